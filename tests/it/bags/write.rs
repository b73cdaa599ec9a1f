//! Recordings of ROS 2 as its recorders write them: messages in CDR, bags in MCAP and in SQLite.

use mcap::{Compression, WriteOptions, records::MessageHeader};
use std::collections::BTreeMap;
use std::io::Cursor;

/// Topic, type, time of receipt in ns, content.
pub type Message = (&'static str, &'static str, i64, Vec<u8>);

pub const JOINTS: &str = "sensor_msgs/msg/JointState";
pub const POINT: &str = "geometry_msgs/msg/PointStamped";
pub const FRAMES: &str = "tf2_msgs/msg/TFMessage";

/// A message in CDR, little endian unless it is big.
pub struct Cdr {
    bytes: Vec<u8>,
    is_big: bool,
}

impl Cdr {
    pub fn new(is_big: bool) -> Self {
        Self {
            bytes: vec![0, u8::from(!is_big), 0, 0],
            is_big,
        }
    }
    fn put<const N: usize>(mut self, mut little: [u8; N]) -> Self {
        self.bytes
            .resize(4 + (self.bytes.len() - 4).next_multiple_of(N), 0);
        if self.is_big {
            little.reverse();
        }
        self.bytes.extend(little);
        self
    }
    pub fn count(self, number: usize) -> Self {
        self.put((number as u32).to_le_bytes())
    }
    pub fn stamp(self, ns: i64) -> Self {
        self.put(((ns / 1_000_000_000) as i32).to_le_bytes())
            .put(((ns % 1_000_000_000) as u32).to_le_bytes())
    }
    pub fn text(self, text: &str) -> Self {
        let mut ours = self.count(text.len() + 1);
        ours.bytes.extend(text.as_bytes());
        ours.bytes.push(0);
        ours
    }
    pub fn numbers(self, numbers: &[f64]) -> Self {
        numbers
            .iter()
            .fold(self, |ours, number| ours.put(number.to_le_bytes()))
    }
    pub fn list(self, numbers: &[f64]) -> Self {
        self.count(numbers.len()).numbers(numbers)
    }
    pub fn done(self) -> Vec<u8> {
        self.bytes
    }
}

pub fn joint_state(
    is_big: bool,
    ns: i64,
    names: &[&str],
    [position, velocity, effort]: [&[f64]; 3],
) -> Vec<u8> {
    let head = Cdr::new(is_big)
        .stamp(ns)
        .text("base_link")
        .count(names.len());
    let named = names.iter().fold(head, |ours, name| ours.text(name));
    named.list(position).list(velocity).list(effort).done()
}

pub fn point(is_big: bool, ns: i64, point: [f64; 3]) -> Vec<u8> {
    Cdr::new(is_big)
        .stamp(ns)
        .text("tracker")
        .numbers(&point)
        .done()
}

pub fn frames(ns: i64, all: &[(&str, &str, [f64; 7])]) -> Vec<u8> {
    let head = Cdr::new(false).count(all.len());
    all.iter()
        .fold(head, |ours, (parent, child, pose)| {
            ours.stamp(ns).text(parent).text(child).numbers(pose)
        })
        .done()
}

/// A bag in MCAP; without compression also without chunks and index.
pub fn mcap(compression: Option<Compression>, messages: &[Message]) -> Vec<u8> {
    mcap_in("cdr", compression, messages)
}

/// The same of messages in another encoding.
pub fn mcap_in(encoding: &str, compression: Option<Compression>, messages: &[Message]) -> Vec<u8> {
    let options = WriteOptions::new()
        .compression(compression)
        .use_chunks(compression.is_some())
        .chunk_size(Some(4096));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let mut channels = BTreeMap::new();
    for (topic, kind, received, data) in messages {
        let channel = *channels.entry(*topic).or_insert_with(|| {
            let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
            writer
                .add_channel(schema, topic, encoding, &BTreeMap::new())
                .unwrap()
        });
        let header = MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: *received as u64,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A bag in SQLite, as the storage plugin of rosbag2 lays it out.
pub fn db3(messages: &[Message]) -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().unwrap();
    let mut base = rusqlite::Connection::open(file.path()).unwrap();
    base.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,\
         offered_qos_profiles TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
    )
    .unwrap();
    let mut topics = BTreeMap::new();
    let all = base.transaction().unwrap();
    for (topic, kind, received, data) in messages {
        let id = *topics.entry(*topic).or_insert_with(|| {
            all.execute(
                "INSERT INTO topics(name,type,serialization_format,offered_qos_profiles) VALUES (?1,?2,'cdr','')",
                (topic, kind),
            )
            .unwrap();
            all.last_insert_rowid()
        });
        all.execute(
            "INSERT INTO messages(topic_id,timestamp,data) VALUES (?1,?2,?3)",
            (id, received, data),
        )
        .unwrap();
    }
    all.commit().unwrap();
    drop(base);
    std::fs::read(file.path()).unwrap()
}

//! Recordings of ROS 2 (MCAP, SQLite) as the same records that text gives: one topic is a table, a message a row.

mod content;
mod mcap;
mod message;
mod sqlite;

use super::record::{InputSource, Record, RecordFault, RecordReader};
use crate::error::{Error, Result};
pub use content::{BagContent, BagTopic, bag_content};
use content::{no_topic, only_topic};
use message::{FieldValue, KINDS, MessageCells, MessageKind};
use std::collections::VecDeque;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::sync::Arc;

/// Messages that say which columns there are, and bytes of them at most.
const HEAD: usize = 4096;
const HEAD_BYTES: usize = 64 << 20;
/// Names of joints may come and go: so many columns at most.
const WIDEST: usize = 4096;

/// How messages that are read may be encoded.
const ENCODINGS: [&str; 2] = ["cdr", "json"];

/// What is recorded under one name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Topic {
    name: String,
    /// Its type, e.g. `sensor_msgs/msg/JointState`.
    kind: String,
    encoding: String,
}

impl Topic {
    /// What is known of its type, where it is read.
    fn known(&self) -> Option<&'static MessageKind> {
        KINDS
            .iter()
            .find(|kind| ENCODINGS.contains(&self.encoding.as_str()) && kind.name == self.kind)
    }
}

/// One message as it is recorded.
#[derive(Debug, Clone, Default)]
struct Message {
    topic: Arc<Topic>,
    /// When the recorder received it, ns since 1970.
    received: i64,
    data: Vec<u8>,
}

/// The bytes of a bag: of all its parts, one behind the other.
type BagSource = BufReader<Box<dyn InputSource>>;

const BLOCK: usize = 1 << 18;

trait Container: Send {
    /// The next message of a topic of which a name is wanted; false at the end. Fails with what is lost, once.
    fn next(
        &mut self,
        source: &mut BagSource,
        wanted: &dyn Fn(&str) -> bool,
        message: &mut Message,
    ) -> std::result::Result<bool, String>;
    /// What a person should know of how it was recorded.
    fn remark(&self) -> Option<String> {
        None
    }
    fn topics(&self) -> Vec<Arc<Topic>>;
    fn position(&self) -> u64;
}

/// Whether a file that begins so is a bag.
pub fn is_bag(head: &[u8]) -> bool {
    head.starts_with(mcap::MAGIC) || head.starts_with(sqlite::MAGIC)
}

struct Messages {
    source: BagSource,
    container: Option<Box<dyn Container>>,
    bounds: Vec<u64>,
    part: usize,
    topics: Vec<Arc<Topic>>,
    losses: Vec<String>,
}

impl Messages {
    fn open(mut source: Box<dyn InputSource>) -> std::io::Result<Self> {
        let bounds = source.bounds()?;
        Ok(Self {
            source: BufReader::with_capacity(BLOCK, source),
            container: None,
            bounds,
            part: 0,
            topics: Vec::new(),
            losses: Vec::new(),
        })
    }
    fn loss(&self) -> Option<String> {
        (!self.losses.is_empty()).then(|| self.losses.join("; "))
    }
    fn lose(&mut self, what: &str) {
        let several = self.bounds.len() > 2;
        self.losses.push(if several {
            format!("part {}: {what}", self.part)
        } else {
            what.into()
        });
    }
    fn next(&mut self, wanted: &dyn Fn(&str) -> bool, message: &mut Message) -> bool {
        loop {
            if self.container.is_none() && !self.begin() {
                return false;
            }
            let Some(container) = &mut self.container else {
                continue;
            };
            let next = container.next(&mut self.source, wanted, message);
            if let Ok(true) = next {
                return true;
            }
            for topic in container.topics() {
                if !self.topics.contains(&topic) {
                    self.topics.push(topic);
                }
            }
            self.container = None;
            if let Err(lost) = next {
                self.lose(&lost);
            }
        }
    }
    /// Opens the next part; false where there is none.
    fn begin(&mut self) -> bool {
        let Some([start, end]) = self.bounds.get(self.part..self.part + 2) else {
            return false;
        };
        let bounds = [*start, *end];
        self.part += 1;
        match self.opened(bounds) {
            Ok(container) => self.container = Some(container),
            Err(lost) => self.lose(&lost),
        }
        true
    }
    fn opened(&mut self, bounds: [u64; 2]) -> std::result::Result<Box<dyn Container>, String> {
        let mut head = [0; 16];
        let most = (bounds[1] - bounds[0]).min(16) as usize;
        let start = SeekFrom::Start(bounds[0]);
        let mut begin = || {
            self.source.seek(start)?;
            self.source.read_exact(&mut head[..most])?;
            self.source.seek(start)
        };
        begin().map_err(|error| error.to_string())?;
        if head.starts_with(mcap::MAGIC) {
            Ok(Box::new(mcap::McapMessages::new(bounds)))
        } else if head.starts_with(sqlite::MAGIC) {
            let source = self.source.get_mut();
            sqlite::SqliteMessages::open(source, bounds).map(|bag| Box::new(bag) as _)
        } else {
            Err("it is no bag".into())
        }
    }
    fn position(&self) -> u64 {
        let before = self.bounds.get(self.part).or(self.bounds.last());
        match &self.container {
            Some(container) => container.position(),
            None => before.copied().unwrap_or_default(),
        }
    }
}

/// Reads one topic of a bag, message by message.
pub struct BagRows {
    messages: Messages,
    /// The topic, and the frames of it that are wanted.
    topic: String,
    frames: Option<String>,
    kind: &'static MessageKind,
    /// Messages that were read for their columns, and are still to be handed out.
    head: VecDeque<Message>,
    message: Message,
    cells: MessageCells,
    is_named: bool,
    /// Columns that are asked for: whether a row may lack them.
    wanted: Option<Vec<Option<bool>>>,
    rows: u64,
    /// Stamp and number of the last message that is a row.
    last: Option<(i64, u64)>,
    text: zmij::Buffer,
}

impl BagRows {
    /// Opens a topic; without a name the only one whose type is read.
    pub fn open(source: Box<dyn InputSource>, label: &str, topic: Option<&str>) -> Result<Self> {
        let failed = |error: std::io::Error| super::failed(label, &error);
        let (source, topic) = match topic {
            Some(topic) => (source, topic.to_string()),
            None => only_topic(source, label)?,
        };
        let (name, frames) = match topic.split_once(' ') {
            Some((name, frames)) => (name, Some(frames)),
            None => (topic.as_str(), None),
        };
        let mut messages = Messages::open(source).map_err(failed)?;
        let (mut head, mut cells, mut bytes) = (VecDeque::new(), MessageCells::default(), 0);
        for name in ["received", "stamp"] {
            cells.set(name, FieldValue::Absent);
        }
        let (mut message, mut kind) = (Message::default(), None);
        while head.len() < HEAD
            && bytes < HEAD_BYTES
            && messages.next(&|other| other == name, &mut message)
        {
            let found = message.topic.known();
            let found = found.filter(|kind| kind.of_frames == frames.is_some());
            let Some(found) = kind.or(found) else { break };
            kind = Some(found);
            bytes += message.data.len();
            // A message that cannot be read is rejected with its row.
            if message::read(found, frames, &message.data, &mut cells).unwrap_or(true)
                && cells.names.len() <= WIDEST
            {
                head.push_back(message.clone());
            }
        }
        let Some(kind) = kind.filter(|_| !head.is_empty()) else {
            let content = bag_content(messages.source.into_inner(), label)?;
            return Err(Error::data(label, no_topic(&topic, &content)));
        };
        cells.is_closed = true;
        let (topic, frames) = (name.to_string(), frames.map(String::from));
        let text = zmij::Buffer::new();
        Ok(Self {
            messages,
            topic,
            frames,
            kind,
            head,
            message,
            cells,
            is_named: false,
            wanted: None,
            rows: 0,
            last: None,
            text,
        })
    }

    /// Why a message is not used, if so.
    fn fault(&mut self, read: std::result::Result<bool, String>) -> Option<(RecordFault, String)> {
        if let Err(why) = read {
            return Some((RecordFault::Damaged, why));
        }
        let mut needed = self.wanted.iter().flatten().zip(&self.cells.cells);
        let lacks =
            needed.position(|(wanted, cell)| *wanted == Some(true) && *cell == FieldValue::Absent);
        if let Some(column) = lacks {
            let has = match self.cells.joints() {
                names if names.is_empty() => names,
                names => format!("; its joints: {names}"),
            };
            let name = &self.cells.names[column];
            let why = format!("the message has no `{name}`{has}");
            return Some((RecordFault::Foreign, why));
        }
        let Some(FieldValue::Time(stamp)) = self.cells.cells.get(1) else {
            return None;
        };
        let before = self.last.replace((*stamp, self.rows));
        let (_, number) = before.filter(|(before, _)| before == stamp)?;
        self.last = before;
        let why = format!("message {number} has the same stamp, {} s", time(*stamp));
        Some((RecordFault::DoubledStamp, why))
    }
}

/// Nanoseconds as seconds, without rounding.
fn time(ns: i64) -> String {
    let (sign, ns) = (if ns < 0 { "-" } else { "" }, ns.unsigned_abs());
    format!("{sign}{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
}

impl RecordReader for BagRows {
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        record.begin(self.rows);
        if !std::mem::replace(&mut self.is_named, true) {
            for name in &self.cells.names {
                record.push(name.as_bytes());
            }
            return Ok(true);
        }
        let read = loop {
            let is_topic = |name: &str| name == self.topic;
            match self.head.pop_front() {
                Some(message) => self.message = message,
                None if self.messages.next(&is_topic, &mut self.message) => {}
                None => return Ok(false),
            }
            let (frames, data) = (self.frames.as_deref(), &self.message.data);
            match message::read(self.kind, frames, data, &mut self.cells) {
                Ok(false) => {}
                read => break read,
            }
        };
        self.rows += 1;
        record.begin(self.rows);
        self.cells.cells[0] = FieldValue::Time(self.message.received);
        record.fault = self.fault(read);
        for (column, cell) in self.cells.cells.iter().enumerate() {
            let wanted = self.wanted.as_ref();
            match cell {
                _ if wanted.is_some_and(|all| all.get(column).is_none_or(Option::is_none)) => {
                    record.push(b"")
                }
                FieldValue::Number(number) => record.push(self.text.format(*number).as_bytes()),
                FieldValue::Time(ns) => record.push(time(*ns).as_bytes()),
                FieldValue::Text(text) => record.push(text.as_bytes()),
                FieldValue::Absent | FieldValue::Blank => record.push(b""),
            }
        }
        Ok(true)
    }
    fn lines(&self) -> u64 {
        self.rows
    }
    fn bytes(&self) -> u64 {
        self.messages.position()
    }
    fn only(&mut self, columns: &[(usize, bool)]) {
        let mut wanted = vec![None; self.cells.names.len()];
        for (column, needed) in columns {
            if let Some(place) = wanted.get_mut(*column) {
                *place = Some(place.unwrap_or(false) || *needed);
            }
        }
        self.wanted = Some(wanted);
    }
    fn remark(&self) -> Option<String> {
        let container = self.messages.container.as_ref();
        container.and_then(|container| container.remark())
    }
    fn loss(&self) -> Option<String> {
        self.messages.loss()
    }
}

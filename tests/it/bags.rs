//! Recordings of ROS 2 are read as they lie: every container and order of bytes, joints by name, and what is not whole with a reason.

mod write;

use crate::answer::{calib, has, put};
use calib::error::Result;
use calib::raw::{BagRows, InputSource, Record, RecordFault, RecordReader, source};
use calib::table::{Intake, Recording, Rejected, from_file};
use mcap::Compression;
use std::io::Cursor;
use std::path::Path;
use write::{FRAMES, JOINTS, Message, POINT, db3, frames, joint_state, mcap, mcap_in, point};

/// Joints of a UR10 as its driver calls them.
pub const ARM: [&str; 6] = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
];
const SECOND: i64 = 1_000_000_000;
/// In November 2023.
const START: i64 = 1_700_000_000 * SECOND + 123_456_789;

/// Every kind of bag with these messages.
fn every(messages: &[Message]) -> Vec<Vec<u8>> {
    let packed = [None, Some(Compression::Lz4), Some(Compression::Zstd)];
    packed
        .into_iter()
        .map(|compression| mcap(compression, messages))
        .chain([db3(messages)])
        .collect()
}

type Rows = (Vec<String>, Vec<Vec<String>>, Option<String>);

/// Names, rows and what is lost.
fn rows_of(bag: Box<dyn InputSource>, topic: Option<&str>) -> Result<Rows> {
    let (mut reader, mut record, mut rows) = (
        BagRows::open(bag, "run.bag", topic)?,
        Record::default(),
        Vec::new(),
    );
    reader.next(&mut record)?;
    let names = record.cells();
    while reader.next(&mut record)? {
        assert!(record.fault.is_none(), "{:?}", record.fault);
        rows.push(record.cells());
    }
    Ok((names, rows, reader.loss()))
}

fn rows(bag: &[u8], topic: Option<&str>) -> Rows {
    rows_of(Box::new(Cursor::new(bag.to_vec())), topic).unwrap()
}

fn refused(bag: &[u8], topic: Option<&str>) -> String {
    let bag = Box::new(Cursor::new(bag.to_vec()));
    rows_of(bag, topic).unwrap_err().to_string()
}

fn column(names: &[String], name: &str) -> usize {
    names.iter().position(|other| other == name).unwrap()
}

/// The state of an arm's joints of which all stand at `q`, by a clock in s.
fn states_of(q: f64, seconds: i64) -> Vec<u8> {
    let ns = START + seconds * SECOND;
    joint_state(false, ns, &ARM, [&[q; 6], &[], &[]])
}

/// A point that was seen at a time, ns.
fn seen(is_big: bool, received: i64, ns: i64, k: i64) -> Message {
    let place = [1.0, 0.01 * k as f64, 0.5];
    ("/reflector", POINT, received, point(is_big, ns, place))
}

fn wave(k: usize, joint: usize) -> f64 {
    0.3 * joint as f64 + (0.1 * k as f64 + joint as f64).sin()
}

/// A state every 8 ms of a hand's finger and the arm's joints, which stand in another order each time.
fn states(is_big: bool, count: usize) -> Vec<Message> {
    let state = |k: usize| {
        let order: Vec<usize> = (0..6).map(|j| (j + k) % 6).collect();
        let names: Vec<&str> = std::iter::once("finger_1")
            .chain(order.iter().map(|j| ARM[*j]))
            .collect();
        let of_factor = |factor: f64| {
            std::iter::once(9.0)
                .chain(order.iter().map(|j| factor * wave(k, *j)))
                .collect::<Vec<f64>>()
        };
        let ns = START + 8_000_000 * k as i64;
        (
            "/joint_states",
            JOINTS,
            ns + 1000,
            joint_state(
                is_big,
                ns,
                &names,
                [&of_factor(1.0), &of_factor(2.0), &of_factor(3.0)],
            ),
        )
    };
    (0..count).map(state).collect()
}

#[test]
fn joints_come_by_their_names_from_every_kind_of_bag_and_both_orders_of_bytes() {
    for bag in every(&states(false, 300))
        .into_iter()
        .chain(every(&states(true, 300)))
    {
        let (names, rows, loss) = rows(&bag, None);
        assert_eq!((rows.len(), loss), (300, None));
        let column = |name: &str| column(&names, name);
        for (k, row) in rows.iter().enumerate() {
            for (j, joint) in ARM.iter().enumerate() {
                for (what, factor) in [("position", 1.0), ("velocity", 2.0), ("effort", 3.0)] {
                    let read: f64 = row[column(&format!("{joint}.{what}"))].parse().unwrap();
                    assert_eq!(
                        read.to_bits(),
                        (factor * wave(k, j)).to_bits(),
                        "{joint} {what}"
                    );
                }
            }
            assert_eq!(row[column("finger_1.position")], "9.0");
        }
        assert_eq!(
            [&rows[0][column("stamp")], &rows[0][column("received")]],
            ["1700000000.123456789", "1700000000.123457789"]
        );
    }
}

#[test]
fn transforms_are_read_by_their_frames() {
    let pose = |k: usize| [k as f64, 0.5, -1.25, 0.0, 0.0, 0.6, 0.8];
    let messages: Vec<Message> = (0..9)
        .map(|k| {
            let ns = START + k as i64 * SECOND;
            let other = ("map", "base", pose(77));
            let all = if k % 3 == 0 {
                vec![other]
            } else {
                vec![other, ("base", "tool0", pose(k))]
            };
            ("/tf", FRAMES, ns, frames(ns, &all))
        })
        .collect();
    for bag in every(&messages) {
        let (names, found, _) = rows(&bag, Some("/tf base->tool0"));
        let x = column(&names, "translation.x");
        let read: Vec<&str> = found.iter().map(|row| row[x].as_str()).collect();
        assert_eq!(read, ["1.0", "2.0", "4.0", "5.0", "7.0", "8.0"]);
        let allowed = "`topic: NAME`; allowed: `/tf base->tool0`, `/tf map->base`";
        has(&refused(&bag, None), allowed);
    }
}

#[test]
fn a_topic_that_is_not_there_or_not_read_is_named_with_those_that_are() {
    let mut messages = states(false, 3);
    messages.push((
        "/plan",
        "trajectory_msgs/msg/JointTrajectory",
        START,
        vec![0, 1, 0, 0],
    ));
    for bag in every(&messages) {
        let absent = "no messages of a topic `/joint_state`; allowed: `/joint_states`; of other types: `/plan`";
        has(&refused(&bag, Some("/joint_state")), absent);
        let foreign =
            "holds trajectory_msgs/msg/JointTrajectory, which is not read; allowed: sensor_msgs";
        has(&refused(&bag, Some("/plan")), foreign);
    }
    let none = "has no topic that is read; none of its topics is read";
    has(&refused(&db3(&messages[3..]), None), none);
}

#[test]
fn a_bag_that_is_cut_gives_its_beginning_and_says_that_the_rest_is_lost() {
    let whole = states(false, 400);
    for bag in every(&whole) {
        let (_, all, _) = rows(&bag, None);
        let mut before = 0;
        for k in 1..=20 {
            let cut = bag[..bag.len() * k / 21].to_vec();
            let Ok((_, found, loss)) = rows_of(Box::new(Cursor::new(cut)), None) else {
                assert!(k < 5, "nothing is read of {k} parts of 21");
                continue;
            };
            assert!(
                found.len() >= before && found[..] == all[..found.len()],
                "{k}"
            );
            assert!(
                found.len() * 21 + 21 * 40 >= all.len() * (k - 1),
                "{k}: {} of {}",
                found.len(),
                all.len()
            );
            let loss = loss.unwrap();
            has(&loss, ["lost", "cut"]);
            before = found.len();
        }
    }
}

#[test]
fn damaged_bytes_never_break_the_reading() {
    let mut draw = 12345u64;
    for bag in every(&states(false, 60)) {
        for _ in 0..150 {
            let mut bytes = bag.clone();
            for _ in 0..3 {
                draw = draw
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                let at = (draw >> 33) as usize % bytes.len();
                bytes[at] = (draw >> 20) as u8;
            }
            let Ok(mut reader) = BagRows::open(Box::new(Cursor::new(bytes)), "run.bag", None)
            else {
                continue;
            };
            let mut record = Record::default();
            while reader.next(&mut record).unwrap() {}
            assert!(reader.lines() <= 400, "{}", reader.lines());
        }
    }
}

/// The type of a message's topic in the head of its row: a number that SQLite keeps for later.
#[test]
fn a_message_that_cannot_be_read_is_a_loss_of_its_bag() {
    let bag = db3(&states(false, 40));
    // Its length, then the types of number, topic, time. Pages that were split hold old copies of rows, too.
    let head = [0x06, 0x00, 0x09, 0x06];
    let found = (0..bag.len() - 4)
        .filter(|at| bag[*at..at + 4] == head)
        .filter_map(|at| {
            let mut damaged = bag.clone();
            damaged[at + 2] = 0x0a;
            let (_, rows, loss) = rows(&damaged, Some("/joint_states"));
            (rows.len() < 40).then_some((rows.len(), loss))
        });
    let found: Vec<_> = found.collect();
    let lost =
        || Some("it is damaged: 1 of its messages cannot be read, which are lost".to_string());
    assert_eq!(found, vec![(39, lost()); 40], "each of the rows");
}

#[test]
fn a_folder_of_parts_is_one_recording_in_the_order_of_their_numbers() {
    let all = states(false, 120);
    for kind in ["mcap", "db3"] {
        let folder = tempfile::tempdir().unwrap();
        for (part, messages) in all.chunks(10).enumerate() {
            let bag = if kind == "mcap" {
                mcap(Some(Compression::Zstd), messages)
            } else {
                db3(messages)
            };
            // One recorder was stopped by force.
            let end = if part == 4 { bag.len() / 2 } else { bag.len() };
            put(folder.path(), format!("run_{part}.{kind}"), &bag[..end]);
        }
        put(
            folder.path(),
            "metadata.yaml",
            "rosbag2_bagfile_information: {}\n",
        );
        let (names, found, loss) = rows_of(source(folder.path()).unwrap(), None).unwrap();
        let x = column(&names, "elbow_joint.position");
        let read: Vec<f64> = found.iter().map(|row| row[x].parse().unwrap()).collect();
        let expected: Vec<f64> = (0..120).map(|k| wave(k, 2)).collect();
        assert!(
            found.len() >= 110 && read[..40] == expected[..40] && read.ends_with(&expected[50..]),
            "{}",
            found.len()
        );
        assert!(loss.is_some_and(|loss| loss.starts_with("part 5: it ")));
    }
}

/// A run of a pipeline in a folder: the rows that were used, those that were not, and the counts.
fn run(here: &Path, pipeline: &str) -> (Recording, Rejected, Intake, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    std::fs::copy(
        root.join("pipelines/ur10/robot.yaml"),
        here.join("robot.yaml"),
    )
    .unwrap();
    let head = "calib: 1\nname: p\nseed: 1\nstages:\n  - uses: robot\n    with: {file: robot.yaml}\n  - uses: ingest\n    with:\n";
    put(here, "p.yaml", format!("{head}{pipeline}"));
    let output = calib(here, "run p.yaml --store s");
    let answer = output.err.clone();
    assert!(output.code == Some(0), "{answer}");
    let at = |name: &str| {
        here.join("s/tables/p")
            .join(format!("ingest.{name}.parquet"))
    };
    let recording = from_file(&at("recording")).unwrap().table;
    (
        recording,
        from_file(&at("rejected")).unwrap().table,
        from_file(&at("intake")).unwrap().table,
        answer,
    )
}

const POSES: &str = "      files:
        - file: run.mcap
          topic: /joint_states
          columns:
            time: {column: stamp, unit: s}
            q: {column: \"{name}.position\", unit: rad}
        - file: run.mcap
          topic: /reflector
          columns:
            time: {column: stamp, unit: s}
            x: {column: point.x, unit: m}
            y: {column: point.y, unit: m}
            z: {column: point.z, unit: m}
      join: {by: time, tolerance_s: 0.001}
      limits: ignore
      max_rejected_fraction: 0.9
";

#[test]
fn each_message_that_is_not_used_has_its_reason() {
    let mut messages: Vec<Message> = (0..20)
        .map(|k| {
            (
                "/joint_states",
                JOINTS,
                START,
                states_of(0.01 * k as f64, k),
            )
        })
        .collect();
    let more = [
        // Another publisher, a gripper.
        joint_state(
            false,
            START + SECOND,
            &["finger_1", "finger_2"],
            [&[0.0, 0.0], &[], &[]],
        ),
        states_of(0.2, 19),
        states_of(f64::NAN, 30),
        joint_state(false, START + 31 * SECOND, &ARM, [&[], &[0.0; 6], &[]]),
        joint_state(false, START + 32 * SECOND, &ARM, [&[0.0; 5], &[], &[]]),
        joint_state(
            false,
            START + 33 * SECOND,
            &["elbow_joint", "elbow_joint"],
            [&[0.0; 2], &[], &[]],
        ),
        states_of(0.0, 34)[..60].to_vec(),
        vec![],
        // A publisher that does not know the time.
        joint_state(false, 0, &ARM, [&[0.3; 6], &[], &[]]),
    ];
    messages.extend(more.map(|data| ("/joint_states", JOINTS, START, data)));
    messages.extend((0..20).map(|k| seen(true, START, START + k * SECOND, k)));
    let folder = tempfile::tempdir().unwrap();
    put(
        folder.path(),
        "run.mcap",
        mcap(Some(Compression::Lz4), &messages),
    );
    let (recording, rejected, intake, _) = run(folder.path(), POSES);
    assert_eq!(recording.rows(), 20);
    let reasons: Vec<(&str, i64)> = rejected
        .0
        .iter()
        .map(|row| (row.reason.as_str(), row.line))
        .collect();
    let expected = [
        ("foreign", 21),
        ("doubled_stamp", 22),
        ("not_a_number", 23),
        ("blank", 24),
        ("damaged", 25),
        ("damaged", 26),
        ("damaged", 27),
        ("damaged", 28),
        ("blank", 29),
    ];
    assert_eq!(reasons, expected);
    let of_k = |k: usize| rejected.0[k].detail.as_str();
    assert_eq!(
        of_k(0),
        "the message has no `shoulder_pan_joint.position`; its joints: finger_1, finger_2"
    );
    assert_eq!(
        of_k(1),
        "message 20 has the same stamp, 1700000019.123456789 s"
    );
    assert_eq!(of_k(4), "`position` has 5 numbers for 6 names");
    for row in &intake.0 {
        assert_eq!(row.accepted + row.rejected, row.read, "{}", row.file);
    }
    assert_eq!(intake.0[0].read, 29);
}

#[test]
fn a_folder_of_parts_is_run_as_one_file_and_a_part_that_changed_is_read_again() {
    let messages: Vec<Message> = (0..40i64)
        .flat_map(|k| {
            let (ns, q) = (
                START + k * SECOND,
                std::array::from_fn::<f64, 6, _>(|j| wave(k as usize, j)),
            );
            let state = joint_state(false, ns, &ARM, [&q, &[], &[]]);
            [("/joint_states", JOINTS, ns, state), seen(false, ns, ns, k)]
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let parts = folder.path().join("run");
    std::fs::create_dir(&parts).unwrap();
    for (part, messages) in messages.chunks(8).enumerate() {
        put(
            &parts,
            format!("run_{part}.mcap"),
            mcap(Some(Compression::Zstd), messages),
        );
    }
    let pipeline = POSES.replace("run.mcap", "run");
    let (recording, _, intake, _) = run(folder.path(), &pipeline);
    assert_eq!((recording.rows(), intake.0[0].read), (40, 40));
    let (.., answer) = run(folder.path(), &pipeline);
    has(&answer, "ingest  cached");
    let last = parts.join("run_9.mcap");
    std::fs::write(&last, &std::fs::read(&last).unwrap()[..300]).unwrap();
    let (recording, .., answer) = run(folder.path(), &pipeline);
    assert!(
        recording.rows() < 40 && answer.contains("part 10: it is cut or damaged before byte"),
        "{answer}"
    );
    // Two kinds of parts are no recording, nor is a folder of anything else.
    put(&parts, "run_3.db3", db3(&messages[..8]));
    let output = calib(folder.path(), "check p.yaml");
    let answer = output.err;
    assert!(
        output.code == Some(2) && answer.contains("all .mcap or all .db3"),
        "{answer}"
    );
}

#[test]
fn two_robots_in_one_topic_are_told_by_their_joints() {
    let of_arm = |arm: &str, k: i64, q: f64| {
        let names: Vec<String> = ARM.iter().map(|joint| format!("{arm}{joint}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let ns = START + k * SECOND / 10;
        let state = joint_state(k % 2 == 0, ns, &names, [&[q; 6], &[], &[]]);
        ("/joint_states", JOINTS, START + k, state)
    };
    let mut messages: Vec<Message> = (0..30)
        .flat_map(|k| [of_arm("left_", k, 0.3), of_arm("", k, 0.01 * k as f64)])
        .collect();
    messages.extend((0..30).map(|k| seen(false, START, START + k * SECOND / 10, k)));
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "run.mcap", mcap(None, &messages));
    let (recording, rejected, intake, _) = run(folder.path(), POSES);
    assert_eq!(
        (recording.rows(), rejected.0.len(), intake.0[0].read),
        (30, 30, 60)
    );
    assert!(
        rejected.0.iter().all(|row| row.reason == "foreign"
            && row.detail.contains("its joints: left_shoulder_pan_joint"))
    );
}

#[test]
fn init_reads_a_bag_and_its_pipeline_runs() {
    let mut messages: Vec<Message> = Vec::new();
    for k in 0..60i64 {
        let (ns, q) = (
            START + k * SECOND / 2,
            std::array::from_fn::<f64, 6, _>(|j| wave(k as usize, j)),
        );
        let state = joint_state(false, ns, &ARM, [&q, &[], &[]]);
        messages.push(("/joint_states", JOINTS, ns, state));
        let seen = [0.8 + 0.01 * k as f64, 0.2 * (k as f64).sin(), 0.5];
        messages.push(("/reflector", POINT, ns, point(false, ns + 1_000_000, seen)));
    }
    messages.push(("/image", "sensor_msgs/msg/Image", START, vec![0, 1, 0, 0]));
    let folder = tempfile::tempdir().unwrap();
    for (name, bag) in [
        ("run.mcap", mcap(Some(Compression::Zstd), &messages)),
        ("run.db3", db3(&messages)),
    ] {
        let here = folder.path().join(name.replace('.', "_"));
        std::fs::create_dir(&here).unwrap();
        put(&here, name, bag);
        let output = calib(&here, &format!("init --robot ur10 --data {name}"));
        let answer = output.out;
        assert!(output.code == Some(0), "{answer}");
        let image = "topic `/image`: sensor_msgs/msg/Image, 1 message; this type is not read";
        let reflector = "topic `/reflector`: geometry_msgs/msg/PointStamped, 60 messages, 2.0000 Hz, longest gap 0.5000 s";
        has(&answer, [image, reflector]);
        let pipeline = std::fs::read_to_string(here.join("pipeline.yaml")).unwrap();
        let lines = [
            "topic: \"/joint_states\"",
            "topic: \"/reflector\"",
            "x: {column: \"point.x\", unit: m}",
            "join: {by: time, tolerance_s: 0.005}",
        ];
        has(&pipeline, lines);
        calib(&here, "run pipeline.yaml --until ingest --store s").code(0);
        let recordings = glob::glob(
            here.join("s/tables/*/ingest.recording.parquet")
                .to_str()
                .unwrap(),
        )
        .unwrap();
        let recordings: Vec<_> = recordings.flatten().collect();
        assert_eq!(
            from_file::<Recording>(&recordings[0]).unwrap().table.rows(),
            60
        );
    }
}

#[test]
fn a_doubled_stamp_is_one_of_the_same_joints() {
    // Two publishers with one clock: the hand's states are no doubles of the arm's.
    let hand = |k: i64| joint_state(false, START + k * SECOND, &["finger_1"], [&[0.0], &[], &[]]);
    let messages: Vec<Message> = (0..4)
        .flat_map(|k| [hand(k), states_of(0.1, k)])
        .map(|data| ("/joint_states", JOINTS, START, data))
        .collect();
    let mut reader = BagRows::open(Box::new(Cursor::new(db3(&messages))), "run.bag", None).unwrap();
    let mut record = Record::default();
    reader.next(&mut record).unwrap();
    let elbow = column(&record.cells(), "elbow_joint.position");
    reader.only(&[(elbow, true)]);
    let mut faults = Vec::new();
    while reader.next(&mut record).unwrap() {
        faults.push(record.fault.as_ref().map(|(fault, _)| *fault));
    }
    assert_eq!(faults, [Some(RecordFault::Foreign), None].repeat(4));
}

#[test]
fn messages_in_json_give_the_rows_that_those_in_cdr_give() {
    let stamp = |k: i64| START + k * SECOND;
    let header = |k: i64, frame: &str| {
        let (sec, nanosec) = (stamp(k) / SECOND, stamp(k) % SECOND);
        format!(
            r#""header": {{"stamp": {{"sec": {sec}, "nanosec": {nanosec}}}, "frame_id": "{frame}"}}"#
        )
    };
    let names = ARM.map(|name| format!("{name:?}")).join(", ");
    let states = |k: i64| {
        let q = [0.1 * k as f64; 6].map(|q| format!("{q:?}")).join(", ");
        format!(
            r#"{{{}, "name": [{names}], "position": [{q}], "velocity": [], "effort": []}}"#,
            header(k, "base_link")
        )
    };
    let place = |k: i64| {
        format!(
            r#"{{{}, "point": {{"x": 1, "y": {:?}, "z": 0.5}}}}"#,
            header(k, "tracker"),
            0.01 * k as f64
        )
    };
    let frame = |k: i64| {
        let turn = r#""rotation": {"x": 0, "y": 0, "z": 0, "w": 1}"#;
        let transform = format!(r#"{{"translation": {{"x": {k}, "y": 2, "z": 3.5}}, {turn}}}"#);
        format!(
            r#" {{"transforms": [{{{}, "child_frame_id": "tool", "transform": {transform}}}]}}"#,
            header(k, "world")
        )
    };
    let (mut json, mut cdr): (Vec<Message>, Vec<Message>) = Default::default();
    for k in 1..4 {
        json.push(("/joint_states", JOINTS, stamp(k), states(k).into_bytes()));
        json.push(("/reflector", POINT, stamp(k), place(k).into_bytes()));
        json.push(("/tf", FRAMES, stamp(k), frame(k).into_bytes()));
        let pose = [k as f64, 2.0, 3.5, 0.0, 0.0, 0.0, 1.0];
        let q = [0.1 * k as f64; 6];
        cdr.push((
            "/joint_states",
            JOINTS,
            stamp(k),
            joint_state(false, stamp(k), &ARM, [&q, &[], &[]]),
        ));
        cdr.push((
            "/reflector",
            POINT,
            stamp(k),
            point(false, stamp(k), [1.0, 0.01 * k as f64, 0.5]),
        ));
        cdr.push((
            "/tf",
            FRAMES,
            stamp(k),
            frames(stamp(k), &[("world", "tool", pose)]),
        ));
    }
    let [json_bag, cdr_bag] = [("json", &json), ("cdr", &cdr)]
        .map(|(encoding, messages)| mcap_in(encoding, Some(Compression::Zstd), messages));
    for topic in ["/joint_states", "/reflector", "/tf world->tool"] {
        assert_eq!(
            rows(&json_bag, Some(topic)),
            rows(&cdr_bag, Some(topic)),
            "{topic}"
        );
    }
    let torn: Vec<Message> = vec![(
        "/reflector",
        POINT,
        START,
        b"{\"point\": {\"x\": 1".to_vec(),
    )];
    let torn = mcap_in("json", None, &torn);
    let bag = Box::new(Cursor::new(torn));
    let mut reader = BagRows::open(bag, "run.bag", Some("/reflector")).unwrap();
    let mut record = Record::default();
    reader.next(&mut record).unwrap();
    assert!(reader.next(&mut record).unwrap());
    let fault = format!("{:?}", record.fault);
    has(&fault, "the message is no whole JSON");
    let other = mcap_in("protobuf", None, &json);
    has(
        &refused(&other, Some("/joint_states")),
        "topic `/joint_states` holds sensor_msgs/msg/JointState encoded as `protobuf`, which is not read; allowed: cdr, json",
    );
}

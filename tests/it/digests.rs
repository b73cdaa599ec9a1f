//! Stored results are those of the code: a stage that gives other tables for equal inputs has another `IMPLEMENTATION` too.
//!
//! Inputs are the tables in `digests/`, made once by the pipelines beside them, so that no stage sees what another one makes today.
//! `digests/digests.txt` holds for each stage its number, a hash of its inputs, and of each table its rows, a hash of its texts, and two
//! sums over its numbers, which hold to 1e-6: processors may differ in the last digits.
//!
//! `CALIB_UPDATE=1 cargo test --test it digests` writes the file anew, except for a stage whose number did not move with its tables.
//! Where a schema has a new major version, run the pipelines in `digests/` and take their tables from the folder `tables` of the store.

use crate::answer::{put, root};
use crate::desk::Desk;
use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type};
use arrow::util::display::{ArrayFormatter, FormatOptions};
use calib::stage::{Arity, ErasedStage, Port, STAGES, StageEntry};
use calib::store::frame::Frame;
use calib::store::read_table;
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};

/// How far the sums of equal tables are apart on two processors, at most.
const TOLERANCE: f64 = 1e-6;
const CONTROLLER: &str = "name,time,q1,q2,q3,q4,q5,q6\nA,0,0,-10,20,5,40,0\nB,10,10,0,-20,15,30,90\nC,20,-40,20,10,0,-30,10\n\
                          D,30,x,20,10,0,-30,10\nE,40,5,5,5,5,5,5\n";
const TRACKER: &str = "name;x;y;z\nA;1834,112;-402,871;1290,455\nC;2034,5;-102,871;990,001\nC;2034,5;-102,871;990,001\nB;0;0;0\nE;1,0;2,0;3,0\n";

/// Whose tables are read by ports that ask for an earlier recording: a motion that ends before the other does.
const EARLIER: &str = "earlier";
/// Each stage with the folder of its tables and its settings.
const TRIALS: &[(&str, &str, &str)] = &[
    ("robot", "points", "{file: robot.yaml}"),
    (
        "ingest",
        "points",
        "files: [{file: controller.csv, columns: {point_id: {column: name}, time: {column: time, unit: s}, \
         q: {column: \"q{j}\", unit: deg}}}, {file: tracker.csv, delimiter: ';', decimal: comma, columns: {point_id: {column: name}, \
         x: {column: x, unit: mm}, y: {column: y, unit: mm}, z: {column: z, unit: mm}}}]\n\
         join: {by: id}\ninstrument: leica_at960\nmax_rejected_fraction: 0.9",
    ),
    (
        "simulate",
        "points",
        "{truth: {offset_deg: [0, 0.01, 0.05, 0.1, -0.1, 0]}, tracker: {position_mm: [4500, -1800, 900]}, \
         poses: {range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]]}, \
         effects: [{backlash: {joint: 1, gap_arcsec: 25}}], blocks: [{usage: fit, points: 20}]}",
    ),
    ("split", "points", "{by: every, n: 4}"),
    (
        "identify",
        "points",
        "{on: [fit, loaded], effects: [base_frame, tool_offset, joint_offset, joint_compliance]}",
    ),
    (
        "stiffness",
        "points",
        "{on: [loaded], load: current, joints: [2, 3]}",
    ),
    ("transfer", "points", "{on: [validate]}"),
    ("diagnose", "points", "{on: [fit]}"),
    (
        "cell_evidence",
        "points",
        "{diagnose: {on: [fit]}, given: [{cell: \"joint_compliance@joint 2\", size: 0.1}]}",
    ),
    ("ingest_torques", "torques", ""),
    ("diagnose_torques", "torques", "{}"),
    (
        "torque_evidence",
        "torques",
        "{diagnose: {}, given: [{cell: \"viscous_friction@joint 2\", size: 1}]}",
    ),
    (
        "diagnose_drives",
        "drives",
        "{robot: robot.xml, drives: drives.json, recording: drives.csv}",
    ),
    ("masses", "torques", "{}"),
    ("compare_torques", "torques", "{}"),
    ("report_torques", "torques", "{}"),
    ("report_drives", "drives", "{}"),
    (
        "compare",
        "points",
        "{previous_parameters: parameters.parquet, previous_recording: recording.parquet}",
    ),
    (
        "learn",
        "points",
        "{rivals: [ridge, mlp], starts: [bso], generations: 10, iterations: 20, folds: 2}",
    ),
    ("optimise", "points", "{seeds: 2, evaluations: 1000}"),
    ("validate", "points", "{}"),
    ("report", "points", "{}"),
];

fn folder() -> PathBuf {
    root("tests/it/digests")
}
fn short(hasher: &blake3::Hasher) -> String {
    hasher.finalize().to_hex()[..16].to_string()
}

/// Of one table: what moves when it does.
struct TableDigest {
    rows: usize,
    words: String,
    sums: [f64; 2],
}

impl TableDigest {
    fn of(frames: &[Frame]) -> Self {
        let (mut words, mut sums) = (blake3::Hasher::new(), [0.0; 2]);
        for frame in frames {
            for (at, (column, name)) in frame
                .batch()
                .columns()
                .iter()
                .zip(frame.column_names())
                .enumerate()
            {
                words.update(name.as_bytes());
                if column.data_type() != &DataType::Float64 {
                    let cells = ArrayFormatter::try_new(column, &FormatOptions::default()).unwrap();
                    for row in 0..frame.rows() {
                        words.update(format!("{}\0", cells.value(row)).as_bytes());
                    }
                    continue;
                }
                let (mut size, mut weighted) = (1e-9, 0.0);
                for (row, value) in column.as_primitive::<Float64Type>().iter().enumerate() {
                    words.update(&[u8::from(value.is_some())]);
                    size += value.unwrap_or(0.0).abs();
                    weighted += value.unwrap_or(0.0) * (1.0 + (0.618_034 * row as f64).fract());
                }
                let weight = 1.0 + (0.754_878 * at as f64).fract();
                sums = [
                    sums[0] + weight * size.ln(),
                    sums[1] + weight * weighted / size,
                ];
            }
        }
        Self {
            rows: frames.iter().map(Frame::rows).sum(),
            words: short(&words),
            sums,
        }
    }
    fn is(&self, other: &Self) -> bool {
        let near = self
            .sums
            .iter()
            .zip(other.sums)
            .all(|(a, b)| (a - b).abs() < TOLERANCE);
        (self.rows, &self.words, near) == (other.rows, &other.words, true)
    }
}

/// Of one stage.
struct StageDigest {
    implementation: u32,
    inputs: String,
    tables: BTreeMap<String, TableDigest>,
}

impl StageDigest {
    /// Tables that are others than before.
    fn moved<'a>(&'a self, before: &'a Self) -> Vec<&'a str> {
        let names = self.tables.keys().chain(
            before
                .tables
                .keys()
                .filter(|name| !self.tables.contains_key(*name)),
        );
        let same = |name: &String| {
            self.tables
                .get(name)
                .zip(before.tables.get(name))
                .is_some_and(|(a, b)| a.is(b))
        };
        names
            .filter(|name| !same(name))
            .map(String::as_str)
            .collect()
    }
}

impl Display for StageDigest {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} {}", self.implementation, self.inputs)?;
        self.tables.iter().try_for_each(
            |(
                name,
                TableDigest {
                    rows,
                    words,
                    sums: [size, weighted],
                },
            )| { writeln!(f, "  {name} {rows} {words} {size:.8} {weighted:.8}") },
        )
    }
}

/// The file: each stage with its number and inputs, each table with rows, texts and sums on a line below it.
fn stored() -> BTreeMap<String, StageDigest> {
    let mut all: BTreeMap<String, StageDigest> = BTreeMap::new();
    let mut last = String::new();
    let text = std::fs::read_to_string(folder().join("digests.txt")).unwrap_or_default();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            [stage, implementation, inputs] => {
                last = stage.to_string();
                let (implementation, inputs) =
                    (implementation.parse().unwrap(), inputs.to_string());
                all.insert(
                    last.clone(),
                    StageDigest {
                        implementation,
                        inputs,
                        tables: BTreeMap::new(),
                    },
                );
            }
            [table, rows, words, size, weighted] => {
                let sums = [size.parse().unwrap(), weighted.parse().unwrap()];
                let digest = TableDigest {
                    rows: rows.parse().unwrap(),
                    words: words.to_string(),
                    sums,
                };
                all.get_mut(&last)
                    .unwrap()
                    .tables
                    .insert(table.to_string(), digest);
            }
            other => panic!("digests.txt: {other:?}"),
        }
    }
    all
}

/// The tables of a folder with the stages that wrote them, in the order of the files' names.
fn tables(folder: &Path) -> Vec<(String, PathBuf, Frame)> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "parquet"));
    paths.sort();
    let stage = |path: &Path| {
        path.file_stem()
            .unwrap()
            .to_str()
            .unwrap()
            .split('.')
            .next()
            .unwrap()
            .to_string()
    };
    let table = |path: PathBuf| {
        (
            stage(&path),
            path.clone(),
            read_table(&path, None).unwrap().table,
        )
    };
    paths.into_iter().map(table).collect()
}

fn parsed(entry: &StageEntry, folder: &Path, settings: &str) -> Box<dyn ErasedStage> {
    let pipeline = std::fs::read_to_string(folder.join("pipeline.yaml")).unwrap();
    let node = match settings {
        "" => calib::yaml::parse(&pipeline)
            .0
            .unwrap()
            .at("stages[1].with")
            .unwrap()
            .clone(),
        settings => calib::yaml::parse(settings).0.unwrap(),
    };
    (entry.parse)(&node).unwrap_or_else(|faults| panic!("{}: {faults:?}", entry.name))
}

/// Runs a stage on the tables of its folder.
fn run(entry: &StageEntry, name: &str, settings: &str) -> StageDigest {
    let (root, folder) = (Path::new(env!("CARGO_MANIFEST_DIR")), folder().join(name));
    let read = |path: PathBuf| std::fs::read(path).unwrap();
    let files = [
        ("robot.yaml", read(root.join("pipelines/sr210d/robot.yaml"))),
        ("controller.csv", CONTROLLER.into()),
        ("tracker.csv", TRACKER.into()),
        (
            "recording.csv",
            read(self::folder().join("torques/recording.csv")),
        ),
        ("robot.xml", read(self::folder().join("drives/robot.xml"))),
        (
            "drives.json",
            read(self::folder().join("drives/drives.json")),
        ),
        (
            "drives.csv",
            read(self::folder().join("drives/recording.csv")),
        ),
        (
            "parameters.parquet",
            read(self::folder().join("points/identify.parameters.parquet")),
        ),
        (
            "recording.parquet",
            read(self::folder().join("points/simulate.recording.parquet")),
        ),
    ];
    let stage = parsed(entry, &folder, settings);
    let mut inputs = blake3::Hasher::new();
    inputs.update(stage.settings().to_string().as_bytes());
    for (_, file) in stage.files() {
        inputs.update(
            &files
                .iter()
                .find(|(name, _)| Path::new(name) == file.0)
                .unwrap()
                .1,
        );
    }
    let desk = files.iter().fold(Desk::default(), |desk, (name, bytes)| {
        desk.with(name, bytes.clone())
    });
    let all = tables(&folder);
    let mut frames = |port: &Port| {
        let is_earlier = |stage: &str| (stage == EARLIER) == port.name.starts_with(EARLIER);
        let mut of_kind: Vec<_> = all
            .iter()
            .filter(|(_, _, frame)| frame.kind() == port.kind)
            .collect();
        if of_kind.iter().any(|(stage, ..)| is_earlier(stage)) {
            of_kind.retain(|(stage, ..)| is_earlier(stage));
        }
        assert!(
            of_kind.len() == 1 || port.arity != Arity::One,
            "{}: {} tables {}",
            entry.name,
            of_kind.len(),
            port.kind
        );
        for (_, path, _) in &of_kind {
            inputs.update(&read(path.clone()));
        }
        of_kind
            .iter()
            .map(|(stage, _, frame)| (stage.clone(), frame.clone()))
            .collect()
    };
    let frames = (entry.reads)().iter().map(&mut frames).collect();
    let written = desk
        .run_any(entry, stage.as_ref(), frames)
        .unwrap_or_else(|error| panic!("{}: {error}", entry.name));
    let tables = written
        .into_iter()
        .map(|(kind, frames)| (kind.to_string(), TableDigest::of(&frames)))
        .collect();
    StageDigest {
        implementation: entry.implementation,
        inputs: short(&inputs),
        tables,
    }
}

#[test]
fn equal_inputs_give_equal_tables_unless_the_implementation_has_another_number() {
    let (mut kept, mut unnumbered, mut stale) = (stored(), Vec::new(), Vec::new());
    for (name, folder, settings) in TRIALS {
        let entry = STAGES.iter().find(|entry| entry.name == *name).unwrap();
        let now = run(entry, folder, settings);
        let before = kept.get(*name);
        let moved: Vec<String> = before.map_or(Vec::new(), |before| {
            now.moved(before).into_iter().map(String::from).collect()
        });
        let same = |before: &StageDigest| {
            (now.implementation, &now.inputs) == (before.implementation, &before.inputs)
        };
        if before.is_some_and(same) && moved.is_empty() {
            continue;
        }
        if before.is_some_and(same) {
            unnumbered.push(format!(
                "{name}: another {} for equal inputs; is its IMPLEMENTATION still {}?",
                moved.join(", "),
                now.implementation
            ));
            continue;
        }
        stale.push(*name);
        kept.insert((*name).into(), now);
    }
    kept.retain(|name, _| STAGES.iter().any(|entry| entry.name == name));
    if std::env::var_os("CALIB_UPDATE").is_some() {
        let head = "# Of each stage its IMPLEMENTATION and its inputs; of each of its tables rows, texts and sums. See ../digests.rs.\n";
        let text: String = kept
            .iter()
            .map(|(name, digest)| format!("{name} {digest}"))
            .collect();
        put(folder(), "digests.txt", format!("{head}{text}"));
        stale.clear();
    }
    assert!(
        unnumbered.is_empty(),
        "bump the numbers, then write digests.txt anew:\n{}",
        unnumbered.join("\n")
    );
    assert!(
        stale.is_empty(),
        "write digests.txt anew with CALIB_UPDATE=1 cargo test --test it digests: {stale:?}"
    );
}

#[test]
fn every_stage_has_a_digest() {
    let (tried, stored) = (TRIALS.iter().map(|trial| trial.0), stored());
    assert_eq!(
        tried.collect::<Vec<_>>(),
        STAGES.iter().map(|entry| entry.name).collect::<Vec<_>>()
    );
    STAGES
        .iter()
        .for_each(|entry| assert!(!stored[entry.name].tables.is_empty(), "{}", entry.name));
}

#[test]
fn a_table_that_differs_in_one_number_has_another_digest() {
    let table = |name: &str| {
        read_table(&folder().join("points").join(name), None)
            .unwrap()
            .table
    };
    let (before, other) = (
        table("identify.prediction.parquet"),
        table("identify.parameters.parquet"),
    );
    let digest = |frame: &Frame| TableDigest::of(std::slice::from_ref(frame));
    assert!(digest(&before).is(&digest(&before)) && !digest(&before).is(&digest(&other)));
    let mut rows = <calib::table::Prediction as calib::table::Table>::from_frame(&before).unwrap();
    rows.0[17].error_mm += 1e-2;
    let changed = calib::table::Table::to_frame(&rows).unwrap();
    let moved = |frame: &Frame| StageDigest {
        implementation: 1,
        inputs: String::new(),
        tables: [("t".into(), digest(frame))].into(),
    };
    assert_eq!(moved(&changed).moved(&moved(&before)), ["t"]);
}

//! First reading of a file: which rows are usable, and what is needed to find duplicates and partners.
//!
//! Memory: 32 bytes a row where ids are mapped and as a rule (`ids`), 16 where files are joined by time, 1 where they are joined at all; the second
//! file of a join is held with its numbers. Where the arm moves, 16 bytes a joint and row for its velocities.

use super::Ingest;
use super::arm::RobotJoints;
use super::external;
use super::fingerprint::{Fingerprints, behind};
use super::ids::{FileIds, narrow};
use super::layout::{FileLayout, Join};
use super::motion::{JointSamples, Track};
use super::reading::{OpenedFile, ProgressCounter};
use super::recorded::RecordedRow;
use super::refusal::{Reason, RowRefusal};
use crate::error::{Error, Result};
use crate::stage::Context;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// How many rows were refused for a reason, and the first of them.
#[derive(Debug, Clone)]
pub(super) struct RefusalCount {
    pub rows: u64,
    pub first_line: u64,
    pub first_detail: String,
}

pub(super) type RefusalCounts = BTreeMap<Reason, RefusalCount>;

/// Counts one refusal.
pub(super) fn tally(counts: &mut RefusalCounts, line: u64, refusal: &RowRefusal) {
    let new = || RefusalCount { rows: 0, first_line: line, first_detail: refusal.detail.clone() };
    counts.entry(refusal.reason).or_insert_with(new).rows += 1;
}

/// Rows that say something odd about the whole file, with the first of them.
#[derive(Debug, Clone, Default)]
pub(super) struct FileOddities {
    pub rows: u64,
    pub first: Option<(u64, usize, f64)>,
}

impl FileOddities {
    fn count(&mut self, line: u64, joint: usize, value: f64) {
        self.rows += 1;
        self.first.get_or_insert((line, joint, value));
    }
}

/// The numbers and texts of the second file of a join, by data row.
#[derive(Default)]
pub(super) struct PackedRows {
    pub slots: Vec<usize>,
    pub values: Vec<f64>,
    pub ids: Vec<String>,
    /// By [`Slots::texts`](super::slots::Slots::texts); none of those that the file does not have.
    pub texts: Vec<Option<Vec<String>>>,
    /// The points of wide rows, of so many targets each.
    pub points: Vec<[f64; 3]>,
    pub targets: usize,
}

impl PackedRows {
    /// No rows of an opened file.
    fn of(reading: &OpenedFile, layout: &FileLayout, arm: &RobotJoints) -> Self {
        Self {
            slots: reading.rows.binding().slots(),
            texts: arm.slots.texts().iter().map(|name| layout.columns.has(name).then(Vec::new)).collect(),
            targets: reading.rows.binding().points.len(),
            ..Self::default()
        }
    }
    fn push(&mut self, row: &RecordedRow, named: bool) {
        self.values.extend(self.slots.iter().map(|slot| row.values.get(*slot).copied().unwrap_or(f64::NAN)));
        self.points.extend((0..self.targets).map(|k| row.points.get(k).copied().unwrap_or([f64::NAN; 3])));
        if named {
            self.ids.push(row.id.clone());
        }
        for (into, text) in self.texts.iter_mut().zip(&row.texts) {
            into.iter_mut().for_each(|texts| texts.push(text.clone()));
        }
    }
}

/// What the first reading found.
pub(super) struct Scan {
    pub label: String,
    pub lines: u64,
    pub read: u64,
    /// The last data row that is not blank all over, as a spreadsheet leaves them at the end.
    pub last: u64,
    pub tally: RefusalCounts,
    pub ids: FileIds,
    /// Time and number of usable rows, for a join by time.
    pub times: Vec<(f64, u32)>,
    /// Usable data rows, for a join.
    pub usable: Vec<bool>,
    pub packed: Option<PackedRows>,
    pub slots: Vec<usize>,
    /// Revolute joints beyond one and a half turns.
    pub turns: FileOddities,
    pub beyond: FileOddities,
    /// Largest angle of a revolute joint, rad.
    pub largest: f64,
    /// Least and largest position of each joint, rad or m.
    pub ranges: Vec<[f64; 2]>,
    /// Where the arm moves: of the file with the joints.
    pub track: Option<Track>,
    /// Hash of what all its usable rows say, of a file with what was measured.
    pub measured: Option<u128>,
    /// Ids of the first usable rows with their data rows, for a join by id.
    pub first_ids: Vec<(u32, String)>,
}

/// Ids that are kept for examples.
const EXAMPLES: usize = 1000;

impl Scan {
    fn new(label: String, slots: Vec<usize>, packed: Option<PackedRows>) -> Self {
        Self {
            label,
            lines: 0,
            read: 0,
            last: 0,
            tally: RefusalCounts::new(),
            ids: FileIds::default(),
            times: Vec::new(),
            usable: Vec::new(),
            packed,
            slots,
            turns: FileOddities::default(),
            beyond: FileOddities::default(),
            largest: 0.0,
            ranges: Vec::new(),
            track: None,
            measured: None,
            first_ids: Vec::new(),
        }
    }
    /// How far a joint turns over the rows at most, rad or m.
    pub(super) fn largest_turn(&self) -> f64 {
        self.ranges.iter().map(|[least, most]| most - least).fold(0.0, f64::max)
    }
    pub(super) fn refused(&self) -> u64 {
        self.tally.values().map(|count| count.rows).sum()
    }
    pub(super) fn used(&self) -> u64 {
        self.read - self.refused()
    }
}

/// A file below its header, with its size in bytes where that is known.
pub(super) struct ScannedFile {
    reading: OpenedFile,
    size: Option<u64>,
}

impl ScannedFile {
    /// What is known before the first row.
    pub(super) fn beginning(&self) -> Scan {
        Scan::new(self.reading.label.clone(), self.reading.rows.binding().slots(), None)
    }
}

/// Opens a file and says what is odd about it.
pub(super) fn open(settings: &Ingest, layout: &FileLayout, arm: &Arc<RobotJoints>, context: &Context) -> Result<ScannedFile> {
    let source = context.services.open(&layout.file)?;
    let size = source.size;
    let reading = OpenedFile::open(source, layout, arm, settings.limits)?;
    external::must_stand(&reading, layout, arm, context)?;
    for remark in reading.remarks() {
        context.services.note(format!("{}: {remark}", reading.label));
    }
    Ok(ScannedFile { reading, size })
}

/// Whoever sees each row with what was judged of it.
pub(super) type RowWatch<'a> = dyn FnMut(&OpenedFile, &Result<(), RowRefusal>) + 'a;

/// Reads file `index` of the settings once.
pub(super) fn scan(
    settings: &Ingest,
    index: usize,
    ScannedFile { mut reading, size }: ScannedFile,
    arm: &RobotJoints,
    context: &Context,
    watch: &mut RowWatch,
) -> Result<Scan> {
    let layout = &settings.files[index];
    let label = reading.label.clone();
    context.services.begin(&format!("reading {label}"), size, "bytes");
    let joined = matches!(settings.join, Some(Join::Id {} | Join::Time { .. } | Join::Order {}));
    let slots = reading.rows.binding().slots();
    let packed = (joined && index > 0).then(|| PackedRows::of(&reading, layout, arm));
    let mut scan = Scan::new(label, slots, packed);
    scan.measured = reading.rows.binding().measures.then_some(0);
    let mut samples = is_track(settings, layout).then(JointSamples::default);
    let keyed = layout.columns.has("point_id") && settings.duplicates != super::layout::Duplicates::Keep;
    let timed = matches!(settings.join, Some(Join::Time { .. }));
    // By id, both rows have the same one.
    let named = layout.columns.has("point_id") && !matches!(settings.join, Some(Join::Id {}));
    reading.rows.fingerprint(Fingerprints { ids: keyed, contents: keyed || scan.measured.is_some() });
    let mut pace = ProgressCounter::new(context);
    while let Some(judged) = reading.next()? {
        let row = &reading.row;
        if let Some((joint, angle)) = row.turned {
            scan.turns.count(row.line, joint, angle);
        }
        match &judged {
            Ok(()) => {
                if keyed && !row.id.is_empty() {
                    scan.ids.push(row, index, &scan.label)?;
                }
                if matches!(settings.join, Some(Join::Id {})) && scan.first_ids.len() < EXAMPLES {
                    scan.first_ids.push((narrow(row.number, &scan.label)?, row.id.clone()));
                }
                if let Some(before) = &mut scan.measured {
                    *before = behind(*before, row.number, row.content);
                }
                if timed {
                    let time = row.values.get(arm.slots.time).copied().unwrap_or(f64::NAN);
                    scan.times.push((time, narrow(row.number, &scan.label)?));
                }
                scan.odd(row, arm);
                if let Some(samples) = &mut samples {
                    sample(samples, row, layout, arm);
                }
            }
            Err(refusal) => tally(&mut scan.tally, row.line, refusal),
        }
        if joined {
            scan.usable.push(judged.is_ok());
        }
        if let Some(packed) = &mut scan.packed {
            packed.push(row, named);
        }
        if !reading.row.is_blank {
            scan.last = row.number;
        }
        watch(&reading, &judged);
        pace.row(reading.rows.bytes());
    }
    context.services.advance(reading.rows.bytes(), "");
    scan.lines = reading.rows.lines();
    scan.read = reading.row.number;
    if scan.read == 0 {
        return Err(Error::data(scan.label, "has a header but no data row; allowed: at least one"));
    }
    if let Some(samples) = samples {
        scan.track = Some(samples.track(settings.motion.as_ref(), scan.read, arm, &scan.label, context)?);
    }
    Ok(scan)
}

/// Whether velocities, or what they change by, follow from this file's joints over time.
fn is_track(settings: &Ingest, layout: &FileLayout) -> bool {
    let timed = layout.columns.number("time").is_some_and(|time| time.column.is_some());
    let moving = settings.motion.is_some() || settings.files.iter().any(|file| file.columns.has("velocity"));
    let asked = settings.motion.is_some() || matches!(settings.join, Some(Join::Time { .. }));
    timed && moving && asked && layout.columns.has("q")
}

fn sample(samples: &mut JointSamples, row: &RecordedRow, layout: &FileLayout, arm: &RobotJoints) {
    let all = |places: &Range<usize>| row.values.get(places.clone()).unwrap_or_default();
    let time = row.values.get(arm.slots.time).copied().unwrap_or(f64::NAN);
    let given = if layout.columns.has("velocity") { all(&arm.slots.velocity) } else { &[] };
    samples.push(row.number, time, all(&arm.slots.q), given);
}

impl Scan {
    fn odd(&mut self, row: &RecordedRow, arm: &RobotJoints) {
        let q = row.values.get(arm.slots.q.clone()).unwrap_or_default();
        for (value, _) in q.iter().zip(&arm.prismatic).filter(|(_, prismatic)| !**prismatic) {
            self.largest = self.largest.max(value.abs());
        }
        self.ranges.resize(q.len(), [f64::INFINITY, f64::NEG_INFINITY]);
        for (value, [least, most]) in q.iter().zip(&mut self.ranges) {
            (*least, *most) = (least.min(*value), most.max(*value));
        }
        if let Some(joint) = row.beyond {
            self.beyond.count(row.line, joint, q.get(joint).copied().unwrap_or(f64::NAN));
        }
    }
}

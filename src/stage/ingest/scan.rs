//! Reading of the files of a measurement: which rows are usable, what is needed to find duplicates and partners, and the rows themselves.
//!
//! Memory: 33 bytes and the id a row where ids are mapped, 16 where files are joined by time, 1 where they are joined at all, 16 a joint where the arm
//! moves; and the rows themselves as far as they may be held (`held`), those that partners are looked for among always.

use super::Ingest;
use super::arm::RobotJoints;
use super::held::{FileIds, HeldRows, RowHasher, RowSource, behind, narrow};
use super::layout::{Duplicates, FileLayout, Join};
use super::motion::{JointSamples, Track};
use super::reading::{OpenedFile, STRIDE};
use super::refusal::{Reason, RowRefusal};
use super::row::RecordedRow;
use crate::error::{Error, Result};
use crate::stage::Context;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// How many rows were refused for a reason, and the first of them.
#[derive(Debug, Clone)]
pub(super) struct RefusalCount {
    pub(crate) rows: u64,
    pub(crate) first_line: u64,
    pub(crate) first_detail: String,
}

pub(super) type RefusalCounts = BTreeMap<Reason, RefusalCount>;

/// Counts one refusal.
pub(super) fn tally(counts: &mut RefusalCounts, line: u64, refusal: &RowRefusal) {
    let new = || RefusalCount {
        rows: 0,
        first_line: line,
        first_detail: refusal.detail.clone(),
    };
    counts.entry(refusal.reason).or_insert_with(new).rows += 1;
}

/// Rows that say something odd about the whole file, with the first of them.
#[derive(Debug, Clone, Default)]
pub(super) struct FileOddities {
    pub(crate) rows: u64,
    pub(crate) first: Option<(u64, usize, f64)>,
}

impl FileOddities {
    fn count(&mut self, line: u64, joint: usize, value: f64) {
        self.rows += 1;
        self.first.get_or_insert((line, joint, value));
    }
}

/// What the reading of a file found.
#[derive(Default)]
pub(super) struct Scan {
    pub(crate) label: String,
    pub(crate) lines: u64,
    pub(crate) read: u64,
    /// The last data row that is not blank all over, as a spreadsheet leaves them at the end.
    pub(crate) last: u64,
    pub(crate) tally: RefusalCounts,
    pub(crate) ids: FileIds,
    /// Time and number of usable rows, for a join by time.
    pub(crate) times: Vec<(f64, u32)>,
    /// Usable data rows, for a join.
    pub(crate) usable: Vec<bool>,
    pub(crate) held: HeldRows,
    pub(crate) slots: Vec<usize>,
    /// Revolute joints beyond one and a half turns.
    pub(crate) turns: FileOddities,
    pub(crate) beyond: FileOddities,
    /// Largest angle of a revolute joint, rad.
    pub(crate) largest: f64,
    /// Least and largest position of each joint, rad or m.
    pub(crate) ranges: Vec<[f64; 2]>,
    /// Where the arm moves: of the file with the joints.
    pub(crate) track: Option<Track>,
    samples: Option<JointSamples>,
    /// Hash of what all its usable rows say, of a file with what was measured.
    pub(crate) measured: Option<u64>,
    /// What could not be read of the file.
    loss: Option<String>,
}

impl Scan {
    fn new(open: &OpenedFile, held: HeldRows) -> Self {
        Self {
            label: open.label.clone(),
            held,
            slots: open.binding().slots(),
            measured: open.binding().measures.then_some(0),
            ..Self::default()
        }
    }
    /// How far a joint turns over the rows at most, rad or m.
    pub(super) fn largest_turn(&self) -> f64 {
        self.ranges
            .iter()
            .map(|[least, most]| most - least)
            .fold(0.0, f64::max)
    }
    pub(super) fn refused(&self) -> u64 {
        self.tally.values().map(|count| count.rows).sum()
    }
    pub(super) fn used(&self) -> u64 {
        self.read - self.refused()
    }
}

/// Reads the files of a measurement once, in parallel; each may hold rows of so many bytes in all.
pub(super) fn files(
    settings: &Ingest,
    arm: &RobotJoints,
    most: usize,
    context: &Context,
) -> Result<Vec<Scan>> {
    let (mut opened, mut sizes) = (Vec::new(), Vec::new());
    for layout in &settings.files {
        let source = context.services.open(&layout.file)?;
        sizes.push(source.size);
        let open = OpenedFile::open(source, layout, arm, settings.limits)?;
        open.remarks()
            .iter()
            .for_each(|remark| context.note(format!("{}: {remark}", open.label)));
        opened.push(open);
    }
    let labels: Vec<&str> = opened.iter().map(|open| open.label.as_str()).collect();
    let what = format!("reading {}", labels.join(", "));
    context
        .services
        .begin(&what, sizes.into_iter().sum(), "bytes");
    let done = AtomicU64::new(0);
    let advance = |more: u64| {
        let all = done.fetch_add(more, Ordering::Relaxed) + more;
        context.services.advance(all, "");
    };
    let scans: Vec<Result<Scan>> = opened
        .into_par_iter()
        .enumerate()
        .map(|(index, open)| file(settings, index, open, (arm, most), &advance))
        .collect();
    // Of several faults that of the first file.
    let mut scans = scans.into_iter().collect::<Result<Vec<_>>>()?;
    for scan in &mut scans {
        context.warn_each(scan.loss.take());
        let track = |samples: JointSamples| {
            samples.track(
                settings.motion.as_ref(),
                scan.read,
                arm,
                &scan.label,
                context,
            )
        };
        scan.track = scan.samples.take().map(track).transpose()?;
    }
    Ok(scans)
}

/// Reads file `index` of the settings.
fn file(
    settings: &Ingest,
    index: usize,
    mut open: OpenedFile,
    (arm, most): (&RobotJoints, usize),
    advance: &dyn Fn(u64),
) -> Result<Scan> {
    let layout = &settings.files[index];
    let joined = matches!(
        settings.join,
        Some(Join::Id {} | Join::Time { .. } | Join::Order {})
    );
    let held = HeldRows::new(
        open.binding(),
        joined && index > 0,
        most / settings.files.len(),
    );
    let mut scan = Scan::new(&open, held);
    scan.samples = is_track(settings, layout).then(JointSamples::default);
    let keyed = layout.columns.has("point_id") && settings.duplicates != Duplicates::Keep;
    let by_time = matches!(settings.join, Some(Join::Time { .. }));
    let (mut hasher, mut reported) = (RowHasher::default(), 0);
    let mut tell =
        |bytes: u64| advance(bytes.saturating_sub(std::mem::replace(&mut reported, bytes)));
    while let Some(judged) = open.next()? {
        let row = &open.row;
        if let Some((joint, angle)) = row.turned {
            scan.turns.count(row.line, joint, angle);
        }
        match &judged {
            Ok(()) => {
                let hashed = keyed || scan.measured.is_some();
                let content = if hashed {
                    hasher.of(row, &open.binding().filled)
                } else {
                    0
                };
                if keyed && !row.id.is_empty() {
                    scan.ids.push(row, content, &scan.label)?;
                }
                if let Some(before) = &mut scan.measured {
                    *before = behind(*before, row.number, content);
                }
                if by_time {
                    let time = row.values.get(arm.slots.time).copied().unwrap_or(f64::NAN);
                    scan.times.push((time, narrow(row.number, &scan.label)?));
                }
                scan.odd(row, arm);
                if let Some(samples) = &mut scan.samples {
                    sample(samples, row, layout, arm);
                }
            }
            Err(refusal) => tally(&mut scan.tally, row.line, refusal),
        }
        if joined {
            scan.usable.push(judged.is_ok());
        }
        if !row.is_blank {
            scan.last = row.number;
        }
        scan.held.push(&open, &judged);
        if open.row.number.is_multiple_of(STRIDE) {
            tell(open.bytes());
        }
    }
    tell(open.bytes());
    open.external.must_stand(&open.label, arm.joints())?;
    (scan.lines, scan.read, scan.loss) = (open.lines(), open.row.number, open.loss());
    if scan.read == 0 {
        return Err(Error::data(
            scan.label,
            "has a header but no data row; allowed: at least one",
        ));
    }
    Ok(scan)
}

/// The rows of a file once more.
pub(super) fn rows<'a>(
    scan: &'a Scan,
    (settings, layout): (&Ingest, &FileLayout),
    arm: &'a RobotJoints,
    context: &Context,
) -> Result<RowSource<'a>> {
    if let Some(held) = scan.held.rows(RecordedRow::empty(arm)) {
        return Ok(RowSource::Held(held));
    }
    let source = context.services.open(&layout.file)?;
    Ok(RowSource::File(Box::new(OpenedFile::open(
        source,
        layout,
        arm,
        settings.limits,
    )?)))
}

/// Whether velocities, or what they change by, follow from this file's joints over time.
fn is_track(settings: &Ingest, layout: &FileLayout) -> bool {
    let timed = layout
        .columns
        .number("time")
        .is_some_and(|time| time.column.is_some());
    let moving = settings.motion.is_some()
        || settings
            .files
            .iter()
            .any(|file| file.columns.has("velocity"));
    let asked = settings.motion.is_some() || matches!(settings.join, Some(Join::Time { .. }));
    timed && moving && asked && layout.columns.has("q")
}

fn sample(samples: &mut JointSamples, row: &RecordedRow, layout: &FileLayout, arm: &RobotJoints) {
    let all = |places: &Range<usize>| row.values.get(places.clone()).unwrap_or_default();
    let time = row.values.get(arm.slots.time).copied().unwrap_or(f64::NAN);
    let given = if layout.columns.has("velocity") {
        all(&arm.slots.velocity)
    } else {
        &[]
    };
    samples.push(row.number, time, all(&arm.slots.q), given);
}

impl Scan {
    fn odd(&mut self, row: &RecordedRow, arm: &RobotJoints) {
        let q = row.values.get(arm.slots.q.clone()).unwrap_or_default();
        for (value, _) in q
            .iter()
            .zip(&arm.prismatic)
            .filter(|(_, prismatic)| !**prismatic)
        {
            self.largest = self.largest.max(value.abs());
        }
        self.ranges
            .resize(q.len(), [f64::INFINITY, f64::NEG_INFINITY]);
        for (value, [least, most]) in q.iter().zip(&mut self.ranges) {
            (*least, *most) = (least.min(*value), most.max(*value));
        }
        if let Some(joint) = row.beyond {
            self.beyond
                .count(row.line, joint, q.get(joint).copied().unwrap_or(f64::NAN));
        }
    }
}

//! The rows of the files of a measurement, each read once: what every row holds, in columns, and why some are not used.

use super::Ingest;
use super::arm::{RobotJoints, Slots};
use super::columns::{Duplicates, FileLayout, LimitPolicy};
use super::motion::{JointSamples, Track};
use super::reading::{OpenedFile, STRIDE};
use super::refusal::{Refusals, beginning};
use super::row::RecordedRow;
use super::turns::{TurnCounter, within_limits};
use crate::Context;
use crate::error::{Error, Result, counted};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// The fault of a file without rows.
pub(super) const NO_ROW: &str = "has a header but no data row; allowed: at least one";

/// Texts one behind the other.
#[derive(Default)]
struct Texts {
    text: String,
    ends: Vec<usize>,
}

impl Texts {
    fn push(&mut self, text: &str) {
        self.text.push_str(text);
        self.ends.push(self.text.len());
    }
    fn get(&self, at: usize) -> &str {
        let start = at.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.text[start..self.ends[at]]
    }
}

/// Rows that say something odd about the whole file, with the first of them: its line, a joint and its position.
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

/// Why a row that can be used is not used after all; files and rows from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GivenUp {
    /// A row of a file has the same id; `copied`: it has the same values too, and is used.
    Duplicate {
        file: usize,
        row: usize,
        copied: bool,
    },
    /// It has no partner in this file; where it is of another than the first, none in the first that has all others.
    Unmatched { file: usize },
}

/// The rows of a file, counted from 0.
#[derive(Default)]
pub(super) struct FileRows {
    pub label: String,
    pub lines: u64,
    /// Rows up to the last that is not blank all over, as a spreadsheet leaves them at the end.
    pub filled: u64,
    /// Places of a row's numbers that the file fills, ascending; those of them that it has columns or values for.
    places: Vec<usize>,
    pub slots: Vec<usize>,
    values: Vec<f64>,
    /// The points of wide rows, of so many targets each.
    points: Vec<[f64; 3]>,
    targets: usize,
    ids: Texts,
    /// Places of a row's texts that the file has, ascending, and the texts of each.
    texts: Vec<(usize, Texts)>,
    line: Vec<u64>,
    /// None where the file does not say it.
    sequence: Vec<Option<i64>>,
    /// How rows that may be refused begin.
    begin: Texts,
    /// Rows that cannot be used, and those that other rows are a reason not to use.
    pub refused: Refusals,
    pub given_up: BTreeMap<usize, GivenUp>,
    /// Revolute joints beyond one and a half turns.
    pub turns: FileOddities,
    pub beyond: FileOddities,
    /// Largest angle of a revolute joint, rad.
    pub largest: f64,
    /// Least and largest position of each joint, rad or m.
    ranges: Vec<[f64; 2]>,
    /// Where the arm moves: of the file with the joints.
    pub track: Option<Track>,
    /// Whether the file holds what was measured.
    measures: bool,
    /// What could not be read of the file.
    loss: Option<String>,
}

impl FileRows {
    pub(super) fn count(&self) -> usize {
        self.line.len()
    }
    /// Rows that can be used.
    pub(super) fn usable(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count()).filter(|at| !self.refused.contains_key(at))
    }
    pub(super) fn is_used(&self, at: usize) -> bool {
        at < self.count() && !self.refused.contains_key(&at) && !self.given_up.contains_key(&at)
    }
    pub(super) fn count_usable(&self) -> u64 {
        (self.count() - self.refused.len()) as u64
    }
    /// Rows that become part of the recording.
    pub(super) fn count_used(&self) -> u64 {
        self.count_usable() - self.given_up.len() as u64
    }
    pub(super) fn line(&self, at: usize) -> u64 {
        self.line[at]
    }
    pub(super) fn id(&self, at: usize) -> &str {
        self.ids.get(at)
    }
    pub(super) fn sequence(&self, at: usize) -> Option<i64> {
        self.sequence.get(at).copied().flatten()
    }
    /// How a row begins in the file, where it may be refused.
    pub(super) fn begin(&self, at: usize) -> &str {
        self.begin.get(at)
    }
    fn values(&self, at: usize) -> &[f64] {
        let width = self.places.len();
        &self.values[at * width..(at + 1) * width]
    }
    /// A number of a row; NaN where the file has none in this place.
    pub(super) fn value(&self, at: usize, place: usize) -> f64 {
        let found = self.places.binary_search(&place);
        found.map_or(f64::NAN, |column| self.values(at)[column])
    }
    /// Numbers of a row into those that are not known.
    pub(super) fn fill(&self, at: usize, numbers: &mut [f64]) {
        for (place, value) in self.places.iter().zip(self.values(at)) {
            if numbers[*place].is_nan() {
                numbers[*place] = *value;
            }
        }
    }
    /// The text of a row in this place; none where the file has none.
    pub(super) fn text(&self, at: usize, place: usize) -> Option<&str> {
        let mut found = self.texts.iter().filter(|(other, _)| *other == place);
        found.next().map(|(_, texts)| texts.get(at))
    }
    /// The points of a wide row, in the order of its targets.
    pub(super) fn points(&self, at: usize) -> &[[f64; 3]] {
        &self.points[at * self.targets..(at + 1) * self.targets]
    }
    /// Whether a row says what a row of another file does, but for its place in the recording.
    pub(super) fn says_same(&self, at: usize, other: &Self, of_other: usize) -> bool {
        let bits = |points: &[[f64; 3]]| {
            let numbers = points.as_flattened().iter();
            numbers.map(|number| number.to_bits()).collect::<Vec<u64>>()
        };
        self.numbers(at).eq(other.numbers(of_other))
            && bits(self.points(at)) == bits(other.points(of_other))
            && self.all_texts(at).eq(other.all_texts(of_other))
    }
    fn numbers(&self, at: usize) -> impl Iterator<Item = (usize, u64)> {
        let numbers = self.places.iter().zip(self.values(at));
        let known = numbers.filter(|(_, number)| !number.is_nan());
        known.map(|(place, number)| (*place, number.to_bits()))
    }
    fn all_texts(&self, at: usize) -> impl Iterator<Item = (usize, &str)> {
        let texts = self.texts.iter();
        let texts = texts.map(move |(place, texts)| (*place, texts.get(at)));
        texts.filter(|(_, text)| !text.is_empty())
    }
    /// Whether both files hold the same measured rows.
    pub(super) fn measured_same(&self, other: &Self) -> bool {
        self.measures
            && other.measures
            && self.count_usable() == other.count_usable()
            && (self.usable().zip(other.usable()))
                .all(|(here, there)| here == there && self.says_same(here, other, there))
    }
    /// When the usable rows were recorded, and where the joints were then.
    fn samples(&self, slots: &Slots, gives_velocity: bool) -> JointSamples {
        let mut samples = JointSamples::default();
        for row in self.usable() {
            let all =
                |places: &Range<usize>| places.clone().map(move |place| self.value(row, place));
            let time = self.value(row, slots.time);
            if time.is_finite() {
                samples.rows.push(row);
                samples.time.push(time);
                samples.q.extend(all(&slots.q));
                if gives_velocity {
                    samples.given.extend(all(&slots.velocity));
                }
            }
        }
        samples
    }
    /// How far a joint turns over the rows at most, rad or m.
    pub(super) fn largest_turn(&self) -> f64 {
        let turns = self.ranges.iter().map(|[least, most]| most - least);
        turns.fold(0.0, f64::max)
    }

    /// Takes the present row of a file, which begins so.
    fn push(&mut self, row: &RecordedRow, begin: &str) {
        self.values
            .extend(self.places.iter().map(|place| row.values[*place]));
        let points = (0..self.targets).map(|k| row.points.get(k).copied().unwrap_or([f64::NAN; 3]));
        self.points.extend(points);
        self.ids.push(&row.id);
        for (place, texts) in &mut self.texts {
            texts.push(&row.texts[*place]);
        }
        self.line.push(row.line);
        self.begin.push(begin);
    }

    /// Reads joints that are logged within one turn as they are: by their neighbours in a `track`, by their limits at poses. A sentence for each
    /// joint of which rows are read so.
    fn turn(&mut self, arm: &RobotJoints, track: bool) -> Vec<String> {
        let usable: Vec<usize> = self.usable().collect();
        let (width, n) = (self.places.len(), arm.joints());
        let column = |place: usize| self.places.binary_search(&place).ok();
        let columns: Option<Vec<usize>> = arm.slots.q.clone().map(column).collect();
        let Some(columns) = columns else {
            return Vec::new();
        };
        let said = match track {
            true => {
                let mut turns = TurnCounter::new(arm);
                let mut all: Vec<f64> = Vec::with_capacity(usable.len() * n);
                for row in &usable {
                    let end = all.len();
                    all.extend(columns.iter().map(|k| self.values[row * width + k]));
                    let (before, here) = all.split_at_mut(end);
                    turns.next(self.line[*row], end > 0, here, before);
                }
                for (row, q) in usable.iter().zip(all.chunks_exact(n)) {
                    for (k, value) in columns.iter().zip(q) {
                        self.values[row * width + k] = *value;
                    }
                }
                turns.remarks()
            }
            false => {
                let turned = |joint: usize| {
                    let is_usable = |row: usize| usable.binary_search(&row).is_ok();
                    let rows = self.values.chunks_exact_mut(width).enumerate();
                    let rows = rows.filter(|(row, _)| is_usable(*row));
                    let mut values: Vec<&mut f64> =
                        rows.map(|(_, row)| &mut row[columns[joint]]).collect();
                    let moved = within_limits(&mut values, arm.limits[joint]);
                    (moved > 0).then(|| {
                        let (name, moved) = (arm.called(joint), counted(moved, "row"));
                        format!(
                            "{name} is logged within one turn: {moved} beyond its limits, read a turn away, within them"
                        )
                    })
                };
                let revolute = (0..n).filter(|joint| !arm.prismatic[*joint]);
                revolute.filter_map(turned).collect()
            }
        };
        if !said.is_empty() {
            self.judge_anew(&usable, &columns, arm);
        }
        said
    }

    /// What is odd about joints that have been read otherwise.
    fn judge_anew(&mut self, usable: &[usize], columns: &[usize], arm: &RobotJoints) {
        (self.largest, self.beyond) = (0.0, FileOddities::default());
        self.ranges.clear();
        for row in usable {
            let values = self.values(*row);
            let q: Vec<f64> = columns.iter().map(|k| values[*k]).collect();
            let beyond = arm.first_beyond(&q);
            self.odd_joints(self.line[*row], &q, beyond, arm);
        }
    }

    fn odd(&mut self, row: &RecordedRow, arm: &RobotJoints) {
        let q = row.values.get(arm.slots.q.clone()).unwrap_or_default();
        self.odd_joints(row.line, q, row.beyond, arm);
    }

    fn odd_joints(&mut self, line: u64, q: &[f64], beyond: Option<usize>, arm: &RobotJoints) {
        let joints = q.iter().zip(&arm.prismatic);
        let turning = joints.filter(|(_, prismatic)| !**prismatic);
        self.largest = turning.fold(self.largest, |largest, (q, _)| largest.max(q.abs()));
        self.ranges
            .resize(q.len(), [f64::INFINITY, f64::NEG_INFINITY]);
        for (value, [least, most]) in q.iter().zip(&mut self.ranges) {
            (*least, *most) = (least.min(*value), most.max(*value));
        }
        if let Some(joint) = beyond {
            let value = q.get(joint).copied().unwrap_or(f64::NAN);
            self.beyond.count(line, joint, value);
        }
    }
}

/// Reads the files of a measurement, in parallel.
pub(super) fn read(
    settings: &Ingest,
    arm: &RobotJoints,
    context: &Context,
) -> Result<Vec<FileRows>> {
    let (mut opened, mut sizes) = (Vec::new(), Vec::new());
    for layout in &settings.files {
        let source = context.services.open(&layout.file)?;
        sizes.push(source.size);
        let open = OpenedFile::open(source, layout, arm, settings.limits)?;
        for remark in open.remarks() {
            context.note(format!("{}: {remark}", open.label));
        }
        opened.push(open);
    }
    let labels: Vec<&str> = opened.iter().map(|open| open.label.as_str()).collect();
    let what = format!("reading {}", labels.join(", "));
    let services = context.services;
    services.begin(&what, sizes.into_iter().sum(), "bytes");
    let done = AtomicU64::new(0);
    let advance = |more: u64| {
        let all = done.fetch_add(more, Ordering::Relaxed) + more;
        services.advance(all, "");
    };
    let files = opened.into_par_iter().zip(&settings.files);
    let read = files.map(|(open, layout)| file(settings, layout, open, arm, &advance));
    let all: Vec<Result<FileRows>> = read.collect();
    // Of several faults that of the first file.
    let mut all = all.into_iter().collect::<Result<Vec<_>>>()?;
    for (rows, layout) in all.iter_mut().zip(&settings.files) {
        context.warn_each(rows.loss.take());
        let track = is_track(settings, layout);
        if settings.limits != LimitPolicy::Ignore && layout.columns.has("q") {
            let said = rows.turn(arm, track).into_iter();
            context.warn_each(said.map(|said| format!("{}: {said}", rows.label)));
        }
        if track {
            let samples = rows.samples(&arm.slots, layout.columns.has("velocity"));
            let count = rows.count();
            let track = samples.track(settings.motion.as_ref(), count, arm, &rows.label, context);
            rows.track = Some(track?);
        }
    }
    Ok(all)
}

fn file(
    settings: &Ingest,
    layout: &FileLayout,
    mut open: OpenedFile,
    arm: &RobotJoints,
    advance: &dyn Fn(u64),
) -> Result<FileRows> {
    let binding = open.binding();
    let texts = binding.worded.iter();
    let mut rows = FileRows {
        label: open.label.clone(),
        places: binding.filled.clone(),
        slots: binding.slots(),
        targets: binding.points.len(),
        texts: texts.map(|place| (*place, Texts::default())).collect(),
        measures: binding.measures,
        ..FileRows::default()
    };
    let says_sequence = binding.sequence.is_some();
    let named = layout.columns.has("point_id") && settings.duplicates != Duplicates::Keep;
    let may_be_given_up = named || settings.is_joined();
    let mut reported = 0;
    let mut tell =
        |bytes: u64| advance(bytes.saturating_sub(std::mem::replace(&mut reported, bytes)));
    while let Some(judged) = open.next()? {
        let row = &open.row;
        if let Some((joint, angle)) = row.turned {
            rows.turns.count(row.line, joint, angle);
        }
        let shown = may_be_given_up || judged.is_err();
        match judged {
            Ok(()) => rows.odd(row, arm),
            Err(refusal) => rows.refused.extend([(rows.count(), refusal)]),
        }
        if !row.is_blank {
            rows.filled = row.number;
        }
        rows.sequence.extend(says_sequence.then_some(row.sequence));
        let begin = shown.then(|| beginning(open.text()));
        rows.push(row, &begin.unwrap_or_default());
        if row.number.is_multiple_of(STRIDE) {
            tell(open.bytes());
        }
    }
    tell(open.bytes());
    open.external.must_stand(&open.label, arm.joints())?;
    (rows.lines, rows.loss) = (open.lines(), open.loss());
    match rows.count() {
        0 => Err(Error::data(rows.label, NO_ROW)),
        _ => Ok(rows),
    }
}

/// Whether velocities, or what they change by, follow from this file's joints over time.
fn is_track(settings: &Ingest, layout: &FileLayout) -> bool {
    let time = layout.columns.number("time");
    let timed = time.is_some_and(|time| time.column.is_some());
    let mut files = settings.files.iter();
    let moving = settings.motion.is_some() || files.any(|file| file.columns.has("velocity"));
    let asked = settings.motion.is_some() || settings.is_joined_by_time();
    timed && moving && asked && layout.columns.has("q")
}

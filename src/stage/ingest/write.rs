//! The recording in chunks, and every row that is not part of it with its reason.

use super::joined::JoinDecisions;
use super::later::Continuation;
use super::layout::FileLayout;
use super::noise::NoiseSlots;
use super::pair::FileDecision;
use super::reading::STRIDE;
use super::refusal::Rejections;
use super::row::RecordedRow;
use super::{scan, verdict};
use crate::error::{Error, Result, counted};
use crate::observation::{KINDS, Part};
use crate::robot::{START, SigmaSource};
use crate::stage::{Context, Sink, StreamedTable};
use crate::table::{Recording, Rejected, SIGMA_SOURCE, Table, TextCells, recording_frame};
use crate::units::Unit;

/// Rows of the recording in memory at once.
const CHUNK: usize = 1 << 16;

/// Writes the streamed tables of all measurements, `names` being those of all their files; `gaps` come before the later ones, s, none where
/// the clock is the same.
pub(super) fn write(
    decided: &[JoinDecisions],
    gaps: &[Option<f64>],
    names: &[String],
    context: &Context,
) -> Result<(StreamedTable<Recording>, StreamedTable<Rejected>)> {
    let rows = decided
        .iter()
        .flat_map(|one| one.scans.iter().zip(one.decisions).take(one.leading()));
    let rows = rows
        .map(|(scan, decision)| verdict::accepted(scan, decision))
        .sum();
    context
        .services
        .begin("writing the recording", Some(rows), "rows");
    let mut recording = RecordingChunks::new(decided, context)?;
    let mut rejected = Rejections::new(names, context)?;
    for (one, gap) in decided
        .iter()
        .zip(std::iter::once(None).chain(gaps.iter().map(Some)))
    {
        gap.into_iter().for_each(|gap| recording.rows.begin(*gap));
        for (index, layout) in one.settings.files.iter().enumerate() {
            file(
                one,
                index,
                layout,
                (index < one.leading()).then_some(&mut recording),
                &mut rejected,
                context,
            )?;
        }
    }
    Ok((recording.finish(context)?, rejected.finish()?))
}

/// Rows of file `index`: rejected ones, and used ones where the recording takes them.
fn file(
    decided: &JoinDecisions,
    index: usize,
    layout: &FileLayout,
    mut recording: Option<&mut RecordingChunks>,
    rejected: &mut Rejections,
    context: &Context,
) -> Result<()> {
    let (Some(scan), Some(decision), Some(name)) = (
        decided.scans.get(index),
        decided.decisions.get(index),
        decided.names.get(index),
    ) else {
        return Err(Error::Bug(format!("file {index} was not scanned")));
    };
    let used = verdict::accepted(scan, decision);
    if recording.is_none() && used == scan.read {
        return Ok(());
    }
    let mut rows = scan::rows(scan, (decided.settings, layout), decided.arm, context)?;
    let mut accepted = 0u64;
    while let Some(judged) = rows.next()? {
        match judged.and_then(|()| decided.outcome(index, decision, rows.row())) {
            Ok(()) => {
                accepted += 1;
                if let Some(chunks) = &mut recording {
                    chunks.push(rows.row(), index, decision, decided)?;
                    if accepted.is_multiple_of(STRIDE) {
                        context.services.advance(chunks.written, "");
                    }
                }
            }
            Err(refusal) => rejected.push(rows.row().rejected(name, rows.text(), refusal))?,
        }
    }
    let read = rows.row().number;
    if let Some(chunks) = recording {
        chunks.before += read;
    }
    if (read, accepted) != (scan.read, used) {
        return Err(Error::data(
            &scan.label,
            "changed while it was read; run again",
        ));
    }
    Ok(())
}

/// A stored column that some file fills, as far as it is known.
struct Stored {
    name: String,
    unit: Unit,
    /// Place in the row's numbers.
    place: usize,
    values: Vec<f64>,
}

/// The recording, chunk by chunk.
struct RecordingChunks<'a> {
    sink: Box<dyn Sink + 'a>,
    sequence: Vec<i64>,
    ids: TextCells,
    /// By setting; none where no file has it.
    texts: Vec<(&'static str, Option<TextCells>)>,
    numbers: Vec<Stored>,
    merged: Vec<f64>,
    noise: NoiseSlots,
    /// Where the standard deviation of each row's point comes from; none where no file has points.
    sources: Option<TextCells>,
    /// Rows without a stated noise.
    inferred: u64,
    /// The file with the joints.
    moving: usize,
    /// The farthest that joints were carried to the moment of their point, s.
    carried: f64,
    rows: Continuation,
    written: u64,
    /// Data rows of the files before this one.
    before: u64,
    /// The most targets of a wide row; 1 where there is none.
    widest: i64,
}

impl<'a> RecordingChunks<'a> {
    fn new(all: &[JoinDecisions], context: &Context<'a>) -> Result<Self> {
        let [decided, ..] = all else {
            return Err(Error::Bug("nothing was read".into()));
        };
        let slots = &decided.arm.slots;
        let mut has = vec![false; slots.count];
        for slot in all
            .iter()
            .flat_map(|one| one.scans)
            .flat_map(|scan| &scan.slots)
        {
            if let Some(has) = has.get_mut(*slot) {
                *has = true;
            }
        }
        if decided.settings.motion.is_some() {
            has[slots.velocity.clone()].fill(true);
        }
        let noise = NoiseSlots::new(slots, decided.settings.instrument);
        let files = &decided.settings.files;
        let points = || KINDS[..1].iter().flat_map(|kind| kind.columns(Part::Value));
        let measured = files
            .iter()
            .any(|file| points().any(|column| file.has(column.setting)));
        if measured {
            noise
                .sigma()
                .into_iter()
                .for_each(|place| has[place] = true);
        }
        // Every recording has points and the names of its rows.
        let always: Vec<&str> = points().map(|column| column.setting).collect();
        let text = |name: &&'static str| {
            let named = *name == "usage" || files.iter().any(|file| file.has(name));
            (*name, named.then(TextCells::default))
        };
        let mut numbers = Vec::new();
        for (column, places) in slots.numbers() {
            for ((name, unit), place) in column
                .columns(&decided.arm.prismatic)
                .into_iter()
                .zip(places.clone())
            {
                if has[place] || always.contains(&column.setting) {
                    numbers.push(Stored {
                        name,
                        unit,
                        place,
                        values: Vec::new(),
                    });
                }
            }
        }
        Ok(Self {
            sink: context.services.sink(Recording::KIND)?,
            sequence: Vec::new(),
            ids: TextCells::default(),
            texts: slots.texts().iter().map(text).collect(),
            numbers,
            merged: Vec::new(),
            noise,
            sources: measured.then(TextCells::default),
            inferred: 0,
            moving: files
                .iter()
                .position(|file| file.columns.has("q"))
                .unwrap_or_default(),
            carried: 0.0,
            rows: Continuation::default(),
            written: 0,
            before: 0,
            widest: files
                .iter()
                .filter_map(|file| file.targets.as_ref())
                .map(|targets| targets.columns.len() as i64)
                .max()
                .unwrap_or(1),
        })
    }
    fn push(
        &mut self,
        row: &RecordedRow,
        index: usize,
        decision: &FileDecision,
        decided: &JoinDecisions,
    ) -> Result<()> {
        self.merged.clone_from(&row.values);
        for (at, held) in decided.partners(row, decision) {
            let width = held.places.len();
            let values = held
                .values
                .get(at * width..(at + 1) * width)
                .unwrap_or_default();
            for (slot, value) in held.places.iter().zip(values) {
                // Mapped in both files, for a join by time: the time of a row is that of the file that leads.
                if let Some(merged) = self.merged.get_mut(*slot).filter(|merged| merged.is_nan()) {
                    *merged = *value;
                }
            }
        }
        // By id, both rows have the same one.
        let ids = decided
            .partners(row, decision)
            .filter_map(|(at, held)| held.ids.get(at).filter(|id| !id.is_empty()));
        let id = ids.last().unwrap_or(&row.id);
        let text = |place: usize| {
            let others = decided
                .partners(row, decision)
                .filter_map(|(at, held)| held.text(place, at));
            others
                .last()
                .or(row.texts.get(place).map(String::as_str))
                .unwrap_or_default()
        };
        self.carry(decided, index, row, decision);
        let number = self.before + row.number;
        let time = self.merged[decided.arm.slots.time];
        let (sequence, time) = self
            .rows
            .next(row.sequence.unwrap_or(number as i64), time)
            .map_err(|(sequence, last)| {
                // Within a file such a row is refused: this is the first row of a file that continues another.
                let message = format!(
                    "sequence {sequence} does not follow {last}, the last of the file before"
                );
                let label = decided
                    .scans
                    .get(index)
                    .map_or("", |scan| scan.label.as_str());
                Error::data(format!("{label}:{}", row.line), message)
            })?;
        self.merged[decided.arm.slots.time] = time;
        let unnamed;
        let id = if id.is_empty() {
            let name = decided
                .arm
                .slots
                .kinds
                .iter()
                .filter_map(|kind| kind.name)
                .map(text)
                .find(|name| !name.is_empty());
            unnamed = name.map_or_else(
                || format!("row {number}"),
                |name| format!("{name} row {}", row.number),
            );
            &unnamed
        } else {
            id
        };
        let Some(points) = decided.points(index, row, decision) else {
            return self.one(sequence, id, text);
        };
        // Numbered through: the targets of a row follow each other.
        let first = sequence.saturating_sub(1).saturating_mul(self.widest);
        let (merged, of_target) = (
            self.merged.clone(),
            self.texts.iter().position(|(name, _)| *name == "target"),
        );
        for (at, target, point) in points {
            self.merged.clone_from(&merged);
            self.merged[decided.arm.slots.point.clone()].copy_from_slice(&point);
            let text = |place| {
                if Some(place) == of_target {
                    target.as_str()
                } else {
                    text(place)
                }
            };
            self.one(first.saturating_add(at), id, text)?;
        }
        Ok(())
    }
    /// A row of the recording: the merged numbers and these texts.
    fn one<'t>(&mut self, sequence: i64, id: &str, text: impl Fn(usize) -> &'t str) -> Result<()> {
        let source = self.noise.fill(&mut self.merged);
        if let Some(sources) = &mut self.sources {
            self.inferred += u64::from(source == SigmaSource::Inferred);
            sources.push(Some(source.name()));
        }
        self.sequence.push(sequence);
        self.ids.push(Some(id));
        for (place, (_, into)) in self.texts.iter_mut().enumerate() {
            into.iter_mut()
                .for_each(|texts| texts.push(Some(text(place)).filter(|text| !text.is_empty())));
        }
        self.numbers
            .iter_mut()
            .for_each(|stored| stored.values.push(self.merged[stored.place]));
        self.written += 1;
        if self.sequence.len() >= CHUNK {
            self.flush()?;
        }
        Ok(())
    }
    /// Velocities that follow from the joints over time; with a join by time joints and velocities at the moment of the point.
    fn carry(
        &mut self,
        decided: &JoinDecisions,
        index: usize,
        row: &RecordedRow,
        decision: &FileDecision,
    ) {
        let slots = &decided.arm.slots;
        // Of files that continue each other each has its own joints.
        let moving = if decision.partners.is_empty() {
            index
        } else {
            self.moving
        };
        let track = decided
            .scans
            .get(moving)
            .and_then(|scan| scan.track.as_ref())
            .zip(decided.number(moving, index, row, decision));
        if let (Some((track, number)), Some(_)) = (track, &decided.settings.motion)
            && let Some(velocity) = self.merged.get_mut(slots.velocity.clone())
        {
            track.fill(number, velocity);
        }
        let apart = decided.later(moving, row, decision);
        let known = decided
            .settings
            .motion
            .as_ref()
            .map_or(0.0, |motion| motion.later_s);
        let later = apart.unwrap_or(0.0) + known;
        if later == 0.0 {
            return;
        }
        for (joint, (q, rate)) in slots.q.clone().zip(slots.velocity.clone()).enumerate() {
            let velocity = self.merged[rate];
            let acceleration =
                track.map_or(0.0, |(track, number)| track.acceleration(number, joint));
            if velocity.is_finite() {
                self.merged[q] += later * (velocity + 0.5 * later * acceleration);
                self.merged[rate] += later * acceleration;
                self.carried = self.carried.max(later.abs());
            }
        }
    }
    fn flush(&mut self) -> Result<()> {
        let texts = self
            .texts
            .iter_mut()
            .filter_map(|(name, texts)| Some((*name, texts.as_mut()?.take())));
        let texts = texts.chain(self.sources.as_mut().map(|all| (SIGMA_SOURCE, all.take())));
        // As much again follows a whole chunk.
        let room = if self.sequence.len() >= CHUNK {
            CHUNK
        } else {
            0
        };
        let numbers = self.numbers.iter_mut().map(
            |Stored {
                 name, unit, values, ..
             }| {
                (
                    name.clone(),
                    *unit,
                    std::mem::replace(values, Vec::with_capacity(room)).into_iter(),
                )
            },
        );
        let frame = recording_frame(
            std::mem::take(&mut self.sequence),
            self.ids.take(),
            texts,
            numbers,
        )?;
        self.sink.push(frame)
    }
    fn finish(mut self, context: &Context) -> Result<StreamedTable<Recording>> {
        if !self.sequence.is_empty() {
            self.flush()?;
        }
        if self.carried > 0.0 {
            let ms = 1e3 * self.carried;
            context.note(format!("joints were extrapolated by their velocity to the time of their point, over {ms:.2} ms at most"));
        }
        if self.inferred > 0 {
            let (rows, least) = (counted(self.inferred, "row"), START);
            context.note(format!(
                "{rows} without a stated noise: weighted as {} um + {} um/m ({} sigma) to start from, which is assumed, not \
                 known; say `instrument`, or map sigma_x or u95",
                least.constant_um, least.per_metre_um, least.coverage
            ));
        }
        Ok(StreamedTable::new(self.sink.finish()?))
    }
}

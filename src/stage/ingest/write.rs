//! The recording in chunks, and every row that is not part of it with its reason.

use super::columns::FileLayout;
use super::later::Continuation;
use super::noise::NoiseSlots;
use super::pair::{JoinedRow, Measurement};
use super::reading::STRIDE;
use super::refusal::Rejections;
use super::rows::FileRows;
use crate::error::{Error, Result, counted};
use crate::observation::{KINDS, Part};
use crate::table::{Recording, Rejected, SIGMA_SOURCE, Table, TextCells, recording_frame};
use crate::units::Unit;
use crate::{Context, Sink, StreamedTable};
use calib_numerics::robot::{START, SigmaSource};
use std::borrow::Cow;

/// Rows of the recording in memory at once.
const CHUNK: usize = 1 << 16;

/// Writes the streamed tables of all measurements, `names` being those of all their files; `gaps` come before the later ones, s, none where
/// the clock is the same.
pub(super) fn write(
    all: &[Measurement],
    gaps: &[Option<f64>],
    names: &[String],
    context: &Context,
) -> Result<(StreamedTable<Recording>, StreamedTable<Rejected>)> {
    let leading = all.iter().flat_map(|one| one.leading());
    let rows = leading.map(FileRows::count_used).sum();
    let services = context.services;
    services.begin("writing the recording", Some(rows), "rows");
    let mut recording = RecordingChunks::new(all, context)?;
    let mut rejected = Rejections::new(names, context)?;
    let gaps = std::iter::once(None).chain(gaps.iter().map(Some));
    for (one, gap) in all.iter().zip(gaps) {
        gap.into_iter().for_each(|gap| recording.rows.begin(*gap));
        for (file, rows) in one.files.iter().enumerate() {
            let leads = file < one.leading().len();
            for row in 0..rows.count() {
                let given_up = || Some(one.refusal(file, row, *rows.given_up.get(&row)?));
                match rows.refused.get(&row).cloned().or_else(given_up) {
                    Some(refusal) => {
                        let (line, id) = (rows.line(row), rows.id(row));
                        let begin = rows.begin(row);
                        rejected.push(refusal.rejected(&one.names[file], line, id, begin))?;
                    }
                    None if leads => {
                        recording.push(one, file, row)?;
                        if recording.written.is_multiple_of(STRIDE) {
                            services.advance(recording.written, "");
                        }
                    }
                    None => {}
                }
            }
            if leads {
                recording.before += rows.count();
            }
        }
    }
    Ok((recording.finish(context)?, rejected.finish()?))
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
    before: usize,
    /// The most targets of a wide row; 1 where there is none.
    widest: i64,
}

impl<'a> RecordingChunks<'a> {
    fn new(all: &[Measurement], context: &Context<'a>) -> Result<Self> {
        let [first, ..] = all else {
            return Err(Error::Bug("nothing was read".into()));
        };
        let slots = &first.arm.slots;
        let mut has = vec![false; slots.count];
        let read = all.iter().flat_map(|one| &one.files);
        for slot in read.flat_map(|rows| &rows.slots) {
            has[*slot] = true;
        }
        if first.settings.motion.is_some() {
            has[slots.velocity.clone()].fill(true);
        }
        let noise = NoiseSlots::new(slots, first.settings.instrument);
        let files = &first.settings.files;
        let points = || KINDS[..1].iter().flat_map(|kind| kind.columns(Part::Value));
        let has_points = |file: &FileLayout| points().any(|column| file.has(column.setting));
        let measured = files.iter().any(has_points);
        for place in noise.sigma() {
            has[place] |= measured;
        }
        // Every recording has points and the names of its rows.
        let always: Vec<&str> = points().map(|column| column.setting).collect();
        let text = |name: &&'static str| {
            let named = *name == "usage" || files.iter().any(|file| file.has(name));
            (*name, named.then(TextCells::default))
        };
        let mut numbers = Vec::new();
        for (column, places) in slots.numbers() {
            let stored = column.columns(&first.arm.prismatic).into_iter();
            for ((name, unit), place) in stored.zip(places.clone()) {
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
        let moving = files.iter().position(|file| file.columns.has("q"));
        let targets = files.iter().filter_map(|file| file.targets.as_ref());
        let widths = targets.map(|targets| targets.columns.len() as i64);
        Ok(Self {
            sink: context.services.sink(Recording::KIND)?,
            sequence: Vec::new(),
            ids: TextCells::default(),
            texts: slots.texts().iter().map(text).collect(),
            numbers,
            merged: vec![f64::NAN; slots.count],
            noise,
            sources: measured.then(TextCells::default),
            inferred: 0,
            moving: moving.unwrap_or_default(),
            carried: 0.0,
            rows: Continuation::default(),
            written: 0,
            before: 0,
            widest: widths.max().unwrap_or(1),
        })
    }
    /// A used row of a file that leads.
    fn push(&mut self, all: &Measurement, file: usize, row: usize) -> Result<()> {
        let (rows, slots) = (&all.files[file], &all.arm.slots);
        let joined = all.joined(file, row);
        // Mapped in both files, for a join by time: the time of a row is that of the file that leads.
        self.merged.fill(f64::NAN);
        for (file, row) in &joined {
            all.files[*file].fill(*row, &mut self.merged);
        }
        let parts = || joined.iter().map(|(file, row)| (&all.files[*file], *row));
        // By id, all have the same one.
        let mut ids = parts().rev().map(|(rows, row)| rows.id(row));
        let id = ids.find(|id| !id.is_empty());
        let text = |place: usize| {
            let mut parts = parts().rev();
            let text = parts.find_map(|(rows, row)| rows.text(row, place));
            text.unwrap_or_default()
        };
        self.carry(all, &joined);
        let number = self.before + row + 1;
        let sequence = rows.sequence(row).unwrap_or(number as i64);
        let next = self.rows.next(sequence, self.merged[slots.time]);
        let (sequence, time) = next.map_err(|(sequence, last)| {
            // Within a file such a row is refused: this is the first row of a file that continues another.
            let message =
                format!("sequence {sequence} does not follow {last}, the last of the file before");
            Error::data(format!("{}:{}", rows.label, rows.line(row)), message)
        })?;
        self.merged[slots.time] = time;
        let unnamed = || {
            let mut names = slots.kinds.iter().filter_map(|kind| kind.name).map(text);
            match names.find(|name| !name.is_empty()) {
                None => format!("row {number}"),
                Some(name) => format!("{name} row {}", row + 1),
            }
        };
        let id = id.map_or_else(|| unnamed().into(), Cow::Borrowed);
        let Some(points) = all.points(&joined) else {
            return self.one(sequence, &id, text);
        };
        // Numbered through: the targets of a row follow each other.
        let first = sequence.saturating_sub(1).saturating_mul(self.widest);
        let merged = self.merged.clone();
        let of_target = self.texts.iter().position(|(name, _)| *name == "target");
        for (at, target, point) in points {
            self.merged.clone_from(&merged);
            self.merged[slots.point.clone()].copy_from_slice(&point);
            let text = |place| match Some(place) == of_target {
                true => target,
                false => text(place),
            };
            self.one(first.saturating_add(at), &id, text)?;
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
    fn carry(&mut self, all: &Measurement, joined: &JoinedRow) {
        let slots = &all.arm.slots;
        // Of files that continue each other each has its own joints.
        let moving = match joined {
            [(file, _)] => *file,
            _ => self.moving,
        };
        let part = joined.iter().find(|(file, _)| *file == moving);
        let track = part.and_then(|(file, row)| Some((all.files[*file].track.as_ref()?, *row)));
        let motion = all.settings.motion.as_ref();
        if let (Some((track, row)), Some(_)) = (track, motion) {
            track.fill(row, &mut self.merged[slots.velocity.clone()]);
        }
        let known = motion.map_or(0.0, |motion| motion.later_s);
        let later = all.later(moving, joined).unwrap_or(0.0) + known;
        if later == 0.0 {
            return;
        }
        for (joint, (q, rate)) in slots.q.clone().zip(slots.velocity.clone()).enumerate() {
            let velocity = self.merged[rate];
            let acceleration = track.map_or(0.0, |(track, row)| track.acceleration(row, joint));
            if velocity.is_finite() {
                self.merged[q] += later * (velocity + 0.5 * later * acceleration);
                self.merged[rate] += later * acceleration;
                self.carried = self.carried.max(later.abs());
            }
        }
    }
    fn flush(&mut self) -> Result<()> {
        let texts = self.texts.iter_mut();
        let texts = texts.filter_map(|(name, texts)| Some((*name, texts.as_mut()?.take())));
        let texts = texts.chain(self.sources.as_mut().map(|all| (SIGMA_SOURCE, all.take())));
        // As much again follows a whole chunk.
        let room = match self.sequence.len() >= CHUNK {
            true => CHUNK,
            false => 0,
        };
        let numbers = self.numbers.iter_mut().map(|stored| {
            let values = std::mem::replace(&mut stored.values, Vec::with_capacity(room));
            (stored.name.clone(), stored.unit, values.into_iter())
        });
        let sequence = std::mem::take(&mut self.sequence);
        let frame = recording_frame(sequence, self.ids.take(), texts, numbers)?;
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

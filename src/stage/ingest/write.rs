//! Second reading: the recording in chunks, and every row that is not part of it with its reason.

use super::arm::RobotJoints;
use super::later::Continuation;
use super::layout::{FileLayout, Join};
use super::noise::NoiseSlots;
use super::pair::{FileDecision, NONE};
use super::reading::{OpenedFile, ProgressCounter};
use super::rejections::Rejections;
use super::row::{Reason, RecordedRow, RowRefusal};
use super::scan::Scan;
use super::{Ingest, verdict};
use crate::error::{Error, Result, counted};
use crate::observation::{KINDS, Part};
use crate::robot::{START, SigmaSource};
use crate::stage::{Context, Sink, StreamedTable};
use crate::table::{Recording, Rejected, RejectedRow, SIGMA_SOURCE, Table, recording_frame};
use crate::units::Unit;

/// Rows of the recording in memory at once.
const CHUNK: usize = 1 << 16;

/// What all files give and decide together.
pub(super) struct JoinDecisions<'a> {
    pub settings: &'a Ingest,
    pub arm: &'a RobotJoints,
    pub scans: &'a [Scan],
    pub fates: &'a [FileDecision],
    /// Names of the files in tables.
    pub names: &'a [String],
}

/// Writes the streamed tables of all measurements, `names` being those of all their files; `gaps` come before the later ones, s, none where
/// the clock is the same.
pub(super) fn write(
    decided: &[JoinDecisions],
    gaps: &[Option<f64>],
    names: &[String],
    context: &Context,
) -> Result<(StreamedTable<Recording>, StreamedTable<Rejected>)> {
    let rows = decided.iter().flat_map(|one| one.scans.iter().zip(one.fates).take(one.leading()));
    let rows = rows.map(|(scan, fate)| verdict::accepted(scan, fate)).sum();
    context.services.begin("writing the recording", Some(rows), "rows");
    let mut recording = Chunks::new(decided, context)?;
    let mut rejected = Rejections::new(names, context)?;
    for (one, gap) in decided.iter().zip(std::iter::once(None).chain(gaps.iter().map(Some))) {
        gap.into_iter().for_each(|gap| recording.rows.begin(*gap));
        for (index, layout) in one.settings.files.iter().enumerate() {
            file(one, index, layout, (index < one.leading()).then_some(&mut recording), &mut rejected, context)?;
        }
    }
    Ok((recording.finish(context)?, rejected.finish()?))
}

fn file(
    decided: &JoinDecisions,
    index: usize,
    layout: &FileLayout,
    mut recording: Option<&mut Chunks>,
    rejected: &mut Rejections,
    context: &Context,
) -> Result<()> {
    let (Some(scan), Some(fate), Some(name)) = (decided.scans.get(index), decided.fates.get(index), decided.names.get(index))
    else {
        return Err(Error::Bug(format!("file {index} was not scanned")));
    };
    let source = context.services.open(&layout.file)?;
    let mut reading = OpenedFile::open(source, layout, decided.arm, decided.settings.limits)?;
    let mut pace = ProgressCounter::new(context);
    let mut accepted = 0;
    while let Some(judged) = reading.next()? {
        match judged.and_then(|()| decided.outcome(index, fate, &reading.row)) {
            Ok(()) => {
                accepted += 1;
                if let Some(chunks) = &mut recording {
                    chunks.push(&reading.row, index, fate, decided)?;
                    pace.row(chunks.written);
                }
            }
            Err(refusal) => rejected.push(RejectedRow {
                file: name.clone(),
                line: reading.row.line as i64,
                point_id: (!reading.row.id.is_empty()).then(|| reading.row.id.clone()),
                reason: refusal.reason.word().into(),
                detail: refusal.detail,
                text: reading.record.text(),
            })?,
        }
    }
    if let Some(chunks) = recording {
        chunks.before += reading.row.number;
    }
    if (reading.row.number, accepted) != (scan.read, verdict::accepted(scan, fate)) {
        return Err(Error::data(&scan.label, "changed while it was read; run again"));
    }
    Ok(())
}

impl JoinDecisions<'_> {
    /// Files whose rows are those of the recording: of joined ones the first.
    fn leading(&self) -> usize {
        let joined = self.fates.iter().any(|fate| !fate.partners.is_empty());
        if joined { 1 } else { self.scans.len() }
    }
    /// Why a usable row is not used after all, if so.
    fn outcome(&self, index: usize, fate: &FileDecision, row: &RecordedRow) -> Result<(), RowRefusal> {
        if let Some(twin) = u32::try_from(row.number).ok().and_then(|number| fate.twins.get(&number)) {
            let there =
                if twin.file as usize == index { String::new() } else { format!(" of {}", self.name(twin.file as usize)) };
            return Err(if twin.copied {
                let detail = format!("a copy of line {}{there}: the same id, the same values", twin.line);
                RowRefusal { reason: Reason::DuplicateRow, detail }
            } else {
                let detail = format!("point id `{}` also stands on line {}{there}", row.id, twin.line);
                RowRefusal { reason: Reason::DuplicateId, detail }
            });
        }
        if fate.is_whole(row.number as usize) {
            return Ok(());
        }
        let lacks = |partner: &Vec<u32>| partner.get((row.number - 1) as usize).is_none_or(|partner| *partner == NONE);
        let other = fate.partners.iter().position(lacks).unwrap_or_default();
        let other = if index == 0 { self.name(other + 1) } else { self.name(0) };
        Err(RowRefusal { reason: Reason::Unmatched, detail: self.lonely(other, index, row) })
    }
    /// The data row of file `file` that is part of a row of file `index`.
    fn number(&self, file: usize, index: usize, row: &RecordedRow, fate: &FileDecision) -> Option<u64> {
        if file == index {
            return Some(row.number);
        }
        let partner = fate.partners.get(file.checked_sub(1)?)?.get((row.number - 1) as usize)?;
        (*partner != NONE).then_some(u64::from(*partner))
    }
    /// When file `file` recorded its part of a row of the first file, s by the first one's clock.
    fn moment(&self, file: usize, row: &RecordedRow, fate: &FileDecision) -> Option<f64> {
        let time = self.arm.slots.time;
        let Some(Join::Time { offset_s, .. }) = &self.settings.join else { return None };
        if file == 0 {
            return row.values.get(time).copied();
        }
        let packed = self.scans.get(file)?.packed.as_ref()?;
        let slot = packed.slots.iter().position(|slot| *slot == time)?;
        let at = (self.number(file, 0, row, fate)? as usize - 1) * packed.slots.len() + slot;
        Some(packed.values.get(at)? - if file == 1 { *offset_s } else { 0.0 })
    }
    /// How much later (s) than its joints the point of a row was measured.
    fn later(&self, moving: usize, row: &RecordedRow, fate: &FileDecision) -> Option<f64> {
        let values = || KINDS.iter().flat_map(|kind| kind.columns(Part::Value));
        let files = &self.settings.files;
        let point = files.iter().position(|file| values().any(|column| file.has(column.setting)))?;
        let later = self.moment(point, row, fate)? - self.moment(moving, row, fate)?;
        Some(later).filter(|later| later.is_finite())
    }
    /// Of a wide row of file `index`, or of its partner, the targets that were seen: which, from 1, by name, where. None of other rows.
    fn points(&self, index: usize, row: &RecordedRow, fate: &FileDecision) -> Option<Vec<(i64, &String, [f64; 3])>> {
        let files = &self.settings.files;
        let wide = |file: &usize| files.get(*file).is_some_and(|layout| layout.targets.is_some());
        let file = if fate.partners.is_empty() { Some(index).filter(wide) } else { (0..files.len()).find(wide) }?;
        let names = files.get(file)?.targets.as_ref()?.columns.keys();
        let points = if file == index {
            row.points.as_slice()
        } else {
            let at = (self.number(file, index, row, fate)? as usize - 1) * names.len();
            self.scans.get(file)?.packed.as_ref()?.points.get(at..at + names.len())?
        };
        let seen = names.zip(points).zip(1..).filter(|((_, point), _)| !point[0].is_nan());
        Some(seen.map(|((name, point), at)| (at, name, *point)).collect())
    }
    fn name(&self, index: usize) -> &str {
        self.names.get(index).map_or("", String::as_str)
    }
    /// A row of file `index` has no partner in the file named `other`, or that none in a third.
    fn lonely(&self, other: &str, index: usize, row: &RecordedRow) -> String {
        let other = if index > 0 && self.names.len() > 2 { format!("{other} (joined to all files)") } else { other.into() };
        match &self.settings.join {
            Some(Join::Id {}) => format!("no usable row of {other} has the point id `{}`", row.id),
            Some(Join::Time { tolerance_s, .. }) => {
                let time = row.values.get(self.arm.slots.time).copied().unwrap_or(f64::NAN);
                format!("{other} has no row within {tolerance_s} s of {time} s")
            }
            _ => format!("data row {} of {other} is missing or rejected", row.number),
        }
    }
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
struct Chunks<'a> {
    sink: Box<dyn Sink + 'a>,
    sequence: Vec<i64>,
    ids: Vec<String>,
    /// By setting; none where no file has it.
    texts: Vec<(&'static str, Option<Vec<Option<String>>>)>,
    numbers: Vec<Stored>,
    merged: Vec<f64>,
    noise: NoiseSlots,
    /// Where the standard deviation of each row's point comes from; none where no file has points.
    sources: Option<Vec<SigmaSource>>,
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

impl<'a> Chunks<'a> {
    fn new(all: &[JoinDecisions], context: &Context<'a>) -> Result<Self> {
        let [decided, ..] = all else { return Err(Error::Bug("nothing was read".into())) };
        let slots = &decided.arm.slots;
        let mut has = vec![false; slots.count];
        for slot in all.iter().flat_map(|one| one.scans).flat_map(|scan| &scan.slots) {
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
        let measured = files.iter().any(|file| points().any(|column| file.has(column.setting)));
        if measured {
            noise.sigma().into_iter().for_each(|place| has[place] = true);
        }
        // Every recording has points and the names of its rows.
        let always: Vec<&str> = points().map(|column| column.setting).collect();
        let text = |name: &&'static str| {
            let named = *name == "usage" || files.iter().any(|file| file.has(name));
            (*name, named.then(Vec::new))
        };
        let mut numbers = Vec::new();
        for (column, places) in slots.numbers() {
            for ((name, unit), place) in column.columns(&decided.arm.prismatic).into_iter().zip(places.clone()) {
                if has[place] || always.contains(&column.setting) {
                    numbers.push(Stored { name, unit, place, values: Vec::new() });
                }
            }
        }
        Ok(Self {
            sink: context.services.sink(Recording::KIND)?,
            sequence: Vec::new(),
            ids: Vec::new(),
            texts: slots.texts().iter().map(text).collect(),
            numbers,
            merged: Vec::new(),
            noise,
            sources: measured.then(Vec::new),
            inferred: 0,
            moving: files.iter().position(|file| file.columns.has("q")).unwrap_or_default(),
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
    fn push(&mut self, row: &RecordedRow, index: usize, fate: &FileDecision, decided: &JoinDecisions) -> Result<()> {
        let label = decided.scans.get(index).map_or("", |scan| scan.label.as_str());
        self.merged.clone_from(&row.values);
        let (mut id, mut texts) = (&row.id, row.texts.iter().collect::<Vec<&String>>());
        for (partner, scan) in fate.partners.iter().zip(decided.scans.iter().skip(1)) {
            let number = partner.get((row.number - 1) as usize).and_then(|number| number.checked_sub(1));
            let Some((at, packed)) = number.map(|number| number as usize).zip(scan.packed.as_ref()) else { continue };
            let width = packed.slots.len();
            let values = packed.values.get(at * width..(at + 1) * width).unwrap_or_default();
            for (slot, value) in packed.slots.iter().zip(values) {
                // Mapped in both files, for a join by time: the time of a row is that of the file that leads.
                if let Some(merged) = self.merged.get_mut(*slot).filter(|merged| merged.is_nan()) {
                    *merged = *value;
                }
            }
            id = packed.ids.get(at).unwrap_or(id);
            for (own, other) in texts.iter_mut().zip(&packed.texts) {
                *own = other.as_ref().and_then(|other| other.get(at)).unwrap_or(own);
            }
        }
        self.carry(decided, index, row, fate);
        let number = self.before + row.number;
        let time = self.merged[decided.arm.slots.time];
        let (sequence, time) = self.rows.next(row.sequence.unwrap_or(number as i64), time).map_err(|(sequence, last)| {
            // Within a file such a row is refused: this is the first row of a file that continues another.
            let message = format!("sequence {sequence} does not follow {last}, the last of the file before");
            Error::data(format!("{label}:{}", row.line), message)
        })?;
        self.merged[decided.arm.slots.time] = time;
        let id = match decided.arm.slots.kinds.iter().filter_map(|kind| texts.get(kind.name?)).find(|name| !name.is_empty()) {
            _ if !id.is_empty() => id.clone(),
            Some(name) => format!("{name} row {}", row.number),
            None => format!("row {number}"),
        };
        let Some(points) = decided.points(index, row, fate) else { return self.one(sequence, id, &texts) };
        // Numbered through: the targets of a row follow each other.
        let first = sequence.saturating_sub(1).saturating_mul(self.widest);
        let (merged, of_target) = (self.merged.clone(), self.texts.iter().position(|(name, _)| *name == "target"));
        for (at, target, point) in points {
            self.merged.clone_from(&merged);
            self.merged[decided.arm.slots.point()].copy_from_slice(&point);
            if let Some(text) = of_target.and_then(|place| texts.get_mut(place)) {
                *text = target;
            }
            self.one(first.saturating_add(at), id.clone(), &texts)?;
        }
        Ok(())
    }
    /// A row of the recording: the merged numbers and these texts.
    fn one(&mut self, sequence: i64, id: String, texts: &[&String]) -> Result<()> {
        let source = self.noise.fill(&mut self.merged);
        if let Some(sources) = &mut self.sources {
            self.inferred += u64::from(source == SigmaSource::Inferred);
            sources.push(source);
        }
        self.sequence.push(sequence);
        self.ids.push(id);
        for ((_, into), text) in self.texts.iter_mut().zip(texts) {
            into.iter_mut().for_each(|texts| texts.push((!text.is_empty()).then(|| text.to_string())));
        }
        self.numbers.iter_mut().for_each(|stored| stored.values.push(self.merged[stored.place]));
        self.written += 1;
        if self.sequence.len() >= CHUNK {
            self.flush()?;
        }
        Ok(())
    }
    /// Velocities that follow from the joints over time; with a join by time joints and velocities at the moment of the point.
    fn carry(&mut self, decided: &JoinDecisions, index: usize, row: &RecordedRow, fate: &FileDecision) {
        let slots = &decided.arm.slots;
        // Of files that continue each other each has its own joints.
        let moving = if fate.partners.is_empty() { index } else { self.moving };
        let track = decided.scans.get(moving).and_then(|scan| scan.track.as_ref()).zip(decided.number(moving, index, row, fate));
        if let (Some((track, number)), Some(_)) = (track, &decided.settings.motion)
            && let Some(velocity) = self.merged.get_mut(slots.velocity.clone())
        {
            track.fill(number, velocity);
        }
        let apart = decided.later(moving, row, fate);
        let known = decided.settings.motion.as_ref().map_or(0.0, |motion| motion.later_s);
        let later = apart.unwrap_or(0.0) + known;
        if later == 0.0 {
            return;
        }
        for (joint, (q, rate)) in slots.q.clone().zip(slots.velocity.clone()).enumerate() {
            let velocity = self.merged[rate];
            let acceleration = track.map_or(0.0, |(track, number)| track.acceleration(number, joint));
            if velocity.is_finite() {
                self.merged[q] += later * (velocity + 0.5 * later * acceleration);
                self.merged[rate] += later * acceleration;
                self.carried = self.carried.max(later.abs());
            }
        }
    }
    fn flush(&mut self) -> Result<()> {
        let texts = self.texts.iter_mut().filter_map(|(name, texts)| Some((*name, std::mem::take(texts.as_mut()?))));
        let source = self.sources.as_mut().map(|all| (SIGMA_SOURCE, all.drain(..).map(|one| Some(one.name().into())).collect()));
        let texts = texts.chain(source);
        let numbers = self.numbers.iter().map(|Stored { name, unit, values, .. }| (name.clone(), *unit, values.iter()));
        let frame = recording_frame(std::mem::take(&mut self.sequence), std::mem::take(&mut self.ids), texts, numbers)?;
        self.numbers.iter_mut().for_each(|stored| stored.values.clear());
        self.sink.push(frame)
    }
    fn finish(mut self, context: &Context) -> Result<StreamedTable<Recording>> {
        if !self.sequence.is_empty() {
            self.flush()?;
        }
        if self.carried > 0.0 {
            let ms = 1e3 * self.carried;
            context
                .services
                .note(format!("joints were extrapolated by their velocity to the time of their point, over {ms:.2} ms at most"));
        }
        if self.inferred > 0 {
            let (rows, least) = (counted(self.inferred, "row"), START);
            context.services.note(format!(
                "{rows} without a stated noise: weighted as {} um + {} um/m ({} sigma) to start from, which is assumed, not \
                 known; say `instrument`, or map sigma_x or u95",
                least.constant_um, least.per_metre_um, least.coverage
            ));
        }
        Ok(StreamedTable::new(self.sink.finish()?))
    }
}

//! Second reading: the recording in chunks, and every row that is not part of it with its reason.

use super::arm::Arm;
use super::layout::{Columns, FileLayout, Join};
use super::pair::{Fate, NONE};
use super::reading::{Pace, Reading};
use super::row::{Reason, Refusal, Row};
use super::scan::Scan;
use super::slot::Slot;
use super::{Ingest, verdict};
use crate::error::{Error, Result};
use crate::stage::{Context, Sink, StreamedTable};
use crate::table::{Recording, Rejected, RejectedRow, Table};

/// Rows of the recording in memory at once.
const CHUNK: usize = 1 << 16;
/// Rejected rows in memory at once, where they come in order.
const REJECTED_CHUNK: usize = 1 << 12;

/// What all files give and decide together.
pub(super) struct Decided<'a> {
    pub settings: &'a Ingest,
    pub arm: &'a Arm,
    pub scans: &'a [Scan],
    pub fates: &'a [Fate],
    /// Names of the files in tables.
    pub names: &'a [String],
}

/// Writes the streamed tables.
pub(super) fn write(decided: &Decided, context: &Context) -> Result<(StreamedTable<Recording>, StreamedTable<Rejected>)> {
    let joined = decided.fates.iter().any(|fate| !fate.partners.is_empty());
    let leading = if joined { 1 } else { decided.scans.len() };
    let rows = decided.scans.iter().zip(decided.fates).take(leading).map(|(scan, fate)| verdict::accepted(scan, fate)).sum();
    context.services.begin("writing the recording", Some(rows), "rows");
    let mut recording = Chunks::new(decided, context)?;
    let mut rejected = Rejections::new(decided.names, context)?;
    for (index, layout) in decided.settings.files.iter().enumerate() {
        file(decided, index, layout, (index < leading).then_some(&mut recording), &mut rejected, context)?;
    }
    Ok((recording.finish(context)?, rejected.finish()?))
}

fn file(
    decided: &Decided,
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
    let mut reading = Reading::open(source, layout, decided.arm, decided.settings.limits)?;
    let mut pace = Pace::new(context);
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

impl Decided<'_> {
    /// Why a usable row is not used after all, if so.
    fn outcome(&self, index: usize, fate: &Fate, row: &Row) -> Result<(), Refusal> {
        if let Some(twin) = u32::try_from(row.number).ok().and_then(|number| fate.twins.get(&number)) {
            let there =
                if twin.file as usize == index { String::new() } else { format!(" of {}", self.name(twin.file as usize)) };
            return Err(if twin.copied {
                let detail = format!("a copy of line {}{there}: the same id, the same values", twin.line);
                Refusal { reason: Reason::DuplicateRow, detail }
            } else {
                let detail = format!("point id `{}` also stands on line {}{there}", row.id, twin.line);
                Refusal { reason: Reason::DuplicateId, detail }
            });
        }
        if fate.is_whole(row.number as usize) {
            return Ok(());
        }
        let lacks = |partner: &Vec<u32>| partner.get((row.number - 1) as usize).is_none_or(|partner| *partner == NONE);
        let other = fate.partners.iter().position(lacks).unwrap_or_default();
        let other = if index == 0 { self.name(other + 1) } else { self.name(0) };
        Err(Refusal { reason: Reason::Unmatched, detail: self.lonely(other, index, row) })
    }
    /// The data row of file `file` that is part of a row of file `index`.
    fn number(&self, file: usize, index: usize, row: &Row, fate: &Fate) -> Option<u64> {
        if file == index {
            return Some(row.number);
        }
        let partner = fate.partners.get(file.checked_sub(1)?)?.get((row.number - 1) as usize)?;
        (*partner != NONE).then_some(u64::from(*partner))
    }
    /// When file `file` recorded its part of a row of the first file, s by the first one's clock.
    fn moment(&self, file: usize, row: &Row, fate: &Fate) -> Option<f64> {
        let time = Slot::Time.index(self.arm.joints());
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
    fn later(&self, moving: usize, row: &Row, fate: &Fate) -> Option<f64> {
        let point = self.settings.files.iter().position(|file| file.columns.x.is_some() || file.columns.distance.is_some())?;
        let later = self.moment(point, row, fate)? - self.moment(moving, row, fate)?;
        Some(later).filter(|later| later.is_finite())
    }
    fn name(&self, index: usize) -> &str {
        self.names.get(index).map_or("", String::as_str)
    }
    /// A row of file `index` has no partner in the file named `other`, or that none in a third.
    fn lonely(&self, other: &str, index: usize, row: &Row) -> String {
        let other = if index > 0 && self.names.len() > 2 { format!("{other} (joined to all files)") } else { other.into() };
        match &self.settings.join {
            Some(Join::Id {}) => format!("no usable row of {other} has the point id `{}`", row.id),
            Some(Join::Time { tolerance_s, .. }) => {
                let time = row.values.get(Slot::Time.index(self.arm.joints())).copied().unwrap_or(f64::NAN);
                format!("no row of {other} is its partner within {tolerance_s} s of {time} s")
            }
            _ => format!("data row {} of {other} is missing or rejected", row.number),
        }
    }
}

/// The texts of a row.
struct Texts<'a> {
    id: &'a str,
    usage: &'a str,
    target: &'a str,
    anchor: &'a str,
}

/// The recording, chunk by chunk.
struct Chunks<'a> {
    sink: Box<dyn Sink + 'a>,
    joints: usize,
    prismatic: Vec<bool>,
    /// Slots that some file fills: only those become columns.
    has: Vec<bool>,
    /// Whether some file names targets, anchors.
    named: [bool; 2],
    chunk: Recording,
    merged: Vec<f64>,
    /// The file with the joints.
    moving: usize,
    /// The farthest that joints were carried to the moment of their point, s.
    carried: f64,
    last_sequence: Option<i64>,
    written: u64,
    /// Data rows of the files before this one.
    before: u64,
}

impl<'a> Chunks<'a> {
    fn new(decided: &Decided, context: &Context<'a>) -> Result<Self> {
        let joints = decided.arm.joints();
        let mut has = vec![false; Slot::count(joints)];
        for slot in decided.scans.iter().flat_map(|scan| &scan.slots) {
            if let Some(has) = has.get_mut(*slot) {
                *has = true;
            }
        }
        let moving = decided.settings.files.iter().position(|file| file.columns.q.is_some()).unwrap_or_default();
        if decided.settings.motion.is_some() {
            (0..joints).for_each(|joint| has[Slot::Velocity(joint).index(joints)] = true);
        }
        let sink = context.services.sink(Recording::KIND)?;
        let names = |mapped: fn(&Columns) -> bool| decided.settings.files.iter().any(|file| mapped(&file.columns));
        let prismatic = decided.arm.prismatic.clone();
        let mut chunks = Self {
            sink,
            joints,
            prismatic,
            has,
            named: [names(|columns| columns.target.is_some()), names(|columns| columns.anchor.is_some())],
            chunk: Recording::default(),
            merged: Vec::new(),
            moving,
            carried: 0.0,
            last_sequence: None,
            written: 0,
            before: 0,
        };
        chunks.chunk = chunks.empty();
        Ok(chunks)
    }
    fn has(&self, slot: Slot) -> bool {
        self.has.get(slot.index(self.joints)).copied().unwrap_or(false)
    }
    fn empty(&self) -> Recording {
        Recording {
            joints: self.joints,
            prismatic: self.prismatic.clone(),
            position_sigma: self.has(Slot::Sigma(0)).then(Vec::new),
            simulated: self.has(Slot::Simulated(0)).then(Vec::new),
            time: self.has(Slot::Time).then(Vec::new),
            payload: self.has(Slot::Payload).then(Vec::new),
            temperature: self.has(Slot::Temperature).then(Vec::new),
            current: self.has(Slot::Current(0)).then(Vec::new),
            direction: self.has(Slot::Direction(0)).then(Vec::new),
            velocity: self.has(Slot::Velocity(0)).then(Vec::new),
            target: self.named[0].then(Vec::new),
            rotation: self.has(Slot::Turn(0)).then(Vec::new),
            rotation_sigma: self.has(Slot::SigmaTurn).then(Vec::new),
            distance: self.has(Slot::Distance).then(Vec::new),
            distance_sigma: self.has(Slot::SigmaDistance).then(Vec::new),
            anchor: self.named[1].then(Vec::new),
            ..Recording::default()
        }
    }
    fn push(&mut self, row: &Row, index: usize, fate: &Fate, decided: &Decided) -> Result<()> {
        let label = decided.scans.get(index).map_or("", |scan| scan.label.as_str());
        self.merged.clone_from(&row.values);
        let mut texts = Texts { id: &row.id, usage: &row.usage, target: &row.target, anchor: &row.anchor };
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
            if let Some(id) = packed.ids.get(at) {
                texts.id = id;
            }
            for (own, other) in
                [(&mut texts.usage, &packed.usage), (&mut texts.target, &packed.target), (&mut texts.anchor, &packed.anchor)]
            {
                if let Some(text) = other.get(at) {
                    *own = text;
                }
            }
        }
        self.carry(decided, index, row, fate);
        let number = self.before + row.number;
        let sequence = row.sequence.unwrap_or(number as i64);
        if let Some(last) = self.last_sequence.replace(sequence)
            && sequence <= last
        {
            // Within a file such a row is refused: this is the first row of a file that continues another.
            let message = format!("sequence {sequence} does not follow {last}, the last of the file before");
            return Err(Error::data(format!("{label}:{}", row.line), message));
        }
        let id = if texts.id.is_empty() { format!("row {number}") } else { texts.id.to_string() };
        self.store(sequence, id, &texts);
        if self.chunk.rows() >= CHUNK {
            self.flush()?;
        }
        Ok(())
    }
    fn store(&mut self, sequence: i64, id: String, texts: &Texts) {
        let named = |text: &str| (!text.is_empty()).then(|| text.to_string());
        let joints = self.joints;
        let (values, chunk) = (&self.merged, &mut self.chunk);
        let one = |slot: Slot| values[slot.index(joints)];
        let axes = |slot: fn(usize) -> Slot| [one(slot(0)), one(slot(1)), one(slot(2))];
        let all = |slot: fn(usize) -> Slot| (0..joints).map(move |joint| values[slot(joint).index(joints)]);
        chunk.sequence.push(sequence);
        chunk.point_id.push(id);
        chunk.usage.push(named(texts.usage));
        chunk.q.extend(all(Slot::Q));
        chunk.position.push(axes(Slot::Position));
        chunk.position_sigma.iter_mut().for_each(|column| column.push(axes(Slot::Sigma)));
        chunk.simulated.iter_mut().for_each(|column| column.push(axes(Slot::Simulated)));
        chunk.time.iter_mut().for_each(|column| column.push(one(Slot::Time)));
        chunk.payload.iter_mut().for_each(|column| column.push(one(Slot::Payload)));
        chunk.temperature.iter_mut().for_each(|column| column.push(one(Slot::Temperature)));
        chunk.current.iter_mut().for_each(|column| column.extend(all(Slot::Current)));
        chunk.direction.iter_mut().for_each(|column| column.extend(all(Slot::Direction)));
        chunk.velocity.iter_mut().for_each(|column| column.extend(all(Slot::Velocity)));
        chunk.target.iter_mut().for_each(|column| column.push(named(texts.target)));
        chunk.anchor.iter_mut().for_each(|column| column.push(named(texts.anchor)));
        chunk.rotation.iter_mut().for_each(|column| column.push(axes(Slot::Turn)));
        chunk.rotation_sigma.iter_mut().for_each(|column| column.push(one(Slot::SigmaTurn)));
        chunk.distance.iter_mut().for_each(|column| column.push(one(Slot::Distance)));
        chunk.distance_sigma.iter_mut().for_each(|column| column.push(one(Slot::SigmaDistance)));
        self.written += 1;
    }
    /// Velocities that follow from the joints over time; with a join by time joints and velocities at the moment of the point.
    fn carry(&mut self, decided: &Decided, index: usize, row: &Row, fate: &Fate) {
        let joints = self.joints;
        // Of files that continue each other each has its own joints.
        let moving = if fate.partners.is_empty() { index } else { self.moving };
        let track = decided.scans.get(moving).and_then(|scan| scan.track.as_ref()).zip(decided.number(moving, index, row, fate));
        let rates = Slot::Velocity(0).index(joints);
        if let (Some((track, number)), Some(_)) = (track, &decided.settings.motion)
            && let Some(velocity) = self.merged.get_mut(rates..rates + joints)
        {
            track.fill(number, velocity);
        }
        let apart = decided.later(moving, row, fate);
        let known = decided.settings.motion.as_ref().map_or(0.0, |motion| motion.later_s);
        let later = apart.unwrap_or(0.0) + known;
        if later == 0.0 {
            return;
        }
        for joint in 0..joints {
            let (q, rate) = (Slot::Q(joint).index(joints), Slot::Velocity(joint).index(joints));
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
        let empty = self.empty();
        let full = std::mem::replace(&mut self.chunk, empty);
        self.sink.push(full.to_frame()?)
    }
    fn finish(mut self, context: &Context) -> Result<StreamedTable<Recording>> {
        if self.chunk.rows() > 0 {
            self.flush()?;
        }
        if self.carried > 0.0 {
            let ms = 1e3 * self.carried;
            context
                .services
                .note(format!("joints were carried by their velocity to the moment of their point, over {ms:.2} ms at most"));
        }
        Ok(StreamedTable::new(self.sink.finish()?))
    }
}

/// The rejected rows, in the order of the table's key.
struct Rejections<'a> {
    sink: Box<dyn Sink + 'a>,
    rows: Vec<RejectedRow>,
    /// The files are read in the order of their names.
    ordered: bool,
}

impl<'a> Rejections<'a> {
    fn new(names: &[String], context: &Context<'a>) -> Result<Self> {
        Ok(Self { sink: context.services.sink(Rejected::KIND)?, rows: Vec::new(), ordered: names.is_sorted() })
    }
    fn push(&mut self, row: RejectedRow) -> Result<()> {
        self.rows.push(row);
        if self.ordered && self.rows.len() >= REJECTED_CHUNK { self.flush() } else { Ok(()) }
    }
    fn flush(&mut self) -> Result<()> {
        self.rows.sort_by(|a, b| (&a.file, a.line).cmp(&(&b.file, b.line)));
        self.sink.push(Rejected(std::mem::take(&mut self.rows)).to_frame()?)
    }
    fn finish(mut self) -> Result<StreamedTable<Rejected>> {
        // Also where nothing was rejected: a table without rows has its columns.
        self.flush()?;
        Ok(StreamedTable::new(self.sink.finish()?))
    }
}

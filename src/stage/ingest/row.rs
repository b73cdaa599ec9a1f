//! The quantities of one row, read from its record, or the reason why not.

use super::arm::{KindSlots, RobotJoints};
use super::bind::{Binding, NumberBinding, SupplyBinding, TextBinding};
use super::columns::LimitPolicy;
use super::refusal::{Reason, RowRefusal, refuse};
use super::stretch::{ALLOWED, ClockColumn, ClockTime};
use crate::raw::{DecimalMark, NumberFault, Record, decoded_text, number};
use crate::units::Unit;
use calib_numerics::robot::ONE_AND_A_HALF_TURNS;

/// Numbers of rows go up to here: the targets of wide rows have room beyond.
const LARGEST_SEQUENCE: i64 = 1 << 52;

/// The quantities of one row; reused from row to row.
#[derive(Default)]
pub(super) struct RecordedRow {
    /// Number of the data row in its file, from 1.
    pub number: u64,
    pub line: u64,
    /// Empty where there is none.
    pub id: String,
    /// By [`Slots::texts`]; empty where there is none.
    ///
    /// [`Slots::texts`]: super::arm::Slots::texts
    pub texts: Vec<String>,
    pub sequence: Option<i64>,
    /// SI, by the places of the arm's slots; NaN where missing.
    pub values: Vec<f64>,
    /// The point of each target of a wide row, SI; NaN where it was not seen.
    pub points: Vec<[f64; 3]>,
    /// The first joint beyond its limits, from 0.
    pub beyond: Option<usize>,
    /// The first revolute joint beyond one and a half turns, from 0, and its angle, rad; also where the row is refused.
    pub turned: Option<(usize, f64)>,
    /// Nothing stands in any of its fields.
    pub is_blank: bool,
}

impl RecordedRow {
    /// An empty one.
    pub(super) fn empty(arm: &RobotJoints) -> Self {
        let texts = vec![String::new(); arm.slots.texts().len()];
        Self {
            texts,
            values: vec![f64::NAN; arm.slots.count],
            ..Self::default()
        }
    }
}

/// Reads rows of one file.
pub(super) struct RowReader<'a> {
    pub binding: Binding,
    mark: DecimalMark,
    limits: LimitPolicy,
    arm: &'a RobotJoints,
    /// Sequence number of the last usable row.
    last_sequence: Option<i64>,
    clock: ClockColumn,
}

impl<'a> RowReader<'a> {
    pub(super) fn new(
        binding: Binding,
        mark: DecimalMark,
        limits: LimitPolicy,
        arm: &'a RobotJoints,
    ) -> Self {
        Self {
            binding,
            mark,
            limits,
            arm,
            last_sequence: None,
            clock: ClockColumn::default(),
        }
    }

    /// Fills `row` from a record; `row.id` is filled also where the row is refused for its numbers.
    pub(super) fn read(
        &mut self,
        record: &Record,
        row: &mut RecordedRow,
    ) -> Result<(), RowRefusal> {
        row.id.clear();
        row.points.clear();
        for place in &self.binding.worded {
            row.texts[*place].clear();
        }
        for place in &self.binding.filled {
            row.values[*place] = f64::NAN;
        }
        (row.sequence, row.beyond, row.turned) = (None, None, None);
        row.line = record.line;
        row.is_blank = record.is_blank(0);
        if let Some((fault, detail)) = &record.fault {
            return refuse((*fault).into(), detail.clone());
        }
        if row.is_blank {
            return refuse(Reason::Blank, "the whole row is blank".into());
        }
        let width = self.binding.width;
        let complete = record.len() >= width;
        text(&self.binding.id, record, "point_id", complete, &mut row.id)?;
        if !complete || !record.is_blank(width) {
            let reason = match complete {
                true => Reason::LongRow,
                false => Reason::ShortRow,
            };
            return refuse(reason, format!("{} fields; allowed: {width}", record.len()));
        }
        for place in &self.binding.worded {
            let (source, name) = (&self.binding.texts[*place], self.arm.slots.texts()[*place]);
            text(source, record, name, true, &mut row.texts[*place])?;
        }
        for (index, value) in &self.binding.constants {
            if let Some(slot) = row.values.get_mut(*index) {
                *slot = *value;
            }
        }
        if let Some((index, rate)) = self.binding.rated
            && let Some(slot) = row.values.get_mut(index)
        {
            *slot = row.number.saturating_sub(1) as f64 / rate;
        }
        self.numbers(record, row)?;
        self.motors(record, row)?;
        self.points(record, row)?;
        self.conventions(row)?;
        self.measured(row)?;
        self.plausible(row)?;
        if let Some(column) = self.binding.sequence {
            row.sequence = Some(self.sequence(record.field(column))?);
        }
        Ok(())
    }

    fn numbers(&mut self, record: &Record, row: &mut RecordedRow) -> Result<(), RowRefusal> {
        for cell in &self.binding.cells {
            let value = value(&mut self.clock, self.mark, record, cell)?;
            let Some(value) = value else { continue };
            let joint = cell.index.wrapping_sub(self.arm.slots.q.start);
            if self.arm.prismatic.get(joint) == Some(&false) && value.abs() > ONE_AND_A_HALF_TURNS {
                row.turned.get_or_insert((joint, value));
            }
            in_range(record, cell, value)?;
            if let Some(slot) = row.values.get_mut(cell.index) {
                *slot = value;
            }
        }
        let q = row.values.get_mut(self.arm.slots.q.clone());
        let q = q.unwrap_or_default();
        for (joint, by, ratio) in &self.binding.coupled {
            q[*joint] -= ratio * q[*by];
        }
        Ok(())
    }

    /// Torques of dc motors: those of their voltage less what the turning motor takes of it.
    fn motors(&mut self, record: &Record, row: &mut RecordedRow) -> Result<(), RowRefusal> {
        for motor in &self.binding.motors {
            let mut read = |cell: &NumberBinding| -> Result<Option<f64>, RowRefusal> {
                let found = value(&mut self.clock, self.mark, record, cell)?;
                found.map_or(Ok(()), |found| in_range(record, cell, found))?;
                Ok(found)
            };
            let Some(drive) = read(&motor.drive)? else {
                continue;
            };
            let supply = match &motor.supply {
                None => Some(1.0),
                Some(SupplyBinding::Volts(volts)) => Some(*volts),
                Some(SupplyBinding::Column(cell)) => read(cell)?,
            };
            let Some(supply) = supply else { continue };
            let taken = match motor.per_speed {
                0.0 => 0.0,
                per_speed => per_speed * row.values[motor.velocity],
            };
            row.values[motor.torque] = motor.per_volt * drive * supply - taken;
        }
        Ok(())
    }

    /// The points of a wide row: of a target that was not seen all cells are blank, or 0.
    fn points(&mut self, record: &Record, row: &mut RecordedRow) -> Result<(), RowRefusal> {
        for (target, cells) in &self.binding.points {
            let mut point = [f64::NAN; 3];
            for (number, cell) in point.iter_mut().zip(cells) {
                if let Some(found) = value(&mut self.clock, self.mark, record, cell)? {
                    in_range(record, cell, found)?;
                    *number = found;
                }
            }
            let blank = point.iter().filter(|value| value.is_nan()).count();
            if blank == 1 || blank == 2 {
                let detail = format!("the point of {target} is incomplete");
                return refuse(Reason::Blank, detail);
            }
            let was_seen = point != [0.0; 3];
            row.points
                .push(if was_seen { point } else { [f64::NAN; 3] });
        }
        Ok(())
    }

    /// Makes what a recording keeps of quantities of several numbers.
    fn conventions(&self, row: &mut RecordedRow) -> Result<(), RowRefusal> {
        for (places, declared, convention) in &self.binding.conventions {
            let Some(numbers) = row.values.get_mut(places.clone()) else {
                continue;
            };
            let given = &numbers[..convention.numbers];
            if given.iter().all(|number| number.is_nan()) {
                continue;
            }
            if given.iter().any(|number| number.is_nan()) {
                let detail = format!("the {} is incomplete", declared.setting);
                return refuse(Reason::OutOfRange, detail);
            }
            match (convention.read)(given) {
                Ok(kept) => {
                    numbers.fill(f64::NAN);
                    numbers[..kept.len()].copy_from_slice(&kept);
                }
                Err(detail) => return refuse(Reason::OutOfRange, detail),
            }
        }
        Ok(())
    }

    /// A row measured something, and what needs a standard deviation has one; of what this file holds.
    fn measured(&self, row: &RecordedRow) -> Result<(), RowRefusal> {
        let there = |index: &usize| row.values.get(*index).is_some_and(|value| !value.is_nan());
        let kinds = self.arm.slots.kinds.iter();
        let is_named = |kind: &KindSlots| {
            let name = kind.name.and_then(|name| row.texts.get(name));
            name.is_some_and(|name| !name.is_empty())
        };
        let is_there = |kind: &KindSlots| kind.values.iter().any(there) || is_named(kind);
        let seen = row.points.iter().any(|point| !point[0].is_nan()) || kinds.clone().any(is_there);
        if self.binding.measures && !seen {
            return refuse(Reason::Blank, "nothing was measured in this row".into());
        }
        for slots in kinds.filter(|slots| slots.own_sigma) {
            let KindSlots {
                kind,
                values,
                sigma,
                ..
            } = slots;
            let measured = values.iter().filter(|index| there(index)).count();
            let name = || kind.about().name;
            if measured > 0 && measured < values.len() {
                return refuse(Reason::Blank, format!("the {} is incomplete", name()));
            }
            if (measured > 0 || is_named(slots)) && !sigma.iter().all(there) {
                return refuse(
                    Reason::Blank,
                    format!("a measured {} without its standard deviation", name()),
                );
            }
        }
        Ok(())
    }

    fn plausible(&self, row: &mut RecordedRow) -> Result<(), RowRefusal> {
        // A tracker that lost its beam writes these as zero.
        if row.values.get(self.arm.slots.point.clone()) == Some(&[0.0; 3]) {
            return refuse(
                Reason::LostBeam,
                "the position is 0, 0, 0: the tracker saw nothing".into(),
            );
        }
        let q = row.values.get(self.arm.slots.q.clone()).unwrap_or_default();
        row.beyond = self.arm.first_beyond(q);
        if let Some(joint) = row.beyond.filter(|_| self.limits == LimitPolicy::Reject) {
            let (scale, unit) = self.arm.shown_in(joint);
            let [lower, upper] = self.arm.limits[joint];
            let [at, lower, upper] = [q[joint], lower, upper].map(|value| value * scale);
            let detail = format!(
                "joint {} at {at:.4} {unit}; allowed: {lower:.4} to {upper:.4} {unit}",
                joint + 1
            );
            return refuse(Reason::OutOfRange, detail);
        }
        Ok(())
    }

    fn sequence(&mut self, text: &[u8]) -> Result<i64, RowRefusal> {
        let shown = String::from_utf8_lossy(text);
        if text.is_empty() {
            return refuse(Reason::Blank, "sequence is blank".into());
        }
        let Ok(value) = shown.parse::<i64>() else {
            let detail = format!("sequence: `{shown}` is not a whole number");
            return refuse(Reason::NotANumber, detail);
        };
        if value.abs() > LARGEST_SEQUENCE {
            let detail =
                format!("sequence {value} is out of range; allowed: up to {LARGEST_SEQUENCE}");
            return refuse(Reason::OutOfRange, detail);
        }
        if let Some(last) = self.last_sequence.filter(|last| value <= *last) {
            let detail = format!("sequence {value} does not follow {last}");
            return refuse(Reason::OutOfOrder, detail);
        }
        self.last_sequence = Some(value);
        Ok(value)
    }
}

/// What a cell holds, SI; nothing where it may be blank and is.
#[inline]
fn value(
    clock: &mut ClockColumn,
    mark: DecimalMark,
    record: &Record,
    cell: &NumberBinding,
) -> Result<Option<f64>, RowRefusal> {
    let number = |column: usize, name: &str| match number(record.field(column), mark) {
        Ok(value) => Ok(Some(value)),
        Err(NumberFault::Blank) if cell.optional => Ok(None),
        Err(fault) => no_number(record, column, name, fault),
    };
    let found = match cell.is_clock {
        true => moment(clock, record, cell)?,
        false => number(cell.column, &cell.name)?,
    };
    let Some(found) = found else { return Ok(None) };
    let mut value = cell.unit.to_si(found);
    if let Some(other) = &cell.difference {
        let Some(added) = number(other.column, &other.name)? else {
            return Ok(None);
        };
        value += other.sign * other.unit.to_si(added);
    }
    Ok(Some(cell.sign * (value - cell.zero) / cell.divisor))
}

/// The clock time in a cell, s; nothing where it may be blank and is.
fn moment(
    clock: &mut ClockColumn,
    record: &Record,
    cell: &NumberBinding,
) -> Result<Option<f64>, RowRefusal> {
    let field = record.field(cell.column);
    match clock.read(field) {
        Some(seconds) => Ok(Some(seconds)),
        None if field.is_empty() && cell.optional => Ok(None),
        None if field.is_empty() => refuse(Reason::Blank, format!("{} is blank", cell.name)),
        None => {
            let (name, found) = (&cell.name, shown(record, cell.column));
            let message = format!("{name}: `{found}` is no clock time; allowed: {ALLOWED}");
            refuse(Reason::NotANumber, message)
        }
    }
}

/// Refuses a value (SI) that no recording may hold.
#[inline]
fn in_range(record: &Record, cell: &NumberBinding, value: f64) -> Result<(), RowRefusal> {
    let [lower, upper] = cell.range;
    let no_direction = cell.is_direction && ![-1.0, 0.0, 1.0].contains(&value);
    if (lower..=upper).contains(&value) && !no_direction {
        return Ok(());
    }
    let unit = cell.unit;
    let lower = if lower == -upper {
        cell.divisor * lower
    } else {
        lower
    };
    let [lower, upper] = [lower, cell.divisor * upper].map(|limit| round(unit.from_si(limit)));
    let allowed = match no_direction {
        true => "1, -1 or 0".to_string(),
        false if unit == Unit::One => format!("{lower} to {upper}"),
        false => format!("{lower} to {upper} {unit}"),
    };
    let (name, text) = (&cell.name, shown(record, cell.column));
    let found = match &cell.difference {
        None => format!("{name}: `{text}`"),
        Some(other) => {
            let sign = if other.sign < 0.0 { "-" } else { "+" };
            let (second, difference) = (&other.name, shown(record, other.column));
            format!("{name} {sign} {second}: `{text}` {sign} `{difference}`")
        }
    };
    Err(RowRefusal {
        misread: unit
            .misread(value, cell.range)
            .filter(|_| !no_direction)
            .map(|unit| (cell.unit_setting, unit)),
        ..RowRefusal::new(Reason::OutOfRange, format!("{found}; allowed: {allowed}"))
    })
}

#[cold]
fn no_number<T>(
    record: &Record,
    column: usize,
    name: &str,
    fault: NumberFault,
) -> Result<T, RowRefusal> {
    let is_clock = ClockTime::parse(record.field(column)).is_some();
    let why = match fault {
        NumberFault::Blank => return refuse(Reason::Blank, format!("{name} is blank")),
        NumberFault::Text if is_clock => {
            "is a clock time, not a number; `unit: clock` reads such times"
        }
        NumberFault::Text => "is not a number",
        NumberFault::Comma => "has a decimal comma; allowed: `decimal: comma` in the settings",
        NumberFault::Point => "has a decimal point; allowed: `decimal: point` in the settings",
        NumberFault::NotFinite => "is not a finite number",
    };
    let shown = shown(record, column);
    refuse(Reason::NotANumber, format!("{name}: `{shown}` {why}"))
}

/// A field for people, cut at 40 characters.
fn shown(record: &Record, column: usize) -> String {
    crate::raw::shown(record.field(column))
        .chars()
        .take(40)
        .collect()
}

fn round(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

fn text(
    source: &Option<TextBinding>,
    record: &Record,
    name: &str,
    complete: bool,
    into: &mut String,
) -> Result<(), RowRefusal> {
    let (column, mapped) = match source {
        None => return Ok(()),
        Some(TextBinding::Value(value)) => {
            into.push_str(value);
            return Ok(());
        }
        Some(TextBinding::Column(column, mapped)) => (*column, mapped),
    };
    let Some(text) = decoded_text(record.field(column)) else {
        let detail = format!("{name} is neither UTF-8 nor Windows-1252 text");
        return refuse(Reason::NotText, detail);
    };
    if text.is_empty() {
        return match mapped.optional || !complete {
            true => Ok(()),
            false => refuse(Reason::Blank, format!("{name} is blank")),
        };
    }
    let Some(counts) = mapped.counts(&text) else {
        let detail = format!("{name}: `{text}` holds no number, and `match: number` asks for one");
        return refuse(Reason::NotANumber, detail);
    };
    into.push_str(counts);
    Ok(())
}

//! From the columns that the settings name to the columns that a file has.

use super::arm::{KindSlots, RobotJoints};
use super::columns::{Columns, FileLayout, WideTargets};
use super::mapped::{
    ColumnRef, JointColumns, JointNames, PerJoint, ScalarColumn, Supply, TextColumn,
};
use super::stretch::CLOCK;
use crate::error::{Error, Fault, Result, counted, did_you_mean, first_of};
use crate::observation::{Convention, DeclaredColumn};
use crate::table::recording_columns;
use crate::units::{Quantity, Unit};
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::ops::Range;

/// Names in an error message; a header of thousands must not fill the screen.
const SHOWN: usize = 60;

/// Where a file's quantities stand, resolved against its header.
#[derive(Default)]
pub(super) struct Binding {
    pub width: usize,
    pub id: Option<TextBinding>,
    /// In the order of the row's texts.
    pub texts: Vec<Option<TextBinding>>,
    /// Those that the file has.
    pub worded: Vec<usize>,
    /// Quantities of several numbers: where they are, and how they are read.
    pub conventions: Vec<(Range<usize>, &'static DeclaredColumn, &'static Convention)>,
    /// Whether the file has what a kind of measurement measured.
    pub measures: bool,
    pub sequence: Option<usize>,
    pub cells: Vec<NumberBinding>,
    /// The point of each target of a wide row.
    pub points: Vec<(String, [NumberBinding; 3])>,
    /// Numbers that are the same in every row, SI.
    pub constants: Vec<(usize, f64)>,
    /// The place of a time that is the row's number over a rate, Hz.
    pub rated: Option<(usize, f64)>,
    /// Torques of dc motors.
    pub motors: Vec<MotorBinding>,
    /// Joints (from 0) from which so many times another one is taken off.
    pub coupled: Vec<(usize, usize, f64)>,
    /// Places of a row's numbers that may be filled, ascending.
    pub filled: Vec<usize>,
    /// Optional columns that the file does not have, for a note.
    pub missing: Vec<String>,
}

/// Text from a column, or for every row the same.
pub(super) enum TextBinding {
    Column(usize, TextColumn),
    Value(String),
}

pub(super) struct NumberBinding {
    /// Place in a row's numbers.
    pub index: usize,
    pub column: usize,
    pub unit: Unit,
    /// What a recording may hold, SI.
    pub range: [f64; 2],
    /// A direction: 1, -1 or 0.
    pub is_direction: bool,
    pub optional: bool,
    /// What the file's number is divided by: how many standard deviations an uncertainty is.
    pub divisor: f64,
    /// What is taken off, SI, and the sign of what remains.
    pub zero: f64,
    pub sign: f64,
    /// The column, as people call it: `x_mm`, or `column 4`.
    pub name: String,
    pub difference: Option<Difference>,
    /// Whether it holds clock times as text.
    pub is_clock: bool,
    /// The setting that states its unit.
    pub unit_setting: &'static str,
}

/// The torque of a dc motor by its voltage, which is a duty times a supply where one is.
pub(super) struct MotorBinding {
    /// Places of torque and velocity in a row's numbers.
    pub torque: usize,
    pub velocity: usize,
    /// The voltage, or the duty.
    pub drive: NumberBinding,
    pub supply: Option<SupplyBinding>,
    /// Nm/V.
    pub per_volt: f64,
    /// Nm s/rad.
    pub per_speed: f64,
}

/// Volts.
pub(super) enum SupplyBinding {
    Volts(f64),
    Column(NumberBinding),
}

/// V: no motor of an arm has more.
const MOST_VOLTS: f64 = 2e3;

/// A column whose numbers are added to those of another, times the sign.
pub(super) struct Difference {
    pub column: usize,
    pub sign: f64,
    pub unit: Unit,
    pub name: String,
}

impl Binding {
    /// What follows from the columns that were found.
    fn settle(&mut self, arm: &RobotJoints, is_wide: bool) {
        let kept = self.conventions.iter();
        let kept = kept.flat_map(|(places, ..)| places.clone());
        let filled: BTreeSet<usize> = self.slots().into_iter().chain(kept).collect();
        self.filled = filled.into_iter().collect();
        let places = 0..self.texts.len();
        self.worded = places
            .filter(|place| self.texts[*place].is_some())
            .collect();
        let is_named = |kind: &KindSlots| kind.name.is_some_and(|name| self.worded.contains(&name));
        let is_read = |kind: &KindSlots| {
            let mut cells = self.cells.iter();
            cells.any(|cell| kind.values.contains(&cell.index))
        };
        let mut kinds = arm.slots.kinds.iter();
        self.measures = is_wide || kinds.any(|kind| is_named(kind) || is_read(kind));
    }
    /// Columns that are read, and whether a row may lack them.
    pub(super) fn columns(&self) -> Vec<(usize, bool)> {
        let texts = self.id.iter().chain(self.texts.iter().flatten());
        let texts = texts.filter_map(|text| match text {
            TextBinding::Column(column, text) => Some((*column, !text.optional)),
            TextBinding::Value(_) => None,
        });
        let numbers = self.cells.iter().flat_map(|cell| {
            let other = cell.difference.as_ref().map(|other| other.column);
            let columns = [Some(cell.column), other].into_iter().flatten();
            columns.map(|column| (column, !cell.optional))
        });
        let supplies = self.motors.iter().filter_map(|motor| match &motor.supply {
            Some(SupplyBinding::Column(cell)) => Some((cell.column, true)),
            _ => None,
        });
        let drives = self.motors.iter();
        let drives = drives.map(|motor| (motor.drive.column, !motor.drive.optional));
        let numbers = numbers.chain(drives).chain(supplies);
        let points = self.points.iter().flat_map(|(_, cells)| cells);
        let others = points.map(|cell| cell.column).chain(self.sequence);
        let others = others.map(|column| (column, true));
        texts.chain(numbers).chain(others).collect()
    }
    /// Slots that this file fills.
    pub(super) fn slots(&self) -> Vec<usize> {
        let cells = self.cells.iter().map(|cell| cell.index);
        let constants = self.constants.iter().map(|constant| constant.0);
        let rated = self.rated.iter().map(|rated| rated.0);
        let motors = self.motors.iter().map(|motor| motor.torque);
        cells.chain(constants).chain(rated).chain(motors).collect()
    }
}

/// The names of a file's columns, if it has a header, else how many there are.
pub(super) struct FileHeader {
    pub label: String,
    /// Line of the header, or of the first data row.
    pub line: u64,
    pub width: usize,
    pub names: Option<Vec<String>>,
}

struct Binder<'a> {
    head: &'a FileHeader,
    binding: Binding,
    faults: Vec<Fault>,
}

/// Resolves every mapped column, or reports all that are missing.
pub(super) fn bind(layout: &FileLayout, head: &FileHeader, arm: &RobotJoints) -> Result<Binding> {
    let binding = Binding {
        width: head.width,
        texts: arm.slots.texts().iter().map(|_| None).collect(),
        ..Binding::default()
    };
    let mut binder = Binder {
        head,
        binding,
        faults: Vec::new(),
    };
    let columns = &layout.columns;
    for (declared, text) in columns.texts() {
        let setting = declared.setting;
        let value = text.value.clone().map(TextBinding::Value);
        let bound = value.or_else(|| {
            let column = binder.column(text.column.as_ref()?, setting, text.optional)?;
            Some(TextBinding::Column(column, text.clone()))
        });
        let texts = arm.slots.texts();
        match texts.iter().position(|name| *name == setting) {
            Some(at) => binder.binding.texts[at] = bound,
            None => binder.binding.id = bound,
        }
    }
    if let Some(sequence) = columns.count("sequence") {
        binder.binding.sequence = binder.column(&sequence.column, "sequence", false);
    }
    for (declared, scalar) in columns.numbers() {
        let is_clock = scalar.unit.as_deref() == Some(CLOCK);
        let unit = match is_clock {
            true => Unit::Second,
            false => unit(scalar.unit.as_deref())?,
        };
        let index = arm.slots.of(declared.setting).start;
        if let Some(rate) = scalar.rate {
            binder.binding.rated = Some((index, rate));
        } else if let Some(value) = scalar.value {
            binder.binding.constants.push((index, unit.to_si(value)));
        } else if let Some(reference) = &scalar.column
            && let Some(column) = binder.column(reference, declared.setting, scalar.optional)
        {
            let difference = binder.difference(scalar, declared.setting)?;
            let cell = binder.cell(declared, false, index, column, unit);
            binder.binding.cells.push(NumberBinding {
                optional: scalar.optional,
                difference,
                is_clock,
                ..cell
            });
        }
    }
    binder.uncertainties(columns, arm)?;
    for (declared, conventions, mapped) in columns.conventions() {
        let Some((convention, references)) = mapped.chosen(conventions) else {
            continue;
        };
        let unit = unit(mapped.unit.as_deref())?;
        let places = arm.slots.of(declared.setting);
        for (index, reference) in places.clone().zip(references) {
            if let Some(column) = binder.column(reference, declared.setting, false) {
                let cell = binder.cell(declared, false, index, column, unit);
                binder.binding.cells.push(NumberBinding {
                    optional: mapped.optional,
                    ..cell
                });
            }
        }
        let found = (places, declared, convention);
        binder.binding.conventions.push(found);
    }
    for (declared, mapped) in columns.joints() {
        binder.joints(declared, mapped, arm)?;
    }
    if let Some(targets) = &layout.targets {
        binder.points(targets)?;
    }
    binder.binding.settle(arm, layout.targets.is_some());
    let found = binder.found();
    if let Some(last) = binder.faults.last_mut() {
        last.message.push_str(&found);
    }
    Error::if_data(binder.faults).map(|()| binder.binding)
}

fn unit(symbol: Option<&str>) -> Result<Unit> {
    let Some(symbol) = symbol else {
        return Ok(Unit::One);
    };
    Unit::parse(symbol).ok_or_else(|| Error::Bug(format!("unchecked unit {symbol}")))
}

impl Binder<'_> {
    fn fault(&mut self, message: String) {
        let FileHeader { label, line, .. } = self.head;
        // Column names of a Parquet file stand on no line.
        let place = match line {
            0 => label.clone(),
            line => format!("{label}:{line}"),
        };
        self.faults.push(Fault::new(place, message));
    }
    fn name(&self, column: usize) -> String {
        let names = self.head.names.as_ref();
        match names.and_then(|names| names.get(column)) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("column {}", column + 1),
        }
    }
    fn find(&self, reference: &ColumnRef) -> Vec<usize> {
        match reference {
            ColumnRef::Number(number) => {
                let index = (*number as usize).checked_sub(1);
                let index = index.filter(|index| *index < self.head.width);
                index.into_iter().collect()
            }
            ColumnRef::Name(name) => {
                let names = self.head.names.iter().flatten().enumerate();
                let named = names.filter(|(_, found)| *found == name.trim());
                named.map(|(index, _)| index).collect()
            }
        }
    }
    fn column(&mut self, reference: &ColumnRef, quantity: &str, optional: bool) -> Option<usize> {
        let found = self.find(reference);
        match found.as_slice() {
            [column] => return Some(*column),
            [] if optional => self
                .binding
                .missing
                .push(format!("no {reference}; `{quantity}` is left out")),
            [] => {
                let hint = self.hint(reference);
                self.fault(format!("no {reference}, mapped to `{quantity}`{hint}"));
            }
            [first, second, ..] => {
                let (first, second) = (first + 1, second + 1);
                self.fault(format!(
                    "{reference}, mapped to `{quantity}`, stands twice in the header ({first} and {second}); name it by number"
                ));
            }
        }
        None
    }
    fn difference(&mut self, scalar: &ScalarColumn, quantity: &str) -> Result<Option<Difference>> {
        let Some((reference, sign)) = scalar.difference() else {
            return Ok(None);
        };
        let unit = unit(scalar.difference_unit.as_deref().or(scalar.unit.as_deref()))?;
        let column = self.column(reference, quantity, false);
        Ok(column.map(|column| Difference {
            column,
            sign,
            unit,
            name: self.name(column),
        }))
    }
    fn hint(&self, reference: &ColumnRef) -> String {
        match (reference, &self.head.names) {
            (ColumnRef::Name(name), Some(names)) => {
                did_you_mean(name, names.iter().map(String::as_str))
            }
            _ => format!("; the file has {}", counted(self.head.width, "column")),
        }
    }
    /// What stands in the header, for the last fault of the list.
    fn found(&self) -> String {
        let Some(names) = &self.head.names else {
            return String::new();
        };
        let mut text = format!("; found: {}", first_of(names, SHOWN));
        let is_number = |name: &String| name.replace(',', ".").parse::<f64>().is_ok();
        let mut marks = [";", "\t", ",", "|"].into_iter();
        if let [only] = names.as_slice()
            && let Some(mark) = marks.find(|mark| only.contains(mark))
        {
            let mark = if mark == "\t" { "tab" } else { mark };
            text.push_str(&format!(" (one column; `delimiter: \"{mark}\"`?)"));
        } else if names.iter().all(is_number) {
            text.push_str(" (all numbers; `header: false`?)");
        }
        text
    }
    /// Uncertainties, each as the standard deviations that it stands for.
    fn uncertainties(&mut self, columns: &Columns, arm: &RobotJoints) -> Result<()> {
        for (declared, mapped, own_columns, divisor) in columns.uncertainties() {
            let unit = unit(mapped.unit.as_deref())?;
            let places = own_columns.iter();
            let places = places.map(|setting| arm.slots.of(setting).start);
            if let Some(value) = mapped.value {
                let value = unit.to_si(value) / divisor;
                let all = places.map(|index| (index, value));
                self.binding.constants.extend(all);
            } else if let Some(reference) = &mapped.column
                && let Some(column) = self.column(reference, declared.setting, mapped.optional)
            {
                for index in places {
                    let cell = self.cell(declared, false, index, column, unit);
                    self.binding.cells.push(NumberBinding {
                        optional: mapped.optional,
                        divisor,
                        ..cell
                    });
                }
            }
        }
        Ok(())
    }
    /// The points of a wide row.
    fn points(&mut self, targets: &WideTargets) -> Result<()> {
        let unit = unit(Some(&targets.unit))?;
        let axes =
            ["x", "y", "z"].map(|axis| recording_columns().find(|column| column.setting == axis));
        let [Some(x), Some(y), Some(z)] = axes else {
            return Err(Error::Bug("a recording without points".into()));
        };
        for (target, references) in &targets.columns {
            let references = references.each_ref();
            let found = references.map(|reference| self.column(reference, target, false));
            if let [Some(a), Some(b), Some(c)] = found {
                let cells = [(x, a), (y, b), (z, c)].map(|(declared, column)| NumberBinding {
                    optional: true,
                    ..self.cell(declared, false, usize::MAX, column, unit)
                });
                self.binding.points.push((target.clone(), cells));
            }
        }
        Ok(())
    }
    /// A cell that may not be blank.
    fn cell(
        &self,
        declared: &DeclaredColumn,
        is_prismatic: bool,
        index: usize,
        column: usize,
        unit: Unit,
    ) -> NumberBinding {
        NumberBinding {
            index,
            column,
            unit,
            range: declared.of_joint(is_prismatic).1,
            is_direction: declared.setting == "direction",
            optional: false,
            divisor: 1.0,
            zero: 0.0,
            sign: 1.0,
            name: self.name(column),
            difference: None,
            is_clock: false,
            unit_setting: "unit",
        }
    }
    fn joints(
        &mut self,
        declared: &DeclaredColumn,
        joints: &JointColumns,
        arm: &RobotJoints,
    ) -> Result<()> {
        let name = declared.setting;
        let (count, all) = (arm.joints(), counted(arm.joints(), "joint"));
        let numbered = |pattern: &str, joint: usize| {
            let called = arm.names.get(joint).map_or("", String::as_str);
            let name = pattern.replace("{j}", &(joint + 1).to_string());
            ColumnRef::Name(name.replace("{name}", called))
        };
        let drive = joints.drive().map(|(names, _)| names);
        let by_pattern =
            |pattern: &String| (0..count).map(|joint| numbered(pattern, joint)).collect();
        let references: Vec<ColumnRef> = match (drive, &joints.columns, &joints.column) {
            (Some(JointNames::List(list)), ..) | (None, Some(list), _) => list.clone(),
            (Some(JointNames::Pattern(pattern)), ..) | (None, None, Some(pattern)) => {
                by_pattern(pattern)
            }
            (None, None, None) => return Err(Error::Bug("unchecked joint columns".into())),
        };
        if references.len() != count {
            let found = counted(references.len(), "column");
            self.fault(format!("`{name}` lists {found}; the robot has {all}"));
            return Ok(());
        }
        if !self.are_of_the_robot(joints, name, count) {
            return Ok(());
        }
        let pattern = match drive {
            Some(JointNames::Pattern(pattern)) => Some(pattern),
            Some(JointNames::List(_)) => None,
            None => joints.column.as_ref(),
        };
        if let Some(pattern) = pattern.filter(|pattern| pattern.contains("{j}")) {
            let next = ColumnRef::Name(pattern.replace("{j}", &(count + 1).to_string()));
            if !self.find(&next).is_empty() {
                self.fault(format!(
                    "{next}, by the pattern of `{name}`: the robot has {all} only"
                ));
                return Ok(());
            }
        }
        let is_there = |reference: &&ColumnRef| !self.find(reference).is_empty();
        let there = references.iter().filter(is_there).count();
        if there == 0 && joints.optional {
            let first = references.first().map(ToString::to_string);
            let first = first.unwrap_or_default();
            let missing = format!("no {first} and so on; `{name}` is left out");
            self.binding.missing.push(missing);
            return Ok(());
        }
        if there > 0 && there < count {
            self.fault(format!(
                "`{name}` has {there} of its columns; the robot has {all}"
            ));
        }
        if drive.is_some() {
            return self.motors(declared, joints, &references, arm);
        }
        for (joint, reference) in references.iter().enumerate() {
            let is_prismatic = arm.prismatic.get(joint).copied().unwrap_or(false);
            let linear = is_prismatic && declared.of_joint(true).0 != declared.quantity;
            let (symbol, kind, setting) = match linear {
                true => (&joints.linear_unit, "prismatic", "linear_unit"),
                false => (&joints.unit, "revolute", "unit"),
            };
            let counts = joints.counts_per_turn.filter(|_| !linear);
            let symbol = match (counts, declared.quantity) {
                (None, _) => symbol.as_deref(),
                (Some(_), Quantity::Angle) => Some("rad"),
                (Some(_), _) => Some("rad/s"),
            };
            if symbol.is_none() && declared.quantity != Quantity::Number {
                let number = joint + 1;
                self.fault(format!(
                    "joint {number} is {kind}; say `{setting}` for `{name}`"
                ));
                continue;
            }
            let unit = unit(symbol)?;
            if let Some(column) = self.column(reference, name, false) {
                let index = arm.slots.of(name).start + joint;
                let cell = self.cell(declared, is_prismatic, index, column, unit);
                let sign = joints.sign.get(joint).copied().unwrap_or(1.0);
                let zero = joints.zero.get(joint).map_or(0.0, |zero| unit.to_si(*zero));
                self.binding.cells.push(NumberBinding {
                    optional: joints.optional,
                    sign,
                    zero,
                    divisor: counts.map_or(1.0, |counts| counts / TAU),
                    unit_setting: setting,
                    ..cell
                });
            }
        }
        let coupled = joints.coupled.iter();
        let coupled = coupled.map(|one| (one.joint - 1, one.by - 1, one.ratio));
        self.binding.coupled.extend(coupled);
        Ok(())
    }
    /// Torques of dc motors, by the columns of what drives them.
    fn motors(
        &mut self,
        declared: &DeclaredColumn,
        joints: &JointColumns,
        references: &[ColumnRef],
        arm: &RobotJoints,
    ) -> Result<()> {
        let (torque, velocity) = (arm.slots.of("torque").start, arm.slots.of("velocity").start);
        let (count, all) = (references.len(), counted(references.len(), "joint"));
        for (setting, numbers) in [
            ("kt_over_r", &joints.kt_over_r),
            ("kt2_over_r", &joints.kt2_over_r),
        ] {
            if let Some(PerJoint::Each(each)) = numbers
                && each.len() != count
            {
                let given = counted(each.len(), "number");
                self.fault(format!(
                    "`torque.{setting}` lists {given}; the robot has {all}"
                ));
            }
        }
        let full = joints.full_duty.unwrap_or(1.0);
        for (joint, reference) in references.iter().enumerate() {
            let Some(column) = self.column(reference, "torque", false) else {
                continue;
            };
            let cell = |binder: &Self, column, divisor, range| NumberBinding {
                range,
                divisor,
                optional: joints.optional,
                sign: joints.sign.get(joint).copied().unwrap_or(1.0),
                ..binder.cell(declared, false, torque + joint, column, Unit::One)
            };
            let (divisor, range) = match joints.duty.is_some() {
                true => (full, [-1.0, 1.0]),
                false => (1.0, [-MOST_VOLTS, MOST_VOLTS]),
            };
            let drive = cell(self, column, divisor, range);
            let supply = match &joints.supply {
                None => None,
                Some(Supply::Volts(volts)) => Some(SupplyBinding::Volts(*volts)),
                Some(Supply::Column(supply)) => {
                    let Some(column) = self.column(&supply.column, "torque", false) else {
                        continue;
                    };
                    let divisor = 1.0 / supply.scale.unwrap_or(1.0);
                    Some(SupplyBinding::Column(NumberBinding {
                        sign: 1.0,
                        ..cell(self, column, divisor, [f64::MIN_POSITIVE, MOST_VOLTS])
                    }))
                }
            };
            let of = |numbers: &Option<PerJoint>| numbers.as_ref().and_then(|all| all.of(joint));
            self.binding.motors.push(MotorBinding {
                torque: torque + joint,
                velocity: velocity + joint,
                drive,
                supply,
                per_volt: of(&joints.kt_over_r).unwrap_or(1.0),
                per_speed: of(&joints.kt2_over_r).unwrap_or(0.0),
            });
        }
        Ok(())
    }
    /// Whether signs, zeros and couplings are those of this robot's joints.
    fn are_of_the_robot(&mut self, joints: &JointColumns, name: &str, count: usize) -> bool {
        let (before, all) = (self.faults.len(), counted(count, "joint"));
        for (list, given) in [("sign", joints.sign.len()), ("zero", joints.zero.len())] {
            if given > 0 && given != count {
                let given = counted(given, "number");
                self.fault(format!(
                    "`{name}.{list}` lists {given}; the robot has {all}"
                ));
            }
        }
        let mut coupled = joints.coupled.iter();
        if coupled.any(|one| one.joint.max(one.by) > count) {
            self.fault(format!(
                "`{name}.coupled` names a joint beyond the last; the robot has {all}"
            ));
        }
        self.faults.len() == before
    }
}

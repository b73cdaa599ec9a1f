//! Which column of the targets holds what, by its name: `q1_deg`, `A1_deg`, `x_mm`, `qw`, `a_deg`, `payload_kg`, `temp_c`, `dir1`, ...

use super::Layout;
use crate::compensate::{CommandTarget, Stated, turns, unstated_payload};
use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Fault, Result, counted, listed};
use crate::robot::{Bound, ONE_AND_A_HALF_TURNS};
use crate::units::{Header, Quantity, Unit};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// What a column holds; joints and axes from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ColumnRole {
    Joint(usize),
    Velocity(usize),
    Acceleration(usize),
    Axis(usize),
    /// w, x, y, z.
    Quaternion(usize),
    /// A about z, then B about the new y, then C about the new x.
    Turn(usize),
    Payload,
    Temperature,
    Time,
    Direction(usize),
    Current(usize),
}

impl ColumnRole {
    /// Whether a target without it is none.
    pub fn is_needed(self) -> bool {
        matches!(
            self,
            Self::Joint(_) | Self::Axis(_) | Self::Quaternion(_) | Self::Turn(_)
        )
    }
    /// What is wrong with a number of the column by itself.
    pub fn fault(self, value: f64) -> Option<String> {
        match self {
            Self::Payload => Stated::Payload.fault(value),
            Self::Temperature => Stated::Temperature.fault(value),
            Self::Direction(_) => Stated::Direction.fault(value),
            _ => None,
        }
    }
}

/// A column that is read: its place in a row, what it holds, and a unit of its numbers or what one is in SI.
pub(super) type ReadColumn<U> = (usize, ColumnRole, U);

/// The columns with a meaning, and what is wrong with their names; none has the meaning of another.
pub(super) fn read_columns<U>(
    place: &str,
    names: &[String],
    meaning: impl Fn(&str) -> Result<Option<(ColumnRole, U)>, String>,
) -> (Vec<ReadColumn<U>>, Vec<Fault>) {
    let (mut columns, mut faults) = (Vec::<ReadColumn<U>>::new(), Vec::new());
    for (index, name) in names.iter().enumerate() {
        match meaning(name) {
            Ok(Some((role, _))) if columns.iter().any(|(_, known, _)| *known == role) => {
                let message = format!("column `{name}` repeats what another column gives");
                faults.push(Fault::new(place, message));
            }
            Ok(found) => columns.extend(found.map(|(role, unit)| (index, role, unit))),
            Err(message) => faults.push(Fault::new(place, message)),
        }
    }
    (columns, faults)
}

/// Units of columns whose names do not end in one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Units {
    /// Unit of angles whose column names none.
    pub angle: Option<Unit>,
    /// Unit of lengths whose column names none.
    pub length: Option<Unit>,
}

/// The columns of a file of targets.
#[derive(Debug, Clone)]
pub(super) struct TargetColumns {
    pub count: usize,
    pub read: Vec<ReadColumn<Unit>>,
    /// Column and unit of each joint; empty where joints are not given.
    pub joints: Vec<(usize, Unit)>,
    pub point: bool,
    pub quaternion: bool,
    /// A, B, C.
    pub turns: bool,
}

/// What columns of joints may be called beside the robot's own names.
const JOINT_NAMES: [&str; 4] = ["q", "a", "j", "joint"];

impl TargetColumns {
    /// Reads the header; fails where it names no whole target, or a unit is missing.
    pub fn read(
        place: &str,
        header: &[String],
        robot: &RobotDescription,
        units: Units,
    ) -> Result<Self> {
        let (columns, mut faults) = read_columns(place, header, |name| role(name, robot, units));
        let mut fault = |message: String| faults.push(Fault::new(place, message));
        let n = robot.joints.len();
        let of = |wanted: ColumnRole| columns.iter().find(|(_, role, _)| *role == wanted);
        let joint = |j: usize| of(ColumnRole::Joint(j)).map(|found| (found.0, found.2));
        let joints: Vec<(usize, Unit)> = (0..n).filter_map(joint).collect();
        let count = |role: fn(usize) -> ColumnRole, most: usize| {
            (0..most).filter(|k| of(role(*k)).is_some()).count()
        };
        let point = count(ColumnRole::Axis, 3);
        let quaternion = count(ColumnRole::Quaternion, 4);
        let turns = count(ColumnRole::Turn, 3);
        if !joints.is_empty() && joints.len() < n {
            let missing = (0..n).filter(|j| joint(*j).is_none());
            let missing = listed(missing.map(|j| format!("q{}", j + 1)));
            fault(format!(
                "has no column for {missing} of the robot's {n} joints"
            ));
        }
        for (found, whole, what) in [
            (point, 3, "x, y, z"),
            (quaternion, 4, "qw, qx, qy, qz"),
            (turns, 3, "a, b, c"),
        ] {
            if found != 0 && found != whole {
                fault(format!("has only {found} of the columns {what}"));
            }
        }
        if faults.is_empty() && joints.is_empty() && point == 0 {
            let names: Vec<String> = header
                .iter()
                .take(12)
                .map(|name| format!("`{name}`"))
                .collect();
            let names = names.join(", ");
            faults.push(Fault::new(
                place,
                format!("no targets found in the columns {names}; expected q1_deg..q{n}_deg (joints), or x_mm, y_mm, z_mm with qw, qx, qy, qz or a_deg, b_deg, c_deg, in a header line"),
            ));
        }
        Error::if_spec(faults)?;
        Ok(Self {
            count: header.len(),
            read: columns,
            joints,
            point: point == 3,
            quaternion: quaternion == 4,
            turns: turns == 3,
        })
    }
}

/// What the column of this name holds in which unit; none where it holds nothing of a target.
fn role(
    name: &str,
    robot: &RobotDescription,
    units: Units,
) -> Result<Option<(ColumnRole, Unit)>, String> {
    let lower = name.trim().to_lowercase();
    let named = |text: &str| {
        robot
            .joints
            .iter()
            .position(|joint| joint.name.to_lowercase() == text)
    };
    // Of a joint called `joint_1_s` the `s` is no unit.
    let whole = Header {
        stem: &lower,
        unit: None,
        ending: None,
    };
    let Header { stem, unit, ending } = if named(&lower).is_some() {
        whole
    } else {
        Header::of(&lower)
    };
    let of_quantity =
        |quantity: Quantity, otherwise: Option<Unit>, option: &str| match unit.or(otherwise) {
            Some(unit) if unit.quantity() == quantity => Ok(Some(unit)),
            // A letter behind the name is a word then: the point C of `x_c`.
            Some(_) if ending.is_some_and(|ending| ending.len() == 1) => Ok(None),
            Some(unit) => Err(format!(
                "column `{name}`: {unit} is no unit of it; allowed: {}",
                Unit::symbols(quantity).join(", ")
            )),
            None => Err(format!(
                "column `{name}` has no unit; call it e.g. `{stem}_{}`, or give {option}",
                option.rsplit(' ').next().unwrap_or_default()
            )),
        };
    let numbered = |prefix: &str| {
        stem.strip_prefix(prefix)
            .and_then(|number| number.parse::<usize>().ok())
            .filter(|n| (1..=robot.joints.len()).contains(n))
    };
    let angle = || of_quantity(Quantity::Angle, units.angle, "--angle deg");
    let length = || of_quantity(Quantity::Length, units.length, "--length mm");
    let place = |names: &[&str]| names.iter().position(|name| *name == stem);
    let of_prefix = || JOINT_NAMES.iter().find_map(|prefix| numbered(prefix));
    if let Some(joint) = named(stem).or_else(|| Some(of_prefix()? - 1)) {
        let unit = match robot.joints[joint].kind {
            JointKind::Revolute => angle()?,
            JointKind::Prismatic => length()?,
        };
        return Ok(unit.map(|unit| (ColumnRole::Joint(joint), unit)));
    }
    if let Some(axis) = place(&["x", "y", "z"]) {
        return Ok(length()?.map(|unit| (ColumnRole::Axis(axis), unit)));
    }
    if let (Some(part), None) = (place(&["qw", "qx", "qy", "qz"]), unit) {
        return Ok(Some((ColumnRole::Quaternion(part), Unit::One)));
    }
    if let Some(turn) = place(&["a", "b", "c"]) {
        return Ok(angle()?.map(|unit| (ColumnRole::Turn(turn), unit)));
    }
    let role = match (stem, unit) {
        ("payload", Some(Unit::Kilogram)) => Some(ColumnRole::Payload),
        ("temp" | "temperature", Some(Unit::Celsius)) => Some(ColumnRole::Temperature),
        ("time", Some(Unit::Second)) => Some(ColumnRole::Time),
        (_, Some(Unit::Ampere)) => numbered("i").map(|n| ColumnRole::Current(n - 1)),
        _ => numbered("dir").map(|n| ColumnRole::Direction(n - 1)),
    };
    // Their numbers are taken as they stand.
    Ok(role.map(|role| (role, Unit::One)))
}

/// The numbers of one row, by their meaning.
#[derive(Default)]
pub(super) struct TargetRow {
    target: CommandTarget,
    pub point: [f64; 3],
    quaternion: [f64; 4],
    turns: [f64; 3],
}

impl TargetRow {
    /// Takes a number, SI.
    pub fn take(&mut self, role: ColumnRole, value: f64, joints: usize) {
        let put = |slot: &mut Option<Vec<f64>>, joint: usize, value: f64| {
            slot.get_or_insert_with(|| vec![0.0; joints])[joint] = value
        };
        match role {
            ColumnRole::Joint(joint) => put(&mut self.target.q, joint, value),
            ColumnRole::Axis(axis) => self.point[axis] = value,
            ColumnRole::Quaternion(part) => self.quaternion[part] = value,
            ColumnRole::Turn(turn) => self.turns[turn] = value,
            ColumnRole::Payload => self.target.payload = Some(value),
            ColumnRole::Temperature => self.target.temperature = Some(value),
            ColumnRole::Time => self.target.time = Some(value),
            ColumnRole::Direction(joint) => put(&mut self.target.direction, joint, value),
            ColumnRole::Current(joint) => put(&mut self.target.current, joint, value),
            ColumnRole::Velocity(_) | ColumnRole::Acceleration(_) => {}
        }
    }

    pub fn target(
        mut self,
        columns: &TargetColumns,
        layout: &Layout,
    ) -> Result<CommandTarget, String> {
        let joints = self.target.q.iter().flatten().zip(&columns.joints);
        let joints = joints.map(|(q, (_, unit))| match unit.quantity() {
            Quantity::Length => (Bound::Length, *q),
            _ => (Bound::Angle, *q),
        });
        let point = self.point.iter().map(|x| (Bound::Length, *x));
        let turned = self.turns.iter().map(|turn| (Bound::Angle, *turn));
        let mut all = joints.chain(point).chain(turned);
        if let Some(message) = all.find_map(|(bound, value)| bound.fault(value)) {
            return Err(message);
        }
        if let (Some(load), None) = (layout.load, self.target.payload) {
            return Err(unstated_payload(load));
        }
        // Where joints are the targets, what else stands there is not the tool's place in the base frame, e.g. measured points.
        if columns.point && (layout.cartesian || columns.joints.is_empty()) {
            self.target.point = Some(Vector3::from(self.point));
            if columns.quaternion {
                self.target.rotation = Some(self.rotation()?);
            } else if columns.turns {
                let [a, b, c] = self.turns;
                self.target.rotation = Some(turns(a, b, c));
            }
        }
        Ok(self.target)
    }

    fn rotation(&self) -> Result<Matrix3<f64>, String> {
        let [w, x, y, z] = self.quaternion;
        let length = Vector3::new(x, y, z).norm().hypot(w);
        if (length - 1.0).abs() > 1e-3 {
            return Err(format!(
                "columns qw, qx, qy, qz: the quaternion has length {length:.4}, expected 1"
            ));
        }
        Ok(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
            .to_rotation_matrix()
            .into_inner())
    }
}

/// Rows with a joint turned farther than joints turn: where most rows have one, their unit is not that of the header.
#[derive(Default)]
pub(super) struct FarTurned {
    rows: usize,
    far: usize,
    /// Place, joint from 0, rad.
    first: Option<(String, usize, f64)>,
}

impl FarTurned {
    /// Counts a row; what the robot's own limits allow is not far.
    pub fn count(
        &mut self,
        place: impl FnOnce() -> String,
        target: &CommandTarget,
        robot: &RobotDescription,
    ) {
        self.rows += 1;
        let mut joints = target.q.iter().flatten().zip(&robot.joints).enumerate();
        let far = joints.find(|(_, (q, joint))| {
            let allowed = joint
                .limits
                .is_some_and(|[lower, upper]| (lower..=upper).contains(*q));
            joint.kind == JointKind::Revolute && q.abs() > ONE_AND_A_HALF_TURNS && !allowed
        });
        if let Some((joint, (q, _))) = far {
            self.far += 1;
            self.first.get_or_insert_with(|| (place(), joint, *q));
        }
    }

    /// What is wrong with the rows so far.
    pub fn fault(&self, columns: &TargetColumns) -> Option<Fault> {
        let (place, joint, q) = self.first.as_ref().filter(|_| 2 * self.far > self.rows)?;
        let (_, unit) = columns.joints.get(*joint)?;
        let [shown, most] =
            [*q, ONE_AND_A_HALF_TURNS].map(|angle| (unit.from_si(angle) * 100.0).round() / 100.0);
        let degrees = if *unit == Unit::Degree {
            ""
        } else {
            "; if these are degrees, let the names of their columns end in _deg"
        };
        let message = format!(
            "in {} of {} a joint is beyond one and a half turns, here joint {} at {shown} {unit}; allowed: up to {most} {unit}{degrees}",
            self.far,
            counted(self.rows, "row"),
            joint + 1
        );
        Some(Fault::new(place, message))
    }
}

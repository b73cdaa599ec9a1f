//! The robot as a table: base, joints, tool; at the zero pose in the base frame.

use super::{JointConventionRow, JointConventions, Parameters, Robot, RobotRow, TorqueParameters};
use crate::description::{
    Coupling, DeclaredInertias, InertiaMoments, JointDescription, JointKind, Made, MassTolerance,
    RobotDescription,
};
use crate::error::{Error, Result};
use crate::units::Unit;
use calib_numerics::robot::{Bound, CountedCoupling, JointConvention};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A cell of the column `couplings`; `by` counts from 1.
#[derive(Serialize, Deserialize)]
struct CouplingCell {
    by: usize,
    ratio: f64,
}

impl Robot {
    /// The rows of a description: base, joints, tool.
    pub fn from_description(robot: &RobotDescription) -> Self {
        let gravity = Vector3::from(robot.gravity);
        let mut base = empty(0, &robot.name, "base");
        [base.axis_x, base.axis_y, base.axis_z] =
            some((gravity.norm() > 0.0).then(|| gravity.normalize().into()));
        base.gravity_m_s2 = Some(gravity.norm());
        if let Some(tolerance) = &robot.inertias.tolerance {
            base.tolerance_mass = Some(tolerance.mass);
            base.tolerance_centre_mm = Some(Unit::Millimetre.from_si(tolerance.centre));
            base.tolerance_inertia = Some(tolerance.inertia);
        }

        if !robot.tolerances.is_empty() {
            let cells = Made::ALL.iter().filter_map(|(made, name, unit)| {
                let value = robot.tolerances.get(made)?;
                Some((*name, unit.from_si(*value)))
            });
            let cells: BTreeMap<&str, f64> = cells.collect();
            base.tolerances =
                Some(serde_json::to_string(&cells).expect("numbers and names serialise"));
        }

        let mut tool = empty(robot.joints.len() + 1, "tool", "tool");
        [tool.point_x_mm, tool.point_y_mm, tool.point_z_mm] = millimetres(Some(robot.tool));
        tool.mass_kg = Some(robot.payload_mass);
        [tool.centre_x_mm, tool.centre_y_mm, tool.centre_z_mm] =
            millimetres(Some(robot.payload_centre));
        let rotation = Matrix3::from_fn(|i, j| robot.tool_rotation[i][j]);
        let orientation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        set_inertia(&mut tool, robot.inertias.payload);
        tool.orientation_w = Some(orientation.w);
        [tool.orientation_x, tool.orientation_y, tool.orientation_z] =
            some(Some([orientation.i, orientation.j, orientation.k]));

        let joints = robot.joints.iter().enumerate().map(|(i, joint)| {
            let mut row = joint_row(i, joint, &robot.couplings);
            set_inertia(&mut row, robot.inertias.links.get(i).copied().flatten());
            row
        });
        Self(
            std::iter::once(base)
                .chain(joints)
                .chain(std::iter::once(tool))
                .collect(),
        )
    }

    /// The description that the rows hold; fails when a body or one of its numbers is missing.
    pub fn to_description(&self) -> Result<RobotDescription> {
        let (Some((base, others)), true) = (self.0.split_first(), self.0.len() > 2) else {
            return Err(Error::data(
                "table robot",
                "expected a base, at least one joint and a tool",
            ));
        };
        let Some((tool, joints)) = others.split_last() else {
            return Err(Error::data("table robot", "has no tool"));
        };
        let size = need(base.gravity_m_s2, base, "gravity_m_s2")?;
        let down = if size == 0.0 {
            [0.0; 3]
        } else {
            all([base.axis_x, base.axis_y, base.axis_z], base, "axis")?
        };
        let q = Quaternion::new(
            need(tool.orientation_w, tool, "orientation_w")?,
            need(tool.orientation_x, tool, "orientation_x")?,
            need(tool.orientation_y, tool, "orientation_y")?,
            need(tool.orientation_z, tool, "orientation_z")?,
        );
        let rotation = UnitQuaternion::from_quaternion(q).to_rotation_matrix();
        let mut couplings = Vec::new();
        for (moved, row) in joints.iter().enumerate() {
            couplings.extend(couplings_of(moved, row, joints.len())?);
        }
        Ok(RobotDescription {
            name: base.name.clone(),
            joints: joints.iter().map(joint).collect::<Result<_>>()?,
            tool: metres(
                [tool.point_x_mm, tool.point_y_mm, tool.point_z_mm],
                tool,
                "point",
            )?,
            tool_rotation: [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[(i, j)])),
            couplings,
            payload_mass: need(tool.mass_kg, tool, "mass_kg")?,
            payload_centre: metres(
                [tool.centre_x_mm, tool.centre_y_mm, tool.centre_z_mm],
                tool,
                "centre",
            )?,
            gravity: down.map(|x| x * size),
            inertias: inertias(base, joints, tool),
            tolerances: tolerances(base)?,
        })
    }
}

fn joint_row(index: usize, joint: &JointDescription, couplings: &[Coupling]) -> RobotRow {
    let mut row = empty(
        index + 1,
        &joint.name,
        if joint.kind == JointKind::Revolute {
            "revolute"
        } else {
            "prismatic"
        },
    );
    [row.axis_x, row.axis_y, row.axis_z] = some(Some(joint.axis));
    [row.point_x_mm, row.point_y_mm, row.point_z_mm] = millimetres(Some(joint.point));
    let [lower, upper] = joint.limits.map_or([None; 2], |limits| limits.map(Some));
    match joint.kind {
        JointKind::Revolute => (row.lower_rad, row.upper_rad) = (lower, upper),
        JointKind::Prismatic => {
            let mm = |x: Option<f64>| x.map(|x| Unit::Millimetre.from_si(x));
            (row.lower_mm, row.upper_mm) = (mm(lower), mm(upper));
        }
    }
    row.reduction_ratio = joint.reduction_ratio;
    row.motor_constant_nm_a = joint.motor_constant;
    row.mass_kg = joint.mass;
    row.coulomb_nm = joint.coulomb;
    [row.centre_x_mm, row.centre_y_mm, row.centre_z_mm] = millimetres(joint.centre);
    let mine = couplings.iter().filter(|c| c.moved == index);
    let cells: Vec<_> = mine
        .map(|c| CouplingCell {
            by: c.by + 1,
            ratio: c.ratio,
        })
        .collect();
    if !cells.is_empty() {
        row.couplings = Some(serde_json::to_string(&cells).expect("numbers and names serialise"));
    }
    row
}

fn joint(row: &RobotRow) -> Result<JointDescription> {
    let metre = |x: Option<f64>| x.map(|x| Unit::Millimetre.to_si(x));
    let (kind, limits) = match row.kind.as_str() {
        "revolute" => (JointKind::Revolute, (row.lower_rad, row.upper_rad)),
        "prismatic" => (
            JointKind::Prismatic,
            (metre(row.lower_mm), metre(row.upper_mm)),
        ),
        other => {
            return Err(fault(
                row,
                &format!("kind is `{other}`; expected revolute or prismatic"),
            ));
        }
    };
    let centre = [row.centre_x_mm, row.centre_y_mm, row.centre_z_mm];
    let factors: Vec<f64> = [row.reduction_ratio, row.motor_constant_nm_a]
        .into_iter()
        .flatten()
        .collect();
    sized(
        Bound::Factor,
        &factors,
        row,
        "reduction_ratio, motor_constant_nm_a",
    )?;
    sized(Bound::Mass, row.mass_kg.as_slice(), row, "mass_kg")?;
    Ok(JointDescription {
        name: row.name.clone(),
        kind,
        axis: all([row.axis_x, row.axis_y, row.axis_z], row, "axis")?,
        point: metres(
            [row.point_x_mm, row.point_y_mm, row.point_z_mm],
            row,
            "point",
        )?,
        limits: limits.0.zip(limits.1).map(|(lower, upper)| [lower, upper]),
        reduction_ratio: row.reduction_ratio,
        motor_constant: row.motor_constant_nm_a,
        mass: row.mass_kg,
        coulomb: row.coulomb_nm,
        centre: if centre == [None; 3] {
            None
        } else {
            Some(metres(centre, row, "centre")?)
        },
    })
}

fn set_inertia(row: &mut RobotRow, moments: Option<InertiaMoments>) {
    [
        row.inertia_xx_kg_m2,
        row.inertia_xy_kg_m2,
        row.inertia_xz_kg_m2,
        row.inertia_yy_kg_m2,
        row.inertia_yz_kg_m2,
        row.inertia_zz_kg_m2,
    ] = moments.map_or([None; 6], |moments| moments.map(Some));
}

fn inertias(base: &RobotRow, joints: &[RobotRow], tool: &RobotRow) -> DeclaredInertias {
    let moments = |row: &RobotRow| {
        Some([
            row.inertia_xx_kg_m2?,
            row.inertia_xy_kg_m2?,
            row.inertia_xz_kg_m2?,
            row.inertia_yy_kg_m2?,
            row.inertia_yz_kg_m2?,
            row.inertia_zz_kg_m2?,
        ])
    };
    let links: Vec<_> = joints.iter().map(moments).collect();
    let tolerance = || {
        let centre = Unit::Millimetre.to_si(base.tolerance_centre_mm?);
        Some(MassTolerance {
            mass: base.tolerance_mass?,
            centre,
            inertia: base.tolerance_inertia?,
        })
    };
    DeclaredInertias {
        links: if links.iter().any(Option::is_some) {
            links
        } else {
            Vec::new()
        },
        payload: moments(tool),
        tolerance: tolerance(),
    }
}

/// How far from nominal the arm is made, where its file says so, SI.
fn tolerances(base: &RobotRow) -> Result<BTreeMap<Made, f64>> {
    let Some(text) = &base.tolerances else {
        return Ok(BTreeMap::new());
    };
    let cells: BTreeMap<String, f64> =
        serde_json::from_str(text).map_err(|e| fault(base, &format!("tolerances: {e}")))?;
    let one = |(name, value): (String, f64)| {
        let mut all = Made::ALL.iter();
        match all.find(|(_, known, _)| *known == name) {
            Some((made, _, unit)) if value > 0.0 => Ok((*made, unit.to_si(value))),
            Some(_) => Err(fault(
                base,
                &format!("tolerances: {name} is {value}; expected above 0"),
            )),
            None => Err(fault(
                base,
                &format!("tolerances: `{name}` is none of an arm"),
            )),
        }
    };
    cells.into_iter().map(one).collect()
}

fn couplings_of(moved: usize, row: &RobotRow, joints: usize) -> Result<Vec<Coupling>> {
    let Some(text) = &row.couplings else {
        return Ok(Vec::new());
    };
    let cells: Vec<CouplingCell> =
        serde_json::from_str(text).map_err(|e| fault(row, &format!("couplings: {e}")))?;
    (cells.into_iter())
        .map(
            |cell| match cell.by.checked_sub(1).filter(|by| *by < joints) {
                Some(by) => Ok(Coupling {
                    moved,
                    by,
                    ratio: cell.ratio,
                }),
                None => Err(fault(
                    row,
                    &format!("couplings: there is no joint {}", cell.by),
                )),
            },
        )
        .collect()
}

fn empty(body: usize, name: &str, kind: &str) -> RobotRow {
    RobotRow {
        body: body as i64,
        name: name.into(),
        kind: kind.into(),
        ..RobotRow::default()
    }
}

fn some(vector: Option<[f64; 3]>) -> [Option<f64>; 3] {
    vector.map_or([None; 3], |vector| vector.map(Some))
}

fn millimetres(point: Option<[f64; 3]>) -> [Option<f64>; 3] {
    some(point.map(|point| point.map(|x| Unit::Millimetre.from_si(x))))
}

fn metres(point: [Option<f64>; 3], row: &RobotRow, what: &str) -> Result<[f64; 3]> {
    let point = all(point, row, what)?.map(|x| Unit::Millimetre.to_si(x));
    sized(Bound::Length, &point, row, what)?;
    Ok(point)
}

fn all(vector: [Option<f64>; 3], row: &RobotRow, what: &str) -> Result<[f64; 3]> {
    match vector {
        [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
        _ => Err(fault(row, &format!("has no {what}"))),
    }
}

/// Whether numbers (SI) are such as a robot can have.
fn sized(bound: Bound, values: &[f64], row: &RobotRow, what: &str) -> Result<()> {
    match values.iter().find_map(|value| bound.fault(*value)) {
        Some(message) => Err(fault(row, &format!("{what}: {message}"))),
        None => Ok(()),
    }
}

fn need(value: Option<f64>, row: &RobotRow, what: &str) -> Result<f64> {
    value.ok_or_else(|| fault(row, &format!("has no {what}")))
}

fn fault(row: &RobotRow, message: &str) -> Error {
    Error::data(
        format!("table robot, body {} (`{}`)", row.body, row.name),
        message,
    )
}

/// A cell of the column `coupled`.
#[derive(Serialize, Deserialize)]
struct CoupledCell {
    by: usize,
    ratio: f64,
    /// In which order couplings are taken off.
    order: usize,
}

impl JointConventions {
    /// The rows of a convention; `prismatic` says which joints are.
    pub fn of(convention: &JointConvention, prismatic: &[bool]) -> Self {
        let cells = |joint: usize| {
            let mine = convention
                .coupled()
                .iter()
                .enumerate()
                .filter(|(_, one)| one.joint == joint);
            let cells: Vec<CoupledCell> = mine
                .map(|(at, one)| CoupledCell {
                    by: one.by + 1,
                    ratio: one.ratio,
                    order: at + 1,
                })
                .collect();
            (!cells.is_empty())
                .then(|| serde_json::to_string(&cells).expect("numbers and names serialise"))
        };
        let joints = convention
            .sign()
            .iter()
            .zip(convention.zero())
            .zip(prismatic)
            .enumerate();
        let row = |(joint, ((sign, zero), prismatic)): (usize, ((&f64, &f64), &bool))| {
            JointConventionRow {
                joint: joint as i64 + 1,
                sign: *sign,
                zero_rad: (!prismatic).then_some(*zero),
                zero_mm: prismatic.then(|| Unit::Millimetre.from_si(*zero)),
                coupled: cells(joint),
            }
        };
        Self(joints.map(row).collect())
    }

    /// The convention that the rows hold; fails where a zero is missing, a sign is none, or a joint is named that is not there.
    pub fn to_convention(&self) -> Result<JointConvention> {
        let fault = |row: &JointConventionRow, message: String| {
            Error::data(format!("table convention, joint {}", row.joint), message)
        };
        let (mut sign, mut zero, mut coupled) = (Vec::new(), Vec::new(), Vec::new());
        for (joint, row) in self.0.iter().enumerate() {
            if row.sign.abs() != 1.0 {
                return Err(fault(
                    row,
                    format!("sign is {}; allowed: 1 and -1", row.sign),
                ));
            }
            let value = row
                .zero_rad
                .or_else(|| row.zero_mm.map(|mm| Unit::Millimetre.to_si(mm)));
            sign.push(row.sign);
            zero.push(value.ok_or_else(|| fault(row, "has no zero".into()))?);
            let cells: Vec<CoupledCell> = match &row.coupled {
                Some(text) => serde_json::from_str(text)
                    .map_err(|error| fault(row, format!("coupled: {error}")))?,
                None => Vec::new(),
            };
            for cell in cells {
                let by = cell
                    .by
                    .checked_sub(1)
                    .filter(|by| *by < self.0.len() && *by != joint);
                let by = by.ok_or_else(|| {
                    fault(row, format!("coupled: there is no other joint {}", cell.by))
                })?;
                coupled.push((
                    cell.order,
                    CountedCoupling {
                        joint,
                        by,
                        ratio: cell.ratio,
                    },
                ));
            }
        }
        coupled.sort_by_key(|(order, _)| *order);
        Ok(JointConvention::new(
            sign,
            zero,
            coupled.into_iter().map(|(_, one)| one).collect(),
        ))
    }
}

/// Parts of a metre and of a unit vector that count: what a unit is converted by and back moves less.
const PARTS: f64 = 1e9;
/// Hexadecimal digits of a hash.
const DIGITS: usize = 16;

/// A robot as its tables call it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct RobotIdentity {
    name: String,
    kinematics: String,
}

impl RobotIdentity {
    fn of(robot: &RobotDescription) -> Self {
        let mut text = String::new();
        let numbers = |vector: &[f64]| {
            vector
                .iter()
                .map(|x| format!(" {}", (x * PARTS).round() as i128))
                .collect::<String>()
        };
        for joint in &robot.joints {
            // What a sliding joint's point is changes nothing.
            let (kind, point) = match joint.kind {
                JointKind::Revolute => ("revolute", numbers(&joint.point)),
                JointKind::Prismatic => ("prismatic", String::new()),
            };
            writeln!(text, "{kind}{}{point}", numbers(&joint.axis)).expect("text grows");
        }
        for coupling in &robot.couplings {
            writeln!(
                text,
                "coupled {} {}{}",
                coupling.moved,
                coupling.by,
                numbers(&[coupling.ratio])
            )
            .expect("text grows");
        }
        let kinematics = blake3::hash(text.as_bytes()).to_hex()[..DIGITS].to_string();
        Self {
            name: robot.name.clone(),
            kinematics,
        }
    }

    /// Fails where a table of the kind `kind` with this identity is used for another robot.
    fn must_be(&self, other: &Self, kind: &str) -> Result<()> {
        let message = match (self.name == other.name, self.kinematics == other.kinematics) {
            (true, true) => return Ok(()),
            (false, true) => format!(
                "is the model of the robot `{}`, and this robot file is of `{}`, whose axes are the same: a model belongs to one arm; where this \
                 is that arm, give it its name in the robot file",
                self.name, other.name
            ),
            (false, false) => format!(
                "is the model of another robot, `{}`, whose axes are not those of `{}`: take the robot file that it was identified with",
                self.name, other.name
            ),
            (true, false) => format!(
                "is the model of `{}` with other axes than this robot file has: take the robot file that it was identified with, or identify anew",
                self.name
            ),
        };
        Err(Error::data(format!("table {kind}"), message))
    }
}

/// Gives a table the robot's columns, and refuses it for another robot; tables of earlier versions lack them.
macro_rules! of_one_robot {
    ($table:ident, $kind:literal) => {
        impl $table {
            /// The same as the model of this robot.
            pub fn of_robot(mut self, robot: &RobotDescription) -> Self {
                let RobotIdentity { name, kinematics } = RobotIdentity::of(robot);
                for row in &mut self.0 {
                    (row.robot, row.kinematics) = (Some(name.clone()), Some(kinematics.clone()));
                }
                self
            }

            /// Whether the table says of which robot it is.
            pub fn says_its_robot(&self) -> bool {
                self.0
                    .iter()
                    .all(|row| row.robot.is_some() && row.kinematics.is_some())
            }

            /// Fails where the table says that it is the model of another robot.
            pub fn must_be_of(&self, robot: &RobotDescription) -> Result<()> {
                let other = RobotIdentity::of(robot);
                let mut stated = self
                    .0
                    .iter()
                    .filter_map(|row| row.robot.clone().zip(row.kinematics.clone()));
                stated.try_for_each(|(name, kinematics)| {
                    RobotIdentity { name, kinematics }.must_be(&other, $kind)
                })
            }
        }
    };
}
of_one_robot!(Parameters, "parameters");
of_one_robot!(TorqueParameters, "torque_parameters");

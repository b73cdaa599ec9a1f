//! One row of targets as numbers, and what holds of the rows of a whole table.

use super::Layout;
use super::columns::{ColumnRole, TargetColumns};
use crate::compensate::unstated_payload;
use crate::compensate::{CommandTarget, turns};
use crate::description::{JointKind, RobotDescription};
use crate::error::{Fault, counted};
use crate::robot::{Bound, ONE_AND_A_HALF_TURNS};
use crate::units::{Quantity, Unit};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// The numbers of one row, by what they mean.
#[derive(Default)]
pub(super) struct TargetRow {
    target: CommandTarget,
    pub point: [f64; 3],
    quaternion: [f64; 4],
    turns: [f64; 3],
}

impl TargetRow {
    pub fn take(&mut self, role: ColumnRole, value: f64, joints: usize) {
        let put = |slot: &mut Option<Vec<f64>>, joint: usize, value: f64| {
            slot.get_or_insert_with(|| vec![0.0; joints])[joint] = value
        };
        match role {
            ColumnRole::Joint(joint, unit) => put(&mut self.target.q, joint, unit.to_si(value)),
            ColumnRole::Axis(axis, unit) => self.point[axis] = unit.to_si(value),
            ColumnRole::Quaternion(part) => self.quaternion[part] = value,
            ColumnRole::Turn(turn, unit) => self.turns[turn] = unit.to_si(value),
            ColumnRole::Payload => self.target.payload = Some(value),
            ColumnRole::Temperature => self.target.temperature = Some(value),
            ColumnRole::Time => self.target.time = Some(value),
            ColumnRole::Direction(joint) => put(&mut self.target.direction, joint, value),
            ColumnRole::Current(joint) => put(&mut self.target.current, joint, value),
        }
    }

    pub fn target(
        mut self,
        columns: &TargetColumns,
        layout: &Layout,
    ) -> Result<CommandTarget, String> {
        let joints = self.target.q.iter().flatten().zip(&columns.joints);
        let joints = joints.map(|(q, (_, unit))| {
            (
                if unit.quantity() == Quantity::Length {
                    Bound::Length
                } else {
                    Bound::Angle
                },
                *q,
            )
        });
        let others = self
            .point
            .iter()
            .map(|x| (Bound::Length, *x))
            .chain(self.turns.iter().map(|turn| (Bound::Angle, *turn)));
        if let Some(message) = joints
            .chain(others)
            .find_map(|(bound, value)| bound.fault(value))
        {
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

//! A chain of screws as a Denavit-Hartenberg table: common normals from axis to axis.
//!
//! T = B row_1 .. row_n tool with rows Rz(theta) Tz(d) Tx(a) Rx(alpha); B is a row before the first joint, and the tool stands in the
//! frame of the last joint. Craig's modified table has the same numbers, grouped as Rx(alpha) Tx(a) Rz(theta) Tz(d).

use super::model::RobotModel;
use crate::spatial::Pose;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// rad: axes nearer to parallel than this are taken as parallel; their common normal would be farther away than the stars.
const PARALLEL: f64 = 1e-12;

/// Numbers of a row, m and rad.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DhRow {
    /// rad.
    pub theta: f64,
    /// m.
    pub d: f64,
    /// m.
    pub a: f64,
    /// rad.
    pub alpha: f64,
}

/// A chain as rows.
#[derive(Debug, Clone, PartialEq)]
pub struct DhTable {
    /// From the base's z axis to the first joint's.
    pub base: DhRow,
    /// The row of each joint at position zero; the last is the identity.
    pub joints: Vec<DhRow>,
    /// In the frame of the last joint.
    pub tool: Pose,
}

impl DhRow {
    fn pose(&self) -> Pose {
        let turn = |axis: Vector3<f64>, angle: f64| Rotation3::new(axis * angle).into_inner();
        let screw_z = Pose::new(
            turn(Vector3::z(), self.theta),
            Vector3::new(0.0, 0.0, self.d),
        );
        screw_z
            * Pose::new(
                turn(Vector3::x(), self.alpha),
                Vector3::new(self.a, 0.0, 0.0),
            )
    }
}

impl DhTable {
    /// The table of an arm; common normals fix what the convention leaves free.
    pub fn of(robot: &RobotModel) -> Self {
        let mut frame = Pose::identity();
        let mut rows = Vec::new();
        for joint in 0..robot.joints() {
            let row = normal(&frame, robot.axis(joint), robot.point(joint));
            frame = frame * row.pose();
            rows.push(row);
        }
        let base = rows.remove(0);
        rows.push(DhRow::default());
        Self {
            base,
            joints: rows,
            tool: frame.inverse() * *robot.home(),
        }
    }

    /// The smallest angle (rad) between neighbouring axes that are not parallel, and the joint (from 0) before it: near zero, the common
    /// normal is far away and the table badly conditioned.
    pub fn flattest(&self) -> Option<(usize, f64)> {
        let angle = |row: &DhRow| row.alpha.sin().abs();
        let skew = self
            .joints
            .iter()
            .enumerate()
            .map(|(joint, row)| (joint, angle(row)))
            .filter(|(_, angle)| *angle > PARALLEL);
        skew.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// From the z axis of `frame` to the line through `point` along `axis` by their common normal.
fn normal(frame: &Pose, axis: &Vector3<f64>, point: &Vector3<f64>) -> DhRow {
    let rotation: &Matrix3<f64> = &frame.rotation;
    let (u, p) = (rotation.tr_mul(axis), frame.inverse_point(point));
    let sine = u.x.hypot(u.y);
    if sine < PARALLEL {
        let away = p.x.hypot(p.y);
        let theta = if away == 0.0 { 0.0 } else { p.y.atan2(p.x) };
        return DhRow {
            theta,
            d: 0.0,
            a: away,
            alpha: if u.z > 0.0 { 0.0 } else { std::f64::consts::PI },
        };
    }
    // x along z cross u, y = z cross x.
    let x = Vector3::new(-u.y, u.x, 0.0) / sine;
    let y = Vector3::z().cross(&x);
    let along = p.dot(&y) / sine;
    DhRow {
        theta: x.y.atan2(x.x),
        d: p.z + along * u.z,
        a: p.dot(&x),
        alpha: sine.atan2(u.z),
    }
}

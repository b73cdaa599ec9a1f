//! The arm as a correction sees it: nominal screws in the tracker's frame, and what small motions anywhere do to the point.
//!
//! A correction through the Jacobian needs no identified geometry: a millimetre or a milliradian of it changes the lever arms by
//! a thousandth. So a correction carries these few numbers and can be applied without the model it was learnt on.

use crate::robot::RobotModel;
use crate::spatial::{Pose, Twist, screw};
use nalgebra::Vector3;

/// One joint at the zero pose, tracker frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// Unit vector.
    pub axis: [f64; 3],
    /// A point on the axis, m.
    pub point: [f64; 3],
    /// Whether the joint is prismatic.
    pub slides: bool,
}

/// Screws, measured point (m) and the direction of gravity at the zero pose, tracker frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ScrewArm {
    /// One for each joint.
    pub hinges: Vec<Hinge>,
    /// m, tracker's frame.
    pub tool: [f64; 3],
    /// Direction of gravity, unit, tracker's frame.
    pub down: [f64; 3],
}

/// The arm at one posture. Station `s` moves with the first `s` joints.
pub struct Stance {
    stations: Vec<Pose>,
    /// Axis and point of each joint.
    axes: Vec<(Vector3<f64>, Vector3<f64>, bool)>,
    tool: Vector3<f64>,
    down: Vector3<f64>,
}

impl ScrewArm {
    /// The nominal robot, its base standing at `base` in the tracker's frame.
    pub fn of(robot: &RobotModel, base: &Pose) -> Self {
        let hinges = (0..robot.joints()).map(|joint| Hinge {
            axis: (base.rotation * robot.axis(joint)).into(),
            point: base.point(robot.point(joint)).into(),
            slides: !robot.is_revolute(joint),
        });
        let gravity = base.rotation * Vector3::from(robot.description().gravity);
        Self {
            hinges: hinges.collect(),
            tool: base.point(&robot.home().translation).into(),
            down: gravity.try_normalize(1e-9).unwrap_or_default().into(),
        }
    }

    /// The posture at joint positions `q` (rad or m).
    pub fn stance(&self, q: &[f64]) -> Stance {
        let mut station = Pose::identity();
        let mut stations = vec![station];
        let mut axes = Vec::with_capacity(self.hinges.len());
        for (hinge, travel) in self.hinges.iter().zip(q) {
            let (axis, point) = (Vector3::from(hinge.axis), Vector3::from(hinge.point));
            axes.push((station.rotation * axis, station.point(&point), hinge.slides));
            let twist = if hinge.slides {
                Twist::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0)
            } else {
                screw(&axis, &point)
            };
            station = station * Pose::exp(&(twist * *travel));
            stations.push(station);
        }
        Stance {
            tool: station.point(&Vector3::from(self.tool)),
            stations,
            axes,
            down: Vector3::from(self.down),
        }
    }
}

impl Stance {
    /// What a turn (or travel) of `joint` does to the measured point, m per rad or per m.
    pub fn turn(&self, joint: usize) -> Vector3<f64> {
        let (axis, point, slides) = &self.axes[joint];
        if *slides {
            *axis
        } else {
            axis.cross(&(self.tool - point))
        }
    }

    /// What a shift of `station` along its `axis` does, m per m.
    pub(crate) fn shift(&self, station: usize, axis: usize) -> Vector3<f64> {
        self.stations[station].rotation.column(axis).into_owned()
    }

    /// What a tilt of `station` about its `axis` through the next joint does, m per rad; nothing at the tool.
    pub(crate) fn tilt(&self, station: usize, axis: usize) -> Vector3<f64> {
        self.axes
            .get(station)
            .map_or_else(Vector3::zeros, |(_, point, _)| {
                self.shift(station, axis).cross(&(self.tool - point))
            })
    }

    /// The torque (or force) on `joint` of a unit weight where the body moved by joint `body` ends, m (or 1).
    pub(crate) fn torque(&self, joint: usize, body: usize) -> f64 {
        let (axis, point, slides) = &self.axes[joint];
        let end = self.axes.get(body + 1).map_or(self.tool, |next| next.1);
        if *slides {
            axis.dot(&self.down)
        } else {
            axis.dot(&(end - point).cross(&self.down))
        }
    }
}

//! A row whose arm was placed: where its target is, and how that moves with every parameter of the stack.
//!
//! The buffers of an evaluation are in [`PlacementBuffers`]; what follows from them is asked of [`PlacedRow`], which holds them.

use super::{Deflection, Direction};
use crate::robot::{LoadCorrection, Posture, RobotModel, Shape, Travel};
use crate::spatial::{Pose, Twist, hat, left_jacobian};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};

/// Buffers of one evaluation, made once per thread.
pub struct PlacementBuffers {
    pub(super) deflection: Deflection,
    /// Commanded travel of each joint.
    pub(super) commanded: Vec<Travel>,
    pub(super) load_correction: LoadCorrection,
    pub(super) posture: Posture,
    pub(super) stations: Vec<Station>,
    /// Frame in front of E_k.
    pub(super) before: Vec<Pose>,
    /// Velocity of the point by the twist of E_k.
    pub(super) by_station: Vec<Matrix3x6<f64>>,
    /// Velocity of the point by the travel of joint k.
    pub(super) by_joint: Vec<Vector3<f64>>,
    /// The row's target.
    pub(super) target: Option<usize>,
    /// Whether `commanded` is near the next row's joints.
    pub(super) near: bool,
    /// Travel of each joint and twist at each station by the constant effects, where only points are wanted, all of the same parameters.
    pub(super) constant: Option<(Vec<f64>, Vec<Twist>)>,
}

impl PlacementBuffers {
    pub(super) fn new(joints: usize) -> Self {
        Self {
            deflection: Deflection::new(joints),
            commanded: vec![Travel::default(); joints],
            load_correction: LoadCorrection::new(joints),
            posture: Posture::new(joints),
            stations: vec![Station::of(&Twist::zeros()); joints + 1],
            before: vec![Pose::identity(); joints + 1],
            by_station: vec![Matrix3x6::zeros(); joints + 1],
            by_joint: vec![Vector3::zeros(); joints],
            target: None,
            near: false,
            constant: None,
        }
    }

    /// Partials are wanted again.
    pub(crate) fn points_and_partials(&mut self) {
        self.deflection.bare = false;
        self.constant = None;
    }

    /// Whether the next row's joints are near those placed last; their sines then follow by addition theorems.
    pub(crate) fn near(&mut self, near: bool) {
        self.near = near;
    }
}

/// What follows from a station's summed twist. Kept until the twist changes: most are the same in every row.
#[derive(Clone)]
pub(super) struct Station {
    pub(crate) twist: Twist,
    /// Whether nothing moves here: most stations of most models.
    pub(crate) still: bool,
    pub(crate) motion: Pose,
    pub(crate) jacobian: Matrix6<f64>,
}

impl Station {
    pub fn of(twist: &Twist) -> Self {
        Self {
            twist: *twist,
            still: *twist == Twist::zeros(),
            motion: Pose::exp(twist),
            jacobian: left_jacobian(twist),
        }
    }
}

/// A row's arm and target, tracker frame, under the parameters that it was placed with.
///
/// Derivatives come through `emit(parameter, derivative)`. A parameter may be emitted more than once; derivatives of one parameter
/// add up. Torques are treated as constant: their change with the parameters is of second order.
pub struct PlacedRow<'a> {
    pub(super) robot: &'a RobotModel,
    pub(super) scratch: &'a mut PlacementBuffers,
    /// The target's point, m.
    pub(crate) point: Vector3<f64>,
}

impl PlacedRow<'_> {
    /// The target's orientation.
    pub(crate) fn orientation(&self) -> Matrix3<f64> {
        self.scratch.posture.behind[self.robot.joints()].rotation
            * self.robot.mounting(self.scratch.target).rotation
    }

    /// From where an anchor is to the point, m. `None` where the robot knows no such anchor.
    pub(crate) fn anchor_reach(&self, anchor: &str) -> Option<Vector3<f64>> {
        let setup = self.robot.setup();
        let anchor = setup.anchors.get(setup.anchor(anchor)?)?;
        let Deflection {
            anchor: shift,
            reading,
            ..
        } = &self.scratch.deflection;
        // What the tracker misreads lengthens no wire.
        Some(self.point - reading - anchor.place - shift)
    }

    /// What an anchor is, corrections included. `None` where the robot knows no such anchor.
    pub(crate) fn anchor_shape(&self, anchor: &str) -> Option<Shape> {
        let setup = self.robot.setup();
        let deflection = &self.scratch.deflection;
        Some(match setup.anchors.get(setup.anchor(anchor)?)?.shape {
            Shape::Point => Shape::Point,
            Shape::Plane(normal) => Shape::Plane((normal + deflection.anchor_tilt).normalize()),
            Shape::Sphere(radius) => Shape::Sphere(radius + deflection.anchor_growth),
        })
    }

    /// The tool frame at the row's target, turned as the robot file has it, and the velocity (v; w) of its origin by each joint.
    pub(crate) fn tool(&self, velocities: &mut [Twist]) -> Pose {
        let behind = &self.scratch.posture.behind;
        let tool = behind[self.robot.joints()] * self.robot.tool_at(self.scratch.target);
        for (joint, velocity) in velocities.iter_mut().enumerate() {
            *velocity = self
                .robot
                .velocity(joint, &behind[joint], &tool.translation);
        }
        tool
    }

    /// Derivatives of the point, m.
    pub(crate) fn partials(&mut self, mut emit: impl FnMut(usize, Vector3<f64>)) {
        self.scratch.velocities(self.robot, &self.point);
        let rates = self.scratch.rates();
        for (parameter, direction) in &self.scratch.deflection.partials {
            emit(*parameter, rates.along(direction));
        }
    }

    /// Derivatives of the orientation as small rotations about the tracker's axes, rad.
    pub(crate) fn rotations(&self, mut emit: impl FnMut(usize, Vector3<f64>)) {
        let deflection = &self.scratch.deflection;
        let turns = self.scratch.turns(self.robot);
        for (parameter, direction) in &deflection.partials {
            if let Some(rotation) = turns.along(direction, &deflection.compliance) {
                emit(*parameter, rotation);
            }
        }
    }

    /// Derivatives of the vector from the row's anchor to the point (m), which is `reach`: as seen from a plane that tilts, from the
    /// surface of a sphere that grows.
    pub(crate) fn partials_from_anchor(
        &mut self,
        reach: &Vector3<f64>,
        mut emit: impl FnMut(usize, Vector3<f64>),
    ) {
        self.scratch.velocities(self.robot, &self.point);
        let rates = self.scratch.rates();
        for (parameter, direction) in &self.scratch.deflection.partials {
            emit(*parameter, rates.anchor_reach(direction, reach));
        }
    }
}

impl PlacementBuffers {
    /// How the point moves with every joint and station.
    pub(super) fn velocities(&mut self, robot: &RobotModel, point: &Vector3<f64>) {
        let Self {
            posture: Posture { behind, .. },
            stations,
            before,
            by_station,
            by_joint,
            ..
        } = self;
        for ((velocity, frame), station) in by_station.iter_mut().zip(&*before).zip(&*stations) {
            // A twist (v; w) in the frame moves the point by R v + R w x arm.
            let mut spatial = Matrix3x6::zeros();
            spatial
                .fixed_view_mut::<3, 3>(0, 0)
                .copy_from(&frame.rotation);
            spatial
                .fixed_view_mut::<3, 3>(0, 3)
                .copy_from(&(hat(&(frame.translation - point)) * frame.rotation));
            *velocity = spatial * station.jacobian;
        }
        for (joint, velocity) in by_joint.iter_mut().enumerate() {
            let axis = behind[joint].rotation * robot.axis(joint);
            *velocity = if robot.is_revolute(joint) {
                axis.cross(&(point - behind[joint].point(robot.point(joint))))
            } else {
                axis
            };
        }
    }

    /// How the point moves, of the row whose velocities were asked for last.
    fn rates(&self) -> Rates<'_> {
        Rates {
            by_joint: &self.by_joint,
            by_station: &self.by_station,
            compliance: &self.deflection.compliance,
        }
    }

    /// How the target turns, of the row that was placed last.
    pub(super) fn turns(&self, robot: &RobotModel) -> Turns {
        let joint = |joint: usize| {
            if robot.is_revolute(joint) {
                self.posture.behind[joint].rotation * robot.axis(joint)
            } else {
                Vector3::zeros()
            }
        };
        let stations = self.before.iter().zip(&self.stations);
        let by_station = stations.map(|(frame, station)| {
            (
                frame.rotation,
                station.jacobian.fixed_rows::<3>(3).into_owned(),
            )
        });
        Turns {
            by_joint: (0..robot.joints()).map(joint).collect(),
            by_station: by_station.collect(),
        }
    }
}

/// How the target turns with every joint and station, rad per rad of each, tracker frame.
#[derive(Clone)]
pub(super) struct Turns {
    by_joint: Vec<Vector3<f64>>,
    /// The frame of each station, and the rotation in it by the station's twist.
    by_station: Vec<(Matrix3<f64>, Matrix3x6<f64>)>,
}

impl Turns {
    /// rad per unit of a parameter; none of what turns nothing.
    pub(super) fn along(&self, direction: &Direction, yielding: &[f64]) -> Option<Vector3<f64>> {
        match direction {
            Direction::Joint(joint, rate) => Some(self.by_joint[*joint] * *rate),
            Direction::Station(station, rate) => {
                let (frame, twist) = &self.by_station[*station];
                Some(frame * (twist * rate))
            }
            Direction::Torque(joint, rate) => {
                Some(self.by_joint[*joint] * (yielding[*joint] * *rate))
            }
            Direction::Anchor(_)
            | Direction::AnchorTilt(..)
            | Direction::AnchorGrowth(_)
            | Direction::Instrument(_) => None,
        }
    }
}

/// How a row's point moves by the travel of each joint and the twist at each station, and how far each joint yields.
#[derive(Clone, Copy)]
pub(super) struct Rates<'a> {
    pub(super) by_joint: &'a [Vector3<f64>],
    pub(super) by_station: &'a [Matrix3x6<f64>],
    pub(super) compliance: &'a [f64],
}

impl Rates<'_> {
    /// Derivative of the point as the tracker reads it, m per unit of a parameter that acts there.
    pub(super) fn along(&self, direction: &Direction) -> Vector3<f64> {
        match direction {
            Direction::Joint(joint, rate) => self.by_joint[*joint] * *rate,
            Direction::Station(station, rate) => self.by_station[*station] * rate,
            Direction::Torque(joint, rate) => {
                self.by_joint[*joint] * (self.compliance[*joint] * *rate)
            }
            Direction::Anchor(_) | Direction::AnchorTilt(..) | Direction::AnchorGrowth(_) => {
                Vector3::zeros()
            }
            Direction::Instrument(rate) => *rate,
        }
    }

    /// Derivative of the vector from the row's anchor to the point, which is `reach`, m per unit.
    pub(super) fn anchor_reach(&self, direction: &Direction, reach: &Vector3<f64>) -> Vector3<f64> {
        match direction {
            Direction::Anchor(rate) => -rate,
            Direction::AnchorTilt(normal, turn) => normal * turn.dot(reach),
            Direction::AnchorGrowth(rate) => reach
                .try_normalize(0.0)
                .map_or_else(Vector3::zeros, |along| along * -*rate),
            Direction::Instrument(_) => Vector3::zeros(),
            other => self.along(other),
        }
    }
}

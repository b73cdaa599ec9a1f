//! The robot as a product of exponentials: screws at the zero pose, forward kinematics (Eqs. 1-2 of the paper).

use crate::description::{JointKind, RobotDescription};
use crate::robot::measurements::Measurements;
use crate::robot::setup::MeasurementSetup;
use crate::spatial::{Pose, Twist, hat, screw};
use nalgebra::{Matrix3, Vector3};

/// Cosine from which on two axes are parallel.
const PARALLEL: f64 = 0.99;

/// A serial robot ready for computing; immutable.
#[derive(Debug, Clone)]
pub struct RobotModel {
    description: RobotDescription,
    screws: Vec<Twist>,
    axes: Vec<Vector3<f64>>,
    points: Vec<Vector3<f64>>,
    /// The matrix of `axis x` and its square.
    turns: Vec<(Matrix3<f64>, Matrix3<f64>)>,
    normals: Vec<[(usize, Vector3<f64>); 2]>,
    home: Pose,
    setup: MeasurementSetup,
}

impl RobotModel {
    /// The chain of a description, with nothing measured yet.
    pub fn new(description: RobotDescription) -> Self {
        let axes: Vec<Vector3<f64>> = description
            .joints
            .iter()
            .map(|joint| Vector3::from(joint.axis).normalize())
            .collect();
        let points: Vec<Vector3<f64>> = description
            .joints
            .iter()
            .map(|joint| Vector3::from(joint.point))
            .collect();
        let screws = description
            .joints
            .iter()
            .zip(axes.iter().zip(&points))
            .map(|(joint, (axis, point))| match joint.kind {
                JointKind::Revolute => screw(axis, point),
                JointKind::Prismatic => Twist::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0),
            })
            .collect();
        let turns = axes
            .iter()
            .map(|axis| (hat(axis), hat(axis) * hat(axis)))
            .collect();
        let normals = axes.iter().map(normals).collect();
        let r = &description.tool_rotation;
        let rotation = Matrix3::from_fn(|row, column| r[row][column]);
        let home = Pose::new(rotation, Vector3::from(description.tool));
        Self {
            description,
            screws,
            axes,
            points,
            turns,
            normals,
            home,
            setup: MeasurementSetup::default(),
        }
    }

    /// The robot with what it is measured by.
    pub fn measured_by(self, setup: MeasurementSetup) -> Self {
        Self { setup, ..self }
    }

    /// Targets and anchors that belong to the arm as it was measured.
    pub fn setup(&self) -> &MeasurementSetup {
        &self.setup
    }

    /// Where a target (by number) sits, the tool point without one: zero pose, base frame.
    pub(crate) fn mounting(&self, target: Option<usize>) -> &Pose {
        target
            .and_then(|target| self.setup.targets.get(target))
            .map_or(&self.home, |target| &target.mounting)
    }

    /// The tool frame where a target (by number) sits: how an instrument's frame is turned against the tool belongs to the instrument.
    pub(crate) fn tool_at(&self, target: Option<usize>) -> Pose {
        Pose::new(self.home.rotation, self.mounting(target).translation)
    }

    /// How the target that a row measured is mounted on the last body.
    pub fn mounting_at(&self, data: &Measurements, row: usize) -> &Pose {
        self.mounting(self.setup.target(data.target(row)))
    }

    /// The data that the model was made of.
    pub fn description(&self) -> &RobotDescription {
        &self.description
    }

    /// Number of joints.
    #[inline]
    pub fn joints(&self) -> usize {
        self.screws.len()
    }

    /// Unit screws at the zero pose in the base frame.
    pub(crate) fn screws(&self) -> &[Twist] {
        &self.screws
    }

    /// Unit axis of joint `joint` (from 0) at the zero pose.
    pub fn axis(&self, joint: usize) -> &Vector3<f64> {
        &self.axes[joint]
    }

    /// Whether the axes of two joints are parallel at the zero pose, whichever way they turn.
    pub fn is_parallel(&self, a: usize, b: usize) -> bool {
        self.axes[a].dot(&self.axes[b]).abs() > PARALLEL
    }

    /// A point on the axis of joint `joint`, m, at the zero pose.
    pub fn point(&self, joint: usize) -> &Vector3<f64> {
        &self.points[joint]
    }

    /// Whether a joint (from 0) turns; else it slides.
    #[inline]
    pub fn is_revolute(&self, joint: usize) -> bool {
        self.description.joints[joint].kind == JointKind::Revolute
    }

    /// Tool frame at the zero pose; its origin is the measured point.
    pub fn home(&self) -> &Pose {
        &self.home
    }

    /// Two unit directions across the axis of joint `joint`, each with the number of the base axis that it comes from.
    pub(crate) fn normals(&self, joint: usize) -> &[(usize, Vector3<f64>); 2] {
        &self.normals[joint]
    }

    /// exp of the joint's screw times its travel: Rodrigues' formula about the joint's own axis.
    pub fn motion(&self, joint: usize, travel: &Travel) -> Pose {
        if !self.is_revolute(joint) {
            return Pose::new(Matrix3::identity(), self.axes[joint] * travel.value());
        }
        let (sine, cosine) = travel.sin_cos();
        let (cross, square) = &self.turns[joint];
        let turn = cross * sine + square * (1.0 - cosine);
        Pose::new(Matrix3::identity() + turn, -(turn * self.points[joint]))
    }

    /// Velocity (v; w) of `point` by joint `joint`, whose zero-pose coordinates `frame` maps; both in one common frame.
    pub(crate) fn velocity(&self, joint: usize, frame: &Pose, point: &Vector3<f64>) -> Twist {
        let axis = frame.rotation * self.axes[joint];
        if !self.is_revolute(joint) {
            return Twist::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0);
        }
        let v = axis.cross(&(point - frame.point(&self.points[joint])));
        Twist::new(v.x, v.y, v.z, axis.x, axis.y, axis.z)
    }

    /// Tool frame in the base frame for joint positions `q` (rad or m): exp(x1 q1) ... exp(xn qn) home.
    pub fn forward(&self, q: &[f64]) -> Pose {
        self.last_body(q) * self.home
    }

    /// Motion of the last body from the zero pose, base frame, for joint positions `q` (rad or m).
    pub fn last_body(&self, q: &[f64]) -> Pose {
        let mut pose = Pose::identity();
        for (joint, travel) in q.iter().enumerate().take(self.joints()) {
            pose = pose * self.motion(joint, &Travel::new(*travel));
        }
        pose
    }
}

/// The two base axes least along `axis`, in their order, made perpendicular to it.
fn normals(axis: &Vector3<f64>) -> [(usize, Vector3<f64>); 2] {
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()));
    let mut chosen = [order[0], order[1]];
    chosen.sort_unstable();
    chosen.map(|k| (k, (Vector3::ith(k, 1.0) - axis * axis[k]).normalize()))
}

/// Travel of a joint, rad or m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Travel {
    value: f64,
    sine: f64,
    cosine: f64,
}

/// Below this angle (rad) the series are exact in f64.
const SMALL: f64 = 2e-2;

impl Travel {
    /// The range that holds one value.
    pub fn new(value: f64) -> Self {
        // The same bits on every machine, and no call into the C library, which here costs a fifth of a whole fit.
        let (sine, cosine) = libm::sincos(value);
        Self {
            value,
            sine,
            cosine,
        }
    }

    /// rad or m.
    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    pub(crate) fn sin_cos(&self) -> (f64, f64) {
        (self.sine, self.cosine)
    }

    /// The travel changed by `by`: addition theorems, with series for small changes.
    pub(crate) fn moved(&self, by: f64) -> Self {
        if by.abs() >= SMALL {
            return Self::new(self.value + by);
        }
        let square = by * by;
        let sine = by * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
        let versine = 0.5 * square * (1.0 - square / 12.0 * (1.0 - square / 30.0));
        Self {
            value: self.value + by,
            sine: self.sine + (self.cosine * sine - self.sine * versine),
            cosine: self.cosine - (self.sine * sine + self.cosine * versine),
        }
    }
}

/// rad: more is seldom a position of a joint, but a common one in degrees.
pub const ONE_AND_A_HALF_TURNS: f64 = 3.0 * std::f64::consts::PI;

/// What is wrong with joints of which most rows turn too far; `value`: that of a joint (from 0), rad.
pub fn too_far(name: &str, unit: &str, rows: [u64; 2], joint: usize, value: f64) -> String {
    let [far, all] = rows;
    let (shown, symbol, most) = match unit {
        "rad" => (value, "rad", "9.42"),
        _ => (value.to_degrees(), "deg", "540"),
    };
    format!(
        "`{name}` is declared in {unit}, but {far} of {all} rows hold a joint beyond one and a half turns, here joint {} at {shown:.4} {symbol}; allowed: up to {most} {symbol}",
        joint + 1
    )
}

/// What a number is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A coordinate or a length, m.
    Length,
    /// Along the axis of a Denavit-Hartenberg joint, m: nearly parallel axes come closest to each other far away.
    Offset,
    /// rad.
    Angle,
    /// kg.
    Mass,
    /// kg m2.
    Inertia,
    /// Motor turns per turn of the joint, torque per current, turns of one joint by another.
    Factor,
}

impl Bound {
    /// The largest size, its unit, and what may be meant instead.
    fn most(self) -> (f64, &'static str, &'static str) {
        match self {
            // The longest tracks are 100 m.
            Self::Length => (1e3, "m", "; is it in another unit?"),
            // Axes that are parallel to 1e-9 rad at 1 m.
            Self::Offset => (1e9, "m", "; is it in another unit?"),
            // Ten turns: more is an angle in degrees.
            Self::Angle => (63.0, "rad", ", ten turns; is it in another unit?"),
            // The heaviest robots are 10 t.
            Self::Mass => (1e6, "kg", "; is it in another unit?"),
            Self::Inertia => (1e7, "kg m2", "; is it in another unit?"),
            Self::Factor => (1e6, "", ""),
        }
    }

    /// What is wrong with a value in SI; nothing of NaN, which stands for what could not be read.
    pub fn fault(self, value: f64) -> Option<String> {
        let (most, unit, instead) = self.most();
        let number = |value: f64| {
            if value.abs() < 1e6 {
                format!("{value}")
            } else {
                format!("{value:e}")
            }
        };
        (value.abs() > most)
            .then(|| format!("{} {unit}", number(value)).trim_end().to_string())
            .map(|shown| {
                let most = format!("{} {unit}", number(most));
                format!("{shown} is more than {}{instead}", most.trim_end())
            })
    }
}

#[cfg(test)]
mod bound_tests {
    use super::Bound;

    #[test]
    fn what_no_robot_has_is_told_with_its_size() {
        assert_eq!(
            Bound::Length.fault(-1e305).as_deref(),
            Some("-1e305 m is more than 1000 m; is it in another unit?")
        );
        assert_eq!(
            Bound::Angle.fault(180.0).as_deref(),
            Some("180 rad is more than 63 rad, ten turns; is it in another unit?")
        );
        assert_eq!(
            Bound::Factor.fault(f64::INFINITY).as_deref(),
            Some("inf is more than 1e6")
        );
        assert_eq!(
            [
                Bound::Length.fault(999.0),
                Bound::Angle.fault(-62.8),
                Bound::Mass.fault(f64::NAN)
            ],
            [None, None, None]
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_travel_is_the_travel_of_the_sum() {
        for value in [-3.0, -0.4, 0.0, 1e-3, 2.9] {
            for by in [-0.5, -0.0199, -1e-5, 0.0, 3e-9, 0.0199, 0.0201, 2.0] {
                let (moved, whole) = (Travel::new(value).moved(by), Travel::new(value + by));
                assert_eq!(moved.value, whole.value);
                assert!((moved.sine - whole.sine).abs() < 3e-16, "{value} + {by}");
                assert!(
                    (moved.cosine - whole.cosine).abs() < 3e-16,
                    "{value} + {by}"
                );
            }
        }
    }
}

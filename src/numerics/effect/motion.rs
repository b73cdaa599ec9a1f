//! Where a small motion enters the chain, and along which directions: the generators of laws. The target as the instrument sees it.

use super::{ArmState, Deflection, NumberSpec, Place};
use crate::robot::RobotModel;
use crate::spatial::{Twist, screw};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Joints and links count from 0.
#[expect(missing_docs, reason = "a field is documented with its motion")]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// A joint travels.
    Joint { joint: usize },
    /// Joint `moved` travels because of joint `by`.
    Coupled { by: usize, moved: usize },
    /// The axis of a joint tilts about the directions across it, or about one of them (0 or 1). It stands in the link before, or turns
    /// with the joint; about which point of it.
    Axis {
        joint: usize,
        about: Option<usize>,
        turning: bool,
        #[serde(default, skip_serializing_if = "AxisPoint::is_own")]
        at: AxisPoint,
    },
    /// A joint is displaced along its axis, or in both directions across it, the link before carrying the directions.
    Slide { joint: usize, along: bool },
    /// A link bends in its middle, about both directions across it.
    Bend { link: usize },
    /// Neighbouring links grow along themselves, each in proportion to its length.
    Links { first: usize, last: usize },
    /// The base, in some of its six directions.
    Base { axes: Axes },
    /// The measuring frame, in some of its six directions.
    Tracker { axes: Axes },
    /// The tool, in some of its six directions, axes of the base at the zero pose.
    Tool { axes: Axes },
    /// What the instrument reads.
    Instrument {
        #[serde(rename = "of")]
        reading: Polar,
    },
}

/// The point of a joint's axis about which it tilts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AxisPoint {
    /// The joint's own.
    #[default]
    Own,
    /// The one nearest to the next joint, or to the tool.
    Next,
    /// The one nearest to the joint before.
    Before,
}

impl AxisPoint {
    fn is_own(&self) -> bool {
        *self == Self::Own
    }

    /// Where it is, m, zero pose.
    pub(crate) fn of(self, robot: &RobotModel, joint: usize) -> Vector3<f64> {
        let (point, axis) = (robot.point(joint), robot.axis(joint));
        let other = match self {
            Self::Own => *point,
            Self::Next if joint + 1 < robot.joints() => *robot.point(joint + 1),
            Self::Next => robot.home().translation,
            Self::Before => joint
                .checked_sub(1)
                .map_or(*point, |before| *robot.point(before)),
        };
        point + axis * axis.dot(&(other - point))
    }
}

/// Directions of a frame's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axes {
    /// Displaced.
    Place,
    /// Turned about the origin.
    Rotation,
    /// Both.
    Both,
}

impl Axes {
    fn range(self) -> std::ops::Range<usize> {
        match self {
            Self::Place => 0..3,
            Self::Rotation => 3..6,
            Self::Both => 0..6,
        }
    }

    /// How many they are.
    pub fn count(self) -> usize {
        self.range().len()
    }

    /// Name, unit and usual size of each.
    fn numbers(self) -> &'static [(&'static str, Unit, f64)] {
        &MOTION[self.range()]
    }
}

/// The numbers of a rigid motion.
pub(super) const MOTION: [(&str, Unit, f64); 6] = [
    ("x", Unit::Millimetre, 0.1),
    ("y", Unit::Millimetre, 0.1),
    ("z", Unit::Millimetre, 0.1),
    ("rx", Unit::Radian, 0.1),
    ("ry", Unit::Radian, 0.1),
    ("rz", Unit::Radian, 0.1),
];

impl Motion {
    /// Where it acts.
    pub fn place(&self) -> Place {
        match *self {
            Self::Joint { joint } | Self::Axis { joint, .. } | Self::Slide { joint, .. } => {
                Place::Joint(joint)
            }
            Self::Bend { link } => Place::Links(link, link),
            Self::Coupled { by, moved } => Place::Coupled(by, moved),
            Self::Links { first, last } => Place::Links(first, last),
            Self::Base { .. } => Place::Base,
            Self::Tracker { .. } | Self::Instrument { .. } => Place::Tracker,
            Self::Tool { .. } => Place::Tool,
        }
    }

    /// The joint that travels, where that is all of the motion.
    pub fn travels(&self) -> Option<usize> {
        match *self {
            Self::Joint { joint } | Self::Coupled { moved: joint, .. } => Some(joint),
            _ => None,
        }
    }

    /// The unit of a travel of the joint that moves; of a frame, of its displacement.
    pub(super) fn unit(&self, robot: &RobotModel) -> Unit {
        match *self {
            Self::Joint { joint } | Self::Coupled { moved: joint, .. }
                if robot.is_revolute(joint) =>
            {
                Unit::Radian
            }
            Self::Axis { .. }
            | Self::Bend { .. }
            | Self::Instrument {
                reading: Polar::Azimuth | Polar::Elevation,
            } => Unit::Radian,
            _ => Unit::Millimetre,
        }
    }

    /// Coefficients of a frame's motion, under names made of those of its axes.
    pub(super) fn frame_numbers(&self, name: impl Fn(&str) -> String) -> Vec<NumberSpec> {
        match self {
            Self::Base { axes } | Self::Tracker { axes } | Self::Tool { axes } => axes
                .numbers()
                .iter()
                .map(|(axis, unit, sigma)| (name(axis), *unit, *sigma))
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Moves by function number `k` of `count`, which has `value`.
    pub(super) fn add(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        (k, count): (usize, usize),
        value: f64,
        p: &[f64],
        out: &mut Deflection,
    ) {
        match *self {
            Self::Joint { joint } | Self::Coupled { moved: joint, .. } => {
                out.turn(k, p, joint, value)
            }
            Self::Axis {
                joint,
                about,
                turning,
                at,
            } => {
                let normals = robot.normals(joint).iter().enumerate();
                let (station, point) =
                    (if turning { joint + 1 } else { joint }, at.of(robot, joint));
                let chosen = normals
                    .filter(|(axis, _)| about.is_none_or(|about| about == *axis))
                    .map(|(_, normal)| normal);
                for (i, (_, normal)) in chosen.enumerate() {
                    out.shift(count * i + k, p, station, screw(normal, &point) * value);
                }
            }
            Self::Slide { joint, along } => {
                let axis = along.then(|| robot.axis(joint));
                let across = robot
                    .normals(joint)
                    .iter()
                    .filter(|_| !along)
                    .map(|(_, normal)| normal);
                for (i, direction) in axis.into_iter().chain(across).enumerate() {
                    let moved = direction * value;
                    out.shift(
                        count * i + k,
                        p,
                        joint,
                        Twist::new(moved.x, moved.y, moved.z, 0.0, 0.0, 0.0),
                    );
                }
            }
            Self::Bend { link } => {
                let along = extent(robot, link);
                if along.norm() <= SHORT {
                    return;
                }
                let middle = robot.point(link) + 0.5 * along;
                for (i, normal) in across(&along).iter().enumerate() {
                    out.shift(count * i + k, p, link + 1, screw(normal, &middle) * value);
                }
            }
            Self::Links { first, last } => {
                for link in first..=last {
                    let growth = extent(robot, link) * value;
                    out.shift(
                        k,
                        p,
                        link + 1,
                        Twist::new(growth.x, growth.y, growth.z, 0.0, 0.0, 0.0),
                    );
                }
            }
            Self::Base { axes } | Self::Tracker { axes } => shift(0, axes, k, value, p, out),
            Self::Tool { axes } => shift(robot.joints(), axes, k, value, p, out),
            Self::Instrument { reading } => out.misread(k, p, state.sight().moved(reading) * value),
        }
    }
}

fn shift(station: usize, axes: Axes, k: usize, value: f64, p: &[f64], out: &mut Deflection) {
    let range = axes.range();
    for (i, axis) in range.clone().enumerate() {
        out.shift(range.len() * k + i, p, station, Twist::ith(axis, value));
    }
}

/// From the point of a link's joint to that of the next one, m, zero pose; the last link ends at the tool.
pub(super) fn extent(robot: &RobotModel, link: usize) -> Vector3<f64> {
    let end = if link + 1 < robot.joints() {
        *robot.point(link + 1)
    } else {
        robot.home().translation
    };
    end - robot.point(link)
}

/// Two unit vectors across a direction and each other.
fn across(along: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = along.iamin();
    let first = along.cross(&Vector3::ith(least, 1.0)).normalize();
    [first, along.cross(&first).normalize()]
}

/// Shorter links (m) neither bend nor grow visibly.
pub(super) const SHORT: f64 = 1e-6;

/// One of the three numbers that an instrument reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Polar {
    /// About the instrument's standing axis, rad.
    Azimuth,
    /// Above its horizon, rad.
    Elevation,
    /// m.
    Range,
}

/// The target as the instrument sees it, which stands at the origin of the recording's frame, its standing axis along z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// rad.
    pub(crate) azimuth: f64,
    /// rad.
    pub(crate) elevation: f64,
    /// m.
    pub(crate) range: f64,
}

impl Sight {
    /// Where an instrument sees a point of its frame, m.
    pub fn of(point: &Vector3<f64>) -> Self {
        let level = point.x.hypot(point.y);
        Self {
            azimuth: libm::atan2(point.y, point.x),
            elevation: libm::atan2(point.z, level),
            range: point.norm(),
        }
    }

    /// By how much the point moves (m) where a reading grows by 1 (rad, m).
    pub(crate) fn moved(&self, reading: Polar) -> Vector3<f64> {
        let ((sa, ca), (se, ce)) = (libm::sincos(self.azimuth), libm::sincos(self.elevation));
        match reading {
            Polar::Azimuth => Vector3::new(-sa, ca, 0.0) * (self.range * ce),
            Polar::Elevation => Vector3::new(-se * ca, -se * sa, ce) * self.range,
            Polar::Range => Vector3::new(ce * ca, ce * sa, se),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_moves_the_point_as_polar_coordinates_say() {
        let point = |[azimuth, elevation, range]: [f64; 3]| {
            let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
            Vector3::new(ce * ca, ce * sa, se) * range
        };
        let (at, step) = ([2.1, -0.4, 3.7], 1e-6);
        let sight = Sight::of(&point(at));
        assert!(
            (sight.azimuth - at[0]).abs()
                + (sight.elevation - at[1]).abs()
                + (sight.range - at[2]).abs()
                < 1e-12
        );
        for (k, reading) in [Polar::Azimuth, Polar::Elevation, Polar::Range]
            .into_iter()
            .enumerate()
        {
            let [mut more, mut less] = [at; 2];
            (more[k], less[k]) = (at[k] + step, at[k] - step);
            let expected = (point(more) - point(less)) / (2.0 * step);
            assert!(
                (sight.moved(reading) - expected).norm() < 1e-8,
                "{reading:?}"
            );
        }
    }
}

//! An effect that nobody listed: a drawn shape of one variable, or a product of two, in one direction of motion anywhere on the chain.

use super::{Act, Motion, State, Stated, TrueValue, true_values};
use crate::arm::Row;
use crate::matrix::{self, Matrix, Vector};
use crate::memory::Moment;
use crate::tracker::Polar;
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What it moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForeignMotion {
    /// A joint about its axis.
    JointTurn,
    /// A joint's axis, seen from the body that carries it.
    JointShift,
    /// The direction of a joint's axis, seen from the body that carries it.
    JointTilt,
    /// The far end of a link.
    LinkShift,
    /// The direction of the far end of a link.
    LinkBend,
    /// The base.
    BaseShift,
    /// The direction of the base.
    BaseTurn,
    /// The measured point in the last link.
    ToolShift,
    /// What the tracker reads: range.
    Range,
    /// Azimuth.
    Azimuth,
    /// Elevation.
    Elevation,
}

impl ForeignMotion {
    /// Whether it acts in what the instrument reads, and not on the arm.
    pub(crate) fn is_sighted(self) -> bool {
        matches!(self, Self::Range | Self::Azimuth | Self::Elevation)
    }

    /// Whether it is a turn, arcsec; else it is a shift, um.
    fn is_turn(self) -> bool {
        use ForeignMotion::*;
        matches!(
            self,
            JointTurn | JointTilt | LinkBend | BaseTurn | Azimuth | Elevation
        )
    }

    /// Where it acts: on a joint or link of this number, or on what has none.
    pub(crate) fn place(self, seat: usize) -> String {
        use ForeignMotion::*;
        match self {
            JointTurn | JointShift | JointTilt => format!("joint {seat}"),
            LinkShift | LinkBend => format!("link {seat}"),
            BaseShift | BaseTurn => "base".into(),
            ToolShift => "tool".into(),
            Range | Azimuth | Elevation => "tracker".into(),
        }
    }
}

/// `size * shape(variable)`, or the product of two shapes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Foreign {
    /// What moves.
    pub motion: ForeignMotion,
    /// The joint or link that moves, from 1; 1 where it is neither.
    #[serde(default = "first")]
    pub seat: usize,
    /// Unit vector of the shift or of the rotation, in the frame of the body that carries it.
    #[serde(default)]
    pub direction: Vector,
    /// At a shape of 1: um of a shift or range, arcsec of a turn.
    pub size: f64,
    /// One course, or two of which the product counts.
    pub courses: Vec<ForeignCourse>,
}

/// A shape over a variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForeignCourse {
    /// What it is a function of.
    pub over: ForeignVariable,
    /// The values of the variable between which the shape is drawn; beyond them it holds its edge value.
    pub between: [f64; 2],
    /// As a function of the share of that way, 0 to 1.
    pub shape: ForeignShape,
}

impl ForeignCourse {
    /// Where a value of the variable lies on the way, 0 to 1.
    fn way(&self, value: f64) -> f64 {
        let [from, to] = self.between;
        ((value - from) / (to - from)).clamp(0.0, 1.0)
    }

    /// The same as straight lines between its values at some of its variable, with the edge value beyond them.
    fn known_at(&self, values: impl Iterator<Item = f64>) -> Self {
        let ways = values.map(|value| self.way(value));
        let mut points: Vec<[f64; 2]> = ways.map(|way| [way, self.shape.value(way)]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self {
            over: self.over.clone(),
            shape: ForeignShape::Corners(points),
            ..*self
        }
    }
}

fn first() -> usize {
    1
}

impl Foreign {
    /// The variables of its courses at a row, with which `torque` (Nm) and with the measured `point` (m) as the motion has it.
    pub fn values(&self, row: &Row, memory: f64, torque: &[f64], point: Vector) -> Vec<f64> {
        let seen = Seen {
            row,
            memory,
            torque,
            point,
        };
        let values = self.courses.iter().map(|course| course.over.value(&seen));
        values.collect()
    }

    /// The same as far as rows show it at which the variables of its courses have these values: straight lines between them.
    pub(crate) fn known_at(&self, values: &[Vec<f64>]) -> Self {
        let known =
            |(k, course): (usize, &ForeignCourse)| course.known_at(values.iter().map(|all| all[k]));
        Self {
            courses: self.courses.iter().enumerate().map(known).collect(),
            ..self.clone()
        }
    }

    /// Product of the shapes in what is seen.
    fn share(&self, seen: &Seen) -> f64 {
        let courses = self.courses.iter();
        let values = courses.map(|one| one.shape.value(one.way(one.over.value(seen))));
        values.product()
    }

    /// The motion, m or rad along its direction.
    fn along(&self, share: f64) -> Vector {
        let unit = if self.motion.is_turn() { ARCSEC } else { 1e-6 };
        matrix::scale(self.direction, unit * self.size * share)
    }

    /// The step of a body, whichever of the two it is.
    fn step(&self, share: f64) -> Matrix {
        let along = self.along(share);
        if self.motion.is_turn() {
            matrix::turn_by(along)
        } else {
            matrix::shift(along)
        }
    }
}

impl Act for Foreign {
    fn act(&self, state: &State, motion: &mut Motion) {
        use ForeignMotion::*;
        let seen = Seen {
            row: state.row,
            memory: state.memory,
            torque: state.torque,
            point: state.posture.tool,
        };
        let share = self.share(&seen);
        let index = self.seat - 1;
        match self.motion {
            JointTurn => motion.joint[index] += ARCSEC * self.size * share,
            JointShift | JointTilt => {
                motion.move_axis(state.arm.foot, index, &self.step(share));
            }
            LinkShift | LinkBend => motion.move_end(index, &self.step(share)),
            BaseShift | BaseTurn => motion.base = matrix::times(&self.step(share), &motion.base),
            ToolShift => motion.tool = matrix::add(motion.tool, self.along(share)),
            Range | Azimuth | Elevation => {}
        }
    }
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        let mut all = self.courses.iter().map(|course| course.over.remember(past));
        all.find(|all| !all.is_empty()).unwrap_or_default()
    }
    fn sight(&self, row: &Row, memory: f64, point: Vector) -> Vector {
        if !self.motion.is_sighted() {
            return point;
        }
        let seen = Seen {
            row,
            memory,
            torque: &[],
            point,
        };
        let by = self.size * self.share(&seen);
        let mut polar = Polar::of(point);
        match self.motion {
            ForeignMotion::Range => polar.range += 1e-6 * by,
            ForeignMotion::Azimuth => polar.azimuth += ARCSEC * by,
            _ => polar.elevation += ARCSEC * by,
        }
        polar.point()
    }
}

impl Stated for Foreign {
    fn seat(&self) -> Option<usize> {
        Some(self.seat)
    }
    fn scale(&mut self, by: f64) {
        self.size *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let unit = if self.motion.is_turn() {
            "arcsec"
        } else {
            "um"
        };
        let place = self.motion.place(self.seat);
        true_values("unknown", "foreign", &place, [("size", unit, self.size)])
    }
}

/// A variable of a recording; joints count from 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForeignVariable {
    /// Angle of a joint, rad.
    Angle(usize),
    /// Side of approach of a joint, +1 or -1.
    Approach(usize),
    /// Travel of a joint in the last move, rad.
    LastMove(usize),
    /// Torque on a joint, Nm; the instrument knows none.
    Load(usize),
    /// kg.
    Payload,
    /// s.
    Time,
    /// C.
    Temperature,
    /// Where the measured point is along a direction, m: from the base, of the instrument from the instrument.
    Space(Vector),
    /// Travel of a joint, of which each move's share fades with a time (s): rad.
    Relaxing(usize, f64),
    /// Travel of a joint that sticks and slips beyond a limit (rad): rad.
    Slipping(usize, f64),
}

/// What is seen of a row.
struct Seen<'a> {
    row: &'a Row,
    memory: f64,
    torque: &'a [f64],
    /// m.
    point: Vector,
}

impl ForeignVariable {
    /// Its value; 0 for a joint that there is not.
    fn value(&self, seen: &Seen) -> f64 {
        let at = |all: &[f64], joint: usize| all.get(joint.wrapping_sub(1)).copied().unwrap_or(0.0);
        match self {
            Self::Angle(joint) => at(&seen.row.command, *joint),
            Self::Approach(joint) => at(&seen.row.direction, *joint),
            Self::Load(joint) => at(seen.torque, *joint),
            Self::Payload => seen.row.payload_kg,
            Self::Time => seen.row.time_s,
            Self::Temperature => seen.row.temperature_c,
            Self::Space(direction) => matrix::dot(*direction, seen.point),
            Self::LastMove(_) | Self::Relaxing(..) | Self::Slipping(..) => seen.memory,
        }
    }

    /// Its value row by row where it depends on the rows before; else nothing.
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        match *self {
            Self::LastMove(joint) => {
                let last = |moment: &Moment| moment.travels(joint).last().unwrap_or(0.0);
                past.iter().map(last).collect()
            }
            Self::Relaxing(joint, time_s) => {
                let (mut then, mut left) = (0.0, 0.0);
                let live = |moment: &Moment| {
                    left = left * (-(moment.time_s - then) / time_s).exp()
                        + moment.travels(joint).sum::<f64>();
                    then = moment.time_s;
                    left
                };
                past.iter().map(live).collect()
            }
            Self::Slipping(joint, limit) => {
                let mut stretch: f64 = 0.0;
                let live = |moment: &Moment| {
                    let ways = moment.travels(joint);
                    ways.for_each(|way| stretch = (stretch + way).max(-limit).min(limit));
                    stretch
                };
                past.iter().map(live).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether it depends on the rows before.
    pub(crate) fn is_remembered(&self) -> bool {
        matches!(
            self,
            Self::LastMove(_) | Self::Relaxing(..) | Self::Slipping(..)
        )
    }
}

/// A function of 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForeignShape {
    /// From -1 to 1: for what has two values only.
    Straight,
    /// Sum of `amplitude cos(rate x + phase)`, rows of amplitude, rate (rad) and phase (rad).
    Smooth(Vec<[f64; 3]>),
    /// Straight pieces between points (x, value) with rising x; outside of them the nearest value.
    Corners(Vec<[f64; 2]>),
    /// Steps: pairs (x, value) with rising x, the value from that x on; 0 before the first.
    Jumps(Vec<[f64; 2]>),
}

impl ForeignShape {
    /// At `x`.
    fn value(&self, x: f64) -> f64 {
        match self {
            Self::Straight => 2.0 * x - 1.0,
            Self::Smooth(waves) => {
                let wave = |[size, rate, phase]: &[f64; 3]| size * (rate * x + phase).cos();
                waves.iter().map(wave).sum()
            }
            Self::Corners(points) => {
                let after = points.iter().position(|[at, _]| *at > x);
                let (before, after) = points.split_at(after.unwrap_or(points.len()));
                match (before.last(), after.first()) {
                    (Some([from, low]), Some([to, high])) => {
                        low + (high - low) * (x - from) / (to - from)
                    }
                    (Some([_, value]), None) | (None, Some([_, value])) => *value,
                    (None, None) => 0.0,
                }
            }
            Self::Jumps(steps) => {
                let last = steps.iter().rev().find(|[at, _]| *at <= x);
                last.map_or(0.0, |[_, value]| *value)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rows_show_of_a_shape_is_exact_at_them_and_straight_between() {
        let shape = ForeignShape::Jumps(vec![[0.2, 1.0], [0.55, -1.0]]);
        let course = ForeignCourse {
            over: ForeignVariable::Time,
            between: [10.0, 20.0],
            shape,
        };
        let known = course.known_at([18.0, 11.0, 13.0].into_iter());
        let at = |value: f64| known.shape.value(known.way(value));
        let values = [5.0, 11.0, 12.0, 13.0, 18.0, 30.0];
        let off = values
            .map(at)
            .into_iter()
            .zip([0.0, 0.0, 0.5, 1.0, -1.0, -1.0]);
        let off = off.map(|(found, wanted)| (found - wanted).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12, "{:?}", values.map(at));
    }
}

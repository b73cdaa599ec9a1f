//! An effect that nobody listed: a drawn shape of one variable, or a product of two, in one direction of motion anywhere on the chain.

mod shape;
mod variable;

pub use shape::ForeignShape;
pub use variable::ForeignVariable;

use super::{Act, Motion, State, Stated, TrueValue, true_value};
use crate::matrix::{self, Matrix, Vector};
use crate::memory::Moment;
use crate::polar::Polar;
use crate::statics::Row;
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use variable::Seen;

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
    /// The same with the edge value of a range beyond it.
    fn held(&self, seen: [f64; 2]) -> Self {
        let [from, to] = self.between;
        let between = [seen[0].max(from), seen[1].min(to)];
        if between[1] - between[0] <= 1e-9 * (to - from) {
            return self.clone();
        }
        let shape = self.shape.part(between.map(|value| (value - from) / (to - from)));
        Self { over: self.over.clone(), between, shape }
    }
}

fn first() -> usize {
    1
}

impl Foreign {
    /// The same as far as a range of times (s) and of temperatures (C) shows it: beyond them it holds its edge value.
    pub fn held(&self, time_s: [f64; 2], temperature_c: [f64; 2]) -> Self {
        let held = |course: &ForeignCourse| match course.over {
            ForeignVariable::Time => course.held(time_s),
            ForeignVariable::Temperature => course.held(temperature_c),
            _ => course.clone(),
        };
        Self { courses: self.courses.iter().map(held).collect(), ..self.clone() }
    }

    /// Product of the shapes in what is seen.
    fn share(&self, seen: &Seen) -> f64 {
        self.courses
            .iter()
            .map(|course| {
                let [from, to] = course.between;
                let way = (course.over.value(seen) - from) / (to - from);
                course.shape.value(way.clamp(0.0, 1.0))
            })
            .product()
    }

    fn shift(&self, share: f64) -> Vector {
        matrix::scale(self.direction, 1e-6 * self.size * share)
    }

    /// The step of a body, whichever of the two it is.
    fn step(&self, share: f64) -> Matrix {
        match self.motion {
            ForeignMotion::JointTilt | ForeignMotion::LinkBend | ForeignMotion::BaseTurn => {
                matrix::turn_by(matrix::scale(self.direction, ARCSEC * self.size * share))
            }
            _ => matrix::shift(self.shift(share)),
        }
    }
}

impl Act for Foreign {
    fn act(&self, state: &State, motion: &mut Motion) {
        let seen = Seen { row: state.row, memory: state.memory, torque: state.torque, point: state.posture.tool };
        let share = self.share(&seen);
        let index = self.seat - 1;
        let end = |motion: &mut Motion, link: usize| {
            motion.link_end[link] = matrix::times(&motion.link_end[link], &self.step(share));
        };
        match self.motion {
            ForeignMotion::JointTurn => motion.joint[index] += ARCSEC * self.size * share,
            ForeignMotion::JointShift | ForeignMotion::JointTilt if index == 0 => {
                // The first axis stands on the base: about its own foot.
                let foot = state.arm.foot;
                let about = matrix::times(&self.step(share), &matrix::shift(matrix::scale(foot, -1.0)));
                motion.base = matrix::times(&motion.base, &matrix::times(&matrix::shift(foot), &about));
            }
            ForeignMotion::JointShift | ForeignMotion::JointTilt => end(motion, index - 1),
            ForeignMotion::LinkShift | ForeignMotion::LinkBend => end(motion, index),
            ForeignMotion::BaseShift | ForeignMotion::BaseTurn => {
                motion.base = matrix::times(&self.step(share), &motion.base);
            }
            ForeignMotion::ToolShift => motion.tool = matrix::add(motion.tool, self.shift(share)),
            ForeignMotion::Range | ForeignMotion::Azimuth | ForeignMotion::Elevation => {}
        }
    }
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        self.courses.iter().map(|course| course.over.remember(past)).find(|all| !all.is_empty()).unwrap_or_default()
    }
    fn sight(&self, row: &Row, memory: f64, point: Vector) -> Vector {
        let by = || self.size * self.share(&Seen { row, memory, torque: &[], point });
        let polar = Polar::of(point);
        match self.motion {
            ForeignMotion::Range => Polar { range: polar.range + 1e-6 * by(), ..polar }.point(),
            ForeignMotion::Azimuth => Polar { azimuth: polar.azimuth + ARCSEC * by(), ..polar }.point(),
            ForeignMotion::Elevation => Polar { elevation: polar.elevation + ARCSEC * by(), ..polar }.point(),
            _ => point,
        }
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
        use ForeignMotion::*;
        let (place, unit) = match self.motion {
            JointTurn | JointTilt => (format!("joint {}", self.seat), "arcsec"),
            JointShift => (format!("joint {}", self.seat), "um"),
            LinkShift => (format!("link {}", self.seat), "um"),
            LinkBend => (format!("link {}", self.seat), "arcsec"),
            BaseShift => ("base".into(), "um"),
            BaseTurn => ("base".into(), "arcsec"),
            ToolShift => ("tool".into(), "um"),
            Range => ("tracker".into(), "um"),
            Azimuth | Elevation => ("tracker".into(), "arcsec"),
        };
        vec![true_value("unknown", "foreign", place, "size", unit, self.size)]
    }
}

//! `tracker_drift`: the tracker's frame moves slowly: steadily, with the warm-up, or as a slow curve in time.

use super::form::{cosines, parameters};
use super::frame_shift::{MOTION, unit};
use super::thermal_growth::Warmth;
use super::{ArmState, Deflection, Effect, Form, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use serde::{Deserialize, Serialize};

/// How the drift goes on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// In proportion to time or to a power of it; 1 at the end of the fitted rows.
    Steady {
        start_s: f64,
        end_s: f64,
        #[serde(default = "one")]
        power: f64,
    },
    /// With temperature or warm-up.
    Warming(Warmth),
    /// Three cosines over the fitted rows, held at their value beyond.
    Slow { start_s: f64, end_s: f64 },
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackerDrift {
    course: Course,
    /// Whether the frame also turns.
    turns: bool,
}

fn one() -> f64 {
    1.0
}

/// Powers of time that a drift may go with: what settles and what begins slowly.
const POWERS: std::ops::RangeInclusive<f64> = 0.25..=3.0;
/// Cosines of a slow course.
const SLOW: usize = 3;

impl TrackerDrift {
    pub fn course(&self) -> Course {
        self.course
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let [start_s, end_s] = survey.time;
        if end_s <= start_s {
            return Vec::new();
        }
        let mut out = Vec::new();
        for turns in [false, true] {
            out.push(Hypothesis::new(Self { course: Course::Steady { start_s, end_s, power: 1.0 }, turns }, 3));
            for (by, tried) in Warmth::all(survey) {
                out.push(Hypothesis::new(Self { course: Course::Warming(by), turns }, 3 * tried).charged(4.0));
            }
        }
        out.push(Hypothesis::new(Self { course: Course::Slow { start_s, end_s }, turns: false }, 1).charged(4.0));
        out
    }

    fn axes(&self) -> usize {
        if self.turns { 6 } else { 3 }
    }
}

impl Effect for TrackerDrift {
    fn name(&self) -> &'static str {
        "tracker_drift"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        if let Course::Slow { .. } = self.course {
            let numbers = (1..=SLOW).flat_map(|k| MOTION.into_iter().take(3).map(move |m| (format!("{}_cos{k}", m.0), m.1, m.2)));
            let numbers: Vec<_> = numbers.collect();
            return parameters(self, numbers.iter().map(|(name, unit, sigma)| (name.as_str(), *unit, *sigma)));
        }
        parameters(self, MOTION.into_iter().take(self.axes()))
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let rate = match self.course {
            Course::Steady { start_s, end_s, power } => {
                let share = (state.time() - start_s) / (end_s - start_s);
                // Rows before the fitted ones lie on the other side.
                libm::copysign(libm::pow(share.abs(), power), share)
            }
            Course::Warming(by) => by.at(state),
            Course::Slow { start_s, end_s } => {
                for (k, value) in cosines(state.time(), [start_s, end_s], SLOW).enumerate() {
                    for axis in 0..3 {
                        out.shift(3 * k + axis, p, 0, unit(axis) * value);
                    }
                }
                return;
            }
        };
        for axis in 0..self.axes() {
            out.shift(axis, p, 0, unit(axis) * rate);
        }
    }
}

impl Placed for TrackerDrift {
    fn place(&self) -> Place {
        Place::Tracker
    }

    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        let courses: Vec<Course> = match self.course {
            Course::Steady { start_s, end_s, power } => {
                let step = libm::pow(1.5, libm::exp2(-0.7 * f64::from(level)));
                let powers = [power * step, power / step].into_iter().filter(|power| POWERS.contains(power));
                powers.map(|power| Course::Steady { start_s, end_s, power }).collect()
            }
            Course::Warming(by) => by.near(survey, level).into_iter().map(Course::Warming).collect(),
            Course::Slow { .. } => Vec::new(),
        };
        courses.into_iter().map(|course| Self { course, ..self.clone() }.into()).collect()
    }
}

//! `thermal_growth`: neighbouring links grow with temperature, or with time since the start where none was recorded.

use super::form::parameters;
use super::link_compliance::{SHORT, extent};
use super::{ArmState, Deflection, Effect, Form, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::spatial::Twist;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

/// How far something has warmed up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Warmth {
    /// K above the first measured temperature.
    Temperature { reference_c: f64 },
    /// 1 - exp(-t / T) since the start.
    Time { start_s: f64, constant_s: f64 },
}

/// Time constants as shares of the recording.
const WARM_UPS: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.5];
/// Shortest and longest time constant, in the same shares: the one is a step at the start, the other a straight line.
const CONSTANTS: [f64; 2] = [0.02, 10.0];

impl Warmth {
    /// What the recording offers, and of how many of its kind each is one: its temperature, and warm-ups of several time
    /// constants, since what was measured need not be the temperature of what grows.
    pub fn all(survey: &Survey) -> Vec<(Self, usize)> {
        let [start_s, end_s] = survey.time;
        let measured = survey.reference_c.map(|reference_c| Self::Temperature { reference_c });
        let kinds = 1 + usize::from(measured.is_some());
        let times = WARM_UPS.iter().filter(|_| end_s > start_s);
        let times = times.map(|share| Self::Time { start_s, constant_s: share * (end_s - start_s) });
        let times = times.map(|time| (time, kinds * WARM_UPS.len()));
        measured.map(|measured| (measured, kinds)).into_iter().chain(times).collect()
    }

    pub fn at(&self, state: &ArmState) -> f64 {
        match self {
            Self::Temperature { reference_c } => state.temperature().map_or(0.0, |now| now - reference_c),
            Self::Time { start_s, constant_s } => 1.0 - libm::exp(-(state.time() - start_s).max(0.0) / constant_s),
        }
    }

    /// The same with time constants around its own, within bounds.
    pub fn near(&self, survey: &Survey, level: i32) -> Vec<Self> {
        let Self::Time { start_s, constant_s } = *self else { return Vec::new() };
        let step = libm::pow(1.5, libm::exp2(-0.5 * f64::from(level)));
        let [shortest, longest] = CONSTANTS.map(|share| share * (survey.time[1] - survey.time[0]));
        let within = |constant_s: f64| Self::Time { start_s, constant_s: constant_s.clamp(shortest, longest) };
        [step, 1.0 / step].map(|factor| within(constant_s * factor)).to_vec()
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThermalGrowth {
    /// From 0.
    first: usize,
    last: usize,
    by: Warmth,
}

impl ThermalGrowth {
    pub fn by(&self) -> Warmth {
        self.by
    }

    /// Every run of neighbouring links.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let links = survey.joints() - 1;
        let long = |link: &usize| extent(survey.robot, *link).norm() > SHORT;
        let mut out = Vec::new();
        for (by, tried) in Warmth::all(survey) {
            for (first, last) in (0..links).flat_map(|first| (first..links).map(move |last| (first, last))) {
                // A run begins and ends with a link that can grow, else it is the same as a shorter one.
                if long(&first) && long(&last) {
                    out.push(Hypothesis::new(Self { first, last, by }, tried).positive());
                }
            }
        }
        out
    }
}

impl Effect for ThermalGrowth {
    fn name(&self) -> &'static str {
        "thermal_growth"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        match self.by {
            Warmth::Temperature { .. } => parameters(self, [("per_kelvin", Unit::One, 1e-3)]),
            Warmth::Time { .. } => parameters(self, [("in_the_end", Unit::One, 1e-2)]),
        }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let warmth = self.by.at(state);
        for link in self.first..=self.last {
            let growth = extent(robot, link) * warmth;
            out.shift(0, p, link + 1, Twist::new(growth.x, growth.y, growth.z, 0.0, 0.0, 0.0));
        }
    }
}

impl Placed for ThermalGrowth {
    fn place(&self) -> Place {
        Place::Links(self.first, self.last)
    }

    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        self.by.near(survey, level).into_iter().map(|by| Self { by, ..self.clone() }.into()).collect()
    }
}

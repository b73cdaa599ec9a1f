//! `joint_table`: a repeatable error of a joint of no simple form, as a curve over the range that was measured.

use super::form::{cosines, parameters};
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointTable {
    joint: usize,
    /// Valid range, rad; beyond it the curve fades out within one wave.
    range_rad: [f64; 2],
    /// Cosines over the range.
    count: usize,
}

/// Highest orders per joint turn that a curve resolves.
const RESOLUTIONS: [f64; 3] = [12.0, 24.0, 36.0];
/// Measured values for each number of a curve.
const VALUES_EACH: f64 = 20.0;
/// Rows within a wave of an end of the range.
const SUPPORT: usize = 5;
/// How large a number of a curve may be, rad (60 arcsec): holds it down where points are sparse.
pub(super) const PLAUSIBLE: f64 = 3e-4;

impl JointTable {
    pub fn joint(&self) -> usize {
        self.joint
    }

    pub fn range(&self) -> [f64; 2] {
        self.range_rad
    }

    /// The curve with coefficients `p`, rad.
    pub fn value(&self, q: f64, p: &[f64]) -> f64 {
        self.functions(q).zip(p).map(|(value, p)| value * p).sum()
    }

    fn functions(&self, q: f64) -> impl Iterator<Item = f64> {
        let [low, high] = self.range_rad;
        let wave = 2.0 * (high - low) / self.count as f64;
        let beyond = (low - q).max(q - high).clamp(0.0, wave);
        let share = if beyond > 0.0 { 0.5 + 0.5 * libm::cos(PI * beyond / wave) } else { 1.0 };
        cosines(q, self.range_rad, self.count).map(move |value| share * value)
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for joint in survey.revolute() {
            for resolution in RESOLUTIONS {
                let Some(range_rad) = well_covered(survey, joint, 2.0 * PI / resolution) else { continue };
                let count = (resolution * (range_rad[1] - range_rad[0]) / PI).ceil();
                if count >= 1.0 && 3.0 * survey.rows.len() as f64 > VALUES_EACH * count {
                    let form = Self { joint, range_rad, count: count as usize };
                    out.push(Hypothesis::new(form, RESOLUTIONS.len()).charged(4.0));
                }
            }
        }
        out
    }
}

/// The range of a joint without sparse ends: within a wave (rad) of either end there are some rows.
fn well_covered(survey: &Survey, joint: usize, wave: f64) -> Option<[f64; 2]> {
    let mut q: Vec<f64> = survey.rows.iter().map(|row| survey.data.q(*row)[joint]).collect();
    q.sort_by(f64::total_cmp);
    let covered = |some: &[f64]| some[SUPPORT - 1] - some[0] < wave;
    let low = q.windows(SUPPORT).find(|some| covered(some))?[0];
    let high = q.windows(SUPPORT).rfind(|some| covered(some))?[SUPPORT - 1];
    (high > low).then_some([low, high])
}

impl Effect for JointTable {
    fn name(&self) -> &'static str {
        "joint_table"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let names: Vec<String> = (1..=self.count).map(|k| format!("cos{k}")).collect();
        parameters(self, names.iter().map(|name| (name.as_str(), Unit::Radian, PLAUSIBLE)))
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (k, value) in self.functions(state.q[self.joint]).enumerate() {
            out.turn(k, p, self.joint, value);
        }
    }
}

impl Placed for JointTable {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }
}

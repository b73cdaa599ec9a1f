//! `backlash`: lost motion; half a gap to the side that friction or gravity leaves the joint on (hysteresis included).

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Form, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

/// What decides on the side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The direction of approach.
    Approach,
    /// The sign of the load, blurred over some torque.
    Load { width_nm: f64 },
    /// Friction of so many Nm decides under smaller loads, larger ones push the joint to their side; blurred over some torque.
    /// Positive: friction leaves the joint on the side to which it came; negative: it trails on the other one.
    Mixed {
        threshold_nm: f64,
        #[serde(default)]
        width_nm: f64,
    },
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Backlash {
    joint: usize,
    side: Side,
}

/// Widths of the blur as shares of the threshold.
const BLURS: [f64; 2] = [0.0, 0.5];
/// Smallest and largest threshold and blur, as shares of the joint's largest load: there the load or the approach decides alone.
const THRESHOLDS: [f64; 2] = [1e-3, 1.5];

impl Backlash {
    pub fn side(&self) -> Side {
        self.side
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for joint in survey.revolute() {
            let both = survey.both_directions(joint);
            if survey.is_loaded(joint) {
                let most = survey.load(joint);
                let widths = [1e-9, 0.03, 0.08].map(|share| Side::Load { width_nm: share * most });
                out.extend(widths.map(|side| Hypothesis::new(Self { joint, side }, 3).positive()));
                if both {
                    let mut loads: Vec<f64> = survey.torques(joint).map(f64::abs).collect();
                    loads.sort_by(f64::total_cmp);
                    let shares = [0.05, 0.15, 0.3, 0.5].map(|share| loads[((loads.len() - 1) as f64 * share) as usize]);
                    for threshold_nm in shares.into_iter().flat_map(|friction| [friction, -friction]) {
                        let sides = BLURS.map(|blur| Side::Mixed { threshold_nm, width_nm: blur * threshold_nm.abs() });
                        out.extend(sides.map(|side| Hypothesis::new(Self { joint, side }, 10 * BLURS.len()).positive()));
                    }
                }
            }
            if both {
                out.push(Hypothesis::new(Self { joint, side: Side::Approach }, 1));
            }
        }
        out
    }
}

impl Effect for Backlash {
    fn name(&self) -> &'static str {
        "backlash"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        parameters(self, [("half_gap", Unit::Radian, 0.01)])
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let side = match self.side {
            Side::Approach => state.direction(self.joint),
            Side::Load { width_nm } => libm::tanh(state.torque()[self.joint] / width_nm),
            Side::Mixed { threshold_nm, width_nm } => {
                let push = state.torque()[self.joint] + threshold_nm * state.direction(self.joint);
                if width_nm > 0.0 { libm::tanh(push / width_nm) } else { push.signum() }
            }
        };
        out.turn(0, p, self.joint, side);
    }

    fn needs_torque(&self) -> bool {
        self.side != Side::Approach
    }
}

impl Placed for Backlash {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        let Side::Mixed { threshold_nm, width_nm } = self.side else { return Vec::new() };
        let power = libm::exp2(-0.5 * f64::from(level));
        let factors = [1.6, 1.25, 0.8, 0.625].map(|factor| libm::pow(factor, power));
        let [least, most] = THRESHOLDS.map(|share| share * survey.load(self.joint));
        let within = |torque: f64| libm::copysign(torque.abs().clamp(least, most), torque);
        let with = |threshold_nm: f64, width_nm: f64| {
            let width_nm = if width_nm > 0.0 { within(width_nm) } else { 0.0 };
            Self { joint: self.joint, side: Side::Mixed { threshold_nm: within(threshold_nm), width_nm } }.into()
        };
        let wider = factors.into_iter().filter(|_| width_nm > 0.0).map(|factor| with(threshold_nm, width_nm * factor));
        factors.into_iter().map(|factor| with(threshold_nm * factor, width_nm)).chain(wider).collect()
    }
}

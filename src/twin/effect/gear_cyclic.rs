//! Run-out of gears and encoders: joint errors that repeat with every turn of the joint or of the motor.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::twin::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `amplitude sin(order q + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearCyclic {
    /// From 1.
    pub joint: usize,
    /// Periods per turn of the joint.
    pub order: f64,
    /// arcsec.
    pub amplitude_arcsec: f64,
    #[serde(default)]
    pub phase_deg: f64,
}

/// `amplitude sin(order N q + phase)` with the reduction ratio N.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearMotorCyclic {
    /// From 1.
    pub joint: usize,
    /// Periods per turn of the motor.
    pub order: f64,
    /// arcsec at the joint.
    pub amplitude_arcsec: f64,
    #[serde(default)]
    pub phase_deg: f64,
}

fn ripple(amplitude_arcsec: f64, order: f64, angle: f64, phase_deg: f64) -> f64 {
    amplitude_arcsec * ARCSEC * (order * angle + phase_deg.to_radians()).sin()
}

/// The same ripple as two amplitudes, as estimators write it.
fn sine_and_cosine(effect: &'static str, joint: usize, order: f64, amplitude_arcsec: f64, phase_deg: f64) -> Vec<TrueValue> {
    let (tag, place) = (format!("j{joint}"), format!("joint {joint}"));
    let (sine, cosine) = phase_deg.to_radians().sin_cos();
    vec![
        true_value(effect, &tag, place.clone(), &format!("sin{order}"), "arcsec", amplitude_arcsec * cosine),
        true_value(effect, &tag, place, &format!("cos{order}"), "arcsec", amplitude_arcsec * sine),
    ]
}

impl Act for GearCyclic {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = state.row.command[self.joint - 1];
        motion.joint[self.joint - 1] += ripple(self.amplitude_arcsec, self.order, angle, self.phase_deg);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn truth(&self) -> Vec<TrueValue> {
        sine_and_cosine("gear_cyclic", self.joint, self.order, self.amplitude_arcsec, self.phase_deg)
    }
}

impl Act for GearMotorCyclic {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = state.row.command[self.joint - 1] * state.arm.links[self.joint - 1].gear;
        motion.joint[self.joint - 1] += ripple(self.amplitude_arcsec, self.order, angle, self.phase_deg);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn truth(&self) -> Vec<TrueValue> {
        sine_and_cosine("gear_motor_cyclic", self.joint, self.order, self.amplitude_arcsec, self.phase_deg)
    }
}

//! Run-out of gears and encoders: joint errors that repeat with every turn of the joint or of the motor.
//!
//! A mesh is also softer with fewer teeth in contact, so that the wind-up itself repeats: that part grows with the torque.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `(amplitude + arcsec_per_nm torque) sin(order q + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearCyclic {
    /// From 1.
    pub joint: usize,
    /// Periods per turn of the joint.
    pub order: f64,
    /// arcsec.
    #[serde(default)]
    pub amplitude_arcsec: f64,
    /// Growth of the amplitude with the load, arcsec per Nm.
    #[serde(default)]
    pub arcsec_per_nm: f64,
    /// Phase at zero, deg.
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
    /// Phase at zero, deg.
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
        let amplitude = self.amplitude_arcsec + self.arcsec_per_nm * state.torque[self.joint - 1];
        motion.joint[self.joint - 1] += ripple(amplitude, self.order, angle, self.phase_deg);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.amplitude_arcsec *= by;
        self.arcsec_per_nm *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let mut out = sine_and_cosine("gear_cyclic", self.joint, self.order, self.amplitude_arcsec, self.phase_deg);
        if self.arcsec_per_nm != 0.0 {
            let (tag, place, number) =
                (format!("j{}", self.joint), format!("joint {}", self.joint), format!("growth{}", self.order));
            out.push(true_value("gear_cyclic", &tag, place, &number, "arcsec/Nm", self.arcsec_per_nm));
        }
        out
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
    fn scale(&mut self, by: f64) {
        self.amplitude_arcsec *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        sine_and_cosine("gear_motor_cyclic", self.joint, self.order, self.amplitude_arcsec, self.phase_deg)
    }
}

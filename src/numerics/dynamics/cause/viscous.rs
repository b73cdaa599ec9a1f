//! Friction that grows with the velocity of a joint.

use super::{FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint_with, fill};
use crate::dynamics::scene::DynamicScene;

/// Its name.
pub(crate) const VISCOUS: &str = "viscous_friction";

/// Friction that grows with the velocity of a joint. Shape: its exponent, 1 but where the data show another: grease that thins with speed.
pub(super) struct Viscous;

/// Between which the exponent is found.
const EXPONENTS: [f64; 2] = [0.4, 1.6];

impl TorqueCause for Viscous {
    about! { name: VISCOUS, coefficients: &[("viscous", "Nm s/rad")], price: 0.0, rich: true, brakes: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint_with(&Viscous, scene, 1, &[&[1.0]])
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        let [least, most] = EXPONENTS;
        let span = ShapeSpan {
            name: "exponent",
            unit: "1",
            index: 0,
            least,
            most,
            by_ratio: true,
            usual: Some(1.0),
        };
        form.shape.first().map(|_| span).into_iter().collect()
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        _column: usize,
        out: &mut [f64],
    ) {
        let joint = form.joint();
        fill(out, |row| power(form, scene.velocity[joint][row]));
    }

    fn friction(
        &self,
        form: &TorqueForm,
        _column: usize,
        velocity: f64,
        _sign: f64,
    ) -> Option<f64> {
        Some(power(form, velocity))
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let (place, size) = (form.place, fitted[0].value);
        match exponent(form) {
            None => format!("{place} has viscous friction of {size:.3} Nm s/rad"),
            Some(exponent) => {
                format!(
                    "{place} has viscous friction of {size:.3} Nm s/rad, which grows with the power {exponent:.2} of speed"
                )
            }
        }
    }
}

/// The straight line nearest to a power of speed over all speeds up to the fastest: at rest, and its slope. Viscous and Coulomb friction that
/// grow with another power are parts of one sum, and as numbers are those of its line.
pub(in super::super) fn line_of_power(exponent: f64, fastest: f64) -> [f64; 2] {
    // Over shares x of the fastest speed: means of x^e and of x x^e.
    let (mean, moment) = (1.0 / (exponent + 1.0), 1.0 / (exponent + 2.0));
    let slope = 12.0 * (moment - 0.5 * mean);
    let scale = fastest.powf(exponent);
    [
        scale * (mean - 0.5 * slope),
        scale * slope / fastest.max(f64::MIN_POSITIVE),
    ]
}

/// Where it is not 1.
fn exponent(form: &TorqueForm) -> Option<f64> {
    form.shape
        .first()
        .copied()
        .filter(|exponent| *exponent != 1.0)
}

/// The power of a velocity, with its sign.
fn power(form: &TorqueForm, velocity: f64) -> f64 {
    exponent(form).map_or(velocity, |exponent| {
        velocity.signum() * velocity.abs().powf(exponent)
    })
}

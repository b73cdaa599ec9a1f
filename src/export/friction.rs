//! What formats hold of the identified torques: friction, rotor and drive of each joint. What they do not hold is listed.

use super::{CarriedTorques, Export};
use crate::dynamics::TorqueTerm;
use crate::effect::Place;
use crate::identified::IdentifiedTorques;

/// Causes that a format has an attribute for.
pub(super) const DAMPING: &str = "viscous_friction";
pub(super) const FRICTION: &str = "coulomb_friction";
pub(super) const ARMATURE: &str = "rotor_inertia";
pub(super) const DRIVE: &str = "torque_constant";

/// The coefficient of a cause of one number at a joint (from 0), SI; none where it was not found. Formats know one number: of friction that
/// grows with another power of speed, and of a torque constant that falls with torque, it is the one that is right at half of the greatest
/// speed or load of the recording.
pub(super) fn coefficient(torques: &IdentifiedTorques, effect: &str, joint: usize) -> Option<f64> {
    let own = torques.model.terms.iter().find(|term| term.effect == effect && term.place == Place::Joint(joint))?;
    let (value, seen) = (own.coefficients.first().copied()?, torques.model.range.get(joint)?);
    Some(match (effect, own.shape.first()) {
        (DAMPING, Some(exponent)) if seen.speed > 0.0 => value * (0.5 * seen.speed).powf(exponent - 1.0),
        (DRIVE, Some(half)) if seen.load.is_finite() => value / (1.0 + 0.5 * seen.load / half),
        _ => value,
    })
}

/// The same where formats allow no less than 0.
pub(super) fn positive(torques: &IdentifiedTorques, effect: &str, joint: usize) -> Option<f64> {
    coefficient(torques, effect, joint).filter(|value| *value > 0.0)
}

/// Nm at the joint per ampere as identified: the declared one where the drives' numbers are right, none where it is not declared.
pub(super) fn gear(torques: &IdentifiedTorques, joint: usize) -> Option<f64> {
    let declared = torques.per_ampere.as_ref()?.get(joint)?;
    // Stated torques are so much more than true ones.
    Some(declared / (1.0 + coefficient(torques, DRIVE, joint).unwrap_or(0.0)))
}

impl Export {
    /// What the reader of a format must know, a sentence a line: of torques, each cause that it leaves out, with its size.
    pub fn remarks_in(&self, carried: CarriedTorques) -> Vec<String> {
        let mut lines = self.remarks();
        let Some(torques) = &self.identified.torques else { return lines };
        let attributes = match carried {
            CarriedTorques::All => return lines,
            CarriedTorques::Nothing => {
                lines.push("not carried: the identified torques (formats urdf, mjcf, json, dynamics)".into());
                return lines;
            }
            CarriedTorques::Causes(attributes) => attributes,
        };
        let holds = |term: &&TorqueTerm| {
            let named = matches!(term.place, Place::Joint(_)) && attributes.contains(&term.effect.as_str());
            named && (term.effect == DRIVE || term.coefficients[0] >= 0.0)
        };
        let left = torques.model.terms.iter().filter(|term| !holds(term));
        lines.extend(
            left.map(|term| format!("not carried: {} at {}, {:.4} Nm rms over the recording", term.effect, term.place, term.rms)),
        );
        lines.extend(torques.of_the_recording.iter().map(|statement| format!("of the recording alone: {statement}")));
        lines
    }
}

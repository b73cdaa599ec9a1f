//! What formats hold of the identified torques: friction, rotor and drive of each joint. What they do not hold is listed.

use super::body::numbers;
use super::{CarriedTorques, Export, Format};
use crate::criteria::torque::NAMED;
use crate::dynamics::{COULOMB, FittedNumber, JointRange, TorqueTerm};
use crate::effect::Place;
use crate::figures::measured;
use crate::identified::IdentifiedTorques;

/// Causes that a format has an attribute for.
pub(super) const DAMPING: &str = "viscous_friction";
pub(super) const FRICTION: &str = COULOMB;
pub(super) const ARMATURE: &str = "rotor_inertia";
pub(super) const DRIVE: &str = "torque_constant";
pub(super) const SPRINGS: [&str; 2] = ["cable_stiffness", "spring_balance"];

/// The number of viscous or Coulomb friction that is of the line of both, where one of them grows with another power of speed.
pub(super) fn of_line(torques: &IdentifiedTorques, term: &TorqueTerm) -> Option<FittedNumber> {
    let Place::Joint(joint) = term.place else {
        return None;
    };
    let [viscous, coulomb] = torques.model.friction_line(joint).ok()??;
    match term.effect.as_str() {
        DAMPING => Some(viscous),
        FRICTION => Some(coulomb),
        _ => None,
    }
}

/// Whether a cause stands alone: less than two standard deviations may as well be nothing, and friction that drives is a part of a sum.
pub(super) fn stands_alone(torques: &IdentifiedTorques, term: &TorqueTerm) -> bool {
    if let Some(FittedNumber { value, sigma }) = of_line(torques, term) {
        return value > 0.0 && value >= *NAMED * sigma;
    }
    let place = term.place.to_string();
    let rows = torques.parameters.0.iter();
    let mut numbers =
        rows.filter(|row| row.effect == term.effect && row.place == place && row.form.is_some());
    let drives = [DAMPING, FRICTION].contains(&term.effect.as_str()) && term.coefficients[0] <= 0.0;
    let is_sure = |value: f64, sigma: f64| value.abs() >= *NAMED * sigma;
    !drives && numbers.any(|row| row.sigma.is_none_or(|sigma| is_sure(row.value, sigma)))
}

/// A number with the digits that its standard deviation tells.
pub(super) fn digits(number: FittedNumber) -> String {
    measured(number.value, Some(number.sigma))
}

/// One standard deviation of a coefficient of a cause; 0 where it is not known.
fn sigma(torques: &IdentifiedTorques, term: &TorqueTerm, coefficient: usize) -> f64 {
    let place = term.place.to_string();
    let mut rows = torques
        .parameters
        .0
        .iter()
        .filter(|row| row.effect == term.effect && row.place == place && row.form.is_some());
    rows.nth(coefficient)
        .and_then(|row| row.sigma)
        .unwrap_or(0.0)
}

/// The coefficient of a cause of one number at a joint (from 0), SI; none where it was not found or does not stand alone. Of a law with a shape
/// it is the number that formats can hold, see [`as_one_number`].
pub(super) fn coefficient(
    torques: &IdentifiedTorques,
    effect: &str,
    joint: usize,
) -> Option<FittedNumber> {
    let mut terms = torques.model.terms.iter();
    let is_it = |term: &&TorqueTerm| term.effect == effect && term.place == Place::Joint(joint);
    let single = terms
        .find(is_it)
        .filter(|single| stands_alone(torques, single))?;
    let value = *single.coefficients.first()?;
    let seen = torques.model.range.get(joint)?;
    let held = as_one_number(single, value, seen, None).map_or(value, |(held, _)| held);
    let found = FittedNumber {
        value: held,
        sigma: sigma(torques, single, 0) * (held / value).abs(),
    };
    Some(of_line(torques, single).unwrap_or(found))
}

/// What formats of one number hold of a law that has a shape, and what must be remark of it: of friction that grows with another power of speed
/// its number of `line` over the recorded speeds, of a torque constant that falls with torque what is right at half of the greatest load.
fn as_one_number(
    term: &TorqueTerm,
    value: f64,
    seen: &JointRange,
    line: Option<FittedNumber>,
) -> Option<(f64, String)> {
    let place = &term.place;
    match (term.effect.as_str(), *term.shape.first()?) {
        (DAMPING, exponent) if exponent != 1.0 => {
            let held = line?.value;
            let remark = format!(
                "{DAMPING} at {place} grows with the power {exponent:.2} of speed: {held:.4} Nm s/rad is written, the line up to {:.3} rad/s",
                seen.speed
            );
            Some((held, remark))
        }
        (DRIVE, half) if seen.load.is_finite() => {
            let (load, held) = (0.5 * seen.load, value / (1.0 + 0.5 * seen.load / half));
            let remark = format!(
                "{DRIVE} at {place} changes with torque: what is written is right at {load:.3} Nm"
            );
            Some((held, remark))
        }
        _ => None,
    }
}

/// The same where formats allow no less than 0.
pub(super) fn positive(
    torques: &IdentifiedTorques,
    effect: &str,
    joint: usize,
) -> Option<FittedNumber> {
    coefficient(torques, effect, joint).filter(|found| found.value > 0.0)
}

/// The stiffness of a spring at a joint (from 0), Nm/rad, and the angle at which it rests, rad; none of one that is no straight line.
pub(super) fn spring(torques: &IdentifiedTorques, joint: usize) -> Option<[FittedNumber; 2]> {
    let at = |term: &&TorqueTerm| {
        SPRINGS.contains(&term.effect.as_str()) && term.place == Place::Joint(joint)
    };
    let single = torques.model.terms.iter().find(at);
    let single = single.filter(|term| stands_alone(torques, term))?;
    let [stiffness, at_zero] = single.coefficients[..] else {
        return None;
    };
    let [of_stiffness, of_zero] = [0, 1].map(|number| sigma(torques, single, number));
    let numbers = [
        (stiffness, of_stiffness),
        (-at_zero / stiffness, of_zero / stiffness),
    ];
    (stiffness > 0.0).then(|| numbers.map(|(value, sigma)| FittedNumber { value, sigma }))
}

/// Nm at the joint per ampere as identified: the declared one where the drives' numbers are right, none where it is not declared.
pub(super) fn gear(torques: &IdentifiedTorques, joint: usize) -> Option<String> {
    let declared = *torques.per_ampere.as_ref()?.get(joint)?;
    // Stated torques are so much more than true ones.
    let gear = |more: FittedNumber| {
        let whole = 1.0 + more.value;
        digits(FittedNumber {
            value: declared / whole,
            sigma: declared.abs() * more.sigma / (whole * whole),
        })
    };
    Some(coefficient(torques, DRIVE, joint).map_or_else(|| numbers([declared]), gear))
}

impl Export {
    /// What the reader of a format must know, a sentence a line: of torques, each cause that it leaves out, with its size.
    pub(crate) fn remarks_in(&self, format: &Format) -> Vec<String> {
        let mut lines = vec![self.mark(format.name).to_string()];
        lines.extend(self.remarks(format.geometry));
        let Some(torques) = &self.identified.torques else {
            return lines;
        };
        let attributes = match format.carries {
            CarriedTorques::All => return lines,
            CarriedTorques::Nothing => {
                let line =
                    "not carried: the identified torques (formats urdf, mjcf, json, dynamics)";
                lines.push(line.into());
                return lines;
            }
            CarriedTorques::Causes(attributes) => attributes,
        };
        let holds = |term: &&TorqueTerm| {
            let named =
                matches!(term.place, Place::Joint(_)) && attributes.contains(&term.effect.as_str());
            let is_whole = !SPRINGS.contains(&term.effect.as_str()) || term.coefficients.len() == 2;
            named
                && is_whole
                && stands_alone(torques, term)
                && (term.effect == DRIVE
                    || of_line(torques, term).is_some()
                    || term.coefficients[0] >= 0.0)
        };
        let held = torques.model.terms.iter().filter(holds);
        lines.extend(held.filter_map(|term| {
            let Place::Joint(joint) = term.place else {
                return None;
            };
            let (value, seen) = (*term.coefficients.first()?, torques.model.range.get(joint)?);
            Some(as_one_number(term, value, seen, of_line(torques, term))?.1)
        }));
        let left = torques.model.terms.iter().filter(|term| !holds(term));
        lines.extend(left.map(|term| {
            format!(
                "not carried: {} at {}, {:.4} Nm rms over the recording",
                term.effect, term.place, term.rms
            )
        }));
        let statements = torques.of_the_recording.iter();
        lines.extend(statements.map(|one| format!("of the recording alone: {one}")));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEEN: JointRange = JointRange {
        position: [-1.0, 1.0],
        speed: 2.0,
        acceleration: 1.0,
        load: 40.0,
        misfit: 0.0,
        usual: 0.0,
        sign_width: 0.01,
        slides: false,
    };

    fn held(effect: &str, shape: &[f64], value: f64) -> Option<(f64, String)> {
        let (place, coefficients) = (Place::Joint(1), vec![value]);
        let term = TorqueTerm {
            declared: None,
            effect: effect.into(),
            place,
            with: [0; 2],
            shape: shape.to_vec(),
            coefficients,
            rms: 1.0,
        };
        as_one_number(
            &term,
            value,
            &SEEN,
            Some(FittedNumber {
                value: 3.3164,
                sigma: 0.1,
            }),
        )
    }

    #[test]
    fn a_law_with_a_shape_is_written_as_one_number_and_with_a_word() {
        let (value, remark) = held(DAMPING, &[0.8], 4.0).expect("a remark");
        assert!((value - 3.3164).abs() < 1e-9, "{value}");
        assert!(
            remark.starts_with(
                "viscous_friction at joint 2 grows with the power 0.80 of speed: 3.31"
            ),
            "{remark}"
        );
        assert!(
            remark.ends_with("Nm s/rad is written, the line up to 2.000 rad/s"),
            "{remark}"
        );
        let (value, remark) = held(DRIVE, &[20.0, 40.0], 0.2).expect("a remark");
        assert!(
            (value - 0.1).abs() < 1e-15 && remark.ends_with("is right at 20.000 Nm"),
            "{value} {remark}"
        );
        assert_eq!(held(DAMPING, &[1.0], 4.0), None);
        assert_eq!(held(DRIVE, &[], 0.2), None);
    }
}

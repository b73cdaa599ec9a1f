//! Terms of a model as forms of causes, and what all numbers of a model are called.

use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::inertial_names::{inertial_name, inertial_unit};
use super::model::{TorqueModel, TorqueTerm};
use crate::error::{Error, Result};

/// Name of the width of a sign among the numbers of a model.
const SIGN_WIDTH: &str = "recording.sign_width";

impl TorqueTerm {
    /// Its form. Fails where no cause has its name or its numbers are too few.
    pub(super) fn form(&self) -> Result<TorqueForm> {
        let cause = TORQUE_CAUSES
            .into_iter()
            .find(|cause| cause.name == self.effect && cause.has_shape(&self.shape));
        let cause = cause.ok_or_else(|| {
            Error::data(
                "torque model",
                format!("`{}` is no cause that adds torque", self.effect),
            )
        })?;
        let form = TorqueForm {
            cause,
            place: self.place,
            with: self.with,
            shape: self.shape.clone(),
            width: self.coefficients.len(),
        };
        Ok(form)
    }

    /// Values of the shape numbers that were found from the data. Fails where no cause has its name.
    pub fn shape_numbers(&self) -> Result<Vec<f64>> {
        self.form().map(|form| {
            form.shape_numbers()
                .iter()
                .map(|span| form.shape[span.index])
                .collect()
        })
    }

    /// Quantity and unit of each coefficient. Fails where no cause has its name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        self.form().map(|form| form.coefficient_names())
    }
}

impl TorqueModel {
    /// Name of each number of the covariance, in its order: `rigid_body.l3.mass`, `viscous_friction.j2.viscous`; a second cause of a name
    /// at a place is `torque_ripple.j2.2.sine`. Fails where no cause has a term's name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        let inertials = (0..self.inertials.len()).filter(|number| self.identified[*number]);
        let mut names: Vec<(String, &'static str)> = inertials
            .map(|number| (inertial_name(number), inertial_unit(number)))
            .collect();
        for (place, term) in self.terms.iter().enumerate() {
            let own = self.prefix(place);
            names.extend(
                term.names()?
                    .into_iter()
                    .map(|(quantity, unit)| (format!("{own}.{quantity}"), unit)),
            );
        }
        for (place, term) in self.terms.iter().enumerate() {
            let own = self.prefix(place);
            names.extend(
                term.form()?
                    .shape_numbers()
                    .iter()
                    .map(|span| (format!("{own}.{}", span.name), span.unit)),
            );
        }
        names.push((SIGN_WIDTH.into(), "rad/s"));
        Ok(names)
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::arm;
    use super::super::cause::TORQUE_CAUSES;
    use super::*;
    use crate::dynamics::clock::RecordingClock;
    use crate::dynamics::recording::TorqueRecording;
    use crate::dynamics::scene::DynamicScene;

    #[test]
    fn every_form_is_read_back_as_one_of_its_own_cause_and_names_its_coefficients() {
        let position = (0..400)
            .map(|k| libm::sin(0.05 * f64::from(k / 4) + f64::from(k % 4)))
            .collect();
        let recording = TorqueRecording::of_motion(
            4,
            (0..100).map(|row| 0.01 * f64::from(row)).collect(),
            position,
        );
        let arm = arm();
        let scene = DynamicScene::new(
            &arm,
            &recording,
            &RecordingClock::of(&recording),
            10.0,
            false,
        );
        let mut tried = 0;
        for cause in TORQUE_CAUSES {
            for form in (cause.forms)(cause, &scene)
                .into_iter()
                .filter(|_| !cause.coefficients.is_empty())
            {
                let term = TorqueTerm {
                    effect: cause.name.into(),
                    place: form.place,
                    with: form.with,
                    shape: form.shape.clone(),
                    coefficients: vec![1.0; form.width],
                    rms: 0.0,
                };
                let read = term.form().expect("a cause");
                assert!(
                    std::ptr::eq(read.cause.coefficients, cause.coefficients),
                    "{}",
                    cause.name
                );
                assert_eq!(read.width, form.width, "{}", cause.name);
                assert!(
                    read.cause.coefficients.len() >= form.width,
                    "{}",
                    cause.name
                );
                tried += 1;
            }
        }
        assert!(tried > 100, "{tried}");
    }
}

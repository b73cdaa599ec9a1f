//! Terms of a model as forms of causes, and what all numbers of a model are called.

use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::coefficients::coefficient_names;
use super::inertial_names::{inertial_name, inertial_unit};
use super::model::{TorqueModel, TorqueTerm};
use crate::error::{Error, Result};

impl TorqueTerm {
    /// Its form. Fails where no cause has its name or its numbers are too few.
    pub(super) fn form(&self) -> Result<TorqueForm> {
        let cause = TORQUE_CAUSES.into_iter().find(|cause| cause.name() == self.effect);
        let cause =
            cause.ok_or_else(|| Error::data("torque model", format!("`{}` is no cause that adds torque", self.effect)))?;
        let form =
            TorqueForm { cause, place: self.place, with: self.with, shape: self.shape.clone(), width: self.coefficients.len() };
        Ok(form)
    }

    /// Quantity and unit of each coefficient. Fails where no cause has its name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        self.form().map(|form| coefficient_names(&form))
    }
}

impl TorqueModel {
    /// Name of each number of the covariance, in its order: `rigid_body.l3.mass`, `viscous_friction.j2.viscous`; a second cause of a name
    /// at a place is `torque_ripple.j2.2.sine`. Fails where no cause has a term's name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        let inertials = (0..self.inertials.len()).filter(|number| self.identified[*number]);
        let mut names: Vec<(String, &'static str)> =
            inertials.map(|number| (inertial_name(number), inertial_unit(number))).collect();
        for (place, term) in self.terms.iter().enumerate() {
            let own = self.prefix(place);
            names.extend(term.names()?.into_iter().map(|(quantity, unit)| (format!("{own}.{quantity}"), unit)));
        }
        Ok(names)
    }
}

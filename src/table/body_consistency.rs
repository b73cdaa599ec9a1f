//! Whether identified inertial numbers are those of bodies.

use super::{BodyConsistencies, BodyConsistencyRow};
use crate::dynamics::{BodyConsistency, TorqueDiagnosis};

impl BodyConsistencies {
    /// The table of a diagnosis.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let enforced = diagnosis.enforced.as_ref();
        let row = |found: BodyConsistency| BodyConsistencyRow {
            link: found.link as i64 + 1,
            mass_kg: found.mass,
            spread_kg_m2: found.spread,
            sigma_kg_m2: found.sigma,
            consistent: found.is_consistent(),
            enforced: enforced.map(|enforced| enforced.links.contains(&found.link)),
            cost: enforced.map(|enforced| enforced.cost),
        };
        Self(diagnosis.model.consistency().into_iter().map(row).collect())
    }
}

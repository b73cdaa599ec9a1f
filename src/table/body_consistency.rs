//! Whether identified inertial numbers are those of bodies.

use crate::dynamics::{BodyConsistency, TorqueDiagnosis};

crate::table::rows! { "body_consistency",
    /// Links whose ten numbers are identified; key `link`.
    pub struct BodyConsistencies of BodyConsistencyRow {
        /// From 1; the last carries the payload.
        link: i64,
        mass_kg: f64,
        spread_kg_m2: f64,
        /// One standard deviation.
        sigma_kg_m2: Option<f64>,
        consistent: bool,
        /// Whether no body had the link's numbers before they were moved to the nearest of bodies; null where nothing was enforced.
        enforced: Option<bool>,
        /// What the whitened squared residual rose by, all links together; null where nothing was enforced.
        cost: Option<f64>,
    }
}

impl BodyConsistencies {
    /// Of a diagnosis.
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

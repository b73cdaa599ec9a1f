//! Whether identified inertial numbers are those of bodies.

use crate::dynamics::TorqueModel;

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
    }
}

impl BodyConsistencies {
    /// Of a model.
    pub fn of(model: &TorqueModel) -> Self {
        let row = |found: crate::dynamics::BodyConsistency| BodyConsistencyRow {
            link: found.link as i64 + 1,
            mass_kg: found.mass,
            spread_kg_m2: found.spread,
            sigma_kg_m2: found.sigma,
            consistent: found.is_consistent(),
        };
        Self(model.consistency().into_iter().map(row).collect())
    }
}

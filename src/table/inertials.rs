//! Masses, first moments and inertias of the links, as the torques show them.

use super::{InertialRow, Inertials};
use crate::dynamics::TorqueDiagnosis;

impl Inertials {
    /// The numbers of a diagnosis.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = diagnosis.inertials.iter().map(|found| InertialRow {
            link: found.link as i64 + 1,
            quantity: found.quantity.into(),
            value: found.value,
            unit: found.unit.into(),
            declared: found.declared,
            sigma: found.sigma,
        });
        let mut rows: Vec<InertialRow> = rows.collect();
        rows.sort_by(|a, b| (a.link, &a.quantity).cmp(&(b.link, &b.quantity)));
        Self(rows)
    }
}

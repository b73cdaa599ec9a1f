//! What changed between two recordings of an arm's torques.

use crate::dynamics::TorqueChanges;

crate::table::rows! { "torque_changes",
    /// Numbers that may have changed, one a row; key `name`.
    pub struct TorqueChangeTable of TorqueChangeRow {
        name: String,
        effect: String,
        place: String,
        unit: String,
        /// In the earlier model; null where it has no such number.
        previous: Option<f64>,
        change: f64,
        /// One standard deviation.
        sigma: f64,
        p_value: f64,
        probability: f64,
        /// Null where it is held to be unchanged.
        rank: Option<i64>,
    }
}

impl TorqueChangeTable {
    /// Of a comparison; `previous` gives a number of the earlier model by name.
    pub fn of(changes: &TorqueChanges, previous: impl Fn(&str) -> Option<f64>) -> Self {
        let rows = changes.changes.iter().map(|change| TorqueChangeRow {
            name: change.name.clone(),
            effect: change.effect.clone(),
            place: change.place.to_string(),
            unit: change.unit.into(),
            previous: previous(&change.name),
            change: change.change,
            sigma: change.sigma,
            p_value: change.p_value,
            probability: change.probability,
            rank: change.rank.map(|rank| rank as i64),
        });
        let mut rows: Vec<TorqueChangeRow> = rows.collect();
        rows.sort_by(|a, b| a.name.cmp(&b.name));
        rows.dedup_by(|a, b| a.name == b.name);
        Self(rows)
    }
}

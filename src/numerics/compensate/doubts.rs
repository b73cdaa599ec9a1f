//! Where measured rows are predicted with doubt: corrections that the model is uncertain of. A row is asked as a target at its joints would be.

use super::{Chain, Circumstance, IdentifiedArm, Nominal, Remark, Uncertainty};
use crate::robot::Measurements;
use rayon::prelude::*;

/// A remark for each of `rows`, in their order; none where the model holds.
pub fn doubts(
    arm: &IdentifiedArm,
    uncertainty: &Uncertainty,
    data: &Measurements,
    rows: &[usize],
) -> Vec<Option<Remark>> {
    let asked = rows.par_iter().map_init(
        || (arm.reach(), Nominal::new(&arm.model().robot)),
        |(reach, nominal), row| {
            reach.under(&Circumstance::of_row(data, *row));
            let q = data.q(*row);
            let off =
                arm.base().rotation * (reach.place(q).translation - nominal.place(q).translation);
            let certainty = uncertainty.of_correction(reach, q, &off);
            Remark::of_certainty(&certainty)
        },
    );
    asked.collect()
}

//! Times in which something pushed on the arm.

use super::{ContactRow, Contacts};
use crate::dynamics::TorqueDiagnosis;

impl Contacts {
    /// A row for each event, in the order of time.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = (1..)
            .zip(&diagnosis.events)
            .map(|(event, found)| ContactRow {
                event,
                start_s: found.start,
                end_s: found.end,
                joints: found
                    .joints
                    .iter()
                    .map(|joint| (joint + 1).to_string())
                    .collect::<Vec<_>>()
                    .join(", "),
                force_x_n: found.force[0],
                force_y_n: found.force[1],
                force_z_n: found.force[2],
                sigma_x_n: found.sigma[0],
                sigma_y_n: found.sigma[1],
                sigma_z_n: found.sigma[2],
                gain: found.gain,
            });
        Self(rows.collect())
    }
}

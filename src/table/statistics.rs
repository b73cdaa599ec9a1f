//! Position error by step and set; held-out and training rows apart.
//!
//! The rivals of a learned correction, as cross-validation within the training rows judged them.

use super::{Corrections, StatisticsRow};
use crate::error::counted;
use crate::observation::KINDS;
use crate::robot::NoiseBasis;

impl StatisticsRow {
    /// Which of its points have a doubtful correction, with their errors; none where none has.
    pub fn doubts(&self) -> Option<String> {
        let (mean, max) = self.mean_remarked_mm.zip(self.max_remarked_mm)?;
        let points = self.remarked_points.as_deref().unwrap_or_default();
        let remarked = self.remarked.unwrap_or_default();
        Some(format!(
            "{remarked} of {}: the correction is uncertain by more than half of itself; mean {mean:.4} mm, max {max:.4} mm there; {points}",
            counted(self.points as usize, "point")
        ))
    }

    /// Whether it is of rows in which the target was brought to places: blocks that are left out are places then.
    pub(crate) fn is_contact(&self) -> bool {
        let own = |word: &str| self.set.ends_with(&format!("({word})"));
        KINDS
            .iter()
            .any(|kind| kind.is_contact() && own(kind.about().word))
    }

    /// Whether its figures of noise rest on nothing that was stated or measured again.
    pub(crate) fn is_inferred(&self) -> bool {
        self.noise_basis.as_deref() == Some(NoiseBasis::Inferred.name())
    }
}

impl Corrections {
    /// Root mean square error (mm) of the training rows under the rival that was kept, each row unseen; none where it could not be tried.
    pub(crate) fn rms_mm(&self) -> Option<f64> {
        self.0.iter().find(|row| row.chosen)?.rms_mm
    }
}

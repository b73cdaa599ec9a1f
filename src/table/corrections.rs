//! The rivals of a learned correction, as cross-validation within the training rows judged them.

use super::Corrections;

impl Corrections {
    /// Root mean square error (mm) of the training rows under the rival that was kept, each row unseen; none where it could not be tried.
    pub fn rms_mm(&self) -> Option<f64> {
        self.0.iter().find(|row| row.chosen)?.rms_mm
    }
}

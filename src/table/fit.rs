//! The course of a least-squares fit: convergence as data.

use super::{Fit, FitRow};
use crate::estimate::Fitted;

impl Fit {
    /// The course of a fit; the reason to stop stands in the last row.
    pub fn of(step: &str, fitted: &Fitted) -> Self {
        let last = fitted.course.len().saturating_sub(1);
        let row = |(iteration, at): (usize, &crate::estimate::Iteration)| FitRow {
            step: step.into(),
            iteration: iteration as i64,
            cost: at.cost,
            rms_mm: at.rms * 1e3,
            gradient: at.gradient,
            step_norm: at.step_norm,
            damping: at.damping,
            stop: (iteration == last).then(|| fitted.stop.name().to_string()),
        };
        Self(fitted.course.iter().enumerate().map(row).collect())
    }
}

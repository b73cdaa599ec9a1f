//! Half and double of what a criterion may be.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// What a criterion is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum CriterionFactor {
    /// As it is.
    One = 0,
    /// Halved.
    Half = 1,
    /// Doubled.
    Double = 2,
}

/// How a criterion is scaled, and whether something came by.
pub(super) struct CriterionScaling<T: 'static> {
    half: OnceLock<T>,
    double: OnceLock<T>,
    factor: AtomicU8,
    reached: AtomicBool,
}

impl<T> CriterionScaling<T> {
    pub(super) const fn new() -> Self {
        Self {
            half: OnceLock::new(),
            double: OnceLock::new(),
            factor: AtomicU8::new(0),
            reached: AtomicBool::new(false),
        }
    }

    pub(super) fn scale(&self, factor: CriterionFactor) {
        self.factor.store(factor as u8, Ordering::Relaxed);
    }

    pub(super) fn was_reached(&self) -> bool {
        self.reached.swap(false, Ordering::Relaxed)
    }
}

impl<T: Scaled> CriterionScaling<T> {
    /// The value as it is scaled now.
    pub(super) fn of<'v>(&'v self, value: &'v T) -> &'v T {
        self.reached.store(true, Ordering::Relaxed);
        match self.factor.load(Ordering::Relaxed) {
            0 => value,
            1 => self.half.get_or_init(|| value.scaled(0.5)),
            _ => self.double.get_or_init(|| value.scaled(2.0)),
        }
    }
}

/// What can be halved and doubled.
pub(crate) trait Scaled: Send + Sync + 'static {
    /// `factor` times as much. A share above a half is as far from 1, a ratio below 2 as far above 1, times the factor; a count is at least 1.
    fn scaled(&self, factor: f64) -> Self;
}

impl Scaled for f64 {
    fn scaled(&self, factor: f64) -> Self {
        if (0.5..2.0).contains(self) && *self != 0.5 && *self != 1.0 {
            1.0 + (self - 1.0) * factor
        } else {
            self * factor
        }
    }
}

impl Scaled for usize {
    fn scaled(&self, factor: f64) -> Self {
        ((*self as f64 * factor).round() as usize).max(1)
    }
}

impl Scaled for u32 {
    fn scaled(&self, factor: f64) -> Self {
        ((f64::from(*self) * factor).round() as u32).max(1)
    }
}

impl Scaled for i32 {
    fn scaled(&self, factor: f64) -> Self {
        ((f64::from(*self) * factor).round() as i32).max(1)
    }
}

impl<const N: usize> Scaled for [f64; N] {
    fn scaled(&self, factor: f64) -> Self {
        self.map(|value| value * factor)
    }
}

//! Half and double of what a criterion may be.

/// What a criterion is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Factor {
    /// As it is.
    One = 0,
    /// Halved.
    Half = 1,
    /// Doubled.
    Double = 2,
}

/// What can be halved and doubled.
pub trait Scaled: Send + Sync + 'static {
    /// `factor` times as much. A share above a half is as far from 1, a ratio below 2 as far above 1, times the factor; a count is at least 1.
    fn scaled(&self, factor: f64) -> Self;
}

impl Scaled for f64 {
    fn scaled(&self, factor: f64) -> Self {
        if (0.5..2.0).contains(self) && *self != 0.5 && *self != 1.0 { 1.0 + (self - 1.0) * factor } else { self * factor }
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

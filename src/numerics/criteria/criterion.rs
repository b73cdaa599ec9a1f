//! A number by which something is decided: `*NAME` is its value.

#[cfg(feature = "ablate")]
use super::scaled::{CriterionScaling, Scaled};
use std::ops::Deref;

/// A number by which something is decided.
pub struct CriterionValue<T: 'static> {
    value: T,
    #[cfg(feature = "ablate")]
    scaling: CriterionScaling<T>,
}

impl<T> CriterionValue<T> {
    pub(super) const fn new(value: T) -> Self {
        Self {
            value,
            #[cfg(feature = "ablate")]
            scaling: CriterionScaling::new(),
        }
    }
}

#[cfg(not(feature = "ablate"))]
impl<T> Deref for CriterionValue<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.value
    }
}

#[cfg(feature = "ablate")]
impl<T: Scaled> Deref for CriterionValue<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.scaling.of(&self.value)
    }
}

/// A criterion of any kind.
#[cfg(feature = "ablate")]
pub(super) trait Scalable: Sync {
    /// How it is scaled.
    fn scale(&self, factor: super::CriterionFactor);
    /// Whether something came by since the last call.
    fn was_reached(&self) -> bool;
}

#[cfg(feature = "ablate")]
impl<T: Scaled> Scalable for CriterionValue<T> {
    fn scale(&self, factor: super::CriterionFactor) {
        self.scaling.scale(factor);
    }

    fn was_reached(&self) -> bool {
        self.scaling.was_reached()
    }
}

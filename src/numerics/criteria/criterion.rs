//! A number by which something is decided: `*NAME` is its value.

use std::ops::Deref;

/// A number by which something is decided.
#[cfg(not(feature = "ablate"))]
pub struct Criterion<T: 'static> {
    value: T,
}

#[cfg(not(feature = "ablate"))]
impl<T> Criterion<T> {
    pub(super) const fn new(value: T) -> Self {
        Self { value }
    }
}

#[cfg(not(feature = "ablate"))]
impl<T> Deref for Criterion<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.value
    }
}

#[cfg(feature = "ablate")]
pub use scalable::{Criterion, Scalable};

#[cfg(feature = "ablate")]
mod scalable {
    use super::super::scaled::{Factor, Scaled};
    use std::ops::Deref;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

    /// A number by which something is decided, which may be scaled while a program runs.
    pub struct Criterion<T: 'static> {
        value: T,
        half: OnceLock<T>,
        double: OnceLock<T>,
        factor: AtomicU8,
        reached: AtomicBool,
    }

    impl<T> Criterion<T> {
        pub(in super::super) const fn new(value: T) -> Self {
            let (half, double) = (OnceLock::new(), OnceLock::new());
            Self { value, half, double, factor: AtomicU8::new(0), reached: AtomicBool::new(false) }
        }
    }

    impl<T: Scaled> Deref for Criterion<T> {
        type Target = T;

        fn deref(&self) -> &T {
            self.reached.store(true, Ordering::Relaxed);
            match self.factor.load(Ordering::Relaxed) {
                0 => &self.value,
                1 => self.half.get_or_init(|| self.value.scaled(0.5)),
                _ => self.double.get_or_init(|| self.value.scaled(2.0)),
            }
        }
    }

    /// A criterion of any kind.
    pub trait Scalable: Sync {
        /// Scales it.
        fn scale(&self, factor: Factor);
        /// Whether something came by since the last call.
        fn was_reached(&self) -> bool;
    }

    impl<T: Scaled> Scalable for Criterion<T> {
        fn scale(&self, factor: Factor) {
            self.factor.store(factor as u8, Ordering::Relaxed);
        }

        fn was_reached(&self) -> bool {
            self.reached.swap(false, Ordering::Relaxed)
        }
    }
}

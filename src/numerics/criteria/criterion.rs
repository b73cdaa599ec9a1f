//! A number by which something is decided, `*NAME` is its value; how a table of them is written; and, for `ablate`, half and double of each.

/// A number by which something is decided.
pub struct CriterionValue<T: 'static> {
    value: T,
    #[cfg(feature = "ablate")]
    scaling: ablate::CriterionScaling<T>,
}

impl<T> CriterionValue<T> {
    pub(super) const fn new(value: T) -> Self {
        Self {
            value,
            #[cfg(feature = "ablate")]
            scaling: ablate::CriterionScaling::new(),
        }
    }
}

#[cfg(not(feature = "ablate"))]
impl<T> std::ops::Deref for CriterionValue<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.value
    }
}

/// A row of a table of criteria, in words.
#[derive(Clone, Copy)]
pub struct CriterionRow {
    /// The table.
    pub room: &'static str,
    /// Its name in the code.
    pub name: &'static str,
    /// What it decides.
    pub meaning: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Where it is from.
    pub source: &'static str,
    /// The number itself.
    #[cfg(feature = "ablate")]
    pub(super) criterion: &'static dyn ablate::Scalable,
}

/// A table: `/// meaning`, `NAME: kind = value, "unit", "source", "what halving and doubling does";`.
macro_rules! criteria {
    ($room:literal; $($(#[doc = $doc:literal])+ $name:ident: $kind:ty = $value:expr, $unit:literal, $source:literal, $scaled:literal;)+) => {
        $(
            $(#[doc = $doc])+
            #[cfg(not(feature = "ablate"))]
            pub const $name: CriterionValue<$kind> = CriterionValue::new($value);
            $(#[doc = $doc])+
            #[cfg(feature = "ablate")]
            pub static $name: CriterionValue<$kind> = CriterionValue::new($value);
        )+

        /// The rows of the table.
        pub(crate) const ROWS: &[super::CriterionRow] = &[
            $(super::CriterionRow {
                room: $room,
                name: stringify!($name),
                meaning: concat!($($doc),+),
                unit: $unit,
                source: $source,
                #[cfg(feature = "ablate")]
                criterion: &$name,
            }),+
        ];
    };
}

pub(super) use criteria;

#[cfg(feature = "ablate")]
pub(super) mod ablate {
    use std::ops::Deref;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

    /// What a criterion is multiplied by.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[repr(u8)]
    pub enum CriterionFactor {
        /// As it is.
        One = 0,
        /// Halved.
        Half = 1,
        /// Doubled.
        Double = 2,
    }

    /// How a criterion is scaled, and whether something came by.
    pub struct CriterionScaling<T: 'static> {
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
    }

    impl<T: Scaled> Deref for super::CriterionValue<T> {
        type Target = T;

        /// The value as it is scaled now.
        fn deref(&self) -> &T {
            let scaling = &self.scaling;
            scaling.reached.store(true, Ordering::Relaxed);
            match scaling.factor.load(Ordering::Relaxed) {
                0 => &self.value,
                1 => scaling.half.get_or_init(|| self.value.scaled(0.5)),
                _ => scaling.double.get_or_init(|| self.value.scaled(2.0)),
            }
        }
    }

    /// A criterion of any kind.
    pub trait Scalable: Sync {
        /// How it is scaled.
        fn scale(&self, factor: CriterionFactor);
        /// Whether something came by since the last call.
        fn was_reached(&self) -> bool;
    }

    impl<T: Scaled> Scalable for super::CriterionValue<T> {
        fn scale(&self, factor: CriterionFactor) {
            self.scaling.factor.store(factor as u8, Ordering::Relaxed);
        }

        fn was_reached(&self) -> bool {
            self.scaling.reached.swap(false, Ordering::Relaxed)
        }
    }

    /// What can be halved and doubled.
    pub trait Scaled: Send + Sync + 'static {
        /// `factor` times as much. A share above a half is as far from 1, a ratio below 2 as far above 1, times the factor; a count is at
        /// least 1.
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

    /// Counts.
    macro_rules! counts {
        ($($kind:ty),+) => {
            $(impl Scaled for $kind {
                fn scaled(&self, factor: f64) -> Self {
                    ((*self as f64 * factor).round() as $kind).max(1)
                }
            })+
        };
    }
    counts!(usize, u32, i32);

    impl<const N: usize> Scaled for [f64; N] {
        fn scaled(&self, factor: f64) -> Self {
            self.map(|value| value * factor)
        }
    }

    impl<const N: usize> Scaled for [usize; N] {
        fn scaled(&self, factor: f64) -> Self {
            self.map(|value| value.scaled(factor))
        }
    }
}

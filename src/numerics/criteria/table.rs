//! How a table of criteria is written.

/// A row of a table of criteria, in words.
#[derive(Debug, Clone, Copy)]
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
            }),+
        ];

        #[cfg(feature = "ablate")]
        pub(super) const SCALABLE: &[(&str, &dyn super::criterion::Scalable)] = &[
            $((concat!($room, "::", stringify!($name)), &$name)),+
        ];
    };
}

pub(super) use criteria;

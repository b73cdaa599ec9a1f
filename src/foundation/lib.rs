//! What all packages may use: errors by reader, the robot as plain data, the units of numbers, their digits, order statistics. It computes no pose.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod description;
pub mod error;
pub mod figures;
pub mod statistics;
pub mod units;

/// Declares an enum with a word for each of its kinds: `name`, and `ALL` of them in their order.
#[macro_export]
macro_rules! named {
    ($(#[$meta:meta])* $vis:vis enum $name:ident { $( $(#[$kind:meta])* $variant:ident $word:literal, )+ }) => {
        $(#[$meta])*
        $vis enum $name { $( $(#[$kind])* $variant, )+ }

        #[allow(dead_code, reason = "not all lists are gone through")]
        impl $name {
            /// All of them.
            $vis const ALL: &'static [Self] = &[$( Self::$variant, )+];
            /// As it is written.
            $vis fn name(self) -> &'static str {
                match self { $( Self::$variant => $word, )+ }
            }
        }
    };
}

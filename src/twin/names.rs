//! Kinds of things by the words that people and files have for them.

/// Declares an enum with a word for each of its kinds, and a list of all.
macro_rules! named {
    ($(#[$meta:meta])* $name:ident, $(#[$list:meta])* $all:ident: $count:literal {
        $( $(#[$kind:meta])* $variant:ident $word:literal, )+
    }) => {
        $(#[$meta])*
        pub enum $name { $( $(#[$kind])* $variant, )+ }

        $(#[$list])*
        pub const $all: [$name; $count] = [ $( $name::$variant, )+ ];

        impl $name {
            /// As it is written.
            pub fn name(self) -> &'static str {
                match self { $( Self::$variant => $word, )+ }
            }
        }
    };
}
pub(crate) use named;

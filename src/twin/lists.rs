//! Lists: kinds of things by the words that people and files have for them, and what may be concealed: a row is a canonical name and how
//! physics of that name is drawn.

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

/// What is concealed under one name; several rows of one name are different causes.
pub struct Family<F> {
    /// The canonical name; `unknown` for what is in no list.
    pub name: &'static str,
    /// May be concealed together with another one.
    pub(crate) paired: bool,
    /// Draws one.
    pub(crate) draw: F,
}

/// Declares a list of families, a row each: whether it may be `paired` or is `alone`, its name, and its draw, an expression of the name, of
/// what it is drawn on, of whether another form than the obvious one is wanted, and of randomness. A draw may return `None` where the robot
/// cannot have it.
macro_rules! families {
    ($(#[$meta:meta])* $list:ident: $draw:ty, |$name:ident, $on:ident, $other:ident, $noise:ident|
     $( $pairing:ident $effect:literal $body:expr; )+) => {
        $(#[$meta])*
        #[allow(unused_variables, reason = "a row uses some of what it is drawn from")]
        pub const $list: &[$crate::lists::Family<$draw>] = &[ $( $crate::lists::Family {
            name: $effect,
            paired: $crate::lists::families!(@ $pairing),
            draw: |$on, $other, $noise| {
                let $name = $effect;
                Some($body)
            },
        } ),+ ];
    };
    (@ paired) => { true };
    (@ alone) => { false };
}
pub(crate) use families;

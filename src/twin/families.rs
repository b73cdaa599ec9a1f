//! Lists of what may be concealed: a row is a canonical name and how physics of that name is drawn.

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
        pub const $list: &[$crate::families::Family<$draw>] = &[ $( $crate::families::Family {
            name: $effect,
            paired: $crate::families::families!(@ $pairing),
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

//! What the twin was made with: true parameters and effects, for tests and proofs only.

crate::table::rows! { "truth",
    /// True numbers, one a row; key `name`.
    pub struct Truth of TruthRow {
        name: String,
        /// The effect in canonical names.
        effect: String,
        place: String,
        unit: String,
        value: f64,
    }
}

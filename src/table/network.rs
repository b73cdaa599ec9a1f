//! A trained multilayer perceptron: weights, input and output scaling, valid range.

crate::table::rows! { "network",
    /// Numbers of the network, one a row; key (`part`, `layer`, `to`, `from`).
    pub struct Network of NetworkRow {
        /// `weight`, `bias`, `input_mean`, `input_scale`, `output_mean`, `output_scale`, `valid_lower`, `valid_upper`.
        part: String,
        layer: i64,
        to: i64,
        from: i64,
        value: f64,
    }
}

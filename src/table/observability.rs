//! What the data of a fit could see: rank, singular values, condition, observability indices O1-O5.

crate::table::rows! { "observability",
    /// Quantities, one a row; key (`step`, `quantity`, `index`).
    pub struct Observability of ObservabilityRow {
        step: String,
        /// `rank`, `rank_expected`, `condition`, `O1`..`O5`, `singular_value`, ...
        quantity: String,
        /// 0, or the number of the singular value from 1.
        index: i64,
        value: f64,
        meaning: String,
    }
}

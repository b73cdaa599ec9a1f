//! What one robot's recording says against an earlier model of it.

crate::table::rows! { "changes",
    /// Changes since the earlier campaign, one parameter a row; key `name`.
    pub struct Changes of ChangeRow {
        name: String,
        effect: String,
        place: String,
        unit: String,
        /// In the earlier model.
        previous: f64,
        /// Estimated alone, beside those ranked; the base's new place is always free.
        change: f64,
        sigma: f64,
        /// Two-sided.
        p_value: f64,
        /// Order in which it was taken in, from 1.
        rank: Option<i64>,
    }
}

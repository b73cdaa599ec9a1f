//! Which row serves what.

crate::table::rows! { "split",
    /// Rows of the recording; key `sequence`. Every row belongs to exactly one set.
    pub struct Split of SplitRow {
        sequence: i64,
        point_id: String,
        /// The name of the set, e.g. `fit`, `validate`.
        set: String,
    }
}

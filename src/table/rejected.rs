//! Rows that were read and not used, each with the reason: nothing is lost.

crate::table::rows! { "rejected",
    /// Rejected rows; key (`file`, `line`).
    pub struct Rejected of RejectedRow {
        file: String,
        /// Line in the file, from 1.
        line: i64,
        point_id: Option<String>,
        /// Short and stable: `blank`, `not_a_number`, `duplicate_id`, `unmatched`, `out_of_range`, `short_row`, `lost_beam`.
        reason: String,
        /// The sentence for a person, with column and what is allowed.
        detail: String,
        /// The row as it stood, cut at 200 characters.
        text: String,
    }
}

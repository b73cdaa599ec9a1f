//! What was read from each file: accepted + rejected = read.

crate::table::rows! { "intake",
    /// Files, one a row; key `file`.
    pub struct Intake of IntakeRow {
        file: String,
        /// Lines of the file, junk and header included.
        lines: i64,
        /// Data rows.
        read: i64,
        accepted: i64,
        rejected: i64,
    }
}

//! Finished documents (the HTML report), kept as a table so that they are versioned like everything else.

crate::table::rows! { "document",
    /// Documents, one a row; key `name`.
    pub struct Document of DocumentRow {
        /// File name, e.g. `report.html`.
        name: String,
        media_type: String,
        content: String,
    }
}

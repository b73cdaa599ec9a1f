//! The schemas of calib's tables: the files of this folder, and of each a macro with the name of its kind that has its columns as fields of
//! Rust (build.rs). The macro `KIND! { Table, Row }` hands them to a macro `rows!` where it is used.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

/// The text of every schema file, one per kind of table.
pub const SCHEMAS: &[&str] = include!(concat!(env!("OUT_DIR"), "/schemas.rs"));

include!(concat!(env!("OUT_DIR"), "/columns.rs"));

//! Two tables, or two runs, compared: which rows changed, by how much, in the column's unit and in sigmas.
//!
//! One column at a time over rows paired by key, so that memory is a few columns whatever the table; tolerances and semantics come
//! from the schema. Equal content hashes answer at once, equal bytes as fast as they can be read.

mod cells;
mod columns;
mod compare;
mod key;
mod measure;
mod source;
mod text;

pub use compare::{compare, table_hash};
pub use text::{Detail, headline, html, short, text};

use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::units::Unit;

/// What a comparison is to overlook, and how much it is to show.
#[derive(Debug, Clone, Default)]
pub struct DiffOptions {
    /// Instead of the key that the files name.
    pub(crate) key: Vec<String>,
    /// Absolute, in the unit of the column.
    pub(crate) atol: Tolerances,
    /// As a share of the larger value.
    pub(crate) rtol: Tolerances,
    /// Columns that are left out.
    pub(crate) ignore: BTreeSet<String>,
    /// Whether columns named here may be missing in both tables: one wish is for several pairs of them.
    pub(crate) where_present: bool,
    /// Columns w, x, y, z that are one rotation together.
    pub(crate) quaternions: Vec<Vec<String>>,
    /// Pairs rows of equal keys in their order instead of reporting them.
    pub(crate) by_occurrence: bool,
    /// Reads everything, also where the files say that they have equal content.
    pub(crate) reread: bool,
    /// Worst rows that are kept.
    pub(crate) limit: usize,
    /// Where every cell that differs is written as a row.
    pub(crate) out: Option<PathBuf>,
}

/// A tolerance for all columns, and for some.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Tolerances {
    /// The tolerance of every column.
    pub(crate) all: Option<f64>,
    /// Tolerances of single columns, each with the unit in which it was given.
    pub(crate) columns: BTreeMap<String, (f64, Option<Unit>)>,
}

impl Tolerances {
    /// Takes in `0.1`, `x_mm=0.1` or `x_mm=100um`.
    pub(crate) fn add(&mut self, flag: &str, text: &str) -> Result<()> {
        let fault = || {
            Error::spec(
                flag,
                format!(
                    "`{text}`: expected a number not below 0, or COLUMN=NUMBER with or without a unit"
                ),
            )
        };
        let (column, value) = match text.rsplit_once('=') {
            Some((column, value)) => (Some(column), value),
            None => (None, text),
        };
        let digits = value
            .trim_end_matches(|c: char| c.is_alphabetic() || c == '/')
            .len();
        // An exponent's letter is followed by digits, a unit's is not.
        let (number, symbol) = value.split_at(digits);
        let number: f64 = number.trim().parse().map_err(|_| fault())?;
        let unit = if symbol.is_empty() {
            None
        } else {
            Some(Unit::parse(symbol).ok_or_else(fault)?)
        };
        if !number.is_finite() || number < 0.0 || (column.is_none() && unit.is_some()) {
            return Err(fault());
        }
        match column {
            Some(column) => drop(self.columns.insert(column.into(), (number, unit))),
            None => self.all = Some(number),
        }
        Ok(())
    }

    /// The tolerance wished for a column that is in `unit`.
    fn of(&self, column: &str, unit: Unit) -> Option<f64> {
        let (number, given) = match self.columns.get(column) {
            Some(wish) => *wish,
            None => (self.all?, None),
        };
        let convert =
            |given: Unit| unit.from_si(given.to_si(number)) - unit.from_si(given.to_si(0.0));
        Some(
            given
                .filter(|given| given.quantity() == unit.quantity())
                .map_or(number, convert),
        )
    }
}

/// Two tables compared.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct TableDiff {
    pub(crate) a: DiffedTable,
    pub(crate) b: DiffedTable,
    /// Columns that identify rows.
    pub(crate) key: Vec<String>,
    /// Equal without a look at any row: by the hash of their content, or byte by byte.
    pub(crate) equal: Option<Equal>,
    /// What differs beside the values: columns, units, types, the schema's version.
    pub(crate) findings: Vec<Discrepancy>,
    /// How many rows are what.
    pub(crate) rows: RowCounts,
    /// Compared columns, in the order of A.
    pub(crate) columns: Vec<ColumnDiff>,
    /// The worst first.
    pub(crate) worst: Vec<WorstRow>,
    /// Keys that occur in one table only or more than once, some of them.
    pub(crate) examples: Examples,
}

/// Why two tables are the same whatever their rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Equal {
    /// The files say that they have the same content.
    Hash,
    /// They are one file.
    File,
    /// They are the same byte by byte.
    Bytes,
}

impl Equal {
    /// What it means, in words.
    pub(crate) fn says(self) -> &'static str {
        match self {
            Self::Hash => "equal by the hash of their content",
            Self::File => "one and the same file",
            Self::Bytes => "equal byte by byte",
        }
    }
}

/// One side of a comparison.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct DiffedTable {
    /// As it was given.
    pub(crate) path: String,
    /// `prediction/1.0.0`.
    pub(crate) schema: Option<String>,
    /// Hash of its content, where the file carries it.
    pub(crate) table_hash: Option<String>,
    pub(crate) rows: u64,
}

/// A difference of the tables' make.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Discrepancy {
    /// `column`, `unit`, `type`, `semantic`, `schema`, `key`.
    pub(crate) what: String,
    pub(crate) column: String,
    pub(crate) says: String,
}

impl Discrepancy {
    fn new(what: &str, column: &str, says: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            column: column.into(),
            says: says.into(),
        }
    }
}

/// How many rows of each class.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct RowCounts {
    /// In every column.
    pub(crate) same: u64,
    /// In every column, and not in all the same.
    pub(crate) within_tolerance: u64,
    /// Beyond tolerance in some column.
    pub(crate) changed: u64,
    /// Keys of the first table alone.
    pub(crate) only_a: u64,
    /// Keys of the second table alone.
    pub(crate) only_b: u64,
    /// Rows whose key occurs more than once in a table.
    pub(crate) duplicate_a: u64,
    /// The same of the second table.
    pub(crate) duplicate_b: u64,
    /// How many keys occur more than once.
    pub(crate) duplicate_keys: u64,
}

/// A column of which values differ.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ColumnDiff {
    pub(crate) name: String,
    /// Unit of tolerance and statistics, A's; `row` where every row has its own.
    pub(crate) unit: String,
    /// Rows with a value in both.
    pub(crate) pairs: u64,
    /// Values that differ within tolerance.
    pub(crate) within: u64,
    /// Values that differ beyond.
    pub(crate) changed: u64,
    /// Absolute tolerance, in the unit of the column.
    pub(crate) atol: f64,
    pub(crate) rtol: f64,
    /// Statistics of B minus A over all pairs; null for texts and where rows have units of their own.
    pub(crate) statistics: Option<DifferenceStatistics>,
    /// Largest difference in standard deviations, where the table has them.
    pub(crate) max_sigmas: Option<f64>,
    /// The same, rms.
    pub(crate) rms_sigmas: Option<f64>,
    #[serde(skip)]
    worst_row: Option<u32>,
    /// Where the difference is largest.
    pub(crate) worst_key: Option<String>,
}

/// Differences of a column of numbers, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct DifferenceStatistics {
    /// Largest size.
    pub(crate) max: f64,
    /// Root of the mean square.
    pub(crate) rms: f64,
    /// Mean.
    pub(crate) bias: f64,
    /// 95th percentile of the size.
    pub(crate) p95: f64,
}

/// A row that changed, with its cells that changed.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct WorstRow {
    /// Key of the row, in words.
    pub(crate) key: String,
    /// What differs in it.
    pub(crate) cells: Vec<WorstCell>,
}

/// A value that differs.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct WorstCell {
    pub(crate) column: String,
    pub(crate) a: serde_json::Value,
    pub(crate) b: serde_json::Value,
    /// The difference of numbers, in their unit.
    pub(crate) difference: Option<f64>,
    /// Empty where there is none.
    pub(crate) unit: String,
    /// The difference in standard deviations, where the table has them.
    pub(crate) sigmas: Option<f64>,
}

/// A few keys of each kind.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Examples {
    /// Keys of the first table alone.
    pub(crate) only_a: Vec<String>,
    /// Keys of the second table alone.
    pub(crate) only_b: Vec<String>,
    /// Keys that occur more than once.
    pub(crate) duplicate: Vec<String>,
}

impl TableDiff {
    /// True where nothing differs beyond tolerance.
    pub(crate) fn is_same(&self) -> bool {
        let rows = &self.rows;
        self.findings.is_empty()
            && rows.changed + rows.only_a + rows.only_b + self.duplicates() == 0
    }

    /// Rows that could not be paired because their key is not theirs alone.
    pub(crate) fn duplicates(&self) -> u64 {
        self.rows.duplicate_a + self.rows.duplicate_b
    }
}

//! Two tables compared from end to end: hashes, keys, columns side by side, the worst rows.

use arrow::array::AsArray;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};

use super::cells::CellWriter;
use super::columns::{self, ColumnPair};
use super::key::{self, Keys, Pairing};
use super::measure::{self, CHANGED, CellDifference, CellValue, ComparedTables, SAME, WITHIN};
use super::source::{TableColumn, TableFile, same_bytes};
use super::{
    ColumnDiff, DiffOptions, DiffedTable, Discrepancy, Equal, Examples, RowCounts, TableDiff,
    WorstCell, WorstRow,
};
use crate::error::{Error, Result};
use crate::raw::same_file;

/// Keys shown of rows without a partner.
const EXAMPLES: usize = 5;

/// Compares the Parquet files `a` and `b`.
pub fn compare(a: &Path, b: &Path, options: &DiffOptions) -> Result<TableDiff> {
    let (a, b) = (TableFile::open(a)?, TableFile::open(b)?);
    if let Some(out) = options.out.as_deref()
        && [&a, &b].iter().any(|source| same_file(&source.path, out))
    {
        return Err(Error::spec(
            "--out",
            format!("{} is one of the tables that are compared", out.display()),
        ));
    }
    let mut diff = TableDiff {
        a: side(&a),
        b: side(&b),
        findings: schema_findings(&a, &b, options)?,
        ..TableDiff::default()
    };
    diff.key = key_columns(&a, &b, options, &mut diff.findings)?;
    let comparisons = columns::plan(&a, &b, &diff.key, options, &mut diff.findings)?;
    if !options.reread && diff.findings.is_empty() {
        diff.equal = equal(&a, &b);
    }
    if diff.equal.is_some() {
        diff.rows.same = a.rows as u64;
        if let Some(path) = &options.out {
            CellWriter::create(path, &a, &diff.key)?.close()?;
        }
        return Ok(diff);
    }
    let (keys, keys_b) = Keys::read(&a, &b, &diff.key)?;
    let pairing = key::pair(&keys, &keys_b, options.by_occurrence);
    diff.examples = examples(&keys, &keys_b, &pairing)?;
    let mut writer = match &options.out {
        Some(path) => {
            let mut writer = CellWriter::create(path, &a, &diff.key)?;
            writer.unpaired(&keys, &pairing.only_a, "only_a")?;
            writer.unpaired(&keys, &pairing.twice_a, "duplicate_a")?;
            writer.unpaired(&keys_b, &pairing.only_b, "only_b")?;
            writer.unpaired(&keys_b, &pairing.twice_b, "duplicate_b")?;
            Some(writer)
        }
        None => None,
    };
    // Only A's keys are needed from here on, and they are large.
    drop(keys_b);
    let rows: Vec<AtomicU8> = (0..a.rows).map(|_| AtomicU8::new(SAME)).collect();
    let files = ComparedTables {
        a: &a,
        b: &b,
        pairing: &pairing,
        rows: &rows,
    };
    let measured = match &mut writer {
        None => {
            let one = |comparison: &ColumnPair| judge(files, comparison, options, None);
            comparisons
                .par_iter()
                .map(one)
                .collect::<Result<Vec<_>>>()?
        }
        Some(writer) => {
            let one =
                |comparison: &ColumnPair| judge(files, comparison, options, Some((writer, &keys)));
            comparisons.iter().map(one).collect::<Result<Vec<_>>>()?
        }
    };
    if let Some(mut writer) = writer {
        writer.flush(&keys)?;
        writer.close()?;
    }
    diff.rows = count(&rows, &pairing);
    drop(rows);
    let mut cells: Vec<(usize, CellDifference)> = Vec::new();
    for (at, (column, worst)) in measured.into_iter().enumerate() {
        let worst_key = keys.texts(column.worst_row.as_slice())?.pop();
        diff.columns.push(ColumnDiff {
            worst_key,
            ..column
        });
        cells.extend(worst.into_iter().map(|cell| (at, cell)));
    }
    diff.worst = worst_rows(&a, &keys, &comparisons, cells, options.limit)?;
    Ok(diff)
}

/// The content hash that a file carries.
pub fn table_hash(path: &Path) -> Result<Option<String>> {
    Ok(TableFile::open(path)?.table_hash)
}

fn side(source: &TableFile) -> DiffedTable {
    DiffedTable {
        path: source.path.display().to_string(),
        schema: source
            .table
            .as_ref()
            .map(|(kind, version)| format!("{kind}/{version}")),
        table_hash: source.table_hash.clone(),
        rows: source.rows as u64,
    }
}

/// Whether the tables are the same without a look at their rows.
fn equal(a: &TableFile, b: &TableFile) -> Option<Equal> {
    if a.table_hash.is_some() && a.table_hash == b.table_hash {
        return Some(Equal::Hash);
    }
    if same_file(&a.path, &b.path) {
        return Some(Equal::File);
    }
    same_bytes(&a.path, &b.path).then_some(Equal::Bytes)
}

fn schema_findings(
    a: &TableFile,
    b: &TableFile,
    options: &DiffOptions,
) -> Result<Vec<Discrepancy>> {
    let (Some((kind_a, version_a)), Some((kind_b, version_b))) = (&a.table, &b.table) else {
        return Ok(Vec::new());
    };
    if kind_a != kind_b && options.key.is_empty() {
        let message = format!(
            "A is a table of {kind_a}, B of {kind_b}: not comparable unless --key names the columns that identify rows"
        );
        return Err(Error::spec(b.path.display().to_string(), message));
    }
    let says = if kind_a != kind_b {
        format!("{kind_a} in A, {kind_b} in B")
    } else if version_a == version_b {
        return Ok(Vec::new());
    } else {
        let step = match () {
            () if version_a.major != version_b.major => "major: columns changed their meaning",
            () if version_a.minor != version_b.minor => "minor: columns were added",
            () => "patch: descriptions changed",
        };
        format!("{kind_a} {version_a} in A, {version_b} in B ({step})")
    };
    Ok(vec![Discrepancy::new("schema", "", says)])
}

fn key_columns(
    a: &TableFile,
    b: &TableFile,
    options: &DiffOptions,
    findings: &mut Vec<Discrepancy>,
) -> Result<Vec<String>> {
    if !options.key.is_empty() {
        options
            .key
            .iter()
            .try_for_each(|name| a.key_column(name).and(b.key_column(name)).map(|_| ()))?;
        return Ok(options.key.clone());
    }
    if !a.key.is_empty() && !b.key.is_empty() && a.key != b.key {
        findings.push(Discrepancy::new(
            "key",
            "",
            format!("{} in A, {} in B", a.key.join(", "), b.key.join(", ")),
        ));
    }
    let key = if a.key.is_empty() { &b.key } else { &a.key };
    if key.is_empty() {
        let message = format!(
            "does not say which columns identify its rows; name them with --key, of: {}",
            a.names().join(", ")
        );
        return Err(Error::spec(a.path.display().to_string(), message));
    }
    Ok(key.clone())
}

fn examples(a: &Keys, b: &Keys, pairing: &Pairing) -> Result<Examples> {
    let some = |keys: &Keys, rows: &[u32]| keys.texts(&keys.distinct(rows, EXAMPLES));
    let mut duplicate = some(a, &pairing.twice_a)?;
    duplicate.extend(some(b, &pairing.twice_b)?);
    duplicate.sort();
    duplicate.dedup();
    duplicate.truncate(EXAMPLES);
    Ok(Examples {
        only_a: some(a, &pairing.only_a)?,
        only_b: some(b, &pairing.only_b)?,
        duplicate,
    })
}

/// Measures a column and keeps its worst cells.
fn judge(
    files: ComparedTables,
    comparison: &ColumnPair,
    options: &DiffOptions,
    mut out: Option<(&mut CellWriter, &Keys)>,
) -> Result<(ColumnDiff, Vec<CellDifference>)> {
    let mut worst: Vec<CellDifference> = Vec::new();
    let mut sees = |cell: &CellDifference| -> Result<()> {
        if let Some((writer, keys)) = &mut out {
            writer.cell(keys, comparison, cell)?;
        }
        if cell.changed
            && (worst.len() < options.limit
                || worst.last().is_some_and(|least| cell.score > least.score))
        {
            let at = worst.partition_point(|other| other.score >= cell.score);
            worst.insert(at, cell.clone());
            worst.truncate(options.limit);
        }
        Ok(())
    };
    let column = measure::measure(files, comparison, &mut sees)?;
    Ok((column, worst))
}

fn count(rows: &[AtomicU8], pairing: &Pairing) -> RowCounts {
    let of_class = |class: u8| {
        rows.iter()
            .filter(|row| row.load(Ordering::Relaxed) == class)
            .count() as u64
    };
    let (within, changed) = (of_class(WITHIN), of_class(CHANGED));
    RowCounts {
        same: pairing.paired as u64 - within - changed,
        within_tolerance: within,
        changed,
        only_a: pairing.only_a.len() as u64,
        only_b: pairing.only_b.len() as u64,
        duplicate_a: pairing.twice_a.len() as u64,
        duplicate_b: pairing.twice_b.len() as u64,
        duplicate_keys: pairing.keys_twice as u64,
    }
}

/// The rows with the worst cells; of equal ones the earlier row first.
fn worst_rows(
    a: &TableFile,
    keys: &Keys,
    comparisons: &[ColumnPair],
    mut cells: Vec<(usize, CellDifference)>,
    limit: usize,
) -> Result<Vec<WorstRow>> {
    cells.sort_by(|(column, l), (other, r)| {
        r.score
            .total_cmp(&l.score)
            .then(l.row.cmp(&r.row))
            .then(column.cmp(other))
    });
    let mut order: Vec<u32> = Vec::new();
    for (_, cell) in &cells {
        if !order.contains(&cell.row) {
            order.push(cell.row);
        }
    }
    order.truncate(limit);
    let units = row_units(a, comparisons, &order)?;
    let texts = keys.texts(&order)?;
    let rows = order.into_iter().zip(texts).map(|(row, key)| {
        let of_row = cells.iter().filter(|(_, cell)| cell.row == row);
        let cells = of_row.map(|(at, cell)| {
            let comparison = &comparisons[*at];
            let unit = if comparison.unit == "row" {
                units.get(&row).cloned().unwrap_or_default()
            } else {
                comparison.unit.clone()
            };
            WorstCell {
                column: comparison.name.clone(),
                a: json(&cell.a),
                b: json(&cell.b),
                difference: cell.difference,
                unit: if unit == "1" { String::new() } else { unit },
                sigmas: cell.sigmas,
            }
        });
        WorstRow {
            key,
            cells: cells.collect(),
        }
    });
    Ok(rows.collect())
}

fn json(value: &CellValue) -> serde_json::Value {
    match value {
        CellValue::Null => serde_json::Value::Null,
        CellValue::Number(number) => (*number).into(),
        CellValue::Text(text) => text.clone().into(),
    }
}

/// The units that the given rows name in the table's column of units.
fn row_units(
    a: &TableFile,
    comparisons: &[ColumnPair],
    rows: &[u32],
) -> Result<BTreeMap<u32, String>> {
    let by_row = comparisons
        .iter()
        .any(|comparison| comparison.unit == "row");
    let semantic = |column: &TableColumn| column.semantic.as_deref() == Some("unit");
    let Some(column) = a.columns.iter().position(semantic).filter(|_| by_row) else {
        return Ok(BTreeMap::new());
    };
    let texts = a.whole_text(column)?;
    let texts = texts.as_string::<i64>();
    let unit = |row: &u32| (*row, texts.value(*row as usize).to_string());
    Ok(rows.iter().map(unit).collect())
}

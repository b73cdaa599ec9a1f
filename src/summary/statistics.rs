//! The result of a run as text and as JSON: errors step by step, rejected rows.

use super::{labelled, tables};
use crate::error::{Result, counted};
use crate::pipeline::{CompletedRun, Manifest};
use crate::store::Store;
use crate::table::{Standing, Statistics, StatisticsRow, Table};
use serde_json::json;

/// The rows of all tables `statistics` of a run.
pub(super) fn rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<StatisticsRow>> {
    Ok(tables::<Statistics>(outcome, store)?
        .into_iter()
        .flat_map(|table| table.0)
        .collect())
}

/// Three tables: points that no model has seen, those that the models were fitted to, and these again
/// cross-validated. `expected` is the rms of a complete
/// model under the instrument's noise.
pub fn statistics(
    outcome: &CompletedRun,
    standing: Option<&Standing>,
    store: &Store,
) -> Result<String> {
    let mut rows = rows(outcome, store)?;
    let withdrawn: Vec<&str> = standing
        .iter()
        .flat_map(|stands| &stands.withdrawn)
        .map(|gone| gone.step.as_str())
        .collect();
    for row in rows
        .iter_mut()
        .filter(|row| withdrawn.contains(&row.step.as_str()))
    {
        row.step.push_str(" (withdrawn)");
    }
    let mut text = String::new();
    for (held_out, title) in [
        (
            false,
            "training points (the models were fitted to these: flattered)",
        ),
        (true, "held-out points (no model has seen these)"),
    ] {
        let rows: Vec<&StatisticsRow> =
            rows.iter().filter(|row| row.held_out == held_out).collect();
        if !rows.is_empty() {
            text.push_str(&block(title, &rows));
        }
    }
    if rows.iter().any(StatisticsRow::is_inferred) {
        text.push_str("expected rests on an assumed noise: none is recorded, and no `instrument` is stated in `ingest`\n\n");
    }
    text.push_str(&folds(&rows));
    text.push_str(&references(&rows));
    Ok(text)
}

/// Training points under fits without them; nothing where no step made folds.
fn folds(rows: &[StatisticsRow]) -> String {
    let rows: Vec<&StatisticsRow> = rows
        .iter()
        .filter(|row| row.fold_rms_mm.is_some())
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let width = |name: fn(&StatisticsRow) -> &str, least: usize| {
        rows.iter()
            .map(|row| name(row).chars().count())
            .max()
            .unwrap_or(0)
            .max(least)
    };
    let (step, set) = (
        width(|row| &row.step, "step".len()),
        width(|row| &row.set, "set".len()),
    );
    let brought = rows.iter().filter(|row| row.is_brought()).count();
    let blocks = match brought {
        0 => "contiguous folds",
        some if some == rows.len() => "whole places",
        _ => "contiguous folds, whole places",
    };
    let mut text = format!(
        "training points, each under a fit without it (cross-validated), error in mm: random folds | {blocks}\n  \
         {:step$}  {:set$}  {:>8}  {:>8}  {:>8}  {:>8} | {:>8}  {:>8}  {:>8}\n",
        "step", "set", "mean", "max", "rms", "expected", "mean", "max", "rms"
    );
    let show = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
    for row in rows {
        text.push_str(&format!(
            "  {:step$}  {:set$}  {:>8}  {:>8}  {:>8}  {:>8} | {:>8}  {:>8}  {:>8}\n",
            row.step,
            row.set,
            show(row.fold_mean_mm),
            show(row.fold_max_mm),
            show(row.fold_rms_mm),
            show(row.fold_expected_mm),
            show(row.block_mean_mm),
            show(row.block_max_mm),
            show(row.block_rms_mm)
        ));
    }
    text + "\n"
}

/// Our figures beside those that the pipeline names; nothing where it names none.
fn references(rows: &[StatisticsRow]) -> String {
    let rows: Vec<(&str, &StatisticsRow)> = rows
        .iter()
        .filter_map(|row| Some((row.reference.as_deref()?, row)))
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let width = |names: &mut dyn Iterator<Item = &str>| {
        names.map(|name| name.chars().count()).max().unwrap_or(0)
    };
    let label = width(&mut rows.iter().map(|row| row.0)).max("reference".len());
    let step = width(&mut rows.iter().map(|row| row.1.step.as_str())).max("step".len());
    let set = width(&mut rows.iter().map(|row| row.1.set.as_str())).max("set".len());
    let mut text = format!(
        "beside reference figures, error in mm: ours | theirs\n  {:label$}  {:step$}  {:set$}  {:>17}  {:>17}  {:>17}\n",
        "reference", "step", "set", "mean", "std", "max"
    );
    let pair = |ours: f64, theirs: Option<f64>| match theirs {
        Some(theirs) => format!("{ours:>7.4} | {theirs:>7.4}"),
        None => format!("{ours:>7.4} | {:>7}", ""),
    };
    for (name, row) in rows {
        text.push_str(&format!(
            "  {name:label$}  {:step$}  {:set$}  {}  {}  {}\n",
            row.step,
            row.set,
            pair(row.mean_mm, row.reference_mean_mm),
            pair(row.std_mm, row.reference_std_mm),
            pair(row.max_mm, row.reference_max_mm)
        ));
    }
    text + "\n"
}

fn block(title: &str, rows: &[&StatisticsRow]) -> String {
    let width = |name: fn(&StatisticsRow) -> &str, least: usize| {
        rows.iter()
            .map(|row| name(row).chars().count())
            .max()
            .unwrap_or(0)
            .max(least)
    };
    let (step, set) = (
        width(|row| &row.step, "step".len()),
        width(|row| &row.set, "set".len()),
    );
    let mut text = format!(
        "{title}, error in mm\n  {:step$}  {:set$}  {:>6}  {:>8}  {:>8}  {:>8}  {:>8}  {:>8}  {:>8}\n",
        "step", "set", "points", "mean", "std", "p95", "max", "rms", "expected"
    );
    for row in rows {
        text.push_str(&format!(
            "  {:step$}  {:set$}  {:>6}  {:>8.4}  {:>8.4}  {:>8.4}  {:>8.4}  {:>8.4}  {:>8}\n",
            row.step,
            row.set,
            row.points,
            row.mean_mm,
            row.std_mm,
            row.p95_mm,
            row.max_mm,
            row.rms_mm,
            row.expected_rms_mm
                .map_or_else(String::new, |expected| format!("{expected:.4}"))
        ));
    }
    text + "\n"
}

/// Errors of every step and set, as JSON.
pub fn statistics_json(outcome: &CompletedRun, store: &Store) -> Result<serde_json::Value> {
    Ok(json!(rows(outcome, store)?))
}

/// How many rows of the raw files were rejected.
pub fn rejected_rows(manifest: &Manifest) -> u64 {
    manifest
        .tables(crate::table::Rejected::KIND)
        .map(|output| output.table.rows)
        .sum()
}

/// Nothing where nothing was rejected.
pub fn rejected(manifest: &Manifest) -> String {
    let line = |output: &crate::pipeline::OutputRecord| {
        let path = output.path.as_deref().unwrap_or_default();
        labelled(
            "rejected",
            &format!(
                "{}, each with its reason in {path}",
                counted(output.table.rows, "row")
            ),
        )
    };
    manifest
        .tables(crate::table::Rejected::KIND)
        .filter(|output| output.table.rows > 0)
        .map(line)
        .collect()
}

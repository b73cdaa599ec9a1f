//! The rivals of each learned correction as text and as JSON.

use super::tables;
use crate::error::Result;
use crate::pipeline::CompletedRun;
use crate::store::Store;
use crate::table::{Corrections, CorrectionsRow};
use serde_json::json;

fn rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<CorrectionsRow>> {
    Ok(tables::<Corrections>(outcome, store)?
        .into_iter()
        .flat_map(|table| table.0)
        .collect())
}

/// One line per rival, the kept one marked; nothing where nothing was learnt.
pub fn corrections(outcome: &CompletedRun, store: &Store) -> Result<String> {
    let rows = rows(outcome, store)?;
    if rows.is_empty() {
        return Ok(String::new());
    }
    let step = rows
        .iter()
        .map(|row| row.step.chars().count())
        .max()
        .unwrap_or(0)
        .max("step".len());
    let mut text = format!(
        "learned corrections, cross-validated on their own training rows (> kept), error in mm\n    \
         {:step$}  {:<16}  {:>8}  {:>8}  {:>8}  {:>7}  {:>11}  why\n",
        "step", "rival", "mean", "rms", "max", "numbers", "evaluations"
    );
    let show =
        |value: Option<f64>| value.map_or_else(|| "-".to_string(), |value| format!("{value:.4}"));
    for row in &rows {
        let settings = match (row.hidden, row.decay) {
            (Some(hidden), Some(decay)) => format!(" ({hidden} neurons, decay {decay})"),
            _ => String::new(),
        };
        text.push_str(&format!(
            "  {} {:step$}  {:<16}  {:>8}  {:>8}  {:>8}  {:>7}  {:>11}  {}{settings}\n",
            if row.chosen { ">" } else { " " },
            row.step,
            row.rival,
            show(row.mean_mm),
            show(row.rms_mm),
            show(row.max_mm),
            row.numbers,
            row.evaluations,
            row.reason
        ));
    }
    Ok(text + "\n")
}

/// Rivals of learned corrections, as JSON.
pub fn corrections_json(outcome: &CompletedRun, store: &Store) -> Result<serde_json::Value> {
    Ok(json!(rows(outcome, store)?))
}

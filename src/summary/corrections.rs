//! The rivals of each learned correction as text and as JSON.

use crate::error::Result;
use crate::pipeline::CompletedRun;
use crate::store::Store;
use crate::table::{Corrections, CorrectionsRow, Table};
use serde_json::json;

fn rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<CorrectionsRow>> {
    let mut rows = Vec::new();
    for output in outcome.tables(Corrections::KIND) {
        rows.extend(Corrections::from_frame(&store.load(&output.table)?)?.0);
    }
    Ok(rows)
}

/// One line per rival, the kept one marked; nothing where nothing was learnt.
pub fn corrections(outcome: &CompletedRun, store: &Store) -> Result<String> {
    let rows = rows(outcome, store)?;
    if rows.is_empty() {
        return Ok(String::new());
    }
    let step = rows.iter().map(|row| row.step.chars().count()).max().unwrap_or(0).max("step".len());
    let mut text = format!(
        "learned corrections, cross-validated on their own training rows (> kept), error in mm\n    \
         {:step$}  {:<16}  {:>8}  {:>8}  {:>8}  {:>7}  {:>11}  why\n",
        "step", "rival", "mean", "rms", "max", "numbers", "evaluations"
    );
    let show = |value: Option<f64>| value.map_or_else(|| "-".to_string(), |value| format!("{value:.4}"));
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
    let row = |row: CorrectionsRow| {
        json!({
            "step": row.step, "rival": row.rival, "chosen": row.chosen, "reason": row.reason, "before_mm": row.before_mm,
            "mean_mm": row.mean_mm, "rms_mm": row.rms_mm, "max_mm": row.max_mm, "gain_mm": row.gain_mm,
            "gain_sigma_mm": row.gain_sigma_mm, "numbers": row.numbers, "evaluations": row.evaluations,
            "hidden": row.hidden, "decay": row.decay,
        })
    };
    Ok(rows(outcome, store)?.into_iter().map(row).collect())
}

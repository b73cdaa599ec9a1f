//! The comparison of optimisers as text and as JSON.

use super::tables;
use crate::error::Result;
use crate::pipeline::CompletedRun;
use crate::store::Store;
use crate::table::{Searches, SearchesRow};
use serde_json::json;

fn rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<SearchesRow>> {
    Ok(tables::<Searches>(outcome, store)?
        .into_iter()
        .flat_map(|table| table.0)
        .collect())
}

/// One line per function and optimiser; nothing where nothing was searched.
pub fn searches(outcome: &CompletedRun, store: &Store) -> Result<String> {
    let rows = rows(outcome, store)?;
    if rows.is_empty() {
        return Ok(String::new());
    }
    let published = rows.iter().any(|row| row.reference_s.is_some());
    let mut text = format!(
        "searches for known minima: found and stuck of all seeds, evaluations to the target of those that found it\n  \
         {:<16}  {:<6}  {:>5}  {:>6}  {:>6}  {:>8}  {:>8}  {:>10}  {:>10}{}\n",
        "function",
        "method",
        "seeds",
        "found",
        "stuck",
        "median",
        "p90",
        "error p50",
        "error p90",
        if published { "  published time" } else { "" }
    );
    for row in &rows {
        let share =
            |count: i64| format!("{:.1}%", 100.0 * count as f64 / row.searches.max(1) as f64);
        let count = |value: Option<f64>| {
            value.map_or_else(|| "-".to_string(), |value| format!("{value:.0}"))
        };
        let error = |value: Option<f64>| {
            value.map_or_else(|| "-".to_string(), |value| format!("{value:.2e}"))
        };
        let time = match (&row.reference, row.reference_s) {
            (Some(label), Some(seconds)) => format!("  {label}: {seconds:.3} s"),
            _ => String::new(),
        };
        text.push_str(&format!(
            "  {:<16}  {:<6}  {:>5}  {:>6}  {:>6}  {:>8}  {:>8}  {:>10}  {:>10}{time}\n",
            format!("{} {}-D", row.function, row.dimensions),
            row.method,
            row.searches,
            share(row.found),
            share(row.stuck),
            count(row.evaluations_median),
            count(row.evaluations_p90),
            error(row.error_median),
            error(row.error_p90),
        ));
    }
    Ok(text + "\n")
}

/// Optimisers beside each other, as JSON.
pub fn searches_json(outcome: &CompletedRun, store: &Store) -> Result<serde_json::Value> {
    Ok(json!(rows(outcome, store)?))
}

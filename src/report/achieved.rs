//! The page of `calib verify-robot`: what the correction achieved at points that were measured after it.

use crate::error::Result;
use crate::language::Locale;
use crate::number::{count, render};
use crate::workspace::{StepErrors, histogram};
use serde_json::json;

/// What the page shows; lengths in mm.
pub struct AchievedTables<'a> {
    /// Heading.
    pub title: &'a str,
    /// Where the model is from.
    pub model: &'a str,
    /// Name, mean, 95th percentile, largest, and what they are of.
    pub rows: Vec<(&'static str, [f64; 3], String)>,
    /// Errors of the uncorrected targets, by the model, and of the measured points.
    pub errors: [Vec<f64>; 2],
    /// Cycles, accuracy and repeatability.
    pub poses: Vec<(usize, f64, f64)>,
    /// What to know of the figures, a sentence each.
    pub remarks: Vec<String>,
}

/// The page as one file that needs no other.
pub fn achieved_page(tables: &AchievedTables) -> Result<String> {
    let locale = Locale::default();
    let errors = tables
        .errors
        .iter()
        .zip([("before", "s0"), ("achieved", "s-last")])
        .map(|(lengths, (step, colour))| {
            let mut sorted_mm = lengths.clone();
            sorted_mm.sort_by(f64::total_cmp);
            let mean_mm = sorted_mm.iter().sum::<f64>() / sorted_mm.len().max(1) as f64;
            StepErrors {
                step: step.into(),
                colour: colour.into(),
                sorted_mm,
                mean_mm,
            }
        });
    let errors: Vec<StepErrors> = errors
        .filter(|errors| !errors.sorted_mm.is_empty())
        .collect();
    let page = json!({
        "title": tables.title,
        "model": tables.model,
        "points": count(tables.errors[1].len() as i64),
        "rows": &tables.rows,
        "remarks": &tables.remarks,
        "picture": histogram(&locale, &errors, "Histogram of the position error before and after correction"),
        "poses": (1..).zip(&tables.poses).collect::<Vec<(i64, _)>>(),
    });
    render(
        &locale,
        "achieved.html",
        include_str!("achieved.html"),
        page,
    )
}

//! The page of `calib verify-robot`: what the correction achieved at points that were measured after it.

use crate::error::Result;
use crate::language::{Locale, PageLanguage, say};
use crate::number::{count, render};
use crate::workspace::{StepErrors, histogram};
use serde_json::json;

/// What the page shows; lengths in mm.
pub struct AchievedTables<'a> {
    /// Where the model is from.
    pub model: &'a str,
    /// `before`, `predicted` or `achieved`: mean, 95th percentile, largest.
    pub rows: Vec<(&'static str, [f64; 3])>,
    /// Whether the tracker's place was found anew from these points.
    pub new_base: bool,
    /// Errors of the uncorrected targets, by the model, and of the measured points.
    pub errors: [Vec<f64>; 2],
    /// Cycles, accuracy and repeatability.
    pub poses: Vec<(usize, f64, f64)>,
    /// How many points are farther off than predicted; none where nothing was predicted.
    pub beyond: Option<usize>,
    /// Targets that had no correction.
    pub unreached: usize,
}

/// The page as one file that needs no other.
pub fn achieved_page(tables: &AchievedTables, language: PageLanguage) -> Result<String> {
    let locale = Locale::new(language);
    let errors = tables
        .errors
        .iter()
        .zip([
            (say!(locale, "before"), "s0"),
            (say!(locale, "achieved"), "s-last"),
        ])
        .map(|(lengths, (step, colour))| {
            let mut sorted_mm = lengths.clone();
            sorted_mm.sort_by(f64::total_cmp);
            let mean_mm = sorted_mm.iter().sum::<f64>() / sorted_mm.len().max(1) as f64;
            StepErrors {
                step,
                colour: colour.into(),
                sorted_mm,
                mean_mm,
            }
        });
    let errors: Vec<StepErrors> = errors
        .filter(|errors| !errors.sorted_mm.is_empty())
        .collect();
    let page = json!({
        "title": say!(locale, "Before, predicted and achieved"),
        "model": tables.model,
        "points": count(tables.errors[1].len() as i64),
        "rows": &tables.rows,
        "new_base": tables.new_base,
        "beyond": tables.beyond,
        "unreached": tables.unreached,
        "picture": histogram(&locale, &errors, &say!(locale, "Histogram of the position error before and after correction")),
        "poses": (1..).zip(&tables.poses).collect::<Vec<(i64, _)>>(),
    });
    render(
        &locale,
        "achieved.html",
        include_str!("achieved.html"),
        page,
    )
}

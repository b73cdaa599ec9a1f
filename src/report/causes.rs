//! The picture of the table of causes: findings and residual, by place and kind of variable.
//!
//! The page of a verification: errors before, predicted and achieved, and the poses that were repeated often enough for ISO 9283.

use super::number::{count, fixed, render, sentence_case, significant};
use super::workspace::{StepErrors, histogram};
use crate::error::Result;
use crate::table::{CauseGrid, CauseGridCell, Cells, Findings};
use serde_json::{Value, json};

/// Sizes (mm) from which a cell has the next colour.
const DECADES: [f64; 6] = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0];

/// What the macro `causes` of the page draws; none where nothing was asked.
pub(super) fn picture(cells: &Cells, findings: &Findings) -> Option<Value> {
    let grid = CauseGrid::of(cells, findings);
    let drawn = |cell: &Option<CauseGridCell>, is_found: bool| {
        let Some(cell) = cell else {
            return json!({ "class": "", "size": "", "name": "" });
        };
        let Some(mm) = cell
            .mm
            .or_else(|| (!cell.effects.is_empty()).then_some(0.0))
        else {
            return json!({ "class": "asked", "size": "\u{b7}", "name": "" });
        };
        let step = DECADES.iter().filter(|from| mm >= **from).count();
        let name = if is_found {
            cell.effects
                .iter()
                .map(|effect| effect.replace('_', " "))
                .collect::<Vec<_>>()
                .join(", ")
        } else {
            String::new()
        };
        json!({ "class": format!("size{step}{}", if is_found && !cell.is_named { " open" } else { "" }), "size": length(mm), "name": name })
    };
    let rows = grid.rows.iter().map(|row| {
        let of = |cells: &[Option<CauseGridCell>], is_found| {
            cells
                .iter()
                .map(|cell| drawn(cell, is_found))
                .collect::<Vec<_>>()
        };
        json!({ "place": row.place, "found": of(&row.found, true), "left": of(&row.left, false) })
    });
    let rows: Vec<Value> = rows.collect();
    (!rows.is_empty())
        .then(|| json!({ "columns": grid.columns, "rows": rows, "others": grid.others }))
}

/// A size in the unit in which it is short.
fn length(mm: f64) -> String {
    match mm {
        _ if mm >= 1.0 => format!("{} mm", significant(mm, 2)),
        _ => format!(
            "{} \u{b5}m",
            significant(1e3 * mm, if mm >= 0.01 { 2 } else { 1 })
        ),
    }
}

/// What a page of one diagnosis is made of.
pub struct DiagnosedTables<'a> {
    /// Head of the page.
    pub(crate) title: &'a str,
    /// The run and the stage.
    pub(crate) origin: [&'a str; 2],
    /// Whether the error comes down to the noise, and the verdict in a sentence.
    pub(crate) verdict: (bool, String),
    /// Name, mean, rms and largest error, mm.
    pub(crate) errors: Vec<[String; 4]>,
    /// The table of causes.
    pub(crate) cells: &'a Cells,
    /// What was found.
    pub(crate) findings: &'a Findings,
    /// What to measure next, a sentence each.
    pub(crate) next: Vec<String>,
}

/// A diagnosis as one file that needs no other.
pub fn diagnosed_page(tables: &DiagnosedTables) -> Result<String> {
    let findings = tables.findings.0.iter().map(|finding| {
        let chance = finding
            .probability
            .map(|probability| format!(", probability {probability:.2}"))
            .unwrap_or_default();
        [
            finding.statement.clone(),
            format!("{} at {}{chance}", finding.effect, finding.place),
        ]
    });
    let page = json!({
        "title": tables.title,
        "run": tables.origin[0],
        "step_id": tables.origin[1],
        "kind": if tables.verdict.0 { "better" } else { "open" },
        "sentence": sentence_case(&tables.verdict.1),
        "errors": tables.errors,
        "causes_found": picture(tables.cells, tables.findings),
        "findings": findings.collect::<Vec<_>>(),
        "next": tables.next,
    });
    render("diagnosed.html", include_str!("diagnosed.html"), page)
}

/// What the page shows; lengths in mm.
pub struct AchievedTables<'a> {
    /// Heading.
    pub(crate) title: &'a str,
    /// Where the model is from.
    pub(crate) model: &'a str,
    /// Name, mean, 95th percentile, largest, and what they are of.
    pub(crate) rows: Vec<(&'static str, [f64; 3], String)>,
    /// Errors of the uncorrected targets, by the model, and of the measured points.
    pub(crate) errors: [Vec<f64>; 2],
    /// Cycles, accuracy and repeatability.
    pub(crate) poses: Vec<(usize, f64, f64)>,
    /// What to know of the figures, a sentence each.
    pub(crate) remarks: Vec<String>,
}

/// The page as one file that needs no other.
pub fn achieved_page(tables: &AchievedTables) -> Result<String> {
    let mm = |length: f64| fixed(length, 4);
    let row = |(name, figures, what): &(&str, [f64; 3], String)| {
        let [mean, p95, max] = figures.map(mm);
        [format!("{name}: {what}"), mean, p95, max]
    };
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
    let poses = (1..)
        .zip(&tables.poses)
        .map(|(k, (cycles, accuracy, repeatability)): (i64, _)| {
            [
                k.to_string(),
                count(*cycles as i64),
                mm(*accuracy),
                mm(*repeatability),
            ]
        });
    let page = json!({
        "title": tables.title,
        "model": tables.model,
        "points": count(tables.errors[1].len() as i64),
        "rows": tables.rows.iter().map(row).collect::<Vec<_>>(),
        "remarks": &tables.remarks,
        "picture": histogram(&errors, "Histogram of the position error before and after correction"),
        "poses": poses.collect::<Vec<_>>(),
    });
    render("achieved.html", include_str!("achieved.html"), page)
}

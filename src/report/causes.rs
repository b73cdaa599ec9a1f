//! The picture of the table of causes: findings and residual, by place and kind of variable.

use super::language::Locale;
use super::number::render;
use crate::error::Result;
use crate::table::{CauseGrid, Cells, Findings, VerdictRow};
use serde_json::json;

/// What the macro `causes` of the page draws; none where nothing was asked.
pub(super) fn picture(cells: &Cells, findings: &Findings) -> Option<CauseGrid> {
    Some(CauseGrid::of(cells, findings)).filter(|grid| !grid.rows.is_empty())
}

/// A diagnosis as one file that needs no other; `origin` is the run, `next` what to measure next, a sentence each.
pub fn diagnosed_page(
    title: &str,
    origin: &str,
    verdict: &VerdictRow,
    (cells, findings): (&Cells, &Findings),
    next: &[String],
) -> Result<String> {
    let locale = Locale::default();
    let page = json!({
        "title": title,
        "run": origin,
        "verdict": verdict,
        "causes_found": picture(cells, findings),
        "findings": &findings.0,
        "next": next,
    });
    render(
        &locale,
        "diagnosed.html",
        include_str!("diagnosed.html"),
        page,
    )
}

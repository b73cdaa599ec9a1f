//! The picture of the table of causes: findings and residual, by place and kind of variable.

use super::language::Locale;
use super::number::render;
use crate::error::Result;
use crate::table::{CauseGrid, CauseGridCell, Cells, Findings, VerdictRow};
use serde_json::{Value, json};

/// Sizes (mm) from which a cell has the next colour.
const DECADES: [f64; 6] = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0];

/// What the macro `causes` of the page draws; none where nothing was asked.
pub(super) fn picture(locale: &Locale, cells: &Cells, findings: &Findings) -> Option<Value> {
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
        json!({ "class": format!("size{step}{}", if is_found && !cell.is_named { " open" } else { "" }), "size": length(locale, mm), "name": name })
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
fn length(locale: &Locale, mm: f64) -> String {
    match mm {
        _ if mm >= 1.0 => format!("{} mm", locale.significant(mm, 2)),
        _ => format!(
            "{} \u{b5}m",
            locale.significant(1e3 * mm, if mm >= 0.01 { 2 } else { 1 })
        ),
    }
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
        "causes_found": picture(&locale, cells, findings),
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

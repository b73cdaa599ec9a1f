//! How well the ball comes back to every socket, plane and sphere, before and after: a picture and a table.

use super::Tables;
use super::language::{Locale, say};
use super::svg::{Area, Scale, Svg, baseline, name_x};
use crate::table::{Labelled, Prediction, PredictionRow};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// What one fixture has: mean and largest distance, mm.
#[derive(Serialize)]
struct FixtureFigures {
    name: String,
    count: usize,
    before: [f64; 2],
    after: [f64; 2],
}

const WIDTH: f64 = 640.0;
const LEFT: f64 = 150.0;
/// Height of a fixture's two bars.
const ROW: f64 = 20.0;
/// Fixtures in the picture; the table has all.
const MOST: usize = 40;

/// Nothing where no row is a contact, or nothing was predicted.
pub(super) fn section(locale: &Locale, tables: &Tables) -> Option<Value> {
    let all = closings(tables)?;
    let name = |table: Option<&Labelled<Prediction>>| {
        table
            .and_then(|table| table.0.first())
            .map(|row| row.step.clone())
    };
    Some(json!({
        "before": name(tables.prediction.first())?,
        "after": name(standing(tables))?,
        "picture": picture(locale, &all[..all.len().min(MOST)]),
        "rows": &all,
        // Fixtures beyond those of the picture.
        "more": all.len().saturating_sub(MOST),
    }))
}

fn standing(tables: &Tables) -> Option<&Labelled<Prediction>> {
    let named = |table: &&Labelled<Prediction>| {
        table.0.first().map(|row| row.step.as_str()) == tables.standing.as_deref()
    };
    tables
        .prediction
        .iter()
        .rev()
        .find(named)
        .or(tables.prediction.last())
}

/// By the order of names, which is that of the recording's table.
fn closings(tables: &Tables) -> Option<Vec<FixtureFigures>> {
    let (first, last) = (tables.prediction.first()?, standing(tables)?);
    let mut rows: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for row in 0..tables.recording.rows() {
        if let Some(name) = tables.recording.contact(row) {
            rows.entry(name).or_default().push(row);
        }
    }
    let figures = |table: &Prediction, rows: &[usize]| -> [f64; 2] {
        let errors: Vec<f64> = rows
            .iter()
            .filter_map(|row| table.0.get(*row))
            .map(|row: &PredictionRow| row.error_mm)
            .collect();
        [
            errors.iter().sum::<f64>() / errors.len().max(1) as f64,
            errors.iter().copied().fold(0.0, f64::max),
        ]
    };
    let all: Vec<FixtureFigures> = rows
        .into_iter()
        .map(|(name, rows)| FixtureFigures {
            name: name.into(),
            count: rows.len(),
            before: figures(first, &rows),
            after: figures(last, &rows),
        })
        .collect();
    (!all.is_empty()).then_some(all)
}

fn picture(locale: &Locale, all: &[FixtureFigures]) -> String {
    let area = Area::new([LEFT, 8.0, WIDTH - 12.0, 8.0 + ROW * all.len() as f64]);
    let means = || {
        all.iter()
            .flat_map(|own| [own.before[0], own.after[0]])
            .filter(|mean| *mean > 0.0)
    };
    let (lower, upper) = (
        means().fold(f64::INFINITY, f64::min),
        means().fold(0.0, f64::max),
    );
    let scale = Scale::positive(0.5 * lower.min(upper), upper).over(area.left, area.right);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    scale.grid_x(&mut svg, area, 7);
    for (k, own) in all.iter().enumerate() {
        let top = area.top + ROW * k as f64;
        svg.name("tick end", [area.left - 6.0, top + 0.7 * ROW], &own.name);
        for (bar, (mean, colour)) in [(own.before[0], "s0"), (own.after[0], "s-last")]
            .into_iter()
            .enumerate()
        {
            let width = (scale.at(mean.max(0.5 * lower.min(upper))) - area.left).max(0.8);
            svg.rect(
                &format!("fill {colour}"),
                [area.left, top + 2.0 + 8.0 * bar as f64],
                [width, 7.0],
            );
        }
    }
    baseline(&mut svg, area);
    name_x(
        &mut svg,
        area,
        &say!(locale, "mean distance of the ball from where it lay, mm"),
    );
    svg.finish(&say!(locale, "Closure by fixture, before and after"))
}

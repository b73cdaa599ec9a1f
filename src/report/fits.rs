//! How the fits went: convergence, what the data could see, training.
//!
//! Rivals of learned corrections.

use super::Tables;
use super::charts::{Line, course, spectrum};
use super::errors::Steps;
use super::language::{Locale, say};
use crate::table::{CorrectionsRow, FitRow, ObservabilityRow, TrainingRow};
use serde_json::{Value, json};

pub(super) fn section(locale: &Locale, tables: &Tables, steps: &Steps) -> Value {
    let fits = groups(tables.fit.iter().flat_map(|t| &t.0), |row: &FitRow| {
        row.step.clone()
    });
    let lines: Vec<Line> = fits
        .iter()
        .map(|(step, rows)| Line {
            colour: steps.colour_of(step),
            points: rows
                .iter()
                .map(|row| [row.iteration as f64, row.rms_mm])
                .collect(),
        })
        .collect();
    let courses = tables.training.iter().flat_map(|t| &t.0);
    let trainings = groups(courses, |row: &TrainingRow| {
        (row.step.clone(), row.phase.clone())
    });
    let seen = groups(
        tables.observability.iter().flat_map(|t| &t.0),
        |row: &ObservabilityRow| row.step.clone(),
    );
    json!({
        "courses": (!lines.is_empty())
            .then(|| course(locale, &lines, &say!(locale, "iteration"), &say!(locale, "rms over the rows of the fit, mm"), &say!(locale, "Convergence of the fits"))),
        "legend": fits.iter().map(|(step, _)| (steps.colour_of(step), step.clone())).collect::<Vec<_>>(),
        "fits": fits.iter().filter_map(|(_, rows)| rows.last()).collect::<Vec<_>>(),
        "seen": seen.into_iter().map(|(step, rows)| see(locale, step, &rows)).collect::<Vec<_>>(),
        "trainings": trainings.into_iter().filter_map(|((step, phase), rows)| training(locale, step, phase, &rows)).collect::<Vec<_>>(),
    })
}

/// Rows by a key, in the order in which the keys first come.
fn groups<'a, R, K: PartialEq>(
    rows: impl Iterator<Item = &'a R>,
    key: impl Fn(&R) -> K,
) -> Vec<(K, Vec<&'a R>)> {
    let mut groups: Vec<(K, Vec<&R>)> = Vec::new();
    for row in rows {
        let key = key(row);
        match groups.iter_mut().find(|group| group.0 == key) {
            Some(group) => group.1.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    groups
}

fn see(locale: &Locale, step: String, rows: &[&ObservabilityRow]) -> Value {
    let values: Vec<(i64, f64)> = rows
        .iter()
        .filter(|row| row.quantity == "singular_value")
        .map(|row| (row.index, row.value))
        .collect();
    let meaning = rows
        .iter()
        .find(|row| row.quantity == "singular_value")
        .map_or("", |row| &row.meaning);
    let others = rows.iter().filter(|row| row.quantity != "singular_value");
    json!({
        "spectrum": (!values.is_empty()).then(|| spectrum(locale, &values, &say!(locale, "Singular values of the step {step}", step))),
        // What the singular values are of.
        "meaning": meaning,
        "quantities": others.collect::<Vec<_>>(),
        "step": step,
    })
}

fn training(locale: &Locale, step: String, phase: String, rows: &[&TrainingRow]) -> Option<Value> {
    let last = rows.last()?;
    let line = |colour: &str, value: fn(&TrainingRow) -> Option<f64>| Line {
        colour: colour.into(),
        points: rows
            .iter()
            .filter_map(|row| Some([row.generation as f64, value(row)?]))
            .collect(),
    };
    let lines: Vec<Line> = [
        line("train", |row| Some(row.train_rms_mm)),
        line("check", |row| row.check_rms_mm),
    ]
    .into_iter()
    .filter(|line| !line.points.is_empty())
    .collect();
    let [x, y] = [
        say!(locale, "generation"),
        say!(locale, "rms of the position error, mm"),
    ];
    let title = say!(locale, "Training of {step}, {phase}", step, phase);
    Some(json!({ "svg": course(locale, &lines, &x, &y, &title), "last": last }))
}

/// The comparisons in pipeline order; stages that had too few rows compared nothing.
pub(super) fn comparisons(tables: &Tables) -> Vec<&Vec<CorrectionsRow>> {
    let rows = tables.corrections.iter().map(|table| &table.0);
    rows.filter(|rows| !rows.is_empty()).collect()
}

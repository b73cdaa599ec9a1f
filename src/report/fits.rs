//! How the fits went: convergence, what the data could see, training.
//!
//! How the rivals of a learned correction did, and why one was kept or none.

use super::Tables;
use super::errors::Steps;
use super::number::{count, mm, signed, significant};
use super::svg::{Line, course, spectrum};
use crate::table::{CorrectionsRow, FitRow, ObservabilityRow, TrainingRow};
use serde_json::{Value, json};

pub(super) fn section(tables: &Tables, steps: &Steps) -> Value {
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
    // The networks of an ensemble differ by chance alone: the swarm and the first of them tell how training went.
    let courses = tables
        .training
        .iter()
        .flat_map(|t| &t.0)
        .filter(|row| row.member <= 1);
    let trainings = groups(courses, |row: &TrainingRow| {
        (row.step.clone(), row.phase.clone())
    });
    let seen = groups(
        tables.observability.iter().flat_map(|t| &t.0),
        |row: &ObservabilityRow| row.step.clone(),
    );
    json!({
        "courses": (!lines.is_empty())
            .then(|| course(&lines, "iteration", "rms over the rows of the fit, mm", "Convergence of the fits")),
        "legend": fits.iter().map(|(step, _)| (steps.colour_of(step), step.clone())).collect::<Vec<_>>(),
        "fits": fits.iter().filter_map(|(_, rows)| rows.last()).collect::<Vec<_>>(),
        "seen": seen.into_iter().map(|(step, rows)| see(step, &rows)).collect::<Vec<_>>(),
        "trainings": trainings.into_iter().filter_map(|((step, phase), rows)| training(step, phase, &rows)).collect::<Vec<_>>(),
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

fn see(step: String, rows: &[&ObservabilityRow]) -> Value {
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
        "spectrum": (!values.is_empty()).then(|| spectrum(&values, &format!("Singular values of the step {step}"))),
        // What the singular values are of.
        "meaning": meaning,
        // Quantity, value, meaning.
        "quantities": others
            .map(|row| {
                let whole = row.value.fract() == 0.0 && row.value.abs() < 1e6;
                let value = if whole { count(row.value as i64) } else { significant(row.value, 4) };
                let name = if row.index == 0 { row.quantity.clone() } else { format!("{} {}", row.quantity, row.index) };
                (name, value, row.meaning.clone())
            })
            .collect::<Vec<_>>(),
        "step": step,
    })
}

fn training(step: String, phase: String, rows: &[&TrainingRow]) -> Option<Value> {
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
    Some(json!({
        "svg": course(&lines, "generation", "rms of the position error, mm", &format!("Training of {step}, {phase}")),
        "last": count(last.generation),
        "evaluations": count(last.evaluations),
        "train": mm(last.train_rms_mm),
        "check": last.check_rms_mm.map(mm),
        "step": step,
        "phase": phase,
    }))
}

/// The comparisons in pipeline order; stages that had too few rows compared nothing.
pub(super) fn comparisons(tables: &Tables) -> Vec<Value> {
    tables
        .corrections
        .iter()
        .filter_map(|table| comparison(&table.0))
        .collect()
}

fn comparison(rows: &[CorrectionsRow]) -> Option<Value> {
    let first = rows.first()?;
    let chosen = rows.iter().find(|row| row.chosen).unwrap_or(first);
    let error = |value: Option<f64>| value.map_or_else(String::new, mm);
    let sentence = if chosen.rival == "none" {
        format!("no correction was kept: {}.", chosen.reason)
    } else {
        let (before, after) = (mm(chosen.before_mm), error(chosen.mean_mm));
        format!(
            "kept is {}; the mean error falls from {before} to {after} mm on rows that it did not see.",
            words(&chosen.rival)
        )
    };
    let view = |row: &CorrectionsRow| {
        let gain = row
            .gain_mm
            .zip(row.gain_sigma_mm)
            .filter(|_| row.rival != "none");
        let gain = gain.map(|(gain, sigma)| format!("{} \u{b1} {}", signed(gain, 3), mm(sigma)));
        let settings = row.hidden.zip(row.decay);
        let settings = settings.map(|(hidden, decay)| format!("{hidden} neurons, decay {decay}"));
        let mut shown = json!(row);
        shown["name"] = words(&row.rival).into();
        shown["gain"] = gain.unwrap_or_default().into();
        shown["settings"] = settings.into();
        shown
    };
    Some(
        json!({ "step": first.step, "sentence": sentence, "rows": rows.iter().map(view).collect::<Vec<_>>() }),
    )
}

/// A rival's name in words; names that are not known stay.
fn words(rival: &str) -> String {
    match rival {
        "none" => "no correction".into(),
        "ridge" => "ridge on harmonics".into(),
        "gaussian_process" => "Gaussian process".into(),
        "curves" => "joint curves".into(),
        "mlp_random" => "network, started at random".into(),
        _ => match (
            rival.strip_prefix("mlp_joints_"),
            rival.strip_prefix("mlp_"),
        ) {
            (Some("random"), _) => "joint network, started at random".into(),
            (Some(start), _) => format!("joint network, started by {}", start.to_uppercase()),
            (None, Some(start)) => format!("network, started by {}", start.to_uppercase()),
            (None, None) => rival.into(),
        },
    }
}

//! How the fits went: convergence, what the data could see, training.
//!
//! How the rivals of a learned correction did, and why one was kept or none.

use super::Tables;
use super::errors::Steps;
use super::language::{Locale, say};
use super::number::count;
use super::svg::{Line, course, spectrum};
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
        // Quantity, value, meaning.
        "quantities": others
            .map(|row| {
                let whole = row.value.fract() == 0.0 && row.value.abs() < 1e6;
                let value = if whole { count(row.value as i64) } else { locale.significant(row.value, 4) };
                let name = if row.index == 0 { row.quantity.clone() } else { format!("{} {}", row.quantity, row.index) };
                (name, value, locale.stored(&row.meaning))
            })
            .collect::<Vec<_>>(),
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
    let (to, evaluations) = (count(last.generation), count(last.evaluations));
    let train = locale.mm(last.train_rms_mm);
    let sentence = match last.check_rms_mm.map(|rms| locale.mm(rms)) {
        Some(check) => say!(
            locale,
            "{step}, {phase}: to generation {to}, {evaluations} evaluations; at the end {train} mm rms on training rows, {check} mm on rows kept back.",
            step,
            phase,
            to,
            evaluations,
            train,
            check
        ),
        None => say!(
            locale,
            "{step}, {phase}: to generation {to}, {evaluations} evaluations; at the end {train} mm rms on training rows.",
            step,
            phase,
            to,
            evaluations,
            train
        ),
    };
    let [x, y] = [
        say!(locale, "generation"),
        say!(locale, "rms of the position error, mm"),
    ];
    let title = say!(locale, "Training of {step}, {phase}", step, phase);
    Some(json!({ "svg": course(locale, &lines, &x, &y, &title), "sentence": sentence }))
}

/// The comparisons in pipeline order; stages that had too few rows compared nothing.
pub(super) fn comparisons(locale: &Locale, tables: &Tables) -> Vec<Value> {
    tables
        .corrections
        .iter()
        .filter_map(|table| comparison(locale, &table.0))
        .collect()
}

fn comparison(locale: &Locale, rows: &[CorrectionsRow]) -> Option<Value> {
    let first = rows.first()?;
    let chosen = rows.iter().find(|row| row.chosen).unwrap_or(first);
    let sentence = if chosen.rival == "none" {
        let reason = locale.stored(&chosen.reason);
        say!(locale, "no correction was kept: {reason}.", reason)
    } else {
        let rival = words(locale, &chosen.rival);
        let before = locale.mm(chosen.before_mm);
        let after = chosen
            .mean_mm
            .map_or_else(String::new, |mean| locale.mm(mean));
        say!(
            locale,
            "kept is {rival}; the mean error falls from {before} to {after} mm on rows that it did not see.",
            rival,
            before,
            after
        )
    };
    let view = |row: &CorrectionsRow| {
        let gain = row
            .gain_mm
            .zip(row.gain_sigma_mm)
            .filter(|_| row.rival != "none");
        let gain = gain
            .map(|(gain, sigma)| format!("{} \u{b1} {}", locale.signed(gain, 3), locale.mm(sigma)));
        let settings = row.hidden.zip(row.decay);
        let settings = settings.map(|(hidden, decay)| {
            let decay = locale.decimal(decay.to_string());
            say!(locale, "{hidden} neurons, decay {decay}", hidden, decay)
        });
        let mut shown = json!(row);
        shown["name"] = words(locale, &row.rival).into();
        shown["gain"] = gain.unwrap_or_default().into();
        shown["settings"] = settings.into();
        shown
    };
    Some(
        json!({ "step": first.step, "sentence": sentence, "rows": rows.iter().map(view).collect::<Vec<_>>() }),
    )
}

/// A rival's name in words; names that are not known stay.
fn words(locale: &Locale, rival: &str) -> String {
    match rival {
        "none" => say!(locale, "no correction"),
        "ridge" => say!(locale, "ridge on harmonics"),
        "gaussian_process" => say!(locale, "Gaussian process"),
        "curves" => say!(locale, "joint curves"),
        "mlp_random" => say!(locale, "network, started at random"),
        _ => match (
            rival.strip_prefix("mlp_joints_"),
            rival.strip_prefix("mlp_").map(str::to_uppercase),
        ) {
            (Some("random"), _) => say!(locale, "joint network, started at random"),
            (Some(start), _) => {
                say!(
                    locale,
                    "joint network, started by {start}",
                    start = start.to_uppercase()
                )
            }
            (None, Some(start)) => say!(locale, "network, started by {start}", start),
            (None, None) => rival.into(),
        },
    }
}

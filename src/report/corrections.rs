//! How the rivals of a learned correction did, and why one was kept or none.

use super::Tables;
use super::number::{mm, signed};
use crate::table::CorrectionsRow;
use serde_json::{Value, json};

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

//! `calib verify-robot`: what compensation achieved, from points that were measured at corrected targets.

use super::pipeline_arguments::{ModelArguments, language_parser};
use super::{emit_json, emit_lines, readable, write};
use crate::api::usual_options;
use crate::compensate::{CorrectionOptions, Corrector};
use crate::error::{Error, Result, counted};
use crate::identified::{Achieved, achieved};
use crate::pipeline::Purpose;
use crate::raw;
use crate::report::{AchievedTables, PageLanguage, achieved_page};
use crate::robot::{Measurements, NoiseBasis, RobotModel};
use crate::summary::labelled;
use crate::targets::{Layout, Units, measured};
use clap::Args;
use serde_json::json;
use std::ffi::OsString;
use std::path::PathBuf;

/// Say what compensation achieved: before, predicted and achieved errors of points that were measured at corrected targets.
///
/// The table holds the targets as they were before correction, in the columns that `calib compensate` knows (q1_deg ..., payload_kg, dir1),
/// and in x_mm, y_mm, z_mm what the tracker measured when the robot was sent to the corrected ones. The wanted point of a row is the one that
/// the nominal robot reaches with its target. Where the same target stands 30 times or more, accuracy and repeatability of that pose are
/// those of ISO 9283; no other figure is.
#[derive(Args)]
#[command(after_help = "Examples:
  calib verify-robot cell7/pipeline.yaml second.csv
  calib verify-robot cell7/pipeline.yaml second.csv --html verified.html
  calib verify-robot cell7/pipeline.yaml second.csv --html nachweis.html --language de
  calib verify-robot latest second.csv --new-base --json")]
pub(super) struct VerifyRobotArguments {
    #[command(flatten)]
    model: ModelArguments,
    /// Targets before correction with the points measured after it: delimited text
    #[arg(value_name = "SECOND")]
    second: PathBuf,
    /// Finds the tracker's place anew from these points: it was moved since the model was identified
    #[arg(long)]
    new_base: bool,
    /// kg at the tool, of targets without a column `payload_kg`
    #[arg(long, value_name = "KG")]
    payload: Option<f64>,
    /// Writes the figures and their picture as one HTML page, too
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Language of that page
    #[arg(long, value_name = "LANGUAGE", default_value = "en", requires = "html", value_parser = language_parser())]
    language: PageLanguage,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl VerifyRobotArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let place = self.second.display().to_string();
        let text = readable(&self.second, raw::text(&self.second))?;
        let identified = self.model.load(Purpose::Compensate, command_line)?;
        let arm = identified.arm();
        // As `compensate`: what depends on load is not predicted without one.
        let unstated = || identified.needed_load(&arm);
        let load = self.payload.is_none().then(unstated).flatten();
        let layout = Layout {
            place: &place,
            robot: &identified.robot,
            units: Units::default(),
            plain: false,
            cartesian: false,
            load,
            force: true,
        };
        let rows = measured(&text, &layout)?;
        if rows.is_empty() {
            return Err(Error::data(&place, "has no row below its header"));
        }
        let nominal = RobotModel::new(identified.robot.clone());
        let options = CorrectionOptions {
            payload: self.payload.unwrap_or(0.0),
            ..usual_options(&identified)
        };
        let mut corrector = Corrector::new(
            &arm,
            identified.coverage(),
            identified.uncertainty(&arm),
            options,
        );
        let noise = identified.data.as_ref().map_or(0.0, instrument_noise);
        let found = achieved(&arm, &nominal, &mut corrector, &rows, self.new_base, noise)?;
        if let Some(path) = &self.html {
            write(
                path,
                &page(&identified.origin, &found, self.new_base, self.language)?,
            )?;
        }
        if self.json {
            return emit_json(&document(&identified.origin, &found));
        }
        emit_lines(&report_text(&identified.origin, &found, self.new_base))
    }
}

/// Rms length of the noise of the points that the model was identified by, m; 0 where it is not known.
fn instrument_noise(data: &Measurements) -> f64 {
    if data.noise_basis == NoiseBasis::Inferred {
        return 0.0;
    }
    let rows = (0..data.rows()).filter(|row| data.has_point(*row));
    let squares: Vec<f64> = rows.map(|row| data.noise(row).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Mean, 95th percentile and largest, mm.
fn figures(lengths: &[f64]) -> [f64; 3] {
    let mut sorted = lengths.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mean = sorted.iter().sum::<f64>() / sorted.len().max(1) as f64;
    [
        mean,
        crate::statistics::quantile(&sorted, 0.95).unwrap_or_default(),
        sorted.last().copied().unwrap_or_default(),
    ]
    .map(|length| length * 1e3)
}

/// Before, predicted and achieved: name, mean, 95th percentile and largest, mm, and what they are of.
fn rows(found: &Achieved, new_base: bool) -> Vec<(&'static str, [f64; 3], String)> {
    let base = if new_base {
        ", the tracker's place found anew"
    } else {
        ""
    };
    let achieved = format!("measured, {}{base}", counted(found.achieved.len(), "point"));
    let before = "of the uncorrected targets, by the model".to_string();
    let predicted =
        "within which 95 % of corrected targets were to be measured, noise included".to_string();
    let all = [
        ("before", &found.before, before),
        ("predicted", &found.predicted, predicted),
        ("achieved", &found.achieved, achieved),
    ];
    let filled = all
        .into_iter()
        .filter(|(_, lengths, _)| !lengths.is_empty());
    filled
        .map(|(name, lengths, what)| (name, figures(lengths), what))
        .collect()
}

/// How many points are farther off than predicted; none where nothing was predicted.
fn beyond(found: &Achieved) -> Option<usize> {
    let pairs = found.achieved.iter().zip(&found.predicted);
    let beyond = pairs
        .filter(|(achieved, predicted)| achieved > predicted)
        .count();
    (!found.predicted.is_empty()).then_some(beyond)
}

/// Targets without a correction; none where all have one.
fn unreached(found: &Achieved) -> Option<String> {
    let targets = counted(found.unreached, "target");
    let line = || format!("{targets} cannot be reached by the model and had no correction");
    (found.unreached > 0).then(line)
}

fn page(origin: &str, found: &Achieved, new_base: bool, language: PageLanguage) -> Result<String> {
    let mm = |lengths: &[f64]| lengths.iter().map(|length| 1e3 * length).collect();
    let poses = found.poses.iter();
    let poses = poses.map(|pose| (pose.cycles, 1e3 * pose.accuracy, 1e3 * pose.repeatability));
    let rows = rows(found, new_base).into_iter();
    let tables = AchievedTables {
        model: origin,
        rows: rows.map(|(name, figures, _)| (name, figures)).collect(),
        new_base,
        errors: [mm(&found.before), mm(&found.achieved)],
        poses: poses.collect(),
        beyond: beyond(found),
        unreached: found.unreached,
    };
    achieved_page(&tables, language)
}

fn report_text(origin: &str, found: &Achieved, new_base: bool) -> String {
    let mut text = labelled("model", origin);
    for (label, [mean, p95, max], what) in rows(found, new_base) {
        let figures = format!("mean {mean:.4} mm, 95 % within {p95:.4} mm, max {max:.4} mm {what}");
        text += &labelled(label, &figures);
    }
    text.extend(beyond(found).map(|beyond| {
        let all = found.achieved.len();
        let line = format!("{beyond} of {all} points are farther off than predicted");
        labelled("", &line)
    }));
    text.extend(unreached(found).map(|line| labelled("warning", &line)));
    for (k, pose) in (1..).zip(&found.poses) {
        let (accuracy, repeatability) = (1e3 * pose.accuracy, 1e3 * pose.repeatability);
        let cycles = pose.cycles;
        let line = format!(
            "pose {k}, {cycles} cycles: accuracy AP {accuracy:.4} mm, repeatability RP {repeatability:.4} mm"
        );
        text += &labelled("ISO 9283", &line);
    }
    text
}

fn document(origin: &str, found: &Achieved) -> serde_json::Value {
    let of_lengths = |lengths: &[f64]| {
        let [mean, p95, max] = figures(lengths);
        json!({ "mean_mm": mean, "p95_mm": p95, "max_mm": max })
    };
    let poses = found.poses.iter().map(|pose| {
        json!({ "cycles": pose.cycles, "accuracy_ap_mm": 1e3 * pose.accuracy, "repeatability_rp_mm": 1e3 * pose.repeatability })
    });
    json!({
        "model": origin, "points": found.achieved.len(), "before": of_lengths(&found.before),
        "predicted_u95": if found.predicted.is_empty() { serde_json::Value::Null } else { of_lengths(&found.predicted) },
        "achieved": of_lengths(&found.achieved), "unreached": found.unreached, "iso_9283": poses.collect::<Vec<_>>(),
    })
}

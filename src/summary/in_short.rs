//! A run in the few lines that matter: the error before and after, the noise, the verdict, the findings.

use super::statistics::rows;
use super::{Diagnosed, labelled};
use crate::error::{Result, counted};
use crate::pipeline::CompletedRun;
use crate::stage::{DIAGNOSES, Stage, Transfer};
use crate::store::Store;
use crate::table::{Standing, StatisticsRow};

/// The errors at the largest set that the step which stands was not fitted to, else at the one that it was fitted to; nothing where no
/// stage stated errors or diagnosed; where a model is carried to another recording, what it does there. A `wrong` set-up is stated alone.
pub fn in_short(
    outcome: &CompletedRun,
    standing: Option<&Standing>,
    wrong: Option<&str>,
    store: &Store,
) -> Result<Option<String>> {
    if let Some(wrong) = wrong {
        return Ok(Some(labelled("verdict", &format!("not accepted: {wrong}"))));
    }
    let rows = rows(outcome, store)?;
    let last = || rows.iter().max_by_key(|row| row.order).map(|row| row.step.as_str());
    let ran = |name: &str| outcome.manifest.stages.iter().rfind(|stage| stage.uses == name && !stage.outputs.is_empty());
    // What a model does elsewhere is what a carried one is asked for; its sets may bear the names of those that it was fitted to.
    let carried = ran(Transfer::NAME).filter(|stage| rows.iter().any(|row| row.step == stage.id));
    let stands = || standing.map(|stands| stands.step.as_str()).or_else(last);
    let diagnosed = || -> Result<String> {
        let Some(stage) = DIAGNOSES.iter().find_map(|name| ran(name)) else { return Ok(String::new()) };
        let told = Diagnosed::read(&outcome.manifest.run_id, stage, store)?;
        let findings = told.strongest().map_or_else(String::new, |findings| labelled("findings", &findings));
        Ok(labelled("verdict", &told.verdict()) + &findings)
    };
    let Some(step) = carried.map(|stage| stage.id.as_str()).or_else(stands) else {
        return Ok(Some(diagnosed()?).filter(|text| !text.is_empty()));
    };
    let own = rows.iter().filter(|row| row.step == step);
    let Some(after) = own.max_by_key(|row| (row.held_out, row.points)) else { return Ok(None) };
    let earlier = rows.iter().filter(|row| carried.is_none() && row.set == after.set && row.order < after.order);
    let before = earlier.min_by_key(|row| (row.order, row.held_out != after.held_out));
    let mut text = before.map_or_else(String::new, |row| labelled("before", &error(row)));
    text.push_str(&labelled(if carried.is_some() { "carried" } else { "after" }, &error(after)));
    text.push_str(&after.doubts().map_or_else(String::new, |line| labelled("doubtful", &line)));
    text.push_str(&labelled("noise", &noise(after)));
    for warning in carried.iter().flat_map(|stage| &stage.warnings) {
        text.push_str(&labelled("warning", warning));
    }
    for warning in standing.iter().flat_map(|stands| stands.warnings()) {
        text.push_str(&labelled("warning", &warning));
    }
    if let Some(standing) = standing.filter(|stands| !stands.withdrawn.is_empty()) {
        text.push_str(&labelled("", &format!("`calib compensate` and `calib export` take the step `{}`", standing.model)));
    }
    text.push_str(&diagnosed()?);
    Ok(Some(text))
}

fn error(row: &StatisticsRow) -> String {
    let rows = match row.held_out {
        true => format!("{} of set {}", counted(row.points as usize, "held-out point"), row.set),
        false => format!("{} of set {}, to which it was fitted: flattered", counted(row.points as usize, "point"), row.set),
    };
    let without = row.mean_without_mm.zip(row.max_without_mm).map_or_else(String::new, |(mean, max)| {
        format!("; mean {mean:.4} mm, max {max:.4} mm without {}", counted(row.suspects as usize, "suspect"))
    });
    format!("mean {:.4} mm, max {:.4} mm after `{}`, {rows}{without}", row.mean_mm, row.max_mm, row.step)
}

fn noise(row: &StatisticsRow) -> String {
    if row.is_inferred() {
        return format!(
            "not known: none is recorded, and no `instrument` is stated in `ingest`; points are weighted by an assumed {:.4} mm rms",
            row.noise_rms_mm
        );
    }
    let basis = match row.noise_basis.as_deref() {
        Some("repeats") => ", by repeated measurements",
        Some(_) => ", by the instrument's statement",
        None => "",
    };
    format!("{:.4} mm rms is expected of these measurements alone{basis}", row.noise_rms_mm)
}

//! A run in ten lines: what was measured, the error before and after, what was found, the verdict, what is in doubt, one next step.

use super::estimate::length;
use super::statistics::statistics_rows;
use super::{DiagnosisSummary, labelled, screen, tables};
use crate::error::{Result, counted};
use crate::pipeline::CompletedRun;
use crate::stage::{DIAGNOSES, DeclaredStage, Transfer};
use crate::store::Store;
use crate::table::{Contradicted, Robot, Standing, StatisticsRow, Withdrawn};
use screen::NextStep;

/// How a result is printed.
#[derive(Debug, Clone, Copy, Default)]
pub struct ResultScreen<'a> {
    /// The `--store` of the commands that are proposed.
    pub store: &'a str,
    /// Columns of the terminal, where there is one.
    pub columns: Option<usize>,
}

/// The errors at the largest set that the step which stands was not fitted to, else at the one that it was fitted to; nothing where no
/// stage stated errors or diagnosed; where a model is carried to another recording, what it does there. A `wrong` set-up is stated alone.
pub fn in_short(
    outcome: &CompletedRun,
    standing: Option<&Standing>,
    wrong: Option<&str>,
    store: &Store,
    on: ResultScreen,
) -> Result<Option<String>> {
    let width = screen::width(on.columns);
    let rows = statistics_rows(outcome, store)?;
    let ran = |name: &str| {
        outcome
            .manifest
            .stages
            .iter()
            .rfind(|stage| stage.uses == name && !stage.outputs.is_empty())
    };
    let diagnosed = DIAGNOSES.iter().find_map(|name| ran(name));
    let diagnosed = diagnosed
        .map(|stage| DiagnosisSummary::read(&outcome.manifest.run_id, stage, store))
        .transpose()?;
    if let Some(wrong) = wrong {
        let verdict =
            diagnosed.map_or_else(|| "wrong set-up".into(), |diagnosis| diagnosis.verdict());
        return Ok(Some(
            labelled("verdict", &verdict)
                + &screen::sentence("", wrong.trim_start_matches("the set-up is wrong: "), width),
        ));
    }
    // What a model does elsewhere is what a carried one is asked for; its sets may bear the names of those that it was fitted to.
    let carried = ran(Transfer::NAME).filter(|stage| rows.iter().any(|row| row.step == stage.id));
    let last = || {
        rows.iter()
            .max_by_key(|row| row.order)
            .map(|row| row.step.as_str())
    };
    let stands = || standing.map(|stands| stands.step.as_str()).or_else(last);
    let step = carried.map(|stage| stage.id.as_str()).or_else(stands);
    let own = || rows.iter().filter(|row| Some(row.step.as_str()) == step);
    let Some(after) = own().max_by_key(|row| (row.held_out, row.points)) else {
        return Ok(diagnosed.map(|diagnosis| diagnosis.in_short(width, on.store)));
    };
    let earlier = rows
        .iter()
        .filter(|row| carried.is_none() && row.set == after.set && row.order < after.order);
    let before = earlier.min_by_key(|row| (row.order, row.held_out != after.held_out));
    let robot = tables::<Robot>(&outcome.manifest, store)?
        .into_iter()
        .next()
        .and_then(|robot| robot.0.into_iter().next());
    let points = |held_out: bool| {
        own()
            .filter(|row| row.held_out == held_out)
            .map(|row| row.points as usize)
            .sum::<usize>()
    };
    let points = format!(
        "{}, {} held out",
        counted(points(false) + points(true), "point"),
        points(true)
    );
    let noise = screen::noise(&length(after.noise_rms_mm), after.noise_basis.as_deref());
    let mut text = screen::measured(
        robot.as_ref().map(|base| base.name.as_str()),
        &points,
        Some(&noise),
    );
    let least = before.map_or(after.mean_mm, |row| row.mean_mm.min(after.mean_mm));
    text.push_str(&before.map_or_else(String::new, |row| error("before", row, least)));
    text.push_str(&error(
        if carried.is_some() {
            "carried"
        } else {
            "after"
        },
        after,
        least,
    ));
    if let Some(diagnosis) = &diagnosed {
        text.push_str(&screen::found(diagnosis.in_few_words(), width));
    }
    text.push_str(&labelled(
        "verdict",
        &diagnosed
            .as_ref()
            .map_or_else(|| verdict(after), DiagnosisSummary::verdict),
    ));
    if let Some(doubtful) = after.remarked.filter(|doubtful| *doubtful > 0) {
        let of = counted(after.points as usize, "point");
        text.push_str(&labelled(
            "doubt",
            &format!("{doubtful} of {of}: correction uncertain by more than half of itself"),
        ));
    }
    for warning in carried
        .iter()
        .flat_map(|stage| &stage.warnings)
        .cloned()
        .chain(standing.into_iter().flat_map(warnings))
    {
        text.push_str(&screen::sentence("warning", &warning, width));
    }
    let next = diagnosed
        .and_then(|diagnosis| diagnosis.next_step("HEAD", on.store))
        .or_else(|| unknown_noise(after));
    let compensate = || NextStep::correct("HEAD", on.store);
    Ok(Some(text + &next.unwrap_or_else(compensate).text(width)))
}

/// What must be known of the choice of a step, a short sentence each.
fn warnings(standing: &Standing) -> impl Iterator<Item = String> {
    let gone = |Withdrawn {
                    step,
                    rms_mm,
                    than,
                    than_rms_mm,
                    points,
                }: &Withdrawn| {
        let [own, other] = [rms_mm, than_rms_mm].map(|mm| length(*mm));
        format!(
            "{step} withdrawn, {than} used: {own} rms against {other} at {points} points unseen by either fit"
        )
    };
    let against = |Contradicted(Withdrawn {
                       step,
                       rms_mm,
                       than,
                       than_rms_mm,
                       points,
                   }): &Contradicted| {
        let [own, other] = [rms_mm, than_rms_mm].map(|mm| length(*mm));
        format!("the {points} held-out points prefer {than}: {other} rms against {own} of {step}")
    };
    standing
        .withdrawn
        .iter()
        .map(gone)
        .chain(standing.contradicted.iter().map(against))
        .collect::<Vec<_>>()
        .into_iter()
}

fn error(label: &str, row: &StatisticsRow, least: f64) -> String {
    let rows = match row.held_out {
        true => counted(row.points as usize, "held-out point"),
        false => format!(
            "{}, to which it was fitted: flattered",
            counted(row.points as usize, "point")
        ),
    };
    let text = screen::errors(
        label,
        [row.mean_mm, row.max_mm],
        least,
        &format!("step {}, {rows}", row.step),
    );
    let without = row
        .mean_without_mm
        .zip(row.max_without_mm)
        .map(|(mean, max)| {
            screen::errors(
                "",
                [mean, max],
                least,
                &format!(
                    "without {}",
                    counted(row.suspects as usize, "suspected outlier")
                ),
            )
        });
    text + &without.unwrap_or_default()
}

/// What is left where no stage asked why.
fn verdict(row: &StatisticsRow) -> String {
    let left = length(row.rms_mm);
    match row.is_inferred() {
        true => format!("identified: {left} rms remain, the noise is not known"),
        false => format!(
            "identified: {left} rms remain, the noise is {}",
            length(row.noise_rms_mm)
        ),
    }
}

fn unknown_noise(row: &StatisticsRow) -> Option<NextStep> {
    row.is_inferred().then(|| NextStep {
        what: "state `instrument` in `ingest`: the noise is not known".into(),
        command: None,
    })
}

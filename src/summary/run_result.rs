//! A run as one result, which `--json` prints and the lines of a terminal show: in ten lines what was measured, the error before and after, what
//! was found, the verdict, what is in doubt and one next step; in full the errors step by step, rivals of learned corrections, optimisers compared.

use super::estimate::length;
use super::{DiagnosisSummary, LimitsSummary, changed, labelled, screen, tables};
use crate::error::{Result, counted};
use crate::pipeline::{CompletedRun, Manifest, StageReport};
use crate::stage::{DIAGNOSES, DeclaredStage, Transfer};
use crate::store::Store;
use crate::table::{
    Contradicted, Corrections, CorrectionsRow, Robot, Searches, SearchesRow, Standing, Statistics,
    StatisticsRow, Table, TorqueChangeRow, TorqueChangeTable, Withdrawn, picked,
};
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use screen::NextStep;
use serde::Serialize;
use serde_json::{Value, json};

/// How a result is printed.
#[derive(Debug, Clone, Copy, Default)]
pub struct ResultScreen<'a> {
    /// The `--store` of the commands that are proposed.
    pub(crate) store: &'a str,
    /// Columns of the terminal, where there is one.
    pub(crate) columns: Option<usize>,
}

/// What a run gave, as `--json` prints it.
#[derive(Serialize)]
pub struct RunResult {
    status: &'static str,
    run_id: String,
    pipeline: String,
    seed: u64,
    stages: Vec<Value>,
    standing: Option<Standing>,
    /// What is wrong with the set-up, where something is.
    pub(crate) wrong_setup: Option<String>,
    /// Whether all limits of reports are kept, where there are some.
    pub(crate) accepted: Option<bool>,
    /// What the reports say of limits.
    pub(crate) limits: LimitsSummary,
    statistics: Vec<StatisticsRow>,
    corrections: Vec<CorrectionsRow>,
    searches: Vec<SearchesRow>,
    /// What changed between recordings of torques, where they are compared.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    changes: Vec<TorqueChangeRow>,
    rejected_rows: u64,
    report: Option<String>,
    documents: Vec<String>,
}

impl RunResult {
    /// What a run gave; `standing` is the step that stands for it. Fails where a table has left the store.
    pub fn read(
        outcome: &CompletedRun,
        standing: Option<Standing>,
        wrong_setup: Option<String>,
        store: &Store,
    ) -> Result<Self> {
        let manifest = &outcome.manifest;
        let documents = outcome.documents.iter();
        let documents: Vec<String> = documents.map(|path| path.display().to_string()).collect();
        let limits = LimitsSummary::of(manifest, store)?;
        let statistics = tables::<Statistics>(manifest, store)?.into_iter();
        let corrections = tables::<Corrections>(manifest, store)?.into_iter();
        let searches = tables::<Searches>(manifest, store)?.into_iter();
        let changes = tables::<TorqueChangeTable>(manifest, store)?.into_iter();
        Ok(Self {
            status: "done",
            run_id: manifest.run_id.clone(),
            pipeline: manifest.pipeline.name.clone(),
            seed: manifest.seed,
            stages: manifest.stages.iter().map(stage_document).collect(),
            standing,
            wrong_setup,
            accepted: limits.accepted(),
            limits,
            statistics: statistics.flat_map(|table| table.0).collect(),
            corrections: corrections.flat_map(|table| table.0).collect(),
            searches: searches.flat_map(|table| table.0).collect(),
            changes: changes.flat_map(|table| table.0).collect(),
            rejected_rows: rejected_rows(manifest),
            report: documents
                .iter()
                .find(|path| path.ends_with(".html"))
                .cloned(),
            documents,
        })
    }

    /// The errors at the largest set that the step which stands was not fitted to, else at the one that it was fitted to; nothing where no
    /// stage stated errors, diagnosed or compared; where a model is carried to another recording, what it does there; where recordings of
    /// torques are compared, what changed. A wrong set-up is stated alone.
    pub fn in_short(
        &self,
        manifest: &Manifest,
        store: &Store,
        on: ResultScreen,
    ) -> Result<Option<String>> {
        let short = self.of_steps(manifest, store, on)?;
        if self.changes.is_empty() || self.wrong_setup.is_some() {
            return Ok(short);
        }
        let table = TorqueChangeTable(self.changes.clone());
        let changed = changed::lines(&table, screen::width(on.columns));
        Ok(Some(short.unwrap_or_default() + &changed))
    }

    fn of_steps(
        &self,
        manifest: &Manifest,
        store: &Store,
        on: ResultScreen,
    ) -> Result<Option<String>> {
        let (width, rows) = (screen::width(on.columns), &self.statistics);
        let ran = |name: &str| {
            let has_run = |stage: &&StageReport| stage.uses == name && !stage.outputs.is_empty();
            manifest.stages.iter().rfind(has_run)
        };
        let diagnosed = DIAGNOSES.iter().find_map(|name| ran(name));
        let read = |stage| DiagnosisSummary::read(&self.run_id, stage, store);
        let diagnosed = diagnosed.map(read).transpose()?;
        let verdict = diagnosed
            .as_ref()
            .map(|diagnosis| diagnosis.verdict.as_str());
        if let Some(wrong) = &self.wrong_setup {
            let wrong = wrong.trim_start_matches("the set-up is wrong: ");
            let verdict = labelled("verdict", verdict.unwrap_or("wrong set-up"));
            return Ok(Some(verdict + &screen::sentence("", wrong, width)));
        }
        // What a model does elsewhere is what a carried one is asked for; its sets may bear the names of those that it was fitted to.
        let carried =
            ran(Transfer::NAME).filter(|stage| rows.iter().any(|row| row.step == stage.id));
        let last = || Some(&rows.iter().max_by_key(|row| row.order)?.step);
        let stands = || self.standing.as_ref().map(|stands| &stands.step);
        let step = carried.map(|stage| &stage.id).or_else(stands).or_else(last);
        let of_step = || rows.iter().filter(|row| Some(&row.step) == step);
        let Some(after) = of_step().max_by_key(|row| (row.held_out, row.points)) else {
            return Ok(diagnosed.map(|diagnosis| diagnosis.in_short(width, on.store)));
        };
        let earlier = rows
            .iter()
            .filter(|row| carried.is_none() && row.set == after.set && row.order < after.order);
        let before = earlier.min_by_key(|row| (row.order, row.held_out != after.held_out));
        let robot = tables::<Robot>(manifest, store)?.into_iter().next();
        let robot = robot.and_then(|robot| robot.0.into_iter().next());
        let points = |held_out: bool| -> usize {
            let rows = of_step().filter(|row| row.held_out == held_out);
            rows.map(|row| row.points as usize).sum()
        };
        let held_out = points(true);
        let all = counted(points(false) + held_out, "point");
        let noise = screen::noise(&length(after.noise_rms_mm), after.noise_basis.as_deref());
        let mut text = screen::measured(
            robot.as_ref().map(|base| base.name.as_str()),
            &format!("{all}, {held_out} held out"),
            Some(&noise),
        );
        let least = before.map_or(after.mean_mm, |row| row.mean_mm.min(after.mean_mm));
        text.extend(before.map(|row| error("before", row, least)));
        let label = if carried.is_some() {
            "carried"
        } else {
            "after"
        };
        text += &error(label, after, least);
        text.extend(
            after
                .without_points()
                .map(|line| screen::sentence("left out", &line, width)),
        );
        text.extend(
            diagnosed
                .iter()
                .map(|diagnosis| screen::found(&diagnosis.in_few_words, width)),
        );
        let identified = || self::verdict(after);
        text += &labelled("verdict", &verdict.map_or_else(identified, String::from));
        if let Some(doubtful) = after.remarked.filter(|doubtful| *doubtful > 0) {
            let points = counted(after.points as usize, "point");
            let doubt =
                format!("{doubtful} of {points}: correction uncertain by more than half of itself");
            text += &labelled("doubt", &doubt);
        }
        let of_stage = carried.iter().flat_map(|stage| stage.warnings.clone());
        let of_choice = self.standing.iter().flat_map(warnings);
        for warning in of_stage.chain(of_choice) {
            text += &screen::sentence("warning", &warning, width);
        }
        let of_diagnosis = |diagnosis: &DiagnosisSummary| diagnosis.next_step("HEAD", on.store);
        let next = diagnosed.as_ref().and_then(of_diagnosis);
        let next = next
            .or_else(|| unknown_noise(after))
            .unwrap_or_else(|| NextStep::correct("HEAD", on.store));
        Ok(Some(text + &next.text(width)))
    }

    /// Points that no model has seen, those that the models were fitted to, these again cross-validated, and next to figures that the pipeline
    /// names; rivals of each learned correction, the kept one marked; functions with known minima by optimiser. `expected` is the rms of a
    /// complete model under the instrument's noise.
    pub fn steps(&self) -> String {
        let withdrawn = || self.standing.iter().flat_map(|stands| &stands.withdrawn);
        let shown = |row: &StatisticsRow| {
            let mut row = row.clone();
            if withdrawn().any(|gone| gone.step == row.step) {
                row.step += " (withdrawn)";
            }
            row
        };
        let rows: Vec<StatisticsRow> = self.statistics.iter().map(shown).collect();
        let folded = || rows.iter().filter(|row| row.fold_rms_mm.is_some());
        let contacts = folded().filter(|row| row.is_contact()).count();
        let blocks = match (folded().count(), contacts) {
            (0, _) => "",
            (_, 0) => "contiguous folds",
            (all, some) if some == all => "whole places",
            _ => "contiguous folds, whole places",
        };
        let references = rows.iter().filter_map(reference);
        let is_published = |row: &SearchesRow| row.reference_s.is_some();
        let about = context! {
            assumed => rows.iter().any(StatisticsRow::is_inferred), blocks, references => Serde(references.collect::<Vec<_>>()), rows => Serde(&rows),
            corrections => Serde(self.corrections.iter().map(correction).collect::<Vec<_>>()),
            searches => Serde(self.searches.iter().map(search).collect::<Vec<_>>()), published => self.searches.iter().any(is_published),
        };
        filled(include_str!("text/steps.txt"), about)
    }

    /// The documents that a run wrote, where they are.
    pub(crate) fn documents(&self) -> &[String] {
        &self.documents
    }
}

fn stage_document(stage: &StageReport) -> Value {
    let mut document = picked(stage, "id uses status reason notes warnings wall_seconds");
    let outputs = stage.outputs.iter().map(|output| {
        json!({
            "port": output.port, "kind": output.kind, "rows": output.table.rows,
            "table_hash": output.table.table_hash, "path": output.path,
        })
    });
    document["outputs"] = outputs.collect();
    document
}

/// Our figures next to those that the pipeline names, where it names some.
fn reference(row: &StatisticsRow) -> Option<Value> {
    let pair = |ours: f64, theirs: Option<f64>| {
        let theirs = theirs.map_or_else(String::new, |mm| format!("{mm:.4}"));
        format!("{ours:>7.4} | {theirs:>7}")
    };
    Some(json!({
        "reference": row.reference.as_ref()?, "step": row.step, "set": row.set, "mean": pair(row.mean_mm, row.reference_mean_mm),
        "std": pair(row.std_mm, row.reference_std_mm), "max": pair(row.max_mm, row.reference_max_mm),
    }))
}

/// A rival of a learned correction, the kept one marked.
fn correction(row: &CorrectionsRow) -> Value {
    let mut shown = json!(row);
    let mark = if row.chosen { ">" } else { " " };
    shown["step"] = format!("{mark} {}", row.step).into();
    if let Some((hidden, decay)) = row.hidden.zip(row.decay) {
        let reason = format!("{} ({hidden} neurons, decay {decay})", row.reason);
        shown["reason"] = reason.into();
    }
    shown
}

/// A function and an optimiser.
fn search(row: &SearchesRow) -> Value {
    let share = |count: i64| format!("{:.1}%", 100.0 * count as f64 / row.searches.max(1) as f64);
    let count = |value: Option<f64>| value.map(|value| format!("{value:.0}"));
    let error = |value: Option<f64>| value.map(|value| format!("{value:.2e}"));
    let published = row.reference.as_ref().zip(row.reference_s);
    let published = published.map(|(label, seconds)| format!("{label}: {seconds:.3} s"));
    json!({
        "function": format!("{} {}-D", row.function, row.dimensions), "method": row.method, "searches": row.searches, "found": share(row.found),
        "stuck": share(row.stuck), "median": count(row.evaluations_median), "p90": count(row.evaluations_p90), "p50": error(row.error_median),
        "p90e": error(row.error_p90), "published": published.unwrap_or_default(),
    })
}

/// What must be known of the choice of a step, a short sentence each.
fn warnings(standing: &Standing) -> Vec<String> {
    let rms = |by: &Withdrawn| [by.rms_mm, by.than_rms_mm].map(length);
    let gone = standing.withdrawn.iter().map(|by| {
        let ([here, other], step, than) = (rms(by), &by.step, &by.than);
        let points = by.points;
        format!("{step} withdrawn, {than} used: {here} rms against {other} at {points} points unseen by either fit")
    });
    let against = standing.contradicted.iter().map(|Contradicted(by)| {
        let ([here, other], step, than) = (rms(by), &by.step, &by.than);
        let points = by.points;
        format!("the {points} held-out points prefer {than}: {other} rms against {here} of {step}")
    });
    gone.chain(against).collect()
}

fn error(label: &str, row: &StatisticsRow, least: f64) -> String {
    let rows = match row.held_out {
        true => counted(row.points as usize, "held-out point"),
        false => format!(
            "{}, to which it was fitted: flattered",
            counted(row.points as usize, "point")
        ),
    };
    let all = |label: &str, what: &str| {
        let subject = format!("step {}, {rows}{what}", row.step);
        screen::errors(label, [row.mean_mm, row.max_mm], least, &subject)
    };
    let Some(clean) = row.mean_without_mm.zip(row.max_without_mm) else {
        return all(label, "");
    };
    let suspects = counted(row.suspects as usize, "suspected outlier");
    let subject = format!("step {}, without {suspects}", row.step);
    screen::errors(label, clean.into(), least, &subject) + &all("", ", with these")
}

/// The residual where no stage diagnosed it.
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

/// How many rows of the raw files were rejected.
fn rejected_rows(manifest: &Manifest) -> u64 {
    manifest
        .tables(crate::table::Rejected::KIND)
        .map(|output| output.table.rows)
        .sum()
}

/// Rejected rows that are named one by one.
const NAMED: usize = 3;

/// The first rejected rows with their reasons, and how many there are; nothing where nothing was rejected.
pub fn rejected(manifest: &Manifest, store: &Store) -> Result<String> {
    let mut text = String::new();
    for output in manifest.tables(crate::table::Rejected::KIND) {
        let count = output.table.rows;
        if count == 0 {
            continue;
        }
        let path = output.path.as_deref().unwrap_or_default();
        let all = format!("{}, each with its reason in {path}", counted(count, "row"));
        text += &labelled("rejected", &all);
        let rows = crate::table::Rejected::from_frame(&store.load(&output.table)?)?;
        for row in rows.0.iter().take(NAMED) {
            let line = format!("{}:{}: {}", row.file, row.line, row.detail);
            text += &labelled("", &line);
        }
        if let Some(more) = (count as usize).checked_sub(NAMED).filter(|more| *more > 0) {
            text += &labelled("", &format!("and {more} more"));
        }
    }
    Ok(text)
}

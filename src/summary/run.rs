//! A run as its manifest has it, and a stage of it.

use crate::audit::Explanation;
use crate::error::{Error, Result};
use crate::pipeline::{Manifest, Plan, RunStatus, StageReport};
use crate::stage::{DeclaredStage, Report};
use crate::store::Store;
use crate::summary::{labelled, tables};
use crate::table::{
    Acceptance, AcceptanceRow, Parameters, Prediction, Recording, Rejected, Robot, Table, picked_of,
};
use crate::text::filled;
use crate::units::Unit;
use minijinja::context;
use minijinja::value::Serde;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// The scoreboard of a set of concealed recordings, from its document and from what only people read of it.
pub fn scoreboard(document: &Value, details: &Value) -> String {
    let about = context! { score => Serde(document), details => Serde(details) };
    filled(include_str!("text/scoreboard.txt"), about)
}

/// A whole run.
pub fn run(manifest: &Manifest) -> String {
    let ids = manifest.stages.iter().map(|stage| stage.id.len());
    filled(
        include_str!("text/run.txt"),
        context! {
            run => Serde(manifest), what => manifest.what(), status => status(manifest),
            width => ids.max().unwrap_or(0),
        },
    )
}

/// One stage with its inputs and tables.
pub fn stage(stage: &StageReport) -> String {
    let settings = stage.key.as_ref().map(|key| &key.settings);
    let settings = serde_json::to_string_pretty(&settings).unwrap_or_default();
    let about = context! { stage => Serde(stage), settings };
    filled(include_str!("text/stage.txt"), about)
}

/// The state of a run as it is printed.
pub fn status(manifest: &Manifest) -> &'static str {
    match manifest.status {
        RunStatus::Running => "running or killed",
        RunStatus::Done => "done",
        RunStatus::Failed => "failed",
    }
}

/// Why a stage ran, as text.
pub fn explanation(explanation: &Explanation) -> String {
    let about = context! { of => Serde(explanation) };
    filled(include_str!("text/explanation.txt"), about)
}

/// Stages with their tables and files, as `calib check` prints them.
pub fn graph(plan: &Plan) -> String {
    let stages = plan.stages.iter().map(|stage| {
        let widths = stage.inputs.iter().map(|input| input.port.name.len());
        let reads = stage.inputs.iter().map(|input| {
            let from = input.from.iter().map(|origin| {
                let writer = &plan.stages[origin.stage];
                format!("{}.{}", writer.id, writer.outputs[origin.port].name)
            });
            (input.port.name, from.collect::<Vec<_>>())
        });
        let files = stage.files.iter();
        let files = files.map(|file| (&file.place, file.path.display().to_string()));
        let writes = stage.outputs.iter().map(|port| match port.name == port.kind {
            true => port.name.to_string(),
            false => format!("{} ({})", port.name, port.kind),
        });
        json!({
            "id": stage.id, "uses": stage.entry.name, "summary": stage.entry.summary, "width": widths.max(),
            "reads": reads.collect::<Vec<_>>(), "files": files.collect::<Vec<_>>(), "writes": writes.collect::<Vec<_>>(),
        })
    });
    let stages = Serde(stages.collect::<Vec<_>>());
    let about = context! { name => &plan.name, seed => plan.seed, stages };
    filled(include_str!("text/graph.txt"), about)
}

/// Lines of a run up to its first fits. Fails where a table has left the store.
pub fn first_look(manifest: &Manifest, store: &Store) -> Result<String> {
    let robots = tables::<Robot>(manifest, store)?;
    let mut recordings = Vec::new();
    for recording in tables::<Recording>(manifest, store)? {
        let points: BTreeSet<&String> = recording.point_id.iter().collect();
        let ranges = match robots.first() {
            Some(robot) => ranges(&recording, robot)?,
            None => Vec::new(),
        };
        recordings
            .push(json!({ "rows": recording.rows(), "points": points.len(), "ranges": ranges }));
    }
    let rejected = tables::<Rejected>(manifest, store)?;
    let rejected: Vec<_> = rejected.into_iter().map(|table| table.0).collect();
    let predictions = tables::<Prediction>(manifest, store)?;
    let errors: Vec<_> = predictions.iter().flat_map(errors).collect();
    let parameters = tables::<Parameters>(manifest, store)?.pop();
    let mut warnings: Vec<[&str; 2]> = Vec::new();
    for stage in &manifest.stages {
        for line in &stage.warnings {
            if warnings.iter().all(|[_, known]| *known != line) {
                warnings.push([&stage.id, line]);
            }
        }
    }
    let about = context! {
        recordings => Serde(recordings), rejected => Serde(rejected), errors => Serde(errors), warnings => Serde(warnings),
        parameters => Serde(parameters.map(|table| table.0)),
    };
    Ok(filled(include_str!("text/first_look.txt"), about))
}

/// Smallest and largest position of each joint, in the robot file's counting, and the limits of joints beyond them.
fn ranges(recording: &Recording, robot: &Robot) -> Result<Vec<Value>> {
    let robot = robot.to_description()?;
    let joints = robot.joints.iter().enumerate().map(|(k, joint)| {
        let values = (0..recording.rows()).map(|row| recording.q(row)[k]);
        let (lower, upper) = values.fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(q), b.max(q)));
        let unit = match recording.prismatic.get(k) {
            Some(true) => Unit::Millimetre,
            _ => Unit::Degree,
        };
        let shown = |ends: [f64; 2]| ends.map(|end| unit.from_si(end));
        let is_beyond = |[a, b]: &[f64; 2]| lower < a - 1e-6 || upper > b + 1e-6;
        json!({
            "name": joint.name, "unit": unit.symbol(), "travel": shown([lower, upper]),
            "beyond": joint.limits.filter(is_beyond).map(shown), "still": upper - lower < 1e-6,
        })
    });
    Ok(joints.collect())
}

/// Step, mean and largest error, mm, and points, in the order in which the steps first come.
fn errors(prediction: &Prediction) -> Vec<(&str, f64, f64, usize)> {
    let mut steps: Vec<(&str, Vec<f64>)> = Vec::new();
    for row in &prediction.0 {
        match steps.iter_mut().find(|(step, _)| *step == row.step) {
            Some((_, errors)) => errors.push(row.error_mm),
            None => steps.push((&row.step, vec![row.error_mm])),
        }
    }
    let one = |(step, errors): (_, Vec<f64>)| {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let largest = errors.iter().copied().fold(0.0, f64::max);
        (step, mean, largest, errors.len())
    };
    steps.into_iter().map(one).collect()
}

/// The judgements of a run's reports, those alone that have limits.
#[derive(Serialize)]
pub struct LimitsSummary(Vec<Judged>);

/// A judgement and the report's stage.
#[derive(Serialize)]
struct Judged {
    stage: String,
    kept: bool,
    sentence: String,
    /// Those for which something was found.
    #[serde(serialize_with = "figures")]
    figures: Vec<AcceptanceRow>,
}

fn figures<S: Serializer>(rows: &[AcceptanceRow], serializer: S) -> Result<S::Ok, S::Error> {
    picked_of(rows, "figure found_mm limit_mm kept").serialize(serializer)
}

impl LimitsSummary {
    /// The judgements of all reports of the record of a run. Fails where a table has left the store, or a report is older than the table.
    pub fn of(manifest: &Manifest, store: &Store) -> crate::error::Result<Self> {
        let mut all = Vec::new();
        let is_report = |stage: &&StageReport| stage.uses == Report::NAME;
        for stage in manifest.stages.iter().filter(is_report) {
            let mut outputs = stage.outputs.iter();
            match outputs.find(|output| output.kind == Acceptance::KIND) {
                Some(output) => {
                    let acceptance = Acceptance::from_frame(&store.load(&output.table)?)?;
                    all.extend(judged(&stage.id, acceptance));
                }
                None if stage.outputs.is_empty() => {}
                None => {
                    let message = "its report was made by an earlier calib, which kept limits elsewhere; run the pipeline again";
                    return Err(Error::data(&manifest.run_id, message));
                }
            }
        }
        Ok(Self(all))
    }

    /// Whether all limits are kept; none where there are none.
    pub(crate) fn accepted(&self) -> Option<bool> {
        (!self.0.is_empty()).then(|| self.0.iter().all(|judged| judged.kept))
    }

    /// What is not accepted, a sentence a report.
    pub(crate) fn exceeded(&self) -> Vec<String> {
        let beyond = self.0.iter().filter(|judged| !judged.kept);
        beyond.map(Judged::words).collect()
    }

    /// A line for each report with limits.
    pub fn text(&self) -> String {
        let line = |judged: &Judged| labelled("limits", &judged.words());
        self.0.iter().map(line).collect()
    }
}

/// What a report says of its limits; none where it has none.
fn judged(stage: &str, Acceptance(rows): Acceptance) -> Option<Judged> {
    let first = rows.first()?;
    Some(Judged {
        stage: stage.into(),
        kept: first.accepted,
        sentence: first.sentence.clone(),
        figures: rows
            .into_iter()
            .filter(|row| row.found_mm.is_some())
            .collect(),
    })
}

impl Judged {
    /// The judgement, then the figures that are beyond, or all where none is.
    fn words(&self) -> String {
        let limits = self.figures.iter().filter_map(|one| {
            let (figure, found, limit) = (&one.figure, one.found_mm?, one.limit_mm);
            let words = format!("{figure} {found:.4} mm, at most {limit} mm allowed");
            (one.kept == self.kept).then_some(words)
        });
        let limits: Vec<String> = limits.collect();
        let sentence = self.sentence.trim_end_matches('.');
        let (first, others) = sentence.split_at(sentence.chars().next().map_or(0, char::len_utf8));
        let sentence = first.to_lowercase() + others;
        match limits.is_empty() {
            true => sentence,
            false => format!("{sentence}: {}", limits.join("; ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::judged;
    use crate::table::{Acceptance, AcceptanceRow};

    #[test]
    fn a_line_names_what_is_beyond_and_a_report_without_limits_has_none() {
        let row = |figure: &str, found_mm, limit_mm, kept| AcceptanceRow {
            order: 1,
            figure: figure.into(),
            found_mm,
            limit_mm,
            kept,
            accepted: false,
            sentence: "Not accepted: beyond the limits.".into(),
        };
        let words = |rows| judged("report", Acceptance(rows)).map(|judged| judged.words());
        let found = vec![
            row("mean", Some(0.0421), 0.03, false),
            row("largest", Some(0.1), 0.5, true),
        ];
        assert_eq!(
            words(found).as_deref(),
            Some("not accepted: beyond the limits: mean 0.0421 mm, at most 0.03 mm allowed")
        );
        assert_eq!(
            words(vec![row("mean", None, 0.03, false)]).as_deref(),
            Some("not accepted: beyond the limits")
        );
        assert!(
            words(Vec::new()).is_none(),
            "a wrong set-up is judged unasked"
        );
    }
}

//! `calib run`: runs what is not already done.
//!
//! `calib check`: whether a pipeline can run: what is still to fill in and to look at, every fault at once, and with `--data` what a first fit says.

use super::pipeline_arguments::{
    CommandTask, ExecutionArguments, language_parser, reported_as, shown,
};
use super::surroundings::columns;
use super::{emit, emit_json, emit_lines};
use crate::error::{Error, Result, counted, listed};
use crate::identified::{standing_of, wrong_setup_of};
use crate::init::{MarkedLines, marked};
use crate::pipeline::{
    CompletedRun, Forecast, Override, Plan, Prospect, Purpose, Selection, StageStatus, look,
    preview,
};
use crate::progress::Verbosity;
use crate::raw::ending;
use crate::report::PageLanguage;
use crate::stage::{DeclaredStage, Identify, Report, ReportDrives, ReportTorques};
use crate::summary::{self, ResultScreen, RunResult, first_look, graph, labelled};
use clap::Args;
use serde_json::json;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Run a pipeline: every stage that is not already done, in order.
///
/// A stage is done when its settings, its input tables and files, its seed and its implementation are those of an earlier
/// run; then its tables are taken as they are. A run that was killed goes on where it stood when the same command is given
/// again. The result is on stdout, progress on stderr. Where the pipeline's report has limits that are exceeded, the code is 1.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct RunArguments {
    /// The pipeline's YAML file
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    #[command(flatten)]
    means: ExecutionArguments,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress; warnings and errors remain
    #[arg(long, short)]
    quiet: bool,
    /// Shows what would run and why, and runs nothing
    #[arg(long, short = 'n')]
    dry_run: bool,
    /// Runs this stage alone; those before it must be cached
    #[arg(long, value_name = "STAGE", conflicts_with_all = ["from", "until"])]
    only: Option<String>,
    /// Runs this stage and those after it; those before it must be cached
    #[arg(long, value_name = "STAGE")]
    from: Option<String>,
    /// Runs up to and with this stage
    #[arg(long, value_name = "STAGE")]
    until: Option<String>,
    /// Prints what stages note while they run, and the errors of every step and set, cross-validated and beside reference figures, too
    #[arg(long, conflicts_with = "json")]
    details: bool,
    /// Language of the report, instead of the one that the pipeline names
    #[arg(long, value_name = "LANGUAGE", value_parser = language_parser())]
    language: Option<PageLanguage>,
    /// Runs again though cached: all selected stages, or this one (give it after PIPELINE)
    #[arg(long, value_name = "STAGE", num_args = 0..=1, default_missing_value = "")]
    force: Option<Vec<String>>,
}

const EXAMPLES: &str = "Examples:
  calib run pipelines/sr210d/pipeline.yaml
  calib run pipelines/case/pipeline.yaml --set case=recordings/robot-7
  calib run pipeline.yaml --set seed=7 --set split.n=5 --dry-run
  calib run pipeline.yaml --from stiffness --force
  calib run pipeline.yaml --language de
  calib run pipeline.yaml --json --quiet > result.json";

/// The stages that write a page.
const REPORTS: [&str; 3] = [Report::NAME, ReportTorques::NAME, ReportDrives::NAME];

impl RunArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<u8> {
        reported_as(self.json, execute(self, command_line))
    }

    /// The pipeline, its reports in another language where one is given.
    fn plan(&self) -> Result<Plan> {
        let plan = self.means.plan(&self.pipeline)?;
        let Some(language) = self.language else {
            return Ok(plan);
        };
        let stages = plan.stages.iter();
        let reports = stages.filter(|stage| REPORTS.contains(&stage.entry.name));
        let sets = reports.map(|stage| Override {
            target: format!("{}.language", stage.id),
            value: language.code().into(),
        });
        let sets: Vec<Override> = sets.collect();
        if sets.is_empty() {
            let message = format!(
                "{} has no stage that writes a page; allowed: {}",
                self.pipeline.display(),
                listed(REPORTS)
            );
            return Err(Error::spec("--language", message));
        }
        self.means.plan_with(&self.pipeline, &sets)
    }
}

/// The exit code of a run whose files do not belong together as they are read: its tables are there, and its data are rejected.
pub(super) const WRONG_SETUP: u8 = 10;

/// Gives the exit code: 1 where the run went through and its result is beyond the limits, 10 where the set-up is wrong.
fn execute(arguments: &RunArguments, command_line: &[OsString]) -> Result<u8> {
    let begun = Instant::now();
    let means = &arguments.means;
    let (plan, store) = (arguments.plan()?, means.store()?);
    // `--force` without a stage stands for all of them.
    let force = arguments
        .force
        .as_ref()
        .map(|ids| ids.iter().filter(|id| !id.is_empty()).cloned().collect());
    let selection = Selection {
        only: arguments.only.clone(),
        from: arguments.from.clone(),
        until: arguments.until.clone(),
        force,
    };
    if arguments.dry_run {
        let forecasts = preview(&plan, &store, &selection)?;
        match arguments.json {
            true => emit_json(&json!({ "pipeline": plan.name, "stages": forecasts }))?,
            false => emit(&forecast_lines(&forecasts))?,
        }
        return Ok(0);
    }
    let task = CommandTask {
        purpose: Purpose::Run,
        selection,
        shown: shown(arguments.quiet, arguments.details),
    };
    let outcome = means.run(&plan, &store, task, command_line)?;
    let wrong = wrong_setup_of(&outcome.manifest, &store)?;
    let standing = standing_of(&outcome.manifest, &store)?;
    let result = RunResult::read(&outcome, standing, wrong, &store)?;
    let code = match result.wrong_setup {
        Some(_) => WRONG_SETUP,
        None => u8::from(result.accepted == Some(false)),
    };
    if arguments.json {
        emit_json(&result)?;
        return Ok(code);
    }
    let on = ResultScreen {
        store: &means.store_again(),
        columns: columns(),
    };
    let short = result.in_short(&outcome.manifest, &store, on)?;
    let mut text = String::new();
    if arguments.details || short.is_none() {
        text += &result.steps();
    }
    text.push_str(short.as_deref().unwrap_or_default());
    // Of a wrong set-up nothing else is said.
    if result.wrong_setup.is_none() {
        text.push_str(&result.limits.text());
    }
    text.push_str(&summary::rejected(&outcome.manifest, &store)?);
    let more = if arguments.details || short.is_none() {
        ""
    } else {
        " (--details: every step and set)"
    };
    let is_shown = |path: &&String| arguments.details || ending(path.as_ref()) == "html";
    for path in result.documents().iter().filter(is_shown) {
        text.push_str(&labelled("report", &format!("{path}{more}")));
    }
    if arguments.details || short.is_none() || outcome.nothing_done() {
        text.push_str(&closing(&outcome, begun.elapsed().as_secs_f64()));
    }
    emit_lines(&text)?;
    Ok(code)
}

fn closing(outcome: &CompletedRun, seconds: f64) -> String {
    let stages = &outcome.manifest.stages;
    let all = [
        StageStatus::Executed,
        StageStatus::Cached,
        StageStatus::NotRun,
    ];
    let [executed, cached, not_run] =
        all.map(|status| stages.iter().filter(|stage| stage.status == status).count());
    let text = if outcome.nothing_done() {
        let stages = counted(stages.len(), "stage");
        format!("nothing to do: {stages} cached ({seconds:.1} s)")
    } else {
        let not_run = match not_run {
            0 => String::new(),
            _ => format!(", {not_run} not selected"),
        };
        let (executed, run) = (counted(executed, "stage"), &outcome.manifest.run_id);
        format!("{executed} run, {cached} cached{not_run} ({seconds:.1} s), run {run}")
    };
    labelled("done", &text)
}

fn forecast_lines(forecasts: &[Forecast]) -> String {
    let width = forecasts
        .iter()
        .map(|forecast| forecast.id.len())
        .max()
        .unwrap_or(0);
    let line = |forecast: &Forecast| {
        let what = match &forecast.prospect {
            Prospect::Cached => "cached".into(),
            Prospect::Run { reason } => format!("run ({reason})"),
            Prospect::Pending { on } => format!("pending (depends on {on})"),
            Prospect::NotSelected => "not selected".into(),
        };
        format!("{:width$}  {what}\n", forecast.id)
    };
    forecasts.iter().map(line).collect()
}

/// Check whether a pipeline can run: what is still to be filled in, what to look at, and every fault with its line.
///
/// The robot file is read, and the headers of the data files: columns that are mapped and not there are named. Exit code 2 for faults of
/// the YAML or of the robot file, 10 for those of the data files alone. Lines that `calib init` marked REPLACE (put your value there) or
/// CHECK (look at it) come first; they are no faults, and a run does not wait for them. `--data` reads the recording and fits base and
/// geometry to it: rows without partner, ranges, warnings of a wrong set-up, what will be observable.
#[derive(Args)]
#[command(after_help = "Examples:
  calib check pipelines/ur10/pipeline.yaml
  calib check pipelines/sr210d/pipeline.yaml --details
  calib check pipelines/case/pipeline.yaml --set case=recordings/robot-7 --data")]
pub(super) struct CheckArguments {
    /// The pipeline's YAML file
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    #[command(flatten)]
    means: ExecutionArguments,
    /// Reads the recording and fits base and geometry to it; what is computed is kept in the store, for the run
    #[arg(long)]
    data: bool,
    /// Prints the graph of stages and tables, too
    #[arg(long)]
    details: bool,
}

impl CheckArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let plan = match self.means.plan(&self.pipeline) {
            Ok(plan) => plan,
            Err(error) => {
                emit_lines(&left(&[&self.pipeline]).1)?;
                return Err(error);
            }
        };
        let files = plan
            .stages
            .iter()
            .filter(|stage| stage.entry.name == "robot")
            .flat_map(|stage| &stage.files);
        let described: Vec<&Path> = files
            .map(|file| file.path.as_path())
            .chain([self.pipeline.as_path()])
            .collect();
        let (to_fill, marks) = left(&described);
        let seen = look(&plan);
        let mut text = marks;
        if let Ok(warnings) = &seen {
            text.extend(warnings.iter().map(|line| labelled("warning", line)));
        }
        emit_lines(&text)?;
        seen?;
        if self.details {
            emit(&graph(&plan))?;
        }
        let stages = counted(plan.stages.len(), "stage");
        let unread = if self.data {
            ""
        } else {
            ", rows are not read (--data reads them)"
        };
        let (label, text) = match to_fill {
            0 if self.means.overrides() || !self.means.store_again().is_empty() => {
                ("ready", format!("{stages} are wired{unread}"))
            }
            0 => (
                "ready",
                format!(
                    "{stages} are wired{unread}: calib run {}",
                    self.pipeline.display()
                ),
            ),
            1 => (
                "not yet",
                format!("a line is left to fill in; {stages} are wired"),
            ),
            lines => (
                "not yet",
                format!("{lines} lines are left to fill in; {stages} are wired"),
            ),
        };
        emit_lines(&labelled(label, &text))?;
        if self.data {
            fitted(self, plan, command_line)
        } else {
            Ok(())
        }
    }
}

/// How many lines are left to fill in, and all that are marked.
fn left(paths: &[&Path]) -> (usize, String) {
    let marks = marked(paths);
    let to_fill = marks
        .iter()
        .find(|kind| kind.label == "replace")
        .map_or(0, |kind| kind.lines.len());
    let one = |MarkedLines { label, what, lines }: &MarkedLines| {
        let head = labelled(label, &format!("{}: {what}", counted(lines.len(), "line")));
        lines.iter().fold(head, |text, (file, number, line)| {
            text + &labelled("", &format!("{file}:{number}: {line}"))
        })
    };
    (to_fill, marks.iter().map(one).collect())
}

/// Runs up to the last fit of base and geometry before anything else is computed, and says what is seen.
fn fitted(arguments: &CheckArguments, plan: Plan, command_line: &[OsString]) -> Result<()> {
    let fits = plan
        .stages
        .iter()
        .enumerate()
        .filter(|(_, stage)| stage.entry.name == Identify::NAME)
        .map(|(at, _)| at);
    let fits: Vec<usize> = fits.collect();
    if fits.is_empty() {
        let file = arguments.pipeline.display().to_string();
        return Err(Error::spec(
            file,
            "has no stage `identify`: --data fits base and geometry of points; rows of torques and of drives are checked when the pipeline runs",
        ));
    }
    let plan = plan.needed_for_all(&fits);
    let store = arguments.means.store()?;
    let task = CommandTask {
        purpose: Purpose::Diagnose,
        selection: Selection::default(),
        shown: Verbosity::Silent,
    };
    let outcome = arguments.means.run(&plan, &store, task, command_line)?;
    emit_lines(&first_look(&outcome.manifest, &store)?)
}

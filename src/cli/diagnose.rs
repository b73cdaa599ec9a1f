//! `calib diagnose`: where simulation and recording differ, what physics is missing, the fit before and after.

use super::pipeline_arguments::{
    CommandTask, ExecutionArguments, language_parser, reported_as, shown,
};
use super::run::WRONG_SETUP;
use super::surroundings::columns;
use super::{emit_json, emit_lines, note, warn};
use crate::audit::{diagnosis, the_stage};
use crate::error::{Error, Result};
use crate::pipeline::{Purpose, Selection, later_diagnosis};
use crate::raw::ending;
use crate::report::PageLanguage;
use crate::stage::DIAGNOSES;
use crate::summary::{DiagnosisSummary, diagnosis_page, rejected};
use clap::Args;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Say what physics a simulation lacks: where it differs from the recording, and how much better the model is with it.
///
/// Runs the `diagnose` stage of a pipeline and what it needs; of a run, shows what was said then, computing nothing. The simulation is
/// the nominal robot with its geometry, reduction ratios and declared couplings identified from the recording; everything else is a
/// finding.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct DiagnoseArguments {
    /// The pipeline's YAML file, or a run as `calib log` names it, RUN/STAGE where it has several diagnoses
    #[arg(value_name = "PIPELINE|RUN")]
    what: PathBuf,
    /// The stage, where there are several `diagnose`
    #[arg(long, value_name = "STAGE")]
    step: Option<String>,
    #[command(flatten)]
    means: ExecutionArguments,
    /// Writes the formula proposed for a finding without a name as an effect of your own, which `diagnose` takes by
    /// `with: {effects: [FILE]}`
    #[arg(long, value_name = "FILE")]
    export_effect: Option<PathBuf>,
    /// The finding whose formula is written, by its number [default: the first that has one]
    #[arg(long, value_name = "N", requires = "export_effect")]
    finding: Option<i64>,
    /// Writes the diagnosis as one HTML file, the table of causes first
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Language of that page
    #[arg(long, value_name = "LANGUAGE", default_value = "en", requires = "html", value_parser = language_parser())]
    language: PageLanguage,
    /// Prints all of the diagnosis: where, probabilities of places, numbers, formulas, every rival, what cannot be observed and why
    #[arg(long, conflicts_with = "json")]
    details: bool,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress; warnings and errors remain
    #[arg(long, short)]
    quiet: bool,
}

const EXAMPLES: &str = "Examples:
  calib diagnose pipelines/case/pipeline.yaml --set case=recordings/robot-7
  calib diagnose pipeline.yaml --json > diagnosis.json
  calib diagnose HEAD --details
  calib diagnose HEAD --html diagnosis.html --language de
  calib diagnose HEAD --export-effect worn_tooth.yaml
  calib diagnose HEAD~1/second --json";

impl DiagnoseArguments {
    /// Gives the exit code: 10 where the set-up is wrong, whatever else was asked for.
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<u8> {
        reported_as(self.json, execute(self, command_line))
    }
}

fn execute(arguments: &DiagnoseArguments, command_line: &[OsString]) -> Result<u8> {
    let store = arguments.means.store()?;
    let (manifest, stage) = if is_pipeline(&arguments.what) {
        let file = arguments.what.display().to_string();
        let plan = arguments.means.plan(&arguments.what)?;
        let stages = plan
            .stages
            .iter()
            .enumerate()
            .filter(|(_, stage)| DIAGNOSES.contains(&stage.entry.name));
        let stages: Vec<(usize, &str)> =
            stages.map(|(at, stage)| (at, stage.id.as_str())).collect();
        let Some((at, id)) = the_stage(&file, &stages, arguments.step.as_deref())? else {
            return Err(Error::spec(
                file,
                "has no stage `diagnose`; put `- uses: diagnose` after the split, or `- uses: diagnose_torques` after `ingest_torques`",
            ));
        };
        let id = id.to_string();
        let plan = plan.needed_for(at);
        let shown = shown(arguments.quiet, arguments.details);
        let task = CommandTask {
            purpose: Purpose::Diagnose,
            selection: Selection::default(),
            shown,
        };
        let outcome = arguments.means.run(&plan, &store, task, command_line)?;
        let stage = outcome.manifest.stage(&id).cloned();
        (
            outcome.manifest,
            stage.ok_or_else(|| Error::Bug(format!("a run without its stage `{id}`")))?,
        )
    } else {
        if arguments.means.overrides() {
            return Err(Error::spec(
                "--set",
                "a finished run cannot be changed; give its pipeline instead",
            ));
        }
        let name = arguments.what.to_string_lossy();
        let (run, step) = match name.split_once('/') {
            Some((run, step)) => (run, Some(step)),
            None => (&*name, arguments.step.as_deref()),
        };
        let found = diagnosis(&store, run, step, &DIAGNOSES)?;
        let head = &found.0.run_id;
        if let ("HEAD", Some(later)) = (run, later_diagnosis(&store, head)) {
            note(format!(
                "HEAD is the last `calib run`, {head}; the last `calib diagnose` is {later}\n"
            ));
        }
        found
    };
    let diagnosis = DiagnosisSummary::read(&manifest.run_id, &stage, &store)?;
    if let Some(file) = &arguments.export_effect {
        write_new(file, &diagnosis.effect_file(arguments.finding)?)?;
    }
    let again = arguments.means.store_again();
    if let Some(file) = &arguments.html {
        let page = diagnosis_page(&diagnosis, &stage, (&store, &again), arguments.language)?;
        write_new(file, &page.html)?;
        warn(page.untranslated(arguments.language));
    }
    if arguments.json {
        emit_json(&diagnosis.document(&again))?;
    } else {
        let text = if arguments.details {
            diagnosis.text(&again)
        } else {
            diagnosis.short(&again, columns())
        };
        emit_lines(&(text + &rejected(&manifest, &store)?))?;
    }
    Ok(if diagnosis.is_wrong_setup() {
        WRONG_SETUP
    } else {
        0
    })
}

/// Writes a file that is not there yet.
fn write_new(file: &Path, text: &str) -> Result<()> {
    let place = || file.display().to_string();
    match std::fs::File::create_new(file) {
        Ok(mut open) => open
            .write_all(text.as_bytes())
            .map_err(|error| Error::store(place(), error.to_string())),
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
            Err(Error::spec(place(), "is there already; name another file"))
        }
        Err(error) => Err(Error::store(place(), error.to_string())),
    }
}

/// A file, or what is named like one; everything else names a run.
fn is_pipeline(what: &Path) -> bool {
    matches!(ending(what).as_str(), "yaml" | "yml") || what.is_file()
}

//! `calib diagnose`: where simulation and recording differ, what physics is missing, the fit before and after.

mod told;

use super::means::{Means, Task};
use super::pipeline_arguments::told_as;
use super::{emit, emit_json, shell};
use crate::error::{Error, Result, nearest};
use crate::pipeline::{Manifest, Purpose, Selection, StageReport, StageStatus, find_run};
use crate::stage::{Diagnose, Stage};
use crate::store::Store;
use clap::Args;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use told::Told;

/// Say where simulation and recording differ, what physics was left out, and how much better the model is with it.
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
    means: Means,
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
  calib diagnose HEAD
  calib diagnose HEAD~1/second --json";

pub(super) fn main(arguments: &DiagnoseArguments, command_line: &[OsString]) -> Result<()> {
    told_as(arguments.json, execute(arguments, command_line))
}

fn execute(arguments: &DiagnoseArguments, command_line: &[OsString]) -> Result<()> {
    let store = arguments.means.store()?;
    let told = if is_pipeline(&arguments.what) {
        let file = arguments.what.display().to_string();
        let plan = arguments.means.plan(&arguments.what)?;
        let own = plan.stages.iter().enumerate().filter(|(_, stage)| stage.entry.name == Diagnose::NAME);
        let own: Vec<(usize, &str)> = own.map(|(at, stage)| (at, stage.id.as_str())).collect();
        let Some((at, id)) = one(&file, &own, arguments.step.as_deref())? else {
            return Err(Error::spec(file, "has no stage `diagnose`; put `- uses: diagnose` after the split"));
        };
        let id = id.to_string();
        let plan = plan.needed_for(at);
        let task = Task { purpose: Purpose::Diagnose, selection: Selection::default(), quiet: arguments.quiet };
        let outcome = arguments.means.run(&plan, &store, task, command_line)?;
        let stage = outcome.manifest.stage(&id).ok_or_else(|| Error::Bug(format!("a run without its stage `{id}`")))?;
        Told::read(&outcome.manifest.run_id, stage, &store)?
    } else {
        if arguments.means.overrides() {
            return Err(Error::spec("--set", "nothing of a run can be set again; give its pipeline instead"));
        }
        let name = arguments.what.to_string_lossy();
        let (run, step) = match name.split_once('/') {
            Some((run, step)) => (run, Some(step)),
            None => (&*name, arguments.step.as_deref()),
        };
        let (manifest, stage) = diagnosis(&store, run, step)?;
        Told::read(&manifest.run_id, &stage, &store)?
    };
    let store = arguments.means.store_again();
    if arguments.json { emit_json(&told.document(&store)) } else { emit(&told.text(&store)) }
}

/// A file, or what is named like one; everything else names a run.
fn is_pipeline(what: &Path) -> bool {
    let ending = what.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    matches!(ending.as_str(), "yaml" | "yml") || what.is_file()
}

/// A run by its name, and its stage `diagnose`: `step` where it has several. Fails with what to type where there is none.
pub(super) fn diagnosis(store: &Store, run: &str, step: Option<&str>) -> Result<(Manifest, StageReport)> {
    let manifest = Manifest::of(store, &find_run(store, run)?)?;
    let place = format!("run {}", manifest.run_id);
    let own = manifest.stages.iter().filter(|stage| stage.uses == Diagnose::NAME);
    let own: Vec<(&StageReport, &str)> = own.map(|stage| (stage, stage.id.as_str())).collect();
    let sets: String = manifest
        .overrides
        .iter()
        .map(|set| format!(" --set {}", shell::quoted(&format!("{}={}", set.target, set.value))))
        .collect();
    let again = format!("calib diagnose {}{sets}", shell::quoted(&manifest.pipeline.file));
    let Some((stage, id)) = one(&place, &own, step)? else {
        let message = format!(
            "diagnosed nothing, its pipeline has no stage `diagnose`: put `- uses: diagnose` after the split of {}, then type\n  {again}",
            manifest.pipeline.file
        );
        return Err(Error::spec(place, message));
    };
    if !matches!(stage.status, StageStatus::Cached | StageStatus::Executed) {
        let step = if own.len() > 1 { format!(" --step {}", shell::quoted(id)) } else { String::new() };
        return Err(Error::spec(place, format!("never came to its stage `{id}`; type\n  {again}{step}")));
    }
    let stage = stage.clone();
    Ok((manifest, stage))
}

/// The one that is meant; nothing where there are none.
fn one<'a, T: Copy>(place: &str, own: &[(T, &'a str)], step: Option<&str>) -> Result<Option<(T, &'a str)>> {
    let list = || own.iter().map(|(_, id)| *id).collect::<Vec<_>>().join(", ");
    match (own, step) {
        ([], _) => Ok(None),
        (_, Some(step)) => own.iter().find(|(_, id)| *id == step).copied().map(Some).ok_or_else(|| {
            let near = nearest(step, own.iter().map(|(_, id)| *id)).map(|near| format!("did you mean `{near}`? "));
            Error::spec(place, format!("no stage `{step}` diagnoses; {}allowed: {}", near.unwrap_or_default(), list()))
        }),
        ([only], None) => Ok(Some(*only)),
        _ => Err(Error::spec(place, format!("has several diagnoses; say which with --step: {}", list()))),
    }
}

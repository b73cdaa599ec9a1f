//! Options of every verb that runs a pipeline or takes its result: overrides, the store, worker threads.

use super::interrupted::says_how_to_go_on;
use super::surroundings::{cores, open_store, surroundings};
use super::{emit_json, warn};
use crate::compensate::GateLimits;
use crate::error::{Error, Fault, Result};
use crate::identified::{
    Files, IdentifiedDrives, IdentifiedModel, TargetBase, drive_steps_of, judges_of, steps_of,
};
use crate::pipeline::{
    CompletedRun, Manifest, Override, Plan, Purpose, RunOptions, Selection, checked_plan, find_run,
    run,
};
use crate::progress::{Progress, Verbosity};
use crate::raw::ending;
use crate::report::PageLanguage;
use crate::shell::typed;
use crate::spatial::Pose;
use crate::store::Store;
use crate::summary::LimitsSummary;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use nalgebra::Vector3;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::json;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A result, whose failure is also a document under `json`.
pub(super) fn reported_as<T>(json: bool, result: Result<T>) -> Result<T> {
    if let (true, Err(error)) = (json, &result) {
        emit_json(&failure(error))?;
    }
    result
}

fn failure(error: &Error) -> serde_json::Value {
    let fault = |fault: &Fault| json!({ "place": fault.place, "message": fault.message });
    let faults: Vec<serde_json::Value> = match error {
        Error::Spec(faults) | Error::Data(faults) => faults.iter().map(fault).collect(),
        Error::Store(only) => vec![fault(only)],
        Error::Bug(message) => vec![json!({ "place": "", "message": message })],
    };
    json!({ "status": "failed", "exit_code": error.exit_code(), "faults": faults })
}

#[derive(Args)]
pub(super) struct ExecutionArguments {
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
    /// Where tables and records are kept: a folder or s3://BUCKET/PREFIX [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
}

/// The languages of pages, by their codes.
pub(super) fn language_parser() -> impl TypedValueParser<Value = PageLanguage> {
    let codes = PossibleValuesParser::new(PageLanguage::ALL.map(PageLanguage::code));
    codes.map(|code| PageLanguage::of_code(&code).unwrap_or_default())
}

/// What a pipeline is run for, how much of it, and how much of its progress is shown.
pub(super) struct CommandTask {
    pub(crate) purpose: Purpose,
    pub(crate) selection: Selection,
    pub(crate) shown: Verbosity,
}

/// As much as `--quiet` and `--details` ask for.
pub(super) fn shown(quiet: bool, details: bool) -> Verbosity {
    match (quiet, details) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Detailed,
        _ => Verbosity::Normal,
    }
}

impl ExecutionArguments {
    /// With all processors.
    pub(crate) fn of(set: &[Override], store: Option<&Path>) -> Self {
        let (set, store) = (set.to_vec(), store.map(Path::to_path_buf));
        let jobs = None;
        Self { set, store, jobs }
    }

    /// Reads a pipeline. Fails with every fault of its YAML and of the robot file at once.
    pub(crate) fn plan(&self, pipeline: &Path) -> Result<Plan> {
        self.plan_with(pipeline, &[])
    }

    /// The same with more overrides, behind those of the command line.
    pub(crate) fn plan_with(&self, pipeline: &Path, more: &[Override]) -> Result<Plan> {
        checked_plan(pipeline, &[&self.set, more].concat())
    }

    pub(crate) fn store(&self) -> Result<Store> {
        open_store(self.store.as_deref())
    }

    /// Whether anything is to be set on the command line.
    pub(crate) fn overrides(&self) -> bool {
        !self.set.is_empty()
    }

    /// `--store` as it was given, to be typed again; empty for the usual place.
    pub(crate) fn store_again(&self) -> String {
        self.store.as_ref().map_or_else(String::new, |store| {
            format!(" --store {}", typed(&store.display().to_string()))
        })
    }

    fn jobs(&self) -> usize {
        self.jobs.map_or_else(cores, usize::from)
    }

    /// Runs the selected stages; with as much progress as is to be shown.
    pub(crate) fn run(
        &self,
        plan: &Plan,
        store: &Store,
        task: CommandTask,
        command_line: &[OsString],
    ) -> Result<CompletedRun> {
        says_how_to_go_on();
        let progress = Progress::new(task.shown, plan.width_of_ids());
        let options = RunOptions {
            selection: task.selection,
            jobs: self.jobs(),
            purpose: task.purpose,
        };
        let around = surroundings(command_line);
        let result = run(plan, store, &options, &around, &progress);
        progress.finish();
        result
    }
}

/// Reads `own`, `smallest` or six numbers.
fn target_base(text: &str) -> std::result::Result<TargetBase, String> {
    match text {
        "own" => return Ok(TargetBase::Own),
        "smallest" => return Ok(TargetBase::Smallest),
        _ => {}
    }
    let number = |part: &str| {
        part.trim()
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite())
    };
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    let Ok([x, y, z, rx, ry, rz]) = <[f64; 6]>::try_from(numbers.unwrap_or_default()) else {
        return Err(
            "allowed: own, smallest, or the base in the tracker's frame as six numbers X,Y,Z,RX,RY,RZ in mm and deg (turned about the fixed axes x, \
             then y, then z)"
                .into(),
        );
    };
    let turn = |axis: [f64; 3], angle: f64| {
        Pose::from_rotation_vector(Vector3::from(axis) * angle.to_radians(), Vector3::zeros())
    };
    let turned = turn([0.0, 0.0, 1.0], rz) * turn([0.0, 1.0, 0.0], ry) * turn([1.0, 0.0, 0.0], rx);
    Ok(TargetBase::Given(Pose {
        translation: Vector3::new(x, y, z) * 1e-3,
        ..turned
    }))
}

/// Where the model comes from.
#[derive(Args)]
pub(super) struct ModelArguments {
    /// A pipeline (its stages run as far as they are not done), a run as `calib log` names it (`latest` is HEAD, the last complete one), or a
    /// table `parameters` (Parquet)
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// The stage whose parameters to take [default: the last `diagnose`, else the last that writes some; the one before it where
    /// held-out points are worse after it]
    #[arg(long, value_name = "STAGE")]
    step: Option<String>,
    /// The robot, where MODEL is a table: calib's YAML, a practice robot.json, or a table `robot` (Parquet)
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// Takes tables without a content hash, which another program wrote, and tables of an earlier calib, which do not say which robot they
    /// are the model of, as they are; a hash that does not hold is refused all the same
    #[arg(long)]
    unchecked: bool,
    /// The base that targets are in: `own`, the robot's as it is identified under tolerances; `smallest`, the one in which the robot as it was
    /// believed is nearest to what was measured, for a cell that was taught with this robot; or where it was measured, in the tracker's frame:
    /// X,Y,Z,RX,RY,RZ in mm and deg about the fixed axes x, then y, then z
    #[arg(long, value_name = "WHICH", value_parser = target_base, default_value = "own", allow_hyphen_values = true)]
    base: TargetBase,
    /// Largest distance of the model's tool, or of a link or a joint's zero in mm, from the robot file's: a model beyond is refused
    #[arg(long, value_name = "MM", default_value_t = 50.0)]
    max_shift: f64,
    /// Largest turn of the model's tool, of a link or of a joint's zero from the robot file's, deg
    #[arg(long, value_name = "DEG", default_value_t = 5.0)]
    max_tilt: f64,
    /// Insists on a model that is refused (set-up wrong, limits of the report exceeded, further from the robot file than --max-shift or
    /// --max-tilt), and on commands and files that are refused; what is written says so
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    means: ExecutionArguments,
    /// Prints no progress and no summary; warnings and errors remain
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

impl ModelArguments {
    /// As many workers as are asked for.
    pub(crate) fn threads(&self) -> Result<ThreadPool> {
        let threads = ThreadPoolBuilder::new().num_threads(self.means.jobs());
        threads
            .build()
            .map_err(|error| Error::store("--jobs", error.to_string()))
    }

    /// Loads the model and says what is to be known of it; runs the pipeline's stages that are not done.
    pub(crate) fn load(
        &self,
        purpose: Purpose,
        command_line: &[OsString],
    ) -> Result<IdentifiedModel> {
        let limits = [
            ("--max-shift", Some(self.max_shift)),
            ("--max-tilt", Some(self.max_tilt)),
        ];
        Error::if_spec(must_be_positive(limits).collect())?;
        let mut identified = self.identified(purpose, command_line)?;
        warn(&identified.warnings);
        if self.base == TargetBase::Smallest && identified.data.is_none() {
            let message = "needs the recording that the model was fitted to; a table of parameters alone has none: name a run";
            return Err(Error::spec("--base", message));
        }
        identified.base = self.base;
        if self.base == TargetBase::Own {
            match identified.base_turned() {
                Some((message, true)) => identified.refusals.push(message),
                turned => warn(turned.map(|(message, _)| message)),
            }
        }
        self.judged(identified)
    }

    /// The drives that a pipeline or a run diagnosed; none where it identified positions or torques, or nothing of drives.
    pub(crate) fn drives(
        &self,
        purpose: Purpose,
        command_line: &[OsString],
    ) -> Result<Option<IdentifiedDrives>> {
        let step = self.step.as_deref();
        match &*ending(&self.model) {
            "parquet" => Ok(None),
            "yaml" | "yml" => {
                let plan = self.means.plan(&self.model)?;
                let wanted = drive_steps_of(&plan);
                if wanted.is_empty() {
                    return Ok(None);
                }
                let task = CommandTask {
                    purpose,
                    selection: Selection::default(),
                    shown: shown(self.quiet, false),
                };
                let (store, plan) = (self.means.store()?, plan.needed_for_all(&wanted));
                let done = self.means.run(&plan, &store, task, command_line)?;
                IdentifiedDrives::of_run(&store, &done.manifest, step)
            }
            _ => {
                let store = self.means.store()?;
                let manifest = Manifest::of(&store, &self.run(&store)?)?;
                IdentifiedDrives::of_run(&store, &manifest, step)
            }
        }
    }

    /// A model that no commands are to be made of is refused, or insisted on.
    fn judged(&self, mut identified: IdentifiedModel) -> Result<IdentifiedModel> {
        let limits = GateLimits {
            shift: self.max_shift * 1e-3,
            tilt: self.max_tilt.to_radians(),
            ..GateLimits::default()
        };
        let gate = identified.gate(limits, self.force);
        if !self.force {
            identified.accepted(&gate, "--force")?;
        }
        identified.refusals = gate.model;
        let refusals = identified.refusals.iter();
        warn(refusals.map(|reason| format!("used because of --force: {reason}")));
        Ok(identified)
    }

    fn identified(&self, purpose: Purpose, command_line: &[OsString]) -> Result<IdentifiedModel> {
        let ending = ending(&self.model);
        if ending == "parquet" {
            let Some(robot) = self.robot.clone() else {
                let message = "say which robot the parameters are of: --robot robot.yaml, or the table `robot` of the same run";
                return Err(Error::spec(self.model.display().to_string(), message));
            };
            return IdentifiedModel::of_files(&Files {
                parameters: self.model.clone(),
                robot,
                unchecked: self.unchecked,
            });
        }
        if self.robot.is_some() {
            return Err(Error::spec(
                "--robot",
                "is of tables of parameters alone; a run or a pipeline knows its robot: leave it out",
            ));
        }
        let store = self.means.store()?;
        let is_pipeline = matches!(ending.as_str(), "yaml" | "yml");
        let manifest = if is_pipeline {
            let plan = self.means.plan(&self.model)?;
            // A report with limits says whether the model is accepted.
            let wanted = [steps_of(&plan)?, judges_of(&plan)].concat();
            let task = CommandTask {
                purpose,
                selection: Selection::default(),
                shown: shown(self.quiet, false),
            };
            let plan = plan.needed_for_all(&wanted);
            self.means.run(&plan, &store, task, command_line)?.manifest
        } else {
            Manifest::of(&store, &self.run(&store)?)?
        };
        let mut identified = IdentifiedModel::of_run(&store, &manifest, self.step.as_deref())?;
        let exceeded = LimitsSummary::of(&manifest, &store)?.exceeded();
        identified.refusals.extend(exceeded);
        // A pipeline's stages say it themselves.
        if !is_pipeline {
            identified.warnings.append(&mut identified.stage_warnings);
        }
        Ok(identified)
    }

    /// The id of a run by its name.
    fn run(&self, store: &Store) -> Result<String> {
        let name = self.model.to_string_lossy();
        let asked = if name == "latest" { "HEAD" } else { &*name };
        find_run(store, asked).map_err(|error| match error {
            Error::Spec(faults) => {
                let why = faults
                    .into_iter()
                    .next()
                    .map(|fault| fault.message)
                    .unwrap_or_default();
                Error::spec(
                    &*name,
                    format!("neither a pipeline (.yaml), a table (.parquet) nor a run: {why}"),
                )
            }
            other => other,
        })
    }
}

/// Faults of options that must be above 0 where they are given.
pub(super) fn must_be_positive<const N: usize>(
    options: [(&'static str, Option<f64>); N],
) -> impl Iterator<Item = Fault> {
    options.into_iter().filter_map(|(option, given)| {
        let given = given.filter(|given| !(given.is_finite() && *given > 0.0))?;
        let message = format!("expected a number above 0, found {given}");
        Some(Fault::new(option, message))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_is_a_word_or_six_numbers_and_nothing_else() {
        assert_eq!(target_base("smallest"), Ok(TargetBase::Smallest));
        let Ok(TargetBase::Given(base)) = target_base("1500, -900, 200, 0, 0, 90") else {
            panic!("six numbers are a base");
        };
        let tip = base.point(&Vector3::new(0.1, 0.0, 0.0));
        assert!((tip - Vector3::new(1.5, -0.8, 0.2)).norm() < 1e-12, "{tip}");
        for wrong in ["", "measured", "1,2,3", "1,2,3,4,5,6,x", "1,2,3,4,5,nan"] {
            let message = target_base(wrong).unwrap_err();
            assert!(message.starts_with("allowed: own, smallest, or"), "{wrong}");
        }
    }
}

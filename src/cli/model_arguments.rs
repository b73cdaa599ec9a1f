//! The identified model that a verb works with: from a pipeline, a run in the store, or a table of parameters.

use super::means::{CommandTask, Means};
use crate::compensate::Gate;
use crate::error::{Error, Fault, Result};
use crate::identified::{Files, IdentifiedModel, steps_of};
use crate::pipeline::{Manifest, Purpose, Selection, find_run};
use crate::raw::ending;
use crate::store::Store;
use crate::summary::LimitsSummary;
use clap::Args;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

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
    /// Takes tables without a content hash, which another program wrote, as they are; a hash that does not hold is refused all the same
    #[arg(long)]
    unchecked: bool,
    /// Insists on a model that is refused (set-up wrong, limits of the report exceeded, further from the robot file than 50 mm or 5 deg in
    /// its tool, a link or a joint's zero), and on commands and files that are refused; what is written says so
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    means: Means,
    /// Prints no progress and no summary; warnings and errors remain
    #[arg(long, short)]
    pub quiet: bool,
}

impl ModelArguments {
    pub fn jobs(&self) -> usize {
        self.means.jobs()
    }

    /// Loads the model and says what is to be known of it; runs the pipeline's stages that are not done.
    pub fn load(&self, purpose: Purpose, command_line: &[OsString]) -> Result<IdentifiedModel> {
        let identified = self.identified(purpose, command_line)?;
        for warning in &identified.warnings {
            let _ = writeln!(std::io::stderr(), "warning: {warning}");
        }
        self.judged(identified)
    }

    /// A model that no commands are to be made of is refused, or insisted on.
    fn judged(&self, mut identified: IdentifiedModel) -> Result<IdentifiedModel> {
        identified.refusals.extend(Gate::default().beyond(&identified.model));
        if identified.refusals.is_empty() {
            return Ok(identified);
        }
        if self.force {
            for reason in &identified.refusals {
                let _ = writeln!(std::io::stderr(), "warning: used because of --force: {reason}");
            }
            return Ok(identified);
        }
        let fault =
            |reason: &String| Fault::new(&identified.origin, format!("refused: {reason}. Correct that, or insist with --force"));
        Err(Error::Data(identified.refusals.iter().map(fault).collect()))
    }

    fn identified(&self, purpose: Purpose, command_line: &[OsString]) -> Result<IdentifiedModel> {
        let ending = ending(&self.model);
        if ending == "parquet" {
            let Some(robot) = self.robot.clone() else {
                let message = "say which robot the parameters are of: --robot robot.yaml, or the table `robot` of the same run";
                return Err(Error::spec(self.model.display().to_string(), message));
            };
            return IdentifiedModel::of_files(&Files { parameters: self.model.clone(), robot, unchecked: self.unchecked });
        }
        let (store, step) = (self.means.store()?, self.step.as_deref());
        if !matches!(ending.as_str(), "yaml" | "yml") {
            let manifest = Manifest::of(&store, &self.run(&store)?)?;
            let mut identified = IdentifiedModel::of_run(&store, &manifest, step)?;
            identified.refusals.extend(LimitsSummary::of(&manifest, &store)?.exceeded());
            // A pipeline's stages say it themselves.
            identified.warnings.append(&mut identified.stage_warnings);
            return Ok(identified);
        }
        let plan = self.means.plan(&self.model)?;
        let steps = steps_of(&plan)?;
        let task = CommandTask { purpose, selection: Selection::default(), quiet: self.quiet };
        let outcome = self.means.run(&plan.needed_for_all(&steps), &store, task, command_line)?;
        IdentifiedModel::of_run(&store, &outcome.manifest, step)
    }

    /// The id of a run by its name.
    fn run(&self, store: &Store) -> Result<String> {
        let name = self.model.to_string_lossy();
        let asked = if name == "latest" { "HEAD" } else { &*name };
        find_run(store, asked).map_err(|error| match error {
            Error::Spec(faults) => {
                let why = faults.into_iter().next().map(|fault| fault.message).unwrap_or_default();
                Error::spec(&*name, format!("neither a pipeline (.yaml), a table (.parquet) nor a run: {why}"))
            }
            other => other,
        })
    }
}

//! The identified model of a run, or of tables that were taken out of a store: what commands are corrected with and what is exported.

mod controller_base;
mod drives;
mod standing;
mod torques;

pub(crate) use drives::{IdentifiedDrives, drive_steps_of};
pub(crate) use standing::placed;
pub use standing::{
    Achieved, RepeatedPose, achieved, convention_of, counted_otherwise, robot_file, standing_of,
    wrong_setup_of,
};
use standing::{last, output, unexplained_of, written};
pub use torques::IdentifiedTorques;

use crate::compensate::{
    Chain, Circumstance, Gate, GateLimits, IdentifiedArm, Nominal, Scatter, Uncertainty,
    load_matters,
};
use crate::description::{JointDescription, JointKind, RobotDescription};
use crate::effect::Load;
use crate::error::{Error, Fault, Result, instead};
use crate::estimate::network::Correction;
use crate::estimate::{Covariance, Model, align};
use crate::pipeline::{Manifest, Plan, RunStatus, StageReport};
use crate::raw::ending;
use crate::robot::{JointConvention, Measurements, RobotModel, Visited};
use crate::spatial::Pose;
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::frame::Frame;
use crate::store::{Store, TableRef};
use crate::table::{
    Corrected, CovarianceTable, Document, Loose, Network, Parameters, Recording, Robot, Standing,
    Table, TablesByKind, TorqueParameters, from_file, of_kind,
};
use std::path::{Path, PathBuf};

/// How a stage's warning of a wrong set-up begins.
const WRONG_SETUP: &str = "the set-up is wrong";

/// The base that targets are in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum TargetBase {
    /// The robot's own, as it is identified under tolerances.
    #[default]
    Own,
    /// That in which the robot as it was believed is nearest to what was measured: of a cell that was taught with this robot.
    Smallest,
    /// Where it was measured, or a frame of the user's: in the tracker's frame.
    Given(Pose),
}

/// How far commands miss in the robot's own base may exceed what they miss in the base of least change by this factor ...
const TURNED: f64 = 4.0 / 3.0;
/// ... and by this much (m): else it is said; from so many times on it is refused.
const MOVED: f64 = 0.1e-3;
const ELSEWHERE: f64 = 3.0;

/// What was identified, and from what.
pub struct IdentifiedModel {
    /// The nominal arm.
    pub robot: RobotDescription,
    /// The table that the model was read from.
    pub parameters: Parameters,
    /// Nominal arm, effects and their values.
    pub model: Model,
    /// What was identified of the torques, if anything.
    pub(crate) torques: Option<IdentifiedTorques>,
    /// What was learned on top, if anything.
    pub(crate) correction: Option<Correction>,
    /// Covariance of the estimated parameters, where it is known.
    pub(crate) covariance: Option<Covariance>,
    /// How the arm scatters about the model.
    pub(crate) scatter: Scatter,
    /// The recording, where it is known.
    pub(crate) data: Option<Measurements>,
    /// How the controller counts its joints; none where a table alone was given, which does not say.
    pub(crate) convention: Option<JointConvention>,
    /// The serial number of the robot, as the pipeline's report states it.
    pub(crate) serial: Option<String>,
    /// Where the parameters come from, e.g. `run 01J..., stage geometry`.
    pub origin: String,
    /// What the last diagnosis left without a cause, if anything.
    pub(crate) unexplained: Option<String>,
    /// What the person must know of it.
    pub warnings: Vec<String>,
    /// What the stage that identified it, or learned on top, warned of when it ran.
    pub(crate) stage_warnings: Vec<String>,
    /// Why no commands are to be made of it, a sentence each.
    pub(crate) refusals: Vec<String>,
    /// The files that it was made from.
    pub(crate) sources: Vec<PathBuf>,
    /// The base that targets are in.
    pub(crate) base: TargetBase,
}

/// A table of parameters as a file, and the robot that they are of.
pub struct Files {
    /// A table `parameters`, Parquet.
    pub parameters: PathBuf,
    /// A robot file, or a table `robot`.
    pub robot: PathBuf,
    /// Takes tables that carry no content hash, or do not say whose model they are.
    pub unchecked: bool,
}

/// Whether a stage of a plan writes a table of a kind.
fn writes(plan: &Plan, at: usize, kind: &str) -> bool {
    let mut outputs = plan.stages[at].outputs.iter();
    outputs.any(|port| port.kind == kind)
}

/// The stages of a plan that identify or learn: which of them stands is known once all have predicted.
pub(crate) fn steps_of(plan: &Plan) -> Result<Vec<usize>> {
    let kinds = [Parameters::KIND, Network::KIND, TorqueParameters::KIND];
    let steps: Vec<usize> = (0..plan.stages.len())
        .filter(|at| kinds.iter().any(|kind| writes(plan, *at, kind)))
        .collect();
    if steps.is_empty() {
        let message = "identifies nothing; put a stage `identify` after the split, or `diagnose_torques` after `ingest_torques`";
        return Err(Error::spec(plan.file.display().to_string(), message));
    }
    Ok(steps)
}

/// The stages of a plan whose reports judge by limits that the user set.
pub(crate) fn judges_of(plan: &Plan) -> Vec<usize> {
    let limited = |at: &usize| {
        let settings = plan.stages[*at].stage.settings();
        let limits = settings.get("limits").and_then(|limits| limits.as_object());
        limits.is_some_and(|limits| limits.values().any(|limit| !limit.is_null()))
    };
    let reports = |at: &usize| writes(plan, *at, Document::KIND);
    let stages = 0..plan.stages.len();
    stages.filter(reports).filter(limited).collect()
}

impl IdentifiedModel {
    /// The model of a run that is done: of `step`, else of the step that stands for it, else of the last stage that writes parameters.
    pub fn of_run(store: &Store, manifest: &Manifest, step: Option<&str>) -> Result<Self> {
        let run = &manifest.run_id;
        let status = match manifest.status {
            RunStatus::Done => None,
            RunStatus::Failed => Some("failed"),
            RunStatus::Running => Some("running or was killed"),
        };
        if let Some(status) = status {
            let message = format!("the run {status}, it is not done");
            return Err(Error::spec(run, message));
        }
        let wrong = wrong_setup_of(manifest, store)?;
        if let (None, Some(wrong)) = (step, &wrong) {
            let message = format!(
                "none of its models is usable: {wrong}. Correct that and run again, or choose a step explicitly with --step and --force"
            );
            return Err(Error::data(run, message));
        }
        let stands = match step {
            None => standing_of(manifest, store)?,
            Some(_) => None,
        };
        let load = |table: &TableRef| load(store, table, manifest);
        let robot = last::<Robot>(manifest, store)?;
        let robot = robot.ok_or_else(|| Error::spec(run, "the run has no table `robot`"))?;
        let robot = robot.to_description()?;
        let files = manifest.stages.iter().flat_map(|stage| &stage.files);
        let files = files.map(|file| &file.path);
        let sources = files.chain([&manifest.pipeline.file]);
        let sources = sources.map(PathBuf::from).collect();
        let serial = serial(&manifest.pipeline.resolved);
        let alone = step.is_some() || manifest.tables(Parameters::KIND).next().is_none();
        let torques = match IdentifiedTorques::of_run(manifest, step, &robot, load)? {
            Some(torques) if alone => {
                return Ok(Self {
                    sources,
                    serial,
                    ..Self::of_torques(robot, torques)?
                });
            }
            other => other,
        };
        let (stage, table) = chosen(manifest, step, stands.as_ref())?;
        // A correction was learned on top of one model and belongs to no other.
        let is_learned = |stage: &&StageReport| {
            let mut withdrawn = stands.iter().flat_map(|stands| &stands.withdrawn);
            let mut inputs = stage.inputs.iter();
            !withdrawn.any(|gone| gone.step == stage.id)
                && inputs.any(|input| input.table.table_hash == table.table_hash)
                && output(stage, Network::KIND).is_some()
        };
        let learned = manifest.stages.iter().rfind(is_learned);
        let network = learned.map(|stage| written::<Network>(stage, load));
        let convention = convention_of(manifest, store)?
            .unwrap_or_else(|| JointConvention::of_the_robot_file(robot.joints.len()));
        let data = last::<Recording>(manifest, store)?.map(|table| table.measurements());
        let is_prismatic = |joint: &JointDescription| joint.kind == JointKind::Prismatic;
        let prismatic: Vec<bool> = robot.joints.iter().map(is_prismatic).collect();
        let correction = match network.transpose()?.flatten() {
            Some(network) => network.correction(&prismatic)?,
            None => None,
        };
        let unexplained = unexplained_of(manifest, store)?;
        let warnings = stands.iter().flat_map(Standing::warnings);
        let warnings = warnings.chain(unexplained.clone()).collect();
        let mut stated = manifest.stages.iter().flat_map(|stage| &stage.warnings);
        let reason = stated.find(|line| line.starts_with(WRONG_SETUP)).cloned();
        let learned = learned.filter(|_| correction.is_some());
        let warnings_of = |stage: &StageReport| -> Vec<String> {
            let lines = stage.warnings.iter();
            lines.map(|line| format!("{}: {line}", stage.id)).collect()
        };
        let stages = [Some(stage), learned].into_iter().flatten();
        let of_stage = |stage: &StageReport, kind: &str| output(stage, kind).map(load).transpose();
        let of_learned = learned.map(|learned| move |kind: &str| of_stage(learned, kind));
        let of_learned = of_learned.as_ref().map(|tables| tables as &TablesByKind);
        let origin = format!("run {run}, stage {}", stage.id);
        Ok(Self {
            serial,
            torques,
            correction,
            data,
            convention: Some(convention),
            unexplained,
            warnings,
            stage_warnings: stages.flat_map(warnings_of).collect(),
            refusals: wrong.or(reason).into_iter().collect(),
            sources,
            ..Self::of_tables(robot, origin, &|kind| of_stage(stage, kind), of_learned)?
        })
    }

    /// The model that a stage identified, by the tables that it wrote; `learned`: those of the stage that learned a correction on top.
    pub(crate) fn of_tables(
        robot: RobotDescription,
        origin: String,
        tables: &TablesByKind,
        learned: Option<&TablesByKind>,
    ) -> Result<Self> {
        let model = Self::of(robot, of_kind(tables)?.unwrap_or_default(), origin)?;
        let covariance = of_kind::<CovarianceTable>(tables)?;
        Ok(Self {
            covariance: covariance.and_then(|table| table.of_model(&model.model)),
            scatter: standing::of(tables, learned)?,
            ..model
        })
    }

    /// Limits of corrections, with why the model is refused where one insists on it.
    pub(crate) fn gate(&self, limits: GateLimits, insisted: bool) -> Gate {
        let mut gate = Gate {
            limits,
            insisted,
            model: Vec::new(),
        };
        if insisted {
            gate.model.clone_from(&self.refusals);
            gate.model.extend(gate.beyond(&self.model));
        }
        gate
    }

    /// Fails with all reasons why no commands are to be made of the model; `insist` says how one insists on it.
    pub(crate) fn accepted(&self, gate: &Gate, insist: &str) -> Result<()> {
        let reasons = [self.refusals.clone(), gate.beyond(&self.model)].concat();
        let fault = |reason: &String| {
            Fault::new(
                &self.origin,
                format!("refused: {reason}. Correct that, or insist with {insist}"),
            )
        };
        match reasons.is_empty() {
            true => Ok(()),
            false => Err(Error::Data(reasons.iter().map(fault).collect())),
        }
    }

    /// Torques alone: positions are those of the robot file.
    fn of_torques(robot: RobotDescription, torques: IdentifiedTorques) -> Result<Self> {
        let (warnings, refusals) = (torques.warnings.clone(), torques.refusals.clone());
        let nominal = Self::of(robot, Parameters::default(), torques.origin.clone())?;
        Ok(Self {
            torques: Some(torques),
            warnings,
            refusals,
            ..nominal
        })
    }

    /// Whether torques were identified and positions were not.
    pub(crate) fn is_of_torques_alone(&self) -> bool {
        self.torques.is_some() && self.parameters.0.is_empty()
    }

    /// The model of a table of parameters; robots come as a table `robot`, in the practice layout, or as calib's YAML.
    pub fn of_files(files: &Files) -> Result<Self> {
        let (mut warnings, place) = (Vec::new(), files.parameters.display().to_string());
        let torques = from_file::<TorqueParameters>(&files.parameters).ok();
        let parameters = match &torques {
            Some(_) => Parameters::default(),
            None => {
                let loose = from_file::<Parameters>(&files.parameters)?;
                files.vouched(&files.parameters, loose, &mut warnings)?
            }
        };
        let says = torques.as_ref().map_or_else(
            || parameters.says_its_robot(),
            |torques| torques.table.says_its_robot(),
        );
        if !says {
            let message =
                "does not say which robot it is the model of, as tables of an earlier calib do not";
            if !files.unchecked {
                let message = format!(
                    "{message}: identify anew, or take it as the model of this robot with --unchecked"
                );
                return Err(Error::data(place, message));
            }
            warnings.push(format!("{place} {message}"));
        }
        let robot = if ending(&files.robot) == "parquet" {
            let loose = from_file::<Robot>(&files.robot)?;
            let table = files.vouched(&files.robot, loose, &mut warnings)?;
            table.to_description()?
        } else {
            robot_file(&files.robot, None)?
        };
        let origin = format!("table {place}");
        let mut model = match torques {
            Some(loose) => {
                let table = files.vouched(&files.parameters, loose, &mut warnings)?;
                let torques = IdentifiedTorques::of(&robot, table, origin)?;
                Self::of_torques(robot, torques)?
            }
            None => Self::of(robot, parameters, origin)?,
        };
        model.warnings = [warnings, model.warnings].concat();
        model.sources = vec![files.parameters.clone(), files.robot.clone()];
        Ok(model)
    }

    fn of(robot: RobotDescription, parameters: Parameters, origin: String) -> Result<Self> {
        if parameters.corrected() == Corrected::OutsideSimulation {
            let message = "these parameters correct the simulation of sim_x, sim_y, sim_z, not the model of the robot file, which alone can be \
                           compensated and exported: take another stage's with --step, or diagnose the recording without these columns";
            return Err(Error::spec(origin, message));
        }
        let model = parameters.model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)?;
        Ok(Self {
            robot,
            parameters,
            model,
            torques: None,
            correction: None,
            covariance: None,
            scatter: Scatter::default(),
            data: None,
            convention: None,
            serial: None,
            origin,
            unexplained: None,
            warnings: Vec::new(),
            stage_warnings: Vec::new(),
            refusals: Vec::new(),
            sources: Vec::new(),
            base: TargetBase::Own,
        })
    }

    /// The arm that commands are corrected with, in the base that targets are in.
    pub(crate) fn arm(&self) -> IdentifiedArm {
        let arm = IdentifiedArm::new(self.model.clone(), self.correction.clone());
        match (self.base, &self.data) {
            (TargetBase::Smallest, Some(data)) => {
                let base = self.base_of_least_change(&arm, data);
                arm.standing_at(base)
            }
            (TargetBase::Given(base), _) => arm.standing_at(base),
            _ => arm,
        }
    }

    /// The base in which the robot as it was believed is nearest to what the model says of the recorded poses.
    fn base_of_least_change(&self, arm: &IdentifiedArm, data: &Measurements) -> Pose {
        let mut as_identified = data.clone();
        as_identified.points.position = arm.model().predict(data);
        let rows: Vec<usize> = (0..data.rows()).collect();
        align(&self.model.robot, &as_identified, &rows)
    }

    /// Why targets in the robot's own base would be moved by more than the robot is wrong, and whether by far more; none where they are not.
    pub(crate) fn base_turned(&self) -> Option<(String, bool)> {
        let data = self.data.as_ref().filter(|data| data.rows() > 0)?;
        let own = IdentifiedArm::new(self.model.clone(), self.correction.clone());
        let least = self.base_of_least_change(&own, data);
        let missed = |arm: &IdentifiedArm| -> f64 {
            let (mut reach, mut nominal) = (arm.reach(), Nominal::new(&arm.model().robot));
            let mut sum = 0.0;
            for row in 0..data.rows() {
                reach.under(&Circumstance::of_row(data, row));
                let q = data.q(row);
                sum += (reach.place(q).translation - nominal.place(q).translation).norm();
            }
            sum / data.rows() as f64
        };
        let own_missed = missed(&own);
        let least_missed = missed(&own.standing_at(least));
        let turned = own_missed > TURNED * least_missed && own_missed - least_missed > MOVED;
        turned.then(|| {
            let message = format!(
                "targets in the robot's own base are {:.2} mm off uncorrected, where the robot as it was believed leaves {:.2} mm of the same poses: where \
                 the base is hangs on parameters that these data do not determine; measure it and state it (--base X,Y,Z,RX,RY,RZ), or take the base of \
                 least change (--base smallest)",
                own_missed * 1e3,
                least_missed * 1e3
            );
            (message, own_missed > ELSEWHERE * least_missed)
        })
    }

    /// The base that targets are in, in words; `known`: how well points are known in the robot's own, m, 95 %.
    pub(crate) fn base_in_words(&self, known: f64) -> String {
        let within = match known > 0.0 {
            true => format!(", and known there to {:.2} mm (95 %)", known * 1e3),
            false => String::new(),
        };
        match self.base {
            TargetBase::Own => format!("targets are in the robot's own base, as it is identified{within}"),
            TargetBase::Smallest => {
                "targets are in the base in which the robot as it was believed is nearest to what was measured".into()
            }
            TargetBase::Given(_) => "targets are in the base that --base states".into(),
        }
    }

    /// The largest load that was measured, kg; none where all rows carried nothing, or no recording is at hand.
    fn heaviest(&self) -> Option<f64> {
        let loads = self.data.iter().flat_map(|data| &data.payload).copied();
        loads.filter(|load| *load > 0.0).max_by(f64::total_cmp)
    }

    /// The same where commands must state theirs: the arm depends on it.
    pub(crate) fn needed_load(&self, arm: &IdentifiedArm) -> Option<f64> {
        self.heaviest().filter(|load| load_matters(arm, *load))
    }

    /// How joints are counted in what goes out, where that is to be said: none where controller and robot file count alike.
    pub(crate) fn counting(&self) -> Option<String> {
        let Some(convention) = &self.convention else {
            return Some(
                "joints are counted as in the robot file; a table of parameters does not say how the controller counts".into(),
            );
        };
        let difference = convention.difference(&self.model.robot)?;
        Some(format!(
            "joints are counted as at the controller: {difference}"
        ))
    }

    /// Refuses to write over a file that the model was made from.
    pub(crate) fn spare(&self, out: Option<&Path>) -> Result<()> {
        let place = |path: &Path| path.canonicalize().ok();
        let Some((out, there)) = out.and_then(|out| Some((out, place(out)?))) else {
            return Ok(());
        };
        if !self
            .sources
            .iter()
            .any(|source| place(source).as_ref() == Some(&there))
        {
            return Ok(());
        }
        let message = format!(
            "{} is a file that the model was made from: name another file",
            out.display()
        );
        Err(Error::spec("--out", message))
    }

    /// What the uncertainty of a target is made of; none where a table alone was given.
    pub(crate) fn coverage(&self) -> Option<Visited> {
        let data = self.data.as_ref().filter(|data| data.rows() > 0)?;
        Some(Visited::of(data, &(0..data.rows()).collect::<Vec<_>>()))
    }

    /// How far a commanded position may be off, from the rows that the model was fitted to; none for a table of parameters alone.
    pub(crate) fn uncertainty(&self, arm: &IdentifiedArm) -> Option<Uncertainty> {
        let uncertainty = Uncertainty::new(arm, self.covariance.clone()?, self.scatter);
        Some(match &self.data {
            Some(data) => uncertainty.with_recording(arm, data),
            None => uncertainty,
        })
    }
}

/// What a pipeline's report states as the serial number of the robot.
fn serial(pipeline: &serde_json::Value) -> Option<String> {
    let stages = pipeline.get("stages")?.as_array()?.iter();
    let stated = stages.filter_map(|stage| stage.get("with")?.get("identity")?.as_object());
    let numbers = stated
        .flatten()
        .filter(|(key, _)| key.to_lowercase().contains("serial"));
    let robot = |(key, _): &(&String, &serde_json::Value)| !key.to_lowercase().contains("robot");
    numbers
        .min_by_key(robot)
        .and_then(|(_, value)| value.as_str())
        .map(String::from)
}

/// The stage whose parameters are taken, and the parameters.
fn chosen<'m>(
    manifest: &'m Manifest,
    step: Option<&str>,
    stands: Option<&Standing>,
) -> Result<(&'m StageReport, &'m TableRef)> {
    let with = |stage: &'m StageReport| Some((stage, output(stage, Parameters::KIND)?));
    let found: Vec<(&StageReport, &TableRef)> = manifest.stages.iter().filter_map(with).collect();
    let of_id = |id: &str| found.iter().find(|(stage, _)| stage.id == id);
    if let Some(step) = step {
        let ids: Vec<&str> = found.iter().map(|(stage, _)| stage.id.as_str()).collect();
        let message = || format!("no stage `{step}` writes parameters{}", instead(step, &ids));
        let taken = of_id(step).copied();
        return taken.ok_or_else(|| Error::spec("--step", message()));
    }
    let standing = stands.and_then(|stands| of_id(&stands.model));
    let mut diagnosed = found.iter().rev();
    let diagnosed = diagnosed.find(|(stage, _)| stage.uses == Diagnose::NAME);
    let taken = standing.or(diagnosed).or(found.last()).copied();
    taken.ok_or_else(|| Error::spec(&manifest.run_id, "the run identified nothing"))
}

/// A table of a run, of which nothing is made anew here: one that is damaged or gone is refused.
fn load(store: &Store, table: &TableRef, manifest: &Manifest) -> Result<Frame> {
    let path = store.object(table)?;
    if !store.is_whole(table)? {
        let message = format!(
            "is not the table that run {} wrote: it is damaged or was removed. `calib run {}` restores it",
            manifest.run_id, manifest.pipeline.file
        );
        return Err(Error::data(path.display().to_string(), message));
    }
    store.load(table)
}

impl Files {
    /// A table whose numbers are those that calib wrote, or that the person takes as they are.
    fn vouched<T>(&self, path: &Path, loose: Loose<T>, warnings: &mut Vec<String>) -> Result<T> {
        let place = path.display().to_string();
        match (loose.vouched, self.unchecked) {
            (true, _) => {}
            (false, true) => warnings.push(format!(
                "{place} carries no content hash: its numbers cannot be verified"
            )),
            (false, false) => {
                let message = "carries no content hash, so another program wrote it: calib cannot tell whether its numbers were changed since they were \
                               identified, and they will move a robot. Take the file that calib wrote (`tables/` in the store), or give \
                               --unchecked";
                return Err(Error::data(place, message));
            }
        }
        Ok(loose.table)
    }
}

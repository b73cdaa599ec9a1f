//! What a run identified of the arm's torques: the model that motions are fed forward with and exports are made of.

use super::standing::{output, written};
use crate::description::RobotDescription;
use crate::dynamics::{DynamicArm, TorqueModel};
use crate::error::Result;
use crate::pipeline::{Manifest, StageReport};
use crate::stage::{dynamic_arm, torque_per_ampere};
use crate::store::TableRef;
use crate::store::frame::Frame;
use crate::table::{
    Robot, Table, TorqueCovariance, TorqueFindings, TorqueParameters, TorqueVerdict,
};

/// The model of torques, and the arm that it is of.
pub struct IdentifiedTorques {
    /// As declared.
    pub(crate) arm: DynamicArm,
    /// What was identified.
    pub(crate) model: TorqueModel,
    /// The table that it was read from.
    pub(crate) parameters: TorqueParameters,
    /// Nm at the joint per ampere of its motor, as declared; none where the robot file does not say it.
    pub(crate) per_ampere: Option<Vec<f64>>,
    /// Findings that belong to the recording and to no motion that is planned (latency, contacts), a sentence each.
    pub(crate) of_the_recording: Vec<String>,
    /// Where it comes from, e.g. `run 01J..., stage diagnose_torques`.
    pub(crate) origin: String,
    /// What the person must know of it.
    pub(crate) warnings: Vec<String>,
    /// Why no torques are to be made of it.
    pub(crate) refusals: Vec<String>,
}

/// Findings that are no part of the model.
const OF_THE_RECORDING: [&str; 2] = ["current_latency", "contact"];

impl IdentifiedTorques {
    /// The model in a table, for a robot. Fails where the table is no model of torques.
    pub(super) fn of(
        robot: &RobotDescription,
        parameters: TorqueParameters,
        origin: String,
    ) -> Result<Self> {
        parameters.must_be_of(robot)?;
        let (arm, _) = dynamic_arm(robot)?;
        let model = parameters.to_model()?;
        let mut warnings = Vec::new();
        if !(0..model.joints()).all(|link| model.is_whole(link)) {
            let warning = "masses are identified as base parameters: no link has masses of its own, and exported are those of the robot file, where it has some";
            warnings.push(warning.into());
        }
        let bodies = model.consistency().into_iter();
        warnings.extend(bodies.filter(|body| !body.is_consistent()).map(|body| {
            let link = body.link + 1;
            format!(
                "no body has the identified inertia of link {link} (table body_consistency): files hold that of the nearest body"
            )
        }));
        Ok(Self {
            arm,
            model,
            parameters,
            per_ampere: torque_per_ampere(robot).ok(),
            of_the_recording: Vec::new(),
            origin,
            warnings,
            refusals: Vec::new(),
        })
    }

    /// The model of the stage `step` of a run, else of the last that identified torques; none where none did.
    pub(super) fn of_run(
        manifest: &Manifest,
        step: Option<&str>,
        robot: &RobotDescription,
        load: impl Fn(&TableRef) -> Result<Frame>,
    ) -> Result<Option<Self>> {
        let is_it = |stage: &&StageReport| {
            step.is_none_or(|step| stage.id == step)
                && output(stage, TorqueParameters::KIND).is_some()
        };
        let Some(stage) = manifest.stages.iter().rfind(is_it) else {
            return Ok(None);
        };
        let Some(parameters) = written::<TorqueParameters>(stage, &load)? else {
            return Ok(None);
        };
        // A stage behind it may have written the robot once more, with the masses that these torques show.
        let read = |table: &&TableRef| {
            let mut inputs = stage.inputs.iter();
            inputs.any(|input| input.table.table_hash == table.table_hash)
        };
        let robots = manifest.tables(Robot::KIND).map(|output| &output.table);
        let read = robots.filter(read).last();
        let read = read
            .map(|table| Robot::from_frame(&load(table)?)?.to_description())
            .transpose()?;
        let robot = read.as_ref().unwrap_or(robot);
        let origin = format!("run {}, stage {}", manifest.run_id, stage.id);
        let mut torques = Self::of(robot, parameters, origin)?;
        if let Some(covariance) = written::<TorqueCovariance>(stage, &load)? {
            torques.model.covariance = covariance.of_model(&torques.model)?;
        }
        let findings = written::<TorqueFindings>(stage, &load)?.unwrap_or_default();
        let mut outside = findings.0;
        outside.retain(|row| OF_THE_RECORDING.contains(&row.effect.as_str()));
        torques.of_the_recording = outside.into_iter().map(|row| row.statement).collect();
        let verdict = written::<TorqueVerdict>(stage, &load)?.unwrap_or_default();
        for row in verdict.0 {
            let statement = &row.statement;
            if row.verdict == "unexplained" {
                let warning = format!("the verdict is `unexplained`: {statement}");
                torques.warnings.push(warning);
            } else if row.is_wrong_setup() {
                let refusal = format!("the set-up is wrong: {statement}");
                torques.refusals.push(refusal);
            }
        }
        Ok(Some(torques))
    }
}

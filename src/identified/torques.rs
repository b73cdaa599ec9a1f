//! What a run identified of the arm's torques: the model that motions are fed forward with and exports are made of.

use super::standing::written;
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
    /// The model in a table, for a robot. Fails where the table is no model of torques or the arm has joints that slide.
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
            warnings
                .push("masses are identified as base parameters: no link has masses of its own, and none are exported".into());
        }
        for body in model
            .consistency()
            .iter()
            .filter(|body| !body.is_consistent())
        {
            warnings.push(format!(
                "no body has the identified inertia of link {} (table body_consistency): files hold that of the nearest body",
                body.link + 1
            ));
        }
        let per_ampere = torque_per_ampere(robot).ok();
        let (of_the_recording, refusals) = (Vec::new(), Vec::new());
        Ok(Self {
            arm,
            model,
            parameters,
            per_ampere,
            of_the_recording,
            origin,
            warnings,
            refusals,
        })
    }

    /// The model of the stage `step` of a run, else of the last that identified torques; none where none did.
    pub(super) fn of_run(
        manifest: &Manifest,
        step: Option<&str>,
        robot: &RobotDescription,
        load: impl Fn(&TableRef) -> Result<Frame>,
    ) -> Result<Option<Self>> {
        let writes = |stage: &&StageReport| {
            stage
                .outputs
                .iter()
                .any(|output| output.kind == TorqueParameters::KIND)
        };
        let mut stages = manifest
            .stages
            .iter()
            .filter(writes)
            .filter(|stage| step.is_none_or(|step| stage.id == step));
        let Some(stage) = stages.next_back() else {
            return Ok(None);
        };
        let Some(parameters) = written::<TorqueParameters>(stage, &load)? else {
            return Ok(None);
        };
        // A stage behind it may have written the robot once more, with the masses that these torques show.
        let mut robots = manifest
            .stages
            .iter()
            .flat_map(|stage| &stage.outputs)
            .filter(|output| output.kind == Robot::KIND);
        let read = |table: &TableRef| {
            stage
                .inputs
                .iter()
                .any(|input| input.table.table_hash == table.table_hash)
        };
        let read = robots.rfind(|output| read(&output.table));
        let read = read
            .map(|output| Robot::from_frame(&load(&output.table)?)?.to_description())
            .transpose()?;
        let robot = read.as_ref().unwrap_or(robot);
        let mut torques = Self::of(
            robot,
            parameters,
            format!("run {}, stage {}", manifest.run_id, stage.id),
        )?;
        if let Some(covariance) = written::<TorqueCovariance>(stage, &load)? {
            torques.model.covariance = covariance.of_model(&torques.model)?;
        }
        let findings = written::<TorqueFindings>(stage, &load)?.unwrap_or_default();
        let outside = findings
            .0
            .into_iter()
            .filter(|row| OF_THE_RECORDING.contains(&row.effect.as_str()));
        torques.of_the_recording = outside.map(|row| row.statement).collect();
        for row in written::<TorqueVerdict>(stage, &load)?
            .unwrap_or_default()
            .0
        {
            match row.verdict.as_str() {
                "unexplained" => torques
                    .warnings
                    .push(format!("the verdict is `unexplained`: {}", row.statement)),
                _ if row.is_wrong_setup() => torques
                    .refusals
                    .push(format!("the set-up is wrong: {}", row.statement)),
                _ => (),
            }
        }
        Ok(Some(torques))
    }
}

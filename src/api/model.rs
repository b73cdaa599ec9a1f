//! An identified arm: where it puts the tool, and with which commands it comes to where the nominal one would.

use super::{Options, Poses, Recording, Robot};
use crate::compensate::{
    Chain, Circumstance, CommandTarget, CorrectionOptions, Corrector, GateLimits, IdentifiedArm,
    load_matters, unstated_payload,
};
use crate::error::{Error, Result};
use crate::identified::IdentifiedModel;
use crate::pipeline::StageTables;
use crate::robot::{JointConvention, Measurements};
use crate::table::{Parameters, Recording as RecordingTable, Table};
use nalgebra::Vector3;
use rayon::prelude::*;

/// What an identification gave.
pub struct Identified {
    /// The arm as identified.
    pub model: Model,
    /// Tables of the stage, notes and warnings.
    pub given: StageTables,
}

/// Base, tool, geometry, transmission and compliance of an arm, by the stage `identify`.
pub fn identify(robot: &Robot, recording: &Recording, options: &Options) -> Result<Identified> {
    let given = options.run("identify", robot, recording)?;
    let model = Model::of_stage(robot, recording, &given)?;
    Ok(Identified { model, given })
}

/// An identified arm that predicts and corrects.
pub struct Model {
    /// What was identified, and from what.
    pub identified: IdentifiedModel,
    arm: IdentifiedArm,
}

/// Commands, and what is known of each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Compensated {
    /// Rows times joints, mm of a joint that slides; NaN in rows that are not reached or refused.
    pub joints_rad: Vec<f64>,
    /// How far the uncorrected commands would be off by the model.
    pub uncorrected_mm: Vec<f64>,
    /// What the model leaves.
    pub residual_mm: Vec<f64>,
    /// Uncertainty (95 %) of the point that is reached; NaN where the model has no covariance.
    pub u95_mm: Vec<f64>,
    /// What is wrong with each, empty if nothing.
    pub remarks: Vec<String>,
}

/// Columns of poses that a command may state.
const STATED: [&str; 5] = ["payload_kg", "temp_c", "time_s", "dir", "i_a"];

impl Model {
    /// The arm of an identified model.
    pub fn new(identified: IdentifiedModel) -> Self {
        let arm = IdentifiedArm::new(identified.model.clone(), identified.correction.clone());
        Self { identified, arm }
    }

    pub(super) fn of_stage(
        robot: &Robot,
        recording: &Recording,
        given: &StageTables,
    ) -> Result<Self> {
        let tables = |kind: &str| Ok(given.kind(kind).cloned());
        let origin = "the identification".to_string();
        let own = IdentifiedModel::of_tables(robot.description.clone(), origin, &tables, None)?;
        let recorded = RecordingTable::from_frame(&recording.table(robot)?)?;
        Ok(Self::new(IdentifiedModel {
            data: Some(recorded.measurements()),
            convention: Some(JointConvention::of_the_robot_file(robot.joints())),
            ..own
        }))
    }

    /// The nominal robot.
    pub fn robot(&self) -> Robot {
        Robot {
            description: self.identified.robot.clone(),
            notes: Vec::new(),
        }
    }

    /// Estimated parameters with their standard deviations, as the table `parameters` has them.
    pub fn parameters(&self) -> &Parameters {
        &self.identified.parameters
    }

    /// Measured points of poses, mm in the frame of the instrument, with the learned correction where there is one.
    pub fn predict(&self, poses: &Poses) -> Result<Vec<[f64; 3]>> {
        let robot = self.robot();
        let mut data = poses.measurements(&robot)?;
        if let Some(convention) = &self.identified.convention {
            data.q
                .chunks_mut(robot.joints())
                .for_each(|q| convention.to_robot(q));
        }
        let points = self.identified.model.predict(&data);
        Ok(match &self.identified.correction {
            None => points.iter().map(millimetres).collect(),
            Some(correction) => {
                let learned = |(row, point): (usize, &Vector3<f64>)| {
                    let own = &data.q[row * data.joints..][..data.joints];
                    let sources = [own, &data.payload[row..=row]].concat();
                    millimetres(&(point + Vector3::from(correction.at(&sources).delta)))
                };
                points.par_iter().enumerate().map(learned).collect()
            }
        })
    }

    /// Places the arm one pose (rad and m) after the other, each by itself, whatever came before: mm in the frame of the instrument.
    pub fn placing(&self) -> impl FnMut(&Circumstance, Vec<f64>) -> [f64; 3] + '_ {
        let mut reach = self.arm.reach();
        move |circumstance, mut q| {
            if let Some(convention) = &self.identified.convention {
                convention.to_robot(&mut q);
            }
            reach.under(circumstance);
            millimetres(&self.arm.base().point(&reach.place(&q).translation))
        }
    }

    /// What corrects commands, with the defaults of `calib compensate`. Fails where the model is refused, unless one insists; `insist` says
    /// how that is done.
    pub fn corrector(&self, insisted: bool, insist: &str) -> Result<Corrector<'_>> {
        let identified = &self.identified;
        let gate = identified.gate(GateLimits::default(), insisted);
        if !insisted {
            identified.accepted(&gate, insist)?;
        }
        let joints = identified.model.robot.joints();
        let convention = identified.convention.clone();
        let manner = CorrectionOptions {
            clock: identified.data.as_ref().is_none_or(Measurements::has_clock),
            gate,
            ..CorrectionOptions::counted_by(
                convention.unwrap_or_else(|| JointConvention::of_the_robot_file(joints)),
            )
        };
        let uncertainty = identified.uncertainty(&self.arm);
        Ok(Corrector::new(
            &self.arm,
            identified.coverage(),
            uncertainty,
            manner,
        ))
    }

    /// The largest load that was measured, kg, where commands must state theirs: the arm depends on it.
    pub fn needed_load(&self) -> Option<f64> {
        let heaviest = self.identified.heaviest();
        heaviest.filter(|load| load_matters(&self.arm, *load))
    }

    /// Commands with which the real arm comes to where the nominal one would be at these joints. Fails where the model is refused and one does
    /// not insist, and where it depends on a payload that is not stated.
    pub fn compensate(&self, poses: &Poses, insisted: bool) -> Result<Compensated> {
        if let Some(name) = poses
            .columns
            .keys()
            .find(|name| !STATED.contains(&name.as_str()))
        {
            let message = format!("no command states it; allowed: {}", STATED.join(", "));
            return Err(Error::spec(name, message));
        }
        let robot = self.robot();
        let (data, n) = (poses.measurements(&robot)?, robot.joints());
        let stated = |name: &str| poses.columns.contains_key(name);
        if let Some(load) = self.needed_load().filter(|_| !stated("payload_kg")) {
            return Err(Error::data("targets", unstated_payload(load)));
        }
        let target = |row: usize| CommandTarget {
            q: Some(data.q[row * n..][..n].to_vec()),
            payload: stated("payload_kg").then(|| data.payload[row]),
            temperature: data.temperature(row),
            time: data.time.as_ref().map(|time| time[row]),
            direction: data
                .direction
                .as_ref()
                .map(|all| all[row * n..][..n].to_vec()),
            current: data.current(row).map(<[f64]>::to_vec),
            ..CommandTarget::default()
        };
        let mut corrector = self.corrector(insisted, "force=True")?;
        let answers = corrector.batch((0..data.rows()).map(target).collect());
        let mut found = Compensated::default();
        for answer in answers {
            let q = answer.q.clone().unwrap_or_else(|| vec![f64::NAN; n]);
            found.joints_rad.extend(q);
            found.uncorrected_mm.push(answer.uncorrected * 1e3);
            found.residual_mm.push(answer.residual * 1e3);
            let u95 = answer.uncertainty.map_or(f64::NAN, |known| known.u95 * 1e3);
            found.u95_mm.push(u95);
            found.remarks.push(answer.remark());
        }
        found.joints_rad = robot.from_si(&found.joints_rad);
        Ok(found)
    }
}

fn millimetres(point: &Vector3<f64>) -> [f64; 3] {
    (point * 1e3).into()
}

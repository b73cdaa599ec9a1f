//! An identified arm: where it puts the tool, and with which commands it comes to where the nominal one would.

use super::{Poses, Recording, Robot};
use crate::compensate::{
    Chain, Circumstance, CommandTarget, CorrectedCommand, CorrectionOptions, Corrector, GateLimits,
    IdentifiedArm, unstated_payload,
};
use crate::error::{Error, Result, instead};
use crate::identified::IdentifiedModel;
use crate::pipeline::{Observer, StageCall, StageTables, Unwatched, run_in_memory};
use crate::robot::{JointConvention, Measurements};
use crate::summary::{DiagnosisSummary, Subject};
use crate::table::{Parameters, Recording as RecordingTable, Table};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde_json::{Value, json};

/// How an identification or a diagnosis is made.
pub struct Options<'a> {
    /// Settings of the stage, as `with:` of a pipeline.
    pub with: Value,
    /// That of the pipeline; `calib init` writes 1.
    pub seed: u64,
    /// Who watches.
    pub observer: &'a dyn Observer,
}

impl Options<'_> {
    /// Settings of the stage, all else as usual.
    pub fn with(with: Value) -> Self {
        Self {
            with,
            seed: 1,
            observer: &Unwatched,
        }
    }

    /// Runs a stage on robot and recording, split as the recording says, and takes its model.
    fn run(&self, uses: &str, robot: &Robot, recording: &Recording) -> Result<Identified> {
        let mut tables = vec![robot.table()?, recording.table(robot)?];
        let recorded = RecordingTable::from_frame(&tables[1])?;
        let how = match recording.held_out {
            Some(_) => json!({ "by": "usage" }),
            None => json!({ "by": "every", "n": 4 }),
        };
        let call = |uses, with| StageCall {
            uses,
            with,
            seed: self.seed,
        };
        let split = run_in_memory(&call("split", &how), &tables, self.observer)?;
        tables.extend(split.tables.into_iter().map(|(_, frame)| frame));
        let mut given = run_in_memory(&call(uses, &self.with), &tables, self.observer)?;
        given.warnings.splice(0..0, split.warnings);
        let of_kind = |kind: &str| Ok(given.kind(kind).cloned());
        let (origin, arm) = (format!("stage {uses}"), robot.description.clone());
        let identified = IdentifiedModel {
            data: Some(recorded.measurements()),
            convention: Some(JointConvention::of_the_robot_file(robot.joints())),
            ..IdentifiedModel::of_tables(arm, origin, &of_kind, None)?
        };
        let model = Model::new(identified);
        Ok(Identified { model, given })
    }
}

/// What an identification gave.
pub struct Identified {
    /// The arm as identified.
    pub model: Model,
    /// Tables of the stage, notes and warnings.
    pub given: StageTables,
}

/// Base, tool, geometry, transmission and compliance of an arm, by the stage `identify`.
pub fn identify(robot: &Robot, recording: &Recording, options: &Options) -> Result<Identified> {
    options.run("identify", robot, recording)
}

/// What a diagnosis gave.
pub struct Diagnosis {
    /// Verdict, findings and what to measure next, as text, as JSON and as a page.
    pub summary: DiagnosisSummary,
    /// The arm with all that was found; refused where the set-up is wrong.
    pub model: Model,
    /// Tables of the stage, notes and warnings.
    pub given: StageTables,
}

/// Where robot and recording differ and which causes explain it, by the stage `diagnose`.
pub fn diagnose(robot: &Robot, recording: &Recording, options: &Options) -> Result<Diagnosis> {
    let Identified { mut model, given } = options.run("diagnose", robot, recording)?;
    let tables = |kind: &str| Ok(given.kind(kind).cloned());
    // Commands that are proposed speak of a run: the last one of whoever types them.
    let subject = Subject {
        run: "HEAD".into(),
        robot: Some(robot.description.name.clone()),
        rows: recording.points_mm.len() as u64,
    };
    let summary = DiagnosisSummary::of_positions(subject, &tables)?;
    if summary.is_wrong_setup() {
        model.identified.refusals.push("the set-up is wrong".into());
    }
    Ok(Diagnosis {
        summary,
        model,
        given,
    })
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
    pub(crate) fn new(identified: IdentifiedModel) -> Self {
        let arm = identified.arm();
        Self { identified, arm }
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
        let mut data = poses.measurements(&self.robot())?;
        let convention = usual_options(&self.identified).convention;
        let rows = data.q.chunks_mut(data.joints);
        rows.for_each(|q| convention.to_robot(q));
        let mut points = self.identified.model.predict(&data);
        if let Some(correction) = &self.identified.correction {
            let rows = points.par_iter_mut().zip(data.q.par_chunks(data.joints));
            rows.zip(&data.payload).for_each(|((point, q), payload)| {
                let sources = [q, &[*payload]].concat();
                *point += Vector3::from(correction.at(&sources).delta);
            });
        }
        Ok(points.iter().map(millimetres).collect())
    }

    /// Places the arm one pose (rad and m) after the other, each by itself, whatever came before: mm in the frame of the instrument.
    pub(crate) fn placing(&self) -> impl FnMut(&Circumstance, &mut [f64]) -> [f64; 3] + '_ {
        let (mut reach, convention) =
            (self.arm.reach(), usual_options(&self.identified).convention);
        move |circumstance, q| {
            convention.to_robot(q);
            reach.under(circumstance);
            millimetres(&self.arm.base().point(&reach.place(q).translation))
        }
    }

    /// What corrects commands, with the defaults of `calib compensate`. Fails where the model is refused, unless one insists; `insist` says
    /// how that is done.
    pub(crate) fn corrector(&self, insisted: bool, insist: &str) -> Result<Corrector<'_>> {
        let identified = &self.identified;
        let gate = identified.gate(GateLimits::default(), insisted);
        if !insisted {
            identified.accepted(&gate, insist)?;
        }
        let manner = CorrectionOptions {
            gate,
            ..usual_options(identified)
        };
        let (coverage, uncertainty) = (identified.coverage(), identified.uncertainty(&self.arm));
        Ok(Corrector::new(&self.arm, coverage, uncertainty, manner))
    }

    /// The largest load that was measured, kg, where commands must state theirs: the arm depends on it.
    pub(crate) fn needed_load(&self) -> Option<f64> {
        self.identified.needed_load(&self.arm)
    }

    /// Commands with which the real arm comes to where the nominal one would be at these joints. Fails where the model is refused and one does
    /// not insist, and where it depends on a payload that is not stated.
    pub fn compensate(&self, poses: &Poses, insisted: bool) -> Result<Compensated> {
        let mut columns = poses.columns.keys();
        if let Some(name) = columns.find(|name| !STATED.contains(&name.as_str())) {
            let message = format!("is nothing that a command states{}", instead(name, &STATED));
            return Err(Error::spec(name, message));
        }
        let robot = self.robot();
        let (data, n) = (poses.measurements(&robot)?, robot.joints());
        let has_load = poses.columns.contains_key("payload_kg");
        if let Some(load) = self.needed_load().filter(|_| !has_load) {
            return Err(Error::data("targets", unstated_payload(load)));
        }
        let of_row = |all: &[f64], row: usize| all[row * n..][..n].to_vec();
        let target = |row: usize| CommandTarget {
            q: Some(of_row(&data.q, row)),
            payload: has_load.then(|| data.payload[row]),
            temperature: data.temperature(row),
            time: data.time.as_ref().map(|time| time[row]),
            direction: data.direction.as_ref().map(|all| of_row(all, row)),
            current: data.current(row).map(<[f64]>::to_vec),
            ..CommandTarget::default()
        };
        let mut corrector = self.corrector(insisted, "force=True")?;
        let answers = corrector.batch((0..data.rows()).map(target).collect());
        let numbers =
            |value_of: fn(&CorrectedCommand) -> f64| answers.iter().map(value_of).collect();
        let joints = answers.iter().flat_map(|answer| {
            let q = answer.q.as_deref();
            robot.from_si(q.unwrap_or(&vec![f64::NAN; n]))
        });
        Ok(Compensated {
            joints_rad: joints.collect(),
            uncorrected_mm: numbers(|answer| answer.uncorrected * 1e3),
            residual_mm: numbers(|answer| answer.residual * 1e3),
            u95_mm: numbers(|answer| answer.uncertainty.map_or(f64::NAN, |known| known.u95 * 1e3)),
            remarks: answers.iter().map(CorrectedCommand::remark).collect(),
        })
    }
}

/// Commands as the controller counts its joints, at times of the recording's clock where it has one.
pub(crate) fn usual_options(identified: &IdentifiedModel) -> CorrectionOptions {
    let joints = identified.model.robot.joints();
    let convention = identified.convention.clone();
    let of_file = || JointConvention::of_the_robot_file(joints);
    CorrectionOptions {
        clock: identified.data.as_ref().is_none_or(Measurements::has_clock),
        ..CorrectionOptions::counted_by(convention.unwrap_or_else(of_file))
    }
}

fn millimetres(point: &Vector3<f64>) -> [f64; 3] {
    (point * 1e3).into()
}

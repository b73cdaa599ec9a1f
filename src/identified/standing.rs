//! What is read of a run next to its model: which step stands for it, how its controller counts its joints, how the arm scatters about the
//! model; and a robot file by its path.

use crate::compensate::{Corrector, IdentifiedArm, Scatter};
use crate::description::RobotDescription;
use crate::error::{Error, Result};
use crate::identified::load;
use crate::pipeline::{Manifest, StageReport};
use crate::raw;
use crate::robot::import::{RobotFileText, read_calib, read_case};
use crate::robot::{JointConvention, RobotModel};
use crate::spatial::Pose;
use crate::stage::ingest::Ingest;
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::frame::Frame;
use crate::store::{Store, TableRef};
use crate::table::{
    Corrected, Corrections, Findings, JointConventions, Observability, Parameters, Prediction,
    Robot, Standing, Step, Table, TablesByKind, Unseen, Verdict, VerdictRow, of_kind, standing,
};
use crate::targets::MeasuredTarget;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::path::Path;

/// What the last diagnosis of a run says of a wrong set-up; none where it is right. Fails where a table has left the store.
pub fn wrong_setup_of(manifest: &Manifest, store: &Store) -> Result<Option<String>> {
    Ok(diagnosed(manifest, store)?.and_then(|(verdict, findings)| verdict.wrong_setup(&findings)))
}

/// What commands and files of a model must be told to lack, where the last diagnosis of its run left something unexplained.
pub(super) fn unexplained_of(manifest: &Manifest, store: &Store) -> Result<Option<String>> {
    let left = diagnosed(manifest, store)?
        .and_then(|(verdict, _)| verdict.0.into_iter().find(VerdictRow::is_unexplained));
    Ok(left.map(|row| {
        let statement = row
            .statement
            .map(|statement| format!(": {statement}"))
            .unwrap_or_default();
        format!(
            "the verdict is `unexplained`, and what no cause explains is not corrected{statement}"
        )
    }))
}

/// Verdict and findings of the last diagnosis.
fn diagnosed(manifest: &Manifest, store: &Store) -> Result<Option<(Verdict, Findings)>> {
    let is_it = |stage: &&StageReport| stage.uses == Diagnose::NAME && !stage.outputs.is_empty();
    let Some(stage) = manifest.stages.iter().rfind(is_it) else {
        return Ok(None);
    };
    let load = |table: &TableRef| store.load(table);
    let (verdict, findings): (Option<Verdict>, Option<Findings>) =
        (written(stage, load)?, written(stage, load)?);
    Ok(verdict.zip(findings))
}

/// The step that stands for a run; none where nothing predicts, the last diagnosis speaks of an outside simulation, or the set-up is
/// wrong. Fails where a table has left the store.
pub fn standing_of(manifest: &Manifest, store: &Store) -> Result<Option<Standing>> {
    let stages = manifest.stages.iter();
    let steps = stages.filter_map(|stage| Some((stage, output(stage, Prediction::KIND)?)));
    let diagnosed = steps
        .clone()
        .rfind(|(stage, _)| stage.uses == Diagnose::NAME);
    let diagnosed = diagnosed.map(|(stage, _)| stage);
    if let Some(stage) = diagnosed
        && let Some(parameters) = written::<Parameters>(stage, |table| store.load(table))?
        && parameters.corrected() == Corrected::OutsideSimulation
    {
        return Ok(None);
    }
    if wrong_setup_of(manifest, store)?.is_some() {
        return Ok(None);
    }
    let step = |(stage, prediction): (&StageReport, &TableRef)| -> Result<Step> {
        Ok(Step {
            id: stage.id.clone(),
            is_identified: output(stage, Parameters::KIND).is_some(),
            unseen: Unseen::of_frame(&store.load(prediction)?)?,
        })
    };
    let steps = steps.map(step).collect::<Result<Vec<Step>>>()?;
    Ok(standing(&steps, diagnosed.map(|stage| stage.id.as_str())))
}

/// The convention of a run's recording, none where nothing was ingested: the twin logs its joints as its robot file counts them.
/// Fails for a run of an earlier calib, which does not say.
pub fn convention_of(manifest: &Manifest, store: &Store) -> Result<Option<JointConvention>> {
    let convention = last::<JointConventions>(manifest, store)?
        .map(|table| table.to_convention())
        .transpose()?;
    let mut stages = manifest.stages.iter();
    if convention.is_none() && stages.any(|stage| stage.uses == Ingest::NAME) {
        let message = format!(
            "the run does not say how the controller counts its joints: an earlier calib made it. `calib run {}` writes it anew",
            manifest.pipeline.file
        );
        return Err(Error::data(&manifest.run_id, message));
    }
    Ok(convention)
}

/// What differs from the robot file's counting at the controller of a run; none where nothing does, or the run does not say.
pub fn counted_otherwise(manifest: &Manifest, store: &Store) -> Result<Option<String>> {
    let Some(table) = last::<JointConventions>(manifest, store)? else {
        return Ok(None);
    };
    let Some(robot) = last::<Robot>(manifest, store)? else {
        return Ok(None);
    };
    let robot = RobotModel::new(robot.to_description()?);
    Ok(table.to_convention()?.difference(&robot))
}

/// The last table of a kind that a run wrote.
pub(super) fn last<T: Table>(manifest: &Manifest, store: &Store) -> Result<Option<T>> {
    let output = manifest.tables(T::KIND).last();
    let frame = output.map(|output| load(store, &output.table, manifest));
    frame.map(|frame| T::from_frame(&frame?)).transpose()
}

/// Where the table of a kind is that a stage wrote.
pub(super) fn output<'s>(stage: &'s StageReport, kind: &str) -> Option<&'s TableRef> {
    let output = stage.outputs.iter().find(|output| output.kind == kind);
    output.map(|output| &output.table)
}

/// The table of a kind that a stage wrote, if it wrote one.
pub(super) fn written<T: Table>(
    stage: &StageReport,
    load: impl Fn(&TableRef) -> Result<Frame>,
) -> Result<Option<T>> {
    let frame = output(stage, T::KIND).map(load);
    frame.map(|frame| T::from_frame(&frame?)).transpose()
}

/// The scatter by the stage whose model stands, and by the one that learned a correction on top of it.
pub(super) fn of(stage: &TablesByKind, learned: Option<&TablesByKind>) -> Result<Scatter> {
    let diagnosed: Option<Verdict> = of_kind(stage)?;
    let fitted: Option<Observability> = of_kind(stage)?;
    let prediction: Option<Prediction> = of_kind(stage)?;
    let corrections: Option<Corrections> = learned.map_or(Ok(None), of_kind)?;
    let of_verdict = diagnosed.and_then(|verdict| Some(verdict.0.first()?.repeatability_rad));
    let of_fit = || {
        let rows = fitted?.0.into_iter();
        let mut rows = rows.filter(|row| row.quantity == "joint_repeatability_rad");
        rows.next().map(|row| row.value)
    };
    let repeatability = of_verdict.or_else(of_fit);
    let mut unexplained = prediction.as_ref().map_or(0.0, Prediction::unexplained_mm);
    let learned = corrections.as_ref().and_then(Corrections::rms_mm);
    if let (Some(rms), Some(prediction)) = (learned, &prediction) {
        // The errors of a correction's folds hold the noise, the parameters' uncertainty and the remaining error.
        let left = rms.powi(2) - prediction.mean_square_noise_mm2();
        unexplained = unexplained.min((left / 3.0).max(0.0).sqrt());
    }
    Ok(Scatter {
        unexplained: unexplained * 1e-3,
        repeatability: repeatability.unwrap_or(0.0),
    })
}

/// Reads a robot file by its ending: `.json` is the practice layout, all else calib's YAML, which may name a URDF.
pub fn robot_file(path: &Path, urdf: Option<&Path>) -> Result<RobotDescription> {
    let read = |path: &Path| {
        let label = path.display().to_string();
        let text = raw::text(path)
            .map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
        Ok((label, text))
    };
    let (label, text) = read(path)?;
    let file = RobotFileText {
        label: &label,
        text: &text,
    };
    if raw::ending(path) == "json" {
        return Ok(read_case(file)?.robot);
    }
    let urdf = urdf.map(read).transpose()?;
    let urdf = urdf.as_ref();
    let urdf = urdf.map(|(label, text)| RobotFileText { label, text });
    Ok(read_calib(file, urdf)?.robot)
}

/// Cycles of a pose from which ISO 9283 speaks of accuracy and repeatability.
const CYCLES: usize = 30;
/// Points that a base is found from at least.
const FEWEST: usize = 4;

/// Lengths of each target, m.
#[derive(Debug, Default)]
pub struct Achieved {
    /// How far the uncorrected commands would be off by the model.
    pub(crate) before: Vec<f64>,
    /// Within which the corrected ones were predicted to be measured with 95 %, by an instrument as before; empty where the model has no covariance.
    pub(crate) predicted: Vec<f64>,
    /// How far the measured points are from the wanted ones.
    pub(crate) achieved: Vec<f64>,
    /// Poses that were repeated often enough.
    pub(crate) poses: Vec<RepeatedPose>,
    /// Targets that the model could not reach, which were not corrected.
    pub(crate) unreached: usize,
}

/// A pose of 30 cycles or more, ISO 9283.
#[derive(Debug)]
pub struct RepeatedPose {
    /// How often.
    pub(crate) cycles: usize,
    /// Distance of the mean of the attained points from the wanted one (AP), m.
    pub(crate) accuracy: f64,
    /// Mean distance from that mean plus three standard deviations (RP), m.
    pub(crate) repeatability: f64,
}

/// Within so many times its rms length the noise of a point stays with 95 %: chi-square of three.
const OF_NOISE: f64 = 1.614;

/// Compares; `new_base` finds the tracker's place anew from these points, each of which was measured with `noise` (rms length, m). Fails where
/// they are too few for that.
pub fn achieved(
    arm: &IdentifiedArm,
    nominal: &RobotModel,
    corrector: &mut Corrector,
    rows: &[MeasuredTarget],
    new_base: bool,
    noise: f64,
) -> Result<Achieved> {
    let convention = corrector.convention().clone();
    let wanted = |row: &MeasuredTarget| {
        let mut q = row.target.q.clone().unwrap_or_default();
        convention.to_robot(&mut q);
        nominal.forward(&q).translation
    };
    let wanted: Vec<Vector3<f64>> = rows.iter().map(wanted).collect();
    let points: Vec<Vector3<f64>> = rows.iter().map(|row| row.point).collect();
    let base = if new_base {
        placed(&wanted, &points)?
    } else {
        *arm.base()
    };
    let pairs = wanted.iter().zip(&points);
    let off: Vec<Vector3<f64>> = pairs
        .map(|(wanted, point)| point - base.point(wanted))
        .collect();
    let mut found = Achieved {
        achieved: off.iter().map(Vector3::norm).collect(),
        ..Achieved::default()
    };
    for answer in corrector.batch(rows.iter().map(|row| row.target.clone()).collect()) {
        found.before.push(answer.uncorrected);
        let within = |u95: f64| (answer.residual + u95).hypot(OF_NOISE * noise);
        found
            .predicted
            .extend(answer.uncertainty.as_ref().map(|known| within(known.u95)));
        found.unreached += usize::from(answer.q.is_none());
    }
    let mut repeated: BTreeMap<Vec<i64>, Vec<Vector3<f64>>> = BTreeMap::new();
    for (row, off) in rows.iter().zip(&off) {
        // Commands are the same where they agree to a nanoradian.
        let q = row.target.q.iter().flatten();
        let key = q.map(|q| (q * 1e9).round() as i64).collect();
        repeated.entry(key).or_default().push(*off);
    }
    let poses = repeated.values().filter(|cycles| cycles.len() >= CYCLES);
    found.poses = poses.map(|cycles| repeated_pose(cycles)).collect();
    Ok(found)
}

/// Deviations from the wanted point of one pose.
fn repeated_pose(off: &[Vector3<f64>]) -> RepeatedPose {
    let count = off.len() as f64;
    let mean = off.iter().sum::<Vector3<f64>>() / count;
    let from: Vec<f64> = off.iter().map(|one| (one - mean).norm()).collect();
    let average = from.iter().sum::<f64>() / count;
    let squares = from.iter().map(|one| (one - average).powi(2));
    let deviation = (squares.sum::<f64>() / (count - 1.0)).sqrt();
    RepeatedPose {
        cycles: off.len(),
        accuracy: mean.norm(),
        repeatability: average + 3.0 * deviation,
    }
}

/// The rigid motion that brings points of the base onto measured ones, least squares (Kabsch).
pub(crate) fn placed(base: &[Vector3<f64>], measured: &[Vector3<f64>]) -> Result<Pose> {
    if base.len() < FEWEST {
        let message = format!("needs {FEWEST} points or more, found {}", base.len());
        return Err(Error::spec("--new-base", message));
    }
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (from, to) = (mean(base), mean(measured));
    let pairs = base.iter().zip(measured);
    let parts = pairs.map(|(a, b)| (b - to) * (a - from).transpose());
    let spread: Matrix3<f64> = parts.sum();
    let svd = spread.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return Err(Error::Bug("a 3 x 3 SVD without vectors".into()));
    };
    let mirror = (u * v).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, mirror)) * v;
    Ok(Pose::new(rotation, to - rotation * from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_base_is_found_again_and_repeats_have_the_figures_of_the_standard() {
        let base: Vec<Vector3<f64>> = (0..6)
            .map(|k| Vector3::new(f64::from(k), f64::from(k * k) * 0.3, f64::from(7 - k).sin()))
            .collect();
        let truth =
            Pose::from_rotation_vector(Vector3::new(0.2, -0.4, 0.7), Vector3::new(1.0, -2.0, 0.5));
        let seen: Vec<Vector3<f64>> = base.iter().map(|point| truth.point(point)).collect();
        let found = placed(&base, &seen).expect("a base");
        assert!(
            (found.translation - truth.translation).norm() < 1e-12
                && (found.rotation - truth.rotation).norm() < 1e-12
        );
        // Two places 2 mm apart, by turns, about a mean that is 3 mm off: every cycle is 1 mm from the mean.
        let off: Vec<Vector3<f64>> = (0..30)
            .map(|k| Vector3::new(0.003, if k % 2 == 0 { 0.001 } else { -0.001 }, 0.0))
            .collect();
        let pose = repeated_pose(&off);
        assert!(
            (pose.accuracy - 0.003).abs() < 1e-12
                && (pose.repeatability - 0.001).abs() < 1e-12
                && pose.cycles == 30
        );
    }
}

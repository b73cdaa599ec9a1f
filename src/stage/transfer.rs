//! `transfer`: an identified model on another recording of the same robot. The arm is held; only where its base stands is found anew.

use crate::diagnose::BASE;
use crate::effect::{AnchorShift, BaseFrame, LONG_AFTER};
use crate::error::{Fault, Result, counted};
use crate::estimate::{FitOptions, align_points};
use crate::robot::{Measurements, RobotModel, Visited};
use crate::stage::identified::{Fitting, Identified};
use crate::stage::screened::fit_rows;
use crate::stage::{Context, Labelled, Stage};
use crate::table::{CovarianceTable, ParameterRow, Parameters, Recording, Robot, Split};
use nalgebra::Vector3;

crate::stage::identified::identification! {
    /// Settings of `transfer`.
    pub struct Transfer {
        /// Sets of the split by which the base is found.
        #[serde(default = "fit_set")]
        pub on: Vec<String>,
    }
}

fn fit_set() -> Vec<String> {
    vec!["fit".into()]
}

crate::stage::reads! {
    /// Input ports of [`Transfer`]: another recording with its split, and the model to try on it; all recordings that there are.
    pub struct TransferReads {
        robot: Robot,
        recording: Recording,
        split: Split,
        parameters: Parameters,
        covariance: Option<CovarianceTable>,
        recordings: Vec<Labelled<Recording>>,
    }
}

impl Stage for Transfer {
    const NAME: &'static str = "transfer";
    const SUMMARY: &'static str = "tests an identified model on another recording of the robot; only its base is estimated anew";
    const IMPLEMENTATION: u32 = 8;
    type Reads = TransferReads;
    type Writes = Identified;

    fn check(&self) -> Vec<Fault> {
        self.shared_faults("fit")
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::stage::on(&self.on)
    }

    fn run(&self, reads: TransferReads, context: &Context) -> Result<Identified> {
        let mut data = reads.recording.measurements();
        let rows = reads.split.rows(&reads.recording, &self.on)?;
        let earlier = reads.parameters.of_the_arm()?;
        let left = reads.parameters.0.len() - earlier.0.len();
        if left > 0 {
            context.services.note(format!(
                "not carried over, since they belong to the first measurement only: {}",
                counted(left, "parameter")
            ));
        }
        // Another recording has another clock: steps have happened, and the arm is warm. What lags follows the time between rows.
        let start = (0..data.rows()).map(|row| data.time(row)).fold(f64::INFINITY, f64::min);
        data.time = Some((0..data.rows()).map(|row| LONG_AFTER + data.time(row) - start).collect());
        let robot = RobotModel::new(reads.robot.to_description()?);
        let there = earlier.model(robot.clone(), &[], self.load.into())?;
        let predicted = there.predict(&data);
        let whole: Vec<usize> = rows.iter().copied().filter(|row| data.whole(*row)).collect();
        let points = |of: &[nalgebra::Vector3<f64>]| whole.iter().map(|row| of[*row]).collect::<Vec<_>>();
        let base = align_points(&points(&predicted), &points(&data.position)) * there.base();
        let mut model = earlier.model_standing(base, robot, &[], self.load.into())?;
        let open: Vec<usize> = match self.free {
            Some(_) => (0..model.x.len()).collect(),
            None => model.stack.parameters_of(BaseFrame::NAME).collect(),
        };
        let (candidates, held) = self.parameter_set().apply(&mut model, &open, context);
        let repeatability = self.repeatability.apply(&model, &mut data, &rows, context);
        let options = FitOptions { rows: &rows, candidates: &candidates };
        let (model, fitted, screening) = fit_rows(&model, &data, &options, &reads.split, self.screen);
        let fitting = Fitting {
            data: &data,
            recording: &reads.recording,
            split: &reads.split,
            asked: &rows,
            rows: &screening.kept,
            screening: &screening,
            held: &held,
            earlier: Some(&earlier),
            earlier_covariance: reads.covariance.as_ref(),
            seen_before: &vec![false; data.rows()],
            geometry: None,
            repeatability,
            folds: self.folds,
        };
        let mut identified = Identified::of(context, &model, &fitted, &fitting);
        let judges = judges(&data, &rows, &screening.kept);
        if earlier.0.iter().any(|row| !is_geometry(row)) {
            let geometry = geometry_alone(&earlier, &reads.robot, &data, &rows, self)?;
            compare(context, &data, &judges, [&model.predict(&data), &geometry]);
        }
        let remarks = remarks(&reads.recordings, &reads.recording, &data, context);
        identified.prediction = identified.prediction.with_remarks(remarks.into_iter());
        Ok(identified)
    }
}

/// Whether a parameter is of the rigid arm, its gears or what it was measured to.
fn is_geometry(row: &ParameterRow) -> bool {
    row.form.is_none() && (row.effect == AnchorShift::NAME || BASE.contains(&row.effect.as_str()))
}

/// Whole points by which a carried model is judged: those that did not place its base, or where there are none, all.
fn judges(data: &Measurements, asked: &[usize], kept: &[usize]) -> Vec<usize> {
    let others: Vec<usize> = (0..data.rows()).filter(|row| !asked.contains(row) && data.whole(*row)).collect();
    if others.is_empty() { kept.iter().copied().filter(|row| data.whole(*row)).collect() } else { others }
}

/// What the geometry of a model predicts without what else was found, its base where these rows have it.
fn geometry_alone(
    earlier: &Parameters,
    robot: &Robot,
    data: &Measurements,
    rows: &[usize],
    settings: &Transfer,
) -> Result<Vec<Vector3<f64>>> {
    let geometry = Parameters(earlier.0.iter().filter(|row| is_geometry(row)).cloned().collect());
    let model = geometry.model(RobotModel::new(robot.to_description()?), &[], settings.load.into())?;
    let predicted = model.predict(data);
    let whole = || rows.iter().copied().filter(|row| data.whole(*row));
    let moved = align_points(
        &whole().map(|row| predicted[row]).collect::<Vec<_>>(),
        &whole().map(|row| data.position[row]).collect::<Vec<_>>(),
    );
    Ok(predicted.iter().map(|point| moved.point(point)).collect())
}

/// Beyond this the difference is not that of two ways to place a base.
const WORSE: f64 = 1.02;

/// Says where a carried model is worse than its own geometry.
fn compare(context: &Context, data: &Measurements, judges: &[usize], [whole, geometry]: [&[Vector3<f64>]; 2]) {
    let rms = |predicted: &[Vector3<f64>]| {
        let squares = judges.iter().map(|row| (data.position[*row] - predicted[*row]).norm_squared());
        (squares.sum::<f64>() / judges.len().max(1) as f64).sqrt() * 1e3
    };
    let (whole, geometry) = (rms(whole), rms(geometry));
    if whole > WORSE * geometry {
        context.services.warn(format!(
            "the carried model leaves {whole:.3} mm rms on this recording, its geometry alone {geometry:.3} mm: what was identified besides it \
             does not hold here"
        ));
    }
}

/// What of each row was never visited by the other recordings; nothing where there is no other.
fn remarks(all: &[Labelled<Recording>], own: &Recording, data: &Measurements, context: &Context) -> Vec<Option<String>> {
    let mut others = all.iter().map(|one| &one.table).filter(|table| table.q != own.q && table.joints == own.joints);
    let Some(first) = others.next() else { return vec![None; data.rows()] };
    let mut visited = first.measurements();
    for more in others.map(Recording::measurements) {
        visited.q.extend(more.q);
        visited.position.extend(more.position);
        visited.payload.extend(more.payload);
        visited.temperature = visited.temperature.take().zip(more.temperature).map(|(a, b)| [a, b].concat());
    }
    let visited = Visited::of(&visited, &(0..visited.rows()).collect::<Vec<_>>());
    let said = |row: usize| {
        let beyond = visited.beyond(data.q(row), data.payload[row], data.temperature(row));
        (!beyond.is_empty()).then(|| beyond.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
    };
    let remarks: Vec<Option<String>> = (0..data.rows()).map(said).collect();
    let outside = remarks.iter().flatten().count();
    if outside > 0 {
        let (rows, lie) = (counted(data.rows(), "row"), if outside == 1 { "lies" } else { "lie" });
        context.services.note(format!(
            "{outside} of {rows} {lie} outside of what the model was measured at: see the remarks of `prediction`"
        ));
    }
    remarks
}

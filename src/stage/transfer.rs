//! `transfer`: an identified model on another recording of the same robot. The arm is held; only where its base stands is found anew.

use crate::doubtful::{FittedRows, fit_rows};
use crate::effect::{Load, names};
use crate::error::{Place, Result, counted};
use crate::estimate::{Model, Screening, align_points, fit};
use crate::identified::{Fitting, Identified, RowsToFit};
use crate::table::{
    CovarianceTable, ParameterRow, Parameters, Prediction, Recording, Robot, Split,
};
use crate::{Context, Labelled, Stage};
use calib_diagnose::BASE;
use calib_numerics::robot::{Measurements, RobotModel};
use nalgebra::Vector3;
use std::collections::BTreeSet;

crate::identified::identification! {
    /// Settings of `transfer`.
    pub struct Transfer {
        /// Sets of the split by which the base is found.
        #[serde(default = "crate::fit_set")]
        pub on: Vec<String>,
    }
}

crate::stage! {
    Transfer, "transfer", 18, "tests an identified model on another recording of the robot; only its base is estimated anew",
        TransferReads {
            robot: Robot,
            recording: Recording,
            split: Split,
            parameters: Parameters,
            covariance: Option<CovarianceTable>,
            recordings: Vec<Labelled<Recording>>,
            models: Vec<Labelled<Parameters>>,
            predictions: Vec<Labelled<Prediction>>,
        } -> Identified
}

impl Stage for Transfer {
    fn faults(&self, at: &mut Place) {
        self.shared_faults("fit", at);
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::on(&self.on)
    }

    fn run(&self, reads: TransferReads, context: &Context) -> Result<Identified> {
        let mut asked = RowsToFit::of(&reads.recording, &reads.split, &self.on)?;
        let earlier = reads.parameters.of_the_arm()?;
        let left = reads.parameters.0.len() - earlier.0.len();
        if left > 0 {
            context.note(format!(
                "not carried over, since they belong to the first measurement only: {}",
                counted(left, "parameter")
            ));
        }
        // Another recording has another clock: steps have happened, and the arm is warm. What lags follows the time between rows.
        asked.data.long_after = true;
        let source = CarriedFrom::of(&reads);
        let mut model = self.placed(&earlier, &reads, &asked)?;
        let open: Vec<usize> = match self.free {
            Some(_) => (0..model.x.len()).collect(),
            None => model.stack.parameters_of(names::BASE_FRAME).collect(),
        };
        let (candidates, held) = self.parameter_set().apply(&mut model, &open, context);
        let fit = self.fit(&model, &candidates, &mut asked, context);
        let mut carried = CarriedModel { earlier, fit, held };
        let mut covariance = reads.covariance.as_ref();
        if let Some(geometry) =
            self.better_alone(&carried, source.as_ref(), &reads, &asked, context)?
        {
            (carried, covariance) = (geometry, None);
        }
        let source_data = source.as_ref().map(|from| from.recording.measurements());
        let fitting = Fitting {
            earlier: Some(&carried.earlier),
            earlier_covariance: covariance,
            measured: source_data.as_ref().unwrap_or(&asked.data),
            doubtful: (0..asked.data.rows()).collect(),
            ..Fitting::of(&asked, &carried.fit, &carried.held, self.folds)
        };
        let identified = Identified::of(context, &fitting);
        let predicted = identified.prediction.0.iter();
        let remarked = predicted.filter(|row| row.remark.is_some());
        let (doubtful, rows) = (remarked.count(), counted(asked.data.rows(), "row"));
        if doubtful > 0 {
            context.note(format!(
                "{doubtful} of {rows}: the correction is uncertain by more than half of itself, see the remarks of `prediction`"
            ));
        }
        Ok(identified)
    }
}

/// A model on another recording, its base found anew there.
struct CarriedModel {
    earlier: Parameters,
    fit: FittedRows,
    held: Vec<usize>,
}

impl Transfer {
    /// A model with its base where these rows have it best.
    fn placed(
        &self,
        earlier: &Parameters,
        reads: &TransferReads,
        asked: &RowsToFit,
    ) -> Result<Model> {
        let robot = RobotModel::new(reads.robot.to_description()?);
        let there = earlier.model(robot.clone(), &[], self.load.into())?;
        let predicted = there.predict(&asked.data);
        let rows = asked.rows.iter();
        let points = rows.filter_map(|row| Some((predicted[*row], asked.data.point(*row)?)));
        let (carried, measured): (Vec<_>, Vec<_>) = points.unzip();
        let base = align_points(&carried, &measured) * there.base();
        earlier.model_standing(base, robot, &[], self.load.into())
    }

    /// The geometry alone, carried likewise, where it is better than all that was found; says how both do.
    fn better_alone(
        &self,
        carried: &CarriedModel,
        source: Option<&CarriedFrom>,
        reads: &TransferReads,
        asked: &RowsToFit,
        context: &Context,
    ) -> Result<Option<CarriedModel>> {
        if carried.earlier.0.iter().all(is_geometry) {
            return Ok(None);
        }
        let geometry = match source {
            Some(source) => source.geometry(reads, self.load.into())?.of_the_arm()?,
            None => stripped(&carried.earlier),
        };
        let RowsToFit {
            data, rows, split, ..
        } = asked;
        let start = self.placed(&geometry, reads, asked)?;
        let candidates: Vec<usize> = start.stack.parameters_of(names::BASE_FRAME).collect();
        let screened = self.screen.then_some(*split);
        let fit = fit_rows(&start, data, rows, &candidates, screened);
        let sides = sides(data, rows, [&carried.fit.screening, &fit.screening]);
        let visited =
            source.map(|source| VisitedCells::of(&source.recording.measurements(), &source.rows));
        let both = [&carried.fit.model, &fit.model].map(|model| model.predict(data));
        let both = both.each_ref().map(Vec::as_slice);
        let comparison = Comparison::of(data, &sides, both, visited.as_ref());
        let words = comparison.words();
        if comparison.chosen_by.is_worse(1) {
            context.warn(format!(
                "{words}: what was identified besides it does not hold here and is not used"
            ));
            let (earlier, held) = (geometry, Vec::new());
            return Ok(Some(CarriedModel { earlier, fit, held }));
        }
        match (comparison.all.is_worse(1), comparison.is_worse_outside()) {
            (true, _) => context.warn(format!(
                "{words}: what was identified besides the geometry makes these points worse, though not those that placed the base, by which it was chosen"
            )),
            (false, true) => {
                context.warn(format!("{words}: in unvisited cells what was identified in addition to the geometry makes it worse"))
            }
            (false, false) => context.note(words),
        }
        Ok(None)
    }
}

/// Whether a parameter is of the rigid arm, its gears or what it was measured to.
fn is_geometry(row: &ParameterRow) -> bool {
    row.form.is_none() && (row.effect == names::ANCHOR || BASE.contains(&row.effect.as_str()))
}

/// Whole points by which one of two carried models is chosen, those that place their base, and by which both are judged, all others, or
/// where there are none the same; without those that neither can follow.
fn sides(data: &Measurements, asked: &[usize], screenings: [&Screening; 2]) -> ComparedRows {
    let aside = |row: usize| {
        let mut all = screenings.iter();
        all.all(|one| one.set_aside().any(|other| other == row))
    };
    let whole = (0..data.rows()).filter(|row| data.has_point(*row) && !aside(*row));
    let (choose, mut judge): (Vec<usize>, Vec<usize>) = whole.partition(|row| asked.contains(row));
    if judge.is_empty() {
        judge.clone_from(&choose);
    }
    ComparedRows { choose, judge }
}

/// A recording that a model was fitted to.
pub(super) struct CarriedFrom<'a> {
    stage: String,
    pub recording: &'a Recording,
    /// Rows that it was fitted to.
    pub rows: Vec<usize>,
}

impl<'a> CarriedFrom<'a> {
    /// The recording of the carried model; none where the tables do not tell.
    pub fn of(reads: &'a TransferReads) -> Option<Self> {
        let mut models = reads.models.iter();
        let carried = models.rfind(|model| model.table == reads.parameters)?;
        Self::of_stage(reads, &carried.stage)
    }

    fn of_stage(reads: &'a TransferReads, stage: &str) -> Option<Self> {
        let mut predictions = reads.predictions.iter();
        let prediction = &predictions.find(|one| one.stage == stage)?.table;
        let mut recordings = reads.recordings.iter().map(|one| &one.table);
        let is_fitted = |at: &usize| !prediction.0[*at].held_out && !prediction.0[*at].suspect;
        Some(Self {
            stage: stage.into(),
            recording: recordings.find(|table| prediction.is_of(table))?,
            rows: (0..prediction.0.len()).filter(is_fitted).collect(),
        })
    }

    /// The geometry that an earlier stage identified by itself from the same recording, else the carried model's, fitted anew to the
    /// same rows without what else was found.
    pub fn geometry(&self, reads: &TransferReads, load: Load) -> Result<Parameters> {
        let of_the_arm = |row: &ParameterRow| {
            row.status == "free"
                && ![names::BASE_FRAME, names::TOOL_OFFSET].contains(&row.effect.as_str())
        };
        let alone = |parameters: &Parameters| {
            parameters.0.iter().all(is_geometry) && parameters.0.iter().any(of_the_arm)
        };
        let here = |stage: &str| {
            CarriedFrom::of_stage(reads, stage).is_some_and(|one| one.recording == self.recording)
        };
        let fits = |model: &&Labelled<Parameters>| {
            model.stage != self.stage && alone(&model.table) && here(&model.stage)
        };
        let identified = reads.models.iter().rfind(fits);
        if let Some(identified) = identified {
            return Ok(identified.table.clone());
        }
        let robot = RobotModel::new(reads.robot.to_description()?);
        let start = stripped(&reads.parameters).model(robot, &[], load)?;
        let candidates: Vec<usize> = (0..start.x.len()).collect();
        let data = self.recording.measurements();
        let (model, fitted) = fit(&start, &data, &self.rows, &candidates);
        Ok(Parameters::of(&self.stage, &model, &fitted, &[], None))
    }
}

/// The geometry as it stands among what else was found, which it makes up for in part.
pub(super) fn stripped(parameters: &Parameters) -> Parameters {
    let rows = parameters.0.iter().filter(|row| is_geometry(row));
    Parameters(rows.cloned().collect())
}

/// Beyond this the difference is not that of two ways to place a base.
const WORSE: f64 = 1.02;
/// Fewer points say nothing.
const FEWEST: usize = 5;

/// Errors of some points, mm.
struct CarriedErrors {
    mean: f64,
    rms: f64,
    largest: f64,
}

impl CarriedErrors {
    fn of(data: &Measurements, predicted: &[Vector3<f64>], rows: &[usize]) -> Self {
        let errors = || {
            rows.iter()
                .map(|row| data.points.residual(*row, &predicted[*row]).norm() * 1e3)
        };
        let count = rows.len().max(1) as f64;
        Self {
            mean: errors().sum::<f64>() / count,
            rms: (errors().map(|error| error * error).sum::<f64>() / count).sqrt(),
            largest: errors().fold(0.0, f64::max),
        }
    }

    fn words(&self) -> String {
        format!("mean {:.3}, largest {:.3} mm", self.mean, self.largest)
    }

    fn is_worse(&self, than: &Self) -> bool {
        self.rms > WORSE * than.rms || self.mean > WORSE * than.mean
    }
}

/// The same points by both.
struct Compared {
    points: usize,
    whole: CarriedErrors,
    geometry: CarriedErrors,
}

impl Compared {
    /// Whether the geometry alone is better at these points, of which there are so many at least.
    fn is_worse(&self, fewest: usize) -> bool {
        self.points >= fewest && self.whole.is_worse(&self.geometry)
    }
}

/// Rows of whole points: held-out ones judge and never choose.
pub struct ComparedRows {
    pub choose: Vec<usize>,
    pub judge: Vec<usize>,
}

/// Both models at the points that judge them.
pub struct Comparison {
    chosen_by: Compared,
    all: Compared,
    /// In cells of the joint space that the model was fitted in, and outside of them; none where that is not known.
    parts: Option<[Compared; 2]>,
}

impl Comparison {
    /// By predictions of the carried model and of its geometry.
    pub fn of(
        data: &Measurements,
        rows: &ComparedRows,
        [whole, geometry]: [&[Vector3<f64>]; 2],
        visited: Option<&VisitedCells>,
    ) -> Self {
        let compared = |rows: &[usize]| Compared {
            points: rows.len(),
            whole: CarriedErrors::of(data, whole, rows),
            geometry: CarriedErrors::of(data, geometry, rows),
        };
        let parts = visited.map(|visited| {
            let is_inside = |row: &&usize| visited.has(data.q(**row));
            let (inside, outside): (Vec<usize>, Vec<usize>) =
                rows.judge.iter().partition(is_inside);
            [compared(&inside), compared(&outside)]
        });
        Self {
            chosen_by: compared(&rows.choose),
            all: compared(&rows.judge),
            parts,
        }
    }

    /// Whether it is better where the joints had not been.
    fn is_worse_outside(&self) -> bool {
        let outside = self.parts.as_ref().map(|[_, outside]| outside);
        outside.is_some_and(|outside| outside.is_worse(FEWEST))
    }

    /// Both, with their figures.
    pub fn words(&self) -> String {
        let [whole, geometry] = [&self.all.whole, &self.all.geometry].map(CarriedErrors::words);
        let points = counted(self.all.points, "point");
        let mut text = format!(
            "the carried model leaves {whole} at {points} of this recording, the geometry alone, carried likewise, {geometry}"
        );
        let part = |part: &Compared| match part.points {
            0 => "none".to_string(),
            points => format!(
                "{}, {} against {}",
                counted(points, "point"),
                part.whole.words(),
                part.geometry.words()
            ),
        };
        if let Some([inside, outside]) = &self.parts {
            let [inside, outside] = [inside, outside].map(part);
            text += &format!(" (visited cells of the joint space: {inside}; unvisited: {outside})");
        }
        text
    }
}

/// Cells of a joint's travel between its least and greatest position.
const CELLS: f64 = 8.0;

/// Cells of pairs of joints that rows lie in; a pose is visited where each of its pairs of joints lies in one of them or next to one.
pub struct VisitedCells {
    /// Least position and width of a cell of each joint, rad or m.
    grid: Vec<[f64; 2]>,
    cells: BTreeSet<(usize, usize, i64, i64)>,
}

impl VisitedCells {
    /// The cells that some rows lie in.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        let joint = |joint: usize| {
            let range = rows.iter().map(|row| data.q(*row)[joint]);
            let [low, high] = range.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
                [low.min(q), high.max(q)]
            });
            [low, ((high - low) / CELLS).max(1e-3)]
        };
        let mut out = Self {
            grid: (0..data.joints).map(joint).collect(),
            cells: BTreeSet::new(),
        };
        for row in rows {
            let cell = out.cell(data.q(*row));
            out.cells
                .extend(pairs(cell.len()).map(|(a, b)| (a, b, cell[a], cell[b])));
        }
        out
    }

    /// Whether joints lie where rows lie.
    pub fn has(&self, q: &[f64]) -> bool {
        let cell = self.cell(q);
        let near = |cell: i64| cell - 1..=cell + 1;
        pairs(cell.len()).all(|(a, b)| {
            near(cell[a])
                .any(|one| near(cell[b]).any(|other| self.cells.contains(&(a, b, one, other))))
        })
    }

    fn cell(&self, q: &[f64]) -> Vec<i64> {
        q.iter()
            .zip(&self.grid)
            .map(|(q, [low, width])| ((q - low) / width).floor() as i64)
            .collect()
    }
}

fn pairs(joints: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..joints).flat_map(move |a| (a + 1..joints).map(move |b| (a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_that_no_row_reached_is_unvisited_though_each_joint_has_been_there() {
        let all = (0..64).map(|k| [f64::from(k % 8), f64::from(k / 8)]);
        let q: Vec<f64> = all
            .filter(|[one, other]| *one < 4.0 || *other < 4.0)
            .flatten()
            .collect();
        let data = Measurements {
            joints: 2,
            q,
            ..Measurements::default()
        };
        let rows: Vec<usize> = (0..data.rows()).collect();
        let visited = VisitedCells::of(&data, &rows);
        assert!(visited.has(&[1.0, 1.0]) && visited.has(&[6.5, 0.5]));
        assert!(!visited.has(&[6.5, 6.5]) && !visited.has(&[-3.0, 1.0]));
    }
}

//! `transfer`: an identified model on another recording of the same robot. The arm is held; only where its base stands is found anew.

use crate::diagnose::BASE;
use crate::effect::{Load, names};
use crate::error::{Place, Result, counted};
use crate::estimate::{FitOptions, Model, Screening, align_points, fit};
use crate::robot::{Measurements, RobotModel};
use crate::stage::identified::{Fitting, Identified, RowsToFit};
use crate::stage::screened::{FittedRows, fit_rows};
use crate::stage::{Context, Labelled, Stage};
use crate::table::{
    CovarianceTable, ParameterRow, Parameters, Prediction, Recording, Robot, Split,
};
use comparison::{ComparedRows, Comparison, VisitedCells};

mod comparison;

crate::stage::identified::identification! {
    /// Settings of `transfer`.
    pub struct Transfer {
        /// Sets of the split by which the base is found.
        #[serde(default = "fit_set")]
        pub(crate) on: Vec<String>,
    }
}

fn fit_set() -> Vec<String> {
    vec!["fit".into()]
}

crate::stage::stage! {
    Transfer, "transfer", 14, "tests an identified model on another recording of the robot; only its base is estimated anew",
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
        crate::stage::on(&self.on)
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
        let source_data = source
            .as_ref()
            .map(|source| source.recording.measurements());
        let fitting = Fitting {
            earlier: Some(&carried.earlier),
            earlier_covariance: covariance,
            measured: source_data.as_ref().unwrap_or(&asked.data),
            doubtful: (0..asked.data.rows()).collect(),
            ..Fitting::of(&asked, &carried.fit, &carried.held, self.folds)
        };
        let identified = Identified::of(context, &fitting);
        let remarked = identified
            .prediction
            .0
            .iter()
            .filter(|row| row.remark.is_some());
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
        let points = asked
            .rows
            .iter()
            .filter_map(|row| Some((predicted[*row], asked.data.point(*row)?)));
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
        let options = FitOptions {
            rows,
            candidates: &candidates,
        };
        let fit = fit_rows(&start, data, &options, split, self.screen);
        let sides = sides(data, rows, [&carried.fit.screening, &fit.screening]);
        let visited =
            source.map(|source| VisitedCells::of(&source.recording.measurements(), &source.rows));
        let both = [
            &carried.fit.model.predict(data)[..],
            &fit.model.predict(data),
        ];
        let comparison = Comparison::of(data, &sides, both, visited.as_ref());
        let words = comparison.words();
        if comparison.is_worse() {
            context.warn(format!(
                "{words}: what was identified besides it does not hold here and is not used"
            ));
            let (earlier, held) = (geometry, Vec::new());
            return Ok(Some(CarriedModel { earlier, fit, held }));
        }
        match (comparison.is_worse_where_judged(), comparison.is_worse_outside()) {
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
        screenings
            .iter()
            .all(|one| one.set_aside().any(|other| other == row))
    };
    let whole: Vec<usize> = (0..data.rows())
        .filter(|row| data.has_point(*row) && !aside(*row))
        .collect();
    let (choose, others): (Vec<usize>, Vec<usize>) =
        whole.into_iter().partition(|row| asked.contains(row));
    ComparedRows {
        judge: if others.is_empty() {
            choose.clone()
        } else {
            others
        },
        choose,
    }
}

/// A recording that a model was fitted to.
pub(super) struct CarriedFrom<'a> {
    stage: String,
    pub(crate) recording: &'a Recording,
    /// Rows that it was fitted to.
    pub(crate) rows: Vec<usize>,
}

impl<'a> CarriedFrom<'a> {
    /// The recording of the carried model; none where the tables do not tell.
    pub fn of(reads: &'a TransferReads) -> Option<Self> {
        let carried = reads
            .models
            .iter()
            .rfind(|model| model.table == reads.parameters)?;
        Self::of_stage(reads, &carried.stage)
    }

    fn of_stage(reads: &'a TransferReads, stage: &str) -> Option<Self> {
        let prediction = &reads
            .predictions
            .iter()
            .find(|one| one.stage == stage)?
            .table;
        let recording = reads
            .recordings
            .iter()
            .map(|one| &one.table)
            .find(|table| prediction.is_of(table))?;
        let rows = (0..)
            .zip(&prediction.0)
            .filter(|(_, row)| !row.held_out && !row.suspect)
            .map(|(at, _)| at)
            .collect();
        Some(Self {
            stage: stage.into(),
            recording,
            rows,
        })
    }

    /// The geometry that an earlier stage identified by itself from the same recording, else the carried model's, fitted anew to the
    /// same rows without what else was found.
    pub(crate) fn geometry(&self, reads: &TransferReads, load: Load) -> Result<Parameters> {
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
        let identified = reads
            .models
            .iter()
            .rfind(|model| model.stage != self.stage && alone(&model.table) && here(&model.stage));
        if let Some(identified) = identified {
            return Ok(identified.table.clone());
        }
        let start = stripped(&reads.parameters).model(
            RobotModel::new(reads.robot.to_description()?),
            &[],
            load,
        )?;
        let candidates: Vec<usize> = (0..start.x.len()).collect();
        let options = FitOptions {
            rows: &self.rows,
            candidates: &candidates,
        };
        let (model, fitted) = fit(&start, &self.recording.measurements(), &options);
        Ok(Parameters::of(&self.stage, &model, &fitted, &[], None))
    }
}

/// The geometry as it stands among what else was found, which it makes up for in part.
pub(super) fn stripped(parameters: &Parameters) -> Parameters {
    Parameters(
        parameters
            .0
            .iter()
            .filter(|row| is_geometry(row))
            .cloned()
            .collect(),
    )
}

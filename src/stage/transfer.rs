//! `transfer`: an identified model on another recording of the same robot. The arm is held; only where its base stands is found anew.

use crate::effect::{BaseFrame, LONG_AFTER};
use crate::error::{Fault, Result, counted};
use crate::estimate::{FitOptions, align_points};
use crate::robot::RobotModel;
use crate::stage::identified::{Fitting, Identified};
use crate::stage::screened::fit_rows;
use crate::stage::{Context, Stage};
use crate::table::{CovarianceTable, Parameters, Recording, Robot, Split};

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
    /// Input ports of [`Transfer`]: another recording with its split, and the model to try on it.
    pub struct TransferReads {
        robot: Robot,
        recording: Recording,
        split: Split,
        parameters: Parameters,
        covariance: Option<CovarianceTable>,
    }
}

impl Stage for Transfer {
    const NAME: &'static str = "transfer";
    const SUMMARY: &'static str = "tries an identified model on another recording of the robot; only its base is found anew";
    const IMPLEMENTATION: u32 = 4;
    type Reads = TransferReads;
    type Writes = Identified;

    fn check(&self) -> Vec<Fault> {
        self.shared_faults("fit")
    }

    fn run(&self, reads: TransferReads, context: &Context) -> Result<Identified> {
        let mut data = reads.recording.measurements();
        let rows = reads.split.rows(&reads.recording, &self.on)?;
        let earlier = reads.parameters.of_the_arm()?;
        let left = reads.parameters.0.len() - earlier.0.len();
        if left > 0 {
            context.services.note(format!("left behind, being of the first measurement alone: {}", counted(left, "parameter")));
        }
        // Another recording has another clock: steps have happened, and the arm is warm.
        data.time = Some(vec![LONG_AFTER; data.rows()]);
        let robot = RobotModel::new(reads.robot.to_description()?);
        let there = earlier.model(robot.clone(), &[], self.load.into())?;
        let predicted = there.predict(&data);
        let whole: Vec<usize> = rows.iter().copied().filter(|row| data.whole(*row)).collect();
        let points = |of: &[nalgebra::Vector3<f64>]| whole.iter().map(|row| of[*row]).collect::<Vec<_>>();
        let base = align_points(&points(&predicted), &points(&data.position)) * there.base();
        let mut model = earlier.model_standing(base, robot, &[], self.load.into())?;
        let open = |name: &str| self.free.is_some() || name.starts_with(BaseFrame::NAME);
        let (candidates, held) = self.parameter_set().apply(&mut model, open, context);
        let repeatability = self.repeatability.apply(&model, &mut data, &rows, context);
        let options = FitOptions { rows: &rows, candidates: &candidates };
        let (fitted, screening) = fit_rows(&mut model, &data, &options, &reads.split, self.screen);
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
        Ok(Identified::of(context, &model, &fitted, &fitting))
    }
}

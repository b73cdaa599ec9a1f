//! Joint stiffness on top of an identified geometry, which is kept: the second step of the paper's sequence (Sec. 4, Eqs. 24-30).

use crate::effect::names;
use crate::error::{Error, Fault, Result};
use crate::estimate::FitOptions;
use crate::robot::RobotModel;
use crate::stage::identified::{Fitting, Identified};
use crate::stage::screened::fit_rows;
use crate::stage::{Context, Stage};
use crate::table::{CovarianceTable, Parameters, Prediction, Recording, Robot, Split};

crate::stage::identified::identification! {
    /// Settings of `stiffness`.
    pub struct Stiffness {
        /// Sets of the split to fit: loaded poses.
        pub on: Vec<String>,
        /// Joints to estimate, from 1; all that the data see if empty.
        #[serde(default)]
        pub joints: Vec<usize>,
    }
}

crate::stage::reads! {
    /// Input ports of [`Stiffness`].
    pub struct StiffnessReads {
        robot: Robot,
        recording: Recording,
        split: Split,
        parameters: Parameters,
        covariance: Option<CovarianceTable>,
        prediction: Prediction,
    }
}

impl Stage for Stiffness {
    const NAME: &'static str = "stiffness";
    const SUMMARY: &'static str =
        "identifies joint compliance from loaded poses; everything identified before is kept";
    const IMPLEMENTATION: u32 = 17;
    type Reads = StiffnessReads;
    type Writes = Identified;

    fn check(&self) -> Vec<Fault> {
        self.shared_faults("loaded")
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::stage::on(&self.on)
    }

    fn run(&self, reads: StiffnessReads, context: &Context) -> Result<Identified> {
        let robot = RobotModel::new(reads.robot.to_description()?);
        let mut data = reads.recording.measurements();
        let rows = reads.split.rows(&reads.recording, &self.on)?;
        let mut model =
            reads
                .parameters
                .model(robot, &[names::JOINT_COMPLIANCE], self.load.into())?;
        let compliance = model
            .stack
            .effects()
            .find(|(effect, _)| effect.name() == names::JOINT_COMPLIANCE);
        if let Some(reason) = compliance.and_then(|(effect, _)| effect.missing(&model.robot, &data))
        {
            return Err(Error::data(
                "with.load",
                format!("no joint load is known: {reason}"),
            ));
        }
        let wanted: Vec<String> = self
            .joints
            .iter()
            .map(|joint| format!("{}.j{joint}", names::JOINT_COMPLIANCE))
            .collect();
        let specs = model.stack.specs();
        if let Some(unknown) = wanted
            .iter()
            .find(|name| !specs.iter().any(|spec| spec.name == **name))
        {
            return Err(Error::spec(
                "with.joints",
                format!("this robot has no `{unknown}`: allowed are its revolute joints, from 1"),
            ));
        }
        let chosen = |k: &usize| wanted.is_empty() || wanted.contains(&specs[*k].name);
        let own: Vec<usize> = model.stack.parameters_of(names::JOINT_COMPLIANCE).collect();
        let open: Vec<usize> = own.iter().copied().filter(chosen).collect();
        let (candidates, _) = self.parameter_set().apply(&mut model, &open, context);
        let repeatability = self.repeatability.apply(&model, &mut data, &rows, context);
        let options = FitOptions {
            rows: &rows,
            candidates: &candidates,
        };
        let (model, fitted, screening) =
            fit_rows(&model, &data, &options, &reads.split, self.screen);
        let held: Vec<usize> = own
            .into_iter()
            .filter(|k| !candidates.contains(k))
            .collect();
        let seen_before: Vec<bool> = reads.prediction.0.iter().map(|row| !row.held_out).collect();
        let fitting = Fitting {
            data: &data,
            recording: &reads.recording,
            split: &reads.split,
            asked: &rows,
            rows: &screening.kept,
            screening: &screening,
            held: &held,
            earlier: Some(&reads.parameters),
            earlier_covariance: reads.covariance.as_ref(),
            seen_before: &seen_before,
            geometry: None,
            repeatability,
            folds: self.folds,
            measured: &data,
            doubtful: (0..data.rows())
                .filter(|row| !seen_before[*row] && rows.binary_search(row).is_err())
                .collect(),
            placed: &std::collections::BTreeMap::new(),
        };
        Ok(Identified::of(context, &model, &fitted, &fitting))
    }
}

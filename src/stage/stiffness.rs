//! Joint stiffness on top of an identified geometry, which is kept: the second step of the paper's sequence (Sec. 4, Eqs. 24-30).

use crate::effect::names;
use crate::error::{Error, Place, Result};
use crate::robot::RobotModel;
use crate::stage::identified::{Fitting, Identified, RowsToFit};
use crate::stage::{Context, Stage};
use crate::table::{CovarianceTable, Parameters, Prediction, Recording, Robot, Split};

crate::stage::identified::identification! {
    /// Settings of `stiffness`.
    pub struct Stiffness {
        /// Sets of the split to fit: loaded poses.
        pub(crate) on: Vec<String>,
        /// Joints to estimate, from 1; all that the data see if empty.
        #[serde(default)]
        pub(crate) joints: Vec<usize>,
    }
}

crate::stage::stage! {
    Stiffness, "stiffness", 17, "identifies joint compliance from loaded poses; everything identified before is kept",
        StiffnessReads {
            robot: Robot,
            recording: Recording,
            split: Split,
            parameters: Parameters,
            covariance: Option<CovarianceTable>,
            prediction: Prediction,
        } -> Identified
}

impl Stage for Stiffness {
    fn faults(&self, at: &mut Place) {
        self.shared_faults("loaded", at);
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::stage::on(&self.on)
    }

    fn run(&self, reads: StiffnessReads, context: &Context) -> Result<Identified> {
        let robot = RobotModel::new(reads.robot.to_description()?);
        let mut asked = RowsToFit::of(&reads.recording, &reads.split, &self.on)?;
        let mut model =
            reads
                .parameters
                .model(robot, &[names::JOINT_COMPLIANCE], self.load.into())?;
        let compliance = model
            .stack
            .effects()
            .find(|(effect, _)| effect.name() == names::JOINT_COMPLIANCE);
        if let Some(reason) =
            compliance.and_then(|(effect, _)| effect.missing(&model.robot, &asked.data))
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
        let all: Vec<usize> = model.stack.parameters_of(names::JOINT_COMPLIANCE).collect();
        let open: Vec<usize> = all.iter().copied().filter(chosen).collect();
        let (candidates, _) = self.parameter_set().apply(&mut model, &open, context);
        let fit = self.fit(&model, &candidates, &mut asked, context);
        let held: Vec<usize> = all
            .into_iter()
            .filter(|k| !candidates.contains(k))
            .collect();
        let seen_before: Vec<bool> = reads.prediction.0.iter().map(|row| !row.held_out).collect();
        let mut fitting = Fitting {
            earlier: Some(&reads.parameters),
            earlier_covariance: reads.covariance.as_ref(),
            ..Fitting::of(&asked, &fit, &held, self.folds)
        };
        fitting.doubtful.retain(|row| !seen_before[*row]);
        fitting.seen_before = seen_before;
        Ok(Identified::of(context, &fitting))
    }
}

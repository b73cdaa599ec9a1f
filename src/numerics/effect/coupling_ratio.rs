//! `coupling_ratio`: joint B moves with joint A by more than the controller believes; the parameter is h of Eq. 14, times k_A.
//!
//! One parameter for each coupling that the robot file declares; of others a term for each pair.

use super::{
    ArmState, Cause, Deflection, Effect, Hypothesis, Law, Motion, NumberSpec, ParameterSpec, Place, Summary, Survey, Term,
    Variable, about, figure, names,
};
use crate::criteria::effect::RARER;
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;

pub struct CouplingRatio;

impl Cause for CouplingRatio {
    about! {
        name: names::COUPLING_RATIO,
        place: "joint A->B",
        formula: "d of B = c q of A",
        size: "1e-5 to 1e-2",
        confounded: "axis_wobble, link_geometry",
        needs: "a wide travel of joint A",
        arm_effect: Some(|_| Box::new(DeclaredCouplings)),
    }

    /// Every pair that the robot file does not declare.
    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let declared = |by, moved| survey.robot.description().couplings.iter().any(|c| c.by == by && c.moved == moved);
        let n = survey.joints();
        let pairs = (0..n).flat_map(|by| (0..n).map(move |moved| (by, moved)));
        let pairs = pairs.filter(|(by, moved)| by != moved && !declared(*by, *moved));
        let pair = |(by, moved): (usize, usize)| {
            let penalty = if by.abs_diff(moved) == 1 { 0.0 } else { *RARER };
            let term = Term::new(&Self, Motion::Coupled { by, moved }, Law::of(Variable::Angle { joint: by }));
            Hypothesis::new(term, 1).penalised(penalty)
        };
        pairs.map(pair).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        vec![(String::new(), Unit::One, 0.01)]
    }

    fn sentence(&self, summary: &Summary) -> String {
        let share = summary.parameters.first().map_or_else(String::new, |n| figure(n.value * 100.0, 2));
        format!("{}: the second moves with the first by {share} % of its angle", summary.place)
    }
}

/// The couplings of the robot file.
struct DeclaredCouplings;

impl Effect for DeclaredCouplings {
    fn name(&self) -> &'static str {
        CouplingRatio.name()
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let couplings = robot.description().couplings.iter();
        let spec = |place: Place| ParameterSpec {
            name: format!("coupling_ratio.{}", place.tag()),
            place,
            unit: Unit::One,
            prior_sigma: 0.01,
        };
        couplings.map(|coupling| spec(Place::Coupled(coupling.by, coupling.moved))).collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (parameter, coupling) in robot.description().couplings.iter().enumerate() {
            out.turn(parameter, p, coupling.moved, state.q[coupling.by]);
        }
    }

    fn missing(&self, robot: &RobotModel, _data: &Measurements) -> Option<String> {
        robot.description().couplings.is_empty().then(|| "the robot file declares no couplings".to_string())
    }
}

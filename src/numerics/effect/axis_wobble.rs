//! `axis_wobble`: the axis of a joint tilts as the joint turns; sines and cosines of an order in one plane or two, which stand in the
//! link before the joint (an outer ring that is not round) or turn with the joint (an inner one).

use super::{
    AxisPoint, Basis, Cause, Hypothesis, Law, Measure, Motion, NumberSpec, Summary, Survey, Term, Variable, about, names,
};
use crate::criteria::effect::{RARE, WOBBLES};
use crate::robot::RobotModel;
use crate::units::Unit;

/// An axis that tilts with its own angle.
pub struct AxisWobble;

/// No bearing lets an axis tilt further, rad (400 arcsec).
const LARGEST: f64 = 2e-3;
/// Points of the axis that are nearer to each other (m) are one.
const NEAR: f64 = 0.02;

impl Cause for AxisWobble {
    about! {
        name: names::AXIS_WOBBLE,
        place: "joint",
        formula: "the axis tilts by sin(n q), cos(n q), n = 1, 2",
        size: "5 to 100 arcsec",
        confounded: "gear_cyclic of a neighbour, coupling_ratio",
        needs: "points far off the axis",
        measure: Some(Measure { rank: 6, advice: "measure a second target off the first" }),
    }

    /// Every joint but the last, whose tilt one measured point cannot separate from its angle.
    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let last = survey.joints() - 1;
        let forms = survey.revolute().filter(|joint| *joint != last).flat_map(|joint| {
            let own = survey.robot.point(joint);
            let far = move |at: &AxisPoint| *at == AxisPoint::Own || (at.of(survey.robot, joint) - own).norm() > NEAR;
            let points = [AxisPoint::Own, AxisPoint::Next, AxisPoint::Before].into_iter().filter(far);
            let orders = [1, 2].into_iter().flat_map(|order| [(order, true), (order, false)]);
            let ways = points.flat_map(move |at| orders.clone().map(move |(order, turning)| (at, order, turning)));
            ways.flat_map(move |(at, order, turning)| {
                let law = Law::new(Variable::Angle { joint }, Basis::Wave { order, overtone: false });
                let odds = if at == AxisPoint::Own { 0.0 } else { *RARE };
                [None, Some(0), Some(1)].map(|about| (Term::new(&Self, Motion::Axis { joint, about, turning, at }, law), odds))
            })
        });
        let one = |(form, odds): (Term, f64)| Hypothesis::new(form, *WOBBLES).penalised(*RARE + odds).within(LARGEST);
        forms.map(one).collect()
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        let Motion::Axis { about, .. } = term.motion() else { return Vec::new() };
        let names = [["a_sin", "a_cos"], ["b_sin", "b_cos"]];
        let chosen = (0..2).filter(|k| about.is_none_or(|about| about == *k)).flat_map(|k| names[k]);
        chosen.map(|name| (name.to_string(), Unit::Radian, 0.01)).collect()
    }

    fn variant(&self, term: &Term) -> String {
        match (term.basis(), term.motion()) {
            (Basis::Wave { order, .. }, Motion::Axis { turning, .. }) => {
                format!("order{order}{}", if turning { "" } else { "_fixed" })
            }
            _ => String::new(),
        }
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("the axis of {} tilts as the joint turns", summary.place)
    }
}

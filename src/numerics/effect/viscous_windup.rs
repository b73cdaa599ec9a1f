//! `viscous_windup`: a moving joint trails behind in proportion to its speed, since viscous friction winds its gear up: d = -c dq/dt.
//!
//! c is the friction's coefficient over the gear's stiffness (s, or arcsec per deg/s). Standing targets know nothing of it.

use super::{
    Basis, Cause, Form, HiddenSize, Hypothesis, Law, Motion, NumberSpec, Place, Summary, Survey, Term, Variable, about, figure,
    names,
};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Joints that trail in proportion to their speed.
pub struct ViscousWindup;

/// s: a joint that trails farther is not driven.
const LARGEST: f64 = 0.1;
/// s: a joint that trails by less (5 arcsec for each deg/s) is no cause to measure again.
const TRAIL: f64 = 5.0 / 3600.0;

impl Cause for ViscousWindup {
    about! {
        name: names::VISCOUS_WINDUP,
        place: "joint",
        formula: "d = -c dq/dt: the joint trails in proportion to its speed",
        size: "0.2 to 10 arcsec for each deg/s",
        confounded: "joint_log_lag where one joint moves alone",
        needs: "joint velocities, of a moving arm",
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        if !survey.moves() {
            return Vec::new();
        }
        let moving = |joint: &usize| survey.rows.iter().any(|row| survey.data.velocity(*row, *joint) != 0.0);
        let law = |joint| Law::new(Variable::Velocity { joint }, Basis::Linear { zero: 0.0, per: -1.0 });
        let terms = (0..survey.joints()).filter(moving).map(|joint| Term::new(&Self, Motion::Joint { joint }, law(joint)));
        terms.map(|term| Hypothesis::new(term, 1).positive().within(LARGEST)).collect()
    }

    fn numbers(&self, term: &Term, robot: &RobotModel) -> Vec<NumberSpec> {
        let turns = term.motion().unit(robot) == Unit::Radian;
        vec![("trail".into(), if turns { Unit::RadianPerRadianPerSecond } else { Unit::Second }, 0.01)]
    }

    fn sentence(&self, summary: &Summary) -> String {
        let trail = summary.parameters.first().map_or_else(String::new, |n| format!("{} {}", figure(n.value, 2), n.unit));
        format!("{} trails behind in proportion to its speed, by {trail}", summary.place)
    }

    fn hidden(&self, form: &Form, robot: &RobotModel) -> Option<HiddenSize> {
        let turns = matches!(form.place(), Place::Joint(joint) if robot.is_revolute(joint));
        let unit = Unit::ArcsecondPerDegreePerSecond;
        turns.then_some(HiddenSize { subject: None, may: "may trail", least: TRAIL, unit })
    }
}

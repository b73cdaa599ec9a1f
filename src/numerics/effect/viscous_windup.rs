//! `viscous_windup`: a moving joint trails behind in proportion to its speed, since viscous friction winds its gear up: d = -c dq/dt.
//!
//! c is the friction's coefficient over the gear's stiffness (s, or arcsec per deg/s). Standing targets know nothing of it.

use super::{Basis, Cause, CauseDescription, Hypothesis, Law, Motion, NumberSpec, Summary, Survey, Term, Variable, figure};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Joints that trail in proportion to their speed.
pub struct ViscousWindup;

/// s: a joint that trails farther is not driven.
const LARGEST: f64 = 0.1;

impl ViscousWindup {
    /// Canonical name, as in tables and YAML.
    pub const NAME: &'static str = "viscous_windup";
}

impl Cause for ViscousWindup {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: Self::NAME,
            place: "joint",
            formula: "d = -c dq/dt: the joint trails in proportion to its speed",
            size: "0.2 to 10 arcsec for each deg/s",
            confounded: "joint_log_lag where one joint moves alone",
            needs: "joint velocities, of a moving arm",
        }
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

    fn finer(&self) -> &'static [&'static str] {
        &["backlash", "gear_cyclic", "unknown"]
    }
}

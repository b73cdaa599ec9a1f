//! What the way of a moving arm is too short or too slow to show: there geometry takes up most of what depends on the speed.

use super::last_round::LastRound;
use crate::criteria::words::{CLOCKS, FOUND};
use crate::effect::{JointLogLag, Place, Variable, ViscousWindup};
use crate::units::Unit;

const TRAIL: f64 = 5.0 / 3600.0;

/// Sentences for causes by speed that could be as large as usual and would not be found.
pub(super) fn by_speed(last: &LastRound) -> Vec<String> {
    let pool = last.pool;
    let mut out = Vec::new();
    let (mut joints, mut largest): (Vec<String>, f64) = (Vec::new(), 0.0);
    for (h, hypothesis) in pool.hypotheses.iter().enumerate().filter(|(h, _)| !last.judged.set.contains(h)) {
        let form = &hypothesis.form;
        let clocks = form.is(&JointLogLag) && form.variables() == [Variable::Speed];
        let turns = |place| matches!(place, Place::Joint(joint) if last.survey.robot.is_revolute(joint));
        if !(clocks || form.is(&ViscousWindup) && turns(form.place())) {
            continue;
        }
        let mut set = last.judged.set.clone();
        set.push(h);
        set.sort_unstable();
        let before: usize = set.iter().take_while(|k| **k != h).map(|k| pool.first[k + 1] - pool.first[*k]).sum();
        // What cannot be seen at all has no standard error.
        let error = Some(pool.solve(&set).error(before)).filter(|error| *error > 0.0);
        let limit = error.map_or(f64::INFINITY, |error| *FOUND * error);
        if clocks && limit > *CLOCKS {
            out.push(format!("{}: clocks may be apart {}; {ADVICE}", form.name(), size(limit, Unit::Millisecond)));
        } else if !clocks && limit > TRAIL {
            joints.push(form.place().to_string());
            largest = largest.max(limit);
        }
    }
    if !joints.is_empty() {
        let (names, size) = (joints.join(", "), size(largest, Unit::ArcsecondPerDegreePerSecond));
        out.push(format!("viscous_windup: {names} may trail {size}; {ADVICE}"));
    }
    out
}

const ADVICE: &str = "geometry absorbs it on this path: measure longer, faster, over the joints' whole range";

fn size(limit: f64, unit: Unit) -> String {
    if limit.is_finite() { format!("by up to {:.1} {unit}", unit.from_si(limit)) } else { "by any amount".into() }
}

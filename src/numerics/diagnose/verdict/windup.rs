//! Whether a free curve of a joint over its own load can be its wind-up: the more a joint is loaded, the more it turns that way.

use super::findings::LastRound;
use crate::criteria::words::{FIRM, LOADS, NAMELESS};
use crate::diagnose::table::FoundCell;
use crate::effect::{Deflection, Direction, Place, names};
use nalgebra::DVector;

/// Rows of like loads.
struct LoadGroup {
    /// Nm, mean.
    load: f64,
    /// rad, mean turn of the joint.
    turn: f64,
    /// Its derivatives by the coefficients of the finding.
    derivatives: DVector<f64>,
}

/// Loads (Nm) between which what is called hardening firmly turns back as the load grows; none of what is a wind-up.
pub(super) fn turns_back(last: &LastRound, found: &FoundCell) -> Option<[f64; 2]> {
    let Place::Joint(joint) = found.place else {
        return None;
    };
    if found.effect != names::JOINT_HARDENING {
        return None;
    }
    let state = &last.state;
    // A stated shape fits to its rows as well as it can.
    let is_stated = |i: &usize| state.causes[*i].form.words(&[]).is_some();
    if found.members.iter().any(is_stated) {
        return None;
    }
    let ranges = found.members.iter().map(|i| state.ranges[*i].clone());
    let parameters: Vec<usize> = ranges.flatten().collect();
    let covariance = state.fitted.covariance.as_ref()?.block(&parameters)?;
    let groups = groups(last, found, joint, parameters.len());
    let turns = groups.iter().map(|group| group.turn);
    let [least, most] = turns.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], turn| {
        [a.min(turn), b.max(turn)]
    });
    let firmly = |from: &LoadGroup, to: &LoadGroup| {
        let along = &to.derivatives - &from.derivatives;
        let error = along.dot(&(&covariance * &along)).max(0.0).sqrt();
        from.turn - to.turn - *FIRM * error > *NAMELESS * (most - least)
    };
    let mut pairs = groups
        .iter()
        .enumerate()
        .flat_map(|(k, from)| groups[k + 1..].iter().map(move |to| (from, to)));
    let (from, to) = pairs.find(|(from, to)| firmly(from, to))?;
    Some([from.load, to.load])
}

/// Rows in the order of their loads, in groups of equal numbers.
fn groups(last: &LastRound, found: &FoundCell, joint: usize, count: usize) -> Vec<LoadGroup> {
    let (state, problem) = (&last.state, &last.view.problem);
    let robot = &state.model.robot;
    let mut buffer = Deflection::new(robot.joints());
    let mut rows: Vec<LoadGroup> = Vec::new();
    for motion in problem.motions() {
        let mut row = LoadGroup {
            load: motion.posture.torque[joint],
            turn: 0.0,
            derivatives: DVector::zeros(count),
        };
        let mut first = 0;
        for i in &found.members {
            let values = &state.model.x[state.ranges[*i].clone()];
            let form = &state.causes[*i].form;
            motion.deflect(robot, last.survey.data, form, values, &mut buffer);
            for (parameter, direction) in &buffer.partials {
                if let Direction::Joint(at, rate) = direction
                    && *at == joint
                {
                    row.turn += values[*parameter] * rate;
                    row.derivatives[first + parameter] += rate;
                }
            }
            first += values.len();
        }
        rows.push(row);
    }
    rows.sort_by(|a, b| a.load.total_cmp(&b.load));
    let mean = |rows: &[LoadGroup]| {
        let share = 1.0 / rows.len() as f64;
        let sum = |value_of: fn(&LoadGroup) -> f64| rows.iter().map(value_of).sum::<f64>() * share;
        LoadGroup {
            load: sum(|row| row.load),
            turn: sum(|row| row.turn),
            derivatives: rows
                .iter()
                .map(|row| &row.derivatives)
                .sum::<DVector<f64>>()
                * share,
        }
    };
    rows.chunks(rows.len().div_ceil(*LOADS).max(1))
        .map(mean)
        .collect()
}

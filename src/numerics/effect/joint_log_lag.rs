//! `joint_log_lag`: joints and points are not of one moment. Of standing points a share of the last move was still to come when the
//! joints were logged, or, where a controller ends the moves of all joints together, a turn shared out as these moves are; of a moving arm the two clocks are apart: each joint is dq/dt times the same time further on.

use super::form::placed;
use super::summary::rounded;
use super::{
    ArmState, Cause, Deflection, Errors, Form, HiddenSize, Hypothesis, NumberSpec, OwnMotion,
    Place, Placed, Summary, Survey, Variable, figure, names,
};
use crate::criteria::words::CLOCKS;
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

/// What the lag is in proportion to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Behind {
    /// The last move of each joint.
    #[default]
    Move,
    /// The last move of each joint as a share of the largest move of any: all joints of a synchronous motion settle alike.
    Synchronous,
    /// The velocity of each joint.
    Clock,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Lag {
    /// Whether each joint lags by a share of its own; else all by one.
    each: bool,
    #[serde(default)]
    by: Behind,
    /// The joint (from 0) that alone lags; none where all do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    only: Option<usize>,
}

/// s: clocks farther apart belong to other postures altogether.
const LARGEST: f64 = 0.3;

pub(super) static CAUSE: Cause = Cause {
    name: names::JOINT_LOG_LAG,
    place: "recording",
    formula: "joints were logged a fraction of the last move too early; of a moving arm d = c dq/dt of every joint, c between its clock and the tracker's",
    size: "0.1 to 5 % of the move; 0.5 to 20 ms",
    confounded: "backlash; viscous_windup where one joint moves alone",
    needs: "rows in the order of measurement; joint velocities",
    hidden: Some(|| HiddenSize {
        subject: Some("clocks"),
        may: "may be apart",
        least: *CLOCKS,
        unit: Unit::Millisecond,
    }),
    motion: Some(OwnMotion {
        propose,
        sentence: Some(sentence),
        read: Form::kept::<Lag>,
    }),
    of_the_measurement: true,
    separable_by_poses: false,
    ..Cause::PLAIN
};

fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let one_of = |tried: usize, each: bool, by: Behind, only: Option<usize>| {
        Hypothesis::new(Lag { each, by, only }, tried)
    };
    if survey.moves() {
        // What a joint moves from one row to the next is its velocity: a share of it is a time, too.
        return vec![one_of(1, false, Behind::Clock, None).within(LARGEST)];
    }
    let turning: Vec<usize> = survey
        .revolute()
        .filter(|joint| survey.travel(*joint) > 0.0)
        .collect();
    let all = [
        (false, Behind::Move),
        (true, Behind::Move),
        (false, Behind::Synchronous),
    ];
    let all = all.map(|(each, by)| one_of(3, each, by, None)).into_iter();
    let single = turning
        .iter()
        .map(|joint| one_of(turning.len(), false, Behind::Move, Some(*joint)));
    all.chain(single).collect()
}

fn sentence(summary: &Summary) -> String {
    let clocks = summary
        .variables(names::JOINT_LOG_LAG)
        .contains(&Variable::Speed);
    match summary.parameters.first() {
        Some(n) if clocks => {
            let (how, when) = if n.value < 0.0 {
                ("early", "before")
            } else {
                ("late", "after")
            };
            let ms = rounded(n.value.abs(), n.sigma, 2);
            format!(
                "the tracker's clock is {ms} ms {how} relative to the controller's: points were measured that long {when} the joints \
                 of their rows"
            )
        }
        // A turn that is shared out, not shares of each turn.
        Some(n) if n.unit == "arcsec" => format!(
            "joints were logged before the arm had settled: the joint that moved most had {} arcsec still to come, the others their \
             shares of it",
            rounded(n.value, n.sigma, 0)
        ),
        Some(n)
            if let Some(joint) = n
                .name
                .rsplit_once("share_j")
                .map(|(_, joint)| joint)
                .filter(|_| summary.parameters.len() == 1) =>
        {
            format!(
                "joint {joint} was logged before it had settled: {} % of its last move was still to come",
                rounded(n.value * 100.0, n.sigma.map(|sigma| 100.0 * sigma), 2)
            )
        }
        Some(n) if summary.parameters.len() == 1 => format!(
            "joints were logged before the arm had settled: {} % of the last move was still to come",
            rounded(n.value * 100.0, n.sigma.map(|sigma| 100.0 * sigma), 2)
        ),
        Some(_) => {
            let shares = summary.parameters.iter().map(|n| n.value * 100.0);
            let most = shares
                .max_by(|a, b| a.abs().total_cmp(&b.abs()))
                .unwrap_or(0.0);
            format!(
                "joints were logged before the arm had settled, each by a share of its own: up to {} % of the last move was \
                 still to come",
                figure(most, 3)
            )
        }
        None => "joints and points do not belong to the same moment".to_string(),
    }
}

impl Placed for Lag {
    placed! { self: Place::Recording, &CAUSE, [if self.by == Behind::Clock { Variable::Speed } else { Variable::LastMove }], self }

    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec> {
        if let Some(joint) = self.only {
            return vec![(format!("share_j{}", joint + 1), Unit::One, 0.1)];
        }
        match (self.by, self.each) {
            (Behind::Clock, _) => vec![("time".into(), Unit::Second, 0.01)],
            (Behind::Synchronous, _) => vec![("rest".into(), Unit::Radian, 0.01)],
            (Behind::Move, true) => (1..=robot.joints())
                .map(|joint| (format!("share_j{joint}"), Unit::One, 0.1))
                .collect(),
            (Behind::Move, false) => vec![("share".into(), Unit::One, 0.1)],
        }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let largest = if self.by == Behind::Synchronous {
            state.largest_turn(robot)
        } else {
            0.0
        };
        for joint in (0..robot.joints()).filter(|joint| self.only.is_none_or(|only| only == *joint))
        {
            match self.by {
                Behind::Synchronous if largest == 0.0 => out.turn(0, p, joint, 0.0),
                Behind::Synchronous => out.turn(0, p, joint, state.last_move(joint) / largest),
                Behind::Clock => out.turn(0, p, joint, state.data.velocity(state.row, joint)),
                Behind::Move => out.turn(
                    if self.each { joint } else { 0 },
                    p,
                    joint,
                    state.last_move(joint),
                ),
            }
        }
    }

    /// Two clocks may be apart either way; of standing points what is still to come is no less than nothing.
    fn impossible(&self, p: &[f64], error: &Errors, _survey: &Survey) -> Option<String> {
        let (most, share) = p
            .iter()
            .copied()
            .enumerate()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        (self.by != Behind::Clock && share < -error(most)).then(|| "a lag is not below zero".into())
    }
}

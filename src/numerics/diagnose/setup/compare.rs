//! Every set-up error of the list tried: the recording without it, base and tool aligned anew, and what is left compared.

use crate::criteria::setup::{
    ALIKE, BETTER, CLEARLY, CLOUD, GOOD, LENGTH, NOMINAL, OWN_NUMBERS, RATIO, SAME, SECOND, SHORT,
    TURNS,
};
use crate::effect::{Place, figure, names};
use crate::estimate::ParameterStatus;
use crate::robot::RobotModel;
use crate::round::FitState;
use crate::setup::counting::Counting;
use crate::setup::mixture::{TwoSetups, is_in_parts};
use crate::setup::order::ColumnOrder;
use crate::setup::placement::{FreeNumber, Placement, PointPairs, place, sampled};
use crate::setup::wrong::{LENGTHS, RowOrder, WrongSetup};
use crate::types::Question;
use crate::units::Unit;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The recording as the files say, and how large arm and measured cloud are.
pub(super) struct AsStated<'a> {
    question: &'a Question<'a>,
    /// Whole rows in their order, and the positions among them of those that judge.
    rows: Vec<usize>,
    judges: Vec<usize>,
    pub(crate) placed: Placement,
    /// m.
    pub(crate) reach: f64,
    cloud: f64,
    noise: f64,
}

/// Set-up errors that together explain what the nominal robot leaves, those that explain as well, and what is left without them.
#[derive(Clone)]
pub(super) struct ExplainedSetup {
    pub(crate) wrong: Vec<WrongSetup>,
    pub(crate) alike: Vec<WrongSetup>,
    pub(crate) placed: Placement,
}

/// One try: what is left, as a share of the measured cloud's size.
struct Try {
    wrong: Vec<WrongSetup>,
    placed: Placement,
    share: f64,
    explains: bool,
}

impl<'a> AsStated<'a> {
    pub(crate) fn of(question: &'a Question<'a>) -> Self {
        let data = question.data;
        let rows: Vec<usize> = (0..data.rows())
            .filter(|row| data.has_point(*row))
            .collect();
        let sample = sampled(question.fit);
        let judges = sample
            .iter()
            .filter_map(|row| rows.binary_search(row).ok())
            .collect();
        let pairs = PointPairs::of(question.robot, data, sample.iter().map(|row| (*row, *row)));
        let squares = sample.iter().map(|row| data.noise(*row).powi(2));
        let noise = (squares.sum::<f64>() / sample.len().max(1) as f64).sqrt();
        Self {
            question,
            rows,
            judges,
            placed: place(&pairs, None),
            reach: pairs.reach(),
            cloud: pairs.cloud(),
            noise,
        }
    }

    /// What the nominal robot leaves, as a share of its reach.
    pub(crate) fn share_of_reach(&self) -> f64 {
        self.placed.left / self.reach.max(f64::MIN_POSITIVE)
    }

    /// Whether no nominal robot leaves so much.
    pub(crate) fn is_no_robot(&self) -> bool {
        self.share_of_reach() > *NOMINAL
    }

    /// Whether the nominal robot leaves more than most, and more than the noise of its points.
    pub(crate) fn is_far_off(&self) -> bool {
        self.is_no_robot() || self.share() > *NOMINAL && self.placed.left > self.noise
    }

    /// Whether a part of the rows lies farther off than any nominal robot leaves them, however near most are.
    pub(crate) fn is_in_parts(&self) -> bool {
        is_in_parts(&self.placed.off, *NOMINAL * self.reach)
    }

    fn share(&self) -> f64 {
        self.placed.left / self.cloud.max(f64::MIN_POSITIVE)
    }

    /// The rows that judge, with set-up errors mended.
    fn mended(&self, wrong: &[WrongSetup]) -> PointPairs<'a> {
        let (data, rows) = (self.question.data, &self.rows);
        let order = wrong.iter().find_map(|one| one.order());
        let partners = order.unwrap_or(RowOrder::Shifted(0)).partners(rows.len());
        let judges = self.judges.iter().map(|k| (rows[*k], rows[partners[*k]]));
        let pairs = PointPairs::of(self.question.robot, data, judges);
        wrong.iter().fold(pairs, |pairs, one| one.mended(&pairs))
    }

    fn tried(&self, wrong: Vec<WrongSetup>) -> Try {
        let pairs = self.mended(&wrong);
        let number = wrong.iter().find_map(|one| one.number());
        let placed = place(&pairs, number);
        let share = placed.left / pairs.cloud().max(f64::MIN_POSITIVE);
        let counts = number.is_none_or(|number| {
            beyond_manufacture(number, &placed.values, self.question.robot, self.reach)
        });
        let price = if number.is_some() { *OWN_NUMBERS } else { 1.0 };
        // One error of the list is found by its kind; what has more freedom must leave what a robot that is set up rightly does.
        let is_free =
            number.is_some() || wrong.len() > 1 || wrong.iter().any(|one| one.is_of_all_joints());
        let most = if is_free { *GOOD } else { *NOMINAL } * pairs.reach();
        let explains = counts
            && *BETTER * price * share < self.share()
            && share < *CLOUD
            && placed.left < most;
        Try {
            wrong,
            placed,
            share: price * share,
            explains,
        }
    }

    /// Whether joints turn as far as joints do, and farther than an arm at rest, with a wrong unit of theirs mended.
    fn turns_as_joints_do(&self, unit: WrongSetup) -> bool {
        let (robot, mended) = (self.question.robot, self.mended(&[unit]));
        let turning =
            (0..mended.rows()).flat_map(|row| (0..robot.joints()).map(move |joint| (row, joint)));
        let largest = turning
            .filter(|(_, joint)| robot.is_revolute(*joint))
            .map(|(row, joint)| mended.q(row)[joint].abs());
        let largest = largest.fold(0.0, f64::max);
        (TURNS[0]..=TURNS[1]).contains(&largest.to_degrees())
    }

    /// Two set-ups whose rows were read as one, where that explains it.
    pub(crate) fn two_setups(&self) -> Option<TwoSetups> {
        let pairs = |rows: &[usize]| {
            let rows = rows.iter().map(|row| (*row, *row));
            PointPairs::of(self.question.robot, self.question.data, rows)
        };
        let sample: Vec<usize> = self.judges.iter().map(|k| self.rows[*k]).collect();
        let found = TwoSetups::of(&pairs(&sample), &self.placed)?;
        let is_right = found.left < *CLOUD * self.cloud && found.left < *NOMINAL * self.reach;
        is_right.then(|| found.with_all_rows(&pairs(&self.rows), &self.rows))
    }

    /// What explains it: one set-up error as a right set-up does, else the order or the whole counting of joints, else one as far as it goes, else a
    /// counting and a unit, else two.
    pub(crate) fn explained(&self) -> Option<ExplainedSetup> {
        let in_order = self.rows.iter().map(|row| (*row, *row));
        let in_order = PointPairs::of(self.question.robot, self.question.data, in_order);
        let try_each = |all: Vec<Vec<WrongSetup>>| -> Vec<Try> {
            let tried = all.into_par_iter().map(|wrong| self.tried(wrong));
            tried.collect()
        };
        let all = WrongSetup::all(&in_order);
        let mut one = try_each(all.iter().map(|wrong| vec![*wrong]).collect());
        let first = chosen(&one);
        let is_right = |found: &&ExplainedSetup| found.placed.left < *GOOD * self.reach;
        if let Some(found) = first.as_ref().filter(is_right) {
            return Some(found.clone());
        }
        let countings = |unit: &[WrongSetup]| -> Vec<Vec<WrongSetup>> {
            let found = Counting::likely(&self.mended(unit)).into_iter();
            found
                .map(|counting| [unit, &[WrongSetup::Counting(counting)]].concat())
                .collect()
        };
        let counted = countings(&[]);
        let ordered = ColumnOrder::likely(&self.mended(&[])).into_iter();
        let ordered = ordered.map(|order| vec![WrongSetup::Columns(order)]);
        let of_all_joints = ordered.chain(counted.clone()).collect();
        let found = chosen(&try_each(of_all_joints)).or(first);
        if found.is_some() {
            return found;
        }
        // A unit of the points scales them and hides no counting; one of the joints is mended before theirs is looked for.
        let point_units = (0..LENGTHS.len()).map(|unit| vec![WrongSetup::PointUnit(unit)]);
        let with_units = point_units.flat_map(|unit| {
            counted
                .iter()
                .map(move |one| [&unit[..], &one[..]].concat())
        });
        let joint_units = [WrongSetup::InRadians, WrongSetup::InDegrees]
            .into_iter()
            .filter(|unit| self.turns_as_joints_do(*unit));
        let joint_units = joint_units.flat_map(|unit| countings(&[unit]));
        let found = chosen(&try_each(with_units.chain(joint_units).collect()));
        if found.is_some() {
            return found;
        }
        one.sort_by(|a, b| a.share.total_cmp(&b.share));
        let first = one.iter().map(|tried| tried.wrong[0]);
        let first = first.filter(|wrong| wrong.number().is_none()).take(*SECOND);
        let both = |a: WrongSetup| {
            let others = all
                .iter()
                .filter(move |b| a != **b && !(a.order().is_some() && b.order().is_some()));
            others.map(move |b| match b.rank() < a.rank() {
                true => vec![*b, a],
                false => vec![a, *b],
            })
        };
        chosen(&try_each(first.flat_map(both).collect()))
    }
}

/// The best of tries in the order of the list, if one explains.
fn chosen(tries: &[Try]) -> Option<ExplainedSetup> {
    let explaining: Vec<&Try> = tries.iter().filter(|tried| tried.explains).collect();
    let shares = explaining.iter().map(|tried| tried.share);
    let least = shares.fold(f64::INFINITY, f64::min);
    let mut least_ones = explaining
        .iter()
        .filter(|tried| tried.share <= *SAME * least);
    let best = least_ones.next()?;
    // Countings and orders that leave the same are the same by kinematics.
    let is_same = |tried: &Try| {
        tried.wrong.iter().all(|one| one.is_of_all_joints()) && tried.share <= *SAME * least
    };
    let is_rival = |tried: &&&Try| {
        tried.wrong != best.wrong
            && tried.share < *ALIKE * least
            && tried.wrong.len() == 1
            && !is_same(tried)
    };
    let alike = explaining.iter().filter(is_rival);
    Some(ExplainedSetup {
        wrong: best.wrong.clone(),
        alike: alike.map(|tried| tried.wrong[0]).collect(),
        placed: best.placed.clone(),
    })
}

/// Whether a number of the robot file is off by more than manufacture errs.
fn beyond_manufacture(number: FreeNumber, values: &[f64], robot: &RobotModel, reach: f64) -> bool {
    let size = Vector3::from_iterator(values.iter().copied().chain([0.0; 3]).take(3)).norm();
    match number {
        FreeNumber::Length(joint) => size > length_error(robot, joint, reach),
        FreeNumber::Axis(joint) => size > length_error(robot, joint - 1, reach),
        FreeNumber::Zero(_) => size > ANGLE,
    }
}

/// rad.
pub(super) const ANGLE: f64 = 2.0 * PI / 180.0;

/// How far an axis may stand from where the robot file has it beyond the link that joint `joint` (from 0) moves, m.
pub(super) fn length_error(robot: &RobotModel, joint: usize, reach: f64) -> f64 {
    let next = (joint + 1).min(robot.joints() - 1);
    (*LENGTH * (robot.point(next) - robot.point(joint)).norm()).max(*SHORT * reach)
}

/// Numbers of the identified base model that are beyond, each with its size.
pub(super) fn beyond(now: &FitState, robot: &RobotModel, reach: f64) -> Vec<String> {
    let mut out = Vec::new();
    let specs = now.model.stack.specs();
    for (effect, range) in now.model.stack.effects() {
        for k in range {
            let ParameterStatus::Free(sigma) = now.fitted.statuses[k] else {
                continue;
            };
            let (spec, value) = (&specs[k], now.model.x[k]);
            let limit = match (effect.name(), spec.place, spec.unit) {
                (names::LINK_GEOMETRY, Place::Links(link, _), Unit::Millimetre) => {
                    length_error(robot, link, reach)
                }
                (names::LINK_GEOMETRY | names::JOINT_OFFSET, _, Unit::Radian) => ANGLE,
                (names::REDUCTION_RATIO, ..) => *RATIO,
                _ => continue,
            };
            if value.abs() > limit + *CLEARLY * sigma {
                let (size, digits, unit) = match spec.unit {
                    Unit::Radian => (value.to_degrees(), 1, "deg"),
                    Unit::Millimetre => (value * 1e3, 1, "mm"),
                    _ => (value * 100.0, 1, "%"),
                };
                out.push(format!("{} by {} {unit}", spec.name, figure(size, digits)));
            }
        }
    }
    out
}

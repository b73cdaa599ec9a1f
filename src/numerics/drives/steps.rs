//! How long the steps of a roll-out are: those of the simulation as it is, and what was found asks for finer ones where a finding explains no
//! more than they err by.

use crate::chain::{Chain, STEP};
use crate::fit::DriveFit;
use crate::key::Key;
use crate::physics::Physics;
use crate::problem::Drives;
use crate::recording::Recording;
use crate::rollout::{Which, roll};
use calib_engine::{Accepted, Options, Problem};

/// Longer steps that are tried, s, and the share of the noise, rms, that is the same motion.
const LONGER: [f64; 2] = [2.5e-3, 1.7e-3];
const SAME: f64 = 0.03;
/// Times that steps are halved at most, and times what they err by that a finding explains at least.
pub(crate) const HALVED: usize = 2;
const DOUBT: f64 = 3.0;

/// Share of a move, squared, that is left where steps are halved again: a step of first order leaves a quarter.
const SETTLES: f64 = 0.5;

/// By how much a simulation moves where its steps are halved.
pub(crate) struct Coarseness {
    /// rad rms, by joint.
    way: Vec<f64>,
    /// Whitened square, in all rows.
    pub(crate) square: f64,
}

fn is_geared(physics: &Physics) -> bool {
    physics.joints.iter().any(|joint| joint.gear.is_some())
}

impl Drives {
    /// How a simulation moves where its steps are halved.
    pub(crate) fn coarseness(&self, physics: &Physics) -> Coarseness {
        let angles = |halved: usize| {
            let mut fine = self.clone();
            (0..halved).for_each(|_| fine.chain.halve(is_geared(physics)));
            fine.angles(physics, Which::Fitted)
        };
        self.moves([&angles(0), &angles(1)])
    }

    fn moves(&self, [now, finer]: [&[f64]; 2]) -> Coarseness {
        let n = self.chain.joints();
        let mut squares = vec![0.0; n];
        let (mut rows, mut whitened) = (0.0, 0.0);
        for row in self.fitted() {
            rows += 1.0;
            for (joint, square) in squares.iter_mut().enumerate() {
                let at = row * n + joint;
                let moves = (now[at] - finer[at]).powi(2);
                *square += moves;
                whitened += moves / self.sigma[at].powi(2);
            }
        }
        let root = |square: f64| (square / rows).sqrt();
        Coarseness {
            way: squares.into_iter().map(root).collect(),
            square: whitened,
        }
    }

    /// The same by steps of half the length, where only gears ask for them by steps of these alone; what they may still be off is noise. Where
    /// finer steps move a simulation as far again it is the motion that cannot be foretold (a load that rattles between two flanks), and
    /// steps stay as they are.
    pub(crate) fn finer(&self, found: &Physics, coarseness: &Coarseness) -> Self {
        let mut finer = self.clone();
        finer.chain.halve(is_geared(found));
        finer.halved += 1;
        let next = finer.coarseness(found);
        if next.square > SETTLES * coarseness.square {
            finer.chain = self.chain.clone();
            finer.halved = HALVED;
        }
        finer.err_by(coarseness);
        finer
    }

    /// All rows by the steps of a part of them.
    pub(crate) fn stepped_as(mut self, part: &Self, coarseness: &Coarseness) -> Self {
        (self.chain, self.halved) = (part.chain.clone(), part.halved);
        self.err_by(coarseness);
        self
    }

    fn err_by(&mut self, coarseness: &Coarseness) {
        let n = self.chain.joints();
        for (at, sigma) in self.sigma.iter_mut().enumerate() {
            *sigma = sigma.hypot(0.5 * coarseness.way[at % n]);
        }
    }

    /// Where steps are shorter with a gear that yields than without: the same with those of the gear in either case, and the set without gears
    /// that explain nothing any more; none where all gears do.
    pub(crate) fn without_gears(
        &self,
        fit: &DriveFit,
        options: &Options,
    ) -> Option<(Self, Vec<Accepted<Key>>)> {
        if self.chain.step <= self.chain.geared_step {
            return None;
        }
        let mut fine = self.clone();
        fine.chain.step = fine.chain.geared_step;
        let explains = |member: usize| {
            let mut rest = fit.set.clone();
            rest.remove(member);
            let without = fine.fitted_with(&rest, Some(fit), false, f64::NEG_INFINITY);
            let share = fit.share();
            fine.log_evidence(fit, share) - fine.log_evidence(&without, share) > options.leaves
        };
        let members = 0..fit.set.len();
        let stays = |member: &usize| !fit.set[*member].cell.key.is_gear() || explains(*member);
        let rest: Vec<Accepted<Key>> = members.filter(stays).map(|k| fit.set[k].clone()).collect();
        (rest.len() < fit.set.len()).then_some((fine, rest))
    }

    /// Whether findings of such ln odds explain more than steps err by, whose halves move a fit by so large a whitened square.
    pub(crate) fn exceed(
        &self,
        odds: impl IntoIterator<Item = f64>,
        fit: &DriveFit,
        square: f64,
    ) -> bool {
        let least = DOUBT * 0.5 * fit.share() * square;
        odds.into_iter().all(|odds| odds > least)
    }

    /// Whether steps are fine enough for the gears of a fit, which ask for more than any other cause, before the long question what else each of
    /// its members could be.
    pub(crate) fn is_fine_for_gears(&self, fit: &DriveFit) -> bool {
        let gears = (0..fit.set.len()).filter(|member| fit.set[*member].cell.key.is_gear());
        let gears: Vec<usize> = gears.collect();
        if gears.is_empty() || self.halved == HALVED {
            return true;
        }
        let square = self
            .coarseness(&self.physics(&fit.inertia, &fit.set))
            .square;
        let share = fit.share();
        let now = self.log_evidence(fit, share);
        let odds = gears.into_iter().map(|member| {
            let mut rest = fit.set.clone();
            rest.remove(member);
            let without = self.fitted_with(&rest, Some(fit), false, f64::NEG_INFINITY);
            now - self.log_evidence(&without, share)
        });
        self.exceed(odds, fit, square)
    }
}

/// The longest step, s, at which the simulation as it is goes where finer steps go, to a small share of the noise: in all rows, as those that
/// judge may ask more of a drive.
pub(crate) fn longest(chain: &Chain, base: &Physics, recording: &Recording, sigma: &[f64]) -> f64 {
    let n = chain.joints();
    let rolled = |step: f64| {
        let mut chain = chain.clone();
        chain.step = step;
        let mut angles = Vec::new();
        roll(&chain, base, recording, &[], Which::All, |row| {
            let at = row.row * n;
            let whitened = row.angle.iter().zip(&sigma[at..at + n]);
            angles.extend(whitened.map(|(angle, sigma)| angle / sigma));
        });
        angles
    };
    let fine = rolled(STEP);
    let near = |step: &f64| {
        let mut squares = vec![0.0; n];
        for (k, (a, b)) in rolled(*step).iter().zip(&fine).enumerate() {
            squares[k % n] += (a - b).powi(2);
        }
        let rows = (fine.len() / n) as f64;
        squares.iter().all(|square| *square < rows * SAME * SAME)
    };
    LONGER.into_iter().find(near).unwrap_or(STEP)
}

//! Jumps and corners over the variable of a group that shows: knots that join one after another while each pays for the choice of its place,
//! as splines with free knots do (Friedman, 1991).

use super::evidence::evidence;
use super::frame::GroupProducts;
use super::groups::{FreeGroup, GroupColumns};
use super::state::KnownCauses;
use crate::criteria::open_world::{BETWEEN_KNOTS, CLOSER_KNOTS, KNOTS, PAYS};
use crate::effect::{Basis, Factor, Knots, Law, Variable};
use nalgebra::{DMatrix, DVector};

/// What is between two knots, or at one.
#[derive(Clone, Copy, PartialEq)]
enum Piece {
    Level,
    Straight,
}

/// A group with knots in the place of its smooth curve: with jumps and with corners, as far as knots pay; none of a product of two curves.
pub(super) fn with_knots(group: &FreeGroup, state: &KnownCauses, columns: &mut GroupColumns) -> Vec<FreeGroup> {
    let Law { first, times } = group.law;
    let mut ways = vec![(first, times)];
    ways.extend(times.map(|times| (times, Some(first))));
    let mut out = Vec::new();
    if group.curves() > 1 {
        return out;
    }
    // A few rows that are wrong one after another are no jump to and fro in time; one step in time is a group of its own.
    for (of, other) in ways.into_iter().filter(|(of, _)| of.basis.is_curve() && of.of != Variable::Time) {
        let Some(mut values) = columns.values(of.of).map(<[f64]>::to_vec) else { continue };
        values.sort_by(f64::total_cmp);
        let ends = [values[0], values[values.len() - 1]];
        let apart = |pair: &&[f64]| pair[1] - pair[0] > 1e-9 * (ends[1] - ends[0]);
        let between: Vec<f64> = values.windows(2).filter(apart).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        for piece in [Piece::Level, Piece::Straight] {
            let search = KnotSearch { group, of, other, values: &values, piece, state, columns: &mut *columns };
            out.extend(search.group_with(&between));
        }
    }
    out
}

/// Some of many values, evenly spread over them.
fn spread(all: &[f64], count: usize) -> Vec<f64> {
    if all.len() <= count {
        return all.to_vec();
    }
    (0..count).map(|k| all[(2 * k + 1) * all.len() / (2 * count)]).collect()
}

/// Where knots of one kind are looked for.
struct KnotSearch<'k, 'f, 'a, 's> {
    group: &'k FreeGroup,
    of: Factor,
    other: Option<Factor>,
    /// At the rows, ascending.
    values: &'k [f64],
    piece: Piece,
    state: &'k KnownCauses<'s>,
    columns: &'k mut GroupColumns<'f, 'a>,
}

impl KnotSearch<'_, '_, '_, '_> {
    /// The group with the knots that pay, out of values `between` those of the rows.
    fn group_with(mut self, between: &[f64]) -> Option<FreeGroup> {
        let coarse = spread(between, *KNOTS / self.other.map_or(1, |other| other.count()));
        let first = self.best(&coarse)?;
        // Closer around those that pay.
        let width = (between.len() / coarse.len()).max(1);
        let near = |knot: &f64| {
            let at = between.partition_point(|other| other < knot);
            spread(&between[at.saturating_sub(width)..(at + width + 1).min(between.len())], *CLOSER_KNOTS)
        };
        let mut closer: Vec<f64> = first.iter().flat_map(near).chain(first.iter().copied()).collect();
        closer.sort_by(f64::total_cmp);
        closer.dedup();
        let found = self.best(&closer).unwrap_or(first);
        let choices = found.iter().fold(self.group.of, |all: usize, _| all.saturating_mul(coarse.len()));
        let ends = self.ends().into_iter().filter(|_| self.piece == Piece::Straight);
        let knots = Knots::new(found.iter().copied().chain(ends));
        let basis = if self.piece == Piece::Level { Basis::Steps { knots } } else { Basis::Corners { knots } };
        let law = Law::new(self.of.of, basis);
        let law = self.other.map_or(law, |other| law.times(other.of, other.basis));
        Some(FreeGroup { law, of: choices, ..*self.group })
    }

    fn ends(&self) -> [f64; 2] {
        [self.values[0], self.values[self.values.len() - 1]]
    }

    /// How many rows are below a value.
    fn rows_below(&self, at: f64) -> usize {
        self.values.partition_point(|value| *value < at)
    }

    /// The knots out of some that pay, ascending; none where none does.
    fn best(&mut self, places: &[f64]) -> Option<Vec<f64>> {
        // A straight line is no corner, and belongs to all of them.
        let line = (self.piece == Piece::Straight).then_some(self.ends()[0]);
        let all: Vec<f64> = line.into_iter().chain(places.iter().copied()).collect();
        let seen = self.products(&all)?;
        // A few rows that are wrong make no jump.
        let least = *BETWEEN_KNOTS * seen.columns[0].len();
        let below: Vec<usize> = all.iter().map(|knot| self.rows_below(*knot)).collect();
        let sound = |k: usize, others: &[usize]| {
            let ends = [0, self.values.len()].into_iter();
            ends.chain(others.iter().map(|other| below[*other])).all(|other| other.abs_diff(below[k]) >= least)
        };
        let most = Knots::MOST - 2 * usize::from(line.is_some());
        let price = (places.len() as f64).ln();
        let (mut chosen, mut log) = (Vec::from_iter(line.map(|_| 0)), f64::NEG_INFINITY);
        let fixed = chosen.len();
        while chosen.len() < fixed + most {
            let free = (fixed..all.len()).filter(|k| sound(*k, &chosen[fixed..]));
            let with = |k: usize| seen.evidence(&[&chosen[..], &[k]].concat());
            let Some((k, value)) = free.map(|k| (k, with(k))).max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if value - price < log + *PAYS {
                break;
            }
            chosen.push(k);
            log = seen.settle(&mut chosen, (fixed, value), &sound) - price;
        }
        let mut knots: Vec<f64> = chosen[fixed..].iter().map(|k| all[*k]).collect();
        knots.sort_by(f64::total_cmp);
        // What takes all knots that there are is a rough curve.
        (!knots.is_empty() && knots.len() < most).then_some(knots)
    }

    /// Products of the columns of one knot each, beside the state.
    fn products(&mut self, knots: &[f64]) -> Option<KnotProducts> {
        let [low, high] = self.ends();
        let values = self.columns.values(self.of.of)?;
        let function = |knot: &f64| -> Vec<f64> {
            let at = |u: &f64| if self.piece == Piece::Level { f64::from(u > knot) } else { (u - knot).max(0.0) / (high - low) };
            values.iter().map(at).collect()
        };
        let mut functions: Vec<Vec<f64>> = knots.iter().map(function).collect();
        let mut each = 1;
        if let Some(other) = self.other {
            let others = self.columns.at_rows(other.of, &other.basis)?;
            let times = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).collect();
            each = others.len();
            functions = functions.iter().flat_map(|a| others.iter().map(move |b| times(a, b))).collect();
        }
        let count = functions.len();
        let (columns, square) = self.columns.frame.projected(self.columns.along(self.group.motion, &functions));
        let GroupProducts { gram, gradient } = self.state.of_columns(self.columns.frame, &columns);
        let directions = square.len() / count;
        let of = |k: usize| (0..directions).flat_map(|d| (0..each).map(move |e| d * count + k * each + e)).collect();
        Some(KnotProducts { gram, gradient, square, columns: (0..knots.len()).map(of).collect() })
    }
}

/// What the evidence of any of some knots needs.
struct KnotProducts {
    gram: DMatrix<f64>,
    gradient: DVector<f64>,
    square: Vec<f64>,
    /// Columns of each knot.
    columns: Vec<Vec<usize>>,
}

impl KnotProducts {
    fn evidence(&self, knots: &[usize]) -> f64 {
        let own: Vec<usize> = knots.iter().flat_map(|k| self.columns[*k].iter().copied()).collect();
        let gram = DMatrix::from_fn(own.len(), own.len(), |i, j| self.gram[(own[i], own[j])]);
        let gradient = DVector::from_fn(own.len(), |i, _| self.gradient[own[i]]);
        let size: f64 = own.iter().map(|k| self.square[*k]).sum();
        evidence(&gram, &gradient, &vec![1.0 / size.max(f64::MIN_POSITIVE); own.len()]).log
    }

    /// Moves each of the free knots to where the evidence of all is largest, as far as a place is `sound` beside the others; returns that
    /// evidence.
    fn settle(&self, chosen: &mut [usize], (fixed, mut log): (usize, f64), sound: &dyn Fn(usize, &[usize]) -> bool) -> f64 {
        for at in fixed..chosen.len().saturating_sub(1) {
            let others: Vec<usize> = (fixed..chosen.len()).filter(|other| *other != at).map(|other| chosen[other]).collect();
            for k in (fixed..self.columns.len()).filter(|k| sound(*k, &others)) {
                let old = chosen[at];
                chosen[at] = k;
                let value = self.evidence(chosen);
                if value > log {
                    log = value;
                } else {
                    chosen[at] = old;
                }
            }
        }
        log
    }
}

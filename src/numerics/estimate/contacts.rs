//! Rows of contacts: joints at which everything closes, at which what such data show is counted; places that no fitted row has, put where the
//! left-out rows say; a ball that was put back elsewhere on the tool.

use super::factor::TriangularFactor;
use super::fit::{Session, fit};
use super::levenberg::{FINE, minimise};
use super::model::Model;
use super::problem::Problem;
use crate::effect::names;
use crate::estimate::scale::ErrorScale;
use crate::observation::{RowView, contacts, kinds};
use crate::robot::Measurements;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// Steps towards joints that close; each squares the remaining error.
const STEPS: usize = 12;
/// m; nothing is left.
const CLOSED: f64 = 1e-14;

impl Problem<'_> {
    /// The data of all candidates from joints at which all contacts close; none where there is none.
    pub fn shown(&self, model: &Model, candidates: &[usize]) -> Option<TriangularFactor> {
        let data = closed(model, self.data, self.rows)?;
        let closed = Problem::new(&data, self.rows, self.excess);
        Some(closed.observe(model, candidates).factor)
    }
}

/// The measurements with joints that close in these rows; none where no row is a contact.
pub(super) fn closed(model: &Model, data: &Measurements, rows: &[usize]) -> Option<Measurements> {
    if !kinds(data).iter().any(|kind| kind.is_contact()) {
        return None;
    }
    let mut out = data.clone();
    let mut scratch = model.stack.scratch(&model.robot);
    for row in rows {
        for (kind, _) in contacts(data, *row) {
            for _ in 0..STEPS {
                let mut placed = model.place(&out, *row, &mut scratch);
                let at = RowView {
                    data: &out,
                    row: *row,
                    placed: &placed,
                };
                let error = kind.residual(at).map(|(error, _)| error);
                let error = error.filter(|error| error.norm() > CLOSED);
                let closing = kind.closing(at);
                let Some(step) = closing
                    .zip(error)
                    .and_then(|(closing, error)| placed.closing_step(&closing, &error))
                else {
                    break;
                };
                let joints = &mut out.q[row * data.joints..(row + 1) * data.joints];
                joints
                    .iter_mut()
                    .zip(step)
                    .for_each(|(q, change)| *q += change);
            }
        }
    }
    Some(out)
}

/// Anchors that no row to fit names and others do, by their numbers, with the rows that do.
fn unseen(
    model: &Model,
    data: &Measurements,
    rows: &[usize],
    others: &[usize],
) -> BTreeMap<usize, Vec<usize>> {
    let setup = model.robot.setup();
    let anchor = |row: &usize| setup.anchor(contacts(data, *row).next()?.1.anchor);
    let seen: BTreeSet<usize> = rows.iter().filter_map(anchor).collect();
    let mut unseen: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for row in others {
        if let Some(number) = anchor(row).filter(|number| !seen.contains(number)) {
            unseen.entry(number).or_default().push(*row);
        }
    }
    unseen
}

/// The parameters of anchors by their numbers, in the stack.
fn parameters<'a>(model: &Model, anchors: impl Iterator<Item = &'a usize>) -> Vec<usize> {
    let setup = model.robot.setup();
    let Some(first) = model.stack.parameters_of(names::ANCHOR).next() else {
        return Vec::new();
    };
    let range = |number: &usize| {
        let begin = first + setup.first_of_anchor(*number);
        begin..begin + setup.anchors[*number].shape.parameters()
    };
    anchors.flat_map(range).collect()
}

/// The model of a fit to `rows` with every anchor that only other rows name placed by these, robustly; and by how much their errors are
/// to be multiplied, since each has a part in its place.
pub fn placed_by_left_out(
    model: &Model,
    data: &Measurements,
    rows: &[usize],
) -> (Model, BTreeMap<usize, f64>) {
    let mut fitted = vec![false; data.rows()];
    rows.iter().for_each(|row| fitted[*row] = true);
    let others: Vec<usize> = (0..data.rows()).filter(|row| !fitted[*row]).collect();
    placed_by(model, data, &unseen(model, data, rows, &others))
}

fn placed_by(
    model: &Model,
    data: &Measurements,
    unseen: &BTreeMap<usize, Vec<usize>>,
) -> (Model, BTreeMap<usize, f64>) {
    let candidates = parameters(model, unseen.keys());
    let mut inflation = BTreeMap::new();
    if candidates.is_empty() {
        return (model.clone(), inflation);
    }
    let rows: BTreeSet<usize> = unseen.values().flatten().copied().collect();
    let rows: Vec<usize> = rows.into_iter().collect();
    for (number, rows) in unseen {
        let axes = |row: &usize| {
            contacts(data, *row)
                .map(|(kind, _)| kind.axes(data, *row))
                .sum::<usize>()
        };
        let (values, placed) = (
            rows.iter().map(axes).sum::<usize>(),
            model.robot.setup().anchors[*number].shape.parameters(),
        );
        let by = if values > placed {
            values as f64 / (values - placed) as f64
        } else {
            f64::NAN
        };
        inflation.extend(rows.iter().map(|row| (*row, by)));
    }
    // Lengths belong to the arm's fit: here the arm stands.
    let start = Model {
        lengths: Vec::new(),
        ..model.clone()
    };
    let x = fit(&start, data, &rows, &candidates).0.x;
    (Model { x, ..model.clone() }, inflation)
}

/// The rows without those of a part, which is sorted.
pub(super) fn less(rows: &[usize], part: &[usize]) -> Vec<usize> {
    let is_kept = |row: &usize| part.binary_search(row).is_err();
    rows.iter().copied().filter(is_kept).collect()
}

/// Errors of the rows `part` under a fit to the others, from the whole one on, where `part` holds all rows of some anchor; `None` where it
/// does not. The noise is that of the whole fit.
pub(super) fn without_places(
    whole: &Session,
    candidates: &[usize],
    part: &[usize],
    scale: ErrorScale,
) -> Option<Vec<f64>> {
    let Session {
        model,
        data,
        rows,
        fitted,
    } = *whole;
    let kept = less(rows, part);
    let unseen = unseen(model, data, &kept, part);
    if unseen.is_empty() {
        return None;
    }
    let gone = parameters(model, unseen.keys());
    let free: Vec<usize> = candidates
        .iter()
        .copied()
        .filter(|k| !gone.contains(k))
        .collect();
    let numbers = |between: &[usize; 2]| between.iter().any(|number| unseen.contains_key(number));
    let mut other = model.clone();
    other.lengths.retain(|known| !numbers(&known.between));
    let problem = Problem::new(data, &kept, fitted.excess());
    let start = problem.evaluate(&other, &free);
    minimise(&problem, &mut other, &free, start, FINE);
    let (other, inflation) = placed_by(&other, data, &unseen);
    let mut scratch = other.stack.scratch(&other.robot);
    let error = |row: &usize| {
        let by = inflation
            .get(row)
            .copied()
            .filter(|by| by.is_finite())
            .unwrap_or(1.0);
        by * scale.error(&other, data, *row, &mut scratch)
    };
    Some(part.iter().map(error).collect())
}

/// Where a ball was put back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reseat {
    /// The first row with it there.
    pub row: usize,
    /// How far it moved at least, m: the fit has taken up a part.
    pub shift: f64,
    /// The same in standard errors.
    pub statistic: f64,
}

/// Beyond so many standard errors no chance among all places of a recording gets.
const CERTAIN: f64 = 8.0;
/// Rows on either side.
const SIDE_FEWEST: usize = 6;
/// Standard deviations to which single rows are cut: a slip of a plate is another matter.
const CUT: f64 = 4.0;

/// The place in the order of `rows` that parts them best, of rows that lay in sockets; `sigma` is what they scatter by, m per axis.
pub fn reseated(model: &Model, data: &Measurements, rows: &[usize], sigma: f64) -> Option<Reseat> {
    let socket = kinds(data)
        .into_iter()
        .find(|kind| kind.is_contact() && kind.about().axes == 3)?;
    let mut scratch = model.stack.scratch(&model.robot);
    let mut seen: Vec<(usize, Vector3<f64>)> = Vec::new();
    for row in rows {
        let placed = model.place(data, *row, &mut scratch);
        if let Some((error, _)) = socket.residual(RowView {
            data,
            row: *row,
            placed: &placed,
        }) {
            let off = placed.orientation().tr_mul(&error);
            seen.push((*row, off * (CUT * sigma / off.norm().max(CUT * sigma))));
        }
    }
    let total: Vector3<f64> = seen.iter().map(|(_, off)| off).sum();
    let mut before = Vector3::zeros();
    let mut best: Option<Reseat> = None;
    for (count, (_, off)) in (1..).zip(&seen) {
        before += off;
        let after = seen.len() - count;
        if count < SIDE_FEWEST || after < SIDE_FEWEST {
            continue;
        }
        let apart = ((total - before) / after as f64 - before / count as f64).norm();
        let statistic = apart / (sigma * (1.0 / count as f64 + 1.0 / after as f64).sqrt());
        if statistic > best.map_or(CERTAIN, |best| best.statistic) {
            best = Some(Reseat {
                row: seen[count].0,
                shift: apart,
                statistic,
            });
        }
    }
    best
}

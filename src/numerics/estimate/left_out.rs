//! Contacts that no fitted row has: a socket, plane or sphere of rows that were left out is placed by these rows themselves, and the
//! arm by the others. How well they close together there is what a calibration is worth at a place that it has not seen.

use super::error_scale::ErrorScale;
use super::fit::{FitOptions, fit};
use super::levenberg::{FINE, minimise};
use super::model::Model;
use super::problem::Problem;
use super::session::Session;
use crate::effect::names;
use crate::observation::contacts;
use crate::robot::Measurements;
use std::collections::{BTreeMap, BTreeSet};

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
    let (placed, _) = fit(
        &start,
        data,
        &FitOptions {
            rows: &rows,
            candidates: &candidates,
        },
    );
    (
        Model {
            x: placed.x,
            ..model.clone()
        },
        inflation,
    )
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
    let kept: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| part.binary_search(row).is_err())
        .collect();
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
    let problem = Problem {
        data,
        rows: &kept,
        excess: fitted.excess(),
    };
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

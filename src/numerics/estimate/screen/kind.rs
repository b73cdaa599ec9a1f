//! What a row that stands out is: exchanged, mislabelled, shifted, in another unit, a zero, part of an event, or none of these.
//!
//! Whitened residual e, leverage H = J (J'WJ)^-1 J', Huber weight w: left out, e becomes (1 - wH)^-1 e, of covariance
//! 1 + H (1 - wH)^-1. Rows that were not fitted have w = 0.

use crate::criteria::screen::{
    ALIKE, BETTER, CANDIDATES, DISAGREES, IMPOSSIBLE, JOINTS, LONG_RUN, RUN, SLIP_TOLERANCE, SOLE,
    ZERO,
};
use crate::estimate::factor::{axpy, dot};
use crate::estimate::model::Model;
use crate::estimate::problem::{HUBER, ObservationTerm, Problem, columns};
use crate::observation::{KINDS, MeasurementKind, noise};
use crate::robot::Measurements;
use faer::Mat;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Why a row stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SuspectKind {
    /// The partner's joints fit this row's point and the other way round.
    Exchanged,
    /// The point belongs to the partner's joints, and no simple exchange explains it.
    Mislabelled,
    /// Three or more consecutive rows whose points belong to the joints this many rows further on.
    ShiftedBlock(i64),
    /// The point is this many times too far from the tracker.
    UnitSlip(f64),
    /// The point is the tracker's origin: what a lost beam leaves.
    Zero,
    /// None of the others.
    Outlier,
    /// One of several consecutive rows that stand out alike: something happened, and the model does not know it.
    Event,
}

/// m, cm, inch and foot for mm, and the other way round.
const SLIPS: [f64; 10] = [
    1000.0,
    1e-3,
    25.4,
    1.0 / 25.4,
    100.0,
    0.01,
    10.0,
    0.1,
    304.8,
    1.0 / 304.8,
];

/// Names every row in `flagged` (ascending), with its partner. Points are matched within `limit` standard deviations, but not where
/// the arm moves: there the rows beside one are always near.
pub(super) fn name(
    data: &Measurements,
    standings: &[LeaveOneOut],
    flagged: &[usize],
    limit: f64,
    moving: bool,
) -> Vec<(usize, SuspectKind, Option<usize>)> {
    let mut kinds: BTreeMap<usize, (SuspectKind, Option<usize>)> = BTreeMap::new();
    for &row in flagged {
        let misread = data
            .point(row)
            .and_then(|point| misread(&point, &standings[row].predicted, *SLIP_TOLERANCE));
        if let Some(kind) = misread {
            kinds.insert(row, (kind, None));
        }
    }
    let by_x = by_x(standings);
    let moved: Vec<usize> = flagged
        .iter()
        .copied()
        .filter(|row| !moving && !kinds.contains_key(row))
        .collect();
    let fits: BTreeMap<usize, Vec<(usize, f64)>> = moved
        .iter()
        .map(|row| (*row, fits(&by_x, data, standings, *row, limit)))
        .collect();
    exchange(&fits, &mut kinds);
    shift(data, &fits, &mut kinds);
    for (row, candidates) in &fits {
        let nearest = candidates.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        if let (false, Some((partner, _))) = (kinds.contains_key(row), nearest) {
            kinds.insert(*row, (SuspectKind::Mislabelled, Some(*partner)));
        }
    }
    let unexplained = flagged.iter().filter(|row| !kinds.contains_key(row));
    let mut measured: Vec<usize> = unexplained.map(|row| data.rank_in_time(*row)).collect();
    measured.sort_unstable();
    for run in runs(&measured) {
        let run: Vec<usize> = run.iter().map(|place| data.at_place(*place)).collect();
        let kind = match beyond_the_log(&run, &kinds, standings.len()) {
            Some(offset) => SuspectKind::ShiftedBlock(offset),
            None if is_event(data, &run, standings) => SuspectKind::Event,
            None => SuspectKind::Outlier,
        };
        kinds.extend(run.iter().map(|row| (*row, (kind, None))));
    }
    kinds
        .into_iter()
        .map(|(row, (kind, partner))| (row, kind, partner))
        .collect()
}

/// A zero, or a point that a change of unit brings to where it was predicted, to a share `tolerance` of its distance.
pub(super) fn misread(
    measured: &Vector3<f64>,
    predicted: &Vector3<f64>,
    tolerance: f64,
) -> Option<SuspectKind> {
    let distance = predicted.norm();
    let slip = SLIPS
        .iter()
        .find(|factor| (measured / **factor - predicted).norm() < tolerance * distance);
    match slip {
        Some(factor) => Some(SuspectKind::UnitSlip(*factor)),
        None => (measured.norm() < *ZERO * distance).then_some(SuspectKind::Zero),
    }
}

/// Predicted points in order of x with their rows, so that near ones are found without looking at all.
fn by_x(standings: &[LeaveOneOut]) -> Vec<(f64, usize)> {
    let places = standings.iter().map(|standing| standing.predicted.x);
    let mut by_x: Vec<(f64, usize)> = places.zip(0..).collect();
    by_x.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    by_x
}

/// Rows of other poses whose joints fit the point of `row` far better than its own, with their distance (m).
fn fits(
    by_x: &[(f64, usize)],
    data: &Measurements,
    standings: &[LeaveOneOut],
    row: usize,
    limit: f64,
) -> Vec<(usize, f64)> {
    let Some(point) = data.point(row) else {
        return Vec::new();
    };
    let standing = &standings[row];
    let typical = median_sigma(standings, row);
    let reach = (limit * typical * 3f64.sqrt()).min(standing.residual.norm() / *BETTER);
    let start = by_x.partition_point(|(x, _)| *x < point.x - reach);
    let slab = by_x[start..]
        .iter()
        .take_while(|(x, _)| *x <= point.x + reach);
    let mut found: Vec<(usize, f64)> = slab
        .map(|(_, other)| (*other, (point - standings[*other].predicted).norm()))
        .filter(|(other, distance)| *distance <= reach && !data.near_pose(row, *other))
        .collect();
    found.sort_by_key(|(other, _)| (other.abs_diff(row), *other));
    found.truncate(*CANDIDATES);
    found
}

/// The row's own standard deviation (m); its neighbour's where a wrong point makes it absurd.
fn median_sigma(standings: &[LeaveOneOut], row: usize) -> f64 {
    let around = row.saturating_sub(2)..(row + 3).min(standings.len());
    let mut sigmas: Vec<f64> = standings[around]
        .iter()
        .map(|standing| standing.sigma)
        .collect();
    sigmas.sort_by(f64::total_cmp);
    sigmas[sigmas.len() / 2]
}

type Kinds = BTreeMap<usize, (SuspectKind, Option<usize>)>;

/// Pairs that fit each other's joints; the closest pairs first where repeats leave a choice.
fn exchange(fits: &BTreeMap<usize, Vec<(usize, f64)>>, kinds: &mut Kinds) {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (&a, candidates) in fits {
        for &(b, there) in candidates.iter().filter(|(b, _)| *b > a) {
            if let Some((_, back)) = fits
                .get(&b)
                .and_then(|other| other.iter().find(|(row, _)| *row == a))
            {
                pairs.push((there.hypot(*back), a, b));
            }
        }
    }
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for (_, a, b) in pairs {
        if !kinds.contains_key(&a) && !kinds.contains_key(&b) {
            kinds.insert(a, (SuspectKind::Exchanged, Some(b)));
            kinds.insert(b, (SuspectKind::Exchanged, Some(a)));
        }
    }
}

/// Runs of rows whose points all belong to the joints the same number of rows away; a row at the end of a run that belongs to
/// a row of it closes the circle.
fn shift(data: &Measurements, fits: &BTreeMap<usize, Vec<(usize, f64)>>, kinds: &mut Kinds) {
    let offsets = |row: usize| -> BTreeSet<i64> {
        fits.get(&row)
            .into_iter()
            .flatten()
            .map(|(other, _)| *other as i64 - row as i64)
            .collect()
    };
    let rows: Vec<usize> = fits
        .keys()
        .copied()
        .filter(|row| !kinds.contains_key(row))
        .collect();
    let mut at = 0;
    while at < rows.len() {
        let mut common = offsets(rows[at]);
        let mut end = at + 1;
        while end < rows.len() && rows[end] == rows[end - 1] + 1 {
            let still: BTreeSet<i64> = common.intersection(&offsets(rows[end])).copied().collect();
            if still.is_empty() {
                break;
            }
            common = still;
            end += 1;
        }
        let (first, last) = (rows[at], rows[end - 1]);
        if stops(data, &rows[at..end]) >= *RUN
            && let Some(offset) = common
                .into_iter()
                .min_by_key(|offset| (offset.abs(), *offset))
        {
            let to = |row: usize| usize::try_from(row as i64 + offset).ok();
            for &row in &rows[at..end] {
                kinds.insert(row, (SuspectKind::ShiftedBlock(offset), to(row)));
            }
            for row in [first.wrapping_sub(1), last + 1] {
                let inside = fits.get(&row).and_then(|found| {
                    found
                        .iter()
                        .find(|(other, _)| (first..=last).contains(other))
                });
                if let (false, Some((partner, _))) = (kinds.contains_key(&row), inside) {
                    kinds.insert(row, (SuspectKind::ShiftedBlock(offset), Some(*partner)));
                }
            }
        }
        at = end;
    }
}

/// Consecutive rows, together.
fn runs(rows: &[usize]) -> impl Iterator<Item = &[usize]> {
    rows.chunk_by(|a, b| a + 1 == *b)
}

/// The offset of the shifted block that a run continues where the joints it asks for were never logged.
fn beyond_the_log(run: &[usize], kinds: &Kinds, rows: usize) -> Option<i64> {
    let (first, last) = (*run.first()?, *run.last()?);
    let neighbours = [first.wrapping_sub(1), last + 1];
    let offset = neighbours.iter().find_map(|row| match kinds.get(row) {
        Some((SuspectKind::ShiftedBlock(offset), _)) => Some(*offset),
        _ => None,
    })?;
    let logged = |row: usize| usize::try_from(row as i64 + offset).is_ok_and(|there| there < rows);
    (!run.iter().any(|row| logged(*row))).then_some(offset)
}

/// So many stops of the arm some rows are of.
pub(super) fn stops(data: &Measurements, rows: &[usize]) -> usize {
    rows.iter()
        .map(|row| data.stop(*row))
        .collect::<BTreeSet<usize>>()
        .len()
}

fn is_event(data: &Measurements, run: &[usize], standings: &[LeaveOneOut]) -> bool {
    let sizes = run.iter().map(|row| standings[*row].residual.norm());
    let (least, most) = sizes.fold((f64::INFINITY, 0.0f64), |(least, most), size| {
        (least.min(size), most.max(size))
    });
    let stops = stops(data, run);
    stops >= *LONG_RUN || stops >= *RUN && most <= *ALIKE * least
}

/// Whether a row that is `off` by so much (m) is improbable even with the model's uncertainty.
pub(super) fn is_wrong(data: &Measurements, row: usize, off: f64) -> bool {
    if off > *IMPOSSIBLE {
        return true;
    }
    let Some(point) = data.point(row) else {
        return false;
    };
    let again = |other: &usize| {
        *other != row && data.target(*other) == data.target(row) && data.same_pose(row, *other)
    };
    let mut repeats = (0..data.rows())
        .filter(again)
        .filter_map(|other| Some((other, data.point(other)?)))
        .peekable();
    let apart = |(other, measured): (usize, Vector3<f64>)| {
        let noise = data.noise(row).hypot(data.noise(other));
        (point - measured).norm() > (*DISAGREES * noise).max(*JOINTS)
    };
    repeats.peek().is_some() && repeats.all(apart)
}

/// Where a row stands.
pub(super) struct LeaveOneOut {
    /// Predicted point, m.
    pub(crate) predicted: Vector3<f64>,
    /// Measured - predicted, m.
    pub(crate) residual: Vector3<f64>,
    /// Standard deviation per axis that a row of this kind has, m.
    pub(crate) sigma: f64,
    /// Length of the leave-one-out residual in standard deviations.
    pub(crate) distance: f64,
}

/// Rows handled at once.
const CHUNK: usize = 64;

/// The standing of every row of the recording after a fit of `free` to the problem's rows.
pub(super) fn leave_one_out(problem: &Problem, model: &Model, free: &[usize]) -> Vec<LeaveOneOut> {
    let data = problem.data;
    let inverse = problem.evaluate(model, free).factor.inverse();
    let column = columns(model, free);
    let mut fitted = vec![false; data.rows()];
    for row in problem.rows {
        fitted[*row] = true;
    }
    let inverse = inverse.map(|inverse| inverse.matrix(1.0));
    let screened: Vec<&dyn MeasurementKind> = KINDS
        .iter()
        .copied()
        .filter(|kind| kind.about().is_screened)
        .collect();
    let chunk = |chunk: usize| {
        let rows = chunk * CHUNK..((chunk + 1) * CHUNK).min(data.rows());
        let mut scratch = model.stack.scratch(&model.robot);
        let mut lines: Mat<f64> = Mat::zeros(3 * screened.len() * rows.len(), free.len());
        let (mut terms, mut standings) = (Vec::new(), Vec::with_capacity(rows.len()));
        for (i, row) in rows.enumerate() {
            let mut placed = model.place(data, row, &mut scratch);
            let predicted = placed.point;
            for kind in &screened {
                let Some((term, _)) =
                    ObservationTerm::of(*kind, data, row, &placed, problem.excess)
                else {
                    continue;
                };
                let first = 3 * terms.len();
                let sensitivity = &term.sensitivity;
                sensitivity.derivatives(&mut placed, |parameter, derivative| {
                    if let Some(j) = column[parameter] {
                        axpy(
                            1.0,
                            derivative.as_slice(),
                            &mut lines.col_as_slice_mut(j)[first..],
                        );
                    }
                });
                terms.push((i, fitted[row], term.error));
            }
            standings.push(LeaveOneOut {
                predicted,
                residual: data.points.residual(row, &predicted),
                sigma: noise(data, row).hypot(3f64.sqrt() * problem.excess.length) / 3f64.sqrt(),
                distance: 0.0,
            });
        }
        // H = G G', G = J R^-1 of the whitened derivatives; a line of G a column.
        let seen = match &inverse {
            Some(inverse) => inverse.transpose() * lines.transpose(),
            None => Mat::zeros(1, lines.nrows()),
        };
        for (k, (i, fitted, error)) in terms.into_iter().enumerate() {
            let line = |axis: usize| seen.col_as_slice(3 * k + axis);
            let leverage = Matrix3::from_fn(|a, b| dot(line(a), line(b)));
            let weight = match error.norm() {
                _ if !fitted => 0.0,
                length if length > HUBER => HUBER / length,
                _ => 1.0,
            };
            let standing = &mut standings[i];
            standing.distance = standing.distance.max(distance(&error, leverage, weight));
        }
        standings
    };
    (0..data.rows().div_ceil(CHUNK))
        .into_par_iter()
        .flat_map_iter(chunk)
        .collect()
}

fn distance(whitened: &Vector3<f64>, leverage: Matrix3<f64>, weight: f64) -> f64 {
    let eigen = SymmetricEigen::new(leverage);
    let along = eigen.eigenvectors.transpose() * whitened;
    let squares = (0..3).map(|k| {
        let h = eigen.eigenvalues[k].max(0.0);
        let weight_left = 1.0 - weight * h;
        if weight_left < 1.0 - *SOLE {
            0.0
        } else {
            along[k] * along[k] / (weight_left * (weight_left + h))
        }
    });
    squares.sum::<f64>().sqrt()
}

//! What is in the model, as a part of the covariance of the rows: everything else is seen through its inverse.
//!
//! With the components' columns Z of unit prior variance and noise kappa^2: X' C^-1 X = (X'X - X'Z (kappa^2 + Z'Z)^-1 Z'X) / kappa^2, so that a
//! component is left out, or another one put in, without a pass over the rows.

use super::component::{CellColumns, Component, PartProducts, SeenGroup};
use super::factored::unit;
use super::frame::{MultipliedColumns, SearchRows};
use crate::criteria::cells::{NU, UNEXPLAINED};
use crate::effect::Form;
use crate::linear::{dot, product};
use calib_engine::{
    AMPLITUDES, EvidenceRows, GroupEvidence, evidence, evidence_at, evidence_between, log_sums,
};
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, MatMut, MatRef, Par, Side};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::collections::BTreeSet;
use std::sync::OnceLock;

/// Columns of which products are taken one by one.
const FEW: usize = 4;

/// Some components in the covariance.
pub struct KnownState {
    /// Standard deviation of the noise over what is stated.
    pub kappa: f64,
    /// What is left, seen through the covariance.
    pub rows: EvidenceRows,
    /// Which components.
    pub(super) components: Vec<Component>,
    /// Keys of their forms, once somebody asks.
    keys: OnceLock<BTreeSet<String>>,
    /// Cholesky factor of kappa^2 + Z'Z.
    lower: Mat<f64>,
    /// L^-1 Z'r.
    along: DVector<f64>,
}

impl KnownState {
    /// Components with the noise that fits them, or with a stated one.
    pub(super) fn of(
        components: Vec<Component>,
        products: &PartProducts,
        frame: &SearchRows,
        kappa: Option<f64>,
    ) -> Self {
        let (gram, along) = products.of(&components);
        Self {
            components,
            ..Self::new(&gram, along, frame.rows(), frame.least_noise(), kappa)
        }
    }

    /// Whether any of some forms is among those of its components: a model holds every number once, by its name.
    pub(super) fn has_any(&self, forms: &[Form]) -> bool {
        let keys = self.keys.get_or_init(|| {
            let forms = self.components.iter().flat_map(|one| &one.forms);
            forms.map(Form::key).collect()
        });
        !keys.is_empty() && forms.iter().any(|form| keys.contains(&form.key()))
    }

    /// Columns of unit prior variance in the covariance, by their Gram matrix and their products with the residual of rows.
    pub fn new(
        gram: &DMatrix<f64>,
        along: DVector<f64>,
        rows: EvidenceRows,
        least_noise: f64,
        kappa: Option<f64>,
    ) -> Self {
        let count = along.len();
        let solved = |square: f64| {
            let mut matrix = Mat::zeros(count, count);
            for (j, column) in gram.as_slice().chunks(count.max(1)).enumerate() {
                matrix.col_as_slice_mut(j)[j..].copy_from_slice(&column[j..]);
                matrix[(j, j)] += square;
            }
            let lower = matrix.llt(Side::Lower).map_or_else(
                |_| Mat::identity(count, count),
                |factor| factor.L().to_owned(),
            );
            let mut solved = along.clone();
            solve(&lower, solved.as_mut_slice());
            (lower, solved)
        };
        let mut square = kappa.map_or(1.0, |kappa| kappa * kappa);
        let (mut lower, mut solved_along) = solved(square);
        if kappa.is_none() {
            // Every step takes a factor of all components: the noise that leaves itself is found by secants.
            let mut before: Option<[f64; 2]> = None;
            for _ in 0..30 {
                let left = (rows.square - solved_along.norm_squared()).max(0.0);
                let next = ((*NU + left) / (*NU + rows.freedom)).max(least_noise);
                let (at, step) = (square, next - square);
                let done = (next.sqrt() - square.sqrt()).abs() < 1e-4 * square.sqrt();
                let slope = before.map(|[last, gap]| (step - gap) / (at - last));
                let secant = slope.map_or(next, |slope| at - step / slope);
                // Less noise explains more: where the slope says otherwise it is rounding.
                let follows = slope.is_some_and(|slope| slope < 0.0) && secant.is_finite();
                square = if follows && !done {
                    secant.max(least_noise)
                } else {
                    next
                };
                before = Some([at, step]);
                (lower, solved_along) = solved(square);
                if done {
                    break;
                }
            }
        }
        let left = (rows.square - solved_along.norm_squared()).max(0.0) / square;
        Self {
            kappa: square.sqrt(),
            // Rows that leave less than the least noise do not make it smaller.
            rows: EvidenceRows {
                square: left,
                freedom: rows.freedom.min(left),
            },
            components: Vec::new(),
            keys: OnceLock::new(),
            lower,
            along: solved_along,
        }
    }

    /// The likeliest coefficients (SI) of its components, one component after another.
    pub(super) fn coefficients(&self, frame: &SearchRows) -> Vec<Vec<f64>> {
        let left = DVector::from_vec(self.left(frame));
        let coefficients = |component: &Component| {
            let seen = left.rows(0, component.values.nrows());
            let along = component.values.tr_mul(&seen) / (self.kappa * self.kappa);
            let scaled = component.roots().zip(component.sigmas()).zip(along.iter());
            scaled
                .map(|((root, sigma), along)| sigma * root * along)
                .collect()
        };
        self.components.iter().map(coefficients).collect()
    }

    /// Its components' columns of unit prior variance, residual rows down, to be multiplied with others.
    pub(super) fn columns<'s>(&'s self, frame: &SearchRows) -> MultipliedColumns<'s> {
        let parts = self.components.iter().map(|component| &*component.part);
        frame.multiplied(parts.collect())
    }

    /// What its components leave of the residual at their likeliest.
    pub(super) fn left(&self, frame: &SearchRows) -> Vec<f64> {
        let mut left = DVector::from_column_slice(frame.residual());
        let Some(weights) = self.weights() else {
            return left.data.into();
        };
        let mut first = 0;
        for Component { part, .. } in &self.components {
            let (rows, count) = part.shape();
            let mut seen = left.rows_mut(0, rows);
            seen.gemv(-1.0, part, &weights.rows(first, count), 1.0);
            first += count;
        }
        left.data.into()
    }

    /// The likeliest weights of its columns; none where it has none.
    pub(crate) fn weights(&self) -> Option<DVector<f64>> {
        let mut weights = self.along.clone();
        let count = weights.len();
        if count == 0 {
            return None;
        }
        let out = MatMut::from_column_major_slice_mut(weights.as_mut_slice(), count, 1);
        solve_upper_triangular_in_place(self.lower.transpose(), out, Par::Seq);
        Some(weights)
    }

    /// Whether what explains so much of the squared residual leaves more than noise.
    pub(super) fn leaves_more_than_noise(&self, fit: f64) -> bool {
        let left = (self.rows.square - fit).max(0.0) / self.rows.freedom.max(1.0);
        self.kappa * left.sqrt() > *UNEXPLAINED
    }

    /// Half of ln of the determinant of the covariance over that of the noise.
    pub fn log_determinant(&self) -> f64 {
        let count = self.along.len() as f64;
        (0..self.along.len())
            .map(|k| self.lower[(k, k)].ln())
            .sum::<f64>()
            - count * self.kappa.ln()
    }

    /// L^-1 Z'X by the products Z'X (components' columns down) of columns X.
    pub fn solved(&self, mut products: DMatrix<f64>) -> DMatrix<f64> {
        solve(&self.lower, products.as_mut_slice());
        products
    }

    /// Gram matrix and gradient of a group seen through the covariance; `across` is L^-1 Z'X of its block from column `first` on.
    pub(super) fn seen(
        &self,
        group: &SeenGroup,
        across: &DMatrix<f64>,
        first: usize,
    ) -> (DMatrix<f64>, DVector<f64>) {
        self.see(
            (&group.gram, &group.gradient),
            across,
            first + group.range.start,
        )
    }

    /// The same of columns by their Gram matrix and gradient.
    pub fn see(
        &self,
        (gram, gradient): (&DMatrix<f64>, &DVector<f64>),
        across: &DMatrix<f64>,
        first: usize,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let square = self.kappa * self.kappa;
        if self.along.is_empty() {
            return (gram / square, gradient / square);
        }
        let (rows, count) = (across.nrows(), gradient.len());
        let columns = &across.as_slice()[first * rows..(first + count) * rows];
        let column = |j: usize| &columns[j * rows..(j + 1) * rows];
        let along = |j: usize, _| (gradient[j] - dot(column(j), self.along.as_slice())) / square;
        let along = DVector::from_fn(count, along);
        if count < FEW {
            let mut seen = gram.clone();
            for j in 0..count {
                for i in 0..=j {
                    seen[(i, j)] = (seen[(i, j)] - dot(column(i), column(j))) / square;
                    seen[(j, i)] = seen[(i, j)];
                }
            }
            return (seen, along);
        }
        let columns = MatRef::from_column_major_slice(columns, rows, count);
        ((gram - product(columns, columns)) / square, along)
    }

    /// The likeliest coefficients (SI) of a block of one group in a shape at an amplitude given the components.
    pub(super) fn likeliest(
        &self,
        block: &CellColumns,
        across: &DMatrix<f64>,
        (shape, amplitude): (usize, f64),
    ) -> Option<DVector<f64>> {
        let [group] = &block.groups[..] else {
            return None;
        };
        let (gram, gradient) = self.seen(group, across, 0);
        let shares = &group.group.shapes[shape].shares;
        let roots = DVector::from_iterator(
            shares.len(),
            shares.iter().map(|share| amplitude * share.sqrt()),
        );
        let mut matrix = DMatrix::from_fn(shares.len(), shares.len(), |i, j| {
            roots[i] * gram[(i, j)] * roots[j]
        });
        (0..shares.len()).for_each(|k| matrix[(k, k)] += 1.0);
        let weights = matrix
            .cholesky()?
            .solve(&roots.component_mul(&gradient))
            .component_mul(&roots);
        let squares = &block.square[group.range.clone()];
        // A function that is zero at all values that there are, as a cosine may be at two, is rounding.
        let least = 1e-9 * squares.iter().copied().fold(0.0, f64::max);
        let scale = |square: f64| if square > least { unit(square) } else { 0.0 };
        Some(DVector::from_fn(weights.len(), |k, _| {
            weights[k] * scale(squares[k])
        }))
    }

    /// Standard error of each coefficient (SI) of a block of one group given the components.
    pub(super) fn errors(&self, block: &CellColumns, across: &DMatrix<f64>) -> Vec<f64> {
        let [group] = &block.groups[..] else {
            return Vec::new();
        };
        let (gram, _) = self.seen(group, across, 0);
        let inverse = gram.try_inverse();
        let variance = |k: usize| inverse.as_ref().map_or(f64::INFINITY, |all| all[(k, k)]);
        let error = |k: usize| {
            let (variance, square) = (variance(k), block.square[group.range.start + k]);
            if variance > 0.0 && square > 0.0 {
                (variance / square).sqrt()
            } else {
                f64::INFINITY
            }
        };
        (0..group.range.len()).map(error).collect()
    }

    /// ln of the largest evidence that any shape of a block could have, whatever its prior: that of its least squares fit.
    pub(super) fn bound(&self, block: &CellColumns, across: &DMatrix<f64>, first: usize) -> f64 {
        let (whole, half) = (*NU + self.rows.square, 0.5 * (self.rows.freedom + *NU));
        let mut most = f64::NEG_INFINITY;
        for group in &block.groups {
            let (gram, gradient) = self.seen(group, across, first);
            let fit = match gradient.len() {
                1 => gradient[0] * gradient[0] / gram[(0, 0)].max(f64::MIN_POSITIVE),
                _ => {
                    let count = gradient.len();
                    // What is all but unseen cannot be told from rounding.
                    let least = 1e-9 * gram.trace().max(f64::MIN_POSITIVE);
                    let factor = Cholesky::new(gram + DMatrix::identity(count, count) * least);
                    factor.map_or(self.rows.square, |factor| {
                        gradient.dot(&factor.solve(&gradient))
                    })
                }
            };
            let log = -half * (1.0 - (fit / whole).min(1.0 - 1e-9)).ln();
            let weight = group
                .group
                .shapes
                .iter()
                .map(|shape| shape.log_weight)
                .fold(f64::NEG_INFINITY, f64::max);
            most = most.max(log + weight.max(-3.0));
        }
        most
    }

    /// The evidence of a component in its shape with the weight of that, from products of parts alone; nothing where
    /// its one coefficient would have a size that it cannot have.
    pub(super) fn component_evidence(
        &self,
        component: &Component,
        products: &PartProducts,
    ) -> Option<GroupEvidence> {
        let (gram, gradient, across) = products.beside(component, &self.components)?;
        let (gram, gradient) = self.see((&gram, &gradient), &self.solved(across), 0);
        if let [square] = component.square[..] {
            let root = component.roots().sum::<f64>();
            let per_part = gradient[0] / gram[(0, 0)].max(f64::MIN_POSITIVE);
            let coefficient = per_part * root / square.sqrt();
            if is_impossible(coefficient, component.positive, component.largest) {
                return None;
            }
        }
        // Its part has the prior variance of its amplitude.
        let shares = vec![component.amplitude.powi(-2); gradient.len()];
        let mut found = evidence(&gram, &gradient, &shares, self.rows);
        found.log += component.shape.log_weight;
        Some(found)
    }

    /// What each shape of a block says, by its group and its place in that: its evidence with its weight; nothing of a shape whose coefficient
    /// would have a size that it cannot have.
    pub(super) fn shapes(
        &self,
        block: &CellColumns,
        across: &DMatrix<f64>,
        first: usize,
    ) -> Vec<(usize, usize, GroupEvidence)> {
        let mut out = Vec::new();
        for (g, (gram, gradient)) in self.possible(block, across, first) {
            for (s, shape) in block.groups[g].group.shapes.iter().enumerate() {
                let mut found =
                    evidence_between(&gram, &gradient, &shape.shares, self.rows, block.between);
                found.log += shape.log_weight;
                out.push((g, s, found));
            }
        }
        out
    }

    /// The same at each amplitude, all shapes of a group together: ln of their evidence with their weights, by the group.
    pub(super) fn at_amplitudes(
        &self,
        block: &CellColumns,
        across: &DMatrix<f64>,
        first: usize,
    ) -> Vec<(usize, [f64; AMPLITUDES])> {
        let of_group = |(g, (gram, gradient)): (usize, (DMatrix<f64>, DVector<f64>))| {
            let shapes = block.groups[g].group.shapes.iter().map(|shape| {
                evidence_at(&gram, &gradient, &shape.shares, self.rows, block.between)
                    .map(|log| log + shape.log_weight)
            });
            (g, log_sums(shapes))
        };
        let groups = self.possible(block, across, first);
        groups.map(of_group).collect()
    }

    /// Gram matrices and gradients of the groups of a block but those whose coefficient would have a size that it cannot have.
    fn possible(
        &self,
        block: &CellColumns,
        across: &DMatrix<f64>,
        first: usize,
    ) -> impl Iterator<Item = (usize, (DMatrix<f64>, DVector<f64>))> {
        let groups = block.groups.iter().enumerate();
        groups.filter_map(move |(g, group)| {
            let (gram, gradient) = self.seen(group, across, first);
            if gradient.len() == 1 {
                let coefficient = gradient[0]
                    / gram[(0, 0)].max(f64::MIN_POSITIVE)
                    / block.square[group.range.start].sqrt();
                if is_impossible(coefficient, group.group.positive, group.group.largest) {
                    return None;
                }
            }
            Some((g, (gram, gradient)))
        })
    }
}

/// Whether a coefficient (SI) has a sign or a size that it cannot have.
fn is_impossible(coefficient: f64, positive: bool, largest: f64) -> bool {
    positive && coefficient < 0.0 || coefficient.abs() > 1.5 * largest
}

/// L^-1 times columns, one after another.
fn solve(lower: &Mat<f64>, columns: &mut [f64]) {
    let rows = lower.nrows();
    if let Some(count) = columns.len().checked_div(rows) {
        let columns = MatMut::from_column_major_slice_mut(columns, rows, count);
        solve_lower_triangular_in_place(lower.as_ref(), columns, Par::Seq);
    }
}

//! What is in the model, as a part of the covariance of the rows: everything else is seen through its inverse.
//!
//! With the components' columns Z of unit prior variance and noise kappa^2: X' C^-1 X = (X'X - X'Z (kappa^2 + Z'Z)^-1 Z'X) / kappa^2, so that a
//! component is left out, or another one put in, without a pass over the rows.

use super::cell::{CellShape, ShapeGroup};
use super::evidence::{EvidenceRows, GroupEvidence, evidence_between};
use super::frame::{SearchRows, UnitColumns, product, view};
use crate::criteria::cells::NU;
use crate::diagnose::linear::dot;
use crate::effect::Form;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, Mat, MatMut, Par, Side};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, RwLock, Weak};

/// A group of shapes with its columns.
pub(super) struct SeenGroup {
    pub(crate) group: ShapeGroup,
    /// Its columns among those of its block.
    pub(crate) range: Range<usize>,
    /// Columns of each form.
    pub(crate) counts: Vec<usize>,
    gram: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Keys of the shapes of a cell: their forms, numbered where several have the same.
pub(super) fn shape_keys(groups: &[SeenGroup]) -> Vec<String> {
    let mut times: BTreeMap<String, usize> = BTreeMap::new();
    let key = |seen: &SeenGroup| {
        let keys: Vec<String> = seen.group.forms.iter().map(Form::key).collect();
        let key = keys.join("+");
        let before = times.entry(key.clone()).or_default();
        *before += 1;
        match *before {
            1 => key,
            count => format!("{key}~{count}"),
        }
    };
    groups.iter().map(key).collect()
}

/// All shapes of a cell with their columns.
pub(super) struct CellColumns {
    pub(crate) groups: Vec<SeenGroup>,
    pub(crate) columns: UnitColumns,
    /// Its possible amplitudes, m.
    pub(crate) between: [f64; 2],
}

impl CellColumns {
    pub(crate) fn of(groups: Vec<ShapeGroup>, frame: &SearchRows) -> Self {
        let forms: Vec<Form> = groups
            .iter()
            .flat_map(|group| group.forms.iter().cloned())
            .collect();
        let (columns, counts) = frame.columns(&forms);
        let (mut first, mut counts) = (0, counts.into_iter());
        let seen = |mut group: ShapeGroup| {
            let counts: Vec<usize> = counts.by_ref().take(group.forms.len()).collect();
            let count: usize = counts.iter().sum();
            let range = first..first + count;
            first += count;
            for shape in group
                .shapes
                .iter_mut()
                .filter(|shape| shape.shares.is_empty())
            {
                shape.shares = vec![1.0 / count.max(1) as f64; count];
            }
            let values = columns.values.columns(range.start, count).into_owned();
            let (gram, gradient) = (product(view(&values), view(&values)), frame.along(&values));
            SeenGroup {
                group,
                range,
                counts,
                gram,
                gradient,
            }
        };
        Self {
            groups: groups.into_iter().map(seen).collect(),
            columns,
            between: [0.0, f64::INFINITY],
        }
    }
}

impl CellColumns {
    /// The shape of a component alone.
    pub(crate) fn of_component(component: &Component, frame: &SearchRows) -> Self {
        let values = component.values.clone();
        let (gram, gradient) = (product(view(&values), view(&values)), frame.along(&values));
        let range = 0..values.ncols();
        let group = SeenGroup {
            group: (*component.group).clone(),
            range,
            counts: component.counts.clone(),
            gram,
            gradient,
        };
        Self {
            groups: vec![group],
            columns: UnitColumns {
                values,
                square: (*component.square).clone(),
            },
            between: [0.0, f64::INFINITY],
        }
    }

    /// With the possible amplitudes that other robots show.
    pub(crate) fn between(self, between: Option<[f64; 2]>) -> Self {
        Self {
            between: between.unwrap_or([0.0, f64::INFINITY]),
            ..self
        }
    }

    /// The largest share of a motion that the columns of a group can make, by their products with it; of unit length.
    pub(crate) fn overlap(&self, along: &[f64]) -> f64 {
        let mut most = 0.0;
        for group in &self.groups {
            let along = DVector::from_column_slice(&along[group.range.clone()]);
            let share = match along.len() {
                1 => along[0] * along[0] / group.gram[(0, 0)].max(f64::MIN_POSITIVE),
                count => {
                    let least = 1e-6 * group.gram.trace().max(f64::MIN_POSITIVE);
                    let factor =
                        Cholesky::new(&group.gram + DMatrix::identity(count, count) * least);
                    factor.map_or(0.0, |factor| along.dot(&factor.solve(&along)))
                }
            };
            most = f64::max(most, share);
        }
        most
    }
}

/// A cell of the model: its forms in one shape, at an amplitude.
#[derive(Clone)]
pub(super) struct Component {
    /// Components of the same number have the same part in the covariance.
    pub(crate) id: u64,
    pub(crate) cell: usize,
    pub(crate) forms: Vec<Form>,
    pub(crate) counts: Vec<usize>,
    pub(crate) shape: CellShape,
    /// Whether, and up to which size, its coefficients are positive.
    pub(crate) group: Arc<ShapeGroup>,
    pub(crate) values: Arc<DMatrix<f64>>,
    pub(crate) square: Arc<Vec<f64>>,
    /// Rms motion at the tool, m.
    pub(crate) amplitude: f64,
    /// Columns whose products with themselves are its part in the covariance: the directions that the rows could show.
    pub(crate) part: Arc<DMatrix<f64>>,
    /// What makes these of its columns.
    pub(crate) mix: Arc<DMatrix<f64>>,
}

/// Prior variance of a direction, in that of the noise, below which no row shows it.
const UNSEEN: f64 = 0.01;

impl Component {
    /// Roots of the prior variances of its columns.
    fn roots(&self) -> impl Iterator<Item = f64> + '_ {
        self.shape
            .shares
            .iter()
            .map(|share| self.amplitude * share.sqrt())
    }

    /// Prior standard deviations of its coefficients, SI.
    pub(crate) fn sigmas(&self) -> Vec<f64> {
        let scale = |square: &f64| {
            if *square > 0.0 {
                square.sqrt().recip()
            } else {
                0.0
            }
        };
        self.roots()
            .zip(self.square.iter())
            .map(|(root, square)| root * scale(square))
            .collect()
    }

    /// With its part in the covariance.
    pub(crate) fn with_part(self, id: u64) -> Self {
        let roots: Vec<f64> = self.roots().collect();
        let mut mix = DMatrix::from_diagonal(&DVector::from_column_slice(&roots));
        if roots.len() > 2 {
            let mut gram = product(view(&self.values), view(&self.values));
            for (j, mut column) in gram.column_iter_mut().enumerate() {
                column
                    .iter_mut()
                    .zip(&roots)
                    .for_each(|(entry, root)| *entry *= root * roots[j]);
            }
            let eigen = gram.symmetric_eigen();
            let seen: Vec<usize> = (0..eigen.eigenvalues.len())
                .filter(|k| eigen.eigenvalues[*k] > UNSEEN)
                .collect();
            let kept = if seen.is_empty() {
                vec![eigen.eigenvalues.imax()]
            } else {
                seen
            };
            mix *= eigen.eigenvectors.select_columns(kept.iter());
        }
        let mut part = DMatrix::zeros(self.values.nrows(), mix.ncols());
        let out = MatMut::from_column_major_slice_mut(
            part.as_mut_slice(),
            self.values.nrows(),
            mix.ncols(),
        );
        matmul(
            out,
            Accum::Replace,
            view(&self.values),
            view(&mix),
            1.0,
            Par::Seq,
        );
        Self {
            id,
            part: Arc::new(part),
            mix: Arc::new(mix),
            ..self
        }
    }

    /// One that has no part in the covariance yet.
    pub(crate) fn apart(
        cell: usize,
        forms: Vec<Form>,
        counts: Vec<usize>,
        group: ShapeGroup,
        columns: UnitColumns,
        amplitude: f64,
    ) -> Self {
        let shape = group.shapes[0].clone();
        let UnitColumns { values, square } = columns;
        Self {
            id: 0,
            cell,
            forms,
            counts,
            shape,
            group: Arc::new(group),
            values,
            square: Arc::new(square),
            amplitude,
            part: Arc::default(),
            mix: Arc::default(),
        }
    }

    /// Products of its part with other columns, by those of its columns with them.
    pub(crate) fn by_part(&self, of_columns: &DMatrix<f64>) -> DMatrix<f64> {
        product(view(&self.mix), view(of_columns))
    }
}

/// Products of the columns of components with those of cells, each computed once: most states differ in amplitudes alone.
#[derive(Default)]
pub(super) struct ColumnProducts(RwLock<ProductCache>);

#[derive(Default)]
struct ProductCache {
    known: BTreeMap<(usize, usize), KnownProduct>,
    /// Numbers in all of them.
    size: usize,
}

struct KnownProduct {
    /// What it is of: as long as it is known, nothing else comes to lie there.
    _of: [Weak<DMatrix<f64>>; 2],
    product: Arc<DMatrix<f64>>,
}

impl ColumnProducts {
    /// The transpose of `a` times `b`.
    pub(crate) fn of(&self, a: &Arc<DMatrix<f64>>, b: &Arc<DMatrix<f64>>) -> Arc<DMatrix<f64>> {
        let key = (Arc::as_ptr(a) as usize, Arc::as_ptr(b) as usize);
        if let Ok(cache) = self.0.read()
            && let Some(known) = cache.known.get(&key)
        {
            return known.product.clone();
        }
        let product = Arc::new(product(view(a), view(b)));
        if let Ok(mut cache) = self.0.write() {
            // 128 MB.
            if cache.size > 1 << 24 {
                *cache = ProductCache::default();
            }
            cache.size += product.len();
            cache.known.insert(
                key,
                KnownProduct {
                    _of: [Arc::downgrade(a), Arc::downgrade(b)],
                    product: product.clone(),
                },
            );
        }
        product
    }
}

/// Products of the parts of components with each other and with the residual, each computed once.
#[derive(Default)]
pub(super) struct PartProducts(RwLock<PartCache>);

#[derive(Default)]
struct PartCache {
    pairs: BTreeMap<(u64, u64), Arc<DMatrix<f64>>>,
    along: BTreeMap<u64, Arc<DVector<f64>>>,
}

impl PartProducts {
    /// Computes what is missing for some components, and forgets what is too much.
    pub(crate) fn know(&self, components: &[&Component], frame: &SearchRows) {
        let Ok(mut cache) = self.0.write() else {
            return;
        };
        if cache.pairs.len() > 20_000 {
            *cache = PartCache::default();
        }
        for (i, component) in components.iter().enumerate() {
            cache
                .along
                .entry(component.id)
                .or_insert_with(|| Arc::new(frame.along(&component.part)));
            for other in &components[..=i] {
                let key = (component.id.max(other.id), component.id.min(other.id));
                let [later, earlier] = if component.id >= other.id {
                    [component, other]
                } else {
                    [other, component]
                };
                cache
                    .pairs
                    .entry(key)
                    .or_insert_with(|| Arc::new(product(view(&later.part), view(&earlier.part))));
            }
        }
    }

    /// The Gram matrix of components, and their products with the residual.
    fn of(&self, components: &[&Component]) -> (DMatrix<f64>, DVector<f64>) {
        let count: usize = components
            .iter()
            .map(|component| component.part.ncols())
            .sum();
        let (mut gram, mut along) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let Ok(cache) = self.0.read() else {
            return (gram, along);
        };
        let mut down = 0;
        for (i, component) in components.iter().enumerate() {
            let rows = component.part.ncols();
            if let Some(known) = cache.along.get(&component.id) {
                along.rows_mut(down, rows).copy_from(known);
            }
            let mut across = 0;
            for other in &components[..=i] {
                let columns = other.part.ncols();
                let key = (component.id.max(other.id), component.id.min(other.id));
                if let Some(known) = cache.pairs.get(&key) {
                    let block = if component.id >= other.id {
                        (**known).clone()
                    } else {
                        known.transpose()
                    };
                    gram.view_mut((across, down), (columns, rows))
                        .copy_from(&block.transpose());
                    gram.view_mut((down, across), (rows, columns))
                        .copy_from(&block);
                }
                across += columns;
            }
            down += rows;
        }
        (gram, along)
    }

    /// How much two components do the same, 0 to 1.
    pub(crate) fn overlap(&self, a: &Component, b: &Component) -> f64 {
        let Ok(cache) = self.0.read() else { return 1.0 };
        let square = |a: u64, b: u64| {
            cache
                .pairs
                .get(&(a.max(b), a.min(b)))
                .map(|known| known.norm_squared())
        };
        match (square(a.id, b.id), square(a.id, a.id), square(b.id, b.id)) {
            (Some(both), Some(first), Some(second)) => {
                both / (first * second).sqrt().max(f64::MIN_POSITIVE)
            }
            _ => 1.0,
        }
    }
}

/// Some components in the covariance.
pub struct KnownState {
    /// Standard deviation of the noise over what is stated.
    pub kappa: f64,
    /// What is left, seen through the covariance.
    pub rows: EvidenceRows,
    /// Which components, by their numbers.
    pub(crate) components: Vec<u64>,
    /// Cholesky factor of kappa^2 + Z'Z.
    lower: Mat<f64>,
    /// L^-1 Z'r.
    along: DVector<f64>,
}

impl KnownState {
    /// Components with the noise that fits them, or with a stated one.
    pub(super) fn of(
        components: &[&Component],
        products: &PartProducts,
        frame: &SearchRows,
        kappa: Option<f64>,
    ) -> Self {
        let (gram, along) = products.of(components);
        let known = Self::new(&gram, along, frame.rows(), frame.least_noise(), kappa);
        Self {
            components: components.iter().map(|component| component.id).collect(),
            ..known
        }
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
            let matrix = Mat::from_fn(count, count, |i, j| {
                gram[(i, j)] + if i == j { square } else { 0.0 }
            });
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
            for _ in 0..30 {
                let left = (rows.square - solved_along.norm_squared()).max(0.0);
                let next = ((*NU + left) / (*NU + rows.freedom)).max(least_noise);
                let done = (next.sqrt() - square.sqrt()).abs() < 1e-4 * square.sqrt();
                square = next;
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
            lower,
            along: solved_along,
        }
    }

    /// The likeliest coefficients (SI) of its components, one component after another.
    pub(super) fn coefficients(
        &self,
        components: &[&Component],
        frame: &SearchRows,
    ) -> Vec<Vec<f64>> {
        let left = DVector::from_vec(self.left(components, frame));
        let of = |component: &&Component| {
            let along = component
                .values
                .tr_mul(&left.rows(0, component.values.nrows()))
                / (self.kappa * self.kappa);
            let scaled = component.roots().zip(component.sigmas()).zip(along.iter());
            scaled
                .map(|((root, sigma), along)| sigma * root * along)
                .collect()
        };
        components.iter().map(of).collect()
    }

    /// What its components leave of the residual at their likeliest.
    pub(super) fn left(&self, components: &[&Component], frame: &SearchRows) -> Vec<f64> {
        let residual = DVector::from_column_slice(frame.residual());
        let left = self.weights().map_or_else(
            || residual.clone(),
            |weights| &residual - side_by_side(components, residual.len()) * weights,
        );
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
    fn seen(
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
        let rows = across.nrows();
        let column = |j: usize| &across.as_slice()[(first + j) * rows..(first + j + 1) * rows];
        let mut seen = gram.clone();
        for j in 0..gradient.len() {
            for i in 0..=j {
                seen[(i, j)] = (seen[(i, j)] - dot(column(i), column(j))) / square;
                seen[(j, i)] = seen[(i, j)];
            }
        }
        let along = |j: usize, _| (gradient[j] - dot(column(j), self.along.as_slice())) / square;
        (seen, DVector::from_fn(gradient.len(), along))
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
        let squares = &block.columns.square[group.range.clone()];
        // A function that is zero at all values that there are, as a cosine may be at two, is rounding.
        let least = 1e-9 * squares.iter().copied().fold(0.0, f64::max);
        let scale = |square: f64| {
            if square > least {
                square.sqrt().recip()
            } else {
                0.0
            }
        };
        let scaled = weights.iter().zip(squares);
        Some(DVector::from_iterator(
            weights.len(),
            scaled.map(|(weight, square)| weight * scale(*square)),
        ))
    }

    /// Standard error of each coefficient (SI) of a block of one group given the components.
    pub(super) fn errors(&self, block: &CellColumns, across: &DMatrix<f64>) -> Vec<f64> {
        let [group] = &block.groups[..] else {
            return Vec::new();
        };
        let (gram, _) = self.seen(group, across, 0);
        let inverse = gram.try_inverse();
        let of = |k: usize| {
            let variance = inverse
                .as_ref()
                .map_or(f64::INFINITY, |inverse| inverse[(k, k)]);
            let square = block.columns.square[group.range.start + k];
            if variance > 0.0 && square > 0.0 {
                (variance / square).sqrt()
            } else {
                f64::INFINITY
            }
        };
        (0..group.range.len()).map(of).collect()
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

    /// What each group of a block says: for every shape ln of its evidence with its weight, and its amplitude; nothing of a shape whose
    /// coefficient would have a size that it cannot have.
    pub(super) fn shapes(
        &self,
        block: &CellColumns,
        across: &DMatrix<f64>,
        first: usize,
        mut each: impl FnMut(usize, usize, GroupEvidence),
    ) {
        for (g, group) in block.groups.iter().enumerate() {
            let (gram, gradient) = self.seen(group, across, first);
            let single = gradient.len() == 1;
            if single {
                let coefficient = gradient[0]
                    / gram[(0, 0)].max(f64::MIN_POSITIVE)
                    / block.columns.square[group.range.start].sqrt();
                let wrong = group.group.positive && coefficient < 0.0;
                if wrong || coefficient.abs() > 1.5 * group.group.largest {
                    continue;
                }
            }
            for (s, shape) in group.group.shapes.iter().enumerate() {
                let found =
                    evidence_between(&gram, &gradient, &shape.shares, self.rows, block.between);
                each(
                    g,
                    s,
                    GroupEvidence {
                        log: found.log + shape.log_weight,
                        ..found
                    },
                );
            }
        }
    }
}

/// L^-1 times columns, one after another.
fn solve(lower: &Mat<f64>, columns: &mut [f64]) {
    let rows = lower.nrows();
    if let Some(count) = columns.len().checked_div(rows) {
        let columns = MatMut::from_column_major_slice_mut(columns, rows, count);
        solve_lower_triangular_in_place(lower.as_ref(), columns, Par::Seq);
    }
}

/// The parts of components in the covariance as one matrix.
fn side_by_side(components: &[&Component], rows: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(
        rows,
        components
            .iter()
            .map(|component| component.part.ncols())
            .sum(),
    );
    let mut first = 0;
    for component in components {
        out.view_mut((0, first), component.part.shape())
            .copy_from(&*component.part);
        first += component.part.ncols();
    }
    out
}

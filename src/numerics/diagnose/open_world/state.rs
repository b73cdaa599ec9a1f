//! What is in the model, as a part of the covariance of the rows: the rest is seen through its inverse.
//!
//! With columns Z of unit prior variance and noise variance 1/s: X' C^-1 X = s X'X - Y'Y, Y = L^-1 s Z'X, L L' = 1 + s Z'Z.

use super::frame::{GroupProducts, ProjectedRows, product, view};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatMut, Par, Side};
use nalgebra::{DMatrix, DVector};

/// Columns of all causes of a model, residual rows x count, with their products.
pub(super) struct CauseColumns {
    pub columns: DMatrix<f64>,
    products: GroupProducts,
}

impl CauseColumns {
    pub fn new(frame: &ProjectedRows, columns: DMatrix<f64>) -> Self {
        let products = GroupProducts { gram: product(view(&columns), view(&columns)), gradient: frame.along(view(&columns)) };
        Self { columns, products }
    }

    /// The products of all causes' columns (down) with some others (across).
    pub fn with(&self, others: &DMatrix<f64>) -> DMatrix<f64> {
        product(view(&self.columns), view(others))
    }
}

/// Causes and free forms under their priors.
#[derive(Clone)]
pub(super) struct KnownCauses<'c> {
    causes: &'c CauseColumns,
    /// The columns of the model's causes that are in it, by their numbers, with the roots of their prior variances.
    picked: Vec<(usize, f64)>,
    /// Further columns times the roots of their prior variances; residual rows x count.
    more: DMatrix<f64>,
    /// Products of all of its columns times the roots of their prior variances, the picked ones first.
    products: GroupProducts,
    /// Cholesky factor.
    lower: Mat<f64>,
    along: DVector<f64>,
    /// Over the variance of the noise, in the variances of the rows.
    scale: f64,
}

/// A group that is asked beside a state.
#[derive(Clone, Copy)]
pub(super) struct AskedGroup<'g> {
    pub products: &'g GroupProducts,
    /// The products of the columns of all the model's causes with the group's.
    pub known: &'g DMatrix<f64>,
    /// Its columns; they may be missing where the state has no others than those of causes.
    pub columns: &'g DMatrix<f64>,
}

impl<'c> KnownCauses<'c> {
    /// A state of some of the model's causes and noise.
    pub fn of(causes: &'c CauseColumns, picked: Vec<(usize, f64)>, scale: f64) -> Self {
        let (count, all) = (picked.len(), &causes.products);
        let among = |i: usize, j: usize| picked[i].1 * picked[j].1 * all.gram[(picked[i].0, picked[j].0)];
        let products = GroupProducts {
            gram: DMatrix::from_fn(count, count, among),
            gradient: DVector::from_fn(count, |i, _| picked[i].1 * all.gradient[picked[i].0]),
        };
        let more = DMatrix::zeros(causes.columns.nrows(), 0);
        Self { causes, picked, more, products, lower: Mat::new(), along: DVector::zeros(0), scale }.factored()
    }

    /// With more columns of these prior variances.
    pub fn with(&self, frame: &ProjectedRows, columns: &DMatrix<f64>, variances: &[f64]) -> Self {
        let (old, new, picked) = (self.products.gradient.len(), columns.ncols(), self.more.ncols());
        let mut more = self.more.clone().resize_horizontally(picked + new, 0.0);
        for (j, variance) in variances.iter().enumerate() {
            more.column_mut(picked + j).axpy(variance.sqrt(), &columns.column(j), 0.0);
        }
        let own = more.columns(picked, new).into_owned();
        let mut gram = self.products.gram.clone().resize(old + new, old + new, 0.0);
        // Only the lower triangle is read.
        gram.view_mut((old, 0), (new, old)).copy_from(&self.across(&self.causes.with(&own), &own).transpose());
        gram.view_mut((old, old), (new, new)).copy_from(&product(view(&own), view(&own)));
        let mut gradient = self.products.gradient.clone().resize_vertically(old + new, 0.0);
        gradient.rows_mut(old, new).copy_from(&frame.along(view(&own)));
        Self { more, products: GroupProducts { gram, gradient }, ..self.clone() }.factored()
    }

    fn factored(mut self) -> Self {
        let GroupProducts { gram, gradient } = &self.products;
        let whole = Mat::from_fn(gram.nrows(), gram.nrows(), |i, j| f64::from(u8::from(i == j)) + self.scale * gram[(i, j)]);
        self.lower = whole.llt(Side::Lower).map_or_else(|_| Mat::new(), |factor| factor.L().to_owned());
        self.along = gradient.rows(0, self.lower.nrows()) * self.scale;
        let along = MatMut::from_column_major_slice_mut(self.along.as_mut_slice(), self.lower.nrows(), 1);
        solve_lower_triangular_in_place(self.lower.as_ref(), along, Par::Seq);
        self
    }

    /// The products of its columns with some others, of which those of all causes' columns are `known`.
    fn across(&self, known: &DMatrix<f64>, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let (picked, more) = (self.picked.len(), self.more.ncols());
        let mut across = DMatrix::zeros(picked + more, known.ncols());
        for (mut to, from) in across.column_iter_mut().zip(known.column_iter()) {
            to.iter_mut().zip(&self.picked).for_each(|(value, (k, root))| *value = root * from[*k]);
        }
        if more > 0 {
            across.rows_mut(picked, more).copy_from(&product(view(&self.more), view(columns)));
        }
        across
    }

    /// The products of any columns beside the state.
    pub fn of_columns(&self, frame: &ProjectedRows, columns: &DMatrix<f64>) -> GroupProducts {
        let products = GroupProducts { gram: product(view(columns), view(columns)), gradient: frame.along(view(columns)) };
        let known = self.causes.with(columns);
        self.beside_one(AskedGroup { products: &products, known: &known, columns })
    }

    /// What the state leaves of the residual, in standard deviations of the noise times the root of `scale`.
    pub fn leaves(&self, frame: &ProjectedRows) -> Vec<f64> {
        let mut left = DVector::from_column_slice(frame.residual());
        let mut along = self.along.clone();
        let whole = MatMut::from_column_major_slice_mut(along.as_mut_slice(), self.lower.nrows(), 1);
        solve_upper_triangular_in_place(self.lower.transpose(), whole, Par::Seq);
        let (picked, more) = (self.picked.len().min(along.len()), self.more.ncols());
        for (value, (k, root)) in along.iter().zip(&self.picked) {
            left.axpy(-value * root, &self.causes.columns.column(*k), 1.0);
        }
        if along.len() == picked + more {
            left.gemv(-1.0, &self.more, &along.rows(picked, more), 1.0);
        }
        left *= self.scale.sqrt();
        left.data.into()
    }

    /// ln of the evidence over that of noise alone.
    pub fn log(&self) -> f64 {
        let determinant: f64 = (0..self.lower.nrows()).map(|k| self.lower[(k, k)].ln()).sum();
        0.5 * self.gain() - determinant
    }

    /// What the squared residual, over the noise, falls by.
    pub fn gain(&self) -> f64 {
        self.along.norm_squared()
    }

    /// A group's products beside the state.
    pub fn beside_one(&self, group: AskedGroup) -> GroupProducts {
        self.beside(&[group]).remove(0)
    }

    /// The products of groups beside the state.
    pub fn beside(&self, groups: &[AskedGroup]) -> Vec<GroupProducts> {
        let count = self.lower.nrows();
        let all: usize = groups.iter().map(|group| group.known.ncols()).sum();
        let mut share = Mat::zeros(count, all);
        let mut first = 0;
        for group in groups.iter().filter(|_| count > 0) {
            for from in self.across(group.known, group.columns).column_iter() {
                let to = share.col_as_slice_mut(first);
                to.iter_mut().zip(&from).for_each(|(value, product)| *value = product * self.scale);
                first += 1;
            }
        }
        solve_lower_triangular_in_place(self.lower.as_ref(), share.as_mut(), Par::Seq);
        let mut first = 0;
        let one = |group: &AskedGroup| {
            let width = group.known.ncols();
            let own = share.as_ref().subcols(first, width);
            first += width;
            let (mut gram, mut gradient) = (&group.products.gram * self.scale, &group.products.gradient * self.scale);
            let out = MatMut::from_column_major_slice_mut(gram.as_mut_slice(), width, width);
            matmul(out, Accum::Add, own.transpose(), own, -1.0, Par::Seq);
            for (j, value) in gradient.iter_mut().enumerate() {
                *value -= own.col(j).iter().zip(self.along.iter()).map(|(share, along)| share * along).sum::<f64>();
            }
            GroupProducts { gram, gradient }
        };
        groups.iter().map(one).collect()
    }
}

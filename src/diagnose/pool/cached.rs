//! The pool with what was computed of its sets: a search meets most of them more than once.

use super::cholesky::PivotedCholesky;
use super::conditional::{Conditional, SetProducts, SetShares};
use super::earlier::{EarlierPool, KnownForm};
use super::hypotheses::HypothesisSet;
use super::solve::{Solution, solve};
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::{Form, Hypothesis};
use faer::Mat;
use std::collections::{BTreeSet, HashMap};
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Hypotheses, the criterion of sets of them, and the problem with sets of them estimated.
pub(crate) struct CachedHypotheses<'a> {
    pool: HypothesisSet<'a>,
    products: Mutex<Products>,
    /// Products of the columns of hypotheses that were in a set with the columns of all, for one column of the pool after another.
    across: Mutex<HashMap<usize, Vec<f64>>>,
    scores: Mutex<HashMap<Vec<usize>, f64>>,
    conditionals: Mutex<HashMap<Vec<usize>, Arc<Conditional>>>,
    /// Forms of causes that an earlier round had beyond its list.
    known: Vec<KnownForm>,
}

/// Products of the columns of pairs of hypotheses: sets share most of their pairs.
type Products = HashMap<(usize, usize), Arc<Mat<f64>>>;

impl<'a> From<HypothesisSet<'a>> for CachedHypotheses<'a> {
    fn from(pool: HypothesisSet<'a>) -> Self {
        Self {
            pool,
            products: Mutex::default(),
            across: Mutex::default(),
            scores: Mutex::default(),
            conditionals: Mutex::default(),
            known: Vec::new(),
        }
    }
}

impl<'a> Deref for CachedHypotheses<'a> {
    type Target = HypothesisSet<'a>;

    fn deref(&self) -> &Self::Target {
        &self.pool
    }
}

impl<'a> CachedHypotheses<'a> {
    /// The pool of an earlier round on another residual of the same rows.
    pub fn again(earlier: EarlierPool, problem: &'a WhitenedProblem<'a>, residual: &[f64], autocorrelation_time: f64) -> Self {
        let EarlierPool { columns, across, known, .. } = earlier;
        let pool = HypothesisSet::again(problem, columns, residual, autocorrelation_time);
        Self { across: Mutex::new(across), known, ..pool.into() }
    }

    /// What another round may use of this one, in which these causes were found: the columns of the list and of the causes, and their
    /// products.
    pub fn keep(self, causes: &[Form], compliance: Vec<f64>) -> EarlierPool {
        let Self { pool, across, .. } = self;
        let mut across = across.into_inner().unwrap_or_else(PoisonError::into_inner);
        let (listed, columns) = (pool.listed, pool.first[pool.listed]);
        let mut known = Vec::new();
        for h in (listed..pool.hypotheses.len()).filter(|h| causes.contains(&pool.hypotheses[*h].form)) {
            let own = pool.first[h]..pool.first[h + 1];
            let mut products = across.remove(&h).unwrap_or_default();
            products.truncate(columns * own.len());
            let form = pool.hypotheses[h].form.clone();
            known.push(KnownForm { form, columns: pool.take_columns(own), products });
        }
        across.retain(|h, _| *h < listed);
        across.iter_mut().for_each(|(h, products)| products.truncate(columns * (pool.first[h + 1] - pool.first[*h])));
        EarlierPool { rows: pool.problem.rows.clone(), compliance, columns: pool.into_columns(), across, known }
    }

    /// Takes more hypotheses; returns the position of the first.
    pub fn add(&mut self, hypotheses: Vec<Hypothesis>) -> usize {
        // What each of the others would gain knows nothing of the new ones.
        lock(&self.conditionals).clear();
        match <[Hypothesis; 1]>::try_from(hypotheses) {
            Ok([one]) => match self.known.iter().position(|known| known.form == one.form) {
                Some(k) => {
                    let KnownForm { columns, products, .. } = self.known.swap_remove(k);
                    let at = self.pool.add_known(one, columns);
                    lock(&self.across).insert(at, products);
                    at
                }
                None => self.pool.add(vec![one]),
            },
            Err(several) => self.pool.add(several),
        }
    }

    fn products(&self, a: usize, b: usize) -> Arc<Mat<f64>> {
        if let Some(products) = lock(&self.products).get(&(a, b)) {
            return products.clone();
        }
        let products = Arc::new(self.pool.products(a, b));
        lock(&self.products).insert((a, b), products.clone());
        products
    }

    /// The factor of the Gram matrix of a set's columns.
    pub(super) fn factor(&self, set: &[usize]) -> PivotedCholesky {
        PivotedCholesky::of(self.gram_of(set, |a, b| self.products(a, b)), self.columns_of(set).len())
    }

    /// Estimates a set of hypotheses together, beside the base model.
    pub fn solve(&self, set: &[usize]) -> Solution {
        solve(&self.pool, set, self.factor(set))
    }

    /// Coefficients of every member of a set.
    pub fn coefficients(&self, set: &[usize]) -> Vec<Vec<f64>> {
        let mut all = self.solve(set).coefficients.into_iter();
        set.iter().map(|k| all.by_ref().take(self.first[k + 1] - self.first[*k]).collect()).collect()
    }

    /// The members of a set with their coefficients.
    pub fn estimated(&self, set: &[usize]) -> Vec<(Form, Vec<f64>)> {
        set.iter().map(|k| self.hypotheses[*k].form.clone()).zip(self.coefficients(set)).collect()
    }

    /// The problem with the hypotheses of a set estimated beside the base model.
    pub fn given(&self, set: &[usize]) -> Arc<Conditional> {
        if let Some(conditional) = lock(&self.conditionals).get(set) {
            return conditional.clone();
        }
        let conditional = Arc::new(self.conditional(set));
        lock(&self.conditionals).insert(set.to_vec(), conditional.clone());
        conditional
    }

    fn conditional(&self, set: &[usize]) -> Conditional {
        self.shares(set).whole(&self.pool)
    }

    /// What a set takes off every column.
    fn shares(&self, set: &[usize]) -> SetShares {
        let count = |h: &usize| self.first[h + 1] - self.first[*h];
        let mut across = lock(&self.across);
        for h in set {
            // Hypotheses that were added since are not among those known.
            let known = across.entry(*h).or_default();
            let more = self.pool.products_with_all(*h, known.len() / count(h).max(1));
            known.extend(more);
        }
        let of = |h: &usize| {
            let (of_hypothesis, count) = (across[h].as_slice(), count(h));
            (0..count).map(move |own| SetProducts { of_hypothesis, count, own })
        };
        let products: Vec<SetProducts> = set.iter().flat_map(of).collect();
        SetShares::of(&self.pool, set, self.factor(set), &products)
    }

    /// Makes the problems of a set without each of some parts of it known: all of them follow from that of the whole set.
    pub fn leave_out(&self, set: &[usize], parts: &BTreeSet<Vec<usize>>) {
        let rest = |gone: &[usize]| -> Vec<usize> { set.iter().copied().filter(|h| !gone.contains(h)).collect() };
        let unknown: Vec<&Vec<usize>> =
            (parts.iter()).filter(|gone| gone.len() < set.len() && !lock(&self.conditionals).contains_key(&rest(gone))).collect();
        if unknown.len() < 2 {
            return;
        }
        let shares = self.shares(set);
        let (whole, coefficients) = (shares.whole(&self.pool), shares.coefficients());
        for gone in unknown {
            if let Some(conditional) = shares.without(&self.pool, &whole, &coefficients, gone) {
                lock(&self.conditionals).insert(rest(gone), Arc::new(conditional));
            }
        }
        lock(&self.conditionals).insert(set.to_vec(), Arc::new(whole));
    }

    /// Drops remembered conditional problems but those of `keep`.
    pub fn forget(&self, keep: &[Vec<usize>]) {
        lock(&self.conditionals).retain(|set, _| set.is_empty() || keep.contains(set));
    }

    /// The criterion of a set; infinite where its members make no sense together.
    pub fn bic(&self, set: &[usize]) -> f64 {
        if let Some(score) = lock(&self.scores).get(set) {
            return *score;
        }
        let score = if self.is_sound(set) { self.criterion(set, &self.solve(set)) } else { f64::INFINITY };
        lock(&self.scores).insert(set.to_vec(), score);
        score
    }
}

/// Remembered results stay right whoever panicked.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

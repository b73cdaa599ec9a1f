//! Columns of cells, and cells of the model as components: their columns in one shape at an amplitude, and the products of these with each other,
//! each computed once.

use super::cell::{CellShape, ShapeGroup};
use super::factored::{FactoredColumns, unit};
use super::frame::{MultipliedColumns, SearchRows};
use crate::effect::Form;
use crate::linear::{Columns, product, view};
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, Par};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, OnceLock, RwLock, Weak};

/// A group of shapes with its columns.
pub(super) struct SeenGroup {
    pub(crate) group: ShapeGroup,
    /// Its columns among those of its block.
    pub(crate) range: Range<usize>,
    /// Columns of each form.
    pub(crate) counts: Vec<usize>,
    pub(super) gram: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
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
    /// Mean squared motion (m2 or rad2) by a unit of each coefficient.
    pub(crate) square: Arc<Vec<f64>>,
    /// Where all of them are directions times functions.
    factored: Option<Vec<FactoredColumns>>,
    /// Residual rows x columns, once somebody wants them.
    values: OnceLock<Arc<Columns>>,
    /// Its possible amplitudes, m.
    pub(crate) between: [f64; 2],
}

impl CellColumns {
    pub(crate) fn of(groups: Vec<ShapeGroup>, frame: &SearchRows) -> Self {
        let forms = groups.iter().flat_map(|group| &group.forms);
        let factored: Option<Vec<_>> = forms.clone().map(|form| frame.factored(form)).collect();
        let values = OnceLock::new();
        let (square, counts) = match &factored {
            Some(factored) => {
                let square = factored.iter().map(|form| &form.square[..]);
                let counts = square.clone().map(<[f64]>::len).collect();
                (square.flatten().copied().collect(), counts)
            }
            None => {
                let (columns, counts) = frame.columns(&forms.cloned().collect::<Vec<_>>());
                let _ = values.set(columns.values);
                (columns.square, counts)
            }
        };
        let (mut first, mut first_form) = (0, 0);
        let seen = |mut group: ShapeGroup| {
            let forms_here = first_form..first_form + group.forms.len();
            let counts: Vec<usize> = counts[forms_here.clone()].to_vec();
            let count: usize = counts.iter().sum();
            let range = first..first + count;
            (first, first_form) = (range.end, forms_here.end);
            let even = group
                .shapes
                .iter_mut()
                .filter(|shape| shape.shares.is_empty());
            even.for_each(|shape| shape.shares = vec![1.0 / count.max(1) as f64; count]);
            let by_factors = factored
                .as_ref()
                .and_then(|factored| frame.factored_products(&factored[forms_here]));
            let (gram, gradient) = by_factors.unwrap_or_else(|| match values.get() {
                Some(values) => frame.products(view(values).subcols(range.start, count)),
                None => frame.products(view(&frame.columns(&group.forms).0.values)),
            });
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
            square: Arc::new(square),
            factored,
            values,
            between: [0.0, f64::INFINITY],
        }
    }

    /// The shape of a component alone.
    pub(crate) fn of_component(component: &Component, frame: &SearchRows) -> Self {
        let (gram, gradient) = frame.products(view(&component.values));
        let group = SeenGroup {
            group: ShapeGroup {
                forms: component.forms.clone(),
                shapes: vec![component.shape.clone()],
                positive: component.positive,
                largest: component.largest,
            },
            range: 0..component.values.ncols(),
            counts: component.counts.clone(),
            gram,
            gradient,
        };
        Self {
            groups: vec![group],
            square: component.square.clone(),
            factored: None,
            values: OnceLock::from(component.values.clone()),
            between: [0.0, f64::INFINITY],
        }
    }

    /// The position of the motion of its first columns among those of the frame; none of what is no product.
    pub(crate) fn motion(&self) -> Option<usize> {
        Some(self.factored.as_ref()?.first()?.motion)
    }

    /// How many columns it has.
    pub(crate) fn count(&self) -> usize {
        self.square.len()
    }

    /// Residual rows x columns.
    pub(crate) fn values(&self, frame: &SearchRows) -> &Arc<Columns> {
        self.values.get_or_init(|| {
            let forms = self.groups.iter().flat_map(|seen| &seen.group.forms);
            frame.columns(&forms.cloned().collect::<Vec<_>>()).0.values
        })
    }

    /// The transpose of columns of which the base is projected off times these.
    pub(crate) fn products(&self, with: &MultipliedColumns, frame: &SearchRows) -> DMatrix<f64> {
        match &self.factored {
            Some(factored) => frame.with_factored(with, &factored.iter().collect::<Vec<_>>()),
            None => with.times(self.values(frame)),
        }
    }

    /// The same of several blocks: one product of matrices for all that are factored.
    fn products_of_each(
        blocks: &[&Self],
        with: &MultipliedColumns,
        frame: &SearchRows,
    ) -> Vec<DMatrix<f64>> {
        let factored = blocks.iter().filter_map(|block| block.factored.as_ref());
        let factored: Vec<&FactoredColumns> = factored.flatten().collect();
        let together = frame.with_factored(with, &factored);
        let mut first = 0;
        let mut products = |block: &&Self| {
            if block.factored.is_none() {
                return block.products(with, frame);
            }
            let columns = together.columns(first, block.count()).into_owned();
            first += block.count();
            columns
        };
        blocks.iter().map(&mut products).collect()
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
    /// Whether its coefficients are positive, and the largest that makes sense, SI.
    pub(crate) positive: bool,
    pub(crate) largest: f64,
    pub(crate) values: Arc<Columns>,
    pub(crate) square: Arc<Vec<f64>>,
    /// Rms motion at the tool, m.
    pub(crate) amplitude: f64,
    /// ln of its evidence over that at its amplitude alone.
    pub(crate) spread: f64,
    /// Columns whose products with themselves are its part in the covariance: the directions that the rows could show.
    pub(crate) part: Arc<Columns>,
    /// What makes these of its columns.
    pub(crate) mix: Arc<DMatrix<f64>>,
}

impl PartialEq for Component {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

/// Prior variance of a direction, in that of the noise, below which no row shows it.
const UNSEEN: f64 = 0.01;

impl Component {
    /// Roots of the prior variances of its columns.
    pub(super) fn roots(&self) -> impl Iterator<Item = f64> + '_ {
        self.shape
            .shares
            .iter()
            .map(|share| self.amplitude * share.sqrt())
    }

    /// Prior standard deviations of its coefficients, SI.
    pub(crate) fn sigmas(&self) -> Vec<f64> {
        let both = self.roots().zip(self.square.iter());
        both.map(|(root, square)| root * unit(*square)).collect()
    }

    /// With its part in the covariance.
    pub(crate) fn with_part(self, id: u64) -> Self {
        let roots: Vec<f64> = self.roots().collect();
        let mut mix = DMatrix::from_diagonal(&DVector::from_column_slice(&roots));
        if roots.len() > 2 {
            let mut gram = product(view(&self.values), view(&self.values));
            for (j, mut column) in gram.column_iter_mut().enumerate() {
                let entries = column.iter_mut().zip(&roots);
                entries.for_each(|(entry, root)| *entry *= root * roots[j]);
            }
            let eigen = gram.symmetric_eigen();
            let mut kept: Vec<usize> = (0..roots.len()).collect();
            kept.retain(|k| eigen.eigenvalues[*k] > UNSEEN);
            if kept.is_empty() {
                kept.push(eigen.eigenvalues.imax());
            }
            mix *= eigen.eigenvectors.select_columns(&kept);
        }
        let mut part = DMatrix::zeros(self.values.nrows(), mix.ncols());
        let (rows, columns) = part.shape();
        let out = MatMut::from_column_major_slice_mut(part.as_mut_slice(), rows, columns);
        let (values, by) = (view(&self.values), view(&mix));
        matmul(out, Accum::Replace, values, by, 1.0, Par::Seq);
        Self {
            id,
            part: Arc::new(part.into()),
            mix: Arc::new(mix),
            ..self
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
    of: (Weak<Columns>, Weak<Vec<f64>>),
    product: Arc<DMatrix<f64>>,
}

impl ProductCache {
    /// Beyond 128 MB what nobody can ask again goes, or else everything.
    fn forget(&mut self) {
        let most = 1 << 24;
        if self.size <= most {
            return;
        }
        self.known.retain(|_, known| known.is_used());
        let sizes = self.known.values().map(|known| known.product.len());
        self.size = sizes.sum();
        if 2 * self.size > most {
            *self = Self::default();
        }
    }
}

impl KnownProduct {
    fn is_used(&self) -> bool {
        self.of.0.strong_count() > 0 && self.of.1.strong_count() > 0
    }
}

impl ColumnProducts {
    /// The transpose of a component's columns, which are multiplied as `with`, times those of each of some blocks.
    pub(crate) fn of_each(
        &self,
        component: &Component,
        with: &MultipliedColumns,
        blocks: &[&CellColumns],
        frame: &SearchRows,
    ) -> Vec<Arc<DMatrix<f64>>> {
        let key = |block: &CellColumns| {
            let (a, b) = (&component.values, &block.square);
            (Arc::as_ptr(a) as usize, Arc::as_ptr(b) as usize)
        };
        let mut out: Vec<Option<Arc<DMatrix<f64>>>> = match self.0.read() {
            Ok(cache) => {
                let known = |block: &&CellColumns| cache.known.get(&key(block));
                let product = |block| Some(known(block)?.product.clone());
                blocks.iter().map(product).collect()
            }
            Err(_) => vec![None; blocks.len()],
        };
        let missing: Vec<usize> = (0..blocks.len()).filter(|k| out[*k].is_none()).collect();
        let fresh: Vec<&CellColumns> = missing.iter().map(|k| blocks[*k]).collect();
        let products = CellColumns::products_of_each(&fresh, with, frame);
        let mut cache = self.0.write().ok();
        for (k, product) in missing.into_iter().zip(products) {
            let product = Arc::new(product);
            out[k] = Some(product.clone());
            let Some(cache) = cache.as_mut() else {
                continue;
            };
            cache.forget();
            cache.size += product.len();
            let of = (&component.values, &blocks[k].square);
            cache.known.insert(
                key(blocks[k]),
                KnownProduct {
                    of: (Arc::downgrade(of.0), Arc::downgrade(of.1)),
                    product,
                },
            );
        }
        out.into_iter().flatten().collect()
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
    /// Forgets all where that is too much; nobody may be between two questions.
    pub(crate) fn forget(&self) {
        if let Ok(mut cache) = self.0.write()
            && cache.pairs.len() > 20_000
        {
            *cache = PartCache::default();
        }
    }

    /// Computes what is missing for some components.
    pub(crate) fn know<'c>(
        &self,
        components: impl Iterator<Item = &'c Component>,
        frame: &SearchRows,
    ) {
        let components: Vec<&Component> = components.collect();
        let Ok(mut cache) = self.0.write() else {
            return;
        };
        for (i, a) in components.iter().enumerate() {
            let along = cache.along.entry(a.id);
            along.or_insert_with(|| Arc::new(frame.along(view(&a.part))));
            for b in &components[..=i] {
                let [later, earlier] = if a.id >= b.id { [a, b] } else { [b, a] };
                let pair = cache.pairs.entry((later.id, earlier.id));
                pair.or_insert_with(|| Arc::new(product(view(&later.part), view(&earlier.part))));
            }
        }
    }

    /// The Gram matrix of a component's part, its products with the residual, and with the parts of others, one after another; none where they
    /// are not known.
    pub(super) fn beside(
        &self,
        component: &Component,
        others: &[Component],
    ) -> Option<(DMatrix<f64>, DVector<f64>, DMatrix<f64>)> {
        let cache = self.0.read().ok()?;
        let gram = cache.pairs.get(&(component.id, component.id))?;
        let along = cache.along.get(&component.id)?;
        let rows = others.iter().map(|other| other.part.ncols()).sum();
        let mut across = DMatrix::zeros(rows, component.part.ncols());
        let mut first = 0;
        for other in others {
            let [later, earlier] = [component.id.max(other.id), component.id.min(other.id)];
            let known = cache.pairs.get(&(later, earlier))?;
            let mut block = across.rows_mut(first, other.part.ncols());
            match later == component.id {
                true => block.tr_copy_from(known),
                false => block.copy_from(known),
            }
            first += other.part.ncols();
        }
        Some(((**gram).clone(), (**along).clone(), across))
    }

    /// The Gram matrix of components, its lower triangle, and their products with the residual.
    pub(super) fn of(&self, components: &[Component]) -> (DMatrix<f64>, DVector<f64>) {
        let count: usize = components.iter().map(|one| one.part.ncols()).sum();
        let (mut gram, mut along) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let Ok(cache) = self.0.read() else {
            return (gram, along);
        };
        let mut down = 0;
        for (i, a) in components.iter().enumerate() {
            let rows = a.part.ncols();
            if let Some(known) = cache.along.get(&a.id) {
                along.rows_mut(down, rows).copy_from(known);
            }
            let mut across = 0;
            for b in &components[..=i] {
                let columns = b.part.ncols();
                if let Some(known) = cache.pairs.get(&(a.id.max(b.id), a.id.min(b.id))) {
                    let mut below = gram.view_mut((down, across), (rows, columns));
                    match a.id >= b.id {
                        true => below.copy_from(known),
                        false => below.tr_copy_from(known),
                    }
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
            let known = cache.pairs.get(&(a.max(b), a.min(b)));
            known.map(|known| known.norm_squared())
        };
        match (square(a.id, b.id), square(a.id, a.id), square(b.id, b.id)) {
            (Some(both), Some(first), Some(second)) => {
                both / (first * second).sqrt().max(f64::MIN_POSITIVE)
            }
            _ => 1.0,
        }
    }
}

//! Products of small matrices with columns of rows, in vectors of whatever width the machine has.
//!
//! Every number is added up in an order that is written out here, and products are never fused with sums: the same bits on any
//! machine. What is worked on is a multiple of [`LANES`] rows of a [`BlockColumn`].

use pulp::Simd;

/// Rows that are worked on together, and partial sums of a scalar product.
pub(super) const LANES: usize = 8;
/// Rows of a block: what a core's first cache holds for all neurons at once.
pub(super) const BLOCK: usize = 16 * LANES;
/// A number of each row of a block.
pub(super) type BlockColumn = [f64; BLOCK];

/// Rows of the small matrix that are worked on together: what sixteen registers hold with room for their factors.
const TILE: usize = 4;

/// A small matrix and the columns that it is multiplied by.
#[derive(Clone, Copy)]
pub(super) struct LaneProduct<'a> {
    /// Added to each row of the product; zero where it is empty.
    pub biases: &'a [f64],
    /// The matrix, column after column.
    pub weights: &'a [f64],
    pub columns: &'a [BlockColumn],
    /// Rows of each column to work on.
    pub length: usize,
}

impl LaneProduct<'_> {
    /// Writes `out[m] = biases[m] + sum_k weights[m, k] columns[k]`, summed in this order.
    #[inline(always)]
    pub fn write<S: Simd>(&self, simd: S, out: &mut [BlockColumn]) {
        let (mut m, count) = (0, out.len());
        while m < count {
            match count - m {
                1 => self.tile::<S, 1>(simd, m, out),
                2 => self.tile::<S, 2>(simd, m, out),
                3 => self.tile::<S, 3>(simd, m, out),
                _ => self.tile::<S, TILE>(simd, m, out),
            }
            m += TILE;
        }
    }

    /// `M` columns of the product from `first` on.
    #[inline(always)]
    fn tile<S: Simd, const M: usize>(&self, simd: S, first: usize, out: &mut [BlockColumn]) {
        let vectors = LANES / S::F64_LANES;
        let mut start = [simd.splat_f64s(0.0); M];
        for (start, bias) in start.iter_mut().zip(self.biases.iter().skip(first)) {
            *start = simd.splat_f64s(*bias);
        }
        let count = out.len();
        let Some(out) = out[first..].first_chunk_mut::<M>() else {
            return;
        };
        for row in (0..self.length).step_by(LANES) {
            // Only the first `vectors` of each are used, a number that is known when this is compiled for a machine.
            let mut sums = start.map(|start| [start; LANES]);
            for (weights, column) in self.weights.chunks_exact(count).zip(self.columns) {
                let Some(weights) = weights[first..].first_chunk::<M>() else {
                    return;
                };
                let column = S::as_simd_f64s(&column[row..row + LANES]).0;
                for (sums, weight) in sums.iter_mut().zip(weights) {
                    let weight = simd.splat_f64s(*weight);
                    for v in 0..vectors {
                        sums[v] = simd.add_f64s(sums[v], simd.mul_f64s(weight, column[v]));
                    }
                }
            }
            for (out, sums) in out.iter_mut().zip(&sums) {
                S::as_mut_simd_f64s(&mut out[row..row + LANES])
                    .0
                    .copy_from_slice(&sums[..vectors]);
            }
        }
    }
}

/// `a . b`: element `i` goes to partial sum `i % LANES`, and these are added by halves.
#[inline(always)]
pub(super) fn dot<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let vectors = LANES / S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); LANES];
    let (a, b) = (S::as_simd_f64s(a).0, S::as_simd_f64s(b).0);
    for (a, b) in a.chunks_exact(vectors).zip(b.chunks_exact(vectors)) {
        for v in 0..vectors {
            sums[v] = simd.add_f64s(sums[v], simd.mul_f64s(a[v], b[v]));
        }
    }
    by_halves::<S>(&sums[..vectors])
}

/// The sum of `a` in the order of [`dot`].
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, a: &[f64]) -> f64 {
    let vectors = LANES / S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); LANES];
    for a in S::as_simd_f64s(a).0.chunks_exact(vectors) {
        for v in 0..vectors {
            sums[v] = simd.add_f64s(sums[v], a[v]);
        }
    }
    by_halves::<S>(&sums[..vectors])
}

#[inline(always)]
fn by_halves<S: Simd>(sums: &[S::f64s]) -> f64 {
    let mut lanes = [0.0; LANES];
    S::as_mut_simd_f64s(&mut lanes).0.copy_from_slice(sums);
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

//! One comparison carried through: every pair of cells judged, the statistics of the differences, the worst rows.

use arrow::array::{Array, ArrayRef, AsArray, Float64Array, Int64Array, LargeStringArray};
use arrow::compute::{cast, kernels::cmp::distinct};
use arrow::datatypes::{DataType, Float64Type, Int64Type};
use std::sync::atomic::{AtomicU8, Ordering};

use super::columns::{ColumnPair, Comparator};
use super::key::{NONE, Pairing};
use super::source::{TableFile, bug, texts_of};
use super::{ColumnDiff, DifferenceStatistics};
use crate::error::Result;

/// Class of a row of A; the greatest of its cells counts.
pub(super) const SAME: u8 = 0;
pub(super) const WITHIN: u8 = 1;
pub(super) const CHANGED: u8 = 2;

/// A pair of cells that are not the same.
#[derive(Debug, Clone)]
pub(super) struct CellDifference {
    pub(crate) row: u32,
    pub(crate) changed: bool,
    pub(crate) a: CellValue,
    pub(crate) b: CellValue,
    /// B minus A in A's unit; null where one of them has no finite number.
    pub(crate) difference: Option<f64>,
    pub(crate) sigmas: Option<f64>,
    /// Differences over tolerance, or sigmas: what the worst are ranked by.
    pub(crate) score: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum CellValue {
    Null,
    Number(f64),
    Text(String),
}

/// Two files side by side: which rows are paired, and the class of every row of A.
#[derive(Clone, Copy)]
pub(super) struct ComparedTables<'d> {
    pub(crate) a: &'d TableFile,
    pub(crate) b: &'d TableFile,
    pub(crate) pairing: &'d Pairing,
    pub(crate) rows: &'d [AtomicU8],
}

impl ComparedTables<'_> {
    /// Places of the rows of a batch of A that have a partner.
    fn paired(&self, start: usize, count: usize) -> impl Iterator<Item = usize> {
        let partners = &self.pairing.partner[start..start + count];
        (0..count).filter(move |at| partners[*at] != NONE)
    }
}

/// Judges a comparison; `sees` is told of every pair of cells that are not the same, in the order of A.
pub(super) fn measure(
    files: ComparedTables,
    comparison: &ColumnPair,
    sees: &mut Seer,
) -> Result<ColumnDiff> {
    let mut tally = DifferenceSums {
        mixed: comparison.unit == "row",
        ..DifferenceSums::default()
    };
    if comparison.how == Comparator::Text {
        texts(files, comparison, &mut tally, sees)?;
    } else {
        numbers(files, comparison, &mut tally, sees)?;
    }
    Ok(tally.finish(comparison))
}

type Seer<'s> = dyn FnMut(&CellDifference) -> Result<()> + 's;

fn numbers(
    files: ComparedTables,
    comparison: &ColumnPair,
    tally: &mut DifferenceSums,
    sees: &mut Seer,
) -> Result<()> {
    let (sigma_a, sigma_b) = comparison.sigma.unzip();
    let columns = |numbers: &[usize], sigma: Option<usize>| -> Vec<usize> {
        numbers.iter().copied().chain(sigma).collect()
    };
    let theirs = columns(&comparison.b, sigma_b)
        .into_iter()
        .map(|column| files.b.whole(column))
        .collect::<Result<Vec<_>>>()?;
    let mut start = 0;
    for batch in files.a.stream(&columns(&comparison.a, sigma_a))? {
        let batch = batch?;
        let rows = batch[0].len();
        let theirs = theirs
            .iter()
            .map(|cells| files.pairing.aligned(cells, start, rows))
            .collect::<Result<Vec<_>>>()?;
        let pairs = NumberPairs {
            comparison,
            a: Numbers::of(batch, (1.0, 0.0), comparison.a.len())?,
            b: Numbers::of(theirs, comparison.conversion, comparison.a.len())?,
        };
        for at in files.paired(start, rows) {
            if let Some(cell) = pairs.cell(start, at, tally) {
                judge(&cell, files.rows, tally);
                sees(&cell)?;
            }
        }
        start += rows;
    }
    Ok(())
}

/// Columns of one file: those of the comparison, and last that of sigmas, where there is one.
struct Numbers {
    numbers: Vec<Float64Array>,
    /// The first column, of whole numbers: beyond 2^53 these differ where their nearest f64 does not.
    whole: Option<Int64Array>,
}

impl Numbers {
    /// The first `size` columns are converted.
    fn of(cells: Vec<ArrayRef>, (scale, shift): (f64, f64), size: usize) -> Result<Self> {
        let number = |(column, cells): (usize, &ArrayRef)| {
            let numbers = cast(cells, &DataType::Float64).map_err(bug)?;
            let numbers = numbers.as_primitive::<Float64Type>();
            Ok(if column < size && (scale, shift) != (1.0, 0.0) {
                numbers.unary(|number| number * scale + shift)
            } else {
                numbers.clone()
            })
        };
        Ok(Self {
            numbers: cells
                .iter()
                .enumerate()
                .map(number)
                .collect::<Result<Vec<_>>>()?,
            whole: cells[0].as_primitive_opt::<Int64Type>().cloned(),
        })
    }

    fn is_null(&self, size: usize, at: usize) -> bool {
        self.numbers[..size].iter().any(|cells| cells.is_null(at))
    }
}

/// Rows of A, and their partners in the same places.
struct NumberPairs<'c> {
    comparison: &'c ColumnPair,
    a: Numbers,
    b: Numbers,
}

impl NumberPairs<'_> {
    /// What a pair shows; none where both are the same.
    fn cell(&self, start: usize, at: usize, tally: &mut DifferenceSums) -> Option<CellDifference> {
        let (comparison, size) = (self.comparison, self.comparison.a.len());
        let (null_a, null_b) = (self.a.is_null(size, at), self.b.is_null(size, at));
        let difference = match (null_a, null_b) {
            (true, true) => return None,
            (false, false) => {
                tally.pairs += 1;
                self.difference(at)?
            }
            _ => f64::NAN,
        };
        let (left, right) = (self.a.numbers[0].value(at), self.b.numbers[0].value(at));
        let value = |null: bool, value: f64| match null {
            true => CellValue::Null,
            false => CellValue::Number(value),
        };
        let largest = if size == 1 {
            left.abs().max(right.abs())
        } else {
            0.0
        };
        let allowed = comparison.atol + comparison.rtol * largest;
        let finite = difference.is_finite();
        let sigmas = self
            .sigma(size, at)
            .filter(|_| finite)
            .map(|sigma| difference.abs() / sigma);
        Some(CellDifference {
            row: (start + at) as u32,
            changed: !(finite && difference.abs() <= allowed),
            a: value(null_a, left),
            b: value(null_b, right),
            difference: finite.then_some(difference),
            sigmas,
            score: score(difference, allowed, sigmas, largest),
        })
    }

    /// B minus A; none where both are the same, as rotations are whose quaternions differ in sign.
    fn difference(&self, at: usize) -> Option<f64> {
        let comparison = self.comparison;
        let cells = |source: &Numbers| -> Vec<f64> {
            let numbers = &source.numbers[..comparison.a.len()];
            numbers.iter().map(|cells| cells.value(at)).collect()
        };
        let difference = if comparison.a.len() == 1 {
            let (left, right) = (self.a.numbers[0].value(at), self.b.numbers[0].value(at));
            let whole = self.a.whole.as_ref().zip(self.b.whole.as_ref());
            let whole = whole.map(|(left, right)| {
                (i128::from(right.value(at)) - i128::from(left.value(at))) as f64
            });
            if (left == right && whole.unwrap_or(0.0) == 0.0) || (left.is_nan() && right.is_nan()) {
                return None;
            }
            whole
                .filter(|_| comparison.conversion == (1.0, 0.0))
                .unwrap_or_else(|| one(comparison.how, right - left))
        } else {
            let (left, right) = (cells(&self.a), cells(&self.b));
            if left == right {
                return None;
            }
            rotation(comparison.how, &left, &right)
        };
        (difference != 0.0).then_some(difference)
    }

    /// The sigma of both, where both have one above zero.
    fn sigma(&self, size: usize, at: usize) -> Option<f64> {
        let (ours, theirs) = (self.a.numbers.get(size)?, self.b.numbers.get(size)?);
        let null = ours.is_null(at) || theirs.is_null(at);
        let both = ((ours.value(at).powi(2) + theirs.value(at).powi(2)) / 2.0).sqrt();
        (!null && both > 0.0).then_some(both)
    }
}

/// What a difference is worth: sigmas where they are known, else times the tolerance, else relative to what is representable.
fn score(difference: f64, allowed: f64, sigmas: Option<f64>, largest: f64) -> f64 {
    match sigmas {
        _ if !difference.is_finite() => f64::MAX,
        Some(sigmas) => sigmas,
        None if allowed > 0.0 => difference.abs() / allowed,
        None => difference.abs() / (1e-9 * largest).max(f64::MIN_POSITIVE),
    }
}

fn one(how: Comparator, difference: f64) -> f64 {
    match how {
        Comparator::Angle(turn) => difference - turn * (difference / turn).round(),
        _ => difference,
    }
}

/// The angle of the rotation from `left` to `right`, rad.
fn rotation(how: Comparator, left: &[f64], right: &[f64]) -> f64 {
    let quaternion = |cells: &[f64]| match how {
        Comparator::RotationVector(factor) => {
            let v = [cells[0] * factor, cells[1] * factor, cells[2] * factor];
            let angle = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            // sin(x/2)/x is 1/2 within f64 below this.
            let ratio = if angle < 1e-9 {
                0.5
            } else {
                (angle / 2.0).sin() / angle
            };
            [
                (angle / 2.0).cos(),
                v[0] * ratio,
                v[1] * ratio,
                v[2] * ratio,
            ]
        }
        _ => [cells[0], cells[1], cells[2], cells[3]],
    };
    let (l, r) = (quaternion(left), quaternion(right));
    let dot: f64 = l.iter().zip(&r).map(|(l, r)| l * r).sum();
    // conj(l) * r: its vector part is exact for small rotations, where the cosine is not.
    let vector = [
        l[0] * r[1] - l[1] * r[0] - l[2] * r[3] + l[3] * r[2],
        l[0] * r[2] - l[2] * r[0] - l[3] * r[1] + l[1] * r[3],
        l[0] * r[3] - l[3] * r[0] - l[1] * r[2] + l[2] * r[1],
    ];
    let sine = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    if sine == 0.0 && dot == 0.0 {
        f64::NAN
    } else {
        2.0 * sine.atan2(dot.abs())
    }
}

fn texts(
    files: ComparedTables,
    comparison: &ColumnPair,
    tally: &mut DifferenceSums,
    sees: &mut Seer,
) -> Result<()> {
    let theirs = files.b.whole_text(comparison.b[0])?;
    let mut start = 0;
    for batch in files.a.stream(&comparison.a)? {
        let ours = texts_of(&batch?[0])?;
        let theirs = files.pairing.aligned(&theirs, start, ours.len())?;
        let theirs = theirs.as_string::<i64>();
        let differ = distinct(&ours, theirs).map_err(bug)?;
        for at in files.paired(start, ours.len()) {
            let text = |cells: &LargeStringArray| match cells.is_null(at) {
                true => CellValue::Null,
                false => CellValue::Text(cells.value(at).into()),
            };
            tally.pairs += u64::from(!ours.is_null(at) && !theirs.is_null(at));
            if !differ.value(at) {
                continue;
            }
            let cell = CellDifference {
                row: (start + at) as u32,
                changed: true,
                a: text(&ours),
                b: text(theirs),
                difference: None,
                sigmas: None,
                // Below every number beyond its tolerance: those say by how much.
                score: 1.0,
            };
            judge(&cell, files.rows, tally);
            sees(&cell)?;
        }
        start += ours.len();
    }
    Ok(())
}

fn judge(cell: &CellDifference, rows: &[AtomicU8], tally: &mut DifferenceSums) {
    rows[cell.row as usize].fetch_max(
        if cell.changed { CHANGED } else { WITHIN },
        Ordering::Relaxed,
    );
    tally.add(cell);
}

/// Sums over the pairs of a column.
#[derive(Default)]
struct DifferenceSums {
    pairs: u64,
    within: u64,
    changed: u64,
    sum: f64,
    squares: f64,
    sigma_squares: f64,
    sigma_count: u64,
    /// Sizes of the differences that are not nought.
    sizes: Vec<f64>,
    worst: Option<(f64, u32)>,
    worst_sigmas: Option<f64>,
    mixed: bool,
}

impl DifferenceSums {
    fn add(&mut self, cell: &CellDifference) {
        *(if cell.changed {
            &mut self.changed
        } else {
            &mut self.within
        }) += 1;
        if let Some(sigmas) = cell.sigmas {
            self.sigma_squares += sigmas * sigmas;
            self.sigma_count += 1;
            self.worst_sigmas = Some(self.worst_sigmas.map_or(sigmas, |worst| worst.max(sigmas)));
        }
        let Some(difference) = cell.difference else {
            return;
        };
        self.sum += difference;
        self.squares += difference * difference;
        self.sizes.push(difference.abs());
        let rank = if self.mixed {
            cell.score
        } else {
            difference.abs()
        };
        if self.worst.is_none_or(|(worst, _)| rank > worst) {
            self.worst = Some((rank, cell.row));
        }
    }

    fn finish(mut self, comparison: &ColumnPair) -> ColumnDiff {
        let pairs = self.pairs as f64;
        let statistics = (self.pairs > 0 && comparison.how != Comparator::Text && !self.mixed)
            .then(|| DifferenceStatistics {
                max: self.sizes.iter().copied().fold(0.0, f64::max),
                rms: (self.squares / pairs).sqrt(),
                bias: self.sum / pairs,
                p95: percentile(&mut self.sizes, self.pairs, 0.95),
            });
        ColumnDiff {
            name: comparison.name.clone(),
            unit: comparison.unit.clone(),
            pairs: self.pairs,
            within: self.within,
            changed: self.changed,
            atol: comparison.atol,
            rtol: comparison.rtol,
            statistics,
            max_sigmas: self.worst_sigmas,
            rms_sigmas: (self.sigma_count > 0)
                .then(|| (self.sigma_squares / pairs.max(1.0)).sqrt()),
            worst_row: self.worst.map(|(_, row)| row),
            worst_key: None,
        }
    }
}

/// The smallest size that at least this part of all pairs does not exceed; pairs beyond the sizes given have none.
fn percentile(sizes: &mut [f64], pairs: u64, part: f64) -> f64 {
    let rank = (part * pairs as f64).ceil() as u64;
    let noughts = pairs - sizes.len() as u64;
    if rank <= noughts {
        return 0.0;
    }
    let at = usize::try_from(rank - noughts - 1)
        .unwrap_or(usize::MAX)
        .min(sizes.len().saturating_sub(1));
    *sizes.select_nth_unstable_by(at, f64::total_cmp).1
}

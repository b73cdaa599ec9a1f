//! One comparison carried through: every pair of cells judged, the statistics of the differences, the worst rows.

use arrow::array::{Array, ArrayRef, AsArray};
use arrow::datatypes::Int64Type;
use std::sync::atomic::{AtomicU8, Ordering};

use super::columns::{ColumnPair, Comparator};
use super::key::{NONE, Pairing};
use super::source::{CellKind, TableFile, push_numbers};
use super::{ColumnDiff, DifferenceStatistics};
use crate::error::Result;

/// Class of a row of A; the greatest of its cells counts.
pub(super) const SAME: u8 = 0;
pub(super) const WITHIN: u8 = 1;
pub(super) const CHANGED: u8 = 2;

/// A pair of cells that are not the same.
#[derive(Debug, Clone)]
pub(super) struct CellDifference {
    /// The row of A.
    pub row: u32,
    pub changed: bool,
    pub a: CellValue,
    pub b: CellValue,
    /// B minus A in A's unit; null where one of them has no finite number.
    pub difference: Option<f64>,
    pub sigmas: Option<f64>,
    /// Differences over tolerance, or sigmas: what the worst are ranked by.
    pub score: f64,
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
    pub a: &'d TableFile,
    pub b: &'d TableFile,
    pub pairing: &'d Pairing,
    pub rows: &'d [AtomicU8],
}

/// Judges a comparison; `sees` is told of every pair of cells that are not the same, in the order of A.
pub(super) fn measure(
    files: ComparedTables,
    comparison: &ColumnPair,
    sees: &mut Seer,
) -> Result<ColumnDiff> {
    let mut tally = DifferenceSums::new(comparison);
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
    let ComparedTables {
        a,
        b,
        pairing,
        rows,
    } = files;
    let size = comparison.a.len();
    let theirs = Theirs::read(a, b, comparison)?;
    let mut wanted = comparison.a.clone();
    wanted.extend(comparison.sigma.map(|(column, _)| column));
    let mut start = 0;
    let mut ours: Vec<Vec<f64>> = vec![Vec::new(); wanted.len()];
    let mut beside: Vec<Vec<f64>> = vec![Vec::new(); size];
    let no_null_there = theirs.columns.iter().all(|(_, nulls)| nulls.is_empty());
    for batch in a.stream(&wanted)? {
        let batch = batch?;
        for (values, array) in ours.iter_mut().zip(&batch) {
            values.clear();
            push_numbers(array, values);
        }
        for (values, (theirs, _)) in beside.iter_mut().zip(&theirs.columns) {
            pairing.beside(theirs, start, batch[0].len(), values);
        }
        let plain =
            size == 1 && theirs.integers.is_none() && no_null_there && batch[0].null_count() == 0;
        for at in 0..batch[0].len() {
            let partner = pairing.partner(start + at);
            if partner == NONE {
                continue;
            }
            if plain && ours[0][at] == beside[0][at] {
                tally.pairs += 1;
                continue;
            }
            let pair = Pair {
                batch: &batch,
                ours: &ours,
                beside: &beside,
                at,
                partner: partner as usize,
            };
            if let Some(cell) = theirs.cell(comparison, &pair, start + at, tally) {
                judge(&cell, rows, tally);
                sees(&cell)?;
            }
        }
        start += batch[0].len();
    }
    Ok(())
}

/// B's columns of a comparison, in A's unit, each with its nulls (empty where there are none).
struct Theirs {
    columns: Vec<(Vec<f64>, Vec<bool>)>,
    /// Where both are whole numbers: beyond 2^53 these differ where their nearest f64 does not.
    integers: Option<Vec<i64>>,
    sigma: Option<(Vec<f64>, Vec<bool>)>,
}

/// A row of A and its partner.
struct Pair<'p> {
    /// The columns of A, and their numbers, with the column of sigmas last where there is one.
    batch: &'p [ArrayRef],
    ours: &'p [Vec<f64>],
    /// B's numbers, in the order of A.
    beside: &'p [Vec<f64>],
    /// In the batch.
    at: usize,
    /// In B.
    partner: usize,
}

fn is_null(nulls: &[bool], row: usize) -> bool {
    nulls.get(row).copied().unwrap_or(false)
}

impl Theirs {
    fn read(a: &TableFile, b: &TableFile, comparison: &ColumnPair) -> Result<Self> {
        let mut columns = comparison
            .b
            .iter()
            .map(|&column| b.numbers(column))
            .collect::<Result<Vec<_>>>()?;
        let (scale, shift) = comparison.conversion;
        if comparison.conversion != (1.0, 0.0) {
            columns
                .iter_mut()
                .flat_map(|(values, _)| values)
                .for_each(|value| *value = *value * scale + shift);
        }
        let whole = comparison.a.len() == 1
            && a.columns[comparison.a[0]].kind == CellKind::Int
            && b.columns[comparison.b[0]].kind == CellKind::Int;
        let integers = whole.then(|| b.integers(comparison.b[0])).transpose()?;
        let sigma = comparison
            .sigma
            .map(|(_, column)| b.numbers(column))
            .transpose()?;
        Ok(Self {
            columns,
            integers,
            sigma,
        })
    }

    /// What a pair shows; none where both are the same.
    fn cell(
        &self,
        comparison: &ColumnPair,
        pair: &Pair,
        row: usize,
        tally: &mut DifferenceSums,
    ) -> Option<CellDifference> {
        let size = comparison.a.len();
        let null_a = pair.batch[..size]
            .iter()
            .any(|array| array.is_null(pair.at));
        let null_b = self
            .columns
            .iter()
            .any(|(_, nulls)| is_null(nulls, pair.partner));
        let difference = match (null_a, null_b) {
            (true, true) => return None,
            (false, false) => {
                tally.pairs += 1;
                self.difference(comparison, pair)?
            }
            _ => f64::NAN,
        };
        let (left, right) = (pair.ours[0][pair.at], pair.beside[0][pair.at]);
        let value = |null: bool, value: f64| {
            if null {
                CellValue::Null
            } else {
                CellValue::Number(value)
            }
        };
        let largest = if size == 1 {
            left.abs().max(right.abs())
        } else {
            0.0
        };
        let allowed = comparison.atol + comparison.rtol * largest;
        let finite = difference.is_finite();
        let sigmas = self
            .sigma(size, pair)
            .filter(|_| finite)
            .map(|sigma| difference.abs() / sigma);
        Some(CellDifference {
            row: row as u32,
            changed: !(finite && difference.abs() <= allowed),
            a: value(null_a, left),
            b: value(null_b, right),
            difference: finite.then_some(difference),
            sigmas,
            score: score(difference, allowed, sigmas, largest),
        })
    }

    /// Theirs minus ours; none where both are the same, as rotations are whose quaternions differ in sign.
    fn difference(&self, comparison: &ColumnPair, pair: &Pair) -> Option<f64> {
        let difference = if comparison.a.len() == 1 {
            let (left, right) = (pair.ours[0][pair.at], pair.beside[0][pair.at]);
            let whole = self
                .integers
                .as_ref()
                .map(|theirs| apart(&pair.batch[0], pair.at, theirs[pair.partner]));
            if (left == right && whole.unwrap_or(0.0) == 0.0) || (left.is_nan() && right.is_nan()) {
                return None;
            }
            whole
                .filter(|_| comparison.conversion == (1.0, 0.0))
                .unwrap_or_else(|| one(comparison.how, right - left))
        } else {
            let left: Vec<f64> = pair.ours[..comparison.a.len()]
                .iter()
                .map(|values| values[pair.at])
                .collect();
            let right: Vec<f64> = pair.beside.iter().map(|values| values[pair.at]).collect();
            if left == right {
                return None;
            }
            rotation(comparison.how, &left, &right)
        };
        (difference != 0.0).then_some(difference)
    }

    /// The sigma of both, where both have one above zero.
    fn sigma(&self, size: usize, pair: &Pair) -> Option<f64> {
        let (values, nulls) = self.sigma.as_ref()?;
        let (ours, theirs) = (pair.ours[size][pair.at], values[pair.partner]);
        let null = pair.batch[size].is_null(pair.at) || is_null(nulls, pair.partner);
        let both = ((ours * ours + theirs * theirs) / 2.0).sqrt();
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

/// Theirs minus ours, of whole numbers.
fn apart(ours: &ArrayRef, at: usize, theirs: i64) -> f64 {
    (i128::from(theirs) - i128::from(ours.as_primitive::<Int64Type>().value(at))) as f64
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
    let ComparedTables {
        a,
        b,
        pairing,
        rows,
    } = files;
    let (column_a, column_b) = (comparison.a[0], comparison.b[0]);
    let mut bytes = String::new();
    let mut ends: Vec<(usize, bool)> = Vec::with_capacity(b.rows);
    for batch in b.stream(&[column_b])? {
        let array = batch?.swap_remove(0);
        for row in 0..array.len() {
            text(&array, b.columns[column_b].kind, row).inspect(|text| bytes.push_str(text));
            ends.push((bytes.len(), array.is_null(row)));
        }
    }
    let mut start = 0;
    for batch in a.stream(&[column_a])? {
        let array = batch?.swap_remove(0);
        for at in 0..array.len() {
            let partner = pairing.partner(start + at);
            if partner == NONE {
                continue;
            }
            let partner = partner as usize;
            let (end, null) = ends[partner];
            let begin = if partner == 0 { 0 } else { ends[partner - 1].0 };
            let left = text(&array, a.columns[column_a].kind, at);
            let right = (!null).then(|| &bytes[begin..end]);
            tally.pairs += u64::from(left.is_some() && right.is_some());
            if left.as_deref() == right {
                continue;
            }
            let value = |text: Option<&str>| {
                text.map_or(CellValue::Null, |text| CellValue::Text(text.into()))
            };
            let cell = CellDifference {
                row: (start + at) as u32,
                changed: true,
                a: value(left.as_deref()),
                b: value(right),
                difference: None,
                sigmas: None,
                // Below every number beyond its tolerance: those say by how much.
                score: 1.0,
            };
            judge(&cell, rows, tally);
            sees(&cell)?;
        }
        start += array.len();
    }
    Ok(())
}

fn text(array: &ArrayRef, kind: CellKind, row: usize) -> Option<std::borrow::Cow<'_, str>> {
    if array.is_null(row) {
        return None;
    }
    if kind == CellKind::Text {
        return Some(array.as_string::<i32>().value(row).into());
    }
    let mut numbers = Vec::with_capacity(1);
    push_numbers(&array.slice(row, 1), &mut numbers);
    Some(
        numbers
            .first()
            .map(f64::to_string)
            .unwrap_or_default()
            .into(),
    )
}

fn judge(cell: &CellDifference, rows: &[AtomicU8], tally: &mut DifferenceSums) {
    rows[cell.row as usize].fetch_max(
        if cell.changed { CHANGED } else { WITHIN },
        Ordering::Relaxed,
    );
    tally.add(cell);
}

/// Sums over the pairs of a column.
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
    fn new(comparison: &ColumnPair) -> Self {
        Self {
            pairs: 0,
            within: 0,
            changed: 0,
            sum: 0.0,
            squares: 0.0,
            sigma_squares: 0.0,
            sigma_count: 0,
            sizes: Vec::new(),
            worst: None,
            worst_sigmas: None,
            mixed: comparison.unit == "row",
        }
    }

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

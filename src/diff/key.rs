//! Rows by their key: which row of B is the row of A, and which have no partner or several.

use arrow::array::{Array, ArrayRef, AsArray, UInt32Array};
use arrow::compute::{cast, take};
use arrow::datatypes::{DataType, Float64Type, Int64Type};
use arrow::error::ArrowError;
use arrow::row::{RowConverter, Rows, SortField};
use rayon::slice::ParallelSliceMut;
use std::cmp::Ordering;
use std::sync::Arc;

use super::source::{CellKind, TableFile, bug};
use crate::error::{Error, Result};

/// No partner.
pub(super) const NONE: u32 = u32::MAX;

/// The keys of one file.
pub(super) struct Keys {
    names: Vec<String>,
    converter: Arc<RowConverter>,
    rows: Rows,
}

/// Rows of A with their partners in B, and rows without.
#[derive(Debug, Default)]
pub(super) struct Pairing {
    /// By row of A.
    pub(crate) partner: Vec<u32>,
    /// Every row has the partner of its number.
    in_place: bool,
    pub(crate) paired: usize,
    pub(crate) only_a: Vec<u32>,
    pub(crate) only_b: Vec<u32>,
    /// Rows whose key occurs more than once in A or in B, and that were not paired.
    pub(crate) twice_a: Vec<u32>,
    pub(crate) twice_b: Vec<u32>,
    /// How many keys occur more than once.
    pub(crate) keys_twice: usize,
}

impl Pairing {
    /// The cells of B that belong to `count` rows of A from `start` on; null where a row has no partner.
    pub(crate) fn aligned(
        &self,
        theirs: &ArrayRef,
        start: usize,
        count: usize,
    ) -> Result<ArrayRef> {
        if self.in_place {
            return Ok(theirs.slice(start, count));
        }
        let partners = self.partner[start..start + count].iter();
        let partners: UInt32Array = partners
            .map(|partner| (*partner != NONE).then_some(*partner))
            .collect();
        take(theirs, &partners, None).map_err(bug)
    }
}

impl Keys {
    /// Reads the key columns of both files.
    pub fn read(a: &TableFile, b: &TableFile, names: &[String]) -> Result<(Self, Self)> {
        let mut types = Vec::new();
        for name in names {
            let [ours, theirs] = [
                &a.columns[a.key_column(name)?],
                &b.columns[b.key_column(name)?],
            ];
            let either = |kind: CellKind| ours.kind == kind || theirs.kind == kind;
            if (ours.kind == CellKind::Text) != (theirs.kind == CellKind::Text) {
                let message = format!("is {} in A and {} in B", ours.stored, theirs.stored);
                return Err(Error::spec(format!("key column {name}"), message));
            }
            types.push(match () {
                () if either(CellKind::Text) => DataType::Utf8,
                () if either(CellKind::Float) => DataType::Float64,
                () => DataType::Int64,
            });
        }
        let fields = types.iter().cloned().map(SortField::new).collect();
        let converter = Arc::new(RowConverter::new(fields).map_err(bug)?);
        let of_source = |source: &TableFile| -> Result<Self> {
            let mut rows = converter.empty_rows(source.rows, 0);
            let columns = names
                .iter()
                .map(|name| source.key_column(name))
                .collect::<Result<Vec<_>>>()?;
            for batch in source.stream(&columns)? {
                let batch = batch?;
                if let Some(at) = batch.iter().position(|cells| cells.null_count() > 0) {
                    let message = format!(
                        "key column {} has nulls; name another key with --key",
                        names[at]
                    );
                    return Err(Error::spec(source.path.display().to_string(), message));
                }
                let cells = batch
                    .iter()
                    .zip(&types)
                    .map(|(cells, kind)| key_cells(cells, kind));
                let cells = cells.collect::<Result<Vec<_>, _>>().map_err(bug)?;
                converter.append(&mut rows, &cells).map_err(bug)?;
            }
            Ok(Self {
                names: names.to_vec(),
                converter: converter.clone(),
                rows,
            })
        };
        let (left, right) = rayon::join(|| of_source(a), || of_source(b));
        Ok((left?, right?))
    }

    /// The key columns of some rows.
    pub fn columns(&self, rows: &[u32]) -> Result<Vec<ArrayRef>> {
        let rows = rows.iter().map(|row| self.rows.row(*row as usize));
        self.converter.convert_rows(rows).map_err(bug)
    }

    /// `robot r1, pose 17`, of every row.
    pub(crate) fn texts(&self, rows: &[u32]) -> Result<Vec<String>> {
        let columns = self.columns(rows)?;
        let cell = |cells: &ArrayRef, row: usize| match cells.data_type() {
            DataType::Utf8 => cells.as_string::<i32>().value(row).to_string(),
            DataType::Int64 => cells.as_primitive::<Int64Type>().value(row).to_string(),
            _ => cells.as_primitive::<Float64Type>().value(row).to_string(),
        };
        let text = |row: usize| {
            let cells = self.names.iter().zip(&columns);
            let cells = cells.map(|(name, cells)| format!("{name} {}", cell(cells, row)));
            cells.collect::<Vec<_>>().join(", ")
        };
        Ok((0..rows.len()).map(text).collect())
    }

    /// The first of the rows whose keys differ from that before them.
    pub(crate) fn distinct(&self, rows: &[u32], most: usize) -> Vec<u32> {
        let mut distinct: Vec<u32> = Vec::new();
        for &row in rows {
            let key = |row: u32| self.rows.row(row as usize);
            if distinct.last().is_none_or(|last| key(*last) != key(row)) {
                distinct.push(row);
            }
            if distinct.len() == most {
                break;
            }
        }
        distinct
    }
}

fn key_cells(cells: &ArrayRef, kind: &DataType) -> Result<ArrayRef, ArrowError> {
    let cells = cast(cells, kind)?;
    Ok(match kind {
        // -0 is 0.
        DataType::Float64 => Arc::new(
            cells
                .as_primitive::<Float64Type>()
                .unary::<_, Float64Type>(|value| value + 0.0),
        ),
        _ => cells,
    })
}

/// The rows of a file in the order of their keys, equal keys in the order of the rows.
struct Sorted<'k> {
    rows: &'k Rows,
    /// Missing where they are stored so.
    order: Option<Vec<u32>>,
}

impl<'k> Sorted<'k> {
    fn of(rows: &'k Rows) -> Self {
        let ascends = (1..rows.num_rows()).all(|row| rows.row(row - 1) <= rows.row(row));
        let sorted = || {
            // With the keys' first bytes, since going to the key of each row would cost more than the sort.
            let first = |row: u32| {
                let (mut bytes, key) = ([0; 16], rows.row(row as usize));
                let most = key.as_ref().len().min(16);
                bytes[..most].copy_from_slice(&key.as_ref()[..most]);
                (u128::from_be_bytes(bytes), row)
            };
            let mut order: Vec<(u128, u32)> = (0..rows.num_rows() as u32).map(first).collect();
            order.par_sort_unstable_by(|(left, l), (right, r)| {
                let whole = || rows.row(*l as usize).cmp(&rows.row(*r as usize));
                left.cmp(right).then_with(whole).then(l.cmp(r))
            });
            order.into_iter().map(|(_, row)| row).collect()
        };
        Self {
            rows,
            order: (!ascends).then(sorted),
        }
    }

    fn len(&self) -> usize {
        self.rows.num_rows()
    }

    /// The row at a place of the order.
    fn row(&self, at: usize) -> usize {
        self.order.as_ref().map_or(at, |order| order[at] as usize)
    }

    fn compare(&self, at: usize, other: &Self, other_at: usize) -> Ordering {
        let (row, other_row) = (self.row(at), other.row(other_at));
        self.rows.row(row).cmp(&other.rows.row(other_row))
    }

    /// How many places from `at` on have its key.
    fn equal_from(&self, at: usize) -> usize {
        let equal = |next: &usize| self.compare(at, self, *next).is_eq();
        1 + (at + 1..self.len()).take_while(equal).count()
    }
}

/// Pairs rows by key. Where `occurrence` is set the first of equal keys is paired with the first, the second with the second.
pub(super) fn pair(a: &Keys, b: &Keys, occurrence: bool) -> Pairing {
    let (a, b) = rayon::join(|| Sorted::of(&a.rows), || Sorted::of(&b.rows));
    let mut pairing = Pairing {
        partner: vec![NONE; a.len()],
        ..Pairing::default()
    };
    let (mut at_a, mut at_b) = (0, 0);
    while at_a < a.len() || at_b < b.len() {
        let order = match (at_a < a.len(), at_b < b.len()) {
            (true, false) => Ordering::Less,
            (false, _) => Ordering::Greater,
            (true, true) => a.compare(at_a, &b, at_b),
        };
        let count_a = if order.is_le() { a.equal_from(at_a) } else { 0 };
        let count_b = if order.is_ge() { b.equal_from(at_b) } else { 0 };
        let twice = count_a > 1 || count_b > 1;
        let apart = twice && !occurrence;
        let paired = if apart { 0 } else { count_a.min(count_b) };
        pairing.keys_twice += usize::from(twice);
        pairing.paired += paired;
        for k in 0..paired {
            pairing.partner[a.row(at_a + k)] = b.row(at_b + k) as u32;
        }
        let (alone_a, alone_b) = if apart {
            (&mut pairing.twice_a, &mut pairing.twice_b)
        } else {
            (&mut pairing.only_a, &mut pairing.only_b)
        };
        alone_a.extend((paired..count_a).map(|k| a.row(at_a + k) as u32));
        alone_b.extend((paired..count_b).map(|k| b.row(at_b + k) as u32));
        (at_a, at_b) = (at_a + count_a, at_b + count_b);
    }
    pairing.in_place = a.len() == b.len() && pairing.partner.iter().copied().eq(0..a.len() as u32);
    pairing
}

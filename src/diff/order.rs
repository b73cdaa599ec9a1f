//! Codes of keys in one number a row where they fit, and rows in the order of the key.

use rayon::iter::{
    IndexedParallelIterator, IntoParallelRefIterator, IntoParallelRefMutIterator, ParallelIterator,
};
use rayon::slice::ParallelSliceMut;
use std::cmp::Ordering;

/// The codes of the key columns of one file.
pub(super) enum Codes {
    /// All columns in one number, the first in the highest bits.
    Packed {
        rows: Vec<u64>,
        fields: Vec<BitField>,
    },
    /// Key columns whose ranges do not fit together into 64 bits.
    Columns(Vec<Vec<u64>>),
}

#[derive(Clone)]
pub(super) struct BitField {
    least: u64,
    shift: u32,
    bits: u32,
}

/// Packs the codes of both files in the same way.
pub(super) fn pack(a: Vec<Vec<u64>>, b: Vec<Vec<u64>>) -> (Codes, Codes) {
    let range = |(left, right): (&Vec<u64>, &Vec<u64>)| {
        let all = || left.par_iter().chain(right.par_iter()).copied();
        let (least, most) = all()
            .map(|code| (code, code))
            .reduce(|| (u64::MAX, 0), |x, y| (x.0.min(y.0), x.1.max(y.1)));
        BitField {
            least,
            shift: 0,
            bits: u64::BITS - most.saturating_sub(least).leading_zeros(),
        }
    };
    let mut fields: Vec<BitField> = a.iter().zip(&b).map(range).collect();
    let mut shift = 0;
    for field in fields.iter_mut().rev() {
        field.shift = shift;
        shift += field.bits;
    }
    if shift > u64::BITS {
        return (Codes::Columns(a), Codes::Columns(b));
    }
    let one = |columns: Vec<Vec<u64>>| {
        let mut rows: Vec<u64> = Vec::new();
        for (codes, field) in columns.into_iter().zip(&fields) {
            let place = |code: u64| (code - field.least).checked_shl(field.shift).unwrap_or(0);
            if rows.is_empty() {
                rows = codes;
                rows.par_iter_mut().for_each(|code| *code = place(*code));
            } else {
                rows.par_iter_mut()
                    .zip(codes.par_iter())
                    .for_each(|(row, code)| *row |= place(*code));
            }
        }
        Codes::Packed {
            rows,
            fields: fields.clone(),
        }
    };
    (one(a), one(b))
}

impl Codes {
    /// The code of a key column in a row.
    pub fn code(&self, row: usize, column: usize) -> u64 {
        match self {
            Self::Packed { rows, fields } => {
                let BitField { least, shift, bits } = fields[column];
                let mask = u64::MAX.checked_shr(u64::BITS - bits).unwrap_or(0);
                least + (rows[row].checked_shr(shift).unwrap_or(0) & mask)
            }
            Self::Columns(columns) => columns[column][row],
        }
    }

    fn rows(&self) -> usize {
        match self {
            Self::Packed { rows, .. } => rows.len(),
            Self::Columns(columns) => columns.first().map_or(0, Vec::len),
        }
    }

    fn compare(&self, row: usize, other: &Self, other_row: usize) -> Ordering {
        match (self, other) {
            (Self::Packed { rows, .. }, Self::Packed { rows: others, .. }) => {
                rows[row].cmp(&others[other_row])
            }
            (Self::Columns(columns), Self::Columns(others)) => {
                let order =
                    |(left, right): (&Vec<u64>, &Vec<u64>)| left[row].cmp(&right[other_row]);
                columns
                    .iter()
                    .zip(others)
                    .map(order)
                    .find(|order| order.is_ne())
                    .unwrap_or(Ordering::Equal)
            }
            _ => unreachable!("both files are packed, or neither"),
        }
    }
}

/// The rows of a file in the order of their keys, equal keys in the order of the rows.
pub(super) struct SortedRows<'c> {
    codes: &'c Codes,
    order: Order,
}

enum Order {
    AsStored,
    /// With the keys beside them, since going to the file's rows for each would cost more than the sort.
    Packed(Vec<(u64, u32)>),
    Rows(Vec<u32>),
}

impl<'c> SortedRows<'c> {
    pub fn of(codes: &'c Codes) -> Self {
        let rows = codes.rows();
        let order = if (1..rows).all(|row| codes.compare(row - 1, codes, row).is_le()) {
            Order::AsStored
        } else if let Codes::Packed { rows, .. } = codes {
            let mut order: Vec<(u64, u32)> = rows.iter().copied().zip(0..).collect();
            order.par_sort_unstable();
            Order::Packed(order)
        } else {
            let mut order: Vec<u32> = (0..rows as u32).collect();
            order.par_sort_unstable_by(|&l, &r| {
                codes.compare(l as usize, codes, r as usize).then(l.cmp(&r))
            });
            Order::Rows(order)
        };
        Self { codes, order }
    }

    pub fn rows(&self) -> usize {
        self.codes.rows()
    }
    pub fn as_stored(&self) -> bool {
        matches!(self.order, Order::AsStored)
    }

    /// The row at a place of the order.
    pub fn row(&self, at: usize) -> usize {
        match &self.order {
            Order::AsStored => at,
            Order::Packed(order) => order[at].1 as usize,
            Order::Rows(order) => order[at] as usize,
        }
    }

    /// Compares the keys at two places.
    pub fn compare(&self, at: usize, other: &Self, other_at: usize) -> Ordering {
        match (self.packed(at), other.packed(other_at)) {
            (Some(left), Some(right)) => left.cmp(&right),
            _ => self
                .codes
                .compare(self.row(at), other.codes, other.row(other_at)),
        }
    }

    fn packed(&self, at: usize) -> Option<u64> {
        match (&self.order, self.codes) {
            (Order::Packed(order), _) => Some(order[at].0),
            (Order::AsStored, Codes::Packed { rows, .. }) => Some(rows[at]),
            _ => None,
        }
    }

    /// How many places from `at` on have its key.
    pub fn equal_from(&self, at: usize) -> usize {
        (at..self.rows())
            .take_while(|&next| next == at || self.compare(at, self, next).is_eq())
            .count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_codes_come_back_and_order_as_their_columns_do() {
        let widths = [
            [3_u64, 1],
            [1 << 40, 1 << 23],
            [u64::MAX, 1],
            [u64::MAX, u64::MAX],
            [1, u64::MAX],
        ];
        for (case, width) in widths.into_iter().enumerate() {
            let make = |salt: u64| -> Vec<Vec<u64>> {
                let code = |k: u64, n: u64| {
                    n.wrapping_mul(0x9E37_79B9_7F4A_7C15)
                        .rotate_left(29 * k as u32 + 7)
                        .wrapping_add(salt)
                };
                (0..2)
                    .map(|k| {
                        (0..50)
                            .map(|n| code(k as u64, n) % width[k].max(1))
                            .collect()
                    })
                    .collect()
            };
            let (a, b) = (make(1), make(2));
            let (packed_a, packed_b) = pack(a.clone(), b.clone());
            assert_eq!(
                matches!(packed_a, Codes::Columns(_)),
                case == 3,
                "case {case}"
            );
            for (left, right) in (0..50).flat_map(|left| (0..50).map(move |right| (left, right))) {
                assert_eq!(
                    [0, 1].map(|k| packed_a.code(left, k)),
                    [a[0][left], a[1][left]]
                );
                let wanted = (a[0][left], a[1][left]).cmp(&(b[0][right], b[1][right]));
                assert_eq!(
                    packed_a.compare(left, &packed_b, right),
                    wanted,
                    "case {case}"
                );
            }
            let order = SortedRows::of(&packed_a);
            assert!((1..50).all(|at| order.compare(at - 1, &order, at).is_le()));
            let mut rows: Vec<usize> = (0..50).map(|at| order.row(at)).collect();
            rows.sort_unstable();
            assert!(rows.into_iter().eq(0..50));
        }
    }
}

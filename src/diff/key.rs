//! Rows by their key: which row of B is the row of A, and which have no partner or several.
//!
//! Keys become 64-bit codes in key order (texts by their rank among all texts), and the codes of all key columns one where they fit;
//! rows that ascend already are merged as they are, others are sorted first.

use arrow::array::{Array, ArrayRef, AsArray};
use arrow::datatypes::{Float64Type, Int64Type};
use std::cmp::Ordering;
use std::collections::HashMap;
use std::sync::Arc;

use super::order::{Codes, SortedRows, pack};
use super::source::{CellKind, TableFile};
use crate::error::{Error, Result};

/// No partner.
pub(super) const NONE: u32 = u32::MAX;
const SIGN: u64 = 1 << 63;

/// The key columns of one file.
pub(super) struct Keys {
    columns: Vec<KeyColumn>,
    codes: Codes,
}

struct KeyColumn {
    name: String,
    meaning: Meaning,
}

#[derive(Clone)]
enum Meaning {
    Int,
    Float,
    /// Codes are places in this ascending list.
    Text(Arc<Vec<Box<str>>>),
}

/// A cell of a key.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum KeyCell {
    Int(i64),
    Float(f64),
    Text(Box<str>),
}

/// Rows of A with their partners in B, and rows without.
#[derive(Debug)]
pub(super) struct Pairing {
    /// By row of A; empty where every row has the partner of its own number.
    partner: Vec<u32>,
    pub paired: usize,
    pub only_a: Vec<u32>,
    pub only_b: Vec<u32>,
    /// Rows whose key occurs more than once in A or in B, and that were not paired.
    pub twice_a: Vec<u32>,
    pub twice_b: Vec<u32>,
    /// How many keys occur more than once.
    pub keys_twice: usize,
}

impl Pairing {
    pub fn partner(&self, row: usize) -> u32 {
        if self.partner.is_empty() {
            row as u32
        } else {
            self.partner[row]
        }
    }

    /// What stands in B beside `count` rows of A from `start` on; nought where a row has no partner. All are fetched in one go, since
    /// their places in memory are far apart.
    pub fn beside<T: Copy + Default>(
        &self,
        theirs: &[T],
        start: usize,
        count: usize,
        out: &mut Vec<T>,
    ) {
        out.clear();
        let fetch = |at: usize| theirs.get(at).copied().unwrap_or_default();
        match self.partner.get(start..start + count) {
            Some(partners) => out.extend(partners.iter().map(|&partner| fetch(partner as usize))),
            None => out.extend((start..start + count).map(fetch)),
        }
    }
}

impl Keys {
    /// `robot r1, pose 17`.
    pub fn text(&self, row: usize) -> String {
        let part = |(column, cell): (&KeyColumn, KeyCell)| match cell {
            KeyCell::Int(value) => format!("{} {value}", column.name),
            KeyCell::Float(value) => format!("{} {value}", column.name),
            KeyCell::Text(value) => format!("{} {value}", column.name),
        };
        self.columns
            .iter()
            .zip(self.cells(row))
            .map(part)
            .collect::<Vec<_>>()
            .join(", ")
    }

    pub fn cells(&self, row: usize) -> impl Iterator<Item = KeyCell> {
        self.columns.iter().enumerate().map(move |(at, column)| {
            let code = self.codes.code(row, at);
            match &column.meaning {
                Meaning::Int => KeyCell::Int((code ^ SIGN) as i64),
                Meaning::Float => KeyCell::Float(f64::from_bits(if code & SIGN != 0 {
                    code ^ SIGN
                } else {
                    !code
                })),
                Meaning::Text(list) => KeyCell::Text(list[code as usize].clone()),
            }
        })
    }
}

/// Reads the key columns of both files.
pub(super) fn read(a: &TableFile, b: &TableFile, names: &[String]) -> Result<(Keys, Keys)> {
    let mut columns: (Vec<KeyColumn>, Vec<KeyColumn>) = (Vec::new(), Vec::new());
    let mut all: (Vec<Vec<u64>>, Vec<Vec<u64>>) = (Vec::new(), Vec::new());
    for name in names {
        let (at_a, at_b) = (a.key_column(name)?, b.key_column(name)?);
        let (kind_a, kind_b) = (a.columns[at_a].kind, b.columns[at_b].kind);
        if (kind_a == CellKind::Text) != (kind_b == CellKind::Text) {
            let message = format!(
                "is {} in A and {} in B",
                a.columns[at_a].stored, b.columns[at_b].stored
            );
            return Err(Error::spec(format!("key column {name}"), message));
        }
        let (left, right) = if kind_a == CellKind::Text {
            let (left, right) = rayon::join(|| texts(a, at_a), || texts(b, at_b));
            unite(left?, right?)
        } else {
            let real = kind_a == CellKind::Float || kind_b == CellKind::Float;
            let (left, right) = rayon::join(|| codes(a, at_a, real), || codes(b, at_b, real));
            let meaning = if real { Meaning::Float } else { Meaning::Int };
            ((left?, meaning.clone()), (right?, meaning))
        };
        columns.0.push(KeyColumn {
            name: name.clone(),
            meaning: left.1,
        });
        columns.1.push(KeyColumn {
            name: name.clone(),
            meaning: right.1,
        });
        all.0.push(left.0);
        all.1.push(right.0);
    }
    let (left, right) = pack(all.0, all.1);
    Ok((
        Keys {
            columns: columns.0,
            codes: left,
        },
        Keys {
            columns: columns.1,
            codes: right,
        },
    ))
}

fn no_null(source: &TableFile, column: usize, array: &ArrayRef) -> Result<()> {
    if array.null_count() == 0 {
        return Ok(());
    }
    let message = format!(
        "key column {} has nulls; name another key with --key",
        source.columns[column].name
    );
    Err(Error::spec(source.path.display().to_string(), message))
}

/// Numbers as codes that ascend as they do.
fn codes(source: &TableFile, column: usize, real: bool) -> Result<Vec<u64>> {
    let mut codes = Vec::with_capacity(source.rows);
    let of_float = |value: f64| {
        let bits = (value + 0.0).to_bits(); // -0 is 0
        if bits & SIGN == 0 { bits | SIGN } else { !bits }
    };
    for batch in source.stream(&[column])? {
        let array = &batch?[0];
        no_null(source, column, array)?;
        match source.columns[column].kind {
            CellKind::Float => codes.extend(
                array
                    .as_primitive::<Float64Type>()
                    .values()
                    .iter()
                    .map(|&value| of_float(value)),
            ),
            CellKind::Int if real => codes.extend(
                array
                    .as_primitive::<Int64Type>()
                    .values()
                    .iter()
                    .map(|&value| of_float(value as f64)),
            ),
            CellKind::Int => codes.extend(
                array
                    .as_primitive::<Int64Type>()
                    .values()
                    .iter()
                    .map(|&value| value as u64 ^ SIGN),
            ),
            CellKind::Flag if real => codes.extend(
                array
                    .as_boolean()
                    .values()
                    .iter()
                    .map(|flag| of_float(f64::from(u8::from(flag)))),
            ),
            _ => codes.extend(
                array
                    .as_boolean()
                    .values()
                    .iter()
                    .map(|flag| u64::from(flag) ^ SIGN),
            ),
        }
    }
    Ok(codes)
}

/// Texts as places in a list of those that occur, by first occurrence.
fn texts(source: &TableFile, column: usize) -> Result<(Vec<u64>, Vec<Box<str>>)> {
    let mut codes: Vec<u64> = Vec::with_capacity(source.rows);
    let mut list: Vec<Box<str>> = Vec::new();
    let mut known: HashMap<Box<str>, u64> = HashMap::new();
    for batch in source.stream(&[column])? {
        let array = &batch?[0];
        no_null(source, column, array)?;
        let array = array.as_string::<i32>();
        for row in 0..array.len() {
            let text = array.value(row);
            // Neighbours often have the same text.
            let code = match codes.last() {
                Some(&last) if &*list[last as usize] == text => last,
                _ => match known.get(text) {
                    Some(&code) => code,
                    None => {
                        list.push(text.into());
                        known.insert(text.into(), list.len() as u64 - 1);
                        list.len() as u64 - 1
                    }
                },
            };
            codes.push(code);
        }
    }
    Ok((codes, list))
}

type Coded = (Vec<u64>, Meaning);

/// One ascending list for both files.
fn unite(mut a: (Vec<u64>, Vec<Box<str>>), mut b: (Vec<u64>, Vec<Box<str>>)) -> (Coded, Coded) {
    let mut all: Vec<Box<str>> = a.1.iter().chain(&b.1).cloned().collect();
    all.sort_unstable();
    all.dedup();
    for (codes, list) in [&mut a, &mut b] {
        let place: Vec<u64> = list
            .iter()
            .map(|text| all.partition_point(|known| known < text) as u64)
            .collect();
        codes
            .iter_mut()
            .for_each(|code| *code = place[*code as usize]);
        list.clear();
    }
    let all = Arc::new(all);
    ((a.0, Meaning::Text(all.clone())), (b.0, Meaning::Text(all)))
}

/// Pairs rows by key. Where `occurrence` is set the first of equal keys is paired with the first, the second with the second.
pub(super) fn pair(a: &Keys, b: &Keys, occurrence: bool) -> Pairing {
    let (a, b) = rayon::join(|| SortedRows::of(&a.codes), || SortedRows::of(&b.codes));
    let mut pairing = Pairing {
        partner: Vec::new(),
        paired: 0,
        only_a: Vec::new(),
        only_b: Vec::new(),
        twice_a: Vec::new(),
        twice_b: Vec::new(),
        keys_twice: 0,
    };
    let mut identity = a.rows() == b.rows() && a.as_stored() && b.as_stored();
    if !identity {
        pairing.spell_out(a.rows());
    }
    let (mut at_a, mut at_b) = (0, 0);
    while at_a < a.rows() || at_b < b.rows() {
        let order = match (at_a < a.rows(), at_b < b.rows()) {
            (true, false) => Ordering::Less,
            (false, _) => Ordering::Greater,
            (true, true) => a.compare(at_a, &b, at_b),
        };
        let count_a = if order.is_le() { a.equal_from(at_a) } else { 0 };
        let count_b = if order.is_ge() { b.equal_from(at_b) } else { 0 };
        let twice = count_a > 1 || count_b > 1;
        pairing.keys_twice += usize::from(twice);
        let paired = if twice && !occurrence {
            0
        } else {
            count_a.min(count_b)
        };
        for k in 0..paired {
            let (left, right) = (a.row(at_a + k), b.row(at_b + k));
            if identity && left != right {
                identity = false;
            }
            pairing.link(a.rows(), left, right, identity);
        }
        let (rest_a, rest_b) = if twice && !occurrence {
            (&mut pairing.twice_a, &mut pairing.twice_b)
        } else {
            (&mut pairing.only_a, &mut pairing.only_b)
        };
        rest_a.extend((paired..count_a).map(|k| a.row(at_a + k) as u32));
        rest_b.extend((paired..count_b).map(|k| b.row(at_b + k) as u32));
        if paired < count_a || paired < count_b {
            identity = false;
            pairing.spell_out(a.rows());
        }
        (at_a, at_b) = (at_a + count_a, at_b + count_b);
    }
    pairing
}

impl Pairing {
    fn link(&mut self, rows: usize, left: usize, right: usize, identity: bool) {
        if !identity {
            self.spell_out(rows);
            self.partner[left] = right as u32;
        }
        self.paired += 1;
    }

    /// Writes out what was the identity so far: the first `paired` rows.
    fn spell_out(&mut self, rows: usize) {
        if self.partner.is_empty() {
            self.partner = vec![NONE; rows];
            self.partner
                .iter_mut()
                .take(self.paired)
                .enumerate()
                .for_each(|(row, partner)| *partner = row as u32);
        }
    }
}

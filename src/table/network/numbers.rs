//! The rows of a correction by their key: every number is there once, or the table is refused.

use super::NetworkRow;
use crate::error::{Error, Result};
use std::collections::BTreeMap;

type NumberKey = (i64, i64, i64);

/// Values by part, then by member, and layer, to, from.
pub(super) struct Numbers<'a>(BTreeMap<&'a str, BTreeMap<i64, BTreeMap<NumberKey, f64>>>);

impl<'a> Numbers<'a> {
    /// Fails where a key stands twice.
    pub fn new(rows: &'a [NetworkRow]) -> Result<Self> {
        let mut parts: BTreeMap<&str, BTreeMap<i64, BTreeMap<NumberKey, f64>>> = BTreeMap::new();
        for row in rows {
            let part = parts
                .entry(&row.part)
                .or_default()
                .entry(row.member)
                .or_default();
            if part
                .insert((row.layer, row.to, row.from), row.value)
                .is_some()
            {
                let place = (row.layer, row.to, row.from);
                return Err(Error::data(
                    "network",
                    format!(
                        "`{}` {place:?} of member {} stands twice",
                        row.part, row.member
                    ),
                ));
            }
        }
        Ok(Self(parts))
    }

    pub fn has(&self, part: &str) -> bool {
        self.0.contains_key(part)
    }

    /// Highest number of a member that has such a part.
    pub fn members(&self, part: &str) -> usize {
        let last = self
            .0
            .get(part)
            .and_then(|members| members.keys().next_back().copied());
        last.and_then(|last| usize::try_from(last).ok())
            .unwrap_or(0)
    }

    /// All shared rows of a part: layer, to, from and value.
    pub fn all(&self, part: &str) -> impl Iterator<Item = (NumberKey, f64)> {
        self.0
            .get(part)
            .and_then(|members| members.get(&0))
            .into_iter()
            .flatten()
            .map(|(place, value)| (*place, *value))
    }

    pub fn count(&self, part: &str) -> usize {
        self.all(part).count()
    }

    /// Numbers of a part that the first member has.
    pub fn first_member(&self, part: &str) -> usize {
        self.0
            .get(part)
            .and_then(|members| members.get(&1))
            .map_or(0, BTreeMap::len)
    }

    /// A number; fails where it is missing.
    pub fn of(&self, member: usize, part: &str, [layer, to, from]: [usize; 3]) -> Result<f64> {
        let place = (layer as i64, to as i64, from as i64);
        let found = self
            .0
            .get(part)
            .and_then(|members| members.get(&(member as i64))?.get(&place));
        found.copied().ok_or_else(|| {
            Error::data(
                "network",
                format!("no `{part}` {place:?} of member {member}"),
            )
        })
    }

    /// A shared number of entry `to`.
    pub fn shared(&self, part: &str, to: usize) -> Result<f64> {
        self.of(0, part, [0, to, 0])
    }

    /// Shared numbers of entry `to`, `from` 1 to `N`.
    pub fn row<const N: usize>(&self, part: &str, to: usize) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.of(0, part, [0, to, k + 1])?;
        }
        Ok(values)
    }
}

/// A number of the table that counts from `least`, from 0; fails below.
pub(super) fn index(value: i64, least: i64) -> Result<usize> {
    usize::try_from(value - least)
        .map_err(|_| Error::data("network", format!("{value} counts from {least}")))
}

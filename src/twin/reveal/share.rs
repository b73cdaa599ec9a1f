//! Counts as shares with their uncertainty.

use serde::{Serialize, Serializer};
use serde_json::json;
use std::collections::BTreeMap;

/// How many of how many, with Wilson's 95 % limits.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Share {
    pub(crate) count: usize,
    pub(crate) of: usize,
}

impl Share {
    /// Counts what holds.
    pub(crate) fn of(all: impl IntoIterator<Item = bool>) -> Share {
        all.into_iter()
            .fold(Share::default(), |share, holds| Share {
                count: share.count + usize::from(holds),
                of: share.of + 1,
            })
    }
    /// What holds by kind.
    pub(super) fn by_kind<'a>(
        all: impl Iterator<Item = (&'a str, bool)>,
    ) -> BTreeMap<&'a str, Share> {
        let mut out: BTreeMap<&str, Share> = BTreeMap::new();
        for (kind, holds) in all {
            let share = out.entry(kind).or_default();
            share.count += usize::from(holds);
            share.of += 1;
        }
        out
    }
    /// The fraction; none of nothing.
    pub(crate) fn value(&self) -> Option<f64> {
        (self.of > 0).then(|| self.count as f64 / self.of as f64)
    }
    /// E. B. Wilson, 1927.
    pub(crate) fn limits(&self) -> [f64; 2] {
        if self.of == 0 {
            return [0.0, 1.0];
        }
        let (n, z) = (self.of as f64, 1.959_964f64);
        let p = self.count as f64 / n;
        let (middle, wide) = (
            p + z * z / (2.0 * n),
            z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt(),
        );
        [
            (middle - wide) / (1.0 + z * z / n),
            (middle + wide) / (1.0 + z * z / n),
        ]
    }
}

impl Serialize for Share {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let limits = self.limits();
        json!({ "count": self.count, "of": self.of, "wilson_95": limits }).serialize(to)
    }
}

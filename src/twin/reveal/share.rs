//! Counts as shares with their uncertainty.

/// How many of how many, with Wilson's 95 % limits.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Share {
    /// So many.
    pub count: usize,
    /// How many there are in all.
    pub of: usize,
}

impl Share {
    /// Counts what holds.
    pub fn of(all: impl IntoIterator<Item = bool>) -> Share {
        all.into_iter()
            .fold(Share::default(), |share, holds| Share {
                count: share.count + usize::from(holds),
                of: share.of + 1,
            })
    }
    /// The fraction; none of nothing.
    pub fn value(&self) -> Option<f64> {
        (self.of > 0).then(|| self.count as f64 / self.of as f64)
    }
    /// E. B. Wilson, 1927.
    pub fn limits(&self) -> [f64; 2] {
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

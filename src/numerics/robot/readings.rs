//! What rows measure beside or instead of a point: readings of other kinds, and names of what was measured.

/// A name for each row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Named {
    /// Different names, in their order.
    pub names: Vec<String>,
    /// By row, position in `names`.
    pub of: Vec<u32>,
}

/// What rows measured of one kind, SI.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Readings {
    /// The kind's name.
    pub kind: &'static str,
    /// Numbers of a row; none of contacts.
    pub width: usize,
    /// Row-major; NaN where a row measured none.
    pub values: Vec<f64>,
    /// Standard deviation of what a row measured.
    pub sigma: Vec<f64>,
    /// The anchors that readings go to, of kinds that have one.
    pub anchor: Option<Named>,
}

/// What a row measured of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading<'a> {
    /// SI, as many as the kind has.
    pub values: &'a [f64],
    /// Standard deviation of each, SI.
    pub sigma: f64,
    /// Empty where it has no name.
    pub anchor: &'a str,
}

impl Readings {
    /// The readings of some rows, in their order.
    pub fn subset(&self, rows: &[usize]) -> Self {
        Self {
            kind: self.kind,
            width: self.width,
            values: rows
                .iter()
                .flat_map(|row| &self.values[row * self.width..(row + 1) * self.width])
                .copied()
                .collect(),
            sigma: rows.iter().map(|row| self.sigma[*row]).collect(),
            anchor: self
                .anchor
                .as_ref()
                .map(|names| Named::of(rows.iter().map(|row| names.name(*row)))),
        }
    }

    /// What was read in a row; none where nothing was.
    pub fn row(&self, row: usize) -> Option<Reading<'_>> {
        let values = &self.values[row * self.width..(row + 1) * self.width];
        let anchor = self.anchor.as_ref().map_or("", |anchor| anchor.name(row));
        // What has no number was measured where it has a name.
        let there = self.width > 0 || !anchor.is_empty();
        (there && values.iter().all(|value| value.is_finite())).then(|| Reading {
            values,
            sigma: self.sigma[row],
            anchor,
        })
    }
}

impl Named {
    /// From the name of each row.
    pub fn of<'a>(rows: impl Iterator<Item = &'a str> + Clone) -> Self {
        let all: std::collections::BTreeSet<&str> = rows.clone().collect();
        let names: Vec<String> = all.into_iter().map(String::from).collect();
        let number = |name: &str| {
            names
                .binary_search_by(|other| other.as_str().cmp(name))
                .unwrap_or_default() as u32
        };
        Self {
            of: rows.map(number).collect(),
            names,
        }
    }

    /// The name that a row carries; empty where it carries none.
    pub fn name(&self, row: usize) -> &str {
        self.of
            .get(row)
            .and_then(|number| self.names.get(*number as usize))
            .map_or("", String::as_str)
    }
}

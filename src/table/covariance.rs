//! The covariance of the estimated parameters, from the rows that they were fitted to.

use super::{CovarianceRow, CovarianceTable};
use crate::effect::ParameterSpec;
use crate::estimate::{Covariance, Fitted, Model};
use std::collections::{BTreeMap, BTreeSet};

impl CovarianceTable {
    /// The covariance of a fit. Parameters that it kept are taken over from `earlier`: what was estimated on top is held to be independent.
    pub fn of(model: &Model, fitted: &Fitted, earlier: Option<&Self>) -> Self {
        let specs = model.stack.specs();
        let own = fitted
            .covariance
            .iter()
            .flat_map(|covariance| covariance.pairs());
        let mut rows: Vec<CovarianceRow> = own
            .map(|(a, b, value, correlation)| row(&specs[a], &specs[b], value, correlation))
            .collect();
        let new: BTreeSet<String> = rows.iter().map(|row| row.parameter.clone()).collect();
        let known: BTreeSet<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
        let kept = |name: &String| known.contains(name.as_str()) && !new.contains(name);
        let before = earlier.iter().flat_map(|table| &table.0);
        rows.extend(
            before
                .filter(|row| kept(&row.parameter) && kept(&row.other))
                .cloned(),
        );
        rows.sort_by(|a, b| (&a.parameter, &a.other).cmp(&(&b.parameter, &b.other)));
        Self(rows)
    }

    /// The covariance of the parameters of `model`, SI; `None` where the table is empty, or says nothing of one of its own.
    pub fn of_model(&self, model: &Model) -> Option<Covariance> {
        let specs = model.stack.specs();
        let position: BTreeMap<&str, usize> = specs
            .iter()
            .enumerate()
            .map(|(k, spec)| (spec.name.as_str(), k))
            .collect();
        let mut values = BTreeMap::new();
        for row in &self.0 {
            let (a, b) = (
                *position.get(row.parameter.as_str())?,
                *position.get(row.other.as_str())?,
            );
            values.insert(
                (a.min(b), a.max(b)),
                row.covariance * specs[a].unit.to_si(1.0) * specs[b].unit.to_si(1.0),
            );
        }
        Covariance::of_pairs(&values)
    }
}

fn row(a: &ParameterSpec, b: &ParameterSpec, value: f64, correlation: f64) -> CovarianceRow {
    let (a, b) = if a.name <= b.name { (a, b) } else { (b, a) };
    CovarianceRow {
        parameter: a.name.clone(),
        other: b.name.clone(),
        covariance: a.unit.from_si(1.0) * b.unit.from_si(1.0) * value,
        unit: format!("{} {}", a.unit.symbol(), b.unit.symbol()),
        correlation,
    }
}

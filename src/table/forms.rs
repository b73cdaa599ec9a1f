//! Formulas for findings without a name, with their numbers.

use super::{FormRow, Forms, picked, picked_of};
use crate::diagnose::Diagnosis;
use serde_json::Value;

impl Forms {
    /// The formulas of a diagnosis.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let (mut rows, mut last, mut form) = (Vec::new(), None, 0);
        for one in &diagnosis.formulas {
            form = if last == Some(one.finding) {
                form + 1
            } else {
                1
            };
            last = Some(one.finding);
            let declaration =
                serde_json::to_string(&one.declaration).expect("numbers and texts serialise");
            rows.extend(one.numbers.iter().map(|number| FormRow {
                rank: one.finding as i64 + 1,
                form,
                number: number.name.clone(),
                formula: one.declaration.law.0.join("; "),
                price: one.price as i64,
                folds_rms_mm: one.folds * 1e3,
                curve_rms_mm: one.curve * 1e3,
                without_rms_mm: one.without.map(|without| without * 1e3),
                proposed: one.chosen,
                value: number.value,
                unit: number.unit.into(),
                sigma: number.sigma.filter(|sigma| sigma.is_finite()),
                declaration: declaration.clone(),
            }));
        }
        rows.sort_by(|a, b| (a.rank, a.form, &a.number).cmp(&(b.rank, b.form, &b.number)));
        Self(rows)
    }

    /// Formulas of a finding, each as its rows, cheapest first.
    pub fn of_finding(&self, rank: i64) -> impl Iterator<Item = &[FormRow]> {
        let own = move |rows: &&[FormRow]| rows.first().is_some_and(|row| row.rank == rank);
        self.0
            .chunk_by(|a, b| (a.rank, a.form) == (b.rank, b.form))
            .filter(own)
    }
}

impl Forms {
    /// The formulas of a finding as JSON.
    pub fn document(&self, rank: i64) -> Vec<Value> {
        let one = |rows: &[FormRow]| {
            let columns = "formula price proposed folds_rms_mm curve_rms_mm without_rms_mm";
            let mut form = picked(&rows[0], columns);
            form["numbers"] = picked_of(rows, "name=number value unit sigma");
            form
        };
        self.of_finding(rank).map(one).collect()
    }
}

/// A formula with its numbers in words: `exp(-((q - centre) / width)^2): centre = 0.71 +- 0.02 rad, c1 = 53 +- 2 arcsec`.
pub fn formula_in_words(rows: &[FormRow]) -> String {
    let Some(first) = rows.first() else {
        return String::new();
    };
    let number = |row: &FormRow| {
        let sigma = row
            .sigma
            .map(|sigma| format!(" +- {}", brief(sigma)))
            .unwrap_or_default();
        let unit = if row.unit == "1" || row.unit == "SI" {
            String::new()
        } else {
            format!(" {}", row.unit)
        };
        format!("{} = {}{sigma}{unit}", row.number, brief(row.value))
    };
    format!(
        "{}: {}",
        first.formula,
        rows.iter().map(number).collect::<Vec<_>>().join(", ")
    )
}

/// Three digits.
fn brief(value: f64) -> String {
    let power = if value == 0.0 {
        0.0
    } else {
        value.abs().log10().floor()
    };
    if (-4.0..6.0).contains(&power) {
        format!("{value:.*}", (2.0 - power).max(0.0) as usize)
    } else {
        format!("{value:.2e}")
    }
}

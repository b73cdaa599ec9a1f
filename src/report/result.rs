//! A finding of a diagnosis as one value that is made once, of its tables: `--json`, the lines of a terminal and the pages show it.

use crate::table::{FormRow, Forms, formula_in_words, picked, picked_of};
use serde::Serialize;
use serde_json::{Value, json};

/// Less probable than this, a name is excluded.
const EXCLUDED: f64 = 0.005;

/// Rows as values.
fn values<'a, R: Serialize + 'a>(rows: impl IntoIterator<Item = &'a R>) -> Vec<Value> {
    rows.into_iter().map(|row| json!(row)).collect()
}

/// Findings on positions or torques: their rows, each with its `numbers` and its `rivals`. A rival is `open` where it is more than the nearest
/// name of a finding that has none: one that the data exclude.
pub fn findings<'a, F: Serialize + 'a, N: Serialize + 'a, R: Serialize + 'a>(
    rows: impl IntoIterator<Item = &'a F>,
    numbers: impl IntoIterator<Item = &'a N>,
    rivals: impl IntoIterator<Item = &'a R>,
) -> Vec<Value> {
    let (mut findings, numbers, mut rivals) = (values(rows), values(numbers), values(rivals));
    for rival in &mut rivals {
        let probability = rival["probability"].as_f64();
        rival["open"] = probability.is_none_or(|share| share >= EXCLUDED).into();
    }
    for finding in &mut findings {
        for (name, all) in [("numbers", &numbers), ("rivals", &rivals)] {
            let of_finding = all.iter().filter(|row| row["rank"] == finding["rank"]);
            finding[name] = of_finding.cloned().collect();
        }
    }
    findings
}

/// The formulas of a finding: what each costs and brings, all of it in `words`, and its `numbers`.
pub fn formulas<'a>(forms: impl IntoIterator<Item = &'a Forms>, rank: i64) -> Value {
    let rows = forms.into_iter().flat_map(|forms| forms.of_finding(rank));
    let formula = |rows: &[FormRow]| {
        let mut formula = json!(rows[0]);
        formula["words"] = formula_in_words(rows).into();
        formula["numbers"] = picked_of(rows, "name=number value unit sigma");
        formula
    };
    rows.map(formula).collect()
}

/// A finding for other programs; `evidence` are the columns that speak for it.
pub fn document(finding: &Value, evidence: &str) -> Value {
    let columns = "effect where=place statement probability place_probability none_probability";
    let rows = |name: &str| finding[name].as_array().into_iter().flatten();
    let mut document = picked(finding, columns);
    document["evidence"] = picked(finding, evidence);
    document["numbers"] = picked_of(rows("numbers"), "name value unit sigma");
    document["rivals"] = picked_of(rows("rivals"), "effect where=place delta_bic probability");
    if finding["formulas"].is_array() {
        let columns = "formula price proposed folds_rms_mm curve_rms_mm without_rms_mm numbers";
        document["forms"] = picked_of(rows("formulas"), columns);
    }
    document
}

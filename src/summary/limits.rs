//! What the reports of a run say of the limits that the user set: a line each, and whether all are kept.

use super::labelled;
use crate::error::{Error, Result};
use crate::pipeline::{CompletedRun, Manifest};
use crate::store::Store;
use crate::table::{Document, Table};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The judgements of a run's reports, those alone that have limits.
pub struct LimitsSummary(Vec<Judged>);

/// A judgement as the report's document for programs has it, and the report's stage.
#[derive(Serialize, Deserialize)]
struct Judged {
    #[serde(default)]
    stage: String,
    #[serde(default, skip_serializing)]
    asked: bool,
    kept: bool,
    sentence: String,
    figures: Vec<Figure>,
}

#[derive(Serialize, Deserialize)]
struct Figure {
    figure: String,
    found_mm: Option<f64>,
    limit_mm: Option<f64>,
    kept: bool,
}

impl LimitsSummary {
    /// Of all reports of a run. Fails where a document has left the store.
    pub fn read(outcome: &CompletedRun, store: &Store) -> Result<Self> {
        Self::of(&outcome.manifest, store)
    }

    /// Of all reports of the record of a run.
    pub fn of(manifest: &Manifest, store: &Store) -> Result<Self> {
        let mut all = Vec::new();
        for stage in &manifest.stages {
            for output in stage.outputs.iter().filter(|output| output.kind == Document::KIND) {
                let documents = Document::from_frame(&store.load(&output.table)?)?.0;
                for document in documents.iter().filter(|document| document.media_type == "application/json") {
                    all.extend(judged(&stage.id, &document.content)?);
                }
            }
        }
        Ok(Self(all))
    }

    /// Whether all limits are kept; none where there are none.
    pub fn accepted(&self) -> Option<bool> {
        (!self.0.is_empty()).then(|| self.0.iter().all(|judged| judged.kept))
    }

    /// What is not accepted, a sentence a report.
    pub fn exceeded(&self) -> Vec<String> {
        self.0.iter().filter(|judged| !judged.kept).map(Judged::words).collect()
    }

    /// A line for each report with limits.
    pub fn text(&self) -> String {
        self.0.iter().map(|judged| labelled("limits", &judged.words())).collect()
    }

    /// The same for other programs.
    pub fn document(&self) -> Result<Value> {
        serde_json::to_value(&self.0).map_err(|error| Error::Bug(error.to_string()))
    }
}

/// What a report says of its limits; none where it has none.
fn judged(stage: &str, content: &str) -> Result<Option<Judged>> {
    let bug = |error: serde_json::Error| Error::Bug(format!("the document of the report `{stage}`: {error}"));
    let mut report: Value = serde_json::from_str(content).map_err(bug)?;
    let limits = report.get_mut("limits").map(Value::take).unwrap_or_default();
    let judged: Option<Judged> = serde_json::from_value(limits).map_err(bug)?;
    Ok(judged.filter(|judged| judged.asked).map(|judged| Judged { stage: stage.into(), ..judged }))
}

impl Judged {
    /// The judgement, then the figures that are beyond, or all where none is.
    fn words(&self) -> String {
        let length = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.4}"));
        let allowed = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| value.to_string());
        let told = self.figures.iter().filter(|figure| figure.kept == self.kept);
        let told =
            told.map(|one| format!("{} {} mm, at most {} mm allowed", one.figure, length(one.found_mm), allowed(one.limit_mm)));
        let told: Vec<String> = told.collect();
        let mut letters = self.sentence.trim_end_matches('.').chars();
        let first = letters.next().map(|letter| letter.to_lowercase().to_string()).unwrap_or_default();
        let sentence = format!("{first}{}", letters.as_str());
        if told.is_empty() { sentence } else { format!("{sentence}: {}", told.join("; ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::judged;

    #[test]
    fn a_line_names_what_is_beyond_and_a_report_without_limits_has_none() {
        let limits = r#"{"asked": true, "kept": false, "sentence": "Not accepted: beyond the limits.", "figures": [
            {"figure": "mean", "found_mm": 0.0421, "limit_mm": 0.03, "kept": false},
            {"figure": "largest", "found_mm": 0.1, "limit_mm": 0.5, "kept": true}]}"#;
        let read = |limits: &str| judged("report", &format!(r#"{{"calib_report": 1, "limits": {limits}}}"#)).expect("a document");
        let words = read(limits).map(|judged| judged.words());
        assert_eq!(words.as_deref(), Some("not accepted: beyond the limits: mean 0.0421 mm, at most 0.03 mm allowed"));
        assert!(read("null").is_none());
        assert!(read(&limits.replace("\"asked\": true", "\"asked\": false")).is_none(), "a wrong set-up is judged unasked");
    }
}

//! What the reports of a run say of the limits that the user set: a line each, and whether all are kept.

use super::labelled;
use crate::error::Error;
use crate::pipeline::{CompletedRun, Manifest};
use crate::stage::{DeclaredStage, Report};
use crate::store::Store;
use crate::table::{Acceptance, AcceptanceRow, Table, picked_of};
use serde::{Serialize, Serializer};

/// The judgements of a run's reports, those alone that have limits.
#[derive(Serialize)]
pub struct LimitsSummary(Vec<Judged>);

/// A judgement and the report's stage.
#[derive(Serialize)]
struct Judged {
    stage: String,
    kept: bool,
    sentence: String,
    /// Those for which something was found.
    #[serde(serialize_with = "figures")]
    figures: Vec<AcceptanceRow>,
}

fn figures<S: Serializer>(rows: &[AcceptanceRow], serializer: S) -> Result<S::Ok, S::Error> {
    picked_of(rows, "figure found_mm limit_mm kept").serialize(serializer)
}

impl LimitsSummary {
    /// The judgements of all reports of a run. Fails where a table has left the store, or a report is older than the table.
    pub fn read(outcome: &CompletedRun, store: &Store) -> crate::error::Result<Self> {
        Self::of(&outcome.manifest, store)
    }

    /// The judgements of all reports of the record of a run.
    pub fn of(manifest: &Manifest, store: &Store) -> crate::error::Result<Self> {
        let mut all = Vec::new();
        for stage in manifest
            .stages
            .iter()
            .filter(|stage| stage.uses == Report::NAME && !stage.outputs.is_empty())
        {
            let Some(own) = stage
                .outputs
                .iter()
                .find(|output| output.kind == Acceptance::KIND)
            else {
                let message = "its report was made by an earlier calib, which kept limits elsewhere; run the pipeline again";
                return Err(Error::data(&manifest.run_id, message));
            };
            all.extend(judged(
                &stage.id,
                Acceptance::from_frame(&store.load(&own.table)?)?,
            ));
        }
        Ok(Self(all))
    }

    /// Whether all limits are kept; none where there are none.
    pub(crate) fn accepted(&self) -> Option<bool> {
        (!self.0.is_empty()).then(|| self.0.iter().all(|judged| judged.kept))
    }

    /// What is not accepted, a sentence a report.
    pub(crate) fn exceeded(&self) -> Vec<String> {
        self.0
            .iter()
            .filter(|judged| !judged.kept)
            .map(Judged::words)
            .collect()
    }

    /// A line for each report with limits.
    pub fn text(&self) -> String {
        self.0
            .iter()
            .map(|judged| labelled("limits", &judged.words()))
            .collect()
    }
}

/// What a report says of its limits; none where it has none.
fn judged(stage: &str, Acceptance(rows): Acceptance) -> Option<Judged> {
    let first = rows.first()?;
    Some(Judged {
        stage: stage.into(),
        kept: first.accepted,
        sentence: first.sentence.clone(),
        figures: rows
            .into_iter()
            .filter(|row| row.found_mm.is_some())
            .collect(),
    })
}

impl Judged {
    /// The judgement, then the figures that are beyond, or all where none is.
    fn words(&self) -> String {
        let limits = self
            .figures
            .iter()
            .filter(|figure| figure.kept == self.kept);
        let limits = limits.filter_map(|one| {
            let (figure, found, limit) = (&one.figure, one.found_mm?, one.limit_mm);
            Some(format!(
                "{figure} {found:.4} mm, at most {limit} mm allowed"
            ))
        });
        let limits: Vec<String> = limits.collect();
        let mut letters = self.sentence.trim_end_matches('.').chars();
        let first = letters
            .next()
            .map(|letter| letter.to_lowercase().to_string())
            .unwrap_or_default();
        let sentence = format!("{first}{}", letters.as_str());
        if limits.is_empty() {
            sentence
        } else {
            format!("{sentence}: {}", limits.join("; "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::judged;
    use crate::table::{Acceptance, AcceptanceRow};

    #[test]
    fn a_line_names_what_is_beyond_and_a_report_without_limits_has_none() {
        let row = |figure: &str, found_mm, limit_mm, kept| AcceptanceRow {
            order: 1,
            figure: figure.into(),
            found_mm,
            limit_mm,
            kept,
            accepted: false,
            sentence: "Not accepted: beyond the limits.".into(),
        };
        let words = |rows| judged("report", Acceptance(rows)).map(|judged| judged.words());
        let found = vec![
            row("mean", Some(0.0421), 0.03, false),
            row("largest", Some(0.1), 0.5, true),
        ];
        assert_eq!(
            words(found).as_deref(),
            Some("not accepted: beyond the limits: mean 0.0421 mm, at most 0.03 mm allowed")
        );
        assert_eq!(
            words(vec![row("mean", None, 0.03, false)]).as_deref(),
            Some("not accepted: beyond the limits")
        );
        assert!(
            words(Vec::new()).is_none(),
            "a wrong set-up is judged unasked"
        );
    }
}

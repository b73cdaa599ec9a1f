//! `cell_evidence`: what every cell of the table of causes says of a robot given cells that its fleet has accepted. `calib fleet diagnose` puts
//! it in the place of a stage `diagnose`, with that stage's settings.

use crate::diagnose::{CellAnswer, GivenCell, cell_evidence};
use crate::error::{Error, Place, Result};
use crate::stage::{AskedRows, Context, Diagnose, DiagnoseReads, RawFile, Stage};
use crate::table::{CellEvidence as CellEvidenceTable, CellEvidenceRow};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of `cell_evidence`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellEvidence {
    /// Settings as of a stage `diagnose`.
    pub(crate) diagnose: Diagnose,
    /// Cells that are taken to be in the robot.
    #[serde(default)]
    pub(crate) given: Vec<Given>,
}

/// A cell that is taken to be in the robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Given {
    /// Its key, as the table cell_evidence has it.
    pub(crate) cell: String,
    /// Key of the shape that all robots share; the robot's likeliest if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) shape: Option<String>,
    /// Rms motion at the tool that is expected of it, mm.
    pub(crate) size_mm: f64,
}

crate::stage::stage! {
    CellEvidence, "cell_evidence", 4, "says what every possible cause explains of one robot, for the sum over a fleet",
        DiagnoseReads -> CellEvidenceWrites {
            cell_evidence: CellEvidenceTable,
        }
}

impl Stage for CellEvidence {
    fn faults(&self, at: &mut Place) {
        self.diagnose.faults(&mut at.at("diagnose"));
        for (k, given) in self.given.iter().enumerate() {
            at.at(format!("given[{k}].size_mm")).must(
                given.size_mm > 0.0 && given.size_mm < 1e3,
                "expected a length above 0 and below 1000 mm",
            );
        }
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let below = |(place, file)| (format!("diagnose.{place}"), file);
        Stage::files(&self.diagnose)
            .into_iter()
            .map(below)
            .collect()
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        let below = |(place, set)| (format!("diagnose.{place}"), set);
        self.diagnose.sets_named().into_iter().map(below).collect()
    }

    fn run(&self, reads: DiagnoseReads, context: &Context) -> Result<CellEvidenceWrites> {
        let asked = AskedRows::of(&self.diagnose, &reads, context)?;
        let question = asked.question(&self.diagnose, context.seed);
        let given: Vec<GivenCell> = self
            .given
            .iter()
            .map(|given| GivenCell {
                cell: given.cell.clone(),
                shape: given.shape.clone(),
                size: 1e-3 * given.size_mm,
            })
            .collect();
        let answers = cell_evidence(&question, &given)
            .map_err(|message| Error::data("table recording", message))?;
        Ok(CellEvidenceWrites {
            cell_evidence: table(answers),
        })
    }
}

fn table(answers: Vec<CellAnswer>) -> CellEvidenceTable {
    // So many digits decide nothing, and they would fill the store.
    let rounded = |value: f64| (1e3 * value).round() / 1e3;
    let row = |answer: CellAnswer| CellEvidenceRow {
        given: answer.left_out.unwrap_or_default(),
        cell: answer.cell,
        shape: answer.shape.unwrap_or_default(),
        effect: answer.effect.into(),
        place: answer.place.to_string(),
        follows: answer.follows.into(),
        log_evidence: rounded(answer.log),
        log_prior: rounded(answer.log_prior),
        size_mm: rounded(1e6 * answer.size) / 1e3,
        sigma_mm: answer.sigma.map(|sigma| rounded(1e6 * sigma) / 1e3),
    };
    let mut rows: Vec<CellEvidenceRow> = answers
        .into_iter()
        .filter(CellAnswer::counts)
        .map(row)
        .collect();
    let key = |row: &CellEvidenceRow| (row.given.clone(), row.cell.clone(), row.shape.clone());
    rows.sort_by_cached_key(key);
    rows.dedup_by_key(|row| key(row));
    CellEvidenceTable(rows)
}

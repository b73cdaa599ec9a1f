//! `cell_evidence`: what every cell of the table of causes says of a robot given cells that its fleet has accepted. `calib fleet diagnose` puts
//! it in the place of a stage `diagnose`, with that stage's settings; `torque_evidence` in that of a stage `diagnose_torques`.

use crate::dynamics;
use crate::error::{Error, Place, Result};
use crate::table::{
    CellAmplitudeRow, CellAmplitudes, CellEvidence as CellEvidenceTable, CellEvidenceRow,
};
use crate::{
    AskedRows, Context, Diagnose, DiagnoseReads, DiagnoseTorques, DiagnoseTorquesReads, RawFile,
    Stage,
};
use calib_diagnose::{CellAnswer, GivenCell, cell_evidence};
use calib_engine::AMPLITUDES;
use calib_numerics::criteria::cells::{LARGEST, SMALLEST};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of both: those of the diagnosis in whose place it is.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Evidence<D> {
    /// Settings as of a stage `diagnose`, or `diagnose_torques`.
    pub diagnose: D,
    /// Cells that are taken to be in the robot.
    #[serde(default)]
    pub given: Vec<Given>,
}

/// Of positions.
pub type CellEvidence = Evidence<Diagnose>;
/// Of torques.
pub type TorqueEvidence = Evidence<DiagnoseTorques>;

/// A cell that is taken to be in the robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Given {
    /// Its key, as the table cell_evidence has it.
    pub cell: String,
    /// Key of the shape that all robots share; the robot's likeliest if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<String>,
    /// Rms motion at the tool that is expected of it, mm, or rms torque, Nm.
    pub size: f64,
}

crate::stage! {
    CellEvidence, "cell_evidence", 9, "says what every possible cause explains of one robot, for the sum over a fleet",
        DiagnoseReads -> CellEvidenceWrites {
            cell_evidence: CellEvidenceTable,
            cell_amplitudes: CellAmplitudes,
        }
}

impl Stage for CellEvidence {
    fn faults(&self, at: &mut Place) {
        self.diagnose.faults(&mut at.at("diagnose"));
        must_have_sizes(&self.given, at);
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let files = Stage::files(&self.diagnose).into_iter();
        files
            .map(|(place, file)| (format!("diagnose.{place}"), file))
            .collect()
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        let below = |(place, set)| (format!("diagnose.{place}"), set);
        self.diagnose.sets_named().into_iter().map(below).collect()
    }

    fn run(&self, reads: DiagnoseReads, context: &Context) -> Result<CellEvidenceWrites> {
        let asked = AskedRows::of(&self.diagnose, &reads, context)?;
        let question = asked.question(&self.diagnose, context.seed);
        let answers = cell_evidence(&question, &cells(&self.given, 1e-3))
            .map_err(|message| Error::data("table recording", message))?;
        Ok(tables(answers, ("mm", 1e3)))
    }
}

crate::stage! {
    TorqueEvidence, "torque_evidence", 11, "says what every possible cause explains of the torques of one robot",
        DiagnoseTorquesReads -> CellEvidenceWrites
}

impl Stage for TorqueEvidence {
    fn faults(&self, at: &mut Place) {
        self.diagnose.faults(&mut at.at("diagnose"));
        must_have_sizes(&self.given, at);
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let files = Stage::files(&self.diagnose).into_iter();
        files
            .map(|(place, file)| (format!("diagnose.{place}"), file))
            .collect()
    }

    fn run(&self, reads: DiagnoseTorquesReads, context: &Context) -> Result<CellEvidenceWrites> {
        let (arm, recording, question) = self.diagnose.asked(&reads, context)?;
        let given = cells(&self.given, 1.0);
        let tell = &mut |line| context.note(line);
        let answers = dynamics::cell_evidence(&arm, &recording, &question, &given, tell)?;
        Ok(tables(answers, ("Nm", 1.0)))
    }
}

fn must_have_sizes(given: &[Given], at: &mut Place) {
    for (k, given) in given.iter().enumerate() {
        at.at(format!("given[{k}].size")).must(
            given.size > 0.0 && given.size < 1e6,
            "expected a size above 0 and below 1e6",
        );
    }
}

/// Given cells with their sizes in SI.
fn cells(given: &[Given], unit: f64) -> Vec<GivenCell> {
    let cell = |given: &Given| GivenCell {
        cell: given.cell.clone(),
        shape: given.shape.clone(),
        size: unit * given.size,
    };
    given.iter().map(cell).collect()
}

/// Of the amplitudes at which evidence is computed, which are written: a cause shows much the same at its neighbours.
const EVERY: usize = 2;

/// Amplitudes that are written.
pub const STEPS: usize = AMPLITUDES / EVERY;

/// ln of one of them over that before it.
pub fn amplitude_step() -> f64 {
    EVERY as f64 * (*LARGEST / *SMALLEST).ln() / (AMPLITUDES - 1) as f64
}

/// What is less at an amplitude is as impossible as this.
const IMPOSSIBLE: f64 = -100.0;

fn tables(mut answers: Vec<CellAnswer>, (unit, per_si): (&str, f64)) -> CellEvidenceWrites {
    let key = |answer: &CellAnswer| {
        let shape = answer.shape.clone().unwrap_or_default();
        let given = answer.left_out.clone().unwrap_or_default();
        (given, answer.cell.clone(), shape)
    };
    answers.retain(CellAnswer::counts);
    answers.sort_by_cached_key(key);
    answers.dedup_by_key(|answer| key(answer));
    // So many digits decide nothing, and they would fill the store.
    let rounded = |value: f64| (1e3 * value).round() / 1e3;
    let (mut rows, mut amplitudes) = (Vec::new(), Vec::new());
    for answer in answers {
        let (given, cell, shape) = key(&answer);
        let at = answer.at_amplitudes.iter().step_by(EVERY);
        for (step, log) in at.take(STEPS).enumerate() {
            amplitudes.push(CellAmplitudeRow {
                given: given.clone(),
                cell: cell.clone(),
                shape: shape.clone(),
                step: step as i64,
                log_evidence: (1e2 * log.max(IMPOSSIBLE)).round() / 1e2,
            });
        }
        rows.push(CellEvidenceRow {
            given,
            cell,
            shape,
            effect: answer.effect.into(),
            place: answer.place.to_string(),
            follows: answer.follows.into(),
            log_evidence: rounded(answer.log),
            log_prior: rounded(answer.log_prior),
            size: rounded(1e3 * per_si * answer.size) / 1e3,
            sigma: answer
                .sigma
                .map(|sigma| rounded(1e3 * per_si * sigma) / 1e3),
            log_ratio: answer.log_ratio.map(rounded),
            unit: unit.into(),
        });
    }
    CellEvidenceWrites {
        cell_evidence: CellEvidenceTable(rows),
        cell_amplitudes: CellAmplitudes(amplitudes),
    }
}

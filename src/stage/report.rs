//! `report`: everything the earlier stages found, as one HTML file that a person reads, prints and files.

use crate::error::{Error, Fault, Result};
use crate::report::{Tables, Wishes, html};
use crate::stage::{Context, Labelled, Stage, reads, writes};
use crate::table::{
    Document, DocumentRow, Fit, Intake, Observability, Parameters, Prediction, Recording, Rejected, Robot, Split, Statistics,
    Training,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Writes `report.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Report {
    /// Heading of the report; without it, the robot's name.
    pub title: Option<String>,
    /// The held-out set that the first sentence speaks of; without it, the one with most points after the last step.
    pub set: Option<String>,
}

reads! {
    pub struct ReportReads {
        statistics: Statistics,
        prediction: Vec<Labelled<Prediction>>,
        parameters: Parameters,
        robot: Robot,
        recording: Recording,
        split: Split,
        intake: Vec<Labelled<Intake>>,
        rejected: Vec<Labelled<Rejected>>,
        fit: Vec<Labelled<Fit>>,
        observability: Vec<Labelled<Observability>>,
        training: Vec<Labelled<Training>>,
    }
}
writes! {
    pub struct ReportWrites {
        document: Document,
    }
}

impl Stage for Report {
    const NAME: &'static str = "report";
    const SUMMARY: &'static str = "Writes one self-contained HTML file: errors before and after, parameters, what was rejected";
    const IMPLEMENTATION: u32 = 3;
    type Reads = ReportReads;
    type Writes = ReportWrites;

    fn run(&self, reads: ReportReads, context: &Context) -> Result<ReportWrites> {
        let tables = Tables {
            statistics: reads.statistics,
            prediction: unlabelled(reads.prediction),
            parameters: reads.parameters,
            robot: reads.robot,
            recording: reads.recording,
            split: reads.split,
            intake: unlabelled(reads.intake),
            rejected: unlabelled(reads.rejected),
            fit: unlabelled(reads.fit),
            observability: unlabelled(reads.observability),
            training: unlabelled(reads.training),
        };
        let wishes = Wishes { title: self.title.as_deref(), set: self.set.as_deref() };
        let content = html(&tables, &wishes).map_err(|error| placed(error, context.id))?;
        let document = DocumentRow { name: "report.html".into(), media_type: "text/html".into(), content };
        Ok(ReportWrites { document: Document(vec![document]) })
    }
}

fn unlabelled<T>(tables: Vec<Labelled<T>>) -> Vec<T> {
    tables.into_iter().map(|labelled| labelled.table).collect()
}

/// Faults of the settings with the stage they belong to.
fn placed(error: Error, stage: &str) -> Error {
    match error {
        Error::Spec(faults) => {
            Error::Spec(faults.into_iter().map(|f| Fault::new(format!("{stage}.{}", f.place), f.message)).collect())
        }
        other => other,
    }
}

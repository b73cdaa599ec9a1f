//! `report_torques`: what a diagnosis of torques found, as one HTML file that a person reads, prints and files.

use crate::error::Result;
use crate::report::{TorqueTables, torque_page};
use crate::stage::{Context, Labelled, Stage, reads, writes};
use crate::table::{
    BodyConsistencies, Contacts, Document, DocumentRow, FrictionCurves, Inertials, JointTorques,
    Robot, Table, TorqueCourse, TorqueFindings, TorqueNumbers, TorqueRivals, TorqueVerdict,
    VerdictSentences,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Writes `torques.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportTorques {
    /// Heading of the page; without it, the robot's name.
    pub title: Option<String>,
}

reads! {
    /// Input ports of `report_torques`.
    pub struct ReportTorquesReads {
        robot: Robot,
        verdict: TorqueVerdict,
        sentences: Vec<Labelled<VerdictSentences>>,
        findings: TorqueFindings,
        numbers: TorqueNumbers,
        rivals: TorqueRivals,
        joints: JointTorques,
        course: TorqueCourse,
        friction: FrictionCurves,
        inertials: Inertials,
        contacts: Contacts,
        consistency: BodyConsistencies,
    }
}
writes! {
    /// Output ports of `report_torques`.
    pub struct ReportTorquesWrites {
        document: Document,
    }
}

impl Stage for ReportTorques {
    const NAME: &'static str = "report_torques";
    const SUMMARY: &'static str =
        "writes one self-contained HTML file: torques before and after, friction, what was found";
    const IMPLEMENTATION: u32 = 5;
    type Reads = ReportTorquesReads;
    type Writes = ReportTorquesWrites;

    fn run(&self, reads: ReportTorquesReads, _context: &Context) -> Result<ReportTorquesWrites> {
        let hash = |name: &str, frame: crate::table::Frame| {
            (name.to_string(), frame.table_hash().to_string())
        };
        let hashes = vec![
            hash("robot", reads.robot.to_frame()?),
            hash("findings", reads.findings.to_frame()?),
            hash("course", reads.course.to_frame()?),
        ];
        let tables = TorqueTables {
            robot: reads.robot,
            verdict: reads.verdict,
            // Other diagnoses of the pipeline have theirs: each is asked for by its step.
            sentences: VerdictSentences(
                reads
                    .sentences
                    .into_iter()
                    .flat_map(|of| of.table.0)
                    .collect(),
            ),
            findings: reads.findings,
            numbers: reads.numbers,
            rivals: reads.rivals,
            joints: reads.joints,
            course: reads.course,
            friction: reads.friction,
            inertials: reads.inertials,
            contacts: reads.contacts,
            consistency: reads.consistency,
            hashes,
        };
        let content = torque_page(&tables, self.title.as_deref())?;
        let html = DocumentRow {
            name: "torques.html".into(),
            media_type: "text/html".into(),
            content,
        };
        Ok(ReportTorquesWrites {
            document: Document(vec![html]),
        })
    }
}

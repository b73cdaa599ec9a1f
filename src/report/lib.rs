//! Tables to one self-contained HTML file: no network, inline SVG, one script that turns the picture of the arm, light and dark, fit to print.
//!
//! Every figure is a column of a table; the pictures only bin, sort and scale them, and values are shown in people's units.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::{error, units};
use calib_table as table;

mod achieved;
mod arm;
mod certificate;
mod charts;
mod curves;
mod data;
mod drives;
mod errors;
mod findings;
mod fits;
pub mod fleet;
pub mod fleet_causes;
mod followed;
mod language;
mod number;
mod parameters;
pub mod result;
mod svg;
mod torques;
mod workspace;

pub use achieved::{AchievedTables, achieved_page};
pub use arm::{PlacedArm, shown_row};
pub use drives::ReportDrivesReads;
pub use drives::drive_page;
pub use findings::diagnosed_page;
pub use language::PageLanguage;
use language::{Locale, say};
pub use torques::ReportTorquesReads;
pub use torques::torque_page;

use crate::error::Result;
use crate::table::{
    Acceptance, Cells, Corrections, Curves, FindingNumbers, Findings, Fit, Forms, Intake,
    JointConventions, Labelled, Observability, Parameters, Prediction, Recording, Rejected, Rivals,
    Robot, Split, Statistics, Suspects, Training, Verdict, VerdictSentences, VerdictTopic,
    Withdrawn,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::ops::Deref;

/// A page as one file that needs no other.
pub struct Page {
    /// All of it.
    pub html: String,
    /// What it says in English since its language lacks it.
    missing: Vec<String>,
}

impl Page {
    /// A warning for each text that stayed English.
    pub fn untranslated(&self, language: PageLanguage) -> Vec<String> {
        untranslated(&self.missing, language)
    }
}

/// A warning for each text of a page that its language lacks.
pub fn untranslated(missing: &[String], language: PageLanguage) -> Vec<String> {
    let language = language.code();
    let texts = missing.iter();
    texts
        .map(|text| format!("the page says this in English, as `{language}` lacks it: {text}"))
        .collect()
}

/// Joints that a page shows more closely: of six, two bear most of the error as a rule, and a reader compares two.
const SHOWN_CLOSELY: usize = 2;

/// The joints of the largest errors, the largest first, and the others in their order.
fn worst_first(errors: &[f64]) -> (Vec<usize>, Vec<usize>) {
    let mut worst: Vec<usize> = (0..errors.len()).collect();
    worst.sort_by(|a, b| errors[*b].total_cmp(&errors[*a]));
    let mut others = worst.split_off(worst.len().min(SHOWN_CLOSELY));
    others.sort_unstable();
    (worst, others)
}

/// Writes `report.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Report {
    /// Heading of the report; without it, the robot's name.
    pub title: Option<String>,
    /// The held-out set that the first sentence speaks of; without it, the one with most points after the step that stands for the run.
    pub set: Option<String>,
    /// Language of the page with its certificate: `en` or `de`.
    pub language: PageLanguage,
    /// What is accepted: of the held-out points of the diagnosed model, without a diagnosis after the last step. Beyond it `calib run` says
    /// so and ends with code 1.
    pub limits: Accepted,
    /// Who, with what, where and when, e.g. {certificate number: K-17, operator: A. Meier, tracker: AT960, tracker serial: 123, tracker
    /// calibrated: 2026-03-02, standard: .., robot serial: .., date: 2026-11-21}; shown as given. What is not stated is a line to fill in; the
    /// date is that of the recording where its clock has one.
    pub identity: BTreeMap<String, String>,
    /// All of the report, or the certificate, what was found and the pictures on at most four pages.
    pub pages: ReportPages,
}

/// How much of the report is written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportPages {
    /// Everything.
    #[default]
    Full,
    /// The certificate, what was found and the pictures.
    Short,
}

/// Largest errors that are accepted, mm; each may be left out.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Accepted {
    /// Arithmetic mean.
    pub mean_mm: Option<f64>,
    /// 95 % of the points.
    pub p95_mm: Option<f64>,
    /// Error of the worst point.
    pub max_mm: Option<f64>,
}

crate::table::reads! {
    /// What a report is made of; lists are in pipeline order and may be empty.
    pub struct ReportReads {
        statistics: Statistics,
        prediction: Vec<Labelled<Prediction>>,
        parameters: Parameters,
        robot: Robot,
        recording: Recording,
        convention: Vec<Labelled<JointConventions>>,
        split: Split,
        intake: Vec<Labelled<Intake>>,
        rejected: Vec<Labelled<Rejected>>,
        fit: Vec<Labelled<Fit>>,
        observability: Vec<Labelled<Observability>>,
        training: Vec<Labelled<Training>>,
        corrections: Vec<Labelled<Corrections>>,
        models: Vec<Labelled<Parameters>>,
        verdict: Vec<Labelled<Verdict>>,
        sentences: Vec<Labelled<VerdictSentences>>,
        findings: Vec<Labelled<Findings>>,
        finding_numbers: Vec<Labelled<FindingNumbers>>,
        rivals: Vec<Labelled<Rivals>>,
        forms: Vec<Labelled<Forms>>,
        cells: Vec<Labelled<Cells>>,
        suspects: Vec<Labelled<Suspects>>,
    }
}

/// The same with what follows from it.
pub struct Tables {
    /// As the ports gave it; parameters are of the model that stands.
    pub reads: ReportReads,
    /// What the controller counts otherwise than the robot file, where it does.
    pub counting: Option<String>,
    /// Findings over what reveals them.
    pub curves: Curves,
    /// The step that the report speaks of; without one, the last.
    pub standing: Option<String>,
    /// Later steps that are worse on the same held-out points.
    pub withdrawn: Vec<Withdrawn>,
    /// The arm where it stands; none where too few points tell.
    pub arm: Option<PlacedArm>,
    /// Content hashes of the tables that the report rests on.
    pub hashes: Vec<(String, String)>,
}

impl Deref for Tables {
    type Target = ReportReads;
    fn deref(&self) -> &ReportReads {
        &self.reads
    }
}

impl Tables {
    /// Findings of all diagnoses, each with its numbers, rivals and formulas.
    fn findings_with_rivals(&self) -> Vec<Value> {
        let mut findings = result::findings(
            self.findings.iter().flat_map(|table| &table.0),
            self.finding_numbers.iter().flat_map(|table| &table.0),
            self.rivals.iter().flat_map(|table| &table.0),
        );
        for finding in &mut findings {
            let rank = finding["rank"].as_i64().unwrap_or_default();
            let forms = self.forms.iter().map(|forms| &forms.table);
            finding["formulas"] = result::formulas(forms, rank);
        }
        findings
    }

    /// What the diagnosis of a step says of a topic.
    fn statements(&self, step: &str, topic: VerdictTopic) -> Vec<&str> {
        self.sentences
            .iter()
            .flat_map(|table| table.about(step, topic))
            .collect()
    }
}

/// The report as HTML and as JSON.
pub struct Pages {
    /// One file that needs no other.
    pub html: String,
    /// What the first page states, for programs.
    pub json: String,
    /// The held-out points of the certificate, as text for spreadsheets.
    pub points: String,
    /// The user's limits and what was found.
    pub acceptance: Acceptance,
    /// What the page says in English since its language lacks it.
    pub missing: Vec<String>,
}

/// The report; fails where `asked.set` is no held-out set.
pub fn pages(tables: &Tables, asked: &Report) -> Result<Pages> {
    let set = asked.set.as_deref();
    let steps = errors::Steps::new(&tables.statistics, tables.standing.as_deref());
    let judgement = certificate::Judgement::new(tables, &asked.limits, set);
    let head = |locale: &Locale| {
        let robot = data::robot_name(locale, &tables.robot);
        let title = asked.title.clone();
        let title = title.unwrap_or_else(|| say!(locale, "Calibration of {robot}", robot));
        (robot, title)
    };
    let json = data::document(tables, asked, head(&Locale::default()), judgement.as_ref())?;
    let locale = &Locale::new(asked.language);
    let (robot, title) = head(locale);
    let choices = [("title", asked.title.as_deref()), ("set", set)];
    let page = json!({
        "title": title,
        "certificate": certificate::certificate(locale, tables, judgement.as_ref(), set),
        "identity": certificate::identity(locale, tables, &asked.identity),
        "held_out": certificate::held_out(tables, set),
        "arm": arm::section(locale, tables),
        "is_short": asked.pages == ReportPages::Short,
        "policy": "; script-src 'unsafe-inline'",
        "hashes": &tables.hashes,
        "diagnosis": findings::section(locale, tables),
        "errors": errors::errors_section(locale, tables, &steps, set)?,
        "closure": errors::closure_section(locale, tables),
        "workspace": errors::workspace_section(locale, &tables.prediction, tables.standing.as_deref()),
        "parameters": parameters::section(locale, &tables.parameters, tables.counting.as_deref()),
        "fits": fits::section(locale, tables, &steps),
        "comparisons": fits::comparisons(tables),
        "data": data::section(locale, tables),
        "choices": choices.into_iter().filter(|(_, value)| value.is_some()).collect::<Vec<_>>(),
        "robot": robot,
        // Steps that do not stand.
        "withdrawn": tables.withdrawn.iter().map(|gone| &gone.step).collect::<Vec<_>>(),
    });
    let html = number::render(locale, "report.html", include_str!("report.html"), page)?;
    let limits = judgement.map(|judgement| judgement.limits);
    Ok(Pages {
        html,
        json,
        points: certificate::points(tables, set)?,
        acceptance: Acceptance(limits.unwrap_or_default()),
        missing: locale.missing(),
    })
}

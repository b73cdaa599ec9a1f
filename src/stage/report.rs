//! `report`: everything the earlier stages found, as one HTML file that a person reads, prints and files.

use crate::effect::Load;
use crate::error::{Error, Fault, Place, Result};
use crate::report::{
    AcceptanceLimits, PageLanguage, ReportOptions, Tables, TorqueTables, pages, torque_page,
};
use crate::robot::RobotModel;
use crate::stage::{Context, Labelled, Stage, curves};
use crate::table::{
    Acceptance, BodyConsistencies, Cells, Contacts, Corrections, Curves, Document, DocumentRow,
    FindingNumbers, Findings, Fit, Forms, Frame, FrictionCurves, Inertials, Intake,
    JointConventions, JointTorques, Observability, Parameters, Prediction, Recording, Rejected,
    Rivals, Robot, Split, Standing, Statistics, Step, Suspects, Table, TorqueCourse,
    TorqueFindings, TorqueNumbers, TorqueRivals, TorqueVerdict, Training, Unseen, Verdict,
    VerdictSentences, standing,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Writes `report.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Report {
    /// Heading of the report; without it, the robot's name.
    pub title: Option<String>,
    /// The held-out set that the first sentence speaks of; without it, the one with most points after the step that stands for the run.
    pub set: Option<String>,
    /// PageLanguage of the page with its certificate: `en` or `de`.
    pub language: PageLanguage,
    /// What is accepted: of the held-out points of the diagnosed model, without a diagnosis after the last step. Beyond it `calib run` says
    /// so and ends with code 1.
    pub limits: Accepted,
    /// Who, with what, where and when, e.g. {operator: A. Meier, tracker: AT960 no. 123, date: 2026-11-21}; shown as given.
    pub identity: BTreeMap<String, String>,
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

crate::stage::stage! {
    Report, "report", 25, "writes one self-contained HTML file: errors before and after, parameters, rejected rows",
        ReportReads {
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
        } -> ReportWrites {
            document: Document,
            acceptance: Acceptance,
            curves: Curves,
        }
}

impl Stage for Report {
    fn sets_named(&self) -> Vec<(String, String)> {
        self.set
            .iter()
            .map(|set| ("set".into(), set.clone()))
            .collect()
    }

    fn run(&self, reads: ReportReads, context: &Context) -> Result<ReportWrites> {
        let curves = self.curves(&reads)?;
        let hashes = hashes(&reads)?;
        // A diagnosis against an outside simulation speaks of that, not of this robot's model.
        let diagnosed = reads
            .findings
            .last()
            .filter(|_| reads.recording.simulated.is_none())
            .map(|findings| &findings.stage);
        let model = |stage: &String| {
            reads
                .models
                .iter()
                .find(|model| model.stage == *stage)
                .map(|model| model.table.clone())
        };
        let step = |step: &Labelled<Prediction>| Step {
            id: step
                .table
                .0
                .first()
                .map_or_else(|| step.stage.clone(), |row| row.step.clone()),
            own: model(&step.stage).is_some(),
            unseen: Unseen::of(&step.table),
        };
        let steps: Vec<Step> = reads.prediction.iter().map(step).collect();
        let wrong = reads.verdict.last().zip(reads.findings.last());
        let wrong =
            wrong.and_then(|(verdict, findings)| verdict.table.wrong_setup(&findings.table));
        let stands = standing(&steps, diagnosed.map(String::as_str));
        let stands = stands.filter(|_| reads.recording.simulated.is_none() && wrong.is_none());
        let withdrawn = stands
            .as_ref()
            .map(|stands| stands.withdrawn.clone())
            .unwrap_or_default();
        stands
            .iter()
            .flat_map(Standing::warnings)
            .for_each(|warning| context.warn(warning));
        let counting = counting(&reads)?;
        let mut standing = stands
            .as_ref()
            .map(|stands| [stands.step.clone(), stands.model.clone()]);
        let (mut statistics, mut prediction) = (reads.statistics, reads.prediction);
        if let Some(carried) = carried(
            standing.as_ref().map(|[step, _]| step),
            &prediction,
            &reads.recording,
        ) {
            prediction.retain(|step| step.table.is_of(&reads.recording));
            statistics
                .0
                .retain(|row| prediction.iter().any(|step| step.stage == row.step));
            standing = Some([carried.clone(), carried]);
        }
        let tables = Tables {
            counting,
            statistics,
            prediction: unlabelled(prediction),
            parameters: standing
                .as_ref()
                .and_then(|[_, stage]| model(stage))
                .unwrap_or(reads.parameters),
            robot: reads.robot,
            recording: reads.recording,
            split: reads.split,
            intake: unlabelled(reads.intake),
            rejected: unlabelled(reads.rejected),
            fit: unlabelled(reads.fit),
            observability: unlabelled(reads.observability),
            training: unlabelled(reads.training),
            corrections: unlabelled(reads.corrections),
            verdict: unlabelled(reads.verdict),
            sentences: unlabelled(reads.sentences),
            findings: unlabelled(reads.findings),
            finding_numbers: unlabelled(reads.finding_numbers),
            rivals: unlabelled(reads.rivals),
            forms: unlabelled(reads.forms),
            cells: unlabelled(reads.cells),
            suspects: unlabelled(reads.suspects),
            curves,
            standing: standing.map(|[step, _]| step),
            withdrawn,
        };
        let Accepted {
            mean_mm,
            p95_mm,
            max_mm,
        } = self.limits;
        let limits = AcceptanceLimits {
            mean_mm,
            p95_mm,
            max_mm,
        };
        let (title, set) = (self.title.as_deref(), self.set.as_deref());
        let options = ReportOptions {
            title,
            set,
            limits,
            language: self.language,
            identity: &self.identity,
            hashes,
        };
        let pages = pages(&tables, &options).map_err(|error| placed(error, context.id))?;
        for text in &pages.missing {
            let language = self.language.code();
            context.warn(format!(
                "the page says this in English, as `{language}` lacks it: {text}"
            ));
        }
        let document = |name: &str, media_type: &str, content| DocumentRow {
            name: name.into(),
            media_type: media_type.into(),
            content,
        };
        let html = document("report.html", "text/html", pages.html);
        let json = document("report.json", "application/json", pages.json);
        Ok(ReportWrites {
            document: Document(vec![html, json]),
            acceptance: pages.acceptance,
            curves: tables.curves,
        })
    }

    fn faults(&self, at: &mut Place) {
        let Accepted {
            mean_mm,
            p95_mm,
            max_mm,
        } = self.limits;
        for (name, limit) in [("mean_mm", mean_mm), ("p95_mm", p95_mm), ("max_mm", max_mm)] {
            let possible = limit.is_none_or(|limit| limit.is_finite() && limit > 0.0);
            at.at(format!("limits.{name}"))
                .must(possible, "expected a length above 0, mm");
        }
    }
}

/// The last step that predicts the recording of the report, where the step that stands predicts another one: the report is of what was
/// carried there.
fn carried(
    standing: Option<&String>,
    prediction: &[Labelled<Prediction>],
    recording: &Recording,
) -> Option<String> {
    let stands = prediction
        .iter()
        .find(|step| Some(&step.stage) == standing)?;
    let here = || prediction.iter().rfind(|step| step.table.is_of(recording));
    if stands.table.is_of(recording) {
        None
    } else {
        here().map(|step| step.stage.clone())
    }
}

impl Report {
    /// Curves of the last diagnosis' findings; none without a diagnosis.
    fn curves(&self, reads: &ReportReads) -> Result<Curves> {
        let Some(findings) = reads
            .findings
            .last()
            .filter(|findings| !findings.table.0.is_empty())
        else {
            return Ok(Curves::default());
        };
        let parameters = reads
            .models
            .iter()
            .find(|model| model.stage == findings.stage);
        let prediction = reads
            .prediction
            .iter()
            .find(|prediction| prediction.stage == findings.stage);
        let (Some(parameters), Some(prediction)) = (parameters, prediction) else {
            return Ok(Curves::default());
        };
        let robot = RobotModel::new(reads.robot.to_description()?);
        let model = parameters.table.model(robot, &[], Load::GravityTorque)?;
        let data = reads.recording.measurements();
        curves::curves(
            &findings.table,
            &parameters.table,
            &model,
            &reads.recording,
            &data,
            &prediction.table,
        )
    }
}

/// What the controller counts otherwise than the robot file, where it does.
fn counting(reads: &ReportReads) -> Result<Option<String>> {
    let Some(convention) = reads.convention.last() else {
        return Ok(None);
    };
    let robot = RobotModel::new(reads.robot.to_description()?);
    Ok(convention.table.to_convention()?.difference(&robot))
}

/// The identity of what the report rests on.
fn hashes(reads: &ReportReads) -> Result<Vec<(String, String)>> {
    let mut out = Vec::new();
    let mut add = |name: String, frame: Frame| out.push((name, frame.table_hash().to_string()));
    add("robot".into(), reads.robot.to_frame()?);
    add("recording".into(), reads.recording.to_frame()?);
    add("split".into(), reads.split.to_frame()?);
    for model in &reads.models {
        add(
            format!("parameters of {}", model.stage),
            model.table.to_frame()?,
        );
    }
    Ok(out)
}

fn unlabelled<T>(tables: Vec<Labelled<T>>) -> Vec<T> {
    tables.into_iter().map(|labelled| labelled.table).collect()
}

/// Faults of the settings with the stage they belong to.
fn placed(error: Error, stage: &str) -> Error {
    match error {
        Error::Spec(faults) => Error::Spec(
            faults
                .into_iter()
                .map(|f| Fault::new(format!("{stage}.{}", f.place), f.message))
                .collect(),
        ),
        other => other,
    }
}

/// Writes `torques.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportTorques {
    /// Heading of the page; without it, the robot's name.
    pub(crate) title: Option<String>,
}

crate::stage::stage! {
    ReportTorques, "report_torques", 5, "writes one self-contained HTML file: torques before and after, friction, what was found",
        ReportTorquesReads {
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
        } -> ReportTorquesWrites {
            document: Document,
        }
}

impl Stage for ReportTorques {
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

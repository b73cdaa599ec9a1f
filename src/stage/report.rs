//! `report`: everything the earlier stages found, as one HTML file that a person reads, prints and files.

use crate::effect::Load;
use crate::error::{Error, Fault, Place, Result};
use crate::estimate::align_points;
use crate::spatial::{Pose, Twist};
use crate::table::{
    Acceptance, Curves, Document, DocumentRow, Frame, Prediction, Recording, Standing, Step, Table,
    Unseen, standing,
};
use crate::{Context, Labelled, Stage, curves};
use calib_numerics::robot::RobotModel;
use calib_report::{
    Page, PageLanguage, PlacedArm, Report, ReportDrivesReads, ReportReads, ReportTorquesReads,
    Tables, drive_page, pages, shown_row, torque_page, untranslated,
};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

crate::stage! {
    Report, "report", 32, "writes one self-contained HTML file: errors before and after, parameters, rejected rows",
        ReportReads -> ReportWrites {
            document: Document,
            acceptance: Acceptance,
            curves: Curves,
        }
}

impl Stage for Report {
    fn sets_named(&self) -> Vec<(String, String)> {
        let set = self.set.iter();
        set.map(|set| ("set".into(), set.clone())).collect()
    }

    fn run(&self, mut reads: ReportReads, context: &Context) -> Result<ReportWrites> {
        let curves = curves_of(&reads)?;
        let hashes = hashes(&reads)?;
        // A diagnosis against an outside simulation speaks of that, not of this robot's model.
        let is_of_robot_file = reads.recording.simulated.is_none();
        let diagnosed = reads.findings.last().filter(|_| is_of_robot_file);
        let diagnosed = diagnosed.map(|findings| findings.stage.as_str());
        let model = |stage: &String| {
            let mut models = reads.models.iter();
            Some(models.find(|model| model.stage == *stage)?.table.clone())
        };
        let step = |step: &Labelled<Prediction>| Step {
            id: match step.0.first() {
                Some(row) => row.step.clone(),
                None => step.stage.clone(),
            },
            is_identified: model(&step.stage).is_some(),
            unseen: Unseen::of(&step.table),
        };
        let steps: Vec<Step> = reads.prediction.iter().map(step).collect();
        let wrong = reads.verdict.last().zip(reads.findings.last());
        let wrong = wrong.and_then(|(verdict, findings)| verdict.wrong_setup(findings));
        let stands = standing(&steps, diagnosed);
        let stands = stands.filter(|_| is_of_robot_file && wrong.is_none());
        let withdrawn = stands.iter().flat_map(|stands| stands.withdrawn.clone());
        let withdrawn = withdrawn.collect();
        context.warn_each(stands.iter().flat_map(Standing::warnings));
        let counting = counting(&reads)?;
        let mut standing = stands.map(|stands| [stands.step, stands.model]);
        let step = standing.as_ref().map(|[step, _]| step);
        if let Some(carried) = carried(step, &reads.prediction, &reads.recording) {
            let prediction = &mut reads.prediction;
            prediction.retain(|step| step.is_of(&reads.recording));
            let rows = &mut reads.statistics.0;
            rows.retain(|row| prediction.iter().any(|step| step.stage == row.step));
            standing = Some([carried.clone(), carried]);
        }
        if let Some(model) = standing.as_ref().and_then(|[_, stage]| model(stage)) {
            reads.parameters = model;
        }
        let step = standing.as_ref().map(|[step, _]| step);
        let arm = placed_arm(&reads, step);
        let tables = Tables {
            arm,
            counting,
            reads,
            curves,
            standing: standing.map(|[step, _]| step),
            withdrawn,
            hashes,
        };
        let pages = pages(&tables, self).map_err(|error| placed(error, context.id))?;
        context.warn_each(untranslated(&pages.missing, self.language));
        let document = |name: &str, media_type: &str, content| DocumentRow {
            name: name.into(),
            media_type: media_type.into(),
            content,
        };
        let html = document("report.html", "text/html", pages.html);
        let json = document("report.json", "application/json", pages.json);
        Ok(ReportWrites {
            document: Document(vec![
                html,
                json,
                document("points.csv", "text/csv", pages.points),
            ]),
            acceptance: pages.acceptance,
            curves: tables.curves,
        })
    }

    fn faults(&self, at: &mut Place) {
        let limits = &self.limits;
        for (name, limit) in [
            ("mean_mm", limits.mean_mm),
            ("p95_mm", limits.p95_mm),
            ("max_mm", limits.max_mm),
        ] {
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
    let mut steps = prediction.iter();
    let stands = steps.find(|step| Some(&step.stage) == standing)?;
    let here = || prediction.iter().rfind(|step| step.is_of(recording));
    let carried = (!stands.is_of(recording)).then(here).flatten();
    carried.map(|step| step.stage.clone())
}

/// Curves of the last diagnosis' findings; none without a diagnosis.
fn curves_of(reads: &ReportReads) -> Result<Curves> {
    let found = reads
        .findings
        .last()
        .filter(|findings| !findings.0.is_empty());
    let diagnosis = found.and_then(|findings| {
        let (mut models, mut steps) = (reads.models.iter(), reads.prediction.iter());
        let parameters = models.find(|model| model.stage == findings.stage)?;
        let prediction = steps.find(|step| step.stage == findings.stage)?;
        Some((findings, parameters, prediction))
    });
    let Some((findings, parameters, prediction)) = diagnosis else {
        return Ok(Curves::default());
    };
    let (robot, recording) = (reads.robot.to_description()?, &reads.recording);
    let model = parameters.model(RobotModel::new(robot), &[], Load::GravityTorque)?;
    let data = recording.measurements();
    curves::curves(findings, parameters, &model, recording, &data, prediction)
}

/// The nominal arm where it stands in the instrument's frame, by the points themselves, in the pose of the largest error before anything.
fn placed_arm(reads: &ReportReads, standing: Option<&String>) -> Option<PlacedArm> {
    const FEWEST: usize = 4;
    let named = |table: &&Labelled<Prediction>| {
        table.0.first().map(|row| &row.step) == standing && table.is_of(&reads.recording)
    };
    let last = reads.prediction.iter().rfind(named);
    let first = reads.prediction.first()?;
    let last = last.or(reads.prediction.last())?;
    let rows = last.0.len().min(first.0.len()).min(reads.recording.rows());
    // A picture is no reason to fail: a table that is no whole robot has none.
    let robot = reads.robot.to_description().map(RobotModel::new);
    let robot = robot
        .ok()
        .filter(|robot| robot.joints() == reads.recording.joints)?;
    let is_usable = |row: &usize| {
        let predicted = &last.0[*row];
        let place = [predicted.x_mm, predicted.y_mm, predicted.z_mm];
        !predicted.suspect && place.iter().all(|mm| mm.is_finite())
    };
    let used: Vec<usize> = (0..rows).filter(is_usable).collect();
    let row = shown_row(&first.0[..rows]).filter(|_| used.len() >= FEWEST)?;
    let metres = |at: &usize| {
        let row = &last.0[*at];
        Vector3::new(row.x_mm, row.y_mm, row.z_mm) * 1e-3
    };
    let commanded = |at: &usize| robot.forward(reads.recording.q(*at)).translation;
    let model: Vec<Vector3<f64>> = used.iter().map(commanded).collect();
    let seen: Vec<Vector3<f64>> = used.iter().map(metres).collect();
    let base = align_points(&model, &seen);
    let mm = |point: &Vector3<f64>| [0, 1, 2].map(|axis| 1e3 * point[axis]);
    let mut rows = [0.0; 12];
    for (place, number) in rows.iter_mut().enumerate() {
        let (row, column) = (place / 4, place % 4);
        *number = match column {
            3 => 1e3 * base.translation[row],
            _ => base.rotation[(row, column)],
        };
    }
    let (mut body, mut chain) = (Pose::identity(), vec![[0.0; 3]]);
    // Of each axis the point nearest to what it carries: a file may name any.
    let tool = robot.home().translation;
    let (mut points, mut carried) = (vec![tool; robot.joints()], tool);
    for joint in (0..robot.joints()).rev() {
        let (axis, point) = (robot.axis(joint), robot.point(joint));
        carried = point + axis * axis.dot(&(carried - point));
        points[joint] = carried;
    }
    let mut joints = Vec::new();
    for (joint, travel) in reads.recording.q(row).iter().enumerate() {
        let (axis, point) = (robot.axis(joint), &points[joint]);
        chain.push(mm(&body.point(point)));
        let twist = match robot.is_revolute(joint) {
            true => {
                let about = point.cross(axis);
                Twist::new(about.x, about.y, about.z, axis.x, axis.y, axis.z)
            }
            false => Twist::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0),
        };
        body = body * Pose::exp(&(twist * *travel));
        joints.push(((*axis).into(), mm(point), !robot.is_revolute(joint)));
    }
    chain.push(mm(&body.point(&tool)));
    Some(PlacedArm {
        base: rows,
        joints,
        tool: mm(&tool),
        chain,
        row,
    })
}

/// What the controller counts otherwise than the robot file, where it does.
fn counting(reads: &ReportReads) -> Result<Option<String>> {
    let Some(convention) = reads.convention.last() else {
        return Ok(None);
    };
    let robot = RobotModel::new(reads.robot.to_description()?);
    Ok(convention.to_convention()?.difference(&robot))
}

/// The identity of what the report rests on.
fn hashes(reads: &ReportReads) -> Result<Vec<(String, String)>> {
    let mut out = Vec::new();
    let mut add = |name: String, frame: Frame| out.push((name, frame.table_hash().to_string()));
    add("robot".into(), reads.robot.to_frame()?);
    add("recording".into(), reads.recording.to_frame()?);
    add("split".into(), reads.split.to_frame()?);
    for model in &reads.models {
        add(format!("parameters of {}", model.stage), model.to_frame()?);
    }
    Ok(out)
}

/// Faults of the settings with the stage they belong to.
fn placed(error: Error, stage: &str) -> Error {
    let Error::Spec(faults) = error else {
        return error;
    };
    let faults = faults.into_iter();
    let placed = faults.map(|fault| Fault::new(format!("{stage}.{}", fault.place), fault.message));
    Error::Spec(placed.collect())
}

/// Writes `torques.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportTorques {
    /// Heading of the page; without it, the robot's name.
    pub title: Option<String>,
    /// Language of the page: `en` or `de`.
    pub language: PageLanguage,
}

crate::stage! {
    ReportTorques, "report_torques", 14, "writes one self-contained HTML file: torques before and after, friction, what was found",
        ReportTorquesReads -> ReportTorquesWrites {
            document: Document,
        }
}

impl Stage for ReportTorques {
    fn run(&self, reads: ReportTorquesReads, context: &Context) -> Result<ReportTorquesWrites> {
        let hash = |name: &str, frame: Frame| (name.into(), frame.table_hash().to_string());
        let hashes = vec![
            hash("robot", reads.robot.to_frame()?),
            hash("findings", reads.findings.to_frame()?),
            hash("course", reads.course.to_frame()?),
        ];
        let page = torque_page(&reads, self.title.as_deref(), self.language, &hashes)?;
        Ok(ReportTorquesWrites {
            document: document("torques.html", page, self.language, context),
        })
    }
}

/// Writes `drives.html`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportDrives {
    /// Heading of the page.
    pub title: Option<String>,
    /// Language of the page: `en` or `de`.
    pub language: PageLanguage,
}

crate::stage! {
    ReportDrives, "report_drives", 5, "writes one self-contained HTML file: commanded, measured and simulated angles before and after, what was found",
        ReportDrivesReads -> ReportDrivesWrites {
            document: Document,
        }
}

impl Stage for ReportDrives {
    fn run(&self, reads: ReportDrivesReads, context: &Context) -> Result<ReportDrivesWrites> {
        let page = drive_page(&reads, self.title.as_deref(), self.language)?;
        Ok(ReportDrivesWrites {
            document: document("drives.html", page, self.language, context),
        })
    }
}

/// A page as the only document of a stage, which warns of what its language lacks.
fn document(name: &str, page: Page, language: PageLanguage, context: &Context) -> Document {
    context.warn_each(page.untranslated(language));
    Document(vec![DocumentRow {
        name: name.into(),
        media_type: "text/html".into(),
        content: page.html,
    }])
}

//! The page of a diagnosis of drives: what was found, and commanded, measured and simulated angles of the two worst joints over time.

use super::language::Locale;
use super::number::render;
use super::result;
use super::torques::over_time;
use crate::error::{Error, Result};
use crate::table::{
    DriveCourse, DriveSimulation, DriveVerdict, FindingNumbers, Findings, JointDriveRow,
    JointDrives, Rivals,
};
use serde_json::{Value, json};

/// What the page is made of.
pub(crate) struct DrivePage<'a> {
    pub(crate) verdict: &'a DriveVerdict,
    pub(crate) findings: &'a Findings,
    pub(crate) numbers: &'a FindingNumbers,
    pub(crate) rivals: &'a Rivals,
    pub(crate) joints: &'a JointDrives,
    pub(crate) simulation: &'a DriveSimulation,
    pub(crate) course: &'a DriveCourse,
}

/// Joints whose curves are shown.
const SHOWN: usize = 2;

/// The page; fails where the verdict is missing.
pub(crate) fn drive_page(tables: &DrivePage) -> Result<String> {
    let verdict = tables.verdict.0.first();
    let verdict =
        verdict.ok_or_else(|| Error::Bug("a diagnosis of drives without a verdict".into()))?;
    let locale = Locale::default();
    let names = tables.simulation.joints();
    let mut worst: Vec<&JointDriveRow> = tables.joints.0.iter().collect();
    worst.sort_by(|a, b| b.before_rms_rad.total_cmp(&a.before_rms_rad));
    let worst = worst.into_iter().take(SHOWN);
    let pictures: Vec<Value> = worst
        .map(|row| pictures(&locale, tables.course, row.joint as usize - 1, &names))
        .collect();
    let page = json!({
        "title": "Commanded and measured joints",
        "joints": names,
        "verdict": verdict,
        "findings": result::findings(&tables.findings.0, &tables.numbers.0, &tables.rivals.0),
        "errors": &tables.joints.0,
        "pictures": pictures,
    });
    render(&locale, "drives.html", include_str!("drives.html"), page)
}

/// Of held-out rows, of all where none are.
fn pictures(locale: &Locale, course: &DriveCourse, joint: usize, names: &[&str]) -> Value {
    let any = course.held_out.contains(&true);
    let rows: Vec<usize> = (0..course.time.len())
        .filter(|row| course.held_out[*row] == any)
        .collect();
    let of_joint = |all: &[f64]| -> Vec<f64> {
        let at = |row: &usize| all[row * course.joints + joint];
        rows.iter().map(at).collect()
    };
    let (command, measured) = (of_joint(&course.command), of_joint(&course.measured));
    let (before, after) = (of_joint(&course.simulated), of_joint(&course.corrected));
    let error = |simulated: &[f64]| -> Vec<f64> {
        let pairs = measured.iter().zip(simulated);
        pairs.map(|(m, s)| 1e3 * (m - s)).collect()
    };
    let time: Vec<f64> = rows.iter().map(|row| course.time[*row]).collect();
    let shaded = vec![false; time.len()];
    let clock = (time.as_slice(), shaded.as_slice());
    let name = format!("joint {} ({})", joint + 1, names[joint]);
    let angles = [
        ("s3", command.as_slice()),
        ("s0", &measured),
        ("s1", &before),
        ("s-last", &after),
    ];
    let errors = [error(&before), error(&after)];
    let errors = [("s1", errors[0].as_slice()), ("s-last", &errors[1])];
    json!({
        "angle": over_time(locale, clock, &angles, [&format!("angle of {name}: commanded, measured, simulated before and after"), "rad"]),
        "error": over_time(locale, clock, &errors, [&format!("error of {name} before and after"), "mrad"]),
        "name": name,
    })
}

//! The page of a diagnosis of drives: what was found; commanded, measured and simulated angles of the two worst joints over time, and their
//! errors over time and speed.

use super::curves::{over_quantity, over_time};
use super::followed::{FollowedFinding, grid};
use super::language::{Locale, PageLanguage, say};
use super::number::render;
use super::result;
use super::{Page, worst_first};
use crate::error::{Error, Result};
use crate::table::{
    DriveCourse, DriveSimulation, DriveVerdict, FindingNumbers, Findings, JointDrives, Rivals,
};
use serde_json::{Value, json};

crate::table::reads! {
    /// What the page is made of.
    pub struct ReportDrivesReads {
        verdict: DriveVerdict,
        findings: Findings,
        numbers: FindingNumbers,
        rivals: Rivals,
        joints: JointDrives,
        simulation: DriveSimulation,
        course: DriveCourse,
    }
}

/// The page; fails where the verdict is missing.
pub fn drive_page(
    tables: &ReportDrivesReads,
    title: Option<&str>,
    language: PageLanguage,
) -> Result<Page> {
    let verdict = tables.verdict.0.first();
    let verdict =
        verdict.ok_or_else(|| Error::Bug("a diagnosis of drives without a verdict".into()))?;
    let locale = Locale::new(language);
    let names = tables.simulation.joints();
    let errors = tables.joints.0.iter();
    let errors: Vec<f64> = errors.map(|row| row.before_rms_rad).collect();
    let (worst, _) = worst_first(&errors);
    let pictures = worst
        .iter()
        .map(|joint| pictures(&locale, &tables.course, *joint, &names));
    let followed: Vec<FollowedFinding> = tables
        .findings
        .0
        .iter()
        .map(|row| FollowedFinding {
            effect: &row.effect,
            place: &row.place,
            follows: row.follows.as_deref().unwrap_or_default(),
            size: MRAD * row.effect_rms_rad.unwrap_or_default(),
        })
        .collect();
    let page = json!({
        "title": title.map_or_else(|| say!(locale, "Commanded and measured joints"), str::to_owned),
        "joints": names,
        "verdict": verdict,
        "grid": grid(&followed),
        "findings": result::findings(&tables.findings.0, &tables.numbers.0, &tables.rivals.0),
        "errors": &tables.joints.0,
        "pictures": pictures.collect::<Vec<Value>>(),
    });
    let html = render(&locale, "drives.html", include_str!("drives.html"), page)?;
    Ok(Page {
        html,
        missing: locale.missing(),
    })
}

/// mrad of a rad.
const MRAD: f64 = 1e3;

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
        pairs.map(|(m, s)| MRAD * (m - s)).collect()
    };
    let time: Vec<f64> = rows.iter().map(|row| course.time[*row]).collect();
    let shaded = vec![false; time.len()];
    let clock = (time.as_slice(), shaded.as_slice());
    let joint_name = names.get(joint).copied().unwrap_or_default();
    let name = say!(
        locale,
        "joint {joint} ({name})",
        joint = joint + 1,
        name = joint_name
    );
    let angles = [
        ("s3", command.as_slice()),
        ("s0", &measured),
        ("s1", &before),
        ("s-last", &after),
    ];
    let errors = [error(&before), error(&after)];
    let errors = [("s1", errors[0].as_slice()), ("s-last", &errors[1])];
    let angle_title = say!(
        locale,
        "angle of {name}: commanded, measured, simulated before and after",
        name
    );
    let error_title = say!(locale, "error of {name} before and after", name);
    let speed_title = say!(
        locale,
        "error of {name} over its speed, before and after",
        name
    );
    let across = say!(locale, "simulated velocity, {unit}", unit = "rad/s");
    json!({
        "angle": over_time(locale, clock, &angles, [&angle_title, "rad"]),
        "error": over_time(locale, clock, &errors, [&error_title, "mrad"]),
        "speed": over_quantity(locale, &speeds(&time, &after), &errors, [&speed_title, &across, "mrad"]),
        "name": name,
    })
}

/// Velocity of a simulated angle, whose differences no encoder makes noisy; zero where a trajectory begins.
fn speeds(time: &[f64], angle: &[f64]) -> Vec<f64> {
    let of_row = |row: usize| {
        let lasted = time[row] - time[row - 1];
        (lasted > 0.0).then(|| (angle[row] - angle[row - 1]) / lasted)
    };
    let rows = 0..time.len();
    rows.map(|row| if row == 0 { None } else { of_row(row) }.unwrap_or_default())
        .collect()
}

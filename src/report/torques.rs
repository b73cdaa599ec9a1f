//! The page of a diagnosis of torques: what was found; of the two worst joints measured, simulated and corrected torque over time and the
//! error over speed and load, of the others over time alone.

use super::curves::{WIDTH, over_quantity, over_time};
use super::data;
use super::followed::{FollowedFinding, grid};
use super::language::{Locale, PageLanguage, say};
use super::number::render;
use super::result;
use super::svg::{Area, Scale, Svg, baseline, name_x, name_y};
use super::{Page, worst_first};
use crate::error::{Error, Result};
use crate::table::{
    BodyConsistencies, Contacts, FrictionCurveRow, FrictionCurves, Inertials, JointTorques,
    Labelled, Robot, TorqueCourse, TorqueFindings, TorqueNumbers, TorqueRivals, TorqueVerdict,
    VerdictSentences, VerdictTopic,
};
use serde_json::{Value, json};

crate::table::reads! {
    /// What the page is made of; sentences are of every diagnosis, each asked for by its step.
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

/// The page; fails where the verdict is missing.
pub fn torque_page(
    tables: &ReportTorquesReads,
    title: Option<&str>,
    language: PageLanguage,
    hashes: &[(String, String)],
) -> Result<Page> {
    let verdict = tables.verdict.0.first();
    let verdict =
        verdict.ok_or_else(|| Error::Bug("a diagnosis of torques without a verdict".into()))?;
    let locale = Locale::new(language);
    let robot = data::robot_name(&locale, &tables.robot);
    let sentences_of = |topic| -> Vec<&str> {
        let all = tables.sentences.iter();
        all.flat_map(|table| table.about(&verdict.step, topic))
            .collect()
    };
    let errors = tables.joints.0.iter();
    let errors: Vec<f64> = errors.map(|row| row.before_rms_nm).collect();
    let (worst, others) = worst_first(&errors);
    let joints = worst.iter().map(|joint| (*joint, true));
    let joints = joints.chain(others.iter().map(|joint| (*joint, false)));
    let followed: Vec<FollowedFinding> = tables
        .findings
        .0
        .iter()
        .map(|row| FollowedFinding {
            effect: &row.effect,
            place: &row.place,
            follows: row.follows.as_deref().unwrap_or_default(),
            size: row.effect_rms_nm,
        })
        .collect();
    let page = json!({
        "title": title.map_or_else(|| say!(locale, "Torques of {robot}", robot), str::to_owned),
        "robot": robot,
        "joints": tables.course.joints,
        "slides": &tables.course.prismatic,
        "verdict": verdict,
        "grid": grid(&followed),
        "findings": result::findings(&tables.findings.0, &tables.numbers.0, &tables.rivals.0),
        "errors": &tables.joints.0,
        "pictures": joints.map(|(joint, is_worst)| pictures(&locale, tables, joint, is_worst)).collect::<Vec<_>>(),
        "contacts": &tables.contacts.0,
        "inertials": &tables.inertials.0,
        "bodies": &tables.consistency.0,
        "not_observable": sentences_of(VerdictTopic::NotObservable),
        "remarks": sentences_of(VerdictTopic::Remark),
        "hashes": hashes,
    });
    let html = render(&locale, "torques.html", include_str!("torques.html"), page)?;
    Ok(Page {
        html,
        missing: locale.missing(),
    })
}

fn pictures(locale: &Locale, tables: &ReportTorquesReads, joint: usize, is_worst: bool) -> Value {
    let course = &tables.course;
    let of_joint = |all: &[f64]| course.of_joint(all, joint).collect::<Vec<f64>>();
    let (measured, simulated, corrected) = (
        of_joint(&course.measured),
        of_joint(&course.simulated),
        of_joint(&course.corrected),
    );
    let less = |model: &[f64]| {
        measured
            .iter()
            .zip(model)
            .map(|(m, model)| m - model)
            .collect::<Vec<f64>>()
    };
    let (before, after) = (less(&simulated), less(&corrected));
    let slides = course.prismatic[joint];
    let [unit, speed_unit] = match slides {
        true => ["N", "m/s"],
        false => ["Nm", "rad/s"],
    };
    let name = say!(locale, "joint {joint}", joint = joint + 1);
    let clock = (course.time.as_slice(), course.held_out.as_slice());
    let torque = [
        ("s1", simulated.as_slice()),
        ("s0", &measured),
        ("s-last", &corrected),
    ];
    let errors = [("s1", before.as_slice()), ("s-last", &after)];
    let curve: Vec<&FrictionCurveRow> = tables
        .friction
        .0
        .iter()
        .filter(|row| row.joint == joint as i64 + 1)
        .collect();
    let over = |quantity: Vec<f64>, title: String, across: String| {
        is_worst.then(|| over_quantity(locale, &quantity, &errors, [&title, &across, unit]))
    };
    let course_title = say!(
        locale,
        "torque of {name}: measured, simulated, corrected",
        name
    );
    let error_title = say!(locale, "error of {name} before and after", name);
    json!({
        "torque": over_time(locale, clock, &torque, [&course_title, unit]),
        "error": over_time(locale, clock, &errors, [&error_title, unit]),
        "speed": over(
            of_joint(&course.velocity),
            say!(locale, "error of {name} over its speed, before and after", name),
            say!(locale, "velocity, {unit}", unit = speed_unit),
        ),
        "load": over(
            simulated.clone(),
            say!(locale, "error of {name} over its load, before and after", name),
            say!(locale, "simulated torque, {unit}", unit),
        ),
        "friction": (!curve.is_empty()).then(|| friction(locale, &curve, slides, &say!(locale, "friction of {name}", name))),
        "name": name,
    })
}

/// Friction over velocity with a band of two standard deviations.
fn friction(locale: &Locale, curve: &[&FrictionCurveRow], slides: bool, title: &str) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 200.0]);
    let ends = |sign: f64| {
        curve
            .iter()
            .map(move |row| row.torque_nm + sign * 2.0 * row.sigma_nm)
    };
    let (low, high) = (
        ends(-1.0).fold(0.0, f64::min),
        ends(1.0).fold(0.0, f64::max),
    );
    let velocity = || curve.iter().map(|row| row.velocity_rad_s);
    let x = Scale::linear(
        velocity().fold(0.0, f64::min),
        velocity().fold(0.0, f64::max),
    )
    .over(area.left, area.right);
    let y = Scale::linear(low, high).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    x.grid_x(&mut svg, area, 6);
    y.grid_y(&mut svg, area, 5);
    let point = |row: &&FrictionCurveRow, sigmas: f64| {
        [
            x.at(row.velocity_rad_s),
            y.at(row.torque_nm + sigmas * row.sigma_nm),
        ]
    };
    let upper = curve.iter().map(|row| point(row, 2.0));
    let lower = curve.iter().rev().map(|row| point(row, -2.0));
    svg.path("band s-last", &upper.chain(lower).collect::<Vec<_>>());
    svg.path(
        "curve s-last",
        &curve.iter().map(|row| point(row, 0.0)).collect::<Vec<_>>(),
    );
    baseline(&mut svg, area);
    let [speed, torque] = match slides {
        true => ["m/s", "N"],
        false => ["rad/s", "Nm"],
    };
    name_x(
        &mut svg,
        area,
        &say!(locale, "velocity, {unit}", unit = speed),
    );
    name_y(
        &mut svg,
        area,
        &say!(locale, "friction, {unit}", unit = torque),
    );
    svg.finish(title)
}

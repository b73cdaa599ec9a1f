//! The page of a diagnosis of torques: what was found, and measured, simulated and corrected torque of each joint over time.

use super::data;
use super::language::Locale;
use super::number::{self, count, fixed, significant};
use super::svg::{Area, Scale, Svg, baseline, name_x, name_y};
use crate::error::{Error, Result};
use crate::table::{
    BodyConsistencies, BodyConsistencyRow, ContactRow, Contacts, FrictionCurveRow, FrictionCurves,
    InertialRow, Inertials, JointTorqueRow, JointTorques, Robot, TorqueCourse, TorqueFindingRow,
    TorqueFindings, TorqueNumbers, TorqueRivals, TorqueVerdict, TorqueVerdictRow, VerdictSentences,
    VerdictTopic,
};
use serde_json::{Value, json};

/// What the page is made of.
pub struct TorqueTables {
    /// The arm.
    pub(crate) robot: Robot,
    /// The verdict.
    pub(crate) verdict: TorqueVerdict,
    /// What the diagnosis says beside it.
    pub(crate) sentences: VerdictSentences,
    /// Strongest first.
    pub(crate) findings: TorqueFindings,
    /// Their numbers.
    pub(crate) numbers: TorqueNumbers,
    /// What would explain the data as well.
    pub(crate) rivals: TorqueRivals,
    /// Errors and noise.
    pub(crate) joints: JointTorques,
    /// Torques over time.
    pub(crate) course: TorqueCourse,
    /// Friction over velocity.
    pub(crate) friction: FrictionCurves,
    /// Masses as the torques show them.
    pub(crate) inertials: Inertials,
    /// Pushes on the arm.
    pub(crate) contacts: Contacts,
    /// Whether the inertials are those of bodies.
    pub(crate) consistency: BodyConsistencies,
    /// Content hashes of the tables that the page rests on.
    pub(crate) hashes: Vec<(String, String)>,
}

/// The page; fails where the verdict is missing.
pub fn torque_page(tables: &TorqueTables, title: Option<&str>) -> Result<String> {
    let verdict = tables.verdict.0.first();
    let verdict =
        verdict.ok_or_else(|| Error::Bug("a diagnosis of torques without a verdict".into()))?;
    let locale = Locale::default();
    let robot = data::robot_name(&locale, &tables.robot);
    let said = |topic| tables.sentences.about(&verdict.step, topic);
    let page = json!({
        "title": title.map_or_else(|| format!("Torques of {robot}"), str::to_owned),
        "robot": robot,
        "joints": tables.course.joints,
        "rows": count(verdict.rows),
        "kind": if verdict.verdict == "unexplained" { "open" } else { "better" },
        "sentence": format!("{}: {}", verdict.verdict.replace('_', " "), verdict.statement),
        "facts": facts(verdict),
        "findings": findings(tables),
        "withdrawn": said(VerdictTopic::Withdrawn),
        "errors": errors(&tables.joints),
        "pictures": (0..tables.course.joints).map(|joint| pictures(&locale, tables, joint)).collect::<Vec<_>>(),
        "contacts": contacts(&tables.contacts),
        "inertials": inertials(&tables.inertials),
        "bodies": bodies(&tables.consistency),
        "not_observable": said(VerdictTopic::NotObservable),
        "remarks": said(VerdictTopic::Remark),
        "hashes": &tables.hashes,
    });
    number::render(&locale, "torques.html", include_str!("torques.html"), page)
}

fn facts(verdict: &TorqueVerdictRow) -> Vec<String> {
    let rows = if verdict.held_out {
        "held-out rows"
    } else {
        "fitted rows (none are held out: flattered)"
    };
    let masses = match verdict.base_parameters {
        Some(count) => format!(
            "masses are identified freely, {count} numbers: their errors cannot be findings"
        ),
        None => "masses are free within their declared tolerance".into(),
    };
    vec![
        format!(
            "rms of measured minus simulated torque over that of measured torque about its mean, mean over joints, {rows}: {} before, \
             {} with the findings",
            fixed(verdict.before_nrmse, 3),
            fixed(verdict.after_nrmse, 3)
        ),
        masses,
        format!(
            "recorded: {}; {} rows at {} Hz after a low-pass of {} Hz on both sides",
            if verdict.signal == "current" {
                "motor currents"
            } else {
                "joint torques"
            },
            count(verdict.rows),
            fixed(verdict.rate_hz, 1),
            fixed(verdict.cutoff_hz, 1)
        ),
    ]
}

fn findings(tables: &TorqueTables) -> Vec<Value> {
    let view = |row: &TorqueFindingRow| {
        let numbers = tables
            .numbers
            .0
            .iter()
            .filter(|number| number.rank == row.rank)
            .map(|number| {
                let sigma = number.sigma.map_or_else(String::new, |sigma| {
                    format!(" \u{b1} {}", significant(sigma, 2))
                });
                format!(
                    "{} {}{sigma} {}",
                    number.name,
                    significant(number.value, 4),
                    number.unit
                )
            });
        let rivals = tables
            .rivals
            .0
            .iter()
            .filter(|rival| rival.rank == row.rank);
        let rivals = rivals.map(|rival| {
            format!(
                "{} at {} {}",
                rival.effect,
                rival.place,
                fixed(rival.probability, 2)
            )
        });
        json!({
            "statement": row.statement,
            "probability": format!(
                "{} {}, at {} {}",
                row.effect,
                fixed(row.probability, 2),
                row.place,
                fixed(row.place_probability, 2)
            ),
            "numbers": numbers.collect::<Vec<_>>().join(", "),
            "rivals": rivals.collect::<Vec<_>>().join(", "),
        })
    };
    tables.findings.0.iter().map(view).collect()
}

fn errors(joints: &JointTorques) -> Vec<Vec<String>> {
    let nm = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 3));
    let row = |row: &JointTorqueRow| {
        vec![
            format!("joint {}", row.joint),
            nm(Some(row.before_rms_nm)),
            nm(Some(row.after_rms_nm)),
            nm(row.after_moving_rms_nm),
            nm(row.after_rest_rms_nm),
            nm(Some(row.noise_nm)),
            fixed(row.autocorrelation, 1),
            fixed(row.before_nrmse, 3),
            fixed(row.after_nrmse, 3),
            row.signature.clone().unwrap_or_default(),
        ]
    };
    joints.0.iter().map(row).collect()
}

fn contacts(contacts: &Contacts) -> Vec<Vec<String>> {
    let row = |row: &ContactRow| {
        let force = [
            (row.force_x_n, row.sigma_x_n),
            (row.force_y_n, row.sigma_y_n),
            (row.force_z_n, row.sigma_z_n),
        ];
        let force = force.map(|(force, sigma)| {
            format!("{} \u{b1} {}", significant(force, 3), significant(sigma, 2))
        });
        vec![
            row.event.to_string(),
            fixed(row.start_s, 2),
            fixed(row.end_s, 2),
            row.joints.clone(),
            force.join(", "),
        ]
    };
    contacts.0.iter().map(row).collect()
}

fn inertials(inertials: &Inertials) -> Vec<Vec<String>> {
    let row = |row: &InertialRow| {
        vec![
            format!("link {}", row.link),
            row.quantity.clone(),
            row.declared
                .map_or_else(String::new, |value| significant(value, 4)),
            significant(row.value, 4),
            significant(row.sigma, 2),
            row.unit.clone(),
        ]
    };
    inertials.0.iter().map(row).collect()
}

fn bodies(consistency: &BodyConsistencies) -> Vec<Vec<String>> {
    let row = |row: &BodyConsistencyRow| {
        vec![
            format!("link {}", row.link),
            significant(row.mass_kg, 4),
            significant(row.spread_kg_m2, 3),
            row.sigma_kg_m2
                .map_or_else(String::new, |sigma| significant(sigma, 2)),
            match (row.enforced == Some(true), row.consistent) {
                (true, _) => "no body had these numbers: moved to the nearest body",
                (false, true) => "a body has these numbers",
                (false, false) => "no body has these numbers",
            }
            .into(),
        ]
    };
    consistency.0.iter().map(row).collect()
}

fn pictures(locale: &Locale, tables: &TorqueTables, joint: usize) -> Value {
    let course = &tables.course;
    let of = |all: &[f64]| course.of_joint(all, joint).collect::<Vec<f64>>();
    let (measured, simulated, corrected) = (
        of(&course.measured),
        of(&course.simulated),
        of(&course.corrected),
    );
    let less = |model: &[f64]| {
        measured
            .iter()
            .zip(model)
            .map(|(m, model)| m - model)
            .collect::<Vec<f64>>()
    };
    let (before, after) = (less(&simulated), less(&corrected));
    let name = format!("joint {}", joint + 1);
    let torque = [
        ("s1", simulated.as_slice()),
        ("s0", &measured),
        ("s-last", &corrected),
    ];
    let curve: Vec<&FrictionCurveRow> = tables
        .friction
        .0
        .iter()
        .filter(|row| row.joint == joint as i64 + 1)
        .collect();
    json!({
        "torque": over_time(locale, course, &torque, &format!("torque of {name}: measured, simulated, corrected")),
        "error": over_time(locale, course, &[("s1", &before), ("s-last", &after)], &format!("error of {name} before and after")),
        "friction": (!curve.is_empty()).then(|| friction(locale, &curve, &format!("friction of {name}"))),
        "name": name,
    })
}

const WIDTH: f64 = 640.0;
/// Steps of time in a picture: more would not be seen; of each the least and the largest value are drawn.
const STEPS: usize = 300;
/// Steps of the clock without rows that break a line.
const GAP: f64 = 8.0;

/// Lines over time; what is held out is shaded.
fn over_time(
    locale: &Locale,
    course: &TorqueCourse,
    lines: &[(&str, &[f64])],
    title: &str,
) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 200.0]);
    let (first, last) = (
        course.time.first().copied().unwrap_or(0.0),
        course.time.last().copied().unwrap_or(1.0),
    );
    let all = || lines.iter().flat_map(|(_, values)| values.iter().copied());
    let (low, high) = (
        all().fold(f64::INFINITY, f64::min),
        all().fold(f64::NEG_INFINITY, f64::max),
    );
    let x = Scale::linear(first, last).over(area.left, area.right);
    let y = Scale::linear(low.min(0.0), high.max(0.0)).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    let stretches = stretches(&course.time);
    for rows in &stretches {
        let held = |row: &usize| course.held_out.get(*row).copied().unwrap_or(false);
        if let (Some(from), Some(to)) = (rows.clone().find(held), rows.clone().rfind(held)) {
            let (left, right) = (x.at(course.time[from]), x.at(course.time[to]));
            svg.rect(
                "held",
                [left, area.top],
                [right - left, area.bottom - area.top],
            );
        }
    }
    x.grid_x(&mut svg, area, 8);
    y.grid_y(&mut svg, area, 5);
    let every = course.time.len().div_ceil(STEPS).max(1);
    for (colour, values) in lines {
        for rows in &stretches {
            let mut points = Vec::new();
            for from in rows.clone().step_by(every) {
                let step = from..(from + every).min(rows.end);
                let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
                let mut ends = [step.clone().min_by(by_value), step.max_by(by_value)];
                ends.sort();
                points.extend(
                    ends.into_iter()
                        .flatten()
                        .map(|row| [x.at(course.time[row]), y.at(values[row])]),
                );
            }
            points.dedup();
            svg.path(&format!("curve {colour}"), &points);
        }
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, "time, s");
    name_y(&mut svg, area, "Nm");
    svg.finish(title)
}

/// Rows without a gap of the clock.
fn stretches(time: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let mut stretches = Vec::new();
    let mut begin = 0;
    for row in 1..time.len() {
        if time[row] - time[row - 1] > GAP * usual {
            stretches.push(begin..row);
            begin = row;
        }
    }
    stretches.push(begin..time.len());
    stretches
}

/// Friction over velocity with a band of two standard deviations.
fn friction(locale: &Locale, curve: &[&FrictionCurveRow], title: &str) -> String {
    let area = Area::new([52.0, 26.0, 406.0, 200.0]);
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
    let mut svg = Svg::new(locale, 420.0, area.bottom + 38.0);
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
    name_x(&mut svg, area, "velocity, rad/s");
    name_y(&mut svg, area, "friction, Nm");
    svg.finish(title)
}

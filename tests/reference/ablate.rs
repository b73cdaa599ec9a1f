//! Scores of concealed recordings with each criterion halved and doubled, a line of JSON each; `ablate.py` runs it and makes the table.
//!
//!     ablate SEED FIRST COUNT POINTS [CRITERION ...]
//!
//! Recordings FIRST to FIRST + COUNT of the seed, in three worlds by turns: one cause of the list, the same with that cause taken out of the
//! list, and physics of no list; POINTS to fit, 0 for 50 to 400. Only what a recording came by is scaled; `-` for no criterion.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program of its own"
)]

use calib_diagnose::{Diagnosis, Question, VerdictKind, diagnose, wrong_setup};
use calib_numerics::criteria::{CriterionFactor, reached, scale};
use calib_numerics::estimate::gauge;
use calib_numerics::robot::{Measurements, NoiseBasis, PointReadings, RobotModel, Sequence};
use calib_twin::conceal::case::Case;
use calib_twin::conceal::design::{Content, Design};
use calib_twin::conceal::family::Column;
use calib_twin::conceal::points::FIT;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// The recording as a user would have it.
fn measured(case: &Case) -> Measurements {
    let shown = |column: Column| !case.hidden.contains(&column);
    let shots = &case.shots;
    let mut data = Measurements {
        joints: case.robot.joints.len(),
        q: shots
            .iter()
            .flat_map(|shot| shot.q.iter().copied())
            .collect(),
        points: PointReadings {
            position: shots
                .iter()
                .map(|shot| Vector3::from(shot.position))
                .collect(),
            sigma: shots
                .iter()
                .map(|shot| Vector3::repeat(shot.sigma))
                .collect(),
        },
        payload: case.payload_kg.clone(),
        time: shown(Column::Time).then(|| shots.iter().map(|shot| shot.time_s).collect()),
        temperature: shown(Column::Temperature).then(|| case.thermometer_c.clone()),
        current: shown(Column::Current).then(|| {
            shots
                .iter()
                .flat_map(|shot| shot.current.iter().copied())
                .collect()
        }),
        direction: shown(Column::Direction).then(|| {
            shots
                .iter()
                .flat_map(|shot| shot.direction.iter().copied())
                .collect()
        }),
        noise_basis: NoiseBasis::Instrument,
        ..Measurements::default()
    };
    data.sequence = data
        .time
        .as_ref()
        .and_then(|time| Sequence::by_time(time, |a, b| data.near_pose(a, b)));
    data
}

fn diagnosed(case: &Case, data: &Measurements, without: &[String]) -> Diagnosis {
    let set: Vec<usize> = case
        .shots
        .iter()
        .map(|shot| usize::from(shot.block != FIT))
        .collect();
    let rows = |count: usize| {
        (0..data.rows())
            .filter(|row| set[*row] == count)
            .collect::<Vec<usize>>()
    };
    let (fit, validate) = (rows(0), rows(1));
    let mut description = case.robot.clone();
    if case.bare {
        description
            .joints
            .iter_mut()
            .for_each(|joint| (joint.mass, joint.centre) = (None, None));
    }
    let (robot, _) = gauge(RobotModel::new(description), data, &fit, &BTreeMap::new())
        .expect("a concealed recording has a gauge");
    let question = Question {
        robot: &robot,
        data,
        fit: &fit,
        validate: &validate,
        set: &set,
        prior_weight: 1.0,
        open_world: 0.3,
        without,
        declared: &[],
        beside_simulation: false,
        known: &[],
        seed: case.seed,
    };
    wrong_setup(&question).unwrap_or_else(|| diagnose(&question, |_| ()))
}

/// What a diagnosis is worth, where the truth is known.
fn score(case: &Case, found: &Diagnosis, is_listed: bool) -> serde_json::Value {
    let named: Vec<(&str, String, f64)> = found
        .findings
        .iter()
        .filter(|finding| !finding.forms.is_empty())
        .map(|finding| {
            (
                &*finding.effect,
                finding.place.to_string(),
                finding.probabilities.name,
            )
        })
        .collect();
    let same =
        |want: &(&str, String), ours: &(&str, String, f64)| want.0 == ours.0 && want.1 == ours.1;
    let (want, all) = (case.want(), case.want_all());
    let accepted = |ours: &(&str, String, f64)| {
        all.iter().any(|want| same(want, ours))
            || case
                .accepted
                .iter()
                .any(|(effect, place)| *effect == ours.0 && *place == ours.1)
    };
    let exact = is_listed
        && want
            .iter()
            .all(|want| named.iter().any(|ours| same(want, ours)))
        && named.iter().all(&accepted);
    let wrong = named
        .iter()
        .any(|ours| ours.0 != "unknown" && ours.2 >= 0.5 && !accepted(ours));
    let placed = case.concealed.first().is_none_or(|one| {
        let places = || {
            std::iter::once(&one.cause.place).chain(case.accepted.iter().map(|(_, place)| place))
        };
        named
            .iter()
            .any(|ours| places().any(|place| ours.1 == *place))
    });
    let floor = 3f64.sqrt() * case.noise_mm[1];
    let held_out = found
        .after
        .as_ref()
        .map_or(f64::NAN, |errors| errors.rms * 1e3)
        / floor;
    let before = found
        .before
        .as_ref()
        .map_or(f64::NAN, |errors| errors.rms * 1e3)
        / floor;
    let silent = named.is_empty();
    let explained = found.verdict != VerdictKind::Unexplained;
    serde_json::json!({ "exact": exact, "placed": placed, "wrong": wrong, "silent": silent, "explained": explained, "held_out": held_out, "before": before, "found": named })
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| {
        arguments
            .get(at)
            .and_then(|text| text.parse::<usize>().ok())
            .expect("SEED FIRST COUNT POINTS [CRITERION ...]")
    };
    let (seed, first, count) = (number(0) as u64, number(1), number(2));
    let points = Some(number(3)).filter(|points| *points > 0);
    let wanted = arguments.get(4..).unwrap_or_default();
    let last = first + count;
    let listed = Design {
        seed,
        cases: 8 * last,
        nulls: 0.1,
        faulty: 0.0,
        points,
        ..Design::default()
    };
    let foreign = Design {
        seed,
        cases: last,
        foreign: 1.0,
        faulty: 0.0,
        points,
        ..Design::default()
    };
    let mut listed_cases = listed
        .contents()
        .into_iter()
        .enumerate()
        .filter(|(_, content)| matches!(content, Content::Single(_)));
    let mut foreign_cases = foreign.contents().into_iter().enumerate();
    for recording in 0..last {
        let (world, design, next) = match recording % 3 {
            2 => ("foreign", &foreign, foreign_cases.next()),
            1 => ("left out", &listed, listed_cases.next()),
            _ => ("listed", &listed, listed_cases.next()),
        };
        let Some((at, content)) = next.filter(|_| recording >= first) else {
            continue;
        };
        let Ok(case) = Case::make(design, at, content) else {
            continue;
        };
        let cause = case
            .concealed
            .first()
            .map(|one| one.cause.effect.to_string());
        let without: Vec<String> = cause.into_iter().filter(|_| world == "left out").collect();
        let (data, is_listed) = (measured(&case), world == "listed");
        let tell = |criterion: &str, factor: f64| {
            let mut line = score(&case, &diagnosed(&case, &data, &without), is_listed);
            line["recording"] = recording.into();
            line["world"] = world.into();
            line["criterion"] = criterion.into();
            line["factor"] = factor.into();
            println!("{line}");
        };
        scale("", CriterionFactor::One);
        reached();
        tell("", 1.0);
        for criterion in reached()
            .iter()
            .filter(|name| wanted.is_empty() || wanted.contains(name))
        {
            for (factor, times) in [(CriterionFactor::Half, 0.5), (CriterionFactor::Double, 2.0)] {
                scale(criterion, factor);
                tell(criterion, times);
            }
        }
    }
}

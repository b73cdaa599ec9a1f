//! What a recording cannot show whatever the truth, and what to measure so that it does.

use crate::criteria::screen::{BULK, MISTAKES};
use crate::criteria::words::{FAULT, STILL};
use crate::effect::{Clock, DeclaredCause, DeclaredForm, Survey, cause, names};
use crate::error::counted;
use crate::estimate::{Screening, Suspect, SuspectKind};
use crate::observation::{Dimension, noise, only_contacts};
use crate::robot::Measurements;
use crate::types::{Finding, RivalCause};
use crate::verdict::findings::LastRound;
use crate::words::small;
use std::sync::Arc;

/// What these data cannot show, whatever the truth; `reach` is the largest motion of the point by each joint, m/rad.
pub(super) fn not_observable(survey: &Survey, reach: &[f64]) -> Vec<String> {
    let mut out = Vec::new();
    for (joint, reach) in reach.iter().enumerate() {
        let name = joint + 1;
        if *reach < *STILL {
            out.push(format!("joint {name}: the measured point lies on its axis; put a second target off the axis"));
        } else if survey.travel(joint) < 0.02 {
            out.push(format!(
                "joint {name}: it hardly moves; vary it over its range"
            ));
        } else if !survey.both_directions(joint) {
            out.push(format!(
                "joint {name}, backlash: it was approached from one side only; approach half of the poses from the other"
            ));
        }
    }
    if !survey.payload_changes() {
        let payload = if survey.heavy_payload() > 0.0 {
            "every row carries the same payload"
        } else {
            "no row carries a payload"
        };
        out.push(format!(
            "payload_error: {payload}; measure with two payloads in alternating blocks"
        ));
    }
    out.extend(masses(survey));
    let clock = Clock::of(survey.data);
    if clock == Clock::Rows {
        out.push("time: none was recorded; the order of the rows is used instead".into());
    }
    if survey.data.temperature.is_none() {
        let by = if clock == Clock::Rows {
            "the order of the rows"
        } else {
            "time"
        };
        out.push(format!(
            "temperature: none was recorded; growth and drift are separated by {by} alone"
        ));
    }
    if survey.data.current.is_none() {
        out.push(
            "counterbalance: without motor currents a gear error of one period a turn looks the same"
                .into(),
        );
    }
    if survey.data.direction.is_none() {
        let order = if survey.data.sequence.is_some() {
            "times, since the rows stand in another order"
        } else {
            "order of the rows"
        };
        out.push(format!("direction of approach: taken from the {order}"));
    }
    let rows: Vec<usize> = (0..survey.data.rows()).collect();
    if only_contacts(survey.data, &rows) {
        out.push(format!(
            "anything below the repeatability of closing, {}: nothing but joints was recorded",
            small(closing(survey.data, &rows), Dimension::Length)
        ));
        out.push("place of the base: it moves with all places that were touched; measure three points of the cell".into());
        out.push("scale of the arm: arm, target and fixtures may all be larger together; state `distances` in `identify`".into());
    } else {
        out.push("tracker scale: link lengths absorb it; measure a scale bar".into());
    }
    out
}

/// Length of one sigma with which the target comes back, rms over rows, m.
fn closing(data: &Measurements, rows: &[usize]) -> f64 {
    let square: f64 = rows.iter().map(|row| noise(data, *row).powi(2)).sum();
    (square / rows.len().max(1) as f64).sqrt()
}

/// Effects of the user's own that were not tried, since the recording lacks a column.
pub(super) fn not_tried(survey: &Survey, causes: &[Arc<DeclaredCause>]) -> Vec<String> {
    let one = |declared: &Arc<DeclaredCause>| {
        let lacking = DeclaredForm::lacking(declared, survey)?;
        Some(format!(
            "{}: the recording has no {lacking}",
            declared.name()
        ))
    };
    causes.iter().filter_map(one).collect()
}

/// Links whose weight the robot file does not give.
fn masses(survey: &Survey) -> Option<String> {
    let all = &survey.robot.description().joints;
    let bare = (1..).zip(all);
    let bare = bare.filter(|(_, joint)| joint.mass.is_none() || joint.centre.is_none());
    let bare: Vec<String> = bare
        .map(|(number, _): (usize, _)| number.to_string())
        .collect();
    match bare.len() {
        0 => None,
        none if none == all.len() => {
            Some("gravity effects: the robot file gives no link masses; wind-up shows as an angle, no stiffness".into())
        }
        some => {
            let (named, all) = (all.len() - some, all.len());
            let bare = bare.join(", ");
            Some(format!(
                "gravity effects: the robot file gives mass and centre of {named} of {all} links; {bare} counted as weightless"
            ))
        }
    }
}

/// Where nothing else is needed.
const POSES: &str = "more poses, chosen to separate them (`calib poses --run`)";

/// Where no poses tell.
const ONE_MOTION: &str = "both are one motion, which no poses tell apart: look at both";

/// Whether a rival is another place of a finding's motion.
fn is_one_motion(finding: &Finding, rival: &RivalCause) -> bool {
    [&finding.effect, &rival.effect] == [names::UNKNOWN; 2] && rival.delta_bic == 0.0
}

/// What would tell findings from their rivals, a sentence each.
pub(super) fn next(findings: &[Finding], causes: &[Arc<DeclaredCause>]) -> Vec<String> {
    let mut out = Vec::new();
    let measure = |name: &str| {
        let mut declared = causes.iter().filter(|declared| declared.name() == name);
        match declared.next() {
            Some(declared) => declared.measure(),
            None => of_library(name),
        }
    };
    for finding in findings {
        for rival in finding.rivals.iter().take(2) {
            let names = [&*finding.effect, &*rival.effect];
            let how = match is_one_motion(finding, rival) {
                true => ONE_MOTION,
                false => least(names.into_iter().filter_map(measure)).unwrap_or(POSES),
            };
            out.push(format!(
                "{} at {} or {} at {}: {how}",
                finding.effect, finding.place, rival.effect, rival.place
            ));
        }
    }
    out
}

/// What is not a pose and may tell two effects apart, where there is such a thing.
pub fn other_means(a: &str, b: &str) -> Option<&'static str> {
    least([a, b].into_iter().filter_map(of_library))
}

/// Rank and advice of a measurement that separates a cause of the library from others.
fn of_library(name: &str) -> Option<(u8, &'static str)> {
    let measure = cause(name)?.measure?;
    Some((measure.rank, measure.advice))
}

fn least<'a>(measures: impl Iterator<Item = (u8, &'a str)>) -> Option<&'a str> {
    let first = measures.min_by_key(|(rank, _)| *rank);
    first.map(|(_, advice)| advice)
}

/// Joints and points of all rows that are so many rows apart.
pub(super) fn rows_apart(offset: i64, last: &LastRound) -> Finding {
    let rows = counted(offset.unsigned_abs() as usize, "row");
    let how = if offset < 0 { "ahead of" } else { "behind" };
    let text = format!(
        "the joints of a point are {rows} {how} it: join the two logs again, nothing else can be diagnosed before"
    );
    of_the_recording(names::JOINT_LOG_LAG, text, last)
}

/// Whether more rows are set aside by the model alone than mistakes are: missing physics may show most there.
pub(super) fn stand_out_in_number(screening: &Screening, rows: usize) -> bool {
    let far = |s: &&Suspect| is_by_the_model_alone(s) && s.statistic > screening.reach;
    let many = screening.suspects.iter().filter(far).count();
    let many = many.saturating_sub(*MISTAKES);
    many as f64 > (1.0 - *BULK) * rows as f64
}

/// Whether a row is set aside by the model alone.
fn is_by_the_model_alone(suspect: &Suspect) -> bool {
    suspect.kind == SuspectKind::Outlier && !suspect.corroborated
}

/// Rows of the recording that no model can follow, as findings; `unknown` is a row that the found causes cannot predict. Where physics is
/// missing, a row that is set aside by the model alone may be where that shows most.
pub(super) fn faults(
    last: &LastRound,
    unknown: Option<usize>,
    something_left: bool,
) -> Vec<Finding> {
    let screening = &last.state.screening;
    // What has no other explanation than that it is far out must be farther than this noise reaches.
    let far = |s: &Suspect| s.kind != SuspectKind::Outlier || s.statistic > screening.reach;
    let rows_of = |kinds: fn(SuspectKind) -> bool| -> Vec<usize> {
        let kept = screening.suspects.iter().filter(|s| {
            !s.used()
                && kinds(s.kind)
                && Some(s.row) != unknown
                && far(s)
                && !(something_left && is_by_the_model_alone(s))
        });
        kept.map(|s| s.row + 1).collect()
    };
    let list = |rows: &[usize]| {
        let named: Vec<String> = rows.iter().take(20).map(usize::to_string).collect();
        let more = match rows.len().saturating_sub(20) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let noun = if rows.len() == 1 { "row" } else { "rows" };
        format!("{noun} {}{more}", named.join(", "))
    };
    type IsKind = fn(SuspectKind) -> bool;
    let kinds: [(&str, &str, IsKind); 3] = [
        (
            names::MISLABELLED_POINT,
            "points carry another point's name",
            |kind| matches!(kind, SuspectKind::Exchanged | SuspectKind::Mislabelled),
        ),
        (
            names::JOINT_LOG_LAG,
            "joints and points are rows apart in the recording",
            |kind| matches!(kind, SuspectKind::ShiftedBlock(_)),
        ),
        (names::OUTLIER, "single wrong points", |kind| {
            use SuspectKind::{Outlier, UnitSlip, Zero};
            matches!(kind, Outlier | UnitSlip(_) | Zero)
        }),
    ];
    let each = kinds
        .into_iter()
        .map(|(effect, text, kinds)| (effect, text, rows_of(kinds)));
    each.filter(|(.., rows)| !rows.is_empty())
        .map(|(effect, text, rows)| {
            of_the_recording(effect, format!("{text}: {}", list(&rows)), last)
        })
        .collect()
}

/// A fault of the recording; without its name where that is not to be given.
fn of_the_recording(effect: &str, statement: String, last: &LastRound) -> Finding {
    let effect = match last.excludes(effect) {
        true => names::UNKNOWN,
        false => effect,
    };
    Finding::of_recording(effect, statement, *FAULT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_more_than_mistakes_beyond_three_and_one_in_fifty_if_only_the_model_speaks_against_them()
     {
        let suspect = |row, corroborated, statistic| {
            let kind = SuspectKind::Outlier;
            Suspect {
                row,
                kind,
                partner: None,
                size: 1e-3,
                statistic,
                corroborated,
            }
        };
        let many = |count: usize, corroborated, statistic, rows| {
            let suspects = (0..count)
                .map(|row| suspect(row, corroborated, statistic))
                .collect();
            stand_out_in_number(
                &Screening {
                    suspects,
                    reach: 10.0,
                    ..Screening::default()
                },
                rows,
            )
        };
        assert!(
            many(8, false, 20.0, 100) && !many(3, false, 20.0, 50) && !many(8, false, 20.0, 1000)
        );
        assert!(!many(8, true, 20.0, 100) && !many(8, false, 5.0, 100));
    }
}

//! What a recording and the first fit to it show that a person should know, a sentence each: a payload column that is not filled, rows that are
//! copies of each other, joints that never move, links without masses, a tool out of place, logs that are rounded.

use crate::description::JointDescription;
use crate::effect::{STANDS, ToolOffset, figure};
use crate::error::{Error, Result, counted, listed};
use crate::estimate::{Fitted, Model, ParameterStatus};
use crate::table::Recording;
use crate::units::Unit;
use calib_numerics::robot::{Measurements, RobotModel};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// What is said where cells of the column are empty.
pub(super) fn blank_payload(recording: &Recording) -> Option<String> {
    let payload = recording.payload.as_ref()?;
    let rows = payload.len();
    let empty = payload.iter().filter(|mass| !mass.is_finite()).count();
    let which = match empty {
        0 => return None,
        all if all == rows => format!("all {rows} rows"),
        some => format!("{some} of {rows} rows"),
    };
    Some(format!(
        "the payload column is empty in {which}, and 0 kg is assumed there: where the arm carried anything, what its weight does is \
         attributed to another cause. Fill the column in, or give `payload` a value in `ingest`"
    ))
}

/// Copies that are named.
const COPIES_NAMED: usize = 3;

/// Numbers to the last digit, and the target where there are several.
type Digits<'a> = (Vec<u64>, Option<&'a str>);

/// Rows (second) whose joints and measured point are those of an earlier row (first) to the last digit. Where joints or points come back to a few
/// counts of an encoder, as one does that dithers between two, rows are alike without being copies.
pub(super) fn copied_rows(recording: &Recording) -> Vec<(usize, usize)> {
    let digits =
        |values: &[f64]| -> Vec<u64> { values.iter().map(|value| value.to_bits()).collect() };
    let target = |row: usize| {
        recording
            .target
            .as_ref()
            .and_then(|all| all[row].as_deref())
    };
    let rows: Vec<(usize, Digits, Digits)> = (0..recording.rows())
        .filter_map(|row| {
            let point = digits(&recording.point(row)?);
            Some((
                row,
                (digits(recording.q(row)), target(row)),
                (point, target(row)),
            ))
        })
        .collect();
    let counted_joints = counted_alike(rows.iter().map(|(_, joints, point)| (joints, point)));
    let counted_points = counted_alike(rows.iter().map(|(_, joints, point)| (point, joints)));
    let mut first: BTreeMap<(&Digits, &Digits), usize> = BTreeMap::new();
    let mut copies = Vec::new();
    for (row, joints, point) in &rows {
        let earlier = *first.entry((joints, point)).or_insert(*row);
        let is_counted = counted_joints.contains(joints) || counted_points.contains(point);
        if earlier != *row && !is_counted {
            copies.push((earlier, *row));
        }
    }
    copies
}

/// Of pairs, the firsts whose seconds are several but no more than half of their rows.
fn counted_alike<'a>(
    pairs: impl Iterator<Item = (&'a Digits<'a>, &'a Digits<'a>)>,
) -> BTreeSet<&'a Digits<'a>> {
    let mut seconds: BTreeMap<&Digits, (usize, BTreeSet<&Digits>)> = BTreeMap::new();
    for (one, second) in pairs {
        let (rows, different) = seconds.entry(one).or_default();
        *rows += 1;
        different.insert(second);
    }
    let is_counted =
        |(rows, different): &(usize, BTreeSet<&Digits>)| (2..=rows / 2).contains(&different.len());
    seconds
        .into_iter()
        .filter(|(_, of_one)| is_counted(of_one))
        .map(|(one, _)| one)
        .collect()
}

/// What is said of them; none where there are none.
pub(super) fn copies_remark(copies: &[(usize, usize)], recording: &Recording) -> Option<String> {
    let id = |row: usize| recording.point_id[row].as_str();
    let named = copies.iter().take(COPIES_NAMED);
    let named = listed(named.map(|(one, copy)| format!("{} is {}", id(*copy), id(*one))));
    let more = match copies.len() > COPIES_NAMED {
        true => ", ...",
        false => "",
    };
    let rows = counted(copies.len(), "row");
    let repeat = if copies.len() == 1 {
        "repeats"
    } else {
        "repeat"
    };
    (!copies.is_empty()).then(|| {
        format!(
            "{rows} {repeat} another row's joints and point to the last digit under an id of their own ({named}{more}): copies, which look like \
             perfect repeatability. They are in one set with that row; take them out of the file"
        )
    })
}

/// Fewer points show no drift.
const DRIFT_FEWEST: usize = 6;
/// Standard deviations by which a drift must be beyond noise.
const DRIFT_CLEARLY: f64 = 4.0;

/// Joints (from 0) that stand in these rows, each with where it does, rad or m.
fn unmoved_joints(data: &Measurements, rows: &[usize]) -> Vec<(usize, f64)> {
    let stands = |joint: usize| {
        let mut positions = rows.iter().map(|row| data.q(*row)[joint]);
        let first = positions.next()?;
        let (least, most) = positions.fold((first, first), |(least, most), q| {
            (least.min(q), most.max(q))
        });
        (most - least < STANDS).then_some((joint, first))
    };
    (0..data.joints).filter_map(stands).collect()
}

/// Fails where the arm stands in all of these rows; says then how far the point drifts meanwhile.
pub(super) fn must_move(data: &Measurements, rows: &[usize]) -> Result<()> {
    if rows.len() < 2 || unmoved_joints(data, rows).len() < data.joints {
        return Ok(());
    }
    let drift = drift(data, rows).map_or_else(String::new, |[by, sigma]| {
        let (by, sigma) = (by * 1e3, sigma * 1e3);
        if by > DRIFT_CLEARLY * sigma {
            format!(
                "; meanwhile the point drifts by {by:.3} mm from the first to the last ({sigma:.3} mm one sigma): the instrument, what it stands \
                 on, or the arm has not settled"
            )
        } else {
            format!("; meanwhile the point does not drift beyond noise ({by:.3} mm, {sigma:.3} mm one sigma)")
        }
    });
    let message = format!(
        "all {} to fit are of one pose: geometry needs poses in which every joint moves, 30 or more{drift}",
        counted(rows.len(), "row")
    );
    Err(Error::data("table recording", message))
}

/// By how much the point moves along a straight line over time, or over the rows, from the first to the last, and its standard deviation, m.
fn drift(data: &Measurements, rows: &[usize]) -> Option<[f64; 2]> {
    let point = |(place, row): (usize, &usize)| {
        let time = data.time.as_ref().map_or(place as f64, |time| time[*row]);
        Some((time, data.point(*row)?))
    };
    let points: Vec<(f64, Vector3<f64>)> = rows.iter().enumerate().filter_map(point).collect();
    let count = points.len() as f64;
    let time = points.iter().map(|(time, _)| time).sum::<f64>() / count;
    let middle = points.iter().map(|(_, point)| point).sum::<Vector3<f64>>() / count;
    let square: f64 = points.iter().map(|(at, _)| (at - time).powi(2)).sum();
    let (least, most) = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (at, _)| {
            (a.min(*at), b.max(*at))
        });
    if points.len() < DRIFT_FEWEST || square.is_nan() || square == 0.0 {
        return None;
    }
    let moments = points
        .iter()
        .map(|(at, point)| (point - middle) * (at - time));
    let slope = moments.sum::<Vector3<f64>>() / square;
    let off = |(at, point): &(f64, Vector3<f64>)| point - middle - slope * (at - time);
    let left: f64 = points.iter().map(|one| off(one).norm_squared()).sum();
    let sigma = (left / (3.0 * (count - 2.0)) / square).sqrt();
    Some([slope.norm() * (most - least), sigma * (most - least)])
}

/// A sentence on joints that stand in rows where others move.
pub(super) fn unmoved_remark(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
) -> Option<String> {
    let unmoved_joints = unmoved_joints(data, rows);
    if rows.len() < 2 || unmoved_joints.is_empty() || unmoved_joints.len() == data.joints {
        return None;
    }
    let at = |(joint, position): &(usize, f64)| {
        let position = match robot.is_revolute(*joint) {
            true => format!("{:.3} deg", position.to_degrees()),
            false => format!("{:.3} mm", position * 1e3),
        };
        format!("joint {} (at {position})", joint + 1)
    };
    let verb = if unmoved_joints.len() == 1 {
        "moves"
    } else {
        "move"
    };
    let all = listed(unmoved_joints.iter().map(at));
    Some(format!(
        "never {verb} in the {} to fit: {all}. What only its motion shows is not determined, and the model holds at this position alone: \
         measure poses with it elsewhere",
        counted(rows.len(), "row")
    ))
}

/// Cosine from which on gravity does not turn a joint.
const UPRIGHT: f64 = 0.99;

/// What is said where links without masses are under load.
pub(super) struct WeightlessLinks {
    /// What is missing, for a verdict.
    pub missing: String,
    /// The same with what it costs and what to do.
    pub warning: String,
}

/// What is said of links without masses at some rows; none where all masses are known, or weight turns no joint.
pub(super) fn weightless_links(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
) -> Option<WeightlessLinks> {
    let joints = &robot.description().joints;
    let is_bare = |joint: &&JointDescription| joint.mass.is_none() || joint.centre.is_none();
    let bare = joints.iter().filter(is_bare).count();
    let gravity = Vector3::from(robot.description().gravity);
    let turned = |joint: usize| {
        let along = gravity.dot(robot.axis(joint)).abs() / gravity.norm().max(f64::MIN_POSITIVE);
        let mut angles = rows.iter().map(|row| data.q(*row)[joint]);
        let first = angles.next();
        robot.is_revolute(joint) && along < UPRIGHT && angles.any(|angle| Some(angle) != first)
    };
    if bare == 0 || gravity.norm() == 0.0 || !(0..robot.joints()).any(turned) {
        return None;
    }
    const AN_ANGLE: &str = "shows at best as an angle, without a stiffness";
    let links = joints.len();
    let (given, windup) = match links - bare {
        0 => ("no link masses".to_string(), AN_ANGLE),
        some => {
            let given = format!("mass and centre of {some} of {links} links alone");
            (given, "cannot be computed")
        }
    };
    let loaded = rows.iter().filter(|row| data.payload[**row] > 0.0).count();
    let (all, some) = (rows.len(), counted(loaded, "row"));
    let load = match loaded {
        0 => String::new(),
        _ => format!(" ({some} of {all} carry a payload)"),
    };
    let missing =
        format!("the robot file gives {given}, yet gravity loads joints in these poses{load}");
    let warning = format!(
        "{missing}: wind-up under the arm's own weight {windup}, bending and counterbalances cannot be computed, and what they do may be \
         attributed to another cause (gear, hose). Fill in `links` of the robot file"
    );
    Some(WeightlessLinks { missing, warning })
}

/// Farther off (m) no holder is, whose reflector a robot file states at all.
const TOOL_FAR: f64 = 20e-3;
/// Standard deviations by which the point must be away.
const TOOL_CLEARLY: f64 = 5.0;

/// What is said of the tool that has no name; none where the point is where the robot file has it.
pub(super) fn misplaced_tool(model: &Model, fitted: &Fitted) -> Option<String> {
    let estimate = |axis: &'static str| {
        let name = format!("{}{axis}", ToolOffset::prefix(""));
        let mut specs = model.stack.specs().iter();
        let k = specs.position(|spec| spec.name == name)?;
        match fitted.statuses[k] {
            ParameterStatus::Free(sigma) => Some((axis, model.x[k], sigma)),
            _ => None,
        }
    };
    let known: Vec<_> = ["x", "y", "z"].into_iter().filter_map(estimate).collect();
    let length = |values: fn(&(&str, f64, f64)) -> f64| {
        let squares = known.iter().map(|one| values(one) * values(one));
        squares.sum::<f64>().sqrt()
    };
    let (off, sigma) = (length(|one| one.1), length(|one| one.2));
    let each = known.iter();
    let each = listed(each.map(|(axis, value, _)| format!("{axis} {:+.0}", 1e3 * value)));
    (off > TOOL_FAR && off > TOOL_CLEARLY * sigma).then(|| {
        format!(
            "the measured point is {} mm from the `tool` of the robot file ({each} mm, zero pose): is it that of this recording, with its signs \
             and in the frame that the file asks for?",
            figure(1e3 * off, 0)
        )
    })
}

/// Steps that logs are rounded to, the coarsest first; finer ones are found as coarser ones are, and make too little to be said.
const STEPS: [f64; 13] = [
    1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5,
];
/// How far off a multiple of its step a number may be that was converted between units, as a share of the step.
const OFF: f64 = 1e-6;
/// Fewer values of a column than this may be multiples by choice.
const STEP_FEWEST: usize = 10;
/// A residual smaller than this share of what rounding would leave says that the numbers are exact: commanded so, and not rounded.
const EXACT: f64 = 0.6;
/// Where residual or noise is this many times larger, rounding does not matter.
const DROWNED: f64 = 4.0;
/// What rounding by a step makes, as a standard deviation in steps: that of a uniform distribution.
const UNIFORM: f64 = 0.288_675;
/// Step of a joint by which the motion of the point is taken, rad or m.
const TURN: f64 = 1e-4;

/// What rounding does to points, m.
struct Rounding {
    what: String,
    rms: f64,
    most: f64,
}

/// What is said of rounded joints and points, a sentence each, where rounding is as large as what the model leaves.
pub(super) fn rounded_logs(model: &Model, data: &Measurements, rows: &[usize]) -> Vec<String> {
    let predicted = model.predict(data);
    let residuals = rows
        .iter()
        .map(|row| data.points.residual(*row, &predicted[*row]));
    let left = rms(residuals.map(|residual| residual.norm()));
    let noise = rms(rows.iter().map(|row| data.noise(*row)));
    let sentence = |rounding: Rounding| {
        let Rounding { what, rms, most } = rounding;
        let matters = left > EXACT * rms && left < DROWNED * rms && noise < DROWNED * rms;
        matters.then(|| {
            format!(
                "{what}, which makes up to {:.2} mm and {:.3} mm rms of the {:.3} mm rms that the model leaves: log more digits",
                most * 1e3,
                rms * 1e3,
                left * 1e3
            )
        })
    };
    let joints = rounded_joints(model, data, rows).into_iter();
    let all = joints.chain(rounded_points(data, rows));
    all.filter_map(sentence).collect()
}

fn rms(lengths: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = lengths.fold((0.0, 0usize), |(sum, count), length| {
        (sum + length * length, count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

/// The coarsest step of which all values are multiples; none where they are too few to tell.
fn step(values: &[f64]) -> Option<f64> {
    let mut distinct = values.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    if distinct.len() < STEP_FEWEST {
        return None;
    }
    let is_multiple = |value: f64, step: f64| {
        ((value / step) - (value / step).round()).abs() < OFF * (1.0 + (value / step).abs() * 1e-4)
    };
    STEPS
        .into_iter()
        .find(|step| distinct.iter().all(|value| is_multiple(*value, *step)))
}

/// The step of a joint in the unit that makes it coarsest.
fn of_joint(values: &[f64], revolute: bool) -> Option<(f64, Unit)> {
    let units = match revolute {
        true => [Unit::Degree, Unit::Radian],
        false => [Unit::Millimetre, Unit::Metre],
    };
    let step_in = |unit: Unit| {
        let values: Vec<f64> = values.iter().map(|value| unit.from_si(*value)).collect();
        step(&values).map(|step| (step, unit))
    };
    let steps = units.into_iter().filter_map(step_in);
    steps.max_by(|a, b| a.1.to_si(a.0).total_cmp(&b.1.to_si(b.0)))
}

fn rounded_joints(model: &Model, data: &Measurements, rows: &[usize]) -> Option<Rounding> {
    let start = model.predict(data);
    let mut coarsest: Option<(f64, Unit)> = None;
    let (mut squares, mut most) = (0.0, vec![0.0; data.rows()]);
    for joint in 0..data.joints {
        let values: Vec<f64> = rows.iter().map(|row| data.q(*row)[joint]).collect();
        let Some((step, unit)) = of_joint(&values, model.robot.is_revolute(joint)) else {
            continue;
        };
        let si = unit.to_si(step);
        if coarsest.is_none_or(|(other, by)| si > by.to_si(other)) {
            coarsest = Some((step, unit));
        }
        let mut turned = data.clone();
        for q in turned.q.iter_mut().skip(joint).step_by(data.joints) {
            *q += TURN;
        }
        let moved = model.predict(&turned);
        for row in rows {
            let lever = (moved[*row] - start[*row]).norm() / TURN;
            squares += (UNIFORM * si * lever).powi(2);
            most[*row] += 0.5 * si * lever;
        }
    }
    let (step, unit) = coarsest?;
    Some(Rounding {
        what: format!("joint positions are rounded to {step} {}", unit.symbol()),
        rms: (squares / rows.len().max(1) as f64).sqrt(),
        most: most.into_iter().fold(0.0, f64::max),
    })
}

fn rounded_points(data: &Measurements, rows: &[usize]) -> Option<Rounding> {
    let axis = |axis: usize| {
        let points = rows.iter().filter_map(|row| data.point(*row));
        let values: Vec<f64> = points
            .map(|point| Unit::Millimetre.from_si(point[axis]))
            .collect();
        step(&values)
    };
    // A point is as coarse as its finest axis says: one axis may be a multiple by chance.
    let steps = (0..3).map(axis).collect::<Option<Vec<f64>>>()?;
    let step = steps.into_iter().fold(f64::INFINITY, f64::min);
    let length = Unit::Millimetre.to_si(step) * 3f64.sqrt();
    Some(Rounding {
        what: format!("measured points are rounded to {step} mm"),
        rms: UNIFORM * length,
        most: 0.5 * length,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_from_the_values_in_the_unit_that_they_were_written_in() {
        let by = |step: f64, unit: Unit| {
            (0..40)
                .map(|k| unit.to_si(f64::from(k * k % 37) * step))
                .collect::<Vec<f64>>()
        };
        assert_eq!(
            of_joint(&by(0.1, Unit::Degree), true),
            Some((0.1, Unit::Degree))
        );
        assert_eq!(
            of_joint(&by(0.001, Unit::Radian), true),
            Some((0.001, Unit::Radian))
        );
        assert_eq!(
            of_joint(&by(0.5, Unit::Millimetre), false),
            Some((0.5, Unit::Millimetre))
        );
        let free: Vec<f64> = (0..40).map(|k| (f64::from(k) * 0.618_034).sin()).collect();
        assert_eq!(of_joint(&free, true), None);
        assert_eq!(of_joint(&by(0.1, Unit::Degree)[..8], true), None);
    }
}

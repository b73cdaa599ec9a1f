//! Joints that stand while an arm is measured: of one pose there is no geometry, of one joint nothing that only its motion shows.

use crate::error::{Error, Result, counted};
use crate::robot::{Measurements, RobotModel};
use nalgebra::Vector3;

/// A joint that moves by less stands: rad or m.
const STILL: f64 = 1e-3;
/// Fewer points show no drift.
const FEWEST: usize = 6;
/// Standard deviations by which a drift must be beyond noise.
const CLEARLY: f64 = 4.0;

/// Joints (from 0) that stand in these rows, each with where it does, rad or m.
fn standing(data: &Measurements, rows: &[usize]) -> Vec<(usize, f64)> {
    let stands = |joint: usize| {
        let mut positions = rows.iter().map(|row| data.q(*row)[joint]);
        let first = positions.next()?;
        let (least, most) = positions.fold((first, first), |(least, most), q| {
            (least.min(q), most.max(q))
        });
        (most - least < STILL).then_some((joint, first))
    };
    (0..data.joints).filter_map(stands).collect()
}

/// Fails where the arm stands in all of these rows; says then how far the point drifts meanwhile.
pub(super) fn must_move(data: &Measurements, rows: &[usize]) -> Result<()> {
    if rows.len() < 2 || standing(data, rows).len() < data.joints {
        return Ok(());
    }
    let drift = drift(data, rows).map_or_else(String::new, |[by, sigma]| {
        let (by, sigma) = (by * 1e3, sigma * 1e3);
        if by > CLEARLY * sigma {
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
    let points: Vec<(f64, Vector3<f64>)> = rows
        .iter()
        .enumerate()
        .filter_map(|(place, row)| {
            Some((
                data.time.as_ref().map_or(place as f64, |time| time[*row]),
                data.point(*row)?,
            ))
        })
        .collect();
    let count = points.len() as f64;
    let time = points.iter().map(|(time, _)| time).sum::<f64>() / count;
    let middle = points.iter().map(|(_, point)| point).sum::<Vector3<f64>>() / count;
    let square: f64 = points.iter().map(|(at, _)| (at - time).powi(2)).sum();
    let (least, most) = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (at, _)| {
            (a.min(*at), b.max(*at))
        });
    if points.len() < FEWEST || square.is_nan() || square == 0.0 {
        return None;
    }
    let slope = points
        .iter()
        .map(|(at, point)| (point - middle) * (at - time))
        .sum::<Vector3<f64>>()
        / square;
    let left: f64 = points
        .iter()
        .map(|(at, point)| (point - middle - slope * (at - time)).norm_squared())
        .sum();
    let sigma = (left / (3.0 * (count - 2.0)) / square).sqrt();
    Some([slope.norm() * (most - least), sigma * (most - least)])
}

/// A sentence on joints that stand in rows where others move.
pub(super) fn remark(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Option<String> {
    let standing = standing(data, rows);
    if rows.len() < 2 || standing.is_empty() || standing.len() == data.joints {
        return None;
    }
    let at = |(joint, position): &(usize, f64)| {
        let position = if robot.is_revolute(*joint) {
            format!("{:.3} deg", position.to_degrees())
        } else {
            format!("{:.3} mm", position * 1e3)
        };
        format!("joint {} (at {position})", joint + 1)
    };
    let (all, verb) = (
        standing.iter().map(at).collect::<Vec<_>>().join(", "),
        if standing.len() == 1 { "moves" } else { "move" },
    );
    Some(format!(
        "never {verb} in the {} to fit: {all}. What only its motion shows is not determined, and the model holds at this position alone: \
         measure poses with it elsewhere",
        counted(rows.len(), "row")
    ))
}

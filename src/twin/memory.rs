//! What an arm lived through before a row, for effects with memory: straight ways in joint space, time and temperature.

use super::plan::Point;

/// How a row was reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Straight pieces of the way from the row before, in order: travel of each joint, rad or m.
    pub pieces: Vec<Vec<f64>>,
    pub time_s: f64,
    pub temperature_c: f64,
}

impl Moment {
    /// Travel of a joint (from 1) piece by piece, rad or m.
    pub fn travels(&self, joint: usize) -> impl Iterator<Item = f64> {
        self.pieces
            .iter()
            .filter_map(move |piece| piece.get(joint.wrapping_sub(1)).copied())
    }
}

fn piece(from: &[f64], to: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}

/// The past of planned points, in the order of measurement.
pub fn past(points: &[Point]) -> Vec<Moment> {
    let mut out = Vec::with_capacity(points.len());
    let mut stood: Option<&[f64]> = None;
    for point in points {
        let back = stood
            .filter(|stood| *stood != point.before.as_slice())
            .map(|stood| piece(stood, &point.before));
        let pieces = back
            .into_iter()
            .chain([piece(&point.before, &point.q)])
            .collect();
        out.push(Moment {
            pieces,
            time_s: point.time_s,
            temperature_c: point.temperature_c,
        });
        stood = Some(&point.q);
    }
    out
}

/// The past of an arm that moves: positions, time and temperature, row after row.
pub(crate) fn along(course: impl Iterator<Item = (Vec<f64>, f64, f64)>) -> Vec<Moment> {
    let mut stood: Option<Vec<f64>> = None;
    let reach = |(q, time_s, temperature_c): (Vec<f64>, f64, f64)| {
        let pieces = stood.iter().map(|stood| piece(stood, &q)).collect();
        stood = Some(q);
        Moment {
            pieces,
            time_s,
            temperature_c,
        }
    };
    course.map(reach).collect()
}

/// A temperature that follows the logged one with a time constant, C: in balance at `start_c` at time 0, the logged one straight from
/// row to row. At `lag_s` 0 it is the logged one.
pub(super) fn behind(past: &[Moment], lag_s: f64, start_c: f64) -> Vec<f64> {
    let (mut then, mut logged, mut lagging) = (0.0, start_c, start_c);
    let follow = |moment: &Moment| {
        let (dt, rise) = (moment.time_s - then, moment.temperature_c - logged);
        if lag_s <= 0.0 {
            lagging = moment.temperature_c;
        } else if dt > 0.0 {
            // Behind a ramp it ends up by slope times lag.
            let trail = rise / dt * lag_s;
            lagging =
                moment.temperature_c - trail + (lagging - logged + trail) * (-dt / lag_s).exp();
        }
        (then, logged) = (moment.time_s, moment.temperature_c);
        lagging
    };
    past.iter().map(follow).collect()
}

/// Travel of a joint (from 1) that has not yet cooled off, rad: each move adds its length, and all of it fades with a time constant.
pub(super) fn recent_travel(past: &[Moment], joint: usize, cooling_s: f64) -> Vec<f64> {
    let (mut then, mut warm) = (0.0, 0.0);
    let live = |moment: &Moment| {
        let kept = if cooling_s > 0.0 {
            (-(moment.time_s - then) / cooling_s).exp()
        } else {
            0.0
        };
        warm = warm * kept + moment.travels(joint).map(f64::abs).sum::<f64>();
        then = moment.time_s;
        warm
    };
    past.iter().map(live).collect()
}

//! What is measured: a run without load, one with full load, and held-out points with either, last, while the arm warms up.

use super::layout::Layout;
use super::robots::Kind;
use crate::arm::Arm;
use crate::noise::{Noise, Purpose};
use crate::plan::{self, Climate, Point, Poses};
use crate::truth::TrueRobot;

/// Blocks of the plan: points to fit and points held out.
pub const FIT: usize = 0;
/// Number of the block of points to judge by.
pub(crate) const VALIDATE: usize = 1;

/// How many points, and which of them twice.
#[derive(Debug, Clone, Copy)]
pub struct Amount {
    pub fit: usize,
    pub validate: usize,
    /// Share of points that repeat the one before.
    pub repeated: f64,
    /// Share of points that are approached from near by.
    pub near: f64,
    /// Whether half of the points carry the full payload.
    pub loaded: bool,
    /// How poses follow each other; none is repeated on a path.
    pub layout: Layout,
}

/// A step of the controller's display, deg; recorded joints are multiples of it, so that writing them loses nothing.
const STEP_DEG: f64 = 1e-4;

/// Points in order of measurement; fails with what is wrong where no pose is allowed.
pub fn plan(
    kind: Kind,
    ranges_deg: &[[f64; 2]],
    amount: Amount,
    climate: &Climate,
    seed: u64,
) -> Result<Vec<Point>, String> {
    let robot = kind.description([0.0; 3]);
    let arm = Arm::new(&robot, &TrueRobot::default());
    let [floor_mm, clearance_mm] = kind.room_mm();
    let poses = Poses {
        range_deg: ranges_deg.to_vec(),
        floor_mm,
        clearance_mm,
        candidates: 1,
    };
    let ranges: Vec<[f64; 2]> = ranges_deg
        .iter()
        .map(|range| range.map(f64::to_radians))
        .collect();
    let mut draw = Noise::new(seed, Purpose::Poses);
    let mut clock = Noise::new(seed, Purpose::Clock);
    let loaded_from = amount.fit.div_ceil(2);
    let blocks = [
        0..loaded_from,
        loaded_from..amount.fit,
        amount.fit..amount.fit + amount.validate,
    ];
    let path = amount
        .layout
        .poses(&arm, &poses, &ranges, &blocks, &mut draw)?;
    let (mut out, mut time): (Vec<Point>, f64) = (Vec::new(), 0.0);
    for number in 0..amount.fit + amount.validate {
        let block = if number < amount.fit { FIT } else { VALIDATE };
        let loaded = match block {
            FIT => 2 * number >= amount.fit,
            _ => draw.chance(0.5),
        };
        let payload_kg = if loaded && amount.loaded {
            robot.payload_mass
        } else {
            0.0
        };
        time += clock.uniform(climate.pace_s[0], climate.pace_s[1]);
        // A repeat: the arm goes away and comes back as it came before, with the same load.
        let again = out.last().filter(|last| {
            path.is_empty()
                && draw.chance(amount.repeated)
                && last.block == block
                && last.payload_kg == payload_kg
        });
        let (q, before) = match again {
            Some(last) => (last.q.clone(), last.before.clone()),
            None => {
                let close = match out.last() {
                    Some(last) if amount.near > 0.0 && draw.chance(amount.near) => {
                        Some(around(&last.q, &ranges, &mut draw))
                    }
                    _ => None,
                };
                let q = match path.get(number) {
                    Some(q) => q.clone(),
                    None => {
                        plan::allowed(&arm, &poses, close.as_ref().unwrap_or(&ranges), &mut draw)?.0
                    }
                };
                let q = q
                    .iter()
                    .map(|angle| ((angle.to_degrees() / STEP_DEG).round() * STEP_DEG).to_radians())
                    .collect();
                (
                    q,
                    out.last()
                        .map_or_else(|| vec![0.0; ranges.len()], |last| last.q.clone()),
                )
            }
        };
        let (direction, temperature_c) = (plan::direction(&q, &before), climate.temperature(time));
        out.push(Point {
            block,
            q,
            before,
            direction,
            time_s: time,
            temperature_c,
            payload_kg,
        });
    }
    Ok(out)
}

/// Shortest and longest of the short moves, deg.
const SHORT_DEG: [f64; 2] = [0.2, 6.0];

/// The part of the ranges that a short move reaches, rad.
fn around(q: &[f64], ranges: &[[f64; 2]], draw: &mut Noise) -> Vec<[f64; 2]> {
    let away = draw.size(SHORT_DEG[0], SHORT_DEG[1]).to_radians();
    q.iter()
        .zip(ranges)
        .map(|(q, [low, high])| [(q - away).max(*low), (q + away).min(*high)])
        .collect()
}

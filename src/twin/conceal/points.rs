//! What is measured: a run without load, one with full load, and held-out points with either, last, while the arm warms up; poses anywhere
//! from row to row, or one after the other along lines and curves in joint space.

use super::robots::Kind;
use crate::arm::Arm;
use crate::lists::named;
use crate::noise::{Noise, Purpose};
use crate::plan::{self, Climate, Point, Poses};
use crate::truth::TrueRobot;
use std::ops::Range;

/// Blocks of the plan: points to fit and points held out.
pub const FIT: usize = 0;
/// Number of the block of points to judge by.
pub(crate) const VALIDATE: usize = 1;

named! {
    /// How poses follow each other.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    Layout,
    /// All of them.
    LAYOUTS: 3 {
        /// Every pose is drawn anew.
        #[default]
        Random "random",
        /// One after the other along lines and curves.
        Path "path",
        /// The poses of the same paths in random order, under the same payloads.
        Shuffled "shuffled",
    }
}

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
/// Shortest and longest of the short moves, deg.
const SHORT_DEG: [f64; 2] = [0.2, 6.0];
/// Fewest and most points of a line or curve.
const POINTS: [f64; 2] = [15.0, 120.0];

/// Points in order of measurement; fails with what is wrong where no pose is allowed.
pub fn plan(
    kind: Kind,
    ranges_deg: &[[f64; 2]],
    amount: Amount,
    climate: &Climate,
    seed: u64,
) -> Result<Vec<Point>, String> {
    let robot = kind.description([0.0; 3]);
    let [floor_mm, clearance_mm] = kind.room_mm();
    let ranges = ranges_deg.iter().map(|range| range.map(f64::to_radians));
    let cell = Cell {
        arm: Arm::new(&robot, &TrueRobot::default()),
        poses: Poses {
            range_deg: ranges_deg.to_vec(),
            floor_mm,
            clearance_mm,
            candidates: 1,
        },
        ranges: ranges.collect(),
    };
    let mut draw = Noise::new(seed, Purpose::Poses);
    let mut clock = Noise::new(seed, Purpose::Clock);
    let (middle, all) = (amount.fit.div_ceil(2), amount.fit + amount.validate);
    let blocks = [0..middle, middle..amount.fit, amount.fit..all];
    let path = cell.path(amount.layout, &blocks, &mut draw)?;
    let (mut out, mut time_s): (Vec<Point>, f64) = (Vec::new(), 0.0);
    for number in 0..all {
        let block = if number < amount.fit { FIT } else { VALIDATE };
        let loaded = match block {
            FIT => 2 * number >= amount.fit,
            _ => draw.chance(0.5),
        };
        let carries = loaded && amount.loaded;
        let payload_kg = if carries { robot.payload_mass } else { 0.0 };
        time_s += clock.uniform(climate.pace_s[0], climate.pace_s[1]);
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
                let last = out.last().map(|last| &last.q);
                let near = last.filter(|_| amount.near > 0.0 && draw.chance(amount.near));
                let near = near.map(|last| cell.around(last, &mut draw));
                let mut q = match path.get(number) {
                    Some(q) => q.clone(),
                    None => cell.pose(near.as_ref().unwrap_or(&cell.ranges), &mut draw)?,
                };
                let shown = |angle: f64| (angle.to_degrees() / STEP_DEG).round() * STEP_DEG;
                let angles = q.iter_mut();
                angles.for_each(|angle| *angle = shown(*angle).to_radians());
                let zero = || vec![0.0; cell.ranges.len()];
                (q, last.cloned().unwrap_or_else(zero))
            }
        };
        out.push(Point {
            block,
            direction: plan::direction(&q, &before),
            q,
            before,
            time_s,
            temperature_c: climate.temperature(time_s),
            payload_kg,
        });
    }
    Ok(out)
}

/// The arm and where it may stand.
struct Cell {
    arm: Arm,
    poses: Poses,
    /// rad.
    ranges: Vec<[f64; 2]>,
}

impl Cell {
    fn pose(&self, ranges: &[[f64; 2]], draw: &mut Noise) -> Result<Vec<f64>, String> {
        let (q, _) = plan::allowed(&self.arm, &self.poses, ranges, draw)?;
        Ok(q)
    }

    /// The part of the ranges that a short move reaches, rad.
    fn around(&self, q: &[f64], draw: &mut Noise) -> Vec<[f64; 2]> {
        let away = draw.size(SHORT_DEG[0], SHORT_DEG[1]).to_radians();
        let near =
            |(q, [low, high]): (&f64, &[f64; 2])| [(q - away).max(*low), (q + away).min(*high)];
        q.iter().zip(&self.ranges).map(near).collect()
    }

    /// Poses (rad) in order of measurement, each of `blocks` shuffled by itself; none where every pose is drawn anew. Ends and bends of the
    /// curves are allowed poses, between them neither floor nor clearance is kept. Fails where no pose is allowed.
    fn path(
        &self,
        layout: Layout,
        blocks: &[Range<usize>],
        draw: &mut Noise,
    ) -> Result<Vec<Vec<f64>>, String> {
        if layout == Layout::Random {
            return Ok(Vec::new());
        }
        let count = blocks.iter().map(|block| block.end).max().unwrap_or(0);
        let mut out: Vec<Vec<f64>> = Vec::with_capacity(count);
        let mut from = self.pose(&self.ranges, draw)?;
        while out.len() < count {
            let to = self.pose(&self.ranges, draw)?;
            let straight = from.iter().zip(&to).map(|(a, b)| 0.5 * (a + b)).collect();
            let bend = match draw.chance(0.5) {
                true => self.pose(&self.ranges, draw)?,
                false => straight,
            };
            let points = draw.size(POINTS[0], POINTS[1]).round() as usize;
            out.extend((0..points).map(|k| curve(&from, &bend, &to, k as f64 / points as f64)));
            from = to;
        }
        out.truncate(count);
        for block in blocks.iter().filter(|_| layout == Layout::Shuffled) {
            draw.shuffle(&mut out[block.clone()]);
        }
        Ok(out)
    }
}

/// A parabola from one pose to another, straight where `bend` is midway (Bezier).
fn curve(from: &[f64], bend: &[f64], to: &[f64], u: f64) -> Vec<f64> {
    let at = |a: f64, b: f64, c: f64| (1.0 - u).powi(2) * a + 2.0 * u * (1.0 - u) * b + u * u * c;
    let joints = from.iter().zip(bend).zip(to);
    joints.map(|((a, b), c)| at(*a, *b, *c)).collect()
}

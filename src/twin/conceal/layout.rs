//! The order of measured poses: anywhere from row to row, or one after the other along lines and curves in joint space.

use crate::arm::Arm;
use crate::names::named;
use crate::noise::Noise;
use crate::plan::{self, Poses};
use std::ops::Range;

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

/// Fewest and most points of a line or curve.
const POINTS: [f64; 2] = [15.0, 120.0];

impl Layout {
    /// Poses (rad) in order of measurement, each of `blocks` shuffled by itself; none where every pose is drawn anew. Ends and bends of the
    /// curves are allowed poses, between them neither floor nor clearance is kept. Fails where no pose is allowed.
    pub(super) fn poses(
        self,
        arm: &Arm,
        poses: &Poses,
        ranges: &[[f64; 2]],
        blocks: &[Range<usize>],
        draw: &mut Noise,
    ) -> Result<Vec<Vec<f64>>, String> {
        let count = blocks.iter().map(|block| block.end).max().unwrap_or(0);
        if self == Self::Random {
            return Ok(Vec::new());
        }
        let mut out: Vec<Vec<f64>> = Vec::with_capacity(count);
        let (mut from, _) = plan::allowed(arm, poses, ranges, draw)?;
        while out.len() < count {
            let (to, _) = plan::allowed(arm, poses, ranges, draw)?;
            let straight: Vec<f64> = from.iter().zip(&to).map(|(a, b)| 0.5 * (a + b)).collect();
            let bend = if draw.chance(0.5) {
                plan::allowed(arm, poses, ranges, draw)?.0
            } else {
                straight
            };
            let points = draw.size(POINTS[0], POINTS[1]).round() as usize;
            out.extend((0..points).map(|k| curve(&from, &bend, &to, k as f64 / points as f64)));
            from = to;
        }
        out.truncate(count);
        if self == Self::Shuffled {
            blocks
                .iter()
                .for_each(|block| draw.shuffle(&mut out[block.clone()]));
        }
        Ok(out)
    }
}

/// A parabola from one pose to another, straight where `bend` is midway (Bezier).
fn curve(from: &[f64], bend: &[f64], to: &[f64], u: f64) -> Vec<f64> {
    let joints = from.iter().zip(bend).zip(to);
    joints
        .map(|((a, b), c)| (1.0 - u).powi(2) * a + 2.0 * u * (1.0 - u) * b + u * u * c)
        .collect()
}

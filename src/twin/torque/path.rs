//! How joints move while torques are recorded: sums of sines that begin and end at rest, and moves from point to point with pauses.

use crate::noise::Noise;
use crate::way::{Move, PEAK, Path};
use std::f64::consts::TAU;

/// Turns of the slowest sine in a stretch, and sines of a joint.
const WAVES: [usize; 5] = [1, 2, 3, 5, 7];

/// Sines that stay inside `ranges` (rad) and below `speed` (rad/s), for so many seconds.
pub(super) fn sines(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Path {
    let joint = |[lower, upper]: &[f64; 2]| {
        let reach = 0.5 * (upper - lower);
        let wave = |k: &usize| {
            let rate = TAU / duration * *k as f64 * noise.uniform(0.9, 1.1);
            [
                noise.uniform(0.2, 1.0) / *k as f64,
                rate,
                noise.uniform(0.0, TAU),
            ]
        };
        let mut waves: Vec<[f64; 3]> = WAVES.iter().map(wave).collect();
        let far: f64 = waves.iter().map(|wave| wave[0]).sum();
        let fast: f64 = waves.iter().map(|wave| wave[0] * wave[1]).sum();
        let share = (0.8 * reach / far).min(speed / fast);
        waves.iter_mut().for_each(|wave| wave[0] *= share);
        let room = (reach - share * far).max(0.0);
        (
            0.5 * (lower + upper) + noise.uniform(-1.0, 1.0) * room,
            waves,
        )
    };
    Path::Waves(ranges.iter().map(joint).collect(), Some(duration))
}

/// Moves between points inside `ranges`, each with a pause after it.
pub(super) fn moves(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Path {
    let point = |noise: &mut Noise| -> Vec<f64> {
        ranges
            .iter()
            .map(|[lower, upper]| noise.uniform(*lower, *upper))
            .collect()
    };
    let (mut moves, mut start_s, mut from) = (Vec::new(), 0.4, point(noise));
    while start_s < duration {
        let to = point(noise);
        let joints = from.iter().zip(&to);
        let far = joints.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let duration_s = (PEAK * far / (speed * noise.uniform(0.4, 1.0))).max(0.5);
        moves.push(Move {
            start_s,
            duration_s,
            from,
            to: to.clone(),
        });
        start_s += duration_s + noise.uniform(0.3, 0.7);
        from = to;
    }
    Path::Moves(moves)
}

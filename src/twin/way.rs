//! A way through joint space, smooth and at random: waves that never stop, or moves from pose to pose by polynomials of fifth degree.

use super::arm::Arm;
use super::noise::{Noise, Purpose};
use super::plan::{self, Poses};
use calib_foundation::description::RobotDescription;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How the arm travels while it is measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Way {
    /// Rows a second.
    pub rate_hz: f64,
    /// Fastest that a joint turns, deg/s (mm/s for a prismatic joint).
    pub speed_deg_s: f64,
    /// How joints get from pose to pose.
    pub(crate) shape: Shape,
    /// Standstill between two moves, s.
    pub dwell_s: f64,
    /// Time for which a joint's deviation (`repeatability_arcsec`) lasts, s; 0: a new one in every row.
    pub wander_s: f64,
    /// Whether the controller logs joint velocities.
    pub log_velocity: bool,
}

impl Default for Way {
    fn default() -> Self {
        Self {
            rate_hz: 100.0,
            speed_deg_s: 40.0,
            shape: Shape::Waves,
            dwell_s: 0.0,
            wander_s: 0.0,
            log_velocity: true,
        }
    }
}

/// Shapes of a way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Shape {
    /// Three sines a joint; within the joints' range, but neither `floor_mm` nor `clearance_mm` is kept.
    Waves,
    /// From one allowed pose to the next, all joints together, at rest at either end.
    Moves,
}

/// Where joints are and how they move: rad, rad/s, rad/s2; of prismatic joints m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointState {
    /// rad.
    pub q: Vec<f64>,
    /// rad/s.
    pub v: Vec<f64>,
    /// rad/s2.
    pub a: Vec<f64>,
}

/// A drawn way.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Path {
    /// Middle, and amplitude, angular frequency, phase of each wave, of every joint; at a standstill at both ends where it lasts so many seconds.
    Waves(Vec<(f64, Vec<[f64; 3]>)>, Option<f64>),
    /// From pose to pose, with rests between.
    Moves(Vec<Move>),
    /// States at even steps, s.
    Given(f64, Vec<JointState>),
}

/// From a pose to the next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Move {
    start_s: f64,
    duration_s: f64,
    from: Vec<f64>,
    to: Vec<f64>,
}

/// Amplitudes of the three waves as shares of half the range, and their frequencies as multiples of the first.
const SHARES: [f64; 3] = [0.5, 0.28, 0.15];
const FREQUENCIES: [f64; 3] = [1.0, 1.7, 2.9];
/// Time before the first row and after the last one, s: the arm moves already, and clocks may be apart.
const MARGIN_S: f64 = 2.0;
/// The fastest moment of a move of fifth degree, in travel over duration.
const PEAK: f64 = 1.875;
/// Time in which waves that begin and end at a standstill come up, s.
const RAMP_S: f64 = 1.0;
/// No move is shorter, s.
const SHORTEST_S: f64 = 0.3;

impl Path {
    /// A way of so many seconds; fails where no pose is allowed.
    pub(crate) fn draw(
        way: &Way,
        robot: &RobotDescription,
        arm: &Arm,
        poses: &Poses,
        seconds: f64,
        seed: u64,
    ) -> Result<Self, String> {
        let ranges = plan::ranges(robot, poses)?;
        let mut draw = Noise::new(seed, Purpose::Poses);
        let joints = robot.joints.iter();
        let speeds: Vec<f64> = joints
            .map(|joint| plan::si(way.speed_deg_s, joint.kind))
            .collect();
        if way.shape == Shape::Waves {
            let joints = ranges.iter().zip(&speeds);
            let waves = joints.map(|(range, speed)| waves(*range, *speed, &mut draw));
            return Ok(Self::Waves(waves.collect(), None));
        }
        let mut moves: Vec<Move> = Vec::new();
        let (mut at, _) = plan::allowed(arm, poses, &ranges, &mut draw)?;
        let mut time = -MARGIN_S;
        while time < seconds + MARGIN_S {
            let (to, _) = plan::allowed(arm, poses, &ranges, &mut draw)?;
            let joints = at.iter().zip(&to).zip(&speeds);
            let lasts = joints.map(|((a, b), speed)| PEAK * (b - a).abs() / speed);
            let duration_s = lasts.fold(SHORTEST_S, f64::max);
            let from = std::mem::replace(&mut at, to.clone());
            moves.push(Move {
                start_s: time,
                duration_s,
                from,
                to,
            });
            time += duration_s + way.dwell_s;
        }
        Ok(Self::Moves(moves))
    }

    /// The joints at a time, s.
    pub(crate) fn at(&self, time: f64) -> JointState {
        let mut state = JointState::default();
        match self {
            Self::Waves(joints, lasts) => {
                let [gate, rate, bend] = lasts.map_or([1.0, 0.0, 0.0], |lasts| gate(time, lasts));
                for (middle, waves) in joints {
                    let [mut x, mut dx, mut ddx] = [0.0; 3];
                    for [size, w, phase] in waves {
                        let (sine, cosine) = (w * time + phase).sin_cos();
                        x += size * sine;
                        dx += size * w * cosine;
                        ddx -= size * w * w * sine;
                    }
                    state.q.push(middle + gate * x);
                    state.v.push(gate * dx + rate * x);
                    state.a.push(gate * ddx + 2.0 * rate * dx + bend * x);
                }
            }
            Self::Moves(moves) => {
                let next = moves.partition_point(|one| one.start_s <= time).max(1) - 1;
                if let Some(one) = moves.get(next) {
                    let lasts = one.duration_s;
                    let [s, ds, dds] = smooth((time - one.start_s) / lasts);
                    for (from, to) in one.from.iter().zip(&one.to) {
                        state.q.push(from + s * (to - from));
                        state.v.push(ds / lasts * (to - from));
                        state.a.push(dds * (to - from) / (lasts * lasts));
                    }
                }
            }
            Self::Given(step, states) => {
                let row = (time / step).round() as usize;
                return states[row.min(states.len() - 1)].clone();
            }
        }
        state
    }
}

/// 0 at both ends of a way that lasts so long, s, 1 between, with its derivatives.
fn gate(time: f64, lasts: f64) -> [f64; 3] {
    let (near, sign) = if time < 0.5 * lasts {
        (time, 1.0)
    } else {
        (lasts - time, -1.0)
    };
    let [s, ds, dds] = smooth(near / RAMP_S);
    [s, sign * ds / RAMP_S, dds / (RAMP_S * RAMP_S)]
}

/// From 0 to 1 with velocity and acceleration 0 at both ends, and its derivatives.
fn smooth(u: f64) -> [f64; 3] {
    let u = u.clamp(0.0, 1.0);
    let s = u * u * u * (10.0 - u * (15.0 - 6.0 * u));
    let ds = 30.0 * u * u * (1.0 - u) * (1.0 - u);
    let dds = 60.0 * u * (u * (2.0 * u - 3.0) + 1.0);
    [s, ds, dds]
}

fn waves([low, high]: [f64; 2], speed: f64, draw: &mut Noise) -> (f64, Vec<[f64; 3]>) {
    let half = 0.5 * (high - low);
    let sizes = SHARES.map(|share| half * share * draw.uniform(0.7, 1.0));
    let paces = FREQUENCIES.map(|times| times * draw.uniform(0.9, 1.1));
    // Never faster than allowed, even where all waves meet.
    let fastest: f64 = sizes
        .iter()
        .zip(&paces)
        .map(|(size, pace)| size * pace)
        .sum();
    let first = speed * draw.uniform(0.6, 1.0) / fastest.max(1e-12);
    let wave = |k: usize, draw: &mut Noise| [sizes[k], first * paces[k], draw.uniform(0.0, TAU)];
    (
        0.5 * (low + high),
        vec![wave(0, draw), wave(1, draw), wave(2, draw)],
    )
}

/// Turns of the slowest sine in a stretch, and sines of a joint.
const TURNS: [usize; 5] = [1, 2, 3, 5, 7];

/// Sines that stay inside `ranges` (rad) and below `speed` (rad/s), for so many seconds.
pub(crate) fn sines(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Path {
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
        let mut waves: Vec<[f64; 3]> = TURNS.iter().map(wave).collect();
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
pub(crate) fn moves(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Path {
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

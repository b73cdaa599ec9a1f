//! How joints move while torques are recorded: sums of sines that begin and end at rest, and moves from point to point with pauses.

use crate::noise::Noise;
use crate::torque::law::JointState;

/// A stretch of the recording.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// s.
    pub(crate) duration: f64,
    form: Form,
}

#[derive(Debug, Clone, PartialEq)]
enum Form {
    /// Joint by joint: middle, and amplitude, rad/s and phase of each sine.
    Sines {
        middle: Vec<f64>,
        waves: Vec<Vec<[f64; 3]>>,
    },
    /// Where each move begins and how long it takes, s, from and to.
    Moves(Vec<Leg>),
    /// States at even steps, s.
    Given(f64, Vec<JointState>),
}

#[derive(Debug, Clone, PartialEq)]
struct Leg {
    start: f64,
    takes: f64,
    from: Vec<f64>,
    to: Vec<f64>,
}

/// Turns of the slowest sine in a stretch, and sines of a joint.
const WAVES: [usize; 5] = [1, 2, 3, 5, 7];
/// Seconds in which the arm starts and stops.
const RAMP: f64 = 1.0;

impl Path {
    /// Sines that stay inside `ranges` (rad) and below `speed` (rad/s).
    pub(super) fn sines(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Self {
        let mut middle = Vec::new();
        let mut waves = Vec::new();
        for [lower, upper] in ranges {
            let reach = 0.5 * (upper - lower);
            let slowest = std::f64::consts::TAU / duration;
            let mut own: Vec<[f64; 3]> = WAVES
                .iter()
                .map(|k| {
                    let rate = slowest * *k as f64 * noise.uniform(0.9, 1.1);
                    [
                        noise.uniform(0.2, 1.0) / *k as f64,
                        rate,
                        noise.uniform(0.0, std::f64::consts::TAU),
                    ]
                })
                .collect();
            let (far, fast) = (
                own.iter().map(|w| w[0]).sum::<f64>(),
                own.iter().map(|w| w[0] * w[1]).sum::<f64>(),
            );
            let share = (0.8 * reach / far).min(speed / fast);
            own.iter_mut().for_each(|wave| wave[0] *= share);
            let room = (reach - share * far).max(0.0);
            middle.push(0.5 * (lower + upper) + noise.uniform(-1.0, 1.0) * room);
            waves.push(own);
        }
        Self {
            duration,
            form: Form::Sines { middle, waves },
        }
    }

    /// Moves between points inside `ranges`, each with a pause after it.
    pub(super) fn moves(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Self {
        let point = |noise: &mut Noise| {
            ranges
                .iter()
                .map(|[lower, upper]| noise.uniform(*lower, *upper))
                .collect::<Vec<f64>>()
        };
        let (mut legs, mut start, mut from) = (Vec::new(), 0.4, point(noise));
        while start < duration {
            let to = point(noise);
            let far = from
                .iter()
                .zip(&to)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            // The peak of this profile is 1.875 times its mean.
            let takes = (1.875 * far / (speed * noise.uniform(0.4, 1.0))).max(0.5);
            legs.push(Leg {
                start,
                takes,
                from,
                to: to.clone(),
            });
            start += takes + noise.uniform(0.3, 0.7);
            from = to;
        }
        Self {
            duration,
            form: Form::Moves(legs),
        }
    }

    /// A motion in even steps, s.
    pub(super) fn given(step: f64, states: Vec<JointState>) -> Self {
        Self {
            duration: step * states.len() as f64,
            form: Form::Given(step, states),
        }
    }

    /// The joints at a time from the stretch's begin, s.
    pub(super) fn at(&self, time: f64) -> JointState {
        match &self.form {
            Form::Sines { middle, waves } => {
                let [gate, rate, bend] = self.gate(time);
                let mut state = JointState::default();
                for (middle, waves) in middle.iter().zip(waves) {
                    let [mut x, mut dx, mut ddx] = [0.0; 3];
                    for [size, w, phase] in waves {
                        let (s, c) = (w * time + phase).sin_cos();
                        x += size * s;
                        dx += size * w * c;
                        ddx -= size * w * w * s;
                    }
                    state.q.push(middle + gate * x);
                    state.v.push(gate * dx + rate * x);
                    state.a.push(gate * ddx + 2.0 * rate * dx + bend * x);
                }
                state
            }
            Form::Moves(legs) => {
                let leg = legs.iter().rfind(|leg| leg.start <= time).or(legs.first());
                leg.map_or_else(JointState::default, |leg| leg.at(time))
            }
            Form::Given(step, states) => {
                states[((time / step).round() as usize).min(states.len() - 1)].clone()
            }
        }
    }

    /// 0 at both ends, 1 between, with its derivatives.
    fn gate(&self, time: f64) -> [f64; 3] {
        let (near, sign) = if time < 0.5 * self.duration {
            (time, 1.0)
        } else {
            (self.duration - time, -1.0)
        };
        let [s, ds, dds] = smooth(near / RAMP);
        [s, sign * ds / RAMP, dds / (RAMP * RAMP)]
    }
}

impl Leg {
    fn at(&self, time: f64) -> JointState {
        let [s, ds, dds] = smooth((time - self.start) / self.takes);
        let mut state = JointState::default();
        for (from, to) in self.from.iter().zip(&self.to) {
            state.q.push(from + s * (to - from));
            state.v.push(ds * (to - from) / self.takes);
            state.a.push(dds * (to - from) / (self.takes * self.takes));
        }
        state
    }
}

/// From 0 to 1 with velocity and acceleration 0 at both ends, and its derivatives.
fn smooth(x: f64) -> [f64; 3] {
    let x = x.clamp(0.0, 1.0);
    let s = x * x * x * (10.0 + x * (6.0 * x - 15.0));
    let ds = 30.0 * x * x * (x * (x - 2.0) + 1.0);
    let dds = 60.0 * x * (x * (2.0 * x - 3.0) + 1.0);
    [s, ds, dds]
}

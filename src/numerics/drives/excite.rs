//! Which commands to send so that what a simulated drive lacks is seen: parts of which each shows some causes, within the limits of position
//! and speed, and another motion that judges.

use calib_numerics::error::{Error, Fault, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::f64::consts::{PI, TAU};

/// What commands may be; lists have a number a joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CommandRequest {
    /// Commands a second.
    pub rate: f64,
    /// s of all parts together.
    pub seconds: f64,
    /// rad, from .. to.
    pub range: Vec<[f64; 2]>,
    /// rad where every part begins and ends.
    pub home: Vec<f64>,
    /// rad/s, of the commands.
    pub speed: Vec<f64>,
    /// The same seed gives the same commands.
    pub seed: u64,
}

/// A part of the commands: a trajectory from rest to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandPart {
    /// `slow`, `sines`, `ramps`, `holds`, `judge`.
    pub name: &'static str,
    /// What it shows, in words.
    pub shows: &'static str,
    /// Its rows.
    pub rows: std::ops::Range<usize>,
}

/// Commands in even steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Commanding {
    /// s between two.
    pub period: f64,
    /// rad, `rows x joints`.
    pub command: Vec<f64>,
    /// Parts, one after the other; the last is not to be fitted.
    pub parts: Vec<CommandPart>,
}

/// Parts with their share of the time.
const PARTS: [(&str, f64, &str); 5] = [
    (
        "slow",
        0.35,
        "friction over speed and load, presliding, backlash, springs, ripple",
    ),
    (
        "sines",
        0.2,
        "inertia, gains, damping, viscous friction, delay, elasticity, coupling",
    ),
    (
        "ramps",
        0.15,
        "limits of torque and speed, delay and hold of commands, voltage sag",
    ),
    (
        "holds",
        0.15,
        "offsets, masses, gravity, dead bands, integral action",
    ),
    (
        "judge",
        0.15,
        "another motion, held out: its error is that of the simulation",
    ),
];

/// s of rest at either end of a part.
const REST: f64 = 0.6;
/// Share of the speed limit of what is slow, at most.
const SLOW: f64 = 0.15;
/// Sines of a joint, and Hz of the slowest and the fastest.
const SINES: usize = 6;
const FREQUENCIES: [f64; 2] = [0.1, 3.0];
/// Commands of a period of the fastest sine, at least.
const COMMANDS_A_PERIOD: f64 = 12.0;
/// s of rest after a ramp, at a pose, and between moves that judge.
const PAUSE: f64 = 0.4;
const HELD: f64 = 0.8;
const JUDGED: f64 = 0.1;
/// Share of a cosine's peak speed that its mean is.
const MEAN_OF_COSINE: f64 = 2.0 / PI;

/// Commands by the request.
///
/// # Errors
/// [`Error::Spec`] with every number of the request that cannot be used.
pub fn commands(request: &CommandRequest) -> Result<Commanding> {
    request.check()?;
    let mut dice = ChaCha8Rng::seed_from_u64(request.seed);
    let mut out = Commanding {
        period: 1.0 / request.rate,
        command: Vec::new(),
        parts: Vec::new(),
    };
    for (name, share, shows) in PARTS {
        let rows = (share * request.seconds * request.rate).round() as usize;
        let lasts = rows as f64 / request.rate - 2.0 * REST;
        let ways = match name {
            "slow" => request.slow(lasts),
            "sines" => request.sines(lasts, &mut dice),
            "ramps" => request.moves(lasts, false, PAUSE, &mut dice),
            "holds" => request.moves(lasts, true, HELD, &mut dice),
            _ => request.moves(lasts, true, JUDGED, &mut dice),
        };
        let from = out.command.len() / request.joints();
        for row in 0..rows {
            let time = row as f64 / request.rate - REST;
            let angle = ways.iter().zip(&request.home);
            out.command
                .extend(angle.map(|(way, home)| home + way.at(time)));
        }
        out.parts.push(CommandPart {
            name,
            shows,
            rows: from..from + rows,
        });
    }
    Ok(out)
}

/// A way from home and back: a polygon of times and angles, or sines within an envelope.
enum Way {
    /// (s, rad), whether corners are rounded.
    Polygon(Vec<[f64; 2]>, bool),
    /// Hz, phase, rad each; s of the whole.
    Sines(Vec<[f64; 3]>, f64),
}

impl Way {
    /// rad from home.
    fn at(&self, time: f64) -> f64 {
        match self {
            Self::Polygon(corners, rounded) => {
                let after = corners.partition_point(|corner| corner[0] <= time);
                let (Some(a), Some(b)) =
                    (after.checked_sub(1).map(|k| corners[k]), corners.get(after))
                else {
                    return if after == 0 {
                        0.0
                    } else {
                        corners.last().map_or(0.0, |corner| corner[1])
                    };
                };
                let share = (time - a[0]) / (b[0] - a[0]);
                let share = if *rounded {
                    0.5 * (1.0 - (PI * share).cos())
                } else {
                    share
                };
                a[1] + (b[1] - a[1]) * share
            }
            Self::Sines(sines, lasts) => {
                let near = (time.min(lasts - time) / Self::RISES).clamp(0.0, 1.0);
                let envelope = near * near * (3.0 - 2.0 * near);
                let wave =
                    |[hertz, phase, size]: &[f64; 3]| size * (TAU * hertz * time + phase).sin();
                envelope * sines.iter().map(wave).sum::<f64>()
            }
        }
    }

    /// s in which sines come up.
    const RISES: f64 = 0.8;
}

impl CommandRequest {
    fn joints(&self) -> usize {
        self.range.len()
    }

    fn check(&self) -> Result<()> {
        let n = self.joints();
        let mut faults = Vec::new();
        let mut claim = |name: &str, is_so: bool, message: String| {
            faults.extend((!is_so).then(|| Fault::new(name, message)));
        };
        let message = format!("{}; allowed: 10 to 2000 Hz", self.rate);
        claim("rate", (10.0..=2000.0).contains(&self.rate), message);
        let least = 4.0 * (n as f64).max(5.0);
        let message = format!(
            "{}; allowed: {least:.0} to 1200, 4 s a joint and more",
            self.seconds
        );
        claim("seconds", (least..=1200.0).contains(&self.seconds), message);
        let is_range =
            |[least, most]: &[f64; 2]| least.is_finite() && most.is_finite() && least < most;
        claim(
            "limits",
            n > 0 && self.range.iter().all(is_range),
            format!("expected {n} finite ranges, one a joint"),
        );
        let is_speed = |speed: &f64| speed.is_finite() && *speed > 0.0;
        claim(
            "speed",
            self.speed.len() == n && self.speed.iter().all(is_speed),
            format!("expected {n} numbers above 0, one a joint"),
        );
        let inside = |(home, [least, most]): (&f64, &[f64; 2])| least < home && home < most;
        claim(
            "home",
            self.home.len() == n && self.home.iter().zip(&self.range).all(inside),
            format!("expected {n} angles within the limits, one a joint"),
        );
        Error::if_spec(faults)
    }

    /// rad from home down and up.
    fn reach(&self, joint: usize) -> [f64; 2] {
        self.range[joint].map(|end| end - self.home[joint])
    }

    /// One joint after the other goes slowly to either end and back, twice: the second time not as far, so that it turns elsewhere.
    fn slow(&self, lasts: f64) -> Vec<Way> {
        let n = self.joints();
        let each = lasts / n as f64;
        let way = |joint: usize| {
            let from = each * joint as f64;
            let [down, up] = self.reach(joint);
            let turns = [0.0, up, down, 0.4 * up, 0.4 * down, 0.0];
            let whole: f64 = turns.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
            // What the time does not allow at the slow speed is not gone.
            let share = (SLOW * self.speed[joint] * each / whole).min(1.0);
            let mut time = from;
            let mut corners = vec![[from, 0.0]];
            for pair in turns.windows(2) {
                time += each * (pair[1] - pair[0]).abs() / whole;
                corners.push([time, share * pair[1]]);
            }
            Way::Polygon(corners, false)
        };
        (0..n).map(way).collect()
    }

    /// All joints together, by sines of random phases as large as range and speed allow.
    fn sines(&self, lasts: f64, dice: &mut ChaCha8Rng) -> Vec<Way> {
        let [first, last] = FREQUENCIES;
        let last = last.min(self.rate / COMMANDS_A_PERIOD);
        let way = |joint: usize| {
            let sines: Vec<[f64; 3]> = (0..SINES)
                .map(|k| {
                    let step = (k as f64 + dice.random_range(0.0..1.0)) / SINES as f64;
                    let hertz = first * (last / first).powf(step);
                    [hertz, dice.random_range(0.0..TAU), 1.0 / hertz.sqrt()]
                })
                .collect();
            Way::Sines(self.within(joint, sines, lasts), lasts)
        };
        (0..self.joints()).map(way).collect()
    }

    /// Sines scaled to the limits of a joint, on the rows of the commands.
    fn within(&self, joint: usize, sines: Vec<[f64; 3]>, lasts: f64) -> Vec<[f64; 3]> {
        let way = Way::Sines(sines.clone(), lasts);
        let rows = (lasts * self.rate) as usize + 1;
        let angles: Vec<f64> = (0..=rows)
            .map(|row| way.at(row as f64 / self.rate))
            .collect();
        let [down, up] = self.reach(joint);
        let mut most = f64::INFINITY;
        for angle in &angles {
            let room = if *angle > 0.0 { up } else { down };
            if *angle != 0.0 {
                most = most.min(room / angle);
            }
        }
        for pair in angles.windows(2) {
            let speed = (pair[1] - pair[0]).abs() * self.rate;
            if speed > 0.0 {
                most = most.min(self.speed[joint] / speed);
            }
        }
        let scaled = |[hertz, phase, size]: [f64; 3]| [hertz, phase, 0.98 * most * size];
        sines.into_iter().map(scaled).collect()
    }

    /// All joints from one random pose to the next with rests of `pause` s between: at the greatest speed from a standstill, or by half
    /// cosines and, as a hold, to each pose once from below and once from above.
    fn moves(&self, lasts: f64, rounded: bool, pause: f64, dice: &mut ChaCha8Rng) -> Vec<Way> {
        let n = self.joints();
        let mut ways: Vec<Vec<[f64; 2]>> = vec![vec![[0.0, 0.0]]; n];
        let by = if rounded { MEAN_OF_COSINE } else { 1.0 };
        let mut time = 0.0;
        let mut at = vec![0.0; n];
        let mut others: Vec<Vec<f64>> = Vec::new();
        loop {
            let to = others.pop().unwrap_or_else(|| {
                let shares: Vec<f64> = (0..n).map(|_| dice.random_range(-0.7..0.7)).collect();
                let pose = |off: f64| -> Vec<f64> {
                    let joint = |(joint, share): (usize, &f64)| {
                        let [down, up] = self.reach(joint);
                        let share = (share + off).clamp(-1.0, 1.0);
                        share * if share > 0.0 { up } else { -down }
                    };
                    shares.iter().enumerate().map(joint).collect()
                };
                if rounded {
                    // Popped in this order: beyond it, the pose from above, below it, the pose from below.
                    others = vec![pose(0.0), pose(-0.25), pose(0.0)];
                    pose(0.25)
                } else {
                    pose(0.0)
                }
            });
            let needs = |to: &[f64], from: &[f64]| {
                let joints = to.iter().zip(from).zip(&self.speed);
                joints
                    .map(|((to, from), speed)| (to - from).abs() / (by * speed))
                    .fold(2.0 / self.rate, f64::max)
            };
            let home = vec![0.0; n];
            let moves = needs(&to, &at);
            let is_last = time + moves + pause + needs(&home, &to) > lasts;
            let (to, moves) = if is_last {
                (home.clone(), needs(&home, &at))
            } else {
                (to, moves)
            };
            let start = if is_last {
                (lasts - moves).max(time)
            } else {
                time
            };
            for (joint, way) in ways.iter_mut().enumerate() {
                // Each at its own greatest speed where it is a ramp: what is slow is another part.
                let own = (to[joint] - at[joint]).abs() / (by * self.speed[joint]);
                let ends = if rounded {
                    start + moves
                } else {
                    start + own.max(1.0 / self.rate)
                };
                way.extend([
                    [start, at[joint]],
                    [ends, to[joint]],
                    [start + moves, to[joint]],
                ]);
            }
            (time, at) = (start + moves + pause, to);
            if is_last {
                break;
            }
        }
        ways.into_iter()
            .map(|corners| Way::Polygon(distinct(corners), rounded))
            .collect()
    }
}

/// Corners whose times rise.
fn distinct(corners: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::with_capacity(corners.len());
    for corner in corners {
        if out.last().is_none_or(|last| corner[0] > last[0] + 1e-9) {
            out.push(corner);
        }
    }
    out
}

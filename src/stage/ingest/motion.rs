//! Arms that move while they are measured: joint velocities by the joints over time, and joints carried to the moment of a point.
//!
//! Through a row's joints and those of its neighbours in the file goes a parabola in time: its slope in the row is the velocity. What
//! that is worth is seen from the same with neighbours twice as far (Richardson: the difference is three times the error).

use super::arm::RobotJoints;
use crate::Context;
use crate::error::{Error, Result, counted};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How joint velocities follow from the joints over time, where no columns give them: a parabola through each row and its
/// neighbours in the file, never across gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VelocitySettings {
    /// Longer steps in time between rows are gaps, s; five times the usual step if not given.
    #[serde(default)]
    pub gap_s: Option<f64>,
    /// Least time from the first to the last row of a parabola, s: more than two steps where joints are logged coarsely.
    #[serde(default)]
    pub over_s: f64,
    /// How much later the points were measured than the joints beside them, s, as `diagnose` says it: joints are carried there.
    #[serde(default)]
    pub later_s: f64,
}

/// Steps beyond so many usual ones are gaps.
const GAP: f64 = 5.0;
/// Velocities that are off by more than this share are worth a warning, and beyond that no velocities: the arm stood at the points.
const ROUGH: f64 = 0.03;
const TOO_ROUGH: f64 = 0.25;
/// Columns of velocities that are so many times what the joints over time say are in another unit.
const OTHER_UNIT: f64 = 3.0;

/// Times and joints of a file's usable rows.
#[derive(Default)]
pub(super) struct JointSamples {
    pub rows: Vec<usize>,
    pub time: Vec<f64>,
    pub q: Vec<f64>,
    /// Velocities that the file gives.
    pub given: Vec<f64>,
}

/// Velocity and acceleration of the joints by data row. 16 bytes a joint and row.
pub(super) struct Track {
    joints: usize,
    /// By data row: velocities, then accelerations; NaN where neither is known.
    rates: Vec<f64>,
}

impl JointSamples {
    /// Neighbours of a row in one stretch without a gap: the rows of its parabola (the same twice where there are but two), `wide`
    /// times as far apart.
    fn around(&self, i: usize, [start, end]: [usize; 2], reach: usize) -> Option<[usize; 3]> {
        let reach = reach.min((end - start) / 2);
        match reach {
            0 if end > start => Some([start, start, end]),
            0 => None,
            _ => {
                let middle = i.clamp(start + reach, end - reach);
                Some([middle - reach, middle, middle + reach])
            }
        }
    }

    /// Velocity and acceleration of joint `joint` in row `i` by the parabola through three rows.
    fn rate(&self, joints: usize, joint: usize, i: usize, [a, b, c]: [usize; 3]) -> [f64; 2] {
        let (t, q) = (
            |k: usize| self.time[k],
            |k: usize| self.q[k * joints + joint],
        );
        let slope = (q(c) - q(a)) / (t(c) - t(a));
        if a == b {
            return [slope, 0.0];
        }
        let curvature =
            ((q(c) - q(b)) / (t(c) - t(b)) - (q(b) - q(a)) / (t(b) - t(a))) / (t(c) - t(a));
        [
            slope + curvature * (2.0 * t(i) - t(a) - t(c)),
            2.0 * curvature,
        ]
    }

    /// The track of a file of `rows` data rows, with a word to the user; fails where `motion` asks for velocities and the rows are too
    /// far apart in time for them, and where those that the file gives are in another unit.
    pub(super) fn track(
        self,
        motion: Option<&VelocitySettings>,
        rows: usize,
        arm: &RobotJoints,
        label: &str,
        context: &Context,
    ) -> Result<Track> {
        let joints = arm.joints();
        let steps = self.time.windows(2).map(|pair| pair[1] - pair[0]);
        let steps = steps.filter(|step| *step > 0.0 && step.is_finite());
        let mut steps: Vec<f64> = steps.collect();
        let middle = steps.len() / 2;
        let given = self.given.iter().any(|value| value.is_finite());
        if steps.is_empty() {
            let rates = Vec::new();
            let message =
                "no two consecutive rows have increasing times: joint velocities cannot be derived";
            return match given || motion.is_none() {
                true => Ok(Track { joints, rates }),
                false => Err(Error::data(label, message)),
            };
        }
        let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let gap = motion.and_then(|motion| motion.gap_s);
        let gap = gap.unwrap_or(GAP * usual);
        let reach = (0.5 * motion.map_or(0.0, |motion| motion.over_s) / usual - 1e-9)
            .ceil()
            .max(1.0) as usize;
        let mut rates = vec![f64::NAN; rows * 2 * joints];
        let (mut isolated, mut start) = (0, 0);
        let (mut squares, mut errors) = (vec![0.0; joints], vec![0.0; joints]);
        let (mut reported, mut both) = (vec![0.0; joints], vec![0.0; joints]);
        while start < self.time.len() {
            let connected = |k: &usize| {
                (0.0..=gap).contains(&(self.time[*k] - self.time[*k - 1]))
                    && self.time[*k] > self.time[*k - 1]
            };
            let end = (start + 1..self.time.len()).take_while(connected).last();
            let end = end.unwrap_or(start);
            for i in start..=end {
                let Some(near) = self.around(i, [start, end], reach) else {
                    isolated += 1;
                    continue;
                };
                let far = self.around(i, [start, end], 2 * reach);
                let far = far.filter(|far| far[0] < near[0] && far[2] > near[2]);
                let at = self.rows[i] * 2 * joints;
                for joint in 0..joints {
                    let [velocity, acceleration] = self.rate(joints, joint, i, near);
                    rates[at + joint] = velocity;
                    rates[at + joints + joint] = acceleration;
                    if let Some(far) = far {
                        let [wide, _] = self.rate(joints, joint, i, far);
                        squares[joint] += velocity * velocity;
                        errors[joint] += ((wide - velocity) / 3.0).powi(2);
                    }
                    let given = self.given.get(i * joints + joint);
                    if let Some(given) = given.filter(|given| given.is_finite()) {
                        reported[joint] += given * given;
                        both[joint] += given * velocity;
                    }
                }
            }
            start = end + 1;
        }
        let fastest = |sums: &[f64]| sums.iter().copied().fold(0.0, f64::max);
        // The joint that moves most of each kind speaks for the others.
        let rough = |prismatic: bool| {
            let of_kind = |sums: &[f64]| -> f64 {
                let all = sums.iter().zip(&arm.prismatic);
                let of_kind = all.filter(|(_, slides)| **slides == prismatic);
                of_kind.map(|(sum, _)| *sum).sum()
            };
            let (all, wrong) = (of_kind(&squares), of_kind(&errors));
            if all > 0.0 { (wrong / all).sqrt() } else { 0.0 }
        };
        let rough = rough(false).max(rough(true));
        if !given && motion.is_some() {
            self.tell(rough, usual, gap, isolated, label, context)?;
        } else if rough > TOO_ROUGH {
            rates.fill(f64::NAN);
        } else {
            let fast = (0..joints).filter(|joint| {
                squares[*joint] > 0.01 * fastest(&squares) && reported[*joint] > 0.0
            });
            for joint in fast {
                same_unit(joint, reported[joint], both[joint], label)?;
            }
        }
        Ok(Track { joints, rates })
    }

    fn tell(
        &self,
        rough: f64,
        usual: f64,
        gap: f64,
        isolated: usize,
        label: &str,
        context: &Context,
    ) -> Result<()> {
        let (ms, gap, off) = (1e3 * usual, 1e3 * gap, 100.0 * rough);
        if rough > TOO_ROUGH {
            let message = format!(
                "rows are {ms:.1} ms apart, too far for the joints' velocities, which would be off by some {off:.0} %; where the arm stood at every point leave `motion` out, else log more often or map `velocity`"
            );
            return Err(Error::data(label, message));
        }
        let alone = match isolated {
            0 => String::new(),
            rows => format!("; none for {} between gaps", counted(rows, "row")),
        };
        context.note(format!(
            "{label}: joint velocities by parabolas through neighbouring rows, {ms:.1} ms apart, never across gaps above {gap:.0} ms; right to about {off:.2} %{alone}"
        ));
        if rough > ROUGH {
            context.warn(format!(
                "{label}: the velocities are right to {off:.0} % only: log more often, or try `motion: {{over_s: ...}}` where joints are logged coarsely"
            ));
        }
        Ok(())
    }
}

/// Whether the velocities that a file gives a joint have the unit and sign of its positions over time, by their squares and products.
fn same_unit(joint: usize, reported: f64, both: f64, label: &str) -> Result<()> {
    // Least squares either way round: noise in either makes it no larger.
    let factor = reported / both.abs().max(f64::MIN_POSITIVE);
    let against = both < 0.0;
    if !against && (1.0 / OTHER_UNIT..=OTHER_UNIT).contains(&factor) {
        return Ok(());
    }
    let how = if against {
        "have the opposite sign of".to_string()
    } else {
        format!("are {factor:.3} times")
    };
    let message = format!(
        "the velocities of joint {} {how} what its positions over time say; state the unit and sign of the file",
        joint + 1
    );
    Err(Error::data(label, message))
}

impl Track {
    fn of(&self, row: usize) -> Option<(&[f64], &[f64])> {
        let (at, joints) = (row * 2 * self.joints, self.joints);
        Some(self.rates.get(at..at + 2 * joints)?.split_at(joints))
    }

    /// Velocities of a row into those of `velocity` that are not known.
    pub(super) fn fill(&self, row: usize, velocity: &mut [f64]) {
        let Some((derived, _)) = self.of(row) else {
            return;
        };
        for (known, derived) in velocity.iter_mut().zip(derived) {
            if known.is_nan() {
                *known = *derived;
            }
        }
    }

    /// Acceleration of a joint in a row, zero where it is not known.
    pub(super) fn acceleration(&self, row: usize, joint: usize) -> f64 {
        let found = self.of(row).and_then(|(_, all)| all.get(joint));
        let known = found.copied().filter(|value| value.is_finite());
        known.unwrap_or(0.0)
    }
}

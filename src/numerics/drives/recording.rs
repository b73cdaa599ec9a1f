//! What was commanded and what the joints did.

use calib_numerics::error::{Error, Result};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// A trajectory: rows of the recording, one after the other, that are rolled out at one go from where it begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Its rows.
    pub rows: Range<usize>,
    /// s at which its recording began: from then on a joint warms up and drives integrate.
    pub began: f64,
}

/// A recording: `rows x joints`, row-major, rad and s.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// s, strictly rising within a trajectory.
    pub time: Vec<f64>,
    /// Commanded angles, sent after the row was measured and held until the next.
    pub command: Vec<f64>,
    /// Measured angles.
    pub angle: Vec<f64>,
    /// Stretches without a gap.
    pub trajectories: Vec<Trajectory>,
    /// Whether a row judges instead of being fitted; a trajectory may have rows of both kinds.
    pub held_out: Vec<bool>,
    /// s between two commands.
    pub period: f64,
    /// rad, steps of the encoder, by joint.
    pub encoder: Vec<f64>,
    /// rad, one standard deviation beside them, by joint.
    pub noise: Vec<f64>,
}

/// Commands of one trajectory with those put back whose rows are missing.
#[derive(Debug, Clone)]
pub(crate) struct Commands {
    time: Vec<f64>,
    /// `time x joints`.
    value: Vec<f64>,
    speed: Vec<f64>,
    /// Integral of value and speed up to each time.
    summed: Vec<f64>,
    summed_speed: Vec<f64>,
    joints: usize,
}

/// Rows that may be missing between two.
const GAP: f64 = 12.0;
/// s without rows after which nobody knows what was commanded and what the arm did: a trajectory begins anew.
pub const PAUSE: f64 = 0.5;
/// s between two recordings, whose clocks do not say it.
const BREAK: f64 = 1.0;
/// Share of the period by which a command may be stamped later than it is taken.
const EARLY: f64 = 0.2;
/// s at the beginning in which a trajectory rests.
const REST: f64 = 0.4;
/// Steps of the encoder, plus standard deviations of the noise, that the angles of a joint at rest span at most.
const STEPS_AT_REST: f64 = 2.5;
const SIGMAS_AT_REST: f64 = 8.0;
/// s, and rows at least, from which the speed of a joint is estimated that moves at the beginning.
const GLANCE: f64 = 0.06;
const LOOKS: usize = 5;

/// Runs of rows, parted where the stamps have a pause.
pub fn without_pauses(time: &[f64], runs: &[Range<usize>], period: f64) -> Vec<Range<usize>> {
    let most = PAUSE.max(GAP * period);
    let mut parted = Vec::new();
    for run in runs {
        let mut start = run.start;
        for row in run.start + 1..run.end {
            if time[row] - time[row - 1] > most {
                parted.push(start..row);
                start = row;
            }
        }
        parted.push(start..run.end);
    }
    parted
}

impl Recording {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.encoder.len()
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// Fails where rows cannot be simulated; `label` names the recording.
    pub fn check(&self, label: &str) -> Result<()> {
        let n = self.joints();
        let fail = |message: String| Err(Error::data(label, message));
        if self.rows() < 20 {
            return fail(format!("has {} rows; expected at least 20", self.rows()));
        }
        if self.command.len() != n * self.rows() || self.angle.len() != n * self.rows() {
            return fail("commands and angles are not of equal length".into());
        }
        for trajectory in &self.trajectories {
            for row in trajectory.rows.clone().skip(1) {
                if self.time[row] <= self.time[row - 1] {
                    let (before, after) = (self.time[row - 1], self.time[row]);
                    return fail(format!(
                        "row {}: time {after} s does not come after {before} s; within a trajectory times rise",
                        row + 1
                    ));
                }
            }
        }
        let mut steps: Vec<f64> = self
            .trajectories
            .iter()
            .flat_map(|t| t.rows.clone().skip(1))
            .map(|row| self.time[row] - self.time[row - 1])
            .collect();
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or_default();
        if (median / self.period - 1.0).abs() > 0.3 {
            return fail(format!(
                "rows are {:.4} s apart, the stated rate of commands is {:.4} Hz ({:.4} s): state the rate at which commands are sent, \
                 `command_rate_hz`, and time in s",
                median,
                1.0 / self.period,
                self.period
            ));
        }
        Ok(())
    }

    /// Span of the commands of a joint, and whether its angles never leave where they begin.
    fn motion(&self, joint: usize) -> (f64, bool) {
        let n = self.joints();
        let span = |all: &[f64]| {
            let of_joint = || all.iter().skip(joint).step_by(n).copied();
            of_joint().fold(f64::MIN, f64::max) - of_joint().fold(f64::MAX, f64::min)
        };
        let still = 3.0 * self.encoder[joint].max(self.noise[joint]);
        (span(&self.command), span(&self.angle) < still)
    }

    /// Joints, from 1, that never move though they are commanded to, or that neither are.
    fn unmoved(&self, commanded: bool) -> String {
        let is_one = |joint: &usize| {
            let (sent, is_still) = self.motion(*joint);
            is_still && (sent > 10.0 * self.encoder[*joint].max(1e-3)) == commanded
        };
        let all = (0..self.joints()).filter(is_one);
        let all: Vec<String> = all.map(|joint| (joint + 1).to_string()).collect();
        all.join(", ")
    }

    /// Fails where a joint never moves though it is commanded to; `label` names the recordings. Joints that rest are told, in a sentence.
    pub fn check_motion(&self, label: &str) -> Result<Option<String>> {
        let still = self.unmoved(true);
        if !still.is_empty() {
            let message = format!(
                "joint {still} never moves though it is commanded to; is its column the right one? A joint that is held is left out of `joints`"
            );
            return Err(Error::data(label, message));
        }
        let rests = Some(self.unmoved(false)).filter(|rests| !rests.is_empty());
        Ok(rests.map(|rests| {
            format!(
                "{label}: joint {rests} rests, so that nothing is learnt of its drive and friction; a joint that is held is left out of `joints`"
            )
        }))
    }

    /// Puts another recording of the same drives behind this one; its clock goes on after ours.
    pub fn append(&mut self, other: &Self) {
        let rows = self.rows();
        let last = self.time.last().copied().unwrap_or_default();
        let later = last + BREAK - other.time.first().copied().unwrap_or_default();
        self.time.extend(other.time.iter().map(|time| time + later));
        self.command.extend_from_slice(&other.command);
        self.angle.extend_from_slice(&other.angle);
        self.held_out.extend_from_slice(&other.held_out);
        let trajectories = other.trajectories.iter().map(|one| Trajectory {
            rows: one.rows.start + rows..one.rows.end + rows,
            began: one.began + later,
        });
        self.trajectories.extend(trajectories);
    }

    /// Some trajectories alone.
    pub(crate) fn cut(&self, trajectories: &[Trajectory]) -> Self {
        let n = self.joints();
        let mut cut = Self {
            time: Vec::new(),
            command: Vec::new(),
            angle: Vec::new(),
            trajectories: Vec::new(),
            held_out: Vec::new(),
            period: self.period,
            encoder: self.encoder.clone(),
            noise: self.noise.clone(),
        };
        for one in trajectories {
            let (rows, cells) = (one.rows.clone(), one.rows.start * n..one.rows.end * n);
            let from = cut.rows();
            cut.time.extend_from_slice(&self.time[rows.clone()]);
            cut.command.extend_from_slice(&self.command[cells.clone()]);
            cut.angle.extend_from_slice(&self.angle[cells]);
            cut.held_out.extend_from_slice(&self.held_out[rows]);
            cut.trajectories.push(Trajectory {
                rows: from..cut.rows(),
                began: one.began,
            });
        }
        cut
    }

    /// Whether a trajectory has rows to fit.
    pub(crate) fn is_fitted(&self, trajectory: &Trajectory) -> bool {
        self.held_out[trajectory.rows.clone()].contains(&false)
    }

    /// Angles and speeds of a trajectory's beginning: a joint rests, or it moves as its first rows say.
    pub(crate) fn start(&self, trajectory: &Trajectory) -> (Vec<f64>, Vec<f64>) {
        let n = self.joints();
        let first = trajectory.rows.start;
        let since = |row: usize| self.time[row] - self.time[first];
        let rows = || trajectory.rows.clone();
        let rest = rows().filter(|row| since(*row) < REST).count();
        let glance = rows().filter(|row| since(*row) < GLANCE).count();
        let glance = glance.max(LOOKS).min(trajectory.rows.len());
        let of = |joint: usize| {
            let angle = |row: usize| self.angle[row * n + joint];
            let all = || (first..first + rest).map(angle);
            let span = all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min);
            let still = STEPS_AT_REST * self.encoder[joint] + SIGMAS_AT_REST * self.noise[joint];
            if span <= still || glance < LOOKS {
                return (all().sum::<f64>() / rest as f64, 0.0);
            }
            // A parabola through the first rows.
            let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for row in first..first + glance {
                let x = Vector3::new(1.0, since(row), since(row) * since(row));
                gram += x * x.transpose();
                right += x * angle(row);
            }
            let fitted = gram.cholesky().map(|factor| factor.solve(&right));
            fitted.map_or((angle(first), 0.0), |fitted| (fitted[0], fitted[1]))
        };
        (0..n).map(of).unzip()
    }

    /// Standard deviation of each angle: of a coarse encoder one and the same error stands in all rows in which its count does not change.
    pub(crate) fn sigma(&self) -> Vec<f64> {
        let n = self.joints();
        let mut sigma = vec![0.0; self.angle.len()];
        for trajectory in &self.trajectories {
            for joint in 0..n {
                let step = self.encoder[joint];
                let mut row = trajectory.rows.start;
                while row < trajectory.rows.end {
                    let value = self.angle[row * n + joint];
                    let mut end = row + 1;
                    while end < trajectory.rows.end
                        && (self.angle[end * n + joint] - value).abs() < 0.5 * step
                    {
                        end += 1;
                    }
                    let variance = self.noise[joint] * self.noise[joint]
                        + step * step / 12.0 * (end - row) as f64;
                    for k in row..end {
                        sigma[k * n + joint] = variance.sqrt().max(1e-9);
                    }
                    row = end;
                }
            }
        }
        sigma
    }

    pub(crate) fn commands(&self, trajectory: &Trajectory, hold: f64) -> Commands {
        let n = self.joints();
        let rows = trajectory.rows.clone();
        let (mut time, mut value, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        for row in rows.clone() {
            if row > rows.start {
                let (a, b) = (self.time[row - 1], self.time[row]);
                let gap = ((b - a) / self.period).round();
                if gap > 1.0 && gap < GAP {
                    for k in 1..gap as usize {
                        let share = k as f64 / gap;
                        time.push(a + (b - a) * share);
                        counts.push(1.0);
                        for joint in 0..n {
                            value.push(self.between(&rows, row, joint, share));
                        }
                    }
                    counts.push(1.0);
                } else {
                    counts.push(gap.max(1.0));
                }
            } else {
                counts.push(1.0);
            }
            time.push(self.time[row]);
            value.extend_from_slice(&self.command[row * n..(row + 1) * n]);
        }
        let mut lasts: Vec<f64> = counts.iter().map(|count| count * self.period).collect();
        if hold > 0.0 {
            (time, value) = self.taken(trajectory, &time, &value, hold);
            lasts = vec![hold; time.len()];
        }
        let mut speed = vec![0.0; value.len()];
        for k in 1..time.len() {
            for joint in 0..n {
                speed[k * n + joint] =
                    (value[k * n + joint] - value[(k - 1) * n + joint]) / lasts[k];
            }
        }
        let summed = |of: &[f64]| {
            let mut sums = vec![0.0; of.len()];
            for k in 1..time.len() {
                for joint in 0..n {
                    sums[k * n + joint] = sums[(k - 1) * n + joint]
                        + of[(k - 1) * n + joint] * (time[k] - time[k - 1]);
                }
            }
            sums
        };
        Commands {
            summed: summed(&value),
            summed_speed: summed(&speed),
            time,
            value,
            speed,
            joints: n,
        }
    }

    /// Times and commands of a drive whose own clock runs on through the recording and takes at each tick the last command that was sent.
    fn taken(
        &self,
        trajectory: &Trajectory,
        sent: &[f64],
        value: &[f64],
        hold: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let (n, began) = (self.joints(), trajectory.began);
        let (first, last) = (sent[0], sent[sent.len() - 1]);
        let slot = ((first - began) / hold + 1e-6).floor();
        let ticks = (1..).map(|k| began + (slot + f64::from(k)) * hold);
        let ticks = ticks.take_while(|tick| *tick <= last);
        let (mut time, mut taken, mut row) = (vec![first], value[..n].to_vec(), 0);
        for tick in ticks {
            // Stamps of rows that are due at a tick may be a little later.
            while row + 1 < sent.len() && sent[row + 1] <= tick + EARLY * self.period {
                row += 1;
            }
            time.push(tick);
            taken.extend_from_slice(&value[row * n..(row + 1) * n]);
        }
        (time, taken)
    }

    /// A command between rows `row - 1` and `row`, by the cubic through the neighbours (Catmull and Rom).
    fn between(&self, rows: &Range<usize>, row: usize, joint: usize, share: f64) -> f64 {
        let n = self.joints();
        let at = |row: usize| self.command[row.clamp(rows.start, rows.end - 1) * n + joint];
        let (p, a, b, c) = (at(row.saturating_sub(2)), at(row - 1), at(row), at(row + 1));
        let (m, k) = (0.5 * (b - p), 0.5 * (c - a));
        let (t, t2, t3) = (share, share * share, share * share * share);
        a * (2.0 * t3 - 3.0 * t2 + 1.0)
            + m * (t3 - 2.0 * t2 + t)
            + b * (3.0 * t2 - 2.0 * t3)
            + k * (t3 - t2)
    }
}

impl Commands {
    /// Number of the last command sent at a time, from a guess.
    pub(crate) fn index(&self, time: f64, guess: usize) -> usize {
        let mut k = guess.min(self.time.len() - 1);
        while k > 0 && self.time[k] > time {
            k -= 1;
        }
        while k + 1 < self.time.len() && self.time[k + 1] <= time {
            k += 1;
        }
        k
    }

    /// Means of command and commanded speed between two times.
    pub(crate) fn mean(&self, joint: usize, from: f64, to: f64, guess: usize) -> [f64; 2] {
        let (a, b) = (self.index(from, guess), self.index(to, guess));
        let n = self.joints;
        if a == b {
            return [self.value[a * n + joint], self.speed[a * n + joint]];
        }
        let integral = |of: &[f64], sums: &[f64], k: usize, time: f64| {
            sums[k * n + joint] + of[k * n + joint] * (time - self.time[k])
        };
        [
            (&self.value, &self.summed),
            (&self.speed, &self.summed_speed),
        ]
        .map(|(of, sums)| (integral(of, sums, b, to) - integral(of, sums, a, from)) / (to - from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints at 100 Hz, steps of 1e-5 rad: the first moves from the beginning, the second after half a second.
    fn recording() -> Recording {
        let rows = 0..200;
        let time: Vec<f64> = rows.clone().map(|row| 0.01 * f64::from(row)).collect();
        let angle = time.iter().flat_map(|t| {
            let second = if *t > 0.5 { 0.2 + 0.3 * (t - 0.5) } else { 0.2 };
            [0.1 + 0.8 * t + 0.5 * t * t, second]
        });
        let angle: Vec<f64> = angle.collect();
        Recording {
            time,
            command: angle.clone(),
            angle,
            trajectories: vec![Trajectory {
                rows: 0..200,
                began: 0.0,
            }],
            held_out: vec![false; 200],
            period: 0.01,
            encoder: vec![1e-5; 2],
            noise: vec![1e-6; 2],
        }
    }

    #[test]
    fn a_trajectory_begins_as_it_is_measured_at_rest_or_in_motion() {
        let recording = recording();
        let (angle, speed) = recording.start(&recording.trajectories[0]);
        assert!((angle[0] - 0.1).abs() < 1e-9 && (speed[0] - 0.8).abs() < 1e-6);
        assert!((angle[1] - 0.2).abs() < 1e-12 && speed[1] == 0.0);
    }

    #[test]
    fn a_drive_that_takes_commands_rarely_does_so_at_ticks_of_its_own_clock() {
        let mut recording = recording();
        recording.trajectories[0].rows = 100..200;
        let whole = &recording.trajectories[0];
        let command = |row: usize| recording.command[2 * row];
        // From the beginning of the recording on every 30 ms: 1.02 s, 1.05 s ..
        let held = recording.commands(whole, 0.03);
        let close =
            |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9;
        assert!(close(held.mean(0, 1.015, 1.016, 0), [command(100), 0.0]));
        let rate = (command(102) - command(100)) / 0.03;
        assert!(close(held.mean(0, 1.025, 1.026, 0), [command(102), rate]));
        // Between two rows the last one that was sent.
        let held = recording.commands(whole, 0.015);
        let rate = (command(103) - command(102)) / 0.015;
        assert!(close(held.mean(0, 1.036, 1.037, 0), [command(103), rate]));
    }

    #[test]
    fn recordings_of_the_same_drives_follow_each_other_each_with_its_own_clock() {
        let (mut whole, later) = (recording(), recording());
        whole.append(&later);
        assert_eq!(whole.rows(), 400);
        assert_eq!(whole.trajectories[1].rows, 200..400);
        let since = whole.time[250] - whole.trajectories[1].began;
        assert!((since - 0.5).abs() < 1e-9, "{since}");
        assert!(whole.time.windows(2).all(|pair| pair[0] < pair[1]));
        whole.check("both").unwrap();
    }
}

//! Commands and responses as a problem of the engine: residual is measured minus simulated angle, whitened by encoder and noise.

use crate::around::Around;
use crate::causes::Usual;
use crate::chain::Chain;
use crate::fit::DriveFit;
use crate::key::Key;
use crate::physics::{Over, Physics};
use crate::recording::{Recording, Trajectory};
use crate::rollout::{Which, roll};
use crate::steps::longest;
use calib_dynamics::InertialTolerance;
use calib_engine::{Accepted, Problem, Scanned};

/// Inertial numbers of a link that are free within their tolerance: mass, centre, inertia.
pub(crate) const FREE: usize = 5;
/// s of recordings in which causes are looked for, and of a window of longer ones.
const SEARCHED: f64 = 40.0;
const WINDOW: f64 = 8.0;
/// Rows of which a residual is summed.
const SLOW: usize = 5;

/// A simulated arm and its recording.
#[derive(Debug, Clone)]
pub struct Drives {
    /// What moves.
    pub chain: Chain,
    /// The simulation as its user has it.
    pub base: Physics,
    /// What was commanded and measured.
    pub recording: Recording,
    /// One standard deviation of the declared inertials.
    pub tolerance: InertialTolerance,
    /// Causes that are not tried.
    pub without: Vec<String>,
    pub(crate) sigma: Vec<f64>,
    pub(crate) usual: Vec<Usual>,
    /// s from the beginning of a recording to its last row, and to the last that is fitted.
    pub(crate) duration: f64,
    pub(crate) shown: f64,
    /// The chain with the steps of a scan: it ranks, so that it needs no finer ones.
    pub(crate) scanned: Chain,
    /// Times that steps were halved.
    pub(crate) halved: usize,
}

impl Drives {
    /// The problem of an arm and its recording.
    pub fn new(
        mut chain: Chain,
        base: Physics,
        recording: Recording,
        tolerance: InertialTolerance,
    ) -> Self {
        let sigma = recording.sigma();
        chain.step = longest(&chain, &base, &recording, &sigma);
        let lasts = |t: &Trajectory| recording.time[t.rows.end - 1] - t.began;
        let duration = recording.trajectories.iter().map(lasts).fold(0.0, f64::max);
        let fitted = recording.trajectories.iter().filter_map(|t| {
            let last = t.rows.clone().rfind(|row| !recording.held_out[*row])?;
            Some(recording.time[last] - t.began)
        });
        let shown = fitted.fold(0.0, f64::max);
        let usual = usual(&chain, &base, &recording);
        Self {
            scanned: chain.clone(),
            halved: 0,
            chain,
            base,
            recording,
            tolerance,
            without: Vec::new(),
            sigma,
            usual,
            duration,
            shown,
        }
    }

    /// The problem of a part of a long recording, in which causes are looked for: windows of all trajectories, each from where it begins.
    pub(crate) fn part(&self) -> Option<Self> {
        let time = |row: usize| self.recording.time[row];
        let fitted = || {
            let all = self.recording.trajectories.iter();
            all.filter(|one| self.recording.is_fitted(one))
        };
        let lasts: f64 = fitted()
            .map(|one| time(one.rows.end - 1) - time(one.rows.start))
            .sum();
        let every = (lasts / SEARCHED).ceil() as usize;
        if every < 2 {
            return None;
        }
        let mut windows: Vec<Trajectory> = Vec::new();
        for one in fitted() {
            // A trajectory is cut where it is long: what begins in motion begins less surely than what rests.
            let lasts = time(one.rows.end - 1) - time(one.rows.start);
            let count = (lasts / WINDOW).round().max(1.0) as usize;
            let end = |k: usize| one.rows.start + one.rows.len() * k / count;
            windows.extend((0..count).map(|k| Trajectory {
                rows: end(k)..end(k + 1),
                began: one.began,
            }));
        }
        let kept = windows.into_iter().step_by(every);
        let kept = kept.filter(|one| one.rows.len() > 1 && self.recording.is_fitted(one));
        let kept: Vec<Trajectory> = kept.collect();
        let n = self.chain.joints();
        let sigma = kept
            .iter()
            .flat_map(|one| &self.sigma[one.rows.start * n..one.rows.end * n]);
        Some(Self {
            sigma: sigma.copied().collect(),
            recording: self.recording.cut(&kept),
            ..self.clone()
        })
    }

    /// The simulation with inertials within their tolerance and a set of causes.
    pub(crate) fn physics(&self, inertia: &[f64], set: &[Accepted<Key>]) -> Physics {
        let mut physics = self.base.clone();
        for (link, by) in physics.bodies.links.iter_mut().zip(inertia.chunks(FREE)) {
            link.mass *= (1.0 + self.tolerance.mass_relative * by[0]).max(0.01);
            for axis in 0..3 {
                link.centre[axis] += self.tolerance.centre * by[1 + axis];
            }
            link.inertia *= (1.0 + self.tolerance.inertia_relative * by[4]).max(0.01);
        }
        for accepted in set {
            accepted
                .cell
                .key
                .apply(&accepted.numbers, &self.usual, self.duration, &mut physics);
        }
        // Each number has this limit by itself; two causes at their limits, of an arm and of a joint, would pass it together.
        for joint in &mut physics.joints {
            joint.delay = joint.delay.max(0.0);
            joint.damping = joint.damping.max(-joint.kd);
        }
        physics
    }

    /// Simulated angles of rows, 0 of those that are not rolled out.
    pub(crate) fn angles(&self, physics: &Physics, which: Which) -> Vec<f64> {
        let n = self.chain.joints();
        let mut angles = vec![0.0; self.recording.angle.len()];
        roll(&self.chain, physics, &self.recording, &[], which, |row| {
            angles[row.row * n..(row.row + 1) * n].copy_from_slice(row.angle);
        });
        angles
    }

    /// Rows that are fitted.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = usize> + '_ {
        let trajectories = self.recording.trajectories.iter();
        let rows = trajectories.flat_map(|t| t.rows.clone());
        rows.filter(|row| !self.recording.held_out[*row])
    }

    /// Squared residual of a fit's rows, joint by joint, whitened by noise and model error.
    pub(crate) fn squares(&self, fit: &DriveFit) -> Vec<f64> {
        let squares = self.noise_squares(&fit.angles).into_iter();
        squares
            .zip(&fit.doubt)
            .map(|(square, doubt)| square / (doubt * doubt))
            .collect()
    }

    /// The same of angles, whitened by the noise alone.
    pub(crate) fn noise_squares(&self, angles: &[f64]) -> Vec<f64> {
        let n = self.chain.joints();
        let mut squares = vec![0.0; n];
        for row in self.fitted() {
            for (joint, square) in squares.iter_mut().enumerate() {
                let at = row * n + joint;
                *square += ((self.recording.angle[at] - angles[at]) / self.sigma[at]).powi(2);
            }
        }
        squares
    }

    /// Squared residual of a fit as that of noise, joint by joint, of the sums of a few rows each, and how many sums there are: what lasts from
    /// row to row stands out of noise there.
    pub(crate) fn slow_squares(&self, fit: &DriveFit) -> (Vec<f64>, f64) {
        let n = self.chain.joints();
        let (mut squares, mut count) = (vec![0.0; n], 0.0);
        for trajectory in &self.recording.trajectories {
            let rows: Vec<usize> = trajectory.rows.clone().collect();
            for rows in rows.chunks_exact(SLOW) {
                if rows.iter().any(|row| self.recording.held_out[*row]) {
                    continue;
                }
                count += 1.0;
                for (joint, square) in squares.iter_mut().enumerate() {
                    let whitened = rows.iter().map(|row| row * n + joint).map(|at| {
                        (self.recording.angle[at] - fit.angles[at])
                            / (self.sigma[at] * fit.doubt[joint])
                    });
                    *square += whitened.sum::<f64>().powi(2) / SLOW as f64;
                }
            }
        }
        (squares, count)
    }

    /// rad rms of the residual of each joint in fitted rows.
    pub(crate) fn errors_of(&self, angles: &[f64]) -> Vec<f64> {
        let n = self.chain.joints();
        let mut squares = vec![0.0; n];
        let mut rows = 0.0;
        for row in self.fitted() {
            rows += 1.0;
            for (joint, square) in squares.iter_mut().enumerate() {
                let at = row * n + joint;
                *square += (self.recording.angle[at] - angles[at]).powi(2);
            }
        }
        squares
            .iter()
            .map(|square| (square / rows).sqrt())
            .collect()
    }
}

/// The cell with a name that a free curve may be, with its numbers as the curve has them, as the first of scanned cells: dry friction of a curve
/// over the own speed, a spring of one over the own angle. Far from where a linear scan stands it hardly sees them.
fn by_its_law(
    member: &Accepted<Key>,
    usual: &[Usual],
    scanned: &[Scanned<Key>],
) -> Option<Scanned<Key>> {
    let values = &member.numbers;
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let (key, numbers) = match member.cell.key {
        Key::Unknown(joint, Over::Speed(by), true) if by == joint => {
            (Key::Coulomb(joint), vec![mean])
        }
        Key::Unknown(joint, Over::Angle(by), false) if by == joint => {
            let [from, to] = usual[joint].range;
            let middle = 0.5 * (count - 1.0);
            let from_middle = |k: usize| k as f64 - middle;
            let slope: f64 = (0..values.len()).map(|k| from_middle(k) * values[k]).sum();
            let square: f64 = (0..values.len()).map(|k| from_middle(k).powi(2)).sum();
            let slope = slope / square * (count - 1.0) / (to - from);
            let at_zero = mean - slope * 0.5 * (from + to);
            (Key::Cable(joint), vec![-slope, at_zero])
        }
        _ => return None,
    };
    let is_it = |one: &&Scanned<Key>| one.accepted.cell.key == key;
    let mut named = scanned.iter().find(is_it)?.clone();
    (named.accepted.numbers, named.log_odds) = (numbers, f64::INFINITY);
    Some(named)
}

/// What the simulation as it is does.
fn usual(chain: &Chain, base: &Physics, recording: &Recording) -> Vec<Usual> {
    let n = chain.joints();
    let mut usual = vec![
        Usual {
            range: [f64::MAX, f64::MIN],
            ..Usual::default()
        };
        n
    ];
    let (mut rows, mut before) = (0.0, vec![0.0; n]);
    let mut before_row: Option<usize> = None;
    roll(chain, base, recording, &[], Which::Fitted, |row| {
        rows += 1.0;
        for (j, u) in usual.iter_mut().enumerate() {
            let command = recording.command[row.row * n + j];
            let angle = recording.angle[row.row * n + j];
            u.torque[0] += row.drive[j].powi(2);
            u.torque[1] = u.torque[1].max(row.drive[j].abs());
            u.speed[0] += row.speed[j].powi(2);
            u.speed[1] = u.speed[1].max(row.speed[j].abs());
            u.error += (command - row.angle[j]).powi(2);
            u.range = [u.range[0].min(angle), u.range[1].max(angle)];
            if let Some(last) = before_row.filter(|last| last + 1 == row.row) {
                let dt = recording.time[row.row] - recording.time[last];
                u.acceleration += ((row.speed[j] - before[j]) / dt).powi(2);
                let sent = (command - recording.command[last * n + j]) / recording.period;
                u.commanded = u.commanded.max(sent.abs());
            }
            before[j] = row.speed[j];
        }
        before_row = Some(row.row);
    });
    for u in &mut usual {
        for sum in [
            &mut u.torque[0],
            &mut u.speed[0],
            &mut u.error,
            &mut u.acceleration,
        ] {
            *sum = (*sum / rows).sqrt();
        }
    }
    usual
}

impl Problem for Drives {
    type Key = Key;
    type Fit = DriveFit;
    type Around = Around;

    fn around(&self, fit: &DriveFit, before: Option<&Around>) -> Around {
        Around::new(self, fit, before)
    }

    fn informed(&self, mut fit: DriveFit, around: &Around) -> DriveFit {
        fit.rich = fit.rich.max(around.rich);
        fit
    }

    fn scan(&self, fit: &DriveFit, around: &Around, out: Option<usize>) -> Vec<Scanned<Key>> {
        let mut scanned = around.scan(fit, out);
        if let Some(named) =
            out.and_then(|member| by_its_law(&fit.set[member], &self.usual, &scanned))
        {
            scanned.insert(0, named);
        }
        scanned
    }

    fn fit(&self, set: &[Accepted<Key>], before: Option<&DriveFit>, least: f64) -> DriveFit {
        match before {
            Some(fit) => self.fitted_with(&self.begun(set, fit), before, false, least),
            None => self.fitted_with(set, None, false, least),
        }
    }

    fn settled(&self, fit: &DriveFit) -> DriveFit {
        self.fitted_with(&fit.set, Some(fit), true, f64::NEG_INFINITY)
    }

    fn is_accurate(&self, fit: &DriveFit) -> bool {
        self.is_fine_for_gears(fit)
    }

    fn set(&self, fit: &DriveFit) -> Vec<Accepted<Key>> {
        fit.set.clone()
    }

    fn independence(&self, fit: &DriveFit) -> f64 {
        fit.share()
    }

    fn log_evidence(&self, fit: &DriveFit, independence: f64) -> f64 {
        fit.log_evidence(independence)
    }

    fn odds(&self, fit: &DriveFit, member: usize, independence: f64) -> Option<f64> {
        fit.odds(member, independence)
    }

    fn excludes(&self, one: &Accepted<Key>, other: &Accepted<Key>) -> bool {
        one.cell.key.excludes(other.cell.key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::against_mujoco::{TOLERANCE, motion};
    use crate::causes::cells;

    #[test]
    fn no_command_is_taken_before_it_is_sent_and_no_joint_speeds_up_by_itself() {
        let (chain, mut base, mut recording) = motion();
        base.joints.iter_mut().for_each(|joint| joint.delay = 4e-3);
        let drives = Drives::new(chain, base.clone(), recording.clone(), TOLERANCE);
        let all = cells(&base, &drives.usual, recording.period, drives.shown);
        let member = |key: Key, number: f64| Accepted {
            cell: all.iter().find(|cell| cell.key == key).unwrap().clone(),
            shape: 0,
            numbers: vec![number],
        };
        let mut early = base.clone();
        early
            .joints
            .iter_mut()
            .for_each(|joint| joint.delay = -8e-3);
        recording.angle = drives.angles(&early, Which::All);
        let measured = Drives::new(drives.chain.clone(), base.clone(), recording, TOLERANCE);
        let fit = measured.fit(&[member(Key::Delay(None), 0.0)], None, f64::NEG_INFINITY);
        assert_eq!(fit.set[0].numbers, [-4e-3]);
        let found = measured.physics(&fit.inertia, &fit.set);
        assert!(found.joints.iter().all(|joint| joint.delay == 0.0));
        let least = |key: Key| member(key, 0.0).cell.shapes[0].bounds[0][0];
        assert_eq!(least(Key::Delay(Some(1))), -4e-3);
        let joint = &base.joints[1];
        assert_eq!(least(Key::Viscous(1)), -(joint.damping + joint.kd));
    }
}

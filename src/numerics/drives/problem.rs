//! Commands and responses as a problem of the engine: residual is measured minus simulated angle, whitened by encoder and noise.

use crate::around::Around;
use crate::causes::Usual;
use crate::chain::{Chain, STEP};
use crate::fit::DriveFit;
use crate::key::Key;
use crate::physics::Physics;
use crate::recording::{Recording, Trajectory};
use crate::rollout::{Which, roll};
use calib_dynamics::InertialTolerance;
use calib_engine::{Accepted, Problem, Scanned};

/// Inertial numbers of a link that are free within their tolerance: mass, centre, inertia.
pub(crate) const FREE: usize = 5;
/// s of recordings in which causes are looked for, and of a window of longer ones.
const SEARCHED: f64 = 40.0;
const WINDOW: f64 = 8.0;

/// Longer steps that are tried, s, and the share of the noise, rms, that is the same motion.
const LONGER: [f64; 2] = [2.5e-3, 1.7e-3];
const SAME: f64 = 0.03;

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
        chain.step = step(&chain, &base, &recording, &sigma);
        let lasts = |t: &Trajectory| recording.time[t.rows.end - 1] - t.began;
        let duration = recording.trajectories.iter().map(lasts).fold(0.0, f64::max);
        let fitted = recording.trajectories.iter().filter_map(|t| {
            let last = t.rows.clone().rfind(|row| !recording.held_out[*row])?;
            Some(recording.time[last] - t.began)
        });
        let shown = fitted.fold(0.0, f64::max);
        let usual = usual(&chain, &base, &recording);
        Self {
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

    /// By joint, rad rms by which a simulation moves where its steps are halved, and the whitened square of that in all rows.
    pub(crate) fn coarseness(&self, physics: &Physics) -> (Vec<f64>, f64) {
        let n = self.chain.joints();
        let mut fine = self.clone();
        fine.chain.halve();
        let (now, finer) = (
            self.angles(physics, Which::Fitted),
            fine.angles(physics, Which::Fitted),
        );
        let mut squares = vec![0.0; n];
        let (mut rows, mut whitened) = (0.0, 0.0);
        for row in self.fitted() {
            rows += 1.0;
            for (joint, square) in squares.iter_mut().enumerate() {
                let at = row * n + joint;
                let moves = (now[at] - finer[at]).powi(2);
                *square += moves;
                whitened += moves / self.sigma[at].powi(2);
            }
        }
        let root = |square: f64| (square / rows).sqrt();
        (squares.into_iter().map(root).collect(), whitened)
    }

    /// The same by steps of half the length; what these may still be off, rad by joint, is noise.
    pub(crate) fn finer(&self, off: &[f64]) -> Self {
        let n = self.chain.joints();
        let mut finer = self.clone();
        finer.chain.halve();
        for (at, sigma) in finer.sigma.iter_mut().enumerate() {
            *sigma = sigma.hypot(off[at % n]);
        }
        finer
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

/// The longest step, s, at which the simulation as it is goes where finer steps go, to a small share of the noise: in all rows, as those that
/// judge may ask more of a drive.
fn step(chain: &Chain, base: &Physics, recording: &Recording, sigma: &[f64]) -> f64 {
    let n = chain.joints();
    let rolled = |step: f64| {
        let mut chain = chain.clone();
        chain.step = step;
        let mut angles = Vec::new();
        roll(&chain, base, recording, &[], Which::All, |row| {
            let at = row.row * n;
            let whitened = row.angle.iter().zip(&sigma[at..at + n]);
            angles.extend(whitened.map(|(angle, sigma)| angle / sigma));
        });
        angles
    };
    let fine = rolled(STEP);
    let near = |step: &f64| {
        let mut squares = vec![0.0; n];
        for (k, (a, b)) in rolled(*step).iter().zip(&fine).enumerate() {
            squares[k % n] += (a - b).powi(2);
        }
        let rows = (fine.len() / n) as f64;
        squares.iter().all(|square| *square < rows * SAME * SAME)
    };
    LONGER.into_iter().find(near).unwrap_or(STEP)
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
        around.scan(fit, out)
    }

    fn fit(&self, set: &[Accepted<Key>], before: Option<&DriveFit>, least: f64) -> DriveFit {
        self.fitted_with(set, before, false, least)
    }

    fn settled(&self, fit: &DriveFit) -> DriveFit {
        self.fitted_with(&fit.set, Some(fit), true, f64::NEG_INFINITY)
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

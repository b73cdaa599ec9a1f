//! A motion from which torques tell most: Fourier series within limits whose information on base parameters and friction is greatest
//! (Swevers, Ganseman, Tukel, De Schutter, Van Brussel, IEEE TRA 1997; D-optimal).

use super::arm::{DynamicArm, INERTIAL_NUMBERS, inertial_name, inertial_unit};
use super::check::name;
use super::columns::{ReducedRegressor, Reduction, base_parameters};
use super::newton_euler::InverseDynamics;
use super::recording::{RecordingClock, TorqueRecording, column, ends};
use super::scene::{DynamicScene, split};
use crate::error::{Error, Fault, Result};
use crate::estimate::swarm::{Algorithm, Budget, SearchBox};
use crate::statistics::nearest;
use nalgebra::{DMatrix, DVector};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::f64::consts::TAU;

/// Random motions within the same limits that the result is compared with.
const RANDOM: usize = 50;
/// Rows of the motion whose information is counted while searching.
const COUNTED: usize = 80;
/// Rows a second on which limits are held while searching; the motion itself is checked on its own rows.
const GRID: f64 = 25.0;
/// A parameter whose variance others raise by more than this is hardly separable from them.
const INFLATED: f64 = 1e4;
/// rad: a joint that moves less shows neither its gravity nor an offset.
const SMALL_RANGE: f64 = 0.2;

/// What a motion may be and is for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExciteRequest {
    /// s.
    pub seconds: f64,
    /// Rows a second.
    pub rate: f64,
    /// Sines of a joint; the slowest lasts a period.
    pub harmonics: usize,
    /// rad, per joint.
    pub range: Vec<[f64; 2]>,
    /// rad/s, per joint.
    pub speed: Vec<f64>,
    /// rad/s^2, per joint.
    pub acceleration: Vec<f64>,
    /// Nm, white noise of a row, per joint.
    pub noise: Vec<f64>,
    /// Generations of the search.
    pub generations: usize,
    /// The same seed gives the same motion.
    pub seed: u64,
    /// Worker threads; no result depends on it.
    pub jobs: usize,
}

/// What a motion tells of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedSigma {
    /// As in the model of torques: `rigid_body.l3.moment_x`, `viscous_friction.j2.viscous`.
    pub name: String,
    /// SI.
    pub unit: &'static str,
    /// One standard deviation that the motion leaves.
    pub sigma: f64,
    /// The median of random motions within the same limits.
    pub random: f64,
    /// How many times other parameters raise its variance.
    pub inflation: f64,
}

/// A motion, and what it tells; lists are row-major (rows x n).
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitingMotion {
    /// s, from 0.
    pub time: Vec<f64>,
    /// rad.
    pub position: Vec<f64>,
    /// rad/s.
    pub velocity: Vec<f64>,
    /// rad/s^2.
    pub acceleration: Vec<f64>,
    /// Base parameters, then viscous and Coulomb friction of each joint.
    pub parameters: Vec<ExpectedSigma>,
    /// Condition of the regressor with columns of one length, of the motion and the median of random ones.
    pub condition: [f64; 2],
    /// Geometric mean over parameters of the sigma of random motions (median) over that of this one.
    pub gain: f64,
    /// Inertial numbers of the arm, of which only the base parameters are seen.
    pub inertials: usize,
    /// What the motion will not determine, a sentence each.
    pub unseen: Vec<String>,
}

/// Searches a motion for an arm.
///
/// # Errors
/// [`crate::error::Error::Spec`] with every number of the request that cannot be used.
pub fn excite(arm: &DynamicArm, request: &ExciteRequest) -> Result<ExcitingMotion> {
    check(arm, request)?;
    let n = arm.joints();
    let coarse = SeriesBasis::new(request.seconds, GRID, request.harmonics);
    let width = 1 + 2 * request.harmonics;
    let mut dice = ChaCha8Rng::seed_from_u64(request.seed);
    let mut random = |_| {
        (0..n * width)
            .map(|_| dice.random_range(-1.0..1.0))
            .collect()
    };
    let draws: Vec<Vec<f64>> = (0..RANDOM).map(&mut random).collect();
    let base = base_of(arm, &coarse, &scaled(&coarse, &draws[0], request));
    let information = Information {
        arm,
        base: &base,
        noise: &request.noise,
    };
    let rows = coarse.spread(COUNTED);
    let share = request.rate * request.seconds / rows.len() as f64;
    let of_x = |x: &[f64]| information.of(&coarse, &scaled(&coarse, x, request), &rows, share);
    let bounds = SearchBox::cube(n * width, -1.0, 1.0);
    let budget = Budget {
        generations: request.generations,
        evaluations: None,
        target: None,
        seed: request.seed,
        jobs: request.jobs,
    };
    let objective = |x: &[f64]| -of_x(x).log_determinant();
    let found = Algorithm::Pso.minimise(40, &objective, &bounds, &budget, |_, _| ());
    let best = of_x(&found.position);
    let others: Vec<_> = draws.iter().map(|x| of_x(x)).collect();
    let fine = SeriesBasis::new(request.seconds, request.rate, request.harmonics);
    let motion = fine.motion(&scaled(&fine, &found.position, request));
    let (sigmas, inflations) = (best.sigmas(), best.inflations());
    let all: Vec<Vec<f64>> = others.iter().map(|other| other.sigmas()).collect();
    let median = |values: &mut dyn Iterator<Item = f64>| {
        nearest(&mut values.collect::<Vec<f64>>(), 0.5).unwrap_or(f64::NAN)
    };
    let parameter = |(place, (name, unit))| ExpectedSigma {
        name,
        unit,
        sigma: sigmas[place],
        random: median(&mut all.iter().map(|other| other[place])),
        inflation: inflations[place],
    };
    let names = names(&base, n).into_iter().enumerate();
    let parameters: Vec<ExpectedSigma> = names.map(parameter).collect();
    let mut gains = others.iter().map(|other| {
        (best.log_determinant() - other.log_determinant()) / (2.0 * parameters.len() as f64)
    });
    let conditions = &mut others.iter().map(|other| other.condition());
    Ok(ExcitingMotion {
        condition: [best.condition(), median(conditions)],
        gain: median(&mut gains).exp(),
        inertials: INERTIAL_NUMBERS * n,
        unseen: unseen(&motion.position, n, &parameters),
        parameters,
        time: motion.time,
        position: motion.position,
        velocity: motion.velocity,
        acceleration: motion.acceleration,
    })
}

fn names(base: &[usize], joints: usize) -> Vec<(String, &'static str)> {
    let masses = base.iter().copied();
    let masses = masses.map(|number| (inertial_name(number), inertial_unit(number)));
    let friction = (1..=joints).flat_map(|joint| {
        [
            (format!("viscous_friction.j{joint}.viscous"), "Nm s/rad"),
            (format!("coulomb_friction.j{joint}.coulomb"), "Nm"),
        ]
    });
    masses.chain(friction).collect()
}

fn check(arm: &DynamicArm, request: &ExciteRequest) -> Result<()> {
    let n = arm.joints();
    let mut faults = Vec::new();
    let mut claim = |name: &str, is_so: bool, message: String| {
        faults.extend((!is_so).then(|| Fault::new(name, message)));
    };
    let lists = [
        ("speed", &request.speed),
        ("acceleration", &request.acceleration),
        ("noise", &request.noise),
    ];
    for (name, list) in lists {
        let is_positive = |value: &f64| value.is_finite() && *value > 0.0;
        let is_so = list.len() == n && list.iter().all(is_positive);
        claim(
            name,
            is_so,
            format!("expected {n} numbers above 0, one a joint"),
        );
    }
    let is_range = |[least, most]: &[f64; 2]| least.is_finite() && most.is_finite() && least < most;
    let is_so = request.range.len() == n && request.range.iter().all(is_range);
    claim(
        "range",
        is_so,
        format!("expected {n} finite ranges, one a joint"),
    );
    let ExciteRequest {
        seconds,
        rate,
        harmonics,
        ..
    } = request;
    let message = format!("{seconds}; allowed: 4 to 600");
    claim("seconds", (4.0..=600.0).contains(seconds), message);
    let message = format!("{rate}; allowed: 20 to 5000 Hz");
    claim("rate", (20.0..=5000.0).contains(rate), message);
    let message = format!("{harmonics}; allowed: 2 to 12");
    claim("harmonics", (2..=12).contains(harmonics), message);
    match faults.is_empty() {
        true => Ok(()),
        false => Err(Error::Spec(faults)),
    }
}

fn unseen(position: &[f64], n: usize, parameters: &[ExpectedSigma]) -> Vec<String> {
    let mut sentences = vec![
        "torque constants: torques in proportion at all joints are masses in proportion; a drive is seen where masses are declared".to_string(),
        "the payload apart from the last link: they are one body; two recordings, with and without it, show it".to_string(),
    ];
    for joint in 0..n {
        let [least, most] = ends(column(position, n, joint));
        let range = most - least;
        if range < SMALL_RANGE {
            sentences.push(format!(
                "{} moves over {range:.3} rad only: its gravity, an offset and a spring are one there",
                name(joint)
            ));
        }
    }
    for one in parameters.iter().filter(|one| one.inflation > INFLATED) {
        sentences.push(format!(
            "{}: hardly apart from other parameters (variance raised {:.0} times)",
            one.name, one.inflation
        ));
    }
    sentences
}

// What torques along a motion tell of base parameters and friction: the information matrix under white noise.

/// rad/s over which the sign of a velocity turns.
const SIGN_WIDTH: f64 = 0.01;
/// Hz.
const CUTOFF: f64 = 5.0;
/// Share of a column's information that is added to the diagonal, so that what is not seen at all is infinitely bad only in proportion.
const FLOOR: f64 = 1e-12;

/// Whose parameters, and how noisy torques are.
struct Information<'a> {
    arm: &'a DynamicArm,
    /// Base parameters, `10 link + number`.
    base: &'a [usize],
    /// Nm, per joint.
    noise: &'a [f64],
}

/// The information of a motion, scaled to ones on the diagonal, and the scales.
struct MotionInformation {
    scaled: DMatrix<f64>,
    scale: DVector<f64>,
}

/// Base parameters of an arm, from a motion that moves all joints.
fn base_of(arm: &DynamicArm, basis: &SeriesBasis, series: &JointSeries) -> Vec<usize> {
    let (n, motion) = (arm.joints(), basis.motion(series));
    let recording = TorqueRecording::of_motion(n, motion.time, motion.position);
    let clock = RecordingClock::even(&recording.time);
    let scene = DynamicScene::new(arm, &recording, &clock, CUTOFF, true);
    base_parameters(&ReducedRegressor::of(
        &scene,
        &Reduction::new(&clock, CUTOFF),
    ))
}

impl Information<'_> {
    /// The information of some rows of a motion, each standing for `share` recorded ones.
    fn of(
        &self,
        basis: &SeriesBasis,
        series: &JointSeries,
        rows: &[usize],
        share: f64,
    ) -> MotionInformation {
        let (n, masses) = (self.arm.joints(), self.base.len());
        let width = masses + 2 * n;
        let mut place = vec![None; INERTIAL_NUMBERS * n];
        for (column, number) in self.base.iter().enumerate() {
            place[*number] = Some(column);
        }
        let mut regressor = DMatrix::<f64>::zeros(n * rows.len(), width);
        let mut dynamics = InverseDynamics::new(self.arm);
        let mut motion = vec![0.0; 3 * n];
        for (count, row) in rows.iter().enumerate() {
            basis.row_into(series, *row, &mut motion);
            let first = n * count;
            dynamics.regressor(
                split(&motion, n),
                &self.arm.gravity,
                |joint, link, numbers| {
                    for (number, value) in numbers.iter().enumerate() {
                        if let Some(column) = place[INERTIAL_NUMBERS * link + number] {
                            regressor[(first + joint, column)] = value / self.noise[joint];
                        }
                    }
                },
            );
            for joint in 0..n {
                let velocity = motion[n + joint];
                regressor[(first + joint, masses + 2 * joint)] = velocity / self.noise[joint];
                regressor[(first + joint, masses + 2 * joint + 1)] =
                    (velocity / SIGN_WIDTH).tanh() / self.noise[joint];
            }
        }
        let whole = regressor.tr_mul(&regressor) * share;
        let scale = DVector::from_fn(width, |column, _| {
            whole[(column, column)].sqrt().max(f64::MIN_POSITIVE)
        });
        let scaled = DMatrix::from_fn(width, width, |a, b| {
            let value = whole[(a, b)] / (scale[a] * scale[b]);
            if a == b { value + FLOOR } else { value }
        });
        MotionInformation { scaled, scale }
    }
}

impl MotionInformation {
    /// Natural logarithm of the determinant; minus infinity where something is not seen.
    fn log_determinant(&self) -> f64 {
        let scales: f64 = self.scale.iter().map(|scale| 2.0 * scale.ln()).sum();
        let factor = self.scaled.clone().cholesky();
        factor.map_or(f64::NEG_INFINITY, |factor| {
            let logs = factor.l().diagonal().map(f64::ln);
            scales + 2.0 * logs.iter().sum::<f64>()
        })
    }

    /// How many times other parameters raise the variance of each.
    fn inflations(&self) -> Vec<f64> {
        self.scaled.clone().cholesky().map_or_else(
            || vec![f64::INFINITY; self.scale.len()],
            |factor| factor.inverse().diagonal().as_slice().to_vec(),
        )
    }

    /// One standard deviation of each parameter.
    fn sigmas(&self) -> Vec<f64> {
        let inflations = self.inflations().into_iter().zip(&self.scale);
        inflations
            .map(|(inflation, scale)| inflation.sqrt() / scale)
            .collect()
    }

    /// Condition of the regressor with columns of one length.
    fn condition(&self) -> f64 {
        let values = self.scaled.symmetric_eigenvalues();
        (values.max() / values.min().max(f64::MIN_POSITIVE)).sqrt()
    }
}

// Fourier series of joints that begin and end at rest, scaled to the limits of each joint.

/// s in which the arm starts and stops.
const RAMP: f64 = 1.0;
/// s: a period is not longer.
const PERIOD: f64 = 10.0;
/// Share of a limit that is used.
const USED: f64 = 0.98;

/// Sines and cosines of a clock, times the start and stop, with their derivatives: `[row][2 harmonic + (sine or cosine)]`.
struct SeriesBasis {
    time: Vec<f64>,
    terms: usize,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

/// Middle (rad) and coefficients of each joint.
struct JointSeries(Vec<(f64, Vec<f64>)>);

/// Row-major (rows x n).
struct SeriesMotion {
    time: Vec<f64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

impl SeriesBasis {
    /// Over `seconds` with `rate` rows a second.
    fn new(seconds: f64, rate: f64, harmonics: usize) -> Self {
        let slowest = TAU * (seconds / PERIOD).ceil() / seconds;
        let rows = 0..=(seconds * rate).round() as usize;
        let time: Vec<f64> = rows.map(|row| row as f64 / rate).collect();
        let (mut position, mut velocity, mut acceleration) = (Vec::new(), Vec::new(), Vec::new());
        for time in &time {
            let [gate, rise, bend] = gate(*time, seconds);
            for harmonic in 1..=harmonics {
                let rate = slowest * harmonic as f64;
                let (sine, cosine) = (rate * time).sin_cos();
                for (value, first) in [(sine, rate * cosine), (cosine, -rate * sine)] {
                    position.push(gate * value);
                    velocity.push(gate * first + rise * value);
                    acceleration.push(2.0 * rise * first + (bend - gate * rate * rate) * value);
                }
            }
        }
        Self {
            time,
            terms: 2 * harmonics,
            position,
            velocity,
            acceleration,
        }
    }

    /// So many rows, evenly spread, the first and the last apart.
    fn spread(&self, count: usize) -> Vec<usize> {
        let count = count.min(self.time.len() - 2).max(1);
        (0..count)
            .map(|one| 1 + (one * (self.time.len() - 2)) / count)
            .collect()
    }

    fn sum(&self, basis: &[f64], row: usize, coefficients: &[f64]) -> f64 {
        let terms = basis[self.terms * row..].iter().zip(coefficients);
        terms.map(|(a, b)| a * b).sum()
    }

    /// Positions, velocities and accelerations (3 n) of a row.
    fn row_into(&self, series: &JointSeries, row: usize, motion: &mut [f64]) {
        let n = series.0.len();
        for (joint, (middle, coefficients)) in series.0.iter().enumerate() {
            motion[joint] = middle + self.sum(&self.position, row, coefficients);
            motion[n + joint] = self.sum(&self.velocity, row, coefficients);
            motion[2 * n + joint] = self.sum(&self.acceleration, row, coefficients);
        }
    }

    /// All rows.
    fn motion(&self, series: &JointSeries) -> SeriesMotion {
        let n = series.0.len();
        let mut all = SeriesMotion {
            time: self.time.clone(),
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
        };
        let mut motion = vec![0.0; 3 * n];
        for row in 0..self.time.len() {
            self.row_into(series, row, &mut motion);
            all.position.extend(&motion[..n]);
            all.velocity.extend(&motion[n..2 * n]);
            all.acceleration.extend(&motion[2 * n..]);
        }
        all
    }
}

/// The series of numbers from -1 to 1 (of each joint a place in its range, then coefficients), each joint scaled to the limit that it
/// meets first on the rows of a clock.
fn scaled(basis: &SeriesBasis, x: &[f64], request: &ExciteRequest) -> JointSeries {
    let width = 1 + basis.terms;
    let of_course = |(joint, course): (usize, &[f64])| {
        // Equal speeds of all harmonics are likelier than equal amplitudes.
        let raw = course[1..].iter().enumerate();
        let raw: Vec<f64> = raw
            .map(|(term, value)| value / (1 + term / 2) as f64)
            .collect();
        let (mut least, mut greatest, mut fastest, mut hardest) =
            (0.0_f64, 0.0_f64, 1e-12_f64, 1e-12_f64);
        for row in 0..basis.time.len() {
            let position = basis.sum(&basis.position, row, &raw);
            (least, greatest) = (least.min(position), greatest.max(position));
            fastest = fastest.max(basis.sum(&basis.velocity, row, &raw).abs());
            hardest = hardest.max(basis.sum(&basis.acceleration, row, &raw).abs());
        }
        let [from, to] = request.range[joint];
        let room = (to - from) / (greatest - least).max(1e-12);
        let by_speed = room.min(request.speed[joint] / fastest);
        let scale = USED * by_speed.min(request.acceleration[joint] / hardest);
        let (lowest, highest) = (from - scale * least, to - scale * greatest);
        let margin = 0.5 * (1.0 - USED) * (highest - lowest);
        let middle = lowest + margin + 0.5 * (course[0] + 1.0) * (highest - lowest - 2.0 * margin);
        (middle, raw.iter().map(|value| scale * value).collect())
    };
    JointSeries(x.chunks_exact(width).enumerate().map(of_course).collect())
}

/// 0 at both ends, 1 between, with its derivatives.
fn gate(time: f64, seconds: f64) -> [f64; 3] {
    let (near, sign) = if time < 0.5 * seconds {
        (time, 1.0)
    } else {
        (seconds - time, -1.0)
    };
    let x = (near / RAMP).clamp(0.0, 1.0);
    let rise = 30.0 * x * x * (x * (x - 2.0) + 1.0) / RAMP;
    let bend = 60.0 * x * (x * (2.0 * x - 3.0) + 1.0) / (RAMP * RAMP);
    [x * x * x * (10.0 + x * (6.0 * x - 15.0)), sign * rise, bend]
}

#[cfg(test)]
mod tests {
    use super::super::recording::largest;
    use super::*;

    #[test]
    fn a_series_holds_its_limits_meets_one_and_starts_and_stops_at_rest() {
        let request = ExciteRequest {
            range: vec![[-0.5, 1.5]],
            speed: vec![0.8],
            acceleration: vec![2.0],
            ..ExciteRequest::default()
        };
        let x: Vec<f64> = (0..11).map(|k| (1.7 * f64::from(k)).sin()).collect();
        let basis = SeriesBasis::new(20.0, 100.0, 5);
        let motion = basis.motion(&scaled(&basis, &x, &request));
        let [speed, acceleration] = [&motion.velocity, &motion.acceleration].map(largest);
        assert!(motion.position.iter().all(|q| (-0.5..=1.5).contains(q)));
        assert!(speed <= 0.8 && acceleration <= 2.0);
        assert!(
            speed > 0.97 * 0.8 || acceleration > 0.97 * 2.0,
            "{speed} {acceleration}"
        );
        for end in [0, motion.time.len() - 1] {
            assert!(motion.velocity[end].abs() < 1e-9 && motion.acceleration[end].abs() < 1e-9);
        }
        // Derivatives are those of the positions.
        for row in 100..1900 {
            let differences = (motion.position[row + 1] - motion.position[row - 1]) * 50.0;
            assert!((motion.velocity[row] - differences).abs() < 1e-3);
        }
    }
}

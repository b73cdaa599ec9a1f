//! A motion from which torques tell most: Fourier series within limits whose information on base parameters and friction is greatest
//! (Swevers, Ganseman, Tukel, De Schutter, Van Brussel, IEEE TRA 1997; D-optimal).

mod information;
mod series;

use super::arm::{DynamicArm, inertial_name, inertial_unit};
use super::scene::ends;
use crate::error::{Error, Fault, Result};
use crate::estimate::swarm::{Algorithm, Budget, SearchBox};
use information::{Information, base_of};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use series::{JointLimits, SeriesBasis, scaled};

/// Random motions within the same limits that the result is compared with.
const RANDOM: usize = 50;
/// Rows of the motion whose information is counted while searching.
const COUNTED: usize = 80;
/// Rows a second on which limits are held while searching; the motion itself is checked on its own rows.
const GRID: f64 = 25.0;
/// A parameter whose variance others raise by more than this is hardly separable from them.
const INFLATED: f64 = 1e4;
/// rad: a joint that moves less shows neither its gravity nor an offset beside it.
const SMALL_RANGE: f64 = 0.2;

/// What a motion may be and is for.
#[derive(Debug, Clone, PartialEq)]
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
    let limits: Vec<JointLimits> = (0..n)
        .map(|joint| JointLimits {
            range: request.range[joint],
            speed: request.speed[joint],
            acceleration: request.acceleration[joint],
        })
        .collect();
    let coarse = SeriesBasis::new(request.seconds, GRID, request.harmonics);
    let width = 1 + 2 * request.harmonics;
    let mut dice = ChaCha8Rng::seed_from_u64(request.seed);
    let mut random = || {
        (0..n * width)
            .map(|_| dice.random_range(-1.0..1.0))
            .collect::<Vec<f64>>()
    };
    let draws: Vec<Vec<f64>> = (0..RANDOM).map(|_| random()).collect();
    let base = base_of(arm, &coarse, &scaled(&coarse, &draws[0], &limits));
    let information = Information {
        arm,
        base: &base,
        noise: &request.noise,
    };
    let rows = coarse.spread(COUNTED);
    let share = request.rate * request.seconds / rows.len() as f64;
    let of_x = |x: &[f64]| information.of(&coarse, &scaled(&coarse, x, &limits), &rows, share);
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
    let motion = fine.motion(&scaled(&fine, &found.position, &limits));
    let sigmas = best.sigmas();
    let inflations = best.inflations();
    let all: Vec<Vec<f64>> = others.iter().map(|other| other.sigmas()).collect();
    let median =
        |values: Vec<f64>| crate::statistics::nearest(&mut values.clone(), 0.5).unwrap_or(f64::NAN);
    let parameters: Vec<ExpectedSigma> = (names(&base, n).into_iter().enumerate())
        .map(|(place, (name, unit))| ExpectedSigma {
            name,
            unit,
            sigma: sigmas[place],
            random: median(all.iter().map(|other| other[place]).collect()),
            inflation: inflations[place],
        })
        .collect();
    let gains = others.iter().map(|other| {
        (best.log_determinant() - other.log_determinant()) / (2.0 * parameters.len() as f64)
    });
    let gain = median(gains.collect()).exp();
    let condition = [
        best.condition(),
        median(others.iter().map(|other| other.condition()).collect()),
    ];
    let unseen = unseen(&motion.position, n, &parameters);
    let (inertials, time) = (10 * n, motion.time);
    let (position, velocity, acceleration) =
        (motion.position, motion.velocity, motion.acceleration);
    Ok(ExcitingMotion {
        time,
        position,
        velocity,
        acceleration,
        parameters,
        condition,
        gain,
        inertials,
        unseen,
    })
}

fn names(base: &[usize], joints: usize) -> Vec<(String, &'static str)> {
    let masses = base
        .iter()
        .map(|number| (inertial_name(*number), inertial_unit(*number)));
    let friction = (1..=joints).flat_map(|joint| {
        let viscous = (format!("viscous_friction.j{joint}.viscous"), "Nm s/rad");
        [
            viscous,
            (format!("coulomb_friction.j{joint}.coulomb"), "Nm"),
        ]
    });
    masses.chain(friction).collect()
}

fn check(arm: &DynamicArm, request: &ExciteRequest) -> Result<()> {
    let n = arm.joints();
    let mut faults = Vec::new();
    let lists = [
        ("speed", &request.speed),
        ("acceleration", &request.acceleration),
        ("noise", &request.noise),
    ];
    for (name, list) in lists {
        if list.len() != n
            || list
                .iter()
                .any(|value| !(value.is_finite() && *value > 0.0))
        {
            faults.push(Fault::new(
                name,
                format!("expected {n} numbers above 0, one a joint"),
            ));
        }
    }
    let empty = |[least, most]: &[f64; 2]| !(least.is_finite() && most.is_finite() && least < most);
    if request.range.len() != n || request.range.iter().any(empty) {
        faults.push(Fault::new(
            "range",
            format!("expected {n} finite ranges, one a joint"),
        ));
    }
    if !(4.0..=600.0).contains(&request.seconds) {
        faults.push(Fault::new(
            "seconds",
            format!("{}; allowed: 4 to 600", request.seconds),
        ));
    }
    if !(20.0..=5000.0).contains(&request.rate) {
        faults.push(Fault::new(
            "rate",
            format!("{}; allowed: 20 to 5000 Hz", request.rate),
        ));
    }
    if !(2..=12).contains(&request.harmonics) {
        faults.push(Fault::new(
            "harmonics",
            format!("{}; allowed: 2 to 12", request.harmonics),
        ));
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(Error::Spec(faults))
    }
}

fn unseen(position: &[f64], n: usize, parameters: &[ExpectedSigma]) -> Vec<String> {
    let mut sentences = vec![
        "torque constants: torques in proportion at all joints are masses in proportion; a drive is seen where masses are declared".to_string(),
        "the payload apart from the last link: they are one body; two recordings, with and without it, show it".to_string(),
    ];
    for joint in 0..n {
        let [least, most] = ends(position.iter().skip(joint).step_by(n).copied());
        let range = most - least;
        if range < SMALL_RANGE {
            sentences.push(format!(
                "joint {} moves over {range:.3} rad only: its gravity, an offset and a spring are one there",
                joint + 1
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

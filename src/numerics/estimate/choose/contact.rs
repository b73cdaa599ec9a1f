//! Postures in which sockets are to hold a ball, so that joints alone determine the arm: D-optimal, given the priors.

use super::exchange::{Criterion, DesignTerm};
use super::point_jacobian::{PointJacobian, factor, gather};
use super::site::Site;
use super::{median, random_sets, subset};
use crate::criteria::choose::{OFF, POSTURES};
use crate::effect::{EffectContext, EffectStack, Load, arm_effect, names};
use crate::estimate::contacts::closed;
use crate::estimate::factor::TriangularFactor;
use crate::estimate::model::Model;
use crate::observation::{MeasurementKind, SocketKind, rank};
use crate::robot::{
    Anchor, MeasurementSetup, Measurements, Named, PointReadings, Readings, RobotModel, Target,
};
use crate::spatial::Pose;
use faer::Mat;
use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// One standard deviation beforehand of a parameter by the beginning of its name, SI.
#[derive(Debug, Clone)]
pub struct PriorSigma {
    /// E.g. `link_geometry.`.
    pub begins: &'static str,
    /// Sigma of parameters whose names end with a rotation.
    pub turns: f64,
    /// Sigma of all other parameters.
    pub others: f64,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct ContactRequest {
    /// Sockets in the base frame, m.
    pub places: Vec<Vector3<f64>>,
    /// Postures to propose, of all sockets together.
    pub count: usize,
    /// Random postures that close, for each socket.
    pub candidates: usize,
    /// Standard deviation per axis with which the ball comes back, m.
    pub sigma: f64,
    /// What is known beforehand.
    pub priors: Vec<PriorSigma>,
    /// The same seed gives the same postures.
    pub seed: u64,
}

/// What a socket is worth.
#[derive(Debug, Clone)]
pub struct LeftOutPlace {
    /// Postures there.
    pub count: usize,
    /// Median over the arm's parameters of how much larger their sigmas are without it.
    pub growth: f64,
}

/// What the ball's distance from the last axis does to the directions of the geometry that such data show at all.
#[derive(Debug, Clone, Copy)]
pub struct BallOffset {
    /// m
    pub off: f64,
    /// How many there are by theory: 4n - 4 of n turning joints.
    pub directions: usize,
    /// Those known to 1 mm or 1 mrad by the postures alone.
    pub known: usize,
    /// Sigma of the weakest, m or rad; infinite where it is not seen.
    pub weakest: f64,
}

/// Postures and what they promise.
pub struct ContactProposal {
    /// The joints at which the ball lies in the sockets; positions are these.
    pub poses: Measurements,
    /// The socket of each row, from 0.
    pub socket: Vec<usize>,
    /// Names and positions of the parameters are its stack's.
    pub model: Model,
    /// Parameters with their prior, proposed and random sigma (median of the sets), SI.
    pub sigma: Vec<(usize, f64, f64, f64)>,
    /// Random sets compared with.
    pub sets: usize,
    /// By socket.
    pub without: Vec<LeftOutPlace>,
    /// With the ball where the robot file has it, then farther and farther off the last axis.
    pub offsets: Vec<BallOffset>,
}

/// Tried together.
const BATCH: usize = 256;
/// m; the ball lies in the socket.
const THERE: f64 = 1e-9;
/// m or rad; by which directions of the geometry are measured.
const UNIT: f64 = 1e-3;
/// Directions that are seen by less than this share of the best are rounding.
const UNSEEN: f64 = 1e-9;
/// Beginnings of the names of what belongs to the geometry of arm and ball.
const GEOMETRY: [&str; 3] = ["tool_offset.", "joint_offset.", "link_geometry."];

/// The nominal arm with sockets, and what is to be identified of it.
fn model(robot: &RobotModel, places: &[Vector3<f64>], ball: Option<Vector3<f64>>) -> Model {
    let anchors = places
        .iter()
        .enumerate()
        .map(|(k, place)| Anchor::point(&name(k), *place))
        .collect();
    let home = robot.home();
    let target = ball.map(|place| Target {
        name: String::new(),
        mounting: Pose::new(home.rotation, place),
        oriented: false,
    });
    let robot = robot.clone().measured_by(MeasurementSetup {
        targets: target.into_iter().collect(),
        anchors,
    });
    let setting = EffectContext {
        base: Pose::identity(),
        load: Load::GravityTorque,
    };
    let probe = Measurements {
        joints: robot.joints(),
        q: vec![0.0; robot.joints()],
        ..socketed(vec![0], 1.0)
    };
    let effects = [
        names::ANCHOR,
        names::TOOL_OFFSET,
        names::JOINT_OFFSET,
        names::LINK_GEOMETRY,
        names::JOINT_COMPLIANCE,
    ];
    let made = effects
        .iter()
        .filter_map(|name| arm_effect(name, &setting))
        .filter(|effect| effect.missing(&robot, &probe).is_none());
    Model::nominal(
        robot.clone(),
        EffectStack::new(&robot, setting.base, made.collect()),
    )
}

fn name(socket: usize) -> String {
    format!("{:04}", socket + 1)
}

/// Rows without joints that lie in these sockets.
fn socketed(sockets: Vec<usize>, sigma: f64) -> Measurements {
    let (rows, names) = (
        sockets.len(),
        sockets.into_iter().map(name).collect::<Vec<_>>(),
    );
    let anchor = Some(Named::of(names.iter().map(String::as_str)));
    let readings = Readings {
        kind: SocketKind.about().name,
        sigma: vec![sigma; rows],
        anchor,
        ..Readings::default()
    };
    Measurements {
        points: PointReadings::none(rows),
        payload: vec![0.0; rows],
        readings: vec![readings],
        ..Measurements::default()
    }
}

/// Random postures within the site at which the ball lies in the sockets, so many for each. Fails with a sentence where one is out of reach.
fn candidates(
    model: &Model,
    site: &Site,
    request: &ContactRequest,
) -> Result<(Measurements, Vec<usize>), String> {
    let mut draw = ChaCha8Rng::seed_from_u64(request.seed);
    let payload = site.payloads.first().copied().unwrap_or_default();
    let mut found: Vec<(usize, Vec<f64>)> = Vec::new();
    for (socket, place) in request.places.iter().enumerate() {
        let (mut found_here, mut tried) = (0, 0);
        while found_here < request.candidates {
            if tried > *POSTURES * (found_here + BATCH) {
                let [x, y, z] = [place.x, place.y, place.z];
                return Err(format!(
                    "socket [{x}, {y}, {z}] m is reached by {found_here} of {tried} random postures within the joints' limits: it is out of reach, \
                     or the ball lies too near the base"
                ));
            }
            let mut data = Measurements {
                joints: site.ranges.len(),
                ..socketed(vec![socket; BATCH], request.sigma)
            };
            data.payload.fill(payload);
            data.q = (0..BATCH)
                .flat_map(|_| site.ranges.clone())
                .map(|[lower, upper]| lower + (upper - lower) * draw.random::<f64>())
                .collect();
            let rows: Vec<usize> = (0..BATCH).collect();
            let there = closed(model, &data, &rows).unwrap_or(data);
            let points = model.predict(&there);
            tried += BATCH;
            for row in rows {
                let q = there.q(row);
                let within = q
                    .iter()
                    .zip(&site.ranges)
                    .all(|(q, [lower, upper])| (lower..=upper).contains(&q));
                if found_here < request.candidates
                    && within
                    && (points[row] - place).norm() < THERE
                    && site.allows(&model.robot, q)
                {
                    found.push((socket, q.to_vec()));
                    found_here += 1;
                }
            }
        }
    }
    let sockets: Vec<usize> = found.iter().map(|(socket, _)| *socket).collect();
    let mut data = Measurements {
        joints: site.ranges.len(),
        ..socketed(sockets.clone(), request.sigma)
    };
    data.q = found.into_iter().flat_map(|(_, q)| q).collect();
    data.payload.fill(payload);
    data.points.position = sockets
        .iter()
        .map(|socket| request.places[*socket])
        .collect();
    Ok((data, sockets))
}

/// What is known of each parameter beforehand, in units of its stack's prior sigma: wide where the request says nothing.
fn known(model: &Model, priors: &[PriorSigma]) -> Vec<f64> {
    let sigma = |name: &str| {
        let stated = priors.iter().find(|prior| name.starts_with(prior.begins))?;
        let turns = name
            .rsplit('.')
            .next()
            .is_some_and(|ending| matches!(ending, "rx" | "ry" | "rz"));
        Some(if turns { stated.turns } else { stated.others })
    };
    model
        .stack
        .specs()
        .iter()
        .map(|spec| sigma(&spec.name).map_or(1.0, |sigma| sigma / spec.tolerance))
        .collect()
}

fn factor_of(known: &[f64]) -> TriangularFactor {
    let p = known.len();
    TriangularFactor::of(&Mat::from_fn(p, p + 1, |i, j| {
        if i == j { 1.0 / known[i] } else { 0.0 }
    }))
}

/// Standard deviations of all parameters after postures whose rows these are, in units of their priors in the stack.
fn sigmas(rows: &Mat<f64>, known: &TriangularFactor) -> Vec<f64> {
    let all = if rows.nrows() > 0 {
        known.stack(&factor(rows))
    } else {
        known.clone()
    };
    let p = rows.ncols();
    let Some(inverse) = all.inverse() else {
        return vec![f64::INFINITY; p];
    };
    (0..p).map(|i| inverse.row_norm(i)).collect()
}

/// Proposes postures. Fails with a sentence where a socket is out of reach or nothing can be identified.
pub fn propose_contacts(
    robot: &RobotModel,
    site: &Site,
    request: &ContactRequest,
) -> Result<ContactProposal, String> {
    let model = model(robot, &request.places, None);
    let (drawn, sockets) = candidates(&model, site, request)?;
    let specs = model.stack.specs();
    let jacobian = PointJacobian::given(&model, (0..specs.len()).collect(), Vec::new());
    let known = known(&model, &request.priors);
    let before = factor_of(&known);
    let term = DesignTerm::given(1.0, jacobian.clone(), &before)
        .ok_or("nothing is known of some direction beforehand")?;
    let mut chosen = Criterion { terms: vec![term] }.exchange(&model, &drawn, &[], request.count);
    chosen.sort_by_key(|row| (sockets[*row], *row));
    let rows = jacobian.rows(&model, &drawn);
    let proposed_rows = gather(&rows, &chosen);
    let proposed = sigmas(&proposed_rows, &before);
    let sets = random_sets(&drawn, chosen.len(), request.seed);
    let random: Vec<Vec<f64>> = sets
        .iter()
        .step_by(4)
        .map(|set| sigmas(&gather(&rows, set), &before))
        .collect();
    let prior: Vec<f64> = specs.iter().map(|spec| spec.tolerance).collect();
    let usual = |k: usize| median(random.iter().map(|all| all[k]).collect());
    let arm: Vec<usize> = (0..specs.len())
        .filter(|k| !specs[*k].name.starts_with(names::ANCHOR))
        .collect();
    let sigma = arm
        .iter()
        .map(|k| {
            (
                *k,
                known[*k] * prior[*k],
                proposed[*k] * prior[*k],
                usual(*k) * prior[*k],
            )
        })
        .collect();
    let without = (0..request.places.len()).map(|socket| {
        let left: Vec<usize> = chosen
            .iter()
            .copied()
            .filter(|row| sockets[*row] != socket)
            .collect();
        let less = sigmas(&gather(&rows, &left), &before);
        LeftOutPlace {
            count: chosen.len() - left.len(),
            growth: median(arm.iter().map(|k| less[*k] / proposed[*k]).collect()),
        }
    });
    let (sets, without) = (random.len(), without.collect());
    let poses = subset(&drawn, &chosen);
    let offsets = offsets(robot, request, &poses);
    Ok(ContactProposal {
        socket: chosen.iter().map(|row| sockets[*row]).collect(),
        poses,
        model,
        sigma,
        sets,
        without,
        offsets,
    })
}

/// How well the postures alone determine the geometry with the ball farther and farther off the last axis: of last joint and ball nothing is seen
/// where it lies on that. The postures are moved until the ball lies in the socket.
fn offsets(robot: &RobotModel, request: &ContactRequest, poses: &Measurements) -> Vec<BallOffset> {
    let last = robot.joints() - 1;
    let (axis, home) = (robot.axis(last), robot.home().translation);
    let arm = home - robot.point(last);
    let from_axis = arm - axis * axis.dot(&arm);
    let side = from_axis
        .try_normalize(1e-6)
        .unwrap_or_else(|| axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize());
    let now = from_axis.norm();
    let tried = std::iter::once(now).chain(OFF.into_iter().filter(|off| *off > now + 1e-3));
    let one = |off: f64| {
        let model = model(robot, &request.places, Some(home + side * (off - now)));
        let rows: Vec<usize> = (0..poses.rows()).collect();
        let data = closed(&model, poses, &rows)?;
        let theory = rank(&model.robot, &data, &rows, false, 0)?;
        let directions =
            theory.saturating_sub(model.robot.setup().first_of_anchor(request.places.len()));
        let sigmas = geometry(&model, &data, directions);
        let known = sigmas.iter().filter(|sigma| **sigma <= UNIT).count();
        Some(BallOffset {
            off,
            directions,
            known,
            weakest: sigmas.last().copied()?,
        })
    };
    tried.filter_map(one).collect()
}

/// Standard deviations (m or rad, ascending) of the `count` directions of the geometry that are seen best, without any prior.
fn geometry(model: &Model, data: &Measurements, count: usize) -> Vec<f64> {
    let specs = model.stack.specs();
    let is_geometry = |name: &str| GEOMETRY.iter().any(|begins| name.starts_with(begins));
    // Sockets come first: the others share the remaining places.
    let last: Vec<usize> = (0..specs.len())
        .filter(|k| is_geometry(&specs[*k].name))
        .collect();
    let mut order: Vec<usize> = model.stack.parameters_of(names::ANCHOR).collect();
    let first = order.len();
    order.extend(&last);
    let scale: Vec<f64> = last.iter().map(|k| UNIT / specs[*k].tolerance).collect();
    let all = factor(&PointJacobian::given(model, order, Vec::new()).rows(model, data));
    let p = last.len();
    let reduced = Mat::from_fn(p, p + 1, |i, j| {
        if j < p && i <= j {
            all.entry(first + i, first + j)
        } else {
            0.0
        }
    });
    let seen = TriangularFactor::of(&reduced).singular_values(&scale);
    let largest = seen.first().copied().unwrap_or_default();
    let sigma = |value: &f64| {
        if *value > UNSEEN * largest {
            UNIT / value
        } else {
            f64::INFINITY
        }
    };
    seen.iter().take(count).map(sigma).collect()
}

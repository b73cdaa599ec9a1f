//! Rigid bodies on a serial chain: mass matrix (composite bodies: Featherstone, 2008, ch. 6) and inverse dynamics, in world axes about the
//! world's origin, in room that is made once.

use calib_dynamics::{DynamicArm, Inertial};
use nalgebra::{Matrix3, Point3, Vector3};

/// Degrees of freedom at most: joints, and rotors that move by themselves.
pub const MOST: usize = 14;
/// s of a step at which roll-outs are those of finer ones, whatever the arm.
pub(crate) const STEP: f64 = 1e-3;
/// s of a step where a gear yields.
const GEARED_STEP: f64 = 5e-4;
/// A number a degree of freedom.
pub type Row = [f64; MOST];
/// A matrix over them.
pub type Square = [Row; MOST];

/// What moves: axes and points at the reference pose.
#[derive(Debug, Clone)]
pub struct Chain {
    axes: Vec<Vector3<f64>>,
    points: Vec<Vector3<f64>>,
    prismatic: Vec<bool>,
    reference: Vec<f64>,
    tool: Vector3<f64>,
    /// s of a step of a roll-out at most, and where a gear yields.
    pub(crate) step: f64,
    pub(crate) geared_step: f64,
}

/// What it carries, a body a link, in world axes at the reference pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Bodies {
    /// Of each link.
    pub links: Vec<Inertial>,
    /// m/s^2.
    pub gravity: Vector3<f64>,
}

/// Links at one position.
#[derive(Debug, Clone, Copy, Default)]
struct Placed {
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    /// Motion by a unit of the joint's speed: turn, and velocity of the point at the origin.
    turn: Vector3<f64>,
    slide: Vector3<f64>,
    mass: f64,
    centre: Vector3<f64>,
    inertia: Matrix3<f64>,
}

/// A chain at one position with its bodies.
#[derive(Debug, Clone)]
pub struct Posed {
    links: [Placed; MOST],
    count: usize,
}

impl Chain {
    /// The chain of an arm whose angles count from `reference`.
    pub fn new(arm: &DynamicArm, reference: &[f64]) -> Self {
        Self {
            axes: arm.axes.clone(),
            points: arm.points.iter().map(|point| point.coords).collect(),
            prismatic: arm.prismatic.clone(),
            reference: reference.to_vec(),
            tool: arm.tool.coords,
            step: STEP,
            geared_step: GEARED_STEP,
        }
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.axes.len()
    }

    /// Steps of half the length, of all roll-outs or of those where a gear yields.
    pub(crate) fn halve(&mut self, geared: bool) {
        self.geared_step *= 0.5;
        if !geared {
            self.step *= 0.5;
        }
    }

    /// The tool point at the reference pose.
    pub fn tool(&self) -> Point3<f64> {
        self.tool.into()
    }

    /// The tool point at a position, m.
    pub fn tool_at(&self, posed: &Posed) -> Vector3<f64> {
        let last = &posed.links[posed.count - 1];
        last.rotation * self.tool + last.shift
    }

    /// The chain at joint positions, with bodies.
    pub fn pose(&self, q: &[f64], bodies: &Bodies, posed: &mut Posed) {
        let (mut rotation, mut shift) = (Matrix3::identity(), Vector3::zeros());
        posed.count = self.joints();
        for (joint, link) in posed.links[..self.axes.len()].iter_mut().enumerate() {
            let axis = rotation * self.axes[joint];
            let by = q[joint] - self.reference[joint];
            if self.prismatic[joint] {
                shift += axis * by;
                (link.turn, link.slide) = (Vector3::zeros(), axis);
            } else {
                let point = rotation * self.points[joint] + shift;
                let turn = turned(&self.axes[joint], by);
                shift = point - rotation * (turn * self.points[joint]);
                rotation *= turn;
                (link.turn, link.slide) = (axis, point.cross(&axis));
            }
            let body = &bodies.links[joint];
            link.rotation = rotation;
            link.shift = shift;
            link.mass = body.mass;
            link.centre = rotation * body.centre.coords + shift;
            link.inertia = rotation * body.inertia * rotation.transpose();
        }
    }

    /// The mass matrix, kg m^2, of rotors held to their joints and without their inertia.
    pub fn mass_matrix(&self, posed: &Posed, matrix: &mut Square) {
        let (mut mass, mut moment, mut inertia) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for joint in (0..posed.count).rev() {
            let link = &posed.links[joint];
            let c = link.centre;
            mass += link.mass;
            moment += c * link.mass;
            inertia += link.inertia
                + (Matrix3::identity() * c.norm_squared() - c * c.transpose()) * link.mass;
            // Momentum of all beyond, about the origin, by a unit of this joint's speed.
            let linear = link.slide * mass + link.turn.cross(&moment);
            let angular = inertia * link.turn + moment.cross(&link.slide);
            for before in 0..=joint {
                let other = &posed.links[before];
                let entry = other.turn.dot(&angular) + other.slide.dot(&linear);
                matrix[before][joint] = entry;
                matrix[joint][before] = entry;
            }
        }
    }

    /// How gravity's torques change with the positions, Nm/rad: the second derivative of the potential.
    pub fn gravity_stiffness(&self, posed: &Posed, gravity: &Vector3<f64>, matrix: &mut Square) {
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for joint in (0..posed.count).rev() {
            let link = &posed.links[joint];
            mass += link.mass;
            moment += link.centre * link.mass;
            let linear = link.slide * mass + link.turn.cross(&moment);
            for before in 0..=joint {
                let entry = -gravity.dot(&posed.links[before].turn.cross(&linear));
                matrix[before][joint] = entry;
                matrix[joint][before] = entry;
            }
        }
    }

    /// How the links move, the world accelerated against gravity.
    pub fn moved(
        &self,
        posed: &Posed,
        gravity: &Vector3<f64>,
        speed: &[f64],
        acceleration: Option<&[f64]>,
        moved: &mut [Moved; MOST],
    ) {
        let mut now = Moved {
            pulled: -*gravity,
            ..Moved::default()
        };
        for joint in 0..posed.count {
            let link = &posed.links[joint];
            let (turn, slide) = (link.turn * speed[joint], link.slide * speed[joint]);
            now.spun += now.spin.cross(&turn);
            now.pulled += now.spin.cross(&slide) + now.drift.cross(&turn);
            if let Some(by) = acceleration {
                now.spun += link.turn * by[joint];
                now.pulled += link.slide * by[joint];
            }
            now.spin += turn;
            now.drift += slide;
            moved[joint] = now;
        }
    }

    /// Torques that a motion asks for, Nm: gravity, centrifugal and Coriolis torques where no acceleration is given.
    pub fn torques(
        &self,
        posed: &Posed,
        gravity: &Vector3<f64>,
        speed: &[f64],
        acceleration: Option<&[f64]>,
        torque: &mut Row,
    ) {
        let mut moved = [Moved::default(); MOST];
        self.moved(posed, gravity, speed, acceleration, &mut moved);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for joint in (0..posed.count).rev() {
            let link = &posed.links[joint];
            let (push, turn) = moved[joint].asks(link.mass, &link.centre, &link.inertia);
            force += push;
            moment += turn;
            torque[joint] = link.turn.dot(&moment) + link.slide.dot(&force);
        }
    }

    /// What a body on a link asks for beyond the one that is there, Nm at each joint before it.
    pub fn torques_of(
        &self,
        posed: &Posed,
        moved: &Moved,
        link: usize,
        body: &Inertial,
        torque: &mut [f64],
    ) {
        let at = &posed.links[link];
        let (force, moment) = moved.asks(at.mass, &at.centre, &at.inertia);
        let centre = at.rotation * body.centre.coords + at.shift;
        let inertia = at.rotation * body.inertia * at.rotation.transpose();
        let (with, turned) = moved.asks(body.mass, &centre, &inertia);
        for joint in 0..=link {
            let before = &posed.links[joint];
            torque[joint] +=
                before.turn.dot(&(turned - moment)) + before.slide.dot(&(with - force));
        }
    }
}

/// How a link moves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moved {
    spin: Vector3<f64>,
    drift: Vector3<f64>,
    spun: Vector3<f64>,
    pulled: Vector3<f64>,
}

impl Moved {
    /// Force and moment about the origin that a body asks for.
    fn asks(
        &self,
        mass: f64,
        centre: &Vector3<f64>,
        inertia: &Matrix3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        // Of the body's centre; the spatial acceleration of the origin's point lacks the turning of its speed.
        let velocity = self.drift + self.spin.cross(centre);
        let accelerated = self.pulled + self.spun.cross(centre) + self.spin.cross(&velocity);
        let force = accelerated * mass;
        let momentum = inertia * self.spin;
        let moment = inertia * self.spun + self.spin.cross(&momentum) + centre.cross(&force);
        (force, moment)
    }
}

impl Default for Posed {
    fn default() -> Self {
        Self {
            links: [Placed::default(); MOST],
            count: 0,
        }
    }
}

/// A turn about a unit axis (Rodrigues).
fn turned(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let (sine, cosine) = libm::sincos(angle);
    let (x, y, z, rest) = (axis.x, axis.y, axis.z, 1.0 - cosine);
    Matrix3::new(
        cosine + x * x * rest,
        x * y * rest - z * sine,
        x * z * rest + y * sine,
        y * x * rest + z * sine,
        cosine + y * y * rest,
        y * z * rest - x * sine,
        z * x * rest - y * sine,
        z * y * rest + x * sine,
        cosine + z * z * rest,
    )
}

/// The inverse of the first n x n of a symmetric positive matrix, by its Cholesky factor; false where it has none.
pub fn invert(matrix: &Square, n: usize, inverse: &mut Square) -> bool {
    let mut l = [[0.0; MOST]; MOST];
    for i in 0..n {
        for j in 0..=i {
            let mut sum = matrix[i][j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            if i == j {
                if sum.is_nan() || sum <= 0.0 {
                    return false;
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    // Of the factor, then its square.
    let mut inner = [[0.0; MOST]; MOST];
    for i in 0..n {
        inner[i][i] = 1.0 / l[i][i];
        for j in 0..i {
            let mut sum = 0.0;
            for k in j..i {
                sum -= l[i][k] * inner[k][j];
            }
            inner[i][j] = sum * inner[i][i];
        }
    }
    for i in 0..n {
        for j in 0..=i {
            let mut sum = 0.0;
            for row in &inner[i..n] {
                sum += row[i] * row[j];
            }
            inverse[i][j] = sum;
            inverse[j][i] = sum;
        }
    }
    true
}

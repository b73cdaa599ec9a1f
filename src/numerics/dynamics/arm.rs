//! The arm that moves as the user believes it: axes, masses and tolerances in the base frame at zero pose, SI; and its inertial numbers as the
//! regressor counts them.

use super::recording::add;
use nalgebra::{Matrix3, Point3, Vector3};

/// Inertial numbers of a link.
pub const INERTIAL_NUMBERS: usize = 10;
/// Where xx xy xz yy yz zz stand in the matrix.
pub(crate) const INERTIA_ENTRIES: [(usize, usize); 6] =
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// One of the ten numbers alone, counted on over the links.
pub(crate) fn unit_number(number: usize) -> [f64; INERTIAL_NUMBERS] {
    std::array::from_fn(|entry| f64::from(u8::from(entry == number % INERTIAL_NUMBERS)))
}

/// Mass, its moment and xx xy xz yy yz zz of a matrix.
fn ten(mass: f64, moment: &Vector3<f64>, inertia: &Matrix3<f64>) -> [f64; INERTIAL_NUMBERS] {
    std::array::from_fn(|number| match number {
        0 => mass,
        1..=3 => moment[number - 1],
        _ => inertia[INERTIA_ENTRIES[number - 4]],
    })
}

/// Adds so much of a body's ten numbers to those of a link of many.
pub(super) fn add_body(theta: &mut [f64], link: usize, share: f64, ten: &[f64; INERTIAL_NUMBERS]) {
    add(&mut theta[INERTIAL_NUMBERS * link..], share, ten);
}

/// The matrix of xx xy xz yy yz zz.
pub(crate) fn inertia_matrix(six: &[f64]) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    for (number, (row, column)) in INERTIA_ENTRIES.into_iter().enumerate() {
        matrix[(row, column)] = six[number];
        matrix[(column, row)] = six[number];
    }
    matrix
}

/// Mass, centre and inertia of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// kg.
    pub mass: f64,
    /// m, base frame at zero pose.
    pub centre: Point3<f64>,
    /// kg m^2 about the centre, base axes at zero pose.
    pub inertia: Matrix3<f64>,
}

/// How far declared inertials may be off without being a finding: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialTolerance {
    /// Tolerance of a mass, as a share of it.
    pub mass_relative: f64,
    /// Tolerance of each coordinate of a centre, m.
    pub centre: f64,
    /// Tolerance of an inertia, as a share of its largest diagonal element.
    pub inertia_relative: f64,
}

/// The declared arm.
#[derive(Debug, Clone, PartialEq)]
pub struct DynamicArm {
    /// Unit vectors of the joint axes, length n.
    pub axes: Vec<Vector3<f64>>,
    /// A point on each axis, m, length n.
    pub points: Vec<Point3<f64>>,
    /// Whether a joint slides instead of turning, length n.
    pub prismatic: Vec<bool>,
    /// The tool point, m.
    pub tool: Point3<f64>,
    /// Bodies of the links, length n; `None` where nothing is declared: then the base parameters are identified.
    pub links: Option<Vec<Inertial>>,
    /// The declared payload; `None` for none.
    pub payload: Option<Inertial>,
    /// m/s^2, base frame: (0, 0, -9.81) for an arm on the floor.
    pub gravity: Vector3<f64>,
    /// Turns of the motor per turn of the joint, length n.
    pub ratio: Vec<f64>,
    /// Pairs (moved, by) of joints, from 0, whose gears are known to be coupled.
    pub coupled: Vec<(usize, usize)>,
    /// Tolerance of links, and of last link and payload together.
    pub tolerance: InertialTolerance,
}

impl DynamicArm {
    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.axes.len()
    }
}

/// The ten numbers of a body about `point`.
pub(super) fn numbers(body: &Inertial, point: &Vector3<f64>) -> [f64; INERTIAL_NUMBERS] {
    let arm = body.centre.coords - point;
    let about = body.inertia + steiner(body.mass, &arm);
    ten(body.mass, &(body.mass * arm), &about)
}

/// What a point mass adds to the inertia at a distance.
pub(super) fn steiner(mass: f64, arm: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * mass
}

impl Inertial {
    /// Two bodies as one; the first where neither has a mass.
    pub fn joined(&self, other: &Inertial) -> Inertial {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return *self;
        }
        let moment = self.centre.coords * self.mass + other.centre.coords * other.mass;
        let centre = (moment / mass).into();
        let of_body = |body: &Inertial| body.inertia + steiner(body.mass, &(body.centre - centre));
        Inertial {
            mass,
            centre,
            inertia: of_body(self) + of_body(other),
        }
    }
}

/// Inertial numbers of the whole arm, payload included, and their tolerance.
#[derive(Debug, Clone)]
pub(super) struct DeclaredInertials {
    /// 10 n, of the links alone.
    pub(crate) links: Vec<f64>,
    /// 10 n, with the declared payload on the last link.
    pub(crate) theta: Vec<f64>,
    /// The last link's numbers of a payload of 1 kg as declared (of a point at the tool where none is).
    pub(crate) payload: [f64; INERTIAL_NUMBERS],
    /// Change of the last link's numbers per kg m by which a payload's centre is elsewhere, in three coordinates.
    pub(crate) payload_shift: [[f64; INERTIAL_NUMBERS]; 3],
    /// Per link: change of its numbers per m of its centre, in three coordinates.
    pub(crate) centre_shift: Vec<[[f64; INERTIAL_NUMBERS]; 3]>,
    /// Per link, 10 x 10 by columns: change of its numbers by one standard deviation of mass, centre (3), inertia (6).
    pub(crate) tolerance: Vec<[[f64; INERTIAL_NUMBERS]; INERTIAL_NUMBERS]>,
}

impl DeclaredInertials {
    /// The inertial numbers of an arm that declares its links.
    pub(crate) fn of(arm: &DynamicArm, bodies: &[Inertial]) -> Self {
        let last = bodies.len() - 1;
        let point = |link: usize| arm.points[link].coords;
        let all = || bodies.iter().enumerate();
        let links: Vec<f64> = all()
            .flat_map(|(link, body)| numbers(body, &point(link)))
            .collect();
        let mut theta = links.clone();
        if let Some(payload) = &arm.payload {
            add_body(&mut theta, last, 1.0, &numbers(payload, &point(last)));
        }
        let tolerance = all().map(|(link, body)| {
            let whole = match &arm.payload {
                Some(payload) if link == last => body.joined(payload),
                _ => *body,
            };
            tolerance(arm, &whole, &point(link))
        });
        let payload = unit_payload(arm);
        Self {
            tolerance: tolerance.collect(),
            payload: numbers(&payload, &point(last)),
            payload_shift: shifts(&payload, &point(last)),
            centre_shift: all()
                .map(|(link, body)| shifts(body, &point(link)))
                .collect(),
            links,
            theta,
        }
    }
}

/// A payload of 1 kg.
fn unit_payload(arm: &DynamicArm) -> Inertial {
    match &arm.payload {
        Some(payload) if payload.mass > 0.0 => Inertial {
            mass: 1.0,
            inertia: payload.inertia / payload.mass,
            ..*payload
        },
        _ => Inertial {
            mass: 1.0,
            centre: arm.tool,
            inertia: Matrix3::zeros(),
        },
    }
}

/// Change of a body's numbers per m of its centre.
fn shifts(body: &Inertial, point: &Vector3<f64>) -> [[f64; INERTIAL_NUMBERS]; 3] {
    let arm = body.centre.coords - point;
    std::array::from_fn(|axis| {
        let along = Vector3::ith(axis, body.mass);
        let inertia = Matrix3::identity() * (2.0 * arm.dot(&along))
            - arm * along.transpose()
            - along * arm.transpose();
        ten(0.0, &along, &inertia)
    })
}

/// Change of a body's numbers by one standard deviation of each of its own.
fn tolerance(
    arm: &DynamicArm,
    body: &Inertial,
    point: &Vector3<f64>,
) -> [[f64; INERTIAL_NUMBERS]; INERTIAL_NUMBERS] {
    /// Step of a coordinate of the centre: small against its tolerance, as an inertia is quadratic in it.
    const STEP: f64 = 1e-2;
    let base = numbers(body, point);
    let largest = (0..3)
        .map(|axis| body.inertia[(axis, axis)])
        .fold(0.0, f64::max);
    std::array::from_fn(|number| {
        let (mut moved, mut step) = (*body, 1.0);
        match number {
            0 => {
                moved.mass *= 1.0 + arm.tolerance.mass_relative;
                moved.inertia *= 1.0 + arm.tolerance.mass_relative;
            }
            1..=3 => {
                step = STEP;
                moved.centre.coords[number - 1] += step * arm.tolerance.centre;
            }
            _ => {
                let (row, column) = INERTIA_ENTRIES[number - 4];
                let mut six = [0.0; 6];
                six[number - 4] = arm.tolerance.inertia_relative
                    * largest
                    * if row == column { 1.0 } else { 0.5 };
                moved.inertia += inertia_matrix(&six);
            }
        }
        let ten = numbers(&moved, point);
        std::array::from_fn(|entry| (ten[entry] - base[entry]) / step)
    })
}

// What the ten inertial numbers of a link are called, and their units.

/// As the regressor counts them: moments are mass times centre from the joint's point, inertias about that point.
pub const INERTIAL_NAMES: [&str; INERTIAL_NUMBERS] = [
    "mass",
    "moment_x",
    "moment_y",
    "moment_z",
    "inertia_xx",
    "inertia_xy",
    "inertia_xz",
    "inertia_yy",
    "inertia_yz",
    "inertia_zz",
];

/// `rigid_body.l3.mass`; `number` counts 10 a link.
pub(super) fn inertial_name(number: usize) -> String {
    format!(
        "rigid_body.l{}.{}",
        number / INERTIAL_NUMBERS + 1,
        INERTIAL_NAMES[number % INERTIAL_NUMBERS]
    )
}

/// kg, kg m or kg m2.
pub(super) fn inertial_unit(number: usize) -> &'static str {
    match number % INERTIAL_NUMBERS {
        0 => "kg",
        1..=3 => "kg m",
        _ => "kg m2",
    }
}

//! What a recording measures with: targets on the tool, each with its own mounting, and anchors in the cell: ends of distances, sockets, planes,
//! spheres.

use crate::spatial::Pose;
use nalgebra::Vector3;

/// A reflector, ball or frame on the tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// As the recording calls it; empty where it has no name.
    pub name: String,
    /// Where it is believed to sit, zero pose, base frame.
    pub mounting: Pose,
    /// Whether its orientation is measured too.
    pub oriented: bool,
}

/// The far end of a draw-wire or ballbar, or what holds the target: a socket, a plane, a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchor {
    /// As the recording calls it; empty where it has no name.
    pub name: String,
    /// Where it is believed to be, tracker frame, m: its centre, of a plane a point of it.
    pub place: Vector3<f64>,
    /// What stands there.
    pub shape: Shape,
}

/// What an anchor is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Shape {
    /// A point.
    #[default]
    Point,
    /// A plane through the place, by its unit normal in the tracker frame.
    Plane(Vector3<f64>),
    /// A sphere about the place, by its radius, m.
    Sphere(f64),
}

impl Shape {
    /// Numbers that say where such an anchor is: x, y, z of a point; a plane's offset and two tilts; a sphere's radius beside its centre.
    pub(crate) fn parameters(&self) -> usize {
        match self {
            Self::Point | Self::Plane(_) => 3,
            Self::Sphere(_) => 4,
        }
    }
}

impl Anchor {
    /// A point.
    pub fn point(name: &str, place: Vector3<f64>) -> Self {
        Self {
            name: name.into(),
            place,
            shape: Shape::Point,
        }
    }

    /// The turns (rad) about the x and y axes, as one rotation vector, that bring the z axis to a unit normal.
    pub fn tilts(normal: &Vector3<f64>) -> [f64; 2] {
        let flat = normal.x.hypot(normal.y);
        let per_sine = if flat > 0.0 {
            libm::atan2(flat, normal.z) / flat
        } else {
            1.0
        };
        [-normal.y * per_sine, normal.x * per_sine]
    }

    /// The unit normal that such turns make of the z axis.
    pub fn normal([about_x, about_y]: [f64; 2]) -> Vector3<f64> {
        let angle = about_x.hypot(about_y);
        let sine = if angle > 0.0 {
            libm::sin(angle) / angle
        } else {
            1.0
        };
        Vector3::new(sine * about_y, -sine * about_x, libm::cos(angle))
    }

    /// How a normal moves with each of its [`Anchor::tilts`], 1/rad: two vectors in the plane.
    pub fn across(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let [about_x, about_y] = Self::tilts(normal);
        let angle = about_x.hypot(about_y);
        if angle < LEVEL {
            return [-Vector3::y(), Vector3::x()];
        }
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let share = sine / angle;
        let bend = (cosine - share) / (angle * angle);
        [
            Vector3::new(
                bend * about_x * about_y,
                -share - bend * about_x * about_x,
                -share * about_x,
            ),
            Vector3::new(
                share + bend * about_y * about_y,
                -bend * about_x * about_y,
                -share * about_y,
            ),
        ]
    }
}

/// A normal that leans less than this, rad, stands on the z axis.
const LEVEL: f64 = 1e-6;

/// Targets and anchors, each by the order of names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeasurementSetup {
    /// None: the robot's tool point is what is measured.
    pub targets: Vec<Target>,
    /// What is measured from.
    pub anchors: Vec<Anchor>,
}

impl MeasurementSetup {
    /// The number of a target by its name.
    pub fn target(&self, name: &str) -> Option<usize> {
        self.targets.iter().position(|target| target.name == name)
    }

    /// The number of an anchor by its name.
    pub fn anchor(&self, name: &str) -> Option<usize> {
        self.anchors.iter().position(|anchor| anchor.name == name)
    }

    /// Where the numbers of an anchor (by its own number) begin among those of all.
    pub fn first_of_anchor(&self, number: usize) -> usize {
        self.anchors
            .iter()
            .take(number)
            .map(|anchor| anchor.shape.parameters())
            .sum()
    }
}

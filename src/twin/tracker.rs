//! The laser tracker: a pose in the room and a noise that grows with range.
//!
//! A point as a tracker measures it: range, azimuth about its standing axis z from x, elevation above its horizon.

use crate::lists::named;
use crate::matrix;
use crate::matrix::{Matrix, Vector};
use crate::noise::{Noise, Purpose};
use crate::truth::{TrueValue, true_values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard deviation of the logarithm of a point's width: one point in six is wider than 1.6 times the median.
const UNEVENNESS: f64 = 0.5;

named! {
    /// How the tracker's errors scatter; all have the stated standard deviation.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    Scatter,
    /// All of them.
    SCATTERS: 5 {
        /// Normal.
        #[default]
        Gaussian "gaussian",
        /// Student's t with 3 degrees of freedom: now and then far out.
        Student "student",
        /// Gaussian, point by point wider or narrower, log-normally.
        Uneven "uneven",
        /// Gaussian, 0.9 of a point's error being that of the point before: air or a tripod that moves.
        Wandering "wandering",
        /// Gaussian, across the beam 2.5 times as large as along it.
        Directional "directional",
    }
}

/// Correlation of a wandering tracker's errors from point to point.
const WANDERING: f64 = 0.9;

/// A directional tracker's error across the beam over that along it.
const ACROSS: f64 = 2.5;

/// The state of a tracker from point to point: its randomness, and where it has wandered to in standard deviations.
pub struct Beam {
    noise: Noise,
    wander: Option<Vector>,
}

impl Beam {
    /// A tracker with this seed of its noise.
    pub fn new(seed: u64) -> Self {
        Self {
            noise: Noise::new(seed, Purpose::Tracker),
            wander: None,
        }
    }
}

/// Where the tracker stands and how well it measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tracker {
    /// Origin of the tracker's frame in the robot's base frame, mm.
    pub position_mm: Vector,
    /// Its roll, pitch and yaw about the fixed base axes, deg.
    pub roll_pitch_yaw_deg: Vector,
    /// Uncertainty of one coordinate at range 0, um.
    pub noise_um: f64,
    /// Its growth with range, um per m.
    pub noise_um_per_m: f64,
    /// How many standard deviations the two figures stand for.
    pub coverage: f64,
    /// How its points scatter.
    pub scatter: Scatter,
}

impl Default for Tracker {
    fn default() -> Self {
        Self {
            position_mm: [4200.0, -1500.0, 900.0],
            roll_pitch_yaw_deg: [0.0, 0.0, 150.0],
            noise_um: 10.0,
            noise_um_per_m: 2.5,
            coverage: 2.0,
            scatter: Scatter::Gaussian,
        }
    }
}

impl Tracker {
    /// The base frame as the tracker sees it.
    pub(crate) fn base(&self) -> Matrix {
        let turned = matrix::roll_pitch_yaw(self.roll_pitch_yaw_deg.map(f64::to_radians));
        matrix::inverse(&matrix::times(
            &matrix::shift(matrix::scale(self.position_mm, 1e-3)),
            &turned,
        ))
    }

    /// The true pose of the tracker under names of its own; a fit's base frame is a correction of an alignment.
    pub fn values(&self) -> Vec<TrueValue> {
        let axes = ["x", "y", "z"].into_iter().enumerate();
        let numbers = axes.flat_map(|(index, axis)| {
            let turned = self.roll_pitch_yaw_deg[index].to_radians();
            [
                (axis.to_string(), "mm", self.position_mm[index]),
                (format!("r{axis}"), "rad", turned),
            ]
        });
        true_values("tracker", "pose", "tracker", numbers)
    }

    /// Standard deviation of a coordinate of `point` (m, tracker frame), m.
    pub fn sigma(&self, point: Vector) -> f64 {
        1e-6 * (self.noise_um + self.noise_um_per_m * matrix::norm(point)) / self.coverage
    }

    /// What the tracker says where `point` (m, tracker frame) is.
    pub fn measure(&self, point: Vector, beam: &mut Beam) -> Vector {
        let sigma = self.sigma(point);
        let Beam { noise, wander } = beam;
        match self.scatter {
            Scatter::Gaussian => point.map(|coordinate| coordinate + sigma * noise.normal()),
            Scatter::Student => point.map(|coordinate| {
                let spread = (0..3)
                    .map(|_| noise.normal().powi(2))
                    .sum::<f64>()
                    .max(1e-12);
                // t with 3 degrees of freedom has variance 3: normal / sqrt(chi2 / 3), over sqrt 3.
                coordinate + sigma * noise.normal() / spread.sqrt()
            }),
            Scatter::Uneven => {
                // exp(w z) has a mean square of exp(2 w^2).
                let wide = (UNEVENNESS * noise.normal() - UNEVENNESS * UNEVENNESS).exp();
                point.map(|coordinate| coordinate + sigma * wide * noise.normal())
            }
            Scatter::Wandering => {
                let fresh = [(); 3].map(|()| noise.normal());
                let part = (1.0 - WANDERING * WANDERING).sqrt();
                let now = wander.map_or(fresh, |last| {
                    std::array::from_fn(|k| WANDERING * last[k] + part * fresh[k])
                });
                *wander = Some(now);
                std::array::from_fn(|k| point[k] + sigma * now[k])
            }
            Scatter::Directional => {
                // Two directions across and one along have the mean square of three equal ones.
                let along = sigma * (3.0 / (2.0 * ACROSS * ACROSS + 1.0)).sqrt();
                let drawn = [(); 3].map(|()| noise.normal());
                let beam = matrix::scale(point, 1.0 / matrix::norm(point));
                let part: f64 = (0..3).map(|k| drawn[k] * beam[k]).sum();
                std::array::from_fn(|k| {
                    point[k] + along * (ACROSS * (drawn[k] - part * beam[k]) + part * beam[k])
                })
            }
        }
    }
}

/// m and rad, in the tracker's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polar {
    /// m.
    pub(crate) range: f64,
    /// rad.
    pub(crate) azimuth: f64,
    /// rad.
    pub(crate) elevation: f64,
}

impl Polar {
    /// The range and the angles of a point as the instrument sees it, m.
    pub(crate) fn of(point: Vector) -> Polar {
        let level = point[0].hypot(point[1]);
        Polar {
            range: matrix::norm(point),
            azimuth: point[1].atan2(point[0]),
            elevation: point[2].atan2(level),
        }
    }

    /// The point, m.
    pub(crate) fn point(self) -> Vector {
        let (level, height) = (
            self.range * self.elevation.cos(),
            self.range * self.elevation.sin(),
        );
        [
            level * self.azimuth.cos(),
            level * self.azimuth.sin(),
            height,
        ]
    }
}

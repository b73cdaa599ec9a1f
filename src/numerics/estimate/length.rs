//! Lengths between anchors that are known from elsewhere: of a print, a gauge block, a ball bar; each with its standard deviation.

use super::model::Model;
use crate::effect::names;
use crate::robot::{Anchor, Shape};
use nalgebra::Vector3;

/// What a known length says of a model, in standard deviations.
pub(crate) struct LengthTerm {
    /// Known - of the model.
    pub(crate) error: f64,
    /// Derivatives of the model's by parameters of the stack.
    pub(crate) rates: Vec<(usize, f64)>,
}

/// An anchor as the model has it.
pub(super) struct StandingAnchor<'a> {
    pub(crate) place: Vector3<f64>,
    pub(crate) shape: Shape,
    anchor: &'a Anchor,
    /// Its first parameter in the stack.
    first: usize,
    tilt: [f64; 2],
}

impl Model {
    /// What each known length says of the model, where the anchors are placed.
    pub(crate) fn length_terms(&self) -> impl Iterator<Item = LengthTerm> {
        self.lengths.iter().filter_map(|known| {
            let [from, to] = [
                self.standing_anchor(known.between[0])?,
                self.standing_anchor(known.between[1])?,
            ];
            let (length, mut rates) = between(&from, &to);
            rates.iter_mut().for_each(|(_, rate)| *rate /= known.sigma);
            Some(LengthTerm {
                error: (known.length - length) / known.sigma,
                rates,
            })
        })
    }

    /// An anchor by its number, corrections included; `None` where nothing places the anchors.
    pub(super) fn standing_anchor(&self, number: usize) -> Option<StandingAnchor<'_>> {
        let setup = self.robot.setup();
        let anchor = setup.anchors.get(number)?;
        let range = self
            .stack
            .effects()
            .find(|(effect, _)| effect.name() == names::ANCHOR)?
            .1;
        let first = range.start + setup.first_of_anchor(number);
        let x = &self.x[first..first + anchor.shape.parameters()];
        Some(match anchor.shape {
            Shape::Plane(normal) => {
                let across = Anchor::across(&normal);
                let shape =
                    Shape::Plane((normal + across[0] * x[1] + across[1] * x[2]).normalize());
                StandingAnchor {
                    place: anchor.place + normal * x[0],
                    shape,
                    anchor,
                    first,
                    tilt: [x[1], x[2]],
                }
            }
            shape => {
                let shape = if let Shape::Sphere(radius) = shape {
                    Shape::Sphere(radius + x[3])
                } else {
                    shape
                };
                StandingAnchor {
                    place: anchor.place + Vector3::new(x[0], x[1], x[2]),
                    shape,
                    anchor,
                    first,
                    tilt: [0.0; 2],
                }
            }
        })
    }
}

/// The length and its derivatives. Of two planes the mean of how far each is from the other's place.
fn between(from: &StandingAnchor, to: &StandingAnchor) -> (f64, Vec<(usize, f64)>) {
    match (&from.shape, &to.shape) {
        (Shape::Plane(_), Shape::Plane(_)) => {
            let [(one, mut rates), (other, more)] = [off_plane(from, to), off_plane(to, from)];
            rates.extend(more);
            rates.iter_mut().for_each(|(_, rate)| *rate *= 0.5);
            (0.5 * (one + other), rates)
        }
        (Shape::Plane(_), _) => off_plane(from, to),
        (_, Shape::Plane(_)) => off_plane(to, from),
        _ => {
            let reach = to.place - from.place;
            let along = reach.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            (
                reach.norm(),
                moved(to, &along)
                    .into_iter()
                    .chain(moved(from, &-along))
                    .collect(),
            )
        }
    }
}

/// How far a place is from a plane.
fn off_plane(plane: &StandingAnchor, other: &StandingAnchor) -> (f64, Vec<(usize, f64)>) {
    let Shape::Plane(normal) = plane.shape else {
        return (0.0, Vec::new());
    };
    let reach = other.place - plane.place;
    let sign = if normal.dot(&reach) < 0.0 { -1.0 } else { 1.0 };
    let mut rates = moved(other, &(normal * sign));
    rates.extend(moved(plane, &(normal * -sign)));
    if let Shape::Plane(believed) = plane.anchor.shape {
        let across = Anchor::across(&believed);
        let size = (believed + across[0] * plane.tilt[0] + across[1] * plane.tilt[1]).norm();
        let turned = across
            .iter()
            .map(|axis| sign * (axis - normal * normal.dot(axis)).dot(&reach) / size);
        rates.extend(
            turned
                .enumerate()
                .map(|(k, rate)| (plane.first + 1 + k, rate)),
        );
    }
    (sign * normal.dot(&reach), rates)
}

/// Derivatives of the place of an anchor along a direction.
fn moved(standing: &StandingAnchor, along: &Vector3<f64>) -> Vec<(usize, f64)> {
    match standing.anchor.shape {
        Shape::Plane(normal) => vec![(standing.first, normal.dot(along))],
        _ => (0..3)
            .map(|axis| (standing.first + axis, along[axis]))
            .collect(),
    }
}

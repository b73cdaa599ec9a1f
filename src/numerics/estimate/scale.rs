//! How well the scale of an arm is known: by how much all lengths of what it measures may be larger together.

use crate::effect::{PlacedRow, PlacementBuffers, names};
use crate::estimate::covariance::Covariance;
use crate::estimate::model::{Model, row_error};
use crate::observation::{Dimension, KINDS, Residual, dimension, kinds, only_contacts};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;
use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

/// m; places that are no farther apart say nothing of scale.
const APART: f64 = 0.02;

/// What is known of the scale of an arm by contacts, where nothing else was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmScale {
    /// Relative standard deviation of the distances between the places; none where all rows close at one. What priors of link lengths
    /// add to it adds up as if all leaned the same way: nobody who states a tolerance of each says that they do not (GUM 5.2.2).
    pub sigma: Option<f64>,
    /// The same where no two links lean the same way.
    pub independent: Option<f64>,
    /// By how much more than their priors say links differ from nominal; at least 1.
    pub beyond: f64,
    /// Whether a length was given, a radius, or the places of two sockets.
    pub by_length: bool,
    /// Whether priors of links hold it.
    pub by_priors: bool,
    /// Farthest place from the base's origin, m.
    pub reach: f64,
}

/// The scale of an arm by rows that were fitted; none where links stay at nominal, or where some
/// measured other than contacts.
pub fn scale(
    model: &Model,
    data: &Measurements,
    rows: &[usize],
    covariance: Option<&Covariance>,
) -> Option<ArmScale> {
    // Links that stay at nominal are the scale.
    let free = covariance.map_or(&[][..], |covariance| covariance.parameters());
    let linked = model
        .stack
        .parameters_of(names::LINK_GEOMETRY)
        .any(|k| free.contains(&k));
    if rows.is_empty() || !linked || !only_contacts(data, rows) {
        return None;
    }
    let mut scratch = model.stack.scratch(&model.robot);
    let points: Vec<Vector3<f64>> = rows
        .iter()
        .map(|row| {
            model
                .stack
                .point(&model.robot, data, *row, &model.x, &mut scratch)
        })
        .collect();
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let square: f64 = points
        .iter()
        .map(|point| (point - middle).norm_squared())
        .sum();
    let links: Vec<usize> = model.stack.parameters_of(names::LINK_GEOMETRY).collect();
    let beyond = covariance.map_or(1.0, |covariance| beyond_priors(model, covariance));
    let sigmas = covariance
        .filter(|_| (square / points.len() as f64).sqrt() > APART)
        .and_then(|covariance| {
            let mut along = vec![0.0; model.x.len()];
            for (row, point) in rows.iter().zip(&points) {
                let off = (point - middle) / square;
                model.stack.derivatives(
                    &model.robot,
                    data,
                    *row,
                    &model.x,
                    &mut scratch,
                    |k, rate| along[k] += off.dot(&rate),
                );
            }
            let parameters = covariance.parameters();
            let weights =
                DVector::from_iterator(parameters.len(), parameters.iter().map(|k| along[*k]));
            let along = covariance.block(parameters)? * &weights;
            let whole = weights.dot(&along);
            // How the scale follows the mean of each prior, in standard deviations of that; and the errors along axes with it.
            let lengths = parameters
                .iter()
                .enumerate()
                .filter(|(_, k)| model.stack.specs()[**k].unit == Unit::Millimetre);
            let lengths = lengths.filter(|(_, k)| links.contains(k));
            let part = |(row, k): (usize, &usize)| {
                let part = along[row].abs() / model.known(*k).prior?.sigma;
                Some((
                    part,
                    carried(&model.robot, &model.stack.specs()[*k].name) as f64,
                ))
            };
            let parts: Vec<(f64, f64)> = lengths.filter_map(part).collect();
            let squares: f64 = parts.iter().map(|(part, _)| part * part).sum();
            let together = (whole - squares).max(0.0)
                + parts.iter().map(|(part, _)| part).sum::<f64>().powi(2);
            let whole = whole
                + parts
                    .iter()
                    .map(|(part, carried)| part * part * carried)
                    .sum::<f64>();
            let together = together.max(whole);
            Some([together, whole].map(|variance| beyond * variance.max(0.0).sqrt()))
        });
    let has_prior = |k: usize| {
        model
            .known
            .get(&k)
            .is_some_and(|known| known.prior.is_some())
    };
    let is_radius = |k: usize| model.stack.specs()[k].name.ends_with(".radius");
    let any_prior = |name: &'static str| model.stack.parameters_of(name).any(has_prior);
    Some(ArmScale {
        sigma: sigmas.map(|[together, _]| together),
        independent: sigmas.map(|[_, independent]| independent),
        beyond,
        by_length: !model.lengths.is_empty()
            || known_places(model) > 1
            || model
                .known
                .iter()
                .any(|(k, known)| is_radius(*k) && known.prior.is_some()),
        by_priors: any_prior(names::LINK_GEOMETRY) || any_prior(names::TOOL_OFFSET),
        reach: points
            .iter()
            .map(|point| (point - model.base().translation).norm())
            .fold(0.0, f64::max),
    })
}

/// How many errors of earlier links a shift of a link stands for in addition to its link: a link's error along the axis of its joint is none of its
/// parameters, since a shift of the next link that is not along its own joint's axis does the same.
fn carried(robot: &RobotModel, name: &str) -> usize {
    let parts = name
        .strip_prefix("link_geometry.l")
        .and_then(|tail| tail.split_once('.'));
    let Some((Ok(link), axis)) = parts.map(|(link, axis)| (link.parse::<usize>(), axis)) else {
        return 0;
    };
    let Some(axis) = ["x", "y", "z"].iter().position(|name| *name == axis) else {
        return 0;
    };
    let along = |joint: &usize| robot.is_revolute(*joint) && robot.axis(*joint)[axis].abs() > ALONG;
    (1..link.min(robot.joints()))
        .rev()
        .take_while(along)
        .count()
}

/// Cosine beyond which an axis lies along another.
const ALONG: f64 = 0.999;

/// Sockets whose places are known beforehand.
pub fn known_places(model: &Model) -> usize {
    let specs = model.stack.specs();
    let is_known = |k: &usize| specs[*k].name.ends_with(".x") && model.known(*k).prior.is_some();
    model
        .stack
        .parameters_of(names::ANCHOR)
        .filter(is_known)
        .count()
}

/// Root of the squares of links' deviations from their priors, in standard deviations, over the number of directions that the data see of
/// them (the ratio of Birge; effective parameters after MacKay, 1992); at least 1.
fn beyond_priors(model: &Model, covariance: &Covariance) -> f64 {
    let (mut square, mut seen) = (0.0, 0.0);
    let links: Vec<usize> = model.stack.parameters_of(names::LINK_GEOMETRY).collect();
    for (row, k) in covariance
        .parameters()
        .iter()
        .enumerate()
        .filter(|(_, k)| links.contains(k))
    {
        if let Some(prior) = model.known(*k).prior {
            square += ((model.x[*k] - prior.mean) / prior.sigma).powi(2);
            seen += (1.0 - (covariance.sigma(row) / prior.sigma).powi(2)).max(0.0);
        }
    }
    if seen < 1.0 {
        1.0
    } else {
        (square / seen).sqrt().max(1.0)
    }
}

/// What errors of rows are compared in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ErrorScale {
    /// Lengths of the residuals of points, or of other lengths, m.
    Lengths,
    /// Standard deviations of what a row measured, root mean square over its numbers, times the noise.
    Noise {
        /// What the noise is a size of.
        dimension: Dimension,
        /// Length of one sigma, root mean square over the rows, m or rad.
        size: f64,
    },
}

impl ErrorScale {
    /// The scale of errors of some rows of a recording.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        if data.readings.is_empty() && rows.iter().all(|row| data.has_point(*row)) {
            return Self::Lengths;
        }
        let dimension = dimension(data, rows);
        let noise: Vec<f64> = rows
            .iter()
            .filter_map(|row| noise(data, *row, dimension))
            .collect();
        let size = (noise.iter().map(|sigma| sigma * sigma).sum::<f64>()
            / noise.len().max(1) as f64)
            .sqrt();
        Self::Noise { dimension, size }
    }

    /// What errors are sizes of: m, or rad where no length was measured.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Lengths => Dimension::Length,
            Self::Noise { dimension, .. } => *dimension,
        }
    }

    /// The size of an error of one standard deviation of a row, m or rad.
    pub fn noise(&self, data: &Measurements, row: usize) -> f64 {
        match self {
            Self::Lengths => data.noise(row),
            Self::Noise { size, .. } => *size,
        }
    }

    /// The error of a row under a model, m or rad.
    pub(crate) fn error(
        &self,
        model: &Model,
        data: &Measurements,
        row: usize,
        scratch: &mut PlacementBuffers,
    ) -> f64 {
        self.of_placed(data, row, &model.place(data, row, scratch))
    }

    /// The error of a row that was placed, m or rad.
    pub(crate) fn of_placed(&self, data: &Measurements, row: usize, placed: &PlacedRow) -> f64 {
        let Self::Noise { size, .. } = self else {
            return row_error(data, row, placed).length;
        };
        let of_row = kinds(data)
            .into_iter()
            .filter_map(|kind| Residual::of(kind, data, row, placed));
        let (square, count) = of_row.fold((0.0, 0), |(square, count), residual| {
            (
                square + residual.whitened(data, 0.0).norm_squared(),
                count + residual.axes,
            )
        });
        (square / f64::from(count.max(1) as u32)).sqrt() * size
    }
}

/// Length of one sigma (m or rad) of the first kind of a dimension that a row measured.
pub fn noise(data: &Measurements, row: usize, dimension: Dimension) -> Option<f64> {
    KINDS
        .iter()
        .filter(|kind| kind.about().dimension == dimension)
        .find_map(|kind| kind.noise(data, row))
}

impl Model {
    /// Sizes (m or rad) of the residual of every row, of the first kind of a dimension that it measured.
    pub fn error_sizes(&self, data: &Measurements, dimension: Dimension) -> Vec<Option<f64>> {
        let kinds: Vec<_> = kinds(data)
            .into_iter()
            .filter(|kind| kind.about().dimension == dimension)
            .collect();
        let size = |scratch: &mut PlacementBuffers, row: usize| {
            let placed = self.place(data, row, scratch);
            kinds
                .iter()
                .find_map(|kind| Residual::of(*kind, data, row, &placed))
                .map(|residual| residual.error.norm())
        };
        (0..data.rows())
            .into_par_iter()
            .map_init(|| self.stack.scratch(&self.robot), size)
            .collect()
    }
}

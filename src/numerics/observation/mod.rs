//! Kinds of measurement: each owns in one place its columns, residual, noise, derivatives and rank; one line each in [`KINDS`].
//!
//! A kind predicts from where the target is: its derivative by a parameter is a linear map of how the parameter moves the point, turns
//! the target or moves the vector from the anchor (a [`Sensitivity`]), which the effect stack says of every parameter.

mod anchored;
mod inclination;
mod orientation;
mod planar;
mod point;
mod residual;

pub use crate::robot::{ColumnShape, Convention, Conventions, DeclaredColumn, Part};
pub use anchored::{Distance, PlaneKind, SocketKind, SphereKind};
pub use inclination::Inclination;
pub use orientation::Orientation;
pub use planar::Planar;
pub use point::PointKind;
pub use residual::{ExcessSigma, Residual, Weight};

use crate::effect::{Closing, Direction, PlacedRow, PointMotion};
use crate::robot::{Anchor, Measurements, Named, Reading, Readings, RobotModel, Shape};
use crate::spatial::Pose;
use crate::units::Unit;
use nalgebra::{Matrix3, Vector3};
use std::ops::RangeInclusive;

/// Every kind of measurement; a recording that maps no other holds the first.
pub const KINDS: &[&dyn MeasurementKind] = &[
    &PointKind,
    &Orientation,
    &Distance,
    &Inclination,
    &SocketKind,
    &PlaneKind,
    &SphereKind,
    &Planar,
];

/// What a kind's residual is a size of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// m
    Length,
    /// rad
    Angle,
}

impl Dimension {
    /// The unit in which small sizes are told.
    pub fn small(self) -> Unit {
        match self {
            Self::Length => Unit::Micrometre,
            Self::Angle => Unit::Arcsecond,
        }
    }
}

/// What a kind says of itself.
#[derive(Debug)]
pub struct KindDescription {
    /// E.g. `distance`.
    pub name: &'static str,
    /// What a prediction calls it that measured it.
    pub word: &'static str,
    /// Whether it measures lengths or angles.
    pub dimension: Dimension,
    /// Numbers of a row, three at most: more are two kinds.
    pub axes: usize,
    /// In the recording.
    pub columns: &'static [DeclaredColumn],
    /// Whether it must come with its standard deviation; else the instrument's noise is taken.
    pub own_sigma: bool,
    /// What it adds to the rank that theory gives.
    pub rank: Rank,
    /// Whether rows that stand out by it are named and set aside; else they are only down-weighted, by Huber's loss.
    pub(crate) is_screened: bool,
}

/// What a kind can see of the geometry, by theory.
#[derive(Debug, Clone, Copy)]
pub struct Rank {
    /// Whether it sees where axes and targets are; else directions alone.
    pub(crate) places: bool,
    /// Whether it sees how targets are turned.
    pub rotations: bool,
    /// Whether it sees how large the arm is: a length was measured, or is known.
    pub(crate) scale: bool,
    /// Translations and rotations of the whole cell that it does not see.
    pub(crate) blind: [usize; 2],
}

/// What of a target's motion a kind sees, in standard deviations: of the point, the orientation, the vector from the anchor.
#[derive(Debug, Clone)]
pub enum Sensitivity {
    /// Derivatives are those of the point.
    Point(Weight),
    /// Derivatives are those of the rotation of the target.
    Rotation(Weight),
    /// Derivatives are those of the vector from the anchor, which stands here.
    FromAnchor(Weight, Vector3<f64>),
}

impl Sensitivity {
    /// The derivative of each number by a parameter that acts along a direction, in standard deviations; zero beyond those of the kind.
    pub fn along(&self, motion: &PointMotion, direction: &Direction) -> Vector3<f64> {
        match self {
            Self::Point(weight) => weight.apply(&motion.point_along(direction)),
            Self::Rotation(weight) => weight.apply(&motion.turn_along(direction)),
            Self::FromAnchor(weight, reach) => {
                weight.apply(&motion.anchor_reach_along(direction, reach))
            }
        }
    }

    /// Derivatives of what was measured by every parameter, in standard deviations, through `emit(parameter, derivatives)`, of each
    /// number as [`Sensitivity::along`] has them.
    pub fn derivatives(&self, placed: &mut PlacedRow, mut emit: impl FnMut(usize, Vector3<f64>)) {
        match self {
            Self::Point(weight) => placed.partials(|k, velocity| emit(k, weight.apply(&velocity))),
            Self::Rotation(weight) => placed.rotations(|k, turn| emit(k, weight.apply(&turn))),
            Self::FromAnchor(weight, reach) => {
                placed.partials_from_anchor(reach, |k, velocity| emit(k, weight.apply(&velocity)))
            }
        }
    }
}

/// A row of a recording, and the arm placed in it.
#[derive(Clone, Copy)]
pub struct RowView<'a, 'p> {
    /// The recording.
    pub data: &'a Measurements,
    /// The row.
    pub row: usize,
    /// The arm.
    pub placed: &'a PlacedRow<'p>,
}

impl RowView<'_, '_> {
    /// Variance (m2) that the joints' repeatability makes of the point along a unit vector.
    fn joint_variance_along(&self, along: &Vector3<f64>) -> f64 {
        let spread = self.data.spread.as_ref();
        spread.map_or(0.0, |all| along.dot(&(all[self.row] * along)))
    }
}

/// A kind of measurement.
pub trait MeasurementKind: Sync {
    /// What it is, in words and numbers.
    fn about(&self) -> &'static KindDescription;

    /// Measured - predicted (m or rad, zero where a number was not measured, and beyond those of the kind) and the variance of each number; `None` where the row
    /// measured none, or the robot lacks what it was measured from.
    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)>;

    /// What it sees of the target's motion, its residual being turned into standard deviations by `weight`.
    fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity;

    /// In which directions a contact holds the target, where that is the measurement: nothing was read but the joints.
    fn closing(&self, _at: RowView) -> Option<Closing> {
        None
    }

    /// Values that a row has of it.
    fn axes(&self, data: &Measurements, row: usize) -> usize {
        if self.reading(data, row).is_some() {
            self.about().axes
        } else {
            0
        }
    }

    /// Turns its residual into standard deviations, with `excess` (m or rad) beside its own variance.
    fn weight(&self, data: &Measurements, row: usize, variance: f64, excess: f64) -> Weight {
        Weight::uniform((variance + self.joint_variance(data, row) + excess * excess).sqrt())
    }

    /// What the joints' repeatability adds to the variance of each number of a row.
    fn joint_variance(&self, data: &Measurements, row: usize) -> f64 {
        data.reading_spread
            .get(self.about().name)
            .map_or(0.0, |all| all[row])
    }

    /// Numbers of its residual, from 0, that a row measured, ascending.
    fn lines(&self, data: &Measurements, row: usize) -> &'static [usize] {
        &[0, 1, 2][..self.axes(data, row)]
    }

    /// Length of one sigma of what a row measured, m or rad.
    fn noise(&self, data: &Measurements, row: usize) -> Option<f64> {
        let joints = self.about().axes as f64 * self.joint_variance(data, row);
        self.instrument(data, row).map(|sigma| {
            if joints > 0.0 {
                (sigma * sigma + joints).sqrt()
            } else {
                sigma
            }
        })
    }

    /// Length of one sigma of the instrument alone, m or rad.
    fn instrument(&self, data: &Measurements, row: usize) -> Option<f64> {
        self.reading(data, row)
            .map(|reading| reading.sigma * (self.about().axes as f64).sqrt())
    }

    /// The error (m or rad) in standard deviations of the instrument alone, squared and summed.
    fn stated(&self, data: &Measurements, row: usize, error: &Vector3<f64>) -> f64 {
        self.reading(data, row).map_or(0.0, |reading| {
            error.norm_squared() / (reading.sigma * reading.sigma)
        })
    }

    /// Whether the rows may measure it at all.
    fn is_in(&self, data: &Measurements) -> bool {
        data.readings
            .iter()
            .any(|readings| readings.kind == self.about().name)
    }

    /// What a row holds of it; none where nothing was measured.
    fn reading<'a>(&self, data: &'a Measurements, row: usize) -> Option<Reading<'a>> {
        data.reading(self.about().name, row)
    }

    /// Words for what a row measured of it.
    fn words(&self, data: &Measurements, row: usize) -> Vec<&'static str> {
        if self.axes(data, row) > 0 {
            vec![self.about().word]
        } else {
            Vec::new()
        }
    }

    /// The numbers of a reading from those of the table (SI; NaN where a row measured none).
    fn keep(&self, stored: &[f64], kept: &mut Vec<f64>) {
        kept.extend(stored);
    }

    /// For a start: a matrix that, summed over rows, is nearest to how the target is turned on the last body, whose rotation at the
    /// row is `body` (tracker frame).
    fn attitude(
        &self,
        _data: &Measurements,
        _row: usize,
        _body: &Matrix3<f64>,
    ) -> Option<Matrix3<f64>> {
        None
    }

    /// For a start where no whole points are: where the base stands, in the recording's frame.
    fn base(&self, _robot: &RobotModel, _data: &Measurements, _rows: &[usize]) -> Option<Pose> {
        None
    }

    /// For a start: where anchors are. Fails with a sentence where too little was measured from one.
    fn anchors(
        &self,
        _robot: &RobotModel,
        _data: &Measurements,
        _rows: &[usize],
        _base: &Pose,
    ) -> Result<Vec<Anchor>, String> {
        Ok(Vec::new())
    }
}

impl dyn MeasurementKind + '_ {
    /// Its columns of a part.
    pub fn columns(&self, part: Part) -> impl Iterator<Item = &'static DeclaredColumn> {
        self.about()
            .columns
            .iter()
            .filter(move |column| column.part == part)
    }

    /// Columns that say that a row measured it: its values or, of a kind that reads none, the name of what holds the target.
    pub fn telling(&self) -> impl Iterator<Item = &'static DeclaredColumn> {
        self.columns(if self.is_contact() {
            Part::Anchor
        } else {
            Part::Value
        })
    }

    /// Whether a contact holds the target, and nothing is read but the joints.
    pub fn is_contact(&self) -> bool {
        self.columns(Part::Value).next().is_none()
    }

    /// What rows measured of it beside points, of the recording's `numbers` (SI, row-major) and `names` by setting.
    pub fn readings<'a>(
        &self,
        numbers: impl Fn(&str) -> Option<&'a [f64]>,
        named: impl Fn(&str) -> Option<Named>,
    ) -> Option<Readings> {
        let values: Vec<(&[f64], usize)> = self
            .columns(Part::Value)
            .map(|column| Some((numbers(column.setting)?, column.stored.len())))
            .collect::<Option<_>>()?;
        let sigma = numbers(self.columns(Part::Sigma).next()?.setting)?.to_vec();
        let (mut kept, mut stored) = (Vec::new(), Vec::new());
        for row in 0..sigma.len() {
            stored.clear();
            values.iter().for_each(|(all, width)| {
                stored.extend_from_slice(&all[row * width..(row + 1) * width])
            });
            self.keep(&stored, &mut kept);
        }
        let anchor = self
            .columns(Part::Anchor)
            .next()
            .map(|column| named(column.setting));
        if self.is_contact() && anchor.as_ref().is_none_or(Option::is_none) {
            return None;
        }
        let anchor = anchor.map(Option::unwrap_or_default);
        Some(Readings {
            kind: self.about().name,
            width: kept.len() / sigma.len().max(1),
            values: kept,
            sigma,
            anchor,
        })
    }
}

/// Kinds that the rows may measure.
pub fn kinds(data: &Measurements) -> Vec<&'static dyn MeasurementKind> {
    KINDS
        .iter()
        .copied()
        .filter(|kind| kind.is_in(data))
        .collect()
}

/// The contacts that hold the target in a row: their kinds, and what holds it.
pub fn contacts(
    data: &Measurements,
    row: usize,
) -> impl Iterator<Item = (&'static dyn MeasurementKind, Reading<'_>)> {
    let kinds = KINDS.iter().filter(|kind| kind.is_contact());
    kinds.filter_map(move |kind| Some((*kind, kind.reading(data, row)?)))
}

/// Whether contacts are all that these rows measured: nothing was read but the joints.
pub fn only_contacts(data: &Measurements, rows: &[usize]) -> bool {
    let kinds = kinds(data);
    let is_contact = |row: &usize| {
        kinds
            .iter()
            .all(|kind| kind.is_contact() || kind.axes(data, *row) == 0)
    };
    kinds.iter().any(|kind| kind.is_contact()) && rows.iter().all(is_contact)
}

/// Numbers that a row measured, of all kinds.
pub fn values(data: &Measurements, row: usize) -> usize {
    KINDS.iter().map(|kind| kind.axes(data, row)).sum()
}

/// What the errors of a recording are sizes of: lengths wherever one of the rows measured one.
pub fn dimension(data: &Measurements, rows: &[usize]) -> Dimension {
    let lengths = || {
        kinds(data)
            .into_iter()
            .filter(|kind| kind.about().dimension == Dimension::Length)
    };
    let measured = |row: &usize| lengths().any(|kind| kind.axes(data, *row) > 0);
    if rows.is_empty() || rows.iter().any(measured) {
        Dimension::Length
    } else {
        Dimension::Angle
    }
}

/// Length (m) of one sigma of what a row measured: of its point, or else of another length; zero where it measured none.
pub fn noise(data: &Measurements, row: usize) -> f64 {
    let mut lengths = KINDS
        .iter()
        .filter(|kind| kind.about().dimension == Dimension::Length);
    lengths
        .find_map(|kind| kind.noise(data, row))
        .unwrap_or(0.0)
}

/// Cosine beyond which a plane's normal lies along an axis: within 0.8 deg.
const ALONG: f64 = 0.9999;

/// Parameters of the geometry that the rows see by theory; none where some saw axes of a point only, of which theory has no word.
///
/// 4R + 2P for the axes (their directions alone are 2R), 3 for a target's place and as many for its orientation, 3 for an anchor (4 for a
/// sphere); less what moves the whole cell unseen, and its scale where no kind sees it and no `length` is known. Sockets
/// whose place is known, `points` of them on no line, fix the cell: one its translations, two the scale and all turns but about their line.
pub fn rank(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
    length: bool,
    points: usize,
) -> Option<usize> {
    let axes = |kind: &dyn MeasurementKind, wanted: RangeInclusive<usize>| {
        rows.iter()
            .any(|row| wanted.contains(&kind.axes(data, *row)))
    };
    let used: Vec<&dyn MeasurementKind> = KINDS
        .iter()
        .copied()
        .filter(|kind| axes(*kind, 1..=kind.about().axes))
        .collect();
    let (whole, others): (Vec<&dyn MeasurementKind>, Vec<&dyn MeasurementKind>) = used
        .iter()
        .copied()
        .partition(|kind| axes(*kind, kind.about().axes..=kind.about().axes));
    let blind = |k: usize| whole.iter().map(|kind| kind.about().rank.blind[k]).min();
    let (translations, rotations) = match points {
        0 => (blind(0)?, blind(1)?),
        1 => (0, blind(1)?),
        2 => (0, blind(1)?.min(1)),
        _ => (0, 0),
    };
    // Beside what fixes the whole cell it does not matter what single axes show.
    if translations + rotations > 0 && !others.is_empty() {
        return None;
    }
    let places = used.iter().any(|kind| kind.about().rank.places);
    let axis = |joint: usize| match (robot.is_revolute(joint), places) {
        (true, true) => 4,
        (true, false) | (false, true) => 2,
        (false, false) => 0,
    };
    let setup = robot.setup();
    let place = if places { 3 } else { 0 };
    let targets: usize = setup
        .targets
        .iter()
        .map(|target| place + if target.oriented { 3 } else { 0 })
        .sum();
    let seen = (0..robot.joints()).map(axis).sum::<usize>()
        + targets.max(place)
        + setup.first_of_anchor(setup.anchors.len());
    // Planes square to the first axis do not show where that stands.
    let along_first = |anchor: &Anchor| match anchor.shape {
        Shape::Plane(normal) => normal.dot(robot.axis(0)).abs() > ALONG,
        _ => false,
    };
    let flat = used
        .iter()
        .all(|kind| kind.about().name == PlaneKind.about().name)
        && setup.anchors.iter().all(along_first);
    let unplaced = if flat && robot.is_revolute(0) && points == 0 {
        2
    } else {
        0
    };
    // The travel of a slide is a length.
    let slides = (0..robot.joints()).any(|joint| !robot.is_revolute(joint));
    let scale = usize::from(
        used.iter().all(|kind| !kind.about().rank.scale) && !length && !slides && points < 2,
    );
    Some(seen - scale - unplaced - if places { translations } else { 0 } - rotations)
}

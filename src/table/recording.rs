//! The recording: joints as commanded or logged, and what was measured of the tool. SI in Rust, mm and rad in the table.

use super::Split;
use crate::Table;
use crate::error::{Error, Result, instead};
use crate::observation::{DeclaredColumn, KINDS};
use crate::store::frame::{Cell, Column, Frame, FrameBuilder};
use crate::units::Unit;
use calib_numerics::robot::{
    CIRCUMSTANCES, Measurements, Memories, Named, NoiseBasis, PointReadings, START, Sequence,
    SigmaSource, law_columns,
};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// All columns, in the order in which people see them: circumstances, and what kinds of measurement own.
pub fn columns() -> impl Iterator<Item = &'static DeclaredColumn> {
    CIRCUMSTANCES
        .iter()
        .chain(KINDS.iter().flat_map(|kind| kind.about().columns))
}

/// Measured points in the order of recording; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
///
/// Where an optional quantity is missing in a single row its value here is NaN, in the table null.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// Joints of the arm.
    pub joints: usize,
    /// Which joints are prismatic: their `q` is in m, stored as `q3_mm`.
    pub prismatic: Vec<bool>,
    /// Strictly increasing.
    pub sequence: Vec<i64>,
    /// Names of the points, a row each.
    pub point_id: Vec<String>,
    /// What the recording itself says a row is for (`fit`, `validate`, ...).
    pub usage: Vec<Option<String>>,
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Measured point in the tracker's frame, m; NaN along an axis that was not measured.
    pub position: Vec<[f64; 3]>,
    /// Its standard deviation per axis, m; NaN along an axis that was not measured.
    pub position_sigma: Option<Vec<[f64; 3]>>,
    /// Where that comes from; without it, from the recording.
    pub sigma_source: Option<Vec<SigmaSource>>,
    /// The same point by another simulation, in a frame fixed to the robot's base, m; NaN where it says nothing.
    pub simulated: Option<Vec<[f64; 3]>>,
    /// s.
    pub time: Option<Vec<f64>>,
    /// kg.
    pub payload: Option<Vec<f64>>,
    /// C.
    pub temperature: Option<Vec<f64>>,
    /// Motor current, A.
    pub current: Option<Vec<f64>>,
    /// Direction of the last move of each joint, +1 / -1 / 0.
    pub direction: Option<Vec<f64>>,
    /// Velocity of each joint when the point was measured, rad/s or m/s.
    pub velocity: Option<Vec<f64>>,
    /// The target that was measured; the tool point where a row names none.
    pub target: Option<Vec<Option<String>>>,
    /// What was measured beside points, and other circumstances: numbers of a setting, SI, row-major; NaN where a row has none.
    pub readings: BTreeMap<&'static str, Vec<f64>>,
    /// Associated names, e.g. of anchors.
    pub names: BTreeMap<&'static str, Vec<Option<String>>>,
}

impl Recording {
    /// How many points.
    pub fn rows(&self) -> usize {
        self.sequence.len()
    }
    /// Joint positions of a row, rad or m.
    pub fn q(&self, row: usize) -> &[f64] {
        &self.q[row * self.joints..(row + 1) * self.joints]
    }
}

impl Recording {
    /// What the numerics need; a point without a standard deviation has the weight that one starts from.
    pub fn measurements(&self) -> Measurements {
        let measured = |value: &f64| if value.is_finite() { *value } else { 0.0 };
        let (points, is_inferred) = points(
            &self.position,
            self.position_sigma.as_deref(),
            self.sigma_source.as_deref(),
        );
        let payload = match &self.payload {
            Some(all) => all.iter().map(measured).collect(),
            None => vec![0.0; self.rows()],
        };
        let mut data = Measurements {
            joints: self.joints,
            q: self.q.clone(),
            points,
            payload,
            current: self.current.clone(),
            time: self.time.clone(),
            temperature: self.temperature.clone(),
            circumstances: law_columns()
                .filter_map(|column| {
                    Some((column.setting, self.readings.get(column.setting)?.clone()))
                })
                .collect(),
            direction: self.direction.clone(),
            velocity: self.velocity.clone(),
            noise_basis: if is_inferred {
                NoiseBasis::Inferred
            } else {
                NoiseBasis::Instrument
            },
            spread: None,
            reading_spread: BTreeMap::new(),
            target: self.target.as_ref().map(|names| named(names)),
            readings: KINDS
                .iter()
                .filter_map(|kind| {
                    let names = |setting: &str| self.names.get(setting).map(|names| named(names));
                    kind.readings(
                        |setting| self.readings.get(setting).map(Vec::as_slice),
                        names,
                    )
                })
                .collect(),
            sequence: None,
            long_after: false,
            memories: Memories::default(),
        };
        data.sequence = data
            .time
            .as_ref()
            .and_then(|time| Sequence::by_time(time, |a, b| data.near_pose(a, b)));
        data
    }

    /// The name of what holds a row's target, where that contact is what was measured.
    pub fn contact(&self, row: usize) -> Option<&str> {
        let settings = KINDS
            .iter()
            .filter(|kind| kind.is_contact())
            .flat_map(|kind| kind.telling());
        settings
            .filter_map(|column| self.names.get(column.setting)?.get(row)?.as_deref())
            .next()
    }

    /// The point of a row (m) where all three of its axes were measured.
    pub fn point(&self, row: usize) -> Option<[f64; 3]> {
        self.position.get(row).copied().filter(is_whole)
    }
}

fn named(names: &[Option<String>]) -> Named {
    Named::of(names.iter().map(|name| name.as_deref().unwrap_or_default()))
}

impl Table for Recording {
    const KIND: &'static str = "recording";

    fn to_frame(&self) -> Result<Frame> {
        let named = |all: &Vec<SigmaSource>| {
            all.iter()
                .map(|source| Some(source.name().to_string()))
                .collect::<Vec<_>>()
        };
        let source = self.sigma_source.as_ref().map(named);
        let texts = [
            ("usage", Some(&self.usage)),
            ("target", self.target.as_ref()),
            (SOURCE, source.as_ref()),
        ];
        let texts = texts
            .into_iter()
            .filter_map(|(name, texts)| Some((name, texts?)));
        let texts = texts.chain(self.names.iter().map(|(name, names)| (*name, names)));
        let numbers = columns().filter_map(|column| Some((column, self.numbers(column)?)));
        let numbers = numbers.flat_map(|(column, (values, first, step))| {
            let stored = column.columns(&self.prismatic).into_iter().enumerate();
            stored.map(move |(k, (name, unit))| {
                (
                    name,
                    unit,
                    values.iter().copied().skip(first + k).step_by(step),
                )
            })
        });
        let texts = texts.map(|(name, texts)| (name, Cell::to_array(texts.clone())));
        frame(
            self.sequence.clone(),
            Cell::to_array(self.point_id.clone()),
            texts,
            numbers,
        )
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let has = |name: &str| frame.column(name).is_some();
        let prismatic = prismatic(frame);
        let mut numbers: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
        for column in columns() {
            let values = self::numbers(frame, column, &prismatic)?;
            numbers.extend(values.map(|values| (column.setting, values)));
        }
        let mut texts: BTreeMap<&'static str, Vec<Option<String>>> = BTreeMap::new();
        for column in columns().filter(|column| column.is_text() && has(column.setting)) {
            if column.setting != "point_id" {
                texts.insert(column.setting, frame.read(column.setting)?);
            }
        }
        let known = |name: Option<String>| {
            let mut all = SigmaSource::ALL.iter().copied();
            all.find(|source| name.as_deref() == Some(source.name()))
                .unwrap_or(SigmaSource::Recorded)
        };
        let source = if has(SOURCE) {
            Some(
                frame
                    .read::<Option<String>>(SOURCE)?
                    .into_iter()
                    .map(known)
                    .collect(),
            )
        } else {
            None
        };
        let mut take = |setting: &str| numbers.remove(setting);
        let mut points = |[x, y, z]: [&str; 3]| -> Option<Vec<[f64; 3]>> {
            let axes = [take(x)?, take(y)?, take(z)?];
            Some(
                (0..frame.rows())
                    .map(|row| [axes[0][row], axes[1][row], axes[2][row]])
                    .collect(),
            )
        };
        Ok(Self {
            joints: prismatic.len(),
            prismatic,
            sequence: frame.read("sequence")?,
            point_id: frame.read("point_id")?,
            usage: texts.remove("usage").unwrap_or_default(),
            position: points(POINT).unwrap_or_default(),
            position_sigma: points(SIGMA),
            sigma_source: source,
            simulated: points(SIMULATED),
            q: take("q").unwrap_or_default(),
            time: take("time"),
            payload: take("payload"),
            temperature: take("temperature"),
            current: take("current"),
            direction: take("direction"),
            velocity: take("velocity"),
            target: texts.remove("target"),
            readings: numbers,
            names: texts,
        })
    }
}

const POINT: [&str; 3] = ["x", "y", "z"];
const SIGMA: [&str; 3] = ["sigma_x", "sigma_y", "sigma_z"];
/// The column that says where standard deviations of points come from.
pub const SOURCE: &str = "sigma_source";
const SIMULATED: [&str; 3] = ["sim_x", "sim_y", "sim_z"];

impl Recording {
    /// The numbers of a column, SI: where they are, the first of them, and how far the next row's is.
    fn numbers(&self, column: &DeclaredColumn) -> Option<(&[f64], usize, usize)> {
        let points = [
            (POINT, Some(&self.position)),
            (SIGMA, self.position_sigma.as_ref()),
            (SIMULATED, self.simulated.as_ref()),
        ];
        for (settings, points) in points {
            if let Some(axis) = settings
                .iter()
                .position(|setting| *setting == column.setting)
            {
                return Some((points?.as_flattened(), axis, 3));
            }
        }
        let values = match column.setting {
            "q" => Some(&self.q),
            "time" => self.time.as_ref(),
            "payload" => self.payload.as_ref(),
            "temperature" => self.temperature.as_ref(),
            "current" => self.current.as_ref(),
            "direction" => self.direction.as_ref(),
            "velocity" => self.velocity.as_ref(),
            other => self.readings.get(other),
        };
        Some((values?, 0, column.columns(&self.prismatic).len().max(1)))
    }
}

/// The table of rows with their texts by setting and their numbers (SI; NaN where a row has none) by stored name and unit.
pub fn frame<N: Iterator<Item = f64>>(
    sequence: Vec<i64>,
    point_id: Column,
    texts: impl Iterator<Item = (&'static str, Column)>,
    numbers: impl Iterator<Item = (String, Unit, N)>,
) -> Result<Frame> {
    let mut frame = FrameBuilder::new(Recording::KIND);
    frame.push("sequence", Cell::to_array(sequence));
    frame.push("point_id", point_id);
    texts.for_each(|(name, texts)| frame.push(name, texts));
    numbers.for_each(|(name, unit, values)| {
        frame.push_numbers(name, values.map(|value| unit.from_si(value)))
    });
    frame.finish()
}

/// What a recording declares by the name of its setting.
pub(super) fn declared(setting: &str) -> &'static DeclaredColumn {
    let mut columns = columns();
    let found = columns.find(|column| column.setting == setting);
    found.expect("a declared circumstance")
}

/// Which joints of a table are prismatic.
pub(super) fn prismatic(frame: &Frame) -> Vec<bool> {
    let has = |name: String| frame.column(&name).is_some();
    (1..)
        .map(|joint| (has(format!("q{joint}_rad")), has(format!("q{joint}_mm"))))
        .take_while(|(turns, slides)| *turns || *slides)
        .map(|(_, slides)| slides)
        .collect()
}

/// The numbers of a declared column, row-major, SI, NaN for null; none where the table lacks it.
pub(super) fn numbers(
    frame: &Frame,
    column: &DeclaredColumn,
    prismatic: &[bool],
) -> Result<Option<Vec<f64>>> {
    let stored = column.columns(prismatic);
    let there = |(name, _): &(String, Unit)| frame.column(name).is_some();
    if !stored.first().is_some_and(there) {
        return Ok(None);
    }
    let read = |(name, unit): &(String, Unit)| -> Result<Vec<f64>> {
        let values = frame.read::<Option<f64>>(name)?.into_iter();
        Ok(values
            .map(|value| value.map_or(f64::NAN, |value| unit.to_si(value)))
            .collect())
    };
    let columns = stored.iter().map(read).collect::<Result<Vec<_>>>()?;
    Ok(Some(interleaved(&columns)))
}

/// Adds a declared column from its numbers, row-major, SI, NaN for null.
pub(super) fn push_numbers(
    frame: &mut FrameBuilder,
    column: &DeclaredColumn,
    prismatic: &[bool],
    values: &[f64],
) {
    let stored = column.columns(prismatic);
    for (k, (name, unit)) in stored.iter().enumerate() {
        let values = values.iter().skip(k).step_by(stored.len());
        frame.push_numbers(name.clone(), values.map(|value| unit.from_si(*value)));
    }
}

/// Columns of equal length -> row-major.
pub(super) fn interleaved<T: Copy>(columns: &[Vec<T>]) -> Vec<T> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .flat_map(|row| columns.iter().map(move |column| column[row]))
        .collect()
}

impl Split {
    /// Rows of the recording in any of `sets`. A set without rows, or a split of another recording, is an error.
    pub fn rows(&self, recording: &Recording, sets: &[String]) -> Result<Vec<usize>> {
        let same = self.0.len() == recording.rows()
            && self
                .0
                .iter()
                .zip(&recording.sequence)
                .all(|(row, s)| row.sequence == *s);
        if !same {
            return Err(Error::data(
                "table split",
                "does not belong to this recording: their sequence numbers differ",
            ));
        }
        for (k, set) in sets.iter().enumerate() {
            if !self.0.iter().any(|row| row.set == *set) {
                let mut names: Vec<&str> = self.0.iter().map(|row| row.set.as_str()).collect();
                names.sort_unstable();
                names.dedup();
                return Err(Error::data(
                    format!("with.on[{k}]"),
                    format!("no row is in set `{set}`{}", instead(set, &names)),
                ));
            }
        }
        Ok((0..self.0.len())
            .filter(|row| sets.contains(&self.0[*row].set))
            .collect())
    }
}

/// Whether all three axes were measured.
pub(super) fn is_whole(point: &[f64; 3]) -> bool {
    point.iter().all(|axis| axis.is_finite())
}

/// Points (m, NaN along axes that were not measured) with their standard deviations, the weight that one starts from where a point has
/// none; and whether one of these was inferred.
pub(super) fn points(
    position: &[[f64; 3]],
    sigma: Option<&[[f64; 3]]>,
    source: Option<&[SigmaSource]>,
) -> (PointReadings, bool) {
    let there = |row: usize, axis: usize| position[row][axis].is_finite();
    let sigma_of = |row: usize, axis: usize| {
        sigma
            .map(|all| all[row][axis])
            .filter(|stated| *stated > 0.0)
    };
    let measured = |value: &f64| if value.is_finite() { *value } else { 0.0 };
    let points: Vec<Vector3<f64>> = position
        .iter()
        .map(|point| Vector3::from_iterator(point.iter().map(measured)))
        .collect();
    let of_row = |row: usize, axis: usize| match there(row, axis) {
        true => sigma_of(row, axis).unwrap_or_else(|| START.sigma(&points[row])),
        false => f64::INFINITY,
    };
    let sigma = (0..points.len())
        .map(|row| Vector3::from_fn(|axis, _| of_row(row, axis)))
        .collect();
    let inferred = |row: usize| {
        let is_inferred = source.is_some_and(|all| all[row] == SigmaSource::Inferred);
        (0..3).any(|axis| there(row, axis) && (is_inferred || sigma_of(row, axis).is_none()))
    };
    let is_inferred = (0..points.len()).any(inferred);
    (
        PointReadings {
            position: points,
            sigma,
        },
        is_inferred,
    )
}

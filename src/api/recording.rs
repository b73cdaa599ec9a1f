//! Arrays -> the table `recording`: its columns are the arguments, its schema says what they may hold.

use super::Robot;
use crate::error::{Error, Fault, Result, counted, instead};
use crate::robot::{
    Instrument, Measurements, ONE_AND_A_HALF_TURNS, PointReadings, START, SigmaSource, too_far,
};
use crate::stage::ingest::instruments;
use crate::store::frame::{Cell, Frame, FrameBuilder};
use crate::store::schema::{self, ColumnType, FieldSchema};
use crate::table::{Recording as RecordingTable, SIGMA_SOURCE, Table};
use crate::units::Unit;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Joints of an arm, and under which circumstances.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Poses {
    /// Rows times joints, as the controller counts them; mm of a joint that slides.
    pub joints_rad: Vec<f64>,
    /// Columns of the table `recording` by their names, a number a row (NaN where there is none); of columns of each joint without the joint
    /// (`i_a`, `dir`), rows times joints.
    pub columns: BTreeMap<String, Vec<f64>>,
}

/// How far measured points scatter, one standard deviation of each axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Sigma {
    /// Not known: a weight to start from.
    #[default]
    Inferred,
    /// By an instrument that calib knows.
    Instrument(String),
    /// One for all, one a row, or one for each axis of each row.
    Mm(Vec<f64>),
}

/// What was measured in which pose.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// In the order of recording.
    pub poses: Poses,
    /// Measured points in the frame of the instrument.
    pub points_mm: Vec<[f64; 3]>,
    /// Their noise.
    pub sigma: Sigma,
    /// Columns with names (`point_id`, `target`, ...), one a row; empty where a row has none.
    pub names: BTreeMap<String, Vec<String>>,
    /// Rows that are fitted to by nothing and judge in the end; without it every fourth pose, as `calib init` writes.
    pub held_out: Option<Vec<bool>>,
}

/// Faults that are reported for one array.
const LISTED: usize = 5;

/// Columns that have fields of their own.
const OWN: [&str; 5] = ["q_rad", "q_mm", "sequence", "usage", SIGMA_SOURCE];

/// A column's name without its joint.
fn short(field: &FieldSchema) -> String {
    field.name.replace("{j}", "")
}

/// mm as they stand in a table after a file was read.
fn as_read(mm: f64) -> f64 {
    Unit::Millimetre.from_si(Unit::Millimetre.to_si(mm))
}

impl Poses {
    /// How many. Fails where the numbers are no rows of this robot, or degrees.
    pub(crate) fn rows(&self, robot: &Robot) -> Result<usize> {
        let (joints, found) = (robot.joints(), self.joints_rad.len());
        let rows = found / joints;
        if rows == 0 || found % joints != 0 {
            let message = format!("{found} numbers are no rows of {joints} joints");
            return Err(Error::data("joints", message));
        }
        let values = self.joints_rad.iter().enumerate();
        let missing = values.filter(|(_, value)| !value.is_finite()).take(LISTED);
        let fault = |(at, value): (usize, &f64)| {
            let place = format!("joints, row {}, joint {}", at / joints, at % joints + 1);
            Fault::new(place, format!("{value} is not a number"))
        };
        let mut faults: Vec<Fault> = missing.map(fault).collect();
        let slides = robot.prismatic();
        let far = |q: &[f64]| {
            let mut each = q.iter().zip(&slides);
            each.position(|(q, slides)| !slides && q.abs() > ONE_AND_A_HALF_TURNS)
        };
        let all = self.joints_rad.chunks(joints).enumerate();
        let mut beyond = all.filter_map(|(row, q)| Some((row, far(q)?)));
        if let Some((row, joint)) = beyond.next() {
            let count = 1 + beyond.count();
            if count * 2 > rows {
                let value = self.joints_rad[row * joints + joint];
                let counts = [count, rows].map(|rows| rows as u64);
                let message = too_far("joints", "rad", counts, joint, value);
                let advice = "; if the array holds degrees, convert it to radians";
                faults.push(Fault::new(format!("joints, row {row}"), message + advice));
            }
        }
        Error::if_data(faults).map(|()| rows)
    }

    /// As the numerics take them; where no time is stated, long after whatever was recorded.
    pub(super) fn measurements(&self, robot: &Robot) -> Result<Measurements> {
        let rows = self.rows(robot)?;
        if self.columns.is_empty() {
            return Ok(Measurements {
                joints: robot.joints(),
                q: robot.to_si(&self.joints_rad),
                points: PointReadings::new(vec![Vector3::zeros(); rows], 1.0),
                payload: vec![0.0; rows],
                long_after: true,
                ..Measurements::default()
            });
        }
        let unmeasured = Recording {
            poses: self.clone(),
            points_mm: vec![[f64::NAN; 3]; rows],
            sigma: Sigma::Mm(vec![f64::NAN]),
            ..Recording::default()
        };
        let mut data = RecordingTable::from_frame(&unmeasured.frame(robot, rows)?)?.measurements();
        data.long_after = data.time.is_none();
        Ok(data)
    }
}

impl Recording {
    /// The table. Fails with what is wrong with the arrays.
    pub(super) fn table(&self, robot: &Robot) -> Result<Frame> {
        let rows = self.poses.rows(robot)?;
        same("points", self.points_mm.len(), rows)?;
        let points = self.points_mm.iter().enumerate();
        let wrong = points.filter_map(|(row, point)| {
            let message = match point.iter().find(|value| !value.is_finite()) {
                Some(value) => format!("{value} is not a number"),
                None if *point == [0.0; 3] => {
                    "the position is 0, 0, 0: the tracker saw nothing".into()
                }
                None => return None,
            };
            Some(Fault::new(format!("points, row {row}"), message))
        });
        let mut faults: Vec<Fault> = wrong.take(LISTED).collect();
        if let Sigma::Mm(given) = &self.sigma
            && let Some(value) = given.iter().find(|mm| !(mm.is_finite() && **mm > 0.0))
        {
            let message = format!("{value} mm; expected a number above 0");
            faults.push(Fault::new("sigma", message));
        }
        Error::if_data(faults)?;
        self.frame(robot, rows)
    }

    /// The table of numbers that were looked at.
    fn frame(&self, robot: &Robot, rows: usize) -> Result<Frame> {
        let fields = &schema::of(RecordingTable::KIND)?.fields;
        let named = |name: &str| fields.iter().find(|field| short(field) == name);
        let mut frame = FrameBuilder::new(RecordingTable::KIND);
        let columns = self.poses.columns.iter();
        let columns = columns.filter(|(name, _)| !OWN.contains(&name.as_str()));
        let columns = columns.map(|(name, values)| (name.as_str(), values));
        for (name, values) in columns.chain([("q_rad", &self.poses.joints_rad)]) {
            let field = named(name).filter(|field| field.column_type == ColumnType::Float64);
            let field = field.ok_or_else(|| unknown(name, fields))?;
            let width = if field.per_joint { robot.joints() } else { 1 };
            same(name, values.len(), rows * width)?;
            for (joint, slides) in robot.prismatic().into_iter().enumerate().take(width) {
                // Of `q_rad` and `dq_rad_s` a joint that slides has `q_mm` and `dq_mm_s`.
                let field_of_kind = named(&name.replace("_rad", "_mm")).filter(|_| slides);
                let field = field_of_kind.unwrap_or(field);
                let unit = field.unit.as_deref().and_then(Unit::parse);
                let stored = |value| unit.map_or(value, |unit| unit.from_si(unit.to_si(value)));
                let name = field.column(field.per_joint.then_some(joint + 1));
                let field_of_kind = values.iter().skip(joint).step_by(width);
                frame.push_numbers(name, field_of_kind.copied().map(stored));
            }
        }
        let sigma = self.sigmas(rows)?;
        for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
            let points = self.points_mm.iter();
            frame.push_numbers(name, points.map(|point| as_read(point[axis])));
            let field_of_kind = sigma.iter().copied().skip(axis).step_by(3);
            frame.push_numbers(format!("sigma_{name}"), field_of_kind);
        }
        let source = match self.sigma {
            Sigma::Inferred => SigmaSource::Inferred,
            Sigma::Instrument(_) => SigmaSource::Instrument,
            Sigma::Mm(_) => SigmaSource::Recorded,
        };
        let set = |row: usize| {
            let held_out = self.held_out.as_ref()?.get(row)?;
            Some(if *held_out { "validate" } else { "fit" }.to_string())
        };
        if let Some(held_out) = &self.held_out {
            same("held_out", held_out.len(), rows)?;
        }
        let source = vec![Some(source.name().to_string()); rows];
        frame.push(SIGMA_SOURCE, Cell::to_array(source));
        frame.push(
            "usage",
            Cell::to_array((0..rows).map(set).collect::<Vec<_>>()),
        );
        frame.push("sequence", Cell::to_array((1..=rows as i64).collect()));
        if !self.names.contains_key("point_id") {
            let ids = (1..=rows).map(|row| format!("row {row}"));
            frame.push("point_id", Cell::to_array(ids.collect::<Vec<String>>()));
        }
        for (name, texts) in &self.names {
            let field = named(name).filter(|field| field.column_type == ColumnType::Utf8);
            if field.is_none() || OWN.contains(&name.as_str()) {
                return Err(unknown(name, fields));
            }
            same(name, texts.len(), rows)?;
            let texts = texts.iter();
            let texts = texts.map(|text| (!text.is_empty()).then(|| text.clone()));
            frame.push(name.as_str(), Cell::to_array(texts.collect::<Vec<_>>()));
        }
        frame.finish()
    }

    /// Standard deviations, mm, three a row.
    fn sigmas(&self, rows: usize) -> Result<Vec<f64>> {
        let figures = match &self.sigma {
            Sigma::Mm(given) => {
                let counts = [1, rows, 3 * rows];
                let Some(count) = counts.into_iter().find(|count| *count == given.len()) else {
                    let message = format!(
                        "{}; expected one for all, {rows}, or three for each of {rows} rows",
                        counted(given.len(), "number")
                    );
                    return Err(Error::data("sigma", message));
                };
                let each = |mm: &f64| std::iter::repeat_n(as_read(*mm), 3 * rows / count);
                return Ok(given.iter().flat_map(each).collect());
            }
            Sigma::Inferred => START,
            Sigma::Instrument(name) => Instrument::named(name).ok_or_else(|| {
                let other = instead(name, &instruments());
                Error::spec("sigma", format!("unknown instrument `{name}`{other}"))
            })?,
        };
        let sigma = |point: &[f64; 3]| {
            let metres = Vector3::from(point.map(|value| Unit::Millimetre.to_si(value)));
            [Unit::Millimetre.from_si(figures.sigma(&metres)); 3]
        };
        Ok(self.points_mm.iter().flat_map(sigma).collect())
    }
}

fn same(name: &str, found: usize, expected: usize) -> Result<()> {
    let message = || format!("{}; expected {expected}", counted(found, "value"));
    (found == expected)
        .then_some(())
        .ok_or_else(|| Error::data(name, message()))
}

fn unknown(name: &str, fields: &[FieldSchema]) -> Error {
    let names: Vec<String> = fields.iter().map(short).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let allowed: Vec<&str> = names
        .into_iter()
        .filter(|name| !OWN.contains(name))
        .collect();
    Error::spec(name, format!("no such column{}", instead(name, &allowed)))
}

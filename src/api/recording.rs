//! Arrays -> the table `recording`: its columns are the arguments, its schema what they may hold.

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
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Joints of an arm, and under which circumstances.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Poses {
    /// Rows times joints, as the controller counts them; mm of a joint that slides.
    pub joints_rad: Vec<f64>,
    /// Columns of the table `recording` by their names, a number a row; of columns of each joint without the joint (`i_a`, `dir`), rows times
    /// joints. NaN where a row has none.
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

/// Faults that are told of one array.
const TOLD: usize = 5;

/// Columns that have fields of their own.
const OWN: [&str; 8] = [
    "q_rad",
    "q_mm",
    "x_mm",
    "y_mm",
    "z_mm",
    "sigma_x_mm",
    "sigma_y_mm",
    "sigma_z_mm",
];

/// A column's name without its joint.
fn short(field: &FieldSchema) -> String {
    field.name.replace("{j}", "")
}

/// What a stage finds in the table after a file was read in this unit.
fn stored(field: &FieldSchema, value: f64) -> f64 {
    let unit = field.unit.as_deref().and_then(Unit::parse);
    unit.map_or(value, |unit| unit.from_si(unit.to_si(value)))
}

impl Poses {
    /// How many. Fails where the numbers are no rows of this robot, or degrees.
    pub fn rows(&self, robot: &Robot) -> Result<usize> {
        let joints = robot.joints();
        let numbers = self.joints_rad.len();
        if numbers % joints != 0 || numbers == 0 {
            let message = format!(
                "{} are no rows of {}",
                counted(numbers, "number"),
                counted(joints, "joint")
            );
            return Err(Error::data("joints", message));
        }
        let mut faults = Vec::new();
        let missing = self.joints_rad.iter().enumerate();
        for (at, value) in missing.filter(|(_, value)| !value.is_finite()).take(TOLD) {
            let place = format!("joints, row {}, joint {}", at / joints, at % joints + 1);
            faults.push(Fault::new(place, format!("{value} is not a number")));
        }
        let turns: Vec<bool> = robot.prismatic().iter().map(|slides| !slides).collect();
        let far = |row: &[f64]| {
            row.iter()
                .zip(&turns)
                .position(|(q, turns)| *turns && q.abs() > ONE_AND_A_HALF_TURNS)
        };
        let rows = self.joints_rad.chunks(joints).enumerate();
        let mut beyond = rows.filter_map(|(row, q)| far(q).map(|joint| (row, joint, q[joint])));
        if let Some((row, joint, value)) = beyond.next() {
            let (count, rows) = (1 + beyond.count(), numbers / joints);
            if count * 2 > rows {
                let message = too_far(
                    "joints",
                    "rad",
                    [count, rows].map(|rows| rows as u64),
                    joint,
                    value,
                );
                let place = format!("joints, row {row}");
                let advice = "; if the array holds degrees, convert it to radians";
                faults.push(Fault::new(place, message + advice));
            }
        }
        match faults.is_empty() {
            true => Ok(numbers / joints),
            false => Err(Error::Data(faults)),
        }
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
        let recording = Recording {
            poses: self.clone(),
            points_mm: vec![[f64::NAN; 3]; rows],
            ..Recording::default()
        };
        let frame = recording.unchecked(robot, rows)?;
        let mut data = RecordingTable::from_frame(&frame)?.measurements();
        data.long_after = data.time.is_none();
        Ok(data)
    }
}

impl Recording {
    /// Settings of the stage `split`.
    pub(super) fn split(&self) -> Value {
        match self.held_out {
            Some(_) => json!({ "by": "usage" }),
            None => json!({ "by": "every", "n": 4 }),
        }
    }

    /// The table. Fails with what is wrong with the arrays.
    pub(super) fn table(&self, robot: &Robot) -> Result<Frame> {
        let rows = self.poses.rows(robot)?;
        let mut faults = Vec::new();
        if self.points_mm.len() != rows {
            let message = format!(
                "{}, but {} of joints: expected as many",
                counted(self.points_mm.len(), "row"),
                rows
            );
            faults.push(Fault::new("points", message));
        }
        for (row, point) in self.points_mm.iter().enumerate() {
            let place = format!("points, row {row}");
            if let Some(value) = point.iter().find(|value| !value.is_finite()) {
                faults.push(Fault::new(place, format!("{value} is not a number")));
            } else if *point == [0.0; 3] {
                let message = "the position is 0, 0, 0: the tracker saw nothing";
                faults.push(Fault::new(place, message));
            }
        }
        faults.truncate(TOLD);
        if !faults.is_empty() {
            return Err(Error::Data(faults));
        }
        self.unchecked(robot, rows)
    }

    /// The table of arrays whose joints and points are numbers.
    fn unchecked(&self, robot: &Robot, rows: usize) -> Result<Frame> {
        let schema = schema::of(RecordingTable::KIND)?;
        let mut frame = FrameBuilder::new(RecordingTable::KIND);
        frame.push("sequence", Cell::to_array((1..=rows as i64).collect()));
        let of_joints = |name: &str, prismatic: bool| {
            let names: &[&str] = match (name, prismatic) {
                ("q_rad", true) => &["q_mm"],
                ("dq_rad_s", true) => &["dq_mm_s"],
                _ => &[name],
            };
            schema
                .fields
                .iter()
                .find(|field| names.contains(&short(field).as_str()))
        };
        let prismatic = robot.prismatic();
        let numbers = self.poses.columns.iter();
        let numbers = numbers.map(|(name, values)| (name.as_str(), values));
        for (name, values) in numbers.chain([("q_rad", &self.poses.joints_rad)]) {
            let field = of_joints(name, false)
                .filter(|field| field.column_type == ColumnType::Float64)
                .filter(|_| name == "q_rad" || !OWN.contains(&name));
            let Some(field) = field else {
                return Err(unknown(name, ColumnType::Float64));
            };
            let width = if field.per_joint { robot.joints() } else { 1 };
            same(name, values.len(), rows * width)?;
            for joint in 0..width {
                let slides = field.per_joint && prismatic.get(joint) == Some(&true);
                let field = of_joints(name, slides).unwrap_or(field);
                let own = values.iter().skip(joint).step_by(width);
                frame.push_numbers(
                    field.column(field.per_joint.then_some(joint + 1)),
                    own.map(|value| stored(field, *value)),
                );
            }
        }
        let measured = self.points_mm.iter().flatten().all(|x| x.is_finite());
        let sigma = measured.then(|| self.sigmas(rows)).transpose()?;
        for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
            let own = self.points_mm.iter().map(|point| as_read(point[axis]));
            frame.push_numbers(name, own);
            if let Some(sigma) = &sigma {
                let own = sigma.iter().copied().skip(axis).step_by(3);
                frame.push_numbers(format!("sigma_{name}"), own);
            }
        }
        let source = match self.sigma {
            Sigma::Inferred => SigmaSource::Inferred,
            Sigma::Instrument(_) => SigmaSource::Instrument,
            Sigma::Mm(_) => SigmaSource::Recorded,
        };
        let source = Some(source.name().to_string());
        frame.push(SIGMA_SOURCE, Cell::to_array(vec![source; rows]));
        self.texts(rows, frame)
    }

    fn texts(&self, rows: usize, mut frame: FrameBuilder) -> Result<Frame> {
        let mut ids: Vec<String> = (1..=rows).map(|row| format!("row {row}")).collect();
        for (name, texts) in &self.names {
            same(name, texts.len(), rows)?;
            let field = schema::of(RecordingTable::KIND)?.fields.iter();
            let mut own = field.filter(|field| field.column_type == ColumnType::Utf8);
            if name == "point_id" {
                ids.clone_from(texts);
            } else if name == SIGMA_SOURCE || name == "usage" || !own.any(|own| own.name == *name) {
                return Err(unknown(name, ColumnType::Utf8));
            } else {
                let texts = texts.iter();
                let texts = texts.map(|text| (!text.is_empty()).then(|| text.clone()));
                frame.push(name.as_str(), Cell::to_array(texts.collect::<Vec<_>>()));
            }
        }
        frame.push("point_id", Cell::to_array(ids));
        let held_out = self.held_out.as_deref().unwrap_or_default();
        if self.held_out.is_some() {
            same("held_out", held_out.len(), rows)?;
        }
        let set = |row: usize| {
            let held_out = held_out.get(row)?;
            Some(if *held_out { "validate" } else { "fit" }.to_string())
        };
        let usage: Vec<Option<String>> = (0..rows).map(set).collect();
        frame.push("usage", Cell::to_array(usage));
        frame.finish()
    }

    /// Standard deviations, mm, three a row.
    fn sigmas(&self, rows: usize) -> Result<Vec<f64>> {
        let figures = match &self.sigma {
            Sigma::Mm(given) => return stated(given, rows),
            Sigma::Inferred => START,
            Sigma::Instrument(name) => Instrument::named(name).ok_or_else(|| {
                let message = format!(
                    "unknown instrument `{name}`{}",
                    instead(name, &instruments())
                );
                Error::spec("sigma", message)
            })?,
        };
        let sigma = |point: &[f64; 3]| {
            let metres = Vector3::from(point.map(|value| Unit::Millimetre.to_si(value)));
            [Unit::Millimetre.from_si(figures.sigma(&metres)); 3]
        };
        Ok(self.points_mm.iter().flat_map(sigma).collect())
    }
}

/// One for all, one a row, or three a row -> three a row, as stored.
fn stated(given: &[f64], rows: usize) -> Result<Vec<f64>> {
    if let Some(at) = given
        .iter()
        .position(|value| !(value.is_finite() && *value > 0.0))
    {
        let message = format!("{} mm; expected a number above 0", given[at]);
        return Err(Error::data("sigma", message));
    }
    let repeats = [1, rows, 3 * rows]
        .into_iter()
        .find(|count| *count == given.len())
        .map(|count| 3 * rows / count);
    let Some(repeats) = repeats else {
        let message = format!(
            "{}; expected one for all, {rows}, or three for each of {rows} rows",
            counted(given.len(), "number")
        );
        return Err(Error::data("sigma", message));
    };
    let each = given
        .iter()
        .flat_map(|value| std::iter::repeat_n(as_read(*value), repeats));
    Ok(each.collect())
}

/// mm as they stand in the table after a file was read.
fn as_read(mm: f64) -> f64 {
    Unit::Millimetre.from_si(Unit::Millimetre.to_si(mm))
}

fn same(name: &str, found: usize, expected: usize) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    let message = format!("{}; expected {expected}", counted(found, "value"));
    Err(Error::data(name, message))
}

fn unknown(name: &str, column_type: ColumnType) -> Error {
    let fields = schema::of(RecordingTable::KIND).map_or(&[][..], |schema| &schema.fields);
    let names: Vec<String> = fields
        .iter()
        .filter(|field| field.column_type == column_type)
        .map(short)
        .filter(|name| !OWN.contains(&name.as_str()) && name != SIGMA_SOURCE && name != "usage")
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Error::spec(name, format!("no such column{}", instead(name, &names)))
}

//! The recording: joints as commanded or logged, and where the tracker saw the tool. SI in Rust, mm and rad in the table.

use crate::error::Result;
use crate::robot::{Instrument, Measurements};
use crate::store::frame::{Cell, Frame, FrameBuilder};
use crate::table::Table;
use crate::units::Unit;
use nalgebra::Vector3;

/// Measured points in the order of recording; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
///
/// Where an optional quantity is missing in a single row its value here is NaN, in the table null.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    pub joints: usize,
    /// Which joints are prismatic: their `q` is in m, stored as `q3_mm`.
    pub prismatic: Vec<bool>,
    /// Strictly increasing.
    pub sequence: Vec<i64>,
    pub point_id: Vec<String>,
    /// What the recording itself says a row is for (`fit`, `validate`, ...).
    pub usage: Vec<Option<String>>,
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Measured point in the tracker's frame, m.
    pub position: Vec<[f64; 3]>,
    /// Its standard deviation per axis, m, where the recording has it.
    pub position_sigma: Option<Vec<[f64; 3]>>,
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
}

impl Recording {
    pub fn rows(&self) -> usize {
        self.sequence.len()
    }
    /// Joint positions of a row, rad or m.
    pub fn q(&self, row: usize) -> &[f64] {
        &self.q[row * self.joints..(row + 1) * self.joints]
    }
}

impl Recording {
    /// What the numerics need, with the instrument's noise; where the recording has standard deviations they are added to it.
    pub fn measurements(&self, instrument: &Instrument) -> Measurements {
        let position: Vec<Vector3<f64>> = self.position.iter().map(|point| Vector3::from(*point)).collect();
        let own = |row: usize, axis: usize| match &self.position_sigma {
            Some(all) if all[row][axis].is_finite() => all[row][axis],
            _ => 0.0,
        };
        let sigma = position
            .iter()
            .enumerate()
            .map(|(row, point)| Vector3::from_fn(|axis, _| instrument.sigma(point).hypot(own(row, axis))))
            .collect();
        let payload = match &self.payload {
            Some(all) => all.iter().map(|mass| if mass.is_finite() { *mass } else { 0.0 }).collect(),
            None => vec![0.0; self.rows()],
        };
        Measurements {
            joints: self.joints,
            q: self.q.clone(),
            position,
            sigma,
            payload,
            current: self.current.clone(),
            time: self.time.clone(),
            temperature: self.temperature.clone(),
            direction: self.direction.clone(),
            spread: None,
        }
    }
}

impl Table for Recording {
    const KIND: &'static str = "recording";

    fn to_frame(&self) -> Result<Frame> {
        let mut frame = FrameBuilder::new(Self::KIND);
        let per_joint = |values: &[f64], joint: usize, unit: Unit| -> Vec<f64> {
            values.iter().skip(joint).step_by(self.joints.max(1)).map(|&value| unit.from_si(value)).collect()
        };
        frame.push("sequence", Cell::to_array(self.sequence.clone()));
        frame.push("point_id", Cell::to_array(self.point_id.clone()));
        frame.push("usage", Cell::to_array(self.usage.clone()));
        for joint in 0..self.joints {
            let (ending, unit) = joint_unit(self.prismatic.get(joint).copied().unwrap_or(false));
            frame.push(format!("q{}_{ending}", joint + 1), Cell::to_array(per_joint(&self.q, joint, unit)));
        }
        for (axis, name) in AXES.iter().enumerate() {
            let of = |points: &[[f64; 3]]| points.iter().map(|point| Unit::Millimetre.from_si(point[axis])).collect::<Vec<f64>>();
            frame.push(format!("{name}_mm"), Cell::to_array(of(&self.position)));
            if let Some(sigma) = &self.position_sigma {
                frame.push(format!("sigma_{name}_mm"), Cell::to_array(present(of(sigma))));
            }
        }
        for (name, values) in [("time_s", &self.time), ("payload_kg", &self.payload), ("temp_c", &self.temperature)] {
            if let Some(values) = values {
                frame.push(name, Cell::to_array(present(values.clone())));
            }
        }
        for joint in 0..self.joints {
            for (prefix, ending, values) in [("i", "_a", &self.current), ("dir", "", &self.direction)] {
                if let Some(values) = values {
                    let column = present(per_joint(values, joint, Unit::One));
                    frame.push(format!("{prefix}{}{ending}", joint + 1), Cell::to_array(column));
                }
            }
        }
        frame.finish()
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let has = |name: &str| frame.column(name).is_some();
        let prismatic: Vec<bool> = (1..)
            .map(|joint| (has(&format!("q{joint}_rad")), has(&format!("q{joint}_mm"))))
            .take_while(|(turns, slides)| *turns || *slides)
            .map(|(_, slides)| slides)
            .collect();
        let joints = prismatic.len();
        let optional = |name: &str| has(name).then(|| absent(frame, name)).transpose();
        let optional_joints = |prefix: &str, ending: &str| {
            let columns = (1..=joints).map(|joint| absent(frame, &format!("{prefix}{joint}{ending}")));
            has(&format!("{prefix}1{ending}"))
                .then(|| columns.collect::<Result<Vec<_>>>().map(|columns| interleave(&columns)))
                .transpose()
        };
        let points = |prefix: &str| -> Result<Vec<[f64; 3]>> {
            let columns = AXES.iter().map(|axis| absent(frame, &format!("{prefix}{axis}_mm"))).collect::<Result<Vec<_>>>()?;
            let si = |row: usize, axis: usize| Unit::Millimetre.to_si(columns[axis][row]);
            Ok((0..frame.rows()).map(|row| [si(row, 0), si(row, 1), si(row, 2)]).collect())
        };
        let q = prismatic.iter().enumerate().map(|(joint, &slides)| {
            let (ending, unit) = joint_unit(slides);
            let column = frame.read::<f64>(&format!("q{}_{ending}", joint + 1))?;
            Ok(column.into_iter().map(|value| unit.to_si(value)).collect())
        });
        Ok(Self {
            joints,
            q: interleave(&q.collect::<Result<Vec<_>>>()?),
            prismatic,
            sequence: frame.read("sequence")?,
            point_id: frame.read("point_id")?,
            usage: frame.read("usage")?,
            position: points("")?,
            position_sigma: has("sigma_x_mm").then(|| points("sigma_")).transpose()?,
            time: optional("time_s")?,
            payload: optional("payload_kg")?,
            temperature: optional("temp_c")?,
            current: optional_joints("i", "_a")?,
            direction: optional_joints("dir", "")?,
        })
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

fn joint_unit(prismatic: bool) -> (&'static str, Unit) {
    if prismatic { ("mm", Unit::Millimetre) } else { ("rad", Unit::Radian) }
}

/// NaN -> null.
fn present(values: Vec<f64>) -> Vec<Option<f64>> {
    values.into_iter().map(|value| (!value.is_nan()).then_some(value)).collect()
}

/// Null -> NaN.
fn absent(frame: &Frame, name: &str) -> Result<Vec<f64>> {
    Ok(frame.read::<Option<f64>>(name)?.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}

/// Columns of equal length -> row-major.
fn interleave(columns: &[Vec<f64>]) -> Vec<f64> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).flat_map(|row| columns.iter().map(move |column| column[row])).collect()
}

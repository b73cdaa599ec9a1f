//! The recording: joints as commanded or logged, and what was measured of the tool. SI in Rust, mm and rad in the table.

use crate::error::Result;
use crate::robot::{Distances, Instrument, Measurements, Named, Turns};
use crate::spatial::Pose;
use crate::store::frame::{Cell, Frame, FrameBuilder};
use crate::table::Table;
use crate::units::Unit;
use nalgebra::{Matrix3, Vector3};

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
    /// Measured point in the tracker's frame, m; NaN along an axis that was not measured.
    pub position: Vec<[f64; 3]>,
    /// Its standard deviation per axis, m, where the recording has it.
    pub position_sigma: Option<Vec<[f64; 3]>>,
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
    /// Orientation of the target in the tracker's frame, as a rotation vector, rad; NaN where it was not measured.
    pub rotation: Option<Vec<[f64; 3]>>,
    /// Its standard deviation about each axis, rad; there wherever the orientation is.
    pub rotation_sigma: Option<Vec<f64>>,
    /// Distance of the target from an anchor, m; NaN where it was not measured.
    pub distance: Option<Vec<f64>>,
    /// Its standard deviation, m; there wherever the distance is.
    pub distance_sigma: Option<Vec<f64>>,
    /// The anchor, where there are several.
    pub anchor: Option<Vec<Option<String>>>,
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
        let measured = |value: &f64| if value.is_finite() { *value } else { 0.0 };
        let position: Vec<Vector3<f64>> =
            self.position.iter().map(|point| Vector3::from_iterator(point.iter().map(measured))).collect();
        let own = |row: usize, axis: usize| match &self.position_sigma {
            Some(all) if all[row][axis].is_finite() => all[row][axis],
            _ => 0.0,
        };
        let sigma = position
            .iter()
            .enumerate()
            .map(|(row, point)| {
                let sigma = |axis: usize| instrument.sigma(point).hypot(own(row, axis));
                let there = |axis: usize| self.position[row][axis].is_finite();
                Vector3::from_fn(|axis, _| if there(axis) { sigma(axis) } else { f64::INFINITY })
            })
            .collect();
        let payload = match &self.payload {
            Some(all) => all.iter().map(measured).collect(),
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
            velocity: self.velocity.clone(),
            spread: None,
            target: self.target.as_ref().map(|names| named(names)),
            turn: self
                .rotation
                .as_ref()
                .zip(self.rotation_sigma.as_ref())
                .map(|(all, sigma)| Turns { rotation: all.iter().map(rotation).collect(), sigma: sigma.clone() }),
            distance: self.distance.as_ref().zip(self.distance_sigma.as_ref()).map(|(length, sigma)| Distances {
                anchor: self.anchor.as_ref().map(|names| named(names)).unwrap_or_default(),
                length: length.clone(),
                sigma: sigma.clone(),
            }),
        }
    }

    /// Whether all three axes of a row's point were measured.
    pub fn is_whole(&self, row: usize) -> bool {
        self.position.get(row).is_some_and(|point| point.iter().all(|axis| axis.is_finite()))
    }
}

fn named(names: &[Option<String>]) -> Named {
    Named::of(names.iter().map(|name| name.as_deref().unwrap_or_default()))
}

fn rotation(vector: &[f64; 3]) -> Option<Matrix3<f64>> {
    let there = vector.iter().all(|value| value.is_finite());
    there.then(|| Pose::from_rotation_vector(Vector3::from(*vector), Vector3::zeros()).rotation)
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
            frame.push(format!("{name}_mm"), Cell::to_array(present(of(&self.position))));
            if let Some(sigma) = &self.position_sigma {
                frame.push(format!("sigma_{name}_mm"), Cell::to_array(present(of(sigma))));
            }
        }
        if let Some(all) = &self.simulated {
            for (axis, name) in AXES.iter().enumerate() {
                let column = all.iter().map(|point| Unit::Millimetre.from_si(point[axis])).collect();
                frame.push(format!("sim_{name}_mm"), Cell::to_array(present(column)));
            }
        }
        for (name, values) in [("time_s", &self.time), ("payload_kg", &self.payload), ("temp_c", &self.temperature)] {
            if let Some(values) = values {
                frame.push(name, Cell::to_array(present(values.clone())));
            }
        }
        for (name, names) in [("target", &self.target), ("anchor", &self.anchor)] {
            if let Some(names) = names {
                frame.push(name, Cell::to_array(names.clone()));
            }
        }
        if let Some(all) = &self.rotation {
            for (axis, name) in AXES.iter().enumerate() {
                frame.push(format!("r{name}_rad"), Cell::to_array(present(all.iter().map(|vector| vector[axis]).collect())));
            }
        }
        for (name, values, unit) in [
            ("sigma_r_rad", &self.rotation_sigma, Unit::Radian),
            ("distance_mm", &self.distance, Unit::Millimetre),
            ("sigma_distance_mm", &self.distance_sigma, Unit::Millimetre),
        ] {
            if let Some(values) = values {
                frame.push(name, Cell::to_array(present(values.iter().map(|value| unit.from_si(*value)).collect())));
            }
        }
        for joint in 0..self.joints {
            for (prefix, ending, values) in [("i", "_a", &self.current), ("dir", "", &self.direction)] {
                if let Some(values) = values {
                    let column = present(per_joint(values, joint, Unit::One));
                    frame.push(format!("{prefix}{}{ending}", joint + 1), Cell::to_array(column));
                }
            }
            if let Some(velocity) = &self.velocity {
                let (ending, unit) = rate_unit(self.prismatic.get(joint).copied().unwrap_or(false));
                frame.push(format!("dq{}_{ending}", joint + 1), Cell::to_array(present(per_joint(velocity, joint, unit))));
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
        let names = |name: &str| has(name).then(|| frame.read::<Option<String>>(name)).transpose();
        let lengths = |name: &str| -> Result<Option<Vec<f64>>> {
            let metres = |column: Vec<f64>| column.into_iter().map(|value| Unit::Millimetre.to_si(value)).collect();
            Ok(optional(name)?.map(metres))
        };
        let rotations = || -> Result<Vec<[f64; 3]>> {
            let columns = AXES.iter().map(|axis| absent(frame, &format!("r{axis}_rad"))).collect::<Result<Vec<_>>>()?;
            Ok((0..frame.rows()).map(|row| [columns[0][row], columns[1][row], columns[2][row]]).collect())
        };
        let rates = prismatic.iter().enumerate().map(|(joint, &slides)| {
            let (ending, unit) = rate_unit(slides);
            let column = absent(frame, &format!("dq{}_{ending}", joint + 1))?;
            Ok(column.into_iter().map(|value| unit.to_si(value)).collect())
        });
        let moving = has("dq1_rad_s") || has("dq1_mm_s");
        let velocity = moving.then(|| rates.collect::<Result<Vec<_>>>().map(|columns| interleave(&columns))).transpose()?;
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
            simulated: has("sim_x_mm").then(|| points("sim_")).transpose()?,
            time: optional("time_s")?,
            payload: optional("payload_kg")?,
            temperature: optional("temp_c")?,
            current: optional_joints("i", "_a")?,
            direction: optional_joints("dir", "")?,
            velocity,
            target: names("target")?,
            rotation: has("rx_rad").then(rotations).transpose()?,
            rotation_sigma: optional("sigma_r_rad")?,
            distance: lengths("distance_mm")?,
            distance_sigma: lengths("sigma_distance_mm")?,
            anchor: names("anchor")?,
        })
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

fn joint_unit(prismatic: bool) -> (&'static str, Unit) {
    if prismatic { ("mm", Unit::Millimetre) } else { ("rad", Unit::Radian) }
}

fn rate_unit(prismatic: bool) -> (&'static str, Unit) {
    if prismatic { ("mm_s", Unit::MillimetrePerSecond) } else { ("rad_s", Unit::RadianPerSecond) }
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

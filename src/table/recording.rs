//! The recording: joints as commanded or logged, and where the tracker saw the tool. SI in Rust, mm and rad in the table.

use crate::error::Result;
use crate::store::frame::Frame;
use crate::table::Table;

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

impl Table for Recording {
    const KIND: &'static str = "recording";
    fn to_frame(&self) -> Result<Frame> {
        unimplemented!(
            "columns sequence, point_id, usage, q{{j}}_rad|q{{j}}_mm, x_mm.., sigma_x_mm.., time_s, payload_kg, temp_c, i{{j}}_a, dir{{j}}"
        )
    }
    fn from_frame(_frame: &Frame) -> Result<Self> {
        unimplemented!()
    }
}

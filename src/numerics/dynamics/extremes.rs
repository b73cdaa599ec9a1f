//! The least and the largest torque of each joint and how many rows have them, gathered over rows that may be read in blocks: what a dead or
//! saturated channel shows.

use crate::error::Fault;

/// Share of rows at one extreme value: a torque that is cut off.
const SATURATED: f64 = 0.02;
/// Rows at least of those.
const SATURATED_ROWS: usize = 40;

/// An extreme value and how many rows have it.
type Extreme = (f64, usize);

/// Extremes of n joints.
pub(super) struct TorqueExtremes {
    rows: usize,
    /// Per joint: least, largest.
    joints: Vec<[Extreme; 2]>,
}

impl TorqueExtremes {
    /// The extremes of no rows of n joints.
    pub fn new(joints: usize) -> Self {
        Self {
            rows: 0,
            joints: vec![[(f64::INFINITY, 0), (f64::NEG_INFINITY, 0)]; joints],
        }
    }

    /// Takes rows x n torques, Nm.
    pub fn push(&mut self, torque: &[f64]) {
        for row in torque.chunks_exact(self.joints.len().max(1)) {
            self.rows += 1;
            for (value, [least, most]) in row.iter().zip(&mut self.joints) {
                meet(least, *value, *value < least.0);
                meet(most, *value, *value > most.0);
            }
        }
    }

    /// A column that holds one number.
    pub fn constant(&self, joint: usize) -> Option<Fault> {
        let [(least, _), (most, _)] = self.joints[joint];
        let message = || format!("torque is {least} in every row: the column holds no measurement");
        (least == most).then(|| Fault::new(name(joint), message()))
    }

    /// Extremes that many rows share.
    pub fn saturated(&self, joint: usize) -> impl Iterator<Item = Fault> {
        let all = self.rows;
        let shared = move |(_, rows): &Extreme| {
            *rows >= SATURATED_ROWS && *rows as f64 > SATURATED * all as f64
        };
        self.joints[joint].into_iter().filter(shared).map(move |(extreme, rows)| {
            let message =
                format!("{rows} of {all} torques are exactly {extreme:.4} Nm, the largest: the current is cut off there");
            Fault::new(name(joint), message)
        })
    }

    /// All of it, joint after joint.
    pub fn faults(&self) -> Vec<Fault> {
        let of = |joint: usize| match self.constant(joint) {
            Some(constant) => vec![constant],
            None => self.saturated(joint).collect(),
        };
        (0..self.joints.len()).flat_map(of).collect()
    }
}

fn meet(extreme: &mut Extreme, value: f64, beyond: bool) {
    if beyond {
        *extreme = (value, 1);
    } else if value == extreme.0 {
        extreme.1 += 1;
    }
}

fn name(joint: usize) -> String {
    format!("joint {}", joint + 1)
}

//! What a drawn effect is a function of: the row, the load, the place in space, or what the arm lived through.

use crate::matrix::{self, Vector};
use crate::memory::Moment;
use crate::statics::Row;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A variable of a recording; joints count from 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForeignVariable {
    /// Angle of a joint, rad.
    Angle(usize),
    /// Side of approach of a joint, +1 or -1.
    Approach(usize),
    /// Travel of a joint in the last move, rad.
    LastMove(usize),
    /// Torque on a joint, Nm; the instrument knows none.
    Load(usize),
    /// kg.
    Payload,
    /// s.
    Time,
    /// C.
    Temperature,
    /// Where the measured point is along a direction, m: from the base, of the instrument from the instrument.
    Space(Vector),
    /// Travel of a joint, of which each move's share fades with a time (s): rad.
    Relaxing(usize, f64),
    /// Travel of a joint that sticks and slips beyond a limit (rad): rad.
    Slipping(usize, f64),
}

/// What is seen of a row.
pub(super) struct Seen<'a> {
    pub(super) row: &'a Row,
    pub(super) memory: f64,
    pub(super) torque: &'a [f64],
    /// m.
    pub(super) point: Vector,
}

impl ForeignVariable {
    /// Its value; 0 for a joint that there is not.
    pub(super) fn value(&self, seen: &Seen) -> f64 {
        let of = |all: &[f64], joint: usize| all.get(joint.wrapping_sub(1)).copied().unwrap_or(0.0);
        match self {
            Self::Angle(joint) => of(&seen.row.command, *joint),
            Self::Approach(joint) => of(&seen.row.direction, *joint),
            Self::Load(joint) => of(seen.torque, *joint),
            Self::Payload => seen.row.payload_kg,
            Self::Time => seen.row.time_s,
            Self::Temperature => seen.row.temperature_c,
            Self::Space(direction) => matrix::dot(*direction, seen.point),
            Self::LastMove(_) | Self::Relaxing(..) | Self::Slipping(..) => seen.memory,
        }
    }

    /// Its value row by row where it depends on the rows before; else nothing.
    pub(super) fn remember(&self, past: &[Moment]) -> Vec<f64> {
        match *self {
            Self::LastMove(joint) => past
                .iter()
                .map(|moment| moment.travels(joint).last().unwrap_or(0.0))
                .collect(),
            Self::Relaxing(joint, time_s) => {
                let (mut then, mut left) = (0.0, 0.0);
                let live = |moment: &Moment| {
                    left = left * (-(moment.time_s - then) / time_s).exp()
                        + moment.travels(joint).sum::<f64>();
                    then = moment.time_s;
                    left
                };
                past.iter().map(live).collect()
            }
            Self::Slipping(joint, limit) => {
                let mut stretch: f64 = 0.0;
                let live = |moment: &Moment| {
                    moment
                        .travels(joint)
                        .for_each(|way| stretch = (stretch + way).max(-limit).min(limit));
                    stretch
                };
                past.iter().map(live).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether it depends on the rows before.
    pub fn is_remembered(&self) -> bool {
        matches!(
            self,
            Self::LastMove(_) | Self::Relaxing(..) | Self::Slipping(..)
        )
    }
}

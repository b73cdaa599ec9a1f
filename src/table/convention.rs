//! How the controller counts its joints, as a table.

use super::{JointConventionRow, JointConventions};
use crate::error::{Error, Result};
use crate::robot::{CountedCoupling, JointConvention};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

/// A cell of the column `coupled`.
#[derive(Serialize, Deserialize)]
struct CoupledCell {
    by: usize,
    ratio: f64,
    /// In which order couplings are taken off.
    order: usize,
}

impl JointConventions {
    /// The rows of a convention; `prismatic` says which joints are.
    pub fn of(convention: &JointConvention, prismatic: &[bool]) -> Self {
        let cells = |joint: usize| {
            let mine = convention
                .coupled()
                .iter()
                .enumerate()
                .filter(|(_, one)| one.joint == joint);
            let cells: Vec<CoupledCell> = mine
                .map(|(at, one)| CoupledCell {
                    by: one.by + 1,
                    ratio: one.ratio,
                    order: at + 1,
                })
                .collect();
            (!cells.is_empty())
                .then(|| serde_json::to_string(&cells).expect("numbers and names serialise"))
        };
        let joints = convention
            .sign()
            .iter()
            .zip(convention.zero())
            .zip(prismatic)
            .enumerate();
        let row = |(joint, ((sign, zero), prismatic)): (usize, ((&f64, &f64), &bool))| {
            JointConventionRow {
                joint: joint as i64 + 1,
                sign: *sign,
                zero_rad: (!prismatic).then_some(*zero),
                zero_mm: prismatic.then(|| Unit::Millimetre.from_si(*zero)),
                coupled: cells(joint),
            }
        };
        Self(joints.map(row).collect())
    }

    /// The convention that the rows hold; fails where a zero is missing, a sign is none, or a joint is named that is not there.
    pub fn to_convention(&self) -> Result<JointConvention> {
        let fault = |row: &JointConventionRow, message: String| {
            Error::data(format!("table convention, joint {}", row.joint), message)
        };
        let (mut sign, mut zero, mut coupled) = (Vec::new(), Vec::new(), Vec::new());
        for (joint, row) in self.0.iter().enumerate() {
            if row.sign.abs() != 1.0 {
                return Err(fault(
                    row,
                    format!("sign is {}; allowed: 1 and -1", row.sign),
                ));
            }
            let value = row
                .zero_rad
                .or_else(|| row.zero_mm.map(|mm| Unit::Millimetre.to_si(mm)));
            sign.push(row.sign);
            zero.push(value.ok_or_else(|| fault(row, "has no zero".into()))?);
            let cells: Vec<CoupledCell> = match &row.coupled {
                Some(text) => serde_json::from_str(text)
                    .map_err(|error| fault(row, format!("coupled: {error}")))?,
                None => Vec::new(),
            };
            for cell in cells {
                let by = cell
                    .by
                    .checked_sub(1)
                    .filter(|by| *by < self.0.len() && *by != joint);
                let by = by.ok_or_else(|| {
                    fault(row, format!("coupled: there is no other joint {}", cell.by))
                })?;
                coupled.push((
                    cell.order,
                    CountedCoupling {
                        joint,
                        by,
                        ratio: cell.ratio,
                    },
                ));
            }
        }
        coupled.sort_by_key(|(order, _)| *order);
        Ok(JointConvention::new(
            sign,
            zero,
            coupled.into_iter().map(|(_, one)| one).collect(),
        ))
    }
}

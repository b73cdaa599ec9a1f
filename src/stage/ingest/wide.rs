//! Wide rows: the points of several targets side by side, as columns of their own.

use super::mapped::ColumnRef;
use crate::error::Fault;
use crate::units::{Quantity, Unit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a wide row holds of a recording.
pub(super) const HELD: [&str; 4] = ["x", "y", "z", "target"];

/// What is of one point alone.
pub(super) const SIMULATED: [&str; 3] = ["sim_x", "sim_y", "sim_z"];

/// Columns of the points of several targets; a row of the file becomes one of the recording for each target that was seen in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WideTargets {
    /// Unit of the file's numbers, e.g. `mm`.
    pub unit: String,
    /// The columns of x, y and z by the target's name, e.g. `{smr1: [X1, Y1, Z1], smr2: [X2, Y2, Z2]}`; blank cells, or a point at 0, 0, 0,
    /// are a target that was not seen.
    pub columns: BTreeMap<String, [ColumnRef; 3]>,
}

impl WideTargets {
    /// Faults of the settings of a file at `place`, whose other columns are these.
    pub(super) fn faults(&self, others: &[&str], has_header: bool, place: &str) -> Vec<Fault> {
        let mut faults = Vec::new();
        for name in others.iter().filter(|name| HELD.contains(name)) {
            faults.push(Fault::new(
                format!("{place}.columns.{name}"),
                "also in `targets`; map it in one of them",
            ));
        }
        for name in others.iter().filter(|name| SIMULATED.contains(name)) {
            let message =
                "one simulated point and several targets; put each target in a separate file";
            faults.push(Fault::new(format!("{place}.columns.{name}"), message));
        }
        let place = &format!("{place}.targets");
        if self.columns.len() < 2 {
            faults.push(Fault::new(
                format!("{place}.columns"),
                "expected two targets or more; one is mapped as x, y and z",
            ));
        }
        for (target, references) in &self.columns {
            let place = format!("{place}.columns.{target}");
            if target.trim().is_empty() {
                faults.push(Fault::new(&place, "a target without a name"));
            }
            for reference in references {
                match reference {
                    ColumnRef::Number(0) => faults.push(Fault::new(&place, "columns count from 1")),
                    ColumnRef::Name(name) if !has_header => {
                        faults.push(Fault::new(
                            &place,
                            format!("there is no header with `{name}` in it; give numbers from 1"),
                        ));
                    }
                    _ => {}
                }
            }
        }
        if Unit::parse(&self.unit).is_none_or(|unit| unit.quantity() != Quantity::Length) {
            let allowed = Unit::symbols(Quantity::Length).join(", ");
            faults.push(Fault::new(
                format!("{place}.unit"),
                format!("`{}` is no unit of length; allowed: {allowed}", self.unit),
            ));
        }
        faults
    }
}

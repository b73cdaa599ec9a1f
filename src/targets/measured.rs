//! Targets beside what was measured when the robot went there: the table of targets as it was before correction, with the measured point of
//! each row in x, y, z.

use super::Layout;
use super::columns::{ColumnRole, TargetColumns};
use super::fields::fields;
use super::row::TargetRow;
use super::text::{delimiter, parse};
use crate::compensate::CommandTarget;
use crate::error::{Error, Fault, Result};
use nalgebra::Vector3;

/// A target and the point that was measured, m, tracker's frame.
#[derive(Debug, Clone)]
pub struct MeasuredTarget {
    /// As it was before correction.
    pub target: CommandTarget,
    /// What was measured.
    pub point: Vector3<f64>,
}

/// Reads a whole table. Fails with the faults of its header, or of its rows with their lines.
pub fn measured(text: &str, layout: &Layout) -> Result<Vec<MeasuredTarget>> {
    let mut lines = (1..)
        .zip(text.trim_start_matches('\u{feff}').lines())
        .filter(|(_, line)| !line.trim().is_empty());
    let Some((number, header)) = lines.next() else {
        return Err(Error::data(
            layout.place,
            "is empty; expected a header line and targets with their measured points",
        ));
    };
    let delimiter = delimiter(header);
    let broken =
        |number: usize, message: String| Fault::new(format!("{}:{number}", layout.place), message);
    let names =
        fields(header, delimiter).map_err(|message| Error::Data(vec![broken(number, message)]))?;
    let names: Vec<String> = names
        .into_iter()
        .map(|field| field.1.into_owned())
        .collect();
    let columns = TargetColumns::read(layout.place, &names, layout.robot, layout.units)?;
    if columns.joints.is_empty() || !columns.point {
        let message = "has no columns of joints (the targets before correction), or no x_mm, y_mm, z_mm (the measured points)";
        return Err(Error::spec(layout.place, message));
    }
    let mut rows = Vec::new();
    let mut faults = Vec::new();
    for (number, line) in lines {
        match row(line, delimiter, &columns, layout) {
            Ok(read) => rows.push(read),
            Err(message) => faults.push(broken(number, message)),
        }
    }
    if faults.is_empty() {
        Ok(rows)
    } else {
        Err(Error::Data(faults))
    }
}

fn row(
    line: &str,
    delimiter: char,
    columns: &TargetColumns,
    layout: &Layout,
) -> Result<MeasuredTarget, String> {
    let cells = fields(line, delimiter)?;
    if cells.len() != columns.count {
        return Err(format!(
            "has {} fields, the header {}",
            cells.len(),
            columns.count
        ));
    }
    let (mut row, mut point) = (TargetRow::default(), Vector3::zeros());
    for (index, role) in &columns.roles {
        let text = &cells[*index].1;
        let value = parse(text, delimiter)
            .map_err(|()| format!("field {} is `{text}`, no number", index + 1))?;
        match (role, value) {
            (ColumnRole::Axis(axis, unit), Some(value)) => point[*axis] = unit.to_si(value),
            (role, Some(value)) => row.take(*role, value, layout.robot.joints.len()),
            (ColumnRole::Axis(..) | ColumnRole::Joint(..), None) => {
                return Err(format!("field {} is empty", index + 1));
            }
            _ => {}
        }
    }
    Ok(MeasuredTarget {
        target: row.target(columns, layout)?,
        point,
    })
}

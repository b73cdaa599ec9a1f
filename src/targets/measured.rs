//! Targets beside what was measured when the robot went there: the table of targets as it was before correction, with the measured point of
//! each row in x, y, z.
//!
//! Files that appear only when they are whole.

use super::Layout;
use super::columns::TargetColumns;
use super::text::{fields, row, table};
use crate::compensate::CommandTarget;
use crate::error::{Error, Fault, Result};
use nalgebra::Vector3;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A target and the point that was measured, m, tracker's frame.
#[derive(Debug, Clone)]
pub struct MeasuredTarget {
    /// As it was before correction.
    pub(crate) target: CommandTarget,
    /// What was measured.
    pub(crate) point: Vector3<f64>,
}

/// Reads a whole table. Fails with the faults of its header, or of its rows with their lines.
pub fn measured(text: &str, layout: &Layout) -> Result<Vec<MeasuredTarget>> {
    let expected = "a header line and targets with their measured points";
    let table = table(text, layout.place, expected)?;
    let names: Vec<String> = table
        .names
        .into_iter()
        .map(|field| field.1.into_owned())
        .collect();
    let columns = TargetColumns::read(layout.place, &names, layout.robot, layout.units)?;
    if columns.joints.is_empty() || !columns.point {
        let message = "has no columns of joints (the targets before correction), or no x_mm, y_mm, z_mm (the measured points)";
        return Err(Error::spec(layout.place, message));
    }
    let read = |line: &str| {
        let row = row(
            &fields(line, table.delimiter)?,
            table.delimiter,
            &columns,
            layout,
        )?;
        let point = row.point.into();
        row.target(&columns, layout)
            .map(|target| MeasuredTarget { target, point })
    };
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
    for (number, line) in table.rows {
        match read(line) {
            Ok(read) => rows.push(read),
            Err(message) => faults.push(Fault::new(format!("{}:{number}", layout.place), message)),
        }
    }
    if faults.is_empty() {
        Ok(rows)
    } else {
        Err(Error::Data(faults))
    }
}

/// The error of an output file that could not be written.
pub fn unwritten(out: &Path, error: &std::io::Error) -> Error {
    Error::store(
        out.display().to_string(),
        format!("cannot be written: {error}"),
    )
}

/// A file appears only when it is whole; a pipe or a device is written as it stands.
pub fn whole<T>(out: &Path, fill: impl FnOnce(File) -> Result<T>) -> Result<T> {
    if out
        .metadata()
        .is_ok_and(|found| !found.is_file() && !found.is_dir())
    {
        return fill(
            File::options()
                .write(true)
                .open(out)
                .map_err(|error| unwritten(out, &error))?,
        );
    }
    let mut name = out.to_path_buf().into_os_string();
    name.push(".part");
    let aside = PathBuf::from(name);
    let file = File::create(&aside).map_err(|error| unwritten(out, &error))?;
    let result = fill(file).and_then(|filled| {
        std::fs::rename(&aside, out)
            .map(|()| filled)
            .map_err(|error| unwritten(out, &error))
    });
    if result.is_err() {
        let _ = std::fs::remove_file(&aside);
    }
    result
}

//! Tables of targets, as delimited text or Parquet: joints are replaced, or written where there are none, and what is known of each
//! target is appended; everything else stays as it is. A target that is not reached gets no joints.
//!
//! Targets with what was measured when the robot went there: the table of targets as it was before correction, with the measured point of
//! each row in x, y, z.
//!
//! Files that appear only when they are whole.

use crate::compensate::CommandTarget;
use crate::description::RobotDescription;
use crate::error::{Error, Fault, Result};
use crate::targets::columns::TargetColumns;
pub use crate::targets::columns::Units;
use crate::targets::text::{fields, row, table};
pub use crate::targets::trajectory::Trajectory;
use nalgebra::Vector3;
use std::fs::File;
use std::path::{Path, PathBuf};

mod columns;
pub(crate) mod parquet;
pub(crate) mod text;
mod trajectory;

/// Rows that are told of one file.
const MOST: usize = 20;

/// What holds for a whole table.
pub struct Layout<'a> {
    /// For messages: the file's name, or `stdin`.
    pub(crate) place: &'a str,
    /// Whose joint names columns may carry.
    pub(crate) robot: &'a RobotDescription,
    /// Units of columns that name none.
    pub(crate) units: Units,
    /// Appends nothing: joints are replaced, all else stays.
    pub(crate) plain: bool,
    /// Poses are the targets though there are joints.
    pub(crate) cartesian: bool,
    /// The largest load that was measured (kg), where the model depends on it and none is stated for targets without a payload.
    pub(crate) load: Option<f64>,
    /// Takes a table that calib corrected already.
    pub(crate) force: bool,
}

/// Columns that calib appends, and that no other table of targets has together.
const APPENDED: [&str; 3] = ["uncorrected_mm", "residual_mm", "iterations"];

impl Layout<'_> {
    /// Why a table is refused by its columns: it was corrected already.
    fn refused(&self, names: &[String]) -> Result<()> {
        if !self.force
            && APPENDED
                .iter()
                .all(|own| names.iter().any(|name| name == own))
        {
            let message = "was compensated by calib already (columns uncorrected_mm, residual_mm, iterations): a second correction would move the robot twice as far. Take the table of before, or insist with --force";
            return Err(Error::data(self.place, message));
        }
        Ok(())
    }
}

/// The targets of a table that are not reached; their joints are empty.
#[derive(Debug, Default)]
pub(crate) struct Unreached {
    /// How many targets were read.
    pub(crate) count: u64,
    /// The first of them.
    pub(crate) faults: Vec<Fault>,
}

impl Unreached {
    fn push(&mut self, place: impl FnOnce() -> String, remark: &str) {
        self.count += 1;
        if self.faults.len() < MOST {
            self.faults.push(Fault::new(
                place(),
                format!("{remark}: no joints are written"),
            ));
        }
    }
}

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

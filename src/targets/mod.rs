//! Tables of targets, as delimited text or Parquet: joints are replaced, or written where there are none, and what is known of each
//! target is appended; everything else stays as it is. A target that is not reached gets no joints.

mod columns;
mod measured;
pub(crate) mod parquet;
pub(crate) mod text;
mod trajectory;

pub use columns::Units;
pub use measured::{MeasuredTarget, measured, unwritten, whole};
pub use trajectory::Trajectory;

use crate::description::RobotDescription;
use crate::error::{Error, Fault, Result};

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

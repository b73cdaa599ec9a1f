//! Tables of targets, as delimited text or Parquet: joints are replaced, or written where there are none, and what is known of each
//! target is appended; everything else stays as it is. A target that is not reached gets no joints.
//!
//! Targets with what was measured when the robot went there: the table of targets as it was before correction, with the measured point of
//! each row in x, y, z.
//!
//! Files that appear only when they are whole.

use crate::compensate::{CommandTarget, CorrectedCommand, Corrector};
use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Fault, Result};
pub use crate::targets::columns::Units;
use crate::targets::columns::{FarTurned, TargetColumns};
use crate::targets::text::{fields, row, table, texts};
pub use crate::targets::trajectory::Trajectory;
use crate::units::Unit;
use nalgebra::Vector3;
use std::fs::File;
use std::path::{Path, PathBuf};

mod columns;
pub mod parquet;
pub mod text;
mod trajectory;

/// Faults that are named of one file.
const LIMIT: usize = 20;
/// Rows held in memory at a time.
const BATCH: usize = 1 << 13;

/// What holds for a whole table.
pub struct Layout<'a> {
    /// For messages: the file's name, or `stdin`.
    pub place: &'a str,
    /// Whose joint names columns may carry.
    pub robot: &'a RobotDescription,
    /// Units of columns that name none.
    pub units: Units,
    /// Appends nothing: joints are replaced, all else stays.
    pub plain: bool,
    /// Poses are the targets though there are joints.
    pub cartesian: bool,
    /// The largest load that was measured (kg), where the model depends on it and none is stated for targets without a payload.
    pub load: Option<f64>,
    /// Takes a table that calib corrected already.
    pub force: bool,
}

/// A column that calib appends.
#[derive(Clone, Copy, PartialEq)]
enum Appended {
    /// From 0, where the table has no joints.
    Joint(usize, Unit),
    Uncorrected,
    Residual,
    Iterations,
    Sigma,
    U95,
    Remark,
}

impl Appended {
    fn name(self) -> String {
        match self {
            Self::Joint(joint, unit) => format!("q{}_{unit}", joint + 1),
            Self::Uncorrected => "uncorrected_mm".into(),
            Self::Residual => "residual_mm".into(),
            Self::Iterations => "iterations".into(),
            Self::Sigma => "sigma_mm".into(),
            Self::U95 => "u95_mm".into(),
            Self::Remark => "remark".into(),
        }
    }
    /// The number that it holds, of a joint that is reached.
    fn number(self, answer: &CorrectedCommand) -> Option<f64> {
        match self {
            Self::Joint(joint, unit) => Some(unit.from_si(answer.q.as_ref()?[joint])),
            Self::Uncorrected => Some(answer.uncorrected * 1e3),
            Self::Residual => Some(answer.residual * 1e3),
            Self::Iterations => Some(answer.iterations as f64),
            Self::Sigma => Some(answer.uncertainty?.sigma * 1e3),
            Self::U95 => Some(answer.uncertainty?.u95 * 1e3),
            Self::Remark => None,
        }
    }
}

/// Columns that no other table of targets has together.
const OURS: [Appended; 3] = [
    Appended::Uncorrected,
    Appended::Residual,
    Appended::Iterations,
];

impl Layout<'_> {
    /// The columns of a table with these names. Fails where it was corrected already.
    fn columns(&self, names: &[String]) -> Result<TargetColumns> {
        if !self.force && OURS.iter().all(|ours| names.contains(&ours.name())) {
            let message = "was compensated by calib already (columns uncorrected_mm, residual_mm, iterations): a second correction would move the robot twice as far. Take the table of before, or insist with --force";
            return Err(Error::data(self.place, message));
        }
        TargetColumns::read(self.place, names, self.robot, self.units)
    }

    /// What is appended to the columns of a table, joints that turn in this unit.
    fn appended(&self, columns: &TargetColumns, angle: Unit, sigma: bool) -> Vec<Appended> {
        let unit = |kind| match kind {
            JointKind::Revolute => angle,
            JointKind::Prismatic => Unit::Millimetre,
        };
        let joints = self.robot.joints.iter().enumerate();
        let joints = joints.filter(|_| columns.joints.is_empty());
        let joints = joints.map(|(j, joint)| Appended::Joint(j, unit(joint.kind)));
        let sigma = [Appended::Sigma, Appended::U95]
            .into_iter()
            .filter(move |_| sigma);
        let known = OURS.into_iter().chain(sigma).chain([Appended::Remark]);
        joints.chain(known.filter(|_| !self.plain)).collect()
    }
}

/// A table of targets that is read, corrected and written some rows at a time.
trait TargetTable {
    /// The targets of the next rows, with the numbers of their rows; none at the end.
    fn read(&mut self) -> Result<Option<Vec<(usize, CommandTarget)>>>;
    /// A row for messages.
    fn place(&self, number: usize) -> String;
    /// Writes the rows that were read last; false where nobody takes them any more, which is no fault.
    fn write(&mut self, answers: &[CorrectedCommand]) -> Result<bool>;
}

/// Corrects a table to its end.
fn corrected(
    table: &mut impl TargetTable,
    columns: &TargetColumns,
    layout: &Layout,
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let (mut unreached, mut turned) = (Unreached::default(), FarTurned::default());
    while let Some(targets) = table.read()? {
        for (number, target) in &targets {
            turned.count(|| table.place(*number), target, layout.robot);
        }
        if let Some(fault) = turned.fault(columns) {
            return Err(Error::Data(vec![fault]));
        }
        let (numbers, targets): (Vec<usize>, _) = targets.into_iter().unzip();
        let answers = corrector.batch(targets);
        for (number, answer) in numbers.iter().zip(&answers) {
            if answer.q.is_none() {
                unreached.push(|| table.place(*number), &answer.remark());
            }
        }
        if !table.write(&answers)? {
            break;
        }
    }
    Ok(unreached)
}

/// The targets of a table that are not reached; their joints are empty.
#[derive(Debug, Default)]
pub struct Unreached {
    /// How many.
    pub count: u64,
    /// The first of them with their lines.
    pub faults: Vec<Fault>,
}

impl Unreached {
    fn push(&mut self, place: impl FnOnce() -> String, remark: &str) {
        self.count += 1;
        if self.faults.len() < LIMIT {
            let message = format!("{remark}: no joints are written");
            self.faults.push(Fault::new(place(), message));
        }
    }
}

/// A target and the point that was measured, m, tracker's frame.
#[derive(Debug, Clone)]
pub struct MeasuredTarget {
    /// As the table states it.
    pub target: CommandTarget,
    /// The measured point.
    pub point: Vector3<f64>,
}

/// Reads a whole table. Fails with the faults of its header, or of its rows with their lines.
pub fn measured(text: &str, layout: &Layout) -> Result<Vec<MeasuredTarget>> {
    let expected = "a header line and targets with their measured points";
    let table = table(text, layout.place, expected)?;
    let columns = layout.columns(&texts(&table.names))?;
    if columns.joints.is_empty() || !columns.point {
        let message = "has no columns of joints (the targets before correction), or no x_mm, y_mm, z_mm (the measured points)";
        return Err(Error::spec(layout.place, message));
    }
    let read = |line: &str| {
        let cells = fields(line, table.delimiter)?;
        let row = row(&cells, table.delimiter, &columns, layout)?;
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
    Error::if_data(faults).map(|()| rows)
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
    let refused = |error: std::io::Error| unwritten(out, &error);
    let is_device = |found: std::fs::Metadata| !found.is_file() && !found.is_dir();
    if out.metadata().is_ok_and(is_device) {
        let device = File::options().write(true).open(out);
        return fill(device.map_err(refused)?);
    }
    let mut name = out.as_os_str().to_owned();
    name.push(".part");
    let aside = PathBuf::from(name);
    let file = File::create(&aside).map_err(refused)?;
    let result = fill(file).and_then(|filled| {
        let renamed = std::fs::rename(&aside, out).map_err(refused);
        renamed.map(|()| filled)
    });
    if result.is_err() {
        let _ = std::fs::remove_file(&aside);
    }
    result
}

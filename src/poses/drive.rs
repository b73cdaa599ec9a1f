//! Proposed poses as columns, CSV and Parquet: the joints as an engineer enters them at the controller, deg and mm, in its counting.

use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Result};
use crate::raw::ending;
use crate::robot::{JointConvention, Measurements, RobotModel};
use crate::units::Unit;
use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
use parquet::arrow::ArrowWriter;
use std::path::Path;
use std::sync::Arc;

/// Poses to drive to.
pub struct Drive {
    /// Whose joint names the file carries.
    pub robot: RobotDescription,
    /// rad or m.
    pub ranges: Vec<[f64; 2]>,
    /// In the order of driving.
    pub poses: Measurements,
    /// +1 or -1, row-major.
    pub direction: Vec<f64>,
    /// How the controller that drives them counts.
    pub convention: JointConvention,
}

/// In which counting joints stand, in the words of a JSON document.
pub(super) fn counting(convention: &JointConvention, robot: &RobotDescription) -> String {
    let difference = convention.difference(&RobotModel::new(robot.clone()));
    difference.map_or_else(
        || "robot file".into(),
        |difference| format!("controller: {difference}"),
    )
}

/// A column: its name, its values, and the decimals that people read (none: whole numbers).
struct DriveColumn {
    name: String,
    values: Vec<f64>,
    decimals: usize,
}

/// Decimals of joint positions: 1e-4 deg is 0.004 mm at 2.5 m.
const JOINT_DECIMALS: usize = 4;

fn columns(drive: &Drive) -> Vec<DriveColumn> {
    let Drive {
        robot,
        poses,
        direction,
        convention,
        ..
    } = drive;
    let n = poses.joints;
    let rows = 0..poses.rows();
    let column = |name: String, decimals, value: &dyn Fn(usize) -> f64| DriveColumn {
        name,
        values: rows.clone().map(value).collect(),
        decimals,
    };
    let shown: Vec<Vec<f64>> = rows.clone().map(|row| shown(drive, poses.q(row))).collect();
    let mut out = vec![column("sequence".into(), 0, &|row| (row + 1) as f64)];
    for (j, joint) in robot.joints.iter().enumerate() {
        let name = format!("q{}_{}", j + 1, joint_unit(joint.kind));
        out.push(column(name, JOINT_DECIMALS, &|row| shown[row][j]));
    }
    out.push(column("payload_kg".into(), 3, &|row| poses.payload[row]));
    for j in 0..n {
        out.push(column(format!("dir{}", j + 1), 0, &|row| {
            direction[row * n + j] * convention.sign()[j]
        }));
    }
    for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
        let position = &poses.points.position;
        let millimetres = |row: usize| Unit::Millimetre.from_si(position[row][axis]);
        out.push(column(name.into(), 3, &millimetres));
    }
    out
}

/// In which joints are entered.
pub(super) fn joint_unit(kind: JointKind) -> Unit {
    match kind {
        JointKind::Revolute => Unit::Degree,
        JointKind::Prismatic => Unit::Millimetre,
    }
}

/// Joints in the controller's numbers, deg or mm, rounded so that what is written keeps within the limits of every joint.
fn shown(drive: &Drive, q: &[f64]) -> Vec<f64> {
    let Drive {
        robot,
        ranges,
        convention,
        ..
    } = drive;
    let scale = 10f64.powi(JOINT_DECIMALS as i32);
    let unit = |j: usize| joint_unit(robot.joints[j].kind);
    let exact = |change: &dyn Fn(&mut [f64]), values: &[f64]| {
        let mut values = values.to_vec();
        change(&mut values);
        values
    };
    // In steps of the last decimal.
    let counted = exact(&|q| convention.to_controller(q), q);
    let mut steps: Vec<f64> = Vec::new();
    for (j, [low, high]) in ranges.iter().enumerate() {
        // Towards the middle of the joint's range.
        let down = (q[j] > 0.5 * (low + high)) == (convention.sign()[j] > 0.0);
        let value = unit(j).from_si(counted[j]) * scale;
        steps.push(if down { value.floor() } else { value.ceil() });
    }
    // A joint whose number holds a part of another one's may still be moved out by the rounding of that one.
    for _ in ranges {
        let numbers: Vec<f64> = steps
            .iter()
            .enumerate()
            .map(|(j, steps)| unit(j).to_si(steps / scale))
            .collect();
        let driven = exact(&|q| convention.to_robot(q), &numbers);
        for (j, [low, high]) in ranges.iter().enumerate() {
            let out = (driven[j] - high).max(0.0) - (low - driven[j]).max(0.0);
            let back =
                (unit(j).from_si(out.abs()) * scale).ceil() * out.signum() * convention.sign()[j];
            steps[j] -= if out == 0.0 { 0.0 } else { back };
        }
    }
    steps.iter().map(|steps| steps / scale).collect()
}

/// What is wrong with the ending, if anything.
pub fn fault(path: &Path) -> Option<String> {
    let known = ["csv", "parquet"].contains(&ending(path).as_str());
    (!known).then(|| format!("`{}` ends in neither .csv nor .parquet", path.display()))
}

/// Writes the poses to a .csv or .parquet file. Fails where the file cannot be written.
pub fn write(path: &Path, drive: &Drive) -> Result<()> {
    let bytes = if ending(path) == "parquet" {
        parquet(drive)?
    } else {
        csv(drive).into_bytes()
    };
    std::fs::write(path, bytes).map_err(|error| {
        let message = format!("cannot be written: {error}");
        Error::store(path.display().to_string(), message)
    })
}

/// The poses as JSON, an object each.
pub(super) fn objects(drive: &Drive) -> Vec<serde_json::Value> {
    let columns = columns(drive);
    let object = |row: usize| {
        columns
            .iter()
            .map(|column| (column.name.clone(), serde_json::json!(column.values[row])))
            .collect()
    };
    (0..drive.poses.rows())
        .map(|row| serde_json::Value::Object(object(row)))
        .collect()
}

fn csv(drive: &Drive) -> String {
    let columns = columns(drive);
    let line = |cell: &dyn Fn(&DriveColumn) -> String| {
        columns.iter().map(cell).collect::<Vec<_>>().join(",") + "\n"
    };
    let row = |row: usize| line(&|column| format!("{:.*}", column.decimals, column.values[row]));
    let rows: String = (0..drive.poses.rows()).map(row).collect();
    line(&|column| column.name.clone()) + &rows
}

fn parquet(drive: &Drive) -> Result<Vec<u8>> {
    let bug = |error: &dyn std::fmt::Display| Error::Bug(error.to_string());
    let arrays = columns(drive).into_iter().map(|column| {
        let whole = column.values.iter().map(|value| *value as i64);
        let array: ArrayRef = match column.name.as_str() {
            "sequence" => Arc::new(whole.collect::<Int64Array>()),
            _ => Arc::new(Float64Array::from(column.values)),
        };
        (column.name, array)
    });
    let batch = RecordBatch::try_from_iter(arrays).map_err(|error| bug(&error))?;
    let written = ArrowWriter::try_new(Vec::new(), batch.schema(), None).and_then(|mut writer| {
        writer.write(&batch)?;
        writer.into_inner()
    });
    written.map_err(|error| bug(&error))
}

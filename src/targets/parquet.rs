//! Targets in Parquet: batch by batch, columns of joints replaced, all others passed on, what is known of each target appended.

use super::columns::{FarTurned, TargetColumns, TargetRow};
use super::{Layout, Unreached};
use crate::compensate::{CommandTarget, CorrectedCommand, Corrector};
use crate::description::JointKind;
use crate::error::{Error, Result};
use crate::raw;
use crate::units::Unit;
use arrow::array::{Array, ArrayRef, AsArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type, Schema};
use parquet::arrow::ArrowWriter;
use std::fs::File;
use std::io::Write;
use std::sync::Arc;

/// Rows held in memory at a time.
const BATCH: usize = 1 << 13;

/// Reads targets from a Parquet file and writes them corrected as another.
pub(crate) fn stream(
    input: File,
    output: impl Write + Send,
    layout: &Layout,
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let fault = |message: String| {
        Error::data(
            layout.place,
            format!("not a readable Parquet file: {message}"),
        )
    };
    let reader = raw::parquet(input, BATCH).map_err(fault)?;
    let schema = reader.schema.clone();
    let names: Vec<String> = schema
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    layout.refused(&names)?;
    let columns = TargetColumns::read(layout.place, &names, layout.robot, layout.units)?;
    let out_schema = Arc::new(described(
        &schema,
        &columns,
        layout,
        corrector.has_uncertainty(),
    ));
    let mut writer = ArrowWriter::try_new(output, out_schema.clone(), None)
        .map_err(|error| Error::Bug(error.to_string()))?;
    let (mut unreached, mut turned) = (Unreached::default(), FarTurned::default());
    let mut rows = 0;
    for batch in reader {
        let batch = batch.map_err(fault)?;
        let targets = targets(&batch, &columns, layout, rows)?;
        for (k, target) in targets.iter().enumerate() {
            turned.count(
                || format!("{}: row {}", layout.place, rows + k + 1),
                target,
                layout.robot,
            );
        }
        if let Some(fault) = turned.fault(&columns) {
            return Err(Error::Data(vec![fault]));
        }
        let answers = corrector.batch(targets);
        for (k, answer) in answers
            .iter()
            .enumerate()
            .filter(|(_, answer)| answer.q.is_none())
        {
            unreached.push(
                || format!("{}: row {}", layout.place, rows + k + 1),
                &answer.remark(),
            );
        }
        let columns = answered(&batch, &columns, layout, &answers);
        let batch = RecordBatch::try_new(out_schema.clone(), columns)
            .map_err(|error| Error::Bug(error.to_string()))?;
        writer
            .write(&batch)
            .map_err(|error| Error::store("output", error.to_string()))?;
        rows += batch.num_rows();
    }
    writer
        .close()
        .map(|_| unreached)
        .map_err(|error| Error::store("output", error.to_string()))
}

fn described(schema: &Schema, columns: &TargetColumns, layout: &Layout, sigma: bool) -> Schema {
    let joint = |index: usize| columns.joints.iter().any(|(column, _)| *column == index);
    let mut fields: Vec<Arc<Field>> = Vec::new();
    for (index, field) in schema.fields().iter().enumerate() {
        fields.push(if joint(index) {
            // Null where a target is not reached.
            Arc::new(
                Field::new(field.name(), DataType::Float64, true)
                    .with_metadata(field.metadata().clone()),
            )
        } else {
            field.clone()
        });
    }
    if columns.joints.is_empty() {
        for (j, joint) in layout.robot.joints.iter().enumerate() {
            fields.push(Arc::new(Field::new(
                format!("q{}_{}", j + 1, stored(joint.kind).symbol()),
                DataType::Float64,
                true,
            )));
        }
    }
    let mut append =
        |name: &str, kind: DataType| fields.push(Arc::new(Field::new(name, kind, false)));
    if !layout.plain {
        append("uncorrected_mm", DataType::Float64);
        append("residual_mm", DataType::Float64);
        append("iterations", DataType::Int64);
        if sigma {
            append("sigma_mm", DataType::Float64);
            append("u95_mm", DataType::Float64);
        }
        append("remark", DataType::Utf8);
    }
    Schema::new_with_metadata(fields, schema.metadata().clone())
}

fn stored(kind: JointKind) -> Unit {
    if kind == JointKind::Revolute {
        Unit::Radian
    } else {
        Unit::Millimetre
    }
}

fn targets(
    batch: &RecordBatch,
    columns: &TargetColumns,
    layout: &Layout,
    before: usize,
) -> Result<Vec<CommandTarget>> {
    let mut numbers = Vec::new();
    for (index, role) in &columns.roles {
        let column = batch.column(*index);
        let name = batch.schema().field(*index).name().clone();
        let cast = cast(column, &DataType::Float64).map_err(|_| {
            Error::data(
                layout.place,
                format!(
                    "column `{name}` holds {}, expected numbers",
                    column.data_type()
                ),
            )
        })?;
        numbers.push((*role, name, cast));
    }
    (0..batch.num_rows())
        .map(|row| {
            let mut taken = TargetRow::default();
            for (role, name, column) in &numbers {
                let values = column.as_primitive::<Float64Type>();
                if !values.is_null(row) && values.value(row).is_finite() {
                    if let Some(message) = role.fault(values.value(row)) {
                        let place = format!("row {}: column `{name}`", before + row + 1);
                        return Err(Error::data(layout.place, format!("{place}: {message}")));
                    }
                    taken.take(*role, values.value(row), layout.robot.joints.len());
                } else if role.is_needed() {
                    return Err(Error::data(
                        layout.place,
                        format!("row {}: column `{name}` is empty", before + row + 1),
                    ));
                }
            }
            let faulty = |message: String| {
                Error::data(layout.place, format!("row {}: {message}", before + row + 1))
            };
            taken.target(columns, layout).map_err(faulty)
        })
        .collect()
}

fn answered(
    batch: &RecordBatch,
    columns: &TargetColumns,
    layout: &Layout,
    answers: &[CorrectedCommand],
) -> Vec<ArrayRef> {
    let numbers = |of: &dyn Fn(&CorrectedCommand) -> f64| -> ArrayRef {
        Arc::new(answers.iter().map(of).collect::<Float64Array>())
    };
    let joint_numbers = |joint: usize, unit: Unit| -> ArrayRef {
        Arc::new(
            answers
                .iter()
                .map(|answer| Some(unit.from_si(answer.q.as_ref()?[joint])))
                .collect::<Float64Array>(),
        )
    };
    let mut out: Vec<ArrayRef> = Vec::new();
    for (index, column) in batch.columns().iter().enumerate() {
        let joint = columns
            .joints
            .iter()
            .position(|(column, _)| *column == index);
        out.push(match joint {
            Some(joint) => joint_numbers(joint, columns.joints[joint].1),
            None => column.clone(),
        });
    }
    if columns.joints.is_empty() {
        for (j, joint) in layout.robot.joints.iter().enumerate() {
            out.push(joint_numbers(j, stored(joint.kind)));
        }
    }
    if !layout.plain {
        out.push(numbers(&|answer| answer.uncorrected * 1e3));
        out.push(numbers(&|answer| answer.residual * 1e3));
        out.push(Arc::new(
            answers
                .iter()
                .map(|answer| answer.iterations as i64)
                .collect::<Int64Array>(),
        ));
        if answers.iter().any(|answer| answer.uncertainty.is_some()) {
            out.push(numbers(&|answer| {
                answer.uncertainty.map_or(0.0, |known| known.sigma) * 1e3
            }));
            out.push(numbers(&|answer| {
                answer.uncertainty.map_or(0.0, |known| known.u95) * 1e3
            }));
        }
        out.push(Arc::new(
            answers
                .iter()
                .map(|answer| Some(answer.remark()))
                .collect::<StringArray>(),
        ));
    }
    out
}

//! Targets in Parquet: batch by batch, columns of joints replaced, all others passed on, what is known of each target appended.

use super::columns::{TargetColumns, TargetRow};
use super::{Appended, BATCH, Layout, TargetTable, Unreached, corrected};
use crate::compensate::{CommandTarget, CorrectedCommand, Corrector};
use crate::error::{Error, Result};
use crate::raw::{self, BatchFile};
use crate::units::Unit;
use arrow::array::{Array, ArrayRef, AsArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use std::fs::File;
use std::io::Write;
use std::sync::Arc;

/// Reads targets from a Parquet file and writes them corrected as another.
pub fn stream(
    input: File,
    output: impl Write + Send,
    layout: &Layout,
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let reader = raw::parquet(input, BATCH).map_err(|message| unreadable(layout, &message))?;
    let names = reader
        .schema
        .fields()
        .iter()
        .map(|field| field.name().clone());
    let columns = layout.columns(&names.collect::<Vec<String>>())?;
    let appended = layout.appended(&columns, Unit::Radian, corrector.has_uncertainty());
    let schema = Arc::new(described(&reader.schema, &columns, &appended));
    let writer = ArrowWriter::try_new(output, schema.clone(), None)
        .map_err(|error| Error::Bug(error.to_string()))?;
    let mut table = ParquetTable {
        layout,
        columns: &columns,
        appended,
        reader,
        batch: None,
        rows: 0,
        schema,
        writer,
    };
    let unreached = corrected(&mut table, &columns, layout, corrector)?;
    let closed = table.writer.close();
    closed
        .map(|_| unreached)
        .map_err(|error| Error::store("output", error.to_string()))
}

fn unreadable(layout: &Layout, message: &str) -> Error {
    Error::data(
        layout.place,
        format!("not a readable Parquet file: {message}"),
    )
}

struct ParquetTable<'a, W: Write + Send> {
    layout: &'a Layout<'a>,
    columns: &'a TargetColumns,
    appended: Vec<Appended>,
    reader: BatchFile,
    /// The rows that were read last, and how many were read before them.
    batch: Option<RecordBatch>,
    rows: usize,
    schema: SchemaRef,
    writer: ArrowWriter<W>,
}

impl<W: Write + Send> TargetTable for ParquetTable<'_, W> {
    fn read(&mut self) -> Result<Option<Vec<(usize, CommandTarget)>>> {
        self.rows += self.batch.as_ref().map_or(0, RecordBatch::num_rows);
        let batch = self.reader.next().transpose();
        self.batch = batch.map_err(|message| unreadable(self.layout, &message))?;
        let targets = |batch| targets(batch, self.columns, self.layout, self.rows);
        let targets = self.batch.as_ref().map(targets).transpose()?;
        Ok(targets.map(|targets| (self.rows + 1..).zip(targets).collect()))
    }
    fn place(&self, number: usize) -> String {
        format!("{}: row {number}", self.layout.place)
    }
    fn write(&mut self, answers: &[CorrectedCommand]) -> Result<bool> {
        let numbers = |column: Appended| -> ArrayRef {
            let numbers = answers.iter().map(|answer| column.number(answer));
            Arc::new(numbers.collect::<Float64Array>())
        };
        let joints = &self.columns.joints;
        let kept = self.batch.iter().flat_map(RecordBatch::columns).enumerate();
        let kept = kept.map(|(index, column)| {
            let joint = joints.iter().position(|(column, _)| *column == index);
            joint.map_or_else(
                || column.clone(),
                |j| numbers(Appended::Joint(j, joints[j].1)),
            )
        });
        let appended = self.appended.iter().map(|column| -> ArrayRef {
            match column {
                Appended::Iterations => {
                    let counts = answers.iter().map(|answer| answer.iterations as i64);
                    Arc::new(counts.collect::<Int64Array>())
                }
                Appended::Remark => {
                    let remarks = answers.iter().map(|answer| Some(answer.remark()));
                    Arc::new(remarks.collect::<StringArray>())
                }
                column => numbers(*column),
            }
        });
        let batch = RecordBatch::try_new(self.schema.clone(), kept.chain(appended).collect())
            .map_err(|error| Error::Bug(error.to_string()))?;
        let written = self.writer.write(&batch);
        written
            .map(|()| true)
            .map_err(|error| Error::store("output", error.to_string()))
    }
}

fn described(schema: &Schema, columns: &TargetColumns, appended: &[Appended]) -> Schema {
    let joint = |index: usize| columns.joints.iter().any(|(column, _)| *column == index);
    let kept = schema
        .fields()
        .iter()
        .enumerate()
        .map(|(index, field)| match joint(index) {
            // Null where a target is not reached.
            true => {
                let field = Field::clone(field).with_data_type(DataType::Float64);
                Arc::new(field.with_nullable(true))
            }
            false => field.clone(),
        });
    let appended = appended.iter().map(|column| {
        let kind = match column {
            Appended::Iterations => DataType::Int64,
            Appended::Remark => DataType::Utf8,
            _ => DataType::Float64,
        };
        let is_joint = matches!(column, Appended::Joint(..));
        Arc::new(Field::new(column.name(), kind, is_joint))
    });
    Schema::new_with_metadata(
        kept.chain(appended).collect::<Vec<_>>(),
        schema.metadata().clone(),
    )
}

fn targets(
    batch: &RecordBatch,
    columns: &TargetColumns,
    layout: &Layout,
    before: usize,
) -> Result<Vec<CommandTarget>> {
    let faulty = |message: String| Error::data(layout.place, message);
    let (mut numbers, schema) = (Vec::new(), batch.schema());
    for (index, role, unit) in &columns.read {
        let (column, name) = (batch.column(*index), schema.field(*index).name());
        let kind = column.data_type();
        let cast = cast(column, &DataType::Float64)
            .map_err(|_| faulty(format!("column `{name}` holds {kind}, expected numbers")))?;
        numbers.push((
            *role,
            *unit,
            name,
            cast.as_primitive::<Float64Type>().clone(),
        ));
    }
    let target = |row: usize| {
        let mut taken = TargetRow::default();
        for (role, unit, name, values) in &numbers {
            if !values.is_null(row) && values.value(row).is_finite() {
                if let Some(message) = role.fault(values.value(row)) {
                    return Err(format!("column `{name}`: {message}"));
                }
                let number = unit.to_si(values.value(row));
                taken.take(*role, number, layout.robot.joints.len());
            } else if role.is_needed() {
                return Err(format!("column `{name}` is empty"));
            }
        }
        taken.target(columns, layout)
    };
    let placed = |row: usize| {
        target(row).map_err(|message| faulty(format!("row {}: {message}", before + row + 1)))
    };
    (0..batch.num_rows()).map(placed).collect()
}

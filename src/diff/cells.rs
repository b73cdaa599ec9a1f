//! The differences as a table: one row for every cell that is not the same, and for every row without a partner.

use arrow::array::{ArrayRef, Float64Builder, Int64Builder, RecordBatch, StringBuilder};
use arrow::datatypes::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::WriterProperties;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::columns::ColumnPair;
use super::key::{KeyCell, Keys, Pairing};
use super::measure::{CellDifference, CellValue};
use super::source::{CellKind, TableFile};
use crate::error::{Error, Result};

/// Rows that are gathered before they are written.
const GROUP_ROWS: usize = 1 << 16;

pub(super) struct CellWriter {
    path: PathBuf,
    schema: SchemaRef,
    writer: ArrowWriter<File>,
    keys: Vec<KeyBuilder>,
    texts: [StringBuilder; 5],
    numbers: [Float64Builder; 4],
    rows: usize,
}

enum KeyBuilder {
    Int(Int64Builder),
    Float(Float64Builder),
    Text(StringBuilder),
}

impl CellWriter {
    pub fn create(path: &Path, a: &TableFile, key: &[String]) -> Result<Self> {
        let refused = |e: &dyn std::fmt::Display| {
            Error::store(path.display().to_string(), format!("cannot write: {e}"))
        };
        let mut fields = Vec::new();
        let mut keys = Vec::new();
        for name in key {
            let kind = a.position(name).map(|at| a.columns[at].kind);
            let (data_type, builder) = match kind {
                Some(CellKind::Float) => {
                    (DataType::Float64, KeyBuilder::Float(Float64Builder::new()))
                }
                Some(CellKind::Int | CellKind::Flag) => {
                    (DataType::Int64, KeyBuilder::Int(Int64Builder::new()))
                }
                _ => (DataType::Utf8, KeyBuilder::Text(StringBuilder::new())),
            };
            fields.push(Field::new(name, data_type, true));
            keys.push(builder);
        }
        fields.extend(
            ["diff_class", "diff_column", "diff_unit"]
                .map(|name| Field::new(name, DataType::Utf8, true)),
        );
        fields.extend(
            ["diff_a", "diff_b", "diff_difference", "diff_sigmas"]
                .map(|name| Field::new(name, DataType::Float64, true)),
        );
        fields.extend(
            ["diff_a_text", "diff_b_text"].map(|name| Field::new(name, DataType::Utf8, true)),
        );
        let schema = Arc::new(Schema::new(fields));
        let level = ZstdLevel::try_new(3).map_err(|e| Error::Bug(e.to_string()))?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(level))
            .build();
        let file = File::create(path).map_err(|e| refused(&e))?;
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties))
            .map_err(|e| refused(&e))?;
        Ok(Self {
            path: path.into(),
            schema,
            writer,
            keys,
            texts: Default::default(),
            numbers: Default::default(),
            rows: 0,
        })
    }

    /// Rows without a partner, those of A first.
    pub fn unpaired(
        &mut self,
        keys: &Keys,
        pairing: &Pairing,
        only_b: &[Vec<KeyCell>],
    ) -> Result<()> {
        for (rows, class) in [
            (&pairing.only_a, "only_a"),
            (&pairing.twice_a, "duplicate_a"),
        ] {
            for &row in rows {
                self.row(keys.cells(row as usize), class, None)?;
            }
        }
        for (at, cells) in only_b.iter().enumerate() {
            let class = if at < pairing.only_b.len() {
                "only_b"
            } else {
                "duplicate_b"
            };
            self.row(cells.iter().cloned(), class, None)?;
        }
        Ok(())
    }

    pub fn cell(
        &mut self,
        keys: &Keys,
        comparison: &ColumnPair,
        cell: &CellDifference,
    ) -> Result<()> {
        let class = if cell.changed {
            "changed"
        } else {
            "within_tolerance"
        };
        self.row(
            keys.cells(cell.row as usize),
            class,
            Some((comparison, cell)),
        )
    }

    fn row(
        &mut self,
        key: impl Iterator<Item = KeyCell>,
        class: &str,
        what: Option<(&ColumnPair, &CellDifference)>,
    ) -> Result<()> {
        for (builder, cell) in self.keys.iter_mut().zip(key) {
            match (builder, cell) {
                (KeyBuilder::Int(builder), KeyCell::Int(value)) => builder.append_value(value),
                (KeyBuilder::Int(builder), KeyCell::Float(value)) => {
                    builder.append_value(value as i64)
                }
                (KeyBuilder::Float(builder), KeyCell::Float(value)) => builder.append_value(value),
                (KeyBuilder::Float(builder), KeyCell::Int(value)) => {
                    builder.append_value(value as f64)
                }
                (KeyBuilder::Text(builder), KeyCell::Text(value)) => builder.append_value(value),
                (KeyBuilder::Int(builder), KeyCell::Text(_)) => builder.append_null(),
                (KeyBuilder::Float(builder), KeyCell::Text(_)) => builder.append_null(),
                (KeyBuilder::Text(builder), _) => builder.append_null(),
            }
        }
        let number = |value: &CellValue| {
            if let CellValue::Number(number) = value {
                Some(*number).filter(|x| x.is_finite())
            } else {
                None
            }
        };
        let text = |value: &CellValue| {
            if let CellValue::Text(text) = value {
                Some(text.clone())
            } else {
                None
            }
        };
        let cell = what.map(|(_, cell)| cell);
        let texts = [
            Some(class.to_string()),
            what.map(|(comparison, _)| comparison.name.clone()),
            what.map(|(comparison, _)| comparison.unit.clone()),
            cell.and_then(|cell| text(&cell.a)),
            cell.and_then(|cell| text(&cell.b)),
        ];
        self.texts
            .iter_mut()
            .zip(texts)
            .for_each(|(builder, text)| builder.append_option(text));
        let numbers = [
            cell.and_then(|cell| number(&cell.a)),
            cell.and_then(|cell| number(&cell.b)),
            cell.and_then(|cell| cell.difference),
            cell.and_then(|cell| cell.sigmas),
        ];
        self.numbers
            .iter_mut()
            .zip(numbers)
            .for_each(|(builder, number)| builder.append_option(number));
        self.rows += 1;
        if self.rows >= GROUP_ROWS {
            self.flush()
        } else {
            Ok(())
        }
    }

    fn flush(&mut self) -> Result<()> {
        if self.rows == 0 {
            return Ok(());
        }
        self.rows = 0;
        let mut arrays: Vec<ArrayRef> = Vec::new();
        for builder in &mut self.keys {
            arrays.push(match builder {
                KeyBuilder::Int(builder) => Arc::new(builder.finish()),
                KeyBuilder::Float(builder) => Arc::new(builder.finish()),
                KeyBuilder::Text(builder) => Arc::new(builder.finish()),
            });
        }
        let [class, column, unit, a_text, b_text] = &mut self.texts;
        for builder in [class, column, unit] {
            arrays.push(Arc::new(builder.finish()));
        }
        for builder in &mut self.numbers {
            arrays.push(Arc::new(builder.finish()));
        }
        for builder in [a_text, b_text] {
            arrays.push(Arc::new(builder.finish()));
        }
        let batch = RecordBatch::try_new(self.schema.clone(), arrays)
            .map_err(|e| Error::Bug(e.to_string()))?;
        let place = self.path.display().to_string();
        self.writer
            .write(&batch)
            .map_err(|e| Error::store(place, format!("cannot write: {e}")))
    }

    pub fn close(mut self) -> Result<()> {
        self.flush()?;
        let place = self.path.display().to_string();
        self.writer
            .close()
            .map(|_| ())
            .map_err(|e| Error::store(place, format!("cannot write: {e}")))
    }
}

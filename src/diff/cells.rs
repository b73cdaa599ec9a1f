//! The differences as a table: one row for every cell that is not the same, and for every row without a partner.

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray, new_null_array};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::WriterProperties;
use std::fmt::Display;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::columns::ColumnPair;
use super::key::Keys;
use super::measure::{CellDifference, CellValue};
use super::source::{CellKind, TableFile, bug};
use crate::error::{Error, Result};

/// Rows that are gathered before they are written.
const GROUP_ROWS: usize = 1 << 16;

pub(super) struct CellWriter {
    path: PathBuf,
    schema: SchemaRef,
    writer: ArrowWriter<File>,
    /// Name and unit of the column of each.
    gathered: Vec<(Arc<str>, Arc<str>, CellDifference)>,
}

fn refused(path: &Path, error: &dyn Display) -> Error {
    Error::store(path.display().to_string(), format!("cannot write: {error}"))
}

impl CellWriter {
    pub(crate) fn create(path: &Path, a: &TableFile, key: &[String]) -> Result<Self> {
        let key_type = |name: &String| match a.position(name).map(|at| a.columns[at].kind) {
            Some(CellKind::Float) => DataType::Float64,
            Some(CellKind::Int | CellKind::Flag) => DataType::Int64,
            _ => DataType::Utf8,
        };
        let keys = key.iter().map(|name| (name.as_str(), key_type(name)));
        let cells = [
            ("diff_class", DataType::Utf8),
            ("diff_column", DataType::Utf8),
            ("diff_unit", DataType::Utf8),
            ("diff_a", DataType::Float64),
            ("diff_b", DataType::Float64),
            ("diff_difference", DataType::Float64),
            ("diff_sigmas", DataType::Float64),
            ("diff_a_text", DataType::Utf8),
            ("diff_b_text", DataType::Utf8),
        ];
        let fields = keys
            .chain(cells)
            .map(|(name, kind)| Field::new(name, kind, true));
        let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
        let level = ZstdLevel::try_new(3).map_err(bug)?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(level))
            .build();
        let file = File::create(path).map_err(|e| refused(path, &e))?;
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties))
            .map_err(|e| refused(path, &e))?;
        Ok(Self {
            path: path.into(),
            schema,
            writer,
            gathered: Vec::new(),
        })
    }

    /// Rows without a partner.
    pub(crate) fn unpaired(&mut self, keys: &Keys, rows: &[u32], class: &str) -> Result<()> {
        for rows in rows.chunks(GROUP_ROWS) {
            let classes = StringArray::from_iter_values(rows.iter().map(|_| class));
            self.write(keys.columns(rows)?, vec![Arc::new(classes)])?;
        }
        Ok(())
    }

    pub(crate) fn cell(
        &mut self,
        keys: &Keys,
        column: &ColumnPair,
        cell: &CellDifference,
    ) -> Result<()> {
        let (name, unit) = match self.gathered.last() {
            Some((name, unit, _)) if **name == *column.name => (name.clone(), unit.clone()),
            _ => (column.name.as_str().into(), column.unit.as_str().into()),
        };
        self.gathered.push((name, unit, cell.clone()));
        if self.gathered.len() < GROUP_ROWS {
            return Ok(());
        }
        self.flush(keys)
    }

    /// Writes what was gathered.
    pub(crate) fn flush(&mut self, keys: &Keys) -> Result<()> {
        let gathered = std::mem::take(&mut self.gathered);
        let rows: Vec<u32> = gathered.iter().map(|(.., cell)| cell.row).collect();
        let text = |pick: &dyn Fn(&CellDifference) -> Option<&str>| -> ArrayRef {
            let texts = gathered.iter().map(|(.., cell)| pick(cell));
            Arc::new(texts.collect::<StringArray>())
        };
        let number = |pick: &dyn Fn(&CellDifference) -> Option<f64>| -> ArrayRef {
            let numbers = gathered.iter().map(|(.., cell)| pick(cell));
            Arc::new(numbers.collect::<Float64Array>())
        };
        let names = gathered.iter().map(|(name, ..)| name);
        let units = gathered.iter().map(|(_, unit, _)| unit);
        let cells = vec![
            text(&|cell| {
                Some(if cell.changed {
                    "changed"
                } else {
                    "within_tolerance"
                })
            }),
            Arc::new(StringArray::from_iter_values(names)),
            Arc::new(StringArray::from_iter_values(units)),
            number(&|cell| cell.a.number()),
            number(&|cell| cell.b.number()),
            number(&|cell| cell.difference),
            number(&|cell| cell.sigmas),
            text(&|cell| cell.a.text()),
            text(&|cell| cell.b.text()),
        ];
        self.write(keys.columns(&rows)?, cells)
    }

    /// Writes rows; columns that are not given are null.
    fn write(&mut self, keys: Vec<ArrayRef>, cells: Vec<ArrayRef>) -> Result<()> {
        let rows = cells[0].len();
        let given = keys.len() + cells.len();
        let fields = self.schema.fields();
        let keys = keys
            .iter()
            .zip(fields)
            .map(|(cells, field)| cast(cells, field.data_type()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(bug)?;
        let nulls = fields[given..]
            .iter()
            .map(|field| new_null_array(field.data_type(), rows));
        let columns = keys.into_iter().chain(cells).chain(nulls).collect();
        let batch = RecordBatch::try_new(self.schema.clone(), columns).map_err(bug)?;
        self.writer
            .write(&batch)
            .map_err(|e| refused(&self.path, &e))
    }

    pub(crate) fn close(self) -> Result<()> {
        self.writer
            .close()
            .map(|_| ())
            .map_err(|e| refused(&self.path, &e))
    }
}

impl CellValue {
    fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number).filter(|number| number.is_finite()),
            _ => None,
        }
    }

    fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }
}

//! Columns of lists, as learning data sets hold them: each number of a list is a column of its own, `state[1]`, `state[2]`, and so on.

use super::batches::Batches;
use arrow::array::{Array, ArrayRef, AsArray, Int64Array, RecordBatch};
use arrow::compute::take;
use arrow::datatypes::{DataType, Field, FieldRef, Schema};
use std::sync::Arc;

/// Numbers of a list, at most: a longer one is a picture or a sound.
const LONGEST: usize = 256;

/// The same with lists of numbers as columns, as many as the longest list of the first rows has; a shorter list has blank cells.
pub(super) fn unfolded(mut source: Batches) -> Batches {
    let fields = source.schema.fields();
    if fields.iter().all(|field| number_of_list(field).is_none()) {
        return source;
    }
    let first = source.batches.next();
    let longest = |column: usize| {
        let rows = first.as_ref().and_then(|batch| batch.as_ref().ok());
        rows.map_or(0, |batch| lists(batch.column(column)).1.windows(2).map(|ends| ends[1] - ends[0]).max().unwrap_or(0))
    };
    let width = |column: usize| Some(longest(column)).filter(|width| (1..=LONGEST).contains(width));
    let widths: Vec<Option<usize>> = (0..fields.len()).map(|k| number_of_list(&fields[k]).and_then(|_| width(k))).collect();
    let columns = fields.iter().zip(&widths).flat_map(|(field, width)| match (number_of_list(field), width) {
        (Some(number), Some(width)) => {
            (1..=*width).map(|k| Arc::new(Field::new(format!("{}[{k}]", field.name()), number.clone(), true))).collect()
        }
        _ => vec![field.clone()],
    });
    let schema = Arc::new(Schema::new(columns.collect::<Vec<FieldRef>>()));
    let (rows, own) = (first.into_iter().chain(source.batches), schema.clone());
    let batches = Box::new(rows.map(move |batch| {
        let columns =
            batch?.columns().iter().zip(&widths).map(|(column, width)| cells(column, *width)).collect::<Result<Vec<_>, _>>();
        columns.and_then(|columns| RecordBatch::try_new(own.clone(), columns.concat())).map_err(|error| error.to_string())
    }));
    Batches { schema, batches, ..source }
}

/// What kind of numbers the lists of a column hold; none where it holds none.
fn number_of_list(field: &Field) -> Option<&DataType> {
    match field.data_type() {
        DataType::List(of) | DataType::LargeList(of) | DataType::FixedSizeList(of, _) => Some(of.data_type()),
        _ => None,
    }
    .filter(|of| of.is_numeric())
}

/// The numbers of all lists of a column, and where each list begins among them, with the end of the last.
fn lists(column: &ArrayRef) -> (&ArrayRef, Vec<usize>) {
    if let Some(list) = column.as_list_opt::<i32>() {
        return (list.values(), list.value_offsets().iter().map(|at| *at as usize).collect());
    }
    if let Some(list) = column.as_list_opt::<i64>() {
        return (list.values(), list.value_offsets().iter().map(|at| *at as usize).collect());
    }
    let list = column.as_fixed_size_list();
    (list.values(), (0..=list.len()).map(|row| row * list.value_length() as usize).collect())
}

/// A column as it is, or so many columns of the numbers of its lists.
fn cells(column: &ArrayRef, width: Option<usize>) -> Result<Vec<ArrayRef>, arrow::error::ArrowError> {
    let Some(width) = width else { return Ok(vec![column.clone()]) };
    let (values, starts) = lists(column);
    let number = |k: usize| {
        let at = |row: usize| (starts[row] + k < starts[row + 1] && !column.is_null(row)).then_some((starts[row] + k) as i64);
        take(values, &(0..column.len()).map(at).collect::<Int64Array>(), None)
    };
    (0..width).map(number).collect()
}

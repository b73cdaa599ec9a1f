//! The check behind [`super::frame::FrameBuilder::finish`]: columns against a schema, once.

use arrow::array::{
    Array, ArrayRef, AsArray, DynComparator, Float64Array, RecordBatch, make_comparator,
};
use arrow::compute::{SortColumn, SortOptions, lexsort_to_indices, take_record_batch};
use arrow::datatypes::{Field, Float64Type, Int64Type, Schema};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::schema::{ColumnType, FieldSchema, TableSchema};
use crate::error::{Error, Fault, Result, counted, listed};

/// Rows ascend by the key; nulls do not occur in it.
const ASCENDING: SortOptions = SortOptions {
    descending: false,
    nulls_first: true,
};

/// Columns by name -> the batch in the order of the schema and of the key.
pub(super) fn parse(schema: &TableSchema, columns: Vec<(String, ArrayRef)>) -> Result<RecordBatch> {
    let bug = |message: String| Error::Bug(format!("table {}: {message}", schema.name));
    let mut given = BTreeMap::new();
    for (name, array) in columns {
        if given.insert(name.clone(), array).is_some() {
            return Err(bug(format!("column {name} twice")));
        }
    }
    if let Some(name) = given.keys().find(|name| schema.field_of(name).is_none()) {
        return Err(bug(format!("column {name} is not in the schema")));
    }
    let layout = layout(schema, &given).map_err(bug)?;
    let metadata = [
        ("calib.schema".to_string(), schema.id()),
        (
            "calib.primary_key".to_string(),
            schema.primary_key.join(","),
        ),
    ];
    let mut fields: Vec<Field> = Vec::new();
    let mut arrays = Vec::new();
    for (field, joint) in &layout {
        let name = field.column(*joint);
        let array = given
            .remove(&name)
            .ok_or_else(|| bug(format!("column {name} is missing")))?;
        if array.data_type() != &field.column_type.arrow() {
            return Err(bug(format!(
                "column {name} is {}, expected {}",
                array.data_type(),
                field.column_type.arrow()
            )));
        }
        fields.push(field.arrow(*joint));
        arrays.push(array);
    }
    let arrow_schema = Arc::new(Schema::new_with_metadata(
        fields,
        metadata.into_iter().collect(),
    ));
    if arrays.windows(2).any(|pair| pair[0].len() != pair[1].len()) {
        return Err(bug("columns of unequal length".into()));
    }
    for (array, field) in arrays.iter().zip(arrow_schema.fields()) {
        let nulls = array.nulls().filter(|_| !field.is_nullable());
        let null = nulls.and_then(|nulls| nulls.iter().position(|is_there| !is_there));
        if let Some(row) = null {
            return Err(bug(format!(
                "column {}, row {row}: null where a value is needed",
                field.name()
            )));
        }
    }
    let batch = RecordBatch::try_new(arrow_schema, arrays).map_err(|e| bug(e.to_string()))?;
    check_values(schema, &layout, &batch)?;
    in_key_order(schema, batch)
}

/// The columns that a table has, in order, for the per-joint and optional columns that are there.
fn layout<'a>(
    schema: &'a TableSchema,
    given: &BTreeMap<String, ArrayRef>,
) -> std::result::Result<Vec<(&'a FieldSchema, Option<usize>)>, String> {
    let joints = given
        .keys()
        .filter_map(|name| schema.field_of(name)?.1)
        .max()
        .unwrap_or(0);
    if joints == 0
        && schema
            .fields
            .iter()
            .any(|field| field.per_joint && !field.optional)
    {
        return Err("no column of any joint".into());
    }
    let is_given = |field: &FieldSchema, joint| given.contains_key(&field.column(Some(joint)));
    let mut layout = Vec::new();
    for field in &schema.fields {
        if !field.per_joint {
            if !field.optional || given.contains_key(&field.name) {
                layout.push((field, None));
            }
            continue;
        }
        // Those of a group are settled with the first of them.
        let is_member = |other: &&FieldSchema| match &field.either {
            Some(group) => other.either.as_ref() == Some(group),
            None => std::ptr::eq(*other, field),
        };
        let members: Vec<&FieldSchema> = schema.fields.iter().filter(is_member).collect();
        let any = |member: &&FieldSchema| (1..=joints).any(|joint| is_given(member, joint));
        if !std::ptr::eq(members[0], field)
            || members.iter().all(|member| member.optional) && !members.iter().any(any)
        {
            continue;
        }
        for joint in 1..=joints {
            let there: Vec<_> = (members.iter())
                .filter(|member| members.len() == 1 || is_given(member, joint))
                .collect();
            let [member] = there[..] else {
                let names = members.iter().map(|member| member.column(Some(joint)));
                return Err(format!(
                    "joint {joint} needs exactly one of the columns {}",
                    listed(names)
                ));
            };
            layout.push((*member, Some(joint)));
        }
    }
    Ok(layout)
}

fn check_values(
    schema: &TableSchema,
    layout: &[(&FieldSchema, Option<usize>)],
    batch: &RecordBatch,
) -> Result<()> {
    let mut faults = Vec::new();
    for ((field, joint), array) in layout.iter().zip(batch.columns()) {
        let place = |row: usize| {
            format!(
                "table {}, column {}, {}",
                schema.name,
                field.column(*joint),
                key_of(schema, batch, row)
            )
        };
        let range = &field.constraints;
        let outside = |value: f64| {
            range.min.is_some_and(|min| value < min) || range.max.is_some_and(|max| value > max)
        };
        let mut bad: Vec<(usize, String)> = Vec::new();
        match field.column_type {
            // As nearly every column is; numbers of null cells are not seen by what is below.
            ColumnType::Float64 if are_inside(array.as_primitive(), range.min, range.max) => (),
            ColumnType::Float64 => {
                for (row, value) in array.as_primitive::<Float64Type>().iter().enumerate() {
                    let Some(value) = value else { continue };
                    if !value.is_finite() {
                        return Err(Error::Bug(format!(
                            "{}: {value}; a stored number is finite, or null where allowed",
                            place(row)
                        )));
                    }
                    bad.extend(outside(value).then(|| (row, value.to_string())));
                }
            }
            ColumnType::Int64 if range.min.is_some() || range.max.is_some() => {
                let values = array.as_primitive::<Int64Type>().iter().enumerate();
                bad.extend(values.filter_map(|(row, value)| {
                    let value = value.filter(|value| outside(*value as f64))?;
                    Some((row, value.to_string()))
                }));
            }
            ColumnType::Utf8 if !range.values.is_empty() => {
                let is_other = |value: &&str| !range.values.iter().any(|allowed| allowed == value);
                let mut values = array.as_string::<i32>().iter().enumerate();
                if let Some((row, value)) =
                    values.find_map(|(row, value)| Some((row, value.filter(is_other)?)))
                {
                    let allowed = range.values.join(", ");
                    let message = format!("{}: `{value}`; allowed: {allowed}", place(row));
                    return Err(Error::Bug(message));
                }
            }
            _ => (),
        }
        if let Some((row, value)) = bad.first() {
            let unit = field
                .unit
                .as_deref()
                .filter(|unit| *unit != "1" && *unit != "row")
                .map_or(String::new(), |unit| format!(" {unit}"));
            let more = if bad.len() > 1 {
                format!(" (and {})", counted(bad.len() - 1, "more row"))
            } else {
                String::new()
            };
            faults.push(Fault::new(
                place(*row),
                format!(
                    "{value}{unit} is out of range; allowed: {}{unit}{more}",
                    span(range.min, range.max)
                ),
            ));
        }
    }
    match Error::if_data(faults) {
        Err(made) if !schema.given => Err(Error::Bug(made.to_string())),
        checked => checked,
    }
}

/// Whether all numbers are finite and in range, those in the place of null cells too.
fn are_inside(column: &Float64Array, min: Option<f64>, max: Option<f64>) -> bool {
    let (min, max) = (min.unwrap_or(f64::MIN), max.unwrap_or(f64::MAX));
    column.values().iter().fold(true, |inside, value| {
        inside & (min <= *value) & (*value <= max)
    })
}

fn span(min: Option<f64>, max: Option<f64>) -> String {
    match (min, max) {
        (Some(min), Some(max)) => format!("{min} to {max}"),
        (Some(min), None) => format!("at least {min}"),
        (None, Some(max)) => format!("at most {max}"),
        (None, None) => "any".into(),
    }
}

/// `sequence 17`, `step geometry, iteration 3`.
pub(super) fn key_of(schema: &TableSchema, batch: &RecordBatch, row: usize) -> String {
    let part = |name: &String| {
        let array = batch.column_by_name(name)?;
        let value = match array.data_type() {
            arrow::datatypes::DataType::Utf8 => array.as_string::<i32>().value(row).to_string(),
            arrow::datatypes::DataType::Int64 => {
                array.as_primitive::<Int64Type>().value(row).to_string()
            }
            _ => return None,
        };
        Some(format!("{name} {value}"))
    };
    schema
        .primary_key
        .iter()
        .filter_map(part)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Compares rows of two batches of one table by key.
pub(super) fn compare_keys(
    schema: &TableSchema,
    left: &RecordBatch,
    right: &RecordBatch,
) -> Result<impl Fn(usize, usize) -> Ordering> {
    let compare = |name: &String| -> Result<DynComparator> {
        let column = |batch: &RecordBatch| {
            batch
                .column_by_name(name)
                .cloned()
                .ok_or_else(|| Error::Bug(format!("no key column {name}")))
        };
        make_comparator(&column(left)?, &column(right)?, ASCENDING)
            .map_err(|e| Error::Bug(e.to_string()))
    };
    let comparators = schema
        .sort
        .iter()
        .map(compare)
        .collect::<Result<Vec<_>>>()?;
    Ok(move |l, r| {
        comparators
            .iter()
            .map(|compare| compare(l, r))
            .find(|order| order.is_ne())
            .unwrap_or(Ordering::Equal)
    })
}

fn in_key_order(schema: &TableSchema, batch: RecordBatch) -> Result<RecordBatch> {
    let ascending = {
        let compare = compare_keys(schema, &batch, &batch)?;
        (1..batch.num_rows()).all(|row| compare(row - 1, row).is_lt())
    };
    if ascending {
        return Ok(batch);
    }
    let columns: Vec<SortColumn> = schema
        .sort
        .iter()
        .filter_map(|name| batch.column_by_name(name))
        .map(|values| SortColumn {
            values: values.clone(),
            options: Some(ASCENDING),
        })
        .collect();
    let bug = |e: arrow::error::ArrowError| Error::Bug(e.to_string());
    let sorted = take_record_batch(&batch, &lexsort_to_indices(&columns, None).map_err(bug)?)
        .map_err(bug)?;
    let twice = {
        let compare = compare_keys(schema, &sorted, &sorted)?;
        (1..sorted.num_rows()).find(|&row| compare(row - 1, row).is_eq())
    };
    match twice {
        Some(row) => Err(Error::Bug(format!(
            "table {}: key {} twice",
            schema.name,
            key_of(schema, &sorted, row)
        ))),
        None => Ok(sorted),
    }
}

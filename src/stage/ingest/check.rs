//! Faults of the settings that types cannot express, each with its place below `with`.

use super::axes::{self, needed};
use super::clock::CLOCK;
use super::columns::Columns;
use super::later;
use super::layout::{Duplicates, FileLayout, Join};
use super::mapped::{ColumnRef, ConventionColumns, JointColumns, ScalarColumn, TextColumn};
use super::noise;
use super::{Ingest, twice};
use crate::error::{Fault, counted, nearest};
use crate::observation::{Conventions, DeclaredColumn, KINDS, MeasurementKind, Part};
use crate::raw::Delimiter;
use crate::table::recording_columns;
use crate::units::{Quantity, Unit};

/// All faults at once.
pub(super) fn faults(settings: &Ingest) -> Vec<Fault> {
    let mut faults = Vec::new();
    if settings.files.is_empty() {
        faults.push(Fault::new("files", "no file; name at least one"));
        return faults;
    }
    if !(settings.max_rejected_fraction > 0.0 && settings.max_rejected_fraction <= 1.0) {
        faults.push(Fault::new(
            "max_rejected_fraction",
            "allowed: above 0 and up to 1",
        ));
    }
    for (index, file) in settings.files.iter().enumerate() {
        file_faults(file, &format!("files[{index}]"), &mut faults);
    }
    faults.extend(later::faults(settings));
    axes::faults(settings, &mut faults);
    together(settings, &mut faults);
    motion_faults(settings, &mut faults);
    faults.extend(noise::faults(settings));
    faults
}

pub(super) fn file_faults(file: &FileLayout, place: &str, faults: &mut Vec<Fault>) {
    if Delimiter::parse(&file.delimiter).is_none() {
        let message = format!(
            "delimiter `{}`; allowed: one ASCII character, `tab` or `whitespace`",
            file.delimiter
        );
        faults.push(Fault::new(format!("{place}.delimiter"), message));
    }
    if file.comment.as_deref() == Some("") {
        faults.push(Fault::new(
            format!("{place}.comment"),
            "an empty text; every line would be a comment",
        ));
    }
    if file.header_in_comment && (file.comment.is_none() || !file.header) {
        let message = match file.header {
            true => "say how a comment begins, e.g. `comment: \"//\"`",
            false => "there is no header",
        };
        faults.push(Fault::new(format!("{place}.header_in_comment"), message));
    }
    if !file.header && file.skip_below_header > 0 {
        faults.push(Fault::new(
            format!("{place}.skip_below_header"),
            "there is no header; use `skip`",
        ));
    }
    let columns = &file.columns;
    if let Some(targets) = &file.targets {
        faults.extend(targets.faults(&columns.names(), file.header, place));
    }
    if file.names().is_empty() {
        faults.push(Fault::new(
            format!("{place}.columns"),
            "no quantity is mapped",
        ));
    }
    for (declared, text) in columns.texts() {
        text_faults(
            declared,
            text,
            file,
            &format!("{place}.columns.{}", declared.setting),
            faults,
        );
    }
    for (declared, counted) in columns.counts() {
        column(
            Some(&counted.column),
            file,
            &format!("{place}.columns.{}", declared.setting),
            faults,
        );
    }
    for (declared, scalar) in columns.numbers() {
        scalar_faults(
            scalar,
            declared.quantity,
            file,
            &format!("{place}.columns.{}", declared.setting),
            faults,
        );
    }
    for (declared, mapped, _, coverage) in columns.uncertainties() {
        let place = format!("{place}.columns.{}", declared.setting);
        one_of(
            mapped.column.is_some(),
            mapped.value.is_some(),
            "`column` or `value`",
            &place,
            faults,
        );
        column(mapped.column.as_ref(), file, &place, faults);
        unit(
            mapped.unit.as_deref(),
            declared.quantity,
            &format!("{place}.unit"),
            faults,
        );
        if !(coverage > 0.0 && coverage.is_finite()) {
            faults.push(Fault::new(
                format!("{place}.coverage_factor"),
                "allowed: above 0, e.g. 2 for 95 %",
            ));
        }
        if mapped
            .value
            .is_some_and(|value| !(value > 0.0 && value.is_finite()))
        {
            faults.push(Fault::new(format!("{place}.value"), "allowed: above 0"));
        }
    }
    for (declared, mapped) in columns.joints() {
        joint_faults(
            declared,
            mapped,
            file,
            &format!("{place}.columns.{}", declared.setting),
            faults,
        );
    }
    for (declared, conventions, mapped) in columns.conventions() {
        let place = format!("{place}.columns.{}", declared.setting);
        convention_faults(declared, conventions, mapped, file, &place, faults);
    }
    twice::faults(file, place, faults);
    no_distance(columns, &format!("{place}.columns"), faults);
    for kind in KINDS {
        kind_faults(*kind, columns, &format!("{place}.columns"), faults);
    }
    // Each group at its first column.
    for group in
        recording_columns().filter(|column| column.together.first() == Some(&column.setting))
    {
        let mapped = group
            .together
            .iter()
            .filter(|setting| columns.has(setting))
            .count();
        if mapped > 0 && mapped < group.together.len() {
            let message = format!("map all of {}, or none", group.together.join(", "));
            faults.push(Fault::new(format!("{place}.columns"), message));
        }
    }
}

fn text_faults(
    declared: &DeclaredColumn,
    text: &TextColumn,
    file: &FileLayout,
    place: &str,
    faults: &mut Vec<Fault>,
) {
    if text.path.is_some() {
        faults.push(Fault::new(
            format!("{place}.path"),
            "is filled in where a pipeline's file is read; here say `value`",
        ));
    } else {
        one_of(
            text.column.is_some(),
            text.value.is_some(),
            "`column`, `value` or `path`",
            place,
            faults,
        );
    }
    if declared.setting == "point_id" && text.value.is_some() {
        faults.push(Fault::new(
            format!("{place}.value"),
            "points cannot all have the same id; name a `column`",
        ));
    }
    for (key, given) in [
        ("match", text.matching.is_some()),
        ("strip", text.strip.is_some()),
    ] {
        if given && declared.setting != "point_id" {
            faults.push(Fault::new(
                format!("{place}.{key}"),
                "a rule for names of points; allowed for `point_id` alone",
            ));
        }
    }
    column(text.column.as_ref(), file, place, faults);
}

/// A distance of nought has no direction.
fn no_distance(columns: &Columns, place: &str, faults: &mut Vec<Fault>) {
    if columns
        .number("distance")
        .is_some_and(|distance| distance.value == Some(0.0))
    {
        let message = "a distance of 0 to an anchor has no direction; a ball that lies in a socket is `socket: {column: ...}` with \
                       `sigma_socket`";
        faults.push(Fault::new(format!("{place}.distance"), message));
    }
}

/// What was measured comes with its standard deviation, and names of what it was measured from with it.
fn kind_faults(
    kind: &dyn MeasurementKind,
    columns: &Columns,
    place: &str,
    faults: &mut Vec<Fault>,
) {
    let settings = |part: Part| kind.columns(part).map(|column| column.setting);
    let mapped = |part: Part| settings(part).any(|setting| columns.has(setting));
    let values: Vec<&str> = kind.telling().map(|column| column.setting).collect();
    let told = values.iter().any(|setting| columns.has(setting));
    let values = values.join("`, `");
    if kind.about().own_sigma && told != mapped(Part::Sigma) {
        for sigma in settings(Part::Sigma) {
            let message = format!(
                "map `{values}` and `{sigma}` together: a reading is weighted by its noise, e.g. {sigma}: {{value: 0.02, unit: ...}}"
            );
            faults.push(Fault::new(place, message));
        }
    }
    for anchor in settings(Part::Anchor).filter(|setting| columns.has(setting) && !told) {
        let message = format!("an {anchor} is the end of a `{values}`; map that too");
        faults.push(Fault::new(format!("{place}.{anchor}"), message));
    }
}

fn convention_faults(
    declared: &DeclaredColumn,
    conventions: &'static Conventions,
    mapped: &ConventionColumns,
    file: &FileLayout,
    place: &str,
    faults: &mut Vec<Fault>,
) {
    let Some((convention, references)) = mapped.chosen(conventions) else {
        faults.push(Fault::new(place, conventions.allowed));
        return;
    };
    if references.len() != convention.numbers {
        faults.push(Fault::new(
            place,
            format!(
                "{}; allowed: {}",
                counted(references.len(), "column"),
                convention.numbers
            ),
        ));
    }
    for reference in references {
        column(Some(reference), file, place, faults);
    }
    if !convention.unitless {
        unit(
            mapped.unit.as_deref(),
            declared.quantity,
            &format!("{place}.unit"),
            faults,
        );
    } else if mapped.unit.is_some() {
        faults.push(Fault::new(
            format!("{place}.unit"),
            format!("a {} has no unit", convention.name),
        ));
    }
}

fn scalar_faults(
    scalar: &ScalarColumn,
    quantity: Quantity,
    file: &FileLayout,
    place: &str,
    faults: &mut Vec<Fault>,
) {
    one_of(
        scalar.column.is_some(),
        scalar.value.is_some(),
        "`column` or `value`",
        place,
        faults,
    );
    column(scalar.column.as_ref(), file, place, faults);
    let is_clock = quantity == Quantity::Time
        && scalar.column.is_some()
        && scalar.unit.as_deref() == Some(CLOCK);
    if !is_clock {
        unit(
            scalar.unit.as_deref(),
            quantity,
            &format!("{place}.unit"),
            faults,
        );
    }
    if scalar.value.is_some_and(|value| !value.is_finite()) {
        faults.push(Fault::new(format!("{place}.value"), "not a finite number"));
    }
    difference_faults(scalar, quantity, file, place, faults);
}

fn difference_faults(
    scalar: &ScalarColumn,
    quantity: Quantity,
    file: &FileLayout,
    place: &str,
    faults: &mut Vec<Fault>,
) {
    let Some((other, sign)) = scalar.difference() else {
        if scalar.difference_unit.is_some() {
            faults.push(Fault::new(
                format!("{place}.difference_unit"),
                "there is no `minus` or `plus`",
            ));
        }
        return;
    };
    let name = if sign < 0.0 { "minus" } else { "plus" };
    if quantity != Quantity::Length {
        faults.push(Fault::new(
            place,
            "`minus` and `plus` are for lengths, e.g. x, y, z",
        ));
        return;
    }
    if scalar.minus.is_some() && scalar.plus.is_some() {
        faults.push(Fault::new(
            place,
            "`minus` and `plus` at once; say one of them",
        ));
    }
    if scalar.column.is_none() {
        faults.push(Fault::new(
            place,
            format!("`{name}` needs `column`: the target that the difference is taken from"),
        ));
    }
    column(Some(other), file, &format!("{place}.{name}"), faults);
    if let Some(symbol) = &scalar.difference_unit {
        unit(
            Some(symbol),
            quantity,
            &format!("{place}.difference_unit"),
            faults,
        );
    }
}

fn joint_faults(
    declared: &DeclaredColumn,
    joints: &JointColumns,
    file: &FileLayout,
    place: &str,
    faults: &mut Vec<Fault>,
) {
    let quantity = declared.quantity;
    one_of(
        joints.column.is_some(),
        joints.columns.is_some(),
        "`column` (a pattern with {j}) or `columns` (a list)",
        place,
        faults,
    );
    match &joints.column {
        Some(pattern) if !["{j}", "{name}"].iter().any(|mark| pattern.contains(mark)) => {
            let message = format!(
                "`{pattern}` has neither {{j}} for the joint's number nor {{name}}; e.g. `q{{j}}_deg`, or list them in `columns`"
            );
            faults.push(Fault::new(format!("{place}.column"), message));
        }
        Some(_) if !file.header => {
            faults.push(Fault::new(
                format!("{place}.column"),
                "there is no header with names; list numbers in `columns`",
            ));
        }
        _ => {}
    }
    for (index, entry) in joints.columns.iter().flatten().enumerate() {
        column(
            Some(entry),
            file,
            &format!("{place}.columns[{index}]"),
            faults,
        );
    }
    faults.extend(joints.counting_faults(declared.setting == "q", place));
    if quantity == Quantity::Angle && joints.optional {
        faults.push(Fault::new(
            format!("{place}.optional"),
            "no recording without joint positions",
        ));
    }
    let linear = declared.of_joint(true).0;
    if linear != quantity {
        if joints.unit.is_some() || joints.linear_unit.is_none() {
            unit(
                joints.unit.as_deref(),
                quantity,
                &format!("{place}.unit"),
                faults,
            );
        }
        if joints.linear_unit.is_some() {
            unit(
                joints.linear_unit.as_deref(),
                linear,
                &format!("{place}.linear_unit"),
                faults,
            );
        }
        return;
    }
    match quantity {
        Quantity::Number if joints.unit.is_some() => {
            faults.push(Fault::new(
                format!("{place}.unit"),
                "a direction (1, -1, 0) has no unit",
            ));
        }
        Quantity::Number => (),
        other => unit(
            joints.unit.as_deref(),
            other,
            &format!("{place}.unit"),
            faults,
        ),
    }
    if joints.linear_unit.is_some() {
        faults.push(Fault::new(
            format!("{place}.linear_unit"),
            "for the positions and velocities of prismatic joints only",
        ));
    }
}

fn one_of(first: bool, second: bool, names: &str, place: &str, faults: &mut Vec<Fault>) {
    if first == second {
        faults.push(Fault::new(place, format!("say {names}, one of them")));
    }
}

fn column(column: Option<&ColumnRef>, file: &FileLayout, place: &str, faults: &mut Vec<Fault>) {
    match column {
        Some(ColumnRef::Number(0)) => faults.push(Fault::new(place, "columns count from 1")),
        Some(ColumnRef::Name(name)) if !file.header => {
            faults.push(Fault::new(
                place,
                format!("there is no header with `{name}` in it; give the column's number from 1"),
            ));
        }
        _ => {}
    }
}

fn unit(symbol: Option<&str>, quantity: Quantity, place: &str, faults: &mut Vec<Fault>) {
    let allowed = Unit::symbols(quantity);
    let clock = if quantity == Quantity::Time {
        ", or clock for times such as 08:15:03 and 2026-11-22T08:15:03"
    } else {
        ""
    };
    let list = allowed.join(", ") + clock;
    match symbol {
        None if quantity == Quantity::Number => {}
        None => faults.push(Fault::new(place, format!("no unit; allowed: {list}"))),
        Some(symbol) => match Unit::parse(symbol) {
            Some(unit) if unit.quantity() == quantity => {}
            Some(_) => faults.push(Fault::new(
                place,
                format!("`{symbol}` is the unit of another quantity; allowed: {list}"),
            )),
            None => {
                let hint = nearest(symbol, allowed)
                    .map(|name| format!("; did you mean `{name}`?"))
                    .unwrap_or_default();
                faults.push(Fault::new(
                    place,
                    format!("unknown unit `{symbol}`; allowed: {list}{hint}"),
                ));
            }
        },
    }
}

/// Faults of the files taken together.
fn together(settings: &Ingest, faults: &mut Vec<Fault>) {
    let files = &settings.files;
    let needed = needed(settings);
    let Some(join) = &settings.join else {
        if files.len() > 1 {
            let message = "several files; say how they belong together: {by: id}, {by: time, tolerance_s: 0.5}, {by: order} or {by: append}";
            faults.push(Fault::new("join", message));
        } else {
            complete(files, &needed, "files[0].columns", faults);
        }
        return;
    };
    if let Join::Append {} = join {
        for (index, file) in files.iter().enumerate() {
            complete(
                std::slice::from_ref(file),
                &needed,
                &format!("files[{index}].columns"),
                faults,
            );
        }
        return;
    }
    if files.len() < 2 {
        faults.push(Fault::new(
            "join",
            format!("joins two files or more, not {}", files.len()),
        ));
        return;
    }
    complete(files, &needed, "files", faults);
    let key = match join {
        Join::Id {} => Some("point_id"),
        Join::Time { .. } => Some("time"),
        _ => None,
    };
    for (index, file) in files.iter().enumerate().skip(1) {
        for name in file.names() {
            if files[..index].iter().any(|other| other.has(name)) && Some(name) != key {
                faults.push(Fault::new(
                    format!("files[{index}].columns.{name}"),
                    "mapped in two files; map it in one",
                ));
            }
        }
        if file.columns.has("sequence") {
            let message = "rows keep the order of the first file; map it there";
            faults.push(Fault::new(
                format!("files[{index}].columns.sequence"),
                message,
            ));
        }
    }
    for (index, file) in files.iter().enumerate() {
        let Some(key) = key else { continue };
        let place = format!("files[{index}].columns.{key}");
        if !file.columns.names().contains(&key) {
            faults.push(Fault::new(
                place,
                format!("not mapped; the files are joined by {key}"),
            ));
        } else if optional_key(file, key) {
            faults.push(Fault::new(
                place,
                "the files are joined by it: a column that is not optional",
            ));
        }
    }
    match join {
        Join::Id {} if settings.duplicates == Duplicates::Keep => {
            faults.push(Fault::new(
                "duplicates",
                "`keep` cannot be combined with a join by id; allowed: reject, first, last",
            ));
        }
        Join::Time {
            tolerance_s,
            offset_s,
        } => {
            if !(tolerance_s.is_finite() && *tolerance_s >= 0.0) {
                faults.push(Fault::new("join.tolerance_s", "allowed: 0 and above"));
            }
            if !offset_s.is_finite() {
                faults.push(Fault::new("join.offset_s", "not a finite number"));
            }
        }
        _ => {}
    }
}

fn optional_key(file: &FileLayout, key: &str) -> bool {
    let id = file.columns.text("point_id").is_some_and(|id| id.optional);
    let time = file
        .columns
        .number("time")
        .is_some_and(|time| time.optional || time.column.is_none());
    if key == "time" { time } else { id }
}

/// Velocities by the joints over time need both in one file.
fn motion_faults(settings: &Ingest, faults: &mut Vec<Fault>) {
    let Some(motion) = &settings.motion else {
        return;
    };
    faults.extend(motion.faults());
    let columns = || settings.files.iter().map(|file| &file.columns);
    let given = columns().any(|columns| columns.has("velocity"));
    let timed = |columns: &Columns| {
        columns
            .number("time")
            .is_some_and(|time| time.column.is_some())
    };
    if !given && columns().any(|columns| columns.has("q") && !timed(columns)) {
        let message = "joint velocities follow from the joints over time: map `time` in the file that has `q`, or map `velocity`";
        faults.push(Fault::new("motion", message));
    }
}

fn complete(files: &[FileLayout], needed: &[&str], place: &str, faults: &mut Vec<Fault>) {
    let mapped: Vec<&str> = files.iter().flat_map(FileLayout::names).collect();
    let missing: Vec<&str> = needed
        .iter()
        .copied()
        .filter(|name| !mapped.contains(name))
        .collect();
    if !missing.is_empty() {
        faults.push(Fault::new(
            place,
            format!("not mapped: {}", missing.join(", ")),
        ));
    }
}

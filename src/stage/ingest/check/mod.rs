//! Faults of the settings that types cannot express, each with its place below `with`.

mod files;

use super::columns::{Columns, FileLayout, HELD, SIMULATED, WideTargets};
use super::mapped::{
    ColumnRef, ConventionColumns, JointColumns, JointNames, ScalarColumn, Supply, TextColumn,
};
use super::stretch::CLOCK;
use super::{Ingest, later, noise};
use crate::error::{Place, counted, did_you_mean};
use crate::observation::{Conventions, DeclaredColumn, KINDS, MeasurementKind, Part};
use crate::raw::Delimiter;
use crate::table::recording_columns;
use crate::units::{Quantity, Unit};
use std::collections::BTreeMap;

pub(super) fn faults(settings: &Ingest, at: &mut Place) {
    if settings.files.is_empty() {
        return at.at("files").fault("no file; name at least one");
    }
    let share = settings.max_rejected_fraction;
    at.at("max_rejected_fraction")
        .must(share > 0.0 && share <= 1.0, "allowed: above 0 and up to 1");
    for (index, layout) in settings.files.iter().enumerate() {
        file(layout, &mut at.at("files").item(index));
    }
    later::faults(settings, at);
    files::faults(settings, at);
    noise::faults(settings, at);
}

pub(super) fn file(file: &FileLayout, at: &mut Place) {
    if Delimiter::parse(&file.delimiter).is_none() {
        at.at("delimiter").fault(format!(
            "delimiter `{}`; allowed: one ASCII character, `tab` or `whitespace`",
            file.delimiter
        ));
    }
    let has_mark = file.comment.as_deref() != Some("");
    let message = "an empty text; every line would be a comment";
    at.at("comment").must(has_mark, message);
    if file.header_in_comment && (file.comment.is_none() || !file.header) {
        at.at("header_in_comment").fault(match file.header {
            true => "say how a comment begins, e.g. `comment: \"//\"`",
            false => "there is no header",
        });
    }
    let possible = file.header || file.skip_below_header == 0;
    let message = "there is no header; use `skip`";
    at.at("skip_below_header").must(possible, message);
    if let Some(targets) = &file.targets {
        wide(targets, file, at);
    }
    if file.names().is_empty() {
        at.at("columns").fault("no quantity is mapped");
    }
    mapped(file, &mut at.at("columns"));
    twice(file, at);
    let (columns, at) = (&file.columns, &mut at.at("columns"));
    let distance = columns.number("distance").and_then(|mapped| mapped.value);
    if distance == Some(0.0) {
        at.at("distance").fault(
            "a distance of 0 to an anchor has no direction; a ball that lies in a socket is `socket: {column: ...}` with \
             `sigma_socket`",
        );
    }
    for kind in KINDS {
        measured(*kind, columns, at);
    }
    // Each group at its first column.
    let is_first = |column: &&DeclaredColumn| column.together.first() == Some(&column.setting);
    for group in recording_columns().filter(is_first) {
        let all = group.together;
        let mapped = all.iter().filter(|setting| columns.has(setting)).count();
        if mapped > 0 && mapped < all.len() {
            at.fault(format!("map all of {}, or none", all.join(", ")));
        }
    }
}
/// Each mapped quantity by itself.
fn mapped(file: &FileLayout, at: &mut Place) {
    let columns = &file.columns;
    for (declared, mapped) in columns.texts() {
        text(declared, mapped, file, &mut at.at(declared.setting));
    }
    for (declared, counted) in columns.counts() {
        column(Some(&counted.column), file, &mut at.at(declared.setting));
    }
    for (declared, mapped) in columns.numbers() {
        let at = &mut at.at(declared.setting);
        scalar(mapped, declared.quantity, file, at);
    }
    for (declared, mapped, _, coverage) in columns.uncertainties() {
        let at = &mut at.at(declared.setting);
        let given = [mapped.column.is_some(), mapped.value.is_some()];
        one_of(given, "`column` or `value`", at);
        column(mapped.column.as_ref(), file, at);
        let symbol = mapped.unit.as_deref();
        unit(symbol, declared.quantity, &mut at.at("unit"));
        let is_allowed = |value: f64| value > 0.0 && value.is_finite();
        let message = "allowed: above 0, e.g. 2 for 95 %";
        at.at("coverage_factor").must(is_allowed(coverage), message);
        let possible = mapped.value.is_none_or(is_allowed);
        at.at("value").must(possible, "allowed: above 0");
    }
    for (declared, mapped) in columns.joints() {
        joints(declared, mapped, file, &mut at.at(declared.setting));
    }
    for (declared, all, mapped) in columns.conventions() {
        conventions(declared, all, mapped, file, &mut at.at(declared.setting));
    }
}

/// Columns of several targets in a row.
fn wide(targets: &WideTargets, file: &FileLayout, at: &mut Place) {
    let others = file.columns.names();
    for (group, message) in [
        (&HELD[..], "also in `targets`; map it in one of them"),
        (
            &SIMULATED,
            "one simulated point and several targets; put each target in a separate file",
        ),
    ] {
        for name in others.iter().filter(|name| group.contains(name)) {
            at.at("columns").at(name).fault(message);
        }
    }
    let at = &mut at.at("targets");
    if targets.columns.len() < 2 {
        at.at("columns")
            .fault("expected two targets or more; one is mapped as x, y and z");
    }
    for (target, references) in &targets.columns {
        let mut columns = at.at("columns");
        let at = &mut columns.at(target);
        if target.trim().is_empty() {
            at.fault("a target without a name");
        }
        for reference in references {
            match reference {
                ColumnRef::Number(0) => at.fault("columns count from 1"),
                ColumnRef::Name(name) if !file.header => at.fault(format!(
                    "there is no header with `{name}` in it; give numbers from 1"
                )),
                _ => {}
            }
        }
    }
    if Unit::parse(&targets.unit).is_none_or(|unit| unit.quantity() != Quantity::Length) {
        let allowed = Unit::symbols(Quantity::Length).join(", ");
        at.at("unit").fault(format!(
            "`{}` is no unit of length; allowed: {allowed}",
            targets.unit
        ));
    }
}

fn text(declared: &DeclaredColumn, text: &TextColumn, file: &FileLayout, at: &mut Place) {
    if text.path.is_some() {
        at.at("path")
            .fault("is filled in where a pipeline's file is read; here say `value`");
    } else {
        let given = [text.column.is_some(), text.value.is_some()];
        one_of(given, "`column`, `value` or `path`", at);
    }
    let is_id = declared.setting == "point_id";
    let message = "points cannot all have the same id; name a `column`";
    at.at("value").must(!is_id || text.value.is_none(), message);
    let message = "a rule for names of points; allowed for `point_id` alone";
    at.at("match")
        .must(is_id || text.matching.is_none(), message);
    at.at("strip").must(is_id || text.strip.is_none(), message);
    column(text.column.as_ref(), file, at);
}

/// What was measured comes with its standard deviation, and names of what it was measured from with it.
fn measured(kind: &dyn MeasurementKind, columns: &Columns, at: &mut Place) {
    let settings = |part: Part| kind.columns(part).map(|column| column.setting);
    let mapped = |part: Part| settings(part).any(|setting| columns.has(setting));
    let values: Vec<&str> = kind.telling().map(|column| column.setting).collect();
    let has_value = values.iter().any(|setting| columns.has(setting));
    let values = values.join("`, `");
    if kind.about().own_sigma && has_value != mapped(Part::Sigma) {
        for sigma in settings(Part::Sigma) {
            at.fault(format!(
                "map `{values}` and `{sigma}` together: a reading is weighted by its noise, e.g. {sigma}: {{value: 0.02, unit: ...}}"
            ));
        }
    }
    for anchor in settings(Part::Anchor).filter(|setting| columns.has(setting) && !has_value) {
        at.at(anchor).fault(format!(
            "an {anchor} is the end of a `{values}`; map that too"
        ));
    }
}

fn conventions(
    declared: &DeclaredColumn,
    conventions: &'static Conventions,
    mapped: &ConventionColumns,
    file: &FileLayout,
    at: &mut Place,
) {
    let Some((convention, references)) = mapped.chosen(conventions) else {
        return at.fault(conventions.allowed);
    };
    let (found, allowed) = (references.len(), convention.numbers);
    let message = format!("{}; allowed: {allowed}", counted(found, "column"));
    at.must(found == allowed, message);
    for reference in references {
        column(Some(reference), file, at);
    }
    let given = mapped.unit.as_deref();
    if !convention.unitless {
        unit(given, declared.quantity, &mut at.at("unit"));
    } else if given.is_some() {
        at.at("unit")
            .fault(format!("a {} has no unit", convention.name));
    }
}

fn scalar(scalar: &ScalarColumn, quantity: Quantity, file: &FileLayout, at: &mut Place) {
    if let Some(rate) = scalar.rate {
        let is_time = quantity == Quantity::Time;
        at.at("rate").must(is_time, "is of `time` alone");
        let possible = rate > 0.0 && rate.is_finite();
        let message = format!("a rate of {rate} Hz; allowed: above 0, e.g. 200");
        at.at("rate").must(possible, message);
        let is_alone = scalar.column.is_none() && scalar.value.is_none() && scalar.unit.is_none();
        let message = "says when each row is; leave `column`, `value` and `unit` out";
        return at.at("rate").must(is_alone, message);
    }
    let given = [scalar.column.is_some(), scalar.value.is_some()];
    one_of(given, "`column` or `value`", at);
    column(scalar.column.as_ref(), file, at);
    let symbol = scalar.unit.as_deref();
    let is_clock = quantity == Quantity::Time && scalar.column.is_some() && symbol == Some(CLOCK);
    if !is_clock {
        unit(symbol, quantity, &mut at.at("unit"));
    }
    if scalar.value.is_some_and(|value| !value.is_finite()) {
        at.at("value").fault("not a finite number");
    }
    let Some((other, sign)) = scalar.difference() else {
        let unneeded = scalar.difference_unit.is_none();
        let mut at = at.at("difference_unit");
        return at.must(unneeded, "there is no `minus` or `plus`");
    };
    let name = if sign < 0.0 { "minus" } else { "plus" };
    if quantity != Quantity::Length {
        return at.fault("`minus` and `plus` are for lengths, e.g. x, y, z");
    }
    if scalar.minus.is_some() && scalar.plus.is_some() {
        at.fault("`minus` and `plus` at once; say one of them");
    }
    if scalar.column.is_none() {
        at.fault(format!(
            "`{name}` needs `column`: the target that the difference is taken from"
        ));
    }
    column(Some(other), file, &mut at.at(name));
    if let Some(symbol) = &scalar.difference_unit {
        unit(Some(symbol), quantity, &mut at.at("difference_unit"));
    }
}

/// What a dc motor is driven with, instead of a torque.
fn motor(declared: &DeclaredColumn, joints: &JointColumns, file: &FileLayout, at: &mut Place) {
    let Some((names, setting)) = joints.drive() else {
        return;
    };
    if declared.setting != "torque" {
        return at.at(setting).fault("is of `torque` alone");
    }
    if joints.column.is_some() || joints.columns.is_some() || joints.unit.is_some() {
        at.fault(format!(
            "`{setting}` stands for the columns of the torque; leave `column`, `columns` and `unit` out"
        ));
    }
    if joints.duty.is_some() && joints.voltage.is_some() {
        at.fault("say `duty` or `voltage`, one of them");
    }
    match names {
        JointNames::Pattern(pattern)
            if !["{j}", "{name}"].iter().any(|mark| pattern.contains(mark)) =>
        {
            at.at(setting).fault(format!(
                "`{pattern}` has neither {{j}} for the joint's number nor {{name}}; e.g. `{setting}{{j}}`, or a list of columns"
            ));
        }
        JointNames::Pattern(_) if !file.header => at
            .at(setting)
            .fault("there is no header with names; list numbers"),
        JointNames::Pattern(_) => {}
        JointNames::List(all) => {
            for (index, entry) in all.iter().enumerate() {
                column(Some(entry), file, &mut at.at(setting).item(index));
            }
        }
    }
    let is_positive = |number: f64| number > 0.0 && number.is_finite();
    if joints.duty.is_some() {
        match &joints.supply {
            None => at
                .at("supply")
                .fault("not stated; a duty is a share of it, e.g. 12, V"),
            Some(Supply::Volts(volts)) => {
                let message = format!("a supply of {volts} V; allowed: above 0 V");
                at.at("supply").must(is_positive(*volts), message);
            }
            Some(Supply::Column(supply)) => {
                column(Some(&supply.column), file, &mut at.at("supply.column"));
                let scale = supply.scale.is_none_or(is_positive);
                at.at("supply.scale")
                    .must(scale, "allowed: above 0, V per unit of the file");
            }
        }
        let full = joints.full_duty.is_none_or(is_positive);
        at.at("full_duty")
            .must(full, "allowed: above 0, e.g. 100 for percent");
    } else {
        let message = "is of a duty; `voltage` is in volts";
        at.at("supply").must(joints.supply.is_none(), message);
        at.at("full_duty").must(joints.full_duty.is_none(), message);
    }
    match &joints.kt_over_r {
        None => at
            .at("kt_over_r")
            .fault("not stated; expected Nm at the joint per volt, e.g. 0.35; where no mass is known any number will do, and masses are relative to it"),
        Some(all) => {
            let possible = all.stated().iter().all(|number| *number != 0.0 && number.is_finite());
            at.at("kt_over_r").must(possible, "allowed: any number but 0, Nm/V");
        }
    }
    if let Some(all) = &joints.kt2_over_r {
        let possible = all
            .stated()
            .iter()
            .all(|number| *number >= 0.0 && number.is_finite());
        at.at("kt2_over_r")
            .must(possible, "allowed: 0 and above, Nm s/rad");
        let message = "needs `velocity`; leave it out, and it is found as viscous friction";
        at.at("kt2_over_r")
            .must(file.columns.has("velocity"), message);
    }
}

fn joints(declared: &DeclaredColumn, joints: &JointColumns, file: &FileLayout, at: &mut Place) {
    let quantity = declared.quantity;
    if joints.drive().is_some() {
        return motor(declared, joints, file, at);
    }
    for (setting, given) in [
        ("supply", joints.supply.is_some()),
        ("full_duty", joints.full_duty.is_some()),
        ("kt_over_r", joints.kt_over_r.is_some()),
        ("kt2_over_r", joints.kt2_over_r.is_some()),
    ] {
        at.at(setting)
            .must(!given, "belongs to `duty` or `voltage` of `torque`");
    }
    let given = [joints.column.is_some(), joints.columns.is_some()];
    let names = "`column` (a pattern with {j}) or `columns` (a list)";
    one_of(given, names, at);
    match &joints.column {
        Some(pattern) if !["{j}", "{name}"].iter().any(|mark| pattern.contains(mark)) => {
            at.at("column").fault(format!(
                "`{pattern}` has neither {{j}} for the joint's number nor {{name}}; e.g. `q{{j}}_deg`, or list them in `columns`"
            ));
        }
        Some(_) if !file.header => at
            .at("column")
            .fault("there is no header with names; list numbers in `columns`"),
        _ => {}
    }
    for (index, entry) in joints.columns.iter().flatten().enumerate() {
        column(Some(entry), file, &mut at.at("columns").item(index));
    }
    counting(joints, declared.setting == "q", at);
    if let Some(counts) = joints.counts_per_turn {
        let mut at = at.at("counts_per_turn");
        let turns = [Quantity::Angle, Quantity::AngularRate].contains(&quantity);
        at.must(turns, "for positions and velocities of joints that turn");
        at.must(joints.unit.is_none(), "stands for `unit`; say one of them");
        at.must(
            counts > 0.0 && counts.is_finite(),
            "allowed: above 0, e.g. 4096",
        );
        return;
    }
    if quantity == Quantity::Angle && joints.optional {
        at.at("optional")
            .fault("no recording without joint positions");
    }
    let [turning, sliding] = [joints.unit.as_deref(), joints.linear_unit.as_deref()];
    let linear = declared.of_joint(true).0;
    if linear != quantity {
        if turning.is_some() || sliding.is_none() {
            unit(turning, quantity, &mut at.at("unit"));
        }
        if sliding.is_some() {
            unit(sliding, linear, &mut at.at("linear_unit"));
        }
        return;
    }
    if quantity != Quantity::Number {
        unit(turning, quantity, &mut at.at("unit"));
    } else if turning.is_some() {
        at.at("unit").fault("a direction (1, -1, 0) has no unit");
    }
    let message = "for positions, velocities and forces of prismatic joints only";
    at.at("linear_unit").must(sliding.is_none(), message);
}

/// How the file is said to count its joints.
fn counting(joints: &JointColumns, are_positions: bool, at: &mut Place) {
    for (index, sign) in joints.sign.iter().enumerate() {
        let mut at = at.at(format!("sign[{index}]"));
        at.must(sign.abs() == 1.0, "allowed: 1 and -1");
    }
    for (index, zero) in joints.zero.iter().enumerate() {
        let mut at = at.at(format!("zero[{index}]"));
        at.must(zero.is_finite(), "not a finite number");
    }
    for (index, one) in joints.coupled.iter().enumerate() {
        let mut at = at.at(format!("coupled[{index}]"));
        if one.joint == 0 || one.by == 0 {
            at.fault("joints count from 1");
        } else if one.joint == one.by {
            at.fault("a joint cannot hold itself; expected two different joints");
        }
        let message = "not a finite number, e.g. 1 or -1";
        at.at("ratio").must(one.ratio.is_finite(), message);
    }
    let is_plain = joints.zero.is_empty() && joints.coupled.is_empty();
    let message = "`zero` and `coupled` are for positions; say them at `q`";
    at.must(are_positions || is_plain, message);
}

fn one_of([first, second]: [bool; 2], names: &str, at: &mut Place) {
    if first == second {
        at.fault(format!("say {names}, one of them"));
    }
}

fn column(column: Option<&ColumnRef>, file: &FileLayout, at: &mut Place) {
    match column {
        Some(ColumnRef::Number(0)) => at.fault("columns count from 1"),
        Some(ColumnRef::Name(name)) if !file.header => at.fault(format!(
            "there is no header with `{name}` in it; give the column's number from 1"
        )),
        _ => {}
    }
}

fn unit(symbol: Option<&str>, quantity: Quantity, at: &mut Place) {
    let allowed = Unit::symbols(quantity);
    let clock = if quantity == Quantity::Time {
        ", or clock for times such as 08:15:03 and 2026-11-22T08:15:03"
    } else {
        ""
    };
    let list = allowed.join(", ") + clock;
    match symbol {
        None if quantity == Quantity::Number => {}
        None => at.fault(format!("no unit; allowed: {list}")),
        Some(symbol) => match Unit::parse(symbol) {
            Some(unit) if unit.quantity() == quantity => {}
            Some(_) => at.fault(format!(
                "`{symbol}` is the unit of another quantity; allowed: {list}"
            )),
            None => {
                let hint = did_you_mean(symbol, allowed);
                at.fault(format!("unknown unit `{symbol}`; allowed: {list}{hint}"));
            }
        },
    }
}

/// A column that a quantity is read from.
struct Use {
    /// Below the file.
    place: String,
    reference: ColumnRef,
    /// As people call it, e.g. `x`.
    name: String,
    /// Quantities of one group never share a column; those of two may where one is the sum of two columns, as a target is next to the
    /// point that is written as its difference from it.
    group: &'static str,
    /// Whether the quantity is this column alone.
    alone: bool,
}

/// Columns that are mapped to two quantities: joints and what was measured need a column each. Circumstances and uncertainties may share
/// columns, also with each other.
fn twice(file: &FileLayout, at: &mut Place) {
    let mut all: BTreeMap<String, Vec<Use>> = BTreeMap::new();
    for used in uses(file) {
        // Where names are the same, so are the columns: `A{j}` stands for a name of each joint.
        let written = match &used.reference {
            ColumnRef::Number(_) => used.reference.to_string(),
            ColumnRef::Name(name) => format!("`{}", name.trim()),
        };
        let earlier = all.entry(written).or_default();
        let clashes = |other: &&Use| other.group == used.group || (other.alone && used.alone);
        if let Some(other) = earlier.iter().find(clashes) {
            let both = match other.name == used.name {
                true => format!("{} twice", used.name),
                false => format!("{} and {}", other.name, used.name),
            };
            at.at(&used.place).fault(format!(
                "{} is mapped to {both}; allowed: a column for each",
                used.reference
            ));
        }
        earlier.push(used);
    }
}

fn uses(file: &FileLayout) -> Vec<Use> {
    let (columns, mut uses) = (&file.columns, Vec::new());
    let mut take = |place: String, reference: &ColumnRef, name: String, group, alone| {
        uses.push(Use {
            place,
            reference: reference.clone(),
            name,
            group,
            alone,
        });
    };
    for (declared, joints) in columns
        .joints()
        .filter(|(declared, _)| declared.quantity != Quantity::Number)
    {
        let setting = declared.setting;
        if let Some(pattern) = &joints.column {
            let (place, reference) = (
                format!("columns.{setting}.column"),
                ColumnRef::Name(pattern.clone()),
            );
            take(place, &reference, format!("`{setting}`"), setting, true);
        }
        for (k, reference) in joints.columns.iter().flatten().enumerate() {
            let place = format!("columns.{setting}.columns[{k}]");
            let name = format!("joint {} of `{setting}`", k + 1);
            take(place, reference, name, setting, true);
        }
    }
    let measured = |setting: &str| {
        let has = |kind: &&&dyn MeasurementKind| {
            let mut values = kind.columns(Part::Value);
            values.any(|column| column.setting == setting)
        };
        KINDS.iter().find(has).map(|kind| kind.about().name)
    };
    for (declared, scalar) in columns.numbers() {
        let setting = declared.setting;
        // A point next to `targets` is a fault of its kind.
        let is_wide = file.targets.is_some() && HELD.contains(&setting);
        let simulated = SIMULATED.contains(&setting).then_some("simulated");
        let Some(group) = measured(setting).or(simulated).filter(|_| !is_wide) else {
            continue;
        };
        let key = scalar.minus.as_ref().map_or("plus", |_| "minus");
        let difference = scalar.difference().map(|(reference, _)| reference);
        for (key, reference) in [("column", scalar.column.as_ref()), (key, difference)] {
            let Some(reference) = reference else { continue };
            let (place, name) = (format!("columns.{setting}.{key}"), format!("`{setting}`"));
            take(place, reference, name, group, difference.is_none());
        }
    }
    for (declared, conventions, mapped) in columns.conventions() {
        let setting = declared.setting;
        let chosen = mapped.chosen(conventions);
        if let (Some(group), Some((convention, references))) = (measured(setting), chosen) {
            for (k, reference) in references.iter().enumerate() {
                let place = format!("columns.{setting}.{}[{k}]", convention.name);
                take(place, reference, format!("`{setting}`"), group, true);
            }
        }
    }
    for (target, references) in file.targets.iter().flat_map(|targets| &targets.columns) {
        for (k, reference) in references.iter().enumerate() {
            let place = format!("targets.columns.{target}[{k}]");
            take(
                place,
                reference,
                format!("target `{target}`"),
                "targets",
                true,
            );
        }
    }
    uses
}

//! Faults of the files of a recording together: what is mapped in none of them, how they are joined, what a moving arm needs.

use crate::error::Place;
use crate::ingest::Ingest;
use crate::ingest::columns::{Columns, Duplicates, FileLayout, Join};
use crate::observation::{KINDS, MeasurementKind, Part};

pub(super) fn faults(settings: &Ingest, at: &mut Place) {
    axes(settings, at);
    together(settings, at);
    motion(settings, at);
}

/// What a recording cannot be without: joints, and points unless another kind of measurement is mapped.
fn needed(settings: &Ingest) -> Vec<&'static str> {
    let [first, others @ ..] = KINDS else {
        return Vec::new();
    };
    let is_mapped = |kind: &&dyn MeasurementKind, columns: &Columns| {
        kind.telling().any(|column| columns.has(column.setting))
    };
    let other = |file: &FileLayout| others.iter().any(|kind| is_mapped(kind, &file.columns));
    let axes: Vec<&str> = match &settings.axes {
        Some(axes) => axes.iter().map(|axis| axis.name()).collect(),
        None if settings.files.iter().any(other) => Vec::new(),
        None => first
            .columns(Part::Value)
            .map(|column| column.setting)
            .collect(),
    };
    std::iter::once("q").chain(axes).collect()
}

/// The axes that were measured, and columns of others.
fn axes(settings: &Ingest, at: &mut Place) {
    let Some(axes) = &settings.axes else { return };
    if axes.is_empty() {
        return at
            .at("axes")
            .fault("no axis; name those that were measured, e.g. [z], or leave `axes` out");
    }
    for (k, axis) in axes.iter().enumerate() {
        let message = format!("`{}` is named twice", axis.name());
        let is_new = !axes[..k].contains(axis);
        at.at(format!("axes[{k}]")).must(is_new, message);
    }
    let names: Vec<&str> = axes.iter().map(|axis| axis.name()).collect();
    let all = KINDS[..1].iter().flat_map(|kind| kind.columns(Part::Value));
    let all = all.map(|column| column.setting);
    let left: Vec<&str> = all.filter(|name| !names.contains(name)).collect();
    for (index, file) in settings.files.iter().enumerate() {
        let at = &mut at.at(format!("files[{index}]"));
        for name in left.iter().filter(|name| file.columns.has(name)) {
            at.at("columns").at(name).fault(format!(
                "`axes: [{}]` says that {name} was not measured; take `{name}` out of `columns`, or add it to `axes`",
                names.join(", ")
            ));
        }
        let possible = file.targets.is_none() || left.is_empty();
        let message = "the points of targets have all axes; leave `axes` out";
        at.at("targets").must(possible, message);
    }
}

/// Faults of the files taken together.
fn together(settings: &Ingest, at: &mut Place) {
    let files = &settings.files;
    let needed = needed(settings);
    let Some(join) = &settings.join else {
        if files.len() > 1 {
            at.at("join").fault(
                "several files; say how they belong together: {by: id}, {by: time, tolerance_s: 0.5}, {by: order} or {by: append}",
            );
        } else {
            complete(files, &needed, &mut at.at("files[0].columns"));
        }
        return;
    };
    if let Join::Append {} = join {
        for (index, file) in files.iter().enumerate() {
            let at = &mut at.at(format!("files[{index}].columns"));
            complete(std::slice::from_ref(file), &needed, at);
        }
        return;
    }
    if files.len() < 2 {
        let message = format!("joins two files or more, not {}", files.len());
        return at.at("join").fault(message);
    }
    complete(files, &needed, &mut at.at("files"));
    let key = match join {
        Join::Id {} => Some("point_id"),
        Join::Time { .. } => Some("time"),
        _ => None,
    };
    for (index, file) in files.iter().enumerate().skip(1) {
        let at = &mut at.at(format!("files[{index}].columns"));
        for name in file.names() {
            if files[..index].iter().any(|other| other.has(name)) && Some(name) != key {
                at.at(name).fault("mapped in two files; map it in one");
            }
        }
        let message = "rows keep the order of the first file; map it there";
        at.at("sequence")
            .must(!file.columns.has("sequence"), message);
    }
    for (index, file) in files.iter().enumerate() {
        let Some(key) = key else { continue };
        let mut at = at.at(format!("files[{index}].columns.{key}"));
        if !file.columns.has(key) {
            at.fault(format!("not mapped; the files are joined by {key}"));
        } else if is_optional(file, key) {
            at.fault("the files are joined by it: a column that is not optional");
        }
    }
    match join {
        Join::Id {} if settings.duplicates == Duplicates::Keep => at
            .at("duplicates")
            .fault("`keep` cannot be combined with a join by id; allowed: reject, first, last"),
        Join::Time {
            tolerance_s,
            offset_s,
        } => {
            let possible = tolerance_s.is_finite() && *tolerance_s >= 0.0;
            at.at("join.tolerance_s")
                .must(possible, "allowed: 0 and above");
            at.at("join.offset_s")
                .must(offset_s.is_finite(), "not a finite number");
        }
        _ => {}
    }
}

fn is_optional(file: &FileLayout, key: &str) -> bool {
    let (id, time) = (file.columns.text("point_id"), file.columns.number("time"));
    match key {
        "time" => time.is_some_and(|time| time.optional || time.column.is_none()),
        _ => id.is_some_and(|id| id.optional),
    }
}

/// Velocities by the joints over time need both in one file.
fn motion(settings: &Ingest, at: &mut Place) {
    let Some(motion) = &settings.motion else {
        return;
    };
    let possible = motion.gap_s.is_none_or(|gap| gap > 0.0 && gap.is_finite());
    at.at("motion.gap_s")
        .must(possible, "allowed: above 0, e.g. 0.1");
    let possible = motion.over_s >= 0.0 && motion.over_s.is_finite();
    at.at("motion.over_s")
        .must(possible, "allowed: 0 and above, e.g. 0.02");
    at.at("motion.later_s")
        .must(motion.later_s.is_finite(), "not a finite number");
    let columns = || settings.files.iter().map(|file| &file.columns);
    let given = columns().any(|columns| columns.has("velocity"));
    let timed = |columns: &Columns| {
        let time = columns.number("time");
        time.is_some_and(|time| time.column.is_some())
    };
    if !given && columns().any(|columns| columns.has("q") && !timed(columns)) {
        at.at("motion").fault(
            "joint velocities follow from the joints over time: map `time` in the file that has `q`, or map `velocity`",
        );
    }
}

fn complete(files: &[FileLayout], needed: &[&str], at: &mut Place) {
    let is_missing = |name: &&&str| !files.iter().any(|file| file.has(name));
    let missing: Vec<&str> = needed.iter().filter(is_missing).copied().collect();
    if !missing.is_empty() {
        at.fault(format!("not mapped: {}", missing.join(", ")));
    }
}

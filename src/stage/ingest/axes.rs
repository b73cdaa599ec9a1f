//! Which axes of its points a recording has.

use super::Ingest;
use super::columns::Columns;
use super::layout::FileLayout;
use crate::error::Fault;
use crate::observation::{KINDS, MeasurementKind, Part};

/// What a recording cannot be without: joints, and points unless another kind of measurement is mapped.
pub(super) fn needed(settings: &Ingest) -> Vec<&'static str> {
    let [first, others @ ..] = KINDS else {
        return Vec::new();
    };
    let mapped = |kind: &&dyn MeasurementKind, columns: &Columns| {
        kind.telling().any(|column| columns.has(column.setting))
    };
    let other = |file: &FileLayout| others.iter().any(|kind| mapped(kind, &file.columns));
    let axes = match &settings.axes {
        Some(axes) => axes.iter().map(|axis| axis.name()).collect(),
        None if settings.files.iter().any(other) => Vec::new(),
        None => first
            .columns(Part::Value)
            .map(|column| column.setting)
            .collect(),
    };
    std::iter::once("q").chain(axes).collect()
}

/// Faults of `axes`, and of columns that it leaves out.
pub(super) fn faults(settings: &Ingest, faults: &mut Vec<Fault>) {
    let Some(axes) = &settings.axes else { return };
    if axes.is_empty() {
        faults.push(Fault::new(
            "axes",
            "no axis; name those that were measured, e.g. [z], or leave `axes` out",
        ));
        return;
    }
    for (k, axis) in axes
        .iter()
        .enumerate()
        .filter(|(k, axis)| axes[..*k].contains(axis))
    {
        faults.push(Fault::new(
            format!("axes[{k}]"),
            format!("`{}` is named twice", axis.name()),
        ));
    }
    let names: Vec<&str> = axes.iter().map(|axis| axis.name()).collect();
    let left = KINDS
        .iter()
        .take(1)
        .flat_map(|kind| kind.columns(Part::Value))
        .map(|column| column.setting);
    let left: Vec<&str> = left.filter(|name| !names.contains(name)).collect();
    for (index, file) in settings.files.iter().enumerate() {
        for name in left.iter().filter(|name| file.columns.has(name)) {
            let message = format!(
                "`axes: [{}]` says that {name} was not measured; take `{name}` out of `columns`, or add it to `axes`",
                names.join(", ")
            );
            faults.push(Fault::new(
                format!("files[{index}].columns.{name}"),
                message,
            ));
        }
        if file.targets.is_some() && !left.is_empty() {
            faults.push(Fault::new(
                format!("files[{index}].targets"),
                "the points of targets have all axes; leave `axes` out",
            ));
        }
    }
}

//! A column that is mapped to two quantities: joints and what was measured each have their own.

use super::layout::FileLayout;
use super::mapped::ColumnRef;
use super::wide::{HELD, SIMULATED};
use crate::error::Fault;
use crate::observation::{KINDS, Part};
use crate::units::Quantity;
use std::collections::BTreeMap;

/// A mapped column.
struct Use {
    /// As people call it, e.g. `x`.
    name: String,
    /// Where the settings name it.
    place: String,
    /// Quantities of one group never share a column; those of two may where one is the sum of two columns, as a target is beside the
    /// point that is written as its difference from it.
    group: &'static str,
    /// Whether the quantity is this column alone.
    alone: bool,
}

/// A column as it is written: `A{j}` stands for a name of each joint.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Written {
    Number(u32),
    Name(String),
}

/// Faults of the columns of a file at `place`. Circumstances and uncertainties may share columns, also with each other.
pub(super) fn faults(file: &FileLayout, place: &str, faults: &mut Vec<Fault>) {
    let mut uses: BTreeMap<Written, Vec<Use>> = BTreeMap::new();
    each(file, place, &mut |reference, own| {
        let written = match reference {
            ColumnRef::Number(number) => Written::Number(*number),
            ColumnRef::Name(name) => Written::Name(name.trim().into()),
        };
        let earlier = uses.entry(written).or_default();
        if let Some(other) = earlier
            .iter()
            .find(|other| other.group == own.group || (other.alone && own.alone))
        {
            let both = if other.name == own.name {
                format!("{} twice", own.name)
            } else {
                format!("{} and {}", other.name, own.name)
            };
            faults.push(Fault::new(
                &own.place,
                format!("{reference} is mapped to {both}; allowed: a column for each"),
            ));
        }
        earlier.push(own);
    });
}

fn each(file: &FileLayout, place: &str, take: &mut dyn FnMut(&ColumnRef, Use)) {
    let columns = &file.columns;
    let measured = |setting: &str| {
        let kind = KINDS.iter().find(|kind| {
            kind.columns(Part::Value)
                .any(|column| column.setting == setting)
        });
        kind.map(|kind| kind.about().name)
    };
    for (declared, joints) in columns
        .joints()
        .filter(|(declared, _)| declared.quantity != Quantity::Number)
    {
        let (setting, place) = (
            declared.setting,
            format!("{place}.columns.{}", declared.setting),
        );
        if let Some(pattern) = &joints.column {
            let own = Use {
                name: format!("`{setting}`"),
                place: format!("{place}.column"),
                group: setting,
                alone: true,
            };
            take(&ColumnRef::Name(pattern.clone()), own);
        }
        for (k, reference) in joints.columns.iter().flatten().enumerate() {
            let name = format!("joint {} of `{setting}`", k + 1);
            take(
                reference,
                Use {
                    name,
                    place: format!("{place}.columns[{k}]"),
                    group: setting,
                    alone: true,
                },
            );
        }
    }
    // A point beside `targets` is a fault of its own.
    let beside = |setting: &str| file.targets.is_some() && HELD.contains(&setting);
    for (declared, scalar) in columns
        .numbers()
        .filter(|(declared, _)| !beside(declared.setting))
    {
        let simulated = SIMULATED.contains(&declared.setting).then_some("simulated");
        let Some(group) = measured(declared.setting).or(simulated) else {
            continue;
        };
        let (name, place) = (
            format!("`{}`", declared.setting),
            format!("{place}.columns.{}", declared.setting),
        );
        let alone = scalar.difference().is_none();
        let difference = if scalar.minus.is_some() {
            ("minus", &scalar.minus)
        } else {
            ("plus", &scalar.plus)
        };
        for (key, reference) in [("column", &scalar.column), difference] {
            let Some(reference) = reference else { continue };
            take(
                reference,
                Use {
                    name: name.clone(),
                    place: format!("{place}.{key}"),
                    group,
                    alone,
                },
            );
        }
    }
    for (declared, conventions, mapped) in columns.conventions() {
        let (Some(group), Some((convention, references))) =
            (measured(declared.setting), mapped.chosen(conventions))
        else {
            continue;
        };
        for (k, reference) in references.iter().enumerate() {
            let place = format!(
                "{place}.columns.{}.{}[{k}]",
                declared.setting, convention.name
            );
            take(
                reference,
                Use {
                    name: format!("`{}`", declared.setting),
                    place,
                    group,
                    alone: true,
                },
            );
        }
    }
    for (target, references) in file.targets.iter().flat_map(|targets| &targets.columns) {
        for (k, reference) in references.iter().enumerate() {
            let place = format!("{place}.targets.columns.{target}[{k}]");
            take(
                reference,
                Use {
                    name: format!("target `{target}`"),
                    place,
                    group: "targets",
                    alone: true,
                },
            );
        }
    }
}

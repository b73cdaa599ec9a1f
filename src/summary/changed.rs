//! What changed between recordings of an arm's torques, in lines: which recordings agree, and of each other one what differs.

use super::estimate::estimate;
use super::found::words;
use super::screen::sentence;
use crate::error::{counted, listed};
use crate::table::{TorqueChangeRow, TorqueChangeTable};
use std::collections::BTreeSet;

/// Lines of a comparison; nothing of an empty one.
pub(super) fn lines(table: &TorqueChangeTable, width: usize) -> String {
    let Some(reference) = table.0.first().map(|row| row.reference.as_str()) else {
        return String::new();
    };
    let names: BTreeSet<&str> = table.0.iter().map(|row| row.recording.as_str()).collect();
    let differs = |name: &&str| of(table, name).any(|row| row.rank.is_some());
    let (others, same): (Vec<&str>, Vec<&str>) = names.iter().copied().partition(differs);
    let mut text = String::new();
    if names.len() > 1 {
        let agreeing = listed(std::iter::once(reference).chain(same.iter().copied()));
        let all = names.len() + 1;
        let what = match (same.len(), others.len()) {
            (_, 0) => format!("all {all} recordings agree: {agreeing}"),
            (0, _) => format!("no two of {all} recordings agree; each against {reference}"),
            _ => format!("{} of {all} recordings agree: {agreeing}", same.len() + 1),
        };
        text += &sentence("compared", &what, width);
    }
    let shown = if names.len() > 1 {
        others
    } else {
        names.iter().copied().collect()
    };
    for name in shown {
        let ranks: BTreeSet<i64> = of(table, name).filter_map(|row| row.rank).collect();
        let unchanged = of(table, name).filter(|row| row.rank.is_none()).count();
        let unchanged = format!("{} unchanged", counted(unchanged, "number"));
        let what = match ranks.len() {
            0 => format!("{name} against {reference}: nothing beyond noise, {unchanged}"),
            count => format!(
                "{name} against {reference}: {}, {unchanged}",
                counted(count, "change")
            ),
        };
        text += &sentence("changed", &what, width);
        for rank in ranks {
            let rows: Vec<&TorqueChangeRow> = of(table, name)
                .filter(|row| row.rank == Some(rank))
                .collect();
            text += &sentence(&format!("{rank:>3}."), &change(&rows), width);
        }
    }
    text
}

fn of<'t>(table: &'t TorqueChangeTable, name: &str) -> impl Iterator<Item = &'t TorqueChangeRow> {
    let name = name.to_string();
    table.0.iter().filter(move |row| row.recording == name)
}

/// A change in words: what, by how much, and where else a mass might be.
fn change(rows: &[&TorqueChangeRow]) -> String {
    let Some(first) = rows.first() else {
        return String::new();
    };
    let find = |ending: &str| {
        let ends = |row: &&&TorqueChangeRow| {
            let last = row.name.rsplit('.').next().unwrap_or_default();
            last == ending || (ending.ends_with('_') && last.starts_with(ending))
        };
        rows.iter().find(ends).copied()
    };
    let carried = ["payload", "added_mass"].contains(&first.effect.as_str());
    let text = if carried {
        let place = match first.effect.as_str() {
            "payload" => "the last link".to_string(),
            _ => first.place.clone(),
        };
        let moment = find("moment_").or_else(|| find("moment"));
        match (find("mass"), moment) {
            (Some(mass), _) => {
                let centre = ["centre_x", "centre_y", "centre_z"].map(find);
                let at = match centre {
                    [Some(x), Some(y), Some(z)] => {
                        let [x, y, z] = [x, y, z].map(|row| 1e3 * row.change);
                        format!(", its centre at ({x:.0}, {y:.0}, {z:.0}) mm at the zero pose")
                    }
                    _ => find("distance").map_or_else(String::new, |place| {
                        format!(", {} from its joint", number(place))
                    }),
                };
                format!("{place} carries {}{at}", signed(mass))
            }
            (None, Some(moment)) => {
                let joint = moment.name.rsplit_once("_j").map(|(_, joint)| joint);
                let joint = joint.map_or("its joint".into(), |joint| format!("joint {joint}"));
                let point = match (
                    find("point_mass"),
                    find("point_distance"),
                    find("mass_at_tool"),
                ) {
                    (Some(mass), Some(place), _) => {
                        format!(": {} if it is small, {} out", number(mass), number(place))
                    }
                    (.., Some(mass)) => format!(": {} if at its end", number(mass)),
                    _ => String::new(),
                };
                format!(
                    "{place} carries {} about {joint}{point}; the mass itself is not seen",
                    signed(moment)
                )
            }
            _ => format!("{place} carries something else"),
        }
    } else {
        let numbers: Vec<String> = rows.iter().map(|row| signed(row)).collect();
        format!(
            "{}: {}",
            words(&first.effect, &first.place),
            numbers.join(", ")
        )
    };
    match &first.rivals {
        Some(rivals) => format!("{text}; or on {rivals}"),
        None => text,
    }
}

/// A number in the unit that suits its size.
fn number(row: &TorqueChangeRow) -> String {
    let unit = match row.unit.as_str() {
        "kg" if row.change.abs() < 1.0 => Some("g"),
        "kg m" if row.change.abs() < 1.0 => Some("g m"),
        "m" => Some("mm"),
        _ => None,
    };
    match unit {
        Some(unit) => estimate(1e3 * row.change, Some(1e3 * row.sigma), unit),
        None => estimate(row.change, Some(row.sigma), &row.unit),
    }
}

fn signed(row: &TorqueChangeRow) -> String {
    let plus = if row.change > 0.0 { "+" } else { "" };
    format!("{plus}{}", number(row))
}

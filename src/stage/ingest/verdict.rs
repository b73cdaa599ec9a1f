//! What is wrong with a file as a whole, or with several files as copies of each other: errors for the owner of the measurements, before any table is written.

use super::apart::{Trimmed, clocks_apart, least_apart, zone};
use super::arm::RobotJoints;
use super::columns::{Columns, Join, LimitPolicy};
use super::pair::Measurement;
use super::refusal::{Reason, RefusalCount, RefusalCounts, tally};
use super::rows::{FileRows, GivenUp};
use crate::Context;
use crate::error::{Error, Fault, Result, counted};
use crate::units::Unit;
use calib_numerics::robot::too_far;
use std::collections::{BTreeMap, BTreeSet};

/// Beyond this largest angle, deg, a file in degrees is believed to be one.
const SMALL_IN_DEGREES: f64 = 6.5;

/// What most rows beyond the limits are a sign of.
const COUNTED: &str = ": the controller may count its joints otherwise than the robot file (`sign`, `zero`, `coupled` of `q`), or the columns stand in \
                       another order";
/// Ids that are looked at for examples.
const EXAMPLES: usize = 1000;
/// Joints that are recorded for calibration turn by more, rad.
const FAR: f64 = 2.0;

/// Fails where a file cannot be what the settings say it is; warns where it is odd.
pub(super) fn judge(all: &Measurement, context: &Context) -> Result<()> {
    let (limits, mut faults) = (all.settings.limits, unequal(all));
    for (index, (rows, layout)) in all.files.iter().zip(&all.settings.files).enumerate() {
        let angles = implausible(rows, &layout.columns, limits, all.arm);
        let fault = angles.or_else(|| too_many_rejected(all, index));
        if fault.is_none() {
            warn(rows, &layout.columns, limits, all.arm, context);
        }
        faults.extend(fault);
    }
    // What a file lacks is said once, not by every file that is joined to it.
    let mut once: Vec<Fault> = Vec::new();
    for fault in faults {
        if !once.contains(&fault) {
            once.push(fault);
        }
    }
    Error::if_data(once)
}

/// Rows that belong together by their order alone are as many in each file, whatever became of them.
fn unequal(all: &Measurement) -> Vec<Fault> {
    let (Some(Join::Order {}), [first, others @ ..]) = (&all.settings.join, &all.files[..]) else {
        return Vec::new();
    };
    let other = others.iter().filter(|other| other.filled != first.filled);
    let faults = other.map(|other| {
        let message = format!(
            "{} data rows, {} has {}: rows cannot be joined by order; allowed: as many rows in each file, or `join: {{by: id}}` or \
             `{{by: time, tolerance_s: ...}}`",
            other.filled, first.label, first.filled
        );
        Fault::new(&other.label, message)
    });
    faults.collect()
}

fn implausible(
    rows: &FileRows,
    columns: &Columns,
    limits: LimitPolicy,
    arm: &RobotJoints,
) -> Option<Fault> {
    let unit = columns.joint("q")?.unit.as_deref().unwrap_or("rad");
    let judged = rows.count_usable() + out_of_range(rows);
    if rows.turns.rows * 2 > judged
        && let Some((line, joint, value)) = rows.turns.first
    {
        let advice = match unit {
            "rad" => "; if the file holds degrees, say `unit: deg`",
            _ => "",
        };
        let message = too_far("q", unit, [rows.turns.rows, judged], joint, value) + advice;
        return Some(Fault::new(format!("{}:{line}", rows.label), message));
    }
    if limits == LimitPolicy::Warn
        && rows.beyond.rows * 2 > judged
        && let Some((line, joint, value)) = rows.beyond.first
        // Joints that turn this far are in the unit that is declared, whatever they are counted from.
        && (arm.prismatic.get(joint) == Some(&true) || unit != "deg" && rows.largest_turn() < FAR)
    {
        let slides = arm.prismatic.get(joint) == Some(&true);
        let linear = columns.joint("q")?.linear_unit.as_deref();
        let linear = linear.filter(|_| slides).and_then(Unit::parse);
        let linear = linear.and_then(|unit| unit.misread(value, arm.limits[joint]));
        let other = match (linear, unit) {
            (Some(linear), _) => format!(
                "; if the file holds {}, say `linear_unit: {}`",
                linear.plural(),
                linear.symbol()
            ),
            (None, "rad") if !slides => "; if the file holds degrees, say `unit: deg`".into(),
            _ => String::new(),
        };
        let message = format!(
            "{} of {judged} rows are beyond the robot's joint limits, here {}; allowed: the unit and order of columns that the file has, or \
             `limits: ignore`{other}",
            rows.beyond.rows,
            arm.beyond(joint, value)
        );
        return Some(Fault::new(format!("{}:{line}", rows.label), message));
    }
    None
}

fn too_many_rejected(all: &Measurement, index: usize) -> Option<Fault> {
    let (files, rows) = (&all.files, &all.files[index]);
    let allowed = all.settings.max_rejected_fraction;
    let (read, accepted) = (rows.count() as u64, rows.count_used());
    let rejected = read - accepted;
    if accepted > 0 && rejected as f64 <= allowed * read as f64 {
        return None;
    }
    let duplicates = |of_copies: bool| {
        let all = rows
            .given_up
            .iter()
            .filter_map(move |(here, why)| match why {
                GivenUp::Duplicate { copied, .. } if *copied == of_copies => Some(*here),
                _ => None,
            });
        let first = all.clone().min().map(|here| rows.line(here));
        (all.count() as u64, first.unwrap_or_default())
    };
    let ((ids, first_id), (copies, first_copy)) = (duplicates(false), duplicates(true));
    let unmatched = rows.given_up.len() as u64 - ids - copies;
    // Every other file is joined to the first; where the rows that lack a partner decide, the shorter file is at fault.
    let partners = (0..files.len()).filter(|other| *other != index && (index == 0 || *other == 0));
    let partner = partners.min_by_key(|other| files[*other].count_usable());
    let cut = partner.map(|other| &files[other]).filter(|other| {
        2 * unmatched > rejected && accepted > 0 && other.count_usable() < rows.count_usable()
    });
    let mut counts = RefusalCounts::new();
    for (row, refusal) in &rows.refused {
        tally(&mut counts, rows.line(*row), refusal);
    }
    let without_partner = match partner {
        None => "no partner in another file".to_string(),
        Some(other) => {
            let by_id = matches!(all.settings.join, Some(Join::Id {}));
            let unlike = by_id.then(|| unlike(all, [index, other])).flatten();
            let unlike = unlike.or_else(|| apart(all, [index, other]));
            let unlike = unlike.unwrap_or_default();
            format!("no partner in {}{unlike}", files[other].label)
        }
    };
    let mut count = |reason: Reason, rows: u64, first_line: u64, detail: &str| {
        let count = RefusalCount {
            rows,
            first_line,
            first_detail: detail.into(),
        };
        counts.extend((rows > 0).then_some((reason, count)));
    };
    let of_ids =
        "point ids that occur more than once; `duplicates: first` or `last` uses one row of each";
    count(Reason::DuplicateId, ids, first_id, of_ids);
    count(Reason::DuplicateRow, copies, first_copy, "duplicate rows");
    count(Reason::Unmatched, unmatched, 0, &without_partner);
    let mut reasons: Vec<_> = counts.iter().collect();
    reasons.sort_by_key(|(_, count)| std::cmp::Reverse(count.rows));
    let listed = reasons.iter().map(|(reason, count)| {
        let place = match count.first_line {
            0 => String::new(),
            line => format!("line {line}: "),
        };
        let (rows, word) = (count.rows, reason.name());
        format!("{rows} {word} ({place}{})", count.first_detail)
    });
    let listed: Vec<String> = listed.collect();
    let share = match (accepted, cut) {
        (0, _) => "no row is left".to_string(),
        (_, Some(_)) => {
            let (matched, label) = (read - unmatched, &rows.label);
            format!(
                "has partners for {matched} of the {read} rows of {label}, {rejected} of which are rejected"
            )
        }
        _ => format!("{rejected} of {read} rows are rejected"),
    };
    let allowed = allowed * 100.0;
    let place = match (cut, reasons.first()) {
        (Some(cut), _) => cut.label.clone(),
        (_, Some((_, count))) if count.first_line > 0 => {
            format!("{}:{}", rows.label, count.first_line)
        }
        _ => rows.label.clone(),
    };
    let misread = misread(rows);
    let message = format!(
        "{share}; allowed: up to {allowed} % (`max_rejected_fraction`); reasons: {}{misread}",
        listed.join("; ")
    );
    Some(Fault::new(place, message))
}

/// The unit in which the numbers that are out of range lie in it, where that goes for most rows.
fn misread(rows: &FileRows) -> String {
    let mut counts: Vec<((&str, Unit), usize)> = Vec::new();
    for found in rows.refused.values().filter_map(|refusal| refusal.misread) {
        match counts.iter_mut().find(|(other, _)| *other == found) {
            Some((_, count)) => *count += 1,
            None => counts.push((found, 1)),
        }
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count);
    match most.filter(|(_, count)| 2 * count > rows.count()) {
        Some(((setting, unit), _)) => {
            let (all, symbol) = (unit.plural(), unit.symbol());
            format!("; if the file holds {all}, say `{setting}: {symbol}`")
        }
        None => String::new(),
    }
}

/// By how much the clocks of two files that are joined by time are apart.
fn apart(all: &Measurement, [one, other]: [usize; 2]) -> Option<String> {
    let Some(Join::Time {
        tolerance_s,
        offset_s,
    }) = &all.settings.join
    else {
        return None;
    };
    // The first file is that to which the others are joined.
    let (second, stated) = match one.max(other) {
        1 => (1, *offset_s),
        later => (later, 0.0),
    };
    let times = |file: usize, offset: f64| -> Vec<f64> {
        let rows = &all.files[file];
        let times = rows
            .usable()
            .map(|row| rows.value(row, all.arm.slots.time) - offset);
        times.filter(|time| time.is_finite()).collect()
    };
    let (here, there) = (times(0, 0.0), times(second, stated));
    if let Some(found) = clocks_apart(&here, &there, *tolerance_s) {
        let (words, offset) = (found.in_words(), Trimmed(stated + found.offset));
        let remedy = match second {
            1 => format!(": `join: {{by: time, tolerance_s: {tolerance_s}, offset_s: {offset}}}`"),
            _ => String::new(),
        };
        return Some(format!("; {words}{remedy}"));
    }
    let least = least_apart(&here, &there).filter(|least| least > tolerance_s)?;
    let zone = zone(least).map_or_else(String::new, |zone| format!(" ({zone}: `offset_s`)"));
    Some(format!(
        "; the nearest rows are {} s apart{zone}",
        Trimmed(least)
    ))
}

/// An id of each of two files that the other one lacks, where both have such: of a pair that differs in case alone, if there is one.
fn unlike(all: &Measurement, files: [usize; 2]) -> Option<String> {
    let without_partner = |file: usize| -> Vec<&str> {
        let rows = &all.files[file];
        let named = rows.usable().filter(|row| !rows.id(*row).is_empty());
        let is_alone =
            |row: &usize| matches!(rows.given_up.get(row), Some(GivenUp::Unmatched { .. }));
        let alone = named.take(EXAMPLES).filter(is_alone);
        alone.map(|row| rows.id(row)).collect()
    };
    let [here, there] = files.map(without_partner);
    // Of three files a row may lack its partner in the third.
    let [ours, known] = [&here, &there].map(|ids| ids.iter().copied().collect::<BTreeSet<&str>>());
    let by_case: BTreeMap<String, &str> = there.iter().map(|id| (id.to_lowercase(), *id)).collect();
    let mut strangers = here.iter().filter(|id| !known.contains(*id));
    let cased = strangers.clone();
    let mut cased = cased.filter_map(|id| Some((*id, *by_case.get(&id.to_lowercase())?)));
    if let Some((one, other)) = cased.next() {
        return Some(format!(
            ", e.g. `{one}` here and `{other}` there: ids that differ in upper and lower case are different ids"
        ));
    }
    let one = strangers.next()?;
    let other = there.iter().find(|id| !ours.contains(*id))?;
    Some(format!(
        ", e.g. `{one}` here and `{other}` there: ids must be the same in both files"
    ))
}

fn warn(
    rows: &FileRows,
    columns: &Columns,
    limits: LimitPolicy,
    arm: &RobotJoints,
    context: &Context,
) {
    if limits == LimitPolicy::Warn
        && let Some((line, joint, value)) = rows.beyond.first
    {
        context.warn(format!(
            "{}: {} with a joint beyond the robot's limits, used all the same; first line {line}, {}{}",
            rows.label,
            counted(rows.beyond.rows, "row"),
            arm.beyond(joint, value),
            if 2 * rows.beyond.rows > rows.count_usable() { COUNTED } else { "" }
        ));
    }
    let unit = columns.joint("q").and_then(|q| q.unit.as_deref());
    let largest = rows.largest.to_degrees();
    let is_small = largest > 0.0 && largest < SMALL_IN_DEGREES;
    if unit == Some("deg") && is_small && rows.count_usable() >= 10 {
        context.warn(format!(
            "{}: no joint is ever beyond {largest:.2} deg; if the file holds rad, say `unit: rad`",
            rows.label
        ));
    }
}

/// Rows that hold something out of range.
fn out_of_range(rows: &FileRows) -> u64 {
    let reasons = rows.refused.values().map(|refusal| refusal.reason);
    reasons
        .filter(|reason| *reason == Reason::OutOfRange)
        .count() as u64
}

/// Fails where the same measured rows would be used twice. One log of several days with a file of joints for each day is none: of its
/// rows each is used once.
pub(super) fn no_copies(read: &[Measurement]) -> Result<()> {
    let place = |set: usize, index: usize| match set.checked_sub(1) {
        None => format!("files[{index}].file"),
        Some(later) => format!("later[{later}].files[{index}]"),
    };
    let sets = read.iter().enumerate();
    let all = sets.flat_map(|(set, one)| {
        let files = one.files.iter().enumerate();
        files.map(move |(index, rows)| (place(set, index), one, rows))
    });
    let all: Vec<(String, &Measurement, &FileRows)> = all.collect();
    let mut faults = Vec::new();
    for (k, (place, one, rows)) in all.iter().enumerate() {
        let mut others = all[..k].iter().map(|other| {
            let rows_twice = used_twice([*one, other.1], [*rows, other.2]);
            (other, rows_twice)
        });
        if let Some((other, rows_twice)) = others.find(|(_, rows_twice)| *rows_twice > 0) {
            let message = format!(
                "`{}` measured what `{}` of `{}` did, and {} would be used twice: copies look like perfect repeatability; name the                  file of another measurement, or take this one out",
                rows.label,
                other.2.label,
                other.0,
                counted(rows_twice, "row")
            );
            faults.push(Fault::new(format!("with.{place}"), message));
        }
    }
    Error::if_data(faults)
}

/// Rows that are used of both files; none where what they measured differs.
fn used_twice(measurements: [&Measurement; 2], files: [&FileRows; 2]) -> u64 {
    let [one, other] = files;
    if !one.measured_same(other) {
        return 0;
    }
    if measurements.iter().any(|used| used.partners.is_empty()) {
        return one.count_used().min(other.count_used());
    }
    let both = |row: &usize| one.is_used(*row) && other.is_used(*row);
    (0..one.count()).filter(both).count() as u64
}

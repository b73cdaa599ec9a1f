//! What is wrong with a file as a whole, or with several files as copies of each other: errors for the owner of the measurements, before any table is written.

use super::Ingest;
use super::arm::RobotJoints;
use super::columns::Columns;
use super::layout::{Join, LimitPolicy};
use super::pair::FileDecision;
use super::refusal::Reason;
use super::scan::{RefusalCount, Scan};
use crate::error::{Error, Fault, Result, counted};
use crate::robot::too_far;
use crate::stage::Context;
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

/// Rows of a file that become part of the recording.
pub(super) fn accepted(scan: &Scan, decision: &FileDecision) -> u64 {
    if decision.partners.is_empty() {
        return scan.used() - decision.twins.len() as u64;
    }
    (1..=scan.read as usize)
        .filter(|number| decision.is_whole(*number))
        .count() as u64
}

/// Fails where a file cannot be what the settings say it is; warns where it is odd.
pub(super) fn judge(
    settings: &Ingest,
    scans: &[Scan],
    decisions: &[FileDecision],
    arm: &RobotJoints,
    context: &Context,
) -> Result<()> {
    let mut faults = unequal(settings, scans);
    for (index, (scan, layout)) in scans.iter().zip(&settings.files).enumerate() {
        let angles = implausible(scan, &layout.columns, settings.limits, arm);
        let fault = angles.or_else(|| too_many_rejected(settings, scans, decisions, index));
        if fault.is_none() {
            warn(scan, &layout.columns, settings.limits, arm, context);
        }
        faults.extend(fault);
    }
    // What a file lacks is said once, not by every file that is joined to it.
    let mut seen = Vec::new();
    faults.retain(|fault| {
        !seen.contains(fault) && {
            seen.push(fault.clone());
            true
        }
    });
    Error::if_data(faults)
}

/// Rows that belong together by their order alone are as many in each file, whatever became of them.
fn unequal(settings: &Ingest, scans: &[Scan]) -> Vec<Fault> {
    let (Some(Join::Order {}), Some((first, others))) = (&settings.join, scans.split_first())
    else {
        return Vec::new();
    };
    let other = others.iter().filter(|other| other.last != first.last);
    let faults = other.map(|other| {
        let message = format!(
            "{} data rows, {} has {}: rows cannot be joined by order; allowed: as many rows in each file, or `join: {{by: id}}` or \
             `{{by: time, tolerance_s: ...}}`",
            other.last, first.label, first.last
        );
        Fault::new(&other.label, message)
    });
    faults.collect()
}

fn implausible(
    scan: &Scan,
    columns: &Columns,
    limits: LimitPolicy,
    arm: &RobotJoints,
) -> Option<Fault> {
    let unit = columns.joint("q")?.unit.as_deref().unwrap_or("rad");
    let judged = scan.used()
        + scan
            .tally
            .get(&Reason::OutOfRange)
            .map_or(0, |count| count.rows);
    if scan.turns.rows * 2 > judged
        && let Some((line, joint, value)) = scan.turns.first
    {
        let advice = match unit {
            "rad" => "; if the file holds degrees, say `unit: deg`",
            _ => "",
        };
        let message = too_far("q", unit, [scan.turns.rows, judged], joint, value) + advice;
        return Some(Fault::new(format!("{}:{line}", scan.label), message));
    }
    if limits == LimitPolicy::Warn
        && scan.beyond.rows * 2 > judged
        && let Some((line, joint, value)) = scan.beyond.first
        // Joints that turn this far are in the unit that is declared, whatever they are counted from.
        && (arm.prismatic.get(joint) == Some(&true) || unit != "deg" && scan.largest_turn() < FAR)
    {
        let degrees = if unit == "deg" {
            ""
        } else {
            "; if the file holds degrees, say `unit: deg`"
        };
        let message = format!(
            "{} of {judged} rows are beyond the robot's joint limits, here {}; allowed: the unit and order of columns that the file has, or \
             `limits: ignore`{degrees}",
            scan.beyond.rows,
            arm.beyond(joint, value)
        );
        return Some(Fault::new(format!("{}:{line}", scan.label), message));
    }
    None
}

fn too_many_rejected(
    settings: &Ingest,
    scans: &[Scan],
    decisions: &[FileDecision],
    index: usize,
) -> Option<Fault> {
    let (scan, decision, layout) = (
        scans.get(index)?,
        decisions.get(index)?,
        settings.files.get(index)?,
    );
    let accepted = accepted(scan, decision);
    let rejected = scan.read - accepted;
    if accepted > 0 && rejected as f64 <= settings.max_rejected_fraction * scan.read as f64 {
        return None;
    }
    let twins = decision.twins.len() as u64;
    let copies = decision.twins.values().filter(|twin| twin.copied).count() as u64;
    let unmatched = scan.used() - accepted - twins;
    // Every other file is joined to the first; where the rows that lack a partner decide, the shorter file is at fault.
    let partner = scans
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != index && (index == 0 || *other == 0));
    let partner_at = partner
        .min_by_key(|(_, other)| other.used())
        .map(|(other, _)| other);
    let partner = partner_at.and_then(|other| scans.get(other));
    let cut = partner
        .filter(|other| 2 * unmatched > rejected && accepted > 0 && other.used() < scan.used());
    let mut counts = scan.tally.clone();
    let first = |copied: bool| {
        let of_kind = decision.twins.values().filter(|twin| twin.copied == copied);
        of_kind
            .map(|twin| u64::from(twin.line))
            .min()
            .unwrap_or_default()
    };
    let without_partner = partner_at.map_or_else(
        || "no partner in another file".to_string(),
        |other| {
            format!(
                "no partner in {}{}",
                scans[other].label,
                Some(&settings.join)
                    .filter(|join| matches!(join, Some(Join::Id {})))
                    .and_then(|_| unlike(scans, decisions, [index, other]))
                    .unwrap_or_default()
            )
        },
    );
    for (reason, rows, first_line, detail) in [
        (
            Reason::DuplicateId,
            twins - copies,
            first(false),
            "point ids that occur more than once".to_string(),
        ),
        (
            Reason::DuplicateRow,
            copies,
            first(true),
            "duplicate rows".to_string(),
        ),
        (Reason::Unmatched, unmatched, 0, without_partner),
    ] {
        if rows > 0 {
            counts.insert(
                reason,
                RefusalCount {
                    rows,
                    first_line,
                    first_detail: detail,
                },
            );
        }
    }
    let mut reasons: Vec<_> = counts.iter().collect();
    reasons.sort_by_key(|(_, count)| std::cmp::Reverse(count.rows));
    let listed: Vec<String> = reasons
        .iter()
        .map(|(reason, count)| {
            let place = if count.first_line == 0 {
                String::new()
            } else {
                format!("line {}: ", count.first_line)
            };
            format!(
                "{} {} ({place}{})",
                count.rows,
                reason.word(),
                count.first_detail
            )
        })
        .collect();
    let share = match (accepted, cut) {
        (0, _) => "no row is left".to_string(),
        (_, Some(_)) => {
            format!(
                "has partners for {} of the {} rows of {}, {rejected} of which are rejected",
                scan.read - unmatched,
                scan.read,
                scan.label
            )
        }
        _ => format!("{rejected} of {} rows are rejected", scan.read),
    };
    let allowed = settings.max_rejected_fraction * 100.0;
    let place = match (cut, reasons.first()) {
        (Some(cut), _) => cut.label.clone(),
        (_, Some((_, count))) if count.first_line > 0 => {
            format!("{}:{}", scan.label, count.first_line)
        }
        _ => scan.label.clone(),
    };
    Some(Fault::new(
        place,
        format!(
            "{share}; allowed: up to {allowed} % (`max_rejected_fraction`); reasons: {}{}",
            listed.join("; "),
            smaller(scan, &layout.columns)
        ),
    ))
}

/// What points that are too large for their unit usually are, where most are.
fn smaller(scan: &Scan, columns: &Columns) -> &'static str {
    let most = scan
        .tally
        .get(&Reason::OutOfRange)
        .is_some_and(|count| 2 * count.rows > scan.read);
    match columns
        .number("x")
        .filter(|_| most)
        .and_then(|x| x.unit.as_deref())
    {
        Some("mm") => "; if the file holds micrometres, say `unit: um`",
        Some("m") => "; if the file holds millimetres, say `unit: mm`",
        _ => "",
    }
}

/// An id of each of two files that the other one lacks, where both have such: of a pair that differs in case alone, if there is one.
fn unlike(scans: &[Scan], decisions: &[FileDecision], files: [usize; 2]) -> Option<String> {
    let without_partner = |file: usize| -> Option<Vec<&str>> {
        let (scan, decision) = (scans.get(file)?, decisions.get(file)?);
        let rows = scan.ids.rows().take(EXAMPLES).filter(|(_, row)| {
            !decision.is_whole(row.number as usize) && !decision.twins.contains_key(&row.number)
        });
        rows.map(|(id, _)| std::str::from_utf8(id).ok()).collect()
    };
    let [here, there] = [without_partner(files[0])?, without_partner(files[1])?];
    // Of three files a row may lack its partner in the third.
    let (ours, known): (BTreeSet<&str>, BTreeSet<&str>) = (
        here.iter().copied().collect(),
        there.iter().copied().collect(),
    );
    let by_case: BTreeMap<String, &str> = there.iter().map(|id| (id.to_lowercase(), *id)).collect();
    let mut strangers = here.iter().filter(|id| !known.contains(*id));
    if let Some((one, other)) = strangers
        .clone()
        .find_map(|id| Some((*id, *by_case.get(&id.to_lowercase())?)))
    {
        return Some(format!(
            ", e.g. `{one}` here and `{other}` there: ids that differ in upper and lower case are different ids"
        ));
    }
    let (one, other) = (
        strangers.next()?,
        there.iter().find(|id| !ours.contains(*id))?,
    );
    Some(format!(
        ", e.g. `{one}` here and `{other}` there: ids must be the same in both files"
    ))
}

fn warn(scan: &Scan, columns: &Columns, limits: LimitPolicy, arm: &RobotJoints, context: &Context) {
    if limits == LimitPolicy::Warn
        && let Some((line, joint, value)) = scan.beyond.first
    {
        context.warn(format!(
            "{}: {} with a joint beyond the robot's limits, used all the same; first line {line}, {}{}",
            scan.label,
            counted(scan.beyond.rows, "row"),
            arm.beyond(joint, value),
            if 2 * scan.beyond.rows > scan.used() { COUNTED } else { "" }
        ));
    }
    let degrees = columns
        .joint("q")
        .is_some_and(|q| q.unit.as_deref() == Some("deg"));
    if degrees
        && scan.largest > 0.0
        && scan.largest.to_degrees() < SMALL_IN_DEGREES
        && scan.used() >= 10
    {
        context.warn(format!(
            "{}: no joint is ever beyond {:.2} deg; if the file holds rad, say `unit: rad`",
            scan.label,
            scan.largest.to_degrees()
        ));
    }
}

/// A file that was read, and its place below `with`.
struct ReadFile<'a> {
    place: String,
    scan: &'a Scan,
    decision: &'a FileDecision,
}

/// Fails where the same measured rows would be used twice. One log of several days with a file of joints for each day is none: of its
/// rows each is used once.
pub(super) fn no_copies(scanned: &[(Vec<Scan>, Vec<FileDecision>)]) -> Result<()> {
    let mut read: Vec<ReadFile> = Vec::new();
    let mut faults = Vec::new();
    for (set, (scans, decisions)) in scanned.iter().enumerate() {
        for (index, (scan, decision)) in scans.iter().zip(decisions).enumerate() {
            let place = match set.checked_sub(1) {
                None => format!("files[{index}].file"),
                Some(later) => format!("later[{later}].files[{index}]"),
            };
            let this = ReadFile {
                place,
                scan,
                decision,
            };
            let found = read
                .iter()
                .find_map(|other| Some((other, shared(other, &this).filter(|rows| *rows > 0)?)));
            if let Some((other, rows)) = found {
                let message = format!(
                    "`{}` measured what `{}` of `{}` did, and {} would be used twice: copies look like perfect repeatability; name the \
                     file of another measurement, or take this one out",
                    scan.label,
                    other.scan.label,
                    other.place,
                    counted(rows, "row")
                );
                faults.push(Fault::new(format!("with.{}", this.place), message));
            }
            read.push(this);
        }
    }
    Error::if_data(faults)
}

/// Rows that are used of both files; none where what they measured differs.
fn shared(one: &ReadFile, other: &ReadFile) -> Option<u64> {
    if one.scan.measured? != other.scan.measured? {
        return None;
    }
    if one.decision.partners.is_empty() || other.decision.partners.is_empty() {
        return Some(accepted(one.scan, one.decision).min(accepted(other.scan, other.decision)));
    }
    let both = |number: &usize| one.decision.is_whole(*number) && other.decision.is_whole(*number);
    Some((1..=one.scan.read as usize).filter(both).count() as u64)
}

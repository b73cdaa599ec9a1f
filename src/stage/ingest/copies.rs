//! A measurement that the settings name twice: files of equal rows that would be used in both places.

use super::pair::FileDecision;
use super::scan::Scan;
use super::verdict::accepted;
use crate::error::{Error, Fault, Result, counted};

/// A file that was read, and its place below `with`.
struct ReadFile<'a> {
    place: String,
    scan: &'a Scan,
    decision: &'a FileDecision,
}

/// Fails where the same measured rows would be used twice. One log of several days beside a file of joints for each day is none: of its
/// rows each is used once.
pub(super) fn refuse(scanned: &[(Vec<Scan>, Vec<FileDecision>)]) -> Result<()> {
    let mut read: Vec<ReadFile> = Vec::new();
    let mut faults = Vec::new();
    for (set, (scans, decisions)) in scanned.iter().enumerate() {
        for (index, (scan, decision)) in scans.iter().zip(decisions).enumerate() {
            let place = match set.checked_sub(1) {
                None => format!("files[{index}].file"),
                Some(later) => format!("later[{later}].files[{index}]"),
            };
            let own = ReadFile {
                place,
                scan,
                decision,
            };
            let found = read
                .iter()
                .find_map(|other| Some((other, shared(other, &own).filter(|rows| *rows > 0)?)));
            if let Some((other, rows)) = found {
                let message = format!(
                    "`{}` measured what `{}` of `{}` did, and {} would be used twice: copies look like perfect repeatability; name the \
                     file of another measurement, or take this one out",
                    scan.label,
                    other.scan.label,
                    other.place,
                    counted(rows, "row")
                );
                faults.push(Fault::new(format!("with.{}", own.place), message));
            }
            read.push(own);
        }
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(Error::Data(faults))
    }
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

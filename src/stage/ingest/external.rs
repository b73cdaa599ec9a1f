//! Axes beside the arm's own (a track, a positioner) that a file records and nobody mapped: where they move, base or workpiece move with them.

use crate::error::{Error, Result};
use crate::raw::{DecimalMark, Record, number};

/// What such columns are called at controllers, without a number and a unit.
const NAMES: &str =
    "e eax ext extaxis external externalaxis track rail linearaxis positioner gantry";
const UNITS: [&str; 4] = ["deg", "mm", "rad", "m"];
/// An axis that moves by less stands: deg or mm, and rad or m.
const STILL: [f64; 2] = [0.1, 1e-3];
/// What RAPID writes for an axis that is not there.
const NONE: f64 = 9e8;

/// The unit that a name ends in, where it is that of an axis beside the arm's own.
fn external(name: &str) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let last = words.last();
    let unit = last.and_then(|last| UNITS.into_iter().find(|unit| unit == last));
    let words = &words[..words.len() - usize::from(unit.is_some())];
    let joined = words.concat();
    let numbered = joined.trim_end_matches(|c: char| c.is_ascii_digit());
    // RAPID numbers its axes by letters; a bare `e` is no axis.
    let letter = numbered
        .strip_prefix("eax")
        .filter(|letter| letter.len() == 1);
    let bare = letter.map_or(numbered, |_| "eax");
    let is_known = NAMES.split(' ').any(|name| name == bare);
    let is_one = is_known && (bare != "e" || joined.len() == 2);
    is_one.then(|| unit.unwrap_or("deg"))
}

/// Columns of such axes, while a file is read.
pub(super) struct ExternalAxes {
    /// Column, name, unit, least and largest number.
    columns: Vec<(usize, String, &'static str, [f64; 2])>,
    decimal: DecimalMark,
}

impl ExternalAxes {
    /// Those among columns that nobody mapped, of a file with joints.
    pub(super) fn among<'n>(
        unmapped: impl Iterator<Item = (usize, &'n String)>,
        has_joints: bool,
        decimal: DecimalMark,
    ) -> Self {
        const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let axes = unmapped.filter(|_| has_joints);
        let axes = axes
            .filter_map(|(column, name)| Some((column, name.clone(), external(name)?, NOTHING)));
        Self {
            columns: axes.collect(),
            decimal,
        }
    }

    pub(super) fn see(&mut self, record: &Record) {
        for (column, .., [least, most]) in &mut self.columns {
            match number(record.field(*column), self.decimal) {
                Ok(number) if number.abs() < NONE => {
                    (*least, *most) = (least.min(number), most.max(number));
                }
                _ => {}
            }
        }
    }

    /// Fails where one of them moved, in addition to so many joints of the arm.
    pub(super) fn must_stand(&self, label: &str, joints: usize) -> Result<()> {
        let moves = |(.., unit, [least, most]): &&(usize, String, &str, [f64; 2])| {
            most - least > STILL[usize::from(matches!(*unit, "rad" | "m"))]
        };
        let Some((_, name, _, [least, most])) = self.columns.iter().find(moves) else {
            return Ok(());
        };
        let message = format!(
            "column `{name}` is an external axis, in addition to the robot's {joints} joints, and moves from {least} to {most}: what stands on it \
             moves with it, and the robot file does not have it; allowed: the axis as a joint of the robot file, mapped in `q`, rows in which it \
             stands, or another name for the column if it is no axis"
        );
        Err(Error::data(label, message))
    }
}

#[cfg(test)]
mod tests {
    use super::external;

    #[test]
    fn names_of_axes_beside_the_arm_are_known_with_their_units() {
        for (name, unit) in [
            ("eax_a", "deg"),
            ("E1", "deg"),
            ("e2_mm", "mm"),
            ("ext_axis_1_m", "m"),
            ("Track", "deg"),
            ("rail_mm", "mm"),
            ("eax1", "deg"),
        ] {
            assert_eq!(external(name), Some(unit), "{name}");
        }
        for name in [
            "e", "error_1", "q7", "x_mm", "track_id", "e12", "exact", "mm", "",
        ] {
            assert_eq!(external(name), None, "{name}");
        }
    }
}

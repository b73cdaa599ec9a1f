//! Lines of a robot file or a pipeline that are still marked as a proposal.

use crate::raw;
use std::path::Path;

/// What `calib init` writes behind lines to look at, and what is to be done there.
const MARKS: [(&str, &str); 2] =
    [("REPLACE", "put your own there and delete the mark"), ("CHECK", "check that it is right and delete the mark")];

/// Warnings where lines are left that `calib init` marked.
pub fn marked(path: &Path) -> String {
    MARKS.map(|mark| of_mark(path, mark)).concat()
}

/// A warning where lines are left that `calib init` marked, with the lines. A line that is a comment all over sets nothing.
fn of_mark(path: &Path, (mark, what): (&str, &str)) -> String {
    let text = raw::text(path).unwrap_or_default();
    let has_mark = |line: &str| line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|word| word == mark);
    let counts = |line: &str| !line.trim_start().starts_with('#') && has_mark(line);
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).filter(|(_, line)| counts(line)).collect();
    if lines.is_empty() {
        return String::new();
    }
    let many = if lines.len() == 1 { "a line is".into() } else { format!("{} lines are", lines.len()) };
    let mut out = format!("\nwarning: {}: {many} still marked {mark}; {what}\n", path.display());
    lines.iter().for_each(|(number, line)| out.push_str(&format!("  {number}: {}\n", line.trim())));
    out
}

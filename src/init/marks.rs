//! Lines of a robot file or a pipeline that are still marked as a proposal.

use crate::raw;
use std::path::Path;

/// What `calib init` writes behind lines to look at, the label of such lines, and what is to be done there.
const MARKS: [(&str, &str, &str); 2] = [
    (
        "REPLACE",
        "replace",
        "put your value there and delete the mark",
    ),
    (
        "CHECK",
        "check",
        "check that it is right and delete the mark",
    ),
];

/// Lines that are left as `calib init` marked them.
pub struct MarkedLines {
    /// The label of their kind.
    pub label: &'static str,
    /// What is to be done with them.
    pub what: &'static str,
    /// File, number of the line and its text.
    pub lines: Vec<(String, usize, String)>,
}

/// The lines of files that `calib init` marked, those to fill in before those to look at. A line that is a comment all over sets nothing.
pub fn marked(paths: &[&Path]) -> Vec<MarkedLines> {
    let of_mark = |(mark, label, what)| {
        let has_mark = |line: &str| {
            line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .any(|word| word == mark)
        };
        let counts = |line: &str| !line.trim_start().starts_with('#') && has_mark(line);
        let mut lines = Vec::new();
        for path in paths {
            let text = raw::text(path).unwrap_or_default();
            let own = (1..).zip(text.lines()).filter(|(_, line)| counts(line));
            lines.extend(own.map(|(number, line)| {
                (path.display().to_string(), number, line.trim().to_string())
            }));
        }
        MarkedLines { label, what, lines }
    };
    MARKS
        .into_iter()
        .map(of_mark)
        .filter(|marked| !marked.lines.is_empty())
        .collect()
}

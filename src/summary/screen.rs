//! The lines of a result, as `run` and `diagnose` print them: 100 columns at most.

use super::found::ShortFinding;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Columns of a result at most. Two findings side by side need 90; on a terminal that is wider still, an eye loses the line.
const WIDTH: usize = 100;
/// Findings that are told of many: the largest five are nearly all of an error as a rule, and a reader acts on those. One more is told rather
/// than counted, since "and 1 smaller" takes its place.
const FOUND: usize = 5;
/// Lines of them on a wide terminal.
const LINES: usize = 3;
/// Below this (mm) a mean error has four decimals, or before and after would both read 0.00 something.
const SMALL: f64 = 0.01;

/// Columns that a result has, on a terminal of this width or elsewhere.
pub(super) fn width(terminal: Option<usize>) -> usize {
    terminal.map_or(WIDTH, |columns| columns.min(WIDTH))
}

/// What was measured: the robot, its rows, the noise.
pub(super) fn measured(robot: Option<&str>, rows: &str, noise: Option<&str>) -> String {
    let noise = noise.map_or_else(String::new, |noise| format!("; {noise}"));
    let robot = robot.map_or_else(String::new, |robot| cut(robot, WIDTH / 3) + ": ");
    labelled("robot", &format!("{robot}{rows}{noise}"))
}

/// Mean and largest error of a step (mm), with the decimals that suit the smaller of all means.
pub(super) fn errors(label: &str, [mean, largest]: [f64; 2], least: f64, subject: &str) -> String {
    let decimals = if least < SMALL { 4 } else { 3 };
    labelled(
        label,
        &format!("{mean:>7.decimals$} mm mean {largest:>8.decimals$} mm largest  {subject}"),
    )
}

/// What the noise is and rests on.
pub(super) fn noise(size: &str, basis: Option<&str>) -> String {
    match basis {
        Some("repeats") => format!("repeats show {size}"),
        Some("inferred") => "noise not known".into(),
        Some(_) | None => format!("instrument {size}"),
    }
}

/// One thing to do next.
pub(crate) struct NextStep {
    pub(crate) what: String,
    /// What to type for it.
    pub(crate) command: Option<String>,
}

impl NextStep {
    /// To correct one's targets by the model of a run.
    pub(crate) fn correct(run: &str, store: &str) -> Self {
        Self {
            what: "correct your targets".into(),
            command: Some(format!("calib compensate {run} targets.csv{store}")),
        }
    }

    /// Its lines.
    pub fn text(&self, width: usize) -> String {
        match &self.command {
            Some(command) if LABEL + self.what.width() + command.width() + 2 <= width => {
                labelled("next", &format!("{}: {command}", self.what))
            }
            Some(command) => sentence("next", &self.what, width) + &labelled("", command),
            None => sentence("next", &self.what, width),
        }
    }
}

/// A sentence of any length under its label.
pub(super) fn sentence(label: &str, text: &str, width: usize) -> String {
    folded(&labelled(label, text), width)
}

/// The largest findings, two a line where there is room, and how many are smaller; on a wide terminal in three lines, so that a result has ten.
pub(super) fn found(findings: &[ShortFinding], width: usize) -> String {
    let mut findings: Vec<&ShortFinding> = findings.iter().collect();
    findings.sort_by(|a, b| b.magnitude().total_cmp(&a.magnitude()));
    let mut shown = match findings.len() > FOUND + 1 {
        true => FOUND,
        false => findings.len(),
    };
    let mut lines = in_lines(&findings, shown, width);
    // On a narrow terminal each stands alone whatever is done: there the number of findings decides, not that of lines.
    while width >= WIDTH && lines.len() > LINES {
        shown -= 1;
        lines = in_lines(&findings, shown, width);
    }
    let labelled_line =
        |(number, text): (usize, &String)| labelled(if number == 0 { "found" } else { "" }, text);
    lines.iter().enumerate().map(labelled_line).collect()
}

/// Lines of the first findings, and of how many are smaller.
fn in_lines(findings: &[&ShortFinding], shown: usize, width: usize) -> Vec<String> {
    let sizes: Vec<&str> = findings[..shown]
        .iter()
        .map(|one| one.size.as_ref().map_or("", |(_, size)| size.as_str()))
        .collect();
    let right = sizes.iter().map(|size| size.width()).max().unwrap_or(0);
    let room = width.saturating_sub(LABEL);
    let half = room / 2 + 1;
    let mut cells: Vec<String> = sizes
        .iter()
        .zip(findings)
        .map(|(size, one)| {
            let either = one.either.as_deref().unwrap_or_default();
            cut(&format!("{size:>right$}  {}{either}", one.what), room)
        })
        .collect();
    let smaller = findings.len() - shown;
    if smaller > 0 {
        cells.push(format!("{:right$}  and {smaller} smaller", ""));
    }
    let mut lines: Vec<String> = Vec::new();
    let mut open = false;
    for cell in cells {
        let fits = width >= WIDTH && cell.width() + 2 <= half;
        match lines.last_mut().filter(|_| open && fits) {
            Some(line) => {
                *line += &" ".repeat(half - line.width());
                *line += &cell;
                open = false;
            }
            None => {
                lines.push(cell);
                open = fits;
            }
        }
    }
    lines
}

/// A finding with its number under its rank; what it might be instead stands beside it where there is room, else below.
pub(super) fn ranked(rank: i64, finding: &ShortFinding, at: &str, width: usize) -> String {
    let room = width.saturating_sub(LABEL);
    let printed = |at: &str| {
        let size = finding.size.as_ref().map(|(_, size)| format!("{size}{at}"));
        let figures: Vec<String> = finding.number.iter().cloned().chain(size).collect();
        let what = &finding.what;
        match figures.is_empty() {
            true => what.clone(),
            false => format!("{what}: {}", figures.join(", ")),
        }
    };
    let printed_here = printed(at);
    let printed_here = match printed_here.width() <= room {
        true => printed_here,
        false => cut(&printed(""), room),
    };
    let label = format!("{rank:>3}.");
    match &finding.instead {
        Some(instead) if printed_here.width() + instead.width() + 2 <= room => {
            labelled(&label, &format!("{printed_here}; {instead}"))
        }
        Some(instead) => labelled(&label, &printed_here) + &labelled("", &cut(instead, room)),
        None => labelled(&label, &printed_here),
    }
}

/// Names in a line, as many as there is room for.
pub(super) fn names(label: &str, all: &[String], width: usize) -> String {
    let room = width.saturating_sub(LABEL);
    let shown = |count: usize| {
        let remaining = all.len() - count;
        let more = if remaining > 0 {
            format!(" and {remaining} more")
        } else {
            String::new()
        };
        all[..count].join(", ") + &more
    };
    let fits = (1..=all.len())
        .rev()
        .map(shown)
        .find(|text| text.width() <= room);
    fits.or_else(|| all.first().cloned())
        .map_or_else(String::new, |text| labelled(label, &cut(&text, room)))
}

/// A text of this width at most, `…` for what is cut off.
pub(super) fn cut(text: &str, width: usize) -> String {
    if text.width() <= width {
        return text.into();
    }
    let mut out = String::new();
    for c in text.chars() {
        if out.width() + c.width().unwrap_or(0) + 1 > width {
            break;
        }
        out.push(c);
    }
    out + "…"
}

/// Columns of a label.
pub const LABEL: usize = 10;
/// A terminal narrower than this breaks lines itself.
const NARROWEST: usize = 40;

/// A label and its text on a line.
pub fn labelled(label: &str, text: &str) -> String {
    format!("{label:LABEL$}{text}\n")
}

/// The same lines, none wider than `width` but for words that are longer and commands, which are there to be copied.
pub fn folded(text: &str, width: usize) -> String {
    let fold = |line: &str| {
        // A command that is broken over lines cannot be copied.
        if line.trim_start().starts_with("calib ") {
            format!("{line}\n")
        } else {
            broken(line, width)
        }
    };
    if width < NARROWEST {
        text.into()
    } else {
        text.lines().map(fold).collect()
    }
}

fn broken(line: &str, width: usize) -> String {
    let mut out = String::new();
    let mut column = 0;
    for (k, word) in line.split(' ').enumerate() {
        if k > 0 && column + 1 + word.width() > width && column > LABEL {
            out.push_str(&format!("\n{:LABEL$}", ""));
            column = LABEL;
        } else if k > 0 {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += word.width();
    }
    out + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(mm: f64, what: &str) -> ShortFinding {
        let size = Some((mm, format!("{mm:.2} mm")));
        ShortFinding {
            size,
            what: what.into(),
            own: what.into(),
            number: Some("14.8 +- 0.4 arcsec".into()),
            either: None,
            instead: None,
        }
    }

    fn several(count: usize) -> Vec<ShortFinding> {
        (1..=count)
            .map(|k| finding(k as f64, &format!("joint {k} yields under load")))
            .collect()
    }

    #[test]
    fn the_five_largest_findings_stand_two_a_line_and_the_others_are_counted() {
        assert_eq!(
            found(&several(17), 100),
            "found     17.00 mm  joint 17 yields under load          16.00 mm  joint 16 yields under load\n          \
             15.00 mm  joint 15 yields under load          14.00 mm  joint 14 yields under load\n          \
             13.00 mm  joint 13 yields under load                    and 12 smaller\n"
        );
        assert_eq!(found(&several(6), 100).lines().count(), 3);
        let long: Vec<ShortFinding> = (1..=6)
            .map(|k| finding(k as f64, &"x".repeat(10 * k)))
            .collect();
        let text = found(&long, 100);
        assert!(
            text.lines().count() == 3 && text.contains("5.00 mm") && text.contains("and 4 smaller"),
            "{text}"
        );
        let narrow = found(&several(17), 80);
        assert!(
            narrow.lines().count() == 6 && narrow.lines().all(|line| line.width() <= 80),
            "{narrow}"
        );
        assert_eq!(found(&[], 100), "");
    }

    #[test]
    fn no_line_is_wider_than_the_result() {
        let long = ShortFinding {
            instead: Some("or: joint 4 errs with angle and direction (31 %)".into()),
            ..finding(0.1, &"x".repeat(70))
        };
        for width in [60, 80, 100] {
            let text = ranked(3, &long, " at the tool", width)
                + &found(&[finding(0.1, &"x".repeat(120))], width);
            let text = text + &names("not seen", &vec!["temperature".to_string(); 20], width);
            assert!(text.lines().all(|line| line.width() <= width), "{text}");
            assert!(
                text.contains("or: joint 4") && text.contains(" more\n"),
                "{text}"
            );
        }
    }

    #[test]
    fn a_long_text_is_broken_at_spaces_under_its_label() {
        assert_eq!(labelled("verdict", "explained"), "verdict   explained\n");
        let text = folded(&labelled("next", &"poses ".repeat(30)), 60);
        assert!(
            text.lines().count() > 2 && text.lines().all(|line| line.len() <= 60),
            "{text}"
        );
        assert!(
            text.lines()
                .skip(1)
                .all(|line| line.starts_with("          poses")),
            "{text}"
        );
        for whole in [
            labelled("report", &"x".repeat(120)),
            labelled("", &format!("calib poses {}", "a ".repeat(60))),
        ] {
            assert_eq!(folded(&whole, 60), whole);
        }
    }
}

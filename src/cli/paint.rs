//! Colours of a result on a terminal: labels stand out, a verdict has the colour of what it means.

use crate::summary::LABEL;
use anstyle::{AnsiColor, Style};

/// Labels of lines that say what is to be seen to, and all others.
const ALARMS: [&str; 4] = ["warning", "doubt", "rejected", "withdrawn"];
const LABELS: [&str; 14] = [
    "robot",
    "before",
    "after",
    "carried",
    "found",
    "verdict",
    "next",
    "report",
    "limits",
    "not seen",
    "set aside",
    "done",
    "error",
    "more",
];

/// What a verdict begins with, and its colour.
const VERDICTS: [(&str, AnsiColor); 7] = [
    ("explained", AnsiColor::Green),
    ("nothing missing", AnsiColor::Green),
    ("unexplained", AnsiColor::Yellow),
    ("identified", AnsiColor::Yellow),
    ("not asked", AnsiColor::Yellow),
    ("wrong set-up", AnsiColor::Red),
    ("not accepted", AnsiColor::Red),
];

/// The same lines with bold labels; of the others nothing changes.
pub(crate) fn painted(text: &str) -> String {
    text.lines().map(|line| line_of(line) + "\n").collect()
}

fn line_of(line: &str) -> String {
    let Some((label, rest)) = line.split_at_checked(LABEL) else {
        return line.into();
    };
    let word = label.trim();
    let rank = word
        .strip_suffix('.')
        .is_some_and(|digits| digits.parse::<u32>().is_ok());
    let bold = match () {
        () if ALARMS.contains(&word) => {
            Style::new().bold().fg_color(Some(AnsiColor::Yellow.into()))
        }
        () if rank || LABELS.contains(&word) => Style::new().bold(),
        () => return line.into(),
    };
    let judges = ["verdict", "limits"].contains(&word);
    let verdict = VERDICTS
        .iter()
        .find(|(begins, _)| judges && rest.starts_with(begins));
    let rest = match verdict {
        Some((word, colour)) => {
            let colour = Style::new().bold().fg_color(Some((*colour).into()));
            format!("{colour}{word}{colour:#}{}", &rest[word.len()..])
        }
        None => rest.into(),
    };
    format!("{bold}{label}{bold:#}{rest}")
}

#[cfg(test)]
mod tests {
    use super::painted;

    #[test]
    fn a_verdict_has_its_colour_and_text_stays_as_it_is() {
        let screen = painted("verdict   explained: all of it\n          calib poses --run HEAD\n");
        assert_eq!(
            screen,
            "\u{1b}[1mverdict   \u{1b}[0m\u{1b}[1m\u{1b}[32mexplained\u{1b}[0m: all of it\n          calib poses --run HEAD\n"
        );
        assert!(
            painted("warning   late\n").starts_with("\u{1b}[1m\u{1b}[33mwarning   \u{1b}[0mlate")
        );
        for plain in [
            "short\n",
            "  step       set             points\n",
            "          calib poses\n",
        ] {
            assert_eq!(painted(plain), plain);
        }
    }
}

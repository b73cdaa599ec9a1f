//! Lines of a result: a label, then text; on a terminal long ones are broken at spaces and indented.

use unicode_width::UnicodeWidthStr;

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
    use super::{folded, labelled};

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

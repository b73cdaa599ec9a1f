//! Lines of a result: a label, then text that is broken at spaces and indented.

use unicode_width::UnicodeWidthStr;

/// Columns of a line, and of its label.
const WIDTH: usize = 100;
const LABEL: usize = 10;

/// A label and its text; a word that is longer than a line (a path, a command's argument) stays whole.
pub fn labelled(label: &str, text: &str) -> String {
    let mut out = format!("{label:LABEL$}");
    let mut column = LABEL;
    for (k, word) in text.split(' ').enumerate() {
        if k > 0 && column + 1 + word.width() > WIDTH {
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
    use super::labelled;

    #[test]
    fn a_long_text_is_broken_at_spaces_under_its_label() {
        assert_eq!(labelled("verdict", "explained"), "verdict   explained\n");
        let text = labelled("next", &"poses ".repeat(30));
        assert!(text.lines().all(|line| line.len() <= 100), "{text}");
        assert!(text.lines().skip(1).all(|line| line.starts_with("          poses")), "{text}");
        let path = "x".repeat(120);
        assert_eq!(labelled("report", &path), format!("report    {path}\n"));
    }
}

//! Sentences that tables hold as English text, read by patterns: what a stage wrote, a later calib or another language can only read again.
//!
//! Holes of a pattern: `{}` is a text that is read itself, `{#}` a number, `{=}` what stays as it is. In the translation `{}` is the next of
//! them, `{2}` the second. Of several patterns that fit the one with most letters is taken, and only where all its holes can be read.

use super::filled;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// How deep a text is made of texts.
const DEEPEST: usize = 12;

/// A part of an English sentence.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Piece {
    Letters(&'static str),
    Text,
    Number,
    Name,
}

const HOLES: [(&str, Piece); 3] = [
    ("{}", Piece::Text),
    ("{#}", Piece::Number),
    ("{=}", Piece::Name),
];

/// The patterns of one language.
pub(super) struct StoredSentences {
    whole: BTreeMap<&'static str, &'static str>,
    /// With their translation; those with most letters first.
    patterns: Vec<(Vec<Piece>, &'static str)>,
}

impl StoredSentences {
    pub(super) fn of(table: impl Iterator<Item = (&'static str, &'static str)>) -> Self {
        let all = table.map(|(key, other)| (key, pieces(key), other));
        let (whole, patterns): (Vec<_>, Vec<_>) =
            all.partition(|(_, pieces, _)| matches!(pieces[..], [] | [Piece::Letters(_)]));
        let mut patterns: Vec<_> = patterns
            .into_iter()
            .map(|(_, pieces, other)| (pieces, other))
            .collect();
        let letters = |piece: &Piece| match piece {
            Piece::Letters(letters) => letters.len(),
            _ => 0,
        };
        patterns.sort_by_key(|(pieces, _)| {
            std::cmp::Reverse(pieces.iter().map(letters).sum::<usize>())
        });
        Self {
            whole: whole
                .into_iter()
                .map(|(key, _, other)| (key, other))
                .collect(),
            patterns,
        }
    }

    /// A text in the other language; none where the table does not have it.
    pub(super) fn translated(&self, text: &str) -> Option<String> {
        let known = RefCell::default();
        Reading { table: self, known }.text(text, 0)
    }
}

/// A pattern taken apart; braces around anything else are letters.
fn pieces(pattern: &'static str) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut text = pattern;
    let next = |text: &str| {
        let found = HOLES
            .iter()
            .filter_map(|(hole, piece)| Some((text.find(hole)?, hole.len(), *piece)));
        found.min_by_key(|(at, ..)| *at)
    };
    while let Some((at, long, piece)) = next(text) {
        pieces.extend((at > 0).then(|| Piece::Letters(&text[..at])));
        pieces.push(piece);
        text = &text[at + long..];
    }
    pieces.extend((!text.is_empty()).then_some(Piece::Letters(text)));
    pieces
}

/// One sentence as it is read; what its parts were is remembered.
struct Reading<'a> {
    table: &'a StoredSentences,
    known: RefCell<BTreeMap<String, Option<String>>>,
}

impl Reading<'_> {
    fn text(&self, text: &str, depth: usize) -> Option<String> {
        if !text.chars().any(char::is_alphabetic) || is_number(text) {
            return Some(with_comma(text));
        }
        if let Some(known) = self.known.borrow().get(text) {
            return known.clone();
        }
        if depth > DEEPEST {
            return None;
        }
        let whole = self.table.whole.get(text).map(|whole| whole.to_string());
        let found = whole.or_else(|| {
            self.table.patterns.iter().find_map(|(pieces, other)| {
                let mut holes = Vec::new();
                let fits = self.fits(pieces, text, depth, &mut holes);
                let mut next = 0..;
                let hole = |number: &str| {
                    let following = next.next()?;
                    let at = number.parse().map_or(following, |number: usize| number - 1);
                    holes.get(at).cloned()
                };
                fits.then(|| filled(other, hole)).flatten()
            })
        });
        self.known.borrow_mut().insert(text.into(), found.clone());
        found
    }

    /// Whether a text is a sentence of these pieces; the translated holes are added to `holes`.
    fn fits(&self, pieces: &[Piece], text: &str, depth: usize, holes: &mut Vec<String>) -> bool {
        let Some((piece, after)) = pieces.split_first() else {
            return text.is_empty();
        };
        if let Piece::Letters(letters) = piece {
            return text
                .strip_prefix(letters)
                .is_some_and(|text| self.fits(after, text, depth, holes));
        }
        let ends: Vec<usize> = match after.first() {
            None => vec![text.len()],
            Some(Piece::Letters(letters)) => {
                text.match_indices(letters).map(|(at, _)| at).collect()
            }
            Some(_) => text.char_indices().map(|(at, _)| at).collect(),
        };
        ends.into_iter().filter(|end| *end > 0).any(|end| {
            let part = &text[..end];
            let hole = match piece {
                Piece::Number => is_number(part).then(|| with_comma(part)),
                Piece::Name => Some(part.to_string()),
                _ => self.text(part, depth + 1),
            };
            let Some(hole) = hole else { return false };
            let before = holes.len();
            holes.push(hole);
            let fit = self.fits(after, &text[end..], depth, holes);
            if !fit {
                holes.truncate(before);
            }
            fit
        })
    }
}

/// Whether a text is a number, or a list or a range of numbers, with signs and powers of ten.
fn is_number(text: &str) -> bool {
    let mark = |c: char| ".,+-\u{2212}\u{b1}\u{2013};% \u{202f}\u{a0}".contains(c);
    let letters: Vec<char> = text.chars().collect();
    let power = |k: usize| {
        let digit = |letter: Option<&char>| letter.is_some_and(char::is_ascii_digit);
        let next = letters.get(k + 1);
        letters[k] == 'e'
            && k > 0
            && digit(letters.get(k - 1))
            && (next == Some(&'-') || digit(next))
    };
    letters.iter().any(char::is_ascii_digit)
        && !text.starts_with([' ', ',', ';'])
        && !text.ends_with([' ', ',', ';', '.'])
        && (0..letters.len()).all(|k| letters[k].is_ascii_digit() || mark(letters[k]) || power(k))
}

/// Numbers with decimal commas; what has two points is no number. Numbers of a list are set apart by semicolons then.
fn with_comma(text: &str) -> String {
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let runs = text.split_inclusive(|c| !is_part(c)).map(|run| {
        let number = run.trim_end_matches(|c| !is_part(c));
        match number.split_once('.') {
            Some((whole, part)) if !whole.is_empty() && !part.is_empty() && !part.contains('.') => {
                run.replacen('.', ",", 1)
            }
            _ => run.into(),
        }
    });
    let out: String = runs.collect();
    if out == text {
        out
    } else {
        out.replace(", ", "; ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: [(&str, &str); 6] = [
        ("joint {#}", "Gelenk {}"),
        (
            "the zero of {} steps by {#} {} from row {#}",
            "{1} springt ab Zeile {4} um {2} {3}",
        ),
        ("arcsec", "\u{2033}"),
        ("{} ({=})", "{} ({})"),
        ("{}, {}", "{}, {}"),
        ("`{by: id}`, or {}", "`{by: id}`, oder {}"),
    ];

    #[test]
    fn a_text_is_made_of_texts_numbers_and_names() {
        let table = StoredSentences::of(TABLE.into_iter());
        for (english, german) in [
            (
                "the zero of joint 2 steps by 15.5 arcsec from row 40",
                Some("Gelenk 2 springt ab Zeile 40 um 15,5 \u{2033}"),
            ),
            (
                "joint 2, joint 3 (a.b 1.5)",
                Some("Gelenk 2, Gelenk 3 (a.b 1.5)"),
            ),
            ("`{by: id}`, or joint 7", Some("`{by: id}`, oder Gelenk 7")),
            ("the zero of the base steps by 15 arcsec from row 40", None),
        ] {
            assert_eq!(table.translated(english).as_deref(), german);
        }
    }

    #[test]
    fn numbers_have_commas_and_versions_points() {
        for (text, comma) in [
            ("0.125", "0,125"),
            (
                "1\u{202f}834.1 \u{b1} 2.5e-7",
                "1\u{202f}834,1 \u{b1} 2,5e-7",
            ),
            ("312.0, 0.0, 75.5", "312,0; 0,0; 75,5"),
            ("0.2.0", "0.2.0"),
            ("1, 4, 6", "1, 4, 6"),
        ] {
            assert!(is_number(text), "{text}");
            assert_eq!(with_comma(text), comma);
        }
        assert!(!is_number("10 mm") && !is_number("e5") && !is_number(" 5") && !is_number("j1"));
    }
}

//! A table of sentences: English with holes, and what stands for it in another language.
//!
//! Two lines each, the second behind `= `. Holes of the English: `{}` is a text that is translated itself, `{#}` a number, `{=}` what stays
//! as it is. In the other language `{}` is the next of them, `{2}` the second. Of several sentences that fit the one with most letters is
//! taken, and only where all its holes can be translated.

use std::cell::RefCell;
use std::collections::BTreeMap;

/// How deep a text is made of texts.
const DEEPEST: usize = 12;

/// A part of an English sentence.
#[derive(Debug, PartialEq)]
enum Piece {
    Letters(&'static str),
    Text,
    Number,
    Name,
}

/// A sentence with holes.
#[derive(Debug)]
struct Pattern {
    pieces: Vec<Piece>,
    other: &'static str,
}

/// The sentences of one language.
pub(super) struct Phrases {
    /// The English ones, in the order of the table.
    pub(crate) english: Vec<&'static str>,
    whole: BTreeMap<&'static str, &'static str>,
    /// Those with most letters first.
    patterns: Vec<Pattern>,
}

impl Phrases {
    /// Reads a table; lines that begin with `#` are for its readers.
    pub fn of(table: &'static str) -> Self {
        let lines: Vec<&str> = table
            .lines()
            .filter(|line| !line.is_empty() && !line.starts_with('#'))
            .collect();
        let pairs = lines
            .chunks(2)
            .filter_map(|pair| Some((pair[0], pair.get(1)?.strip_prefix("= ")?)));
        let (mut english, mut whole, mut patterns) = (Vec::new(), BTreeMap::new(), Vec::new());
        for (key, other) in pairs {
            english.push(key);
            match pieces(key) {
                own if own.iter().any(|piece| !matches!(piece, Piece::Letters(_))) => {
                    patterns.push(Pattern { pieces: own, other })
                }
                _ => {
                    whole.insert(key, other);
                }
            }
        }
        patterns.sort_by_key(|pattern| std::cmp::Reverse(pattern.letters()));
        Self {
            english,
            whole,
            patterns,
        }
    }
}

impl Pattern {
    fn letters(&self) -> usize {
        self.pieces
            .iter()
            .map(|piece| {
                if let Piece::Letters(letters) = piece {
                    letters.len()
                } else {
                    0
                }
            })
            .sum()
    }

    /// The other language with its holes filled; braces around anything but a number are letters.
    fn filled(&self, holes: &[String]) -> String {
        let mut parts = self.other.split('{');
        let mut out = parts.next().unwrap_or_default().to_string();
        let mut next = 0;
        for part in parts {
            let hole = part
                .split_once('}')
                .filter(|(number, _)| number.chars().all(|c| c.is_ascii_digit()));
            let Some((number, after)) = hole else {
                out.push('{');
                out.push_str(part);
                continue;
            };
            let hole = number
                .parse()
                .map_or(next, |number: usize| number.saturating_sub(1));
            next += 1;
            out.push_str(holes.get(hole).map_or("", String::as_str));
            out.push_str(after);
        }
        out
    }
}

/// An English sentence taken apart; braces around anything else are letters.
fn pieces(key: &'static str) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let (mut begin, mut at) = (0, 0);
    while let Some(open) = key[at..].find('{').map(|open| at + open) {
        let hole = [
            ("{}", Piece::Text),
            ("{#}", Piece::Number),
            ("{=}", Piece::Name),
        ];
        let Some((mark, piece)) = hole
            .into_iter()
            .find(|(mark, _)| key[open..].starts_with(mark))
        else {
            at = open + 1;
            continue;
        };
        if open > begin {
            pieces.push(Piece::Letters(&key[begin..open]));
        }
        pieces.push(piece);
        at = open + mark.len();
        begin = at;
    }
    if begin < key.len() {
        pieces.push(Piece::Letters(&key[begin..]));
    }
    pieces
}

/// Translates texts and remembers them.
pub(super) struct PhraseReader<'a> {
    phrases: &'a Phrases,
    known: RefCell<BTreeMap<String, Option<String>>>,
}

impl<'a> PhraseReader<'a> {
    pub fn new(phrases: &'a Phrases) -> Self {
        Self {
            phrases,
            known: RefCell::default(),
        }
    }

    /// A text in the other language; none where the table does not have it.
    pub(crate) fn translate(&self, text: &str) -> Option<String> {
        self.within(text, 0)
    }

    fn within(&self, text: &str, depth: usize) -> Option<String> {
        if !text.chars().any(char::is_alphabetic) || is_number(text) {
            return Some(with_comma(text));
        }
        if let Some(known) = self.known.borrow().get(text) {
            return known.clone();
        }
        if depth > DEEPEST {
            return None;
        }
        let mut found = self.sentence(text, depth);
        let first = text.chars().next().filter(|letter| letter.is_uppercase());
        if let (None, Some(first)) = (&found, first) {
            // The beginning of a sentence that stands within others in the table.
            let small = first
                .to_lowercase()
                .chain(text.chars().skip(1))
                .collect::<String>();
            found = self.sentence(&small, depth).map(|found| capital(&found));
        }
        self.known.borrow_mut().insert(text.into(), found.clone());
        found
    }

    fn sentence(&self, text: &str, depth: usize) -> Option<String> {
        if let Some(whole) = self.phrases.whole.get(text) {
            return Some((*whole).into());
        }
        self.phrases.patterns.iter().find_map(|pattern| {
            let mut holes = Vec::new();
            self.fits(&pattern.pieces, text, depth, &mut holes)
                .then(|| pattern.filled(&holes))
        })
    }

    /// Whether a text is a sentence of these pieces; the translated holes are added to `holes`.
    fn fits(&self, pieces: &[Piece], text: &str, depth: usize, holes: &mut Vec<String>) -> bool {
        let Some((piece, rest)) = pieces.split_first() else {
            return text.is_empty();
        };
        if let Piece::Letters(letters) = piece {
            return text
                .strip_prefix(letters)
                .is_some_and(|text| self.fits(rest, text, depth, holes));
        }
        let ends: Vec<usize> = match rest.first() {
            None => vec![text.len()],
            Some(Piece::Letters(letters)) => {
                text.match_indices(letters).map(|(at, _)| at).collect()
            }
            Some(_) => text.char_indices().map(|(at, _)| at).collect(),
        };
        ends.into_iter().filter(|end| *end > 0).any(|end| {
            let own = &text[..end];
            let hole = match piece {
                Piece::Number => is_number(own).then(|| with_comma(own)),
                Piece::Name => Some(own.to_string()),
                _ => self.within(own, depth + 1),
            };
            let Some(hole) = hole else { return false };
            let before = holes.len();
            holes.push(hole);
            let fit = self.fits(rest, &text[end..], depth, holes);
            if !fit {
                holes.truncate(before);
            }
            fit
        })
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Whether a text is a number, or a list or a range of numbers, with signs and powers of ten.
fn is_number(text: &str) -> bool {
    let text = ["&lt; ", "> ", "\u{2264} "]
        .iter()
        .find_map(|mark| text.strip_prefix(mark))
        .unwrap_or(text);
    let mark = |c: char| ".,+-\u{2212}\u{b1}\u{2013};% \u{202f}\u{a0}".contains(c);
    let letters: Vec<char> = text.chars().collect();
    let power = |k: usize| {
        let digit = |k: Option<usize>| {
            k.and_then(|k| letters.get(k))
                .is_some_and(char::is_ascii_digit)
        };
        letters[k] == 'e'
            && digit(k.checked_sub(1))
            && letters
                .get(k + 1)
                .is_some_and(|next| *next == '-' || next.is_ascii_digit())
    };
    letters.iter().any(char::is_ascii_digit)
        && !text.starts_with([' ', ',', ';'])
        && !text.ends_with([' ', ',', ';', '.'])
        && (0..letters.len()).all(|k| letters[k].is_ascii_digit() || mark(letters[k]) || power(k))
}

/// Numbers with decimal commas; what has two points is no number. Numbers of a list are set apart by semicolons then.
fn with_comma(text: &str) -> String {
    let letters: Vec<char> = text.chars().collect();
    let digit = |k: usize| letters.get(k).is_some_and(char::is_ascii_digit);
    let run = |from: usize, step: isize| {
        let next = |k: &usize| k.checked_add_signed(step).filter(|k| digit(*k));
        std::iter::successors(Some(from), next)
            .last()
            .and_then(|k| k.checked_add_signed(step))
    };
    let is_point = |k: Option<usize>| k.and_then(|k| letters.get(k)) == Some(&'.');
    let decimal = |k: usize| {
        let between = letters[k] == '.' && k > 0 && digit(k - 1) && digit(k + 1);
        let more = || {
            is_point(run(k - 1, -1))
                || run(k + 1, 1).is_some_and(|end| is_point(Some(end)) && digit(end + 1))
        };
        between && !more()
    };
    let out: String = (0..letters.len())
        .map(|k| if decimal(k) { ',' } else { letters[k] })
        .collect();
    if out.len() == text.len() && out != text {
        out.replace(", ", "; ")
    } else {
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "# a remark\njoint {#}\n= Gelenk {}\n\nthe zero of {} steps by {#} {} from row {#}\n= {1} springt ab Zeile {4} um {2} {3}\narcsec\n= \u{2033}\n\
                         {} ({=})\n= {} ({})\n{}, {}\n= {}, {}\n`{by: id}`, or {}\n= `{by: id}`, oder {}\n{}.\n= {}.\n";

    #[test]
    fn a_text_is_made_of_texts_numbers_and_names() {
        let phrases = Phrases::of(TABLE);
        let reader = PhraseReader::new(&phrases);
        let said = |text: &str| reader.translate(text);
        assert_eq!(
            said("The zero of joint 2 steps by 15.5 arcsec from row 40.").as_deref(),
            Some("Gelenk 2 springt ab Zeile 40 um 15,5 \u{2033}.")
        );
        assert_eq!(
            said("joint 2, joint 3 (a.b 1.5)").as_deref(),
            Some("Gelenk 2, Gelenk 3 (a.b 1.5)")
        );
        assert_eq!(
            said("`{by: id}`, or joint 7").as_deref(),
            Some("`{by: id}`, oder Gelenk 7")
        );
        assert_eq!(
            said("the zero of the base steps by 15 arcsec from row 40"),
            None
        );
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

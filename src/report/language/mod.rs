//! The language of a page: its sentences and its numbers.
//!
//! Sentences are messages as gettext has them: the English with named holes is what the table of a language, `de.po`, finds its translation
//! by. Rust says them by [`say!`], templates by `_("...", name=...)`. English sentences that tables hold are read by [`stored`].
//!
//! Sentences that tables hold as English text, read by patterns: what a stage wrote, a later calib or another language can only read again.
//!
//! Holes of a pattern: `{}` is a text that is read itself, `{#}` a number, `{=}` what stays as it is. In the translation `{}` is the next of
//! them, `{2}` the second. Of several patterns that fit the one with most letters is taken, and only where all its holes can be read.

use minijinja::value::{Kwargs, Value};
use minijinja::{Environment, ErrorKind, HtmlEscape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock, Mutex};

/// A language that the report can be read in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum PageLanguage {
    /// English.
    #[default]
    #[serde(rename = "en")]
    English,
    /// German, with decimal commas.
    #[serde(rename = "de")]
    German,
}

/// The tables of a language.
struct Catalogue {
    messages: BTreeMap<&'static str, &'static str>,
    stored: StoredSentences,
}

static GERMAN: LazyLock<Catalogue> = LazyLock::new(|| Catalogue {
    messages: entries(include_str!("de.po")).collect(),
    stored: StoredSentences::of(entries(include_str!("de_stored.po"))),
});

/// The messages of a table in gettext's format, each a line of English and a line of its translation.
fn entries(table: &'static str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let text = |line: &'static str, key: &str| line.strip_prefix(key)?.strip_suffix('"');
    let pairs = table.lines().zip(table.lines().skip(1));
    pairs.filter_map(move |(id, other)| Some((text(id, "msgid \"")?, text(other, "msgstr \"")?)))
}

impl PageLanguage {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::English, Self::German];

    /// As settings and the command line name it.
    pub fn code(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::German => "de",
        }
    }

    /// The language of a code.
    pub fn of_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.code() == code)
    }

    fn catalogue(self) -> Option<&'static Catalogue> {
        match self {
            Self::English => None,
            Self::German => Some(&GERMAN),
        }
    }

    /// A sentence that a table holds, in this language; none where its table has no such sentence.
    pub fn stored(self, english: &str) -> Option<String> {
        match self.catalogue() {
            None => Some(micro(english)),
            Some(catalogue) => catalogue.stored.translated(english),
        }
    }
}

/// A language with its numbers, and what it had no translation of.
#[derive(Debug, Clone, Default)]
pub(super) struct Locale {
    language: PageLanguage,
    missing: Arc<Mutex<BTreeSet<String>>>,
}

/// A message in the language of a locale, filled: `say!(locale, "{points} of {all}", points, all = 3)`. The compiler holds names and holes
/// against each other.
macro_rules! say {
    (@ $name:ident) => { $name.to_string() };
    (@ $name:ident = $value:expr) => { $value.to_string() };
    ($locale:expr, $id:literal $(, $name:ident $(= $value:expr)?)* $(,)?) => {{
        let _ = format_args!($id $(, $name = "")*);
        $locale.say($id, &[$((stringify!($name), say!(@ $name $(= $value)?))),*])
    }};
}
pub(super) use say;

impl Locale {
    pub(super) fn new(language: PageLanguage) -> Self {
        Self {
            language,
            ..Self::default()
        }
    }

    /// What stayed English since the language's tables lack it.
    pub(super) fn missing(&self) -> Vec<String> {
        let missing = self.missing.lock();
        missing.map_or_else(|_| Vec::new(), |missing| missing.iter().cloned().collect())
    }

    fn miss(&self, english: &str) {
        if let Ok(mut missing) = self.missing.lock() {
            missing.insert(english.into());
        }
    }

    /// What [`say!`] calls.
    pub(super) fn say(&self, id: &str, arguments: &[(&str, String)]) -> String {
        let of_name = |name: &str| arguments.iter().find(|(known, _)| *known == name);
        let filled = self.message(id, |name| of_name(name).map(|(_, value)| value.clone()));
        filled.unwrap_or_else(|| id.into())
    }

    /// A message with its holes filled; none where one has no argument.
    fn message(&self, id: &str, argument: impl FnMut(&str) -> Option<String>) -> Option<String> {
        let catalogue = self.language.catalogue();
        let translated = catalogue.map(|catalogue| catalogue.messages.get(id).copied());
        if translated == Some(None) {
            self.miss(id);
        }
        filled(translated.flatten().unwrap_or(id), argument)
    }

    /// A text of a table; as it is where the language's table lacks it.
    pub(super) fn stored(&self, english: &str) -> String {
        self.language.stored(english).unwrap_or_else(|| {
            self.miss(english);
            english.into()
        })
    }

    /// A statement of a table as a sentence.
    pub(super) fn sentence(&self, statement: &str) -> String {
        let statement = statement.trim_end_matches('.');
        // Some tables hold statements as sentences already.
        let stored = self.language.stored(statement);
        let stored = stored.or_else(|| self.language.stored(&with_small_letter(statement)));
        sentence_case(&stored.unwrap_or_else(|| {
            self.miss(statement);
            statement.into()
        }))
    }

    /// A number that was written with a decimal point.
    pub(super) fn decimal(&self, number: String) -> String {
        match self.language {
            PageLanguage::English => number,
            PageLanguage::German => number.replace('.', ","),
        }
    }

    /// What templates say and read: `_("...", name=...)` as gettext has it, its arguments escaped and the message not, and the filters `stored` and `sentence`.
    pub(super) fn teach(&self, environment: &mut Environment) {
        let (messages, tables, statements) = (self.clone(), self.clone(), self.clone());
        environment.add_function("_", move |id: &str, arguments: Kwargs| {
            let escaped = |value: Value| match value.is_safe() {
                true => value.to_string(),
                false => HtmlEscape(&value.to_string()).to_string(),
            };
            let argument = |name: &str| arguments.get::<Value>(name).ok().map(escaped);
            let filled = messages.message(id, argument).ok_or_else(|| {
                minijinja::Error::new(ErrorKind::MissingArgument, format!("of `{id}`"))
            })?;
            arguments.assert_all_used()?;
            Ok(Value::from_safe_string(filled))
        });
        environment.add_filter("stored", move |english: &str| tables.stored(english));
        let language = self.language;
        // Names of causes that a user declares stay.
        environment.add_filter("cause", move |effect: &str| {
            let name = effect.replace('_', " ");
            language.stored(&name).unwrap_or(name)
        });
        environment.add_filter("sentence", move |english: &str| {
            statements.sentence(english)
        });
        environment.add_global("lang", self.language.code());
    }
}

fn with_small_letter(sentence: &str) -> String {
    let mut letters = sentence.chars();
    let first = letters.next().map(|letter| letter.to_lowercase());
    first.into_iter().flatten().chain(letters).collect()
}

/// A statement as a sentence.
pub(super) fn sentence_case(statement: &str) -> String {
    let mut letters = statement.chars();
    let first = letters
        .next()
        .map(|letter| letter.to_uppercase().to_string())
        .unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

/// A text with its holes filled, `{name}` or `{}`; other braces are letters. None where a hole has no argument.
fn filled(text: &str, mut argument: impl FnMut(&str) -> Option<String>) -> Option<String> {
    let mut parts = text.split('{');
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let hole = part.split_once('}').filter(|(name, _)| {
            let mut letters = name.chars();
            letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
        });
        if let Some((name, after)) = hole {
            out += &argument(name)?;
            out += after;
        } else {
            out.push('{');
            out += part;
        }
    }
    Some(out)
}

/// A text whose `um` and `urad` are written as a page can, but for what is to be copied.
fn micro(text: &str) -> String {
    let written = |word: &str| {
        let core = word.trim_start_matches('(');
        let unit = core.trim_end_matches(|c: char| !c.is_alphanumeric());
        let is_unit = ["um", "um/m", "urad", "urad/Nm"].contains(&unit);
        word.replacen('u', if is_unit { "\u{b5}" } else { "u" }, 1)
    };
    let parts = text.split('`').enumerate().map(|(k, part)| match k % 2 {
        0 => part.split(' ').map(written).collect::<Vec<_>>().join(" "),
        _ => part.into(),
    });
    parts.collect::<Vec<_>>().join("`")
}

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
pub struct StoredSentences {
    whole: BTreeMap<&'static str, &'static str>,
    /// With their translation; those with most letters first.
    patterns: Vec<(Vec<Piece>, &'static str)>,
}

impl StoredSentences {
    pub fn of(table: impl Iterator<Item = (&'static str, &'static str)>) -> Self {
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
    pub fn translated(&self, text: &str) -> Option<String> {
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
        // The name of a cause is read as its words.
        let whole = self.table.whole.get(text).copied().or_else(|| {
            let words = text.contains('_').then(|| text.replace('_', " "))?;
            self.table.whole.get(words.as_str()).copied()
        });
        let found = whole.map(str::to_string).or_else(|| {
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
    use super::{Locale, PageLanguage, micro};

    #[test]
    fn a_message_is_filled_in_its_language_and_stays_english_where_that_lacks_it() {
        let [english, german] = PageLanguage::ALL.map(Locale::new);
        let rows = |locale: &Locale| say!(locale, "{rows} rows", rows = 7);
        assert_eq!([rows(&english), rows(&german)], ["7 rows", "7 Zeilen"]);
        assert_eq!(say!(german, "no {such} message", such = 1), "no 1 message");
        assert_eq!(german.missing(), ["no {such} message"]);
        assert_eq!(german.decimal("0.125".into()), "0,125");
    }

    #[test]
    fn micrometres_are_written_as_such_on_a_page_and_steps_called_so_stay() {
        assert_eq!(
            micro("Up (31 um rms at the tool), 4 urad/Nm."),
            "Up (31 \u{b5}m rms at the tool), 4 \u{b5}rad/Nm."
        );
        assert_eq!(micro("a maximum: `unit: um`"), "a maximum: `unit: um`");
    }

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

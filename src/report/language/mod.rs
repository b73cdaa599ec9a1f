//! The language of a page: its sentences and its numbers.
//!
//! Sentences are messages as gettext has them: the English with named holes is what the table of a language, `de.po`, finds its translation
//! by. Rust says them by [`say!`], templates by `_("...", name=...)`. English sentences that tables hold are read by [`stored`].

mod stored;

use minijinja::value::{Kwargs, Value};
use minijinja::{Environment, ErrorKind, HtmlEscape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock, Mutex};
use stored::StoredSentences;

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
    pub(crate) const ALL: [Self; 2] = [Self::English, Self::German];

    /// As settings and the command line name it.
    pub(crate) fn code(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::German => "de",
        }
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
        let of = |name: &str| arguments.iter().find(|(known, _)| *known == name);
        let filled = self.message(id, |name| of(name).map(|(_, value)| value.clone()));
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
        sentence_case(&self.stored(statement.trim_end_matches('.')))
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
        environment.add_filter("sentence", move |english: &str| {
            statements.sentence(english)
        });
        environment.add_global("lang", self.language.code());
    }
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
}

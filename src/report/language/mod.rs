//! Languages of the report. It is written in English; another language is a table of its sentences, and translates the finished page.

mod phrases;
mod text;

use phrases::{PhraseReader, Phrases};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

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

static GERMAN: LazyLock<Phrases> = LazyLock::new(|| Phrases::of(include_str!("german.txt")));

/// A page in another language.
pub struct Translation {
    /// The page.
    pub html: String,
    /// What has no sentence in the language's table and stayed as it was.
    pub missing: Vec<String>,
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

    fn phrases(self) -> Option<&'static Phrases> {
        match self {
            Self::English => None,
            Self::German => Some(&GERMAN),
        }
    }

    /// The English of a language's table, in its order; empty for English itself.
    pub fn known(self) -> Vec<&'static str> {
        self.phrases()
            .map_or_else(Vec::new, |phrases| phrases.english.clone())
    }

    /// A sentence in this language; none where its table has no such sentence.
    pub fn sentence(self, english: &str) -> Option<String> {
        match self.phrases() {
            None => Some(english.into()),
            Some(phrases) => PhraseReader::new(phrases).translate(english),
        }
    }

    /// An English page in this language. What stands in an element with `translate="no"`, in `code`, `style` or `script` stays as it is.
    pub fn page(self, english: String) -> Translation {
        let Some(phrases) = self.phrases() else {
            return Translation {
                html: text::each(&english, micro),
                missing: Vec::new(),
            };
        };
        let reader = PhraseReader::new(phrases);
        let mut missing = Vec::new();
        let html = text::each(&english, |sentence| {
            let translated = reader.translate(sentence);
            if translated.is_none() {
                missing.push(sentence.to_string());
            }
            translated
        });
        let own = format!("<html lang=\"{}\">", self.code());
        Translation {
            html: html.replacen("<html lang=\"en\">", &own, 1),
            missing,
        }
    }
}

/// A text whose `um` and `urad` are written as a page can; none where it has none.
fn micro(text: &str) -> Option<String> {
    let own = |word: &str| {
        let core = word.trim_start_matches('(');
        let unit = core.trim_end_matches(|c: char| !c.is_alphanumeric());
        let is_unit = ["um", "um/m", "urad", "urad/Nm"].contains(&unit);
        if is_unit {
            word.replacen('u', "\u{b5}", 1)
        } else {
            word.to_string()
        }
    };
    let out = text.split(' ').map(own).collect::<Vec<_>>().join(" ");
    (out != text).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::{PageLanguage, micro};

    #[test]
    fn micrometres_are_written_as_such_on_a_page_and_steps_called_so_stay() {
        assert_eq!(
            micro("Up (31 um rms at the tool), 4 urad/Nm.").as_deref(),
            Some("Up (31 \u{b5}m rms at the tool), 4 \u{b5}rad/Nm.")
        );
        assert_eq!(micro("a maximum"), None);
        let page = PageLanguage::English
            .page("<p>5 um.</p><code>5 um</code><i translate=\"no\">um</i>".into());
        assert_eq!(
            page.html,
            "<p>5 \u{b5}m.</p><code>5 um</code><i translate=\"no\">um</i>"
        );
    }
}

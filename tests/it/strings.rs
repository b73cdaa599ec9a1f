//! What calib says: every sentence of the sources in one file, to be read in one sitting, in the terms of the field.
//!
//! `CALIB_UPDATE=1 cargo test --test it strings` writes the file anew; read the difference before you keep it.

use crate::source::files;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Words of this project alone, and what the field says instead.
const IDIOMS: [(&str, &str); 9] = [
    ("goes with", "depends on"),
    ("go with", "depend on"),
    ("taken for", "confounded with"),
    ("tell apart", "separate"),
    ("tells apart", "separates"),
    ("told apart", "separated"),
    ("count less", "are down-weighted"),
    ("what became of", "the state of"),
    ("in a word", "in short"),
];
/// Words that make a literal a sentence.
const WORDS: usize = 3;

/// The literals of a source, without its unit tests, comments and raw strings.
fn literals(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let mut found = Vec::new();
    let mut letters = code.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '/' if letters.peek() == Some(&'/') => {
                letters.by_ref().find(|c| *c == '\n');
            }
            'r' if letters.peek() == Some(&'#') => {
                letters.next();
                if letters.next_if_eq(&'"').is_some() {
                    while let Some(c) = letters.next() {
                        if c == '"' && letters.next_if_eq(&'#').is_some() {
                            break;
                        }
                    }
                }
            }
            '\'' => {
                // A character, or a lifetime: '"' must not open a string.
                if letters.next_if_eq(&'\\').is_some() {
                    letters.next();
                    letters.next_if_eq(&'\'');
                } else if letters.next_if_eq(&'"').is_some() {
                    letters.next_if_eq(&'\'');
                }
            }
            '"' => {
                let mut literal = String::new();
                while let Some(c) = letters.next().filter(|c| *c != '"') {
                    match c {
                        '\\' => match letters.next() {
                            Some('\n') => while letters.next_if(|c| c.is_whitespace()).is_some() {},
                            Some('n' | 't') => literal.push(' '),
                            Some(other) => literal.push(other),
                            None => (),
                        },
                        other => literal.push(other),
                    }
                }
                found.push(literal.split_whitespace().collect::<Vec<_>>().join(" "));
            }
            _ => (),
        }
    }
    found
}

/// Every sentence with the file that says it.
pub(crate) fn sentences() -> BTreeSet<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let each = files(&root).into_iter().flat_map(|path| {
        let name = path.strip_prefix(&root).expect("below src").to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(&path).expect("a source");
        let said =
            literals(&text).into_iter().filter(|literal| literal.split(' ').filter(|word| word.len() > 1).count() >= WORDS);
        said.map(|literal| (name.clone(), literal)).collect::<Vec<_>>()
    });
    // Units and sources of criteria are read in their tables, and nobody else is told them.
    each.filter(|(name, _)| !name.ends_with("tests.rs") && !name.starts_with("numerics/criteria/")).collect()
}

#[test]
fn what_calib_says_is_as_it_was_read() {
    let mut text = String::new();
    let mut file = String::new();
    for (name, sentence) in sentences() {
        if name != file {
            text.push_str(&format!("\n{name}\n"));
            file = name;
        }
        text.push_str(&format!("  {sentence}\n"));
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/strings.txt");
    if std::env::var_os("CALIB_UPDATE").is_some() {
        fs::write(&path, &text).expect("a file");
    }
    let read = fs::read_to_string(&path).unwrap_or_default();
    assert!(text == read, "write it anew with CALIB_UPDATE=1 cargo test --test it strings, and read the difference");
}

#[test]
fn calib_speaks_in_the_terms_of_the_field() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = ["README.md", "pipelines/README.md", "pipelines/gallery.md", "pipelines/proof/README.md", "schemas/README.md"]
        .into_iter()
        .chain(["src/cli/README.md", "src/numerics/effect/README.md", "tests/it/forms/sentences.txt"])
        .map(|page| (page.to_string(), fs::read_to_string(root.join(page)).expect("a page")));
    let said: Vec<(String, String)> = sentences().into_iter().chain(pages).collect();
    assert!(said.len() > 1000, "only {} sentences", said.len());
    let faults: Vec<String> = said
        .iter()
        .flat_map(|(file, text)| {
            let found = IDIOMS.iter().filter(|(idiom, _)| text.contains(idiom));
            found.map(move |(idiom, term)| format!("{file}: `{idiom}`: write `{term}`"))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn literals_are_found_over_lines_and_beside_characters() {
    let text = "let a = '\"'; // \"no\"\nlet b = \"one \\\n     two\\n\"; let c: &'a str = r#\"raw\"#; f('\\'', \"three\");\n#[cfg(test)]\nmod tests {\n\"four\"";
    assert_eq!(literals(text), ["one two", "three"]);
}

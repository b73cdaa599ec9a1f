//! Sentences among the literals of the sources.

use crate::source::files;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Words that make a literal a sentence.
const WORDS: usize = 3;

/// The literals of a source, without its unit tests, comments and raw strings.
fn literals(text: &str) -> Vec<String> {
    let code = text
        .split("#[cfg(test)]\nmod tests {")
        .next()
        .unwrap_or_default();
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
        let name = path
            .strip_prefix(&root)
            .expect("below src")
            .to_string_lossy()
            .replace('\\', "/");
        let text = fs::read_to_string(&path).expect("a source");
        let result_of = literals(&text)
            .into_iter()
            .filter(|literal| literal.split(' ').filter(|word| word.len() > 1).count() >= WORDS);
        result_of
            .map(|literal| (name.clone(), literal))
            .collect::<Vec<_>>()
    });
    // Units and sources of criteria are read in their tables, and appear nowhere else.
    each.filter(|(name, _)| !name.ends_with("tests.rs") && !name.starts_with("numerics/criteria/"))
        .collect()
}

#[test]
fn literals_are_found_over_lines_and_beside_characters() {
    let text = "let a = '\"'; // \"no\"\nlet b = \"one \\\n     two\\n\"; let c: &'a str = r#\"raw\"#; f('\\'', \"three\");\n#[cfg(test)]\nmod tests {\n\"four\"";
    assert_eq!(literals(text), ["one two", "three"]);
}

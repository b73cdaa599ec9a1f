//! Files and functions are short: a file is one idea, a function is read without scrolling.

use crate::source::files;
use std::fs;
use std::path::Path;

/// Lines of a file and of a function, at most.
const FILE: usize = 600;
const FUNCTION: usize = 80;

/// Functions of a text with their lines, in rustfmt's style: a function ends where a brace stands under its first letter.
fn functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        let head = code.split_once("fn ").filter(|(before, _)| {
            let words = before.split_whitespace();
            let known = |word: &str| {
                ["const", "async", "unsafe", "pub"].contains(&word) || word.starts_with("pub(") || word.ends_with(')')
            };
            (before.is_empty() || before.ends_with(' ')) && words.clone().all(known)
        });
        let Some((_, name)) = head.filter(|_| !line.ends_with(['}', ';'])) else { continue };
        let end = format!("{}}}", &line[..line.len() - code.len()]);
        if let Some(length) = lines[at..].iter().position(|line| line.starts_with(&end)) {
            let name = name.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default();
            found.push((name.to_string(), length + 1));
        }
    }
    found
}

#[test]
fn no_file_and_no_function_is_longer_than_one_reads() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut longer = Vec::new();
    for path in files(&root) {
        let (text, name) =
            (fs::read_to_string(&path).unwrap(), path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/"));
        if text.lines().count() > FILE {
            longer.push(name.clone());
        }
        longer.extend(
            functions(&text).into_iter().filter(|(_, lines)| *lines > FUNCTION).map(|(own, _)| format!("{name}: fn {own}")),
        );
    }
    assert_eq!(longer, Vec::<String>::new(), "at most {FILE} lines a file and {FUNCTION} a function");
}

#[test]
fn a_function_is_as_long_as_its_lines() {
    let text = "pub(crate) fn one(\n    a: u8,\n) {\n    fn inner() {\n    }\n}\nfn two() {}\n    pub const fn three() -> u8 {\n        3\n    }\n";
    let found = functions(text);
    let found: Vec<(&str, usize)> = found.iter().map(|(name, lines)| (name.as_str(), *lines)).collect();
    assert_eq!(found, [("one", 6), ("inner", 2), ("three", 3)]);
}

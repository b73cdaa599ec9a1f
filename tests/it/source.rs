//! The sources as the compiler sees them: which module a file is, and what it names of other modules. Unit tests, comments and texts
//! are left out; groups (`use crate::{a, b::{c, d}}`), `self`, `super` and paths inside expressions are not.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A path that a file names, from the root of the crate: `["store", "key", "StageKey"]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Use {
    pub line: usize,
    pub path: Vec<String>,
    /// What an import calls it here; none for a path inside an expression.
    pub name: Option<String>,
    /// A `pub use`: the module hands it on and need not use it itself.
    pub handed_on: bool,
}

#[derive(Debug)]
pub struct Source {
    /// Below `src`, with slashes.
    pub file: String,
    /// The module: `["store", "key"]`.
    pub module: Vec<String>,
    pub uses: Vec<Use>,
}

/// All files below `src` that are not unit tests alone, in order.
pub fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    for path in files(&root) {
        let file = path
            .strip_prefix(&root)
            .unwrap()
            .to_string_lossy()
            .replace('\\', "/");
        let text = fs::read_to_string(&path).unwrap();
        found.push((module_of(&file), file, text));
    }
    let modules: Vec<Vec<String>> = found.iter().map(|(module, ..)| module.clone()).collect();
    let sources = found.into_iter().map(|(module, file, text)| Source {
        uses: uses(&text, &module, &modules),
        file,
        module,
    });
    sources.collect()
}

pub fn files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !path.ends_with("tests.rs")
        {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// `store/key.rs` -> `store::key`, `store/mod.rs` -> `store`, `lib.rs` -> the root. What the packages below `src` hold has the path by which
/// the crate `calib` hands it on: `numerics/effect/form.rs` -> `effect::form`, `twin/arm.rs` -> `twin::arm`.
fn module_of(file: &str) -> Vec<String> {
    let mut parts: Vec<String> = file
        .trim_end_matches(".rs")
        .split('/')
        .map(String::from)
        .collect();
    if parts
        .last()
        .is_some_and(|last| ["mod", "lib"].contains(&last.as_str()))
    {
        parts.pop();
    }
    if parts.len() > 1 && ["foundation", "numerics"].contains(&parts[0].as_str()) {
        parts.remove(0);
    }
    parts
}

/// What a text names of its crate. `modules` are all modules of it.
pub fn uses(text: &str, module: &[String], modules: &[Vec<String>]) -> Vec<Use> {
    let tokens = without_tests(&tokens(text));
    let mut found = Vec::new();
    let mut add = |line: usize, path: Vec<String>, name: Option<String>, handed_on: bool| {
        if let Some(path) = absolute(&path, module, modules) {
            found.push(Use {
                line,
                path,
                name,
                handed_on,
            });
        }
    };
    let mut at = 0;
    while at < tokens.len() {
        let before = at.checked_sub(1).map(|before| tokens[before].text.as_str());
        if tokens[at].text == "use" {
            let handed_on = matches!(before, Some("pub" | ")"));
            let mut leaves = Vec::new();
            at = tree(&tokens, at + 1, &mut Vec::new(), &mut leaves);
            for (line, path, name) in leaves {
                add(line, path, Some(name), handed_on);
            }
        } else if tokens[at].is_word() && before != Some("::") {
            let line = tokens[at].line;
            let mut path = vec![tokens[at].text.clone()];
            while tokens.get(at + 1).is_some_and(|token| token.text == "::")
                && tokens.get(at + 2).is_some_and(Token::is_word)
            {
                path.push(tokens[at + 2].text.clone());
                at += 2;
            }
            at += 1;
            if path.len() > 1 {
                add(line, path, None, false);
            }
        } else {
            at += 1;
        }
    }
    found
}

/// The leaves of an import's tree that begins at a token: line, path, name. Gives the token after it.
fn tree(
    tokens: &[Token],
    mut at: usize,
    path: &mut Vec<String>,
    leaves: &mut Vec<(usize, Vec<String>, String)>,
) -> usize {
    let depth = path.len();
    let mut name = None;
    let line = tokens[at].line;
    let mut group = false;
    while let Some(token) = tokens.get(at) {
        match token.text.as_str() {
            "::" => at += 1,
            "{" => {
                group = true;
                at += 1;
                while tokens[at].text != "}" {
                    at = if tokens[at].text == "," {
                        at + 1
                    } else {
                        tree(tokens, at, path, leaves)
                    };
                }
                at += 1;
            }
            "as" => {
                name = Some(tokens[at + 1].text.clone());
                at += 2;
            }
            "self" if path.len() > depth || depth > 0 => at += 1,
            _ if token.is_word() || token.text == "*" => {
                path.push(token.text.clone());
                at += 1;
            }
            _ => break,
        }
    }
    if !group {
        let last = path.last().cloned().unwrap_or_default();
        leaves.push((line, path.clone(), name.unwrap_or(last)));
    }
    path.truncate(depth);
    at
}

/// A path from the root of the crate; none for one into another crate.
fn absolute(path: &[String], module: &[String], modules: &[Vec<String>]) -> Option<Vec<String>> {
    let mut base = module.to_vec();
    let mut rest = path;
    match rest.first()?.as_str() {
        "crate" if module.first().is_some_and(|first| first == "twin") => {
            base.truncate(1);
            rest = &rest[1..];
        }
        "crate" | "calib" | "calib_foundation" | "calib_numerics" => {
            base.clear();
            rest = &rest[1..];
        }
        package @ ("calib_diagnose" | "calib_dynamics" | "calib_twin") => {
            base = vec![package.trim_start_matches("calib_").into()];
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {}
        first => {
            // A module that is declared here.
            base.push(first.into());
            if !modules.contains(&base) {
                return None;
            }
            rest = &rest[1..];
        }
    }
    while rest.first().is_some_and(|part| part == "super") {
        base.pop();
        rest = &rest[1..];
    }
    base.extend(rest.iter().cloned());
    Some(base)
}

/// Which file a path leads to, through what modules hand on or import themselves.
pub fn home<'a>(
    path: &[String],
    by_module: &BTreeMap<&[String], &'a Source>,
) -> Option<&'a Source> {
    let length = (0..=path.len())
        .rev()
        .find(|length| by_module.contains_key(&path[..*length]))?;
    let source = by_module[&path[..length]];
    let Some(item) = path.get(length) else {
        return Some(source);
    };
    match source
        .uses
        .iter()
        .find(|import| import.name.as_ref() == Some(item) && import.path != path[..=length])
    {
        Some(import) => {
            let further: Vec<String> = import
                .path
                .iter()
                .chain(&path[length + 1..])
                .cloned()
                .collect();
            home(&further, by_module)
        }
        None => Some(source),
    }
}

/// A word, a number, `::` or another single character; a text or a comment is none.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Token {
    line: usize,
    text: String,
}

impl Token {
    fn is_word(&self) -> bool {
        self.text
            .starts_with(|c: char| c.is_alphabetic() || c == '_')
    }
}

fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let (mut found, mut at, mut line) = (Vec::new(), 0, 1);
    while at < chars.len() {
        let next = chars.get(at + 1).copied();
        let end = match chars[at] {
            '/' if next == Some('/') => to(&chars, at, |c| c == '\n'),
            '/' if next == Some('*') => after_comment(&chars, at),
            '"' => after_text(&chars, at + 1),
            'r' | 'b' if raw(&chars, at).is_some() => raw(&chars, at).unwrap_or(at),
            '\'' => after_tick(&chars, at),
            ':' if next == Some(':') => {
                found.push(Token {
                    line,
                    text: "::".into(),
                });
                at + 2
            }
            c if c.is_alphanumeric() || c == '_' => {
                let end = to(&chars, at, |c| !(c.is_alphanumeric() || c == '_'));
                found.push(Token {
                    line,
                    text: chars[at..end].iter().collect(),
                });
                end
            }
            c => {
                if !c.is_whitespace() {
                    found.push(Token {
                        line,
                        text: c.to_string(),
                    });
                }
                at + 1
            }
        };
        line += chars[at..end.min(chars.len())]
            .iter()
            .filter(|c| **c == '\n')
            .count();
        at = end;
    }
    found
}

fn to(chars: &[char], from: usize, stop: impl Fn(char) -> bool) -> usize {
    (from..chars.len())
        .find(|at| stop(chars[*at]))
        .unwrap_or(chars.len())
}

fn after_comment(chars: &[char], from: usize) -> usize {
    let (mut at, mut depth) = (from, 0);
    while at + 1 < chars.len() {
        match (chars[at], chars[at + 1]) {
            ('/', '*') => (at, depth) = (at + 2, depth + 1),
            ('*', '/') => (at, depth) = (at + 2, depth - 1),
            _ => at += 1,
        }
        if depth == 0 {
            return at;
        }
    }
    chars.len()
}

fn after_text(chars: &[char], from: usize) -> usize {
    let mut at = from;
    while at < chars.len() && chars[at] != '"' {
        at += if chars[at] == '\\' { 2 } else { 1 };
    }
    at + 1
}

/// The end of `r"..."`, `r#"..."#`, `b"..."`, `br"..."` that begins here.
fn raw(chars: &[char], from: usize) -> Option<usize> {
    if from > 0 && (chars[from - 1].is_alphanumeric() || chars[from - 1] == '_') {
        return None;
    }
    let quote = to(chars, from, |c| !"rb#".contains(c));
    let prefix: String = chars[from..quote].iter().collect();
    let marks = prefix.chars().filter(|c| *c == '#').count();
    if chars.get(quote) != Some(&'"') {
        return None;
    }
    if !prefix.contains('r') {
        return Some(after_text(chars, quote + 1));
    }
    let closes = |at: &usize| {
        chars[*at] == '"'
            && chars[at + 1..]
                .iter()
                .take(marks)
                .filter(|c| **c == '#')
                .count()
                == marks
    };
    (quote + 1..chars.len())
        .find(closes)
        .map(|at| at + 1 + marks)
}

/// After a character, or after the tick of a lifetime.
fn after_tick(chars: &[char], from: usize) -> usize {
    match (chars.get(from + 1), chars.get(from + 2)) {
        (Some('\\'), _) => to(chars, from + 3, |c| c == '\'') + 1,
        (_, Some('\'')) => from + 3,
        _ => from + 1,
    }
}

/// Without items behind `#[cfg(test)]`, each up to its `;` or the end of its block.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let here: Vec<&str> = tokens[at..]
            .iter()
            .take(7)
            .map(|token| token.text.as_str())
            .collect();
        if here != ["#", "[", "cfg", "(", "test", ")", "]"] {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        at += 7;
        let mut depth = 0;
        while at < tokens.len() {
            let text = tokens[at].text.as_str();
            depth += match text {
                "{" | "(" | "[" => 1,
                "}" | ")" | "]" => -1,
                _ => 0,
            };
            at += 1;
            if depth == 0 && (text == ";" || text == "}") {
                break;
            }
        }
    }
    kept
}

#[test]
fn every_way_to_name_a_module_is_seen() {
    let text = r##"
//! crate::comment::a
use crate::{alpha::{self, One}, beta::Two as Second, gamma};
#[cfg(test)]
mod tests { use crate::hidden::Thing; fn f() { "}" ; } }
use super::delta::{Three, four::*};
pub(crate) use child::Five;
fn g<'a>(x: &'a str) -> char { let _ = r#"crate::text::b"#; let _ = "crate::text::\"c"; crate::epsilon::h::<u8>(x); '\'' }
/* crate::comment::d /* nested */ crate::comment::e */
fn k() { std::mem::swap(); child::call(self::own::Six); vec![super::super::top::Seven]; }
"##;
    let words = |path: &str| path.split("::").map(String::from).collect::<Vec<_>>();
    let named: Vec<Vec<String>> = uses(
        "use crate::arm::Arm; use calib_foundation::units::Unit;",
        &words("twin::motion"),
        &[],
    )
    .into_iter()
    .map(|one| one.path)
    .collect();
    assert_eq!(named, [words("twin::arm::Arm"), words("units::Unit")]);
    let modules = [words("room::here"), words("room::here::child")];
    let found: Vec<(usize, String, bool)> = uses(text, &words("room::here"), &modules)
        .into_iter()
        .map(|one| (one.line, one.path.join("::"), one.handed_on))
        .collect();
    let wanted = [
        (3, "alpha", false),
        (3, "alpha::One", false),
        (3, "beta::Two", false),
        (3, "gamma", false),
        (6, "room::delta::Three", false),
        (6, "room::delta::four::*", false),
        (7, "room::here::child::Five", true),
        (8, "epsilon::h", false),
        (10, "room::here::child::call", false),
        (10, "room::here::own::Six", false),
        (10, "top::Seven", false),
    ];
    assert_eq!(
        found,
        wanted.map(|(line, path, handed_on)| (line, path.to_string(), handed_on))
    );
}

//! The sources as the compiler sees them: which module a file is, and what it names of other modules. Unit tests, comments and texts
//! are left out; groups (`use crate::{a, b::{c, d}}`), `self`, `super` and paths inside expressions are not.

use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A path that a file names, from the root of the crate: `["store", "key", "StageKey"]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Use {
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
    let mut add = |path: Vec<String>, name: Option<String>, handed_on: bool| {
        if let Some(path) = absolute(&path, module, modules) {
            found.push(Use {
                path,
                name,
                handed_on,
            });
        }
    };
    let mut at = 0;
    while at < tokens.len() {
        let before = at.checked_sub(1).map(|before| tokens[before].as_str());
        if tokens[at] == "use" {
            let handed_on = matches!(before, Some("pub" | ")"));
            let mut leaves = Vec::new();
            at = tree(&tokens, at + 1, &mut Vec::new(), &mut leaves);
            for (path, name) in leaves {
                add(path, Some(name), handed_on);
            }
        } else if is_word(&tokens[at]) && before != Some("::") {
            let mut path = vec![tokens[at].clone()];
            while tokens.get(at + 1).is_some_and(|token| token == "::")
                && tokens.get(at + 2).is_some_and(|token| is_word(token))
            {
                path.push(tokens[at + 2].clone());
                at += 2;
            }
            at += 1;
            if path.len() > 1 {
                add(path, None, false);
            }
        } else {
            at += 1;
        }
    }
    found
}

/// The leaves of an import's tree that begins at a token: path, name. Gives the token after it.
fn tree(
    tokens: &[String],
    mut at: usize,
    path: &mut Vec<String>,
    leaves: &mut Vec<(Vec<String>, String)>,
) -> usize {
    let depth = path.len();
    let mut name = None;
    let mut group = false;
    while let Some(token) = tokens.get(at) {
        match token.as_str() {
            "::" => at += 1,
            "{" => {
                group = true;
                at += 1;
                while tokens[at] != "}" {
                    at = if tokens[at] == "," {
                        at + 1
                    } else {
                        tree(tokens, at, path, leaves)
                    };
                }
                at += 1;
            }
            "as" => {
                name = Some(tokens[at + 1].clone());
                at += 2;
            }
            "self" if path.len() > depth || depth > 0 => at += 1,
            _ if is_word(token) || token == "*" => {
                path.push(token.clone());
                at += 1;
            }
            _ => break,
        }
    }
    if !group {
        let last = path.last().cloned().unwrap_or_default();
        leaves.push((path.clone(), name.unwrap_or(last)));
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

/// Words, `::` and other single characters of a text; literals and comments are none.
fn tokens(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    flatten(text.parse().unwrap(), &mut found);
    found
}

fn flatten(stream: TokenStream, found: &mut Vec<String>) {
    let mut colon = false;
    for tree in stream {
        let after_colon = std::mem::take(&mut colon);
        match tree {
            TokenTree::Punct(mark) if mark.as_char() == ':' && after_colon => {
                found.push("::".into())
            }
            TokenTree::Punct(mark) if mark.as_char() == ':' => {
                colon = mark.spacing() == Spacing::Joint
            }
            TokenTree::Group(group) => {
                let [open, close] = match group.delimiter() {
                    Delimiter::Parenthesis => ["(", ")"],
                    Delimiter::Brace => ["{", "}"],
                    Delimiter::Bracket => ["[", "]"],
                    Delimiter::None => ["", ""],
                };
                found.push(open.into());
                flatten(group.stream(), found);
                found.push(close.into());
            }
            TokenTree::Literal(_) => {}
            word => found.push(word.to_string()),
        }
    }
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Without items behind `#[cfg(test)]`, each up to its `;` or the end of its block.
fn without_tests(tokens: &[String]) -> Vec<String> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let here: Vec<&str> = tokens[at..]
            .iter()
            .take(7)
            .map(|token| token.as_str())
            .collect();
        if here != ["#", "[", "cfg", "(", "test", ")", "]"] {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        at += 7;
        let mut depth = 0;
        while at < tokens.len() {
            let text = tokens[at].as_str();
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
    let found: Vec<(String, bool)> = uses(text, &words("room::here"), &modules)
        .into_iter()
        .map(|one| (one.path.join("::"), one.handed_on))
        .collect();
    let wanted = [
        ("alpha", false),
        ("alpha::One", false),
        ("beta::Two", false),
        ("gamma", false),
        ("room::delta::Three", false),
        ("room::delta::four::*", false),
        ("room::here::child::Five", true),
        ("epsilon::h", false),
        ("room::here::child::call", false),
        ("room::here::own::Six", false),
        ("top::Seven", false),
    ];
    assert_eq!(
        found,
        wanted.map(|(path, handed_on)| (path.to_string(), handed_on))
    );
}

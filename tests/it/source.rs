//! What each file of the sources names of other modules, read line by line as rustfmt sets them: imports and paths inside expressions.

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
    let mut found = Vec::new();
    let mut add = |line: usize, path: &str, name: Option<String>, handed_on: bool| {
        let path: Vec<String> = path.split("::").map(String::from).collect();
        let path: Vec<String> = path.into_iter().filter(|part| !part.is_empty()).collect();
        if let Some(path) = absolute(&path, module, modules) {
            found.push(Use {
                line,
                path,
                name,
                handed_on,
            });
        }
    };
    let mut lines = code(text).into_iter();
    while let Some((line, text)) = lines.next() {
        let plain = ["pub(crate) ", "pub(super) ", "pub "]
            .iter()
            .find_map(|word| text.strip_prefix(word));
        if let Some(tree) = plain.unwrap_or(text).strip_prefix("use ") {
            let mut tree = tree.to_string();
            while !tree.contains(';') {
                tree += lines.next().map_or(";", |(_, more)| more);
            }
            let mut leaves = Vec::new();
            spread(tree.trim_end_matches(';'), "", &mut leaves);
            for (path, name) in leaves {
                add(line, &path, Some(name), plain.is_some());
            }
            continue;
        }
        let is_of_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        let paths = text.split(|c: char| !is_of_path(c));
        for path in paths.filter(|path| path.trim_matches(':').contains("::")) {
            add(line, path, None, false);
        }
    }
    found
}

/// The leaves of an import's tree: path and name.
fn spread(tree: &str, before: &str, leaves: &mut Vec<(String, String)>) {
    let Some((path, inner)) = tree.split_once('{') else {
        let (path, name) = tree.trim().split_once(" as ").unwrap_or((tree.trim(), ""));
        let path = format!("{before}{path}");
        let path = path.trim_end_matches("::self");
        let last = path.rsplit("::").next().unwrap_or_default();
        let name = if name.is_empty() { last } else { name };
        return leaves.push((path.into(), name.into()));
    };
    let before = format!("{before}{}", path.trim());
    let inner = inner.rsplit_once('}').map_or(inner, |(inner, _)| inner);
    let mut depth = 0;
    let members = inner.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0 && c == ','
    });
    for member in members.filter(|member| !member.trim().is_empty()) {
        spread(member, &before, leaves);
    }
}

/// Lines with their numbers, without comments and without items behind `#[cfg(test)]`, as rustfmt sets them.
fn code(text: &str) -> Vec<(usize, &str)> {
    let mut kept = Vec::new();
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        let ours = line.trim_start();
        if ours.starts_with("#[cfg(test)]") {
            let end = format!("{}}}", &line[..line.len() - ours.len()]);
            if !lines.next().is_some_and(|(_, item)| item.ends_with(';')) {
                lines.by_ref().find(|(_, line)| *line == end);
            }
        } else if !ours.starts_with("//") {
            kept.push((number, ours.split(" // ").next().unwrap_or(ours)));
        }
    }
    kept
}

/// A path from the root of the crate; none for one into another crate.
fn absolute(path: &[String], module: &[String], modules: &[Vec<String>]) -> Option<Vec<String>> {
    let mut base = module.to_vec();
    let mut remainder = path;
    match remainder.first()?.as_str() {
        "crate" if module.first().is_some_and(|first| first == "twin") => {
            base.truncate(1);
            remainder = &remainder[1..];
        }
        "crate" | "calib" | "calib_foundation" | "calib_numerics" => {
            base.clear();
            remainder = &remainder[1..];
        }
        package @ ("calib_diagnose" | "calib_dynamics" | "calib_twin") => {
            base = vec![package.trim_start_matches("calib_").into()];
            remainder = &remainder[1..];
        }
        "self" => remainder = &remainder[1..],
        "super" => {}
        first => {
            // A module that is declared here.
            base.push(first.into());
            if !modules.contains(&base) {
                return None;
            }
            remainder = &remainder[1..];
        }
    }
    while remainder.first().is_some_and(|part| part == "super") {
        base.pop();
        remainder = &remainder[1..];
    }
    base.extend(remainder.iter().cloned());
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

#[test]
fn every_way_to_name_a_module_is_seen() {
    let text = "
//! crate::comment::a
use crate::{
    alpha::{self, One},
    beta::Two as Second, gamma,
};
#[cfg(test)]
mod tests {
    use crate::hidden::Thing;
}
pub(crate) use child::Five;
use super::delta::{Three, four::*}; // crate::comment::b
fn g(x: &str) -> u8 { crate::epsilon::h::<u8>(x) }
fn k() { std::mem::swap(); child::call(self::own::Six); vec![super::super::top::Seven]; }
";
    let words = |path: &str| path.split("::").map(String::from).collect::<Vec<_>>();
    let named = |text: &str, module: &str, modules: &[Vec<String>]| {
        let uses = uses(text, &words(module), modules).into_iter();
        uses.map(|one| (one.line, one.path.join("::"), one.handed_on))
            .collect::<Vec<_>>()
    };
    let foreign = "use crate::arm::Arm;\nuse calib_foundation::units::Unit;";
    let found = named(foreign, "twin::motion", &[]);
    assert_eq!(found[0].1, "twin::arm::Arm");
    assert_eq!(found[1].1, "units::Unit");
    let modules = [words("room::here"), words("room::here::child")];
    let wanted = [
        (3, "alpha", false),
        (3, "alpha::One", false),
        (3, "beta::Two", false),
        (3, "gamma", false),
        (11, "room::here::child::Five", true),
        (12, "room::delta::Three", false),
        (12, "room::delta::four::*", false),
        (13, "epsilon::h", false),
        (14, "room::here::child::call", false),
        (14, "room::here::own::Six", false),
        (14, "top::Seven", false),
    ];
    let wanted = wanted.map(|(line, path, handed_on)| (line, path.to_string(), handed_on));
    assert_eq!(named(text, "room::here", &modules), wanted);
}

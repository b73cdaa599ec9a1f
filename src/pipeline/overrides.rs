//! `--set` and `${variable}`: what is put into the YAML's tree before it is typed.
//!
//! An entry of `files` with `file: data/*/hole_?.csv` stands for one entry for each file that matches, in the order of their paths; `*` is
//! any text within a folder's or file's name, `?` one letter. A column with `path: "{position}/hole_{n}.csv"` has as its value what stands
//! for the braces at the end of its file's path, joined by `/`: `front/0`.

use crate::error::{Fault, listed, nearest};
use crate::yaml::{self, Mark, Node, Trouble, YamlValue};
use glob::{MatchOptions, Pattern, glob_with};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// One `--set target=value`.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Override {
    /// A variable, `seed` or `STAGE.path.of.setting`.
    pub(crate) target: String,
    pub(crate) value: String,
}

impl Override {
    /// Reads `target=value`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((target, value)) if !target.is_empty() => Ok(Self {
                target: target.trim().into(),
                value: value.into(),
            }),
            _ => Err(format!(
                "`{text}`: expected TARGET=VALUE, e.g. case=recordings/r7, seed=7 or split.n=4"
            )),
        }
    }

    fn node(&self) -> Result<Node, Fault> {
        let (node, troubles) = yaml::parse(&self.value);
        match (node, troubles.into_iter().next()) {
            (Some(mut node), None) => {
                node.walk_mut("", &mut |_, node| {
                    node.mark = Mark::CommandLine;
                    node.overridden = true;
                });
                Ok(node)
            }
            // An empty value is an empty text.
            _ if self.value.trim().is_empty() => Ok(Node {
                overridden: true,
                ..Node::new(YamlValue::Text(String::new()), Mark::CommandLine)
            }),
            (_, trouble) => {
                let why = trouble.map(|trouble| trouble.message).unwrap_or_default();
                Err(Fault::new(
                    format!("--set {}", self.target),
                    format!("the value is not YAML: {why}"),
                ))
            }
        }
    }
}

/// The variables of a pipeline: name and value.
pub(super) type Variables = BTreeMap<String, Node>;

/// Puts the overrides into the tree and takes its variables out.
pub(super) fn apply(tree: &mut Node, overrides: &[Override]) -> (Variables, Vec<Fault>) {
    let mut faults = Vec::new();
    let given = tree.get("variables").map(Node::entries).unwrap_or_default();
    let given = given
        .iter()
        .map(|(name, _, node)| (name.clone(), node.clone()));
    let mut variables: Variables = given.collect();
    let ids = stage_ids(tree);
    let mut names: BTreeSet<String> = used_variables(tree);
    names.extend(variables.keys().cloned());
    for set in overrides {
        let node = match set.node() {
            Ok(node) => node,
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        let place = format!("--set {}", set.target);
        let stage = set
            .target
            .split_once(['.', '['])
            .and_then(|(id, _)| ids.iter().position(|known| known == id));
        match stage {
            _ if set.target == "seed" => {
                if let Err(why) = tree.put("seed", node) {
                    faults.push(Fault::new(place, why));
                }
            }
            _ if names.contains(&set.target) => {
                variables.insert(set.target.clone(), node);
            }
            Some(index) => {
                let path = set.target[ids[index].len()..].trim_start_matches('.');
                if let Err(why) = tree.put(&format!("stages[{index}].with.{path}"), node) {
                    faults.push(Fault::new(place, why));
                }
            }
            None => faults.push(Fault::new(place, unknown(&set.target, &names, &ids))),
        }
    }
    (variables, faults)
}

fn unknown(target: &str, names: &BTreeSet<String>, ids: &[String]) -> String {
    let (head, tail) = match target.find(['.', '[']) {
        Some(dot) => target.split_at(dot),
        None => (target, ""),
    };
    if tail.is_empty() && ids.iter().any(|id| id == target) {
        return format!("`{target}` is a stage: name a setting of it, e.g. {target}.SETTING=VALUE");
    }
    let known: &mut dyn Iterator<Item = &str> = if tail.is_empty() {
        &mut names.iter().map(String::as_str).chain(["seed"])
    } else {
        &mut ids.iter().map(String::as_str)
    };
    let hint = nearest(head, known).map(|name| format!("; did you mean `{name}{tail}`?"));
    let settings = ids.iter().map(|id| format!("{id}.SETTING"));
    let allowed = names.iter().cloned().chain(["seed".into()]).chain(settings);
    format!(
        "no variable or setting of that name{} Allowed: {}",
        hint.unwrap_or_else(|| ".".into()),
        listed(allowed)
    )
}

/// The id of every stage, empty where the YAML gives none.
pub(super) fn stage_ids(tree: &Node) -> Vec<String> {
    let id = |stage: &Node| {
        stage
            .get("id")
            .or_else(|| stage.get("uses"))
            .and_then(Node::text)
            .unwrap_or_default()
    };
    tree.get("stages")
        .map(Node::items)
        .unwrap_or_default()
        .iter()
        .map(id)
        .collect()
}

fn used_variables(tree: &Node) -> BTreeSet<String> {
    let mut used = BTreeSet::new();
    if let Some(stages) = tree.get("stages") {
        stages.walk("", &mut |_, node| {
            if let YamlValue::Text(text) = &node.value {
                used.extend(pieces(text).filter_map(|piece| match piece {
                    Piece::Variable(name) => Some(name.to_string()),
                    Piece::Plain(_) => None,
                }));
            }
        });
    }
    used
}

/// Replaces every `${name}` below `node`; text that is one variable alone takes its type too.
pub(super) fn substitute(node: &mut Node, path: &str, variables: &Variables) -> Vec<Trouble> {
    let mut troubles = Vec::new();
    node.walk_mut(path, &mut |path, node| {
        let YamlValue::Text(text) = &node.value else {
            return;
        };
        let found: Vec<Piece> = pieces(text).collect();
        if !found
            .iter()
            .any(|piece| matches!(piece, Piece::Variable(_)))
        {
            return;
        }
        let text = text.clone();
        match fill(node, &text, variables) {
            Ok(filled) => *node = filled,
            Err(message) => troubles.push(Trouble::new(message).at(node.mark).below(path)),
        }
    });
    troubles
}

fn fill(node: &Node, text: &str, variables: &Variables) -> Result<Node, String> {
    let mut filled = String::new();
    let mut overridden = node.overridden;
    for (index, piece) in pieces(text).enumerate() {
        let name = match piece {
            Piece::Plain(plain) => {
                filled.push_str(plain);
                continue;
            }
            Piece::Variable(name) => name,
        };
        let Some(variable) = variables.get(name) else {
            let hint = nearest(name, variables.keys().map(String::as_str)).map_or_else(
                || ".".into(),
                |near| format!("; did you mean `${{{near}}}`?"),
            );
            return Err(format!(
                "`${{{name}}}` is not defined{hint} Give it under `variables` or by --set {name}=VALUE"
            ));
        };
        if matches!(variable.value, YamlValue::Null) {
            return Err(format!(
                "`${{{name}}}` has no value here: give it by --set {name}=VALUE"
            ));
        }
        if text.len() == name.len() + 3 {
            return Ok(Node {
                mark: node.mark,
                ..variable.clone()
            });
        }
        let Some(value) = variable.text() else {
            return Err(format!(
                "`${{{name}}}` is a list or a block and cannot stand inside text"
            ));
        };
        overridden |= index == 0 && variable.overridden;
        filled.push_str(&value);
    }
    Ok(Node {
        overridden,
        ..Node::new(YamlValue::Text(filled), node.mark)
    })
}

enum Piece<'t> {
    Plain(&'t str),
    Variable(&'t str),
}

/// Splits text at its `${name}`; anything else with a dollar is plain.
fn pieces(text: &str) -> impl Iterator<Item = Piece<'_>> {
    let mut remainder = text;
    std::iter::from_fn(move || {
        if remainder.is_empty() {
            return None;
        }
        if let Some(name) = variable_at(remainder) {
            remainder = &remainder[name.len() + 3..];
            return Some(Piece::Variable(name));
        }
        let end = remainder
            .char_indices()
            .skip(1)
            .find(|(at, _)| variable_at(&remainder[*at..]).is_some())
            .map_or(remainder.len(), |(at, _)| at);
        let (plain, after) = remainder.split_at(end);
        remainder = after;
        Some(Piece::Plain(plain))
    })
}
fn variable_at(text: &str) -> Option<&str> {
    let (name, _) = text.strip_prefix("${")?.split_once('}')?;
    (!name.is_empty()
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-'))
    .then_some(name)
}

/// Most files that a pattern may stand for: a slip must not read a whole disk.
const LIMIT: usize = 10_000;

/// Fills in the entries of `files` and `recording` below the settings of a stage; relative paths start at `folder`.
pub(super) fn expand(with: &mut Node, folder: &Path) -> Vec<Trouble> {
    let mut troubles = Vec::new();
    if let Some(node) = with.at_mut("recording") {
        if node.text().is_some_and(|text| is_pattern(&text)) {
            let alone = node.clone();
            node.value = YamlValue::List(vec![alone]);
        }
        if let YamlValue::List(items) = &mut node.value {
            *items = expanded(std::mem::take(items), folder, "recording", &mut troubles);
        }
    }
    let Some(Node {
        value: YamlValue::List(items),
        ..
    }) = with.at_mut("files")
    else {
        return troubles;
    };
    let all = expanded(std::mem::take(items), folder, "files", &mut troubles);
    *items = all;
    for (index, item) in items.iter_mut().enumerate() {
        let path = item.get("file").and_then(Node::text).unwrap_or_default();
        let Some(Node {
            value: YamlValue::Map(columns),
            ..
        }) = item.at_mut("columns")
        else {
            continue;
        };
        for (key, _, column) in columns.iter_mut() {
            let Some((pattern, mark)) = column
                .get("path")
                .and_then(|node| Some((node.text()?, node.mark)))
            else {
                continue;
            };
            let place = format!("files[{index}].columns.{key}.path");
            match named(&pattern, &path) {
                Ok(name) => {
                    let YamlValue::Map(entries) = &mut column.value else {
                        continue;
                    };
                    entries.retain(|(key, ..)| key != "path");
                    entries.push(("value".into(), mark, Node::new(YamlValue::Text(name), mark)));
                }
                Err(message) => troubles.push(Trouble::new(message).at(mark).below(&place)),
            }
        }
    }
    troubles
}

fn is_pattern(text: &str) -> bool {
    text.contains(['*', '?'])
}

/// Entries of a list of files, each that is a pattern, or whose `file` is one, once for every file that matches.
fn expanded(items: Vec<Node>, folder: &Path, list: &str, troubles: &mut Vec<Trouble>) -> Vec<Node> {
    let mut all = Vec::with_capacity(items.len());
    for (index, item) in items.into_iter().enumerate() {
        let alone = matches!(item.value, YamlValue::Text(_));
        let below = if alone { "" } else { "file" };
        let place = match alone {
            true => format!("{list}[{index}]"),
            false => format!("{list}[{index}].file"),
        };
        let file = item
            .at(below)
            .and_then(|node| Some((node.text()?, node.overridden, node.mark)));
        let Some((pattern, overridden, mark)) = file.filter(|(pattern, ..)| is_pattern(pattern))
        else {
            all.push(item);
            continue;
        };
        let start = if overridden {
            PathBuf::new()
        } else {
            folder.to_path_buf()
        };
        let found = match matching(&start, &pattern) {
            Ok(found) if found.is_empty() => Err(format!(
                "no file matches `{}`",
                start.join(&pattern).display()
            )),
            found => found,
        };
        let entries = found.and_then(|found| {
            let entries = found.into_iter().map(|path| {
                let mut entry = item.clone();
                // Commands in a file of their own: their pattern's stars stand for what the file's stand for.
                let commands = entry
                    .get("commands")
                    .and_then(Node::text)
                    .filter(|commands| is_pattern(commands));
                if let Some(commands) = commands {
                    let text = alike(&pattern, &path, &commands)?;
                    if let Some(node) = entry.at_mut("commands") {
                        node.value = YamlValue::Text(text);
                    }
                }
                if let Some(file) = entry.at_mut(below) {
                    file.value = YamlValue::Text(path);
                }
                Ok(entry)
            });
            entries.collect::<Result<Vec<Node>, String>>()
        });
        match entries {
            Ok(entries) => all.extend(entries),
            Err(message) => troubles.push(Trouble::new(message).at(mark).below(&place)),
        }
    }
    all
}

/// The pattern of `commands` with its stars replaced by the text that those of `pattern` stand for in `path`.
fn alike(pattern: &str, path: &str, commands: &str) -> Result<String, String> {
    let wrong = || {
        format!(
            "`{commands}` is not like `{pattern}`: allowed is a pattern with no more stars, which stand for the same text in the same order"
        )
    };
    let parts = |text: &str| -> Vec<String> {
        let parts = text.split('/').filter(|part| *part != ".");
        parts.map(str::to_string).collect()
    };
    let (parts, all) = (parts(pattern), parts(path));
    if parts.len() != all.len() || pattern.contains('?') || commands.contains('?') {
        return Err(wrong());
    }
    let mut names = Vec::new();
    for (pattern, text) in parts.iter().zip(&all) {
        names.extend(stars(pattern, text).ok_or_else(wrong)?);
    }
    let mut names = names.into_iter();
    let mut out = String::new();
    for (k, part) in commands.split('*').enumerate() {
        if k > 0 {
            out += &names.next().ok_or_else(wrong)?;
        }
        out += part;
    }
    Ok(out)
}

/// Files that match, relative to `start`, in the order of their paths.
fn matching(start: &Path, pattern: &str) -> Result<Vec<String>, String> {
    let is_named = |part: &Component| *part != Component::CurDir;
    let start: PathBuf = start.components().filter(is_named).collect();
    // Brackets are letters here, and no wildcard goes over folders.
    let parts = pattern.split('/').filter(|part| !matches!(*part, "" | "."));
    let parts = parts.map(|part| part.replace('[', "[[]").replace("**", "*"));
    let root = if pattern.starts_with('/') { "/" } else { "" };
    let here = if pattern.starts_with("./") { "./" } else { "" };
    let below = root.to_string() + &parts.collect::<Vec<_>>().join("/");
    let whole = Path::new(&Pattern::escape(&start.to_string_lossy())).join(below);
    let options = MatchOptions {
        require_literal_leading_dot: true,
        ..MatchOptions::default()
    };
    let found = glob_with(&whole.to_string_lossy(), options).map_err(|error| error.to_string())?;
    let relative = |path: PathBuf| {
        let inside = path.strip_prefix(&start).unwrap_or(&path);
        Some(here.to_string() + inside.to_str()?)
    };
    let files = found.flatten().filter(|path| path.is_file());
    let mut found: Vec<String> = files.filter_map(relative).take(LIMIT + 1).collect();
    if found.len() > LIMIT {
        return Err(format!("more than {LIMIT} files match; name a folder"));
    }
    found.sort();
    Ok(found)
}

/// What stands for the braces of a pattern at the end of a path, joined by `/`.
fn named(pattern: &str, path: &str) -> Result<String, String> {
    let wrong = || {
        format!(
            "`{path}` does not end like `{pattern}`; braces stand for text within a folder's or file's name"
        )
    };
    let (parts, all): (Vec<&str>, Vec<&str>) =
        (pattern.split('/').collect(), path.split('/').collect());
    let middle = all
        .len()
        .checked_sub(parts.len())
        .map(|first| &all[first..])
        .ok_or_else(wrong)?;
    let mut names = Vec::new();
    for (pattern, text) in parts.iter().zip(middle) {
        names.extend(braces(pattern, text).ok_or_else(wrong)?);
    }
    if names.is_empty() {
        return Err(format!(
            "`{pattern}` has no braces; e.g. \"{{position}}/hole_{{n}}.csv\""
        ));
    }
    Ok(names.join("/"))
}

/// What stands for the braces of one name, each at least a character.
fn braces(pattern: &str, text: &str) -> Option<Vec<String>> {
    let brace = |pattern: &str| {
        let (before, tail) = pattern.split_once('{')?;
        let (_, after) = tail.split_once('}')?;
        Some((before.to_string(), after.to_string()))
    };
    wildcards(pattern, text, 1, &brace)
}

/// What stands for the stars of one name.
fn stars(pattern: &str, text: &str) -> Option<Vec<String>> {
    let star = |pattern: &str| {
        let (before, after) = pattern.split_once('*')?;
        Some((before.to_string(), after.to_string()))
    };
    wildcards(pattern, text, 0, &star)
}

/// What stands for the wildcards of one name: each the shortest text, of at least so many bytes, that lets the rest match. `split` gives what is
/// before and after the first wildcard of a pattern.
fn wildcards(
    pattern: &str,
    text: &str,
    least: usize,
    split: &dyn Fn(&str) -> Option<(String, String)>,
) -> Option<Vec<String>> {
    let Some((before, after)) = split(pattern) else {
        return (pattern == text).then(Vec::new);
    };
    let text = text.strip_prefix(before.as_str())?;
    let ends = text.char_indices().map(|(at, _)| at).chain([text.len()]);
    ends.filter(|end| *end >= least).find_map(|end| {
        let more = wildcards(&after, &text[end..], least, split)?;
        let first = std::iter::once(text[..end].to_string());
        Some(first.chain(more).collect())
    })
}

#[cfg(test)]
mod tests {
    use super::{alike, named};

    #[test]
    fn stars_of_the_commands_stand_for_the_same_text_as_those_of_the_file() {
        let pattern = "../data/*/motor_*.csv";
        let path = "../data/sine/motor_2.csv";
        let commands = "../data/*/sent_*.csv";
        assert_eq!(
            alike(pattern, path, commands),
            Ok("../data/sine/sent_2.csv".into())
        );
        assert_eq!(alike("*.csv", "a.csv", "b/*.csv"), Ok("b/a.csv".into()));
        assert!(alike("*.csv", "a.csv", "*/*.csv").is_err());
    }

    #[test]
    fn braces_name_what_stands_in_a_path() {
        let pattern = "{position}/hole_{n}.csv";
        assert_eq!(
            named(pattern, "../data/front_left/hole_0.csv"),
            Ok("front_left/0".into())
        );
        assert!(
            named(pattern, "../data/front/socket_0.csv")
                .is_err_and(|message| message.contains("does not end like"))
        );
        assert!(named(pattern, "hole_0.csv").is_err());
        assert!(
            named("hole.csv", "a/hole.csv").is_err_and(|message| message.contains("has no braces"))
        );
    }
}

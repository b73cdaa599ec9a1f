//! Files by a pattern, and names that stand in the paths of files: both are filled in before settings are typed, so that a table's key
//! knows every file and every name.
//!
//! An entry of `files` with `file: data/*/hole_?.csv` stands for one entry for each file that matches, in the order of their paths; `*` is
//! any text within a folder's or file's name, `?` one letter. A column with `path: "{position}/hole_{n}.csv"` has as its value what stands
//! for the braces at the end of its file's path, joined by `/`: `front/0`.

use crate::yaml::{Node, Trouble, YamlValue};
use glob::{MatchOptions, Pattern, glob_with};
use std::path::{Component, Path, PathBuf};

/// Most files that a pattern may stand for: a slip must not read a whole disk.
const LIMIT: usize = 10_000;

/// Fills in the entries of `files` below the settings of a stage; relative paths start at `folder`.
pub(super) fn expand(with: &mut Node, folder: &Path) -> Vec<Trouble> {
    let mut troubles = Vec::new();
    let Some(Node {
        value: YamlValue::List(items),
        ..
    }) = with.at_mut("files")
    else {
        return troubles;
    };
    let mut all = Vec::with_capacity(items.len());
    for (index, item) in std::mem::take(items).into_iter().enumerate() {
        let place = format!("files[{index}].file");
        let file = item
            .get("file")
            .and_then(|node| Some((node.text()?, node.overridden, node.mark)));
        let Some((pattern, overridden, mark)) =
            file.filter(|(pattern, ..)| pattern.contains(['*', '?']))
        else {
            all.push(item);
            continue;
        };
        let start = if overridden {
            PathBuf::new()
        } else {
            folder.to_path_buf()
        };
        match matching(&start, &pattern) {
            Ok(found) if found.is_empty() => {
                troubles.push(
                    Trouble::new(format!(
                        "no file matches `{}`",
                        start.join(&pattern).display()
                    ))
                    .at(mark)
                    .below(&place),
                );
            }
            Ok(found) => all.extend(found.into_iter().map(|path| {
                let mut entry = item.clone();
                if let Some(file) = entry.at_mut("file") {
                    file.value = YamlValue::Text(path);
                }
                entry
            })),
            Err(message) => troubles.push(Trouble::new(message).at(mark).below(&place)),
        }
    }
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

/// What stands for the braces of one name: each the shortest text that lets the rest match.
fn braces(pattern: &str, text: &str) -> Option<Vec<String>> {
    let Some((before, tail)) = pattern.split_once('{') else {
        return (pattern == text).then(Vec::new);
    };
    let (_, after) = tail.split_once('}')?;
    let text = text.strip_prefix(before)?;
    let ends = text
        .char_indices()
        .skip(1)
        .map(|(at, _)| at)
        .chain([text.len()]);
    ends.filter(|end| *end > 0).find_map(|end| {
        let more = braces(after, &text[end..])?;
        Some(
            std::iter::once(text[..end].to_string())
                .chain(more)
                .collect(),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::named;

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

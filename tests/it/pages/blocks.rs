//! Pages as text: fenced blocks, generated blocks, and where pages are.

use std::fs;
use std::path::{Path, PathBuf};

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every page of the repository with its path from the root, in order.
pub fn pages() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for folder in [".", "pipelines", "schemas", "src", "tests"] {
        walk(&root().join(folder), folder != ".", &mut found);
    }
    let name = |path: &Path| {
        path.strip_prefix(root())
            .expect("below the root")
            .to_string_lossy()
            .replace('\\', "/")
    };
    let mut pages: Vec<(String, String)> = found
        .iter()
        .map(|path| {
            (
                name(path).trim_start_matches("./").to_string(),
                fs::read_to_string(path).expect("text"),
            )
        })
        .collect();
    pages.sort();
    assert!(pages.len() > 6, "only {} pages", pages.len());
    pages
}

fn walk(folder: &Path, deep: bool, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
    {
        if entry.is_dir() && deep {
            walk(&entry, true, found);
        } else if entry.extension().is_some_and(|ending| ending == "md") {
            found.push(entry);
        }
    }
}

/// A fenced block: its kind and its lines.
pub struct Fenced<'a> {
    pub kind: &'a str,
    pub lines: Vec<&'a str>,
}

pub fn fenced(text: &str) -> impl Iterator<Item = Fenced<'_>> {
    let mut lines = text.lines();
    std::iter::from_fn(move || {
        let kind = lines.find_map(|line| line.trim_start().strip_prefix("```"))?;
        Some(Fenced {
            kind,
            lines: lines
                .by_ref()
                .take_while(|line| line.trim_start() != "```")
                .collect(),
        })
    })
}

/// The page with the block of this name replaced; none where it has no such block.
pub fn replaced(page: &str, name: &str, text: &str) -> Option<String> {
    let (open, close) = (
        format!("<!-- generated: {name} -->\n"),
        format!("<!-- end of {name} -->"),
    );
    let (before, tail) = page.split_once(&open)?;
    let (_, after) = tail.split_once(&close)?;
    Some(format!("{before}{open}\n{}\n\n{close}{after}", text.trim()))
}

/// Text in a cell of a table.
pub fn cell(text: &str) -> String {
    text.split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .replace('|', "\\|")
}

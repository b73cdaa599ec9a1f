//! Links of the pages lead to files and headings that exist.

use super::blocks::{pages, root};
use std::collections::{BTreeMap, BTreeSet};

/// The anchors of a page's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut fenced = false;
    let mut out = BTreeSet::new();
    for line in text.lines() {
        fenced ^= line.trim_start().starts_with("```");
        let Some((_, heading)) = line
            .split_once("# ")
            .filter(|(marks, _)| !fenced && marks.chars().all(|c| c == '#'))
        else {
            continue;
        };
        let kept: String = heading
            .to_lowercase()
            .chars()
            .filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c))
            .map(|c| if c == ' ' { '-' } else { c })
            .collect();
        let count = seen.entry(kept.clone()).or_default();
        out.insert(if *count == 0 {
            kept
        } else {
            format!("{kept}-{count}")
        });
        *count += 1;
    }
    out
}

/// Where the links of a page lead, those of code left out.
fn targets(text: &str) -> Vec<(usize, String)> {
    let mut fenced = false;
    let mut out = Vec::new();
    for (number, line) in text.lines().enumerate() {
        fenced ^= line.trim_start().starts_with("```");
        if fenced {
            continue;
        }
        let prose: String = line.split('`').step_by(2).collect::<Vec<_>>().join("code");
        for tail in prose.split("](").skip(1) {
            out.extend(
                tail.split_once(')')
                    .map(|(target, _)| (number + 1, target.to_string())),
            );
        }
    }
    out
}

#[test]
fn links_of_pages_lead_to_files_and_headings() {
    let pages = pages();
    let headings: BTreeMap<&str, BTreeSet<String>> = pages
        .iter()
        .map(|(page, text)| (page.as_str(), anchors(text)))
        .collect();
    let (mut faults, mut count) = (Vec::new(), 0);
    for (page, text) in &pages {
        for (line, target) in targets(text)
            .into_iter()
            .filter(|(_, target)| !target.contains("://"))
        {
            count += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let folder = page.rsplit_once('/').map_or("", |(folder, _)| folder);
            let path = if file.is_empty() {
                page.clone()
            } else {
                joined(folder, file)
            };
            if !root().join(&path).exists() {
                faults.push(format!("{page}:{line}: no file {path}"));
            } else if !anchor.is_empty() {
                let known = headings
                    .get(path.as_str())
                    .or_else(|| headings.get(format!("{path}/README.md").as_str()));
                if !known.is_some_and(|known| known.contains(anchor)) {
                    faults.push(format!("{page}:{line}: no heading #{anchor} in {path}"));
                }
            }
        }
    }
    assert!(count > 40, "only {count} links were found");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn joined(folder: &str, file: &str) -> String {
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in file
        .split('/')
        .filter(|part| !part.is_empty() && *part != ".")
    {
        if part == ".." {
            parts.pop();
        } else {
            parts.push(part);
        }
    }
    parts.join("/")
}

#[test]
fn anchors_are_those_that_github_makes() {
    let found =
        anchors("# A, b: `c_d`\n```sh\n# no heading\n```\n## calib run\n## calib run\n#no\n");
    assert_eq!(
        found,
        ["a-b-c_d", "calib-run", "calib-run-1"]
            .map(String::from)
            .into()
    );
}

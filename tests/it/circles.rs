//! No file of `src` uses, by whatever detour, a file that uses it: what two files know of each other belongs into a third.
//!
//! A room's own file (`mod.rs`, or `x.rs` beside `x/`) and the files below it are one here: it lists them, and they use what it declares.

use crate::source::{Source, Use, home, sources, uses};
use std::collections::{BTreeMap, BTreeSet};

/// Files that list what belongs to them, and the folder in which their members are.
const REGISTRIES: [(&str, &str); 2] = [
    ("numerics/effect/form.rs", "numerics/effect/"),
    ("numerics/effect/cause.rs", "numerics/effect/"),
];

/// File -> file that it uses -> where and by which path.
type Arrows<'a> = BTreeMap<&'a str, BTreeMap<&'a str, &'a Use>>;

fn arrows(sources: &[Source]) -> Arrows<'_> {
    let by_module: BTreeMap<&[String], &Source> = sources
        .iter()
        .map(|source| (source.module.as_slice(), source))
        .collect();
    let lists = |lister: &Source, member: &Source| {
        member.module.starts_with(&lister.module)
            || REGISTRIES
                .iter()
                .any(|(file, folder)| lister.file == *file && member.file.starts_with(folder))
    };
    let mut arrows = Arrows::new();
    for source in sources {
        let imported = source.uses.iter().filter(|one| !one.handed_on);
        for (one, to) in imported.filter_map(|one| Some((one, home(&one.path, &by_module)?))) {
            if to.file != source.file && !lists(source, to) {
                arrows
                    .entry(&source.file)
                    .or_default()
                    .entry(&to.file)
                    .or_insert(one);
            }
        }
    }
    arrows
}

/// All that a file uses, directly or by others.
fn reached<'a>(arrows: &Arrows<'a>, file: &str) -> BTreeSet<&'a str> {
    let mut seen = BTreeSet::new();
    let mut waiting: Vec<&str> = vec![file];
    while let Some(next) = waiting.pop() {
        for to in arrows.get(next).into_iter().flat_map(BTreeMap::keys) {
            if seen.insert(*to) {
                waiting.push(to);
            }
        }
    }
    seen
}

/// Sets of files that all use each other, at least by detours.
fn circles<'a>(arrows: &Arrows<'a>) -> BTreeSet<Vec<&'a str>> {
    let reached: BTreeMap<&str, BTreeSet<&'a str>> = arrows
        .keys()
        .map(|file| (*file, reached(arrows, file)))
        .collect();
    let mutual =
        |file: &str, other: &str| reached.get(other).is_some_and(|files| files.contains(file));
    let circle = |file: &&str| -> Vec<&'a str> {
        reached[file]
            .iter()
            .copied()
            .filter(|other| mutual(file, other))
            .collect()
    };
    reached
        .keys()
        .map(circle)
        .filter(|circle| !circle.is_empty())
        .collect()
}

#[test]
fn no_file_uses_what_uses_it() {
    let sources = sources();
    let arrows = arrows(&sources);
    let found = circles(&arrows);
    let mut faults = Vec::new();
    for circle in &found {
        faults.push(format!("a circle of {} files:", circle.len()));
        for file in circle {
            for (to, one) in arrows[file].iter().filter(|(to, _)| circle.contains(to)) {
                faults.push(format!(
                    "  src/{file}:{} uses {to} by {}",
                    one.line,
                    one.path.join("::")
                ));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_circle_is_found_behind_a_door_that_hands_on() {
    let text = |module: &str| match module {
        "room" => "pub use left::Left;\nuse right::help;",
        "room::left" => "use super::right::Right;",
        "room::right" => "use crate::{other::Apart, room::Left};\npub fn help() {}",
        _ => "use crate::room::right::Right;",
    };
    let words = |module: &str| module.split("::").map(String::from).collect::<Vec<_>>();
    let names = ["room", "room::left", "room::right", "user"];
    let modules = names.map(words);
    let sources = names.map(|name| Source {
        file: name.replace("::", "/"),
        module: words(name),
        uses: uses(text(name), &words(name), &modules),
    });
    assert_eq!(
        circles(&arrows(&sources)),
        BTreeSet::from([vec!["room/left", "room/right"]])
    );
}

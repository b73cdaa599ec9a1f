//! Every cause as a page's section, from its declaration, and the walk that adds one.

use super::blocks::{cell, root};
use super::signature::signatures;
use calib::effect::{CAUSES, Cause, EffectContext, Load};
use calib::spatial::Pose;
use std::fs;

pub fn text() -> String {
    let mut text = String::from("| cause | place | formula |\n|---|---|---|\n");
    for about in CAUSES.iter().map(|cause| cause.about()) {
        text.push_str(&format!("| [`{0}`](#{0}) | {1} | {2} |\n", about.name, about.place, cell(about.formula)));
    }
    text.push_str(
        "\nA signature is the motion of the measured point (of joints: along the path on which the joint moves it) while the joint of the cause sweeps \
         from end to end, comes from below in the first half and from above in the second, and time and temperature rise. Every line has its own scale.\n",
    );
    let pictures = signatures();
    for cause in CAUSES {
        let about = cause.about();
        text.push_str(&format!("\n### {}\n\n| | |\n|---|---|\n", about.name));
        let signature = pictures.get(about.name).map_or_else(String::new, |(of, line)| format!("`{line}` {of}"));
        for (head, says) in [
            ("place", about.place.to_string()),
            ("formula", about.formula.to_string()),
            ("signature", signature),
            ("usual size", about.size.to_string()),
            ("needs", about.needs.to_string()),
            ("confounded with", about.confounded.to_string()),
            ("next measurement", next(*cause)),
            ("found by", found_by(*cause)),
        ] {
            if !["", "-"].contains(&says.as_str()) {
                text.push_str(&format!("| {head} | {} |\n", cell(&says)));
            }
        }
    }
    text
}

/// What separates a cause from the others that the data do not exclude.
fn next(cause: &dyn Cause) -> String {
    let poses = "poses that `calib poses --run HEAD --separate` proposes";
    match (cause.about().measure, cause.about().separable_by_poses) {
        (Some(measure), true) => format!("{poses}; {}", measure.advice),
        (Some(measure), false) => measure.advice.to_string(),
        (None, true) => poses.to_string(),
        (None, false) => String::new(),
    }
}

fn found_by(cause: &dyn Cause) -> String {
    let setting = EffectContext { base: Pose::identity(), load: Load::GravityTorque };
    let identified = cause.arm_effect(&setting).is_some();
    let stays = if cause.about().of_the_measurement { "; it belongs to the measurement and is not compensated" } else { "" };
    format!("{}{stays}", if identified { "`identify`; `diagnose` has it in its base model or names it" } else { "`diagnose`" })
}

/// The walk: the file of a cause as a test compiles and fits it, and the two lines that make it known.
pub fn walk() -> String {
    let file = include_str!("seat_compliance.rs");
    let (code, _) = file.split_once("\n#[cfg(test)]\n").expect("a cause, then its test");
    format!(
        "1. **Write one file**, `src/numerics/effect/seat_compliance.rs`: a law at a place. A test compiles the file below as it stands here and fits it to a recording \
         (`cargo test --test it seat_compliance`); in the library its first line reads `use super::{{...}}`.\n\n```rust\n{}\n```\n\n\
         2. **Make it known** by two lines: `mod seat_compliance;` in [`mod.rs`](mod.rs), and `&seat_compliance::SeatCompliance,` in the list `CAUSES` of \
         [`cause.rs`](cause.rs), behind the causes that a model has before it.\n\
         3. **Run the laws**: `cargo test --test it forms`. Every form of every cause must be nothing without a size, have central differences as its partials, survive \
         being stored, stay near its neighbours, and have a sentence of its own; the sentence is added to `tests/it/forms/sentences.txt` after you read it.\n\
         4. **Write the pages anew**: `CALIB_UPDATE=1 cargo test --test it pages`. The cause has its section above, and `calib effects` lists it.\n\
         5. **Show that it is found**, and not where it is not: conceal it in the twin (`src/twin/effect/`, by mathematics of its own) and run \
         `calib simulate prove --out proof --seed 7 --cases 60 --nulls 0.5`.",
        code.trim()
    )
}

#[test]
fn a_cause_is_one_file_and_two_lines_as_the_walk_says() {
    let folder = root().join("src/numerics/effect");
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("a file");
    let (modules, list) = (read("mod.rs"), read("cause.rs"));
    let mut count = 0;
    for entry in fs::read_dir(&folder).expect("the effects").map(|entry| entry.expect("an entry").path()) {
        let text = if entry.extension().is_some_and(|ending| ending == "rs") {
            fs::read_to_string(&entry).expect("text")
        } else {
            continue;
        };
        for name in text.lines().filter_map(|line| line.strip_prefix("impl Cause for ")?.strip_suffix(" {")) {
            let stem = entry.file_stem().expect("a name").to_string_lossy().into_owned();
            assert_eq!(modules.lines().filter(|line| *line == format!("mod {stem};")).count(), 1, "{stem}");
            assert_eq!(list.lines().filter(|line| line.trim() == format!("&{stem}::{name},")).count(), 1, "{stem}::{name}");
            count += 1;
        }
    }
    assert_eq!(count, CAUSES.len());
}

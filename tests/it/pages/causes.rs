//! Every cause as a page's section, from its row, and the walk that adds one.

use super::blocks::cell;
use calib::effect::CAUSES;

pub fn text() -> String {
    let mut text = String::from(
        "| cause | place | formula | usual size | needs | confounded with |\n|---|---|---|---|---|---|\n",
    );
    for cause in CAUSES {
        let cells = [
            cause.place,
            cause.formula,
            cause.size,
            cause.needs,
            cause.confounded,
        ]
        .map(cell);
        text.push_str(&format!("| `{}` | {} |\n", cause.name, cells.join(" | ")));
    }
    text
}

/// The walk: the row of a cause as a test compiles and fits it.
pub fn walk() -> String {
    let file = include_str!("seat_compliance.rs");
    let (code, _) = file
        .split_once("\n#[cfg(test)]\n")
        .expect("a row, then its test");
    let (_, row) = code.split_once("\n\n").expect("imports, then the row");
    format!(
        "1. **Write a row** into [`table.rs`](table.rs), behind the causes that a model has before it, as `&Cause {{ .. }}`. A test compiles the one below as it \
         stands here and fits it to a recording (`cargo test --test it seat_compliance`).\n\n```rust\n{}\n```\n\n\
         2. **Run the laws**: `cargo test --test it forms`. Every form must be nothing without a size, have central differences as its partials, survive being \
         stored, stay near its neighbours and have a sentence; `tests/it/forms/sentences.txt` lists them (`CALIB_UPDATE=1` writes it anew), `src/report/language/de_stored.po` has their German.\n\
         3. **Write the pages anew**: `CALIB_UPDATE=1 cargo test --test it pages`.\n\
         4. **Show that it is found**, and not where it is not: conceal it in the twin (`src/twin/effect/`, by mathematics of its own) and run \
         `calib simulate prove --out proof --seed 7 --cases 60 --nulls 0.5`.",
        row.trim()
    )
}

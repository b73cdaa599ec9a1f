//! Numbers by which something is decided, one table a class: what each means, its unit, where it is from, and what halving and doubling
//! it does.
//!
//! A source is of one of these kinds: `literature`, `physics` (sizes of arms, links, air), `count` (what follows from how many there
//! are), `measured by` a script, and `judgement`: somebody chose it. The last entry of a row is what `tests/reference/ablate.py` saw; it is
//! empty where no recording of that run came by. Numbers that decide nothing (rows that one thread handles, roundings, steps of a solver)
//! stand where they are used.
//!
//! With the feature `ablate` a program may scale each of them while it runs; without it they are constants.

mod criterion;

pub mod cells;
pub mod choose;
pub mod closed_form;
pub mod effect;
pub mod fleet;
pub mod judge;
pub mod noise;
pub mod screen;
pub mod search;
pub mod setup;
pub mod torque;
pub mod words;

#[cfg(feature = "ablate")]
pub use criterion::ablate::{CriterionFactor, Scaled};
pub use criterion::{CriterionRow, CriterionValue};

/// All tables.
pub const TABLES: &[&[CriterionRow]] = &[
    cells::ROWS,
    choose::ROWS,
    closed_form::ROWS,
    effect::ROWS,
    fleet::ROWS,
    judge::ROWS,
    noise::ROWS,
    screen::ROWS,
    search::ROWS,
    setup::ROWS,
    torque::ROWS,
    words::ROWS,
];

/// Whether something came by a criterion since the last call, by the names of rooms and criteria.
#[cfg(feature = "ablate")]
pub fn reached() -> Vec<String> {
    let reached = all().filter(|(_, row)| row.criterion.was_reached());
    reached.map(|(name, _)| name).collect()
}

/// Scales one criterion (`room::NAME`) and leaves all others as they are; `false` where there is none of that name.
#[cfg(feature = "ablate")]
pub fn scale(name: &str, factor: CriterionFactor) -> bool {
    all().for_each(|(_, row)| row.criterion.scale(CriterionFactor::One));
    let found = all().find(|(other, _)| other == name);
    found
        .inspect(|(_, row)| row.criterion.scale(factor))
        .is_some()
}

#[cfg(feature = "ablate")]
fn all() -> impl Iterator<Item = (String, &'static CriterionRow)> {
    let rows = TABLES.iter().copied().flatten();
    rows.map(|row| (format!("{}::{}", row.room, row.name), row))
}

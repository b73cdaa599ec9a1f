//! The difference of two runs as a short text: what was put in differently, and what came out of it, table by table.

use crate::audit::{RunAddress, RunDiff, TableChange};
use crate::diff::{ColumnDiff, TableDiff, headline, short};
use crate::error::{Result, counted};
use crate::pipeline::{Manifest, StageReport};
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::Store;
use crate::table::{FindingRow, Findings, Rivals, Table};
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;

/// Tables that are told one by one.
const TABLES: usize = 6;
/// Settings and files that are told one by one.
const CAUSES: usize = 5;

/// Two runs compared, as text, with the rivals that are gone or new; with `stat` every table of which rows differ.
pub fn run_diff(diff: &RunDiff, rivals: &[RivalChange], stat: bool) -> String {
    let most = |shown: usize| if stat { usize::MAX } else { shown };
    let value = |value: &str| match value.len() > 40 {
        true => format!("{}…", value.chars().take(12).collect::<String>()),
        false => value.to_string(),
    };
    let causes = diff.causes.iter().take(most(CAUSES)).map(|cause| {
        let change = &cause.change;
        let place = match change.name.is_empty() {
            true => &cause.stage,
            false => &change.name,
        };
        let [before, now] = [&change.before, &change.now].map(|text| value(text));
        (&change.what, place, before, now)
    });
    let causes: Vec<_> = causes.collect();
    let is_same = |table: &&TableChange| table.status == "same";
    let (same, mut differing): (Vec<_>, Vec<&TableChange>) = diff.tables.iter().partition(is_same);
    // The largest change of a length first; of tables without one what people ask for, in the order of the pipeline.
    let rank = |table: &TableChange| {
        ["parameters", "statistics", "prediction"]
            .iter()
            .position(|kind| *kind == table.kind)
            .unwrap_or(3)
    };
    differing.sort_by(|a, b| {
        largest_mm(b)
            .total_cmp(&largest_mm(a))
            .then(rank(a).cmp(&rank(b)))
    });
    let (shown, others) = differing.split_at(differing.len().min(most(TABLES)));
    let tables = shown.iter().map(|table| (&table.name, summary(table)));
    let others = others.iter().map(|table| &table.name);
    let about = context! {
        runs => Serde([&diff.a, &diff.b]), more_causes => diff.causes.len() - causes.len(), causes => Serde(causes),
        rivals => rival_words(rivals), tables => Serde(tables.collect::<Vec<_>>()),
        width => shown.iter().map(|table| table.name.len()).max(),
        others => Serde(others.collect::<Vec<_>>()), same => same.len(),
    };
    filled(include_str!("text/run_diff.txt"), about)
}

/// The largest change of a column in mm, 0 where none changed.
fn largest_mm(table: &TableChange) -> f64 {
    let columns = table
        .diff
        .iter()
        .flat_map(|diff| &diff.columns)
        .filter(|column| column.unit == "mm" && column.changed > 0);
    columns
        .filter_map(|column| column.statistics)
        .map(|found| found.max)
        .fold(0.0, f64::max)
}

fn summary(table: &TableChange) -> String {
    let Some(diff) = &table.diff else {
        return table.status.into();
    };
    let rows = &diff.rows;
    let all = rows.same + rows.within_tolerance + rows.changed;
    let changed = match rows.changed {
        0 => table.status.to_string(),
        changed => format!("{changed} of {} changed", counted(all, "row")),
    };
    let counts = [
        (rows.only_a, "only in A"),
        (rows.only_b, "only in B"),
        (diff.duplicates(), "with duplicate keys"),
    ];
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let counts = counts.map(|(count, what)| format!("{count} {what}"));
    let found = diff.findings.iter();
    let found = found.map(|one| format!("{} {}: {}", one.what, one.column, one.says));
    let parts = std::iter::once(changed).chain(counts).chain(found);
    parts.collect::<Vec<_>>().join(", ") + &measure(diff)
}

/// The column that says most: its greatest change, in its unit and in sigmas.
fn measure(diff: &TableDiff) -> String {
    let is_telling = |column: &&ColumnDiff| {
        column.changed > 0 && column.statistics.is_some() && !column.unit.is_empty()
    };
    let telling = || diff.columns.iter().filter(is_telling);
    let sigmas = |column: &ColumnDiff| column.max_sigmas.unwrap_or(0.0);
    let column = telling().find(|column| column.name == "error_mm");
    let column = column.or_else(|| telling().max_by(|a, b| sigmas(a).total_cmp(&sigmas(b))));
    match column.and_then(|column| Some((column, column.statistics?))) {
        // Where every row is a quantity of its own, the worst row says more than a mean over rows.
        Some((column, found)) if diff.rows.changed > 20 => {
            let sigmas = column.max_sigmas;
            let sigmas = sigmas.map_or_else(String::new, |by| format!(" ({} sigma)", short(by)));
            let (name, unit) = (&column.name, &column.unit);
            let [rms, max] = [found.rms, found.max].map(short);
            format!("; {name} by {rms} {unit} rms, at most {max} {unit}{sigmas}")
        }
        _ => diff.worst.first().map_or_else(String::new, |row| {
            format!("; {}: {}", row.key, headline(row))
        }),
    }
}

/// Less probable than this, a rival is excluded: one in twenty is what a reader takes for decided.
const OPEN: f64 = 0.05;

/// A finding of one of two runs and an explanation that one of them could not exclude.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalChange {
    pub(crate) stage: String,
    pub(crate) finding: CauseAtPlace,
    /// What fitted as well, in one of the runs.
    pub(crate) rival: CauseAtPlace,
    /// What the later run makes of both.
    pub(crate) outcome: RivalOutcome,
    /// Probability of the rival, or of the finding where the rival took its place; null where it is not among the rivals.
    pub(crate) before: Option<f64>,
    /// The same in the later run; `None` where it is gone.
    pub(crate) now: Option<f64>,
}

/// An effect at a place, as tables have them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct CauseAtPlace {
    pub(crate) effect: String,
    #[serde(rename = "where")]
    pub(crate) place: String,
}

/// What run B says of a finding and its rival in run A.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum RivalOutcome {
    /// The finding stays, the rival is excluded.
    Confirmed,
    /// The rival is the finding now, and what was found before is excluded.
    Reversed,
    /// One of the two is found, and the other is not excluded.
    Open,
    Both,
    Neither,
    /// A finding of run B has a rival that run A excluded.
    New,
}

/// The findings of a diagnosis, and the rivals of each with their probabilities.
struct DiagnosedCauses(Vec<(CauseAtPlace, Vec<Listed>)>);

/// A rival and its probability.
type Listed = (CauseAtPlace, Option<f64>);

impl DiagnosedCauses {
    /// None where a table was not written or has left the store.
    fn read(stage: &StageReport, store: &Store) -> Result<Option<Self>> {
        let (findings, rivals): (Option<Findings>, Option<Rivals>) =
            (table(stage, store)?, table(stage, store)?);
        let (Some(findings), Some(rivals)) = (findings, rivals) else {
            return Ok(None);
        };
        let finding = |row: &FindingRow| {
            let of_finding = rivals.0.iter().filter(|rival| rival.rank == row.rank);
            let named =
                of_finding.map(|rival| (cause(&rival.effect, &rival.place), rival.probability));
            (cause(&row.effect, &row.place), named.collect())
        };
        Ok(Some(Self(findings.0.iter().map(finding).collect())))
    }

    fn finds(&self, cause: &CauseAtPlace) -> bool {
        self.0.iter().any(|(finding, _)| finding == cause)
    }

    /// Findings with the rivals that are not excluded, and their probabilities.
    fn open(&self) -> impl Iterator<Item = (&CauseAtPlace, &CauseAtPlace, Option<f64>)> {
        let pairs = self.0.iter().flat_map(|(finding, rivals)| {
            rivals
                .iter()
                .map(move |(rival, value)| (finding, rival, *value))
        });
        pairs.filter(|(_, _, value)| is_open(*value))
    }

    /// A rival of a finding, if it is listed.
    fn rival(&self, finding: &CauseAtPlace, rival: &CauseAtPlace) -> Option<&Listed> {
        let of_finding = self.0.iter().filter(|(cause, _)| cause == finding);
        let mut rivals = of_finding.flat_map(|(_, rivals)| rivals);
        rivals.find(|(cause, _)| cause == rival)
    }
}

/// A rival that is listed without a probability is not excluded.
fn is_open(probability: Option<f64>) -> bool {
    probability.is_none_or(|value| value >= OPEN)
}

fn cause(effect: &str, place: &str) -> CauseAtPlace {
    CauseAtPlace {
        effect: effect.into(),
        place: place.into(),
    }
}

/// A table of a stage; none where it was not written or has left the store.
fn table<T: Table>(stage: &StageReport, store: &Store) -> Result<Option<T>> {
    let Some(record) = stage.outputs.iter().find(|output| output.kind == T::KIND) else {
        return Ok(None);
    };
    if !store.object(&record.table)?.exists() {
        return Ok(None);
    }
    T::from_frame(&store.load(&record.table)?).map(Some)
}

fn compare(stage: &str, a: &DiagnosedCauses, b: &DiagnosedCauses) -> Vec<RivalChange> {
    let change = |finding: &CauseAtPlace, rival: &CauseAtPlace, outcome| RivalChange {
        stage: stage.into(),
        finding: finding.clone(),
        rival: rival.clone(),
        outcome,
        before: None,
        now: None,
    };
    let probability = |listed: Option<&Listed>| listed.and_then(|(_, value)| *value);
    let mut out: Vec<RivalChange> = Vec::new();
    for (finding, rival, before) in a.open() {
        let (stays, comes) = (b.finds(finding), b.finds(rival));
        let listed = match stays {
            true => b.rival(finding, rival),
            false => b.rival(rival, finding),
        };
        let outcome = match (stays, comes) {
            (true, true) => RivalOutcome::Both,
            (false, false) => RivalOutcome::Neither,
            _ if listed.is_some_and(|(_, value)| is_open(*value)) => RivalOutcome::Open,
            (true, false) => RivalOutcome::Confirmed,
            (false, true) => RivalOutcome::Reversed,
        };
        out.push(RivalChange {
            before,
            now: probability(listed),
            ..change(finding, rival, outcome)
        });
    }
    for (finding, rival, now) in b.open() {
        let is_known = |one: &RivalChange| {
            [(&one.finding, &one.rival), (&one.rival, &one.finding)].contains(&(finding, rival))
        };
        if !out.iter().any(is_known) {
            out.push(RivalChange {
                before: probability(a.rival(finding, rival)),
                now,
                ..change(finding, rival, RivalOutcome::New)
            });
        }
    }
    out
}

/// What the diagnoses of two compared runs say about rivals, stage by stage.
pub fn rival_changes(
    store: &Store,
    diff: &RunDiff,
    runs: [&RunAddress; 2],
) -> Result<Vec<RivalChange>> {
    let [a, b] = [&diff.a, &diff.b].map(|run| Manifest::of(store, &run.run));
    let (a, b) = (a?, b?);
    let is_asked = |id: &String| {
        let named = |run: &&RunAddress| {
            run.port.is_none() && run.stage.as_ref().is_none_or(|stage| stage == id)
        };
        runs.iter().all(named)
    };
    let mut out = Vec::new();
    for now in b.stages.iter().filter(|stage| is_asked(&stage.id)) {
        let before = a.stage(&now.id);
        let both = before.filter(|before| {
            [&before.uses, &now.uses]
                .iter()
                .all(|uses| **uses == Diagnose::NAME)
        });
        let Some(before) = both else { continue };
        let causes = [before, now].map(|stage| DiagnosedCauses::read(stage, store));
        let [before, after] = causes;
        if let (Some(before), Some(after)) = (before?, after?) {
            out.extend(compare(&now.id, &before, &after));
        }
    }
    Ok(out)
}

/// A line each.
pub(crate) fn rival_words(changes: &[RivalChange]) -> String {
    let about = context! { changes => Serde(changes) };
    filled(include_str!("text/rivals.txt"), about)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagnosed(findings: &[(&str, &[(&str, f64)])]) -> DiagnosedCauses {
        let named = |text: &str| {
            text.split_once('@')
                .map(|(effect, place)| cause(effect, place))
                .expect("EFFECT@PLACE")
        };
        let rivals = |all: &[(&str, f64)]| {
            all.iter()
                .map(|(name, value)| (named(name), Some(*value)))
                .collect()
        };
        DiagnosedCauses(
            findings
                .iter()
                .map(|(name, all)| (named(name), rivals(all)))
                .collect(),
        )
    }

    #[test]
    fn every_rival_that_was_open_is_confirmed_reversed_or_still_open() {
        let before = diagnosed(&[
            (
                "joint_compliance@joint 2",
                &[
                    ("joint_hardening@joint 2", 0.31),
                    ("link_mass@link 2", 0.02),
                ],
            ),
            ("backlash@joint 3", &[("joint_log_lag@joint 3", 0.2)]),
            ("gear_cyclic@joint 1", &[("cable_drag@joint 1", 0.4)]),
            ("link_mass@link 4", &[("link_mass@link 5", 0.3)]),
            ("tool_shift@tool", &[("base_shift@base", 0.1)]),
        ]);
        let now = diagnosed(&[
            (
                "joint_compliance@joint 2",
                &[
                    ("joint_hardening@joint 2", 0.01),
                    ("link_mass@link 2", 0.06),
                ],
            ),
            ("joint_log_lag@joint 3", &[]),
            ("gear_cyclic@joint 1", &[("cable_drag@joint 1", 0.07)]),
            ("link_mass@link 4", &[]),
            ("link_mass@link 5", &[]),
        ]);
        let found = compare("diagnose", &before, &now);
        use RivalOutcome::{Both, Confirmed, Neither, New, Open, Reversed};
        let outcomes: Vec<RivalOutcome> = found.iter().map(|change| change.outcome).collect();
        assert_eq!(outcomes, [Confirmed, Reversed, Open, Both, Neither, New]);
        let text = rival_words(&found);
        for line in [
            "diagnose: decided: joint_compliance at joint 2, not joint_hardening at joint 2 (its probability 0.31 -> 0.01)",
            "diagnose: decided: joint_log_lag at joint 3, not backlash at joint 3 as in A (the rival's probability was 0.20 there)",
            "diagnose: still open: gear_cyclic at joint 1 or cable_drag at joint 1 (probability of the less probable one 0.40 -> 0.07)",
            "diagnose: new rival: joint_compliance at joint 2 or link_mass at link 2 (probability 0.02 -> 0.06)",
        ] {
            assert!(text.contains(line), "{line} is missing in\n{text}");
        }
    }
}

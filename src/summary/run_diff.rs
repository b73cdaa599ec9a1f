//! The difference of two runs as a short text: what was put in differently, and what came out of it, table by table.

use super::rival_changes::{RivalChange, rival_words};
use super::run::filled;
use crate::audit::{RunDiff, TableChange};
use crate::diff::{ColumnDiff, TableDiff, headline, short};
use crate::error::counted;
use minijinja::context;
use minijinja::value::Serde;

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
        let place = if change.name.is_empty() {
            &cause.stage
        } else {
            &change.name
        };
        (
            &change.what,
            place,
            value(&change.before),
            value(&change.now),
        )
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
    let mut parts = vec![if rows.changed == 0 {
        table.status.to_string()
    } else {
        format!("{} of {} changed", rows.changed, counted(all, "row"))
    }];
    for (count, what) in [
        (rows.only_a, "only in A"),
        (rows.only_b, "only in B"),
        (diff.duplicates(), "with duplicate keys"),
    ] {
        if count > 0 {
            parts.push(format!("{count} {what}"));
        }
    }
    parts.extend(
        diff.findings
            .iter()
            .map(|finding| format!("{} {}: {}", finding.what, finding.column, finding.says)),
    );
    let mut text = parts.join(", ");
    text.push_str(&measure(diff));
    text
}

/// The column that says most: its greatest change, in its unit and in sigmas.
fn measure(diff: &TableDiff) -> String {
    let worst = diff.worst.first().map(|row| (&row.key, headline(row)));
    let telling = |column: &&ColumnDiff| {
        column.changed > 0 && column.statistics.is_some() && !column.unit.is_empty()
    };
    let column = diff
        .columns
        .iter()
        .filter(telling)
        .find(|column| column.name == "error_mm");
    let column = column.or_else(|| {
        diff.columns.iter().filter(telling).max_by(|l, r| {
            l.max_sigmas
                .unwrap_or(0.0)
                .total_cmp(&r.max_sigmas.unwrap_or(0.0))
        })
    });
    match (
        column.and_then(|column| Some((column, column.statistics?))),
        worst,
    ) {
        // Where every row is a quantity of its own, the worst row says more than a mean over rows.
        (Some((column, found)), _) if diff.rows.changed > 20 => {
            let sigmas = column
                .max_sigmas
                .map_or_else(String::new, |sigmas| format!(" ({} sigma)", short(sigmas)));
            format!(
                "; {} by {} {} rms, at most {} {}{sigmas}",
                column.name,
                short(found.rms),
                column.unit,
                short(found.max),
                column.unit
            )
        }
        (_, Some((key, cell))) => format!("; {key}: {cell}"),
        _ => String::new(),
    }
}

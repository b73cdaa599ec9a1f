//! The difference of two runs as a short text: what was put in differently, and what came out of it, table by table.

use super::rival_changes::{RivalChange, rival_words};
use crate::audit::{RunDiff, TableChange};
use crate::diff::{ColumnDiff, TableDiff, headline, short};
use crate::error::counted;

/// Tables that are told one by one.
const TABLES: usize = 6;
/// Settings and files that are told one by one.
const CAUSES: usize = 5;

/// Two runs compared, as text, with the rivals that are gone or new; with `stat` every table of which rows differ.
pub fn run_diff(diff: &RunDiff, rivals: &[RivalChange], stat: bool) -> String {
    let line = |letter: char, run: &crate::audit::RunSummary| {
        format!(
            "{letter}  {}  {}  {:.16}\n",
            run.run, run.pipeline, run.started
        )
    };
    let mut text = line('A', &diff.a) + &line('B', &diff.b);
    let shown = if stat { diff.causes.len() } else { CAUSES };
    for cause in diff.causes.iter().take(shown) {
        let change = &cause.change;
        let value = |value: &str| {
            if value.len() > 40 {
                format!("{}…", value.chars().take(12).collect::<String>())
            } else {
                value.to_string()
            }
        };
        let place = if change.name.is_empty() {
            cause.stage.clone()
        } else {
            change.name.clone()
        };
        text.push_str(&format!(
            "{} {place}: {} -> {}\n",
            change.what,
            value(&change.before),
            value(&change.now)
        ));
    }
    if diff.causes.len() > shown {
        text.push_str(&format!(
            "and {} of settings and files\n",
            counted(diff.causes.len() - shown, "more change")
        ));
    }
    if diff.causes.is_empty() {
        text.push_str("settings, files and seeds are the same\n");
    }
    let same = diff
        .tables
        .iter()
        .filter(|table| table.status == "same")
        .count();
    let mut differing: Vec<&TableChange> = diff
        .tables
        .iter()
        .filter(|table| table.status != "same")
        .collect();
    if differing.is_empty() {
        return text + &format!("same: {}\n", counted(same, "table"));
    }
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
    let (shown, rest) = differing.split_at(if stat {
        differing.len()
    } else {
        differing.len().min(TABLES)
    });
    text.push_str(&rival_words(rivals));
    text.push('\n');
    let width = shown
        .iter()
        .map(|table| table.name.len())
        .max()
        .unwrap_or(0);
    for table in shown {
        text.push_str(&format!("{:width$}  {}\n", table.name, summary(table)));
    }
    let rest: Vec<&str> = rest.iter().map(|table| table.name.as_str()).collect();
    if !rest.is_empty() {
        text.push_str(&format!(
            "also changed: {} (--stat lists each)\n",
            list(&rest)
        ));
    }
    if same > 0 {
        text.push_str(&format!("same: {}\n", counted(same, "table")));
    }
    text
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

fn list(names: &[&str]) -> String {
    const SHOWN: usize = 4; // a line's worth
    if names.len() <= SHOWN {
        names.join(", ")
    } else {
        format!(
            "{} and {} more",
            names[..SHOWN].join(", "),
            names.len() - SHOWN
        )
    }
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

//! A run in ten lines: what was measured, the error before and after, what was found, the verdict, what is in doubt, one next step.
//!
//! Tables of a run as text and as rows: errors step by step, rivals of learned corrections, optimisers compared, rejected rows.

use super::estimate::length;
use super::{DiagnosisSummary, labelled, screen, tables};
use crate::error::{Result, counted};
use crate::pipeline::{CompletedRun, Manifest};
use crate::stage::{DIAGNOSES, DeclaredStage, Transfer};
use crate::store::Store;
use crate::table::{
    Contradicted, Corrections, CorrectionsRow, Robot, Searches, SearchesRow, Standing, Statistics,
    StatisticsRow, Table, Withdrawn,
};
use screen::NextStep;
use serde::Serialize;
use serde_json::{Value, json};

/// How a result is printed.
#[derive(Debug, Clone, Copy, Default)]
pub struct ResultScreen<'a> {
    /// The `--store` of the commands that are proposed.
    pub(crate) store: &'a str,
    /// Columns of the terminal, where there is one.
    pub(crate) columns: Option<usize>,
}

/// The errors at the largest set that the step which stands was not fitted to, else at the one that it was fitted to; nothing where no
/// stage stated errors or diagnosed; where a model is carried to another recording, what it does there. A `wrong` set-up is stated alone.
pub fn in_short(
    outcome: &CompletedRun,
    standing: Option<&Standing>,
    wrong: Option<&str>,
    store: &Store,
    on: ResultScreen,
) -> Result<Option<String>> {
    let width = screen::width(on.columns);
    let rows = statistics_rows(outcome, store)?;
    let ran = |name: &str| {
        outcome
            .manifest
            .stages
            .iter()
            .rfind(|stage| stage.uses == name && !stage.outputs.is_empty())
    };
    let diagnosed = DIAGNOSES.iter().find_map(|name| ran(name));
    let diagnosed = diagnosed
        .map(|stage| DiagnosisSummary::read(&outcome.manifest.run_id, stage, store))
        .transpose()?;
    if let Some(wrong) = wrong {
        let verdict =
            diagnosed.map_or_else(|| "wrong set-up".into(), |diagnosis| diagnosis.verdict());
        return Ok(Some(
            labelled("verdict", &verdict)
                + &screen::sentence("", wrong.trim_start_matches("the set-up is wrong: "), width),
        ));
    }
    // What a model does elsewhere is what a carried one is asked for; its sets may bear the names of those that it was fitted to.
    let carried = ran(Transfer::NAME).filter(|stage| rows.iter().any(|row| row.step == stage.id));
    let last = || {
        rows.iter()
            .max_by_key(|row| row.order)
            .map(|row| row.step.as_str())
    };
    let stands = || standing.map(|stands| stands.step.as_str()).or_else(last);
    let step = carried.map(|stage| stage.id.as_str()).or_else(stands);
    let of_step = || rows.iter().filter(|row| Some(row.step.as_str()) == step);
    let Some(after) = of_step().max_by_key(|row| (row.held_out, row.points)) else {
        return Ok(diagnosed.map(|diagnosis| diagnosis.in_short(width, on.store)));
    };
    let earlier = rows
        .iter()
        .filter(|row| carried.is_none() && row.set == after.set && row.order < after.order);
    let before = earlier.min_by_key(|row| (row.order, row.held_out != after.held_out));
    let robot = tables::<Robot>(&outcome.manifest, store)?
        .into_iter()
        .next()
        .and_then(|robot| robot.0.into_iter().next());
    let points = |held_out: bool| {
        of_step()
            .filter(|row| row.held_out == held_out)
            .map(|row| row.points as usize)
            .sum::<usize>()
    };
    let points = format!(
        "{}, {} held out",
        counted(points(false) + points(true), "point"),
        points(true)
    );
    let noise = screen::noise(&length(after.noise_rms_mm), after.noise_basis.as_deref());
    let mut text = screen::measured(
        robot.as_ref().map(|base| base.name.as_str()),
        &points,
        Some(&noise),
    );
    let least = before.map_or(after.mean_mm, |row| row.mean_mm.min(after.mean_mm));
    text.push_str(&before.map_or_else(String::new, |row| error("before", row, least)));
    text.push_str(&error(
        if carried.is_some() {
            "carried"
        } else {
            "after"
        },
        after,
        least,
    ));
    if let Some(diagnosis) = &diagnosed {
        text.push_str(&screen::found(diagnosis.in_few_words(), width));
    }
    text.push_str(&labelled(
        "verdict",
        &diagnosed
            .as_ref()
            .map_or_else(|| verdict(after), DiagnosisSummary::verdict),
    ));
    if let Some(doubtful) = after.remarked.filter(|doubtful| *doubtful > 0) {
        let counted_points = counted(after.points as usize, "point");
        text.push_str(&labelled(
            "doubt",
            &format!(
                "{doubtful} of {counted_points}: correction uncertain by more than half of itself"
            ),
        ));
    }
    for warning in carried
        .iter()
        .flat_map(|stage| &stage.warnings)
        .cloned()
        .chain(standing.into_iter().flat_map(warnings))
    {
        text.push_str(&screen::sentence("warning", &warning, width));
    }
    let next = diagnosed
        .and_then(|diagnosis| diagnosis.next_step("HEAD", on.store))
        .or_else(|| unknown_noise(after));
    let compensate = || NextStep::correct("HEAD", on.store);
    Ok(Some(text + &next.unwrap_or_else(compensate).text(width)))
}

/// What must be known of the choice of a step, a short sentence each.
fn warnings(standing: &Standing) -> impl Iterator<Item = String> {
    let gone = |Withdrawn {
                    step,
                    rms_mm,
                    than,
                    than_rms_mm,
                    points,
                }: &Withdrawn| {
        let [here, other] = [rms_mm, than_rms_mm].map(|mm| length(*mm));
        format!(
            "{step} withdrawn, {than} used: {here} rms against {other} at {points} points unseen by either fit"
        )
    };
    let against = |Contradicted(Withdrawn {
                       step,
                       rms_mm,
                       than,
                       than_rms_mm,
                       points,
                   }): &Contradicted| {
        let [here, other] = [rms_mm, than_rms_mm].map(|mm| length(*mm));
        format!("the {points} held-out points prefer {than}: {other} rms against {here} of {step}")
    };
    standing
        .withdrawn
        .iter()
        .map(gone)
        .chain(standing.contradicted.iter().map(against))
        .collect::<Vec<_>>()
        .into_iter()
}

fn error(label: &str, row: &StatisticsRow, least: f64) -> String {
    let rows = match row.held_out {
        true => counted(row.points as usize, "held-out point"),
        false => format!(
            "{}, to which it was fitted: flattered",
            counted(row.points as usize, "point")
        ),
    };
    let text = screen::errors(
        label,
        [row.mean_mm, row.max_mm],
        least,
        &format!("step {}, {rows}", row.step),
    );
    let without = row
        .mean_without_mm
        .zip(row.max_without_mm)
        .map(|(mean, max)| {
            screen::errors(
                "",
                [mean, max],
                least,
                &format!(
                    "without {}",
                    counted(row.suspects as usize, "suspected outlier")
                ),
            )
        });
    text + &without.unwrap_or_default()
}

/// What is left where no stage asked why.
fn verdict(row: &StatisticsRow) -> String {
    let left = length(row.rms_mm);
    match row.is_inferred() {
        true => format!("identified: {left} rms remain, the noise is not known"),
        false => format!(
            "identified: {left} rms remain, the noise is {}",
            length(row.noise_rms_mm)
        ),
    }
}

fn unknown_noise(row: &StatisticsRow) -> Option<NextStep> {
    row.is_inferred().then(|| NextStep {
        what: "state `instrument` in `ingest`: the noise is not known".into(),
        command: None,
    })
}

/// Errors of every step and set.
pub fn statistics_rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<StatisticsRow>> {
    let tables = tables::<Statistics>(&outcome.manifest, store)?;
    Ok(tables.into_iter().flat_map(|table| table.0).collect())
}

/// Rivals of learned corrections.
pub fn corrections_rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<CorrectionsRow>> {
    let tables = tables::<Corrections>(&outcome.manifest, store)?;
    Ok(tables.into_iter().flat_map(|table| table.0).collect())
}

/// Optimisers on functions whose minima are known.
pub fn searches_rows(outcome: &CompletedRun, store: &Store) -> Result<Vec<SearchesRow>> {
    let tables = tables::<Searches>(&outcome.manifest, store)?;
    Ok(tables.into_iter().flat_map(|table| table.0).collect())
}

/// Three tables: points that no model has seen, those that the models were fitted to, and these again
/// cross-validated. `expected` is the rms of a complete
/// model under the instrument's noise.
pub fn statistics(
    outcome: &CompletedRun,
    standing: Option<&Standing>,
    store: &Store,
) -> Result<String> {
    let mut rows = statistics_rows(outcome, store)?;
    let withdrawn: Vec<&str> = standing
        .iter()
        .flat_map(|stands| &stands.withdrawn)
        .map(|gone| gone.step.as_str())
        .collect();
    for row in rows
        .iter_mut()
        .filter(|row| withdrawn.contains(&row.step.as_str()))
    {
        row.step.push_str(" (withdrawn)");
    }
    let mut text = String::new();
    for (held_out, title) in [
        (
            false,
            "training points (the models were fitted to these: flattered)",
        ),
        (true, "held-out points (no model has seen these)"),
    ] {
        let rows: Vec<&StatisticsRow> =
            rows.iter().filter(|row| row.held_out == held_out).collect();
        if !rows.is_empty() {
            text.push_str(&errors(title, &rows));
        }
    }
    if rows.iter().any(StatisticsRow::is_inferred) {
        text.push_str("expected rests on an assumed noise: none is recorded, and no `instrument` is stated in `ingest`\n\n");
    }
    text.push_str(&folds(&rows));
    text.push_str(&references(&rows));
    Ok(text)
}

fn errors(title: &str, rows: &[&StatisticsRow]) -> String {
    let columns = "<step=step <set=set >6points=points >8mean=mean_mm >8std=std_mm >8p95=p95_mm >8max=max_mm >8rms=rms_mm >8expected=expected_rms_mm";
    format!("{title}, error in mm\n{}\n", listed(rows, columns, ""))
}

/// Training points under fits without them; nothing where no step made folds.
fn folds(rows: &[StatisticsRow]) -> String {
    let rows = rows.iter().filter(|row| row.fold_rms_mm.is_some());
    let rows: Vec<&StatisticsRow> = rows.collect();
    let contacts = rows.iter().filter(|row| row.is_contact()).count();
    let blocks = match contacts {
        _ if rows.is_empty() => return String::new(),
        0 => "contiguous folds",
        some if some == rows.len() => "whole places",
        _ => "contiguous folds, whole places",
    };
    let columns = "<step=step <set=set >8mean=fold_mean_mm >8max=fold_max_mm >8rms=fold_rms_mm >8expected=fold_expected_mm >8|mean=block_mean_mm >8max=block_max_mm >8rms=block_rms_mm";
    format!(
        "training points, each under a fit without it (cross-validated), error in mm: random folds | {blocks}\n{}\n",
        listed(&rows, columns, "")
    )
}

/// Our figures next to those that the pipeline names; nothing where it names none.
fn references(rows: &[StatisticsRow]) -> String {
    let pair = |ours: f64, theirs| format!("{ours:>7.4} | {:>7}", figure(theirs, ""));
    let cells = rows.iter().filter_map(|row| {
        Some(vec![
            row.reference.clone()?,
            row.step.clone(),
            row.set.clone(),
            pair(row.mean_mm, row.reference_mean_mm),
            pair(row.std_mm, row.reference_std_mm),
            pair(row.max_mm, row.reference_max_mm),
        ])
    });
    let cells: Vec<Vec<String>> = cells.collect();
    if cells.is_empty() {
        return String::new();
    }
    let heads = ["<reference", "<step", "<set", ">17mean", ">17std", ">17max"];
    format!(
        "reference figures, error in mm: ours | theirs\n{}\n",
        aligned(&heads, cells)
    )
}

/// One line per rival of each learned correction, the kept one marked; nothing where nothing was learnt.
pub fn corrections(outcome: &CompletedRun, store: &Store) -> Result<String> {
    let rows = corrections_rows(outcome, store)?;
    if rows.is_empty() {
        return Ok(String::new());
    }
    let shown = rows.iter().map(|row| {
        let mut shown = json!(row);
        let mark = if row.chosen { ">" } else { " " };
        shown["step"] = format!("{mark} {}", row.step).into();
        if let Some((hidden, decay)) = row.hidden.zip(row.decay) {
            let reason = format!("{} ({hidden} neurons, decay {decay})", row.reason);
            shown["reason"] = reason.into();
        }
        shown
    });
    let shown: Vec<Value> = shown.collect();
    let columns = "<\u{a0}\u{a0}step=step <16rival=rival >8mean=mean_mm >8rms=rms_mm >8max=max_mm >7numbers=numbers >11evaluations=evaluations <why=reason";
    Ok(format!(
        "learned corrections, cross-validated on their own training rows (> kept), error in mm\n{}\n",
        listed(&shown, columns, "-").replacen('\u{a0}', " ", 2)
    ))
}

/// One line per function and optimiser; nothing where nothing was searched.
pub fn searches(outcome: &CompletedRun, store: &Store) -> Result<String> {
    let rows = searches_rows(outcome, store)?;
    if rows.is_empty() {
        return Ok(String::new());
    }
    let mut heads = vec![
        "<16function",
        "<6method",
        ">5seeds",
        ">6found",
        ">6stuck",
        ">8median",
        ">8p90",
        ">10error p50",
        ">10error p90",
    ];
    if rows.iter().any(|row| row.reference_s.is_some()) {
        heads.push("<published time");
    }
    let cells = rows.iter().map(|row| {
        let share =
            |count: i64| format!("{:.1}%", 100.0 * count as f64 / row.searches.max(1) as f64);
        let count =
            |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.0}"));
        let error =
            |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.2e}"));
        let published = row.reference.as_ref().zip(row.reference_s);
        let published = published.map(|(label, seconds)| format!("{label}: {seconds:.3} s"));
        vec![
            format!("{} {}-D", row.function, row.dimensions),
            row.method.clone(),
            row.searches.to_string(),
            share(row.found),
            share(row.stuck),
            count(row.evaluations_median),
            count(row.evaluations_p90),
            error(row.error_median),
            error(row.error_p90),
            published.unwrap_or_default(),
        ]
    });
    Ok(format!(
        "searches for known minima: found and stuck of all seeds, evaluations to the target of those that found it\n{}\n",
        aligned(&heads, cells.collect())
    ))
}

fn figure(mm: Option<f64>, none: &str) -> String {
    mm.map_or_else(|| none.into(), |mm| format!("{mm:.4}"))
}

/// Rows below their heads: each column is a head as in [`aligned`] and the name of what it shows, lengths with four decimals.
fn listed(rows: &[impl Serialize], columns: &str, none: &str) -> String {
    let columns = columns
        .split(' ')
        .filter_map(|column| column.split_once('='));
    let (heads, names): (Vec<&str>, Vec<&str>) = columns.unzip();
    let cell = |value: &Value| match value {
        Value::Null => none.into(),
        Value::String(text) => text.clone(),
        number if number.is_f64() => figure(number.as_f64(), none),
        other => other.to_string(),
    };
    let cells = rows.iter().map(|row| {
        let row = json!(row);
        names.iter().map(|name| cell(&row[*name])).collect()
    });
    aligned(&heads, cells.collect())
}

/// Rows below their heads. A head says how a column is aligned (`<`, `>`), how wide it is at least, and with `|` that a line stands before it.
fn aligned(heads: &[&str], rows: Vec<Vec<String>>) -> String {
    let digits = |c: char| c.is_ascii_digit();
    let names = heads
        .iter()
        .map(|head| head[1..].trim_start_matches(digits));
    let titles = names.map(|name| name.trim_start_matches('|').to_string());
    let all: Vec<Vec<String>> = std::iter::once(titles.collect()).chain(rows).collect();
    let width = |k: usize| {
        let least = heads[k][1..].split(|c| !digits(c)).next();
        let least = least.and_then(|least| least.parse().ok()).unwrap_or(0);
        let cells = all.iter().map(|row| row[k].chars().count());
        cells.max().unwrap_or(0).max(least)
    };
    let widths: Vec<usize> = (0..heads.len()).map(width).collect();
    let line = |row: &Vec<String>| {
        let mut line = String::new();
        for (k, (head, cell)) in heads.iter().zip(row).enumerate() {
            let before = if head.contains('|') { " | " } else { "  " };
            match (head.starts_with('<'), k + 1 == heads.len()) {
                (true, true) if cell.is_empty() => {}
                (true, true) => line += &format!("{before}{cell}"),
                (true, false) => line += &format!("{before}{cell:0$}", widths[k]),
                (false, _) => line += &format!("{before}{cell:>0$}", widths[k]),
            }
        }
        line + "\n"
    };
    all.iter().map(line).collect()
}

/// How many rows of the raw files were rejected.
pub fn rejected_rows(manifest: &Manifest) -> u64 {
    manifest
        .tables(crate::table::Rejected::KIND)
        .map(|output| output.table.rows)
        .sum()
}

/// Nothing where nothing was rejected.
pub fn rejected(manifest: &Manifest) -> String {
    let line = |output: &crate::pipeline::OutputRecord| {
        let path = output.path.as_deref().unwrap_or_default();
        labelled(
            "rejected",
            &format!(
                "{}, each with its reason in {path}",
                counted(output.table.rows, "row")
            ),
        )
    };
    manifest
        .tables(crate::table::Rejected::KIND)
        .filter(|output| output.table.rows > 0)
        .map(line)
        .collect()
}

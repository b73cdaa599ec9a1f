//! The verdict, the table of errors after every step, and their pictures; held-out and training points never together.

use crate::Tables;
use crate::error::{Error, Result};
use crate::findings::wrong_setup;
use crate::language::{Locale, say};
use crate::number::count;
use crate::svg::{Area, Scale, Svg, baseline, name_x};
use crate::table::{Labelled, Prediction, PredictionRow, Statistics, StatisticsRow, UNFOLDED};
use crate::workspace::{Colours, StepErrors, VIEWS, cumulative, histogram, scatter};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The steps in pipeline order, each with the colour it has in all pictures.
pub(super) struct Steps {
    names: BTreeMap<i64, String>,
    standing: Option<i64>,
}

impl Steps {
    /// `standing` is the step that the report speaks of; without one, the last.
    pub fn new(statistics: &Statistics, standing: Option<&str>) -> Self {
        let names: BTreeMap<i64, String> = statistics
            .0
            .iter()
            .map(|row| (row.order, row.step.clone()))
            .collect();
        let named = names
            .iter()
            .rev()
            .find(|(_, name)| Some(name.as_str()) == standing)
            .or(names.last_key_value());
        Self {
            standing: named.map(|(order, _)| *order),
            names,
        }
    }
    pub fn standing(&self) -> Option<i64> {
        self.standing
    }
    fn colour(&self, order: i64) -> String {
        // Colours of the steps but the first and the one that stands repeat after five.
        if Some(order) == self.standing {
            "s-last".into()
        } else {
            format!("s{}", if order == 0 { 0 } else { 1 + (order - 1) % 5 })
        }
    }
    /// Colour of a step by name; a step without predictions has the first one's.
    pub fn colour_of(&self, step: &str) -> String {
        let order = self
            .names
            .iter()
            .rev()
            .find(|(_, name)| *name == step)
            .map_or(0, |(order, _)| *order);
        self.colour(order)
    }
}

/// What is left out together, beside parts drawn at random.
fn blocks(locale: &Locale, rows: &[StatisticsRow]) -> String {
    let folded = || rows.iter().filter(|row| row.fold_rms_mm.is_some());
    match (
        folded().any(StatisticsRow::is_contact),
        folded().all(StatisticsRow::is_contact),
    ) {
        (true, true) => say!(locale, "whole places"),
        (true, false) => say!(locale, "contiguous parts of the recording; whole places"),
        (false, _) => say!(locale, "contiguous parts of the recording"),
    }
}

pub(super) fn errors_section(
    locale: &Locale,
    tables: &Tables,
    steps: &Steps,
    wished: Option<&str>,
) -> Result<Value> {
    let rows = &tables.statistics.0;
    let mut last: Vec<&StatisticsRow> = rows
        .iter()
        .filter(|r| Some(r.order) == steps.standing() && r.held_out)
        .collect();
    if let Some(wished) = wished
        && !last.iter().any(|row| row.set == wished)
    {
        let allowed: Vec<&str> = last.iter().map(|row| row.set.as_str()).collect();
        return Err(Error::spec(
            "with.set",
            format!(
                "`{wished}` is not a held-out set of the step that the run uses; allowed: {}",
                allowed.join(", ")
            ),
        ));
    }
    last.sort_by_key(|row| (wished != Some(&row.set), -row.points, row.set.clone()));
    let kept: Vec<&str> = last.iter().map(|row| row.set.as_str()).collect();
    let later = sets(rows, true)
        .into_iter()
        .filter(|set| !kept.contains(set));
    let block = |set: &str, held_out: bool, note: Option<String>| {
        json!({
            "set": set,
            "note": note,
            "rows": rows.iter().filter(|r| r.set == set && r.held_out == held_out).map(|r| row(r, steps)).collect::<Vec<_>>(),
        })
    };
    let held_out = kept.iter().map(|set| block(set, true, None));
    let used = later.map(|set| {
        block(
            set,
            true,
            Some(say!(locale, "held out until a later step was fitted to it")),
        )
    });
    Ok(json!({
        "wrong": wrong_setup(tables).is_some(),
        // The sets still held out after the step that stands, before and after; the first is what the page speaks of.
        "judged": last.iter().map(|after| json!({ "before": before(rows, after), "after": after })).collect::<Vec<_>>(),
        "withdrawn": tables.withdrawn.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "left_out": last.first().and_then(|after| after.without_points()),
        "doubts": last.first().and_then(|after| after.doubts()),
        // Sets still held out after the step that stands, the verdict's first; then those that a later step was fitted to.
        "held_out": held_out.chain(used).collect::<Vec<_>>(),
        "training": sets(rows, false).into_iter().map(|set| block(set, false, None)).collect::<Vec<_>>(),
        "folds": rows.iter().filter(|row| row.fold_rms_mm.is_some()).map(|r| row(r, steps)).collect::<Vec<_>>(),
        // What the second kind of folds is.
        "blocks": blocks(locale, rows),
        // Steps whose cross-validation was dropped, and the number of poses.
        "unfolded": unfolded(tables),
        "references": rows.iter().filter(|row| row.reference.is_some()).collect::<Vec<_>>(),
        "pictures": last.iter().map(|row| picture(locale, tables, row, steps)).collect::<Vec<_>>(),
        "legend": steps.names.iter().map(|(order, step)| (steps.colour(*order), step)).collect::<Vec<_>>(),
    }))
}

fn unfolded(tables: &Tables) -> Vec<(String, String)> {
    let rows = tables
        .observability
        .iter()
        .flat_map(|table| &table.0)
        .filter(|row| row.quantity == UNFOLDED);
    rows.map(|row| (row.step.clone(), count(row.value as i64)))
        .collect()
}

/// Names of sets of this kind, in the order of their first row.
fn sets(rows: &[StatisticsRow], held_out: bool) -> Vec<&str> {
    let mut names = Vec::new();
    for row in rows.iter().filter(|row| row.held_out == held_out) {
        if !names.contains(&row.set.as_str()) {
            names.push(row.set.as_str());
        }
    }
    names
}

/// A row with the colour of its step, and whether it is the step that stands.
fn row(row: &StatisticsRow, steps: &Steps) -> Value {
    let mut shown = json!(row);
    shown["colour"] = steps.colour(row.order).into();
    shown["last"] = (Some(row.order) == steps.standing()).into();
    shown
}

/// The first step with held-out rows of the same set as `after`.
pub(super) fn before<'a>(
    rows: &'a [StatisticsRow],
    after: &StatisticsRow,
) -> Option<&'a StatisticsRow> {
    rows.iter()
        .filter(|r| r.held_out && r.set == after.set && r.order < after.order)
        .min_by_key(|r| r.order)
}

fn picture(locale: &Locale, tables: &Tables, set: &StatisticsRow, steps: &Steps) -> Value {
    let rows = tables
        .statistics
        .0
        .iter()
        .filter(|row| row.held_out && row.set == set.set);
    let errors: Vec<StepErrors> = rows
        .map(|row| {
            let table = tables.prediction.iter().flat_map(|table| &table.0);
            let of_row = table.filter(|p| p.step == row.step && p.set == row.set && p.held_out);
            let mut sorted_mm: Vec<f64> = of_row.map(|p| p.error_mm).collect();
            sorted_mm.sort_by(f64::total_cmp);
            StepErrors {
                step: row.step.clone(),
                colour: steps.colour(row.order),
                sorted_mm,
                mean_mm: row.mean_mm,
            }
        })
        .filter(|errors| !errors.sorted_mm.is_empty())
        .collect();
    json!({
        "set": set.set,
        "points": count(set.points),
        "histogram": histogram(locale, &errors, &say!(locale, "Histogram of the position error after each step, set {set}", set = set.set)),
        "cumulative": cumulative(locale, &errors, &say!(locale, "Cumulative position error after each step, set {set}", set = set.set)),
    })
}

/// Nothing where nothing was predicted.
pub(super) fn workspace_section(
    locale: &Locale,
    prediction: &[Labelled<Prediction>],
    standing: Option<&str>,
) -> Option<Value> {
    let mut filled = prediction.iter().filter(|table| !table.0.is_empty());
    let first = filled.next()?;
    let is = |table: &&Labelled<Prediction>| {
        table
            .0
            .first()
            .is_some_and(|row| Some(row.step.as_str()) == standing)
    };
    let last = filled.clone().rfind(is).or_else(|| filled.next_back());
    let colours = Colours::new(first, last.unwrap_or(first));
    let mut panels = Vec::new();
    for view in VIEWS {
        for table in std::iter::once(first).chain(last) {
            let step = table.0.first().map_or("", |row| &row.step);
            let name = say!(locale, "{view} after “{step}”", view = view.name, step);
            let (svg, remark) = scatter(
                locale,
                view,
                table,
                [first, last.unwrap_or(first)],
                &colours,
                &name,
            );
            panels.push(json!({ "name": name, "remark": remark, "svg": svg }));
        }
    }
    Some(json!({ "legend": colours.legend(locale), "panels": panels }))
}

/// What one fixture has: mean and largest distance, mm.
#[derive(Serialize)]
struct FixtureFigures {
    name: String,
    count: usize,
    before: [f64; 2],
    after: [f64; 2],
}

const CLOSURE_WIDTH: f64 = 640.0;
const LEFT: f64 = 150.0;
/// Height of a fixture's two bars.
const ROW: f64 = 20.0;
/// Fixtures in the picture: a page of paper has room for so many; the table has all.
const LIMIT: usize = 40;

/// Nothing where no row is a contact, or nothing was predicted.
pub(super) fn closure_section(locale: &Locale, tables: &Tables) -> Option<Value> {
    let all = closings(tables)?;
    let name = |table: Option<&Labelled<Prediction>>| {
        table
            .and_then(|table| table.0.first())
            .map(|row| row.step.clone())
    };
    Some(json!({
        "before": name(tables.prediction.first())?,
        "after": name(standing_prediction(tables))?,
        "picture": closure_picture(locale, &all[..all.len().min(LIMIT)]),
        "rows": &all,
        // Fixtures beyond those of the picture.
        "more": all.len().saturating_sub(LIMIT),
    }))
}

pub(super) fn standing_prediction(tables: &Tables) -> Option<&Labelled<Prediction>> {
    let named = |table: &&Labelled<Prediction>| {
        table.0.first().map(|row| row.step.as_str()) == tables.standing.as_deref()
    };
    tables
        .prediction
        .iter()
        .rev()
        .find(named)
        .or(tables.prediction.last())
}

/// By the order of names, which is that of the recording's table.
fn closings(tables: &Tables) -> Option<Vec<FixtureFigures>> {
    let (first, last) = (tables.prediction.first()?, standing_prediction(tables)?);
    let mut rows: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for row in 0..tables.recording.rows() {
        if let Some(name) = tables.recording.contact(row) {
            rows.entry(name).or_default().push(row);
        }
    }
    let figures = |table: &Prediction, rows: &[usize]| -> [f64; 2] {
        let errors: Vec<f64> = rows
            .iter()
            .filter_map(|row| table.0.get(*row))
            .map(|row: &PredictionRow| row.error_mm)
            .collect();
        [
            errors.iter().sum::<f64>() / errors.len().max(1) as f64,
            errors.iter().copied().fold(0.0, f64::max),
        ]
    };
    let all: Vec<FixtureFigures> = rows
        .into_iter()
        .map(|(name, rows)| FixtureFigures {
            name: name.into(),
            count: rows.len(),
            before: figures(first, &rows),
            after: figures(last, &rows),
        })
        .collect();
    (!all.is_empty()).then_some(all)
}

fn closure_picture(locale: &Locale, all: &[FixtureFigures]) -> String {
    let area = Area::new([
        LEFT,
        8.0,
        CLOSURE_WIDTH - 12.0,
        8.0 + ROW * all.len() as f64,
    ]);
    let means = || {
        all.iter()
            .flat_map(|figures| [figures.before[0], figures.after[0]])
            .filter(|mean| *mean > 0.0)
    };
    let (lower, upper) = (
        means().fold(f64::INFINITY, f64::min),
        means().fold(0.0, f64::max),
    );
    let scale = Scale::positive(0.5 * lower.min(upper), upper).over(area.left, area.right);
    let mut svg = Svg::new(locale, CLOSURE_WIDTH, area.bottom + 38.0);
    scale.grid_x(&mut svg, area, 7);
    for (k, figures) in all.iter().enumerate() {
        let top = area.top + ROW * k as f64;
        svg.name(
            "tick end",
            [area.left - 6.0, top + 0.7 * ROW],
            &figures.name,
        );
        for (bar, (mean, colour)) in [(figures.before[0], "s0"), (figures.after[0], "s-last")]
            .into_iter()
            .enumerate()
        {
            let width = (scale.at(mean.max(0.5 * lower.min(upper))) - area.left).max(0.8);
            svg.rect(
                &format!("fill {colour}"),
                [area.left, top + 2.0 + 8.0 * bar as f64],
                [width, 7.0],
            );
        }
    }
    baseline(&mut svg, area);
    name_x(
        &mut svg,
        area,
        &say!(locale, "mean distance of the ball from where it lay, mm"),
    );
    svg.finish(&say!(locale, "Closure by fixture, before and after"))
}

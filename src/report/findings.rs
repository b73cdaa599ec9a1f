//! What was left out of the simulation: the diagnosis' verdict, its findings with their curves, what it could not see.

use crate::error::Result;
use crate::language::{Locale, PageLanguage, say};
use crate::number::render;
use crate::svg::{Area, Scale, Svg, baseline, label, name_x, name_y};
use crate::table::{CauseGrid, CurveRow, FindingRow, VerdictTopic};
use crate::units::Unit;
use crate::{Page, Tables};
use serde_json::{Value, json};

/// Points drawn in one picture: more would hide each other.
const DRAWN: usize = 350;

/// The columns that speak for a finding.
const EVIDENCE: [&str; 8] = [
    "probability",
    "place_probability",
    "none_probability",
    "f_statistic",
    "p_value",
    "delta_bic",
    "heldout_gain_mm",
    "effect_rms_mm",
];

/// None where the pipeline made no diagnosis.
pub(super) fn section(locale: &Locale, tables: &Tables) -> Option<Value> {
    let verdict = tables
        .verdict
        .iter()
        .flat_map(|table| &table.0)
        .next_back()?;
    let suspects = tables.suspects.iter().flat_map(|table| &table.0);
    let findings = findings(locale, tables);
    let shown = |column: &&str| findings.iter().any(|finding| !finding[*column].is_null());
    let arcsec = |rad: Option<f64>| rad.map(|rad| Unit::Arcsecond.from_si(rad));
    let mut gone = tables
        .withdrawn
        .iter()
        .filter(|gone| gone.step == verdict.step);
    Some(json!({
        "verdict": verdict,
        "withdrawn": gone.next().map(ToString::to_string),
        "assumed": verdict.is_noise_assumed(),
        "inferred": verdict.is_noise_inferred() && !verdict.is_noise_assumed(),
        "noise_arcsec": arcsec(verdict.noise_floor_rad),
        "leftover_arcsec": arcsec(verdict.leftover_rms_rad),
        "repeatability_arcsec": arcsec(Some(verdict.repeatability_rad)),
        "causes": tables.cells.last().zip(tables.findings.last()).map(|(cells, findings)| CauseGrid::of(cells, findings)),
        // Of which evidence the meaning is stated.
        "meanings": EVIDENCE.iter().filter(|column| shown(column)).collect::<Vec<_>>(),
        "findings": findings,
        "next": tables.statements(&verdict.step, VerdictTopic::NextMeasurement),
        "suspects": suspects.filter(|row| row.step == verdict.step).collect::<Vec<_>>(),
    }))
}

/// What is wrong with the set-up; none where it is right.
pub(super) fn wrong_setup(tables: &Tables) -> Option<String> {
    let findings = tables.findings.last()?;
    tables.verdict.last()?.wrong_setup(findings)
}

/// Findings with numbers, rivals that the data do not exclude, formulas, range and curves.
fn findings(locale: &Locale, tables: &Tables) -> Vec<Value> {
    let rows = || tables.findings.iter().flat_map(|table| &table.0);
    let mut findings = tables.findings_with_rivals();
    for (shown, row) in findings.iter_mut().zip(rows()) {
        let points = tables.curves.0.iter();
        let curve: Vec<_> = points.filter(|point| point.rank == row.rank).collect();
        let is_missing = |column: &&&str| shown[**column].is_null();
        shown["without"] = EVIDENCE.iter().filter(is_missing).copied().collect();
        shown["valid"] = json!(row.valid_range());
        shown["pictures"] = json!(pictures(locale, row, &curve));
    }
    findings
}

/// Before with the fitted curve and its band, and after on the same scales.
fn pictures(locale: &Locale, finding: &FindingRow, curve: &[&CurveRow]) -> Vec<(String, String)> {
    let Some(first) = curve.first() else {
        return Vec::new();
    };
    // People read degrees and arcsec.
    let (x_unit, x_scale) = if first.x_unit == "rad" {
        ("deg", 1f64.to_degrees())
    } else {
        (first.x_unit.as_str(), 1.0)
    };
    let is_angle = first.unit == "rad";
    let y_scale = if is_angle {
        Unit::Arcsecond.from_si(1.0)
    } else {
        1.0
    };
    let over = locale.stored(&first.over);
    let x_unit = locale.stored(x_unit);
    let (x_name, y_name) = (
        say!(locale, "{over}, {x_unit}", over, x_unit),
        match is_angle {
            true => say!(locale, "residual, arcsec"),
            false => say!(locale, "residual, mm"),
        },
    );
    let every = curve.len().div_ceil(DRAWN).max(1);
    let mut rows: Vec<&CurveRow> = curve.iter().step_by(every).copied().collect();
    rows.sort_by(|a, b| a.x.total_cmp(&b.x));
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::MAX, f64::MIN), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    };
    let (x0, x1) = range(&mut rows.iter().map(|row| row.x * x_scale));
    let (y0, y1) = range(
        &mut rows
            .iter()
            .flat_map(|row| [row.without, row.with, row.fitted])
            .map(|value| value * y_scale),
    );
    let margin = 0.06 * (y1 - y0).max(1e-9);
    let area = Area::new([52.0, 26.0, 406.0, 230.0]);
    let x = Scale::linear(x0, x1).over(area.left, area.right);
    let y = Scale::linear(y0 - margin, y1 + margin).over(area.bottom, area.top);
    let draw = |before: bool| {
        let mut svg = Svg::new(locale, 420.0, area.bottom + 38.0);
        x.grid_x(&mut svg, area, 6);
        y.grid_y(&mut svg, area, 6);
        let at = |row: &CurveRow, value: f64| [x.at(row.x * x_scale), y.at(value * y_scale)];
        if before {
            let band = |row: &&CurveRow| {
                let two = 2.0 * row.band?;
                Some([-two, two].map(|off| at(row, row.fitted + off)))
            };
            svg.lines("whisker", &rows.iter().filter_map(band).collect::<Vec<_>>());
        }
        for (held_out, class) in [(false, "dots s0 fitted"), (true, "dots s0")] {
            let of_kind = rows.iter().filter(|row| row.held_out == held_out);
            let value = |row: &CurveRow| if before { row.without } else { row.with };
            let dots: Vec<_> = of_kind.map(|row| at(row, value(row))).collect();
            svg.dots(class, 3.8, &dots);
        }
        if before {
            let dots: Vec<_> = rows.iter().map(|row| at(row, row.fitted)).collect();
            svg.dots("dots s-last", 2.6, &dots);
        }
        svg.line("zero", [area.left, y.at(0.0)], [area.right, y.at(0.0)]);
        baseline(&mut svg, area);
        name_x(&mut svg, area, &x_name);
        name_y(&mut svg, area, &y_name);
        let (effect, place) = (&finding.effect, locale.stored(&finding.place));
        let [from, to] = [x0, x1].map(|end| locale.decimal(label(end)));
        svg.finish(&match before {
            true => say!(
                locale,
                "Without the finding: {effect} at {place}, from {from} to {to} {x_unit}",
                effect,
                place,
                from,
                to,
                x_unit
            ),
            false => say!(
                locale,
                "With the finding: {effect} at {place}, from {from} to {to} {x_unit}",
                effect,
                place,
                from,
                to,
                x_unit
            ),
        })
    };
    let direction = match is_angle {
        true => say!(locale, "about the joint"),
        false => say!(locale, "along the effect's displacement"),
    };
    vec![
        (
            draw(true),
            say!(
                locale,
                "Without the finding: residual {direction} (grey; pale: fitted rows), the fitted effect (blue) and two standard deviations of it.",
                direction
            ),
        ),
        (
            draw(false),
            say!(
                locale,
                "With the finding, on the same scale: the remaining residual."
            ),
        ),
    ]
}

/// A diagnosis as one file that needs no other.
pub fn diagnosed_page(page: Value, language: PageLanguage) -> Result<Page> {
    let locale = Locale::new(language);
    let template = include_str!("diagnosed.html");
    let html = render(&locale, "diagnosed.html", template, page)?;
    Ok(Page {
        html,
        missing: locale.missing(),
    })
}

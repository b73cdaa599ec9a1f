//! What was left out of the simulation: the diagnosis' verdict, its findings with their curves, what it could not see.

use super::Tables;
use super::number::{count, mm, sentence_case, significant};
use super::svg::{Area, Scale, Svg, baseline, label, name_x, name_y};
use crate::table::{
    CurveRow, FindingRow, FormRow, RivalRow, VerdictRow, VerdictTopic, formula_in_words,
};
use crate::units::Unit;
use serde::Serialize;
use serde_json::{Value, json};

/// Points drawn in one picture: more would hide each other.
const DRAWN: usize = 700;

/// The figures that speak for a finding, with what each means.
const EVIDENCE: [(&str, &str); 8] = [
    (
        "probability of the name",
        "that it is this effect at this place; the rest, up to 1, is listed below the finding",
    ),
    ("of the place", "that it acts at this place, whatever it is"),
    (
        "of none",
        "that it is neither this effect nor any of its rivals",
    ),
    (
        "F",
        "gain per parameter over the residual variance; about 1 for noise",
    ),
    (
        "p",
        "chance that noise gives as much to this form alone; the search among many is in the probabilities",
    ),
    (
        "2 ln evidence",
        "twice the ln of the evidence for the finding beside all others; above 10 is strong",
    ),
    (
        "cross-validated gain",
        "cross-validated rms without the finding minus that with it",
    ),
    ("size", "rms of the whole effect at the tool"),
];

#[derive(Serialize)]
struct FindingView {
    rank: String,
    effect: String,
    place: String,
    statement: String,
    /// Name, value, sigma, unit.
    numbers: Vec<[String; 4]>,
    /// What, figure.
    evidence: Vec<(&'static str, String)>,
    rivals: Vec<String>,
    /// Formulas that do what it does, with what they cost and bring.
    formulas: Vec<String>,
    valid: Option<String>,
    pictures: Vec<(String, String)>,
}

/// None where the pipeline made no diagnosis.
pub(super) fn section(tables: &Tables) -> Option<Value> {
    let verdict = tables
        .verdict
        .iter()
        .flat_map(|table| &table.0)
        .next_back()?;
    let figure = |value: Option<f64>| value.map_or_else(|| "\u{2013}".into(), mm);
    let errors =
        |name: &str, mean, rms, max| [name.to_string(), figure(mean), figure(rms), figure(max)];
    let suspects = tables
        .suspects
        .iter()
        .flat_map(|table| &table.0)
        .filter(|row| row.step == verdict.step);
    let wrong = wrong_setup(tables).is_some();
    let (before, after) = match wrong {
        true => ("before: as set up", "after: set-up corrected"),
        false => (
            "before: geometry, zeros and ratios identified",
            "after: with the findings",
        ),
    };
    let findings: Vec<FindingView> = tables
        .findings
        .iter()
        .flat_map(|table| &table.0)
        .map(|row| finding(row, tables))
        .collect();
    let shown = |name: &str| {
        findings
            .iter()
            .flat_map(|finding| &finding.evidence)
            .any(|(shown, _)| *shown == name)
    };
    let meanings: Vec<_> = EVIDENCE
        .into_iter()
        .filter(|(name, _)| shown(name))
        .collect();
    Some(json!({
        "kind": match verdict.verdict.as_str() {
            "explained" | "nothing_missing" => "better",
            _ => "unknown",
        },
        "sentence": sentence(verdict, tables),
        "heading": if wrong { "The set-up is wrong" } else { "What the simulation lacked" },
        // What the errors are of.
        "caption": if wrong { "Error of the nominal robot, base and tool fitted, mm" } else { "Error of held-out points, mm" },
        // Name, mean, rms, max.
        "errors": vec![
            errors(before, verdict.before_mean_mm, verdict.before_rms_mm, verdict.before_max_mm),
            errors(after, verdict.after_mean_mm, verdict.after_rms_mm, verdict.after_max_mm),
        ],
        "causes": tables.cells.last().zip(tables.findings.last()).and_then(|(cells, findings)| super::causes::picture(cells, findings)),
        "facts": facts(verdict),
        "findings": findings,
        // What each figure of the evidence means.
        "meanings": meanings,
        "next": tables.statements(&verdict.step, VerdictTopic::NextMeasurement),
        "signature": verdict.signature,
        "suspects": suspects
            .map(|row| [row.point_id.clone(), row.set.clone(), row.kind.clone(), mm(row.size_mm), row.remark.clone()])
            .collect::<Vec<_>>(),
    }))
}

/// What is wrong with the set-up; none where it is right.
pub(super) fn wrong_setup(tables: &Tables) -> Option<String> {
    let findings = tables.findings.last()?;
    tables.verdict.last()?.wrong_setup(findings)
}

fn facts(verdict: &VerdictRow) -> Vec<(&'static str, String)> {
    let repeatability = Unit::Arcsecond.from_si(verdict.repeatability_rad);
    let basis = match verdict.noise_basis.as_deref() {
        _ if verdict.is_noise_assumed() => {
            " (assumed: none is recorded, no instrument is stated)".into()
        }
        _ if verdict.is_noise_inferred() => " (inferred from what is left)".into(),
        Some(basis) => format!(" (by {basis})"),
        None => String::new(),
    };
    let size = |length: Option<f64>, angle: Option<f64>| {
        let angle = || {
            angle.map(|angle| format!("{} arcsec", significant(Unit::Arcsecond.from_si(angle), 2)))
        };
        length
            .map(|length| format!("{} mm", mm(length)))
            .or_else(angle)
    };
    let noise = size(verdict.noise_floor_mm, verdict.noise_floor_rad)
        .map(|noise| format!("{noise}{basis}"));
    let facts = [
        ("noise of one point, rms", noise),
        (
            "left over at fitted rows, rms",
            size(verdict.leftover_rms_mm, verdict.leftover_rms_rad),
        ),
        (
            "probability that no further cause is there",
            verdict.p_after.map(|p| significant(p, 2)),
        ),
        (
            "the same before any finding",
            verdict.p_before.map(|p| significant(p, 2)),
        ),
        (
            "repeatability of the joints",
            verdict
                .p_after
                .map(|_| format!("{} arcsec", significant(repeatability, 2))),
        ),
        ("rows fitted", Some(count(verdict.points))),
    ];
    facts
        .into_iter()
        .filter_map(|(name, figure)| Some((name, figure?)))
        .collect()
}

fn sentence(verdict: &VerdictRow, tables: &Tables) -> String {
    let said = match verdict.verdict.as_str() {
        "explained" => "The findings bring the error of held-out points down to the noise.",
        "nothing_missing" => "These data show nothing that the simulation lacks.",
        "not_asked" => "Too few rows were fitted to determine what the simulation lacks.",
        _ => "The findings do not explain the whole error.",
    };
    let said = match &verdict.statement {
        Some(statement) => sentence_case(statement),
        None => said.into(),
    };
    let said = match wrong_setup(tables) {
        Some(_) => said,
        None => format!(
            "{said} The simulation is the nominal robot with geometry, zeros, ratios and declared couplings identified; everything else \
             is a finding."
        ),
    };
    match tables
        .withdrawn
        .iter()
        .find(|gone| gone.step == verdict.step)
    {
        Some(gone) => format!("This step is not the one that the run uses: {gone}. {said}"),
        None => said,
    }
}

/// A chance; what floating point no longer holds is not zero.
fn chance(p: f64) -> String {
    if p > 0.0 {
        significant(p, 2)
    } else {
        "< 1e-300".into()
    }
}

fn finding(row: &FindingRow, tables: &Tables) -> FindingView {
    let numbers = tables
        .finding_numbers
        .iter()
        .flat_map(|table| &table.0)
        .filter(|number| number.rank == row.rank);
    let rivals = tables
        .rivals
        .iter()
        .flat_map(|table| &table.0)
        .filter(|rival| rival.rank == row.rank && rival.is_inseparable());
    let share = |p: Option<f64>| p.map(|p| format!("{p:.2}"));
    let millimetres = |value: Option<f64>| value.map(|v| format!("{} mm", mm(v)));
    let figures = [
        share(row.probability),
        share(row.place_probability),
        share(row.none_probability),
        row.f_statistic.map(|v| significant(v, 3)),
        row.p_value.map(chance),
        row.delta_bic.map(|v| significant(v, 3)),
        millimetres(row.heldout_gain_mm),
        millimetres(row.effect_rms_mm),
    ];
    let valid = row
        .valid_range()
        .map(|(joint, [from, to], unit)| format!("joint {joint} from {from:.1} to {to:.1} {unit}"));
    let curve: Vec<&CurveRow> = tables
        .curves
        .0
        .iter()
        .filter(|point| point.rank == row.rank)
        .collect();
    FindingView {
        rank: row.rank.to_string(),
        effect: row.effect.clone(),
        place: row.place.clone(),
        statement: sentence_case(row.statement.trim_end_matches('.')),
        numbers: numbers
            .map(|n| {
                let sigma = n
                    .sigma
                    .map(|sigma| significant(sigma, 2))
                    .unwrap_or_default();
                [
                    n.name.clone(),
                    significant(n.value, 5),
                    sigma,
                    n.unit.clone(),
                ]
            })
            .collect(),
        evidence: EVIDENCE
            .into_iter()
            .zip(figures)
            .filter_map(|((name, _), figure)| Some((name, figure?)))
            .collect(),
        rivals: rivals.map(rival).collect(),
        formulas: tables
            .forms
            .iter()
            .flat_map(|table| table.of_finding(row.rank))
            .map(formula)
            .collect(),
        valid,
        pictures: pictures(row, &curve),
    }
}

/// A formula with its numbers, its price and its errors on folds.
fn formula(rows: &[FormRow]) -> String {
    let words = formula_in_words(rows);
    let errors = rows.first().map(|row| {
        let proposed = if row.proposed { ", proposed" } else { "" };
        let [with, curve] = [row.folds_rms_mm, row.curve_rms_mm].map(mm);
        let without = row
            .without_rms_mm
            .map(|error| format!(", {} mm without", mm(error)))
            .unwrap_or_default();
        format!(
            " ({} parts{proposed}; {with} mm cross-validated, {curve} mm with the curve{without})",
            row.price
        )
    });
    format!("{words}{}", errors.unwrap_or_default())
}

fn rival(row: &RivalRow) -> String {
    let probability = row
        .probability
        .map(|p| format!("probability {p:.2}, "))
        .unwrap_or_default();
    format!(
        "{} at {} ({probability}2 ln evidence {} less)",
        row.effect,
        row.place,
        significant(row.delta_bic, 2)
    )
}

/// Before with the fitted curve and its band, and after on the same scales.
fn pictures(finding: &FindingRow, curve: &[&CurveRow]) -> Vec<(String, String)> {
    let Some(first) = curve.first() else {
        return Vec::new();
    };
    // People read degrees and arcsec.
    let (x_unit, x_scale) = if first.x_unit == "rad" {
        ("deg", 1f64.to_degrees())
    } else {
        (first.x_unit.as_str(), 1.0)
    };
    let (y_unit, y_scale) = if first.unit == "rad" {
        ("arcsec", Unit::Arcsecond.from_si(1.0))
    } else {
        ("mm", 1.0)
    };
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
    let draw = |title: &str, before: bool| {
        let mut svg = Svg::new(420.0, area.bottom + 38.0);
        x.grid_x(&mut svg, area, 6);
        y.grid_y(&mut svg, area, 6);
        if before {
            for row in &rows {
                if let Some(band) = row.band {
                    let at = x.at(row.x * x_scale);
                    let ends = [row.fitted - 2.0 * band, row.fitted + 2.0 * band]
                        .map(|value| y.at(value * y_scale));
                    svg.line("whisker", [at, ends[0]], [at, ends[1]]);
                }
            }
        }
        for row in &rows {
            let value = if before { row.without } else { row.with };
            let class = if row.held_out {
                "dot s0"
            } else {
                "dot s0 fitted"
            };
            svg.circle(class, [x.at(row.x * x_scale), y.at(value * y_scale)], 1.9);
        }
        if before {
            for row in &rows {
                svg.circle(
                    "dot s-last",
                    [x.at(row.x * x_scale), y.at(row.fitted * y_scale)],
                    1.3,
                );
            }
        }
        svg.line("zero", [area.left, y.at(0.0)], [area.right, y.at(0.0)]);
        baseline(&mut svg, area);
        name_x(&mut svg, area, &format!("{}, {x_unit}", first.over));
        name_y(&mut svg, area, &format!("residual, {y_unit}"));
        svg.finish(&format!(
            "{title}: {} at {}, from {} to {} {x_unit}",
            finding.effect,
            finding.place,
            label(x0),
            label(x1)
        ))
    };
    let what = if first.unit == "rad" {
        "about the joint"
    } else {
        "along the effect's displacement"
    };
    vec![
        (
            draw("Without the finding", true),
            format!(
                "Without the finding: residual {what} (grey; pale: fitted rows), the fitted effect (blue) and two standard deviations of it."
            ),
        ),
        (
            draw("With the finding", false),
            "With the finding, on the same scale: the remaining residual.".into(),
        ),
    ]
}

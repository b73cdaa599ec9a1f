//! What was left out of the simulation: the diagnosis' verdict, its findings with their curves, what it could not see.

use super::Tables;
use super::language::{Locale, say};
use super::number::count;
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
fn evidence(locale: &Locale) -> [[String; 2]; 8] {
    [
        [
            say!(locale, "probability of the name"),
            say!(
                locale,
                "that it is this effect at this place; the rest, up to 1, is listed below the finding"
            ),
        ],
        [
            say!(locale, "of the place"),
            say!(locale, "that it acts at this place, whatever it is"),
        ],
        [
            say!(locale, "of none"),
            say!(
                locale,
                "that it is neither this effect nor any of its rivals"
            ),
        ],
        [
            "F".into(),
            say!(
                locale,
                "gain per parameter over the residual variance; about 1 for noise"
            ),
        ],
        [
            "p".into(),
            say!(
                locale,
                "chance that noise gives as much to this form alone; the search among many is in the probabilities"
            ),
        ],
        [
            say!(locale, "2 ln evidence"),
            say!(
                locale,
                "twice the ln of the evidence for the finding beside all others; above 10 is strong"
            ),
        ],
        [
            say!(locale, "cross-validated gain"),
            say!(
                locale,
                "cross-validated rms without the finding minus that with it"
            ),
        ],
        [
            say!(locale, "size"),
            say!(locale, "rms of the whole effect at the tool"),
        ],
    ]
}

#[derive(Serialize)]
struct FindingView {
    rank: String,
    effect: String,
    place: String,
    statement: String,
    /// Name, value, sigma, unit.
    numbers: Vec<[String; 4]>,
    /// What, figure.
    evidence: Vec<[String; 2]>,
    rivals: Vec<String>,
    /// Formulas that do what it does, with what they cost and bring.
    formulas: Vec<String>,
    valid: Option<String>,
    pictures: Vec<(String, String)>,
}

/// None where the pipeline made no diagnosis.
pub(super) fn section(locale: &Locale, tables: &Tables) -> Option<Value> {
    let verdict = tables
        .verdict
        .iter()
        .flat_map(|table| &table.0)
        .next_back()?;
    let figure =
        |value: Option<f64>| value.map_or_else(|| "\u{2013}".into(), |value| locale.mm(value));
    let errors = |name: String, mean, rms, max| [name, figure(mean), figure(rms), figure(max)];
    let suspects = tables
        .suspects
        .iter()
        .flat_map(|table| &table.0)
        .filter(|row| row.step == verdict.step);
    let wrong = wrong_setup(tables).is_some();
    let (before, after) = match wrong {
        true => (
            say!(locale, "before: as set up"),
            say!(locale, "after: set-up corrected"),
        ),
        false => (
            say!(locale, "before: geometry, zeros and ratios identified"),
            say!(locale, "after: with the findings"),
        ),
    };
    let findings: Vec<FindingView> = tables
        .findings
        .iter()
        .flat_map(|table| &table.0)
        .map(|row| finding(locale, row, tables))
        .collect();
    let shown = |name: &str| {
        findings
            .iter()
            .flat_map(|finding| &finding.evidence)
            .any(|[shown, _]| shown == name)
    };
    let meanings: Vec<_> = evidence(locale)
        .into_iter()
        .filter(|[name, _]| shown(name))
        .collect();
    Some(json!({
        "kind": match verdict.verdict.as_str() {
            "explained" | "nothing_missing" => "better",
            _ => "unknown",
        },
        "sentence": sentence(locale, verdict, tables),
        "heading": if wrong { say!(locale, "The set-up is wrong") } else { say!(locale, "What the simulation lacked") },
        // What the errors are of.
        "caption": if wrong { say!(locale, "Error of the nominal robot, base and tool fitted, mm") } else { say!(locale, "Error of held-out points, mm") },
        // Name, mean, rms, max.
        "errors": vec![
            errors(before, verdict.before_mean_mm, verdict.before_rms_mm, verdict.before_max_mm),
            errors(after, verdict.after_mean_mm, verdict.after_rms_mm, verdict.after_max_mm),
        ],
        "causes": tables.cells.last().zip(tables.findings.last()).and_then(|(cells, findings)| super::causes::picture(locale, cells, findings)),
        "facts": facts(locale, verdict),
        "findings": findings,
        // What each figure of the evidence means.
        "meanings": meanings,
        "next": tables.statements(&verdict.step, VerdictTopic::NextMeasurement),
        "signature": verdict.signature,
        "suspects": suspects
            .map(|row| [row.point_id.clone(), row.set.clone(), locale.stored(&row.kind), locale.mm(row.size_mm), locale.stored(&row.remark)])
            .collect::<Vec<_>>(),
    }))
}

/// What is wrong with the set-up; none where it is right.
pub(super) fn wrong_setup(tables: &Tables) -> Option<String> {
    let findings = tables.findings.last()?;
    tables.verdict.last()?.wrong_setup(findings)
}

/// A noise with what it rests on.
pub(super) fn noise_basis(
    locale: &Locale,
    noise: String,
    basis: Option<&str>,
    is_assumed: bool,
) -> String {
    match basis {
        _ if is_assumed => say!(
            locale,
            "{noise} (assumed: none is recorded, no instrument is stated)",
            noise
        ),
        Some(basis) => say!(
            locale,
            "{noise} (by {basis})",
            noise,
            basis = locale.stored(basis)
        ),
        None => noise,
    }
}

fn facts(locale: &Locale, verdict: &VerdictRow) -> Vec<(String, String)> {
    let arcsec = |rad: f64| {
        let angle = locale.significant(Unit::Arcsecond.from_si(rad), 2);
        say!(locale, "{angle} arcsec", angle)
    };
    let size = |length: Option<f64>, angle: Option<f64>| {
        length
            .map(|length| say!(locale, "{length} mm", length = locale.mm(length)))
            .or_else(|| angle.map(arcsec))
    };
    let basis = |noise: String| match verdict.is_noise_inferred() && !verdict.is_noise_assumed() {
        true => say!(locale, "{noise} (inferred from what is left)", noise),
        false => {
            let basis = verdict.noise_basis.as_deref();
            noise_basis(locale, noise, basis, verdict.is_noise_assumed())
        }
    };
    let probability = |p: Option<f64>| p.map(|p| locale.significant(p, 2));
    let facts = [
        (
            say!(locale, "noise of one point, rms"),
            size(verdict.noise_floor_mm, verdict.noise_floor_rad).map(basis),
        ),
        (
            say!(locale, "left over at fitted rows, rms"),
            size(verdict.leftover_rms_mm, verdict.leftover_rms_rad),
        ),
        (
            say!(locale, "probability that no further cause is there"),
            probability(verdict.p_after),
        ),
        (
            say!(locale, "the same before any finding"),
            probability(verdict.p_before),
        ),
        (
            say!(locale, "repeatability of the joints"),
            verdict.p_after.map(|_| arcsec(verdict.repeatability_rad)),
        ),
        (say!(locale, "rows fitted"), Some(count(verdict.points))),
    ];
    facts
        .into_iter()
        .filter_map(|(name, figure)| Some((name, figure?)))
        .collect()
}

fn sentence(locale: &Locale, verdict: &VerdictRow, tables: &Tables) -> String {
    let statement = match (&verdict.statement, verdict.verdict.as_str()) {
        (Some(statement), _) => locale.sentence(statement),
        (None, "explained") => say!(
            locale,
            "The findings bring the error of held-out points down to the noise."
        ),
        (None, "nothing_missing") => {
            say!(locale, "These data show nothing that the simulation lacks.")
        }
        (None, "not_asked") => say!(
            locale,
            "Too few rows were fitted to determine what the simulation lacks."
        ),
        (None, _) => say!(locale, "The findings do not explain the whole error."),
    };
    let sentence = match wrong_setup(tables) {
        Some(_) => statement,
        None => {
            statement
                + " "
                + &say!(
                    locale,
                    "The simulation is the nominal robot with geometry, zeros, ratios and declared couplings identified; everything else is a finding."
                )
        }
    };
    let mut gone = tables
        .withdrawn
        .iter()
        .filter(|gone| gone.step == verdict.step);
    match gone.next() {
        Some(gone) => {
            let gone = locale.stored(&gone.to_string());
            say!(
                locale,
                "This step is not the one that the run uses: {gone}. {sentence}",
                gone,
                sentence
            )
        }
        None => sentence,
    }
}

fn finding(locale: &Locale, row: &FindingRow, tables: &Tables) -> FindingView {
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
    let share = |p: Option<f64>| p.map(|p| locale.fixed(p, 2));
    let millimetres = |length: Option<f64>| {
        length.map(|length| say!(locale, "{length} mm", length = locale.mm(length)))
    };
    let three = |value: Option<f64>| value.map(|value| locale.significant(value, 3));
    // What floating point no longer holds is not zero.
    let chance = |p: f64| match p > 0.0 {
        true => locale.significant(p, 2),
        false => "< 1e-300".into(),
    };
    let figures = [
        share(row.probability),
        share(row.place_probability),
        share(row.none_probability),
        three(row.f_statistic),
        row.p_value.map(chance),
        three(row.delta_bic),
        millimetres(row.heldout_gain_mm),
        millimetres(row.effect_rms_mm),
    ];
    let valid = row.valid_range().map(|(joint, ends, unit)| {
        let [from, to] = ends.map(|end| locale.fixed(end, 1));
        let unit = locale.stored(unit);
        say!(
            locale,
            "joint {joint} from {from} to {to} {unit}",
            joint,
            from,
            to,
            unit
        )
    });
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
        statement: locale.sentence(&row.statement),
        numbers: numbers
            .map(|n| {
                let sigma = n
                    .sigma
                    .map(|sigma| locale.significant(sigma, 2))
                    .unwrap_or_default();
                [
                    n.name.clone(),
                    locale.significant(n.value, 5),
                    sigma,
                    locale.stored(&n.unit),
                ]
            })
            .collect(),
        evidence: evidence(locale)
            .into_iter()
            .zip(figures)
            .filter_map(|([name, _], figure)| Some([name, figure?]))
            .collect(),
        rivals: rivals.map(|row| rival(locale, row)).collect(),
        formulas: tables
            .forms
            .iter()
            .flat_map(|table| table.of_finding(row.rank))
            .map(|rows| formula(locale, rows))
            .collect(),
        valid,
        pictures: pictures(locale, row, &curve),
    }
}

/// A formula with its numbers, its price and its errors on folds.
fn formula(locale: &Locale, rows: &[FormRow]) -> String {
    let formula = formula_in_words(rows);
    let Some(row) = rows.first() else {
        return formula;
    };
    let price = match row.proposed {
        true => say!(locale, "{parts} parts, proposed", parts = row.price),
        false => say!(locale, "{parts} parts", parts = row.price),
    };
    let [folds, curve] = [row.folds_rms_mm, row.curve_rms_mm].map(|rms| locale.mm(rms));
    match row.without_rms_mm.map(|rms| locale.mm(rms)) {
        Some(without) => say!(
            locale,
            "{formula} ({price}; {folds} mm cross-validated, {curve} mm with the curve, {without} mm without)",
            formula,
            price,
            folds,
            curve,
            without
        ),
        None => say!(
            locale,
            "{formula} ({price}; {folds} mm cross-validated, {curve} mm with the curve)",
            formula,
            price,
            folds,
            curve
        ),
    }
}

fn rival(locale: &Locale, row: &RivalRow) -> String {
    let (effect, place) = (&row.effect, locale.stored(&row.place));
    let less = locale.significant(row.delta_bic, 2);
    match row.probability.map(|p| locale.fixed(p, 2)) {
        Some(p) => say!(
            locale,
            "{effect} at {place} (probability {p}, 2 ln evidence {less} less)",
            effect,
            place,
            p,
            less
        ),
        None => say!(
            locale,
            "{effect} at {place} (2 ln evidence {less} less)",
            effect,
            place,
            less
        ),
    }
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

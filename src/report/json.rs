//! `report.json`: what the report says, for other programs. Every figure is a column of a table.

use super::limits::Judgement;
use super::{ReportOptions, Tables};
use crate::error::{Error, Result};
use crate::table::{FormRow, VerdictTopic};
use serde_json::{Value, json};

/// The document; `judgement` is that of the page.
pub(super) fn document(
    tables: &Tables,
    options: &ReportOptions,
    title: &str,
    judgement: Option<&Judgement>,
) -> Result<String> {
    let statistics = tables.statistics.0.iter().map(|row| {
        json!({
            "step": row.step, "set": row.set, "held_out": row.held_out, "points": row.points, "mean_mm": row.mean_mm, "std_mm": row.std_mm,
            "p95_mm": row.p95_mm, "max_mm": row.max_mm, "rms_mm": row.rms_mm, "median_mm": row.median_mm, "noise_rms_mm": row.noise_rms_mm,
            "noise_basis": row.noise_basis,
        })
    });
    let findings = tables.findings.iter().flat_map(|table| &table.0).map(|row| {
        let numbers = tables.finding_numbers.iter().flat_map(|table| &table.0).filter(|number| number.rank == row.rank);
        let rivals = tables.rivals.iter().flat_map(|table| &table.0).filter(|rival| rival.rank == row.rank);
        json!({
            "rank": row.rank, "effect": row.effect, "where": row.place, "statement": row.statement,
            "probability": row.probability, "place_probability": row.place_probability, "none_probability": row.none_probability,
            "numbers": numbers.map(|n| json!({ "name": n.name, "value": n.value, "unit": n.unit, "sigma": n.sigma })).collect::<Vec<_>>(),
            "evidence": { "f_statistic": row.f_statistic, "p_value": row.p_value, "delta_bic": row.delta_bic, "heldout_gain_mm": row.heldout_gain_mm },
            "forms": tables.forms.iter().flat_map(|table| table.of_finding(row.rank)).map(form).collect::<Vec<_>>(),
            "rivals": rivals.map(|r| json!({ "effect": r.effect, "where": r.place, "delta_bic": r.delta_bic, "probability": r.probability })).collect::<Vec<_>>(),
        })
    });
    let parameters = tables.parameters.0.iter().map(|row| {
        json!({ "name": row.name, "where": row.place, "unit": row.unit, "nominal": row.nominal, "value": row.value, "sigma": row.sigma, "status": row.status })
    });
    let corrections = tables.corrections.iter().flat_map(|table| &table.0).map(|row| {
        json!({
            "step": row.step, "rival": row.rival, "chosen": row.chosen, "reason": row.reason, "before_mm": row.before_mm, "mean_mm": row.mean_mm,
            "rms_mm": row.rms_mm, "max_mm": row.max_mm, "gain_mm": row.gain_mm, "gain_sigma_mm": row.gain_sigma_mm, "numbers": row.numbers,
        })
    });
    let diagnosis = tables.verdict.iter().flat_map(|table| &table.0).next_back().map(|row| {
        json!({ "step": row.step, "verdict": row.verdict, "statement": row.statement, "noise_basis": row.noise_basis, "noise_floor_mm": row.noise_floor_mm, "before_rms_mm": row.before_rms_mm,
            "after_rms_mm": row.after_rms_mm, "not_observable": tables.said(&row.step, VerdictTopic::NotObservable), "clock": row.clock })
    });
    let withdrawn = tables.withdrawn.iter().map(|gone| {
        json!({ "step": gone.step, "rms_mm": gone.rms_mm, "than": gone.than, "than_rms_mm": gone.than_rms_mm, "points": gone.points })
    });
    let limits = judgement.map(|judgement| {
        let lines = judgement.found().map(|(row, found)| json!({ "figure": row.figure, "found_mm": found, "limit_mm": row.limit_mm, "kept": row.kept }));
        json!({ "asked": !judgement.limits.is_empty(), "kept": judgement.kept, "sentence": judgement.sentence, "figures": lines.collect::<Vec<_>>() })
    });
    let document = json!({
        "calib_report": 1,
        "title": title,
        "robot": super::data::robot_name(&tables.robot),
        "calib": env!("CARGO_PKG_VERSION"),
        "identity": options.identity,
        "standing": tables.standing,
        "withdrawn": withdrawn.collect::<Vec<_>>(),
        "limits": limits,
        "statistics": statistics.collect::<Vec<_>>(),
        "diagnosis": diagnosis,
        "findings": findings.collect::<Vec<_>>(),
        "corrections": corrections.collect::<Vec<_>>(),
        "parameters_counting": tables.counting.as_ref().map_or_else(|| "robot file".into(), |difference| format!("robot file; the controller counts otherwise: {difference}")),
        "parameters": parameters.collect::<Vec<_>>(),
        "rejected_rows": tables.rejected.iter().map(|table| table.0.len()).sum::<usize>(),
        "suspects": tables.suspects.iter().map(|table| table.0.len()).sum::<usize>(),
        "tables": options.hashes.iter().map(|(kind, hash)| json!({ "table": kind, "content": hash })).collect::<Vec<_>>(),
    });
    serde_json::to_string_pretty(&document)
        .map(|text| text + "\n")
        .map_err(|error| Error::Bug(error.to_string()))
}

fn form(rows: &[FormRow]) -> Value {
    let numbers = rows.iter().map(|row| json!({ "name": row.number, "value": row.value, "unit": row.unit, "sigma": row.sigma }));
    let numbers: Vec<Value> = numbers.collect();
    rows.first().map_or(Value::Null, |row| {
        json!({ "formula": row.formula, "price": row.price, "folds_rms_mm": row.folds_rms_mm, "curve_rms_mm": row.curve_rms_mm,
            "without_rms_mm": row.without_rms_mm, "proposed": row.proposed, "numbers": numbers })
    })
}

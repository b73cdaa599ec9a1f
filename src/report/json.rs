//! `report.json`: what the report says, for other programs. Every figure is a column of a table.

use super::certificate::Judgement;
use super::language::Locale;
use super::{ReportOptions, Tables};
use crate::error::Result;
use crate::table::{VerdictTopic, picked, picked_of};
use serde_json::json;

/// The document; `judgement` is that of the page.
pub(super) fn document(
    tables: &Tables,
    options: &ReportOptions,
    (robot, title): (String, String),
    judgement: Option<&Judgement>,
) -> Result<String> {
    let findings = tables
        .findings
        .iter()
        .flat_map(|table| &table.0)
        .map(|row| {
            let columns =
                "rank effect where=place statement probability place_probability none_probability";
            let mut finding = picked(row, columns);
            finding["numbers"] = picked_of(tables.numbers(row.rank), "name value unit sigma");
            finding["evidence"] = picked(row, "f_statistic p_value delta_bic heldout_gain_mm");
            finding["forms"] = tables
                .forms
                .iter()
                .flat_map(|table| table.document(row.rank))
                .collect();
            finding["rivals"] = picked_of(
                tables.rivals(row.rank),
                "effect where=place delta_bic probability",
            );
            finding
        });
    let diagnosis = tables.verdict.iter().flat_map(|table| &table.0).next_back().map(|row| {
        let columns = "step verdict statement noise_basis noise_floor_mm before_rms_mm after_rms_mm clock";
        let mut diagnosis = picked(row, columns);
        diagnosis["not_observable"] = json!(tables.statements(&row.step, VerdictTopic::NotObservable));
        diagnosis
    });
    let limits = judgement.map(|judgement| {
        let figures = judgement.found().map(|(row, _)| row);
        json!({
            "asked": !judgement.limits.is_empty(), "kept": judgement.kept, "sentence": judgement.sentence(&Locale::default()),
            "figures": picked_of(figures, "figure found_mm limit_mm kept"),
        })
    });
    let counting = tables.counting.as_ref().map_or_else(
        || "robot file".into(),
        |difference| format!("robot file; the controller counts otherwise: {difference}"),
    );
    let document = json!({
        "calib_report": 1,
        "title": title,
        "robot": robot,
        "calib": env!("CARGO_PKG_VERSION"),
        "identity": options.identity,
        "standing": tables.standing,
        "withdrawn": tables.withdrawn,
        "limits": limits,
        "statistics": picked_of(
            &tables.statistics.0,
            "step set held_out points mean_mm std_mm p95_mm max_mm rms_mm median_mm noise_rms_mm noise_basis",
        ),
        "diagnosis": diagnosis,
        "findings": findings.collect::<Vec<_>>(),
        "corrections": picked_of(
            tables.corrections.iter().flat_map(|table| &table.0),
            "step rival chosen reason before_mm mean_mm rms_mm max_mm gain_mm gain_sigma_mm numbers",
        ),
        "parameters_counting": counting,
        "parameters": picked_of(&tables.parameters.0, "name where=place unit nominal value sigma status"),
        "rejected_rows": tables.rejected.iter().map(|table| table.0.len()).sum::<usize>(),
        "suspects": tables.suspects.iter().map(|table| table.0.len()).sum::<usize>(),
        "tables": options.hashes.iter().map(|(kind, hash)| json!({ "table": kind, "content": hash })).collect::<Vec<_>>(),
    });
    Ok(format!("{document:#}\n"))
}

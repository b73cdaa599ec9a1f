//! `without`: a cause that is excluded is neither tried nor named, whatever looks like it.

use super::{CASE, Named, case_with, concealed, diagnosis, refused, table_of, wanted};
use crate::answer::has;
use calib::table::{Findings, Parameters};
use serde_json::Value;
use std::path::Path;

/// What the pipeline of cases says without some causes.
fn answer_of(without: &str, folder: &Path) -> Value {
    let step = "  - uses: diagnose\n";
    let with = format!("{step}    with: {{without: [{without}]}}\n");
    case_with(folder, &[(step, &with)]);
    diagnosis(folder)
}

#[test]
fn an_excluded_cause_is_not_named_by_another_form_of_it() {
    for (family, seed) in [("cable_drag", "5"), ("backlash", "32")] {
        let folder = concealed(family, seed, "120");
        let answer = answer_of(family, folder.path());
        let findings = answer["findings"].as_array().unwrap();
        assert!(!findings.is_empty(), "{family}: {answer:#}");
        // Neither as a name, nor as a rival, nor in a sentence.
        assert!(!answer.to_string().contains(family), "{family}: {answer:#}");
        let table: Findings = table_of(folder.path(), "diagnose.findings.parquet");
        assert!(table.0.iter().all(|row| row.effect != family));
    }
}

#[test]
fn what_an_excluded_cause_explains_takes_no_neighbours_name() {
    for (seed, place) in [("1", "link 2"), ("2", "link 4"), ("6", "link 2")] {
        let folder = concealed("link_compliance", seed, "120");
        let answer = answer_of("link_compliance", folder.path());
        let found = wanted(&answer["findings"]);
        let here = ("unknown".to_string(), place.to_string());
        assert_eq!(found, Named::from([here]), "seed {seed}: {answer:#}");
    }
}

#[test]
fn an_excluded_correction_of_geometry_leaves_the_robot_file_as_it_is() {
    let folder = concealed("zero_shift", "923", "120");
    let here = folder.path();
    let ratios = |without: &str| {
        answer_of(without, here);
        let parameters: Parameters = table_of(here, "diagnose.parameters.parquet");
        parameters
            .0
            .iter()
            .filter(|row| row.effect == "reduction_ratio")
            .count()
    };
    assert_eq!((ratios("backlash"), ratios("reduction_ratio")), (6, 0));
}

#[test]
fn nothing_is_diagnosed_without_the_frame_of_the_base() {
    let folder = concealed("zero_shift", "923", "40");
    case_with(
        folder.path(),
        &[(
            "  - uses: diagnose\n",
            "  - uses: diagnose\n    with: {without: [base_frame]}\n",
        )],
    );
    has(
        &refused(&format!("diagnose p.yaml --quiet {CASE}"), folder.path()),
        "`base_frame` places the robot before the instrument",
    );
}

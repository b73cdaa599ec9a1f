//! Laws of torque of a user's own in YAML, and how much a diagnosis believes in what nobody listed.

use crate::answer::{calib, has, put, read, root};
use serde_json::Value;
use std::path::Path;

/// The pipeline of torques without its report, with settings of its diagnosis.
fn pipeline(folder: &Path, settings: &str) {
    let text = read(root("pipelines/dynamics/pipeline.yaml"));
    let (head, _) = text.split_once("  - uses: report_torques").unwrap();
    let with = format!("  - uses: diagnose_torques\n    with: {{{settings}}}\n");
    put(
        folder,
        "p.yaml",
        head.replace("  - uses: diagnose_torques\n", &with),
    );
}

/// The recording of the example with more current of the third motor where its joint is near an angle, rad.
fn worn(folder: &Path, amperes: f64, centre: f64) {
    let case = root("pipelines/dynamics/example");
    std::fs::create_dir(folder.join("case")).unwrap();
    let here = folder.join("case");
    std::fs::copy(case.join("robot.json"), here.join("robot.json")).unwrap();
    let text = read(case.join("recording.csv"));
    let mut lines = text.lines();
    let head = lines.next().unwrap();
    let at = |name: &str| head.split(',').position(|column| column == name).unwrap();
    let (angle, current) = (at("q3_deg"), at("i3_a"));
    let row = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        let number = |cell: &str| cell.parse::<f64>().unwrap();
        let off = (number(&cells[angle]).to_radians() - centre) / 0.2;
        let more = amperes * (-off * off).exp();
        cells[current] = format!("{:.4}", number(&cells[current]) + more);
        cells.join(",")
    };
    let rows: Vec<String> = std::iter::once(head.to_string())
        .chain(lines.map(row))
        .collect();
    put(here, "recording.csv", rows.join("\n") + "\n");
}

fn found(answer: &Value) -> Vec<String> {
    let findings = answer["findings"].as_array().unwrap().iter();
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_string();
    findings
        .map(|one| format!("{} at {}", text(one, "effect"), text(one, "where")))
        .collect()
}

#[test]
fn a_law_of_ones_own_is_found_at_its_joint_and_stays_with_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    worn(here, 1.0, 0.3);
    let law = read(root("pipelines/dynamics/effects/worn_seal.yaml"));
    put(here, "worn_seal.yaml", law);
    pipeline(here, "effects: [worn_seal.yaml]");
    let set = "--quiet --set case=case --store s";
    calib(here, &format!("run p.yaml {set}")).code(0);
    let answer = calib(here, &format!("diagnose p.yaml --json {set}"));
    let answer = answer.code(0).json();
    let found = found(&answer);
    assert!(
        found.contains(&"worn_seal at joint 3".to_string()),
        "{found:?}"
    );
    std::fs::remove_file(here.join("worn_seal.yaml")).unwrap();
    let model = "export HEAD --format dynamics --store s --out model.json";
    calib(here, model).code(0);
    has(&read(here.join("model.json")), "worn_seal");
}

#[test]
fn what_is_wrong_with_a_law_is_said_at_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let law = "calib_effect: 1
effects:
  - name: coulomb_friction
    place: joint
    law: sign(velocity)
  - name: pull
    place: tool
    law: elevation
    size: 3
";
    put(here, "pull.yaml", law);
    pipeline(here, "effects: [pull.yaml], open_world: 1");
    let case = root("pipelines/dynamics/example");
    let run = format!("diagnose p.yaml --set case={} --store s", case.display());
    let refused = calib(here, &run);
    has(&refused.err, "open_world");
    pipeline(here, "effects: [pull.yaml]");
    let refused = calib(here, &run);
    assert_ne!(refused.code, Some(0));
    for said in [
        "is a cause of calib's own library",
        "a torque acts at a joint; found `tool`",
        "`elevation` is not known of rows of torques",
        "the usual size of a torque is taken from the recording",
    ] {
        has(&refused.err, said);
    }
}

//! A fleet's causes: what each recording alone hardly shows, the sum over robots names; a fleet without a cause names nothing.

use super::{fleet, output, write};
use crate::answer::{has, read, root};
use crate::fixture::spread;
use calib::report::PageLanguage;
use calib::report::fleet_causes::html;
use calib::table::{FleetCellRow, FleetCells, FleetFindingRow, FleetFindings, FleetOutliers};
use calib::twin::conceal::design::Design;
use calib::twin::torque::TorqueCase;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

const ROBOTS: usize = 8;
const LACKING: usize = 5;

/// Twins with rigid errors of their own and what `effects` says of each.
pub fn twins(folder: &Path, name: &str, effects: impl Fn(usize) -> String) -> std::path::PathBuf {
    let robot = root("pipelines/sr210d/robot.yaml");
    let pipeline = format!(
        "calib: 1\nname: twins\nseed: 5\nstages:\n  - uses: robot\n    with: {{file: {}}}\n  - uses: simulate\n    with:\n      \
         truth: {{}}\n      tracker: {{position_mm: [4500, -1800, 900], roll_pitch_yaw_deg: [0.3, -0.2, 155]}}\n      \
         blocks: [{{usage: fit, points: 100}}]\n  - uses: split\n    with: {{by: usage}}\n  - uses: diagnose\n",
        robot.display()
    );
    write(folder.join("twins.yaml"), &pipeline);
    let mut list =
        "robot,model,set.simulate.seed,set.simulate.truth.offset_deg,set.simulate.effects\n"
            .to_string();
    for robot in 0..ROBOTS {
        let offset = |joint: usize| 0.1 * spread(robot * 31 + joint, joint) - 0.05;
        let offsets: Vec<String> = (0..6)
            .map(|joint| format!("{:.6}", offset(joint)))
            .collect();
        let (offsets, effects) = (offsets.join(", "), effects(robot));
        writeln!(
            list,
            "robot {robot},sr210d,{},\"[{offsets}]\",\"{effects}\"",
            4000 + robot
        )
        .unwrap();
    }
    write(folder.join(format!("{name}.csv")), &list);
    let text =
        format!("calib: 1\nname: {name}\npipeline: twins.yaml\nrobots:\n  - list: {name}.csv\n");
    write(folder.join(format!("{name}.yaml")), &text)
}

fn diagnose(file: &Path, store: &Path, more: &[&str]) -> Value {
    let (result, printed) = output(
        fleet("diagnose", file, store)
            .args(["--json", "--quiet"])
            .args(more),
    );
    assert!(result.status.success(), "{printed}");
    serde_json::from_slice(&result.stdout).unwrap()
}

fn rows<'a>(answer: &'a Value, list: &str) -> Vec<&'a Value> {
    answer[list].as_array().unwrap().iter().collect()
}

#[test]
fn robots_together_name_a_weak_cause_its_order_and_the_robot_that_lacks_it() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let wave = |robot: usize| match robot {
        LACKING => "[]".into(),
        _ => format!(
            "[{{gear_cyclic: {{joint: 4, order: 3, amplitude_arcsec: 12, phase_deg: {}}}}}]",
            37 * robot
        ),
    };
    let file = twins(folder, "shared", wave);
    let answer = diagnose(&file, &store, &[]);
    let findings = rows(&answer, "findings");
    assert_eq!(findings.len(), 1, "{answer:#}");
    let finding = findings[0];
    assert_eq!(
        [
            &finding["effect"],
            &finding["place"],
            &finding["robot"],
            &finding["shape"]
        ],
        ["gear_cyclic", "joint 4", "", "gear_cyclic@joint 4#order3"],
        "{answer:#}"
    );
    assert_eq!(finding["robots"], 7, "{answer:#}");
    let outliers = rows(&answer, "outliers");
    assert_eq!(outliers.len(), 1, "{answer:#}");
    assert_eq!(
        [&outliers[0]["kind"], &outliers[0]["robot"]],
        ["lacks", "robot 5"]
    );
    // Nothing is computed again, however many work at it.
    let again = diagnose(&file, &store, &["-j", "1"]);
    assert_eq!(again["computed"], 0);
    assert_eq!(again["findings"], answer["findings"]);
    // The next robot of the model is expected to have it.
    let text = read(&file);
    let text = text.replace("name: shared", "name: next")
        + "prior: {fleet: shared, stage: diagnose, by: causes}\n";
    let next = write(folder.join("next.yaml"), &text);
    let (result, printed) =
        output(fleet("run", &next, &store).args(["--json", "--quiet", "--robot", "robot 3"]));
    assert!(result.status.success(), "{printed}");
    let answer: Value = serde_json::from_slice(&result.stdout).unwrap();
    let causes = |answer: &Value| answer["robots"][3]["causes"].as_str().map(str::to_string);
    assert_eq!(
        causes(&answer).as_deref(),
        Some("gear_cyclic at joint 4"),
        "{answer:#}"
    );
}

#[test]
fn a_prior_of_causes_of_a_fleet_that_was_not_diagnosed_is_a_fault_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let file = twins(folder, "first", |_| "[]".into());
    let text = read(&file);
    let with = |tail: &str| write(folder.join("next.yaml"), &format!("{text}prior: {tail}\n"));
    let message_of = |tail: &str| {
        let (result, printed) = output(fleet("run", &with(tail), &store).arg("--quiet"));
        assert_eq!(result.status.code(), Some(2), "{printed}");
        printed
    };
    let lacks = message_of("{fleet: other, stage: diagnose, by: causes}");
    has(&lacks, "no fleet `other` was diagnosed");
    let named = message_of("{fleet: other, stage: diagnose, by: causes, effects: [backlash]}");
    has(&named, "prior.effects");
}

fn size(robot: usize) -> FleetCellRow {
    let deviation = if robot == 7 {
        9.0
    } else {
        (robot % 7) as f64 / 3.0 - 1.0
    };
    FleetCellRow {
        cell: "backlash@joint 3".into(),
        robot: format!("<b>{robot}</b>"),
        group: "sr210d".into(),
        plant: Some(
            if robot.is_multiple_of(2) {
                "north"
            } else {
                "south"
            }
            .into(),
        ),
        campaign: None,
        effect: "backlash".into(),
        place: "joint 3".into(),
        log_evidence: 5.0,
        probability: 1.0,
        size: 0.03 + 0.003 * deviation,
        sigma: 0.003,
        log_ratio: 50.0,
        unit: "mm".into(),
        deviation: Some(deviation),
    }
}

#[test]
fn the_page_of_two_thousand_robots_is_small_and_the_furthest_robot_comes_first() {
    let finding = FleetFindingRow {
        group: "sr210d".into(),
        cell: "backlash@joint 3".into(),
        robot: String::new(),
        effect: "backlash".into(),
        place: "joint 3".into(),
        follows: "approach".into(),
        shape: None,
        robots: 1500,
        of_robots: 2000,
        log_odds: 900.0,
        probability: 0.97,
        rival: None,
        size: 0.03,
        spread: Some(0.002),
        unit: "mm".into(),
        trend: None,
        decided: Some(true),
        statement: "backlash at joint 3 in 1500 of 2000 robots".into(),
    };
    let cells = FleetCells((0..2000).map(size).collect());
    let page = html(
        "line",
        &FleetFindings(vec![finding]),
        &cells,
        &FleetOutliers::default(),
        PageLanguage::English,
    );
    let page = page.unwrap().html;
    assert!(page.len() < 2_000_000, "{}", page.len());
    assert!(page.contains("height: 75.0%") && !page.contains("<b>7"));
    assert_eq!(page.matches("class=\"sigma\"").count(), 2000);
    let rows: Vec<&str> = page.split("<td class=\"name\">").skip(1).collect();
    assert!(rows.len() == 2000 && rows[0].starts_with("&lt;b&gt;7&lt;"));
}

#[test]
fn a_fleet_without_a_common_cause_names_none_and_a_robot_alone_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let one = |robot: usize| match robot {
        2 => "[{backlash: {joint: 3, gap_arcsec: 20}}]".into(),
        _ => "[]".into(),
    };
    let answer = diagnose(&twins(folder, "single", one), &store, &[]);
    let findings = rows(&answer, "findings");
    assert_eq!(findings.len(), 1, "{answer:#}");
    assert_eq!(
        (&findings[0]["robot"], &findings[0]["effect"]),
        (&"robot 2".into(), &"backlash".into())
    );
    assert_eq!(rows(&answer, "outliers")[0]["kind"], "alone");
}

#[test]
fn arms_of_a_model_have_their_friction_and_a_ripple_of_a_gear_in_common() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let design = Design {
        seed: 3,
        cases: 8,
        nulls: 1.0,
        other_forms: 0.0,
        seconds: 20.0,
        rate: 50.0,
        ..Design::default()
    };
    let has_sensors = |case: &TorqueCase| case.recording()[1].1.contains("tau1_nm");
    let mut cases = (0..8).map(|number| TorqueCase::draw(&design, number));
    let arm = cases.find(has_sensors).expect("an arm with sensors");
    let mut list = "robot,model,folder\n".to_string();
    for robot in 0..3 {
        let [(_, file), (_, rows)] = arm.clone().on_other_paths(70 + robot, 20.0).recording();
        write(folder.join(format!("{robot}/robot.json")), &file);
        write(
            folder.join(format!("{robot}/recording.csv")),
            &rippled(&rows, 0.7 * robot as f64),
        );
        writeln!(list, "arm {robot},seven7r,{robot}").unwrap();
    }
    write(folder.join("list.csv"), &list);
    let pipeline = root("pipelines/dynamics/pipeline.yaml");
    let text = format!(
        "calib: 1\nname: arms\npipeline: {}\nrobots:\n  - {{list: list.csv, variable: case}}\n",
        pipeline.display()
    );
    let answer = diagnose(&write(folder.join("arms.yaml"), &text), &store, &[]);
    let ripple = rows(&answer, "findings").into_iter().find(|row| {
        row["effect"] == "torque_ripple" && row["place"] == "joint 4" && row["robot"] == ""
    });
    let ripple = ripple.unwrap_or_else(|| panic!("{answer:#}"));
    assert_eq!(
        (&ripple["robots"], &ripple["unit"]),
        (&3.into(), &"Nm".into()),
        "{answer:#}"
    );
    // 0.5 Nm is 0.35 Nm rms.
    let size = ripple["size"].as_f64().unwrap();
    assert!((size - 0.35).abs() < 0.08, "{size}");
    // Its sizes are no lengths.
    let next = text.replace("name: arms", "name: next")
        + "prior: {fleet: arms, stage: diagnose_torques, by: causes}\n";
    let next = write(folder.join("next.yaml"), &next);
    let (result, message) = output(fleet("run", &next, &store).arg("--quiet"));
    assert_eq!(result.status.code(), Some(2), "{message}");
    has(&message, "was diagnosed by torques (sizes in Nm)");
}

/// Rows of a recording with a torque at joint 4 that comes back three times a turn.
fn rippled(rows: &str, phase: f64) -> String {
    let mut lines = rows.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let column = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    let (angle, torque) = (column("q4_deg"), column("tau4_nm"));
    let mut out = heads.join(",") + "\n";
    for line in lines {
        let q: f64 = line[angle].parse().unwrap();
        let tau: f64 = line[torque].parse().unwrap();
        let tau = format!("{:.4}", tau + 0.5 * (3.0 * q.to_radians() + phase).cos());
        let cells = line.iter().enumerate();
        let cells = cells.map(|(k, cell)| if k == torque { &*tau } else { cell });
        out += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    out
}

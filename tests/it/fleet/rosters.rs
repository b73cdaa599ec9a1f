//! Robots from a list, from one big table, and with settings of their own.

use super::{Line, write};
use crate::answer::read;
use std::path::Path;

#[test]
fn a_list_names_robots_their_folders_groups_and_settings() {
    let list = "robot;folder;model;plant;set.joint.effects\n\
        \"r;1\";cases/recordings/c0001;c6;Linz;\n\
        r2;cases/recordings/c0002;c6;Graz;\"[base_frame, joint_offset]\"\n\
        r3;cases/recordings/none;c6;;\n";
    let tail = "groups: {plant: Wien, campaign: 2026-10-01}\nrobots:\n  - list: robots.csv\n\
        overrides:\n  - robots: ['r;*']\n    set: {joint.effects: [base_frame, tool_offset], joint.screen: false}\n    groups: {model: other}\n";
    let line = Line::of(3, tail);
    write(line.folder.path().join("robots.csv"), list);
    let answer = line.run(10);
    assert_eq!(
        (answer["done"].as_u64(), answer["rejected"].as_u64()),
        (Some(2), Some(1))
    );
    assert!(
        answer["robots"][2]["reason"]
            .as_str()
            .unwrap()
            .contains("no such file"),
        "{answer}"
    );
    let manifest = |robot: usize| -> serde_json::Value {
        let run = answer["robots"][robot]["run"].as_str().unwrap();
        serde_json::from_slice(
            &std::fs::read(line.store.join("runs").join(run).join("manifest.json")).unwrap(),
        )
        .unwrap()
    };
    let effects = |robot: usize| {
        let stages = manifest(robot)["stages"].clone();
        let joint = stages
            .as_array()
            .unwrap()
            .iter()
            .find(|stage| stage["id"] == "joint")
            .unwrap()
            .clone();
        joint["key"]["settings"]["effects"].clone()
    };
    assert_eq!(effects(0), serde_json::json!(["base_frame", "tool_offset"]));
    assert_eq!(
        effects(1),
        serde_json::json!(["base_frame", "joint_offset"])
    );
    let page = read(answer["page"].as_str().unwrap());
    for group in [
        "other, Linz, 2026-10-01",
        "c6, Graz, 2026-10-01",
        "c6, Wien, 2026-10-01",
    ] {
        assert!(page.contains(group), "{group}");
    }
}

/// The rows of all cases in one CSV, with the robot's name in a column.
fn together(cases: &Path, names: &[(&str, &str)]) -> String {
    const CONTROLLER: [&str; 9] = [
        "point_id",
        "use",
        "payload_kg",
        "q1_deg",
        "q2_deg",
        "q3_deg",
        "q4_deg",
        "q5_deg",
        "q6_deg",
    ];
    const TRACKER: [&str; 3] = ["x_mm", "y_mm", "z_mm"];
    let mut text = format!("cell,{},{}\n", CONTROLLER.join(","), TRACKER.join(","));
    for (case, robot) in names {
        let columns = |file: &str, wanted: &[&str]| -> Vec<String> {
            let text = read(cases.join("recordings").join(case).join(file));
            let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
            let places: Vec<usize> = wanted
                .iter()
                .map(|name| header.iter().position(|other| other == name).unwrap())
                .collect();
            let pick = |line: &str| {
                places
                    .iter()
                    .map(|place| line.split(',').nth(*place).unwrap())
                    .collect::<Vec<_>>()
                    .join(",")
            };
            text.lines().skip(1).map(pick).collect()
        };
        for (a, b) in columns("controller.csv", &CONTROLLER)
            .into_iter()
            .zip(columns("tracker.csv", &TRACKER))
        {
            text.push_str(&format!("\"{robot}\",{a},{b}\n"));
        }
    }
    text
}

#[test]
fn one_big_table_is_parted_by_robot_once() {
    let line = Line::of(
        3,
        "robots:\n  - {recording: all.csv, by: cell, variable: part}\n",
    );
    let (cases, here) = (&line.cases, line.folder.path());
    let names = [("c0001", "../a"), ("c0002", "b, c"), ("c0003", "d")];
    write(here.join("all.csv"), &together(cases, &names));
    let text = read(super::pipeline());
    let start = text.find("        - file: ${case}/controller.csv").unwrap();
    let end = text.find("        - file: ${case}/tracker.csv").unwrap();
    let join = text.find("      join: {by: id}\n").unwrap();
    let xyz = "            x: {column: x_mm, unit: mm}\n            y: {column: y_mm, unit: mm}\n            z: {column: z_mm, unit: mm}\n";
    let one = text[start..end].replace("${case}/controller.csv", "${part}");
    let text = format!(
        "{}{one}{xyz}{}",
        &text[..start],
        &text[join + "      join: {by: id}\n".len()..]
    );
    let text = text.replace(
        "${case}/robot.json",
        &cases
            .join("recordings/c0001/robot.json")
            .display()
            .to_string(),
    );
    write(here.join("one.yaml"), &text);
    let text = read(&line.file).replace(&super::pipeline().display().to_string(), "one.yaml");
    std::fs::write(&line.file, text).unwrap();
    let answer = line.run(0);
    let names: Vec<&str> = answer["robots"]
        .as_array()
        .unwrap()
        .iter()
        .map(|robot| robot["robot"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["../a", "b, c", "d"]);
    // The same as the robot's own files give.
    assert!(
        answer["robots"][0]["after_rms_mm"].as_f64().unwrap() < 0.2,
        "{answer}"
    );
    assert_eq!(line.run(0)["computed"].as_u64(), Some(0));
    // A row more of one robot is another recording of that one alone.
    let mut all = read(here.join("all.csv"));
    let last = all
        .lines()
        .next_back()
        .unwrap()
        .replacen("d\",", "d\",x", 1)
        + "\n";
    all.push_str(&last);
    write(here.join("all.csv"), &all);
    assert_eq!(line.run(0)["computed"].as_u64(), Some(1));
}

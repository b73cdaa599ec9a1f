//! `verify-robot`: what compensation achieved, from points measured at corrected targets.

use crate::answer::{calib, has, put};
use crate::library_of_arms::{REFLECTOR, on_flange, real, recording, tracker};
use calib::robot::{LibraryArm, RobotModel};
use serde_json::Value;
use std::fmt::Write;

#[test]
fn what_compensation_achieved_is_measured_against_the_wanted_points() {
    let arm = LibraryArm::find("lrmate_200id").unwrap();
    let read = arm.read().unwrap();
    let robot = RobotModel::new(read.robot.clone());
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| {
        let output = calib(folder.path(), arguments);
        let printed = output.err.clone();
        assert!(output.code == Some(0), "{arguments:?}: {printed}");
        output.out.clone()
    };
    put(
        folder.path(),
        "measured.csv",
        recording(&robot, &read.about.coupled),
    );
    run(&format!(
        "init cell --data measured.csv --robot {}",
        arm.name
    ));
    let [file, pipeline] =
        ["cell/robot.yaml", "cell/pipeline.yaml"].map(|name| folder.path().join(name));
    std::fs::write(
        &file,
        on_flange(&std::fs::read_to_string(&file).unwrap(), arm.name, &robot),
    )
    .unwrap();
    // Geometry alone: what is compensated is known then.
    let text = std::fs::read_to_string(&pipeline).unwrap();
    let text = text
        .split("  # What else is wrong")
        .next()
        .unwrap()
        .to_string();
    std::fs::write(&pipeline, text).unwrap();
    // Targets as the controller counts them: joint 3 from the horizontal.
    let mut targets = String::from("name,J1_deg,J2_deg,J3_deg,J4_deg,J5_deg,J6_deg\n");
    let wanted = |k: i32| {
        if k < 12 {
            [10 * k - 60, 3 * k, 2 * k - 20, 20 - 3 * k, 30 + k, 5 * k].map(f64::from)
        } else {
            [20.0, 10.0, -15.0, 5.0, 40.0, 0.0]
        }
    };
    (0..42).for_each(|k| {
        writeln!(
            targets,
            "T{k},{}",
            wanted(k).map(|q| q.to_string()).join(",")
        )
        .unwrap()
    });
    put(folder.path(), "targets.csv", &targets);
    run("compensate cell/pipeline.yaml targets.csv --out corrected.csv --quiet");
    let corrected = std::fs::read_to_string(folder.path().join("corrected.csv")).unwrap();
    let mut second = targets.lines().next().unwrap().to_string() + ",x_mm,y_mm,z_mm\n";
    for (line, target) in corrected.lines().skip(1).zip(targets.lines().skip(1)) {
        let shown: Vec<f64> = line
            .split(',')
            .skip(1)
            .take(6)
            .map(|cell| cell.parse::<f64>().unwrap().to_radians())
            .collect();
        // The real arm: joint 3 moves with joint 2, and zeros are off.
        let mut q = shown.clone();
        q[2] += shown[1];
        let point = tracker().point(&robot.forward(&real(&q)).point(&REFLECTOR));
        writeln!(
            second,
            "{target},{:.4},{:.4},{:.4}",
            1e3 * point.x,
            1e3 * point.y,
            1e3 * point.z
        )
        .unwrap();
    }
    put(folder.path(), "second.csv", second);
    let answer: Value =
        serde_json::from_str(&run("verify-robot cell/pipeline.yaml second.csv --json")).unwrap();
    let figure = |row: &str, name: &str| answer[row][name].as_f64().unwrap();
    assert!(figure("before", "mean_mm") > 0.5, "{answer:#}");
    assert!(figure("achieved", "max_mm") < 0.02, "{answer:#}");
    assert!(figure("predicted_u95", "mean_mm") < 0.05, "{answer:#}");
    assert_eq!(
        (
            answer["points"].as_u64(),
            answer["iso_9283"][0]["cycles"].as_u64()
        ),
        (Some(42), Some(30)),
        "{answer:#}"
    );
    let text =
        run("verify-robot cell/pipeline.yaml second.csv --new-base --quiet --html verified.html");
    has(
        &text,
        ["achieved  mean 0.00", "the tracker's place found anew"],
    );
    has(&text, "ISO 9283  pose 1, 30 cycles: accuracy AP 0.0");
    // The page has the figures of the terminal.
    let page = std::fs::read_to_string(folder.path().join("verified.html")).unwrap();
    let line = text
        .lines()
        .find(|line| line.starts_with("achieved"))
        .unwrap();
    let numbers: Vec<&str> = line
        .split(' ')
        .filter(|word| word.len() > 4 && word.parse::<f64>().is_ok())
        .collect();
    assert_eq!(numbers.len(), 3, "{line}");
    assert!(
        numbers
            .iter()
            .all(|number| page.contains(&format!("<td>{number}</td>"))),
        "{numbers:?}"
    );
    run("verify-robot cell/pipeline.yaml second.csv --quiet --html nachweis.html --language de");
    let german = std::fs::read_to_string(folder.path().join("nachweis.html")).unwrap();
    has(
        &german,
        [
            "<html lang=\"de\">",
            "Was die Kompensation erreicht hat",
            "erreicht: 42 Messpunkte",
            "Stellungen mit mindestens 30 Zyklen, mm",
        ],
    );
    // A table has one decimal mark, in lines without decimals too.
    put(
        folder.path(),
        "ziele.csv",
        "name;J1_deg;J2_deg;J3_deg;J4_deg;J5_deg;J6_deg\nA;10;5;-20;20;30;5\nB;10,5;5;-20;20;30;5\nC;20;5;-20;20;30;5\n",
    );
    run("compensate cell/pipeline.yaml ziele.csv --out korrigiert.csv --quiet");
    let marked = std::fs::read_to_string(folder.path().join("korrigiert.csv")).unwrap();
    for line in marked.lines().skip(1) {
        assert!(line.contains(',') && !line.contains('.'), "{line}");
    }
    assert!(
        page.contains("<th scope=\"row\">1</th><td>30</td>") && page.matches("<svg ").count() == 1,
        "{page}"
    );
}

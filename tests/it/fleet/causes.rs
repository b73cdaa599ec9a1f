//! A fleet's causes: what each recording alone hardly shows, the sum over robots names; a fleet without a cause names nothing.

use super::{fleet, output, write};
use crate::fixture::spread;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

const ROBOTS: usize = 8;
const LACKING: usize = 5;

/// Twins with rigid errors of their own and what `effects` says of each.
fn twins(folder: &Path, name: &str, effects: impl Fn(usize) -> String) -> std::path::PathBuf {
    let robot = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/sr210d/robot.yaml");
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
    let (result, said) = output(
        fleet("diagnose", file, store)
            .args(["--json", "--quiet"])
            .args(more),
    );
    assert!(result.status.success(), "{said}");
    serde_json::from_slice(&result.stdout).unwrap()
}

fn rows<'a>(told: &'a Value, list: &str) -> Vec<&'a Value> {
    told[list].as_array().unwrap().iter().collect()
}

#[test]
fn robots_together_name_a_cause_that_none_names_alone_and_the_robot_that_lacks_it() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let gap = |robot: usize| match robot {
        LACKING => "[]".into(),
        _ => "[{backlash: {joint: 3, gap_arcsec: 1.9}}]".into(),
    };
    let file = twins(folder, "shared", gap);
    let told = diagnose(&file, &store, &[]);
    let findings = rows(&told, "findings");
    assert_eq!(findings.len(), 1, "{told:#}");
    assert_eq!(
        (
            &findings[0]["effect"],
            &findings[0]["place"],
            &findings[0]["robot"]
        ),
        (&"backlash".into(), &"joint 3".into(), &"".into()),
        "{told:#}"
    );
    assert_eq!(findings[0]["robots"], 7, "{told:#}");
    let outliers = rows(&told, "outliers");
    assert_eq!(outliers.len(), 1, "{told:#}");
    assert_eq!(
        (&outliers[0]["kind"], &outliers[0]["robot"]),
        (&"lacks".into(), &"robot 5".into())
    );
    // Nothing is computed again, whoever had it in hand.
    let again = diagnose(&file, &store, &["-j", "1"]);
    assert_eq!(again["computed"], 0);
    assert_eq!(again["findings"], told["findings"]);
    // The next robots of the model know of it.
    let text = std::fs::read_to_string(&file)
        .unwrap()
        .replace("name: shared", "name: next")
        + "prior: {fleet: shared, stage: diagnose, by: causes}\n";
    let next = write(folder.join("next.yaml"), &text);
    let (result, said) =
        output(fleet("run", &next, &store).args(["--quiet", "--robot", "robot 0"]));
    assert_eq!(result.status.code(), Some(0), "{said}");
    let findings = |name: &str| {
        let (result, said) = output(fleet("status", &folder.join(name), &store).arg("--json"));
        assert!(result.status.success(), "{said}");
    };
    findings("next.yaml");
}

#[test]
fn a_fleet_without_a_common_cause_names_none_and_a_robot_alone_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let one = |robot: usize| match robot {
        2 => "[{backlash: {joint: 3, gap_arcsec: 20}}]".into(),
        _ => "[]".into(),
    };
    let told = diagnose(&twins(folder, "single", one), &store, &[]);
    let findings = rows(&told, "findings");
    assert_eq!(findings.len(), 1, "{told:#}");
    assert_eq!(
        (&findings[0]["robot"], &findings[0]["effect"]),
        (&"robot 2".into(), &"backlash".into())
    );
    assert_eq!(rows(&told, "outliers")[0]["kind"], "alone");
}

//! Arms of unknown masses, as most cells have them: no payload, no currents, no masses in the robot file.

use super::{rms, wanted};
use crate::answer::{calib, has, read, root};
use serde_json::Value;

/// What a diagnosis says of concealed recordings of this kind, with the truth of each.
fn bare(robot: &str, family: &str, forms: &str, seed: &str) -> (Value, Value) {
    let folder = tempfile::tempdir().unwrap();
    let made = "simulate conceal --out set --cases 1 --points 120 --faulty 0 --bare";
    let drawn = &format!("--robot {robot} --family {family} --other-forms {forms} --seed {seed}");
    calib(folder.path(), &format!("{made} {drawn}")).ok();
    let pipeline = root("pipelines/case/pipeline.yaml").display().to_string();
    let case = format!(
        "case={}",
        folder.path().join("set/recordings/c0001").display()
    );
    let answer = calib(
        folder.path(),
        &format!("diagnose {pipeline} --set {case} --json --quiet --store store"),
    );
    let truth = read(folder.path().join("set/sealed/c0001.json"));
    let robot = read(folder.path().join("set/recordings/c0001/robot.json"));
    assert!(
        !robot.contains("\"mass\"") && !robot.contains("\"com\""),
        "{robot}"
    );
    (answer.json(), serde_json::from_str(&truth).unwrap())
}

#[test]
fn gravity_is_found_where_nobody_knows_the_masses_and_no_hose_is() {
    for robot in ["sr210d", "compact6", "seven7r"] {
        let (answer, truth) = bare(robot, "joint_compliance", "1", "61");
        for finding in answer["findings"].as_array().unwrap() {
            let statement = finding["statement"].as_str().unwrap();
            has(
                statement,
                [
                    "winds up under gravity, by up to ",
                    "cannot be separated from the links' weight",
                ],
            );
        }
        let found = wanted(&answer["findings"]);
        let is_soft = |place: &str| found.contains(&("joint_compliance".into(), place.into()));
        assert!(
            found.iter().all(|(effect, _)| effect == "joint_compliance"),
            "{robot}: {found:?}"
        );
        let plain = truth["effects"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|effect| effect["L"].as_f64() > Some(50.0));
        let plain: Vec<&str> = plain
            .filter_map(|effect| effect["where"].as_str())
            .collect();
        assert!(
            plain.len() > 1 && plain.iter().all(|place| is_soft(place)),
            "{robot}: {plain:?}, found {found:?}"
        );
        let [before, after] = ["before", "after"].map(|when| rms(&answer, when));
        let floor = answer["noise_floor_mm"].as_f64().unwrap();
        assert!(
            after < 1.2 * floor && before > 2.0 * after,
            "{robot}: {before} to {after}"
        );
    }
}

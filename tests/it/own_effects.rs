//! A user's own effect in YAML: found by its name on concealed recordings, and kept with its run.

use crate::answer::{self, has, put, read, root, starts_with};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn calib(words: &str, folder: &Path) -> String {
    answer::calib(folder, words).ok()
}

fn diagnosed(arguments: &str, folder: &Path) -> Value {
    serde_json::from_str(&calib(arguments, folder)).unwrap()
}

/// Findings as `effect at place`.
fn found(answer: &Value) -> Vec<String> {
    let one = |finding: &Value| {
        format!(
            "{} at {}",
            finding["effect"].as_str().unwrap(),
            finding["where"].as_str().unwrap()
        )
    };
    answer["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(one)
        .collect()
}

/// The pipeline of cases without its reports, with an effect of one's own.
fn pipeline(folder: &Path, effect: &str) {
    let text = read(root("pipelines/case/pipeline.yaml"));
    let (head, _) = text.split_once("  - uses: validate").unwrap();
    let text = head.replace(
        "  - uses: diagnose\n",
        &format!("  - uses: diagnose\n    with: {{effects: [{effect}]}}\n"),
    );
    has(&text, effect);
    put(folder, "p.yaml", text);
}

/// Concealed recordings with a local error at some joint, which the library does not name: their numbers and joints.
fn bumps(folder: &Path) -> Vec<(String, String)> {
    let cases =
        "--cases 12 --open 1 --seed 41 --points 120 --robot compact6 --faulty 0 --natural 1";
    calib(&format!("simulate conceal --out sealed {cases}"), folder);
    let mut sealed: Vec<PathBuf> = std::fs::read_dir(folder.join("sealed/sealed"))
        .unwrap()
        .map(|file| file.unwrap().path())
        .collect();
    sealed.sort();
    let truth = |file: &PathBuf| -> Value { serde_json::from_str(&read(file)).unwrap() };
    let name = |file: &PathBuf| file.file_stem().unwrap().to_string_lossy().into_owned();
    let place = |truth: &Value| truth["want"][0]["where"].as_str().unwrap().to_string();
    let of_bumps = sealed
        .iter()
        .map(|file| (name(file), truth(file)))
        .filter(|(_, truth)| truth.to_string().contains("\"bump\""));
    of_bumps
        .map(|(name, truth)| (name, place(&truth)))
        .collect()
}

#[test]
fn an_effect_of_ones_own_is_found_at_its_joint_and_stays_with_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::copy(
        root("pipelines/case/effects/worn_tooth.yaml"),
        here.join("worn_tooth.yaml"),
    )
    .unwrap();
    pipeline(here, "worn_tooth.yaml");
    let bumps = bumps(here);
    assert_eq!(bumps.len(), 3, "{bumps:?}");
    let case = |name: &str| format!("case=sealed/recordings/{name}");
    for (name, place) in &bumps {
        let answer = diagnosed(
            &format!("diagnose p.yaml --json --quiet --set {}", case(name)),
            here,
        );
        assert_eq!(
            found(&answer),
            [format!("worn_tooth at {place}")],
            "{name}: {answer:#}"
        );
        let statement = answer["findings"][0]["statement"].as_str().unwrap();
        starts_with(statement, &format!("a tooth of {place} is worn near "));
        assert_eq!(answer["findings"][0]["parameters"][0]["unit"], "arcsec");
    }

    // From the store, and without the file.
    let set = format!("--set {}", case(&bumps[0].0));
    calib(&format!("run p.yaml --quiet {set}"), here);
    let again: Value =
        serde_json::from_str(&calib(&format!("run p.yaml --quiet --json {set}"), here)).unwrap();
    assert!(
        again["stages"]
            .as_array()
            .unwrap()
            .iter()
            .all(|stage| stage["status"] == "cached"),
        "{again:#}"
    );
    let targets = "name,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\na,10,-100,20,5,30,0\nb,-20,-70,40,15,-25,60\n";
    put(here, "targets.csv", targets);
    let corrected = || calib("compensate HEAD targets.csv", here);
    let with_the_file = corrected();
    assert_ne!(
        with_the_file,
        calib("compensate HEAD --step geometry targets.csv", here)
    );
    std::fs::remove_file(here.join("worn_tooth.yaml")).unwrap();
    assert_eq!(corrected(), with_the_file);
    assert_eq!(
        found(&diagnosed("diagnose HEAD --json", here)),
        [format!("worn_tooth at {}", bumps[0].1)]
    );
    calib("diff HEAD~1 HEAD", here);
    for verb in ["show HEAD", "log", "export HEAD --format json", "verify"] {
        calib(verb, here);
    }
    // The law as it stood is part of what decides whether a run is the same.
    let law = read(root("pipelines/case/effects/worn_tooth.yaml"));
    put(here, "worn_tooth.yaml", law.replace("to: 1.2", "to: 1.1"));
    let other: Value =
        serde_json::from_str(&calib(&format!("run p.yaml --quiet --json {set}"), here)).unwrap();
    let computed: Vec<&Value> = other["stages"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|stage| stage["status"] != "cached")
        .collect();
    assert!(
        computed.len() == 1 && computed[0]["id"] == "diagnose",
        "{other:#}"
    );
}

/// What a diagnosis has no name for gets a formula; that one, declared, is the name in the next recording.
#[test]
fn a_formula_of_an_unknown_is_found_by_its_name_in_the_next_recording() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    pipeline(here, "");
    let bumps = bumps(here);
    let case = |name: &str| format!("case=sealed/recordings/{name}");
    let answer = diagnosed(
        &format!("diagnose p.yaml --json --quiet --set {}", case(&bumps[2].0)),
        here,
    );
    let finding = &answer["findings"][0];
    assert_eq!(finding["where"], bumps[2].1.as_str(), "{answer:#}");
    let forms = finding["forms"].as_array().unwrap();
    assert!((1..=3).contains(&forms.len()), "{finding:#}");
    let proposed: Vec<&Value> = forms
        .iter()
        .filter(|form| form["proposed"] == true)
        .collect();
    let [proposed] = proposed[..] else {
        panic!("{forms:#?}")
    };
    assert_eq!(
        proposed["formula"], "exp(-((q - centre) / width)^2)",
        "{forms:#?}"
    );
    let number = |name: &str| {
        let of_key = |key: &str| {
            let number = proposed["numbers"]
                .as_array()
                .unwrap()
                .iter()
                .find(|number| number["name"] == name)
                .expect(name);
            number[key].as_f64().unwrap()
        };
        [of_key("value"), of_key("sigma")]
    };
    // The twin's own: -41 deg, 34 deg.
    let truth = read(here.join(format!("sealed/sealed/{}.json", bumps[2].0)));
    let truth: Value = serde_json::from_str(&truth).unwrap();
    let bump = &truth["effects"][0]["physical"][0]["joint_bump"];
    for (name, key) in [("centre", "centre_deg"), ("width", "width_deg")] {
        let ([value, sigma], expected) = (number(name), bump[key].as_f64().unwrap().to_radians());
        assert!(
            (value - expected).abs() < 4.0 * sigma && sigma < 0.1,
            "{name}: {value} +- {sigma}, truth {expected}"
        );
    }
    let prices: Vec<(i64, f64)> = forms
        .iter()
        .map(|form| {
            (
                form["price"].as_i64().unwrap(),
                form["folds_rms_mm"].as_f64().unwrap(),
            )
        })
        .collect();
    assert!(
        prices
            .windows(2)
            .all(|pair| pair[0].0 < pair[1].0 && pair[0].1 > pair[1].1),
        "{prices:?}"
    );

    let set = case(&bumps[2].0);
    let export = &format!("diagnose p.yaml --quiet --set {set} --export-effect mine.yaml");
    calib(export, here);
    answer::calib(here, export).code(2);
    let text = read(here.join("mine.yaml"));
    put(here, "mine.yaml", text.replace("bump_of_q", "soft_spot"));
    pipeline(here, "mine.yaml");
    for (name, place) in &bumps {
        let answer = diagnosed(
            &format!("diagnose p.yaml --json --quiet --set {}", case(name)),
            here,
        );
        assert_eq!(
            found(&answer)[0],
            format!("soft_spot at {place}"),
            "{name}: {answer:#}"
        );
    }
}

#[test]
fn a_fleet_finds_an_effect_of_ones_own() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::copy(
        root("pipelines/case/effects/worn_tooth.yaml"),
        here.join("worn_tooth.yaml"),
    )
    .unwrap();
    pipeline(here, "worn_tooth.yaml");
    let bumps = bumps(here);
    let robots: Vec<String> = bumps
        .iter()
        .map(|(name, _)| format!("  - folders: sealed/recordings/{name}\n"))
        .collect();
    put(
        here,
        "f.yaml",
        format!(
            "calib: 1\nname: line\npipeline: p.yaml\nrobots:\n{}",
            robots.concat()
        ),
    );
    let answer: Value =
        serde_json::from_str(&calib("fleet run f.yaml --json --quiet", here)).unwrap();
    assert_eq!(answer["done"], 3, "{answer:#}");
    for ((name, place), robot) in bumps.iter().zip(answer["robots"].as_array().unwrap()) {
        assert!(
            robot
                .to_string()
                .contains(&format!("worn_tooth at {place}")),
            "{name}: {robot:#}"
        );
    }
    assert_eq!(
        diagnosed("fleet run f.yaml --json --quiet", here)["computed"],
        0
    );
}

/// The same law under a name of the library's and under one's own: declared, it is found where the library may not look for it.
#[test]
fn a_cause_left_out_is_found_by_its_declaration() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let declared = "calib_effect: 1
name: late_zero
place: joint
law: step(time - moment)
shape:
  moment: {from: 0, to: 3400}
unit: arcsec
";
    put(here, "late_zero.yaml", declared);
    pipeline(here, "late_zero.yaml], without: [zero_shift");
    let arguments = "simulate conceal --out sealed --cases 1 --seed 923 --points 120";
    calib(
        &format!("{arguments} --family zero_shift --robot compact6 --faulty 0"),
        here,
    );
    let truth: Value = serde_json::from_str(&read(here.join("sealed/sealed/c0001.json"))).unwrap();
    let answer = diagnosed(
        "diagnose p.yaml --json --quiet --set case=sealed/recordings/c0001",
        here,
    );
    let place = truth["want"][0]["where"].as_str().unwrap();
    assert_eq!(
        found(&answer),
        [format!("late_zero at {place}")],
        "{answer:#}"
    );
}

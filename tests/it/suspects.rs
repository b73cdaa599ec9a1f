//! What the stages say of rows that do not belong: tables, notes, and silence on good recordings.

use crate::answer::{has, read, root};
use crate::desk::{Desk, identify_reads, shared, table};
use crate::sr210d::{experiment, settings};
use calib::stage::ingest::{Ingest, IngestReads};
use calib::stage::split::{SplitBy, SplitReads};
use calib::stage::{Identify, ReadRobot, RobotReads};
use calib::table::{Prediction, PredictionRow, Recording, Robot, Split, Suspects};
use serde::de::DeserializeOwned;
use serde_json::Value;

pub struct Inputs {
    pub robot: Robot,
    pub recording: Recording,
    pub split: Split,
}

/// Robot, recording and split of a pipeline of ours on recordings beside the repository, and the settings of one stage.
pub fn pipeline<T: DeserializeOwned>(
    name: &str,
    variables: &[(&str, &str)],
    stage: &str,
) -> (Inputs, T) {
    let folder = root("pipelines").join(name);
    let text = read(folder.join("pipeline.yaml"));
    let text = variables.iter().fold(text, |text, (key, value)| {
        text.replace(&format!("${{{key}}}"), value)
    });
    let whole: Value = serde_saphyr::from_str(&text).unwrap();
    let with = |id: &str| {
        let mut stages = whole["stages"].as_array().unwrap().iter();
        let found = stages
            .find(|stage| stage["id"] == id || (stage["id"].is_null() && stage["uses"] == id));
        let with = found.unwrap()["with"].clone();
        if with.is_null() {
            serde_json::json!({})
        } else {
            with
        }
    };
    let desk = Desk::default();
    let mut robot: ReadRobot = serde_json::from_value(with("robot")).unwrap();
    robot.file.0 = folder.join(&robot.file.0);
    let robot: Robot = table(&desk.run(&robot, RobotReads {}).unwrap()).remove(0);
    let ingest: Ingest = serde_json::from_value(with("ingest")).unwrap();
    let chunks = table(
        &desk
            .run(
                &ingest,
                IngestReads {
                    robot: robot.clone(),
                },
            )
            .unwrap(),
    );
    let recording: Recording = match <[Recording; 1]>::try_from(chunks) {
        Ok([recording]) => recording,
        Err(chunks) => panic!("{} chunks of a small recording", chunks.len()),
    };
    let split: SplitBy = serde_json::from_value(with("split")).unwrap();
    let split = table(
        &desk
            .run(
                &split,
                SplitReads {
                    recording: recording.clone(),
                },
            )
            .unwrap(),
    )
    .remove(0);
    (
        Inputs {
            robot,
            recording,
            split,
        },
        serde_json::from_value(with(stage)).unwrap(),
    )
}

fn identify(desk: &Desk, stage: &Identify, inputs: Inputs) -> (Suspects, Prediction) {
    let Inputs {
        robot,
        recording,
        split,
    } = inputs;
    let tables = desk
        .run(stage, identify_reads(robot, recording, split))
        .unwrap();
    (table(&tables).remove(0), table(&tables).remove(0))
}

#[test]
fn a_recording_without_mistakes_has_no_suspects() {
    let Some(folder) = shared("practice/p05_null") else {
        return;
    };
    let case = folder.display().to_string();
    for step in ["nominal", "geometry", "joint"] {
        let (inputs, stage) = pipeline("case", &[("case", &case)], step);
        let (suspects, _) = identify(&Desk::default(), &stage, inputs);
        assert_eq!(suspects.0, [], "{step}");
    }
}

#[test]
fn on_a_real_robot_what_the_model_lacks_is_not_taken_for_mistakes() {
    let Some(folder) = shared("data/ipa_ur10") else {
        return;
    };
    let data = folder.display().to_string();
    let variables = [
        ("data", data.as_str()),
        ("series", "Series_C/measurements_random_poses.csv"),
    ];
    for step in ["nominal", "geometry", "ratios"] {
        let (inputs, stage) = pipeline("ur10", &variables, step);
        let rows = inputs.recording.rows();
        let (suspects, _) = identify(&Desk::default(), &stage, inputs);
        println!("{step}: {} of {rows} rows are suspects", suspects.0.len());
        for row in &suspects.0 {
            println!(
                "{} {} {:.3} mm, {:.1}",
                row.sequence, row.kind, row.size_mm, row.statistic
            );
        }
        assert!(
            suspects.0.len() <= 8,
            "{step}: {} of {rows} rows",
            suspects.0.len()
        );
    }
}

#[test]
fn suspects_are_named_to_the_person_listed_and_still_predicted() {
    let clean = experiment("all", 1);
    let sequence = |set: &str, k: usize| {
        clean
            .split
            .0
            .iter()
            .filter(|row| row.set == set)
            .nth(k)
            .unwrap()
            .sequence as usize
    };
    let rows = [
        sequence("unloaded_fit", 3),
        sequence("unloaded_check", 7),
        sequence("unloaded_fit", 20),
        sequence("check", 5),
    ];
    let [a, b, inch, lost] = rows.map(|sequence| {
        clean
            .recording
            .sequence
            .iter()
            .position(|s| *s as usize == sequence)
            .unwrap()
    });
    let mut recording = clean.recording.clone();
    recording.position.swap(a, b);
    recording.position[inch] = recording.position[inch].map(|value| 25.4 * value);
    recording.position[lost] = [0.0; 3];
    let mut stage: Identify = settings("geometry", "all");
    let inputs = || Inputs {
        robot: clean.robot.clone(),
        recording: recording.clone(),
        split: clean.split.clone(),
    };
    let desk = Desk::default();
    let (suspects, prediction) = identify(&desk, &stage, inputs());
    let id = |row: usize| &recording.point_id[row];
    let kinds: Vec<(&str, &str, Option<i64>)> = suspects
        .0
        .iter()
        .map(|row| {
            (
                row.point_id.as_str(),
                row.kind.as_str(),
                row.partner_sequence,
            )
        })
        .collect();
    let mut expected = vec![
        (id(a).as_str(), "exchanged", Some(recording.sequence[b])),
        (id(b).as_str(), "exchanged", Some(recording.sequence[a])),
        (id(inch).as_str(), "unit_slip", None),
        (id(lost).as_str(), "zero", None),
    ];
    expected.sort_by_key(|(name, ..)| recording.point_id.iter().position(|id| id == name));
    assert_eq!(kinds, expected);
    let (first, second) = (id(a.min(b)), id(a.max(b)));
    let said = desk.warnings.lock().unwrap().join("\n");
    let sentence = format!(
        "4 rows set aside: {first} and {second} look exchanged; {} is 25.4 times too far; {} is zero",
        id(inch),
        id(lost)
    );
    has(&said, &sentence);
    let marked = prediction.0.iter().filter(|row| row.suspect).count();
    assert_eq!((prediction.0.len(), marked), (recording.rows(), 4));
    // A row that was looked at to set it aside is no held-out row of the fit's own set.
    assert!(
        prediction
            .0
            .iter()
            .all(|row| row.set != "unloaded_fit" || !row.held_out)
    );
    let weight = |row: &PredictionRow| match (row.suspect, row.set.as_str()) {
        (true, _) => row.weight == Some(0.0),
        (false, "unloaded_fit") => row.weight.is_some_and(|weight| weight > 0.0),
        _ => row.weight.is_none(),
    };
    assert!(prediction.0.iter().all(weight));
    stage.screen = false;
    let desk = Desk::default();
    let (suspects, prediction) = identify(&desk, &stage, inputs());
    assert_eq!(
        (
            suspects.0.len(),
            prediction.0.iter().filter(|row| row.suspect).count()
        ),
        (0, 0)
    );
    // Rows that are not set aside count the less the farther off they are, and the note names them.
    let least = prediction.0[inch].weight.unwrap();
    assert!(
        least < 0.01
            && prediction
                .0
                .iter()
                .filter_map(|row| row.weight)
                .all(|weight| weight >= least),
        "{least}"
    );
    let said = desk.notes.lock().unwrap().join("\n");
    has(
        &said,
        [
            "far off and down-weighted: ",
            &*format!("({} to 0.0", id(inch)),
        ],
    );
}

//! What the stages say of rows that do not belong: tables, notes, and silence on good recordings.

use crate::answer::has;
use crate::desk::shared;
use crate::recorded::Example;
use crate::sr210d::{example, experiment};
use calib::stage::Identify;
use calib::table::{Prediction, PredictionRow, Suspects};

/// Suspects of each of these steps of a pipeline.
fn suspects(example: &Example, steps: [&str; 3]) -> Vec<(Suspects, usize)> {
    let recorded = example.ingested();
    let step = |step| recorded.identify_by(&example.with(step)).unwrap();
    let rows = recorded.recording.rows();
    steps.map(|name| (step(name).get(), rows)).into()
}

#[test]
fn a_recording_without_mistakes_has_no_suspects() {
    let Some(folder) = shared("practice/p05_null") else {
        return;
    };
    let example = Example::new("case", &[("case", &folder.display().to_string())]);
    for (suspects, _) in suspects(&example, ["nominal", "geometry", "joint"]) {
        assert_eq!(suspects.0, []);
    }
}

#[test]
fn on_a_real_robot_what_the_model_lacks_is_not_taken_for_mistakes() {
    let Some(folder) = shared("data/ipa_ur10") else {
        return;
    };
    let variables = [
        ("data", &*folder.display().to_string()),
        ("series", "Series_C/measurements_random_poses.csv"),
    ];
    let steps = ["nominal", "geometry", "ratios"];
    let found = suspects(&Example::new("ur10", &variables), steps);
    for (step, (suspects, rows)) in steps.iter().zip(found) {
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
    let (clean, _) = experiment("all", 1);
    let row = |set: &str, k: usize| {
        let mut rows = clean.split.0.iter().filter(|row| row.set == set);
        let sequence = rows.nth(k).unwrap().sequence;
        let mut all = clean.recording.sequence.iter();
        all.position(|other| *other == sequence).unwrap()
    };
    let [a, b, inch, lost] = [
        ("unloaded_fit", 3),
        ("unloaded_check", 7),
        ("unloaded_fit", 20),
        ("check", 5),
    ]
    .map(|(set, k)| row(set, k));
    let mut dirty = clean.clone();
    let points = &mut dirty.recording.position;
    points.swap(a, b);
    points[inch] = points[inch].map(|value| 25.4 * value);
    points[lost] = [0.0; 3];
    let recording = &dirty.recording;
    let mut stage: Identify = example("all").with("geometry");
    let made = dirty.identify_by(&stage).unwrap();
    let (suspects, prediction): (Suspects, Prediction) = (made.get(), made.get());
    let id = |row: usize| &recording.point_id[row];
    let kinds = suspects.0.iter();
    let kinds: Vec<(&str, &str, Option<i64>)> = kinds
        .map(|row| (&*row.point_id, &*row.kind, row.partner_sequence))
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
    let sentence = format!(
        "4 rows set aside: {first} and {second} look exchanged; {} is 25.4 times too far; {} is zero",
        id(inch),
        id(lost)
    );
    has(&made.warnings, &sentence);
    let marked = prediction.0.iter().filter(|row| row.suspect).count();
    assert_eq!((prediction.0.len(), marked), (recording.rows(), 4));
    // A row that was looked at to set it aside is no held-out row of the fit's own set.
    let is_fine = |row: &PredictionRow| row.set != "unloaded_fit" || !row.held_out;
    assert!(prediction.0.iter().all(is_fine));
    let weight = |row: &PredictionRow| match (row.suspect, row.set.as_str()) {
        (true, _) => row.weight == Some(0.0),
        (false, "unloaded_fit") => row.weight.is_some_and(|weight| weight > 0.0),
        _ => row.weight.is_none(),
    };
    assert!(prediction.0.iter().all(weight));
    stage.screen = false;
    let made = dirty.identify_by(&stage).unwrap();
    let (suspects, prediction): (Suspects, Prediction) = (made.get(), made.get());
    assert!(suspects.0.is_empty() && !prediction.0.iter().any(|row| row.suspect));
    // Rows that are not set aside count the less the farther off they are, and the note names them.
    let least = prediction.0[inch].weight.unwrap();
    let mut weights = prediction.0.iter().filter_map(|row| row.weight);
    assert!(
        least < 0.01 && weights.all(|weight| weight >= least),
        "{least}"
    );
    has(
        &made.notes,
        [
            "far off and down-weighted: ",
            &*format!("({} to 0.0", id(inch)),
        ],
    );
}

//! Every row of a recording goes to exactly one set.

use crate::desk::{Desk, table};
use calib::error::{Error, Result};
use calib::stage::Stage;
use calib::stage::split::{SplitBy, SplitReads};
use calib::table::{Recording, Split};

/// One joint; rows with the same number are repeats of a pose.
fn recording(poses: &[i32]) -> Recording {
    let rows = poses.len();
    Recording {
        joints: 1,
        prismatic: vec![false],
        sequence: (0..rows as i64).map(|row| 10 + 2 * row).collect(),
        point_id: (0..rows).map(|row| format!("P{row}")).collect(),
        usage: vec![None; rows],
        q: poses.iter().map(|pose| f64::from(*pose) * 0.01).collect(),
        position: vec![[1.0, 2.0, 3.0]; rows],
        ..Recording::default()
    }
}

fn distinct(rows: i32) -> Recording {
    recording(&(0..rows).collect::<Vec<_>>())
}

fn settings(yaml: &str) -> SplitBy {
    let options = serde_saphyr::options! { strict_booleans: true };
    serde_saphyr::from_str_with_options(yaml, options).unwrap()
}

fn sets(yaml: &str, recording: Recording) -> Result<Vec<String>> {
    let (rows, sequence, ids) = (
        recording.rows(),
        recording.sequence.clone(),
        recording.point_id.clone(),
    );
    let tables = Desk::default().run(&settings(yaml), SplitReads { recording })?;
    let split = table::<Split>(&tables).remove(0);
    assert_eq!(split.0.len(), rows);
    assert!(
        split
            .0
            .iter()
            .zip(sequence.iter().zip(&ids))
            .all(|(row, (s, id))| row.sequence == *s && row.point_id == *id)
    );
    Ok(split.0.into_iter().map(|row| row.set).collect())
}

fn refuses(yaml: &str, recording: Recording, expected: &str) {
    match sets(yaml, recording) {
        Err(error @ Error::Data(_)) => assert_eq!(error.to_string(), expected),
        other => panic!("{other:?}"),
    }
}

fn deals(yaml: &str, recording: Recording, expected: &str) {
    assert_eq!(sets(yaml, recording).unwrap().join(" "), expected, "{yaml}");
}

#[test]
fn every_fourth_row_validates() {
    let expected = "fit fit fit validate fit fit fit validate fit";
    deals("{by: every, n: 4}", distinct(9), expected);
    let named = "{by: every, n: 3, offset: 0, set: check, rest: learn}";
    deals(named, distinct(4), "check learn learn check");
    let expected = "with.n: set `validate` gets none of the 3 rows; say a smaller `n`";
    refuses("{by: every, n: 4}", distinct(3), expected);
    let expected = "with.fraction: set `validate` gets none of the 9 rows; say a larger `fraction`";
    refuses("{by: random, fraction: 0.0001}", distinct(9), expected);
}

#[test]
fn blocks_are_dealt_in_turn_and_break_at_poses() {
    let of_two = "{by: blocks, length: 2, sets: [a, b]}";
    deals(of_two, distinct(5), "a a b b a");
    let three = "{by: blocks, count: 3, sets: [a, a, b]}";
    deals(three, distinct(6), "a a a a b b");
    deals(of_two, recording(&[0, 1, 1, 2, 3, 4]), "a a a b a a");
}

#[test]
fn random_choice_keeps_repeats_together_and_follows_the_seed() {
    // No path: neighbours are far apart.
    let poses: Vec<i32> = (0..300).map(|row| row / 3 * 37 % 100).collect();
    let first = sets("{by: random, fraction: 0.25}", recording(&poses)).unwrap();
    let drawn = first.iter().filter(|set| *set == "validate").count();
    assert!((74..=76).contains(&drawn), "{drawn}");
    assert!(
        first
            .chunks(3)
            .all(|pose| pose.iter().all(|set| *set == pose[0]))
    );
    assert_eq!(
        sets("{by: random, fraction: 0.25}", recording(&poses)).unwrap(),
        first
    );
}

#[test]
fn usage_labels_become_sets() {
    let labelled = |labels: &[&str]| {
        let mut recording = distinct(labels.len() as i32);
        recording.usage = labels
            .iter()
            .map(|label| (!label.is_empty()).then(|| label.to_string()))
            .collect();
        recording
    };
    deals(
        "{by: usage}",
        labelled(&["fit", "validate"]),
        "fit validate",
    );
    let mapped = "{by: usage, sets: {train: fit, test: validate}, blank: rest}";
    deals(
        mapped,
        labelled(&["test", "train", ""]),
        "validate fit rest",
    );
    let unknown =
        "with.sets: label `trian` (point `P1`) has no set; mapped: test, train; found: test, trian";
    refuses(mapped, labelled(&["test", "trian"]), unknown);
    let none = "with.blank: point `P0` has no usage label; found: none; allowed: map `usage` in ingest, or say `blank`";
    refuses("{by: usage}", labelled(&["", ""]), none);
}

#[test]
fn counts_in_the_order_of_recording_must_fit_the_rows() {
    let yaml = "{by: order, sets: [{set: a, rows: 2}, {set: b, rows: 1}, {set: a}]}";
    deals(yaml, distinct(5), "a a b a a");
    let short = "{by: order, sets: [{set: a, rows: 2}, {set: b, rows: 4}]}";
    let message = "with.sets[1].rows: set `b` takes 4 rows, but only 3 of 5 remain";
    refuses(short, distinct(5), message);
    let message =
        "with.sets: the sets take 6 of 7 rows; let the last one leave `rows` out, or name one more";
    refuses(short, distinct(7), message);
}

#[test]
fn faulty_settings_are_named_by_their_place() {
    for (yaml, expected) in [
        (
            "{by: every, n: 1, offset: 5, set: a, rest: a}",
            "n offset rest",
        ),
        ("{by: blocks, length: 0, sets: []}", "length sets"),
        ("{by: random, fraction: 1.5}", "fraction"),
        (
            "{by: order, sets: [{set: a}, {set: b, rows: 0}]}",
            "sets[0].rows sets[1].rows",
        ),
    ] {
        let faults = settings(yaml).check();
        let places: Vec<&str> = faults.iter().map(|fault| fault.place.as_str()).collect();
        assert_eq!(places.join(" "), expected, "{yaml}");
    }
}

/// Three targets a pose, whose logs differ in the last digits.
fn targets(poses: usize) -> Recording {
    let mut recording = recording(
        &(0..poses as i32)
            .flat_map(|pose| [100 * pose; 3])
            .collect::<Vec<_>>(),
    );
    recording
        .q
        .iter_mut()
        .enumerate()
        .for_each(|(row, q)| *q += 1e-6 * row as f64);
    recording.target = Some(
        (0..3 * poses)
            .map(|row| Some(["A", "B", "C"][row % 3].into()))
            .collect(),
    );
    recording
}

#[test]
fn no_choice_parts_the_targets_of_a_pose() {
    for yaml in [
        "{by: every, n: 4}",
        "{by: random, fraction: 0.3}",
        "{by: blocks, count: 4, sets: [fit, fit, fit, validate]}",
    ] {
        let sets = sets(yaml, targets(20)).unwrap();
        assert!(
            sets.chunks(3)
                .all(|pose| pose[0] == pose[1] && pose[1] == pose[2]),
            "{yaml}: {sets:?}"
        );
        assert!(sets.iter().any(|set| set == "validate"), "{yaml}");
    }
    let every = sets("{by: every, n: 4}", targets(8)).unwrap();
    assert_eq!(every.iter().filter(|set| *set == "validate").count(), 6);
}

#[test]
fn points_of_an_encoder_that_dithers_between_two_counts_are_no_copies() {
    // Four poses, each read six times: the joint stands, one coordinate is one of two counts.
    let mut all = recording(&[
        0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3,
    ]);
    let count = |row: usize| 1.534e-3 * f64::from(u8::from([1, 4, 5].contains(&(row % 6))));
    all.position = (0..24)
        .map(|row| [1.0 + all.q[row], 2.0 + count(row), 3.0])
        .collect();
    let desk = Desk::default();
    let read = SplitReads { recording: all };
    desk.run(&settings("{by: every, n: 4}"), read).unwrap();
    let said = desk.warnings.lock().unwrap().join(" ");
    assert!(!said.contains("copies"), "{said}");
}

#[test]
fn copies_of_a_row_under_other_ids_stay_in_one_set_and_are_counted() {
    let copied = || {
        let mut all = recording(&[0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3]);
        all.position = all.q.iter().map(|q| [1.0 + q, 2.0, 3.0]).collect();
        all
    };
    for yaml in [
        "{by: every, n: 3}",
        "{by: blocks, length: 2, sets: [fit, fit, validate]}",
        "{by: random, fraction: 0.4}",
        "{by: order, sets: [{set: fit, rows: 8}, {set: validate}]}",
    ] {
        let desk = Desk::default();
        let tables = desk.run(
            &settings(yaml),
            SplitReads {
                recording: copied(),
            },
        );
        let tables = match (&tables, yaml.contains("order")) {
            // All of a set are copies of another's.
            (Err(error), true) => {
                assert!(error.to_string().contains("validate"), "{error}");
                continue;
            }
            _ => tables.unwrap(),
        };
        let split = table::<Split>(&tables).remove(0);
        for k in 0..4 {
            assert_eq!(
                split.0[8 + k].set,
                split.0[k].set,
                "{yaml}: P{} copies P{k}",
                8 + k
            );
        }
        let warnings = desk.warnings.lock().unwrap().join("\n");
        assert!(
            warnings.contains("4 rows") && warnings.contains("P8 is P0"),
            "{yaml}: {warnings}"
        );
    }
    // A pose that was measured again is no copy.
    let mut again = copied();
    again.position[8..]
        .iter_mut()
        .for_each(|point| point[0] += 1e-6);
    let desk = Desk::default();
    desk.run(
        &settings("{by: every, n: 3}"),
        SplitReads { recording: again },
    )
    .unwrap();
    assert!(desk.warnings.lock().unwrap().is_empty());
}

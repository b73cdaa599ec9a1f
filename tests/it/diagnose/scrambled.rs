//! Held-out rows choose nothing: whatever they say, the same causes are found, with the same numbers. They judge how probable these are.

use crate::recorded::{Example, Made, Recorded};
use calib::table::{
    CovarianceTable, FindingRow, Findings, Parameters, Prediction, RivalRow, Rivals, Table,
};

/// Moves the measured points of held-out rows by 0.3 mm, to and fro.
fn scattered(inputs: &mut Recorded) {
    let held = (0..inputs.split.0.len()).filter(|row| inputs.split.0[*row].set != "fit");
    for (k, row) in held.enumerate() {
        inputs.recording.position[row][k % 3] += if k % 2 == 0 { 3e-4 } else { -3e-4 };
    }
}

/// Gives the measured points of held-out rows to one another.
fn exchanged(inputs: &mut Recorded) {
    let held: Vec<usize> = (0..inputs.split.0.len())
        .filter(|row| inputs.split.0[*row].set != "fit")
        .collect();
    let points: Vec<[f64; 3]> = held
        .iter()
        .map(|row| inputs.recording.position[*row])
        .collect();
    for (k, row) in held.iter().enumerate() {
        inputs.recording.position[*row] = points[(k + 1) % points.len()];
    }
}

/// Findings that explain something, but for how probable they are: that held-out rows themselves are wrong is said, too.
fn causes(made: &Made) -> Vec<FindingRow> {
    let findings: Findings = made.get();
    let explaining = findings.0.into_iter();
    let explaining = explaining.filter(|row| row.delta_bic.is_some());
    let without_probabilities = |row: FindingRow| FindingRow {
        probability: None,
        place_probability: None,
        none_probability: None,
        ..row
    };
    explaining.map(without_probabilities).collect()
}

/// What else findings may be, but for how probable that is.
fn rivals(made: &Made) -> Vec<RivalRow> {
    let rivals: Rivals = made.get();
    let without_probability = |row: RivalRow| RivalRow {
        probability: None,
        ..row
    };
    rivals.0.into_iter().map(without_probability).collect()
}

#[test]
fn every_choice_of_a_diagnosis_is_the_same_whatever_held_out_rows_say() {
    for (family, seed) in [
        ("gear_cyclic", "41"),
        ("backlash", "42"),
        ("joint_hardening", "43"),
    ] {
        let folder = super::concealed(family, seed, "120");
        let case = folder
            .path()
            .join("sealed/recordings/c0001")
            .display()
            .to_string();
        let example = Example::new("case", &[("case", &case)]);
        let recorded = example.ingested();
        let diagnosed = |change: fn(&mut Recorded)| {
            let mut recording = recorded.clone();
            change(&mut recording);
            recording.diagnose_by(&example.with("diagnose")).unwrap()
        };
        let (sound, other, mixed) = (
            diagnosed(|_| ()),
            diagnosed(scattered),
            diagnosed(exchanged),
        );
        let after = |made: &Made| made.verdict().after_rms_mm.unwrap();
        assert!(
            after(&other) > 2.0 * after(&sound),
            "{family}: nothing was scattered"
        );
        fn same<T: Table + PartialEq + std::fmt::Debug>(a: &Made, b: &Made) {
            let [a, b]: [T; 2] = [a, b].map(|made| made.get());
            assert_eq!(a, b, "{}", T::KIND);
        }
        for other in [&other, &mixed] {
            assert_eq!(causes(&sound), causes(other));
            same::<Parameters>(&sound, other);
            same::<CovarianceTable>(&sound, other);
            assert_eq!(rivals(&sound), rivals(other));
        }
        let folds = |made: &Made| -> Vec<Option<f64>> {
            let prediction: Prediction = made.get();
            prediction.0.iter().map(|row| row.fold_error_mm).collect()
        };
        assert_eq!(folds(&sound), folds(&other));
        assert!(folds(&sound).iter().flatten().count() > 60);
    }
}

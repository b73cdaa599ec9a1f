//! Cross-validation: as honest as held-out points, repeats together, and the same on any number of threads.

use crate::answer::{has, starts_with};
use crate::fixture::{self, all_rows, fit_all, misses, rms};
use crate::identify::{GEOMETRY, SIGMA, model, recording};
use crate::recorded::{labelled, made};
use crate::sr210d::{example, experiment};
use calib::estimate::{Fitted, Folds, Model, Session, align, cross_validate, leave_one_out};
use calib::robot::{Measurements, RobotModel};
use calib::stage::{FoldSetting, Identify, Stage, Validate, ValidateReads};
use calib::table::{Prediction, Statistics};

fn identify(data: &Measurements, effects: &[&str]) -> (Model, Fitted) {
    identify_rows(data, effects, &all_rows(data))
}

fn identify_rows(data: &Measurements, effects: &[&str], rows: &[usize]) -> (Model, Fitted) {
    let robot = RobotModel::new(fixture::offset_wrist());
    let model = model(&robot, align(&robot, data, rows), effects);
    fit_all(&model, data, rows)
}

/// What is made of a fit of these effects to all rows.
fn of_session<T>(data: &Measurements, effects: &[&str], make: impl Fn(&Session) -> T) -> T {
    let (model, fitted) = identify(data, effects);
    make(&Session {
        data,
        rows: &all_rows(data),
        model: &model,
        fitted: &fitted,
    })
}

fn folds(data: &Measurements, effects: &[&str], count: usize) -> Option<Folds> {
    of_session(data, effects, |session| cross_validate(session, count, 7))
}

/// Every row, and every row again.
fn twice(once: &Measurements) -> Measurements {
    let mut twice = once.clone();
    twice.q.extend_from_within(..);
    twice.points.position.extend_from_within(..);
    twice.points.sigma.extend_from_within(..);
    twice.payload.extend_from_within(..);
    twice
}

#[test]
fn folds_of_a_complete_model_show_the_noise_and_what_its_parameters_cost() {
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let (mut random, mut blocks, mut training) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 200..220 {
        let (data, _) = recording(&fixture::offset_wrist(), &effects, 80, seed);
        let found = folds(&data, &effects, 5).unwrap();
        random.extend(found.random);
        blocks.extend(found.blocks);
        training.extend(misses(&identify(&data, &effects).0, &data));
    }
    // 33 parameters from 64 points of three values.
    let expected = SIGMA * 3f64.sqrt() * f64::sqrt(1.0 + 33.0 / (192.0 - 34.0));
    for (name, errors) in [("random", random), ("blocks", blocks)] {
        let ratio = rms(errors) / expected;
        assert!(
            (0.96..1.06).contains(&ratio),
            "{name}: {ratio:.3} of what is expected"
        );
    }
    assert!(rms(training) < 0.95 * SIGMA * 3f64.sqrt());
}

/// One step from the whole fit is as good as ten more fits: to 1 % of the noise, outliers among the rows or not.
#[test]
fn a_fold_is_what_a_fit_without_its_rows_says() {
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    for (seed, outlier) in [(230, 0.0), (231, 6e-4)] {
        let (mut data, _) = recording(&fixture::offset_wrist(), &effects, 80, seed);
        data.points.position[33].x += outlier;
        let found = folds(&data, &effects, 5).unwrap().blocks;
        let mut differences = Vec::new();
        for block in 0..5 {
            let kept: Vec<usize> = (0..80).filter(|row| row / 16 != block).collect();
            let refitted = misses(&identify_rows(&data, &effects, &kept).0, &data);
            let rows = 16 * block..16 * (block + 1);
            differences.extend(rows.map(|row| found[row] - refitted[row]));
        }
        let off = rms(differences) / (SIGMA * 3f64.sqrt());
        println!("folds against refits: {off:.1e} of the noise");
        assert!(off < 0.01, "outlier {outlier}: {off:.4} of the noise");
    }
}

#[test]
fn rows_of_one_pose_are_never_on_both_sides() {
    let (once, _) = recording(&fixture::offset_wrist(), &GEOMETRY, 60, 5);
    let twice = twice(&once);
    let (one, two) = (
        folds(&once, &GEOMETRY, 6).unwrap(),
        folds(&twice, &GEOMETRY, 6).unwrap(),
    );
    // A row whose twin was fitted would be predicted far better.
    for (one, two) in [(one.random, two.random), (one.blocks, two.blocks)] {
        let (one, two) = (rms(one), rms(two));
        assert!((two / one - 1.0).abs() < 0.05, "{two:e} and {one:e}");
    }
}

#[test]
fn too_few_poses_make_no_folds() {
    let (data, _) = recording(&fixture::offset_wrist(), &GEOMETRY, 9, 5);
    assert_eq!(folds(&data, &["base_frame"], 5), None);
    let (data, _) = recording(&fixture::offset_wrist(), &GEOMETRY, 11, 5);
    assert_eq!(folds(&data, &GEOMETRY, 5), None);
    assert!(folds(&data, &["base_frame"], 5).is_some());
}

#[test]
fn any_number_of_threads_gives_the_same_folds() {
    let (data, _) = recording(&fixture::offset_wrist(), &GEOMETRY, 60, 6);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| folds(&data, &GEOMETRY, 5))
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn statistics_have_the_folds_of_fitted_rows_and_of_no_others() {
    let (recorded, _) = experiment("none", 5);
    let stage: Identify = example("none").with("geometry");
    let found = recorded.identify_by(&stage).unwrap();
    let prediction: Prediction = found.get();
    assert!(
        prediction
            .0
            .iter()
            .all(|row| row.fold_error_mm.is_some() == (row.set == "unloaded_fit"))
    );
    let reads = ValidateReads {
        prediction: vec![labelled("geometry", prediction.clone())],
        observability: vec![labelled("geometry", found.get())],
    };
    let statistics: Statistics = made(&Validate::default(), reads).get();
    for row in &statistics.0 {
        assert_eq!(
            row.fold_rms_mm.is_some(),
            row.set == "unloaded_fit",
            "{}",
            row.set
        );
    }
    let row = statistics
        .0
        .iter()
        .find(|row| row.set == "unloaded_fit")
        .unwrap();
    let errors = prediction.0.iter().filter_map(|row| row.fold_error_mm);
    let found = row.fold_rms_mm.unwrap();
    assert!((found / rms(errors) - 1.0).abs() < 1e-12 && found > row.rms_mm);
    let expected = row.fold_expected_mm.unwrap() / row.noise_rms_mm;
    assert!((1.02..1.4).contains(&expected));
    let wrong = Identify {
        folds: FoldSetting::Parts(1),
        ..stage
    };
    let allowed =
        "folds: allowed: 0 for none, 2 to 100, or n to leave out one pose after the other";
    assert!(
        wrong
            .check()
            .iter()
            .any(|fault| fault.to_string() == allowed)
    );
}

#[test]
fn with_one_fold_a_pose_each_is_predicted_by_a_fit_to_all_others() {
    let (data, _) = recording(&fixture::offset_wrist(), &GEOMETRY, 40, 240);
    let one_out = |data: &Measurements| of_session(data, &GEOMETRY, leave_one_out);
    let found = one_out(&data).unwrap();
    assert_eq!((found.count, &found.random), (40, &found.blocks));
    for left in [0, 17, 39] {
        let kept: Vec<usize> = (0..40).filter(|row| *row != left).collect();
        let error = misses(&identify_rows(&data, &GEOMETRY, &kept).0, &data)[left];
        assert!(
            (found.random[left] - error).abs() < 0.02 * SIGMA,
            "{left}: {:e} for {error:e}",
            found.random[left]
        );
    }
    let twice = twice(&data);
    assert_eq!(
        one_out(&twice).unwrap().count,
        40,
        "a pose that is measured twice is one"
    );
    let (few, _) = recording(&fixture::offset_wrist(), &GEOMETRY, 8, 5);
    assert_eq!(one_out(&few), None);
}

#[test]
fn folds_are_a_number_or_n_and_a_cross_validation_that_is_dropped_is_told() {
    let (recorded, _) = experiment("none", 5);
    let yaml = |folds: &str| serde_json::from_str::<FoldSetting>(folds);
    assert_eq!(yaml("\"n\"").unwrap(), FoldSetting::EachPose);
    assert_eq!(yaml("5").unwrap(), FoldSetting::default());
    let wrong = yaml("\"all\"").expect_err("no setting").to_string();
    has(
        &wrong,
        "a number of folds (0 for none), or n for one a pose",
    );
    let run = |folds: FoldSetting| {
        let stage = Identify {
            folds,
            ..example("none").with("geometry")
        };
        let made = recorded.identify_by(&stage).unwrap();
        let warned = made.warnings.lines().filter(|line| line.contains("cross"));
        let warned: Vec<String> = warned.map(Into::into).collect();
        (made.quantity("folds"), made.quantity("unfolded"), warned)
    };
    let each = run(FoldSetting::EachPose);
    let poses = each.0.unwrap();
    assert_eq!((each.1, each.2.len()), (None, 0));
    let (folds, unfolded, warned) = run(FoldSetting::Parts(100));
    assert_eq!((folds, unfolded), (None, Some(poses)));
    starts_with(
        &warned[0],
        &format!("not cross-validated: {poses} poses in "),
    );
    has(&warned[0], "allowed: two poses for each of 100 folds");
    assert_eq!(run(FoldSetting::Parts(0)), (None, None, Vec::new()));
}

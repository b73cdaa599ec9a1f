//! Torques that are fed forward say how certain they are, and what is not certain is refused: a wrong number moves a robot.

use super::results::{Solved, arm, calib, column, motion, rms, rows_of, solve, solved};
use crate::answer::{Answer, has, read};
use crate::compensate::concealed::from_environment;
use calib::twin::torque::TorqueCase;
use std::path::Path;

fn fed(solved: &Solved, file: &Path, more: &str) -> Answer {
    let file = file.display().to_string();
    calib(
        &format!("compensate HEAD {file} --torque {more}"),
        &solved.path("store"),
    )
}

/// A fresh motion of the solved case as a file.
fn fresh(name: &str) -> std::path::PathBuf {
    let file = solved().path(name);
    let rows = solved().case.clone().on_other_paths(977, 40.0).true_rows();
    std::fs::write(&file, motion(&rows, 1, true)).unwrap();
    file
}

/// Cells of a column as text.
fn cells<'t>(text: &'t str, name: &str) -> Vec<&'t str> {
    let mut lines = text.lines();
    let place = lines
        .next()
        .unwrap()
        .split(',')
        .position(|column| column == name)
        .unwrap();
    lines
        .map(|line| line.splitn(place + 2, ',').nth(place).unwrap())
        .collect()
}

/// Share of rows of a fresh motion whose true torque lies within the uncertainty that is told, joint by joint.
fn covered(solved: &Solved, seed: u64) -> Vec<f64> {
    let fresh = solved.case.clone().on_other_paths(seed, 40.0);
    let (rows, n) = (fresh.true_rows(), fresh.robot.joints.len());
    let mut within = vec![(0usize, 0usize); n];
    for stretch in [1, 2] {
        let file = solved.path(&format!("fresh_{seed}_{stretch}.csv"));
        std::fs::write(&file, motion(&rows, stretch, true)).unwrap();
        let text = fed(solved, &file, "--quiet --force").ok();
        let ours = rows_of(&rows, stretch);
        for (joint, (inside, all)) in within.iter_mut().enumerate() {
            let found = column(&text, &format!("tau{}_nm", joint + 1));
            let u95 = column(&text, &format!("u95_{}_nm", joint + 1));
            let off = ours.iter().zip(&found);
            let off = off.map(|(row, found)| rows.torque[n * row + joint] - found);
            println!(
                "stretch {stretch}, joint {}: rms error {:.4} Nm, rms u95 {:.4} Nm",
                joint + 1,
                rms(off.clone()),
                rms(u95.iter().copied())
            );
            *all += ours.len();
            *inside += off
                .zip(&u95)
                .filter(|(off, u95)| off.abs() <= **u95)
                .count();
        }
    }
    within
        .into_iter()
        .map(|(inside, all)| inside as f64 / all as f64)
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_uncertainty_of_a_torque_covers_the_truth_of_fresh_motions() {
    let shares = covered(solved(), 977);
    println!("within u95, joint by joint: {shares:.2?}");
    // Joint 2 has Stribeck friction: the speed over which it falls has a variance, and still its torques are surer than they should be.
    let others = shares
        .iter()
        .enumerate()
        .all(|(joint, share)| joint == 1 || *share > 0.7);
    assert!(
        mean(&shares) > 0.9 && others && shares[1] > 0.55,
        "{shares:.2?}"
    );
}

/// `CALIB_RECORDINGS=12 cargo test --test it -- torques::feed_forward --nocapture` prints the figures of the README.
#[test]
fn the_uncertainty_of_torques_covers_the_truth_of_several_arms() {
    let cases: Vec<TorqueCase> =
        super::results::cases(from_environment("CALIB_RECORDINGS", 2) as usize);
    let mut all = Vec::new();
    for case in cases {
        let name = format!("{} {}", case.name, case.robot.name);
        let solved = solve(case);
        let shares = covered(&solved, 978);
        println!("{name}: {shares:.2?}");
        all.extend(shares);
    }
    println!("within u95 over all arms and joints: {:.3}", mean(&all));
    assert!(mean(&all) > 0.9);
}

#[test]
fn torques_less_certain_than_allowed_are_refused_and_written_only_with_force() {
    let file = fresh("doubtful.csv");
    let rows = read(&file).lines().count() - 1;
    let refused = fed(solved(), &file, "--max-uncertainty 1e-6").code(10);
    has(&refused.err, ["doubtful.csv:2: ", "no torques are written"]);
    let message = format!("{rows} of {rows} rows are less certain than allowed");
    has(&refused.err, &message);
    let text = refused.out;
    assert!(
        cells(&text, "tau2_nm").iter().all(|cell| cell.is_empty())
            && cells(&text, "i2_a").iter().all(|cell| cell.is_empty())
    );
    assert!(column(&text, "u95_2_nm").iter().all(|u95| *u95 > 0.0));
    has(&text, ["refused: joint ", "Nm allowed (--max-uncertainty)"]);
    let text = fed(solved(), &file, "--max-uncertainty 1e-6 --force").ok();
    assert!(
        column(&text, "tau2_nm")
            .iter()
            .all(|torque| torque.is_finite())
    );
    assert_eq!(
        text.matches("written because of --force: joint ").count(),
        rows
    );
    // By default a motion like the recorded one is written whole.
    fed(solved(), &file, "").code(0);
    let without = fed(solved(), &file, "--no-sigma --quiet").ok();
    assert!(!without.contains("u95_1_nm"));
}

#[test]
fn torques_that_were_fed_forward_already_are_no_motion() {
    let file = fresh("once.csv");
    let once = fed(solved(), &file, "--quiet").ok();
    let twice = solved().path("twice.csv");
    std::fs::write(&twice, &once).unwrap();
    let refused = fed(solved(), &twice, "").code(10);
    has(&refused.err, "carries the torques that calib wrote already");
    let again = fed(solved(), &twice, "--quiet --force").ok();
    assert_eq!(again, once);
}

#[test]
fn a_motion_beyond_the_recording_is_remarked_row_by_row_with_what_it_exceeds() {
    let slow = read(fresh("slow.csv"));
    // The same path in a third of the time.
    let path = |line: &str| {
        line.split(',')
            .skip(1)
            .take(6)
            .collect::<Vec<_>>()
            .join(",")
    };
    let fast: String = slow
        .lines()
        .map(|line| match line.split_once(',') {
            Some((time, _)) if time != "time_s" => {
                format!("{:.5},{}\n", time.parse::<f64>().unwrap() / 3.0, path(line))
            }
            _ => format!("time_s,{}\n", path(line)),
        })
        .collect();
    let file = solved().path("fast.csv");
    std::fs::write(&file, fast).unwrap();
    let output = fed(solved(), &file, "--force");
    has(&output.err, "beyond the motion that the model was seen in");
    let fast = output.ok();
    let remarks = [
        "faster than recorded",
        "accelerates more than recorded",
        "under more load than recorded",
    ];
    has(&fast, remarks);
    // Friction is less certain where nobody saw it.
    let slow = fed(solved(), &solved().path("slow.csv"), "--quiet").ok();
    let most = |text: &str| column(text, "u95_2_nm").into_iter().fold(0.0, f64::max);
    assert!(
        most(&fast) > 2.0 * most(&slow),
        "{} {}",
        most(&fast),
        most(&slow)
    );
}

#[test]
fn an_arm_whose_recording_says_its_temperature_is_remarked_where_it_is_colder() {
    let case = arm();
    let [robot, (name, text)] = case.recording();
    let warmer = |(row, line): (usize, &str)| match row {
        0 => format!("{line},temp_c\n"),
        _ => format!("{line},{:.2}\n", 25.0 + 0.001 * row as f64),
    };
    let text: String = text.lines().enumerate().map(warmer).collect();
    let solved = super::results::solve_files(case.clone(), &[robot, (name, text)]);
    let file = solved.path("motion.csv");
    std::fs::write(
        &file,
        motion(&case.on_other_paths(977, 40.0).true_rows(), 1, false),
    )
    .unwrap();
    let cold = fed(&solved, &file, "--temperature 5").ok();
    assert!(
        cold.contains("colder than recorded: 5.0 C, the recording begins at 25.0 C"),
        "{}",
        &cold[..2000]
    );
    let usual = fed(&solved, &file, "--temperature 26").ok();
    assert!(!usual.contains("than recorded: "), "{}", &usual[..2000]);
}

//! A motion proposed for a recording of torques: it holds its limits, and tells more than a random one.

use super::write;
use crate::answer::{calib, has, read};
use calib::dynamics::{
    DynamicArm, InverseDynamics, MotionRow, TorqueModel, TorqueQuestion, TorqueRecording, diagnose,
};
use calib::effect::Place;
use calib::excitation::{MotionProposal, MotionRequest, exciting_motion};
use calib::twin::torque::JointState;
use calib::twin::torque::TorqueCase;
use std::path::PathBuf;

fn request(robot: PathBuf, generations: usize) -> MotionRequest {
    MotionRequest {
        robot,
        urdf: None,
        seconds: 20.0,
        rate: 100.0,
        harmonics: 5,
        limits: Some(vec![
            [-120.0, 120.0],
            [-140.0, -30.0],
            [-100.0, 100.0],
            [-120.0, 120.0],
            [-120.0, 120.0],
            [-120.0, 120.0],
        ]),
        margin: 2.0,
        speed: vec![80.0],
        acceleration: vec![240.0],
        noise: vec![0.6, 1.5, 0.8, 0.2, 0.15, 0.1],
        generations,
        seed: 3,
        jobs: 2,
    }
}

#[test]
fn an_exciting_motion_holds_its_limits_and_tells_more_than_random_ones() {
    let folder = tempfile::tempdir().unwrap();
    let case = super::results::arm();
    write(folder.path(), &case.recording());
    let asked = request(folder.path().join("robot.json"), 60);
    let proposal = exciting_motion(&asked).unwrap();
    let motion = &proposal.motion;
    let n = 6;
    for row in 0..motion.time.len() {
        for joint in 0..n {
            let [least, most] = asked.limits.as_ref().unwrap()[joint].map(f64::to_radians);
            assert!(
                (least..=most).contains(&motion.position[n * row + joint]),
                "joint {} leaves its range",
                joint + 1
            );
            assert!(motion.velocity[n * row + joint].abs() <= 80f64.to_radians());
            assert!(motion.acceleration[n * row + joint].abs() <= 240f64.to_radians());
        }
    }
    println!("gain {:.3}, condition {:?}", motion.gain, motion.condition);
    assert!(
        motion.gain > 1.5,
        "sigmas of random motions are {} times those of this one",
        motion.gain
    );
    assert!(motion.parameters.len() > 40, "{}", motion.parameters.len());
    assert!(
        motion
            .unseen
            .iter()
            .any(|line| line.contains("torque constants"))
    );
    // The same seed on one thread gives the same motion.
    let again = exciting_motion(&MotionRequest { jobs: 1, ..asked }).unwrap();
    assert_eq!(motion.position, again.motion.position);
}

/// A case recorded on a proposed motion.
fn recorded(case: &TorqueCase, proposal: &MotionProposal) -> TorqueRecording {
    let (motion, n) = (&proposal.motion, case.robot.joints.len());
    let of_list = |list: &[f64], row: usize| list[n * row..n * (row + 1)].to_vec();
    let state = |row: usize| JointState {
        q: of_list(&motion.position, row),
        v: of_list(&motion.velocity, row),
        a: of_list(&motion.acceleration, row),
    };
    let case = case
        .clone()
        .on_motion(0.01, (0..motion.time.len()).map(state).collect());
    let rows = case.true_rows();
    TorqueRecording {
        joints: n,
        torque: case.noisy(&rows),
        position: rows
            .state
            .iter()
            .flat_map(|state| state.q.clone())
            .collect(),
        simulated: None,
        velocity: None,
        temperature: None,
        trajectory: rows
            .trajectory
            .iter()
            .map(|number| *number as u32)
            .collect(),
        held_out: rows.validate,
        time: rows.time,
        from_current: false,
    }
}

/// Standard deviation of the torque that a model of base parameters, viscous and Coulomb friction gives, mean over joints in parts of
/// their noise, over the rows of fresh motions.
fn predicted_sigma(model: &TorqueModel, arm: &DynamicArm, case: &TorqueCase) -> f64 {
    let (n, width) = (
        arm.joints(),
        (model.covariance.len() as f64).sqrt().round() as usize,
    );
    let numbers: Vec<usize> = (0..10 * n)
        .filter(|number| model.identified[*number])
        .collect();
    let mut dynamics = InverseDynamics::new(arm);
    let (mut sum, mut count) = (0.0, 0);
    for state in case
        .clone()
        .on_other_paths(404, 40.0)
        .true_rows()
        .state
        .iter()
        .step_by(25)
    {
        let mut by = vec![vec![0.0; width]; n];
        let motion = MotionRow {
            position: &state.q,
            velocity: &state.v,
            acceleration: &state.a,
        };
        dynamics.regressor(motion, &arm.gravity, |joint, link, ten| {
            for (place, number) in numbers
                .iter()
                .enumerate()
                .filter(|(_, number)| **number / 10 == link)
            {
                by[joint][place] = ten[number % 10];
            }
        });
        let mut place = numbers.len();
        for term in &model.terms {
            if let (Place::Joint(joint), 1) = (term.place, term.coefficients.len()) {
                by[joint][place] = match term.effect.as_str() {
                    "viscous_friction" => state.v[joint],
                    "coulomb_friction" => (state.v[joint] / model.sign_width).tanh(),
                    _ => 0.0,
                };
            }
            place += term.coefficients.len();
        }
        for (joint, by) in by.iter().enumerate() {
            let product = |row: usize| {
                by.iter()
                    .zip(&model.covariance[width * row..])
                    .map(|(a, b)| a * b)
                    .sum::<f64>()
            };
            let variance: f64 = (0..width).map(|row| by[row] * product(row)).sum();
            sum += variance.max(0.0).sqrt() / case.white_noise()[joint];
            count += 1;
        }
    }
    sum / f64::from(count)
}

#[test]
fn what_is_identified_from_an_exciting_motion_is_surer_than_from_random_ones() {
    let folder = tempfile::tempdir().unwrap();
    let case = super::results::arm();
    write(folder.path(), &case.recording());
    let (mut arm, _) = super::declared(&case);
    arm.links = None;
    let sigma = |asked: &MotionRequest| {
        let proposal = exciting_motion(asked).unwrap();
        let question = TorqueQuestion {
            free_inertials: true,
            ..TorqueQuestion::default()
        };
        let found = diagnose(&arm, &recorded(&case, &proposal), &question, &mut |_| ()).unwrap();
        predicted_sigma(&found.model, &arm, &case)
    };
    let asked = request(folder.path().join("robot.json"), 60);
    let exciting = sigma(&asked);
    // Without a generation the best of the forty random motions that the search begins with.
    let random: Vec<f64> = (11..13)
        .map(|seed| {
            sigma(&MotionRequest {
                seed,
                generations: 0,
                ..asked.clone()
            })
        })
        .collect();
    println!(
        "sigma of fresh torques over noise {exciting:.4}, by the best of forty random motions {random:?}"
    );
    assert!(
        random.iter().all(|random| 1.15 * exciting < *random),
        "{exciting}, by random motions {random:?}"
    );
}

#[test]
fn the_file_of_a_motion_is_one_that_compensate_takes() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &super::results::arm().recording());
    let (robot, file) = (
        folder.path().join("robot.json"),
        folder.path().join("motion.csv"),
    );
    let limits = "-90:90,-120:-40,-90:90,-90:90,-90:90,-90:90";
    let words = format!(
        "excite {} --seconds 8 --rate 50 --generations 2 --out {} --limits {limits}",
        robot.display(),
        file.display()
    );
    let printed = calib(".", &words).ok();
    has(&printed, ["condition number", "will not determine"]);
    let text = read(&file);
    let robot = calib::identified::robot_file(&robot, None).unwrap();
    let trajectory = calib::targets::Trajectory::read("motion.csv", &text, &robot, false).unwrap();
    assert_eq!(trajectory.motion.time.len(), 401);
    assert!(trajectory.motion.acceleration.is_some());
}

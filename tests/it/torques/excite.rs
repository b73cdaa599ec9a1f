//! A motion proposed for a recording of torques: it holds its limits, and tells more than a random one.

use super::write;
use calib::dynamics::{TorqueQuestion, TorqueRecording, diagnose};
use calib::excitation::{MotionRequest, exciting_motion};
use calib::twin::torque::rigid::JointState;
use std::path::PathBuf;
use std::process::Command;

fn request(robot: PathBuf, generations: usize) -> MotionRequest {
    MotionRequest {
        robot,
        urdf: None,
        seconds: 20.0,
        rate: 100.0,
        harmonics: 5,
        limits: Some(vec![[-120.0, 120.0], [-140.0, -30.0], [-100.0, 100.0], [-120.0, 120.0], [-120.0, 120.0], [-120.0, 120.0]]),
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
    let folder = tempfile::tempdir().expect("a folder");
    let case = super::results::arm();
    write(folder.path(), &case.recording());
    let asked = request(folder.path().join("robot.json"), 60);
    let proposal = exciting_motion(&asked).expect("a motion");
    let motion = &proposal.motion;
    let n = 6;
    for row in 0..motion.time.len() {
        for joint in 0..n {
            let [least, most] = asked.limits.as_ref().expect("limits")[joint].map(f64::to_radians);
            assert!((least..=most).contains(&motion.position[n * row + joint]), "joint {} leaves its range", joint + 1);
            assert!(motion.velocity[n * row + joint].abs() <= 80f64.to_radians());
            assert!(motion.acceleration[n * row + joint].abs() <= 240f64.to_radians());
        }
    }
    println!("gain {:.3}, condition {:?}", motion.gain, motion.condition);
    assert!(motion.gain > 1.2, "sigmas of random motions are {} times those of this one", motion.gain);
    assert!(motion.parameters.len() > 40, "{}", motion.parameters.len());
    assert!(motion.unseen.iter().any(|line| line.contains("torque constants")));
    // The same seed on one thread gives the same motion.
    let again = exciting_motion(&MotionRequest { jobs: 1, ..asked }).expect("a motion");
    assert_eq!(motion.position, again.motion.position);
}

#[test]
fn what_is_identified_from_an_exciting_motion_is_surer_than_from_a_random_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let case = super::results::arm();
    write(folder.path(), &case.recording());
    let sigma_of = |generations: usize| {
        let proposal = exciting_motion(&request(folder.path().join("robot.json"), generations)).expect("a motion");
        let (motion, n) = (&proposal.motion, 6);
        let of = |list: &[f64], row: usize| list[n * row..n * (row + 1)].to_vec();
        let states = (0..motion.time.len()).map(|row| JointState {
            q: of(&motion.position, row),
            v: of(&motion.velocity, row),
            a: of(&motion.acceleration, row),
        });
        let recorded = case.clone().on_motion(0.01, states.collect());
        let rows = recorded.true_rows();
        let torque = recorded.noisy(&rows);
        let recording = TorqueRecording {
            joints: n,
            time: rows.time.clone(),
            position: rows.state.iter().flat_map(|state| state.q.clone()).collect(),
            velocity: None,
            torque,
            temperature: None,
            trajectory: rows.trajectory.iter().map(|number| *number as u32).collect(),
            held_out: rows.validate.clone(),
            from_current: false,
        };
        let (mut arm, _) = super::declared(&recorded);
        arm.links = None;
        let question = TorqueQuestion { free_inertials: true, ..TorqueQuestion::default() };
        let found = diagnose(&arm, &recording, &question, &mut |_| ()).expect("a diagnosis");
        let friction = found.findings.iter().flat_map(|finding| &finding.parameters);
        let friction: Vec<f64> = friction
            .filter(|number| ["viscous", "coulomb"].contains(&number.name.as_str()))
            .filter_map(|number| number.sigma)
            .collect();
        let masses: Vec<f64> = found.inertials.iter().map(|number| number.sigma).collect();
        assert_eq!(friction.len(), 2 * n, "{:?}", found.findings.iter().map(|finding| &finding.statement).collect::<Vec<_>>());
        let mean = |all: &[f64]| (all.iter().map(|sigma| sigma.ln()).sum::<f64>() / all.len() as f64).exp();
        [mean(&friction), mean(&masses)]
    };
    let ([friction, masses], [random_friction, random_masses]) = (sigma_of(60), sigma_of(0));
    println!("sigma of friction {friction:.5}, random {random_friction:.5}; of masses {masses:.5}, random {random_masses:.5}");
    assert!(masses * 1.15 < random_masses, "masses {masses}, by a random motion {random_masses}");
}

#[test]
fn the_file_of_a_motion_is_one_that_compensate_takes() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &super::results::arm().recording());
    let (robot, file) = (folder.path().join("robot.json"), folder.path().join("motion.csv"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
    command.arg("excite").arg(&robot).args(["--seconds", "8", "--rate", "50", "--generations", "2", "--out"]).arg(&file);
    let output = command.args(["--limits", "-90:90,-120:-40,-90:90,-90:90,-90:90,-90:90"]).output().expect("calib");
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(told.contains("condition number") && told.contains("will not determine"), "{told}");
    let text = std::fs::read_to_string(&file).expect("a file");
    let robot = calib::identified::robot_file(&robot, None).expect("a robot");
    let trajectory = calib::targets::Trajectory::read("motion.csv", &text, &robot).expect("a motion");
    assert_eq!(trajectory.motion.time.len(), 401);
    assert!(trajectory.motion.acceleration.is_some());
}

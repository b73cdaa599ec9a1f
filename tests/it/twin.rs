//! The twin: its own kinematics and statics against numbers worked out by hand, its noise, its seeds, and the stage.

use crate::answer::{has, read, root};
use crate::desk::Desk;
use crate::fixture::robot_of;
use calib::description::{JointDescription, JointKind, RobotDescription};
use calib::error::Result;
use calib::stage::{Context, Remainder, Simulate, SimulateReads, SimulateWrites, Stage};
use calib::table::{Robot, Truth};
use calib::twin::arm::{Arm, Motion, Row};
use calib::twin::effect::{
    Backlash, BaseCompliance, GearCyclic, JointCompliance, LinkCompliance, Physical,
};
use calib::twin::recorder::{Equilibrium, settle};
use calib::twin::tracker::{Beam, Scatter, Tracker};
use calib::twin::truth::{CouplingError, LinkError, TrueRobot};
use std::f64::consts::{FRAC_PI_2, PI};

pub const ARCSEC: f64 = PI / 648_000.0;

pub fn sr210d() -> RobotDescription {
    let path = root("pipelines/sr210d/robot.yaml");
    let text = read(&path);
    robot_of(&text)
}

/// One joint with axis -y at the origin and 2 m of massless arm along x, 100 kg at its end: a weight turns it by -m g r cos q.
fn lever() -> RobotDescription {
    RobotDescription {
        name: "lever".into(),
        joints: vec![JointDescription {
            name: "J1".into(),
            kind: JointKind::Revolute,
            axis: [0.0, -1.0, 0.0],
            point: [0.0; 3],
            limits: Some([-1.0, 1.0]),
            reduction_ratio: Some(200.0),
            motor_constant: Some(0.5),
            mass: Some(0.0),
            centre: Some([0.0; 3]),
            coulomb: None,
        }],
        tool: [2.0, 0.0, 0.0],
        tool_rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        couplings: vec![],
        payload_mass: 100.0,
        payload_centre: [2.0, 0.0, 0.0],
        gravity: [0.0, 0.0, -10.0],
        inertias: Default::default(),
        tolerances: Default::default(),
    }
}

/// A row of an arm that stands, with what effects make of the rows before.
pub fn row(q: &[f64], payload_kg: f64, memory: Vec<f64>) -> Row {
    Row {
        command: q.to_vec(),
        drive: q.to_vec(),
        direction: vec![1.0; q.len()],
        time_s: 0.0,
        temperature_c: 20.0,
        payload_kg,
        velocity: Vec::new(),
        memory,
    }
}

fn settled(
    robot: &RobotDescription,
    effects: &[Physical],
    q: &[f64],
    payload_kg: f64,
) -> Equilibrium {
    let arm = Arm::new(robot, &TrueRobot::default());
    settle(&arm, &row(q, payload_kg, vec![]), effects)
}

fn tool_mm(robot: &RobotDescription, truth: &TrueRobot, q: &[f64]) -> [f64; 3] {
    let arm = Arm::new(robot, truth);
    arm.posture(&truth.drive(robot, q), &Motion::none(q.len()))
        .tool
        .map(|x| 1e3 * x)
}

pub fn assert_near(found: impl AsRef<[f64]>, expected: impl AsRef<[f64]>, within: f64) {
    let (found, expected) = (found.as_ref(), expected.as_ref());
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().zip(expected);
    let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart <= within, "{found:?} is {apart} from {expected:?}");
}

/// The point is (1542, 50, 1340) from joint 2, (260, 50, 30) from joint 5 and (50, 30) across axes 4 and 6; quarter turns by hand.
#[test]
fn quarter_turns_put_the_tool_where_paper_and_pencil_do() {
    let robot = sr210d();
    let turns: [(&[usize], [f64; 3]); 8] = [
        (&[], [1854.0, 50.0, 1340.0]),
        (&[1], [-50.0, 1854.0, 1340.0]),
        (&[2], [312.0 - 1340.0, 50.0, 1542.0]),
        (&[3], [312.0 - 265.0, 50.0, 1075.0 + 1542.0]),
        (&[4], [1854.0, -30.0, 1360.0]),
        (&[5], [1594.0 - 30.0, 50.0, 1310.0 + 260.0]),
        (&[6], [1854.0, -30.0, 1360.0]),
        (&[1, 2], [-50.0, 312.0 - 1340.0, 1542.0]),
    ];
    for (joints, tool) in turns {
        let mut q = [0.0; 6];
        joints.iter().for_each(|joint| q[joint - 1] = FRAC_PI_2);
        assert_near(tool_mm(&robot, &TrueRobot::default(), &q), tool, 1e-9);
    }
}

#[test]
fn errors_of_lengths_gears_and_couplings_move_the_tool_as_they_should() {
    let robot = sr210d();
    let longer = LinkError {
        link: 2,
        shift_mm: [0.0, 0.0, 0.5],
        tilt_arcsec: [0.0; 3],
    };
    let truth = TrueRobot {
        links: vec![longer],
        ..TrueRobot::default()
    };
    assert_near(
        tool_mm(&robot, &truth, &[0.0; 6]),
        [1854.0, 50.0, 1340.5],
        1e-9,
    );
    // The half millimetre lies on the upper arm, which joint 2 lays back along -x.
    assert_near(
        tool_mm(&robot, &truth, &[0.0, FRAC_PI_2, 0.0, 0.0, 0.0, 0.0]),
        [311.5 - 1340.0, 50.0, 1542.0],
        1e-9,
    );

    let tilted = LinkError {
        link: 1,
        shift_mm: [0.0; 3],
        tilt_arcsec: [0.0, 0.0, 10.0],
    };
    let truth = TrueRobot {
        links: vec![tilted],
        ..TrueRobot::default()
    };
    let a = 10.0 * ARCSEC;
    let expected = [
        312.0 + 1542.0 * a.cos() - 50.0 * a.sin(),
        50.0 * a.cos() + 1542.0 * a.sin(),
        1340.0,
    ];
    assert_near(tool_mm(&robot, &truth, &[0.0; 6]), expected, 1e-9);

    let truth = TrueRobot {
        ratio: vec![1.0, 1.0, 1.0, 1.0, 1.01, 1.02],
        couplings: vec![CouplingError {
            moved: 6,
            by: 5,
            error: 0.1,
        }],
        offset_deg: vec![0.0, 0.0, 0.0, 0.0, 0.0, 3.0],
        ..TrueRobot::default()
    };
    let drive = truth.drive(&robot, &[0.0, 0.0, 0.0, 0.0, 0.5, 0.2]);
    assert!((drive[4] - 0.505).abs() < 1e-15);
    assert!((drive[5] - (3.0 * PI / 180.0 + 1.02 * 0.2 + 0.1 * 1.01 * 0.5)).abs() < 1e-15);
}

#[test]
fn a_mass_on_a_compliant_joint_sags_until_torque_and_wind_up_agree() {
    let spring = JointCompliance::effect(1, 1e-5);
    let found = settled(&lever(), &[spring], &[0.0], 100.0);
    // 100 kg, 10 m/s2, 2 m: sag = 0.02 rad cos(sag); the first two terms of its series leave 2e-9.
    let mut sag: f64 = 0.0;
    for _ in 0..50 {
        sag = 0.02 * sag.cos();
    }
    assert!((sag - (0.02 - 0.02f64.powi(3) / 2.0)).abs() < 1e-8);
    assert_near(
        found.posture.tool,
        [2.0 * sag.cos(), 0.0, -2.0 * sag.sin()],
        1e-13,
    );
    assert!((found.torque[0] + 2000.0 * sag.cos()).abs() < 1e-9);
}

#[test]
fn a_beam_bends_by_the_cantilever_formula() {
    let beam = LinkCompliance::effect(1, 3e-7, 0.0);
    let found = settled(&lever(), &[beam], &[0.0], 100.0);
    // F L^3 / (3 EI) with L/EI = 3e-7: 1000 N * 4 m2 * 3e-7 / 3.
    assert_near(found.posture.tool, [2.0, 0.0, -4e-4], 1e-9);
}

#[test]
fn a_foundation_tilts_towards_the_load() {
    let base = BaseCompliance::effect([1e-8, 1e-8], [0.0, 0.0, -1000.0]);
    let found = settled(&lever(), &[base], &[0.0], 100.0);
    // 2000 Nm tilt by 2e-5 rad about 1 m below: the tool goes down by 2 m of it and forwards by 1 m of it.
    assert_near(found.posture.tool, [2.0 + 2e-5, 0.0, -4e-5], 1e-8);
}

#[test]
fn a_joint_trails_by_half_its_gap_and_more_under_load() {
    let turned = |arcsec_per_nm, closing_nm| {
        let gap = Backlash::effect(1, 20.0, arcsec_per_nm, closing_nm, 0.0);
        settled(&lever(), &[gap], &[0.0], 100.0).motion.joint[0] / ARCSEC
    };
    assert!((turned(0.0, 0.0) + 10.0).abs() < 1e-9);
    assert!((turned(0.01, 0.0) + 20.0).abs() < 1e-6);
    assert!((turned(0.0, 500.0) + 10.0).abs() < 1e-9);
}

#[test]
fn a_gear_ripple_follows_the_reported_angle() {
    let ripple = GearCyclic::effect(1, 3.0, 12.0, 0.0, 30.0);
    let found = settled(&lever(), &[ripple], &[PI / 9.0], 0.0);
    assert!(
        (found.motion.joint[0] - 12.0 * ARCSEC).abs() < 1e-15,
        "sin(3 * 20 deg + 30 deg) = 1"
    );
}

#[test]
fn tracker_noise_has_the_stated_size() {
    let tracker = Tracker {
        noise_um: 10.0,
        noise_um_per_m: 2.5,
        coverage: 2.0,
        ..Tracker::default()
    };
    let point = [0.0, 4.0, 3.0];
    // (10 + 2.5 * 5) / 2.
    assert!((tracker.sigma(point) - 11.25e-6).abs() < 1e-18);
    let mut beam = Beam::new(7);
    let draws: Vec<f64> = (0..20_000)
        .map(|_| tracker.measure(point, &mut beam)[1] - 4.0)
        .collect();
    let mean = draws.iter().sum::<f64>() / draws.len() as f64;
    let sigma = (draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / draws.len() as f64).sqrt();
    // Four standard errors of a mean and of a standard deviation of 20,000 draws.
    assert!(
        mean.abs() < 4.0 * 11.25e-6 / 20_000f64.sqrt(),
        "mean {mean}"
    );
    assert!(
        (sigma / 11.25e-6 - 1.0).abs() < 4.0 / 40_000f64.sqrt(),
        "sigma {sigma}"
    );
}

/// Errors (in standard deviations) of a tracker that looks along z 20,000 times.
fn errors_along_z(scatter: Scatter) -> Vec<[f64; 3]> {
    let tracker = Tracker {
        scatter,
        ..Tracker::default()
    };
    let point = [0.0, 0.0, 4.0];
    let (sigma, mut beam) = (tracker.sigma(point), Beam::new(11));
    let mut error = || {
        let seen = tracker.measure(point, &mut beam);
        std::array::from_fn(|axis| (seen[axis] - point[axis]) / sigma)
    };
    (0..20_000).map(|_| error()).collect()
}

fn mean_product(errors: &[[f64; 3]], value_of: impl Fn(&[f64; 3], &[f64; 3]) -> f64) -> f64 {
    errors
        .windows(2)
        .map(|pair| value_of(&pair[0], &pair[1]))
        .sum::<f64>()
        / (errors.len() - 1) as f64
}

#[test]
fn a_wandering_tracker_keeps_nine_tenths_of_its_error_from_point_to_point() {
    let errors = errors_along_z(Scatter::Wandering);
    // 20,000 draws with 0.9 count as 20,000 (1 - 0.81) / (1 + 0.81) = 2,100 for a variance: 3 % is one standard error.
    let variance = mean_product(&errors, |a, _| a[1] * a[1]);
    assert!((variance - 1.0).abs() < 0.12, "{variance}");
    let next = mean_product(&errors, |a, b| a[1] * b[1]) / variance;
    assert!((next - 0.9).abs() < 0.02, "{next}");
    assert!(mean_product(&errors, |a, _| a[0] * a[2]).abs() < 0.15);
}

#[test]
fn a_directional_tracker_errs_across_the_beam_more_than_along_it() {
    let errors = errors_along_z(Scatter::Directional);
    let sigma = [0, 1, 2].map(|axis| mean_product(&errors, |a, _| a[axis] * a[axis]).sqrt());
    assert!(
        (sigma[0] / sigma[2] - 2.5).abs() < 0.08 && (sigma[1] / sigma[2] - 2.5).abs() < 0.08,
        "{sigma:?}"
    );
    let square: f64 = sigma.iter().map(|sigma| sigma * sigma).sum();
    assert!(
        (square - 3.0).abs() < 0.1,
        "as much in all as the stated noise: {square}"
    );
}

fn simulate(settings: &Simulate, seed: u64) -> Result<SimulateWrites> {
    let robot = Robot::from_description(&sr210d());
    settings.clone().run(
        SimulateReads { robot },
        &Context {
            id: "simulate",
            seed,
            jobs: 1,
            services: &Desk::default(),
        },
    )
}

/// What a simulation writes.
fn made(settings: &Simulate, seed: u64) -> SimulateWrites {
    simulate(settings, seed).unwrap()
}

/// What a simulation that must not run says.
fn refused(settings: &Simulate) -> String {
    let error = simulate(settings, 1).err().expect("must not run");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

/// Where settings are wrong, whatever the robot.
fn places(settings: &Simulate) -> Vec<String> {
    let faults = settings.check().into_iter();
    faults.map(|fault| fault.place).collect()
}

fn stated(text: &str) -> Simulate {
    serde_saphyr::from_str(text).unwrap()
}

fn settings() -> Simulate {
    stated(
        "
truth: {ratio: [1, 1.0013, 1, 1, 1, 1], compliance_rad_a: [0, 1.89e-5, -2.49e-5, 0, 0, 0]}
effects:
  - gear_cyclic: {joint: 3, order: 17, amplitude_arcsec: 12, phase_deg: 30}
  - holding_friction: {joint: 2, torque_nm: 60}
motors: {sign: [1, -1, 1, 1, 1, 1]}
poses: {range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]], floor_mm: 300, clearance_mm: 1000}
blocks: [{usage: fit, points: 12}, {usage: check, points: 8, payload_kg: 210}]
",
    )
}

#[test]
fn more_points_than_fit_into_memory_are_refused_with_their_place() {
    let mut all = settings();
    all.blocks[1].points = 1 << 32;
    all.poses.candidates = 1 << 32;
    assert_eq!(places(&all), ["poses.candidates", "blocks[1].points"]);
}

#[test]
fn a_seed_gives_one_recording_and_another_seed_another() {
    let [first, again, other] = [5, 5, 6].map(|seed| made(&settings(), seed));
    assert_eq!(first.recording, again.recording);
    assert_eq!(first.truth, again.truth);
    assert_ne!(first.recording.q, other.recording.q);
}

#[test]
fn without_its_remainder_a_twin_is_its_parameters() {
    let without = Simulate {
        remainder: Remainder::None,
        ..settings()
    };
    let bare = Simulate {
        effects: vec![],
        ..settings()
    };
    let [all, without, bare] = [settings(), without, bare].map(|settings| made(&settings, 5));
    assert_eq!(without.recording, bare.recording);
    assert_eq!(
        all.recording.q, without.recording.q,
        "the plan does not depend on the effects"
    );
    assert_ne!(all.recording.position, without.recording.position);
    let acts = |table: &Truth, effect: &str| table.0.iter().any(|row| row.effect == effect);
    assert!(acts(&all.truth, "gear_cyclic") && acts(&all.truth, "holding_friction"));
    assert!(!acts(&without.truth, "gear_cyclic") && !acts(&without.truth, "holding_friction"));
    let mut rows = without.truth.0.iter();
    let ratio = rows.find(|row| row.name == "reduction_ratio.j2").unwrap();
    assert!((ratio.value - 0.0013).abs() < 1e-12);
}

#[test]
fn a_plan_keeps_to_limits_floor_and_blocks() {
    let settings = settings();
    let recording = made(&settings, 5).recording;
    assert_eq!(recording.rows(), 20);
    let robot = sr210d();
    for index in 0..recording.rows() {
        let q = recording.q(index);
        for (angle, range) in q.iter().zip(&settings.poses.range_deg) {
            assert!((range[0]..=range[1]).contains(&angle.to_degrees()));
        }
        let tool = tool_mm(&robot, &settings.truth, q);
        let far = tool[0].hypot(tool[1]);
        assert!(tool[2] >= 295.0 && far >= 995.0, "{tool:?}");
    }
    let payload = recording.payload.unwrap();
    assert_eq!((payload[11], payload[12]), (0.0, 210.0));
    assert_eq!(recording.usage[12].as_deref(), Some("check"));
    assert_eq!(recording.point_id[12], "check-0001");
    let time = recording.time.unwrap();
    assert!(time.windows(2).all(|pair| pair[1] > pair[0]));
}

/// Wind-up is the factor times the current (Eq. 28), and the current is the holding torque through gear and motor.
#[test]
fn currents_carry_the_load_in_the_controllers_sign() {
    let settings = Simulate {
        remainder: Remainder::None,
        ..settings()
    };
    let recording = made(&settings, 5).recording;
    let current = recording.current.clone().unwrap();
    let robot = sr210d();
    let arm = Arm::new(&robot, &settings.truth);
    let spring = |joint: usize, factor: f64| {
        let link = &arm.links[joint - 1];
        JointCompliance::effect(joint, factor / (link.gear * link.motor_constant))
    };
    for index in 0..recording.rows() {
        let q = recording.q(index);
        let payload = recording.payload.as_ref().unwrap()[index];
        let mut row = row(q, payload, vec![]);
        row.drive = settings.truth.drive(&robot, q);
        let found = settle(&arm, &row, &[spring(2, 1.89e-5), spring(3, 2.49e-5)]);
        for (joint, factor) in [(1, 1.89e-5), (2, -2.49e-5)] {
            let off = factor * current[index * 6 + joint] - found.motion.joint[joint];
            assert!(off.abs() < 1e-12, "row {index}");
        }
    }
}

#[test]
fn settings_that_a_robot_cannot_have_are_named_all_at_once() {
    let text = "
truth: {ratio: [1, 1], links: [{link: 9, shift_mm: [0, 0, 1]}], compliance_rad_a: [0, -1.89e-5, 0, 0, 0, 0]}
effects: [{backlash: {joint: 7, gap_arcsec: 10}}]
motors: {sign: [1, -1, 1, 1, 1, 1]}
blocks: [{usage: fit, points: 5}]
";
    let message = refused(&stated(text));
    for place in [
        "truth.ratio",
        "truth.links[0].link",
        "truth.compliance_rad_a[1]",
        "effects[0]",
    ] {
        has(&message, &*format!("simulate.with.{place}: "));
    }
}

#[test]
fn a_workspace_without_a_pose_is_refused_with_what_to_widen() {
    let mut settings = settings();
    settings.poses.floor_mm = 9000.0;
    has(&refused(&settings), "poses.floor_mm");
}

/// Given poses come first and as they are, each from the side that is asked for; the load is the pose's or the block's.
#[test]
fn given_poses_are_measured_from_the_side_that_is_asked_for() {
    let text = "
truth: {offset_deg: [0, 0, 0, 0, 0, 0]}
effects: [{backlash: {joint: 2, gap_arcsec: 20}}]
tracker: {noise_um: 0, noise_um_per_m: 0}
poses: {range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]], floor_mm: 300, clearance_mm: 1000}
climate: {begin_s: 7200}
blocks:
  - usage: fit
    payload_kg: 210
    points: 2
    given:
      - {joints_deg: [10, 0, 0, 0, 0, 0], direction: [-1, 1, 1, 0, 1, 1]}
      - {joints_deg: [10, 0, 0, 0, 0, 0], direction: [-1, -1, 1, 0, 1, 1], payload_kg: 0}
      - {joints_deg: [20, -10, 0, 0, 0, 5]}
";
    let settings = stated(text);
    assert!(places(&settings).is_empty());
    let recording = made(&settings, 3).recording;
    assert_eq!(recording.rows(), 5);
    let side = |row: usize| recording.direction.as_ref().unwrap()[6 * row..6 * row + 6].to_vec();
    assert_eq!(side(0), [-1.0, 1.0, 1.0, 0.0, 1.0, 1.0]);
    assert_eq!(side(1), [-1.0, -1.0, 1.0, 0.0, 1.0, 1.0]);
    // Straight from the pose before.
    assert_eq!(side(2), [1.0, -1.0, 0.0, 0.0, 0.0, 1.0]);
    let payload = recording.payload.as_ref().unwrap();
    assert_eq!(payload[..4], [210.0, 0.0, 210.0, 210.0]);
    assert!((recording.q(0)[0] - 10f64.to_radians()).abs() < 1e-15);
    assert_eq!(recording.point_id[2], "fit-0003");
    let mut time = recording.time.as_ref().unwrap().iter();
    assert!(time.all(|time| *time > 7200.0));
    // Joint 2 trails by 10 arcsec on either side; the tool is 1542 mm before its axis and 1340 mm above it.
    let [up, down] = [0, 1].map(|row| recording.position[row]);
    let square = |axis: usize| (up[axis] - down[axis]).powi(2);
    let moved = (square(0) + square(1) + square(2)).sqrt();
    let expected = 20.0 * ARCSEC * 1.542f64.hypot(1.340);
    assert!(
        (moved / expected - 1.0).abs() < 1e-6,
        "{moved} m instead of {expected} m"
    );
}

#[test]
fn given_poses_that_cannot_be_are_named_all_at_once() {
    let text = "
climate: {begin_s: -1}
motion: {rate_hz: 100}
blocks:
  - {usage: fit, points: 5}
  - usage: more
    given:
      - {joints_deg: []}
      - {joints_deg: [0, 0, 0, 0, 0, 0], direction: [2, 0, 0, 0, 0, 0], payload_kg: -1}
";
    let at = |pose: usize, what: &str| format!("blocks[1].given[{pose}].{what}");
    let expected = [
        at(0, "joints_deg"),
        at(1, "direction"),
        at(1, "payload_kg"),
        "blocks[1].given".into(),
        "climate.begin_s".into(),
    ];
    assert_eq!(places(&stated(text)), expected);
    let text = "blocks: [{usage: fit, given: [{joints_deg: [0, 500, 0, 0, 0, 0], direction: [1]}, {joints_deg: [0, 0]}]}]";
    let message = refused(&stated(text));
    for part in [
        "given[0].direction: has 1 numbers, the robot 6 joints",
        "given[0].joints_deg: joint 2 is at 500 deg; allowed: ",
        "given[1].joints_deg: has 2 numbers, the robot 6 joints",
    ] {
        has(&message, &*format!("simulate.with.blocks[0].{part}"));
    }
}

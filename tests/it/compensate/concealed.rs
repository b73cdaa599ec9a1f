//! Commands after concealed recordings: where the simulated arm really goes with them, inside and outside of what was measured.
//!
//! `CALIB_RECORDINGS=100 cargo test --release --test it -- compensate::concealed --nocapture` prints the whole table.

use super::true_error::exact;
use crate::fixture::{self, all_rows};
use crate::recorded::{Recorded, recording_of};
use calib::compensate::{
    CommandTarget, CorrectedCommand, CorrectionOptions, Corrector, IdentifiedArm, Scatter,
    Uncertainty,
};
use calib::description::RobotDescription;
use calib::effect::Load;
use calib::estimate::Model;
use calib::robot::{JointConvention, RobotModel, Visited};
use calib::table::{CovarianceTable, Parameters, Prediction, Recording, Robot};
use calib::twin::arm::Arm;
use calib::twin::conceal::case::Case;
use calib::twin::conceal::design::{Content, Design};
use calib::twin::conceal::family::Column;
use calib::twin::conceal::points::Layout;
use calib::twin::conceal::points::{Amount, FIT, plan};
use calib::twin::conceal::robots::Kind;
use calib::twin::effect::{GearCyclic, JointCompliance, Physical};
use calib::twin::noise::{Noise, Purpose};
use calib::twin::plan::{Point, Poses, allowed};
use calib::twin::recorder::{Experiment, Shot};
use calib::twin::tracker::Tracker;
use nalgebra::Vector3;
use serde_json::json;

/// Causes of the arm: those of the measurement move no robot.
const OF_THE_ARM: [&str; 13] = [
    "joint_compliance",
    "joint_hardening",
    "link_compliance",
    "base_compliance",
    "backlash",
    "gear_cyclic",
    "gear_motor_cyclic",
    "gear_load",
    "thermal_growth",
    "joint_warming",
    "zero_shift",
    "axis_wobble",
    "counterbalance",
];

/// Targets of a recording; every third is outside of what was measured.
const TARGETS: usize = 500;

/// A target and what came of it.
pub struct Outcome {
    pub outside: bool,
    /// mm; with all findings, and with geometry alone.
    pub miss: f64,
    pub plain: f64,
    u95: f64,
    pub remarked: bool,
    pub refused: bool,
}

/// What the tool says of a target, and where the arm goes then; what it names.
fn outcomes(case: &Case) -> (Vec<Outcome>, String) {
    outcomes_at(case, targets(case))
}

/// The same of these targets, each with whether it is outside of what was measured.
pub fn outcomes_at(
    case: &Case,
    (targets, outside): (Vec<Point>, Vec<bool>),
) -> (Vec<Outcome>, String) {
    let mut recording = recorded(case);
    let mut robot = case.robot.clone();
    if case.bare {
        robot
            .joints
            .iter_mut()
            .for_each(|joint| (joint.mass, joint.centre) = (None, None));
    }
    recording.robot = Robot::from_description(&robot);
    let geometry = recording.identify(json!({"effects": GEOMETRY}));
    let plain = IdentifiedArm::new(model(&robot, &geometry.get()), None);

    let made = recording.diagnose(json!({}));
    let model = model(&robot, &made.get());
    let covariance = made.get::<CovarianceTable>().of_model(&model);
    let verdict = made.verdict();
    if from_environment("CALIB_DETAILS", 0) == 1 {
        for row in &made.get::<Parameters>().0 {
            println!(
                "  {} {} = {:.4} +- {:?} {} {}",
                row.name, row.place, row.change, row.sigma, row.unit, row.status
            );
        }
        println!("  {:?}", verdict.statement);
    }
    let unexplained = made.get::<Prediction>().unexplained_mm() * 1e-3;
    let named = made.named();
    let named: Vec<String> = named
        .iter()
        .map(|(effect, place)| format!("{effect} at {place}"))
        .collect();
    let scatter = Scatter {
        unexplained,
        repeatability: verdict.repeatability_rad,
    };
    let arm = IdentifiedArm::new(model, None);
    let data = recording.recording.measurements();

    let options = || CorrectionOptions {
        clock: data.has_clock(),
        ..CorrectionOptions::counted_by(JointConvention::of_the_robot_file(robot.joints.len()))
    };
    let uncertainty = covariance
        .map(|covariance| Uncertainty::new(&arm, covariance, scatter).with_recording(&arm, &data));
    let mut corrector = Corrector::new(
        &arm,
        Some(Visited::of(&data, &all_rows(&data))),
        uncertainty,
        options(),
    );
    let commands = corrector.batch(targets.iter().map(|target| command(case, target)).collect());
    let geometry = Corrector::new(&plain, None, None, options())
        .batch(targets.iter().map(|t| command(case, t)).collect());
    let corrected = misses(case, &arm, &targets, &commands);
    let without = misses(case, &plain, &targets, &geometry);
    let outcome = |k: usize| Outcome {
        outside: outside[k],
        miss: corrected[k].unwrap_or(f64::NAN),
        plain: without[k].unwrap_or(f64::NAN),
        u95: commands[k]
            .uncertainty
            .map_or(f64::NAN, |uncertainty| uncertainty.u95 * 1e3),
        remarked: !commands[k].remarks.is_empty(),
        refused: commands[k].q.is_none(),
    };
    ((0..targets.len()).map(outcome).collect(), named.join(", "))
}

const GEOMETRY: [&str; 6] = [
    "base_frame",
    "tool_offset",
    "joint_offset",
    "link_geometry",
    "reduction_ratio",
    "coupling_ratio",
];

pub fn model(robot: &RobotDescription, parameters: &Parameters) -> Model {
    parameters
        .model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)
        .unwrap()
}

/// A recording of which the rows of its design's fit are fitted.
pub fn recorded(case: &Case) -> Recorded {
    let robot = Robot::from_description(&case.robot);
    let set = |row: usize| match case.shots[row].block == FIT {
        true => "fit",
        false => "validate",
    };
    Recorded::dealt(robot, recording(case), set)
}

fn recording(case: &Case) -> Recording {
    let shown = |column: Column| !case.hidden.contains(&column);
    let all = recording_of(&case.robot, &case.shots);
    let currents = || {
        case.shots
            .iter()
            .flat_map(|shot| shot.current.iter().copied())
    };
    Recording {
        position_sigma: Some(case.shots.iter().map(|shot| [shot.sigma; 3]).collect()),
        time: all.time.filter(|_| shown(Column::Time)),
        payload: Some(case.payload_kg.clone()),
        temperature: shown(Column::Temperature).then(|| case.thermometer_c.clone()),
        current: shown(Column::Current).then(|| currents().collect()),
        direction: all.direction.filter(|_| shown(Column::Direction)),
        ..all
    }
}

/// Two thirds in the joints' recorded ranges, loads and times, then one third over all that the joints can do, with other loads, later.
pub fn targets(case: &Case) -> (Vec<Point>, Vec<bool>) {
    let fitted: Vec<_> = case.shots.iter().filter(|shot| shot.block == FIT).collect();
    let joints = case.robot.joints.len();
    let recorded: Vec<[f64; 2]> = (0..joints)
        .map(|joint| {
            let all = fitted.iter().map(|shot| shot.q[joint].to_degrees());
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
                [low.min(q), high.max(q)]
            })
        })
        .collect();
    let whole: Vec<[f64; 2]> = case
        .robot
        .joints
        .iter()
        .map(|joint| joint.limits.unwrap().map(f64::to_degrees))
        .collect();
    let amount = |fit| Amount {
        fit,
        validate: 0,
        repeated: 0.0,
        near: 0.0,
        loaded: !case.bare,
        layout: Layout::default(),
    };
    let far = TARGETS / 3;
    let planned = |ranges: &[[f64; 2]], count, salt: u64| {
        let (amount, seed) = (amount(count), case.seed ^ salt);
        plan(case.kind, ranges, amount, &case.climate, seed).unwrap()
    };
    let mut inside = planned(&recorded, TARGETS - far, 0xA5);
    let mut outside = planned(&whole, far, 0x5A);
    for (k, target) in inside.iter_mut().enumerate() {
        let shot = fitted[k * 7 % fitted.len()];
        (target.time_s, target.temperature_c) = (shot.time_s, shot.temperature_c);
    }
    let last = case.shots.last().map_or(0.0, |shot| shot.time_s);
    for (k, target) in outside.iter_mut().enumerate() {
        target.time_s = last * (1.0 + k as f64 / far as f64);
        target.temperature_c = case.climate.temperature(target.time_s);
        target.payload_kg *= 1.3;
    }
    let is_outside = inside
        .iter()
        .map(|_| false)
        .chain(outside.iter().map(|_| true))
        .collect();
    inside.append(&mut outside);
    (inside, is_outside)
}

fn command(case: &Case, target: &Point) -> CommandTarget {
    let shown = |column: Column| !case.hidden.contains(&column);
    CommandTarget {
        q: Some(target.q.clone()),
        payload: Some(target.payload_kg),
        temperature: shown(Column::Temperature).then_some(target.temperature_c),
        time: shown(Column::Time).then_some(target.time_s),
        direction: Some(target.direction.clone()),
        ..CommandTarget::default()
    }
}

/// By how much (mm) the true arm misses each target, in the base that was identified; none where there is no command.
fn misses(
    case: &Case,
    arm: &IdentifiedArm,
    targets: &[Point],
    commands: &[CorrectedCommand],
) -> Vec<Option<f64>> {
    let concealed = case.concealed.iter();
    let concealed = concealed.flat_map(|one| one.cause.physical.clone());
    let effects: Vec<Physical> = concealed.chain(case.friction.iter().cloned()).collect();
    let driven = targets.iter().zip(commands).map(|(target, command)| Point {
        q: command.q.clone().unwrap_or_else(|| target.q.clone()),
        ..target.clone()
    });
    let shots = measured(case, &effects, &exact(&case.tracker), driven.collect(), 1);
    let robot = RobotModel::new(case.robot.clone());
    let each = shots.iter().zip(targets).zip(commands);
    each.map(|((shot, target), command)| {
        command.q.as_ref()?;
        let wanted = arm.base().point(&robot.forward(&target.q).translation);
        Some((Vector3::from(shot.position) - wanted).norm() * 1e3)
    })
    .collect()
}

/// What a tracker says of the arm of a case at these points, with the effects that are given.
fn measured(
    case: &Case,
    effects: &[Physical],
    tracker: &Tracker,
    points: Vec<Point>,
    seed: u64,
) -> Vec<Shot> {
    let experiment = Experiment {
        robot: &case.robot,
        truth: &case.truth,
        effects,
        tracker,
        motors: &case.motors,
        repeatability_arcsec: &[],
        poses: &Poses::default(),
        blocks: &[],
        climate: &case.climate,
        seed,
    };
    experiment.measure(points, || ())
}

pub fn from_environment(name: &str, usual: u64) -> u64 {
    std::env::var(name)
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(usual)
}

/// Whether a target is missed by more than with geometry alone, and by more than the instrument scatters, without a word.
pub fn is_harmed(one: &Outcome, floor: f64) -> bool {
    one.miss > (1.5 * one.plain).max(2.0 * floor) && !one.remarked
}

/// A line of the table.
fn print(case: &Case, floor: f64, outcomes: &[Outcome], named: &str) {
    let want: Vec<String> = case
        .want()
        .iter()
        .map(|(effect, place)| format!("{effect} at {place}"))
        .collect();
    let rms = |outside: bool, value_of: fn(&Outcome) -> f64| {
        let some = outcomes.iter();
        let some = some.filter(|one| one.outside == outside && !one.refused);
        fixture::rms(some.map(value_of))
    };
    let count = |is: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|one| is(one)).count();
    println!(
        "{} {:8} wanted [{}], named [{named}]: inside {:.3} (geometry {:.3}), outside {:.3} ({:.3}) mm rms, floor {floor:.3}; harmed {}, remarked {} + {}, refused {}",
        case.name,
        case.kind.name(),
        want.join(", "),
        rms(false, |one| one.miss),
        rms(false, |one| one.plain),
        rms(true, |one| one.miss),
        rms(true, |one| one.plain),
        count(&|one| is_harmed(one, floor)),
        count(&|one| one.remarked && !one.outside),
        count(&|one| one.remarked && one.outside),
        count(&|one| one.refused)
    );
}

#[test]
fn a_correction_never_harms_unless_it_says_so() {
    let (count, seed) = (
        from_environment("CALIB_RECORDINGS", 3) as usize,
        from_environment("CALIB_SEED", 29),
    );
    let design = Design {
        seed,
        cases: count,
        families: OF_THE_ARM.map(String::from).to_vec(),
        pairs: 0.3,
        nulls: 0.1,
        bare: from_environment("CALIB_BARE", 0) == 1,
        ..Design::default()
    };
    let mut all = Vec::new();
    for (number, content) in design.contents().into_iter().enumerate() {
        let case = Case::make(&design, number, content).unwrap();
        let floor = case.noise_mm[0] * 3f64.sqrt();
        let (outcomes, named) = outcomes(&case);
        print(&case, floor, &outcomes, &named);
        all.extend(outcomes.into_iter().map(|one| (floor, one)));
    }
    for outside in [false, true] {
        let these: Vec<&(f64, Outcome)> = all
            .iter()
            .filter(|(_, one)| one.outside == outside && !one.refused)
            .collect();
        let share = |is: &dyn Fn(f64, &Outcome) -> bool| {
            100.0 * these.iter().filter(|(floor, one)| is(*floor, one)).count() as f64
                / these.len() as f64
        };
        println!(
            "{}: {} targets, within u95 {:.1} %, remarked {:.1} %, harmed without a remark {:.2} %, by noise and 1.5 x {:.2} %",
            if outside { "outside" } else { "inside" },
            these.len(),
            share(&|_, one| one.miss <= one.u95),
            share(&|_, one| one.remarked),
            share(&|_, one| one.miss > 1.5 * one.plain && !one.remarked),
            share(&|floor, one| is_harmed(one, floor)),
        );
        let harmed = share(&|floor, one| is_harmed(one, floor));
        assert!(harmed <= 0.2, "{harmed} % of {} targets", these.len());
    }
}

/// Rows that keep the tool upright, up or down: the arm's moment across the sum of three angles loads no row. The robot file gives no
/// masses, gears wave at all joints.
pub fn upright(seed: u64) -> Case {
    let case = nothing(seed, true);
    let mut draw = Noise::new(seed, Purpose::Design);
    let (limits, room) = (limits(&case), Room::of(&case));
    let mut ours = Noise::new(seed ^ 7, Purpose::Design);
    let q_of = |_: &Shot| loop {
        let mut q = room.pose(&limits, &mut ours);
        let turned = if ours.chance(0.5) { 90.0f64 } else { -90.0 };
        q[3] = turned.to_radians() - q[1] - q[2];
        q[3] -= std::f64::consts::TAU * (q[3] / std::f64::consts::TAU).round();
        q[4] = if ours.chance(0.5) { 90.0f64 } else { -90.0 }.to_radians();
        if (limits[3][0]..=limits[3][1]).contains(&q[3]) {
            return q;
        }
    };
    let yields = [(2, 6e-6), (3, 8e-6), (4, 1e-5)].map(|(joint, rad_per_nm)| {
        Physical::JointCompliance(JointCompliance { joint, rad_per_nm })
    });
    let gears = (1..=5).map(|joint| {
        Physical::GearCyclic(GearCyclic {
            joint,
            order: draw.uniform(1.5, 4.0).round(),
            amplitude_arcsec: draw.uniform(50.0, 100.0),
            arcsec_per_nm: 0.0,
            phase_deg: draw.uniform(0.0, 360.0),
        })
    });
    let effects = yields.into_iter().chain(gears).collect();
    again(case, effects, seed, q_of)
}

/// Of the joints, rad.
pub fn limits(case: &Case) -> Vec<[f64; 2]> {
    let joints = case.robot.joints.iter();
    joints.map(|joint| joint.limits.unwrap()).collect()
}

/// Where an arm may be.
pub struct Room(Arm, Poses);

impl Room {
    pub fn of(case: &Case) -> Self {
        let poses = Poses {
            range_deg: Vec::new(),
            floor_mm: 20.0,
            clearance_mm: 150.0,
            candidates: 1,
        };
        Self(Arm::new(&case.robot, &case.truth), poses)
    }

    pub fn pose(&self, ranges: &[[f64; 2]], draw: &mut Noise) -> Vec<f64> {
        allowed(&self.0, &self.1, ranges, draw).unwrap().0
    }
}

/// A desktop arm with nothing concealed, unless without masses.
pub fn nothing(seed: u64, bare: bool) -> Case {
    let design = Design {
        seed,
        cases: 1,
        robots: vec![Kind::Compact6],
        nulls: 1.0,
        bare,
        faulty: 0.0,
        ..Design::default()
    };
    // Without currents, which no target states.
    Case {
        hidden: [Column::Current].into(),
        tampered: Vec::new(),
        ..Case::make(&design, 0, Content::Null).unwrap()
    }
}

/// The case measured again with these effects, at the poses that `q_of` gives its rows; nothing is carried.
pub fn again(
    mut case: Case,
    effects: Vec<Physical>,
    seed: u64,
    mut q_of: impl FnMut(&Shot) -> Vec<f64>,
) -> Case {
    let mut before = vec![0.0; 6];
    let mut planned = Vec::new();
    for shot in std::mem::take(&mut case.shots) {
        let q = q_of(&shot);
        let direction = calib::twin::plan::direction(&q, &before);
        let Shot {
            block,
            time_s,
            temperature_c,
            ..
        } = shot;
        planned.push(Point {
            block,
            q: q.clone(),
            before,
            direction,
            time_s,
            temperature_c,
            payload_kg: 0.0,
        });
        before = q;
    }
    let shots = measured(&case, &effects, &case.tracker, planned, seed);
    Case {
        friction: effects,
        payload_kg: vec![0.0; shots.len()],
        shots,
        ..case
    }
}

#[test]
fn what_no_row_shows_moves_no_robot() {
    for seed in 0..from_environment("CALIB_RECORDINGS", 3) {
        let case = upright(500 + seed);
        let floor = case.noise_mm[0] * 3f64.sqrt();
        let (outcomes, named) = outcomes(&case);
        print(&case, floor, &outcomes, &named);
        let kept = || outcomes.iter().filter(|one| !one.refused);
        let square = |value_of: fn(&Outcome) -> f64| {
            kept().map(value_of).map(|miss| miss * miss).sum::<f64>()
        };
        assert!(
            square(|one| one.miss) < 0.25 * square(|one| one.plain),
            "seed {}: {named}",
            500 + seed
        );
        assert!(
            outcomes.iter().filter(|one| is_harmed(one, floor)).count() * 1000 <= outcomes.len(),
            "seed {}",
            500 + seed
        );
        // Home, and all links in line upwards: the tool is level there, as in no row.
        let away = [[0.0; 6], [0.0, 0.0, -90.0, 0.0, 0.0, 0.0]]
            .map(|q: [f64; 6]| q.map(f64::to_radians).to_vec());
        let point = |q: Vec<f64>| Point {
            block: FIT,
            before: q.clone(),
            direction: vec![0.0; 6],
            time_s: case.shots[0].time_s,
            temperature_c: case.shots[0].temperature_c,
            payload_kg: 0.0,
            q,
        };
        let (away, _) = outcomes_at(&case, (away.map(point).to_vec(), vec![true; 2]));
        for one in &away {
            assert!(one.refused || !is_harmed(one, floor), "seed {}", 500 + seed);
        }
    }
}

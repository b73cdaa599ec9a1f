//! The true robot, a twin that shares no kinematics with the model, goes where it was wanted: every kind of effect that acts.

use super::concealed::model;
use crate::fixture::rms;
use crate::recorded::{Recorded, made, recording_of, settings};
use calib::compensate::{
    Circumstance, IdentifiedArm as Identified, Nominal, Reach, SETTLED, ToolGoal, least_change,
    one_step,
};
use calib::description::RobotDescription;
use calib::estimate::Model;
use calib::estimate::network::Correction;
use calib::robot::{RobotModel, RowTime};
use calib::stage::{Learn, LearnReads};
use calib::table::{Findings, Network, Parameters, Prediction, Robot};
use calib::twin::arm::Arm;
use calib::twin::conceal::robots::Kind;
use calib::twin::effect::Physical;
use calib::twin::plan::{Block, Climate, Point, Poses, plan};
use calib::twin::recorder::{Experiment, Motors, Shot};
use calib::twin::tracker::Tracker;
use calib::twin::truth::{LinkError, TrueRobot};
use nalgebra::Vector3;
use serde_json::json;

pub struct Cell {
    pub robot: RobotDescription,
    truth: TrueRobot,
    effects: Vec<Physical>,
    tracker: Tracker,
    poses: Poses,
    climate: Climate,
}

impl Cell {
    pub fn new(kind: Kind, effects: Vec<Physical>) -> Self {
        Self::of(
            kind.description([60.0, -45.0, 35.0]),
            kind.reach_m(),
            kind.room_mm(),
            effects,
        )
    }

    /// A cell of a robot of this reach, with room around it.
    pub fn of(
        robot: RobotDescription,
        reach_m: f64,
        room_mm: [f64; 2],
        effects: Vec<Physical>,
    ) -> Self {
        let n = robot.joints.len();
        let scale = reach_m;
        let link = |link: usize| LinkError {
            link,
            shift_mm: [0.4 * scale, -0.3 * scale, 0.2 * scale],
            tilt_arcsec: [60.0, -40.0, 30.0],
        };
        let [floor_mm, clearance_mm] = room_mm;
        let truth = TrueRobot {
            links: (1..n).map(link).collect(),
            offset_deg: (0..n).map(|j| 0.03 - 0.01 * j as f64).collect(),
            ratio: (0..n).map(|j| 1.0 + 1e-4 * (j as f64 - 2.0)).collect(),
            ..TrueRobot::default()
        };
        let poses = Poses {
            floor_mm,
            clearance_mm,
            candidates: 3,
            ..Poses::default()
        };
        let tracker = Tracker {
            position_mm: [3000.0 * scale / 2.0, -1500.0, 900.0],
            ..Tracker::default()
        };
        Self {
            robot,
            truth,
            effects,
            tracker,
            poses,
            climate: Climate::default(),
        }
    }

    pub fn points(&self, count: usize, payload_kg: &[f64], seed: u64) -> Vec<Point> {
        let blocks: Vec<Block> = payload_kg
            .iter()
            .map(|kg| Block {
                usage: "fit".into(),
                points: count / payload_kg.len(),
                payload_kg: *kg,
                given: vec![],
            })
            .collect();
        let arm = Arm::new(&self.robot, &self.truth);
        plan(&self.robot, &arm, &self.poses, &blocks, &self.climate, seed).unwrap()
    }

    fn measure(&self, points: Vec<Point>, tracker: &Tracker, seed: u64) -> Vec<Shot> {
        let motors = Motors::default();
        let experiment = Experiment {
            robot: &self.robot,
            truth: &self.truth,
            effects: &self.effects,
            tracker,
            motors: &motors,
            repeatability_arcsec: &[],
            poses: &self.poses,
            blocks: &[],
            climate: &self.climate,
            seed,
        };
        experiment.measure(points, || {})
    }

    /// A recording of `count` points, of which three quarters are fitted.
    fn recorded(&self, count: usize, payload_kg: &[f64]) -> Recorded {
        self.recorded_by(self.points(count, payload_kg, 5), 77)
    }

    /// A recording of these points with the noise of a seed.
    pub fn recorded_by(&self, points: Vec<Point>, seed: u64) -> Recorded {
        let shots = self.measure(points, &self.tracker, seed);
        let recording = recording_of(&self.robot, &shots);
        let robot = Robot::from_description(&self.robot);
        let set = |k: usize| if k % 4 == 3 { "validate" } else { "fit" };
        Recorded::dealt(robot, recording, set)
    }

    /// The model of a recording of 80 points, with the geometry alone.
    pub fn identified(&self) -> Model {
        self.rigid(&self.recorded(80, &[0.0])).0
    }

    /// With the geometry alone: the model, its table, its prediction.
    fn rigid(&self, recorded: &Recorded) -> (Model, Parameters, Prediction) {
        let geometry = json!({
            "effects": ["base_frame", "tool_offset", "joint_offset", "link_geometry", "reduction_ratio"], "folds": 0,
        });
        let made = recorded.identify(geometry);
        let parameters = made.get();
        (model(&self.robot, &parameters), parameters, made.get())
    }

    /// What `diagnose` makes of it: the model, its findings, the noise of a measured point, mm.
    fn diagnosed(&self, recorded: Recorded) -> (Model, Findings, f64) {
        let made = recorded.diagnose(json!({}));
        let floor = made.verdict().noise_floor_mm.unwrap();
        (model(&self.robot, &made.get()), made.get(), floor)
    }

    /// The rigid model, and what is learned on top of it.
    fn learned(&self, recorded: Recorded) -> (Model, Option<Correction>) {
        let (model, _, prediction) = self.rigid(&recorded);
        let learn = json!({"rivals": ["ridge", "gaussian_process"]});
        let learn: Learn = settings(learn);
        let prismatic = recorded.recording.prismatic.clone();
        let reads = LearnReads {
            recording: recorded.recording,
            split: recorded.split,
            prediction,
        };
        let network: Network = made(&learn, reads).get();
        (model, network.correction(&prismatic).unwrap())
    }

    /// Where (m) the true robot puts its tool in its own base, without the noise of measurement; `base` as it was identified or set up.
    pub fn places(&self, points: Vec<Point>) -> Vec<Vector3<f64>> {
        self.measure(points, &exact(&self.tracker), 77)
            .iter()
            .map(|shot| Vector3::from(shot.position))
            .collect()
    }

    /// Unseen targets: later than the recording, with another seed.
    fn targets(&self, payload_kg: &[f64]) -> Vec<Point> {
        self.targets_by(500, payload_kg, 99)
    }

    pub fn targets_by(&self, count: usize, payload_kg: &[f64], seed: u64) -> Vec<Point> {
        let mut targets = self.points(count, payload_kg, seed);
        targets.iter_mut().for_each(|target| target.time_s += 1e5);
        targets
    }

    /// Rms (mm) of where the true robot goes, with the commands that `solve` makes of each target.
    fn true_error(
        &self,
        arm: &Identified,
        targets: &[Point],
        solve: impl Fn(&mut Reach, &ToolGoal, &[f64]) -> Vec<f64>,
    ) -> f64 {
        rms(self.misses(arm, targets, solve)) * 1e3
    }

    /// By how much (m) the true robot misses each target, with the commands that `solve` makes of it.
    pub fn misses(
        &self,
        arm: &Identified,
        targets: &[Point],
        mut solve: impl FnMut(&mut Reach, &ToolGoal, &[f64]) -> Vec<f64>,
    ) -> Vec<f64> {
        let robot = RobotModel::new(self.robot.clone());
        let mut reach = arm.reach();
        let mut commands = Vec::new();
        for target in targets {
            reach.under(&Circumstance {
                payload: target.payload_kg,
                temperature: Some(target.temperature_c),
                time: RowTime::At(target.time_s),
                direction: target.direction.clone(),
                current: None,
            });
            let wanted = ToolGoal {
                pose: robot.forward(&target.q),
                oriented: false,
            };
            commands.push(Point {
                q: solve(&mut reach, &wanted, &target.q),
                ..target.clone()
            });
        }
        let shots = self.measure(commands, &exact(&self.tracker), 77);
        let wanted = |target: &Point| arm.base().point(&robot.forward(&target.q).translation);
        shots
            .iter()
            .zip(targets)
            .map(|(shot, target)| (Vector3::from(shot.position) - wanted(target)).norm())
            .collect()
    }
}

/// A tracker without noise.
pub fn exact(tracker: &Tracker) -> Tracker {
    Tracker {
        noise_um: 0.0,
        noise_um_per_m: 0.0,
        ..tracker.clone()
    }
}

/// 500 unseen targets; what the true robot misses them by, in noise floors.
fn proof_of(cell: &Cell) {
    let (name, rated) = (&cell.robot.name, cell.robot.payload_mass);
    let (model, findings, floor) = cell.diagnosed(cell.recorded(200, &[0.0, rated]));
    let arm = Identified::new(model, None);
    let targets = cell.targets(&[0.0, rated]);
    let before = cell.true_error(&arm, &targets, |_, _, q| q.to_vec());
    let after = cell.true_error(&arm, &targets, |reach, wanted, q| {
        let found = least_change(reach, wanted, q, q);
        assert!(found.residual <= SETTLED, "{found:?}");
        found.q
    });
    let step = cell.true_error(&arm, &targets, |reach, wanted, q| {
        one_step(reach, &mut Nominal::new(&arm.model().robot), wanted, q).q
    });
    let named = findings.0.iter();
    let named: Vec<String> = named
        .map(|row| format!("{} at {}", row.effect, row.place))
        .collect();
    assert!(
        after < 1.5 * floor,
        "{name}: {after:.4} mm above {floor:.4} mm; found {named:?}"
    );
    assert!(after > 0.05 * floor, "too good: the truth leaked");
    assert!(step < 0.2 * before && step >= 0.99 * after);
}

#[test]
fn arms_of_every_kind_go_where_they_are_wanted_by_every_kind_of_effect() {
    let warm = Climate {
        rise_k: 20.0,
        warm_up_h: 0.7,
        ..Climate::default()
    };
    for (kind, climate, effects) in [
        (
            Kind::Sr210d,
            None,
            "[{gear_cyclic: {joint: 2, order: 3, amplitude_arcsec: 25, phase_deg: 40}}, \
             {zero_shift: {joint: 3, step_arcsec: 40, at_s: 1500}}]",
        ),
        (
            Kind::Compact6,
            None,
            "[{gear_cyclic: {joint: 3, order: 2, amplitude_arcsec: 60, phase_deg: 10}}]",
        ),
        (
            Kind::Seven7r,
            None,
            "[{gear_cyclic: {joint: 4, order: 2, amplitude_arcsec: 80, phase_deg: 10}}]",
        ),
        // Wind-up, heat, lost motion.
        (
            Kind::Sr210d,
            None,
            "[{joint_compliance: {joint: 2, rad_per_nm: 6.0e-8}}, \
             {joint_compliance: {joint: 3, rad_per_nm: 9.0e-8}}, {backlash: {joint: 1, gap_arcsec: 90}}]",
        ),
        (
            Kind::Compact6,
            Some(warm),
            "[{thermal_growth: {link: 2, um_per_m_k: 12, reference_c: 20}}, {backlash: {joint: 1, gap_arcsec: 150}}]",
        ),
        (
            Kind::Seven7r,
            None,
            "[{joint_compliance: {joint: 2, rad_per_nm: 4.0e-6}}, {backlash: {joint: 3, gap_arcsec: 200}}]",
        ),
    ] {
        let mut cell = Cell::new(kind, physics(effects));
        cell.climate = climate.unwrap_or_default();
        proof_of(&cell);
    }
}

#[test]
fn a_learned_correction_is_made_up_for() {
    let wave =
        physics("[{gear_cyclic: {joint: 2, order: 3, amplitude_arcsec: 60, phase_deg: 70}}]");
    let cell = Cell::new(Kind::Sr210d, wave);
    let (model, correction) = cell.learned(cell.recorded(200, &[0.0]));
    let left = correction.as_ref().expect("something was learned").left;
    let arm = Identified::new(model.clone(), correction);
    let rigid = Identified::new(model, None);
    let targets = cell.targets(&[0.0]);
    let solve = |reach: &mut Reach, wanted: &ToolGoal, q: &[f64]| {
        let found = least_change(reach, wanted, q, q);
        assert!(found.residual <= SETTLED, "round trip {} m", found.residual);
        found.q
    };
    let (before, after) = (
        cell.true_error(&rigid, &targets, solve),
        cell.true_error(&arm, &targets, solve),
    );
    // What cross-validation says is left of a point, a root mean square.
    let left = 3f64.sqrt() * left * 1e3;
    println!("{before:.4} -> {after:.4} mm, left {left:.4} mm");
    assert!(
        after < 1.2 * left && after < 0.9 * before,
        "{before:.4} -> {after:.4} mm, left {left:.4} mm"
    );
}

/// Effects of the twin, YAML.
pub fn physics(yaml: &str) -> Vec<Physical> {
    serde_saphyr::from_str(yaml).unwrap()
}

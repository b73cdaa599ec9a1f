//! Least squares on position data: rank as the theory says, truth recovered, uncertainty honest.

use crate::fixture::{self, all_rows, fit_all, largest, misses, rms};
use crate::recorded::{Example, mean_mm_of};
use calib::description::RobotDescription;
use calib::effect::{EffectContext, EffectStack, Load, arm_effect};
use calib::estimate::{Determined, Fitted, Model, ParameterStatus, Stop, align};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::{Pose, Twist};
use calib::table::Parameters;
use nalgebra::Vector3;
use serde_json::json;

pub const SIGMA: f64 = 1e-5;
pub const GEOMETRY: [&str; 4] = ["base_frame", "tool_offset", "joint_offset", "link_geometry"];

/// A reproducible number that is as good as normal: the sum of twelve uniform ones.
pub fn normal(index: usize) -> f64 {
    let mut state = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut sum = -6.0;
    for _ in 0..12 {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        sum += (state >> 11) as f64 / (1u64 << 53) as f64;
    }
    sum
}

pub fn model(robot: &RobotModel, base: Pose, effects: &[&str]) -> Model {
    let setting = EffectContext {
        base,
        load: Load::GravityTorque,
    };
    let made = effects
        .iter()
        .map(|name| arm_effect(name, &setting).unwrap())
        .collect();
    Model::nominal(robot.clone(), EffectStack::new(robot, base, made))
}

/// A recording of a robot whose true parameters are drawn, with the names and values of what was drawn.
pub fn recording(
    description: &RobotDescription,
    effects: &[&str],
    rows: usize,
    seed: usize,
) -> (Measurements, Model) {
    recording_where(description, effects, rows, seed, |_| true)
}

/// The same with only those parameters off nominal that `drawn` accepts.
pub fn recording_where(
    description: &RobotDescription,
    effects: &[&str],
    rows: usize,
    seed: usize,
    drawn: impl Fn(usize) -> bool,
) -> (Measurements, Model) {
    let times = |k| if drawn(k) { 1.0 } else { 0.0 };
    recording_drawn(description, effects, rows, seed, times)
}

/// The same with the size of every parameter multiplied.
fn recording_drawn(
    description: &RobotDescription,
    effects: &[&str],
    rows: usize,
    seed: usize,
    times: impl Fn(usize) -> f64,
) -> (Measurements, Model) {
    let robot = RobotModel::new(description.clone());
    let base = Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.05, -0.1, 2.2));
    let mut truth = model(&robot, base, effects);
    for (k, spec) in truth.stack.specs().to_vec().iter().enumerate() {
        let size = match spec.name.split('.').next() {
            Some("base_frame") => 0.0,
            Some("joint_compliance") => 4e-7,
            Some("reduction_ratio" | "coupling_ratio") => 3e-4,
            _ => 5e-4,
        };
        truth.x[k] = times(k) * size * normal(1000 * seed + k);
    }
    let mut data = Measurements {
        joints: robot.joints(),
        q: fixture::poses(description, rows),
        points: PointReadings::new(vec![Vector3::zeros(); rows], SIGMA),
        payload: (0..rows)
            .map(|row| [0.0, description.payload_mass][row % 2])
            .collect(),
        ..Measurements::default()
    };
    data.points.position = truth.predict(&data);
    for (row, point) in data.points.position.iter_mut().enumerate() {
        *point += Vector3::from_fn(|axis, _| {
            SIGMA * normal(7_777 + 31 * seed + 1_000_000 * (seed + 1) + 3 * row + axis)
        });
    }
    (data, truth)
}

fn identify(
    data: &Measurements,
    description: &RobotDescription,
    effects: &[&str],
    rows: &[usize],
) -> (Model, Fitted) {
    let robot = RobotModel::new(description.clone());
    let base = align(&robot, data, rows);
    fit_all(&model(&robot, base, effects), data, rows)
}

/// Everything that is estimated in addition to the geometry.
const BEYOND: [&str; 3] = ["reduction_ratio", "coupling_ratio", "joint_compliance"];

fn rms_of(model: &Model, data: &Measurements, is: impl Fn(usize) -> bool) -> f64 {
    let all = misses(model, data).into_iter().enumerate();
    rms(all.filter(|(row, _)| is(*row)).map(|(_, miss)| miss))
}

#[test]
fn position_data_see_four_parameters_a_revolute_joint_two_a_prismatic_one_and_three_of_the_tool() {
    for (description, expected) in fixture::all().into_iter().zip([27, 27, 31, 29]) {
        let (data, _) = recording(&description, &GEOMETRY, 120, 1);
        let (_, fitted) = identify(&data, &description, &GEOMETRY, &all_rows(&data));
        assert_eq!(fitted.singular.len(), expected, "{}", description.name);
        let gap = fitted.singular_all[expected - 1] / fitted.singular_all[expected].max(1e-300);
        assert!(
            gap > 1e6,
            "{}: the singular values fall by {gap:.1e} behind the rank",
            description.name
        );
        assert_eq!(fitted.stop, Stop::Converged);
    }
}

#[test]
fn geometry_ratios_coupling_and_compliance_come_back_and_held_out_points_reach_the_noise() {
    let effects = [&GEOMETRY[..], &BEYOND].concat();
    for description in fixture::all() {
        let (data, truth) = recording(&description, &effects, 400, 2);
        let rows: Vec<usize> = (0..400)
            .filter(|row| row % 2 == 0 || row % 3 == 0)
            .collect();
        let (model, fitted) = identify(&data, &description, &effects, &rows);
        let held_out = rms_of(&model, &data, |row| !rows.contains(&row));
        let floor = SIGMA * 3f64.sqrt();
        assert!(
            (0.85..1.15).contains(&(held_out / floor)),
            "{}: held-out {held_out:.2e}, noise {floor:.2e}",
            description.name
        );
        assert!(
            fitted.excess_sigma < 3e-6,
            "{}: nothing is left out, yet {:.1e} m",
            description.name,
            fitted.excess_sigma
        );
        for (k, spec) in model.stack.specs().iter().enumerate() {
            let gauge = GEOMETRY.iter().any(|name| spec.name.starts_with(name));
            if let (false, ParameterStatus::Free(sigma)) = (gauge, &fitted.statuses[k]) {
                let off = (model.x[k] - truth.x[k]) / sigma;
                assert!(
                    off.abs() < 4.5,
                    "{} {}: {off:.1} sigma off",
                    description.name,
                    spec.name
                );
            }
        }
    }
}

#[test]
fn a_few_gross_outliers_do_not_move_the_fit() {
    let description = fixture::spherical();
    let (mut data, _) = recording(&description, &GEOMETRY, 160, 3);
    let rows: Vec<usize> = (0..120).collect();
    for row in [5, 40, 77] {
        data.points.position[row] += Vector3::new(0.3, -0.1, 0.8);
    }
    let (model, fitted) = identify(&data, &description, &GEOMETRY, &rows);
    let held_out = rms_of(&model, &data, |row| row >= 120);
    assert!(
        held_out < 1.5 * SIGMA * 3f64.sqrt(),
        "held-out {held_out:.2e} m"
    );
    assert!(fitted.downweighted.len() >= 3);
}

#[test]
fn a_point_on_the_last_axis_leaves_the_last_ratio_to_its_tolerance() {
    let mut description = fixture::spherical();
    description.tool = [1.954, 0.0, 1.31];
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let robot = RobotModel::new(description.clone());
    let mut data = recording(&description, &[], 100, 4).0;
    data.points.position = model(&robot, Pose::identity(), &[]).predict(&data);
    let (model, fitted) = identify(&data, &description, &effects, &all_rows(&data));
    let mut specs = model.stack.specs().iter();
    let k = specs
        .position(|spec| spec.name == "reduction_ratio.j6")
        .unwrap();
    assert_eq!(fitted.determined(&model, k), Some(Determined::ByTolerance));
    assert!(model.x[k].abs() < 1e-3 * model.tolerances[k]);
}

/// z-scores of every free parameter over many robots of one kinematics, their names, and whether the rank was right each time.
fn scores(
    description: &RobotDescription,
    effects: &[&str],
    robots: usize,
    rows: usize,
) -> (Vec<String>, Vec<Vec<f64>>) {
    let all: Vec<usize> = (0..rows).collect();
    let (data, _) = recording(description, &[], rows, 0);
    let (model, fitted) = identify(&data, description, effects, &all);
    // What tolerances hardly have a part in: the truth is drawn otherwise than they say.
    let by_the_data = |k: &usize| {
        let known = fitted.covariance.as_ref().and_then(|all| all.block(&[*k]));
        known.is_some_and(|known| known[(0, 0)].sqrt() < 0.02 * model.tolerances[*k])
    };
    let free: Vec<usize> = fitted.free().into_iter().filter(by_the_data).collect();
    let names = free
        .iter()
        .map(|k| model.stack.specs()[*k].name.clone())
        .collect();
    let mut scores = vec![Vec::new(); free.len()];
    for seed in 100..100 + robots {
        let (data, truth) =
            recording_where(description, effects, rows, seed, |k| free.contains(&k));
        let (model, fitted) = identify(&data, description, effects, &all);
        for (score, k) in scores.iter_mut().zip(&free) {
            let ParameterStatus::Free(sigma) = fitted.statuses[*k] else {
                panic!("{}: the rank changed", model.stack.specs()[*k].name)
            };
            // The base is estimated about its own start: its pose is compared, not its corrections.
            if !model.stack.specs()[*k].name.starts_with("base_frame") {
                score.push((model.x[*k] - truth.x[*k]) / sigma);
            }
        }
    }
    (names, scores)
}

#[test]
fn two_hundred_robots_of_each_kinematics_scatter_as_their_sigmas_say() {
    const ROBOTS: usize = 200;
    let effects = [&GEOMETRY[..], &BEYOND].concat();
    for description in fixture::all() {
        let (names, scores) = scores(&description, &effects, ROBOTS, 100);
        let (mut inside, mut count) = (0, 0);
        for (name, scores) in names
            .iter()
            .zip(&scores)
            .filter(|(_, scores)| !scores.is_empty())
        {
            let scatter = rms(scores.iter().copied());
            assert!(
                (0.85..1.18).contains(&scatter),
                "{} {name}: scatter over reported sigma {scatter:.3}",
                description.name
            );
            inside += scores.iter().filter(|z| z.abs() < 1.96).count();
            count += scores.len();
        }
        let cover = inside as f64 / count as f64;
        assert!(
            (0.92..0.98).contains(&cover),
            "{}: 95 % intervals cover {cover:.3}",
            description.name
        );
    }
}

#[test]
fn a_point_meant_to_lie_on_the_last_axis_is_predicted_as_well_as_any() {
    // Where it really lies makes visible what the nominal robot hides; left out, it costs more than the noise.
    let mut cases = [
        (fixture::spherical(), [1.954, 0.0, 1.31]),
        (fixture::offset_wrist(), [-1.1843, -0.26, 0.0116]),
    ];
    for (description, tool) in &mut cases {
        description.tool = *tool;
        let off = (60..72).map(|seed| {
            let (mut data, truth) = recording_drawn(description, &GEOMETRY, 160, seed, |_| 1.5);
            let (model, _) = identify(&data, description, &GEOMETRY, &all_rows(&data));
            data.points.position = truth.predict(&data);
            rms(misses(&model, &data)) / (SIGMA * 3f64.sqrt())
        });
        let worst = largest(off);
        assert!(
            worst < 0.5,
            "{}: predictions are off by {worst:.2} of the noise",
            description.name
        );
    }
}

#[test]
fn a_step_without_effects_says_how_far_the_nominal_robot_is_off() {
    let blocks = json!([{"usage": "fit", "points": 20}, {"usage": "validate", "points": 6}]);
    let (recorded, _) =
        Example::new("sr210d", &[("remainder", "none")]).simulated(json!({"blocks": blocks}));
    let nominal = recorded.identify(json!({"effects": []}));
    assert!(nominal.get::<Parameters>().0.is_empty());
    assert!(mean_mm_of(&nominal.get(), "validate") > 0.1);
}

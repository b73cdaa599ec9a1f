//! What may be measured beside a single point: several targets, poses, some axes, distances. Rank, truth and uncertainty of each.

mod holder;
mod lag;
pub mod laws;
mod level;
mod stops;
mod tables;

use crate::fixture::{self, fit_all, largest, misses, rms};
use crate::identify::{GEOMETRY, model, normal};
use calib::description::RobotDescription;
use calib::effect::ParameterSpec;
use calib::estimate::{Fitted, Known, Model, ParameterStatus, Prior, gauge};
use calib::robot::{
    MeasurementSetup, Measurements, Named, PointReadings, Readings, RobotModel, Target,
};
use calib::spatial::{Pose, Twist};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

const SIGMA: f64 = 1e-5;
const SIGMA_TURN: f64 = 5e-5;

/// A robot that is off nominal, its targets and its anchors.
struct Cell {
    description: RobotDescription,
    truth: Model,
    seed: usize,
}

impl Cell {
    /// Targets by name, mm from the tool point.
    fn new(description: RobotDescription, targets: &[(&str, [f64; 3])], seed: usize) -> Self {
        let robot = RobotModel::new(description.clone());
        let home = *robot.home();
        let target = |(name, offset): &(&str, [f64; 3])| Target {
            name: (*name).into(),
            mounting: Pose::new(home.rotation, home.point(&(Vector3::from(*offset) * 1e-3))),
            oriented: false,
        };
        let setup = MeasurementSetup {
            targets: targets.iter().map(target).collect(),
            anchors: Vec::new(),
        };
        let base = Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.05, -0.1, 2.2));
        let mut truth = model(&robot.measured_by(setup), base, &GEOMETRY);
        for (k, spec) in truth.stack.specs().to_vec().iter().enumerate() {
            if !spec.name.starts_with("base_frame") && !spec.name.starts_with("tool_offset") {
                truth.x[k] = 5e-4 * normal(1000 * seed + k);
            }
        }
        Self {
            description,
            truth,
            seed,
        }
    }

    fn noise(&self, index: usize) -> f64 {
        normal(99_991 * (self.seed + 1) + index)
    }

    /// Rows that measure every target in every pose, without noise; other poses for another `part`.
    fn rows(&self, poses: usize, part: usize) -> Measurements {
        let all = fixture::poses(&self.description, poses * (part + 1));
        let joints = self.description.joints.len();
        let q = &all[poses * part * joints..];
        let names: Vec<&str> = self
            .truth
            .robot
            .setup()
            .targets
            .iter()
            .map(|target| target.name.as_str())
            .collect();
        let count = names.len().max(1);
        let rows = poses * count;
        let mut data = Measurements {
            joints,
            q: (0..rows)
                .flat_map(|row| q[row / count * joints..(row / count + 1) * joints].to_vec())
                .collect(),
            points: PointReadings::new(vec![Vector3::zeros(); rows], SIGMA),
            payload: vec![0.0; rows],
            target: (!names.is_empty()).then(|| Named::of((0..rows).map(|row| names[row % count]))),
            ..Measurements::default()
        };
        data.points.position = self.truth.predict(&data);
        data
    }

    fn disturb(&self, data: &mut Measurements) {
        for (row, point) in data.points.position.iter_mut().enumerate() {
            *point += Vector3::from_fn(|axis, _| SIGMA * self.noise(3 * row + axis));
        }
    }

    /// Orientation of the last body in every row, from points: where it puts a point and its neighbours.
    fn turns(&self, data: &Measurements) -> Vec<Matrix3<f64>> {
        let moved = |axis: usize| {
            let mut setup = self.truth.robot.setup().clone();
            setup
                .targets
                .iter_mut()
                .for_each(|target| target.mounting.translation[axis] += 0.5);
            Model {
                robot: self.truth.robot.clone().measured_by(setup),
                ..self.truth.clone()
            }
            .predict(data)
        };
        let (unmoved, shifted) = (self.truth.predict(data), [moved(0), moved(1), moved(2)]);
        (0..data.rows())
            .map(|row| {
                Matrix3::from_columns(
                    &[0, 1, 2].map(|axis: usize| (shifted[axis][row] - unmoved[row]) / 0.5),
                )
            })
            .collect()
    }

    /// Adds measured orientations of frames that sit askew on the tool.
    fn turn(&self, data: &mut Measurements) {
        let askew =
            Pose::from_rotation_vector(Vector3::new(0.9, -1.2, 0.4), Vector3::zeros()).rotation;
        let noise = |row: usize| {
            Vector3::from_fn(|axis, _| SIGMA_TURN * self.noise(500_000 + 3 * row + axis))
        };
        let turns = self.turns(data).into_iter().enumerate();
        let measured = turns.map(|(row, turn)| {
            Pose::from_rotation_vector(noise(row), Vector3::zeros()).rotation * turn * askew
        });
        data.readings.push(Readings {
            kind: "orientation",
            width: 9,
            values: measured
                .flat_map(|rotation| rotation.data.0.concat())
                .collect(),
            sigma: vec![SIGMA_TURN; data.rows()],
            anchor: None,
        });
    }

    /// Adds measured distances from anchors in turn (m, tracker frame), with a sigma.
    fn reach(&self, data: &mut Measurements, anchors: &[(&str, Vector3<f64>)], sigma: f64) {
        let unmoved = self.truth.predict(data);
        let rows = 0..data.rows();
        let length = |row: usize| {
            (unmoved[row] - anchors[row % anchors.len()].1).norm()
                + sigma * self.noise(900_000 + row)
        };
        data.readings.push(Readings {
            kind: "distance",
            width: 1,
            anchor: Some(Named::of(
                rows.clone().map(|row| anchors[row % anchors.len()].0),
            )),
            values: rows.map(length).collect(),
            sigma: vec![sigma; data.rows()],
        });
    }

    /// A fit that starts at the nominal robot and knows the targets by name alone.
    fn fit(
        &self,
        data: &Measurements,
        known: impl Fn(&Model) -> BTreeMap<usize, Known>,
    ) -> (Model, Fitted) {
        let rows: Vec<usize> = (0..data.rows()).collect();
        let stated = BTreeMap::new();
        let (robot, base) = gauge(
            RobotModel::new(self.description.clone()),
            data,
            &rows,
            &stated,
        )
        .unwrap();
        let effects = [&["anchor"][..], &GEOMETRY].concat();
        let mut model = model(&robot, base, &effects);
        model.known = known(&model);
        fit_all(&model, data, &rows)
    }
}

fn nothing(_: &Model) -> BTreeMap<usize, Known> {
    BTreeMap::new()
}

/// Mean square of what predictions miss the truth by over what their sigma says.
fn honesty(model: &Model, fitted: &Fitted, at: &Measurements) -> f64 {
    let covariance = fitted.covariance.as_ref().unwrap();
    (rms(misses(model, at)) / rms(covariance.of_predictions(model, at))).powi(2)
}

const THREE: [(&str, [f64; 3]); 3] = [
    ("A", [120.0, 0.0, 30.0]),
    ("B", [-60.0, 90.0, 30.0]),
    ("C", [-50.0, -80.0, -40.0]),
];

#[test]
fn every_target_adds_three_to_the_rank_and_their_places_come_out() {
    for (description, axes) in fixture::all().into_iter().zip([24, 24, 28, 26]) {
        let cell = Cell::new(description, &THREE, 3);
        let mut data = cell.rows(60, 0);
        cell.disturb(&mut data);
        let (model, fitted) = cell.fit(&data, nothing);
        let name = &cell.description.name;
        assert_eq!(fitted.singular.len(), axes + 9, "{name}");
        assert!(
            fitted.clusters == 60,
            "{name}: rows of a pose stay together, {} clusters",
            fitted.clusters
        );
        let fresh = cell.rows(60, 1);
        let off = largest(misses(&model, &fresh));
        assert!(off < 5.0 * SIGMA, "{name}: new poses are off by {off:e} m");
    }
}

#[test]
fn targets_known_from_elsewhere_show_the_zero_of_the_last_joint() {
    let cell = Cell::new(fixture::offset_wrist(), &THREE, 4);
    let mut data = cell.rows(60, 0);
    cell.disturb(&mut data);
    let stated: BTreeMap<String, Vector3<f64>> = THREE
        .iter()
        .map(|(name, offset)| ((*name).to_string(), Vector3::from(*offset) * 1e-3))
        .collect();
    let rows: Vec<usize> = (0..data.rows()).collect();
    let (robot, base) = gauge(
        RobotModel::new(cell.description.clone()),
        &data,
        &rows,
        &stated,
    )
    .unwrap();
    let mut model = model(&robot, base, &GEOMETRY);
    let specs = model.stack.specs().to_vec();
    for k in model.stack.parameters_of("tool_offset") {
        let (mean, sigma) = (0.0, 1e-5);
        model.known.entry(k).or_default().prior = Some(Prior { mean, sigma });
    }
    let (_, fitted) = fit_all(&model, &data, &rows);
    let is_zero = |spec: &ParameterSpec| spec.name == "joint_offset.j6";
    let zero = specs.iter().position(is_zero).unwrap();
    let ParameterStatus::Free(sigma) = fitted.statuses[zero] else {
        panic!("{:?}", fitted.statuses[zero])
    };
    assert!(sigma < 1e-4, "{sigma:e} rad");
}

#[test]
fn poses_add_the_orientation_of_the_tool_to_the_rank() {
    for (description, axes) in fixture::all().into_iter().zip([24, 24, 28, 26]) {
        let cell = Cell::new(description, &[("", [0.0; 3])], 5);
        let mut data = cell.rows(80, 0);
        data.target = None;
        cell.disturb(&mut data);
        cell.turn(&mut data);
        let (model, fitted) = cell.fit(&data, nothing);
        let name = &cell.description.name;
        assert_eq!(fitted.singular.len(), axes + 6, "{name}");
        // The median of 80 scatters by a tenth.
        assert!(
            fitted.excess_sigma < 0.6 * SIGMA,
            "{name}: {:e} m",
            fitted.excess_sigma
        );
        assert!(
            fitted
                .excess_sigma_angle
                .is_some_and(|turn| turn < 0.6 * SIGMA_TURN),
            "{name}: {:?} rad",
            fitted.excess_sigma_angle
        );
        let errors = model.row_errors(&data).into_iter();
        let rms = rms(errors.filter_map(|error| error.angle));
        assert!(
            (0.85..1.12).contains(&(rms / (3f64.sqrt() * SIGMA_TURN))),
            "{name}: orientations are off by {rms:e} rad"
        );
    }
}

#[test]
fn distances_from_one_anchor_see_all_but_where_the_cell_stands() {
    let cell = Cell::new(fixture::offset_wrist(), &[], 6);
    let mut data = cell.rows(200, 0);
    cell.reach(
        &mut data,
        &[("", cell.truth.base().point(&Vector3::new(-0.9, 1.6, -0.5)))],
        2e-5,
    );
    data.points.position.fill(Vector3::zeros());
    data.points.sigma.fill(Vector3::repeat(f64::INFINITY));
    let (model, fitted) = cell.fit(&data, nothing);
    assert_eq!(fitted.singular.len(), 27 + 3 - 6);
    let errors = model.row_errors(&data).into_iter();
    let rms = rms(errors.map(|error| error.length));
    let expected = 2e-5 * (1.0f64 - 24.0 / 200.0).sqrt();
    assert!(
        (0.85..1.15).contains(&(rms / expected)),
        "{rms:e} m are left, {expected:e} expected"
    );
}

#[test]
fn an_anchor_beside_a_tracker_is_placed_where_it_is() {
    let cell = Cell::new(fixture::spherical(), &[], 7);
    let mut data = cell.rows(80, 0);
    cell.disturb(&mut data);
    let anchors = [
        ("north", Vector3::new(4.0, 1.0, 0.3)),
        ("south", Vector3::new(1.0, -3.0, 0.2)),
    ];
    cell.reach(&mut data, &anchors, 3e-5);
    let (model, fitted) = cell.fit(&data, nothing);
    assert_eq!(fitted.singular.len(), 27 + 6);
    for k in model.stack.parameters_of("anchor") {
        let spec = &model.stack.specs()[k];
        let (_, place) = spec.name.split_once('.').unwrap();
        let (name, axis) = place.split_once('.').unwrap();
        let axis = ["x", "y", "z"]
            .iter()
            .position(|known| *known == axis)
            .unwrap();
        let truth = anchors.iter().find(|(known, _)| *known == name).unwrap().1[axis];
        let ParameterStatus::Free(sigma) = fitted.statuses[k] else {
            panic!("{}: {:?}", spec.name, fitted.statuses[k])
        };
        let pull = (model.standing(k).1 - truth) / sigma;
        assert!(pull.abs() < 3.5, "{}: {pull:.1} sigma off", spec.name);
    }
}

#[test]
fn rows_of_one_axis_count_for_that_axis_alone() {
    let cell = Cell::new(fixture::offset_wrist(), &[], 8);
    let mut data = cell.rows(120, 0);
    cell.disturb(&mut data);
    let (_, whole) = cell.fit(&data, nothing);
    let spoilt = |row: usize| row >= 60;
    for row in (0..120).filter(|row| spoilt(*row)) {
        // What was not measured must not matter.
        data.points.position[row].x = 0.0;
        data.points.position[row].y = 0.0;
        data.points.sigma[row].x = f64::INFINITY;
        data.points.sigma[row].y = f64::INFINITY;
    }
    let (model, fitted) = cell.fit(&data, nothing);
    assert_eq!(fitted.singular.len(), 27);
    assert_eq!(fitted.values, 3 * 60 + 60);
    let half = laws::select(&data, &(0..60).collect::<Vec<_>>());
    let (_, few) = cell.fit(&half, nothing);
    let fresh = cell.rows(60, 2);
    let sigma = |fitted: &Fitted| {
        let covariance = fitted.covariance.as_ref().unwrap();
        rms(covariance.of_predictions(&model, &fresh))
    };
    let [all, some, none] = [&whole, &fitted, &few].map(sigma);
    assert!(
        all < some && some < none,
        "more axes tell more: {all:e}, {some:e}, {none:e}"
    );
    let off = largest(misses(&model, &fresh));
    assert!(off < 4.0 * SIGMA, "new poses are off by {off:e} m");
}

#[test]
fn what_is_said_of_predictions_is_what_they_are_off_by_whatever_was_measured() {
    type Kind = (&'static str, fn(&Cell) -> Measurements);
    let kinds: [Kind; 4] = [
        ("targets", |cell| cell.rows(40, 0)),
        ("poses", |cell| {
            let mut data = cell.rows(30, 0);
            cell.turn(&mut data);
            data
        }),
        ("heights", |cell| {
            let mut data = cell.rows(60, 0);
            for row in (0..data.rows()).filter(|row| row % 3 != 0) {
                data.points.sigma[row].x = f64::INFINITY;
                data.points.sigma[row].y = f64::INFINITY;
            }
            data
        }),
        ("distances", |cell| {
            let mut data = cell.rows(50, 0);
            cell.reach(&mut data, &[("", Vector3::new(3.5, 1.0, 0.2))], 2e-5);
            data
        }),
    ];
    for (kind, make) in kinds {
        let seeds = 24;
        let mean = (0..seeds).map(|seed| {
            let cell = Cell::new(fixture::offset_wrist(), &THREE[..2], 20 + seed);
            let mut data = make(&cell);
            cell.disturb(&mut data);
            let (model, fitted) = cell.fit(&data, nothing);
            honesty(&model, &fitted, &cell.rows(40, 3))
        });
        let mean = mean.sum::<f64>() / seeds as f64;
        assert!(
            (0.75..1.3).contains(&mean),
            "{kind}: squared errors are {mean:.2} of what sigma says"
        );
    }
}

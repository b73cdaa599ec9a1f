//! Laws that every kind of measurement keeps, on an arm that is off nominal: residual, derivatives, rank.

use super::{SIGMA, THREE};
use crate::fixture;
use crate::identify::{GEOMETRY, model, normal};
use calib::description::RobotDescription;
use calib::estimate::{Fitted, Model, fit, gauge};
use calib::observation::{KINDS, MeasurementKind, RowView, Weight, rank};
use calib::robot::{
    Anchor, MeasurementSetup, Measurements, PointReadings, Readings, RobotModel, Target,
};
use calib::spatial::{Pose, Twist};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// A target that sits askew, an anchor, and a robot whose parameters are off.
pub struct Truth {
    description: RobotDescription,
    pub model: Model,
}

impl Truth {
    pub fn new(description: RobotDescription, askew: Vector3<f64>) -> Self {
        let robot = RobotModel::new(description.clone());
        let home = *robot.home();
        let offset = Vector3::from(THREE[0].1) * 1e-3;
        let rotation = home.rotation * Pose::from_rotation_vector(askew, Vector3::zeros()).rotation;
        let target = Target {
            name: String::new(),
            mounting: Pose::new(rotation, home.point(&offset)),
            oriented: true,
        };
        let anchor = Anchor::point("", Vector3::new(4.6, -2.5, 0.8));
        let robot = robot.measured_by(MeasurementSetup {
            targets: vec![target],
            anchors: vec![anchor],
        });
        let base = Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.0, 0.0, 0.0));
        let mut model = model(&robot, base, &[&["anchor"][..], &GEOMETRY].concat());
        for (k, spec) in model.stack.specs().to_vec().iter().enumerate() {
            // The seat is where the target truly is; the base stands level.
            if !spec.name.starts_with("tool_offset") && !spec.name.starts_with("base_frame") {
                model.x[k] = 5e-4 * normal(7000 + k);
            }
        }
        Self { description, model }
    }

    /// Poses with what every kind measures, without noise.
    pub fn rows(&self, poses: usize) -> Measurements {
        let joints = self.description.joints.len();
        let mut data = Measurements {
            joints,
            q: fixture::poses(&self.description, poses),
            points: PointReadings::new(vec![Vector3::zeros(); poses], SIGMA),
            payload: vec![0.0; poses],
            ..Measurements::default()
        };
        data.points.position = self.model.predict(&data);
        let rotations = self.rotations(&data);
        for kind in read().skip(1) {
            data.readings
                .push(self.readings(kind.about().name, &data, &rotations));
        }
        data
    }

    /// A fit of the parameters that are `asked` for by name, from the nominal robot.
    pub fn fit(&self, data: &Measurements, asked: impl Fn(&str) -> bool) -> (Model, Fitted) {
        let rows: Vec<usize> = (0..data.rows()).collect();
        let (robot, base) = gauge(
            RobotModel::new(self.description.clone()),
            data,
            &rows,
            &BTreeMap::new(),
        )
        .unwrap();
        let model = model(&robot, base, &[&["anchor"][..], &GEOMETRY].concat());
        let candidates: Vec<usize> = (0..model.x.len())
            .filter(|k| asked(&model.stack.specs()[*k].name))
            .collect();
        fit(&model, data, &rows, &candidates)
    }

    /// How the target is turned in every row, by differences of points.
    fn rotations(&self, data: &Measurements) -> Vec<Matrix3<f64>> {
        let seat = self.model.robot.setup().targets[0].mounting;
        let nearby = [0, 1, 2].map(|axis: usize| {
            let mut setup = self.model.robot.setup().clone();
            setup.targets[0].mounting.translation += seat.rotation.column(axis) * 0.5;
            Model {
                robot: self.model.robot.clone().measured_by(setup),
                ..self.model.clone()
            }
            .predict(data)
        });
        let rows = 0..data.rows();
        rows.map(|row| {
            Matrix3::from_columns(
                &[0, 1, 2].map(|axis: usize| (nearby[axis][row] - data.points.position[row]) / 0.5),
            )
        })
        .collect()
    }

    fn readings(
        &self,
        kind: &'static str,
        data: &Measurements,
        rotations: &[Matrix3<f64>],
    ) -> Readings {
        let (stack, x) = (&self.model.stack, &self.model.x);
        let named = |axis: &str| {
            stack
                .specs()
                .iter()
                .position(|spec| spec.name == format!("anchor.{axis}"))
                .unwrap()
        };
        let moved = Vector3::new(x[named("x")], x[named("y")], x[named("z")]);
        let anchor = self.model.robot.setup().anchors[0].place + moved;
        let row: &dyn Fn(usize) -> Vec<f64> = match kind {
            "orientation" => &|row| rotations[row].iter().copied().collect(),
            "inclination" => &|row| {
                [0, 1]
                    .map(|axis: usize| rotations[row][(2, axis)].asin())
                    .to_vec()
            },
            "planar" => &|row| {
                [1, 2]
                    .map(|axis: usize| {
                        -data.points.position[row][axis] / data.points.position[row].x
                    })
                    .to_vec()
            },
            "distance" => &|row| vec![(data.points.position[row] - anchor).norm()],
            other => panic!("say what `{other}` measures"),
        };
        let values: Vec<f64> = (0..data.rows()).flat_map(row).collect();
        let anchor = (kind == "distance").then(Default::default);
        Readings {
            kind,
            width: values.len() / data.rows(),
            values,
            sigma: vec![SIGMA; data.rows()],
            anchor,
        }
    }
}

/// Some of the rows.
pub fn select(data: &Measurements, rows: &[usize]) -> Measurements {
    let taken = |all: &Readings| Readings {
        values: rows
            .iter()
            .flat_map(|row| all.values[row * all.width..(row + 1) * all.width].to_vec())
            .collect(),
        sigma: rows.iter().map(|row| all.sigma[*row]).collect(),
        ..all.clone()
    };
    Measurements {
        joints: data.joints,
        q: rows.iter().flat_map(|row| data.q(*row).to_vec()).collect(),
        points: data.points.subset(rows),
        payload: rows.iter().map(|row| data.payload[*row]).collect(),
        readings: data.readings.iter().map(taken).collect(),
        ..Measurements::default()
    }
}

const ASKEW: [f64; 3] = [0.9, -1.2, 0.4];

/// Kinds that read something; what is only brought to a place has a file of its own.
fn read() -> impl Iterator<Item = &'static dyn MeasurementKind> {
    KINDS.iter().copied().filter(|kind| !kind.is_contact())
}

/// The residual of a kind under a model with parameters `x`; none where the row has none of it.
fn residual(
    kind: &dyn MeasurementKind,
    model: &Model,
    data: &Measurements,
    row: usize,
    x: &[f64],
) -> Option<Vector3<f64>> {
    let mut scratch = model.stack.scratch(&model.robot);
    let placed = &model.stack.place(&model.robot, data, row, x, &mut scratch);
    kind.residual(RowView { data, row, placed })
        .map(|(error, _)| error)
}

/// Derivatives of what a row has of a kind are central differences; whether it has any.
pub fn derivatives_hold(
    kind: &dyn MeasurementKind,
    model: &Model,
    data: &Measurements,
    row: usize,
) -> bool {
    const STEP: f64 = 1e-6;
    let mut scratch = model.stack.scratch(&model.robot);
    let x = &model.x;
    let mut placed = model.stack.place(&model.robot, data, row, x, &mut scratch);
    if residual(kind, model, data, row, x).is_none() {
        return false;
    }
    let at = RowView {
        data,
        row,
        placed: &placed,
    };
    let mut partials = vec![Vector3::zeros(); x.len()];
    let sensitivity = kind.sensitivity(at, Weight::uniform(1.0));
    sensitivity.derivatives(&mut placed, |k, ours| partials[k] += ours);
    for (k, partial) in partials.iter().enumerate() {
        let moved = |step: f64| {
            let mut x = x.clone();
            x[k] += step;
            residual(kind, model, data, row, &x).unwrap()
        };
        let central = (moved(-STEP) - moved(STEP)) / (2.0 * STEP);
        let (spec, off) = (&model.stack.specs()[k].name, (central - partial).norm());
        assert!(
            off < 2e-6 * (1.0 + partial.norm()),
            "{}, row {row}, {spec}: {central} by differences, {partial} by formula",
            kind.about().name
        );
    }
    true
}

#[test]
fn every_kind_leaves_nothing_at_the_truth_and_its_derivatives_are_central_differences() {
    for description in fixture::all() {
        let truth = Truth::new(description, Vector3::from(ASKEW));
        let data = truth.rows(6);
        let Truth { model, description } = &truth;
        for (kind, row) in read().flat_map(|kind| (0..data.rows()).map(move |row| (kind, row))) {
            let name = format!("{}, {}, row {row}", description.name, kind.about().name);
            let left = residual(kind, model, &data, row, &model.x).unwrap();
            assert!(left.norm() < 1e-9, "{name}: {left} is left");
            assert_eq!(kind.axes(&data, row), kind.about().axes, "{name}");
            assert!(derivatives_hold(kind, model, &data, row), "{name}");
        }
    }
}

/// The data with one kind alone.
fn alone(data: &Measurements, kind: &dyn MeasurementKind) -> Measurements {
    let name = kind.about().name;
    let mut ours = data.clone();
    ours.readings.retain(|readings| readings.kind == name);
    if name != KINDS[0].about().name {
        ours.points.position.fill(Vector3::zeros());
        ours.points.sigma.fill(Vector3::repeat(f64::INFINITY));
    }
    ours
}

#[test]
fn the_rank_of_every_kind_is_that_of_theory() {
    for description in [
        fixture::offset_wrist(),
        fixture::seven(),
        fixture::on_track(),
    ] {
        let truth = Truth::new(description, Vector3::from(ASKEW));
        let all = truth.rows(600);
        // A level is read where it is upright.
        let upright: Vec<usize> = (0..all.rows())
            .filter(|row| all.reading("orientation", *row).unwrap().values[8] > 0.0)
            .collect();
        let all = select(&all, &upright);
        for kind in read() {
            let data = alone(&all, kind);
            let rows: Vec<usize> = (0..data.rows()).collect();
            let (model, fitted) = truth.fit(&data, |_| true);
            let name = format!("{}, {}", truth.description.name, kind.about().name);
            let expected = rank(&model.robot, &data, &rows, false, 0);
            assert_eq!(Some(fitted.singular.len()), expected, "{name}");
        }
    }
}

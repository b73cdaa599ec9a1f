//! What the benches fit: a robot, its recording, and which of its rows.

use crate::fixture;
use calib::description::{Coupling, JointDescription, JointKind, RobotDescription};
use calib::effect::{EffectContext, EffectStack, Load, identified};
use calib::estimate::{Fitted, Model, align, fit};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::{Pose, Twist};
use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

#[derive(Clone)]
pub struct Case {
    pub robot: RobotModel,
    pub data: Measurements,
    pub effects: Vec<String>,
    /// Rows to fit.
    pub rows: Vec<usize>,
}

/// Noise of a simulated point, one sigma per axis, m.
const SIGMA: f64 = 1e-5;

impl Case {
    /// A 6R robot with plausible errors in all parameters.
    pub fn simulated(rows: usize) -> Self {
        Self::simulated_as(rows, 1)
    }

    /// Another robot of the kind for every seed.
    pub fn simulated_as(rows: usize, seed: u64) -> Self {
        let description = fixture::spherical();
        let robot = RobotModel::new(description.clone());
        let effects: Vec<String> = identified().map(|cause| cause.name().to_string()).collect();
        let mut truth = model(
            &robot,
            Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.05, -0.1, 2.2)),
            &effects,
        );
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut spread = |size: f64| size * random.random_range(-1.7..1.7);
        for (k, spec) in truth.stack.specs().to_vec().iter().enumerate() {
            truth.x[k] = spread(match spec.name.split('.').next() {
                Some("base_frame") => 0.0,
                Some("joint_compliance") => 4e-7,
                Some("reduction_ratio" | "coupling_ratio") => 3e-4,
                _ => 5e-4,
            });
        }
        let mut data = Measurements {
            joints: robot.joints(),
            q: fixture::poses(&description, rows),
            points: PointReadings::new(vec![Vector3::zeros(); rows], SIGMA),
            payload: (0..rows)
                .map(|row| {
                    if row % 2 == 0 {
                        0.0
                    } else {
                        description.payload_mass
                    }
                })
                .collect(),
            ..Measurements::default()
        };
        data.points.position = truth.predict(&data);
        for point in &mut data.points.position {
            *point += Vector3::from_fn(|_, _| spread(SIGMA));
        }
        Self {
            robot,
            data,
            effects,
            rows: (0..rows).collect(),
        }
    }

    /// From the file that `compare.py` writes; SI, `fit` says how many rows from the first are to be fitted.
    pub fn read(value: &Value) -> Self {
        let robot = &value["robot"];
        let joints = robot["joints"]
            .as_array()
            .expect("joints")
            .iter()
            .map(|joint| JointDescription {
                name: String::new(),
                kind: JointKind::Revolute,
                axis: vector(&joint["axis"]),
                point: vector(&joint["point"]),
                limits: None,
                reduction_ratio: None,
                motor_constant: None,
                mass: joint["mass"].as_f64(),
                centre: Some(vector(&joint["centre"])),
                coulomb: None,
            });
        let couplings = robot["couplings"]
            .as_array()
            .expect("couplings")
            .iter()
            .map(|coupling| Coupling {
                moved: coupling["moved"].as_u64().expect("moved") as usize,
                by: coupling["by"].as_u64().expect("by") as usize,
                ratio: 0.0,
            });
        let description = RobotDescription {
            name: "compared".into(),
            joints: joints.collect(),
            tool: vector(&robot["tool"]),
            tool_rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            couplings: couplings.collect(),
            payload_mass: 0.0,
            payload_centre: vector(&robot["tool"]),
            gravity: [0.0, 0.0, -9.81],
            inertias: Default::default(),
            tolerances: Default::default(),
        };
        let position: Vec<Vector3<f64>> = numbers(&value["position"])
            .chunks(3)
            .map(Vector3::from_column_slice)
            .collect();
        let sigma = value["sigma"].as_f64().expect("sigma");
        let data = Measurements {
            joints: description.joints.len(),
            q: numbers(&value["q"]),
            payload: vec![0.0; position.len()],
            points: PointReadings::new(position, sigma),
            ..Measurements::default()
        };
        let effects = value["effects"]
            .as_array()
            .expect("effects")
            .iter()
            .filter_map(|name| Some(name.as_str()?.to_string()));
        let rows = 0..value["fit"].as_u64().expect("fit") as usize;
        Self {
            robot: RobotModel::new(description),
            data,
            effects: effects.collect(),
            rows: rows.collect(),
        }
    }

    /// The whole identification: alignment, visibility, fit, uncertainty.
    pub fn fit(&self) -> (Model, Fitted) {
        let model = model(
            &self.robot,
            align(&self.robot, &self.data, &self.rows),
            &self.effects,
        );
        let candidates: Vec<usize> = (0..model.stack.specs().len()).collect();
        fit(&model, &self.data, &self.rows, &candidates)
    }
}

fn model(robot: &RobotModel, base: Pose, effects: &[String]) -> Model {
    let setting = EffectContext {
        base,
        load: Load::GravityTorque,
    };
    let chosen = identified().filter(|cause| effects.iter().any(|name| name == cause.name()));
    Model::nominal(
        robot.clone(),
        EffectStack::new(
            robot,
            base,
            chosen
                .filter_map(|cause| cause.arm_effect(&setting))
                .collect(),
        ),
    )
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(|number| number.as_f64().expect("a number"))
        .collect()
}

fn vector(value: &Value) -> [f64; 3] {
    numbers(value).try_into().expect("three numbers")
}

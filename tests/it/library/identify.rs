use calib::effect::{EffectContext, EffectStack, Load, arm_effect};
use calib::estimate::{FitOptions, Model, ParameterStatus, fit, gauge};
use calib::robot::import::{RobotFileText, read_calib};
use calib::robot::{Measurements, PointReadings, RobotModel};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::error::Error;

/// A parameter with its standard deviation, SI.
pub struct Estimated {
    pub name: String,
    pub value: f64,
    pub sigma: f64,
}

/// Parameters of an arm, from joint positions (rad, a row of `q` for each pose) and measured points
/// (m, in the tracker's frame, wherever it stands).
pub fn identify(
    robot_file: &str,
    q: &[Vec<f64>],
    points: &[[f64; 3]],
) -> Result<Vec<Estimated>, Box<dyn Error>> {
    let robot = RobotModel::new(
        read_calib(
            RobotFileText {
                label: "robot.yaml",
                text: robot_file,
            },
            None,
        )?
        .robot,
    );
    let data = Measurements {
        joints: robot.joints(),
        q: q.concat(),
        points: PointReadings::new(
            points.iter().map(|point| Vector3::from(*point)).collect(),
            10e-6,
        ), // 10 um on every axis
        payload: vec![0.0; points.len()],
        ..Measurements::default()
    };
    let rows: Vec<usize> = (0..data.rows()).collect();
    // Where the nominal robot's base stands in the tracker's frame, and where its targets are.
    let (robot, base) = gauge(robot, &data, &rows, &BTreeMap::new())?;
    let context = EffectContext {
        base,
        load: Load::GravityTorque,
    };
    let names = ["base_frame", "tool_offset", "joint_offset", "link_geometry"];
    let effects = names
        .iter()
        .filter_map(|name| arm_effect(name, &context))
        .collect();
    let nominal = Model::nominal(robot.clone(), EffectStack::new(&robot, base, effects));
    let candidates: Vec<usize> = (0..nominal.x.len()).collect();
    let (model, fitted) = fit(
        &nominal,
        &data,
        &FitOptions {
            rows: &rows,
            candidates: &candidates,
        },
    );
    // Candidates that the data cannot determine keep their nominal value; `fitted.statuses` says why.
    let estimated = fitted
        .statuses
        .iter()
        .enumerate()
        .filter_map(|(k, status)| match status {
            ParameterStatus::Free(sigma) => Some(Estimated {
                name: model.stack.specs()[k].name.clone(),
                value: model.x[k],
                sigma: *sigma,
            }),
            _ => None,
        });
    Ok(estimated.collect())
}

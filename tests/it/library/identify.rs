use calib::api::{Options, Poses, Recording, Robot, Sigma, identify};
use calib::error::Result;
use calib::table::ParameterRow;

/// Parameters of an arm, from joint positions (rad, a row of them for each pose) and measured points (mm, in the tracker's frame, wherever
/// it stands). `sigma` is that of data and tolerances together, `determined` says which of both tells.
pub fn parameters(
    robot_file: &str,
    joints_rad: Vec<f64>,
    points_mm: Vec<[f64; 3]>,
) -> Result<Vec<ParameterRow>> {
    let robot = Robot::from_text("robot.yaml", robot_file)?;
    let recording = Recording {
        held_out: Some(vec![false; points_mm.len()]),
        poses: Poses {
            joints_rad,
            ..Poses::default()
        },
        points_mm,
        sigma: Sigma::Mm(vec![0.01]), // 10 um on every axis
        ..Recording::default()
    };
    let effects = ["base_frame", "tool_offset", "joint_offset", "link_geometry"];
    let options = Options::with(serde_json::json!({ "effects": effects }));
    let model = identify(&robot, &recording, &options)?.model;
    Ok(model.parameters().0.clone())
}

//! Points that were computed and not measured are told from measured ones by a residual that no instrument has.

use crate::answer::{calib, put};
use crate::fixture;
use crate::identify::normal;
use calib::robot::RobotModel;
use std::fmt::Write;

const PIPELINE: &str = "calib: 1
name: computed
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: data.csv
          columns:
            q: {column: \"q{j}\", unit: rad}
            x: {column: x_t, MINUS unit: mm}
            y: {column: y_t, unit: mm}
            z: {column: z_t, unit: mm}
  - uses: split
    with: {by: every, n: 4}
  - uses: identify
    with: {effects: [base_frame, joint_offset]}
  - uses: validate
";

const ROBOT: &str = "calib_robot: 1
name: offset wrist
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, -1, 0], point: [0, 0, 127.3]}
    - {axis: [0, -1, 0], point: [-612, 0, 127.3]}
    - {axis: [0, -1, 0], point: [-1184.3, 0, 127.3]}
    - {axis: [0, 0, -1], point: [-1184.3, -163.9, 127.3]}
    - {axis: [0, -1, 0], point: [-1184.3, -163.9, 11.6]}
tool: {point: [-1184.3, -340, -40]}
";

/// What the run says on stderr where the column of x holds the nominal point and that of the difference `noise_mm` of noise.
fn message_of(minus: &str, noise_mm: f64) -> String {
    let robot = RobotModel::new(fixture::offset_wrist());
    let mut text = "q1,q2,q3,q4,q5,q6,x_t,y_t,z_t,x_dif\n".to_string();
    for row in 0..60 {
        let q: Vec<f64> = (0..6).map(|joint| 0.8 * normal(6 * row + joint)).collect();
        let point = robot.forward(&q).translation * 1e3;
        let cells: Vec<String> = q.iter().map(|q| format!("{q:.9}")).collect();
        let difference = noise_mm * normal(1000 + row);
        writeln!(
            text,
            "{},{:.5},{:.5},{:.5},{difference:.5}",
            cells.join(","),
            point.x,
            point.y,
            point.z
        )
        .unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let minus = if minus.is_empty() {
        String::new()
    } else {
        format!("minus: {minus},")
    };
    for (name, text) in [
        ("robot.yaml", ROBOT),
        ("pipeline.yaml", &PIPELINE.replace("MINUS", &minus)),
        ("data.csv", &text),
    ] {
        put(folder.path(), name, text);
    }
    let output = calib(folder.path(), "run pipeline.yaml --json --quiet").code(0);
    output.out.clone()
}

#[test]
fn a_target_taken_for_the_measured_point_is_a_warning_and_noise_is_none() {
    let warning = "they are probably computed (a target, a nominal point), not measured; check the column mapping";
    assert_eq!(
        message_of("", 0.0).matches(warning).count(),
        2,
        "identify and validate say so"
    );
    assert_eq!(message_of("x_dif", 0.03).matches(warning).count(), 0);
}

//! A model moves the arm that it is of: tables of another robot are refused, bodies that cannot be are named, and the tool that was
//! identified is the tool that goes out.

use crate::answer::{fed, has, put};
use crate::compensate::{ROBOT, cell};
use crate::desk::shared;
use crate::fixture::robot_of;
use calib::robot::RobotModel;
use calib::robot::import::{RobotFileText, read_calib};
use calib::spatial::Pose;
use calib::table::{Parameters, Table, from_file};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use parquet::arrow::ArrowWriter;
use serde_json::Value;
use std::path::Path;

const PARAMETERS: &str = "identify.parameters.parquet";
const TARGETS: &str = "A1_deg,A2_deg,A3_deg,A4_deg,A5_deg,A6_deg\n10,20,-30,5,40,0\n";

fn message_of(folder: &Path, verb: &str) -> (Option<i32>, String, String) {
    let output = fed(folder, verb, TARGETS);
    (output.code, output.out, output.err)
}

#[test]
fn a_model_is_refused_for_another_robot_and_so_is_a_table_that_does_not_say_whose_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::copy(
        cell().join(".calib/tables/small").join(PARAMETERS),
        here.join(PARAMETERS),
    )
    .unwrap();
    put(
        here,
        "own.yaml",
        ROBOT.replace("limits: [-120, 120]", "limits: [-121, 120]"),
    );
    put(
        here,
        "renamed.yaml",
        ROBOT.replace("name: small", "name: large"),
    );
    put(
        here,
        "longer.yaml",
        ROBOT.replace("[0, 0, 900]", "[0, 0, 901]"),
    );
    let other = ROBOT
        .replace("name: small", "name: large")
        .replace("[0, 0, 900]", "[0, 0, 901]");
    put(here, "other.yaml", other);
    let verbs = [
        format!("compensate {PARAMETERS}"),
        format!("export {PARAMETERS} --format urdf"),
    ];
    for verb in verbs {
        // Limits are no part of what a model is of.
        let (code, _, printed) = message_of(here, &format!("{verb} --robot own.yaml"));
        assert_eq!(code, Some(0), "{printed}");
        for (robot, sentence) in [
            (
                "other.yaml",
                "table parameters: is the model of another robot, `small`, whose axes are not those of `large`",
            ),
            (
                "longer.yaml",
                "table parameters: is the model of `small` with other axes than this robot file has",
            ),
            (
                "renamed.yaml",
                "is the model of the robot `small`, and this robot file is of `large`, whose axes are the same",
            ),
        ] {
            let (code, out, printed) = message_of(here, &format!("{verb} --robot {robot}"));
            assert_eq!((code, out.as_str()), (Some(10), ""), "{robot}: {printed}");
            assert!(printed.contains(sentence), "{robot}: {printed}");
        }
    }
    // As an earlier calib wrote it, without a content hash.
    let mut table = from_file::<Parameters>(&here.join(PARAMETERS))
        .unwrap()
        .table;
    table
        .0
        .iter_mut()
        .for_each(|row| (row.robot, row.kinematics) = (None, None));
    let frame = table.to_frame().unwrap();
    let file = std::fs::File::create(here.join("older.parquet")).unwrap();
    let mut writer = ArrowWriter::try_new(file, frame.batch().schema(), None).unwrap();
    writer.write(frame.batch()).unwrap();
    writer.close().unwrap();
    for verb in ["compensate", "export --format urdf"] {
        let (code, out, printed) =
            message_of(here, &format!("{verb} older.parquet --robot renamed.yaml"));
        assert_eq!((code, out.as_str()), (Some(10), ""), "{printed}");
        let (code, _, printed) = message_of(
            here,
            &format!("{verb} older.parquet --robot renamed.yaml --unchecked"),
        );
        assert_eq!(code, Some(0), "{printed}");
        has(&printed, "does not say which robot it is the model of");
    }
}

#[test]
fn a_table_that_does_not_say_whose_model_it_is_is_refused_for_either_robot_unless_someone_takes_it()
{
    let Some(fault) = shared("review/faults/two_robots") else {
        return;
    };
    let path = |name: &str| fault.join(name).display().to_string();
    let [table, targets] = ["parameters.parquet", "tg.csv"].map(path);
    for robot in ["irb.yaml", "kr6.yaml"].map(path) {
        let ask = &format!("compensate {table} --robot {robot} {targets}");
        let (code, out, printed) = message_of(&fault, ask);
        assert_eq!((code, out.as_str()), (Some(10), ""), "{printed}");
        has(
            &printed,
            ["does not say which robot it is the model of", "--unchecked"],
        );
        let (code, _, printed) = message_of(&fault, &format!("{ask} --unchecked"));
        assert!(
            code == Some(0) && printed.contains("does not say which robot it is the model of"),
            "{printed}"
        );
    }
}

/// The URDF of a report: Link1's izz is 409 times ixx + iyy, Link2 has no moment about one axis.
const URDF: &str = r#"<robot name="rm6"><link name="base_link"/>
<link name="Link1"><inertial><origin xyz="0 0 0.1"/><mass value="1.5"/><inertia ixx="2.1E-3" ixy="0" ixz="0" iyy="2.0E-3" iyz="0" izz="1676359E-6"/></inertial></link>
<link name="Link2"><inertial><origin xyz="0.1 0 0"/><mass value="1.0"/><inertia ixx="1E-3" ixy="0" ixz="0" iyy="1E-3" iyz="0" izz="0"/></inertial></link>
<link name="tool0"/>
<joint name="j1" type="revolute"><parent link="base_link"/><child link="Link1"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="0" velocity="0"/></joint>
<joint name="j2" type="continuous"><parent link="Link1"/><child link="Link2"/><origin xyz="0 0 0.2" rpy="1.5708 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="f" type="fixed"><parent link="Link2"/><child link="tool0"/><origin xyz="0.3 0 0"/></joint>
</robot>
"#;

#[test]
fn inertias_of_no_body_are_named_by_their_links_and_refused_for_torques_alone() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "arm.urdf", URDF);
    let first = "arm.urdf:2: link `Link1`: no body has a principal moment of inertia of 408.868 times the sum of the other two";
    let second = "arm.urdf:3: link `Link2`: no body has a principal moment of inertia that is zero";
    let (code, _, printed) = message_of(here, "init cell --urdf arm.urdf");
    assert_eq!(code, Some(0), "{printed}");
    has(&printed, [first, second]);
    let pipeline = "calib: 1\nname: u\nseed: 1\nstages:\n  - uses: robot\n    with: {file: robot.yaml, urdf: arm.urdf}\n";
    put(here, "pipeline.yaml", pipeline);
    let robot = "calib_robot: 1\nunits: {length: mm, angle: deg}\nkinematics: {urdf: {base: base_link, tip: tool0}}\n";
    put(here, "robot.yaml", robot);
    let (code, out, printed) = message_of(here, "check pipeline.yaml");
    let all = format!("{out}{printed}");
    assert_eq!(code, Some(0), "{all}");
    has(&all, [first, second, "positions do not depend on it"]);
    let (code, _, printed) = message_of(here, "excite robot.yaml --urdf arm.urdf");
    assert_eq!(code, Some(10), "{printed}");
    has(
        &printed,
        "table robot: link 1: no body has a principal moment of inertia of 408.868 times",
    );
}

/// Poses of the cell's arm with its tool elsewhere, measured in full; the tool's point is shifted by `shift` (mm), its frame turned by 30 deg.
fn full_poses(shift: [f64; 3]) -> (String, Vector3<f64>) {
    let robot = robot_of(ROBOT);
    let mut moved = robot.clone();
    moved.tool = [0, 1, 2].map(|k| robot.tool[k] + shift[k] * 1e-3);
    let arm = RobotModel::new(moved.clone());
    let base =
        Pose::from_rotation_vector(Vector3::new(0.1, -0.2, 0.7), Vector3::new(1.2, -0.8, 0.4));
    let turned = Rotation3::new(Vector3::new(0.0, 30f64.to_radians(), 0.0)).into_inner();
    let mut text = String::from("q1,q2,q3,q4,q5,q6,x,y,z,qw,qx,qy,qz\n");
    for row in 0..60 {
        let share = |joint: usize| {
            (0.5 + 0.618_034 * (row as f64) * (1.0 + 0.37 * joint as f64)).fract() * 2.0 - 1.0
        };
        let q: Vec<f64> = [110.0, 55.0, 70.0, 150.0, 110.0, 150.0]
            .iter()
            .enumerate()
            .map(|(j, most)| most * share(j))
            .collect();
        let radians: Vec<f64> = q.iter().map(|degrees| degrees.to_radians()).collect();
        let pose = base * arm.forward(&radians);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
            pose.rotation * turned,
        ));
        let noise = |k: usize| 0.005 * ((row * 7 + k * 13) as f64).sin();
        let p = pose.translation * 1e3;
        let mut cells: Vec<String> = q.iter().map(|q| format!("{q:.9}")).collect();
        cells.extend((0..3).map(|k| format!("{:.6}", p[k] + noise(k))));
        cells.extend([turn.w, turn.i, turn.j, turn.k].map(|x| format!("{x:.12}")));
        text.push_str(&(cells.join(",") + "\n"));
    }
    (text, Vector3::from(moved.tool))
}

const MEASURED: &str = "calib: 1
name: full
seed: 1
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: poses.csv
          columns:
            q: {column: \"q{j}\", unit: deg}
            x: {column: x, unit: mm}
            y: {column: y, unit: mm}
            z: {column: z, unit: mm}
ORIENTATION
  - uses: split
    with: {by: every, n: 4}
  - id: geometry
    uses: identify
    with: {effects: [base_frame, tool_offset, joint_offset, link_geometry]}
";
const ORIENTATION: &str = "            orientation: {quaternion: [qw, qx, qy, qz]}\n            sigma_orientation: {value: 30, unit: arcsec}";

#[test]
fn the_identified_tool_goes_out_or_is_refused_whether_orientations_are_measured_or_not() {
    for (shift, is_refused) in [([12.0, -9.0, 20.0], false), ([94.0, 11.0, -36.0], true)] {
        let (poses, tool) = full_poses(shift);
        for orientation in [ORIENTATION, ""] {
            let folder = tempfile::tempdir().unwrap();
            let here = folder.path();
            put(here, "robot.yaml", ROBOT);
            put(here, "poses.csv", &poses);
            put(
                here,
                "pipeline.yaml",
                MEASURED.replace("ORIENTATION", orientation),
            );
            let export = "export pipeline.yaml --step geometry --format json";
            let (code, out, printed) = message_of(here, export);
            if is_refused {
                assert_eq!(
                    (code, out.as_str()),
                    (Some(10), ""),
                    "{orientation}: {printed}"
                );
                assert!(printed.contains("tool is 101."), "{orientation}: {printed}");
                let (code, _, printed) =
                    message_of(here, "compensate pipeline.yaml --step geometry");
                assert!(
                    code == Some(10) && printed.contains("tool is 101."),
                    "{orientation}: {printed}"
                );
            } else {
                assert_eq!(code, Some(0), "{orientation}: {printed}");
            }
            let (code, out, printed) = message_of(here, &format!("{export} --force"));
            assert_eq!(code, Some(0), "{orientation}: {printed}");
            let model: Value = serde_json::from_str(&out).unwrap();
            let found =
                Vector3::from([0, 1, 2].map(|k| model["tool"]["point_m"][k].as_f64().unwrap()));
            // The last zero turns the tool about its axis, so the point is compared where it is: within what a joint's zero does.
            assert!(
                (found - tool).norm() < 1e-4,
                "{orientation}: {found} instead of {tool}"
            );
            assert_eq!(
                printed.contains("the tool is the identified point"),
                !orientation.is_empty(),
                "{printed}"
            );
            let apart = printed
                .split("rigid geometry alone stands ")
                .nth(1)
                .and_then(|text| text.split(" mm").next());
            assert!(
                apart
                    .and_then(|mm| mm.parse::<f64>().ok())
                    .is_some_and(|mm| mm < 0.05),
                "{printed}"
            );
        }
    }
}

/// Factory numbers of a real UR5, written in mm and degrees; neighbouring axes 2, 3 and 4 are nearly parallel (github.com,
/// UniversalRobots/Universal_Robots_ROS_Driver, issue 457).
pub const FACTORY: &str = "calib_robot: 1
name: UR5 of its factory
units: {length: mm, angle: deg}
kinematics:
  dh:
    - {theta: -0.0005515862795130782, d: 88.8794492754001, a: 0.279332356195598, alpha: 89.97377351635724}
    - {theta: -82.33806877859622, d: 574241.3845794561, a: -56.6854832098269, alpha: -0.04204899604596786}
    - {theta: 116.04865943980298, d: -507363.40209816804, a: -326.46702272051, alpha: 0.1865592729591728}
    - {theta: -33.70451094100497, d: -66767.6839353205, a: 0.0149388687216263, alpha: 89.9772951184475}
    - {theta: 0.0023700249666705636, d: 94.9734691141216, a: 0.000223692592990586, alpha: -90.01224276111223}
    - {theta: 0.0004683211769942338, d: 82.56250145549531, a: 0, alpha: 0.0}
";

#[test]
fn every_export_of_an_arm_with_nearly_parallel_axes_is_the_same_arm_when_it_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", FACTORY);
    let pipeline = "calib: 1
name: factory
seed: 2
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: simulate
    with:
      truth: {offset_deg: [0, -0.05, 0.04, 0.03, -0.06, 0]}
      poses: {range_deg: [[-120, 120], [-120, -40], [-90, 90], [-120, 120], [-120, 120], [-120, 120]], floor_mm: -5000, clearance_mm: 0}
      blocks: [{usage: fit, points: 40}]
  - uses: split
    with: {by: usage}
  - uses: identify
    with: {on: [fit], effects: [base_frame, joint_offset]}
";
    put(here, "pipeline.yaml", pipeline);
    let exported = |format: &str| {
        let (code, out, printed) = message_of(
            here,
            &format!("export pipeline.yaml --format {format} --force"),
        );
        assert_eq!(code, Some(0), "{printed}");
        out
    };
    let file = |text: &str, urdf: Option<&str>| {
        let urdf = urdf.map(|text| RobotFileText {
            label: "arm.urdf",
            text,
        });
        RobotModel::new(
            read_calib(
                RobotFileText {
                    label: "robot.yaml",
                    text,
                },
                urdf,
            )
            .unwrap()
            .robot,
        )
    };
    let urdf_units = "calib_robot: 1\nunits: {length: mm, angle: deg}\nkinematics:\n  urdf: {base: base_link, tip: tool0}\n";
    let urdf = file(urdf_units, Some(&exported("urdf")));
    for format in ["dh", "mdh"] {
        let table = file(&exported(format), None);
        for k in 0..200 {
            let q: Vec<f64> = (0..6)
                .map(|j| 2.0 * (1.3 * k as f64 + 0.7 * j as f64).sin())
                .collect();
            let apart = (table.forward(&q).translation - urdf.forward(&q).translation).norm();
            // A double holds a kilometre to 1e-13 m; URDF is written to nanometres.
            assert!(apart < 1e-8, "{format}: {apart} m");
        }
    }
}

#[test]
fn a_run_knows_its_robot() {
    let (code, out, printed) = message_of(cell(), "compensate HEAD --robot other.yaml");
    assert_eq!((code, out.as_str()), (Some(2), ""), "{printed}");
    has(
        &printed,
        "--robot: is of tables of parameters alone; a run or a pipeline knows its robot",
    );
}

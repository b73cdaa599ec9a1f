//! The YAML examples of the pages are what calib reads.

use calib::pipeline::Plan;
use calib::robot::import::{RobotFileText, read_calib};
use calib::stage::STAGES;
use std::path::Path;

/// The only YAML block of the pages about files that contains `key` at the start of a line.
pub fn example(key: &str) -> String {
    let pages = ["pipelines/README.md", "schemas/README.md"].map(|page| {
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).expect("a page")
    });
    let blocks = pages.iter().flat_map(|text| {
        text.split("```yaml\n")
            .skip(1)
            .filter_map(|tail| tail.split_once("```"))
    });
    let found: Vec<&str> = blocks
        .map(|(block, _)| block)
        .filter(|block| block.lines().any(|line| line.starts_with(key)))
        .collect();
    assert_eq!(found.len(), 1, "{key}");
    found[0].to_string()
}

#[test]
fn the_robot_file_of_the_pages_is_read() {
    let text = example("calib_robot:");
    let robot = read_calib(
        RobotFileText {
            label: "schemas/README.md",
            text: &text,
        },
        None,
    )
    .unwrap_or_else(|e| panic!("{e}"))
    .robot;
    assert_eq!(robot.joints.len(), 6);
    // Its one twist is the axis of a wrist: through the axis of joint 4, parallel to joint 3.
    let wrist = &robot.joints[4];
    assert_eq!(wrist.axis, [0.0, -1.0, 0.0]);
    assert!((wrist.point[0] - 1.594).abs() < 1e-12 && (wrist.point[2] - 1.310).abs() < 1e-12);
}

#[test]
fn the_pipeline_of_the_pages_is_understood() {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    put("robot.yaml", &example("calib_robot:"));
    put("monday/controller.csv", "");
    put("monday/tracker.csv", "");
    put("pipeline.yaml", &example("stages:"));
    let plan = Plan::load(&folder.path().join("pipeline.yaml"), &[], STAGES)
        .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(plan.stages.len(), 7);
}

#[test]
fn the_fleet_file_of_the_pages_is_understood() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("FLEET.yaml");
    std::fs::write(&file, example("robots:")).expect("a file");
    let (fleet, _) = calib::fleet::FleetFile::load(&file).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        (
            fleet.robots.len(),
            fleet.previous.map(|previous| previous.stage)
        ),
        (2, Some("compare".to_string()))
    );
}

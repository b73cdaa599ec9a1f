//! Files by a pattern, names by their paths, and what is refused with the place in the YAML.

use crate::answer::has;
use calib::pipeline::Plan;
use calib::stage::STAGES;
use std::path::Path;

const ROBOT: &str = "
calib_robot: 1
units: {length: mm, angle: deg}
kinematics:
  dh:
    - {theta: 0, d: 0, a: 300, alpha: 0}
    - {theta: 0, d: 0, a: 200, alpha: 90}
tool: {point: [0, 0, 0]}
";

/// A folder with three files of joints at two positions, and the pipeline that reads it.
fn folder(columns: &str, file: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("robot.yaml", ROBOT);
    for (name, rows) in [
        ("front/hole_0.csv", "0.1,0.2\n0.3,0.4\n"),
        ("front/hole_1.csv", "0.5,0.6\n"),
        ("back/hole_0.csv", "0.7,0.8\n"),
    ] {
        write(&format!("data/{name}"), rows);
    }
    write("data/front/hole_0_pose.csv", "1,2,3,4,5,6,7\n");
    let yaml = format!(
        "calib: 1\nname: files\nstages:\n  - uses: robot\n    with: {{file: robot.yaml}}\n  - uses: ingest\n    with:\n      \
         files:\n        - file: {file}\n          header: false\n          columns:\n            q: {{columns: [1, 2], unit: rad}}\n{columns}      \
         join: {{by: append}}\n"
    );
    write("pipeline.yaml", &yaml);
    folder
}

fn plan(folder: &Path) -> Result<Plan, String> {
    Plan::load(&folder.join("pipeline.yaml"), &[], STAGES).map_err(|error| error.to_string())
}

fn refused(columns: &str, file: &str) -> String {
    plan(folder(columns, file).path()).err().unwrap()
}

const NAMED: &str = "            socket: {path: \"{position}/hole_{n}.csv\"}\n            sigma_socket: {value: 0.1, unit: mm}\n";

#[test]
fn a_pattern_stands_for_its_files_and_paths_name_the_sockets() {
    let folder = folder(NAMED, "data/*/hole_?.csv");
    let plan = plan(folder.path()).unwrap();
    let ingest = &plan.stages[1];
    let named: Vec<String> = ingest
        .files
        .iter()
        .map(|file| file.named.display().to_string())
        .collect();
    assert_eq!(
        named,
        [
            "data/back/hole_0.csv",
            "data/front/hole_0.csv",
            "data/front/hole_1.csv"
        ]
    );
    let settings = ingest.stage.settings();
    let sockets: Vec<&str> = (0..3)
        .map(|k| {
            settings["files"][k]["columns"]["socket"]["value"]
                .as_str()
                .unwrap()
        })
        .collect();
    assert_eq!(sockets, ["back/0", "front/0", "front/1"]);
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let none = refused(NAMED, "data/*/socket_?.csv");
    has(&none, ["stages[1].with.files[0].file", "no file matches"]);
    let path = refused(
        &NAMED.replace("hole_{n}", "socket_{n}"),
        "data/*/hole_?.csv",
    );
    has(&path, ["files[0].columns.socket.path", "does not end like"]);
    let alone = refused("            socket: {value: a}\n", "data/back/hole_0.csv");
    has(&alone, "map `socket` and `sigma_socket` together");
    let distance = "            distance: {value: 0, unit: mm}\n            sigma_distance: {value: 0.1, unit: mm}\n";
    let nought = refused(distance, "data/back/hole_0.csv");
    has(&nought, ["columns.distance", "`socket: {column: ...}`"]);
}

//! The JSON Schema of the pipeline's YAML: what editors complete from.

use crate::answer::{read, root};
use calib::pipeline::json_schema;
use calib::stage::STAGES;
use std::collections::BTreeSet;
use std::path::PathBuf;

#[test]
fn the_schema_in_the_repository_is_that_of_the_code() {
    let path = root("schemas/pipeline.v1.schema.json");
    let kept = read(&path);
    assert!(
        kept == json_schema(STAGES),
        "out of date; make it anew with: cargo run -- schema pipeline > schemas/pipeline.v1.schema.json"
    );
}

#[test]
fn every_stage_is_registered_once_and_documented() {
    let names: BTreeSet<&str> = STAGES.iter().map(|entry| entry.name).collect();
    assert_eq!(names.len(), STAGES.len());
    for entry in STAGES {
        assert!(
            !entry.summary.is_empty() && entry.implementation > 0,
            "{}",
            entry.name
        );
        for port in (entry.reads)().iter().chain(&(entry.writes)()) {
            assert!(
                calib::table::TABLES.contains(&port.kind),
                "{}: no table `{}`",
                entry.name,
                port.kind
            );
        }
    }
}

#[test]
fn every_stage_is_in_the_list() {
    let folders = ["src/stage", "src/stage/ingest"].map(root);
    let entries = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let files = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file());
    let declared = |path: PathBuf| {
        let text = read(path);
        text.matches("\nimpl Stage for ").count()
    };
    let stages: usize = files.map(declared).sum();
    assert_eq!(
        stages,
        STAGES.len(),
        "a stage is missing in STAGES (src/stage/mod.rs)"
    );
}

#[test]
fn the_schema_of_fleet_files_is_that_of_their_type() {
    let file = root("schemas/fleet.v1.schema.json");
    let fresh = calib::fleet::file::json_schema();
    assert!(
        read(file) == fresh,
        "run: calib schema fleet > schemas/fleet.v1.schema.json"
    );
}

//! Every pipeline of the repository: checked, and run where its data are at hand.

use crate::answer::{put, read};
use crate::desk::{self, shared};
use calib::error::Error;
use calib::pipeline::{Override, Plan};
use calib::stage::STAGES;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pipelines() -> Vec<PathBuf> {
    let folders = std::fs::read_dir(root().join("pipelines"))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = folders
        .map(|folder| folder.join("pipeline.yaml"))
        .filter(|file| file.is_file())
        .collect();
    files.sort();
    files
}

/// What keeps a pipeline from running here: files that are not in the repository.
fn missing_data(file: &Path, settings: &[String]) -> Option<String> {
    let stated = settings.iter().skip(1).step_by(2);
    let overrides: Vec<Override> = stated.map(|text| Override::parse(text).unwrap()).collect();
    match Plan::load(file, &overrides, STAGES) {
        Ok(_) => None,
        Err(Error::Spec(faults))
            if faults
                .iter()
                .all(|fault| fault.message.starts_with("no such file")) =>
        {
            Some(
                faults
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join("\n"),
            )
        }
        Err(error) => panic!("{error}"),
    }
}

/// Settings with which a pipeline runs every stage that it has in seconds instead of minutes: fewer seeds, every sixth row.
fn shorter(name: &str, folder: &Path) -> Vec<String> {
    const SERIES: &str = "Series_C/measurements_random_poses.csv";
    const GRID: &str = "3D_UR5_uncalibrated_grid_cleaned.csv";
    const RANDOM: &str = "3D_UR5_uncalibrated_random_cleaned.csv";
    let thinned = |text: &str| {
        let (header, rows) = text.split_once('\n').unwrap();
        let kept = std::iter::once(header).chain(rows.lines().step_by(6));
        kept.collect::<Vec<_>>().join("\n")
    };
    let set = |target: &str| ["--set".to_string(), target.to_string()];
    match name {
        "pipelines/swarm/pipeline.yaml" => [set("table2.seeds=20"), set("ten.seeds=3")].concat(),
        "pipelines/ur10/pipeline.yaml" => {
            let Some(data) = shared("data/ipa_ur10") else {
                return Vec::new();
            };
            let whole = read(data.join(SERIES));
            std::fs::create_dir_all(folder.join("Series_C")).unwrap();
            put(folder, SERIES, thinned(&whole));
            set(&format!("data={}", folder.display())).to_vec()
        }
        "pipelines/ur5/pipeline.yaml" => {
            let Some(data) = shared("data/ur5_gts3800") else {
                return Vec::new();
            };
            put(folder, GRID, thinned(&read(data.join(GRID))));
            put(folder, RANDOM, read(data.join(RANDOM)));
            let sets = set("split.sets=[{set: fit, rows: 167}, {set: validate}]");
            [set(&format!("data={}", folder.display())), sets].concat()
        }
        _ => Vec::new(),
    }
}

/// Tables and records below a store with when they were written.
fn store_files(store: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let mut found = BTreeMap::new();
    for kind in ["store/objects", "store/actions"] {
        for folder in std::fs::read_dir(store.join(kind)).unwrap().flatten() {
            for entry in std::fs::read_dir(folder.path()).unwrap().flatten() {
                found.insert(entry.path(), entry.metadata().unwrap().modified().unwrap());
            }
        }
    }
    assert!(!found.is_empty());
    found
}

/// Errors and verdict of the first example, to the digits that the README prints.
fn ends_as_the_readme_says(printed: &str) {
    let readme = read(root().join("README.md"));
    let (_, block) = readme.split_once("```text\n").unwrap();
    let (block, _) = block.split_once("```").unwrap();
    let told = ["before ", "after ", "verdict "];
    for line in block
        .lines()
        .filter(|line| told.iter().any(|word| line.starts_with(word)))
    {
        assert!(printed.contains(line), "{line}\n{printed}");
    }
}

#[test]
fn every_pipeline_is_sound_and_runs_where_its_data_are() {
    assert!(pipelines().len() >= 3);
    for file in pipelines() {
        let name = file.strip_prefix(root()).unwrap().display().to_string();
        let store = tempfile::tempdir().unwrap();
        let settings = shorter(&name, store.path());
        if let Some(missing) = missing_data(&file, &settings) {
            desk::missing(&format!(
                "{name}: {}",
                missing.lines().next().unwrap_or_default()
            ));
            continue;
        }
        let run = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
            command
                .arg("run")
                .arg(&file)
                .args(&settings)
                .arg("--store")
                .arg(store.path().join("store"));
            command.output().unwrap()
        };
        let first = run();
        assert!(
            first.status.success(),
            "{name}:\n{}",
            String::from_utf8_lossy(&first.stderr)
        );
        if name == "pipelines/sr210d/pipeline.yaml" {
            ends_as_the_readme_says(&String::from_utf8_lossy(&first.stdout));
        }
        let made = store_files(store.path());
        let second = run();
        let printed = String::from_utf8_lossy(&second.stdout);
        assert!(
            second.status.success() && printed.contains("nothing to do: "),
            "{name}:\n{printed}"
        );
        assert_eq!(
            store_files(store.path()),
            made,
            "{name}: the second run wrote no table and no record anew"
        );
    }
}

#[test]
fn every_pipeline_names_its_schema_for_editors() {
    for file in pipelines() {
        let text = read(&file);
        let first = text.lines().next().unwrap_or_default();
        let path = first
            .strip_prefix("# yaml-language-server: $schema=")
            .unwrap_or_else(|| panic!("{}: {first}", file.display()));
        assert!(
            file.parent().unwrap().join(path).is_file(),
            "{}: {path}",
            file.display()
        );
    }
}

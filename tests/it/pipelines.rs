//! Every pipeline of the repository: checked, and run where its data are at hand.

use calib::error::Error;
use calib::pipeline::Plan;
use calib::stage::STAGES;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pipelines() -> Vec<PathBuf> {
    let folders = std::fs::read_dir(root().join("pipelines")).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = folders.map(|folder| folder.join("pipeline.yaml")).filter(|file| file.is_file()).collect();
    files.sort();
    files
}

/// What keeps a pipeline from running here: files that are not in the repository.
fn missing_data(file: &Path) -> Option<String> {
    match Plan::load(file, &[], STAGES) {
        Ok(_) => None,
        Err(Error::Spec(faults)) if faults.iter().all(|fault| fault.message.starts_with("no such file")) => {
            Some(faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn every_pipeline_is_sound_and_runs_where_its_data_are() {
    assert!(pipelines().len() >= 3);
    for file in pipelines() {
        let name = file.strip_prefix(root()).unwrap().display().to_string();
        if let Some(missing) = missing_data(&file) {
            assert!(std::env::var_os("CI").is_none(), "{name}: nothing may be skipped in CI\n{missing}");
            println!("skipped {name}, whose data are not here:\n{missing}");
            continue;
        }
        let store = tempfile::tempdir().unwrap();
        let run = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
            command.arg("run").arg(&file).arg("--store").arg(store.path().join("store"));
            command.output().unwrap()
        };
        let first = run();
        assert!(first.status.success(), "{name}:\n{}", String::from_utf8_lossy(&first.stderr));
        let begun = std::time::Instant::now();
        let second = run();
        let seconds = begun.elapsed().as_secs_f64();
        let said = String::from_utf8_lossy(&second.stdout);
        assert!(second.status.success() && said.contains("nothing to do: all "), "{name}:\n{said}");
        assert!(seconds < 1.0, "{name}: the second run took {seconds:.1} s");
    }
}

#[test]
fn every_pipeline_names_its_schema_for_editors() {
    for file in pipelines() {
        let text = std::fs::read_to_string(&file).unwrap();
        let first = text.lines().next().unwrap_or_default();
        let path =
            first.strip_prefix("# yaml-language-server: $schema=").unwrap_or_else(|| panic!("{}: {first}", file.display()));
        assert!(file.parent().unwrap().join(path).is_file(), "{}: {path}", file.display());
    }
}

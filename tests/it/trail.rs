//! The audit trail: runs listed, explained, compared, traced; a store verified bit by bit, and swept.

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn pipeline() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/resume/pipeline.yaml")
}
fn calib(store: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calib")).args(arguments).arg("--store").arg(store).output().unwrap()
}
fn run(store: &Path, arguments: &[&str]) {
    let pipeline = pipeline();
    let output = calib(store, &[&["run", pipeline.to_str().unwrap(), "--quiet"], arguments].concat());
    assert!(output.status.success(), "{}", text(&output));
}
fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}
fn said(store: &Path, arguments: &[&str]) -> String {
    let output = calib(store, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output));
    text(&output)
}
fn json(store: &Path, arguments: &[&str]) -> Value {
    serde_json::from_slice(&calib(store, &[arguments, &["--json"]].concat()).stdout).unwrap()
}
/// All files of a store but its locks.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}
/// Changes a file in place through every name that it has.
fn overwrite(path: &Path, bytes: &[u8]) {
    let mut permissions = path.metadata().unwrap().permissions();
    let kept = permissions.clone();
    #[allow(clippy::permissions_set_readonly_false)] // the file is put back as it was
    permissions.set_readonly(false);
    std::fs::set_permissions(path, permissions).unwrap();
    std::fs::write(path, bytes).unwrap();
    std::fs::set_permissions(path, kept).unwrap();
}

#[test]
fn a_changed_setting_is_told_with_its_stage_and_by_how_much() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, &[]);
    run(store, &["--set", "geometry.effects=[base_frame, tool_offset, joint_offset]"]);
    let output = calib(store, &["diff", "HEAD~1", "HEAD"]);
    let told = text(&output);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.lines().count() < 20, "{told}");
    assert!(told.contains("settings geometry.effects: "), "{told}");
    assert!(told.contains("geometry.parameters") && told.contains("geometry.prediction"), "{told}");
    assert!(
        told.contains("error_mm by ") && told.contains(" mm rms, at most ") && told.contains(" mm (") && told.contains(" sigma)"),
        "{told}"
    );
    assert!(!told.contains("nominal."), "what is the same is not told: {told}");
    let explained = said(store, &["explain", "geometry"]);
    assert!(explained.contains("executed, because: settings changed: geometry.effects"), "{explained}");
    let explained = said(store, &["explain", "validate"]);
    assert!(explained.contains("input prediction (geometry): ") && !explained.contains("(nominal)"), "{explained}");
    assert!(said(store, &["explain", "nominal"]).contains("nothing that it depends on changed"));
    assert_eq!(calib(store, &["diff", "HEAD", "HEAD"]).status.code(), Some(0));
    let table = json(store, &["diff", "HEAD~1/geometry/prediction", "HEAD/geometry/prediction"]);
    assert_eq!((&table["rows"]["changed"], &table["key"][0]), (&80.into(), &"sequence".into()));
}

#[test]
fn runs_are_listed_shown_tagged_and_their_tables_traced() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, &["--set", "seed=12"]);
    run(store, &[]);
    assert!(said(store, &["tag", "HEAD~1", "first"]).starts_with("first is run "));
    let log = said(store, &["log"]);
    assert_eq!(log.lines().count(), 2, "{log}");
    assert!(log.lines().next().unwrap().contains("resume  done, 7 run, 0 cached") && log.contains("[first]"), "{log}");
    let shown = said(store, &["show", "first"]);
    assert!(shown.contains("set on the command line: seed = 12") && shown.contains("because: never run"), "{shown}");
    assert!(said(store, &["show", "first/geometry"]).contains("reads   recording <- simulate.recording, 80 rows"));
    assert_eq!(said(store, &["show", "HEAD", "--yaml"]), std::fs::read_to_string(pipeline()).unwrap());
    let manifest = json(store, &["show", "HEAD"]);
    assert_eq!(manifest["previous"]["run"], json(store, &["show", "first"])["run_id"]);
    let traced = said(store, &["lineage", "HEAD/validate/statistics"]);
    assert!(traced.contains("recording <- simulate.recording") && traced.contains("file robot.yaml"), "{traced}");
    let table = store.join("tables/resume/validate.statistics.parquet");
    assert_eq!(said(store, &["lineage", table.to_str().unwrap()]), traced);
    let refused = calib(store, &["show", "fisrt"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused).contains("did you mean the tag `first`?"), "{}", text(&refused));
    assert_eq!(said(store, &["tag", "--delete", "first"]), "");
    assert_eq!(said(store, &["tag"]), "");
}

#[test]
fn one_flipped_bit_in_any_file_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, &[]);
    run(store, &["--set", "split.by=every", "--set", "split.n=4"]);
    said(store, &["tag", "HEAD", "kept"]);
    let clean = said(store, &["verify"]);
    assert!(clean.contains("2 runs, 1 tag,") && clean.ends_with("all as they were written\n"), "{clean}");
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let files: Vec<PathBuf> = files(store).into_iter().filter(|path| !path.starts_with(store.join("locks"))).collect();
    assert!(files.len() > 50, "{}", files.len());
    for path in files {
        let whole = std::fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        let bit = random.random_range(0..whole.len() * 8);
        flipped[bit / 8] ^= 1 << (bit % 8);
        overwrite(&path, &flipped);
        let output = calib(store, &["verify"]);
        assert_eq!(output.status.code(), Some(1), "bit {bit} of {}: {}", path.display(), text(&output));
        overwrite(&path, &whole);
    }
    assert_eq!(said(store, &["verify"]), clean);
    // A manifest that was written anew, seal and all, is not the one that the next run saw.
    let runs: Vec<PathBuf> =
        self::files(&store.join("runs")).into_iter().filter(|path| path.ends_with("manifest.json")).collect();
    let manifest = std::fs::read_to_string(&runs[0]).unwrap();
    let body = manifest.split(",\n  \"sealed\"").next().unwrap().replacen("\"seed\": 11", "\"seed\": 12", 1);
    let forged = format!("{body},\n  \"sealed\": \"{}\"\n}}\n", blake3::hash(body.as_bytes()).to_hex());
    overwrite(&runs[0], forged.as_bytes());
    let output = calib(store, &["verify"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("has changed since this run began"), "{}", text(&output));
}

#[test]
fn a_sweep_leaves_what_tags_and_the_last_runs_need() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    for seed in ["1", "2", "3"] {
        run(store, &["--set", &format!("seed={seed}")]);
    }
    said(store, &["tag", "HEAD~2", "released"]);
    let sweep = ["gc", "--keep-runs", "1", "--grace-hours", "0"];
    assert_eq!(json(store, &["gc", "--keep-runs", "1"])["actions"], 0, "what is young stays");
    let would = json(store, &[&sweep[..], &["--dry-run"]].concat());
    let before = files(&store.join("objects")).len();
    let swept = json(store, &sweep);
    assert_eq!(would, swept);
    assert_eq!(files(&store.join("objects")).len() as u64, before as u64 - swept["objects"].as_u64().unwrap());
    assert_eq!(swept["actions"], 7, "the stages of the run between");
    let executed = |seed: &str| {
        let pipeline = pipeline();
        let result = json(store, &["run", pipeline.to_str().unwrap(), "--quiet", "--set", &format!("seed={seed}")]);
        result["stages"].as_array().unwrap().iter().filter(|stage| stage["status"] == "executed").count()
    };
    said(store, &["verify"]);
    assert_eq!((executed("1"), executed("3"), executed("2")), (0, 0, 7));
}

#[test]
fn the_last_run_is_the_last_also_where_the_clock_went_backwards() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, &[]);
    // A run of the far future, as a clock that was wrong leaves it.
    let runs = store.join("runs");
    let real = std::fs::read_dir(&runs).unwrap().next().unwrap().unwrap().path();
    let future = ulid::Ulid::from_parts(1 << 45, 7).to_string();
    std::fs::rename(real, runs.join(&future)).unwrap();
    run(store, &["--set", "seed=5"]);
    let manifest = json(store, &["show", "HEAD"]);
    assert_eq!((&manifest["seed"], manifest["run_id"].as_str().unwrap() > future.as_str()), (&5.into(), true));
}

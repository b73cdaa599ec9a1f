//! The audit trail: runs listed, explained, compared, traced; a store verified bit by bit, and swept.

use crate::answer::Words;
use crate::answer::{self, Answer, ends_with, has, put, root, starts_with};
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

fn pipeline() -> PathBuf {
    root("tests/it/resume/pipeline.yaml")
}
fn calib(store: &Path, words: &str) -> Answer {
    stored(store, words.words())
}
fn stored(store: &Path, mut words: Vec<OsString>) -> Answer {
    words.extend(["--store".into(), store.into()]);
    answer::calib(".", &words)
}
fn run(store: &Path, more: &str) {
    calib(
        store,
        &format!("run {} --quiet {more}", pipeline().display()),
    )
    .ok();
}
fn text(answer: &Answer) -> String {
    answer.both()
}
fn message_of(store: &Path, words: &str) -> String {
    calib(store, words).code(0).both()
}
fn json(store: &Path, words: &str) -> Value {
    calib(store, &format!("{words} --json")).json()
}
/// All files of a store but its locks.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
    {
        if path.is_dir() {
            found.extend(files(&path))
        } else {
            found.push(path)
        }
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
    run(store, "");
    run(
        store,
        "--set 'geometry.effects=[base_frame, tool_offset, joint_offset]'",
    );
    let output = calib(store, "diff HEAD~1 HEAD");
    let printed = text(&output);
    assert_eq!(output.code, Some(1), "{printed}");
    assert!(printed.lines().count() < 20, "{printed}");
    has(&printed, "settings geometry.effects: ");
    has(&printed, ["geometry.parameters", "geometry.prediction"]);
    has(
        &printed,
        ["error_mm by ", " mm rms, at most ", " mm (", " sigma)"],
    );
    assert!(
        !printed.contains("nominal."),
        "what is the same is not told: {printed}"
    );
    let explained = message_of(store, "explain geometry");
    has(
        &explained,
        "executed, because: settings changed: geometry.effects",
    );
    let explained = message_of(store, "explain validate");
    assert!(
        explained.contains("input prediction (geometry): ") && !explained.contains("(nominal)"),
        "{explained}"
    );
    assert!(message_of(store, "explain nominal").contains("nothing that it depends on changed"));
    assert_eq!(calib(store, "diff HEAD HEAD").code, Some(0));
    let table = json(
        store,
        "diff HEAD~1/geometry/prediction HEAD/geometry/prediction",
    );
    assert_eq!(
        (&table["rows"]["changed"], &table["key"][0]),
        (&80.into(), &"sequence".into())
    );
}

#[test]
fn of_two_runs_tolerances_hold_in_every_table_that_has_the_column() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, "");
    run(store, "--set seed=12");
    let with = |more: &str| calib(store, &format!("diff HEAD~1/validate HEAD/validate {more}"));
    assert_eq!(with("").code, Some(1));
    let within = with("--atol 1e6").code(0);
    has(&text(&within), "within tolerance");
    assert_eq!(
        with("--atol mean_mm=1m --rtol 1e-9").code,
        Some(1),
        "the other columns differ"
    );
    // Of the run's tables few have the column.
    assert_eq!(
        calib(store, "diff HEAD~1 HEAD --ignore mean_mm").code,
        Some(1)
    );
    let refused = |flag: &str, value: &str, why: &str| {
        let output = calib(store, &format!("diff HEAD~1 HEAD {flag} {value}"));
        let printed = text(&output);
        assert!(output.code == Some(2) && printed.contains(why), "{printed}");
    };
    refused(
        "--ignore",
        "meen_mm",
        "--ignore: no column `meen_mm` in any table that both runs have; did you mean `mean_mm`?",
    );
    refused(
        "--atol",
        "nowhere_mm=1",
        "--atol: no column `nowhere_mm` in any table that both runs have",
    );
    refused(
        "--key",
        "step",
        "--key: is for two tables: name them as RUN/STAGE/PORT",
    );
    refused(
        "--quaternion",
        "a,b,c,d",
        "--quaternion: is for two tables: name them as RUN/STAGE/PORT",
    );
}

#[test]
fn a_limit_that_is_exceeded_is_said_and_ends_with_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    let file = pipeline();
    let with = |limits: &str, more: &str| {
        let set = format!("--set 'report.limits={limits}'");
        calib(
            store,
            &format!("run {} --quiet {set} {more}", file.display()),
        )
    };
    for _ in 0..2 {
        let beyond = with("{mean_mm: 0.000001, max_mm: 500}", "");
        let printed = text(&beyond);
        assert_eq!(beyond.code, Some(1), "{printed}");
        let line = printed
            .lines()
            .find(|line| line.starts_with("limits    "))
            .unwrap_or_else(|| panic!("{printed}"));
        starts_with(
            line,
            "limits    not accepted: beyond the limits at 20 held-out points of set validate, step geometry",
        );
        assert!(
            line.contains("mean 0.")
                && line.contains("mm, at most 0.000001 mm allowed")
                && !line.contains("largest"),
            "{line}"
        );
    }
    let document = with("{mean_mm: 0.000001}", "--json");
    let read: Value = document.json();
    assert_eq!(
        (document.code, &read["status"], &read["accepted"]),
        (Some(1), &"done".into(), &false.into())
    );
    assert_eq!(
        (&read["limits"][0]["stage"], &read["limits"][0]["kept"]),
        (&"report".into(), &false.into())
    );
    let kept = with("{mean_mm: 500}", "");
    let printed = text(&kept);
    assert!(
        kept.code == Some(0)
            && printed.contains("limits    accepted: within the limits at 20 held-out points"),
        "{printed}"
    );
    let none = calib(store, &format!("run {} --quiet", file.display()));
    assert!(
        none.code == Some(0) && text(&none).lines().all(|line| !line.starts_with("limits")),
        "{}",
        text(&none)
    );
}

#[test]
fn runs_are_listed_shown_tagged_and_their_tables_traced() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, "--set seed=12");
    run(store, "");
    assert!(message_of(store, "tag HEAD~1 first").starts_with("first is run "));
    let log = message_of(store, "log");
    assert_eq!(log.lines().count(), 2, "{log}");
    assert!(
        log.lines()
            .next()
            .unwrap()
            .contains("resume  done, 7 run, 0 cached")
            && log.contains("[first]"),
        "{log}"
    );
    let shown = message_of(store, "show first");
    has(
        &shown,
        ["set on the command line: seed = 12", "because: never run"],
    );
    assert!(
        message_of(store, "show first/geometry")
            .contains("reads   recording <- simulate.recording, 80 rows")
    );
    assert_eq!(
        message_of(store, "show HEAD --yaml"),
        std::fs::read_to_string(pipeline()).unwrap()
    );
    let manifest = json(store, "show HEAD");
    assert_eq!(
        manifest["previous"]["run"],
        json(store, "show first")["run_id"]
    );
    let traced = message_of(store, "lineage HEAD/validate/statistics");
    has(
        &traced,
        ["recording <- simulate.recording", "file robot.yaml"],
    );
    let table = store.join("tables/resume/validate.statistics.parquet");
    assert_eq!(
        message_of(store, &format!("lineage {}", table.display())),
        traced
    );
    let refused = calib(store, "show fisrt").code(2);
    has(&text(&refused), "did you mean the tag `first`?");
    assert_eq!(message_of(store, "tag --delete first"), "");
    assert_eq!(message_of(store, "tag"), "");
}

#[test]
fn a_tag_has_not_the_form_of_an_id_and_says_which_run_it_left() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, "--set seed=12");
    run(store, "");
    let [old, new] = ["HEAD~1", "HEAD"].map(|name| {
        json(store, &format!("show {name}"))["run_id"]
            .as_str()
            .unwrap()
            .to_string()
    });
    for name in [
        old.clone(),
        old.to_lowercase(),
        ulid::Ulid::from_parts(1 << 45, 7).to_string(),
    ] {
        let refused = calib(store, &format!("tag HEAD {name}")).code(2);
        has(
            &text(&refused),
            &format!("tag {name}: has the form of a run's id"),
        );
    }
    assert_eq!(json(store, &format!("show {old}"))["run_id"], old.as_str());
    assert_eq!(
        message_of(store, "tag HEAD~1 first"),
        format!("first is run {old}\n")
    );
    assert_eq!(
        message_of(store, "tag HEAD first"),
        format!("first is run {new}, was run {old}\n")
    );
    assert_eq!(
        message_of(store, "tag HEAD first"),
        format!("first is run {new}\n")
    );
}

#[cfg(target_os = "linux")]
#[test]
fn folders_whose_names_are_no_text_are_used_all_the_same() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let named = |bytes: &[u8]| folder.path().join(std::ffi::OsStr::from_bytes(bytes));
    let (cell, store) = (named(b"cell\xff\xfe"), named(b"store\xff"));
    std::fs::create_dir(&cell).unwrap();
    let robot = root("pipelines/sr210d/robot.yaml");
    std::fs::copy(robot, cell.join("robot.yaml")).unwrap();
    let yaml = std::fs::read_to_string(pipeline())
        .unwrap()
        .replace("../../../pipelines/sr210d/robot.yaml", "robot.yaml");
    put(&cell, "p.yaml", yaml);
    let run = [
        "run".into(),
        cell.join("p.yaml").into_os_string(),
        "-q".into(),
        "--json".into(),
    ];
    let document = stored(&store, run.into()).code(0).json();
    assert!(
        document["report"]
            .as_str()
            .unwrap()
            .contains("/store\u{fffd}/documents/"),
        "{document}"
    );
    let manifest = json(&store, "show HEAD");
    let path = manifest["stages"][0]["files"][0]["path"].as_str().unwrap();
    ends_with(path, "/cell\u{fffd}\u{fffd}/robot.yaml");
    assert!(message_of(&store, "log").contains("resume  done, 7 run, 0 cached"));
}

#[test]
fn one_flipped_bit_in_any_file_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, "");
    run(store, "--set split.by=every --set split.n=4");
    message_of(store, "tag HEAD kept");
    let clean = message_of(store, "verify");
    ends_with(&clean, "all as they were written\n");
    has(&clean, "2 runs, 1 tag,");
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let files: Vec<PathBuf> = files(store)
        .into_iter()
        .filter(|path| !path.starts_with(store.join("locks")))
        .collect();
    assert!(files.len() > 50, "{}", files.len());
    for path in files {
        let whole = std::fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        let bit = random.random_range(0..whole.len() * 8);
        flipped[bit / 8] ^= 1 << (bit % 8);
        overwrite(&path, &flipped);
        calib(store, "verify").code(1);
        overwrite(&path, &whole);
    }
    assert_eq!(message_of(store, "verify"), clean);
    // A manifest that was written anew, seal and all, is not the one that the next run saw.
    let runs: Vec<PathBuf> = self::files(&store.join("runs"))
        .into_iter()
        .filter(|path| path.ends_with("manifest.json"))
        .collect();
    let manifest = std::fs::read_to_string(&runs[0]).unwrap();
    let body = manifest.split(",\n  \"sealed\"").next().unwrap().replacen(
        "\"seed\": 11",
        "\"seed\": 12",
        1,
    );
    let forged = format!(
        "{body},\n  \"sealed\": \"{}\"\n}}\n",
        blake3::hash(body.as_bytes()).to_hex()
    );
    overwrite(&runs[0], forged.as_bytes());
    let output = calib(store, "verify").code(1);
    has(&text(&output), "has changed since this run began");
}

#[test]
fn a_sweep_leaves_what_tags_and_the_last_runs_need() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    for seed in ["1", "2", "3"] {
        run(store, &format!("--set seed={seed}"));
    }
    message_of(store, "tag HEAD~2 released");
    let sweep = "gc --keep-runs 1 --grace-hours 0";
    assert_eq!(
        json(store, "gc --keep-runs 1")["actions"],
        0,
        "what is young stays"
    );
    let would = json(store, &format!("{sweep} --dry-run"));
    let before = files(&store.join("objects")).len();
    let swept = json(store, sweep);
    assert_eq!(would, swept);
    assert_eq!(
        files(&store.join("objects")).len() as u64,
        before as u64 - swept["objects"].as_u64().unwrap()
    );
    assert_eq!(swept["actions"], 7, "the stages of the run between");
    let executed = |seed: &str| {
        let pipeline = pipeline();
        let result = json(
            store,
            &format!("run {} --quiet --set seed={seed}", pipeline.display()),
        );
        result["stages"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|stage| stage["status"] == "executed")
            .count()
    };
    message_of(store, "verify");
    assert_eq!((executed("1"), executed("3"), executed("2")), (0, 0, 7));
}

#[test]
fn the_last_run_is_the_last_also_where_the_clock_went_backwards() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    run(store, "");
    // A run of the far future, as a clock that was wrong leaves it.
    let runs = store.join("runs");
    let real = std::fs::read_dir(&runs)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let future = ulid::Ulid::from_parts(1 << 45, 7).to_string();
    std::fs::rename(real, runs.join(&future)).unwrap();
    run(store, "--set seed=5");
    let manifest = json(store, "show HEAD");
    assert_eq!(
        (
            &manifest["seed"],
            manifest["run_id"].as_str().unwrap() > future.as_str()
        ),
        (&5.into(), true)
    );
}

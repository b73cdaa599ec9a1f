//! The store: identity, the commit protocol, and what is done about damage, rivals and refusals.

use crate::answer::{has, put, read};
use arrow::array::ArrayRef;
use calib::error::{Error, Result};
use calib::store::frame::{Cell, Frame, FrameBuilder};
use calib::store::{
    Account, KEY_FORMAT, Lookup, PendingTable, Published, StageKey, Store, TableHash, TableRef,
};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

pub(super) fn key(stage: &str, seed: u64) -> StageKey {
    StageKey {
        key_format: KEY_FORMAT,
        id: stage.into(),
        stage: stage.into(),
        implementation: 1,
        settings: serde_json::json!({"every": 4, "tolerance": 1.0}),
        reads: BTreeMap::new(),
        files: BTreeMap::new(),
        schemas: BTreeMap::from([("out".to_string(), "split/1.0.0".to_string())]),
        seed,
    }
}

/// A letter and a number each.
fn names(letter: char, keys: &[i64]) -> ArrayRef {
    let name = |key: &i64| format!("{letter}{key}");
    Cell::to_array(keys.iter().map(name).collect())
}

fn texts<const N: usize>(texts: [&str; N]) -> ArrayRef {
    Cell::to_array(texts.map(String::from).to_vec())
}

fn columns(keys: &[i64]) -> FrameBuilder {
    let mut frame = FrameBuilder::new("split");
    let set = |key: &i64| if key % 4 == 3 { "validate" } else { "fit" }.to_string();
    frame.push("sequence", Cell::to_array(keys.to_vec()));
    frame.push("point_id", names('P', keys));
    frame.push("set", Cell::to_array(keys.iter().map(set).collect()));
    frame
}

pub(super) fn split(keys: std::ops::Range<i64>) -> Frame {
    columns(&keys.collect::<Vec<_>>()).finish().unwrap()
}

pub(super) fn publish(store: &Store, key: &StageKey, frame: &Frame) -> Result<Published> {
    store.publish(
        key,
        vec![("out".into(), PendingTable::Frame(frame.clone()))],
        Account::default(),
    )
}

fn place() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path().join("store")).unwrap();
    (folder, store)
}

fn files(dir: &Path) -> usize {
    let Ok(entries) = fs::read_dir(dir) else {
        return 0;
    };
    entries
        .map(|entry| entry.unwrap().path())
        .map(|path| if path.is_dir() { files(&path) } else { 1 })
        .sum()
}

fn streamed(store: &Store, chunks: &[std::ops::Range<i64>]) -> TableRef {
    let mut writer = store.writer("split").unwrap();
    for chunk in chunks {
        writer.push(&split(chunk.clone())).unwrap();
    }
    writer.finish().unwrap().table().clone()
}

#[test]
fn chunks_change_neither_the_content_hash_nor_the_bytes() {
    let (_folder, store) = place();
    let whole = streamed(&store, std::slice::from_ref(&(0..200_000)));
    let pieces = streamed(
        &store,
        &[
            0..1,
            1..70_000,
            70_000..70_000,
            70_000..199_999,
            199_999..200_000,
        ],
    );
    assert_eq!(whole, pieces);
    assert_eq!(whole.table_hash, split(0..200_000).table_hash());
    assert_ne!(whole.table_hash, split(0..199_999).table_hash());
}

#[test]
fn the_order_of_pushing_and_computing_does_not_show_in_the_content() {
    let upside_down = columns(&[5, 3, 4]).finish().unwrap();
    assert_eq!(upside_down.read::<i64>("sequence").unwrap(), [3, 4, 5]);
    assert_eq!(upside_down.table_hash(), split(3..6).table_hash());
}

#[test]
fn the_content_hash_sees_a_moved_border_between_texts_and_a_null() {
    let hash = |pair: [&str; 2], sigma: Option<f64>| {
        let mut frame = FrameBuilder::new("parameters");
        frame.push("name", texts(["a", "b"]));
        for name in ["effect", "place", "unit", "step"] {
            frame.push(name, texts(pair));
        }
        frame.push("status", texts(["free", "held"]));
        frame.push("remark", Cell::to_array(vec![None, Some(String::new())]));
        frame.push("form", Cell::to_array(vec![None::<String>, None]));
        frame.push("nominal", Cell::to_array(vec![0.0, 0.0]));
        frame.push("value", Cell::to_array(vec![0.0, 1.0]));
        frame.push("change", Cell::to_array(vec![0.0, 1.0]));
        frame.push("sigma", Cell::to_array(vec![sigma, None]));
        frame.finish().unwrap().table_hash()
    };
    let hashes: Vec<TableHash> = vec![
        hash(["ab", "c"], None),
        hash(["a", "bc"], None),
        hash(["ab", "c"], Some(0.0)),
    ];
    assert!(hashes[0] != hashes[1] && hashes[0] != hashes[2] && hashes[1] != hashes[2]);
}

#[test]
fn a_frame_that_breaks_its_schema_is_refused_with_column_and_key() {
    let refused = |change: fn(&mut FrameBuilder), keys: &[i64]| {
        let mut frame = columns(keys);
        change(&mut frame);
        let error = frame.finish().unwrap_err();
        assert_eq!(error.exit_code(), 70, "{error}");
        error.to_string()
    };
    assert!(refused(|_| (), &[1, 2, 2]).contains("table split: key sequence 2 twice"));
    assert!(
        refused(
            |frame| frame.push("extra", Cell::to_array(vec![1i64])),
            &[1]
        )
        .contains("column extra is not in the schema")
    );
    assert!(
        refused(|frame| *frame = FrameBuilder::new("split"), &[1])
            .contains("column sequence is missing")
    );
    assert!(refused(|frame| *frame = FrameBuilder::new("splitt"), &[1]).contains("splitt"));
    let float = |values: Vec<Option<f64>>| {
        let mut frame = FrameBuilder::new("truth");
        let rows: Vec<i64> = (0..values.len() as i64).collect();
        for name in ["name", "effect", "place", "unit"] {
            frame.push(name, names('n', &rows));
        }
        frame.push("value", Cell::to_array(values));
        frame.finish().unwrap_err().to_string()
    };
    assert!(float(vec![Some(1.0), Some(f64::NAN)]).contains("column value, name n1: NaN"));
    assert!(float(vec![Some(f64::NEG_INFINITY)]).contains("column value, name n0: -inf"));
    assert!(float(vec![Some(1.0), None]).contains("column value, row 1: null"));
}

#[test]
fn a_streamed_table_whose_keys_turn_back_is_refused() {
    let (_folder, store) = place();
    let mut writer = store.writer("split").unwrap();
    writer.push(&split(0..10)).unwrap();
    let error = writer.push(&split(9..12)).unwrap_err().to_string();
    has(&error, "key sequence 9 after sequence 9");
}

#[test]
fn looking_leaves_no_trace_and_publishing_makes_a_stage_done() {
    let (_folder, store) = place();
    assert_eq!(store.action(&key("split", 1)).unwrap(), Lookup::Absent);
    assert!(!store.root().exists());
    let account = Account {
        notes: vec!["rank 27".into()],
        wall_seconds: 0.5,
        ..Account::default()
    };
    let products = vec![("out".to_string(), PendingTable::Frame(split(0..9)))];
    let record = store
        .publish(&key("split", 1), products, account.clone())
        .unwrap()
        .record;
    let Lookup::Done(found) = Store::open(store.root())
        .unwrap()
        .action(&key("split", 1))
        .unwrap()
    else {
        panic!("not done")
    };
    assert_eq!((&*found, &found.account), (&record, &account));
    assert_eq!(store.load(&record.tables["out"]).unwrap(), split(0..9));
    assert_eq!(store.action(&key("split", 2)).unwrap(), Lookup::Absent);
}

#[test]
fn a_key_does_not_depend_on_the_order_of_its_settings() {
    let with = |text: &str| {
        StageKey {
            settings: serde_json::from_str(text).unwrap(),
            ..key("split", 1)
        }
        .id()
    };
    assert_eq!(
        with(r#"{"a": {"x": 0.1, "y": [1, 2]}, "b": null}"#),
        with(r#"{"b": null, "a": {"y": [1, 2], "x": 0.1}}"#)
    );
    assert_ne!(with(r#"{"a": 1}"#), with(r#"{"a": 1.0}"#));
    assert_ne!(with(r#"{"a": [1, 2]}"#), with(r#"{"a": [2, 1]}"#));
}

#[test]
fn a_store_opens_while_another_begins_it() {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..40 {
        let root = folder.path().join(number.to_string());
        let begun = root.join("format.json");
        let other = std::thread::spawn({
            let root = root.clone();
            move || publish(&Store::open(root).unwrap(), &key("split", 1), &split(0..1)).unwrap()
        });
        while !begun.exists() {
            Store::open(&root).unwrap();
        }
        other.join().unwrap();
    }
}

#[test]
fn rivals_publish_one_object_and_one_record() {
    let (_folder, store) = place();
    let rivals: Vec<_> = (0..8)
        .map(|_| {
            let root = store.root().to_owned();
            std::thread::spawn(move || {
                publish(
                    &Store::open(root).unwrap(),
                    &key("split", 1),
                    &split(0..100),
                )
                .unwrap()
            })
        })
        .collect();
    let published: Vec<Published> = rivals
        .into_iter()
        .map(|rival| rival.join().unwrap())
        .collect();
    assert!(
        published
            .iter()
            .all(|one| one == &published[0] && one.conflict.is_none())
    );
    assert_eq!(
        (
            files(&store.root().join("objects")),
            files(&store.root().join("actions"))
        ),
        (1, 1)
    );
    assert_eq!(
        files(&store.root().join("tmp")),
        0,
        "nobody leaves unfinished files"
    );
}

#[test]
fn the_first_record_stands_and_another_content_is_reported() {
    let (_folder, store) = place();
    let first = publish(&store, &key("split", 1), &split(0..9)).unwrap();
    let second = publish(&store, &key("split", 1), &split(0..8)).unwrap();
    assert_eq!(second.record, first.record);
    let conflict = second.conflict.unwrap();
    has(&conflict, ["stage split is not deterministic", "out"]);
}

#[test]
fn a_torn_record_or_a_damaged_object_is_as_good_as_absent_and_healed_by_publishing() {
    let (_folder, store) = place();
    let record = publish(&store, &key("split", 1), &split(0..900))
        .unwrap()
        .record;
    let id = record.id.as_str();
    let record_path = store
        .root()
        .join("actions")
        .join(&id[..2])
        .join(format!("{id}.json"));
    let object = store.object_path(&record.tables["out"]);
    let whole = (fs::read(&record_path).unwrap(), fs::read(&object).unwrap());
    let overwrite = |path: &Path, bytes: &[u8]| {
        fs::remove_file(path).unwrap();
        fs::write(path, bytes).unwrap();
    };
    let torn: [&dyn Fn(); 4] = [
        &|| overwrite(&record_path, &whole.0[..whole.0.len() / 2]),
        &|| overwrite(&record_path, b""),
        &|| overwrite(&object, &whole.1[..whole.1.len() - 1]),
        &|| fs::remove_file(&object).unwrap(),
    ];
    for tear in torn {
        tear();
        let Lookup::Damaged(why) = store.action(&key("split", 1)).unwrap() else {
            panic!("damage not seen")
        };
        has(&why, "the stage runs again");
        assert_eq!(
            publish(&store, &key("split", 1), &split(0..900))
                .unwrap()
                .conflict,
            None
        );
        assert_eq!(
            store.action(&key("split", 1)).unwrap(),
            Lookup::Done(Box::new(record.clone()))
        );
        assert_eq!(
            (fs::read(&record_path).unwrap(), fs::read(&object).unwrap()),
            whole
        );
    }
}

#[test]
fn a_flipped_byte_is_found_on_reading_and_the_object_is_set_aside() {
    let (_folder, store) = place();
    let record = publish(&store, &key("split", 1), &split(0..900))
        .unwrap()
        .record;
    let object = store.object_path(&record.tables["out"]);
    let mut bytes = fs::read(&object).unwrap();
    bytes[100] ^= 1;
    fs::remove_file(&object).unwrap();
    fs::write(&object, bytes).unwrap();
    let error = store.load(&record.tables["out"]).unwrap_err();
    assert_eq!(error.exit_code(), 75);
    assert!(
        error
            .to_string()
            .contains("`calib run` of its pipeline writes it anew"),
        "{error}"
    );
    assert!(matches!(
        store.action(&key("split", 1)).unwrap(),
        Lookup::Damaged(_)
    ));
}

#[test]
fn a_store_of_a_newer_calib_and_a_folder_that_is_no_store_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    put(
        folder.path(),
        "format.json",
        r#"{"calib_store": 2, "new": true}"#,
    );
    let error = Store::open(folder.path()).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(
        error
            .to_string()
            .contains("newer calib (format 2, this one knows 1)"),
        "{error}"
    );
    put(folder.path(), "format.json", "{");
    assert_eq!(Store::open(folder.path()).unwrap_err().exit_code(), 75);
    fs::rename(
        folder.path().join("format.json"),
        folder.path().join("holiday.jpg"),
    )
    .unwrap();
    let error = Store::open(folder.path()).unwrap_err();
    assert!(
        error.to_string().contains("not a calib store")
            && error.to_string().contains("holiday.jpg"),
        "{error}"
    );
}

#[test]
fn a_place_that_cannot_be_written_says_what_to_do() {
    let (_folder, store) = place();
    publish(&store, &key("split", 1), &split(0..9)).unwrap();
    fs::remove_dir_all(store.root().join("actions")).unwrap();
    put(store.root(), "actions", "in the way");
    let error = publish(&store, &key("split", 2), &split(0..9)).unwrap_err();
    assert_eq!(error.exit_code(), 75, "{error}");
    assert!(error.to_string().contains("--store DIR"), "{error}");
    let on_a_file = Store::open(store.root().join("format.json")).unwrap_err();
    assert_eq!(on_a_file.exit_code(), 75, "{on_a_file}");
}

#[cfg(unix)]
#[test]
fn a_read_only_store_can_be_read_and_refuses_to_be_written() {
    use std::os::unix::fs::PermissionsExt;
    let (_folder, store) = place();
    let root = store.root().to_owned();
    let record = publish(&store, &key("split", 1), &split(0..9))
        .unwrap()
        .record;
    drop(store);
    let folders = [root.join("tmp"), root.clone()];
    let mode = |mode| {
        folders
            .iter()
            .for_each(|dir| fs::set_permissions(dir, fs::Permissions::from_mode(mode)).unwrap())
    };
    mode(0o555);
    let store = Store::open(&root).unwrap();
    assert_eq!(
        store.action(&key("split", 1)).unwrap(),
        Lookup::Done(Box::new(record))
    );
    if fs::write(root.join("probe"), "").is_ok() {
        crate::desk::skipped("this user may write into read-only folders");
    } else {
        let error = publish(&store, &key("split", 2), &split(0..9)).unwrap_err();
        assert_eq!(error.exit_code(), 75);
        assert!(
            error.to_string().contains("make the folder writable"),
            "{error}"
        );
    }
    mode(0o755);
}

#[test]
fn the_human_path_follows_the_latest_table_and_reads_without_the_store() {
    let (_folder, store) = place();
    let first = publish(&store, &key("split", 1), &split(0..9))
        .unwrap()
        .record;
    let second = publish(&store, &key("split", 2), &split(0..5))
        .unwrap()
        .record;
    let path = store
        .expose("cell 7", "split", "out", &first.tables["out"])
        .unwrap();
    assert_eq!(path, store.root().join("tables/cell 7/split.out.parquet"));
    for record in [&first, &second, &second, &first] {
        let table = &record.tables["out"];
        store.expose("cell 7", "split", "out", table).unwrap();
        assert_eq!(
            fs::read(&path).unwrap(),
            fs::read(store.object_path(table)).unwrap()
        );
    }
    assert!(fs::metadata(&path).unwrap().permissions().readonly());
    let document = store
        .expose_document("cell 7", "report.html", b"<p>")
        .unwrap();
    assert_eq!(fs::read(document).unwrap(), b"<p>");
    for hostile in ["..", "../x", "a/b", "", ".hidden", "a\\b", "nul\0"] {
        assert!(
            matches!(
                store.expose(hostile, "s", "p", &first.tables["out"]),
                Err(Error::Spec(_))
            ),
            "{hostile:?}"
        );
        assert!(
            matches!(
                store.expose_document("cell 7", hostile, b""),
                Err(Error::Spec(_))
            ),
            "{hostile:?}"
        );
    }
}

#[test]
fn a_run_leaves_a_manifest_from_its_first_moment_and_events_line_by_line() {
    let (_folder, store) = place();
    let id = "01J00000000000000000000000";
    let mut run = store
        .begin_run(id, &serde_json::json!({"status": "running"}))
        .unwrap();
    assert_eq!(store.manifest(id).unwrap()["status"], "running");
    run.append_event(&serde_json::json!({"stage": "ingest"}))
        .unwrap();
    run.append_event(&serde_json::json!({"stage": "split\n"}))
        .unwrap();
    let dir = run.dir().to_owned();
    store
        .finish_run(run, &serde_json::json!({"status": "done"}), false)
        .unwrap();
    assert_eq!(store.manifest(id).unwrap()["status"], "done");
    assert_eq!(read(dir.join("events.jsonl")).lines().count(), 2);
    assert_eq!(store.runs().unwrap(), [id]);
    assert!(
        store.begin_run(id, &serde_json::json!({})).is_err(),
        "a run is begun once"
    );
}

#[test]
fn what_a_dead_process_left_is_swept_and_what_a_living_one_uses_stays() {
    let (_folder, store) = place();
    publish(&store, &key("split", 1), &split(0..9)).unwrap();
    let mut writer = store.writer("split").unwrap();
    writer.push(&split(0..9)).unwrap();
    let tmp = store.root().join("tmp");
    fs::create_dir(tmp.join("4000000.0")).unwrap();
    put(&tmp, "4000000.0/0", "half a table");
    put(&tmp, "4000000.0.lock", "");
    publish(
        &Store::open(store.root()).unwrap(),
        &key("split", 2),
        &split(0..9),
    )
    .unwrap();
    assert!(!tmp.join("4000000.0").exists() && !tmp.join("4000000.0.lock").exists());
    assert_eq!(writer.finish().unwrap().table().rows, 9);
}

#[cfg(target_os = "linux")]
#[test]
fn a_million_rows_stream_in_bounded_memory() {
    // The memory of a process in which this test runs and no other.
    if !crate::alone::alone("store::a_million_rows_stream_in_bounded_memory") {
        return;
    }
    const ROWS: i64 = 1_000_000;
    const CHUNK: i64 = 10_000;
    let (_folder, store) = place();
    let mut writer = store.writer("prediction").unwrap();
    let resident = || -> u64 {
        let pages: u64 = read("/proc/self/statm")
            .split(' ')
            .nth(1)
            .unwrap()
            .parse()
            .unwrap();
        pages * 4096
    };
    let (mut settled, mut most) = (0, 0);
    for start in (0..ROWS).step_by(CHUNK as usize) {
        let keys: Vec<i64> = (start..start + CHUNK).collect();
        let mut frame = FrameBuilder::new("prediction");
        frame.push("point_id", names('P', &keys));
        for (name, text) in [("set", "fit"), ("step", "geometry")] {
            frame.push(name, Cell::to_array(vec![text.to_string(); keys.len()]));
        }
        for name in ["held_out", "suspect"] {
            frame.push(name, Cell::to_array(vec![false; keys.len()]));
        }
        let numbers = "x_mm y_mm z_mm dx_mm dy_mm dz_mm error_mm noise_mm sigma_mm fold_error_mm block_error_mm";
        for name in numbers.split(' ') {
            let number = |key: &i64| (*key as f64 * 0.7371).fract();
            frame.push(name, Cell::to_array(keys.iter().map(number).collect()));
        }
        frame.push("sequence", Cell::to_array(keys));
        writer.push(&frame.finish().unwrap()).unwrap();
        if start == ROWS / 5 {
            settled = resident();
        }
        most = most.max(resident());
    }
    let file = writer.finish().unwrap();
    assert_eq!(file.table().rows, ROWS as u64);
    // The columns are over 100 MB in memory.
    let grown = most.saturating_sub(settled);
    assert!(
        grown < 60_000_000,
        "grew by {grown} bytes after the first fifth of the rows"
    );
}

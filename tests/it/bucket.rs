//! A store in a bucket: what one machine made another one takes, whoever is killed or comes second; the bucket here is in memory.

use calib::error::{Error, Result};
use calib::store::{Bucket, Lookup, Store};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

use crate::store::{key, publish, split};

/// Files by key, and how many requests are still answered.
#[derive(Debug)]
struct Memory {
    files: Mutex<BTreeMap<String, Vec<u8>>>,
    answers: Mutex<usize>,
    refused_creates: Mutex<usize>,
    /// Knows no condition, as some servers do not.
    careless: bool,
    /// What another machine writes after the next request.
    elsewhere: Mutex<BTreeMap<String, Vec<u8>>>,
}

impl Memory {
    fn new() -> Arc<Self> {
        Self::with(false)
    }
    fn with(careless: bool) -> Arc<Self> {
        Arc::new(Self {
            careless,
            files: Mutex::default(),
            answers: Mutex::new(usize::MAX),
            refused_creates: Mutex::default(),
            elsewhere: Mutex::default(),
        })
    }
    fn ask(&self) -> Result<()> {
        let mut answers = self.answers.lock().unwrap();
        *answers = answers
            .checked_sub(1)
            .ok_or_else(|| Error::store("bucket", "the network is gone"))?;
        Ok(())
    }
    fn keys(&self, folder: &str) -> Vec<String> {
        self.files
            .lock()
            .unwrap()
            .keys()
            .filter(|key| key.starts_with(folder))
            .cloned()
            .collect()
    }
    fn flip(&self, key: &str, at: usize) {
        let mut files = self.files.lock().unwrap();
        let bytes = files.get_mut(key).unwrap();
        let at = at % bytes.len();
        bytes[at] ^= 4;
    }
}

impl Bucket for Memory {
    fn name(&self) -> &str {
        "s3://cell/seven"
    }
    fn fetch(&self, key: &str, to: &Path) -> Result<bool> {
        self.ask()?;
        let found = self.files.lock().unwrap().get(key).cloned();
        self.files
            .lock()
            .unwrap()
            .append(&mut self.elsewhere.lock().unwrap());
        found.iter().for_each(|bytes| fs::write(to, bytes).unwrap());
        Ok(found.is_some())
    }
    fn send(&self, from: &Path, key: &str) -> Result<()> {
        self.ask()?;
        self.files
            .lock()
            .unwrap()
            .insert(key.into(), fs::read(from).unwrap());
        Ok(())
    }
    fn create(&self, from: &Path, key: &str) -> Result<bool> {
        self.ask()?;
        let mut files = self.files.lock().unwrap();
        let fresh = !files.contains_key(key);
        *self.refused_creates.lock().unwrap() += usize::from(!fresh && key.starts_with("actions/"));
        files
            .entry(key.into())
            .or_insert_with(|| fs::read(from).unwrap());
        Ok(fresh || self.careless)
    }
    fn remove(&self, key: &str) -> Result<()> {
        self.ask()?;
        self.files.lock().unwrap().remove(key);
        Ok(())
    }
    fn list(&self, folder: &str, most: usize) -> Result<Vec<(String, u64)>> {
        self.ask()?;
        let files = self.files.lock().unwrap();
        let below = files
            .iter()
            .filter(|(key, _)| key.starts_with(folder))
            .take(most);
        Ok(below
            .map(|(key, bytes)| (key.clone(), bytes.len() as u64))
            .collect())
    }
}

/// A bucket that holds what a folder holds, and a store before it that has fetched nothing yet.
pub fn bucket_of(folder: &Path, cache: &Path) -> Store {
    fn put(bucket: &Memory, root: &Path, folder: &Path) {
        for path in fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path())
        {
            if path.is_dir() {
                put(bucket, root, &path);
            } else {
                let key = path
                    .strip_prefix(root)
                    .unwrap()
                    .to_str()
                    .unwrap()
                    .replace('\\', "/");
                bucket
                    .files
                    .lock()
                    .unwrap()
                    .insert(key, fs::read(&path).unwrap());
            }
        }
    }
    let bucket = Memory::new();
    put(&bucket, folder, folder);
    Store::open_before(cache, bucket).unwrap()
}

/// A store of one machine, with a cache of its own.
fn machine(bucket: &Arc<Memory>) -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open_before(folder.path().join("cache"), bucket.clone()).unwrap();
    (folder, store)
}

fn manifest(id: &str, status: &str) -> serde_json::Value {
    serde_json::json!({"run_id": id, "status": status, "stages": []})
}

const FIRST: &str = "01JAAAAAAAAAAAAAAAAAAAAAAA";
const SECOND: &str = "01JBBBBBBBBBBBBBBBBBBBBBBB";
const THIRD: &str = "01JCCCCCCCCCCCCCCCCCCCCCCC";

/// A run of one stage, as the pipeline does it.
fn run(store: &Store, id: &str) -> Result<()> {
    let id = store.reserve_run(id)?;
    let mut run = store.begin_run(&id, &manifest(&id, "running"))?;
    run.append_event(&serde_json::json!({"event": "begins"}))?;
    publish(store, &key("split", 1), &split(0..100))?;
    store.expose_document("cell", "report.html", b"<p>fine</p>")?;
    store.write_manifest(&run, &manifest(&id, "running"))?;
    run.append_event(&serde_json::json!({"event": "ends"}))?;
    store.finish_run(run, &manifest(&id, "done"), false)
}

#[test]
fn what_one_machine_made_another_takes() {
    let bucket = Memory::new();
    let (_a, first) = machine(&bucket);
    assert!(bucket.keys("").is_empty(), "looking leaves no trace");
    assert_eq!(first.action(&key("split", 1)).unwrap(), Lookup::Absent);
    run(&first, FIRST).unwrap();
    first.tag("as delivered", FIRST).unwrap();
    let (_b, second) = machine(&bucket);
    let Lookup::Done(record) = second.action(&key("split", 1)).unwrap() else {
        panic!("not done")
    };
    assert_eq!(second.load(&record.tables["out"]).unwrap(), split(0..100));
    assert_eq!(second.records().unwrap().len(), 1);
    assert_eq!(
        (
            second.runs().unwrap(),
            calib::pipeline::find_run(&second, "as delivered").unwrap()
        ),
        (vec![FIRST.into()], FIRST.into())
    );
    assert_eq!(second.manifest(FIRST).unwrap()["status"], "done");
    run(&second, SECOND).unwrap();
    second.untag("as delivered").unwrap();
    // The first machine opens it again, with what it has.
    let again = Store::open_before(first.root(), bucket.clone()).unwrap();
    assert_eq!(
        (again.runs().unwrap().len(), again.tags().unwrap().len()),
        (2, 0)
    );
    assert!(
        again.verify().unwrap().faults.is_empty(),
        "{:?}",
        again.verify().unwrap().faults
    );
    assert_eq!(
        again
            .sweep(&Default::default(), std::time::SystemTime::now(), false)
            .unwrap_err()
            .exit_code(),
        2
    );
    // What is taken out of the bucket is taken out of what was fetched from it.
    bucket
        .files
        .lock()
        .unwrap()
        .retain(|key, _| !key.contains(SECOND));
    assert_eq!(
        Store::open_before(first.root(), bucket.clone())
            .unwrap()
            .runs()
            .unwrap(),
        [FIRST]
    );
}

#[test]
fn cut_off_after_any_request_nothing_is_visible_by_half_and_another_machine_goes_on() {
    let (mut answers, mut whole) = (0, 0);
    loop {
        let bucket = Memory::new();
        let (_a, first) = machine(&bucket);
        *bucket.answers.lock().unwrap() = answers;
        let ended = run(&first, FIRST);
        *bucket.answers.lock().unwrap() = usize::MAX;
        if let Err(error) = &ended {
            assert_eq!(error.exit_code(), 75, "{error}");
        }
        if !bucket.keys("").is_empty() {
            let (_c, looking) = machine(&bucket);
            assert_eq!(
                looking.verify().unwrap().faults,
                [],
                "after {answers} requests"
            );
            assert!(
                !matches!(
                    looking.action(&key("split", 1)).unwrap(),
                    Lookup::Damaged(_)
                ),
                "after {answers} requests"
            );
        }
        // The same machine and another one, in turn.
        let (_d, other) = machine(&bucket);
        for (id, store) in [
            (
                SECOND,
                Store::open_before(first.root(), bucket.clone()).unwrap(),
            ),
            (THIRD, other),
        ] {
            run(&store, id).unwrap();
            assert_eq!(
                store.verify().unwrap().faults,
                [],
                "after {answers} requests and {id}"
            );
        }
        assert_eq!(bucket.keys("actions/").len(), 1);
        whole += usize::from(ended.is_ok());
        if whole > 0 {
            break;
        }
        answers += 1;
    }
    assert_eq!(
        answers, 9,
        "format twice, manifest, table, record; events and manifest, twice"
    );
}

#[test]
fn of_those_who_commit_at_once_one_is_first_and_its_record_is_everybodys() {
    let bucket = Memory::new();
    let workers: Vec<_> = (0..8)
        .map(|_| {
            let (folder, store) = machine(&bucket);
            std::thread::spawn(move || {
                (
                    publish(&store, &key("split", 1), &split(0..100)).unwrap(),
                    folder,
                )
            })
        })
        .collect();
    let records: Vec<_> = workers
        .into_iter()
        .map(|worker| worker.join().unwrap().0)
        .collect();
    assert!(
        records
            .iter()
            .all(|published| published.record == records[0].record && published.conflict.is_none())
    );
    assert_eq!(*bucket.refused_creates.lock().unwrap(), 7);
    // Other content under the same key: told, and the first stands.
    let (_folder, store) = machine(&bucket);
    let other = publish(&store, &key("split", 1), &split(0..101)).unwrap();
    assert!(other.conflict.unwrap().contains("not deterministic"));
    assert_eq!(other.record, records[0].record);
}

#[test]
fn a_flipped_bit_in_any_file_of_the_bucket_is_found_and_a_run_mends_it() {
    let bucket = Memory::new();
    let (_a, first) = machine(&bucket);
    run(&first, FIRST).unwrap();
    first.tag("kept", FIRST).unwrap();
    let sound = bucket.files.lock().unwrap().clone();
    for name in bucket.keys("") {
        for at in [0, 77, 1234] {
            *bucket.files.lock().unwrap() = sound.clone();
            bucket.flip(&name, at);
            let folder = tempfile::tempdir().unwrap();
            let damaged = Store::open_before(folder.path().join("cache"), bucket.clone());
            let faults = damaged.map_or_else(
                |error| error.to_string(),
                |store| format!("{:?}", store.verify().unwrap().faults),
            );
            assert!(
                faults.contains("s3://cell/seven/"),
                "{name} at {at}: {faults}"
            );
        }
    }
    *bucket.files.lock().unwrap() = sound;
    let object = bucket.keys("objects/").remove(0);
    bucket.flip(&object, 500);
    // What was fetched before stands until a verification says that the bucket lost it.
    assert!(matches!(
        first.action(&key("split", 1)).unwrap(),
        Lookup::Done(_)
    ));
    let (_b, second) = machine(&bucket);
    assert!(matches!(
        second.action(&key("split", 1)).unwrap(),
        Lookup::Damaged(_)
    ));
    assert_eq!(first.verify().unwrap().faults.len(), 1);
    assert!(matches!(
        first.action(&key("split", 1)).unwrap(),
        Lookup::Damaged(_)
    ));
    publish(&first, &key("split", 1), &split(0..100)).unwrap();
    assert_eq!(first.verify().unwrap().faults, []);
    assert!(matches!(
        second.action(&key("split", 1)).unwrap(),
        Lookup::Done(_)
    ));
}

#[test]
fn a_store_that_another_machine_begins_in_this_moment_is_a_store() {
    let bucket = Memory::new();
    bucket
        .elsewhere
        .lock()
        .unwrap()
        .insert("format.json".into(), br#"{"calib_store":1}"#.to_vec());
    let (_folder, store) = machine(&bucket);
    run(&store, FIRST).unwrap();
    assert_eq!(store.verify().unwrap().faults, []);
}

#[test]
fn a_server_without_put_if_absent_is_refused() {
    let (_folder, store) = machine(&Memory::with(true));
    let error = run(&store, FIRST).unwrap_err();
    assert!(
        error.exit_code() == 2 && error.to_string().contains("put-if-absent"),
        "{error}"
    );
}

#[test]
fn a_place_that_is_no_store_is_left_alone() {
    let bucket = Memory::new();
    bucket
        .files
        .lock()
        .unwrap()
        .insert("holidays/one.jpg".into(), vec![1]);
    let folder = tempfile::tempdir().unwrap();
    let open =
        |bucket: &Arc<Memory>| Store::open_before(folder.path().join("cache"), bucket.clone());
    let error = open(&bucket).unwrap_err();
    assert!(
        error.exit_code() == 2 && error.to_string().contains("holidays/one.jpg"),
        "{error}"
    );
    let bucket = Memory::new();
    bucket
        .files
        .lock()
        .unwrap()
        .insert("format.json".into(), br#"{"calib_store":9}"#.to_vec());
    assert!(
        open(&bucket)
            .unwrap_err()
            .to_string()
            .contains("newer calib")
    );
    let (_folder, store) = machine(&Memory::new());
    assert_eq!(store.verify().unwrap_err().exit_code(), 2);
}

#[cfg(not(feature = "s3"))]
#[test]
fn without_the_feature_it_is_said_how_to_come_by_it() {
    let error =
        Store::open_s3("s3://cell/seven", &BTreeMap::new(), Path::new("cache")).unwrap_err();
    assert!(
        error.exit_code() == 2 && error.to_string().contains("--features s3"),
        "{error}"
    );
}

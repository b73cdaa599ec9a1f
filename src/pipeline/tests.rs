//! The engine with small stages of its own: caching, reasons, wiring, panics.

#![expect(
    clippy::disallowed_methods,
    reason = "a test is its own cli: it hands the clock down"
)]

use super::*;
use crate::error::{Error, Fault, Place, Result};
use crate::stage::{Context, Labelled, RawFile, Stage, StageEntry, stage};
use crate::store::Store;
use crate::table::{Split, SplitRow, Truth, TruthRow};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::sync::Mutex;

/// Makes a split of as many rows as it is told, or as its file has bytes.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Source {
    /// Rows.
    rows: std::num::NonZeroU32,
    #[serde(default)]
    set: String,
    #[serde(default)]
    file: Option<RawFile>,
}
stage! { Source, "source", 1, "makes a split", Nothing {} -> SourceWrites { split: Split, } }

impl Stage for Source {
    fn faults(&self, at: &mut Place) {
        at.at("rows").must(self.rows.get() <= 1000, "at most 1000");
    }
    fn files(&self) -> Vec<(String, RawFile)> {
        self.file
            .iter()
            .map(|file| ("file".into(), file.clone()))
            .collect()
    }
    fn run(&self, _: Nothing, context: &Context) -> Result<SourceWrites> {
        let mut rows = i64::from(self.rows.get());
        if let Some(file) = &self.file {
            let mut text = String::new();
            context
                .services
                .open(file)?
                .reader
                .read_to_string(&mut text)
                .unwrap();
            rows = text.len() as i64;
        }
        assert!(self.set != "panic", "told to");
        context.services.note(format!("{rows} rows"));
        let row = |sequence| SplitRow {
            sequence,
            point_id: sequence.to_string(),
            set: self.set.clone(),
        };
        Ok(SourceWrites {
            split: Split((0..rows).map(row).collect()),
        })
    }
}

/// Counts the rows of every split.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Count {}
stage! {
    Count, "count", 3, "counts rows",
    CountReads { last: Split, all: Vec<Labelled<Split>>, } -> CountWrites { truth: Truth, }
}

impl Stage for Count {
    fn run(&self, reads: CountReads, _: &Context) -> Result<CountWrites> {
        let row = |name: &str, rows: usize| TruthRow {
            name: name.into(),
            effect: "count".into(),
            place: "recording".into(),
            value: rows as f64,
            unit: "1".into(),
        };
        let mut rows = vec![row("last", reads.last.0.len())];
        rows.extend(
            reads
                .all
                .iter()
                .map(|split| row(&split.stage, split.table.0.len())),
        );
        Ok(CountWrites { truth: Truth(rows) })
    }
}

const TRIAL: &[StageEntry] = &[StageEntry::of::<Source>(), StageEntry::of::<Count>()];

/// Remembers what it is told.
#[derive(Default)]
struct Ear(Mutex<Vec<String>>);
impl Observer for Ear {
    fn stage_begins(&self, id: &str, _: &str, reason: &str) {
        self.0.lock().unwrap().push(format!("{id}: {reason}"));
    }
    fn warn(&self, id: &str, line: &str) {
        self.0
            .lock()
            .unwrap()
            .push(format!("{id}: warning: {line}"));
    }
}

fn surroundings() -> Surroundings {
    Surroundings {
        tool: Tool {
            name: "calib".into(),
            version: "0".into(),
            target: "test".into(),
            revision: None,
            rustc: None,
        },
        host: Host {
            name: "test".into(),
            os: "test".into(),
            architecture: "test".into(),
            cores: 1,
        },
        user: None,
        environment: BTreeMap::new(),
        command_line: vec!["calib".into()],
        now: std::time::SystemTime::now,
        peak_memory: || None,
        run_id: ulid::Ulid::generate().to_string(),
    }
}

const TWO: &str = "calib: 1\nname: trial\nstages:\n- {id: a, uses: source, with: {rows: 3}}\n- {id: b, uses: source, with: {rows: 5, set: x}}\n- uses: count\n";

fn plan(text: &str, sets: &[&str]) -> Result<Plan> {
    let sets: Vec<Override> = sets
        .iter()
        .map(|set| Override::parse(set).unwrap())
        .collect();
    Plan::parse(Path::new("p.yaml"), text.into(), &sets, TRIAL)
}
fn faults(text: &str, sets: &[&str]) -> Vec<String> {
    match plan(text, sets).map(|_| ()) {
        Err(Error::Spec(faults)) => faults.iter().map(Fault::to_string).collect(),
        other => panic!("{other:?}"),
    }
}
fn options(force: Option<Vec<String>>) -> RunOptions {
    RunOptions {
        selection: Selection {
            force,
            ..Default::default()
        },
        jobs: 1,
        purpose: Purpose::Run,
    }
}
/// Runs and returns what was said and what came out of `count`.
fn go(store: &Path, plan: &Plan, options: &RunOptions) -> Result<(Vec<String>, CompletedRun)> {
    let ear = Ear::default();
    let store = Store::open(store)?;
    let outcome = run(plan, &store, options, &surroundings(), &ear)?;
    Ok((ear.0.into_inner().unwrap(), outcome))
}

#[test]
fn what_is_done_is_not_done_again_and_what_changed_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let (messages, first) = go(folder.path(), &plan(TWO, &[]).unwrap(), &options(None)).unwrap();
    assert_eq!(
        messages,
        ["a: never run", "b: never run", "count: never run"]
    );
    let (messages, second) = go(folder.path(), &plan(TWO, &[]).unwrap(), &options(None)).unwrap();
    assert_eq!(messages, [""; 0]);
    assert!(second.nothing_done() && !first.nothing_done());
    assert_eq!(
        second.manifest.stages[0].notes,
        ["3 rows"],
        "a cached stage says what it said"
    );
    let changed = plan(TWO, &["b.rows=6"]).unwrap();
    let store = Store::open(folder.path()).unwrap();
    let prospects: Vec<Prospect> = preview(&changed, &store, &Selection::default())
        .unwrap()
        .into_iter()
        .map(|forecast| forecast.prospect)
        .collect();
    let reason = "settings changed: b.rows".to_string();
    assert_eq!(
        prospects,
        [
            Prospect::Cached,
            Prospect::Run { reason },
            Prospect::Pending { on: "b".into() }
        ]
    );
    let (messages, _) = go(folder.path(), &changed, &options(None)).unwrap();
    assert_eq!(
        messages,
        [
            "b: settings changed: b.rows",
            "count: input all, last changed"
        ]
    );
    let (messages, _) = go(folder.path(), &plan(TWO, &[]).unwrap(), &options(None)).unwrap();
    assert_eq!(messages, [""; 0], "going back costs nothing");
}

/// Remembers how long stages are expected to take, s.
#[derive(Default)]
struct Watch(Mutex<Vec<(String, f64)>>);
impl Observer for Watch {
    fn expects(&self, id: &str, seconds: f64) {
        self.0.lock().unwrap().push((id.into(), seconds));
    }
}

#[test]
fn a_stage_that_ran_before_is_expected_to_take_as_long_in_proportion_to_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let (_, first) = go(folder.path(), &plan(TWO, &[]).unwrap(), &options(None)).unwrap();
    let store = Store::open(folder.path()).unwrap();
    let watch = Watch::default();
    let longer = plan(TWO, &["b.rows=10"]).unwrap();
    run(&longer, &store, &options(None), &surroundings(), &watch).unwrap();
    let seen = watch.0.into_inner().unwrap();
    let lasted = |stage: usize| first.manifest.stages[stage].wall_seconds.unwrap();
    // `b` reads no rows; the longest table that `count` reads is twice as long.
    let expected = [("b", lasted(1)), ("count", 2.0 * lasted(2))];
    let expected: Vec<(String, f64)> = expected
        .map(|(id, seconds)| (id.to_string(), seconds))
        .into();
    assert_eq!(seen, expected);
}

#[test]
fn a_stage_whose_inputs_came_out_equal_is_not_run_again() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store");
    let file = folder.path().join("raw.txt");
    std::fs::write(&file, "abc").unwrap();
    let text = format!("{TWO}\n").replace(
        "rows: 3",
        &format!("rows: 3, file: {:?}", file.display().to_string()),
    );
    go(&store, &plan(&text, &[]).unwrap(), &options(None)).unwrap();
    std::fs::write(&file, "xyz").unwrap();
    let (messages, _) = go(&store, &plan(&text, &[]).unwrap(), &options(None)).unwrap();
    assert_eq!(
        messages,
        ["a: file raw.txt changed"],
        "another file of the same length gives the same table"
    );
}

/// Writes a file as soon as a stage begins: after the file was hashed, before the stage opens it.
struct Hand<'t> {
    file: &'t Path,
    text: &'t str,
}
impl Observer for Hand<'_> {
    fn stage_begins(&self, id: &str, _: &str, _: &str) {
        if id == "a" {
            std::fs::write(self.file, self.text).unwrap();
        }
    }
}

#[test]
fn nothing_is_kept_of_a_file_that_changed_after_it_was_hashed() {
    let folder = tempfile::tempdir().unwrap();
    let (store, file) = (folder.path().join("store"), folder.path().join("raw.txt"));
    std::fs::write(&file, "abc").unwrap();
    let text = TWO.replace(
        "rows: 3",
        &format!("rows: 3, file: {:?}", file.display().to_string()),
    );
    let plan = plan(&text, &[]).unwrap();
    let with = |text: &str| {
        let hand = Hand { file: &file, text };
        run(
            &plan,
            &Store::open(&store).unwrap(),
            &options(None),
            &surroundings(),
            &hand,
        )
    };
    let error = with("abcdef").err().unwrap();
    let expected = format!(
        "{}: the file changed while stage `a` waited or ran: nothing of the stage was kept",
        file.display()
    );
    assert_eq!(
        (error.exit_code(), error.to_string().starts_with(&expected)),
        (75, true),
        "{error}"
    );
    // Were the table of six rows kept under the key of three bytes, it would be taken from here on.
    std::fs::write(&file, "abc").unwrap();
    let outcome = with("abc").unwrap();
    let first = &outcome.manifest.stages[0];
    assert_eq!(
        (first.status, &first.notes[..]),
        (StageStatus::Executed, &["3 rows".to_string()][..]),
        "written anew and the same"
    );
    assert!(with("abc").unwrap().nothing_done());
}

#[test]
fn inputs_are_wired_by_kind_or_by_wish() {
    let plan_by_kind = plan(TWO, &[]).unwrap();
    let from = |plan: &Plan, port: usize| {
        plan.stages[2].inputs[port]
            .from
            .iter()
            .map(|origin| origin.stage)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        (from(&plan_by_kind, 0), from(&plan_by_kind, 1)),
        (vec![1], vec![0, 1])
    );
    let wished = plan(
        &TWO.replace(
            "- uses: count",
            "- {uses: count, reads: {last: a, all: [b]}}",
        ),
        &[],
    )
    .unwrap();
    assert_eq!((from(&wished, 0), from(&wished, 1)), (vec![0], vec![1]));
}

#[test]
fn forcing_runs_what_is_cached() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(TWO, &[]).unwrap();
    go(folder.path(), &plan, &options(None)).unwrap();
    let (messages, _) = go(folder.path(), &plan, &options(Some(vec!["b".into()]))).unwrap();
    assert_eq!(messages, ["b: forced"]);
    let (messages, _) = go(folder.path(), &plan, &options(Some(Vec::new()))).unwrap();
    assert_eq!(messages, ["a: forced", "b: forced", "count: forced"]);
}

#[test]
fn a_selected_stage_needs_its_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let only = |id: &str| RunOptions {
        selection: Selection {
            only: Some(id.into()),
            ..Default::default()
        },
        jobs: 1,
        purpose: Purpose::Run,
    };
    let plan = plan(TWO, &[]).unwrap();
    let error = go(folder.path(), &plan, &only("count")).err().unwrap();
    assert!(
        error
            .to_string()
            .contains("stage `count` reads from `b`, which is not cached"),
        "{error}"
    );
    let (messages, outcome) = go(folder.path(), &plan, &only("a")).unwrap();
    assert_eq!(messages, ["a: never run"]);
    assert_eq!(outcome.manifest.stages[2].status, StageStatus::NotRun);
    let error = go(folder.path(), &plan, &only("cuont")).err().unwrap();
    assert_eq!(
        error.to_string(),
        "--only: no stage `cuont`; did you mean `count`? Allowed: a, b, count"
    );
}

#[test]
fn a_panic_is_a_bug_of_the_stage_and_leaves_the_others_done() {
    let folder = tempfile::tempdir().unwrap();
    let broken = plan(&TWO.replace("set: x", "set: panic"), &[]).unwrap();
    let error = go(folder.path(), &broken, &options(None)).err().unwrap();
    assert_eq!(
        (
            error.exit_code(),
            error.to_string().contains("stage b panicked: told to")
        ),
        (70, true),
        "{error}"
    );
    let (messages, _) = go(folder.path(), &plan(TWO, &[]).unwrap(), &options(None)).unwrap();
    assert_eq!(messages, ["b: never run", "count: never run"]);
}

#[test]
fn every_fault_of_a_pipeline_comes_at_once_in_the_order_of_the_file() {
    let text = "calib: 2
name: a/b
sed: 4
stages:
- {uses: source, with: {rows: 0, sett: x}}
- {id: b, uses: soruce}
- {id: source, uses: source, with: {rows: 2000, file: nowhere.txt}, wiht: 3}
- {uses: count, reads: {lost: source, last: later, all: [count]}}
- {id: later, uses: source, with: {rows: .inf, set: \"${sett}\"}}
";
    assert_eq!(
        faults(text, &["sead=3", "source.x.y=3"]),
        [
            "--set sead: no variable or setting of that name; did you mean `seed`? Allowed: sett, seed, source.SETTING, b.SETTING, source.SETTING, count.SETTING, later.SETTING",
            "p.yaml:1:8: calib: format 2 is not known to this calib, which reads 1",
            "p.yaml:2:7: name: `a/b`: expected letters, digits, `-` and `_`, starting with a letter or digit",
            "p.yaml:3:1: sed: unknown key; did you mean `seed`? Allowed: calib, name, seed, variables, stages",
            "p.yaml:5:31: stages[0].with.rows: expected a positive whole number, e.g. 4; found 0",
            "p.yaml:5:34: stages[0].with.sett: unknown key; did you mean `set`? Allowed: rows, set, file",
            "p.yaml:6:17: stages[1].uses: unknown stage `soruce`; did you mean `source`? Allowed: source, count",
            "p.yaml:7:3: stages[2]: two stages have the id `source`; give one of them another `id`",
            "p.yaml:7:43: stages[2].with.rows: at most 1000",
            "p.yaml:7:55: stages[2].with.file: no such file: `nowhere.txt` (paths are relative to the YAML file; those given by --set to the working directory)",
            "p.yaml:7:69: stages[2].wiht: unknown key; did you mean `with`? Allowed: id, uses, with, reads",
            "p.yaml:8:25: stages[3].reads.lost: stage `count` has no input `lost`; did you mean `last`? Allowed: last, all",
            "p.yaml:8:39: stages[3].reads.last: `later` comes later, which would be a cycle; a stage reads from stages before it",
            "p.yaml:8:52: stages[3].reads.all: `count` is this stage itself, which would be a cycle; a stage reads from stages before it",
            "p.yaml:9:42: stages[4].with.rows: expected a finite number; found .inf",
            "p.yaml:9:53: stages[4].with.set: `${sett}` is not defined. Give it under `variables` or by --set sett=VALUE",
            "--set: stages[0].with.x: unknown key. Allowed: rows, set, file",
        ]
    );
}

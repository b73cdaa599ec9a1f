//! `calib query`: SQL over the tables of a run gives what the tables hold.

use crate::answer::{self, Answer, ends_with, has, root};
use calib::audit::{self, QueryTables};
use calib::pipeline::{Manifest, find_run};
use calib::store::Store;
use calib::table::{Prediction, PredictionRow, Recording, Table};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::bucket::bucket_of;

/// One run that all tests ask.
static STORE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = root("tests/it/resume/pipeline.yaml");
    let run = ["run", pipeline.to_str().unwrap(), "--quiet"];
    calib(folder.path(), &run).ok();
    folder
});

fn calib(store: &Path, words: &[&str]) -> Answer {
    let store = store.to_str().unwrap();
    answer::calib(".", &[words, &["--store", store]].concat())
}
fn ask(words: &[&str]) -> String {
    calib(STORE.path(), &[&["query", "HEAD"], words].concat()).ok()
}
fn refused(sql: &str) -> String {
    let answer = calib(STORE.path(), &["query", "HEAD", sql]).code(2);
    assert_eq!(answer.out, "", "{sql}");
    answer.err
}
/// The objects of `--json`.
fn rows(sql: &str) -> Vec<Value> {
    serde_json::from_str::<Vec<Value>>(&ask(&[sql, "--json"])).unwrap()
}
fn table<T: Table>(name: &str) -> T {
    let store = Store::open(STORE.path()).unwrap();
    let tables =
        QueryTables::of(&Manifest::of(&store, &find_run(&store, "HEAD").unwrap()).unwrap());
    T::from_frame(&store.load(&tables.find(name).unwrap().table).unwrap()).unwrap()
}
fn objects(store: &Path) -> Vec<PathBuf> {
    let folders = std::fs::read_dir(store.join("objects"))
        .into_iter()
        .flatten();
    folders
        .flat_map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap())
        .map(|file| file.unwrap().path())
        .collect()
}
fn prediction(stage: &str) -> Vec<PredictionRow> {
    table::<Prediction>(&format!("{stage}_prediction")).0
}

#[test]
fn without_sql_tables_are_listed_with_rows_columns_and_units() {
    let printed = ask(&[]);
    for line in [
        "  geometry_prediction  80 rows\n",
        "  nominal_prediction   80 rows\n",
        "  simulate_recording  80 rows, also `recording`\n",
        "  mm     Measured minus predicted, x in the tracker frame.\n",
    ] {
        assert!(printed.contains(line), "{line}: {printed}");
    }
    assert!(!printed.contains("also `prediction`"), "{printed}");
    let one = ask(&["geometry.prediction"]);
    assert!(
        one.starts_with("prediction: ")
            && one.contains("geometry_prediction")
            && !one.contains("nominal_prediction"),
        "{one}"
    );
    let listed: Vec<Value> = serde_json::from_str(&ask(&["--json"])).unwrap();
    let recording = listed
        .iter()
        .find(|table| table["table"] == "simulate_recording")
        .unwrap();
    assert_eq!(
        (&recording["rows"], &recording["short"]),
        (&80.into(), &"recording".into())
    );
    let columns = recording["columns"].as_array().unwrap();
    let q6 = columns
        .iter()
        .find(|column| column["name"] == "q6_rad")
        .unwrap();
    assert_eq!(
        (&q6["unit"], &q6["type"]),
        (&"rad".into(), &"float64".into())
    );
}

#[test]
fn groups_hold_what_the_table_holds_in_the_order_of_its_rows() {
    let ours = prediction("geometry");
    let mut order: Vec<&str> = Vec::new();
    let mut groups: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for row in &ours {
        if !order.contains(&row.set.as_str()) {
            order.push(&row.set);
        }
        groups.entry(&row.set).or_default().push(row.error_mm);
    }
    assert!(groups.len() > 1, "{groups:?}");
    let sql = "SELECT step, \"set\", count(*) AS points, avg(error_mm) AS mean_mm, max(error_mm) AS max_mm \
               FROM geometry.prediction GROUP BY step, \"set\"";
    let entries = rows(sql);
    assert_eq!(
        entries
            .iter()
            .map(|row| row["set"].as_str().unwrap())
            .collect::<Vec<_>>(),
        order
    );
    for row in &entries {
        let errors = &groups[row["set"].as_str().unwrap()];
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        assert_eq!(
            (&row["step"], &row["points"]),
            (&"geometry".into(), &errors.len().into())
        );
        assert!((row["mean_mm"].as_f64().unwrap() - mean).abs() < 1e-12);
        assert_eq!(
            row["max_mm"].as_f64().unwrap(),
            errors.iter().copied().fold(0.0, f64::max)
        );
    }
    // As many groups as rows, which threads would give in any order; the same of what is joined, distinct or left over.
    let errors: Vec<f64> = ours.iter().map(|row| row.error_mm).collect();
    for sql in [
        "SELECT error_mm FROM geometry_prediction GROUP BY error_mm",
        "SELECT DISTINCT error_mm FROM geometry_prediction",
        "SELECT g.error_mm FROM geometry_prediction g JOIN recording r ON r.sequence = g.sequence",
        "SELECT error_mm FROM geometry_prediction EXCEPT SELECT error_mm FROM geometry_prediction WHERE error_mm < 0",
        "SELECT error_mm FROM geometry_prediction WHERE sequence IN (SELECT sequence FROM recording)",
    ] {
        let answer: Vec<f64> = rows(sql)
            .iter()
            .map(|row| row["error_mm"].as_f64().unwrap())
            .collect();
        assert_eq!(answer, errors, "{sql}");
    }
    let grid = ask(&[sql]);
    assert!(
        grid.starts_with("step ") && grid.lines().count() == 1 + entries.len(),
        "{grid}"
    );
}

#[test]
fn tables_are_joined_by_their_points_in_the_order_of_the_first() {
    let (nominal, geometry) = (prediction("nominal"), prediction("geometry"));
    let after: BTreeMap<i64, f64> = geometry
        .iter()
        .map(|row| (row.sequence, row.error_mm))
        .collect();
    let entries = rows(
        "SELECT n.sequence, n.error_mm - g.error_mm AS gain_mm FROM nominal.prediction n \
         JOIN \"geometry/prediction\" AS g ON n.sequence = g.sequence",
    );
    assert_eq!(entries.len(), nominal.len());
    for (row, ours) in entries.iter().zip(&nominal) {
        assert_eq!(row["sequence"], ours.sequence);
        assert_eq!(
            row["gain_mm"].as_f64().unwrap(),
            ours.error_mm - after[&ours.sequence]
        );
    }
    // Another kind of table, by its short name, and what has no pair.
    let recording: Recording = table("recording");
    let entries = rows(
        "SELECT recording.sequence FROM recording WHERE sequence NOT IN \
         (SELECT sequence FROM geometry_prediction WHERE error_mm >= 0)",
    );
    assert_eq!(
        (entries.len(), recording.to_frame().unwrap().rows()),
        (0, 80)
    );
    let ours = rows(
        "SELECT geometry.prediction.step AS s FROM geometry.prediction JOIN recording USING (sequence) LIMIT 3",
    );
    assert_eq!(
        ours.iter()
            .map(|row| row["s"].as_str().unwrap())
            .collect::<Vec<_>>(),
        ["geometry"; 3]
    );
}

#[test]
fn with_window_and_order_are_answered() {
    let mut ours = prediction("geometry");
    ours.sort_by(|a, b| b.error_mm.total_cmp(&a.error_mm));
    let entries = rows(
        "WITH worst AS (SELECT sequence, error_mm, ROW_NUMBER() OVER (PARTITION BY step ORDER BY error_mm DESC) AS place \
         FROM geometry_prediction) SELECT sequence FROM worst WHERE place <= 3 ORDER BY place",
    );
    let worst: Vec<i64> = entries
        .iter()
        .map(|row| row["sequence"].as_i64().unwrap())
        .collect();
    assert_eq!(
        worst,
        ours[..3].iter().map(|row| row.sequence).collect::<Vec<_>>()
    );
}

#[test]
fn csv_and_json_hold_every_row_to_the_last_digit() {
    let ours = prediction("geometry");
    let sql = "SELECT sequence, point_id, error_mm, turn_rad FROM (SELECT *, NULL AS turn_rad FROM geometry_prediction)";
    let text = ask(&[sql, "--csv"]);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    assert_eq!(
        reader.headers().unwrap(),
        vec!["sequence", "point_id", "error_mm", "turn_rad"]
    );
    let records: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(records.len(), ours.len());
    let objects = rows(sql);
    for ((record, object), row) in records.iter().zip(&objects).zip(&ours) {
        assert_eq!(
            (record[2].parse::<f64>().unwrap(), &record[3]),
            (row.error_mm, "")
        );
        assert_eq!(
            (&record[0], &record[1]),
            (row.sequence.to_string().as_str(), row.point_id.as_str())
        );
        assert_eq!(
            (object["error_mm"].as_f64().unwrap(), &object["turn_rad"]),
            (row.error_mm, &Value::Null)
        );
    }
    assert_eq!(objects.len(), ours.len());
}

#[test]
fn fifty_rows_are_shown_and_the_others_counted() {
    let sql = "SELECT sequence, error_mm FROM geometry_prediction";
    let printed = ask(&[sql]);
    assert_eq!(printed.lines().count(), 52);
    ends_with(
        &printed,
        "\n30 more rows: --rows N shows N of them, --csv and --json all\n",
    );
    assert_eq!(ask(&[sql, "--rows", "0"]).lines().count(), 81);
    assert_eq!(ask(&[sql, "--rows", "3"]).lines().count(), 5);
    assert!(
        ask(&["SELECT sequence FROM geometry_prediction WHERE error_mm < 0"])
            .ends_with("no rows\n")
    );
}

#[test]
fn what_is_not_there_is_named_with_what_is() {
    let printed = refused("SELECT * FROM geometry_predicton");
    has(
        &printed,
        "no table `geometry_predicton`; did you mean `geometry_prediction`? Its tables: ",
    );
    has(&printed, ["simulate_recording", "nominal_parameters"]);
    let printed = refused("SELECT eror_mm FROM geometry_prediction");
    has(
        &printed,
        "no column `eror_mm`; did you mean `error_mm`? Columns of geometry_prediction: sequence, ",
    );
    let printed =
        refused("SELECT g.eror_mm FROM geometry_prediction g JOIN recording USING (sequence)");
    has(
        &printed,
        [
            "no column `eror_mm`; did you mean `error_mm`?",
            "of recording: ",
        ],
    );
    let printed = refused("SELECT sequence FROM prediction");
    has(
        &printed,
        "`prediction` is written by several stages; say which: nominal.prediction, geometry.prediction",
    );
    let printed = refused("SELECT step, sum(error_mm FROM geometry_prediction");
    has(&printed, ["SQL: Expected: ", "Line: 1, Column: "]);
    let printed = refused("SELECT step FROM geometry_prediction ORDER BY 0");
    assert!(
        printed.starts_with("error: SQL: ") && printed.lines().count() == 1,
        "{printed}"
    );
    assert!(refused("recordin").contains("did you mean `recording`?"));
}

#[test]
fn under_json_a_fault_is_a_document_too() {
    let output = calib(
        STORE.path(),
        &["query", "HEAD", "SELECT * FROM nosuch", "--json"],
    );
    let answer = output.json();
    assert_eq!(
        (output.code, &answer["status"], &answer["exit_code"]),
        (Some(2), &"failed".into(), &2.into())
    );
    let message = answer["faults"][0]["message"].as_str().unwrap();
    assert!(message.contains("no table `nosuch`"), "{answer}");
    has(&output.err, message);
}

#[test]
fn a_product_of_tables_that_no_memory_holds_is_refused_before_it_is_made() {
    for sql in [
        "SELECT count(*) FROM recording a CROSS JOIN recording b CROSS JOIN recording c CROSS JOIN recording d CROSS JOIN recording e",
        "WITH p AS (SELECT a.sequence FROM recording a CROSS JOIN recording b) SELECT * FROM p x CROSS JOIN p y CROSS JOIN p z",
        "SELECT a.sequence FROM recording a, recording b, (SELECT x.sequence FROM recording x, recording y) c, recording d",
    ] {
        let printed = refused(sql);
        assert!(
            printed.contains("every row of one table with every row of the other gives")
                && printed.contains("USING"),
            "{sql}: {printed}"
        );
    }
    // 80 rows twice are no harm.
    assert_eq!(
        rows("SELECT a.sequence FROM recording a CROSS JOIN recording b").len(),
        6400
    );
}

#[test]
fn a_text_that_a_spreadsheet_would_run_is_only_a_text_in_csv() {
    let sql = "SELECT '=1+1' AS a, '@x' AS b, '-2.5' AS c, '+x' AS d, sequence AS \"=e\" FROM recording LIMIT 1";
    assert_eq!(ask(&[sql, "--csv"]), "a,b,c,d,'=e\n'=1+1,'@x,-2.5,'+x,0\n");
    assert_eq!(rows(sql)[0]["a"], "=1+1");
}

#[test]
fn nothing_but_the_tables_of_the_run_is_read_and_nothing_changed() {
    let before = objects(STORE.path());
    for sql in [
        "DROP TABLE recording",
        "DELETE FROM recording WHERE sequence = 1",
        "CREATE TABLE mine AS SELECT * FROM recording",
        "SELECT 1; SELECT 2",
    ] {
        assert!(refused(sql).contains("expected one SELECT"), "{sql}");
    }
    let printed = refused("SELECT * FROM read_parquet('other.parquet')");
    has(&printed, "no table `read_parquet`");
    assert_eq!(objects(STORE.path()), before);
    let output = calib(STORE.path(), &["query", "SELECT * FROM recording"]);
    has(&output.code(2).err, "the run comes before the SQL");
}

#[test]
fn of_a_store_in_a_bucket_the_tables_that_are_asked_are_fetched() {
    let folder = tempfile::tempdir().unwrap();
    let store = bucket_of(STORE.path(), &folder.path().join("cache"));
    let tables =
        QueryTables::of(&Manifest::of(&store, &find_run(&store, "HEAD").unwrap()).unwrap());
    let answer = audit::query(
        &store,
        &tables,
        "SELECT r.sequence FROM recording r JOIN split USING (sequence)",
    )
    .unwrap();
    assert_eq!((answer.rows(), objects(store.root()).len()), (80, 2));
}

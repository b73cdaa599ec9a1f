//! Every table kind: one schema, and a round trip through the store for no row, one row and extreme values.
//!
//! The JSON Schema of the YAML files: what editors complete from.

use crate::answer::{has, read, root};
use arrow::array::Array;
use calib::pipeline::json_schema;
use calib::stage::STAGES;
use calib::store::frame::{Cell, Frame, FrameBuilder};
use calib::store::schema::{self, ColumnType, FieldSchema};
use calib::store::{Account, PendingTable, Store};
use calib::table::{self, Table};
use std::collections::BTreeSet;
use std::path::PathBuf;

use super::store::key;

/// Which value of its range a cell takes.
#[derive(Debug, Clone, Copy)]
enum Extreme {
    Lowest,
    Highest,
    /// Null where allowed, else the least number above nothing, or the emptiest text.
    Least,
}

fn cell(
    field: &FieldSchema,
    extreme: Extreme,
    row: usize,
    key: bool,
) -> (Option<f64>, Option<i64>, Option<String>, Option<bool>) {
    let none = field.nullable && matches!(extreme, Extreme::Least);
    let range = &field.constraints;
    let (low, high) = (range.min.unwrap_or(f64::MIN), range.max.unwrap_or(f64::MAX));
    let number = match extreme {
        Extreme::Lowest => low,
        Extreme::Highest => high,
        Extreme::Least => f64::from_bits(1).max(low),
    };
    let whole = match extreme {
        _ if key => range
            .min
            .map_or(i64::MIN + 1, |low| low as i64)
            .saturating_add(row as i64),
        Extreme::Lowest => range.min.map_or(i64::MIN, |low| low as i64),
        Extreme::Highest => range.max.map_or(i64::MAX, |high| high as i64),
        Extreme::Least => range.min.map_or(0, |low| low as i64),
    };
    let text = match (&range.values[..], extreme) {
        ([], _) if key => format!("{row:03} \u{1F916}\0\"'\n"),
        ([], Extreme::Lowest) => String::new(),
        ([], _) => "=\u{10FFFF}<script>\r\n".repeat(1000),
        ([.., last], Extreme::Highest) => last.clone(),
        ([first, ..], _) => first.clone(),
    };
    let truth = matches!(extreme, Extreme::Highest);
    (
        (!none).then_some(number),
        (!none).then_some(whole),
        (!none).then_some(text),
        (!none).then_some(truth),
    )
}

fn frame(kind: &str, rows: &[Extreme]) -> Frame {
    let schema = schema::of(kind).unwrap();
    let mut builder = FrameBuilder::new(kind);
    let mut either = Vec::new();
    for field in &schema.fields {
        if field.either.is_some() && either.contains(&&field.either) {
            continue;
        }
        either.push(&field.either);
        let joints: Vec<Option<usize>> = if field.per_joint {
            (1..=7).map(Some).collect()
        } else {
            vec![None]
        };
        for joint in joints {
            let key = schema.primary_key.contains(&field.name);
            let cells: Vec<_> = rows
                .iter()
                .enumerate()
                .map(|(row, extreme)| cell(field, *extreme, row, key))
                .collect();
            let cells = cells.into_iter();
            let array = match field.column_type {
                ColumnType::Float64 => Cell::to_array(cells.map(|cell| cell.0).collect()),
                ColumnType::Int64 => Cell::to_array(cells.map(|cell| cell.1).collect()),
                ColumnType::Utf8 => Cell::to_array(cells.map(|cell| cell.2).collect()),
                ColumnType::Boolean => Cell::to_array(cells.map(|cell| cell.3).collect()),
            };
            // Lists of rows leave an optional column out that has no value.
            if !field.optional || kind == "recording" || array.null_count() < array.len() {
                builder.push(field.column(joint), array);
            }
        }
    }
    builder.finish().unwrap()
}

fn round_trip<T: Table>() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let cases: [&[Extreme]; 4] = [
        &[],
        &[Extreme::Lowest],
        &[Extreme::Highest],
        &[Extreme::Least],
    ];
    for (case, rows) in cases.into_iter().enumerate() {
        let written = frame(T::KIND, rows);
        let products = vec![("out".to_string(), PendingTable::Frame(written.clone()))];
        let record = store
            .publish(&key(T::KIND, case as u64), products, Account::default())
            .unwrap()
            .record;
        let table = &record.tables["out"];
        let read = store.load(table).unwrap();
        assert_eq!(read, written, "{} with {rows:?}", T::KIND);
        assert_eq!(
            (table.rows, &table.table_hash),
            (rows.len() as u64, &read.table_hash())
        );
        let values = T::from_frame(&read).unwrap();
        // The recording converts units, which rounds in the last digit; for it the names of the columns have to do.
        let back = values.to_frame().unwrap();
        assert!(
            back.column_names().eq(written.column_names()),
            "{}",
            T::KIND
        );
        if T::KIND != "recording" {
            assert_eq!(back, written, "{}", T::KIND);
        }
    }
}

macro_rules! kinds {
    ($($kind:ident)*) => {
        const KINDS: &[&str] = &[$(<table::$kind as Table>::KIND),*];
        #[test]
        fn every_table_survives_a_round_trip_empty_with_one_row_and_with_extreme_values() {
            $( round_trip::<table::$kind>(); )*
        }
    };
}
kinds! { Acceptance BodyConsistencies CellAmplitudes CellEvidence Cells Changes Contacts JointConventions Corrections CovarianceTable Curves Document DriveCourse DriveSimulation DriveVerdict FindingNumbers Findings Fit FleetTable FleetCells FleetChanges FleetFindings FleetOutliers Forms FrictionCurves Inertials Intake JointDrives JointTorques ArmMotion Network Observability Parameters Prediction Recording Rejected Rivals Robot Scoreboard SearchCourse Searches Shares Spectrum Split
Statistics Suspects TorqueChangeTable TorqueCourse TorqueCovariance TorqueFindings TorqueNumbers TorqueParameters TorqueRivals TorqueVerdict Training Truth Verdict VerdictSentences }

#[test]
fn every_table_is_tested_and_has_exactly_one_schema() {
    assert_eq!(KINDS, table::TABLES);
    let embedded: Vec<&str> = schema::all().map(|schema| schema.name.as_str()).collect();
    assert_eq!(
        embedded,
        table::TABLES,
        "schemas/*.json and TABLES of src/table/lib.rs, by name"
    );
    let folder = root("schemas");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.retain(|name| name.ends_with(".json") && !name.ends_with(".schema.json"));
    files.sort();
    assert_eq!(
        files,
        table::TABLES
            .iter()
            .map(|kind| format!("{kind}.json"))
            .collect::<Vec<_>>()
    );
}

#[test]
fn a_recording_keeps_its_quantities_its_gaps_and_its_prismatic_joint() {
    let nan = f64::NAN;
    let recording = table::Recording {
        joints: 2,
        prismatic: vec![true, false],
        sequence: vec![3, 7],
        point_id: vec!["P1".into(), "P1".into()],
        usage: vec![Some("fit".into()), None],
        q: vec![1.25, -0.5, 2.5, 3.0],
        position: vec![[1.0, -2.0, 0.125], [0.0, 0.5, 4.0]],
        position_sigma: None,
        time: Some(vec![0.0, nan]),
        payload: Some(vec![210.0, 0.0]),
        temperature: None,
        current: Some(vec![1.0, nan, -2.0, 0.0]),
        direction: Some(vec![1.0, -1.0, 0.0, nan]),
        ..table::Recording::default()
    };
    let frame = recording.to_frame().unwrap();
    let names: Vec<&str> = frame.column_names().collect();
    assert_eq!(
        names.join(" "),
        "sequence point_id usage q1_mm q2_rad x_mm y_mm z_mm time_s payload_kg i1_a i2_a dir1 dir2"
    );
    assert_eq!(frame.read::<f64>("q1_mm").unwrap(), [1250.0, 2500.0]);
    assert_eq!(
        frame.read::<Option<f64>>("time_s").unwrap(),
        [Some(0.0), None]
    );
    assert_eq!(
        frame.read::<Option<f64>>("i2_a").unwrap(),
        [None, Some(0.0)]
    );
    let back = table::Recording::from_frame(&frame).unwrap();
    // NaN is not equal to itself, so the two are compared as text.
    assert_eq!(format!("{back:?}"), format!("{recording:?}"));
}

#[test]
fn a_recording_without_joints_or_with_degrees_for_radians_is_refused() {
    let none = table::Recording::default().to_frame().unwrap_err();
    assert!(
        none.to_string().contains("no column of any joint"),
        "{none}"
    );
    let degrees = table::Recording {
        joints: 1,
        prismatic: vec![false],
        sequence: vec![0, 1],
        point_id: vec!["a".into(), "b".into()],
        usage: vec![None, None],
        q: vec![90.0, -45.0],
        position: vec![[0.0; 3]; 2],
        ..Default::default()
    };
    let error = degrees.to_frame().unwrap_err();
    assert_eq!(error.exit_code(), 10);
    assert_eq!(
        error.to_string(),
        "table recording, column q1_rad, sequence 0: 90 rad is out of range; allowed: -20 to 20 rad (and 1 more row)"
    );
}

/// Runs where Python has the four readers; `CALIB_PYTHON` names another interpreter than `python3`.
#[test]
fn duckdb_pandas_pyarrow_and_polars_read_every_table_with_its_units_and_key() {
    let python = std::env::var("CALIB_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |arguments: &[&std::ffi::OsStr]| {
        std::process::Command::new(&python).args(arguments).output()
    };
    let import = "import duckdb, pandas, polars, pyarrow";
    if !run(&["-c".as_ref(), import.as_ref()]).is_ok_and(|output| output.status.success()) {
        crate::desk::skipped(&format!(
            "{python} has not all of duckdb, pandas, pyarrow and polars"
        ));
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    for (case, rows) in [
        ("empty", &[][..]),
        (
            "extreme",
            &[Extreme::Lowest, Extreme::Highest, Extreme::Least],
        ),
    ]
    .into_iter()
    {
        for kind in KINDS {
            let products = vec![("out".to_string(), PendingTable::Frame(frame(kind, rows)))];
            let record = store
                .publish(
                    &key(&format!("{case} {kind}"), 0),
                    products,
                    Account::default(),
                )
                .unwrap()
                .record;
            store
                .expose(case, kind, "out", &record.tables["out"])
                .unwrap();
        }
    }
    let script = root("tests/reference/read_tables.py");
    let output = run(&[script.as_os_str(), folder.path().as_os_str()]).unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{printed}");
    has(&printed, &format!("{} tables read alike", 2 * KINDS.len()));
}

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
        "a stage is missing in STAGES (src/stage/lib.rs)"
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

#[test]
fn a_number_out_of_range_is_a_bug_in_what_calib_made_and_a_fault_in_what_people_gave() {
    let made = table::Findings(vec![table::FindingRow {
        probability: Some(-3e-14),
        ..Default::default()
    }]);
    let given = table::Robot(vec![table::RobotRow {
        kind: "base".into(),
        gravity_m_s2: Some(-9.81),
        ..Default::default()
    }]);
    let codes = [made.to_frame(), given.to_frame()].map(|frame| {
        let error = frame.unwrap_err();
        (
            error.exit_code(),
            error.to_string().contains("out of range"),
        )
    });
    assert_eq!(codes, [(70, true), (10, true)]);
}

//! Many robots, Parquet in and out through the store: CPU time against that of the fits alone.

use crate::problem::Case;
use calib::store::key::{KEY_FORMAT, StageKey};
use calib::store::{Account, PendingTable, Store};
use calib::table::{Fit, FitContext, Observability, Parameters, Recording, Table};
use std::collections::BTreeMap;

/// Points of each robot.
const ROWS: usize = 160;

/// Prints CPU time per robot: reading its recording, fitting, and publishing parameters, course and observability.
pub fn fleet(robots: usize) -> calib::error::Result<()> {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::open(folder.path())?;
    let mut recordings = Vec::new();
    for robot in 0..robots {
        let case = Case::simulated_as(ROWS, robot as u64);
        let product = PendingTable::Frame(recording(&case).to_frame()?);
        let published = store.publish(
            &key("simulate", robot),
            vec![("recording".into(), product)],
            Account::default(),
        )?;
        recordings.push(published.record.tables["recording"].clone());
    }
    let template = Case::simulated(ROWS);
    let mut spent = BTreeMap::from([
        ("1 read", 0.0),
        ("2 fit", 0.0),
        ("3 tables", 0.0),
        ("4 publish", 0.0),
    ]);
    for (robot, table) in recordings.iter().enumerate() {
        let clock = cpu_seconds();
        let read = Recording::from_frame(&store.load(table)?)?;
        let case = Case {
            data: read.measurements(),
            ..template.clone()
        };
        let clock = add(&mut spent, "1 read", clock);
        let (model, fitted) = case.fit();
        let clock = add(&mut spent, "2 fit", clock);
        let products = vec![
            (
                "parameters".to_string(),
                PendingTable::Frame(
                    Parameters::of("identify", &model, &fitted, &[], None).to_frame()?,
                ),
            ),
            (
                "fit".to_string(),
                PendingTable::Frame(Fit::of("identify", &fitted).to_frame()?),
            ),
            (
                "observability".to_string(),
                PendingTable::Frame(
                    Observability::of("identify", &fitted, &FitContext::default()).to_frame()?,
                ),
            ),
        ];
        let clock = add(&mut spent, "3 tables", clock);
        store.publish(&key("identify", robot), products, Account::default())?;
        add(&mut spent, "4 publish", clock);
    }
    let whole: f64 = spent.values().sum();
    for (part, seconds) in &spent {
        println!(
            "{:<10} {:>8.2} ms CPU a robot",
            &part[2..],
            seconds / robots as f64 * 1e3
        );
    }
    println!(
        "{robots} robots of {ROWS} points: {:.2} x the CPU time of the fits alone",
        whole / spent["2 fit"]
    );
    Ok(())
}

fn recording(case: &Case) -> Recording {
    let joints = case.data.joints;
    Recording {
        joints,
        prismatic: vec![false; joints],
        sequence: (0..case.data.rows() as i64).collect(),
        point_id: (0..case.data.rows()).map(|row| format!("{row}")).collect(),
        usage: vec![None; case.data.rows()],
        q: case.data.q.clone(),
        position: case
            .data
            .points
            .position
            .iter()
            .map(|point| [point.x, point.y, point.z])
            .collect(),
        payload: Some(case.data.payload.clone()),
        ..Recording::default()
    }
}

fn key(stage: &str, robot: usize) -> StageKey {
    StageKey {
        key_format: KEY_FORMAT,
        id: stage.into(),
        stage: stage.into(),
        implementation: 1,
        settings: serde_json::Value::Null,
        reads: BTreeMap::new(),
        files: BTreeMap::new(),
        schemas: BTreeMap::new(),
        seed: robot as u64,
    }
}

fn add(spent: &mut BTreeMap<&str, f64>, part: &'static str, since: f64) -> f64 {
    let now = cpu_seconds();
    *spent.entry(part).or_default() += now - since;
    now
}

/// CPU time of all threads, s.
pub fn cpu_seconds() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task")
        .into_iter()
        .flatten()
        .flatten();
    let nanoseconds = threads.filter_map(|thread| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-9
}

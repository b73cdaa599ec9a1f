//! Benches of the fit. `cargo bench` runs the criterion groups; further forms print figures instead:
//!
//! - `cargo bench -- solve FILE` fits a problem that `compare.py` wrote and prints its time and held-out error as JSON;
//! - `cargo bench -- curve [ROWS ...]` prints time and peak memory over the number of points;
//! - `cargo bench -- fleet [ROBOTS]` prints CPU time of many robots, Parquet in and out, against that of their fits;
//! - `cargo bench -- bare FILE ...` reads delimited files by the csv crate and nothing else (`tests/reference/ingest_speed.py`);
//! - `cargo bench -- swarm` prints how often and how fast each swarm optimiser finds a known minimum.

#![expect(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "benches read the clock and print figures"
)]

use std::hint::black_box;

mod bare;
#[path = "../it/fixture.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod fixture;
mod fleet;
mod problem;
mod solve;
mod swarm;

use criterion::{BenchmarkId, Criterion, Throughput};
use nalgebra::Vector3;
use problem::Case;

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    match arguments.split_first() {
        Some((verb, files)) if verb == "solve" => files.iter().for_each(|file| solve::solve(file)),
        Some((verb, rows)) if verb == "curve" => solve::curve(rows),
        Some((verb, count)) if verb == "fleet" => {
            let robots = count
                .first()
                .and_then(|text| text.parse().ok())
                .unwrap_or(1_000);
            fleet::fleet(robots).unwrap_or_else(|error| panic!("{error}"));
        }
        Some((verb, files)) if verb == "bare" => bare::read(files),
        Some((verb, _)) if verb == "swarm" => swarm::table(),
        _ => criterion(),
    }
}

fn criterion() {
    let mut criterion = Criterion::default().configure_from_args();
    let case = Case::simulated(160);
    criterion.bench_function("fit of 160 points, 48 parameters", |bencher| {
        bencher.iter(|| black_box(case.fit().1.stop))
    });

    let (model, _) = case.fit();
    let mut scratch = model.stack.scratch(&model.robot);
    criterion.bench_function("jacobian of 160 rows", |bencher| {
        bencher.iter(|| {
            let mut sum = Vector3::zeros();
            for row in 0..160 {
                model.stack.derivatives(
                    &model.robot,
                    &case.data,
                    row,
                    &model.x,
                    &mut scratch,
                    |_, derivative| sum += derivative,
                );
            }
            sum
        });
    });

    let mut group = criterion.benchmark_group("fit over points");
    group.sample_size(10);
    for rows in [1_000, 10_000] {
        let case = Case::simulated(rows);
        group.throughput(Throughput::Elements(rows as u64));
        group.bench_with_input(BenchmarkId::from_parameter(rows), &case, |bencher, case| {
            bencher.iter(|| black_box(case.fit().1.stop));
        });
    }
    group.finish();
    criterion.final_summary();
}

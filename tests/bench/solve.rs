//! Figures that criterion does not make: one problem from a file, and the curve over points with its memory.

use crate::fleet::cpu_seconds;
use crate::problem::Case;
use std::time::Instant;

/// Batches of fits; the least time is the one without the machine's other work.
const BATCHES: usize = 6;
/// Fits in a batch: the kernel's clock of CPU time ticks every few milliseconds.
const FITS: usize = 25;

/// Prints CPU time, size and held-out error of the problem in `file` as a line of JSON.
pub fn solve(file: &str) {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{file}: {error}"));
    let case =
        Case::read(&serde_json::from_str(&text).unwrap_or_else(|error| panic!("{file}: {error}")));
    let mut seconds: Vec<f64> = (0..BATCHES)
        .map(|_| {
            let start = cpu_seconds();
            (0..FITS).for_each(|_| drop(std::hint::black_box(case.fit())));
            (cpu_seconds() - start) / FITS as f64
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    let (model, fitted) = case.fit();
    let predicted = model.predict(&case.data);
    let held_out = case.rows.len()..case.data.rows();
    let errors: Vec<f64> = held_out
        .map(|row| (predicted[row] - case.data.points.position[row]).norm_squared())
        .collect();
    let rms = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
    println!(
        "{}",
        serde_json::json!({
            "seconds": seconds[0], "median": seconds[BATCHES / 2], "held_out": rms, "stop": fitted.stop.name(),
            "candidates": fitted.singular_all.len(), "free": fitted.singular.len(),
        })
    );
}

/// Prints seconds per fit and the peak of memory at growing numbers of points.
pub fn curve(rows: &[String]) {
    let asked: Vec<usize> = rows.iter().filter_map(|text| text.parse().ok()).collect();
    println!(
        "{:>9} {:>10} {:>14} {:>12} {:>12}",
        "points", "s per fit", "us per point", "data MB", "peak MB"
    );
    for rows in if asked.is_empty() {
        vec![1_000, 10_000, 100_000, 1_000_000]
    } else {
        asked
    } {
        let case = Case::simulated(rows);
        let before = peak();
        let start = Instant::now();
        std::hint::black_box(case.fit());
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{rows:>9} {seconds:>10.3} {:>14.2} {before:>12.0} {:>12.0}",
            seconds / rows as f64 * 1e6,
            peak()
        );
    }
}

/// Most memory that the process has held so far, MB.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok())
        .unwrap_or(f64::NAN)
        / 1024.0
}

//! Table 2 of Wang et al. (2020) with times: success, evaluations and wall time to the target beside the paper's, and in ten
//! dimensions, of which a network has more.

use calib::estimate::swarm::{Algorithm, Landscape, SearchStop};
use calib::stage::{BenchmarkProblem, Optimise};
use std::time::Instant;

/// The paper's times to the target, s; none for its own method.
const PUBLISHED: [(Algorithm, f64); 4] = [
    (Algorithm::Bas, 0.087843),
    (Algorithm::Pso, 0.215134),
    (Algorithm::Ga, 0.262317),
    (Algorithm::Abc, 0.132563),
];

/// Prints the tables, each search on one core.
pub fn table() {
    let stage = Optimise::default();
    compare(&stage, &stage.problems[0], stage.seeds, &PUBLISHED);
    for function in [
        Landscape::Rastrigin,
        Landscape::Rosenbrock,
        Landscape::Ackley,
        Landscape::Michalewicz,
    ] {
        compare(
            &stage,
            &BenchmarkProblem {
                function,
                dimensions: 10,
                tolerance: 1e-2,
            },
            30,
            &[],
        );
    }
}

fn compare(
    stage: &Optimise,
    problem: &BenchmarkProblem,
    seeds: usize,
    published: &[(Algorithm, f64)],
) {
    println!(
        "{}-D {}, absolute error {:e}, {seeds} seeds, at most {} evaluations, one core",
        problem.dimensions,
        problem.function.name(),
        problem.tolerance,
        stage.evaluations
    );
    println!(
        "{:<6} {:>7} {:>9} {:>9} {:>9} {:>9} {:>10} {:>9} {:>8}",
        "method",
        "found",
        "evals p50",
        "evals p90",
        "ms p50",
        "ms p90",
        "error p50",
        "paper ms",
        "ratio"
    );
    let minimum = problem
        .function
        .minimum(problem.dimensions)
        .unwrap_or(f64::NEG_INFINITY);
    for method in Algorithm::ALL {
        let (mut times, mut evaluations, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        for seed in 0..seeds as u64 {
            let begun = Instant::now();
            let outcome = stage.search(problem, method, seed);
            let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
            errors.push((outcome.value - minimum).max(0.0));
            if outcome.stop == SearchStop::Target {
                times.push(milliseconds);
                evaluations.push(outcome.evaluations as f64);
            }
        }
        let found = 100.0 * times.len() as f64 / seeds as f64;
        let shown = |values: &[f64], share: f64, digits: usize| {
            quantile(values, share)
                .map_or_else(|| "-".to_string(), |value| format!("{value:.digits$}"))
        };
        let paper = published
            .iter()
            .find(|row| row.0 == method)
            .map(|row| row.1 * 1e3);
        let ratio = paper
            .zip(quantile(&times, 0.5))
            .map(|(paper, ours)| format!("{:.0} x", paper / ours));
        println!(
            "{:<6} {found:>6.1}% {:>9} {:>9} {:>9} {:>9} {:>10.1e} {:>9} {:>8}",
            method.name(),
            shown(&evaluations, 0.5, 0),
            shown(&evaluations, 0.9, 0),
            shown(&times, 0.5, 3),
            shown(&times, 0.9, 3),
            quantile(&errors, 0.5).unwrap_or(f64::NAN),
            paper.map_or_else(|| "-".into(), |ms| format!("{ms:.1}")),
            ratio.unwrap_or_else(|| "-".into()),
        );
    }
    println!();
}

/// The value below which a share of them lies; none without values.
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((share * sorted.len() as f64) as usize).copied()
}

//! Table 2 of Wang et al. (2020) with times: success, evaluations and wall time to the target beside the paper's.

use calib::estimate::swarm::{Algorithm, Stop};
use calib::stage::Optimise;
use std::time::Instant;

/// The paper's times to the target, s.
const PUBLISHED: [(Algorithm, f64); 4] =
    [(Algorithm::Bas, 0.087843), (Algorithm::Pso, 0.215134), (Algorithm::Ga, 0.262317), (Algorithm::Abc, 0.132563)];

/// Prints the table for 200 seeds on one core.
pub fn table() {
    let stage = Optimise::default();
    let problem = &stage.problems[0];
    println!("2-D Michalewicz, absolute error {:e}, {} seeds, one core", problem.tolerance, stage.seeds);
    println!(
        "{:<6} {:>7} {:>9} {:>9} {:>10} {:>10} {:>10} {:>8}",
        "method", "found", "evals p50", "evals p90", "ms p50", "ms p90", "paper ms", "ratio"
    );
    for method in Algorithm::ALL {
        let (mut times, mut evaluations) = (Vec::new(), Vec::new());
        for seed in 0..stage.seeds as u64 {
            let begun = Instant::now();
            let outcome = stage.search(problem, method, seed);
            let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
            if outcome.stop == Stop::Target {
                times.push(milliseconds);
                evaluations.push(outcome.evaluations as f64);
            }
        }
        let found = 100.0 * times.len() as f64 / stage.seeds as f64;
        let (time, spent) = (spread(times), spread(evaluations));
        let paper = PUBLISHED.iter().find(|row| row.0 == method).map(|row| row.1 * 1e3);
        println!(
            "{:<6} {found:>6.1}% {:>9.0} {:>9.0} {:>10.3} {:>10.3} {:>10} {:>8}",
            method.name(),
            spent[0],
            spent[1],
            time[0],
            time[1],
            paper.map_or_else(|| "-".into(), |ms| format!("{ms:.1}")),
            paper.map_or_else(|| "-".into(), |ms| format!("{:.0} x", ms / time[0])),
        );
    }
}

/// Median and nine in ten.
fn spread(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [0.5, 0.9].map(|share| values.get((share * values.len() as f64) as usize).copied().unwrap_or(f64::NAN))
}

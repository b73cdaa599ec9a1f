//! The network of Wang et al. (2020), trained on rows from a file: seconds, losses and parameters as JSON.

use calib::estimate::network::descent::{Descent, descend};
use calib::estimate::network::loss::{Batch, Loss, LossBuffers};
use calib::estimate::network::{Activation, LayerSizes, OUTPUTS};
use calib::estimate::swarm::{Algorithm, Budget, SearchBox, SwarmResult};
use serde_json::{Value, json};
use std::time::Instant;

/// Runs of each; the least time is the one without the machine's other work.
const RUNS: usize = 7;
/// Trainings in a run, so that a clock can time them.
const TRAININGS: usize = 20;
/// Most iterations to get to another program's loss.
const ITERATIONS: usize = 2000;

/// Searches with a beetle swarm, and trains by gradient from each of the file's starts until its loss is reached.
pub fn train(file: &str) {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{file}: {error}"));
    let problem: Value =
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{file}: {error}"));
    let count = |name: &str| problem[name].as_u64().expect("a whole number") as usize;
    let x: Vec<Vec<f64>> = rows(&problem["x"]);
    let y: Vec<[f64; OUTPUTS]> = rows(&problem["y"])
        .into_iter()
        .map(|row| row.try_into().expect("three targets"))
        .collect();
    let shape = LayerSizes {
        inputs: x[0].len(),
        hidden: count("hidden"),
        outputs: OUTPUTS,
        activation: Activation::Sigmoid,
    };
    let batch = Batch::new(&x, &y);
    let loss = Loss {
        shape,
        batch: &batch,
        decay: problem["decay"].as_f64().expect("a number"),
    };
    let search = |seed: u64| -> SwarmResult {
        let budget = Budget {
            generations: count("generations"),
            evaluations: None,
            target: None,
            seed,
            jobs: 1,
        };
        let bounds = SearchBox::cube(shape.parameters(), -1.0, 1.0);
        Algorithm::Bso.minimise(count("beetles"), &loss, &bounds, &budget, |_, _| {})
    };
    let swarm = least(RUNS, || drop(search(1)));
    let found: Vec<f64> = (1..=count("seeds") as u64)
        .map(|seed| search(seed).value)
        .collect();

    let mut scratch = LossBuffers::new(shape);
    let mut descent = |start: &[f64], iterations: usize| -> Descent {
        descend(
            |x, gradient| loss.gradient(x, gradient, &mut scratch),
            |_| None,
            start.to_vec(),
            iterations,
        )
    };
    let mut trained = Vec::new();
    for (start, target) in rows(&problem["starts"])
        .iter()
        .zip(rows(&problem["targets"]))
    {
        let whole = descent(start, ITERATIONS);
        let reached = whole
            .history
            .iter()
            .find(|iteration| iteration.loss <= target[0]);
        let iterations = reached.map_or(ITERATIONS, |iteration| iteration.index);
        let seconds = least(RUNS, || {
            (0..TRAININGS).for_each(|_| drop(descent(start, iterations)))
        }) / TRAININGS as f64;
        let end = descent(start, iterations);
        trained.push(json!({
            "reached": reached.is_some(), "seconds": seconds, "iterations": iterations,
            "evaluations": end.history.last().map(|last| last.evaluations),
            "loss": end.history.last().map(|last| last.loss), "parameters": end.parameters,
        }));
    }
    let evaluations = Algorithm::Bso.evaluations(count("beetles"), count("generations"));
    let swarm = json!({"seconds": swarm, "evaluations": evaluations, "losses": found});
    println!("{}", json!({"swarm": swarm, "trained": trained}));
}

/// Least wall time of several runs, s.
fn least(runs: usize, mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..runs {
        let begun = Instant::now();
        work();
        best = best.min(begun.elapsed().as_secs_f64());
    }
    best
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    let numbers = |row: &Value| {
        row.as_array()
            .expect("a row")
            .iter()
            .map(|n| n.as_f64().expect("a number"))
            .collect()
    };
    value
        .as_array()
        .expect("rows")
        .iter()
        .map(numbers)
        .collect()
}

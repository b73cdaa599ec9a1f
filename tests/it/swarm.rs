//! Swarm optimisers on landscapes with known minima.

use calib::estimate::swarm::{BeetleAntennae, BeetleSwarm, Bounds, Budget, Method, Outcome, Stop, minimise};
use std::f64::consts::PI;

/// Eq. 35 with its sign: minimum -1.8013 at (2.20, 1.57).
fn michalewicz(x: &[f64]) -> f64 {
    -x.iter().zip(1..).map(|(x, i)| x.sin() * (f64::from(i) * x * x / PI).sin().powi(20)).sum::<f64>()
}
/// The minimum to more digits than the paper prints (any textbook: -1.80130341).
const MINIMUM: f64 = -1.801_303_41;

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

fn search<M: Method>(method: &M, f: fn(&[f64]) -> f64, bounds: &Bounds, seed: u64, jobs: usize) -> Outcome {
    let budget = Budget { generations: 200, evaluations: None, target: None, seed, jobs };
    minimise(method, &f, bounds, &budget, |_, _| {})
}

/// How many of `seeds` searches come within 1e-4 of the minimum, and how many evaluations the successful ones took (median).
fn successes<M: Method>(method: &M, generations: usize, seeds: u64) -> (usize, u64) {
    let mut spent: Vec<u64> = (0..seeds)
        .filter_map(|seed| {
            let budget = Budget { generations, evaluations: None, target: Some(MINIMUM + 1e-4), seed, jobs: 1 };
            let outcome = minimise(method, &michalewicz, &Bounds::cube(2, 0.0, PI), &budget, |_, _| {});
            (outcome.stop == Stop::Target).then_some(outcome.evaluations)
        })
        .collect();
    spent.sort_unstable();
    (spent.len(), spent.get(spent.len() / 2).copied().unwrap_or(0))
}

#[test]
fn beetle_swarm_finds_the_michalewicz_minimum_from_nearly_every_seed() {
    let (found, evaluations) = successes(&BeetleSwarm::default(), 200, 200);
    println!("BSO: {found} of 200 seeds, median {evaluations} evaluations");
    assert!(found >= 198, "{found} of 200");
    assert!((150..15_000).contains(&evaluations), "{evaluations} evaluations");
}

#[test]
fn a_lone_beetle_gets_stuck_from_many_seeds() {
    let (found, evaluations) = successes(&BeetleAntennae::default(), 200, 200);
    println!("BAS: {found} of 200 seeds, median {evaluations} evaluations");
    // About one in six succeeds: the paper's Table 2 shows the time of a run that did.
    assert!((15..60).contains(&found), "{found} of 200");
}

#[test]
fn the_minimum_lies_where_the_paper_says() {
    let outcome = search(&BeetleSwarm::default(), michalewicz, &Bounds::cube(2, 0.0, PI), 1, 1);
    assert!((outcome.value - -1.8013).abs() < 1e-4, "{}", outcome.value);
    assert!((outcome.position[0] - 2.20).abs() < 0.01 && (outcome.position[1] - 1.57).abs() < 0.01, "{:?}", outcome.position);
}

#[test]
fn the_sphere_is_descended_to_its_bottom() {
    let bounds = Bounds::cube(5, -3.0, 4.0);
    for seed in 0..10 {
        let outcome = search(&BeetleSwarm::default(), sphere, &bounds, seed, 1);
        assert!(outcome.value < 1e-6, "seed {seed}: {}", outcome.value);
    }
    // One beetle's steps sum to at most 10 and die out: it comes near, not there.
    let outcome = search(&BeetleAntennae::default(), sphere, &Bounds::cube(2, -3.0, 4.0), 3, 1);
    assert!(outcome.value < 0.05 && outcome.value > 0.0, "{}", outcome.value);
}

#[test]
fn two_threads_give_the_bits_of_one_and_a_seed_gives_its_search_again() {
    let bounds = Bounds::cube(6, -1.0, 1.0);
    let method = BeetleSwarm { beetles: 17, ..BeetleSwarm::default() };
    let one = search(&method, sphere, &bounds, 5, 1);
    for jobs in [1, 2, 3, 64] {
        assert_eq!(one, search(&method, sphere, &bounds, 5, jobs), "{jobs} threads");
    }
    assert_ne!(one.position, search(&method, sphere, &bounds, 6, 1).position);
}

#[test]
fn the_history_falls_counts_every_evaluation_and_is_observed() {
    let method = BeetleSwarm { beetles: 10, ..BeetleSwarm::default() };
    let mut seen = Vec::new();
    let budget = Budget { generations: 40, evaluations: Some(910), target: None, seed: 2, jobs: 2 };
    let outcome = minimise(&method, &michalewicz, &Bounds::cube(2, 0.0, PI), &budget, |generation, best| {
        assert_eq!(michalewicz(best), generation.best);
        seen.push(generation.clone());
    });
    assert_eq!(seen, outcome.history);
    assert!(seen.windows(2).all(|pair| pair[1].best <= pair[0].best && pair[1].evaluations == pair[0].evaluations + 30));
    assert!(seen.iter().all(|generation| generation.mean >= generation.best));
    assert_eq!((outcome.stop, outcome.evaluations), (Stop::Evaluations, 910));
    assert!(outcome.elite.windows(2).all(|pair| pair[0].0 <= pair[1].0) && outcome.elite[0].0 == outcome.value);
}

#[test]
fn the_bounds_hold_and_a_value_that_is_no_number_is_never_best() {
    let f = |x: &[f64]| {
        assert!(x.iter().all(|x| (-1.0..=2.0).contains(x)), "{x:?}");
        if x[0] < 0.0 { f64::NAN } else { (x[0] - 2.0).abs() + x[1].abs() }
    };
    let budget = Budget { generations: 100, evaluations: None, target: None, seed: 9, jobs: 2 };
    let bounds = Bounds::cube(2, -1.0, 2.0);
    let swarm = minimise(&BeetleSwarm::default(), &f, &bounds, &budget, |_, _| {});
    let beetle = minimise(&BeetleAntennae::default(), &f, &bounds, &budget, |_, _| {});
    assert!(swarm.value < 1e-3 && beetle.value.is_finite(), "{} {}", swarm.value, beetle.value);
}

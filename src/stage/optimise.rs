//! `optimise`: the swarm optimisers on functions with known minima, many seeds each (Table 2 of Wang et al. 2020).
//!
//! A search that found the target quickly once says little: what counts is from how many seeds it gets there, and how often it
//! gets stuck. Times are no part of a table, which is the same whenever it is made; `cargo bench -- swarm` prints them.

use crate::error::{Place, Result};
use crate::estimate::swarm::{Algorithm, Budget, Landscape, SearchStop, SwarmResult};
use crate::estimate::threads::in_order;
use crate::statistics::quantile;
use crate::table::{SearchCourse, SearchCourseRow, Searches, SearchesRow};
use crate::{Context, Stage};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// Settings of `optimise`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Optimise {
    /// What is minimised.
    pub problems: Vec<BenchmarkProblem>,
    /// The optimisers to compare.
    pub methods: Vec<Algorithm>,
    /// Individuals of a swarm; half of a bee colony is employed.
    pub population: usize,
    /// Evaluations that each search may spend.
    pub evaluations: u64,
    /// Searches of every method on every problem.
    pub seeds: usize,
    /// Searches of every method on every problem of which the whole course is kept.
    pub courses: usize,
    /// Published times to stand beside ours.
    pub reference: Vec<PublishedTime>,
}

/// A function, and how near to its minimum counts as found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchmarkProblem {
    /// What is minimised.
    pub function: Landscape,
    /// How many numbers are searched.
    pub dimensions: usize,
    /// The search ends where the value is nearer to the minimum than this.
    pub tolerance: f64,
}

/// A published time to the target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedTime {
    /// Where it stands, e.g. `Table 2`.
    pub label: String,
    pub function: Landscape,
    pub dimensions: usize,
    pub method: Algorithm,
    /// s.
    pub seconds: f64,
}

impl Default for Optimise {
    fn default() -> Self {
        Self {
            problems: vec![BenchmarkProblem {
                function: Landscape::Michalewicz,
                dimensions: 2,
                tolerance: 1e-4,
            }],
            methods: Algorithm::ALL.to_vec(),
            population: 50,
            evaluations: 30_000,
            seeds: 200,
            courses: 1,
            reference: Vec::new(),
        }
    }
}

crate::stage! {
    Optimise, "optimise", 1, "compares swarm optimisers on functions with known minima, over many seeds",
        OptimiseReads {} -> OptimiseWrites {
            searches: Searches,
            search_course: SearchCourse,
        }
}

impl Stage for Optimise {
    fn faults(&self, at: &mut Place) {
        at.at("population").whole(self.population, 4..=10_000);
        at.at("seeds").whole(self.seeds, 1..=100_000);
        at.at("courses").whole(self.courses, 0..=1000);
        at.at("evaluations").must(
            (1..=100_000_000).contains(&self.evaluations),
            format!("expected 1 to 1e8, not {}", self.evaluations),
        );
        for (i, problem) in self.problems.iter().enumerate() {
            let mut at = at.at(format!("problems[{i}]"));
            let known = problem.function.minimum(problem.dimensions).is_some()
                && (1..=1000).contains(&problem.dimensions);
            at.at("dimensions").must(
                known,
                "the minimum is not known there: 2, 5 or 10 for michalewicz, 2 to 1000 for rosenbrock, else 1 to 1000",
            );
            at.at("tolerance").must(
                problem.tolerance > 0.0 && problem.tolerance.is_finite(),
                "expected a number above zero, e.g. 1e-4",
            );
            let same = |other: &BenchmarkProblem| {
                (other.function, other.dimensions) == (problem.function, problem.dimensions)
            };
            at.must(
                !self.problems[..i].iter().any(same),
                "the same function in as many dimensions stands above",
            );
        }
    }

    fn run(&self, _reads: OptimiseReads, context: &Context) -> Result<OptimiseWrites> {
        let mut methods = self.methods.clone();
        methods.sort_unstable();
        methods.dedup();
        let total = self.problems.len() * methods.len() * self.seeds;
        let services = context.services;
        services.begin("searching", Some(total as u64), "searches");
        let done = Mutex::new((0_u64, f64::INFINITY));
        let (mut searches, mut course) = (Searches::default(), SearchCourse::default());
        for problem in &self.problems {
            for method in &methods {
                done.lock().expect("no search panics").1 = f64::INFINITY;
                let outcomes = in_order(context.jobs, self.seeds, |seed| {
                    let outcome =
                        self.search(problem, *method, context.seed.wrapping_add(seed as u64));
                    let mut done = done.lock().expect("no search panics");
                    *done = (done.0 + 1, done.1.min(outcome.value));
                    let (name, function) = (method.name(), problem.function.name());
                    let what = format!("{name} on {}-D {function}", problem.dimensions);
                    services.advance(done.0, &format!("{what}, best {:.6}", done.1));
                    outcome
                });
                let row = self.row(context.id, problem, *method, &outcomes);
                searches.0.push(row);
                for (seed, outcome) in outcomes.iter().enumerate().take(self.courses) {
                    let rows = outcome.history.iter().map(|generation| SearchCourseRow {
                        step: context.id.into(),
                        function: problem.function.name().into(),
                        dimensions: problem.dimensions as i64,
                        method: method.name().into(),
                        seed: seed as i64,
                        generation: generation.index as i64,
                        best: generation.best,
                        mean: Some(generation.mean).filter(|mean| mean.is_finite()),
                        evaluations: generation.evaluations as i64,
                    });
                    course.0.extend(rows);
                }
            }
        }
        Ok(OptimiseWrites {
            searches,
            search_course: course,
        })
    }
}

impl Optimise {
    /// One search on one thread.
    pub fn search(&self, problem: &BenchmarkProblem, method: Algorithm, seed: u64) -> SwarmResult {
        let (function, dimensions) = (&problem.function, problem.dimensions);
        let minimum = function.minimum(dimensions).unwrap_or(f64::NEG_INFINITY);
        let budget = Budget {
            generations: method.generations(self.population, self.evaluations),
            evaluations: Some(self.evaluations),
            target: Some(minimum + problem.tolerance),
            seed,
            jobs: 1,
        };
        function.search(dimensions, method, self.population, &budget)
    }

    fn row(
        &self,
        step: &str,
        problem: &BenchmarkProblem,
        method: Algorithm,
        outcomes: &[SwarmResult],
    ) -> SearchesRow {
        let minimum = problem.function.minimum(problem.dimensions).unwrap_or(0.0);
        let reached = outcomes.iter().filter(|one| one.stop == SearchStop::Target);
        let mut reached: Vec<f64> = reached.map(|one| one.evaluations as f64).collect();
        let errors = outcomes.iter().map(|one| (one.value - minimum).max(0.0));
        let mut errors: Vec<f64> = errors.collect();
        reached.sort_by(f64::total_cmp);
        errors.sort_by(f64::total_cmp);
        let stuck = outcomes.iter().filter(|outcome| stuck(outcome)).count();
        let is_of_row = |r: &&PublishedTime| {
            (r.function, r.dimensions, r.method) == (problem.function, problem.dimensions, method)
        };
        let reference = self.reference.iter().find(is_of_row);
        SearchesRow {
            step: step.into(),
            function: problem.function.name().into(),
            dimensions: problem.dimensions as i64,
            method: method.name().into(),
            tolerance: problem.tolerance,
            searches: outcomes.len() as i64,
            found: reached.len() as i64,
            stuck: stuck as i64,
            evaluations_median: quantile(&reached, 0.5),
            evaluations_p90: quantile(&reached, 0.9),
            error_median: quantile(&errors, 0.5),
            error_p90: quantile(&errors, 0.9),
            reference: reference.map(|reference| reference.label.clone()),
            reference_s: reference.map(|reference| reference.seconds),
        }
    }
}

/// Whether a search missed the target and found nothing better in the second half of its generations.
fn stuck(outcome: &SwarmResult) -> bool {
    let half = outcome.history.get(outcome.history.len() / 2);
    outcome.stop != SearchStop::Target && half.is_some_and(|half| half.best <= outcome.value)
}

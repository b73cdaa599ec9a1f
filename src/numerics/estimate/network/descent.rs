//! Gradient training: limited-memory BFGS (Liu and Nocedal 1989) with backtracking, stopped early by rows kept back.

use super::OUTPUTS;
use crate::estimate::factor::axpy;
use std::collections::VecDeque;

/// Steps remembered; ten is the usual choice and more gains nothing here.
const MEMORY: usize = 10;
/// Armijo's condition: the least share of the predicted decrease.
const SUFFICIENT: f64 = 1e-4;
/// Below this relative decrease over one iteration the loss counts as flat.
const FLAT: f64 = 1e-9;
/// Iterations without a better check loss before training ends.
const PATIENCE: usize = 20;

/// One iteration of the training; iteration 0 is the start.
#[derive(Debug, Clone, PartialEq)]
pub struct DescentIteration {
    /// From 0.
    pub index: usize,
    /// Loss on the training rows, decay included.
    pub loss: f64,
    /// Mean squared error per output on the training rows, and on the rows kept back.
    pub(crate) train: [f64; OUTPUTS],
    /// Mean squares of each output at the check rows, where there are some.
    pub(crate) check: Option<[f64; OUTPUTS]>,
    /// Evaluations of the loss so far.
    pub evaluations: u64,
}

/// A trained network.
#[derive(Debug, Clone)]
pub struct Descent {
    /// At the best iteration.
    pub parameters: Vec<f64>,
    /// Iteration by iteration.
    pub history: Vec<DescentIteration>,
}

/// Minimises a loss from `start` in at most `iterations` iterations.
///
/// `evaluate` writes its gradient and returns its value with the mean squared error of each output; `check` judges rows kept back. With
/// a check, the parameters of the smallest check error are returned, else those of the smallest loss.
pub fn descend(
    mut evaluate: impl FnMut(&[f64], &mut [f64]) -> (f64, [f64; OUTPUTS]),
    mut check: impl FnMut(&[f64]) -> Option<[f64; OUTPUTS]>,
    start: Vec<f64>,
    iterations: usize,
) -> Descent {
    let mut x = start;
    let mut gradient = vec![0.0; x.len()];
    let (mut loss, mut squares) = evaluate(&x, &mut gradient);
    let mut evaluations = 1;
    let mut memory: VecDeque<Pair> = VecDeque::new();
    let mut kept = (f64::INFINITY, x.clone());
    let mut since = 0;
    let mut history = Vec::new();
    let mut next = x.clone();
    let mut next_gradient = gradient.clone();
    let mut index = 0;
    loop {
        let checked = check(&x);
        history.push(DescentIteration {
            index,
            loss,
            train: squares,
            check: checked,
            evaluations,
        });
        let judged = checked.map_or(loss, |squares| squares.iter().sum());
        if judged < kept.0 {
            kept = (judged, x.clone());
            since = 0;
        } else {
            since += 1;
        }
        if since >= PATIENCE || index >= iterations {
            break;
        }
        let mut direction = quasi_newton(&gradient, &memory);
        let mut slope = dot(&direction, &gradient);
        if slope >= 0.0 {
            // The memory has gone bad: start again from steepest descent.
            memory.clear();
            direction = gradient.iter().map(|g| -g).collect();
            slope = dot(&direction, &gradient);
        }
        let length = norm(&direction);
        // The first step has no curvature to go by: one unit of length is about one weight.
        let mut step = if memory.is_empty() {
            1.0 / length.max(1.0)
        } else {
            1.0
        };
        let found = loop {
            for ((n, x), d) in next.iter_mut().zip(&x).zip(&direction) {
                *n = x + step * d;
            }
            let (value, at_next) = evaluate(&next, &mut next_gradient);
            evaluations += 1;
            if value <= loss + SUFFICIENT * step * slope {
                break Some((value, at_next));
            }
            step *= 0.5;
            if step * length < 1e-12 {
                break None;
            }
        };
        let Some((value, at_next)) = found else {
            break;
        };
        let [s, y] = [(&next, &x), (&next_gradient, &gradient)]
            .map(|(n, x)| n.iter().zip(x).map(|(n, x)| n - x).collect::<Vec<f64>>());
        let curvature = dot(&s, &y);
        // Only positive curvature keeps the approximation positive definite.
        if curvature > 1e-10 * norm(&s) * norm(&y) {
            if memory.len() == MEMORY {
                memory.pop_front();
            }
            memory.push_back(Pair { s, y, curvature });
        }
        let flat = loss - value <= FLAT * loss.abs();
        std::mem::swap(&mut x, &mut next);
        std::mem::swap(&mut gradient, &mut next_gradient);
        (loss, squares) = (value, at_next);
        index += 1;
        if flat {
            break;
        }
    }
    Descent {
        parameters: kept.1,
        history,
    }
}

/// A step and the change of the gradient along it.
struct Pair {
    s: Vec<f64>,
    y: Vec<f64>,
    curvature: f64,
}

/// Minus the approximate inverse Hessian times the gradient, by the two-loop recursion.
fn quasi_newton(gradient: &[f64], memory: &VecDeque<Pair>) -> Vec<f64> {
    let mut q: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let mut alphas = Vec::with_capacity(memory.len());
    for pair in memory.iter().rev() {
        let alpha = dot(&pair.s, &q) / pair.curvature;
        axpy(-alpha, &pair.y, &mut q);
        alphas.push(alpha);
    }
    if let Some(last) = memory.back() {
        let scale = last.curvature / dot(&last.y, &last.y);
        q.iter_mut().for_each(|q| *q *= scale);
    }
    for (pair, alpha) in memory.iter().zip(alphas.into_iter().rev()) {
        let beta = dot(&pair.y, &q) / pair.curvature;
        axpy(alpha - beta, &pair.s, &mut q);
    }
    q
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

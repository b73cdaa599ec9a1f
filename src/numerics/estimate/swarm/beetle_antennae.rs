//! Beetle antennae search (BAS): one beetle smells left and right of a random direction and steps to the better side.
//!
//! Wang et al. (2020), Eqs. 31-34 as corrected: `x_r = x + d b`, `x_l = x - d b`, `x <- x - delta b sign(f(x_r) - f(x_l))`,
//! `d <- 0.95 d + 0.01`, `delta <- 0.95 delta`. Antennae and beetle stay within the bounds.

use super::{Method, Objective, Search};
use rand::RngExt;

/// Parameters of beetle antennae search; the default is the paper's.
#[derive(Debug, Clone, PartialEq)]
pub struct BeetleAntennae {
    /// First sensing length `d`, in units of the coordinates.
    pub(crate) antenna: f64,
    /// First step `delta`, in units of the coordinates.
    pub(crate) step: f64,
    /// Factor of both per iteration.
    pub(crate) decay: f64,
    /// What the antenna gains per iteration, so that it never vanishes.
    pub(crate) antenna_floor: f64,
}

impl Default for BeetleAntennae {
    fn default() -> Self {
        Self {
            antenna: 2.0,
            step: 0.5,
            decay: 0.95,
            antenna_floor: 0.01,
        }
    }
}

/// Where the beetle is.
pub struct Beetle {
    position: Vec<f64>,
    best: (f64, Vec<f64>),
    antenna: f64,
    step: f64,
}

impl Method for BeetleAntennae {
    type State = Beetle;

    fn first(&self) -> usize {
        1
    }

    fn further(&self) -> usize {
        3
    }

    fn start<O: Objective>(&self, search: &mut Search<O>) -> Beetle {
        let position = search.bounds.random(&mut search.rng);
        let value = search.visit(std::slice::from_ref(&position))[0];
        Beetle {
            best: (value, position.clone()),
            position,
            antenna: self.antenna,
            step: self.step,
        }
    }

    fn step<O: Objective>(&self, beetle: &mut Beetle, search: &mut Search<O>) {
        let direction = unit_vector(search);
        let smell_at = |sign: f64| {
            let mut x: Vec<f64> = beetle
                .position
                .iter()
                .zip(&direction)
                .map(|(x, b)| x + sign * beetle.antenna * b)
                .collect();
            search.bounds.clamp(&mut x);
            x
        };
        let antennae = [smell_at(1.0), smell_at(-1.0)];
        let values = search.probe(&antennae);
        let turn = sign(values[0], values[1]);
        for (x, b) in beetle.position.iter_mut().zip(&direction) {
            *x -= beetle.step * b * turn;
        }
        search.bounds.clamp(&mut beetle.position);
        let value = search.visit(std::slice::from_ref(&beetle.position))[0];
        if value < beetle.best.0 {
            beetle.best = (value, beetle.position.clone());
        }
        beetle.antenna = self.decay * beetle.antenna + self.antenna_floor;
        beetle.step *= self.decay;
    }

    fn elite(&self, beetle: &Beetle) -> Vec<(f64, Vec<f64>)> {
        vec![beetle.best.clone()]
    }
}

/// Eq. 31: components in -1..1, scaled to length one.
fn unit_vector<O: Objective>(search: &mut Search<O>) -> Vec<f64> {
    loop {
        let b: Vec<f64> = (0..search.bounds.dimensions())
            .map(|_| search.rng.random_range(-1.0..1.0))
            .collect();
        let length = b.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A direction cannot be told from a vector this short; with one coordinate or more it is drawn again at once.
        if length > 1e-9 {
            return b.into_iter().map(|x| x / length).collect();
        }
        if b.is_empty() {
            return b;
        }
    }
}

/// The sign of `right - left` with sign(0) = 0, also where both are infinite.
pub(super) fn sign(right: f64, left: f64) -> f64 {
    match right.partial_cmp(&left) {
        Some(std::cmp::Ordering::Greater) => 1.0,
        Some(std::cmp::Ordering::Less) => -1.0,
        _ => 0.0,
    }
}

//! How large causes are expected to be: the prior of the numbers of a cell that are sizes.

use crate::key::Key;
use calib_engine::{Accepted, Shape};

/// Numbers of a shape that are sizes: 0 is nothing of the cause. What is usual of them is where half of all are, and some are many times that,
/// so that their prior is Cauchy's (Jeffreys, 1961).
fn sizes(shape: &Shape) -> Vec<usize> {
    let is_size = |k: &usize| {
        shape.usual[*k] > 0.0
            && shape.start[*k] == 0.0
            && shape.centre[*k] == 0.0
            && shape.columns.iter().any(|column| column[*k] != 0.0)
    };
    (0..shape.usual.len()).filter(is_size).collect()
}

/// How far a number of a shape is moved at once: no further than the linear model can be believed.
pub(crate) fn furthest(shape: &Shape, number: usize) -> f64 {
    let times = if sizes(shape).contains(&number) {
        10.0
    } else {
        3.0
    };
    times * shape.usual[number]
}

/// The sizes of a member: which of its numbers, and their squared length in what is usual.
pub(crate) struct Sizes {
    pub(crate) numbers: Vec<usize>,
    square: f64,
}

impl Sizes {
    pub(crate) fn of(one: &Accepted<Key>) -> Self {
        let shape = &one.cell.shapes[one.shape];
        let numbers = sizes(shape);
        let square = numbers
            .iter()
            .map(|k| (one.numbers[*k] / shape.usual[*k]).powi(2));
        Self {
            square: square.sum(),
            numbers,
        }
    }

    /// Precision of their prior around where they are, in units of what is usual.
    pub(crate) fn precision(&self) -> f64 {
        (1.0 + self.numbers.len() as f64) / (1.0 + self.square)
    }

    /// -2 ln of the prior's density over that at nothing.
    pub(crate) fn penalty(&self) -> f64 {
        (1.0 + self.numbers.len() as f64) * self.square.ln_1p()
    }

    /// ln of the prior's density at nothing over that of a Gaussian as wide as the prior is around where they are.
    pub(crate) fn log_tail(&self) -> f64 {
        let count = self.numbers.len();
        // Gamma((1 + d) / 2) / Gamma(1 / 2), by steps of one from d = 0 or d = 1.
        let pi = std::f64::consts::PI;
        let mut log_gamma = if count.is_multiple_of(2) {
            0.0
        } else {
            -0.5 * pi.ln()
        };
        let mut k = if count.is_multiple_of(2) { 0.5 } else { 1.0 };
        while k < 0.5 * (1 + count) as f64 {
            log_gamma += k.ln();
            k += 1.0;
        }
        log_gamma + 0.5 * count as f64 * (2.0_f64.ln() - self.precision().ln())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes of so many numbers, all at one place.
    fn sizes(count: usize, at: f64) -> Sizes {
        Sizes {
            numbers: (0..count).collect(),
            square: count as f64 * at * at,
        }
    }

    #[test]
    fn the_density_of_one_size_is_cauchys() {
        // 1 / (pi (1 + u^2)), over that of a Gaussian of the curvature's width at its own top.
        for at in [0.0, 0.5, 30.0] {
            let one = sizes(1, at);
            let density = (one.log_tail() - 0.5 * one.penalty()).exp();
            let width = one.precision().sqrt().recip();
            let expected = 1.0 / (std::f64::consts::PI * (1.0 + at * at));
            let gaussian = 1.0 / (width * std::f64::consts::TAU.sqrt());
            assert!(
                (density / (expected / gaussian) - 1.0).abs() < 1e-12,
                "{at}"
            );
        }
        // Of two: 1 / (2 pi (1 + u^2)^(3/2)).
        let two = sizes(2, 2.0);
        let density = (two.log_tail() - 0.5 * two.penalty()).exp();
        let expected = 9.0_f64.powf(-1.5) / std::f64::consts::TAU;
        let gaussian = two.precision() / std::f64::consts::TAU;
        assert!((density / (expected / gaussian) - 1.0).abs() < 1e-12);
    }
}

//! Functions with known minima on which optimisers are compared.
//!
//! Michalewicz is Eq. 35 of Wang et al. (2020) with its sign, `-sum sin(x_i) sin(i x_i^2 / pi)^20` on `[0, pi]^n`; the others as in
//! Jamil and Yang (2013), minimum 0.

use super::{Algorithm, Budget, SearchBox, SwarmResult};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{E, PI};

/// A function to be minimised in any number of dimensions.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Landscape {
    /// Flat with narrow valleys; the paper's. In 2, 5 or 10 dimensions.
    Michalewicz,
    /// A bowl with a lattice of minima.
    Rastrigin,
    /// A bent valley.
    Rosenbrock,
    /// A plateau of small minima around a funnel.
    Ackley,
}

impl Landscape {
    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Michalewicz => "michalewicz",
            Self::Rastrigin => "rastrigin",
            Self::Rosenbrock => "rosenbrock",
            Self::Ackley => "ackley",
        }
    }

    /// Its value at a point of any dimension.
    pub fn value(self, x: &[f64]) -> f64 {
        let n = x.len() as f64;
        match self {
            Self::Michalewicz => -x
                .iter()
                .zip(1..)
                .map(|(x, i)| x.sin() * (f64::from(i) * x * x / PI).sin().powi(20))
                .sum::<f64>(),
            Self::Rastrigin => x
                .iter()
                .map(|x| x * x - 10.0 * (2.0 * PI * x).cos() + 10.0)
                .sum(),
            Self::Rosenbrock => x
                .windows(2)
                .map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2))
                .sum(),
            Self::Ackley => {
                let squares: f64 = x.iter().map(|x| x * x).sum::<f64>() / n;
                let cosines: f64 = x.iter().map(|x| (2.0 * PI * x).cos()).sum::<f64>() / n;
                20.0 - 20.0 * (-0.2 * squares.sqrt()).exp() + E - cosines.exp()
            }
        }
    }

    /// The box that is searched.
    pub(crate) fn bounds(self, dimensions: usize) -> SearchBox {
        let (lower, upper) = match self {
            Self::Michalewicz => (0.0, PI),
            Self::Rastrigin => (-5.12, 5.12),
            Self::Rosenbrock => (-2.048, 2.048),
            Self::Ackley => (-32.768, 32.768),
        };
        SearchBox::cube(dimensions, lower, upper)
    }

    /// One search for its minimum; `population` as of [`Algorithm::minimise`].
    pub fn search(
        self,
        dimensions: usize,
        method: Algorithm,
        population: usize,
        budget: &Budget,
    ) -> SwarmResult {
        method.minimise(
            population,
            &|x: &[f64]| self.value(x),
            &self.bounds(dimensions),
            budget,
            |_, _| {},
        )
    }

    /// The smallest value, where it is known.
    pub fn minimum(self, dimensions: usize) -> Option<f64> {
        match (self, dimensions) {
            (Self::Michalewicz, 2) => Some(-1.801_303_41),
            (Self::Michalewicz, 5) => Some(-4.687_658_18),
            (Self::Michalewicz, 10) => Some(-9.660_151_72),
            (Self::Michalewicz, _) => None,
            (Self::Rosenbrock, 0 | 1) => None,
            _ => Some(0.0),
        }
    }
}

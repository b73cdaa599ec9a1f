//! The learned correction of what physics left over: multilayer perceptrons with one hidden layer, started by a beetle swarm and
//! trained by gradient (Wang et al. 2020, section 5.3-5.4 and Fig. 3).
//!
//! [`perceptron`] is the network and its gradient, [`descent`] the gradient training, [`training`] the ensemble from samples,
//! [`cross_validation`] the judge of whether it helps at all, and [`Correction`] the result: the one function by which a network is
//! ever applied, with the range in which it may be.

pub mod correction;
pub mod cross_validation;
pub mod descent;
pub mod perceptron;
pub mod training;

pub use correction::{Applied, Correction, Feature, Map};
pub use cross_validation::{Verdict, judge};
pub use perceptron::{Activation, OUTPUTS, Shape};
pub use training::{Course, Phase, Recipe, Samples, train};

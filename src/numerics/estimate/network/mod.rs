//! The learned correction of what physics left over: rivals compared by cross-validation, the best of which is kept if it helps.
//!
//! [`rivals`] is the judge. The rivals: [`linear`] fits [`basis`] terms (ridge on harmonics; joint curves through the Jacobian of
//! the [`arm`]), [`process`] is a Gaussian process, `training` makes `perceptron`s (Wang et al. 2020, sections 5.3-5.4) of small
//! [`loss`] from random starts or from a swarm's by [`descent`]. [`Correction`] is the result: the one function by which any of them is ever
//! applied, with the [`region`] in which it may be.

pub mod arm;
pub mod basis;
pub mod correction;
pub mod descent;
pub mod linear;
pub mod loss;
pub(crate) mod perceptron;
pub mod process;
pub mod region;
pub mod rivals;
pub(crate) mod training;

pub use arm::ScrewArm;
pub use correction::{AppliedCorrection, Body, Correction, Feature, Map};
pub use perceptron::{Activation, LayerSizes, OUTPUTS};
pub use region::TrainingSamples;
pub use rivals::{JudgedRival, Rival, compare};
pub use training::{Phase, Recipe, TrainingStart, TrainingStep, train};

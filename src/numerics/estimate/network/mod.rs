//! The learned correction of what physics left over: rivals compared by cross-validation, the best of which is kept if it helps.
//!
//! [`rivals`] is the judge of [`ridge`], [`process`] and the network of Wang et al. (2020), sections 5.3-5.4: a [`perceptron`] that
//! [`training`] starts at random or by a beetle swarm. [`Correction`] is the one function by which any of them is applied, with the
//! [`region`] in which it may be.

pub mod correction;
pub mod descent;
pub mod perceptron;
pub mod process;
pub mod region;
pub mod ridge;
pub mod rivals;
pub mod training;

pub use correction::{AppliedCorrection, Body, Correction, Feature, Map};
pub use perceptron::{Activation, LayerSizes, OUTPUTS};
pub use region::TrainingSamples;
pub use rivals::{JudgedRival, Rival, compare};
pub use training::{Phase, Recipe, TrainingStart, TrainingStep, train};

//! Estimation: robust least squares on streamed QR factors, what the data can see, and the model that comes of it.

mod align;
mod change;
pub mod choose;
mod cluster;
mod covariance;
mod factor;
pub mod fisher;
mod fit;
mod folds;
mod known;
mod levenberg;
mod model;
pub mod network;
mod observe;
mod problem;
mod remedy;
mod repeats;
mod screen;
pub mod swarm;
pub mod threads;

pub use align::align;
pub use change::{Change, Session, changes};
pub use covariance::Covariance;
pub(crate) use fisher::tail;
pub use fit::{Fate, FitOptions, Fitted, fit};
pub use folds::{Folds, cross_validate};
pub use known::{Bounds, CONFLICT, Known, Opinion, Prior};
pub use levenberg::{Iteration, Stop};
pub use model::Model;
pub use observe::Visibility;
pub(crate) use problem::Weight;
pub use remedy::{Remedy, remedies};
pub use repeats::{Poses, Repeated, spread};
pub use screen::{Kind, Screening, Suspect, fit_screened};

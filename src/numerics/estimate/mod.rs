//! Estimation: robust least squares on streamed QR factors, what the data can see, and the model that comes of it.

mod change;
pub mod choose;
mod cluster;
mod contacts;
mod covariance;
mod factor;
mod fit;
mod folds;
mod gauge;
mod length;
mod levenberg;
mod model;
pub mod network;
mod observe;
mod problem;
mod remedy;
mod repeats;
mod scale;
mod screen;
pub mod swarm;
pub mod threads;
mod units;

pub use change::{ParameterChange, changes};
pub use contacts::{Reseat, placed_by_left_out, reseated};
pub use covariance::{Covariance, tail};
pub use fit::{
    Determined, Fitted, ParameterStatus, Session, beyond_tolerance, determined_directions, fit,
};
pub use folds::{
    FoldKind, Folds, NearbyFits, cross_validate, dealt, fold_poses, gather, leave_one_out,
};
pub use gauge::{align, align_points, gauge};
pub use levenberg::{Iteration, Stop};
pub use model::{Bounds, CONFLICT, Known, KnownLength, Model, Prior, PriorCheck, RowError};
pub(crate) use problem::columns;
pub use remedy::{Remedy, remedies};
pub use repeats::{Poses, Repeated, autocorrelation_time, spread};
pub use scale::{ArmScale, ErrorScale, known_places, noise, scale};
pub use screen::{Screening, Suspect, SuspectKind, fit_screened};
pub use units::Units;

//! A round: the recording is looked at around the present model, which is then fitted anew with the causes that were found.

mod common_size;
mod correlated_noise;
mod fit_state;
mod noise;
mod stretches;
mod view;

pub(crate) use correlated_noise::correlation_left_by;
pub use fit_state::BASE;
pub(crate) use fit_state::{EstimatedCause, FitState, Fitter, with_causes};
pub(crate) use view::{RoundView, compliance};

//! "None of the list" as a hypothesis with an evidence of its own.
//!
//! A name is a point inside a free form: smooth functions, under a Gaussian-process prior, of whatever the recording has, in every motion of
//! a place. Evidence of both comes from one function ([`evidence`]), after geometry is projected off. A name stands where neither the free
//! form instead of it, at whatever place, nor beside it says more. What a free form adds to all causes joins the model as a finding
//! without a name.
//!
//! Sources: Kennedy and O'Hagan (2001), discrepancy of simulators; Rasmussen and Williams (2006), ch. 4: spectral density of the Matern kernel.

mod evidence;
mod frame;
mod free_form;
mod groups;
mod knots;
mod look;
mod names;
mod pairs;
mod settle;
mod state;
mod step;
mod variants;

pub(crate) use names::NameOdds;
pub(crate) use settle::settle;

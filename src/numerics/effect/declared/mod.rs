//! Effects that a user declares: a place, what moves there, and laws as formulas; tried beside the causes of the library.
//!
//! effect = sum_k c_k * direction(place) * law_k(row; shape), as a [`Term`](super::Term), with any formula for a law. A form keeps its
//! declaration, so that whatever keeps the form needs no file.

mod declaration;
mod form;
mod formula;
mod pattern;
mod quantity;
mod torque;

pub use declaration::{EffectDeclaration, Laws, ShapeRange, Starts};
pub use form::{DeclaredCause, DeclaredForm};
pub use pattern::DeclarationFault;
pub use torque::DeclaredTorque;

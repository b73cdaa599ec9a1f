//! Folds of the rows to fit: how well poses are predicted by a fit that did not see them. Rows that are held out for validation take no part.

mod alternatives;
mod fold_errors;

pub(crate) use alternatives::Alternatives;
pub(crate) use fold_errors::FoldErrors;

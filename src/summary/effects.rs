//! The library of effects for other programs.

use crate::effect::Cause;
use serde_json::{Value, json};

/// Name, formula, usual size, what each is confounded with, and what a recording needs to show it.
pub fn effects_json(causes: &[&Cause]) -> Value {
    let one = |about: &&Cause| {
        json!({
            "name": about.name, "place": about.place, "formula": about.formula, "size": about.size,
            "confounded": about.confounded, "needs": about.needs,
            "measure": about.measure.map(|measure| measure.advice),
        })
    };
    causes.iter().map(one).collect()
}

//! Where in the YAML the setting stands of which a running stage complains.

use super::overrides;
use super::plan::Plan;
use crate::error::{Error, Fault};
use crate::yaml::{self, Node, Trouble};

/// The same error with line, path and stage of each setting: `with.n` of `split` becomes `p.yaml:36:26: stages[2].with.n`.
pub(super) fn placed(error: Error, plan: &Plan, id: &str) -> Error {
    match error {
        Error::Spec(faults) => Error::Spec(all(faults, plan, id)),
        Error::Data(faults) => Error::Data(all(faults, plan, id)),
        other => other,
    }
}

fn all(faults: Vec<Fault>, plan: &Plan, id: &str) -> Vec<Fault> {
    faults
        .into_iter()
        .map(|fault| one(&fault, plan, id).unwrap_or(fault))
        .collect()
}

/// None where the fault is not in a setting.
fn one(fault: &Fault, plan: &Plan, id: &str) -> Option<Fault> {
    let own = fault
        .place
        .strip_prefix(id)
        .and_then(|rest| rest.strip_prefix('.'))
        .unwrap_or(&fault.place);
    if own != "with" && !own.starts_with("with.") {
        return None;
    }
    let mut tree = yaml::parse(&plan.text).0?;
    overrides::apply(&mut tree, &plan.overrides);
    let named = |stage: &Node| {
        stage
            .get("id")
            .or_else(|| stage.get("uses"))
            .and_then(Node::text)
            .is_some_and(|name| name == id)
    };
    let index = tree.get("stages")?.items().iter().position(named)?;
    let path = format!("stages[{index}].{own}");
    let message = format!("stage `{id}`: {}", fault.message);
    Some(
        Trouble::new(message)
            .at(tree.nearest_mark(&path))
            .below(&path)
            .fault(&plan.file.display().to_string()),
    )
}

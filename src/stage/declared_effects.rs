//! Effects that a user declares in YAML files of their own: read with every fault at its line.
//!
//! ```yaml
//! calib_effect: 1
//! name: worn_tooth                # as findings will call it
//! place: joint                    # any joint that turns; or joint 3, link 2, base, tool, tracker
//! law: exp(-((q - centre) / width)^2)
//! shape:                          # numbers of the law that are fitted
//!   centre: {from: -3, to: 3, start: [-2, -1, 0, 1, 2]}
//!   width: {from: 0.03, to: 0.5}
//! unit: arcsec                    # of the law's coefficient
//! sentence: "{place} is worn near {centre} rad, by {value}"
//! ```

use super::{Context, RawFile};
use crate::effect::{DeclaredCause, EffectDeclaration};
use crate::error::{Error, Result};
use crate::yaml::{self, Node, Trouble, YamlValue, typed};
use std::collections::BTreeMap;

// Bytes; a recording named here by mistake must not fill the memory.
const MOST_BYTES: u64 = 1 << 20;
const FORMAT: i128 = 1;
const VERSION: &str = "calib_effect";
const LIST: &str = "effects";

/// The declared effects of some files, in their order. Fails with every fault of all files.
pub(super) fn declared_effects(
    files: &[RawFile],
    context: &Context,
) -> Result<Vec<&'static DeclaredCause>> {
    let (mut causes, mut faults) = (Vec::new(), Vec::new());
    let mut names: BTreeMap<String, String> = BTreeMap::new();
    for file in files {
        let (label, content) = context.text(file, "effects declared in YAML", MOST_BYTES)?;
        let mut troubles = Vec::new();
        for (path, node, cause) in read(&content, &mut troubles) {
            let name = cause.declaration().name.clone();
            if let Some(other) = names.insert(name.clone(), label.clone()) {
                let message = format!(
                    "`{name}` is declared in {other} already; give each effect a name of its own"
                );
                let trouble = Trouble::new(message).at(node.nearest_mark("name"));
                troubles.push(trouble.below("name").below(&path));
            }
            causes.push(cause);
        }
        faults.extend(troubles.into_iter().map(|trouble| trouble.fault(&label)));
    }
    Error::if_spec(faults)?;
    Ok(causes)
}

/// The effects of a text that are right, with their paths and places; what is wrong goes to `troubles`.
fn read(text: &str, troubles: &mut Vec<Trouble>) -> Vec<(String, Node, &'static DeclaredCause)> {
    let (root, found) = yaml::parse(text);
    troubles.extend(found);
    let Some(root) = root else { return Vec::new() };
    let mut listed = Vec::new();
    let YamlValue::Map(entries) = &root.value else {
        let message = format!("expected a block of keys that begins with `{VERSION}: {FORMAT}`");
        troubles.push(Trouble::new(message).at(root.mark));
        return Vec::new();
    };
    match root.get(VERSION).map(|node| (&node.value, node.mark)) {
        Some((YamlValue::Integer(FORMAT), _)) => (),
        Some((_, mark)) => {
            let message = format!("expected {FORMAT}, the format of effects that this calib knows");
            troubles.push(Trouble::new(message).at(mark).below(VERSION));
        }
        None => {
            let message = format!("missing key `{VERSION}`; expected `{VERSION}: {FORMAT}`");
            troubles.push(Trouble::new(message).at(root.mark));
        }
    }
    let one = match root.get(LIST) {
        Some(list) => {
            let is_other = |key: &str| key != VERSION && key != LIST;
            for (key, mark, _) in entries.iter().filter(|(key, ..)| is_other(key)) {
                let trouble = Trouble::unknown_key(key, &[VERSION, LIST]);
                troubles.push(trouble.at(*mark).below(key));
            }
            if !matches!(list.value, YamlValue::List(_)) {
                let trouble = Trouble::new("expected a list of effects");
                troubles.push(trouble.at(list.mark).below(LIST));
            }
            let items = list.items().iter().enumerate();
            listed.extend(items.map(|(k, node)| (format!("{LIST}[{k}]"), node.clone())));
            None
        }
        None => {
            let settings = entries.iter().filter(|(key, ..)| key != VERSION);
            let settings = YamlValue::Map(settings.cloned().collect());
            Some((String::new(), Node::new(settings, root.mark)))
        }
    };
    one.into_iter()
        .chain(listed)
        .filter_map(|(path, node)| declared(path, node, troubles))
        .collect()
}

/// One effect, where nothing is wrong with it.
fn declared(
    path: String,
    node: Node,
    troubles: &mut Vec<Trouble>,
) -> Option<(String, Node, &'static DeclaredCause)> {
    let declaration: EffectDeclaration = match typed(&node) {
        Ok(declaration) => declaration,
        Err(found) => {
            troubles.extend(found.into_iter().map(|trouble| trouble.below(&path)));
            return None;
        }
    };
    match DeclaredCause::of(&declaration) {
        Ok(cause) => Some((path, node, cause)),
        Err(found) => {
            troubles.extend(found.into_iter().map(|fault| {
                let trouble = Trouble::new(fault.message).at(node.nearest_mark(&fault.path));
                trouble.below(&fault.path).below(&path)
            }));
            None
        }
    }
}

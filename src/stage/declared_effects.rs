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
//!
//! Torques have the same words with a joint as their place: `law: velocity^3`, a coefficient in Nm.

use super::{Context, RawFile};
use crate::effect::{DeclarationFault, EffectDeclaration};
use crate::error::{Error, Result};
use crate::yaml::{self, Node, Trouble, YamlValue, typed};
use std::collections::BTreeMap;

// Bytes; a recording named here by mistake must not fill the memory.
const MOST_BYTES: u64 = 1 << 20;
const FORMAT: i128 = 1;
const VERSION: &str = "calib_effect";
const LIST: &str = "effects";

/// How a declaration is understood, or everything that is wrong with it.
type Understand<T> = fn(&EffectDeclaration) -> std::result::Result<T, Vec<DeclarationFault>>;

/// The declared effects of some files, in their order. Fails with every fault of all files.
pub(super) fn declared_effects<T>(
    files: &[RawFile],
    understand: Understand<T>,
    context: &Context,
) -> Result<Vec<T>> {
    let (mut causes, mut faults) = (Vec::new(), Vec::new());
    let mut names: BTreeMap<String, String> = BTreeMap::new();
    for file in files {
        let (label, content) = context.text(file, "effects declared in YAML", MOST_BYTES)?;
        let mut troubles = Vec::new();
        for (path, node, name, cause) in read(&content, understand, &mut troubles) {
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

/// An effect with its path, its place in the text, and its name.
type Found<T> = (String, Node, String, T);

/// The effects of a text that are right; what is wrong goes to `troubles`.
fn read<T>(text: &str, understand: Understand<T>, troubles: &mut Vec<Trouble>) -> Vec<Found<T>> {
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
        .filter_map(|(path, node)| declared(path, node, understand, troubles))
        .collect()
}

/// One effect, where nothing is wrong with it.
fn declared<T>(
    path: String,
    node: Node,
    understand: Understand<T>,
    troubles: &mut Vec<Trouble>,
) -> Option<Found<T>> {
    let declaration: EffectDeclaration = match typed(&node) {
        Ok(declaration) => declaration,
        Err(found) => {
            troubles.extend(found.into_iter().map(|trouble| trouble.below(&path)));
            return None;
        }
    };
    match understand(&declaration) {
        Ok(cause) => Some((path, node, declaration.name, cause)),
        Err(found) => {
            troubles.extend(found.into_iter().map(|fault| {
                let trouble = Trouble::new(fault.message).at(node.nearest_mark(&fault.path));
                trouble.below(&fault.path).below(&path)
            }));
            None
        }
    }
}

//! The targets of a program with what is in force where they are reached: gathered from all its motions, and given to the literals.

use super::flow::JoinedState;
use super::literal::{InForce, Setting};
use super::{Gathered, Literal};
use crate::spatial::Pose;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// What is in force wherever the files of a program move to targets.
#[derive(Debug, Default)]
pub(super) struct Reached {
    /// By the name of a target, in capitals.
    pub(crate) named: BTreeMap<String, Vec<InForce>>,
    /// By the bytes of a target that stands in a motion of the file that is corrected.
    pub(crate) placed: Vec<(Range<usize>, InForce)>,
    /// Names that are used otherwise than by motions.
    pub(crate) mentioned: BTreeMap<String, InForce>,
    /// What was assumed of other files, at the bytes of the file that is corrected.
    pub(crate) assumed: Vec<(usize, String)>,
}

impl Reached {
    /// For each literal what is in force wherever it is reached; `names`: numbers of literals that a variable holds, and its name. Both are in the
    /// order of the program.
    pub(crate) fn uses(
        &self,
        literals: &[Literal],
        names: &[(Range<usize>, String)],
    ) -> Vec<Vec<InForce>> {
        let of_k = |(k, literal): (usize, &Literal)| {
            let name = names.get(names.partition_point(|(literals, _)| literals.end <= k));
            if let Some((_, name)) = name.filter(|(literals, _)| literals.contains(&k)) {
                return self
                    .named
                    .get(name)
                    .into_iter()
                    .flatten()
                    .chain(self.mentioned.get(name))
                    .cloned()
                    .collect();
            }
            let at = literal.at();
            let placed = self
                .placed
                .get(self.placed.partition_point(|(span, _)| span.end <= at));
            placed
                .filter(|(span, _)| span.contains(&at))
                .map(|(_, force)| force.clone())
                .into_iter()
                .collect()
        };
        literals.iter().enumerate().map(of_k).collect()
    }
}

/// How the language calls what is in force.
pub(super) struct Words {
    pub(crate) base: &'static str,
    pub(crate) tool: &'static str,
    /// What is assumed where nothing is set.
    pub(crate) no_base: &'static str,
}

/// Gives literals their frames, tools and payloads, and says which they are. `uses`: for each literal what is in force wherever it is reached.
pub(super) fn settle(found: &mut Gathered, uses: Vec<Vec<InForce>>, words: &Words) {
    let mut reported = BTreeSet::new();
    let mut notes: Vec<(bool, usize, String)> = Vec::new();
    for (literal, uses) in found.literals.iter_mut().zip(uses) {
        let at = literal.at();
        let cartesian = !literal.kind.is_of_joints();
        let Some(all) = uses.into_iter().reduce(|all, one| all.joined(&one)) else {
            if cartesian {
                notes.push((
                    true,
                    at,
                    "is moved to in none of the files that were read, which would state its frame and tool; --with names others"
                        .into(),
                ));
            }
            continue;
        };
        let mut tell = |refuses: bool, note: String| {
            if refuses || reported.insert(note.clone()) {
                notes.push((refuses, at, note));
            }
        };
        if cartesian {
            match all.base {
                Setting::Known(pose, by) => {
                    literal.frame = Some(pose).filter(|pose| *pose != Pose::identity());
                    if literal.frame.is_some() {
                        tell(false, format!("{by} is applied, in the robot's base"));
                    }
                }
                Setting::Unset => tell(false, words.no_base.into()),
                Setting::Open(why) => tell(true, format!("its {} {why}", words.base)),
            }
        }
        match all.tool {
            Setting::Known(tool, _) => literal.tool_in_force = Some(tool),
            Setting::Open(why) if cartesian => tell(true, format!("its {} {why}", words.tool)),
            Setting::Open(_) | Setting::Unset => {}
        }
        match all.load {
            Setting::Known(Some(mass), by) => {
                literal.payload = Some(mass);
                tell(false, format!("payload {mass} kg, as {by} states"));
            }
            Setting::Open(why) => tell(false, format!("no payload is stated: it {why}")),
            _ => {}
        }
    }
    for (refuses, at, note) in notes {
        if refuses {
            found.frame(at, note)
        } else {
            found.warn(at, note)
        }
    }
}

//! In which frame and under which load targets are reached: the tools, work objects and loads that a program declares, and the motions
//! that name them.
//!
//! `tooldata`: [robhold, tframe, tload]; `wobjdata`: [robhold, ufprog, ufmec, uframe, oframe]; `loaddata`: [mass, ...] (ABB, Technical
//! reference manual RAPID). A work object is applied where it stands still and the program alone says where; the world frame is taken as
//! the robot's base.

use super::super::token::{ProgramText, Token, TokenKind};
use super::super::{Gathered, TargetKind, quoted};
use super::list::List;
use super::{Declaration, declaration};
use crate::spatial::Pose;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Instructions whose last positional argument is the tool.
const TOOL_LAST: [&str; 4] = ["MOVEL", "MOVEJ", "MOVEC", "MOVEABSJ"];

/// The work object of the robot's base, and the tool and the load of nothing.
const NONE: [&str; 3] = ["WOBJ0", "TOOL0", "LOAD0"];

/// A target by its name in the program, or by its number where it stands in a motion.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum UsedTarget {
    Named(String),
    Literal(usize),
}

/// What a motion names beside its position, in capitals.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
struct MotionUse {
    object: Option<String>,
    tool: Option<String>,
    /// The total load, instead of the tool's.
    load: Option<String>,
}

/// What a program declares and names of them.
#[derive(Debug, Default)]
pub(super) struct DeclaredSurroundings {
    /// Work objects in the robot's base; none where the declaration does not say, or the program sets it.
    objects: BTreeMap<String, Option<Pose>>,
    /// Masses of tools and loads, kg; none likewise.
    masses: BTreeMap<String, Option<f64>>,
    uses: BTreeMap<UsedTarget, BTreeSet<MotionUse>>,
    /// Literals that a variable holds.
    names: Vec<(Range<usize>, String)>,
    /// Where a load is gripped that is none.
    gripped: bool,
}

impl DeclaredSurroundings {
    /// What the statements declare.
    pub fn of(source: ProgramText, statements: &[&[Token]]) -> Self {
        let mut out = Self::default();
        for statement in statements {
            match declaration(source, statement) {
                Some(Declaration { kind, name, value, .. }) => out.declare(source, &kind, name, value.unwrap_or_default()),
                None => out.unset(source, statement),
            }
        }
        out
    }

    fn declare(&mut self, source: ProgramText, kind: &str, name: String, value: &[Token]) {
        let list = value.first().filter(|first| first.is(b'[')).map(|_| List::read(source, value));
        let mass = |load: &List| load.number(0).filter(|mass| *mass >= 0.0);
        match kind {
            "WOBJDATA" => {
                let still = |list: &List| !list.is_word(0, "TRUE") && list.is_word(1, "TRUE");
                let pose = list.filter(still).and_then(|list| Some(frame(list.list(3)?)? * frame(list.list(4)?)?));
                self.objects.insert(name, pose);
            }
            "TOOLDATA" => {
                let mass = list.filter(|list| list.is_word(0, "TRUE")).and_then(|list| mass(list.list(2)?));
                self.masses.insert(name, mass);
            }
            "LOADDATA" => {
                self.masses.insert(name, list.and_then(|list| mass(&list)));
            }
            _ => {}
        }
    }

    /// `wobj1.oframe := ...`: what a program sets when it runs its text does not say.
    fn unset(&mut self, source: ProgramText, statement: &[Token]) {
        let assigns = statement.iter().any(|token| token.sort == TokenKind::Pair(b':'));
        let Some(first) = statement.first().filter(|first| assigns && first.sort == TokenKind::Word) else { return };
        let name = source.upper(first);
        if let Some(pose) = self.objects.get_mut(&name) {
            *pose = None;
        }
        if let Some(mass) = self.masses.get_mut(&name) {
            *mass = None;
        }
    }

    /// Whether a work object is applied.
    pub fn has_object(&self, name: &str) -> bool {
        self.objects.get(name).is_some_and(Option::is_some)
    }

    /// Takes note of what a motion names: `arguments` between its commas, `positions` by which of them are positions.
    pub fn motion(
        &mut self,
        source: ProgramText,
        instruction: &str,
        arguments: &[&[Token]],
        positions: &[usize],
        literals: usize,
    ) {
        let mut named = MotionUse::default();
        let plain = || arguments.iter().filter(|argument| argument.first().is_some_and(|first| first.sort == TokenKind::Word));
        for argument in plain() {
            let name = source.upper(&argument[0]);
            if self.masses.contains_key(&name) && argument.get(1).is_none_or(|next| next.is(b'\\')) {
                named.tool = Some(name);
            }
        }
        if named.tool.is_none() && TOOL_LAST.contains(&instruction) {
            named.tool = plain().next_back().map(|last| source.upper(&last[0]));
        }
        for tokens in arguments.iter().flat_map(|argument| argument.windows(4)) {
            let slot = match () {
                () if source.is_word(&tokens[1], &["WOBJ"]) => &mut named.object,
                () if source.is_word(&tokens[1], &["TLOAD"]) => &mut named.load,
                () => continue,
            };
            if tokens[0].is(b'\\') && tokens[2].sort == TokenKind::Pair(b':') {
                *slot = Some(source.upper(&tokens[3])).filter(|name| !NONE.contains(&name.as_str()));
            }
        }
        let mut literal = literals;
        let positional = arguments.iter().filter(|argument| argument.first().is_none_or(|first| !first.is(b'\\')));
        for (_, argument) in positional.enumerate().filter(|(number, _)| positions.contains(number)) {
            let target = match argument.first() {
                Some(first) if first.is(b'[') => {
                    literal += 1;
                    UsedTarget::Literal(literal - 1)
                }
                Some(first) if source.is_word(first, &["OFFS", "RELTOOL"]) && argument.len() > 2 => {
                    UsedTarget::Named(source.upper(&argument[2]))
                }
                Some(first) => UsedTarget::Named(source.upper(first)),
                None => continue,
            };
            self.uses.entry(target).or_default().insert(named.clone());
        }
    }

    /// Takes note that literals of these numbers are the values of a variable.
    pub fn named(&mut self, literals: Range<usize>, name: String) {
        self.names.push((literals, name));
    }

    /// `GripLoad`: from there on another load is carried, and where that is the order of execution alone says.
    pub fn grip(&mut self, source: ProgramText, statement: &[Token], found: &mut Gathered) {
        if statement.get(1).is_none_or(|load| !source.is_word(load, &["LOAD0"])) {
            self.gripped = true;
            let load = quoted(source.bytes, statement.last().map_or(0..0, |last| statement[0].span.start..last.span.end));
            found.warn(statement[0].span.start, format!("{load} changes the load: the program states no payload of its targets"));
        }
    }

    /// Gives literals their frames and payloads, and says which they are.
    pub fn settle(self, found: &mut Gathered) {
        let mut told = BTreeSet::new();
        let mut notes: Vec<(bool, usize, String)> = Vec::new();
        let mut of_the_file: Option<String> = None;
        for (k, literal) in found.literals.iter_mut().enumerate() {
            let name = self.names.iter().find(|(literals, _)| literals.contains(&k)).map(|(_, name)| name.clone());
            let target = name.map_or(UsedTarget::Literal(k), UsedTarget::Named);
            let Some(uses) = self.uses.get(&target) else { continue };
            let at = literal.at();
            let objects: BTreeSet<Option<&str>> = uses.iter().map(|used| used.object.as_deref()).collect();
            let tools: BTreeSet<&str> = uses.iter().filter_map(|used| used.tool.as_deref()).collect();
            if literal.kind != TargetKind::Joints {
                if objects.len() > 1 {
                    notes.push((true, at, "is reached in more than one work object, and has one correction".into()));
                } else if let Some(Some(object)) = objects.first()
                    && let Some(Some(pose)) = self.objects.get(*object)
                {
                    literal.frame = Some(*pose);
                    if told.insert((*object).to_string()) {
                        notes.push((
                            false,
                            at,
                            format!("work object `{object}` is applied as this program declares it, in the robot's base"),
                        ));
                    }
                }
                if tools.len() > 1 {
                    let tools = tools.iter().map(|tool| format!("`{tool}`")).collect::<Vec<_>>().join(", ");
                    notes.push((true, at, format!("is reached with the tools {tools}, of which the robot file has one")));
                } else if let Some(tool) = tools.first() {
                    if let Some(first) = of_the_file.as_ref().filter(|first| *first != tool) {
                        let why = format!(
                            "is reached with the tool `{tool}`, another target with `{first}`, of which the robot file has one"
                        );
                        notes.push((true, at, why));
                    }
                    of_the_file.get_or_insert_with(|| (*tool).to_string());
                }
            }
            let load = |used: &MotionUse| used.load.clone().or_else(|| used.tool.clone());
            let loads: BTreeSet<Option<String>> = uses.iter().map(load).collect();
            let masses: Vec<Option<f64>> =
                loads.iter().map(|load| load.as_ref().and_then(|load| self.masses.get(load).copied().flatten())).collect();
            literal.payload = masses[0].filter(|_| !self.gripped && masses.iter().all(|mass| *mass == masses[0]));
            if let (Some(mass), Some(Some(load))) = (literal.payload, loads.first())
                && told.insert(load.clone())
            {
                notes.push((false, at, format!("payload {mass} kg, as `{load}` states")));
            }
        }
        for (refuses, at, note) in notes {
            if refuses { found.frame(at, note) } else { found.warn(at, note) }
        }
    }
}

/// `[[x, y, z], [q1, q2, q3, q4]]`, mm.
fn frame(list: &List) -> Option<Pose> {
    let (place, turn) = (list.list(0)?, list.list(1)?);
    let at = |list: &List, k: usize| list.number(k);
    let translation = Vector3::new(at(place, 0)?, at(place, 1)?, at(place, 2)?) * 1e-3;
    let turn = Quaternion::new(at(turn, 0)?, at(turn, 1)?, at(turn, 2)?, at(turn, 3)?);
    let unit = (turn.norm() - 1.0).abs() < super::list::UNIT;
    unit.then(|| Pose::new(UnitQuaternion::from_quaternion(turn).to_rotation_matrix().into_inner(), translation))
}

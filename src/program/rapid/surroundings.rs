//! In which frame, with which tool and under which load targets are reached: the tools, work objects and loads that the files of a program
//! declare, and the motions that name them.
//!
//! `tooldata`: [robhold, tframe, tload]; `wobjdata`: [robhold, ufprog, ufmec, uframe, oframe]; `loaddata`: [mass, ...] (ABB, Technical
//! reference manual RAPID). A work object is applied where it stands still and the program alone says where; the world frame is taken as
//! the robot's base.

use super::super::literal::{InForce, Reached, Setting, ToolInForce, Words, settle};
use super::super::token::{Token, TokenKind, arguments, over, quoted};
use super::super::{Companion, Gathered, Language, others};
use super::list::{List, UNIT};
use super::{declaration, is_variable, motion, statements};
use crate::spatial::Pose;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// Instructions whose last positional argument is the tool.
const TOOL_LAST: [&str; 4] = ["MOVEL", "MOVEJ", "MOVEC", "MOVEABSJ"];

/// A value that the program sets when it runs.
const SET: &str = "is set when the program runs";

/// Something declared, or why its declaration does not say what it is.
type DeclaredValue<T> = Result<T, String>;

/// What the files of a program declare.
#[derive(Debug, Default)]
pub(super) struct DeclaredSurroundings {
    /// Work objects in the robot's base.
    objects: BTreeMap<String, DeclaredValue<Pose>>,
    /// Frames of tools at the flange.
    tools: BTreeMap<String, DeclaredValue<Pose>>,
    /// Masses of tools and loads, kg; none where they are not stated.
    masses: BTreeMap<String, Option<f64>>,
    /// Where a load is gripped that is none.
    gripped: Option<String>,
}

impl DeclaredSurroundings {
    /// Adds what the statements of a file declare, and the loads that they grip.
    pub fn declare_all(&mut self, statements: &[&[Token]]) {
        for statement in statements {
            match declaration(statement) {
                Some(declared) => {
                    let value = declared.value.unwrap_or_default();
                    self.declare(&declared.kind, declared.name, value)
                }
                None if statement[0].is_word("GRIPLOAD") => self.grip(statement),
                None => {}
            }
        }
        let others = statements.iter();
        let others = others.filter(|statement| declaration(statement).is_none());
        others.for_each(|statement| self.unset(statement));
    }

    fn declare(&mut self, kind: &str, name: String, value: &[Token]) {
        let is_list = value.first().is_some_and(|first| first.is(b'['));
        let list = is_list.then(|| List::read(value));
        let mass = |load: &List| load.number(0).filter(|mass| *mass >= 0.0);
        match kind {
            "WOBJDATA" => note(&mut self.objects, name, object(list.as_ref())),
            "TOOLDATA" => {
                let carried = list.filter(|list| list.is_word(0, "TRUE"));
                let load = carried.as_ref().and_then(|list| mass(list.list(2)?));
                let pose = carried.as_ref().and_then(|list| frame(list.list(1)?));
                let still = "stands still, or is not declared with its numbers: expected one that the robot carries";
                let pose = pose.ok_or_else(|| still.into());
                note(&mut self.tools, name.clone(), pose);
                self.masses.insert(name, load);
            }
            "LOADDATA" => drop(self.masses.insert(name, list.and_then(|list| mass(&list)))),
            _ => {}
        }
    }

    /// `wobj1.oframe := ...`: what a program sets when it runs its text does not say.
    fn unset(&mut self, statement: &[Token]) {
        let first = &statement[0];
        if first.sort != TokenKind::Word || !statement.iter().any(Token::assigns) {
            return;
        }
        let name = first.upper();
        let mut pairs = statement.windows(2);
        let of_load = pairs.any(|w| w[0].is(b'.') && w[1].is_word("TLOAD"));
        if let Some(pose) = self.objects.get_mut(&name) {
            *pose = Err(SET.into());
        }
        if let Some(pose) = self.tools.get_mut(&name).filter(|_| !of_load) {
            *pose = Err(SET.into());
        }
        if let Some(mass) = self.masses.get_mut(&name) {
            *mass = None;
        }
    }

    /// `GripLoad`: from there on another load is carried, and where that is the order of execution alone says.
    fn grip(&mut self, statement: &[Token]) {
        let load = statement.get(1);
        if load.is_none_or(|load| !load.is_word("LOAD0")) {
            let why = || format!("changes when the program runs: {}", quoted(statement));
            self.gripped.get_or_insert_with(why);
        }
    }

    /// Frames of tools by their names, as the files declare them.
    pub fn tools(&self) -> impl Iterator<Item = ToolInForce> + '_ {
        self.tools.iter().map(|(name, frame)| ToolInForce {
            name: name.clone(),
            frame: frame.clone().ok(),
        })
    }

    /// Takes note of the targets that a statement moves to, and of those that it hands on. Of a motion of another file the names alone count.
    fn reach(&self, statement: &[Token], is_own: bool, out: &mut Reached) {
        if declaration(statement).is_some() {
            return;
        }
        let name = statement[0].upper();
        let assigns = statement.iter().position(Token::assigns);
        let assigns = assigns.filter(|at| is_variable(&statement[..*at]));
        let Some((_, positions)) = motion(&name).filter(|_| assigns.is_none()) else {
            let handed = &statement[assigns.unwrap_or(1)..];
            return out.handed_on(handed, &format!("`{name}`"));
        };
        let arguments: Vec<&[Token]> = arguments(&statement[1..]).collect();
        let force = self.in_force(&name, &arguments);
        let is_positional = |argument: &&&[Token]| {
            let first = argument.first();
            first.is_none_or(|first| !first.is(b'\\'))
        };
        let positional = arguments.iter().filter(is_positional).enumerate();
        for (_, argument) in positional.filter(|(number, _)| positions.contains(number)) {
            match argument {
                [first, ..] if first.is(b'[') => {
                    let span = over(argument, first.start);
                    out.placed.extend(is_own.then(|| (span, force.clone())));
                }
                [first, _, shifted, ..] if first.is_word("OFFS RELTOOL") => {
                    out.moved_to(shifted, &force)
                }
                [first, ..] => out.moved_to(first, &force),
                [] => {}
            }
        }
    }

    /// What is in force by the arguments of a motion.
    fn in_force(&self, instruction: &str, arguments: &[&[Token]]) -> InForce {
        let (mut object, mut tool, mut load) = (None, None, None);
        let is_plain = |first: &&Token| first.sort == TokenKind::Word;
        let plain = || {
            arguments
                .iter()
                .filter(|one| one.first().filter(is_plain).is_some())
        };
        for argument in plain() {
            let known = self.masses.contains_key(&argument[0].upper());
            if known && argument.get(1).is_none_or(|next| next.is(b'\\')) {
                tool = Some(&argument[0]);
            }
        }
        if tool.is_none() && TOOL_LAST.contains(&instruction) {
            tool = plain().next_back().map(|last| &last[0]);
        }
        for tokens in arguments.iter().flat_map(|argument| argument.windows(4)) {
            let slot = match &tokens[1] {
                word if word.is_word("WOBJ") => &mut object,
                word if word.is_word("TLOAD") => &mut load,
                _ => continue,
            };
            if tokens[0].is(b'\\') && tokens[2].assigns() {
                *slot = Some(&tokens[3]).filter(|token| !token.is_word("LOAD0"));
            }
        }
        let base = match object.filter(|object| !object.is_word("WOBJ0")) {
            None => Setting::Known(Pose::identity(), "wobj0".into()),
            Some(object) => match self.objects.get(&object.upper()) {
                Some(Ok(pose)) => Setting::Known(*pose, format!("work object {}", object.quoted())),
                Some(Err(why)) => Setting::Open(format!("{} {why}", object.quoted())),
                None => Setting::Open(format!(
                    "{} is declared in none of the files that were read",
                    object.quoted()
                )),
            },
        };
        let of_tool = |token: &Token| {
            let name = token.upper();
            let frame = if name == "TOOL0" {
                Some(Ok(Pose::identity()))
            } else {
                self.tools.get(&name).cloned()
            };
            match frame.transpose() {
                Ok(frame) => Setting::Known(ToolInForce { name, frame }, token.quoted()),
                Err(why) => Setting::Open(format!("{} {why}", token.quoted())),
            }
        };
        InForce {
            base,
            tool: tool.map_or(Setting::Unset, of_tool),
            load: self.load(load.or(tool)),
        }
    }

    fn load(&self, by: Option<&Token>) -> Setting<Option<f64>> {
        match (&self.gripped, by) {
            (Some(why), _) => Setting::Open(why.clone()),
            (None, Some(by)) => {
                let mass = self.masses.get(&by.upper()).copied().flatten();
                Setting::Known(mass, by.quoted())
            }
            (None, None) => Setting::Unset,
        }
    }
}

/// Takes note of a second declaration of one name, which may be another routine's.
fn note(
    known: &mut BTreeMap<String, DeclaredValue<Pose>>,
    name: String,
    value: DeclaredValue<Pose>,
) {
    match known.get_mut(&name) {
        Some(before) if *before != value => {
            *before = Err("is declared twice, with other numbers".into())
        }
        Some(_) => {}
        None => drop(known.insert(name, value)),
    }
}

/// A work object in the robot's base.
fn object(list: Option<&List>) -> DeclaredValue<Pose> {
    let unknown = || "is not declared with its numbers".to_string();
    let list = list.ok_or_else(unknown)?;
    if list.is_word(0, "TRUE") {
        return Err("is carried by the robot: expected one that stands still".into());
    }
    if !list.is_word(1, "TRUE") {
        let why = "is moved by a mechanical unit or a conveyor: expected one that stands still";
        return Err(why.into());
    }
    let part = |k: usize| list.list(k).and_then(frame).ok_or_else(unknown);
    Ok(part(3)? * part(4)?)
}

/// `[[x, y, z], [q1, q2, q3, q4]]`, mm.
fn frame(list: &List) -> Option<Pose> {
    let (place, turn) = (list.list(0)?, list.list(1)?);
    let at = |list: &List, k: usize| list.number(k);
    let translation = Vector3::new(at(place, 0)?, at(place, 1)?, at(place, 2)?) * 1e-3;
    let turn = Quaternion::new(at(turn, 0)?, at(turn, 1)?, at(turn, 2)?, at(turn, 3)?);
    let unit = (turn.norm() - 1.0).abs() < UNIT;
    let rotation = || UnitQuaternion::from_quaternion(turn).to_rotation_matrix();
    unit.then(|| Pose::new(rotation().into_inner(), translation))
}

const WORDS: Words = Words {
    base: "work object",
    tool: "tool",
    no_base: "no work object is named: calib assumed that the target stands in the robot's base",
};

/// Gives targets their frames, tools and loads, by all files of the program.
pub(super) fn in_force(lines: &[&[Token]], companions: &[Companion], found: &mut Gathered) {
    let others = others(companions, Language::Rapid);
    let read = |tokens| statements(tokens, &mut Gathered::default());
    let others: Vec<Vec<&[Token]>> = others.iter().map(|tokens| read(tokens)).collect();
    let mut known = DeclaredSurroundings::default();
    others.iter().for_each(|lines| known.declare_all(lines));
    known.declare_all(lines);
    let mut reached = Reached::default();
    let named = others.iter().flatten();
    named.for_each(|statement| known.reach(statement, false, &mut reached));
    let corrected = lines.iter();
    corrected.for_each(|statement| known.reach(statement, true, &mut reached));
    settle(found, &reached, &WORDS);
    found.tools = known.tools().collect();
}

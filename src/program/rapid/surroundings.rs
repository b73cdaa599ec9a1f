//! In which frame, with which tool and under which load targets are reached: the tools, work objects and loads that the files of a program
//! declare, and the motions that name them.
//!
//! `tooldata`: [robhold, tframe, tload]; `wobjdata`: [robhold, ufprog, ufmec, uframe, oframe]; `loaddata`: [mass, ...] (ABB, Technical
//! reference manual RAPID). A work object is applied where it stands still and the program alone says where; the world frame is taken as
//! the robot's base.
//!
//! What is in force where the files of a program in RAPID move to its targets.

use super::super::literal::{InForce, Setting, ToolInForce};
use super::super::settle::{Reached, Words, settle};
use super::super::token::{ProgramText, Token, TokenKind, arguments, tokens};
use super::super::{Companion, Gathered, Language, quoted};
use super::list::List;
use super::{Declaration, declaration, motion, statements};
use crate::spatial::Pose;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;

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
    pub(crate) fn declare_all(&mut self, source: ProgramText, statements: &[&[Token]]) {
        for statement in statements {
            match declaration(source, statement) {
                Some(Declaration {
                    kind, name, value, ..
                }) => self.declare(source, &kind, name, value.unwrap_or_default()),
                None if source.is_word(&statement[0], &["GRIPLOAD"]) => {
                    self.grip(source, statement)
                }
                None => {}
            }
        }
        for statement in statements
            .iter()
            .filter(|statement| declaration(source, statement).is_none())
        {
            self.unset(source, statement);
        }
    }

    fn declare(&mut self, source: ProgramText, kind: &str, name: String, value: &[Token]) {
        let list = value
            .first()
            .filter(|first| first.is(b'['))
            .map(|_| List::read(source, value));
        let mass = |load: &List| load.number(0).filter(|mass| *mass >= 0.0);
        match kind {
            "WOBJDATA" => note(&mut self.objects, name, object(list.as_ref())),
            "TOOLDATA" => {
                let carried = list.filter(|list| list.is_word(0, "TRUE"));
                let load = carried.as_ref().and_then(|list| mass(list.list(2)?));
                let pose = carried.as_ref().and_then(|list| frame(list.list(1)?));
                let still = "stands still, or is not declared with its numbers: expected one that the robot carries";
                note(
                    &mut self.tools,
                    name.clone(),
                    pose.ok_or_else(|| still.into()),
                );
                self.masses.insert(name, load);
            }
            "LOADDATA" => drop(self.masses.insert(name, list.and_then(|list| mass(&list)))),
            _ => {}
        }
    }

    /// `wobj1.oframe := ...`: what a program sets when it runs its text does not say.
    fn unset(&mut self, source: ProgramText, statement: &[Token]) {
        let assigns = statement
            .iter()
            .any(|token| token.sort == TokenKind::Pair(b':'));
        let Some(first) = statement
            .first()
            .filter(|first| assigns && first.sort == TokenKind::Word)
        else {
            return;
        };
        let name = source.upper(first);
        let of_load = statement
            .windows(2)
            .any(|w| w[0].is(b'.') && source.is_word(&w[1], &["TLOAD"]));
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
    fn grip(&mut self, source: ProgramText, statement: &[Token]) {
        if statement
            .get(1)
            .is_none_or(|load| !source.is_word(load, &["LOAD0"]))
        {
            let text = quoted(source.bytes, source.over(statement, 0));
            self.gripped
                .get_or_insert_with(|| format!("changes when the program runs: {text}"));
        }
    }

    /// Frames of tools by their names, as the files declare them.
    pub(crate) fn tools(&self) -> impl Iterator<Item = ToolInForce> + '_ {
        self.tools.iter().map(|(name, frame)| ToolInForce {
            name: name.clone(),
            frame: frame.clone().ok(),
        })
    }

    /// Takes note of what a motion names: `arguments` between its commas, `positions` by which of them are positions. Of a motion of another
    /// file the names alone count.
    pub(crate) fn motion(
        &self,
        source: ProgramText,
        (instruction, arguments, positions): (&str, &[&[Token]], &[usize]),
        is_own: bool,
        out: &mut Reached,
    ) {
        let force = self.in_force(source, instruction, arguments);
        let positional = arguments
            .iter()
            .filter(|argument| argument.first().is_none_or(|first| !first.is(b'\\')));
        for (_, argument) in positional
            .enumerate()
            .filter(|(number, _)| positions.contains(number))
        {
            let name = match argument.first() {
                Some(first) if first.is(b'[') => {
                    let span = source.over(argument, first.span.start);
                    out.placed.extend(is_own.then(|| (span, force.clone())));
                    continue;
                }
                Some(first)
                    if source.is_word(first, &["OFFS", "RELTOOL"]) && argument.len() > 2 =>
                {
                    &argument[2]
                }
                Some(first) => first,
                None => continue,
            };
            out.named
                .entry(source.upper(name))
                .or_default()
                .push(force.clone());
        }
    }

    /// What is in force by the arguments of a motion.
    fn in_force(&self, source: ProgramText, instruction: &str, arguments: &[&[Token]]) -> InForce {
        let (mut object, mut tool, mut load) = (None, None, None);
        let plain = || {
            arguments.iter().filter(|argument| {
                argument
                    .first()
                    .is_some_and(|first| first.sort == TokenKind::Word)
            })
        };
        for argument in plain() {
            let known = self.masses.contains_key(&source.upper(&argument[0]));
            if known && argument.get(1).is_none_or(|next| next.is(b'\\')) {
                tool = Some(&argument[0]);
            }
        }
        if tool.is_none() && TOOL_LAST.contains(&instruction) {
            tool = plain().next_back().map(|last| &last[0]);
        }
        for tokens in arguments.iter().flat_map(|argument| argument.windows(4)) {
            let slot = match () {
                () if source.is_word(&tokens[1], &["WOBJ"]) => &mut object,
                () if source.is_word(&tokens[1], &["TLOAD"]) => &mut load,
                () => continue,
            };
            if tokens[0].is(b'\\') && tokens[2].sort == TokenKind::Pair(b':') {
                *slot = Some(&tokens[3]).filter(|token| !source.is_word(token, &["LOAD0"]));
            }
        }
        let written = |token: &Token| quoted(source.bytes, token.span.clone());
        let base = match object {
            None => Setting::Known(Pose::identity(), "wobj0".into()),
            Some(object) if source.is_word(object, &["WOBJ0"]) => {
                Setting::Known(Pose::identity(), "wobj0".into())
            }
            Some(object) => match self.objects.get(&source.upper(object)) {
                Some(Ok(pose)) => Setting::Known(*pose, format!("work object {}", written(object))),
                Some(Err(why)) => Setting::Open(format!("{} {why}", written(object))),
                None => Setting::Open(format!(
                    "{} is declared in none of the files that were read",
                    written(object)
                )),
            },
        };
        let of_tool = |token: &Token| {
            let name = source.upper(token);
            let frame = if name == "TOOL0" {
                Some(Ok(Pose::identity()))
            } else {
                self.tools.get(&name).cloned()
            };
            match frame.transpose() {
                Ok(frame) => Setting::Known(ToolInForce { name, frame }, written(token)),
                Err(why) => Setting::Open(format!("{} {why}", written(token))),
            }
        };
        InForce {
            base,
            tool: tool.map_or(Setting::Unset, of_tool),
            load: self.load(source, load.or(tool)),
        }
    }

    fn load(&self, source: ProgramText, by: Option<&Token>) -> Setting<Option<f64>> {
        match (&self.gripped, by) {
            (Some(why), _) => Setting::Open(why.clone()),
            (None, Some(by)) => {
                let mass = self.masses.get(&source.upper(by)).copied().flatten();
                Setting::Known(mass, quoted(source.bytes, by.span.clone()))
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
    let Some(list) = list else {
        return Err("is not declared with its numbers".into());
    };
    if list.is_word(0, "TRUE") {
        return Err("is carried by the robot: expected one that stands still".into());
    }
    if !list.is_word(1, "TRUE") {
        return Err(
            "is moved by a mechanical unit or a conveyor: expected one that stands still".into(),
        );
    }
    let pose = list
        .list(3)
        .and_then(frame)
        .zip(list.list(4).and_then(frame))
        .map(|(user, object)| user * object);
    pose.ok_or_else(|| "is not declared with its numbers".into())
}

/// `[[x, y, z], [q1, q2, q3, q4]]`, mm.
fn frame(list: &List) -> Option<Pose> {
    let (place, turn) = (list.list(0)?, list.list(1)?);
    let at = |list: &List, k: usize| list.number(k);
    let translation = Vector3::new(at(place, 0)?, at(place, 1)?, at(place, 2)?) * 1e-3;
    let turn = Quaternion::new(at(turn, 0)?, at(turn, 1)?, at(turn, 2)?, at(turn, 3)?);
    let unit = (turn.norm() - 1.0).abs() < super::list::UNIT;
    unit.then(|| {
        Pose::new(
            UnitQuaternion::from_quaternion(turn)
                .to_rotation_matrix()
                .into_inner(),
            translation,
        )
    })
}

const WORDS: Words = Words {
    base: "work object",
    tool: "tool",
    no_base: "no work object is named: calib assumed that the target stands in the robot's base",
};

/// Gives targets their frames, tools and loads, by all files of the program. `names`: literals that a variable holds, and its name.
pub(super) fn in_force(
    (source, lines): (ProgramText, &[&[Token]]),
    companions: &[Companion],
    names: &[(Range<usize>, String)],
    found: &mut Gathered,
) {
    // What is wrong with the writing of another file is no fault of this one.
    let read =
        |companion: &Companion| tokens(companion.text(Language::Rapid), &mut Gathered::default());
    let others: Vec<Vec<Token>> = companions.iter().map(read).collect();
    let others = companions
        .iter()
        .map(|companion| companion.text(Language::Rapid))
        .zip(&others);
    let others: Vec<(ProgramText, Vec<&[Token]>)> = others
        .map(|(source, tokens)| (source, statements(source, tokens, &mut Gathered::default())))
        .collect();
    let mut surroundings = DeclaredSurroundings::default();
    for (source, statements) in &others {
        surroundings.declare_all(*source, statements);
    }
    surroundings.declare_all(source, lines);
    let mut reached = Reached::default();
    for (source, statement) in others
        .iter()
        .flat_map(|(source, statements)| statements.iter().map(move |one| (source, one)))
    {
        reach(*source, statement, &surroundings, false, &mut reached);
    }
    for statement in lines {
        reach(source, statement, &surroundings, true, &mut reached);
    }
    let uses = reached.uses(&found.literals, names);
    settle(found, uses, &WORDS);
    found.tools = surroundings.tools().collect();
}

/// Takes note of the targets that a statement moves to, and of those that it hands on.
fn reach(
    source: ProgramText,
    statement: &[Token],
    known: &DeclaredSurroundings,
    is_own: bool,
    out: &mut Reached,
) {
    let name = source.upper(&statement[0]);
    let assigns = statement
        .iter()
        .position(|token| token.sort == TokenKind::Pair(b':'));
    let plain = assigns.is_none_or(|at| {
        statement[..at]
            .iter()
            .any(|token| token.is(b'\\') || token.is(b','))
    });
    if declaration(source, statement).is_some() {
        return;
    }
    if let Some((_, positions)) = motion(&name).filter(|_| plain) {
        known.motion(
            source,
            (
                &name,
                &arguments(&statement[1..]).collect::<Vec<_>>(),
                positions,
            ),
            is_own,
            out,
        );
        return;
    }
    let from = if plain {
        1
    } else {
        assigns.unwrap_or_default()
    };
    for word in statement
        .iter()
        .skip(from)
        .filter(|token| token.sort == TokenKind::Word)
    {
        let force = InForce::open(&format!("is not followed: `{name}` hands the target on"));
        out.mentioned.entry(source.upper(word)).or_insert(force);
    }
}

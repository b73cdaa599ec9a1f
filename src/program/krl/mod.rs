//! KUKA KRL: a statement a line. Targets are the aggregates `{...}` of motions, and of variables of a type of targets.
//!
//! Types: POS, E3POS, E6POS and AXIS, E3AXIS, E6AXIS, by the aggregate's own prefix (`{E6POS: X 1,...}`), else by the variable's declaration
//! in the same file, else by the motion. FRAME is a target only as operand of a motion. Variables of the system (`$BASE`, `$H_POS`),
//! relative motions (`LIN_REL`) and motions of external axes (`ASYPTP`) are left alone. What the geometric operator `:` joins is no
//! absolute pose: such targets are refused, and so is every aggregate that may be a target and of which the file does not tell.
//!
//! The positions by axes that a file declares, by their names.

mod aggregate;
mod line;
mod system;

use super::literal::{Reached, Words, settle};
use super::token::{Token, brackets_match, closing, enclosed, lines, tokens};
use super::{Companion, Gathered, Grammar, Language, others};
use aggregate::{AXES, Aggregate, FRAME, Type};
use line::{declared, member, structure, variable};
use std::collections::BTreeSet;
use system::{SystemData, reach};

pub(super) const GRAMMAR: Grammar = Grammar {
    endings: &["src", "dat", "sub"],
    comment: ";",
    heads: &["DEF", "DEFDAT", "DEFFCT", "GLOBAL"],
    begins: &[
        "DEFDAT",
        "DEF ",
        "E6AXIS",
        "E3AXIS",
        "DECL AXIS",
        "E6POS",
        "&ACCESS",
    ],
    read,
    listed,
};

/// Motions, and how many positions each has.
const MOTIONS: [(&str, usize); 7] = [
    ("PTP", 1),
    ("LIN", 1),
    ("CIRC", 2),
    ("SPTP", 1),
    ("SLIN", 1),
    ("SCIRC", 2),
    ("SPL", 1),
];

/// What moves by a distance, or no axis of the robot.
const LEFT: &str = "PTP_REL LIN_REL CIRC_REL SPTP_REL SLIN_REL SCIRC_REL SPL_REL ASYPTP";

/// What may stand behind a position: how it is blended.
const BLENDING: &str = "C_PTP C_DIS C_ORI C_VEL C_SPL";

const NO_POSITION: &str = "an aggregate that is no position of this motion";

const RELATIVE: &str = "the geometric operator `:` makes a relative pose of its operand; calib corrects absolute ones alone";

/// Types of the system with fields that targets have as well.
const KNOWN: [&str; 3] = ["FDAT", "FRAME", "INERTIA"];

const WORDS: Words = Words {
    base: "$BASE",
    tool: "$TOOL",
    no_base: "no $BASE is set before this target: calib assumed that it stands in the robot's base",
};

/// Frames of the system that are kept in files.
const FRAME_TABLES: [&str; 2] = ["BASE_DATA", "TOOL_DATA"];

/// How many positions a line moves to, where it is a motion.
fn motion(line: &[Token]) -> Option<usize> {
    let head = |(name, _): &(&str, usize)| line[0].is_word(name);
    let (_, positions) = MOTIONS.into_iter().find(head)?;
    // `PTP = 3` names a variable.
    (!line.get(1).is_some_and(|next| next.is(b'='))).then_some(positions)
}

/// A motion without what stands behind its `WITH`.
fn before_with<'t, 'p>(line: &'t [Token<'p>]) -> &'t [Token<'p>] {
    let with = line.iter().position(|token| token.is_word("WITH"));
    &line[..with.unwrap_or(line.len())]
}

fn read(bytes: &[u8], companions: &[Companion]) -> Gathered {
    let mut reader = Reader::default();
    let all = tokens(bytes, Language::Krl, &mut reader.found);
    let lines = lines(&all);
    for line in &lines {
        if let Some((kind, names)) = declared(line) {
            let names = names.into_iter();
            names.for_each(|name| reader.found.declare(name, kind.clone()));
        }
    }
    reader.structures = lines.iter().filter_map(|line| structure(line)).collect();
    lines.iter().for_each(|line| reader.line(line));
    in_force(bytes, &lines, companions, &mut reader.found);
    reader.found
}

/// Gives targets their frames, tools and loads, by all files of the program.
fn in_force(bytes: &[u8], statements: &[&[Token]], companions: &[Companion], found: &mut Gathered) {
    let others = others(companions, Language::Krl);
    let others: Vec<Vec<&[Token]>> = others.iter().map(|tokens| lines(tokens)).collect();
    let (mut data, mut reached) = (SystemData::default(), Reached::default());
    others.iter().for_each(|lines| data.declare(lines));
    data.declare_routines(&others);
    data.declare(statements);
    reach(bytes, statements, &data, None, &mut reached);
    for (file, lines) in companions.iter().zip(&others) {
        reach(file.text, lines, &data, Some(file.place), &mut reached);
    }
    settle(found, &reached, &WORDS);
    let mut literals = found.literals.iter();
    if literals.any(|literal| literal.frame.is_some() || literal.tool_in_force.is_some()) {
        let mut called = BTreeSet::new();
        let assumed = reached.assumed.into_iter();
        let once = assumed.filter(|(_, message)| called.insert(message.clone()));
        found.warnings.extend(once);
    }
    found.tools = data.tools().collect();
}

#[derive(Default)]
struct Reader {
    /// Types that the file itself declares by STRUC, in capitals.
    structures: BTreeSet<String>,
    found: Gathered,
}

fn braces_match(line: &[Token], found: &mut Gathered) -> bool {
    brackets_match(line, &[(b'{', b'}')], "on its line", found)
}

impl Reader {
    fn line(&mut self, line: &[Token]) {
        if !braces_match(line, &mut self.found) {
            return;
        }
        let head = line[0].upper();
        if line[0].is_word(LEFT) {
            if head.ends_with("_REL") {
                let message = format!(
                    "left as it is: {head} moves by a distance from where the target before, as corrected, has led"
                );
                self.found.warn(line[0].start, message);
            }
            return;
        }
        match motion(line) {
            Some(positions) => self.motion(line, positions),
            None => self.other(line, &head),
        }
    }

    fn motion(&mut self, line: &[Token], positions: usize) {
        if let Some(colon) = Self::geometric(line) {
            self.found.fault(colon, RELATIVE);
            return;
        }
        let end = before_with(line).len();
        let (mut depth, mut operand, mut begins) = (0, 0, true);
        let mut k = 1;
        while k < end {
            let token = &line[k];
            if !token.is(b'{') {
                depth += token.opens();
                if depth == 0 && token.is(b',') {
                    (operand, begins) = (operand + 1, true);
                } else {
                    begins = false;
                }
                k += 1;
                continue;
            }
            let close = closing(line, k);
            let behind = line.get(close + 1).filter(|_| close + 1 < end);
            let follows = |next: &&Token| !(next.is(b',') || next.is_word(BLENDING));
            if !begins || operand >= positions || depth != 0 {
                self.found.fault(token.start, NO_POSITION);
            } else if let Some(stray) = behind.filter(follows) {
                self.found.stray(stray, "behind a position");
            } else {
                self.position(&line[k..=close]);
            }
            (k, begins) = (close + 1, false);
        }
        self.settings(&line[end..]);
    }

    /// An operand of a motion.
    fn position(&mut self, tokens: &[Token]) {
        let aggregate = Aggregate::new(tokens);
        let frame = |name: &str| (name == "FRAME").then_some(Type::FRAME);
        let kind = match aggregate.prefix.as_deref() {
            None => Ok(aggregate.by_fields()),
            Some(name) => Type::of(name).or_else(|| frame(name)).ok_or(name),
        };
        match kind {
            Ok(kind) => aggregate.take(kind, &mut self.found),
            Err(name) => {
                let message = format!("type {name} is not understood as a position");
                self.found.fault(tokens[0].start, message);
            }
        }
    }

    /// What stands behind WITH sets variables of the system: `$BASE = {...}`, `$VEL = {...}`.
    fn settings(&mut self, tokens: &[Token]) {
        for (k, close) in enclosed(tokens, 0, b'{') {
            let system = k > 1 && tokens[k - 1].is(b'=') && tokens[k - 2].text().starts_with(b"$");
            if !system && Aggregate::new(&tokens[k..=close]).may_be_target() {
                self.found.fault(tokens[k].start, NO_POSITION);
            }
        }
    }

    /// Where a geometric operator stands.
    fn geometric(line: &[Token]) -> Option<usize> {
        let heads = "DEF DEFFCT EXT EXTFCT EXTP EXTFCTP";
        if line.len() == 2 || line.iter().any(|token| token.is_word(heads)) {
            return None;
        }
        let mut depth = 0;
        let operator = |token: &&Token| {
            depth += i32::from(token.is(b'{')) - i32::from(token.is(b'}'));
            depth == 0 && token.is(b':')
        };
        line.iter().find(operator).map(|token| token.start)
    }

    /// A declaration, an assignment, or what is neither.
    fn other(&mut self, line: &[Token], head: &str) {
        let declares = declared(line).map(|(kind, _)| kind);
        let has_aggregate = line.iter().any(|token| token.is(b'{'));
        if let Some(at) = Self::geometric(line) {
            match has_aggregate {
                _ if declares.as_deref() == Some("FRAME") || self.sets_frame(line) => {}
                true => self.found.fault(at, RELATIVE),
                false => self.found.warn(
                    at,
                    "left as it is: a pose that the program computes by the geometric operator `:`",
                ),
            }
            return;
        }
        if !has_aggregate {
            return self.component(line, head);
        }
        for (k, close) in enclosed(line, 0, b'{') {
            let before = self.found.literals.len();
            self.value(&line[..k], &line[k..=close], declares.as_deref());
            if self.found.literals.len() == before {
                continue;
            }
            if let Some((name, _)) = variable(&line[..k]) {
                self.found.held_by(name, before);
            }
            if let Some(stray) = line.get(close + 1).filter(|next| !next.is(b',')) {
                self.found.stray(stray, "behind a target");
            }
        }
    }

    /// Whether a line sets a variable that is known to be no target.
    fn sets_frame(&self, line: &[Token]) -> bool {
        let name = line[0].upper();
        name.starts_with('$')
            || FRAME_TABLES.contains(&name.as_str())
            || self.found.stated(&name) == Some("FRAME")
    }

    /// An aggregate behind `before`, in a line that declares a type or none.
    fn value(&mut self, before: &[Token], tokens: &[Token], declares: Option<&str>) {
        let aggregate = Aggregate::new(tokens);
        let at = tokens[0].start;
        let (name, member) = variable(before).unwrap_or_default();
        let prefix = aggregate.prefix.clone();
        if name.starts_with('$') {
            if aggregate.by_fields().is_of_axes() || prefix.as_deref().and_then(Type::of).is_some()
            {
                let message = format!("left as it is: `{name}` is a variable of the system");
                self.found.warn(at, message);
            }
            return;
        }
        if FRAME_TABLES.contains(&name.as_str()) {
            return;
        }
        let by_name = declares
            .or_else(|| self.found.stated(&name))
            .filter(|_| member.is_none())
            .map(String::from);
        match prefix.or(by_name) {
            Some(kind) => match Type::of(&kind) {
                Some(kind) => aggregate.take(kind, &mut self.found),
                None => self.of_other_type(&kind, tokens),
            },
            None if aggregate.may_be_target() => {
                let what = if name.is_empty() {
                    "this aggregate".into()
                } else {
                    format!("`{name}`")
                };
                let advice = aggregate.advice();
                let message =
                    format!("the type of {what} is not stated in this file; write {advice}");
                self.found.fault(at, message);
            }
            None => self.nested(tokens),
        }
    }

    /// An aggregate of a type that is none of targets: it is left where the type is known, or declared in this file.
    fn of_other_type(&mut self, kind: &str, tokens: &[Token]) {
        let at = tokens[0].start;
        if !KNOWN.contains(&kind) && Aggregate::new(tokens).may_be_target() {
            if !self.structures.contains(kind) {
                let message = format!(
                    "type {kind} is not understood: calib cannot say whether this is a target"
                );
                return self.found.fault(at, message);
            }
            let message =
                format!("left as it is: {kind} is a structure of this file and no type of targets");
            self.found.warn(at, message);
        }
        self.nested(tokens);
    }

    /// Aggregates inside one that is no target: a target by its prefix, a frame, or of a kind that is not told.
    fn nested(&mut self, tokens: &[Token]) {
        for (k, close) in enclosed(tokens, 1, b'{') {
            let (inner, at) = (&tokens[k..=close], tokens[k].start);
            let aggregate = Aggregate::new(inner);
            match aggregate
                .prefix
                .as_deref()
                .map(|name| (name, Type::of(name)))
            {
                Some((_, Some(kind))) => aggregate.take(kind, &mut self.found),
                Some((name, None)) => self.of_other_type(name, inner),
                // The centre of mass and the inertia of a LOAD.
                None if tokens[k - 1].is_word("CM J") => {}
                None if aggregate.is_frame() => {
                    let message = "left as it is: read as a FRAME inside a structure";
                    self.found.warn(at, message);
                }
                None if aggregate.may_be_target() => {
                    let advice = aggregate.advice();
                    let message =
                        format!("the type of this aggregate is not stated; write {advice}");
                    self.found.fault(at, message);
                }
                None => self.nested(inner),
            }
        }
    }

    /// `XP1.Z = 50`: one number of a target.
    fn component(&mut self, line: &[Token], head: &str) {
        let Some((Some(member), Some(_))) = member(&line[1..]) else {
            return;
        };
        let of_target = [AXES, FRAME].concat().contains(&member.as_str());
        if !of_target || head.starts_with('$') || self.sets_frame(line) {
            return;
        }
        let at = line[0].start;
        let types = self.found.types(head);
        if types.iter().any(|name| Type::of(name).is_some()) {
            let message = format!(
                "sets {member} of the target `{head}` alone; a target is corrected whole or not at all"
            );
            self.found.partial(at, message);
        } else if types.is_empty() {
            let message = format!(
                "left as it is: sets {member} of `{head}`, whose type this file does not state"
            );
            self.found.warn(at, message);
        }
    }
}

fn listed(bytes: &[u8]) -> Gathered {
    let mut found = Gathered::default();
    let tokens = tokens(bytes, Language::Krl, &mut found);
    for line in lines(&tokens) {
        let declares = declared(line).map(|(kind, _)| kind);
        if !line.iter().any(|token| token.is(b'{')) || !braces_match(line, &mut found) {
            continue;
        }
        for (open, close) in enclosed(line, 0, b'{') {
            let aggregate = Aggregate::new(&line[open..=close]);
            let kind = aggregate.prefix.as_ref().or(declares.as_ref());
            let kind = kind.and_then(|kind| Type::of(kind));
            let (Some(kind), Some((name, None))) = (kind, variable(&line[..open])) else {
                continue;
            };
            if !kind.is_of_axes() {
                found.poses += 1;
                continue;
            }
            let before = found.literals.len();
            aggregate.take(kind, &mut found);
            found.held_by(name, before);
        }
    }
    found
}

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
mod reached;
mod system;

use super::settle::{Reached, Words, settle};
use super::token::{ProgramText, Token, TokenKind, brackets_match, closing, lines, tokens};
use super::{Companion, Declared, Gathered, Language, quoted};
use aggregate::{Aggregate, Type};
use line::{declared, member, structure, variable};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use system::SystemData;

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
const LEFT: [&str; 8] = [
    "PTP_REL",
    "LIN_REL",
    "CIRC_REL",
    "SPTP_REL",
    "SLIN_REL",
    "SCIRC_REL",
    "SPL_REL",
    "ASYPTP",
];

/// What may stand behind a position: how it is blended.
const BLENDING: [&str; 5] = ["C_PTP", "C_DIS", "C_ORI", "C_VEL", "C_SPL"];

const RELATIVE: &str = "the geometric operator `:` makes a relative pose of its operand; calib corrects absolute ones alone";

/// Types of the system with fields that targets have as well.
const KNOWN: [&str; 2] = ["FRAME", "INERTIA"];

const WORDS: Words = Words {
    base: "$BASE",
    tool: "$TOOL",
    no_base: "no $BASE is set before this target: calib assumed that it stands in the robot's base",
};

/// Frames of the system that are kept in files.
const FRAME_TABLES: [&str; 2] = ["BASE_DATA", "TOOL_DATA"];

pub(super) fn read(bytes: &[u8], companions: &[Companion]) -> Gathered {
    let mut found = Gathered::default();
    let source = ProgramText {
        bytes,
        language: Language::Krl,
    };
    let all = tokens(source, &mut found);
    let lines = lines(&all);
    let mut types: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in &lines {
        if let Some((kind, names)) = declared(source, line) {
            for name in names {
                let known = types.entry(name).or_default();
                if !known.contains(&kind) {
                    known.push(kind.clone());
                }
            }
        }
    }
    let structures = lines
        .iter()
        .filter_map(|line| structure(source, line))
        .collect();
    let mut reader = Reader {
        source,
        types,
        structures,
        names: Vec::new(),
        found,
    };
    for line in &lines {
        reader.line(line);
    }
    let Reader {
        names, mut found, ..
    } = reader;
    in_force(source, &lines, companions, &names, &mut found);
    found
}

/// Gives targets their frames, tools and loads, by all files of the program.
fn in_force(
    source: ProgramText,
    statements: &[&[Token]],
    companions: &[Companion],
    names: &[(Range<usize>, String)],
    found: &mut Gathered,
) {
    // What is wrong with the writing of another file is no fault of this one.
    let read =
        |companion: &Companion| tokens(companion.text(Language::Krl), &mut Gathered::default());
    let others: Vec<Vec<Token>> = companions.iter().map(read).collect();
    let (mut data, mut reached) = (SystemData::default(), Reached::default());
    let companions = || companions.iter().zip(&others);
    let read: Vec<(ProgramText, Vec<&[Token]>)> = companions()
        .map(|(companion, tokens)| (companion.text(Language::Krl), lines(tokens)))
        .collect();
    read.iter()
        .for_each(|(source, lines)| data.declare(*source, lines));
    data.declare_routines(&read);
    data.declare(source, statements);
    reached::reach(source, statements, &data, None, &mut reached);
    for (companion, tokens) in companions() {
        reached::reach(
            companion.text(Language::Krl),
            &lines(tokens),
            &data,
            Some(companion.place),
            &mut reached,
        );
    }
    let uses = reached.uses(&found.literals, names);
    settle(found, uses, &WORDS);
    let mut called = BTreeSet::new();
    if found
        .literals
        .iter()
        .any(|literal| literal.frame.is_some() || literal.tool_in_force.is_some())
    {
        found.warnings.extend(
            reached
                .assumed
                .into_iter()
                .filter(|(_, message)| called.insert(message.clone())),
        );
    }
    found.tools = data.tools().collect();
}

struct Reader<'p> {
    source: ProgramText<'p>,
    /// Variable -> types it is declared with anywhere in the file.
    types: BTreeMap<String, Vec<String>>,
    /// Types that the file itself declares by STRUC, in capitals.
    structures: BTreeSet<String>,
    /// Literals that a variable holds, by their numbers, and its name.
    names: Vec<(Range<usize>, String)>,
    found: Gathered,
}

impl Reader<'_> {
    fn line(&mut self, line: &[Token]) {
        if !self.braces_match(line) {
            return;
        }
        let head = self.source.upper(&line[0]);
        if LEFT.contains(&head.as_str()) {
            if head.ends_with("_REL") {
                let message = format!(
                    "left as it is: {head} moves by a distance from where the target before, as corrected, has led"
                );
                self.found.warn(line[0].span.start, message);
            }
            return;
        }
        if let Some((_, positions)) = MOTIONS.iter().find(|(name, _)| *name == head) {
            // `PTP = 3` names a variable.
            if !line.get(1).is_some_and(|next| next.is(b'=')) {
                return self.motion(line, *positions);
            }
        }
        self.other(line, &head);
    }

    fn braces_match(&mut self, line: &[Token]) -> bool {
        brackets_match(line, &[(b'{', b'}')], "on its line", &mut self.found)
    }

    fn motion(&mut self, line: &[Token], positions: usize) {
        if let Some(colon) = self.geometric(line) {
            self.found.fault(colon, RELATIVE);
            return;
        }
        let end = line
            .iter()
            .position(|token| self.source.is_word(token, &["WITH"]))
            .unwrap_or(line.len());
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
            let whole = begins && operand < positions;
            if !whole || depth != 0 {
                self.found.fault(
                    token.span.start,
                    "an aggregate that is no position of this motion",
                );
            } else if let Some(stray) =
                behind.filter(|next| !(next.is(b',') || self.source.is_word(next, &BLENDING)))
            {
                let text = quoted(self.source.bytes, stray.span.clone());
                self.found.fault(
                    stray.span.start,
                    format!("{text} behind a position is not understood"),
                );
            } else {
                self.position(&line[k..=close]);
            }
            (k, begins) = (close + 1, false);
        }
        self.settings(&line[end..]);
    }

    /// An operand of a motion.
    fn position(&mut self, tokens: &[Token]) {
        let aggregate = Aggregate::new(self.source, tokens);
        let kind = match aggregate.prefix() {
            None => aggregate.by_fields(),
            Some(name) => match Type::of(&name).or((name == "FRAME").then_some(Type::FRAME)) {
                Some(kind) => kind,
                None => {
                    let message = format!("type {name} is not understood as a position");
                    self.found.fault(tokens[0].span.start, message);
                    return;
                }
            },
        };
        aggregate.take(kind, &mut self.found);
    }

    /// What stands behind WITH sets variables of the system: `$BASE = {...}`, `$VEL = {...}`.
    fn settings(&mut self, tokens: &[Token]) {
        let mut k = 0;
        while k < tokens.len() {
            if tokens[k].is(b'{') {
                let close = closing(tokens, k);
                let system = k > 1
                    && tokens[k - 1].is(b'=')
                    && self.source.upper(&tokens[k - 2]).starts_with('$');
                if !system && Aggregate::new(self.source, &tokens[k..=close]).may_be_target() {
                    self.found.fault(
                        tokens[k].span.start,
                        "an aggregate that is no position of this motion",
                    );
                }
                k = close;
            }
            k += 1;
        }
    }

    /// Where a geometric operator stands.
    fn geometric(&self, line: &[Token]) -> Option<usize> {
        let label = line.len() == 2;
        let heading = line.iter().any(|token| {
            self.source.is_word(
                token,
                &["DEF", "DEFFCT", "EXT", "EXTFCT", "EXTP", "EXTFCTP"],
            )
        });
        let mut depth = 0;
        line.iter()
            .filter(|_| !label && !heading)
            .find_map(|token| {
                match token.sort {
                    TokenKind::Sign(b'{') => depth += 1,
                    TokenKind::Sign(b'}') => depth -= 1,
                    _ => {}
                }
                (depth == 0 && token.is(b':')).then_some(token.span.start)
            })
    }

    /// A declaration, an assignment, or what is neither.
    fn other(&mut self, line: &[Token], head: &str) {
        let declares = declared(self.source, line).map(|(kind, _)| kind);
        let has_aggregate = line.iter().any(|token| token.is(b'{'));
        if let Some(at) = self.geometric(line) {
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
        let mut k = 0;
        while k < line.len() {
            if line[k].is(b'{') {
                let close = closing(line, k);
                let before = self.found.literals.len();
                self.value(&line[..k], &line[k..=close], declares.as_deref());
                let taken = self.found.literals.len() > before;
                if let Some((name, _)) = variable(self.source, &line[..k]).filter(|_| taken) {
                    self.names.push((before..self.found.literals.len(), name));
                }
                if let Some(stray) = line.get(close + 1).filter(|next| taken && !next.is(b',')) {
                    let text = quoted(self.source.bytes, stray.span.clone());
                    self.found.fault(
                        stray.span.start,
                        format!("{text} behind a target is not understood"),
                    );
                }
                k = close;
            }
            k += 1;
        }
    }

    /// Whether a line sets a variable that is known to be no target.
    fn sets_frame(&self, line: &[Token]) -> bool {
        let name = self.source.upper(&line[0]);
        name.starts_with('$')
            || FRAME_TABLES.contains(&name.as_str())
            || self.stated(&name) == Some("FRAME")
    }

    /// The one type that a variable has in this file.
    fn stated(&self, name: &str) -> Option<&str> {
        match self.types.get(name).map(Vec::as_slice) {
            Some([one]) => Some(one),
            _ => None,
        }
    }

    /// An aggregate behind `before`, in a line that declares a type or none.
    fn value(&mut self, before: &[Token], tokens: &[Token], declares: Option<&str>) {
        let aggregate = Aggregate::new(self.source, tokens);
        let at = tokens[0].span.start;
        let (name, member) = variable(self.source, before).unwrap_or_default();
        let prefix = aggregate.prefix();
        if name.starts_with('$') {
            if aggregate.by_fields().is_of_axes() || prefix.as_deref().and_then(Type::of).is_some()
            {
                self.found.warn(
                    at,
                    format!("left as it is: `{name}` is a variable of the system"),
                );
            }
            return;
        }
        if FRAME_TABLES.contains(&name.as_str()) {
            return;
        }
        let by_name = declares
            .or_else(|| self.stated(&name))
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
                self.found.fault(
                    at,
                    format!(
                        "the type of {what} is not stated in this file; write {}",
                        aggregate.advice()
                    ),
                );
            }
            None => self.nested(tokens),
        }
    }

    /// An aggregate of a type that is none of targets: it is left where the type is known, or declared in this file.
    fn of_other_type(&mut self, kind: &str, tokens: &[Token]) {
        let at = tokens[0].span.start;
        if kind != "FDAT"
            && !KNOWN.contains(&kind)
            && Aggregate::new(self.source, tokens).may_be_target()
        {
            if self.structures.contains(kind) {
                self.found.warn(
                    at,
                    format!(
                        "left as it is: {kind} is a structure of this file and no type of targets"
                    ),
                );
            } else {
                let message = format!(
                    "type {kind} is not understood: calib cannot say whether this is a target"
                );
                self.found.fault(at, message);
                return;
            }
        }
        self.nested(tokens);
    }

    /// Aggregates inside one that is no target: a target by its prefix, a frame, or of a kind that is not told.
    fn nested(&mut self, tokens: &[Token]) {
        let mut k = 1;
        while k < tokens.len() {
            if tokens[k].is(b'{') {
                let close = closing(tokens, k);
                let inner = &tokens[k..=close];
                let aggregate = Aggregate::new(self.source, inner);
                match aggregate.prefix().as_deref().map(Type::of) {
                    Some(Some(kind)) => aggregate.take(kind, &mut self.found),
                    Some(None) => {
                        self.of_other_type(&aggregate.prefix().unwrap_or_default(), inner)
                    }
                    // The centre of mass and the inertia of a LOAD.
                    None if self.source.is_word(&tokens[k - 1], &["CM", "J"]) => {}
                    None if aggregate.is_frame() => {
                        self.found.warn(
                            inner[0].span.start,
                            "left as it is: read as a FRAME inside a structure",
                        );
                    }
                    None if aggregate.may_be_target() => {
                        let message = format!(
                            "the type of this aggregate is not stated; write {}",
                            aggregate.advice()
                        );
                        self.found.fault(inner[0].span.start, message);
                    }
                    _ => self.nested(inner),
                }
                k = close;
            }
            k += 1;
        }
    }

    /// `XP1.Z = 50`: one number of a target.
    fn component(&mut self, line: &[Token], head: &str) {
        let Some((Some(member), Some(_))) = member(self.source, &line[1..]) else {
            return;
        };
        let of_target = [
            "X", "Y", "Z", "A", "B", "C", "A1", "A2", "A3", "A4", "A5", "A6",
        ]
        .contains(&member.as_str());
        if !of_target || head.starts_with('$') || self.sets_frame(line) {
            return;
        }
        let at = line[0].span.start;
        let types = self.types.get(head).map(Vec::as_slice).unwrap_or_default();
        if types.iter().any(|name| Type::of(name).is_some()) {
            self.found
                .partial(at, format!("sets {member} of the target `{head}` alone; a target is corrected whole or not at all"));
        } else if types.is_empty() {
            self.found.warn(
                at,
                format!(
                    "left as it is: sets {member} of `{head}`, whose type this file does not state"
                ),
            );
        }
    }
}

pub(super) fn listed(bytes: &[u8]) -> Declared {
    let mut found = Gathered::default();
    let source = ProgramText {
        bytes,
        language: Language::Krl,
    };
    let tokens = tokens(source, &mut found);
    let mut reader = Reader {
        source,
        types: BTreeMap::new(),
        structures: BTreeSet::new(),
        names: Vec::new(),
        found,
    };
    let (mut names, mut poses) = (Vec::new(), 0);
    for line in lines(&tokens) {
        let declares = declared(source, line).map(|(kind, _)| kind);
        if !line.iter().any(|token| token.is(b'{')) || !reader.braces_match(line) {
            continue;
        }
        let mut k = 0;
        while let Some(open) = line[k..]
            .iter()
            .position(|token| token.is(b'{'))
            .map(|at| k + at)
        {
            let close = closing(line, open);
            k = close + 1;
            let aggregate = Aggregate::new(source, &line[open..k]);
            let kind = aggregate.prefix().or_else(|| declares.clone());
            let (Some(kind), Some((name, None))) = (
                kind.as_deref().and_then(Type::of),
                variable(source, &line[..open]),
            ) else {
                continue;
            };
            if !kind.is_of_axes() {
                poses += 1;
                continue;
            }
            let before = reader.found.literals.len();
            aggregate.take(kind, &mut reader.found);
            names.extend(std::iter::repeat_n(
                name,
                reader.found.literals.len() - before,
            ));
        }
    }
    Declared {
        found: reader.found,
        names,
        poses,
    }
}

//! ABB RAPID: statements up to `;`, over lines. Targets are the literals `[...]` of robtargets and jointtargets, also in arrays.
//!
//! A literal is a target where it is declared or assigned to a variable that this file declares as one, or stands as position of a motion
//! instruction. Everything else that has the form of one is refused: RAPID gives a literal no type of its own. `Offs` and `RelTool` of a
//! named target stay: the controller adds the offset to the corrected target, so that the robot goes to the shifted point with the
//! correction of the unshifted one; a warning names the line.
//!
//! The jointtargets that a program declares, by their names.

mod list;
mod surroundings;

use super::token::{self, BRACKETS, ProgramText, Token, TokenKind, arguments, tokens};
use super::{Companion, Declared, Gathered, Language, quoted};
use list::{List, Want, depths};
use std::collections::BTreeMap;
use std::ops::Range;
use surroundings::in_force;

/// Motion instructions by how they begin, and which of the positional arguments are positions.
const MOTIONS: [(&str, &[usize]); 10] = [
    ("MOVEEXTJ", &[]),
    ("MOVEC", &[0, 1]),
    ("MOVE", &[0]),
    ("TRIGGC", &[0, 1]),
    ("TRIGGL", &[0]),
    ("TRIGGJ", &[0]),
    ("SEARCHC", &[2, 3]),
    ("SEARCHL", &[2]),
    ("ARCC", &[0, 1]),
    ("ARCL", &[0]),
];

/// Begins as a motion and is none.
const NO_MOTION: &str = "TRIGGCHECKIO";

/// Keywords behind which a statement begins.
const BLOCKS: [&str; 15] = [
    "THEN",
    "DO",
    "ELSE",
    "ENDIF",
    "ENDFOR",
    "ENDWHILE",
    "ENDTEST",
    "ENDPROC",
    "ENDFUNC",
    "ENDTRAP",
    "ENDMODULE",
    "ENDRECORD",
    "BACKWARD",
    "ERROR",
    "UNDO",
];

/// What a declaration begins with.
const STORAGE: [&str; 3] = ["VAR", "PERS", "CONST"];

/// Types whose literals may have the form of a target and are none.
const NUMBERS: [&str; 5] = ["NUM", "DNUM", "BYTE", "ROBJOINT", "EXTJOINT"];

pub(super) fn read(bytes: &[u8], companions: &[Companion]) -> Gathered {
    let mut found = Gathered::default();
    let source = ProgramText {
        bytes,
        language: Language::Rapid,
    };
    let all = tokens(source, &mut found);
    let statements = statements(source, &all, &mut found);
    let mut types: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for statement in &statements {
        if let Some(declaration) = declaration(source, statement) {
            let known = types.entry(declaration.name).or_default();
            if !known.contains(&declaration.kind) {
                known.push(declaration.kind);
            }
        }
    }
    let mut reader = Reader {
        source,
        types,
        names: Vec::new(),
        found,
    };
    for statement in &statements {
        reader.statement(statement);
    }
    let Reader {
        names, mut found, ..
    } = reader;
    in_force((source, &statements), companions, &names, &mut found);
    found
}

/// The motion instruction of this name, in capitals.
fn motion(name: &str) -> Option<(&'static str, &'static [usize])> {
    MOTIONS
        .into_iter()
        .find(|(begin, _)| name.starts_with(begin) && name != NO_MOTION)
}

/// The statements of a program, each without its `;` and without the heads of blocks before it. A value that no `;` ends before the
/// next block is a fault: what follows would be read as a part of it, or the other way round.
fn statements<'t>(
    source: ProgramText,
    tokens: &'t [Token],
    found: &mut Gathered,
) -> Vec<&'t [Token]> {
    let mut out: Vec<&[Token]> = Vec::new();
    let mut start = 0;
    let mut k = 0;
    while k < tokens.len() {
        let token = &tokens[k];
        let end = if token.is(b';') {
            Some((k, k + 1))
        } else if token.is(b':') || source.is_word(token, &BLOCKS) {
            Some((k + 1, k + 1))
        } else {
            heading(source, &tokens[k..]).map(|length| (k + length, k + length))
        };
        let ends = token.is(b';') || token.is(b':') || source.is_word(token, &["THEN", "DO"]);
        if end.is_some()
            && !ends
            && tokens[start..k]
                .iter()
                .any(|t| t.is(b'[') || t.sort == TokenKind::Pair(b':'))
        {
            let text = quoted(source.bytes, token.span.clone());
            found.fault(token.span.start, format!("`;` is missing before {text}"));
        }
        k += 1;
        if let Some((end, next)) = end {
            out.push(&tokens[start..end]);
            (start, k) = (next, next);
        }
    }
    out.push(&tokens[start..]);
    out.retain(|statement| !statement.is_empty());
    out
}

/// How many tokens the head of a module or a routine has; none where there is no such head.
fn heading(source: ProgramText, tokens: &[Token]) -> Option<usize> {
    let kind = &tokens[0];
    let mut length = if source.is_word(kind, &["MODULE", "PROC", "TRAP"]) {
        2
    } else if source.is_word(kind, &["FUNC"]) {
        3
    } else {
        return None;
    };
    if tokens.get(length).is_some_and(|token| token.is(b'(')) {
        length += tokens[length..].iter().position(|token| token.is(b')'))? + 1;
    }
    Some(length.min(tokens.len()))
}

struct Declaration<'t> {
    /// In capitals, as the name.
    kind: String,
    name: String,
    /// Behind `:=`.
    value: Option<&'t [Token]>,
    /// Behind the name and its dimensions, where there is no `:=`.
    stray: Option<&'t Token>,
}

fn declaration<'t>(source: ProgramText, statement: &'t [Token]) -> Option<Declaration<'t>> {
    let scoped = statement
        .iter()
        .take_while(|token| source.is_word(token, &["LOCAL", "TASK"]))
        .count();
    let [storage, kind, name, tail @ ..] = &statement[scoped..] else {
        return None;
    };
    if !source.is_word(storage, &STORAGE)
        || kind.sort != TokenKind::Word
        || name.sort != TokenKind::Word
    {
        return None;
    }
    let assign = tail
        .iter()
        .position(|token| token.sort == TokenKind::Pair(b':'));
    let dimensions = tail.iter().take_while(|token| !token.is(b'}')).count();
    let named = if tail.first().is_some_and(|token| token.is(b'{')) {
        tail.get(dimensions + 1..).unwrap_or_default()
    } else {
        tail
    };
    let stray = if assign.is_none() {
        named.first()
    } else {
        None
    };
    Some(Declaration {
        kind: source.upper(kind),
        name: source.upper(name),
        value: assign.map(|k| &tail[k + 1..]),
        stray,
    })
}

struct Reader<'p> {
    source: ProgramText<'p>,
    /// Variable -> types it is declared with anywhere in the file.
    types: BTreeMap<String, Vec<String>>,
    /// Literals that a variable holds, by their numbers, and its name.
    names: Vec<(Range<usize>, String)>,
    found: Gathered,
}

impl Reader<'_> {
    fn statement(&mut self, statement: &[Token]) {
        if !self.brackets_match(statement) {
            return;
        }
        self.frames(statement);
        if let Some(Declaration {
            kind,
            value,
            stray,
            name,
        }) = declaration(self.source, statement)
        {
            if let Some(stray) = stray {
                let text = quoted(self.source.bytes, stray.span.clone());
                self.found.fault(
                    stray.span.start,
                    format!("{text} in a declaration is not understood; expected `:=` or `;`"),
                );
            }
            return self.set(value.unwrap_or_default(), Some(&kind), name);
        }
        // In the head of a routine these words stand in brackets.
        let storage =
            |(token, depth): &(&Token, _)| *depth == 0 && self.source.is_word(token, &STORAGE);
        if let Some((storage, _)) = depths(statement).find(storage) {
            self.found.fault(
                storage.span.start,
                "a declaration that is not understood; expected a type and a name",
            );
            return;
        }
        match depths(statement)
            .position(|(token, depth)| depth == 0 && token.sort == TokenKind::Pair(b':'))
        {
            Some(k)
                if k > 0
                    && !statement[..k]
                        .iter()
                        .any(|token| token.is(b'\\') || token.is(b',')) =>
            {
                self.assignment(statement, k)
            }
            _ => self.instruction(statement),
        }
    }

    fn brackets_match(&mut self, statement: &[Token]) -> bool {
        token::brackets_match(statement, &BRACKETS, "in its statement", &mut self.found)
    }

    /// Displacements.
    fn frames(&mut self, statement: &[Token]) {
        const BASE: &str =
            "calib assumed that targets are in the robot's base, as in wobj0 without displacement";
        let head = &statement[0];
        if self
            .source
            .is_word(head, &["PDISPON", "PDISPSET", "EOFFSON", "EOFFSSET"])
        {
            let name = quoted(self.source.bytes, head.span.clone());
            self.found.frame(
                head.span.start,
                format!("{name} displaces what follows: {BASE}"),
            );
        }
    }

    /// A value for the variable `name` of type `kind`; none: of a type that this file does not state.
    fn set(&mut self, value: &[Token], kind: Option<&str>, name: String) {
        let want = match kind {
            Some("ROBTARGET") => Some(Want::Pose),
            Some("JOINTTARGET") => Some(Want::Joints),
            _ => None,
        };
        match (want, value.first()) {
            (Some(want), Some(first)) if first.is(b'[') => {
                let list = List::read(self.source, value);
                if list.tokens < value.len() {
                    let stray = &value[list.tokens];
                    let text = quoted(self.source.bytes, stray.span.clone());
                    self.found.fault(
                        stray.span.start,
                        format!("{text} behind a target is not understood"),
                    );
                } else {
                    let before = self.found.literals.len();
                    list.take(want, true, &mut self.found);
                    self.names.push((before..self.found.literals.len(), name));
                }
            }
            _ if kind.is_some_and(|kind| NUMBERS.contains(&kind)) => {}
            _ => {
                let kind_of = kind.map_or_else(
                    || "whose type this file does not state".into(),
                    |kind| format!("of type {kind}"),
                );
                self.computed(value, want.is_some());
                self.others(value, format!("a variable {kind_of}"));
            }
        }
    }

    /// Literals that are no targets by where they stand: those of the form of one are refused.
    fn others(&mut self, tokens: &[Token], place: String) {
        let mut k = 0;
        while k < tokens.len() {
            if tokens[k].is(b'[') {
                let list = List::read(self.source, &tokens[k..]);
                if let Some(want) = list.has_form() {
                    let message = format!(
                        "has the form of a {} and stands in {place}; declare it: `CONST {0} p := [...]`",
                        want.name()
                    );
                    self.found.fault(tokens[k].span.start, message);
                }
                k += list.tokens;
            } else {
                k += 1;
            }
        }
    }

    /// `p := ...`, `p.trans.z := ...`.
    fn assignment(&mut self, statement: &[Token], assign: usize) {
        let (variable, value) = (&statement[..assign], &statement[assign + 1..]);
        let name = self.source.upper(&variable[0]);
        let members: Vec<String> = variable
            .windows(2)
            .filter(|w| w[0].is(b'.'))
            .map(|w| self.source.upper(&w[1]))
            .collect();
        let types = self.types.get(&name).map(Vec::as_slice).unwrap_or_default();
        let Some(member) = members.first() else {
            let kind = if let [one] = types {
                Some(one.clone())
            } else {
                None
            };
            return self.set(value, kind.as_deref(), name);
        };
        let at = variable[0].span.start;
        let target = types
            .iter()
            .any(|kind| matches!(kind.as_str(), "ROBTARGET" | "JOINTTARGET"));
        let part = ["TRANS", "ROT", "ROBAX"].contains(&member.as_str());
        let given = quoted(self.source.bytes, self.source.over(variable, at));
        if target && part {
            self.found.partial(at, format!("{given} sets a part of a target alone; a target is corrected whole or not at all"));
        } else if part && types.is_empty() {
            self.found.warn(
                at,
                format!("left as it is: {given}, of a type that this file does not state"),
            );
        } else {
            self.others(value, "a member of a variable".into());
        }
    }

    fn instruction(&mut self, statement: &[Token]) {
        let name = self.source.upper(&statement[0]);
        let Some((begin, positions)) = motion(&name) else {
            return self.others(
                statement,
                format!("`{name}`, no motion instruction that calib knows"),
            );
        };
        if begin == "MOVEEXTJ" {
            self.found.warn(
                statement[0].span.start,
                "moves external axes alone: calib assumed that they do not move the robot",
            );
            return;
        }
        let want = if name.contains("ABSJ") {
            Want::Joints
        } else {
            Want::Pose
        };
        let (mut number, arguments) = (0, arguments(&statement[1..]));
        for argument in arguments {
            let Some(first) = argument.first() else {
                number += 1;
                continue;
            };
            // `MoveL \Conc, p10, ...`
            if first.is(b'\\') {
                self.others(argument, format!("an argument of `{name}`"));
                continue;
            }
            if positions.contains(&number) {
                self.position(argument, want);
            } else {
                self.others(
                    argument,
                    format!("an argument of `{name}` that is no position"),
                );
            }
            number += 1;
        }
    }

    fn position(&mut self, argument: &[Token], want: Want) {
        if argument[0].is(b'[') {
            let list = List::read(self.source, argument);
            match argument.get(list.tokens) {
                Some(stray) if !stray.is(b'\\') => {
                    let text = quoted(self.source.bytes, stray.span.clone());
                    self.found.fault(
                        stray.span.start,
                        format!("{text} behind a target is not understood"),
                    );
                }
                _ => {
                    list.take(want, false, &mut self.found);
                    self.others(&argument[list.tokens..], "an optional argument".into());
                }
            }
            return;
        }
        self.computed(argument, true);
        self.others(argument, "an expression".into());
    }

    /// A call in the place of a target; where that is not sure, those that give one.
    fn computed(&mut self, tokens: &[Token], target: bool) {
        let [function, bracket, ..] = tokens else {
            return;
        };
        let name = quoted(self.source.bytes, function.span.clone());
        if !bracket.is(b'(') {
            return;
        }
        if self.source.is_word(function, &["OFFS", "RELTOOL"]) {
            let message = "shifts its target; where that one is corrected, the shifted one gets the same correction";
            self.found.warn(
                function.span.start,
                format!("left as it is: {name} {message}"),
            );
        } else if target {
            self.found.warn(
                function.span.start,
                format!("left as it is: {name} computes the target"),
            );
        }
    }
}

pub(super) fn listed(bytes: &[u8]) -> Declared {
    let mut found = Gathered::default();
    let source = ProgramText {
        bytes,
        language: Language::Rapid,
    };
    let tokens = tokens(source, &mut found);
    let statements = statements(source, &tokens, &mut found);
    let mut reader = Reader {
        source,
        types: BTreeMap::new(),
        names: Vec::new(),
        found,
    };
    let (mut names, mut poses) = (Vec::new(), 0);
    for statement in statements {
        let Some((value, kind)) = declaration(source, statement)
            .and_then(|declared| Some((declared.value?, declared.kind)))
        else {
            continue;
        };
        if kind == "ROBTARGET" {
            poses += 1;
        }
        if kind != "JOINTTARGET" || !reader.brackets_match(statement) {
            continue;
        }
        let name = name(source, statement);
        if !value.first().is_some_and(|first| first.is(b'[')) {
            let at = value
                .first()
                .map_or(statement[0].span.start, |first| first.span.start);
            reader.found.fault(
                at,
                format!("`{name}` is no list of numbers; expected [[6 joints], [6 external axes]]"),
            );
            continue;
        }
        let list = List::read(source, value);
        if list.tokens < value.len() {
            reader.found.fault(
                value[list.tokens].span.start,
                format!("something behind the list of `{name}`; expected `;`"),
            );
            continue;
        }
        let (before, is_array) = (
            reader.found.literals.len(),
            value.get(2).is_some_and(|token| token.is(b'[')),
        );
        list.take(Want::Joints, is_array, &mut reader.found);
        let count = reader.found.literals.len() - before;
        names.extend((1..=count).map(|k| {
            if is_array {
                format!("{name}{{{k}}}")
            } else {
                name.clone()
            }
        }));
    }
    Declared {
        found: reader.found,
        names,
        poses,
    }
}

/// The name that a declaration gives, as it is written.
fn name(source: ProgramText, statement: &[Token]) -> String {
    // Scope, storage and type are words, too; the name is the last one before a dimension or `:=`.
    let words = statement
        .iter()
        .take_while(|token| token.sort == TokenKind::Word);
    words.last().map_or_else(String::new, |word| {
        String::from_utf8_lossy(&source.bytes[word.span.clone()]).into_owned()
    })
}

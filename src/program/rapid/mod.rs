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

use super::token::{self, BRACKETS, Token, TokenKind, arguments, quoted, tokens};
use super::{Companion, Gathered, Grammar, Language};
use list::{List, Want, depths};
use surroundings::in_force;

pub(super) const GRAMMAR: Grammar = Grammar {
    endings: &["mod", "modx", "sys", "sysx", "prg"],
    comment: "!",
    heads: &["MODULE"],
    begins: &["JOINTTARGET", "ROBTARGET", "MODULE"],
    read,
    listed,
};

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
const BLOCKS: &str = "THEN DO ELSE ENDIF ENDFOR ENDWHILE ENDTEST ENDPROC ENDFUNC ENDTRAP ENDMODULE ENDRECORD \
    BACKWARD ERROR UNDO";

/// What a declaration begins with.
const STORAGE: &str = "VAR PERS CONST";

/// Types whose literals may have the form of a target and are none.
const NUMBERS: [&str; 5] = ["NUM", "DNUM", "BYTE", "ROBJOINT", "EXTJOINT"];

fn read(bytes: &[u8], companions: &[Companion]) -> Gathered {
    let mut reader = Reader(Gathered::default());
    let all = tokens(bytes, Language::Rapid, &mut reader.0);
    let statements = statements(&all, &mut reader.0);
    for declared in statements.iter().filter_map(|one| declaration(one)) {
        reader.0.declare(declared.name, declared.kind);
    }
    statements.iter().for_each(|one| reader.statement(one));
    in_force(&statements, companions, &mut reader.0);
    reader.0
}

/// The motion instruction of this name, in capitals.
fn motion(name: &str) -> Option<(&'static str, &'static [usize])> {
    MOTIONS
        .into_iter()
        .find(|(begin, _)| name.starts_with(begin) && name != NO_MOTION)
}

/// The statements of a program, each without its `;` and without the heads of blocks before it. A value that no `;` ends before the
/// next block is a fault: what follows would be read as a part of it, or the other way round.
fn statements<'t, 'p>(tokens: &'t [Token<'p>], found: &mut Gathered) -> Vec<&'t [Token<'p>]> {
    let mut out: Vec<&[Token]> = Vec::new();
    let mut start = 0;
    let mut k = 0;
    while k < tokens.len() {
        let token = &tokens[k];
        let end = if token.is(b';') {
            Some((k, k + 1))
        } else if token.is(b':') || token.is_word(BLOCKS) {
            Some((k + 1, k + 1))
        } else {
            heading(&tokens[k..]).map(|length| (k + length, k + length))
        };
        let ends = token.is(b';') || token.is(b':') || token.is_word("THEN DO");
        let mut before = tokens[start..k].iter();
        if end.is_some() && !ends && before.any(|one| one.is(b'[') || one.assigns()) {
            let message = format!("`;` is missing before {}", token.quoted());
            found.fault(token.start, message);
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
fn heading(tokens: &[Token]) -> Option<usize> {
    let kind = &tokens[0];
    let mut length = if kind.is_word("MODULE PROC TRAP") {
        2
    } else if kind.is_word("FUNC") {
        3
    } else {
        return None;
    };
    if tokens.get(length).is_some_and(|token| token.is(b'(')) {
        length += tokens[length..].iter().position(|token| token.is(b')'))? + 1;
    }
    Some(length.min(tokens.len()))
}

struct Declaration<'t, 'p> {
    /// In capitals, as the name.
    kind: String,
    name: String,
    /// Behind `:=`.
    value: Option<&'t [Token<'p>]>,
    /// Behind the name and its dimensions, where there is no `:=`.
    stray: Option<&'t Token<'p>>,
}

fn declaration<'t, 'p>(statement: &'t [Token<'p>]) -> Option<Declaration<'t, 'p>> {
    let is_scope = |token: &&Token| token.is_word("LOCAL TASK");
    let scoped = statement.iter().take_while(is_scope).count();
    let [storage, kind, name, tail @ ..] = &statement[scoped..] else {
        return None;
    };
    if !storage.is_word(STORAGE) || [kind, name].iter().any(|one| one.sort != TokenKind::Word) {
        return None;
    }
    let assign = tail.iter().position(Token::assigns);
    let dimensions = tail.iter().take_while(|token| !token.is(b'}')).count();
    let named = match tail.first().is_some_and(|token| token.is(b'{')) {
        true => tail.get(dimensions + 1..).unwrap_or_default(),
        false => tail,
    };
    Some(Declaration {
        kind: kind.upper(),
        name: name.upper(),
        value: assign.map(|k| &tail[k + 1..]),
        stray: named.first().filter(|_| assign.is_none()),
    })
}

/// Whether what stands before `:=` is a variable: no argument of an instruction.
fn is_variable(before: &[Token]) -> bool {
    !before.iter().any(|token| token.is(b'\\') || token.is(b','))
}

struct Reader(Gathered);

impl Reader {
    fn statement(&mut self, statement: &[Token]) {
        if !brackets_match(statement, &mut self.0) {
            return;
        }
        self.frames(statement);
        if let Some(declared) = declaration(statement) {
            if let Some(stray) = declared.stray {
                let text = stray.quoted();
                let message =
                    format!("{text} in a declaration is not understood; expected `:=` or `;`");
                self.0.fault(stray.start, message);
            }
            let (name, value) = (declared.name, declared.value.unwrap_or_default());
            return self.set(value, Some(&declared.kind), name);
        }
        let outside = |wanted: fn(&Token) -> bool| {
            depths(statement).position(|(token, depth)| depth == 0 && wanted(token))
        };
        // In the head of a routine these words stand in brackets.
        if let Some(storage) = outside(|token| token.is_word(STORAGE)) {
            let message = "a declaration that is not understood; expected a type and a name";
            return self.0.fault(statement[storage].start, message);
        }
        match outside(|token| token.assigns()) {
            Some(k) if k > 0 && is_variable(&statement[..k]) => self.assignment(statement, k),
            _ => self.instruction(statement),
        }
    }

    /// Displacements.
    fn frames(&mut self, statement: &[Token]) {
        const BASE: &str =
            "calib assumed that targets are in the robot's base, as in wobj0 without displacement";
        let head = &statement[0];
        if head.is_word("PDISPON PDISPSET EOFFSON EOFFSSET") {
            let message = format!("{} displaces what follows: {BASE}", head.quoted());
            self.0.frame(head.start, message);
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
                let list = List::read(value);
                if let Some(stray) = value.get(list.tokens) {
                    return self.0.stray(stray, "behind a target");
                }
                let before = self.0.literals.len();
                list.take(want, true, &mut self.0);
                self.0.held_by(name, before);
            }
            _ if kind.is_some_and(|kind| NUMBERS.contains(&kind)) => {}
            _ => {
                let kind_of = kind.map_or_else(
                    || "whose type this file does not state".into(),
                    |kind| format!("of type {kind}"),
                );
                self.computed(value, want.is_some());
                self.others(value, &format!("a variable {kind_of}"));
            }
        }
    }

    /// Literals that are no targets by where they stand: those of the form of one are refused.
    fn others(&mut self, tokens: &[Token], place: &str) {
        let mut k = 0;
        while k < tokens.len() {
            if !tokens[k].is(b'[') {
                k += 1;
                continue;
            }
            let list = List::read(&tokens[k..]);
            if let Some(want) = list.has_form() {
                let name = want.name();
                let message = format!(
                    "has the form of a {name} and stands in {place}; declare it: `CONST {name} p := [...]`"
                );
                self.0.fault(tokens[k].start, message);
            }
            k += list.tokens;
        }
    }

    /// `p := ...`, `p.trans.z := ...`.
    fn assignment(&mut self, statement: &[Token], assign: usize) {
        let (variable, value) = (&statement[..assign], &statement[assign + 1..]);
        let name = variable[0].upper();
        let mut members = variable.windows(2).filter(|w| w[0].is(b'.'));
        let Some(member) = members.next().map(|w| &w[1]) else {
            let kind = self.0.stated(&name).map(String::from);
            return self.set(value, kind.as_deref(), name);
        };
        let types = self.0.types(&name);
        let is_target = |kind: &String| ["ROBTARGET", "JOINTTARGET"].contains(&kind.as_str());
        let (target, unknown) = (types.iter().any(is_target), types.is_empty());
        let part = ["TRANS", "ROT", "ROBAX"].contains(&member.upper().as_str());
        let (at, given) = (variable[0].start, quoted(variable));
        if target && part {
            let message = format!(
                "{given} sets a part of a target alone; a target is corrected whole or not at all"
            );
            self.0.partial(at, message);
        } else if part && unknown {
            let message =
                format!("left as it is: {given}, of a type that this file does not state");
            self.0.warn(at, message);
        } else {
            self.others(value, "a member of a variable");
        }
    }

    fn instruction(&mut self, statement: &[Token]) {
        let name = statement[0].upper();
        let Some((begin, positions)) = motion(&name) else {
            let place = format!("`{name}`, no motion instruction that calib knows");
            return self.others(statement, &place);
        };
        if begin == "MOVEEXTJ" {
            let message =
                "moves external axes alone: calib assumed that they do not move the robot";
            return self.0.warn(statement[0].start, message);
        }
        let want = if name.contains("ABSJ") {
            Want::Joints
        } else {
            Want::Pose
        };
        let mut number = 0;
        for argument in arguments(&statement[1..]) {
            // `MoveL \Conc, p10, ...`
            if argument.first().is_some_and(|first| first.is(b'\\')) {
                self.others(argument, &format!("an argument of `{name}`"));
                continue;
            }
            if !argument.is_empty() && positions.contains(&number) {
                self.position(argument, want);
            } else {
                let place = format!("an argument of `{name}` that is no position");
                self.others(argument, &place);
            }
            number += 1;
        }
    }

    fn position(&mut self, argument: &[Token], want: Want) {
        if !argument[0].is(b'[') {
            self.computed(argument, true);
            return self.others(argument, "an expression");
        }
        let list = List::read(argument);
        match argument.get(list.tokens) {
            Some(stray) if !stray.is(b'\\') => self.0.stray(stray, "behind a target"),
            _ => {
                list.take(want, false, &mut self.0);
                self.others(&argument[list.tokens..], "an optional argument");
            }
        }
    }

    /// A call in the place of a target; where that is not sure, those that give one.
    fn computed(&mut self, tokens: &[Token], target: bool) {
        let [function, bracket, ..] = tokens else {
            return;
        };
        let does = if !bracket.is(b'(') {
            return;
        } else if function.is_word("OFFS RELTOOL") {
            "shifts its target; where that one is corrected, the shifted one gets the same correction"
        } else if target {
            "computes the target"
        } else {
            return;
        };
        let message = format!("left as it is: {} {does}", function.quoted());
        self.0.warn(function.start, message);
    }
}

fn brackets_match(statement: &[Token], found: &mut Gathered) -> bool {
    token::brackets_match(statement, &BRACKETS, "in its statement", found)
}

fn listed(bytes: &[u8]) -> Gathered {
    let mut found = Gathered::default();
    let tokens = tokens(bytes, Language::Rapid, &mut found);
    for statement in statements(&tokens, &mut found) {
        let Some(Declaration {
            kind,
            value: Some(value),
            ..
        }) = declaration(statement)
        else {
            continue;
        };
        found.poses += usize::from(kind == "ROBTARGET");
        if kind != "JOINTTARGET" || !brackets_match(statement, &mut found) {
            continue;
        }
        // As it is written. Scope, storage and type are words, too; the name is the last one before a dimension or `:=`.
        let words = statement
            .iter()
            .take_while(|token| token.sort == TokenKind::Word);
        let name = words.last().map_or_else(String::new, Token::name);
        if !value.first().is_some_and(|first| first.is(b'[')) {
            let at = value.first().unwrap_or(&statement[0]).start;
            let message =
                format!("`{name}` is no list of numbers; expected [[6 joints], [6 external axes]]");
            found.fault(at, message);
            continue;
        }
        let list = List::read(value);
        if let Some(stray) = value.get(list.tokens) {
            let message = format!("something behind the list of `{name}`; expected `;`");
            found.fault(stray.start, message);
            continue;
        }
        let (before, is_array) = (
            found.literals.len(),
            value.get(2).is_some_and(|token| token.is(b'[')),
        );
        list.take(Want::Joints, is_array, &mut found);
        for (k, at) in (before..found.literals.len()).enumerate() {
            let name = if is_array {
                format!("{name}{{{}}}", k + 1)
            } else {
                name.clone()
            };
            found.names.push((at..at + 1, name));
        }
    }
    found
}

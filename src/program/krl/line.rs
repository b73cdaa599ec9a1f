//! Parts of a line of KRL: what it declares, what it sets, which braces belong together.

use super::super::flow::{FlowLine, FlowStep};
use super::super::token::{Token, TokenKind};

/// Types that need no DECL.
const PREDEFINED: [&str; 11] = [
    "INT", "REAL", "BOOL", "CHAR", "FRAME", "POS", "E3POS", "E6POS", "AXIS", "E3AXIS", "E6AXIS",
];

/// How many of these words a line begins with, and what follows them.
fn behind<'t, 'p>(line: &'t [Token<'p>], words: &str) -> (usize, &'t [Token<'p>]) {
    let count = line.iter().take_while(|token| token.is_word(words)).count();
    (count, &line[count..])
}

/// The type and the names that a line declares, in capitals.
pub(super) fn declared(line: &[Token]) -> Option<(String, Vec<String>)> {
    let (skipped, tail) = behind(line, "DECL GLOBAL CONST");
    let [kind, first, ..] = tail else { return None };
    let plain = tail
        .get(2)
        .is_none_or(|next| next.is(b'=') || next.is(b'[') || next.is(b','));
    if kind.sort != TokenKind::Word || first.sort != TokenKind::Word || !plain {
        return None;
    }
    let kind = kind.upper();
    if skipped == 0 && !PREDEFINED.contains(&kind.as_str()) {
        return None;
    }
    let mut names = vec![first.upper()];
    let mut depth = 0;
    for pair in tail.windows(2) {
        depth += pair[0].opens();
        if depth == 0 && pair[0].is(b',') && pair[1].sort == TokenKind::Word {
            names.push(pair[1].upper());
        }
    }
    Some((kind, names))
}

/// The type that a line declares as a structure: `[GLOBAL] STRUC NAME ...`.
pub(super) fn structure(line: &[Token]) -> Option<String> {
    match behind(line, "GLOBAL").1 {
        [word, name, ..] if word.is_word("STRUC") && name.sort == TokenKind::Word => {
            Some(name.upper())
        }
        _ => None,
    }
}

/// Behind a name: the last member of `[1].FRAME.X`, and what follows `=`; the second is none where nothing is set.
pub(super) fn member<'t, 'p>(
    tail: &'t [Token<'p>],
) -> Option<(Option<String>, Option<&'t [Token<'p>]>)> {
    let mut member = None;
    let mut k = 0;
    loop {
        match tail.get(k).map(|token| token.sort) {
            Some(TokenKind::Sign(b'[')) => {
                k += tail[k..].iter().position(|token| token.is(b']'))? + 1
            }
            Some(TokenKind::Sign(b'.')) => {
                member = Some(tail.get(k + 1)?.upper());
                k += 2;
            }
            Some(TokenKind::Sign(b'=')) => return Some((member, Some(&tail[k + 1..]))),
            _ => return Some((member, None)),
        }
    }
}

/// The variable that is set where `before` ends in `NAME[1].MEMBER =`: its name, and whether a member of it.
pub(super) fn variable(before: &[Token]) -> Option<(String, Option<String>)> {
    let (last, mut tail) = before.split_last()?;
    if !last.is(b'=') {
        return None;
    }
    let mut subject = None;
    loop {
        let (last, front) = tail.split_last()?;
        if last.is(b']') {
            let open = front.iter().rposition(|token| token.is(b'['))?;
            tail = &front[..open];
        } else if last.sort == TokenKind::Word {
            if front.last().is_some_and(|token| token.is(b'.')) {
                subject = subject.or_else(|| Some(last.upper()));
                tail = &front[..front.len() - 1];
            } else {
                return Some((last.upper(), subject));
            }
        } else {
            return None;
        }
    }
}

/// Names before a bracket, in capitals: what a line calls, if it calls anything.
pub(super) fn called(line: &[Token]) -> impl Iterator<Item = String> {
    let calls = |w: &&[Token]| w[0].sort == TokenKind::Word && w[1].is(b'(');
    line.windows(2).filter(calls).map(|w| w[0].upper())
}

/// Heads of lines behind whose `DEF` a routine begins.
const ROUTINES: &str = "DEF DEFFCT";

/// What such lines name runs at another time.
const DECLARING: &str = "EXT EXTFCT EXTP EXTFCTP INTERRUPT GLOBAL TRIGGER";

/// The routines of a file, in capitals.
pub(super) fn routines(lines: &[&[Token]]) -> Vec<String> {
    let name = |line: &&[Token]| match step(line) {
        FlowStep::Routine(name) => Some(name),
        _ => None,
    };
    lines.iter().filter_map(name).collect()
}

/// The lines of a file as steps; `sets`: whether a line sets what is in force.
pub(super) fn steps(lines: &[&[Token]], sets: impl Fn(&[Token]) -> bool) -> Vec<FlowLine> {
    let routines = routines(lines);
    let of_line = |line: &&[Token]| {
        let step = step(line);
        let none = matches!(step, FlowStep::Routine(_)) || line[0].is_word(DECLARING);
        let calls = called(line).filter(|name| !none && routines.contains(name));
        FlowLine {
            calls: calls.collect(),
            sets: sets(line),
            step,
        }
    };
    lines.iter().map(of_line).collect()
}

pub(super) fn step(line: &[Token]) -> FlowStep {
    let word = line[0].upper();
    let second = line.get(1).map(Token::upper).unwrap_or_default();
    let mut heads = line.iter().take(3);
    if let Some(at) = heads.position(|token| token.is_word(ROUTINES)) {
        // A function has its type before its name.
        let mut pairs = line[at + 1..].windows(2);
        let name = pairs.find(|w| w[1].is(b'(')).map(|w| w[0].upper());
        return FlowStep::Routine(name.unwrap_or(second));
    }
    if line.len() == 2 && line[0].sort == TokenKind::Word && line[1].is(b':') {
        return FlowStep::Label(word);
    }
    match word.as_str() {
        "END" | "ENDFCT" => FlowStep::EndRoutine,
        "IF" => FlowStep::If,
        "ELSE" => FlowStep::Else,
        "ENDIF" => FlowStep::EndIf,
        "FOR" | "WHILE" => FlowStep::While,
        "LOOP" | "REPEAT" => FlowStep::Loop,
        "ENDFOR" | "ENDWHILE" | "UNTIL" => FlowStep::EndLoop,
        "ENDLOOP" => FlowStep::EndForever,
        "EXIT" => FlowStep::Exit,
        "SWITCH" => FlowStep::Switch,
        "CASE" => FlowStep::Case,
        "DEFAULT" => FlowStep::Default,
        "ENDSWITCH" => FlowStep::EndSwitch,
        "GOTO" => FlowStep::Goto(second),
        "RETURN" => FlowStep::Return,
        _ => FlowStep::Plain,
    }
}

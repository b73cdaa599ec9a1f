//! Parts of a line of KRL: what it declares, what it sets, which braces belong together.
//!
//! Lines of KRL as steps of the order of execution.

use super::super::flow::{FlowLine, FlowStep};
use super::super::token::{ProgramText, Token, TokenKind};

/// Types that need no DECL.
const PREDEFINED: [&str; 11] = [
    "INT", "REAL", "BOOL", "CHAR", "FRAME", "POS", "E3POS", "E6POS", "AXIS", "E3AXIS", "E6AXIS",
];

/// The type and the names that a line declares, in capitals.
pub(super) fn declared(source: ProgramText, line: &[Token]) -> Option<(String, Vec<String>)> {
    let skipped = line
        .iter()
        .take_while(|token| source.is_word(token, &["DECL", "GLOBAL", "CONST"]))
        .count();
    let tail = &line[skipped..];
    let [kind, first, ..] = tail else { return None };
    let plain = tail
        .get(2)
        .is_none_or(|next| next.is(b'=') || next.is(b'[') || next.is(b','));
    if kind.sort != TokenKind::Word || first.sort != TokenKind::Word || !plain {
        return None;
    }
    let kind = source.upper(kind);
    if skipped == 0 && !PREDEFINED.contains(&kind.as_str()) {
        return None;
    }
    let mut names = vec![source.upper(first)];
    let mut depth = 0;
    for pair in tail.windows(2) {
        depth += pair[0].opens();
        if depth == 0 && pair[0].is(b',') && pair[1].sort == TokenKind::Word {
            names.push(source.upper(&pair[1]));
        }
    }
    Some((kind, names))
}

/// The type that a line declares as a structure: `[GLOBAL] STRUC NAME ...`.
pub(super) fn structure(source: ProgramText, line: &[Token]) -> Option<String> {
    let skipped = line
        .iter()
        .take_while(|token| source.is_word(token, &["GLOBAL"]))
        .count();
    match &line[skipped..] {
        [word, name, ..] if source.is_word(word, &["STRUC"]) && name.sort == TokenKind::Word => {
            Some(source.upper(name))
        }
        _ => None,
    }
}

/// Behind a name: the last member of `[1].FRAME.X`, and what follows `=`; the second is none where nothing is set.
pub(super) fn member<'t>(
    source: ProgramText,
    tail: &'t [Token],
) -> Option<(Option<String>, Option<&'t [Token]>)> {
    let mut member = None;
    let mut k = 0;
    loop {
        match tail.get(k).map(|token| token.sort) {
            Some(TokenKind::Sign(b'[')) => {
                k += tail[k..].iter().position(|token| token.is(b']'))? + 1
            }
            Some(TokenKind::Sign(b'.')) => {
                member = Some(source.upper(tail.get(k + 1)?));
                k += 2;
            }
            Some(TokenKind::Sign(b'=')) => return Some((member, Some(&tail[k + 1..]))),
            _ => return Some((member, None)),
        }
    }
}

/// The variable that is set where `before` ends in `NAME[1].MEMBER =`: its name, and whether a member of it.
pub(super) fn variable(source: ProgramText, before: &[Token]) -> Option<(String, Option<String>)> {
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
                subject = subject.or_else(|| Some(source.upper(last)));
                tail = &front[..front.len() - 1];
            } else {
                return Some((source.upper(last), subject));
            }
        } else {
            return None;
        }
    }
}

/// Heads of lines behind whose `DEF` a routine begins.
const ROUTINES: [&str; 2] = ["DEF", "DEFFCT"];

/// The lines of a file as steps; `sets`: whether a line sets what is in force.
pub(super) fn steps(
    source: ProgramText,
    lines: &[&[Token]],
    sets: impl Fn(&[Token]) -> bool,
) -> Vec<FlowLine> {
    let all: Vec<FlowStep> = lines.iter().map(|line| step(source, line)).collect();
    let routines: Vec<&String> = all
        .iter()
        .filter_map(|step| {
            if let FlowStep::Routine(name) = step {
                Some(name)
            } else {
                None
            }
        })
        .collect();
    let called = |line: &[Token], step: &FlowStep| -> Vec<String> {
        let calls = line
            .windows(2)
            .filter(|w| w[0].sort == TokenKind::Word && w[1].is(b'('));
        let named = calls
            .map(|w| source.upper(&w[0]))
            .filter(|name| routines.contains(&name));
        if matches!(step, FlowStep::Routine(_)) || is_declared(source, line) {
            Vec::new()
        } else {
            named.collect()
        }
    };
    let of_line = |(line, step): (&&[Token], FlowStep)| FlowLine {
        calls: called(line, &step),
        sets: sets(line),
        step,
    };
    lines.iter().zip(all.clone()).map(of_line).collect()
}

/// `EXT`, `INTERRUPT DECL` and `TRIGGER`: what they name runs at another time.
fn is_declared(source: ProgramText, line: &[Token]) -> bool {
    source.is_word(
        &line[0],
        &[
            "EXT",
            "EXTFCT",
            "EXTP",
            "EXTFCTP",
            "INTERRUPT",
            "GLOBAL",
            "TRIGGER",
        ],
    )
}

pub(super) fn step(source: ProgramText, line: &[Token]) -> FlowStep {
    let word = source.upper(&line[0]);
    let second = line
        .get(1)
        .map(|token| source.upper(token))
        .unwrap_or_default();
    if let Some(at) = line
        .iter()
        .take(3)
        .position(|token| source.is_word(token, &ROUTINES))
    {
        // A function has its type before its name.
        let name = line[at + 1..]
            .windows(2)
            .find(|w| w[1].is(b'('))
            .map(|w| source.upper(&w[0]));
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

//! Lines of KRL as steps of the order of execution.

use super::super::flow::{FlowLine, Step};
use super::super::token::{ProgramText, Token, TokenKind};

/// Heads of lines behind whose `DEF` a routine begins.
const ROUTINES: [&str; 2] = ["DEF", "DEFFCT"];

/// The lines of a file as steps; `sets`: whether a line sets what is in force.
pub(super) fn steps(source: ProgramText, lines: &[&[Token]], sets: impl Fn(&[Token]) -> bool) -> Vec<FlowLine> {
    let all: Vec<Step> = lines.iter().map(|line| step(source, line)).collect();
    let routines: Vec<&String> =
        all.iter().filter_map(|step| if let Step::Routine(name) = step { Some(name) } else { None }).collect();
    let called = |line: &[Token], step: &Step| -> Vec<String> {
        let calls = line.windows(2).filter(|w| w[0].sort == TokenKind::Word && w[1].is(b'('));
        let named = calls.map(|w| source.upper(&w[0])).filter(|name| routines.contains(&name));
        if matches!(step, Step::Routine(_)) || is_declared(source, line) { Vec::new() } else { named.collect() }
    };
    let of = |(line, step): (&&[Token], Step)| FlowLine { calls: called(line, &step), sets: sets(line), step };
    lines.iter().zip(all.clone()).map(of).collect()
}

/// `EXT`, `INTERRUPT DECL` and `TRIGGER`: what they name runs at another time.
fn is_declared(source: ProgramText, line: &[Token]) -> bool {
    source.is_word(&line[0], &["EXT", "EXTFCT", "EXTP", "EXTFCTP", "INTERRUPT", "GLOBAL", "TRIGGER"])
}

pub(super) fn step(source: ProgramText, line: &[Token]) -> Step {
    let word = source.upper(&line[0]);
    let second = line.get(1).map(|token| source.upper(token)).unwrap_or_default();
    if let Some(at) = line.iter().take(3).position(|token| source.is_word(token, &ROUTINES)) {
        // A function has its type before its name.
        let name = line[at + 1..].windows(2).find(|w| w[1].is(b'(')).map(|w| source.upper(&w[0]));
        return Step::Routine(name.unwrap_or(second));
    }
    if line.len() == 2 && line[0].sort == TokenKind::Word && line[1].is(b':') {
        return Step::Label(word);
    }
    match word.as_str() {
        "END" | "ENDFCT" => Step::EndRoutine,
        "IF" => Step::If,
        "ELSE" => Step::Else,
        "ENDIF" => Step::EndIf,
        "FOR" | "WHILE" => Step::While,
        "LOOP" | "REPEAT" => Step::Loop,
        "ENDFOR" | "ENDWHILE" | "UNTIL" => Step::EndLoop,
        "ENDLOOP" => Step::EndForever,
        "EXIT" => Step::Exit,
        "SWITCH" => Step::Switch,
        "CASE" => Step::Case,
        "DEFAULT" => Step::Default,
        "ENDSWITCH" => Step::EndSwitch,
        "GOTO" => Step::Goto(second),
        "RETURN" => Step::Return,
        _ => Step::Plain,
    }
}

//! Lines of KRL as steps of the order of execution.

use super::super::flow::{FlowLine, FlowStep};
use super::super::token::{ProgramText, Token, TokenKind};

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
    let of = |(line, step): (&&[Token], FlowStep)| FlowLine {
        calls: called(line, &step),
        sets: sets(line),
        step,
    };
    lines.iter().zip(all.clone()).map(of).collect()
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

//! Frames of the system that a program sets, and what calib takes for granted where it does.

use super::super::Gathered;
use super::super::token::{ProgramText, Token};
use super::line::member;
use super::surroundings::SetSurroundings;

/// What a line sets that calib takes for granted.
pub(super) fn set(source: ProgramText, line: &[Token], known: &SetSurroundings, found: &mut Gathered) {
    for (k, token) in line.iter().enumerate() {
        let names = ["$BASE", "$TOOL", "$IPO_MODE", "$ROBROOT"];
        if source.is_word(token, &names) && member(source, &line[k + 1..]).is_some_and(|(_, rest)| rest.is_some()) {
            let name = source.upper(token);
            if !known.applies(&name) {
                found.frame(token.span.start, assumed(&name));
            }
        }
    }
    let calls = line.windows(4).find(|w| source.is_word(&w[0], &["BAS"]) && w[1].is(b'(') && w[2].is(b'#'));
    if let Some(call) = calls.filter(|call| source.is_word(&call[3], &["BASE", "TOOL", "EX_BASE", "FRAMES"])) {
        let name = if source.is_word(&call[3], &["TOOL"]) { "$TOOL" } else { "$BASE" };
        if !known.applies(name) {
            found.frame(call[0].span.start, assumed(name));
        }
    }
}

/// The data of an inline form: which base its point is taught in.
pub(super) fn of_point(source: ProgramText, tokens: &[Token], known: &SetSurroundings, found: &mut Gathered) {
    let base = tokens.windows(2).find(|w| source.is_word(&w[0], &["BASE_NO"]));
    if base.and_then(|w| source.number(&w[1..])).is_some_and(|(number, _)| number != 0.0) && !known.applies("$BASE") {
        found.frame(tokens[0].span.start, assumed("$BASE"));
    }
    if tokens.windows(3).any(|w| source.is_word(&w[0], &["IPO_FRAME"]) && source.is_word(&w[2], &["TCP"])) {
        found.frame(tokens[0].span.start, assumed("$IPO_MODE"));
    }
}

/// What calib takes for granted where a program sets a frame of the system.
pub(super) fn assumed(name: &str) -> String {
    match name {
        "$TOOL" => "sets $TOOL: calib assumed that its frame is the tool of the robot file".into(),
        "$IPO_MODE" => "sets $IPO_MODE: calib assumed that the robot carries the tool (#BASE)".into(),
        name => format!("sets {name}: calib assumed that targets are in the robot's base, $BASE and $ROBROOT at zero"),
    }
}

//! What is in force where a file of KRL moves to its targets.

use super::super::flow::{Flow, FlowStep};
use super::super::literal::InForce;
use super::super::settle::Reached;
use super::super::token::{ProgramText, Token, TokenKind, arguments};
use super::MOTIONS;
use super::line::{declared, step, steps};
use super::system::{SystemData, SystemState};

/// Adds the motions of a file; `file`: how people find it, where it is not the one that is corrected.
pub(super) fn reach(
    source: ProgramText,
    lines: &[&[Token]],
    data: &SystemData,
    file: Option<&str>,
    out: &mut Reached,
) {
    let places = places(source.bytes, lines, file);
    let names: Vec<String> = lines
        .iter()
        .filter_map(|line| {
            if let FlowStep::Routine(name) = step(source, line) {
                Some(name)
            } else {
                None
            }
        })
        .collect();
    let flow = Flow::of(&steps(source, lines, |line| data.sets(source, line)));
    let states = match &flow {
        Ok(flow) => flow.states(&SystemState::START, |at, state| {
            data.take(source, lines[at], &places[at], state)
        }),
        Err(_) => vec![None; lines.len()],
    };
    let lost = match flow {
        Ok(_) => "is not known: no way leads to this line".to_string(),
        Err(at) => format!(
            "is not known: the block of {} does not close where it should",
            places[at]
        ),
    };
    for ((line, state), place) in lines.iter().zip(states).zip(&places) {
        if !is_motion(source, line) {
            mentions(source, line, place, out);
            if let Some(name) = data
                .unknown_call(source, line)
                .filter(|name| !names.contains(name) && file.is_none())
            {
                let message = format!(
                    "calls {name} of a file that was not read: calib assumed that it leaves $BASE, $TOOL and $LOAD as they are"
                );
                out.assumed.push((line[0].span.start, message));
            }
            continue;
        }
        let force = match &state {
            Some(state) => data.at_motion(source, line, place, state),
            None => InForce::open(&lost),
        };
        for operand in operands(source, line) {
            match operand.first() {
                Some(first) if first.sort == TokenKind::Word => {
                    out.named
                        .entry(source.upper(first))
                        .or_default()
                        .push(force.clone());
                }
                Some(first) if first.is(b'{') && file.is_none() => {
                    let last = operand.last().map_or(first.span.end, |last| last.span.end);
                    out.placed.push((first.span.start..last, force.clone()));
                }
                _ => {}
            }
        }
    }
}

fn is_motion(source: ProgramText, line: &[Token]) -> bool {
    let named = MOTIONS
        .iter()
        .any(|(name, _)| source.is_word(&line[0], &[name]));
    named && !line.get(1).is_some_and(|next| next.is(b'='))
}

/// The positions of a motion, and whatever else stands between its commas.
fn operands<'t>(source: ProgramText, line: &'t [Token]) -> impl Iterator<Item = &'t [Token]> {
    let end = line
        .iter()
        .position(|token| source.is_word(token, &["WITH"]))
        .unwrap_or(line.len());
    arguments(&line[1..end])
}

/// Names that a line uses otherwise than as the position of a motion: where what they hold goes is not followed.
fn mentions(source: ProgramText, line: &[Token], place: &str, out: &mut Reached) {
    let head = source.upper(&line[0]);
    // Variables of the system are no targets that a program moves to by their names.
    if declared(source, line).is_some() || head.ends_with("_REL") || head.starts_with('$') {
        return;
    }
    // What is assigned to is none that is used.
    let from = line
        .iter()
        .position(|token| token.is(b'='))
        .map_or(1, |at| at + 1);
    for word in line
        .iter()
        .skip(from)
        .filter(|token| token.sort == TokenKind::Word)
    {
        let force = InForce::open(&format!("is not followed: {place} hands the target on"));
        out.mentioned.entry(source.upper(word)).or_insert(force);
    }
}

/// How people find each line.
fn places(bytes: &[u8], lines: &[&[Token]], file: Option<&str>) -> Vec<String> {
    let (mut number, mut from) = (1, 0);
    let place = |line: &&[Token]| {
        let at = line[0].span.start;
        number += bytes[from..at]
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
        from = at;
        file.map_or_else(
            || format!("line {number}"),
            |file| format!("{file}:{number}"),
        )
    };
    lines.iter().map(place).collect()
}

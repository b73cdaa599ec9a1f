//! What is in force where the files of a program in RAPID move to its targets.

use super::super::force::InForce;
use super::super::settle::{Reached, Words, settle};
use super::super::token::{ProgramText, Token, TokenKind, tokens};
use super::super::{Companion, Gathered, Language};
use super::arguments::arguments;
use super::surroundings::DeclaredSurroundings;
use super::{declaration, motion, statements};
use std::ops::Range;

const WORDS: Words = Words {
    base: "work object",
    tool: "tool",
    no_base: "no work object is named: calib assumed that the target stands in the robot's base",
};

/// Gives targets their frames, tools and loads, by all files of the program. `names`: literals that a variable holds, and its name.
pub(super) fn in_force(
    (source, own): (ProgramText, &[&[Token]]),
    companions: &[Companion],
    names: &[(Range<usize>, String)],
    found: &mut Gathered,
) {
    // What is wrong with the writing of another file is no fault of this one.
    let read =
        |companion: &Companion| tokens(companion.text(Language::Rapid), &mut Gathered::default());
    let others: Vec<Vec<Token>> = companions.iter().map(read).collect();
    let others = companions
        .iter()
        .map(|companion| companion.text(Language::Rapid))
        .zip(&others);
    let others: Vec<(ProgramText, Vec<&[Token]>)> = others
        .map(|(source, tokens)| (source, statements(source, tokens, &mut Gathered::default())))
        .collect();
    let mut surroundings = DeclaredSurroundings::default();
    for (source, statements) in &others {
        surroundings.declare_all(*source, statements);
    }
    surroundings.declare_all(source, own);
    let mut reached = Reached::default();
    for (source, statement) in others
        .iter()
        .flat_map(|(source, statements)| statements.iter().map(move |one| (source, one)))
    {
        reach(*source, statement, &surroundings, false, &mut reached);
    }
    for statement in own {
        reach(source, statement, &surroundings, true, &mut reached);
    }
    let uses = reached.uses(&found.literals, names);
    settle(found, uses, &WORDS);
    found.tools = surroundings.tools().collect();
}

/// Takes note of the targets that a statement moves to, and of those that it hands on.
fn reach(
    source: ProgramText,
    statement: &[Token],
    known: &DeclaredSurroundings,
    is_own: bool,
    out: &mut Reached,
) {
    let name = source.upper(&statement[0]);
    let assigns = statement
        .iter()
        .position(|token| token.sort == TokenKind::Pair(b':'));
    let plain = assigns.is_none_or(|at| {
        statement[..at]
            .iter()
            .any(|token| token.is(b'\\') || token.is(b','))
    });
    if declaration(source, statement).is_some() {
        return;
    }
    if let Some((_, positions)) = motion(&name).filter(|_| plain) {
        known.motion(
            source,
            (&name, &arguments(&statement[1..]), positions),
            is_own,
            out,
        );
        return;
    }
    let from = if plain {
        1
    } else {
        assigns.unwrap_or_default()
    };
    for word in statement
        .iter()
        .skip(from)
        .filter(|token| token.sort == TokenKind::Word)
    {
        let force = InForce::open(&format!("is not followed: `{name}` hands the target on"));
        out.mentioned.entry(source.upper(word)).or_insert(force);
    }
}

//! Tokens of a statement by the depth of their brackets, and the arguments between its commas.

use super::super::token::{Token, TokenKind};

/// Tokens with the depth of brackets at each: the brackets themselves are outside.
pub(super) fn depths(tokens: &[Token]) -> impl Iterator<Item = (&Token, i32)> {
    let mut depth = 0;
    tokens.iter().map(move |token| match token.sort {
        TokenKind::Sign(b'[' | b'(' | b'{') => {
            depth += 1;
            (token, depth - 1)
        }
        TokenKind::Sign(b']' | b')' | b'}') => {
            depth -= 1;
            (token, depth)
        }
        _ => (token, depth),
    })
}

/// Between the commas outside of brackets.
pub(super) fn arguments(tokens: &[Token]) -> Vec<&[Token]> {
    let commas: Vec<usize> = depths(tokens)
        .enumerate()
        .filter(|(_, (token, depth))| *depth == 0 && token.is(b','))
        .map(|(k, _)| k)
        .collect();
    let mut start = 0;
    let mut out = Vec::with_capacity(commas.len() + 1);
    for comma in commas {
        out.push(&tokens[start..comma]);
        start = comma + 1;
    }
    out.push(&tokens[start..]);
    out
}

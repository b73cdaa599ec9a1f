//! Parts of a line of KRL: what it declares, what it sets, which braces belong together.

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
    let rest = &line[skipped..];
    let [kind, first, ..] = rest else { return None };
    let plain = rest
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
    for pair in rest.windows(2) {
        depth += opens(&pair[0]);
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

/// +1 where a bracket opens, -1 where it closes.
pub(super) fn opens(token: &Token) -> i32 {
    match token.sort {
        TokenKind::Sign(b'{' | b'[' | b'(') => 1,
        TokenKind::Sign(b'}' | b']' | b')') => -1,
        _ => 0,
    }
}

/// The place of the brace that closes the one at `open`.
pub(super) fn closing(line: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (k, token) in line.iter().enumerate().skip(open) {
        match token.sort {
            TokenKind::Sign(b'{') => depth += 1,
            TokenKind::Sign(b'}') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return k;
        }
    }
    line.len() - 1
}

/// Behind a name: the last member of `[1].FRAME.X`, and what follows `=`; the second is none where nothing is set.
pub(super) fn member<'t>(
    source: ProgramText,
    rest: &'t [Token],
) -> Option<(Option<String>, Option<&'t [Token]>)> {
    let mut member = None;
    let mut k = 0;
    loop {
        match rest.get(k).map(|token| token.sort) {
            Some(TokenKind::Sign(b'[')) => {
                k += rest[k..].iter().position(|token| token.is(b']'))? + 1
            }
            Some(TokenKind::Sign(b'.')) => {
                member = Some(source.upper(rest.get(k + 1)?));
                k += 2;
            }
            Some(TokenKind::Sign(b'=')) => return Some((member, Some(&rest[k + 1..]))),
            _ => return Some((member, None)),
        }
    }
}

/// The variable that is set where `before` ends in `NAME[1].MEMBER =`: its name, and whether a member of it.
pub(super) fn variable(source: ProgramText, before: &[Token]) -> Option<(String, Option<String>)> {
    let (last, mut rest) = before.split_last()?;
    if !last.is(b'=') {
        return None;
    }
    let mut of = None;
    loop {
        let (last, front) = rest.split_last()?;
        if last.is(b']') {
            let open = front.iter().rposition(|token| token.is(b'['))?;
            rest = &front[..open];
        } else if last.sort == TokenKind::Word {
            if front.last().is_some_and(|token| token.is(b'.')) {
                of = of.or_else(|| Some(source.upper(last)));
                rest = &front[..front.len() - 1];
            } else {
                return Some((source.upper(last), of));
            }
        } else {
            return None;
        }
    }
}

//! The positions by axes that a file declares, by their names.

use super::super::token::{ProgramText, TokenKind, tokens};
use super::super::{Declared, Gathered, Language};
use super::Reader;
use super::aggregate::{Aggregate, Type};
use super::line::{closing, declared, variable};
use std::collections::{BTreeMap, BTreeSet};

pub(in crate::program) fn listed(bytes: &[u8]) -> Declared {
    let mut found = Gathered::default();
    let source = ProgramText {
        bytes,
        language: Language::Krl,
    };
    let tokens = tokens(source, &mut found);
    let mut reader = Reader {
        source,
        types: BTreeMap::new(),
        structures: BTreeSet::new(),
        names: Vec::new(),
        found,
    };
    let (mut names, mut poses) = (Vec::new(), 0);
    for line in tokens
        .split(|token| token.sort == TokenKind::LineEnd)
        .filter(|line| !line.is_empty())
    {
        let declares = declared(source, line).map(|(kind, _)| kind);
        if !line.iter().any(|token| token.is(b'{')) || !reader.braces_match(line) {
            continue;
        }
        let mut k = 0;
        while let Some(open) = line[k..]
            .iter()
            .position(|token| token.is(b'{'))
            .map(|at| k + at)
        {
            let close = closing(line, open);
            k = close + 1;
            let aggregate = Aggregate::new(source, &line[open..k]);
            let kind = aggregate.prefix().or_else(|| declares.clone());
            let (Some(kind), Some((name, None))) = (
                kind.as_deref().and_then(Type::of),
                variable(source, &line[..open]),
            ) else {
                continue;
            };
            if !kind.is_of_axes() {
                poses += 1;
                continue;
            }
            let before = reader.found.literals.len();
            aggregate.take(kind, &mut reader.found);
            names.extend(std::iter::repeat_n(
                name,
                reader.found.literals.len() - before,
            ));
        }
    }
    Declared {
        found: reader.found,
        names,
        poses,
    }
}

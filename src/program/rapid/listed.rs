//! The jointtargets that a program declares, by their names.

use super::super::token::{ProgramText, Token, TokenKind, tokens};
use super::super::{Declared, Gathered, Language};
use super::list::{List, Want};
use super::{Reader, declaration, statements};
use std::collections::BTreeMap;

pub(in crate::program) fn listed(bytes: &[u8]) -> Declared {
    let mut found = Gathered::default();
    let source = ProgramText {
        bytes,
        language: Language::Rapid,
    };
    let tokens = tokens(source, &mut found);
    let statements = statements(source, &tokens, &mut found);
    let mut reader = Reader {
        source,
        types: BTreeMap::new(),
        names: Vec::new(),
        found,
    };
    let (mut names, mut poses) = (Vec::new(), 0);
    for statement in statements {
        let Some((value, kind)) =
            declaration(source, statement).and_then(|own| Some((own.value?, own.kind)))
        else {
            continue;
        };
        if kind == "ROBTARGET" {
            poses += 1;
        }
        if kind != "JOINTTARGET" || !reader.brackets_match(statement) {
            continue;
        }
        let name = name(source, statement);
        if !value.first().is_some_and(|first| first.is(b'[')) {
            let at = value
                .first()
                .map_or(statement[0].span.start, |first| first.span.start);
            reader.found.fault(
                at,
                format!("`{name}` is no list of numbers; expected [[6 joints], [6 external axes]]"),
            );
            continue;
        }
        let list = List::read(source, value);
        if list.tokens < value.len() {
            reader.found.fault(
                value[list.tokens].span.start,
                format!("something behind the list of `{name}`; expected `;`"),
            );
            continue;
        }
        let (before, is_array) = (
            reader.found.literals.len(),
            value.get(2).is_some_and(|token| token.is(b'[')),
        );
        list.take(Want::Joints, is_array, &mut reader.found);
        let count = reader.found.literals.len() - before;
        names.extend((1..=count).map(|k| {
            if is_array {
                format!("{name}{{{k}}}")
            } else {
                name.clone()
            }
        }));
    }
    Declared {
        found: reader.found,
        names,
        poses,
    }
}

/// The name that a declaration gives, as it is written.
fn name(source: ProgramText, statement: &[Token]) -> String {
    // Scope, storage and type are words, too; the name is the last one before a dimension or `:=`.
    let words = statement
        .iter()
        .take_while(|token| token.sort == TokenKind::Word);
    words.last().map_or_else(String::new, |word| {
        String::from_utf8_lossy(&source.bytes[word.span.clone()]).into_owned()
    })
}

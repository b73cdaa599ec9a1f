//! Bracket lists of RAPID: `[[x,y,z],[q1,q2,q3,q4],[cf1,cf4,cf6,cfx],[eax..]]` and `[[rax_1..rax_6],[eax..]]`, and arrays of them.

use super::super::token::{ProgramText, Token};
use super::super::{DEPTH, Gathered, Literal, PostureStatement, TargetKind, quoted};
use crate::error::counted;
use std::ops::Range;

/// deg or mm: the external axis is not connected.
const NOT_CONNECTED: f64 = 9e9;

/// How far from 1 the length of a quaternion may be: four decimals are enough.
pub(super) const UNIT: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Want {
    Joints,
    Pose,
}

impl Want {
    pub(crate) fn name(self) -> &'static str {
        if self == Self::Joints {
            "jointtarget"
        } else {
            "robtarget"
        }
    }

    /// How many numbers each list has.
    fn shape(self) -> &'static [usize] {
        if self == Self::Joints {
            &[6, 6]
        } else {
            &[3, 4, 4, 6]
        }
    }
}

enum Item<'t> {
    List(List<'t>),
    Leaf(&'t [Token]),
}

/// A list that opens at the first of its tokens.
pub(super) struct List<'t> {
    source: ProgramText<'t>,
    span: Range<usize>,
    /// How many it has, brackets included.
    pub(crate) tokens: usize,
    items: Vec<Item<'t>>,
}

impl<'t> List<'t> {
    /// Reads the list that opens at `tokens[0]`; its brackets match. It has no items where they are nested too deep.
    pub fn read(source: ProgramText<'t>, tokens: &'t [Token]) -> Self {
        if depths(tokens).any(|(_, depth)| depth >= DEPTH as i32) {
            return Self {
                source,
                span: source.over(tokens, 0),
                tokens: tokens.len(),
                items: Vec::new(),
            };
        }
        Self::nested(source, tokens)
    }

    fn nested(source: ProgramText<'t>, tokens: &'t [Token]) -> Self {
        let mut items = Vec::new();
        let (mut k, mut from, mut round) = (1, 1, 0);
        let mut inner: Option<List> = None;
        while k < tokens.len() {
            let token = &tokens[k];
            if token.is(b'[') && k == from {
                let list = Self::nested(source, &tokens[k..]);
                k += list.tokens;
                inner = Some(list);
                continue;
            }
            // A list inside an expression, `Offs([..],..)`: a leaf holds it whole.
            if token.is(b'[') {
                k += Self::nested(source, &tokens[k..]).tokens;
                continue;
            }
            round += i32::from(token.is(b'(') || token.is(b'{'))
                - i32::from(token.is(b')') || token.is(b'}'));
            let closes = token.is(b']');
            if closes || (token.is(b',') && round == 0) {
                items.push(match inner.take() {
                    Some(list) if list.tokens == k - from => Item::List(list),
                    _ => Item::Leaf(&tokens[from..k]),
                });
                from = k + 1;
            }
            k += 1;
            if closes {
                break;
            }
        }
        Self {
            source,
            span: source.over(&tokens[..k], 0),
            tokens: k,
            items,
        }
    }

    fn lists(&self) -> impl Iterator<Item = &List<'t>> {
        self.items.iter().filter_map(|item| {
            if let Item::List(list) = item {
                Some(list)
            } else {
                None
            }
        })
    }

    /// The list that is item `k`.
    pub(crate) fn list(&self, k: usize) -> Option<&List<'t>> {
        self.items.get(k).and_then(|item| {
            if let Item::List(list) = item {
                Some(list)
            } else {
                None
            }
        })
    }

    /// The number that is item `k`.
    pub fn number(&self, k: usize) -> Option<f64> {
        let Item::Leaf(tokens) = self.items.get(k)? else {
            return None;
        };
        self.source.number(tokens).map(|(number, _)| number)
    }

    /// Whether item `k` is a word, in any case.
    pub(crate) fn is_word(&self, k: usize, word: &str) -> bool {
        matches!(self.items.get(k), Some(Item::Leaf([token])) if self.source.is_word(token, &[word]))
    }

    /// What it, or a list inside it, has the form of: names may stand for some of its lists.
    pub(crate) fn has_form(&self) -> Option<Want> {
        let form = |want: &Want| {
            let shape = want.shape();
            let fits = |(item, size): (&Item, &usize)| match item {
                Item::List(list) => list.items.len() == *size && list.lists().next().is_none(),
                Item::Leaf(_) => true,
            };
            self.items.len() == shape.len()
                && self.lists().next().is_some()
                && self.items.iter().zip(shape).all(fits)
        };
        // A slip in what follows makes no other thing of it.
        let begins = |want: &Want| {
            let shape = want.shape();
            let used = shape.len() / 2;
            let fits = |(item, size): (&Item, &usize)| matches!(item, Item::List(list) if list.items.len() == *size);
            self.items.len() > used && self.items.iter().zip(&shape[..used]).all(fits)
        };
        let wants = [Want::Joints, Want::Pose];
        wants
            .into_iter()
            .find(|want| form(want) || begins(want))
            .or_else(|| self.lists().find_map(List::has_form))
    }

    /// Takes the targets in it, those of an array where that is allowed, or says everything that is wrong.
    pub(crate) fn take(&self, want: Want, array: bool, found: &mut Gathered) {
        let flat = |item: &Item| match item {
            Item::List(list) => list.lists().next().is_none(),
            Item::Leaf(_) => true,
        };
        if self.items.iter().all(flat) || !array {
            return self.target(want, found);
        }
        for item in &self.items {
            match item {
                Item::List(list) => list.take(want, array, found),
                Item::Leaf(tokens) => {
                    let span = self.source.over(tokens, self.span.start);
                    found.fault(
                        span.start,
                        format!("{} in an array of targets", quoted(self.source.bytes, span)),
                    );
                }
            }
        }
    }

    fn target(&self, want: Want, found: &mut Gathered) {
        let before = found.faults.len();
        let shape = want.shape();
        let mut numbers: Vec<Vec<(f64, Range<usize>)>> = Vec::new();
        for (item, size) in self.items.iter().zip(shape) {
            match item {
                Item::List(list) if list.items.len() == *size => numbers.push(list.numbers(found)),
                Item::List(list) => {
                    let message = format!(
                        "{}, expected {size} here in a {}",
                        counted(list.items.len(), "number"),
                        want.name()
                    );
                    found.fault(list.span.start, message);
                }
                Item::Leaf(tokens) => {
                    let span = self.source.over(tokens, self.span.start);
                    let text = quoted(self.source.bytes, span.clone());
                    found.fault(
                        span.start,
                        format!(
                            "{text} in a {}, expected a list of {size} numbers",
                            want.name()
                        ),
                    );
                }
            }
        }
        if self.items.len() != shape.len() {
            let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
            let message = format!(
                "expected a {}: lists of {} numbers",
                want.name(),
                sizes.join(", ")
            );
            found.fault(self.span.start, message);
        }
        if found.faults.len() > before {
            return;
        }
        for (value, span) in numbers
            .last()
            .into_iter()
            .flatten()
            .filter(|(value, _)| *value != NOT_CONNECTED)
        {
            let message = format!(
                "external axis at {value}: calib assumed that external axes do not move the robot"
            );
            found.warn(span.start, message);
        }
        let axis = |(value, _): &(f64, _)| (*value != NOT_CONNECTED).then_some(*value);
        let external = numbers.last().into_iter().flatten().map(axis).collect();
        let posture = if want == Want::Pose {
            configuration(&numbers[2], found)
        } else {
            PostureStatement::Unstated
        };
        let posture_spans = match posture {
            PostureStatement::Unstated => Vec::new(),
            _ => numbers[2].iter().map(|(_, span)| span.clone()).collect(),
        };
        let used = if want == Want::Joints { 1 } else { 2 };
        let (values, spans): (Vec<f64>, Vec<Range<usize>>) =
            numbers.into_iter().take(used).flatten().unzip();
        if want == Want::Pose {
            let length = values[3..]
                .iter()
                .map(|part| part * part)
                .sum::<f64>()
                .sqrt();
            if (length - 1.0).abs() > UNIT {
                found.fault(
                    spans[3].start,
                    format!("the quaternion has length {length:.4}, expected 1"),
                );
                return;
            }
        }
        let kind = if want == Want::Joints {
            TargetKind::Joints
        } else {
            TargetKind::Quaternion
        };
        found.literals.push(Literal::read(
            kind,
            (values, spans),
            external,
            (posture, posture_spans),
        ));
    }

    fn numbers(&self, found: &mut Gathered) -> Vec<(f64, Range<usize>)> {
        let mut out = Vec::new();
        for item in &self.items {
            let (tokens, at) = match item {
                Item::Leaf(tokens) => (*tokens, self.span.start),
                Item::List(list) => {
                    found.fault(list.span.start, "a list, expected a number");
                    continue;
                }
            };
            match self.source.number(tokens) {
                Some(number) => out.push(number),
                None if tokens.is_empty() => found.fault(at, "a number is missing in this list"),
                None => {
                    let span = self.source.over(tokens, at);
                    found.fault(
                        span.start,
                        format!("{} is no number", quoted(self.source.bytes, span)),
                    );
                }
            }
        }
        out
    }
}

/// `[cf1,cf4,cf6,cfx]`: whole quarter turns, and one of eight configurations.
fn configuration(numbers: &[(f64, Range<usize>)], found: &mut Gathered) -> PostureStatement {
    const LARGEST: f64 = 100.0;
    let mut all = [0; 4];
    if numbers.iter().any(|(value, _)| *value == NOT_CONNECTED) {
        return PostureStatement::Unstated;
    }
    for (k, (number, (value, span))) in all.iter_mut().zip(numbers).enumerate() {
        let fault = match k {
            3 if value.fract() != 0.0 || !(0.0..8.0).contains(value) => {
                "no configuration cfx, expected a whole number from 0 to 7"
            }
            _ if value.fract() != 0.0 || value.abs() > LARGEST => {
                "no quadrant of a joint, expected a whole number"
            }
            _ => {
                *number = *value as i32;
                continue;
            }
        };
        found.fault(span.start, format!("{value} is {fault}"));
        return PostureStatement::Unstated;
    }
    PostureStatement::Configuration(all)
}

/// Tokens with the depth of brackets at each: the brackets themselves are outside.
pub(super) fn depths(tokens: &[Token]) -> impl Iterator<Item = (&Token, i32)> {
    let mut depth = 0;
    tokens.iter().map(move |token| {
        let opens = token.opens();
        depth += opens;
        (token, depth - opens.max(0))
    })
}

//! Bracket lists of RAPID: `[[x,y,z],[q1,q2,q3,q4],[cf1,cf4,cf6,cfx],[eax..]]` and `[[rax_1..rax_6],[eax..]]`, and arrays of them.

use super::super::token::{Token, number, over, quoted};
use super::super::{DEPTH, Gathered, Literal, PostureStatement, TargetKind};
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
    pub fn name(self) -> &'static str {
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

enum Item<'t, 'p> {
    List(List<'t, 'p>),
    Leaf(&'t [Token<'p>]),
}

impl<'t, 'p> Item<'t, 'p> {
    fn list(&self) -> Option<&List<'t, 'p>> {
        match self {
            Self::List(list) => Some(list),
            Self::Leaf(_) => None,
        }
    }
}

/// A list that opens at the first of its tokens.
pub(super) struct List<'t, 'p> {
    span: Range<usize>,
    /// How many it has, brackets included.
    pub tokens: usize,
    items: Vec<Item<'t, 'p>>,
}

impl<'t, 'p> List<'t, 'p> {
    /// Reads the list that opens at `tokens[0]`; its brackets match. It has no items where they are nested too deep.
    pub fn read(tokens: &'t [Token<'p>]) -> Self {
        if depths(tokens).any(|(_, depth)| depth >= DEPTH as i32) {
            return Self {
                span: over(tokens, 0),
                tokens: tokens.len(),
                items: Vec::new(),
            };
        }
        Self::nested(tokens)
    }

    fn nested(tokens: &'t [Token<'p>]) -> Self {
        let mut items = Vec::new();
        let (mut k, mut from, mut round) = (1, 1, 0);
        let mut inner: Option<List> = None;
        while k < tokens.len() {
            let token = &tokens[k];
            if token.is(b'[') {
                let list = Self::nested(&tokens[k..]);
                let begins = k == from;
                k += list.tokens;
                // A list inside an expression, `Offs([..],..)`: a leaf holds it whole.
                if begins {
                    inner = Some(list);
                }
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
            span: over(&tokens[..k], 0),
            tokens: k,
            items,
        }
    }

    fn lists(&self) -> impl Iterator<Item = &List<'t, 'p>> {
        self.items.iter().filter_map(Item::list)
    }

    fn is_flat(&self) -> bool {
        self.lists().next().is_none()
    }

    /// The list that is item `k`.
    pub fn list(&self, k: usize) -> Option<&List<'t, 'p>> {
        self.items.get(k)?.list()
    }

    /// The number that is item `k`.
    pub fn number(&self, k: usize) -> Option<f64> {
        match self.items.get(k)? {
            Item::Leaf(tokens) => number(tokens).map(|(number, _)| number),
            Item::List(_) => None,
        }
    }

    /// Whether item `k` is a word, in any case.
    pub fn is_word(&self, k: usize, word: &str) -> bool {
        matches!(self.items.get(k), Some(Item::Leaf([token])) if token.is_word(word))
    }

    /// What it, or a list inside it, has the form of: names may stand for some of its lists.
    pub fn has_form(&self) -> Option<Want> {
        let form = |want: &Want| {
            let fits = |(item, size): (&Item, &usize)| {
                let of_size = |list: &List| list.items.len() == *size && list.is_flat();
                item.list().is_none_or(of_size)
            };
            self.items.len() == want.shape().len()
                && !self.is_flat()
                && self.items.iter().zip(want.shape()).all(fits)
        };
        // A slip in what follows makes no other thing of it.
        let begins = |want: &Want| {
            let used = &want.shape()[..want.shape().len() / 2];
            let fits = |(item, size): (&Item, &usize)| {
                item.list().is_some_and(|list| list.items.len() == *size)
            };
            self.items.len() > used.len() && self.items.iter().zip(used).all(fits)
        };
        let mut wants = [Want::Joints, Want::Pose].into_iter();
        let found = wants.find(|want| form(want) || begins(want));
        found.or_else(|| self.lists().find_map(List::has_form))
    }

    /// Takes the targets in it, those of an array where that is allowed, or says everything that is wrong.
    pub fn take(&self, want: Want, array: bool, found: &mut Gathered) {
        if !array || self.lists().all(List::is_flat) {
            return self.target(want, found);
        }
        for item in &self.items {
            match item {
                Item::List(list) => list.take(want, array, found),
                Item::Leaf(tokens) => {
                    let message = format!("{} in an array of targets", quoted(tokens));
                    found.fault(over(tokens, self.span.start).start, message);
                }
            }
        }
    }

    fn target(&self, want: Want, found: &mut Gathered) {
        let before = found.faults.len();
        let (shape, name) = (want.shape(), want.name());
        let mut numbers: Vec<Vec<(f64, Range<usize>)>> = Vec::new();
        for (item, size) in self.items.iter().zip(shape) {
            match item {
                Item::List(list) if list.items.len() == *size => numbers.push(list.numbers(found)),
                Item::List(list) => {
                    let given = counted(list.items.len(), "number");
                    let message = format!("{given}, expected {size} here in a {name}");
                    found.fault(list.span.start, message);
                }
                Item::Leaf(tokens) => {
                    let text = quoted(tokens);
                    let message = format!("{text} in a {name}, expected a list of {size} numbers");
                    found.fault(over(tokens, self.span.start).start, message);
                }
            }
        }
        if self.items.len() != shape.len() {
            let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
            let sizes = sizes.join(", ");
            let message = format!("expected a {name}: lists of {sizes} numbers");
            found.fault(self.span.start, message);
        }
        if found.faults.len() > before {
            return;
        }
        let axes = numbers.pop().unwrap_or_default();
        for (value, span) in axes.iter().filter(|(value, _)| *value != NOT_CONNECTED) {
            let message = format!(
                "external axis at {value}: calib assumed that external axes do not move the robot"
            );
            found.warn(span.start, message);
        }
        let axis = |(value, _): &(f64, _)| (*value != NOT_CONNECTED).then_some(*value);
        let external = axes.iter().map(axis).collect();
        let (posture, kind) = match want {
            Want::Joints => (PostureStatement::Unstated, TargetKind::Joints),
            Want::Pose => (configuration(&numbers[2], found), TargetKind::Quaternion),
        };
        let posture_spans = match posture {
            PostureStatement::Unstated => Vec::new(),
            _ => numbers[2].iter().map(|(_, span)| span.clone()).collect(),
        };
        let used = numbers.into_iter().take(2).flatten();
        let (values, spans): (Vec<f64>, Vec<Range<usize>>) = used.unzip();
        if want == Want::Pose {
            let square: f64 = values[3..].iter().map(|part| part * part).sum();
            let length = square.sqrt();
            if (length - 1.0).abs() > UNIT {
                let message = format!("the quaternion has length {length:.4}, expected 1");
                return found.fault(spans[3].start, message);
            }
        }
        let posture = (posture, posture_spans);
        let literal = Literal::read(kind, (values, spans), external, posture);
        found.literals.push(literal);
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
            match number(tokens) {
                Some(number) => out.push(number),
                None if tokens.is_empty() => found.fault(at, "a number is missing in this list"),
                None => found.fault(tokens[0].start, format!("{} is no number", quoted(tokens))),
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
pub(super) fn depths<'t, 'p>(
    tokens: &'t [Token<'p>],
) -> impl Iterator<Item = (&'t Token<'p>, i32)> {
    let mut depth = 0;
    tokens.iter().map(move |token| {
        let opens = token.opens();
        depth += opens;
        (token, depth - opens.max(0))
    })
}

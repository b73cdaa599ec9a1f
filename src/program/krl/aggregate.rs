//! `{[TYPE:] NAME value, ...}`: the fields of a target, each known, named once, and one number.

use super::super::token::{Token, TokenKind, arguments, number, over, quoted};
use super::super::{Gathered, Literal, PostureStatement, TargetKind};
use std::ops::Range;

pub(super) const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
pub(super) const FRAME: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
const EXTERNALS: [&str; 6] = ["E1", "E2", "E3", "E4", "E5", "E6"];
const STATUS: [&str; 2] = ["S", "T"];
/// Bit of S.
const ACCURATE: u32 = 16;

/// A type of targets, by its fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Type {
    axes: bool,
    externals: usize,
    status: bool,
}

impl Type {
    pub const FRAME: Self = Self {
        axes: false,
        externals: 0,
        status: false,
    };

    /// By name, in capitals; none for types of no target.
    pub fn of(name: &str) -> Option<Self> {
        let (axes, externals) = match name {
            "POS" => (false, 0),
            "E3POS" => (false, 3),
            "E6POS" => (false, 6),
            "AXIS" => (true, 0),
            "E3AXIS" => (true, 3),
            "E6AXIS" => (true, 6),
            _ => return None,
        };
        Some(Self {
            axes,
            externals,
            status: !axes,
        })
    }

    pub fn is_of_axes(self) -> bool {
        self.axes
    }

    fn coordinates(self) -> [&'static str; 6] {
        if self.axes { AXES } else { FRAME }
    }

    /// Names of its fields.
    fn fields(self) -> Vec<&'static str> {
        let status = if self.status { &STATUS[..] } else { &[] };
        [&self.coordinates(), status, &EXTERNALS[..self.externals]].concat()
    }
}

/// The tokens of an aggregate, braces included.
pub(super) struct Aggregate<'t, 'p> {
    tokens: &'t [Token<'p>],
    /// The type before the colon, in capitals.
    pub(super) prefix: Option<String>,
    /// Between the commas.
    fields: Vec<&'t [Token<'p>]>,
}

/// The name of a field, its number and where that stands.
type Field = (String, f64, Range<usize>);

impl<'t, 'p> Aggregate<'t, 'p> {
    pub fn new(tokens: &'t [Token<'p>]) -> Self {
        let mut inner = &tokens[1..tokens.len() - 1];
        let mut prefix = None;
        if let [name, colon, tail @ ..] = inner
            && name.sort == TokenKind::Word
            && colon.is(b':')
        {
            (prefix, inner) = (Some(name.upper()), tail);
        }
        let fields = arguments(inner).collect();
        Self {
            tokens,
            prefix,
            fields,
        }
    }

    /// Names of the fields that have one, in capitals.
    fn names(&self) -> impl Iterator<Item = String> {
        let firsts = self.fields.iter().filter_map(|field| field.first());
        let words = firsts.filter(|token| token.sort == TokenKind::Word);
        words.map(Token::upper)
    }

    fn has_axes(&self) -> bool {
        self.names().any(|name| AXES.contains(&name.as_str()))
    }

    /// What it is as operand of a motion.
    pub fn by_fields(&self) -> Type {
        let axes = self.has_axes();
        Type {
            axes,
            externals: 6,
            status: !axes,
        }
    }

    /// X, Y, Z, A, B, C and nothing else: a FRAME as much as a POS.
    pub fn is_frame(&self) -> bool {
        let names: Vec<String> = self.names().collect();
        names.iter().any(|name| name == "X")
            && names.iter().all(|name| FRAME.contains(&name.as_str()))
    }

    /// Whether its fields are those of a target.
    pub fn may_be_target(&self) -> bool {
        let names: Vec<String> = self.names().collect();
        let is_of = |sets: &[&[&str]], name: &String| sets.concat().contains(&name.as_str());
        let all = |sets: &[&[&str]]| names.iter().all(|name| is_of(sets, name));
        names.iter().any(|name| is_of(&[&AXES, &FRAME[..3]], name))
            || !names.is_empty() && all(&[&FRAME, &STATUS, &EXTERNALS])
    }

    /// The number of a field, in capitals, where it is one.
    pub fn number(&self, name: &str) -> Option<f64> {
        let is = |field: &&&[Token]| field.first().is_some_and(|first| first.is_word(name));
        number(&self.fields.iter().find(is)?[1..]).map(|(number, _)| number)
    }

    /// How its type is stated.
    pub fn advice(&self) -> &'static str {
        if self.has_axes() {
            "`{E6AXIS: ...}`"
        } else {
            "`{E6POS: ...}` for a target, `{FRAME: ...}` for a frame, which stays as it is"
        }
    }

    /// Takes it as a target of type `kind`, or says everything that is wrong with it.
    pub fn take(&self, kind: Type, found: &mut Gathered) {
        let before = found.faults.len();
        let mut numbers: Vec<Field> = Vec::new();
        let mut at = self.tokens[0].end;
        for field in &self.fields {
            let Some(first) = field.first() else {
                found.fault(at, "a field is empty");
                continue;
            };
            at = field.last().map_or(at, |token| token.end);
            if let Some(number) = read(kind, field, found) {
                if numbers.iter().any(|(name, ..)| *name == number.0) {
                    found.fault(first.start, format!("{} is given twice", number.0));
                }
                numbers.push(number);
            }
        }
        if found.faults.len() > before {
            return;
        }
        let given = |name: &str| {
            let of_name = numbers.iter().find(|(given, ..)| given == name);
            of_name.map(|(_, value, span)| (*value, span.clone()))
        };
        for (name, value, span) in &numbers {
            if EXTERNALS.contains(&name.as_str()) && *value != 0.0 {
                let message = format!(
                    "{name} is {value}: calib assumed that external axes stand at 0 and do not move the robot"
                );
                found.warn(span.start, message);
            }
        }
        let names = kind.coordinates();
        let missing: Vec<&str> = names
            .into_iter()
            .filter(|name| given(name).is_none())
            .collect();
        if !missing.is_empty() {
            let missing = missing.join(", ");
            let message =
                format!("the target has no {missing}; a target is corrected whole or not at all");
            return found.partial(self.tokens[0].start, message);
        }
        let numbers = names.into_iter().filter_map(given).unzip();
        let external = EXTERNALS.map(|name| given(name).map(|(value, _)| value));
        let [status, turn] = STATUS.map(given);
        let bits = |stated: &Option<(f64, Range<usize>)>| stated.as_ref().map(|(x, _)| *x as u32);
        let posture = match [bits(&status), bits(&turn)] {
            [None, None] => PostureStatement::Unstated,
            [status, turn] => PostureStatement::StatusTurn { status, turn },
        };
        if let Some((value, span)) = &status
            && *value as u32 & ACCURATE != 0
        {
            let message = "S says that the point was taught at an absolutely accurate robot: calib assumed that the controller's own model of the robot's errors is off";
            found.warn(span.start, message);
        }
        let spans = [status, turn].into_iter().flatten();
        let posture = (posture, spans.map(|(_, span)| span).collect());
        let kind = if kind.axes {
            TargetKind::Joints
        } else {
            TargetKind::Frame
        };
        let literal = Literal::read(kind, numbers, external.to_vec(), posture);
        found.literals.push(literal);
    }
}

/// A field of a target; status and turn may be bit patterns.
fn read(kind: Type, field: &[Token], found: &mut Gathered) -> Option<Field> {
    let (first, value) = field.split_first()?;
    if first.sort != TokenKind::Word {
        found.fault(first.start, format!("{} has no name", quoted(field)));
        return None;
    }
    let (name, known) = (first.upper(), kind.fields());
    if !known.contains(&name.as_str()) {
        let (given, allowed) = (first.quoted(), known.join(", "));
        let message = format!("unknown field {given} (allowed: {allowed})");
        found.fault(first.start, message);
        return None;
    }
    let bits = STATUS.contains(&name.as_str());
    let pattern = || if bits { pattern(value) } else { None };
    let fits = |number: f64| !bits || (number.fract() == 0.0 && number >= 0.0);
    if let Some((number, span)) = number(value).or_else(pattern)
        && fits(number)
    {
        return Some((name, number, span));
    }
    let message = if value.is_empty() {
        format!("{name} has no number")
    } else {
        let expected = if bits {
            "a whole number or a bit pattern"
        } else {
            "a number"
        };
        format!("{name} is {}, expected {expected}", quoted(value))
    };
    found.fault(over(value, first.end).start, message);
    None
}

/// `'B101010'`, `'H2A'`: the number that it is.
fn pattern(value: &[Token]) -> Option<(f64, Range<usize>)> {
    let [only] = value else { return None };
    let text = std::str::from_utf8(only.text()).ok()?;
    let inner = text.strip_prefix('\'')?.strip_suffix('\'')?;
    let (base, digits) = inner.split_at_checked(1)?;
    let radix = match base {
        "B" | "b" => 2,
        "H" | "h" => 16,
        _ => return None,
    };
    let number = u32::from_str_radix(digits, radix).ok()?;
    Some((f64::from(number), only.span()))
}

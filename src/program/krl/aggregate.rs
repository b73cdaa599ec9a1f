//! `{[TYPE:] NAME value, ...}`: the fields of a target, each known, named once, and one number.

use super::super::token::{ProgramText, Token, TokenKind, arguments};
use super::super::{Gathered, Literal, PostureStatement, TargetKind, quoted};
use std::ops::Range;

const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
const FRAME: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
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
    pub(crate) const FRAME: Self = Self {
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

    pub(crate) fn is_of_axes(self) -> bool {
        self.axes
    }

    fn coordinates(self) -> [&'static str; 6] {
        if self.axes { AXES } else { FRAME }
    }

    fn others(self) -> impl Iterator<Item = &'static str> {
        STATUS
            .into_iter()
            .filter(move |_| self.status)
            .chain(EXTERNALS.into_iter().take(self.externals))
    }
}

/// The tokens of an aggregate, braces included.
pub(super) struct Aggregate<'t> {
    source: ProgramText<'t>,
    tokens: &'t [Token],
    prefix: Option<String>,
    /// Between the commas.
    fields: Vec<&'t [Token]>,
}

impl<'t> Aggregate<'t> {
    pub(crate) fn new(source: ProgramText<'t>, tokens: &'t [Token]) -> Self {
        let mut inner = &tokens[1..tokens.len() - 1];
        let mut prefix = None;
        if let [name, colon, tail @ ..] = inner
            && name.sort == TokenKind::Word
            && colon.is(b':')
        {
            (prefix, inner) = (Some(source.upper(name)), tail);
        }
        let fields = arguments(inner).collect();
        Self {
            source,
            tokens,
            prefix,
            fields,
        }
    }

    /// The type before the colon, in capitals.
    pub(crate) fn prefix(&self) -> Option<String> {
        self.prefix.clone()
    }

    /// Names of the fields that have one, in capitals.
    fn names(&self) -> impl Iterator<Item = String> {
        self.fields
            .iter()
            .filter_map(|field| field.first())
            .filter(|token| token.sort == TokenKind::Word)
            .map(|token| self.source.upper(token))
    }

    fn has_axes(&self) -> bool {
        self.names().any(|name| AXES.contains(&name.as_str()))
    }

    /// What it is as operand of a motion.
    pub(crate) fn by_fields(&self) -> Type {
        let axes = self.has_axes();
        Type {
            axes,
            externals: 6,
            status: !axes,
        }
    }

    /// X, Y, Z, A, B, C and nothing else: a FRAME as much as a POS.
    pub(crate) fn is_frame(&self) -> bool {
        let names: Vec<String> = self.names().collect();
        names.iter().any(|name| name == "X")
            && names.iter().all(|name| FRAME.contains(&name.as_str()))
    }

    /// Whether its fields are those of a target.
    pub(crate) fn may_be_target(&self) -> bool {
        let names: Vec<String> = self.names().collect();
        let is_of =
            |sets: &[&[&str]], name: &String| sets.iter().any(|set| set.contains(&name.as_str()));
        names.iter().any(|name| is_of(&[&AXES, &FRAME[..3]], name))
            || (!names.is_empty()
                && names
                    .iter()
                    .all(|name| is_of(&[&FRAME, &STATUS, &EXTERNALS], name)))
    }

    /// The number of a field, in capitals, where it is one.
    pub fn number(&self, name: &str) -> Option<f64> {
        let field = self.fields.iter().find(|field| {
            field
                .first()
                .is_some_and(|first| self.source.is_word(first, &[name]))
        })?;
        self.source.number(&field[1..]).map(|(number, _)| number)
    }

    /// How its type is stated.
    pub(crate) fn advice(&self) -> &'static str {
        if self.has_axes() {
            "`{E6AXIS: ...}`"
        } else {
            "`{E6POS: ...}` for a target, `{FRAME: ...}` for a frame, which stays as it is"
        }
    }

    /// The bytes of a field's value.
    fn value(&self, field: &[Token]) -> Range<usize> {
        self.source.over(&field[1..], field[0].span.end)
    }

    /// Takes it as a target of type `kind`, or says everything that is wrong with it.
    pub(crate) fn take(&self, kind: Type, found: &mut Gathered) {
        let open = self.tokens[0].span.start;
        let before = found.faults.len();
        let mut numbers: Vec<(String, f64, Range<usize>)> = Vec::new();
        let mut at = self.tokens[0].span.end;
        for field in &self.fields {
            let Some(first) = field.first() else {
                found.fault(at, "a field is empty");
                continue;
            };
            at = field.last().map_or(at, |token| token.span.end);
            if let Some(number) = self.field(kind, field, first, found) {
                if numbers.iter().any(|(name, ..)| *name == number.0) {
                    found.fault(first.span.start, format!("{} is given twice", number.0));
                }
                numbers.push(number);
            }
        }
        if found.faults.len() > before {
            return;
        }
        let given = |name: &str| numbers.iter().find(|(given, ..)| given == name);
        for (name, value, span) in numbers
            .iter()
            .filter(|(name, value, _)| EXTERNALS.contains(&name.as_str()) && *value != 0.0)
        {
            let message = format!(
                "{name} is {value}: calib assumed that external axes stand at 0 and do not move the robot"
            );
            found.warn(span.start, message);
        }
        let names = kind.coordinates();
        let missing: Vec<&str> = names
            .into_iter()
            .filter(|name| given(name).is_none())
            .collect();
        if !missing.is_empty() {
            found.partial(
                open,
                format!(
                    "the target has no {}; a target is corrected whole or not at all",
                    missing.join(", ")
                ),
            );
            return;
        }
        let (values, spans) = names
            .into_iter()
            .filter_map(given)
            .map(|(_, value, span)| (*value, span.clone()))
            .unzip();
        let external = EXTERNALS
            .into_iter()
            .map(|name| given(name).map(|(_, value, _)| *value))
            .collect();
        let kind = if kind.axes {
            TargetKind::Joints
        } else {
            TargetKind::Frame
        };
        let [status, turn] =
            STATUS.map(|name| given(name).map(|(_, value, span)| (*value as u32, span)));
        if let Some((_, span)) = status.filter(|(status, _)| status & ACCURATE != 0) {
            let message = "S says that the point was taught at an absolutely accurate robot: calib assumed that the controller's own model of the robot's errors is off";
            found.warn(span.start, message);
        }
        let posture_spans: Vec<Range<usize>> = [&status, &turn]
            .into_iter()
            .flatten()
            .map(|(_, span)| (*span).clone())
            .collect();
        let posture = match [status, turn].map(|stated| stated.map(|(bits, _)| bits)) {
            [None, None] => PostureStatement::Unstated,
            [status, turn] => PostureStatement::StatusTurn { status, turn },
        };
        found.literals.push(Literal::read(
            kind,
            (values, spans),
            external,
            (posture, posture_spans),
        ));
    }

    /// Name and number of a field; status and turn may be bit patterns.
    fn field(
        &self,
        kind: Type,
        field: &[Token],
        first: &Token,
        found: &mut Gathered,
    ) -> Option<(String, f64, Range<usize>)> {
        let bytes = self.source.bytes;
        if first.sort != TokenKind::Word {
            found.fault(
                first.span.start,
                format!("{} has no name", quoted(bytes, self.source.over(field, 0))),
            );
            return None;
        }
        let name = self.source.upper(first);
        if !kind
            .coordinates()
            .into_iter()
            .chain(kind.others())
            .any(|known| known == name)
        {
            let allowed: Vec<&str> = kind
                .coordinates()
                .into_iter()
                .chain(kind.others())
                .collect();
            let given = quoted(bytes, first.span.clone());
            found.fault(
                first.span.start,
                format!("unknown field {given} (allowed: {})", allowed.join(", ")),
            );
            return None;
        }
        let value = &field[1..];
        let bits = STATUS.contains(&name.as_str());
        let number = self
            .source
            .number(value)
            .or_else(|| if bits { pattern(bytes, value) } else { None });
        if let Some((number, span)) =
            number.filter(|(number, _)| !bits || (number.fract() == 0.0 && *number >= 0.0))
        {
            return Some((name, number, span));
        }
        let span = self.value(field);
        let message = if value.is_empty() {
            format!("{name} has no number")
        } else {
            let expected = if bits {
                "a whole number or a bit pattern"
            } else {
                "a number"
            };
            format!(
                "{name} is {}, expected {expected}",
                quoted(bytes, span.clone())
            )
        };
        found.fault(span.start, message);
        None
    }
}

/// `'B101010'`, `'H2A'`: the number that it is.
fn pattern(bytes: &[u8], value: &[Token]) -> Option<(f64, Range<usize>)> {
    let [only] = value else { return None };
    let text = std::str::from_utf8(&bytes[only.span.clone()]).ok()?;
    let inner = text.strip_prefix('\'')?.strip_suffix('\'')?;
    let (base, digits) = inner.split_at_checked(1)?;
    let radix = match base {
        "B" | "b" => 2,
        "H" | "h" => 16,
        _ => return None,
    };
    u32::from_str_radix(digits, radix)
        .ok()
        .map(|number| (f64::from(number), only.span.clone()))
}

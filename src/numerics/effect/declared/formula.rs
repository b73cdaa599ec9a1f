//! Formulas of declared effects: small trees of numbers, shape numbers and what a row offers.
//!
//! Small on purpose: a search for closed forms builds and prices such trees, and `libm` gives the same bits on every machine.

use super::quantity::RowQuantity;
use std::fmt;

/// A formula; shape numbers stand by their position.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Formula {
    Number(f64),
    Shape(usize),
    Row(RowQuantity),
    Call(Function, Box<Formula>),
    Join(Operator, Box<Formula>, Box<Formula>),
}

/// Functions of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Function {
    Minus,
    Sin,
    Cos,
    Tan,
    Atan,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    Abs,
    /// -1, 0 or 1.
    Sign,
    /// 1 above zero, else 0.
    Step,
}

impl Function {
    /// All that have a name.
    pub(crate) const NAMED: [(&'static str, Self); 11] = [
        ("sin", Self::Sin),
        ("cos", Self::Cos),
        ("tan", Self::Tan),
        ("atan", Self::Atan),
        ("tanh", Self::Tanh),
        ("exp", Self::Exp),
        ("ln", Self::Ln),
        ("sqrt", Self::Sqrt),
        ("abs", Self::Abs),
        ("sign", Self::Sign),
        ("step", Self::Step),
    ];

    fn name(self) -> &'static str {
        Self::NAMED
            .iter()
            .find(|(_, function)| *function == self)
            .map_or("-", |(name, _)| name)
    }

    fn value(self, x: f64) -> f64 {
        match self {
            Self::Minus => -x,
            Self::Sin => libm::sin(x),
            Self::Cos => libm::cos(x),
            Self::Tan => libm::tan(x),
            Self::Atan => libm::atan(x),
            Self::Tanh => libm::tanh(x),
            Self::Exp => libm::exp(x),
            Self::Ln => libm::log(x),
            Self::Sqrt => libm::sqrt(x),
            Self::Abs => x.abs(),
            Self::Sign if x == 0.0 => 0.0,
            Self::Sign => x.signum(),
            Self::Step => f64::from(x > 0.0),
        }
    }
}

/// What joins two formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operator {
    Plus,
    Less,
    Times,
    Over,
    Power,
}

impl Operator {
    fn sign(self) -> &'static str {
        match self {
            Self::Plus => " + ",
            Self::Less => " - ",
            Self::Times => " * ",
            Self::Over => " / ",
            Self::Power => "^",
        }
    }

    /// The higher, the closer it binds.
    fn rank(self) -> u8 {
        match self {
            Self::Plus | Self::Less => 1,
            Self::Times | Self::Over => 2,
            Self::Power => 4,
        }
    }

    fn value(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Plus => a + b,
            Self::Less => a - b,
            Self::Times => a * b,
            Self::Over => a / b,
            Self::Power => libm::pow(a, b),
        }
    }
}

/// Rank of a sign in front: binds closer than products, not than powers.
const MINUS: u8 = 3;

impl Formula {
    pub(crate) fn call(function: Function, of: Self) -> Self {
        Self::Call(function, Box::new(of))
    }

    pub(crate) fn join(operator: Operator, a: Self, b: Self) -> Self {
        Self::Join(operator, Box::new(a), Box::new(b))
    }

    /// The value with these shape numbers; `None` where the row lacks what it asks for.
    pub fn value(&self, shape: &[f64], row: &dyn Fn(&RowQuantity) -> Option<f64>) -> Option<f64> {
        Some(match self {
            Self::Number(number) => *number,
            Self::Shape(k) => *shape.get(*k)?,
            Self::Row(quantity) => row(quantity)?,
            Self::Call(function, of) => function.value(of.value(shape, row)?),
            Self::Join(operator, a, b) => {
                operator.value(a.value(shape, row)?, b.value(shape, row)?)
            }
        })
    }

    /// Calls `visit` with every part, this one first.
    pub fn walk(&self, visit: &mut dyn FnMut(&Formula)) {
        visit(self);
        match self {
            Self::Call(_, of) => of.walk(visit),
            Self::Join(_, a, b) => {
                a.walk(visit);
                b.walk(visit);
            }
            _ => (),
        }
    }

    /// How many parts it has.
    pub(crate) fn parts(&self) -> usize {
        let mut count = 0;
        self.walk(&mut |_| count += 1);
        count
    }

    /// What it asks of a row, each once.
    pub(crate) fn quantities(&self) -> Vec<RowQuantity> {
        let mut out = Vec::new();
        self.walk(&mut |part| match part {
            Self::Row(quantity) if !out.contains(quantity) => out.push(*quantity),
            _ => (),
        });
        out
    }

    /// Its text, with these names of the shape numbers.
    pub fn text(&self, shape: &[String]) -> String {
        Written {
            formula: self,
            shape,
        }
        .to_string()
    }

    fn rank(&self) -> u8 {
        match self {
            Self::Join(operator, ..) => operator.rank(),
            Self::Call(Function::Minus, _) => MINUS,
            Self::Number(number) if *number < 0.0 => MINUS,
            _ => u8::MAX,
        }
    }
}

/// A formula with the names of its shape numbers.
struct Written<'a> {
    formula: &'a Formula,
    shape: &'a [String],
}

impl Written<'_> {
    fn part(&self, formula: &Formula, least: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = Written {
            formula,
            shape: self.shape,
        };
        if formula.rank() < least {
            write!(f, "({part})")
        } else {
            write!(f, "{part}")
        }
    }
}

impl fmt::Display for Written<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.formula {
            Formula::Number(number) => write!(f, "{number}"),
            Formula::Shape(k) => f.write_str(self.shape.get(*k).map_or("?", String::as_str)),
            Formula::Row(quantity) => f.write_str(&quantity.text(self.shape)),
            Formula::Call(Function::Minus, of) => {
                f.write_str("-")?;
                self.part(of, MINUS, f)
            }
            Formula::Call(function, of) => write!(
                f,
                "{}({})",
                function.name(),
                Written {
                    formula: of,
                    shape: self.shape
                }
            ),
            Formula::Join(operator, a, b) => {
                // Powers bind to the right, all others to the left.
                let (left, right) = if *operator == Operator::Power {
                    (1, 0)
                } else {
                    (0, 1)
                };
                self.part(a, operator.rank() + left, f)?;
                f.write_str(operator.sign())?;
                self.part(b, operator.rank() + right, f)
            }
        }
    }
}

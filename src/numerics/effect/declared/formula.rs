//! Formulas of declared effects: small trees of numbers, shape numbers and what a row offers.
//!
//! Small on purpose: a search for closed forms builds and prices such trees, and `libm` gives the same bits on every machine.

use super::quantity::RowQuantity;

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

impl Formula {
    pub(crate) fn call(function: Function, argument: Self) -> Self {
        Self::Call(function, Box::new(argument))
    }

    pub(crate) fn join(operator: Operator, a: Self, b: Self) -> Self {
        Self::Join(operator, Box::new(a), Box::new(b))
    }

    /// The value with these shape numbers; `None` where the row lacks what it asks for.
    pub(crate) fn value(
        &self,
        shape: &[f64],
        row: &dyn Fn(&RowQuantity) -> Option<f64>,
    ) -> Option<f64> {
        Some(match self {
            Self::Number(number) => *number,
            Self::Shape(k) => *shape.get(*k)?,
            Self::Row(quantity) => row(quantity)?,
            Self::Call(function, argument) => function.value(argument.value(shape, row)?),
            Self::Join(operator, a, b) => {
                operator.value(a.value(shape, row)?, b.value(shape, row)?)
            }
        })
    }

    /// Calls `visit` with every part, this one first.
    pub(crate) fn walk(&self, visit: &mut dyn FnMut(&Formula)) {
        visit(self);
        match self {
            Self::Call(_, argument) => argument.walk(visit),
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
}

//! Formulas of declared effects: small trees of numbers, shape numbers and what a row offers, and how they are read from text.
//!
//! Small on purpose: a search for closed forms builds and prices such trees, and `libm` gives the same bits on every machine.

use super::quantity::{self, Constant, RowQuantity};
use crate::error::nearest;

/// A formula; shape numbers stand by their position.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Formula {
    Number(f64),
    Shape(usize),
    Row(RowQuantity),
    Call(Function, Box<Formula>),
    Join(Operator, Box<Formula>, Box<Formula>),
}

/// Declares the functions of one argument that have a name.
macro_rules! functions {
    ($($function:ident $name:literal $value:expr;)+) => {
        /// Functions of one argument.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum Function {
            Minus,
            $($function,)+
        }

        impl Function {
            /// All that have a name.
            pub(crate) const NAMED: &[(&str, Self)] = &[$(($name, Self::$function)),+];

            fn value(self, x: f64) -> f64 {
                let of_one: fn(f64) -> f64 = match self {
                    Self::Minus => return -x,
                    $(Self::$function => $value,)+
                };
                of_one(x)
            }
        }
    };
}

functions! {
    Sin "sin" libm::sin;
    Cos "cos" libm::cos;
    Tan "tan" libm::tan;
    Atan "atan" libm::atan;
    Tanh "tanh" libm::tanh;
    Exp "exp" libm::exp;
    Ln "ln" libm::log;
    Sqrt "sqrt" libm::sqrt;
    Abs "abs" f64::abs;
    // -1, 0 or 1.
    Sign "sign" |x| if x == 0.0 { 0.0 } else { x.signum() };
    // 1 above zero, else 0.
    Step "step" |x| f64::from(x > 0.0);
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
    fn call(function: Function, argument: Self) -> Self {
        Self::Call(function, Box::new(argument))
    }

    fn join(operator: Operator, a: Self, b: Self) -> Self {
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
    fn walk(&self, visit: &mut dyn FnMut(&Formula)) {
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

    /// Whether a part of it is of some kind.
    pub(crate) fn any(&self, is: impl Fn(&Formula) -> bool) -> bool {
        let mut found = false;
        self.walk(&mut |part| found |= is(part));
        found
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

/// What is wrong with a formula, and at which of its characters (from 1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FormulaFault {
    pub(crate) at: usize,
    pub(crate) message: String,
}

impl FormulaFault {
    /// At the character after so many.
    fn new(before: usize, message: impl Into<String>) -> Self {
        let (at, message) = (before + 1, message.into());
        Self { at, message }
    }
}

/// Deeper brackets are nobody's formula.
const DEEPEST: usize = 60;

/// Reads a formula with these names of shape numbers: `+ - * / ^`, brackets, functions, names; `^` binds to the right and before a sign in
/// front.
pub fn parse(text: &str, shape: &[String]) -> Result<Formula, FormulaFault> {
    let letters: Vec<char> = text.chars().collect();
    let mut reader = FormulaReader {
        letters: &letters,
        at: 0,
        depth: 0,
        shape,
    };
    let formula = reader.sum()?;
    match reader.peek() {
        None => Ok(formula),
        Some(')') => Err(reader.fault("`)` without `(`")),
        Some(letter) => Err(reader.fault(format!(
            "expected an operator (+ - * / ^) or the end, found `{letter}`"
        ))),
    }
}

struct FormulaReader<'a> {
    letters: &'a [char],
    at: usize,
    depth: usize,
    shape: &'a [String],
}

impl FormulaReader<'_> {
    fn fault(&self, message: impl Into<String>) -> FormulaFault {
        FormulaFault::new(self.at, message)
    }

    /// The next letter that is no blank.
    fn peek(&mut self) -> Option<char> {
        while self
            .letters
            .get(self.at)
            .is_some_and(|letter| letter.is_whitespace())
        {
            self.at += 1;
        }
        self.letters.get(self.at).copied()
    }

    fn take(&mut self, wanted: char) -> bool {
        let there = self.peek() == Some(wanted);
        self.at += usize::from(there);
        there
    }

    fn sum(&mut self) -> Result<Formula, FormulaFault> {
        let mut left = self.product()?;
        loop {
            let operator = match self.peek() {
                Some('+') => Operator::Plus,
                Some('-') => Operator::Less,
                _ => return Ok(left),
            };
            self.at += 1;
            left = Formula::join(operator, left, self.product()?);
        }
    }

    fn product(&mut self) -> Result<Formula, FormulaFault> {
        let mut left = self.signed()?;
        loop {
            let operator = match self.peek() {
                Some('*') => Operator::Times,
                Some('/') => Operator::Over,
                _ => return Ok(left),
            };
            self.at += 1;
            left = Formula::join(operator, left, self.signed()?);
        }
    }

    fn signed(&mut self) -> Result<Formula, FormulaFault> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.fault(format!("more than {DEEPEST} parts within each other")));
        }
        let formula = if self.take('-') {
            Formula::call(Function::Minus, self.signed()?)
        } else {
            self.power()?
        };
        self.depth -= 1;
        Ok(formula)
    }

    fn power(&mut self) -> Result<Formula, FormulaFault> {
        let base = self.atom()?;
        if self.take('^') {
            Ok(Formula::join(Operator::Power, base, self.signed()?))
        } else {
            Ok(base)
        }
    }

    fn atom(&mut self) -> Result<Formula, FormulaFault> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                self.close()?;
                Ok(inner)
            }
            Some(letter) if letter.is_ascii_digit() || letter == '.' => {
                self.number().map(Formula::Number)
            }
            Some(letter) if letter.is_ascii_alphabetic() => self.name(),
            Some(letter) => Err(self.fault(format!(
                "expected a number, a name or `(`, found `{letter}`"
            ))),
            None => Err(self.fault("expected a number, a name or `(`, found the end")),
        }
    }

    fn close(&mut self) -> Result<(), FormulaFault> {
        if self.take(')') {
            Ok(())
        } else {
            Err(self.fault("expected `)`"))
        }
    }

    fn number(&mut self) -> Result<f64, FormulaFault> {
        let start = self.at;
        let exponent = |at: usize, letters: &[char]| {
            matches!(letters[at], '+' | '-') && matches!(letters[at - 1], 'e' | 'E')
        };
        while self.at < self.letters.len() {
            let letter = self.letters[self.at];
            let inside = letter.is_ascii_digit() || matches!(letter, '.' | 'e' | 'E');
            if !(inside || self.at > start && exponent(self.at, self.letters)) {
                break;
            }
            self.at += 1;
        }
        let text: String = self.letters[start..self.at].iter().collect();
        text.parse::<f64>()
            .ok()
            .filter(|number| number.is_finite())
            .ok_or_else(|| FormulaFault::new(start, format!("`{text}` is no number")))
    }

    fn name(&mut self) -> Result<Formula, FormulaFault> {
        let start = self.at;
        while self
            .letters
            .get(self.at)
            .is_some_and(|letter| letter.is_ascii_alphanumeric() || *letter == '_')
        {
            self.at += 1;
        }
        let name: String = self.letters[start..self.at].iter().collect();
        if let Some(k) = self.shape.iter().position(|shape| *shape == name) {
            return Ok(Formula::Shape(k));
        }
        if name == "pi" {
            return Ok(Formula::Number(std::f64::consts::PI));
        }
        let there = |message: String| FormulaFault::new(start, message);
        if let Some((_, function)) = Function::NAMED.iter().find(|(name_of, _)| *name_of == name) {
            if !self.take('(') {
                return Err(there(format!("`{name}` is a function: write {name}(...)")));
            }
            let argument = self.sum()?;
            self.close()?;
            return Ok(Formula::call(*function, argument));
        }
        let Some((asked, whose)) = RowQuantity::named(&name) else {
            let known = quantity::names().chain(Function::NAMED.iter().map(|(name, _)| *name));
            let mut all: Vec<&str> = known.collect();
            all.extend(self.shape.iter().map(String::as_str));
            let near = nearest(&name, all);
            let near = near
                .map(|near| format!("; did you mean `{near}`?"))
                .unwrap_or_else(|| ".".into());
            let functions: Vec<&str> = Function::NAMED.iter().map(|(name, _)| *name).collect();
            let shape = match self.shape {
                [] => "none".into(),
                some => some.join(", "),
            };
            return Err(there(format!(
                "`{name}` is no name{near} Allowed: {}; functions {}; pi; shape numbers: {shape}",
                quantity::known(),
                functions.join(", ")
            )));
        };
        let remembers = asked.1.constant().is_some();
        let constant = remembers.then(|| self.constant(&name)).transpose()?;
        Ok(Formula::Row(RowQuantity {
            asked,
            whose,
            constant,
        }))
    }

    /// The constant of a memory: a positive number or a shape number, in brackets.
    fn constant(&mut self, name: &str) -> Result<Constant, FormulaFault> {
        let wanted = format!(
            "`{name}` takes a constant: a positive number or a shape number, e.g. {name}(0.02)"
        );
        if !self.take('(') {
            return Err(self.fault(wanted));
        }
        self.peek();
        let start = self.at;
        let constant = match self.sum()? {
            Formula::Number(number) if number > 0.0 => Constant::Number(number),
            Formula::Shape(k) => Constant::Shape(k),
            _ => return Err(FormulaFault::new(start, wanted)),
        };
        self.close()?;
        Ok(constant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        parse(text, &[])
            .unwrap_or_else(|fault| panic!("{text}: {fault:?}"))
            .value(&[], &|_| None)
            .expect("a number")
    }

    #[test]
    fn a_formula_means_what_it_means_on_paper() {
        let worked_out = [
            ("1 - 2 - 3", -4.0),
            ("2 ^ 3 ^ 2", 512.0),
            ("-2^2", -4.0),
            ("2^-1", 0.5),
            ("(2 ^ 3) ^ 2", 64.0),
            ("(-2)^2", 4.0),
            ("1 - (2 - 3)", 2.0),
            ("12 / 3 / 2", 2.0),
            ("-(1 + 2) * 3", -9.0),
            ("2e-1 + 1.5E+1", 15.2),
            ("abs(-3) + sign(-7) + sign(0) + step(2) + step(0)", 3.0),
            (
                "sqrt(16) - exp(0) + ln(1) + tanh(0) + atan(0) + tan(0)",
                3.0,
            ),
            ("sin(pi / 2) + cos(pi)", 0.0),
        ];
        for (text, expected) in worked_out {
            assert!(
                (value(text) - expected).abs() < 1e-15,
                "{text} is {}",
                value(text)
            );
        }
    }

    #[test]
    fn a_fault_names_its_place() {
        let faults = [
            ("q +", 4, "found the end"),
            ("(q", 3, "expected `)`"),
            ("q)", 2, "`)` without `(`"),
            ("q q", 3, "expected an operator"),
            ("sin q", 1, "`sin` is a function"),
            ("2 * temprature", 5, "did you mean `temperature`?"),
            ("q0", 1, "`q0` is no name"),
            ("time3", 1, "`time3` is no name"),
            ("slip", 5, "takes a constant"),
            ("slip(q)", 6, "takes a constant"),
            ("slip(0)", 6, "takes a constant"),
            ("1.2.3", 1, "no number"),
            ("q § 2", 3, "expected an operator"),
            ("", 1, "found the end"),
        ];
        for (text, at, message) in faults {
            let fault = parse(text, &[]).expect_err(text);
            assert!(
                fault.at == at && fault.message.contains(message),
                "{text}: {fault:?}"
            );
        }
        let deep = "(".repeat(10_000);
        assert!(
            parse(&deep, &[])
                .expect_err("deep")
                .message
                .contains("within each other")
        );
    }
}

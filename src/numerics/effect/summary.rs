//! What a cause is given to put its finding into words.

use super::{Cause, Clock, Form, Place, Term, Variable, cause, figure};
use crate::units::Unit;

/// A coefficient of a finding in the unit in which people read it.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterEstimate {
    /// E.g. `gear_cyclic.j2.order3.sin`.
    pub name: String,
    /// Its form, by position among those of its finding.
    pub form: usize,
    /// In `unit`.
    pub value: f64,
    /// As people read it.
    pub unit: &'static str,
    /// One standard deviation, where it was estimated.
    pub sigma: Option<f64>,
}

/// The unit in which people read a number of this unit.
pub fn people(unit: Unit) -> (Unit, &'static str) {
    match unit {
        Unit::Radian => (Unit::Arcsecond, "arcsec"),
        Unit::Second => (Unit::Millisecond, "ms"),
        Unit::RadianPerRadianPerSecond => (Unit::ArcsecondPerDegreePerSecond, "arcsec/(deg/s)"),
        other => (other, other.symbol()),
    }
}

/// The unit behind a number; none of ratios.
fn unit(number: &ParameterEstimate) -> String {
    if number.unit == "1" { String::new() } else { format!(" {}", number.unit) }
}

/// A finding: its place, its forms and their fitted numbers.
#[derive(Debug, Clone, Copy)]
pub struct Summary<'a> {
    /// Where it acts.
    pub place: Place,
    /// Places and shapes that make it up.
    pub forms: &'a [Form],
    /// Their fitted coefficients.
    pub parameters: &'a [ParameterEstimate],
    /// What counts time in the recording.
    pub clock: Clock,
}

impl<'a> Summary<'a> {
    /// The cause of a name: of one of the forms, or of the library.
    pub fn cause(&self, name: &str) -> Option<&'static dyn Cause> {
        self.forms.iter().map(|form| form.cause()).find(|own| own.name() == name).or_else(|| cause(name))
    }

    /// The first form of a type.
    pub(super) fn form<T: super::Placed>(&self) -> Option<&'a T> {
        self.forms.iter().find_map(Form::as_a)
    }

    /// The numbers of the first form of a type.
    pub(super) fn of_form<T: super::Placed>(&self) -> impl Iterator<Item = &'a ParameterEstimate> {
        let number = self.forms.iter().position(|form| form.as_a::<T>().is_some());
        self.parameters.iter().filter(move |estimate| Some(estimate.form) == number)
    }

    /// The terms under a cause's name.
    pub(super) fn terms(&self, name: &'static str) -> impl Iterator<Item = &'a Term> {
        self.estimates(name).map(|(term, _)| term)
    }

    /// The terms under a cause's name, each with its fitted numbers.
    pub(super) fn estimates(&self, name: &'static str) -> impl Iterator<Item = (&'a Term, Vec<&'a ParameterEstimate>)> {
        let own = move |form: usize| self.parameters.iter().filter(|n| n.form == form).collect();
        let forms = self.forms.iter().enumerate().filter(move |(_, form)| form.cause().name() == name);
        forms.filter_map(move |(number, form)| Some((form.term()?, own(number))))
    }

    /// The first number with its unit.
    pub(super) fn value(&self) -> String {
        self.parameters.first().map_or_else(String::new, |n| format!("{:.3e}{}", n.value, unit(n)))
    }

    /// The size of the first number with its unit.
    pub(super) fn size(&self) -> String {
        self.parameters.first().map_or_else(String::new, |n| format!("{}{}", figure(n.value.abs(), 0), unit(n)))
    }

    /// When the first term of a cause changes, if it does.
    pub(super) fn when(&self, name: &'static str) -> String {
        let change = self.terms(name).find_map(|term| match (term.law().first.of, term.basis()) {
            (Variable::Time, super::Basis::After { at }) => Some(at),
            _ => None,
        });
        change.map_or_else(String::new, |time| self.clock.since(time))
    }
}

/// The amplitude of a sine and a cosine, the first two of some numbers.
pub(super) fn amplitude(numbers: &[&ParameterEstimate]) -> String {
    match numbers {
        [a, b, ..] => format!("{} {}", figure(a.value.hypot(b.value), 0), a.unit),
        _ => String::new(),
    }
}

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
    if number.unit == "1" {
        String::new()
    } else {
        format!(" {}", number.unit)
    }
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
    pub fn cause(&self, name: &str) -> Option<&'static Cause> {
        self.forms
            .iter()
            .map(|form| form.cause())
            .find(|declared| declared.name() == name)
            .or_else(|| cause(name))
    }

    /// The forms under a cause's name, each with its fitted numbers.
    fn forms_of(
        &self,
        name: &'static str,
    ) -> impl Iterator<Item = (&'a Form, Vec<&'a ParameterEstimate>)> {
        let numbers =
            move |form: usize| self.parameters.iter().filter(|n| n.form == form).collect();
        let forms = self
            .forms
            .iter()
            .enumerate()
            .filter(move |(_, form)| form.name() == name);
        forms.map(move |(number, form)| (form, numbers(number)))
    }

    /// What the first form under a cause's name that has words of its own says: see [`Placed::words`](super::Placed::words).
    pub(super) fn words(&self, name: &'static str) -> Option<String> {
        self.forms_of(name)
            .find_map(|(form, numbers)| form.words(&numbers))
    }

    /// The fitted numbers of the first form under a cause's name that has none.
    pub(super) fn wordless(&self, name: &'static str) -> Vec<&'a ParameterEstimate> {
        self.forms_of(name)
            .find(|(form, numbers)| form.words(numbers).is_none())
            .map(|(_, numbers)| numbers)
            .unwrap_or_default()
    }

    /// What the forms under a cause's name depend on.
    pub(super) fn variables(&self, name: &'static str) -> Vec<Variable> {
        self.forms_of(name)
            .flat_map(|(form, _)| form.variables())
            .collect()
    }

    /// The terms under a cause's name.
    pub(super) fn terms(&self, name: &'static str) -> impl Iterator<Item = &'a Term> {
        self.estimates(name).map(|(term, _)| term)
    }

    /// The terms under a cause's name, each with its fitted numbers.
    pub(super) fn estimates(
        &self,
        name: &'static str,
    ) -> impl Iterator<Item = (&'a Term, Vec<&'a ParameterEstimate>)> {
        self.forms_of(name)
            .filter_map(|(form, numbers)| Some((form.term()?, numbers)))
    }

    /// The first number with its unit.
    pub(super) fn value(&self) -> String {
        self.parameters
            .first()
            .map_or_else(String::new, |n| format!("{:.3e}{}", n.value, unit(n)))
    }

    /// The size of the first number with its unit.
    pub(super) fn size(&self) -> String {
        self.parameters.first().map_or_else(String::new, |n| {
            format!("{}{}", figure(n.value.abs(), 0), unit(n))
        })
    }
}

//! What a cause is given to put its finding into words, and what a finding is in the fitted model.

use super::{Basis, Cause, Clock, EffectStack, Form, Place, Term, Variable, cause, figure, names};
use crate::criteria::words::CONSTANT;
use crate::figures::measured;
use crate::robot::{Measurements, RobotModel, Travel};
use crate::units::Unit;
use nalgebra::Vector3;

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

/// A number with the digits that its standard deviation tells, where that was estimated; else with its usual decimals.
pub(super) fn rounded(value: f64, sigma: Option<f64>, decimals: usize) -> String {
    match sigma.filter(|sigma| *sigma > 0.0 && sigma.is_finite()) {
        Some(sigma) => measured(value, Some(sigma)),
        None => figure(value, decimals),
    }
}

/// The root of the sum of squares of numbers, with its standard deviation where all have one.
pub(super) fn root_of_squares(numbers: &[&ParameterEstimate]) -> (f64, Option<f64>) {
    let size = numbers.iter().map(|n| n.value.powi(2)).sum::<f64>().sqrt();
    let of_each = numbers.iter().map(|n| Some((n.value * n.sigma?).powi(2)));
    let square: Option<f64> = of_each.sum();
    (
        size,
        square
            .filter(|_| size > 0.0)
            .map(|square| square.sqrt() / size),
    )
}

/// The unit behind a number; none of ratios.
pub(super) fn unit(number: &ParameterEstimate) -> String {
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
        let form = self.forms.iter().find(|form| form.name() == name);
        form.map(|form| form.cause()).or_else(|| cause(name))
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
            format!("{}{}", rounded(n.value.abs(), n.sigma, 0), unit(n))
        })
    }
}

/// A finding in the fitted model.
#[derive(Clone, Copy)]
pub struct FittedForms<'a> {
    /// The arm of the model.
    pub robot: &'a RobotModel,
    /// Its effects.
    pub stack: &'a EffectStack,
    /// Its parameters, SI.
    pub x: &'a [f64],
    /// All rows of the recording.
    pub data: &'a Measurements,
    /// Fitted rows, ascending.
    pub rows: &'a [usize],
    /// What the finding is called.
    pub called: &'a str,
    /// What makes it up.
    pub forms: &'a [Form],
}

/// What a finding is in the fitted model, where that says more than its own numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelledFinding {
    /// The sentence for a mechanic, without the size at the tool.
    pub sentence: String,
    /// The cause, at its place, that does the same in these data.
    pub same: (&'static str, Place),
}

/// A size that a cause may have where it is not found, since geometry takes up most of what it does on a short or slow path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HiddenSize {
    /// What would be off; its place where that is not named.
    pub subject: Option<&'static str>,
    /// What that may do, as in `may trail`.
    pub may: &'static str,
    /// Less is no cause to measure again, SI.
    pub least: f64,
    /// In which people read it.
    pub unit: Unit,
}

/// Whether a form is a step of the last joint's zero, or of the target on the tool; when.
fn stepped(form: &Form, joints: usize) -> Option<f64> {
    let last = form.name() == names::ZERO_SHIFT && form.place() == Place::Joint(joints - 1);
    let law = form
        .term()
        .filter(|_| last || form.name() == names::TOOL_SHIFT)?
        .law();
    match (law.first.variable, law.first.basis) {
        (Variable::Time, Basis::After { at }) => Some(at),
        _ => None,
    }
}

/// A finding that is made of such steps alone, as a turn of the holder: a target that steps about the last axis at constant radius, whichever
/// name the step has. One target on the last body cannot separate a step of the last joint's zero from a displacement of the target about
/// that axis.
pub fn turned_holder(fitted: &FittedForms) -> Option<ModelledFinding> {
    let FittedForms {
        robot, data, rows, ..
    } = *fitted;
    let joints = robot.joints();
    if joints < 2 || !robot.is_revolute(joints - 1) {
        return None;
    }
    let times = fitted
        .forms
        .iter()
        .map(|form| stepped(form, joints))
        .collect::<Option<Vec<f64>>>()?;
    let (first, last) = times
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| {
            (a.min(*at), b.max(*at))
        });
    let before = *rows.iter().find(|row| data.time(**row) <= first)?;
    let after = *rows
        .iter()
        .find(|row| data.time(**row) > last && data.target(**row) == data.target(before))?;
    let [from, to] = [before, after].map(|row| off_the_axis(fitted, row));
    let axis = robot.axis(joints - 1);
    let [along, radius] = [
        (to - from).dot(axis),
        axis.cross(&to).norm() - axis.cross(&from).norm(),
    ];
    let moved = (to - from).norm();
    if along.abs().max(radius.abs()) >= *CONSTANT * moved {
        return None;
    }
    let angle = axis
        .dot(&from.cross(&to))
        .atan2(axis.cross(&from).dot(&axis.cross(&to)));
    let joint = Place::Joint(joints - 1);
    let sentence = format!(
        "the holder has turned by {} deg about the flange{}, its target at constant radius; a step in the zero of {joint} would look the same",
        figure(angle.to_degrees().abs(), 2),
        Clock::of(data).since(first)
    );
    let is_zero = fitted.called == names::ZERO_SHIFT;
    let same = if is_zero {
        (names::TOOL_SHIFT, Place::Tool)
    } else {
        (names::ZERO_SHIFT, joint)
    };
    Some(ModelledFinding { sentence, same })
}

/// Where a row's target is from a point on the last axis, m, zero pose, if the last joint stood where it was commanded.
fn off_the_axis(fitted: &FittedForms, row: usize) -> Vector3<f64> {
    let FittedForms {
        robot,
        stack,
        x,
        data,
        ..
    } = *fitted;
    let last = robot.joints() - 1;
    let motion = stack.point_motion(robot, data, row, x, &mut stack.scratch(robot));
    let commanded =
        motion.posture.behind[last] * robot.motion(last, &Travel::new(data.q(row)[last]));
    commanded.inverse_point(&motion.point) - robot.point(last)
}

//! Formulas for errors without a name: small ones that do what a free curve does, judged by folds of the rows to fit.
//!
//! Every formula of a grammar is fitted in place of the finding's curves, its shape numbers refined; price (parts and coefficients) and
//! error on folds make a Pareto front of at most three. Rows that are held out for validation take no part. Each is a declaration of an
//! effect of one's own, ready to be written.
//!
//! Formulas that none beats in both price and error (Pareto), and the one that is proposed.
//!
//! How well shape numbers are known: by the curvature of the residual, with all coefficients fitted at every step.

use crate::closed_form::grammar::{NamedVariable, declarations};
use crate::criteria::closed_form::{BETTER, LIKE, SHOWN, STARTS};
use crate::effect::{
    DeclaredCause, DeclaredForm, EffectDeclaration, Form, Motion, ParameterEstimate, Place, Survey,
    Variable, names, people,
};
use crate::judge::{Alternatives, fold_error};
use crate::regression::FormRegression;
use crate::round::{EstimatedCause, FitState, RoundView};
use crate::types::{ClosedForm, Finding};
use nalgebra::DMatrix;
use std::sync::Arc;

mod grammar;

/// What formulas are looked for in: the fitted model, and the rows around it.
pub(super) struct FormulaSearch<'a, 'b> {
    pub(crate) state: &'b FitState,
    pub(crate) view: &'b RoundView<'a>,
    pub(crate) survey: &'b Survey<'a>,
}

/// A formula with its shape numbers where they fit best.
struct Candidate {
    cause: Arc<DeclaredCause>,
    form: Form,
    price: usize,
}

impl FormulaSearch<'_, '_> {
    /// Formulas for findings, those of each cheapest first; none where it has a name, or is no function of one or two variables.
    pub(crate) fn formulas(&self, findings: &[Finding]) -> Vec<ClosedForm> {
        findings
            .iter()
            .enumerate()
            .filter_map(|(at, finding)| self.forms(at, finding))
            .flatten()
            .collect()
    }

    fn forms(&self, at: usize, finding: &Finding) -> Option<Vec<ClosedForm>> {
        let nameless = |form: &Form| form.cause().is_nameless();
        // What it has elsewhere are details of the model.
        let forms = finding.forms.iter();
        let forms: Vec<&Form> = forms.filter(|form| form.place() == finding.place).collect();
        let is_named = ![names::UNKNOWN, names::JOINT_TABLE].contains(&&*finding.effect);
        if is_named || forms.is_empty() || !forms.iter().all(|form| nameless(form)) {
            return None;
        }
        let causes = &self.state.causes;
        let is_member = |i: &usize| forms.contains(&&causes[*i].form);
        let (members, others): (Vec<usize>, Vec<usize>) = (0..causes.len()).partition(is_member);
        let (place, variables) = self.variables(&forms)?;
        let others: Vec<&Form> = others.iter().map(|i| &causes[*i].form).collect();
        let problem = &self.view.problem;
        let base = problem.basis(&self.view.fitter.base());
        let residual = self.view.without_causes(self.state);
        let given = FormRegression::new(problem, &base, &others, &residual);
        let Place::Joint(joint) = finding.place else {
            return None;
        };
        let unit = if self.survey.robot.is_revolute(joint) {
            "rad"
        } else {
            "mm"
        };
        let declarations = declarations(&place, unit, &variables);
        let candidate = |declaration: &EffectDeclaration| {
            self.candidate(DeclaredCause::of(declaration).ok()?, finding.place, &given)
        };
        let candidates: Vec<Candidate> = declarations.iter().filter_map(candidate).collect();
        let forms = candidates.iter().map(|candidate| &candidate.form);
        let rivals: Vec<EstimatedCause> = forms.map(|form| self.at_zero(form)).collect();
        let (state, fitter) = (self.state, self.view.fitter);
        let curve = fold_error(state, fitter)?;
        let shown = Alternatives::ask(state, fitter, &rivals, |near| {
            // Where nothing near the model does without them, all that is known is that it is worse than any formula.
            let without = near.error(&members, None);
            let priced = |(k, candidate): (usize, &Candidate)| Priced {
                price: candidate.price,
                error: near.error(&members, Some(k)).unwrap_or(f64::NAN),
            };
            let priced: Vec<Priced> = candidates.iter().enumerate().map(priced).collect();
            let (shown, chosen) = front(&priced, [without.unwrap_or(f64::INFINITY), curve])?;
            let one = |(position, k): (usize, &usize)| {
                let coefficients = near.coefficients(&members, *k);
                ClosedForm {
                    finding: at,
                    declaration: candidates[*k].cause.declaration().clone(),
                    price: priced[*k].price,
                    folds: priced[*k].error,
                    curve,
                    without,
                    chosen: Some(position) == chosen,
                    numbers: self.numbers(&candidates[*k], &variables, &given, coefficients),
                }
            };
            Some(shown.iter().enumerate().map(one).collect())
        });
        shown.flatten()
    }

    /// The place as a declaration has it, and the variables, where they are one or two.
    fn variables(&self, forms: &[&Form]) -> Option<(String, Vec<NamedVariable>)> {
        let mut joint = None;
        let mut variables: Vec<Variable> = Vec::new();
        for form in forms {
            let term = form.term()?;
            let Motion::Joint { joint: joint_here } = term.motion() else {
                return None;
            };
            joint = Some(joint_here);
            for variable in term.law().variables() {
                if !variables.contains(&variable) {
                    variables.push(variable);
                }
            }
        }
        let joint = joint?;
        let slides = |joint: usize| !self.survey.robot.is_revolute(joint);
        let named = |one: &Variable| NamedVariable::of(*one, joint, self.range(*one)?, slides);
        let named: Vec<NamedVariable> = variables.iter().map(named).collect::<Option<_>>()?;
        let anywhere = self.survey.robot.is_revolute(joint)
            && variables.iter().all(|asked| asked.is_of(joint));
        let place = if anywhere {
            "joint".into()
        } else {
            Place::Joint(joint).to_string()
        };
        (1..=2).contains(&named.len()).then_some((place, named))
    }

    /// Lowest and highest value over the fitted rows.
    fn range(&self, variable: Variable) -> Option<[f64; 2]> {
        let values = self.view.problem.values(variable)?;
        let first = *values.first()?;
        let wider = |[low, high]: [f64; 2], value: &f64| [low.min(*value), high.max(*value)];
        Some(values.iter().fold([first; 2], wider))
    }

    /// A declared law at the place of the finding, its shape numbers where they fit best.
    fn candidate(
        &self,
        cause: Arc<DeclaredCause>,
        place: Place,
        given: &FormRegression,
    ) -> Option<Candidate> {
        let forms = DeclaredForm::hypotheses(&cause, self.survey).into_iter();
        let forms = forms.map(|hypothesis| hypothesis.form);
        let forms: Vec<Form> = forms.filter(|form| form.place() == place).collect();
        let with_gains = |forms: Vec<Form>| given.gains(&forms).into_iter().zip(forms);
        let mut starts: Vec<(f64, Form)> = with_gains(forms).collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        // The best start need not lead to the best shape.
        starts.truncate(*STARTS);
        let ends = starts.into_iter();
        let ends = ends.map(|(_, form)| given.refined(form, self.survey));
        let (_, form) = with_gains(ends.collect()).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Candidate {
            price: cause.price(),
            cause,
            form,
        })
    }

    fn at_zero(&self, form: &Form) -> EstimatedCause {
        let count = form.parameters(&self.state.model.robot).len();
        EstimatedCause {
            form: form.clone(),
            coefficients: vec![0.0; count],
            priors: Vec::new(),
        }
    }

    /// Shape numbers, then coefficients (SI, with their standard deviations) as the whole model has them with the formula in place of the
    /// curves.
    fn numbers(
        &self,
        candidate: &Candidate,
        variables: &[NamedVariable],
        given: &FormRegression,
        coefficients: Option<Vec<(f64, f64)>>,
    ) -> Vec<ParameterEstimate> {
        let Candidate { form, .. } = candidate;
        let sigmas = shape_sigmas(form, given);
        let number = |name: String, value: f64, unit, sigma| ParameterEstimate {
            name,
            form: 0,
            value,
            unit,
            sigma,
        };
        let shape = form.shape_numbers().into_iter().zip(sigmas);
        let shape = shape.map(|((name, value), sigma)| {
            let (symbol, scale) = unit(&name, variables);
            number(
                name,
                scale * value,
                symbol,
                sigma.map(|sigma| scale * sigma),
            )
        });
        let mut out: Vec<ParameterEstimate> = shape.collect();
        let specs = form.parameters(&self.state.model.robot);
        let coefficients = specs.iter().zip(coefficients.unwrap_or_default());
        for (k, (spec, (value, sigma))) in (1..).zip(coefficients) {
            let (unit, symbol) = people(spec.unit);
            let sigma = Some(unit.from_si(sigma));
            out.push(number(format!("c{k}"), unit.from_si(value), symbol, sigma));
        }
        out
    }
}

/// The unit of a shape number, and the factor from SI: that of the variable, or turns of it; in SI where it is no position of a joint.
fn unit(name: &str, variables: &[NamedVariable]) -> (&'static str, f64) {
    let all = |is: fn(&NamedVariable) -> bool| variables.iter().all(is);
    match name {
        "order" if all(|variable| variable.is_angle) => ("1", 1.0),
        "order" => ("SI", 1.0),
        _ if all(|variable| variable.is_angle) => ("rad", 1.0),
        _ if all(|variable| variable.is_prismatic) => ("mm", 1e3),
        _ => ("SI", 1.0),
    }
}

/// What a formula costs and how well it carries over to poses that it has not seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Priced {
    pub(crate) price: usize,
    /// Rms of folds, m.
    pub(crate) error: f64,
}

/// Positions of the formulas worth showing, cheapest first, of those that are better than none at all; and which of them is proposed:
/// the cheapest that is as good as the best, where that does what the free curve does.
pub(crate) fn front(
    all: &[Priced],
    [without, curve]: [f64; 2],
) -> Option<(Vec<usize>, Option<usize>)> {
    let mut order: Vec<usize> = (0..all.len())
        .filter(|k| all[*k].error.is_finite())
        .collect();
    order.sort_by(|a, b| {
        let (one, other) = (&all[*a], &all[*b]);
        let by_price = one.price.cmp(&other.price);
        by_price
            .then(one.error.total_cmp(&other.error))
            .then(a.cmp(b))
    });
    let mut falls: Vec<(usize, f64)> = Vec::new();
    let mut best = without;
    for k in order {
        if all[k].error < best * (1.0 - *BETTER) {
            falls.push((k, best / all[k].error));
            best = all[k].error;
        }
    }
    let last = falls.last()?.0;
    while falls.len() > *SHOWN {
        // What gains least over the next cheaper one goes; the best stays.
        let (least, _) = falls[..falls.len() - 1]
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        falls.remove(least);
    }
    let shown: Vec<usize> = falls.into_iter().map(|(k, _)| k).collect();
    let as_good = |k: &usize| all[*k].error <= all[last].error * (1.0 + *BETTER);
    let chosen = shown
        .iter()
        .position(as_good)
        .filter(|_| all[last].error <= *LIKE * curve);
    Some((shown, chosen))
}

/// Steps as shares of a shape number's range.
const STEP: f64 = 1e-3;

/// One standard deviation of each shape number of a form that fits best; none where the residual has no minimum there.
pub(crate) fn shape_sigmas(form: &Form, given: &FormRegression) -> Vec<Option<f64>> {
    let Some(declared) = form.declared() else {
        return Vec::new();
    };
    let steps = declared.shape_steps(STEP);
    let count = steps.len();
    let unknown = vec![None; count];
    if count == 0 || declared.declaration().pattern().jumps() {
        return unknown;
    }
    let at = |moves: &[(usize, f64)]| {
        let mut shift = vec![0.0; count];
        moves
            .iter()
            .for_each(|(k, times)| shift[*k] += times * steps[*k]);
        declared.shifted(&shift)
    };
    let pairs: Vec<(usize, usize)> = (0..count)
        .flat_map(|a| (0..=a).map(move |b| (a, b)))
        .collect();
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let forms: Vec<Form> = pairs
        .iter()
        .flat_map(|(a, b)| corners.map(|(i, j)| at(&[(*a, i), (*b, j)])))
        .collect();
    let gains = given.gains(&forms);
    // Squares of whitened residuals fall by the gain: half of their second derivatives is the information.
    let mut information = DMatrix::zeros(count, count);
    for ((a, b), gain) in pairs.into_iter().zip(gains.chunks(4)) {
        let second = -(gain[0] - gain[1] - gain[2] + gain[3]) / (4.0 * steps[a] * steps[b]);
        information[(a, b)] = 0.5 * second;
        information[(b, a)] = 0.5 * second;
    }
    let Some(covariance) = information.try_inverse() else {
        return unknown;
    };
    let variances = (0..count).map(|k| covariance[(k, k)]);
    variances
        .map(|variance| (variance > 0.0).then(|| variance.sqrt()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(all: &[(usize, f64)], curve: f64) -> Option<(Vec<usize>, Option<usize>)> {
        front(
            &all.iter()
                .map(|(price, error)| Priced {
                    price: *price,
                    error: *error,
                })
                .collect::<Vec<_>>(),
            [10.0, curve],
        )
    }

    #[test]
    fn the_front_holds_what_nothing_beats_in_both() {
        // The third is dearer than the second and worse; the fourth hardly better than the second.
        assert_eq!(
            of(&[(2, 9.0), (4, 5.0), (6, 6.0), (8, 4.99), (9, 3.0)], 3.1),
            Some((vec![0, 1, 4], Some(2)))
        );
        // Five that fall: the two that gain least over their neighbours go, never the best.
        assert_eq!(
            of(&[(1, 9.0), (2, 8.9), (3, 4.0), (4, 3.9), (5, 3.8)], 3.8),
            Some((vec![0, 2, 4], Some(2)))
        );
        // The curve does better than any of them.
        assert_eq!(of(&[(2, 9.0), (4, 5.0)], 3.0), Some((vec![0, 1], None)));
        assert_eq!(of(&[(3, 10.0), (5, f64::NAN)], 3.0), None);
        assert_eq!(of(&[], 3.0), None);
    }
}

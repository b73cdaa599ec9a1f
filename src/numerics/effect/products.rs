//! Products by heredity: a name claims that its size is one constant. Where it follows something else besides, the law is another one
//! than its name says.

use super::{Basis, Factor, Form, Hypothesis, Motion, Placed, Survey, Term, Unknown, Variable, interactions};

/// Moves (a quantile of theirs) within which an error may depend on how far the joint came.
const START: f64 = 0.3;

/// The law of a named form times each variable that its size may follow, as laws without a name.
pub fn products(form: &Form, survey: &Survey) -> Vec<Hypothesis> {
    let Some(term) = form.term().filter(|term| !term.cause().is_nameless() && term.law().times.is_none()) else {
        return Vec::new();
    };
    let of = term.law().first.of;
    let after = matches!(term.basis(), Basis::After { .. });
    let turned = |variable| matches!(variable, Variable::Angle { .. });
    let mut factors = followed(term.motion(), survey);
    // A product of two angles is a law of its own.
    factors.retain(|factor| !(turned(of) && turned(factor.of)) && (factor.of != of || (after && of == Variable::Time)));
    let count = factors.len();
    let law = |factor: Factor| term.law().times(factor.of, factor.basis);
    let terms = factors.into_iter().map(|factor| Term::new(&Unknown, term.motion(), law(factor)));
    terms.map(|term| Hypothesis::new(term, count).inheriting()).collect()
}

/// Whether a form is a product without a name that was made of the law of another one; what its size follows.
pub fn follows(product: &Form, named: &Form) -> Option<Variable> {
    let (product, named) = (product.term()?, named.term()?);
    let by = product.law().times?.of;
    let [own, first] = [product, named].map(|term| term.law().first);
    if named.law().times.is_some() {
        return None;
    }
    let same = product.motion() == named.motion() && own.of.to_string() == first.of.to_string();
    let alike = std::mem::discriminant(&own.basis) == std::mem::discriminant(&first.basis);
    (same && alike && product.cause().is_nameless() && !named.cause().is_nameless()).then_some(by)
}

/// Whether a form with a name is the law that a product without one would be, whatever the course in its second variable.
pub fn is_named_product(named: &Form, product: &Form) -> bool {
    let (Some(named), Some(product)) = (named.term(), product.term()) else { return false };
    let second = |term: &Term| term.law().times.map(|factor| factor.of);
    let same = named.motion() == product.motion() && named.law().first == product.law().first;
    same && second(named) == second(product) && !named.cause().is_nameless()
}

/// What the size of an error at a place may follow.
fn followed(motion: Motion, survey: &Survey) -> Vec<Factor> {
    let mut out: Vec<Factor> = interactions::slow(survey).into_iter().map(|(of, range)| centred(of, range)).collect();
    let angle = |joint: usize| centred(Variable::Angle { joint }, survey.range[joint]);
    match motion {
        Motion::Joint { joint } => {
            out.push(angle(joint));
            if survey.is_loaded(joint) {
                out.push(Factor::new(Variable::Load { joint }, Basis::PROPORTIONAL));
            }
            if survey.both_directions(joint) {
                out.push(Factor::new(Variable::Approach { joint }, Basis::PROPORTIONAL));
            }
            let width = interactions::move_of(survey, joint, START);
            if width > 0.0 {
                out.push(Factor::new(Variable::Move { joint }, Basis::Bump { centre: 0.0, width }));
            }
        }
        Motion::Links { last, .. } if last + 1 < survey.joints() => out.push(angle(last + 1)),
        Motion::Base { .. } | Motion::Tracker { .. } => out.push(angle(0)),
        Motion::Tool { .. } => out.push(angle(survey.joints() - 1)),
        Motion::Instrument { .. } => {
            let [elevation, range] = survey.seen();
            out.extend([centred(Variable::Elevation, elevation), centred(Variable::Range, range)]);
        }
        _ => return Vec::new(),
    }
    out.retain(|factor| !matches!(factor.basis, Basis::Linear { per, .. } if per <= 0.0));
    out
}

/// From -1 to 1 over a range.
fn centred(of: Variable, [low, high]: [f64; 2]) -> Factor {
    Factor::new(of, Basis::Linear { zero: 0.5 * (low + high), per: 0.5 * (high - low) })
}

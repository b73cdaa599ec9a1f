//! Where the residual sits and what it depends on, before any name is given: what each place and each variable could explain at most.

use super::pool::{Conditional, HypothesisSet};
use super::types::{ExplainedShare, Located, SpectrumLine};
use crate::effect::{Basis, Clock, Form, Survey, Variable};
use std::collections::BTreeMap;

/// The residual beside the causes of `given`.
pub(crate) fn locate(pool: &HypothesisSet, given: &Conditional, survey: &Survey) -> Located {
    let mut best: BTreeMap<(&'static str, String), ExplainedShare> = BTreeMap::new();
    let mut spectrum = Vec::new();
    let clock = Clock::of(survey.data);
    for (fall, h) in &given.falls {
        let form = &pool.hypotheses[*h].form;
        let (gain, parameters) = given.gain(pool, *h);
        let share = gain / given.square.max(f64::MIN_POSITIVE);
        let names =
            std::iter::once(("place", form.place().to_string())).chain(variables(form, clock).map(|name| ("variable", name)));
        for (by, name) in names {
            // Falls come largest first: the first one stands.
            best.entry((by, name.clone())).or_insert(ExplainedShare {
                by,
                name,
                share,
                parameters,
                delta_bic: fall + pool.prior_penalty[*h],
                effect: form.name(),
            });
        }
        spectrum.extend(wave(form).map(|(joint, motor, order)| SpectrumLine { joint, motor, order, share }));
    }
    let mut shares: Vec<ExplainedShare> = best.into_values().collect();
    shares.sort_by(|a, b| a.by.cmp(b.by).then(b.share.total_cmp(&a.share)).then(a.name.cmp(&b.name)));
    let spectrum = strongest(spectrum);
    debug_assert!(spectrum.iter().all(|wave| wave.joint < survey.joints()));
    Located { shares, spectrum }
}

/// Lines by joint, gear side and order; of several causes that are one line the one that explains most.
fn strongest(mut lines: Vec<SpectrumLine>) -> Vec<SpectrumLine> {
    let key = |line: &SpectrumLine| (line.joint, line.motor, line.order);
    lines.sort_by(|a, b| key(a).cmp(&key(b)).then(b.share.total_cmp(&a.share)));
    lines.dedup_by_key(|line| key(line));
    lines
}

/// What a form depends on, in words.
fn variables(form: &Form, clock: Clock) -> Option<String> {
    let names: Vec<String> = form.variables().into_iter().map(|variable| clock.named(variable)).collect();
    (!names.is_empty()).then(|| names.join(" and "))
}

/// The order of a pure sine and cosine of a joint's or its motor's angle at that joint.
fn wave(form: &Form) -> Option<(usize, bool, u32)> {
    let term = form.term()?;
    let (joint, of) = term.of_one()?;
    let Basis::Wave { order, overtone: false } = term.basis() else { return None };
    let motor = of == Variable::Motor { joint };
    (motor || of == Variable::Angle { joint }).then_some((joint, motor, order))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_causes_of_one_order_are_one_line() {
        let line = |joint, order, share| SpectrumLine { joint, motor: true, order, share };
        let all = strongest(vec![line(1, 2, 0.1), line(0, 1, 0.2), line(0, 1, 0.5), line(0, 3, 0.1)]);
        let seen: Vec<(usize, f64)> = all.iter().map(|line| (line.joint, line.share)).collect();
        assert_eq!(seen, [(0, 0.5), (0, 0.1), (1, 0.1)]);
    }
}

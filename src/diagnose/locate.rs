//! Where the residual sits and what it goes with, before any name is given: what each place and each variable could explain at most.

use super::pool::Pool;
use super::state::State;
use crate::effect::{Basis, Clock, Effect, Form, Survey, Variable};
use std::collections::BTreeMap;

/// The best of all hypotheses at a place, or of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// `place` or `variable`.
    pub by: &'static str,
    /// E.g. `joint 3`, `link 2-4`; `q3`, `load of joint 2`, `time` (`row` where none was recorded).
    pub name: String,
    /// Of the squared residual that the base model leaves, in standard deviations.
    pub share: f64,
    /// How many numbers it takes, which alone explain as many lines of noise.
    pub numbers: usize,
    /// Fall of the criterion: positive where it is more than chance.
    pub delta_bic: f64,
    /// The effect that does it.
    pub effect: &'static str,
}

/// What a sine and a cosine of an order explain of the residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// From 0.
    pub joint: usize,
    /// Whether the order is per turn of the motor.
    pub motor: bool,
    pub order: u32,
    pub share: f64,
}

/// Where a residual sits.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Located {
    /// Places, then variables; largest shares first.
    pub shares: Vec<Share>,
    /// By joint, motor and order.
    pub spectrum: Vec<Line>,
}

/// The residual beside the causes of `state`.
pub(crate) fn locate(pool: &Pool, state: &State, survey: &Survey) -> Located {
    let mut best: BTreeMap<(&'static str, String), Share> = BTreeMap::new();
    let mut spectrum = Vec::new();
    let clock = Clock::of(survey.data);
    for (fall, h) in state.falls(pool) {
        let form = &pool.hypotheses[*h].form;
        let (gain, numbers) = state.gain(pool, *h);
        let share = gain / state.square.max(f64::MIN_POSITIVE);
        let names =
            std::iter::once(("place", form.place().to_string())).chain(variables(form, clock).map(|name| ("variable", name)));
        for (by, name) in names {
            // Falls come largest first: the first one stands.
            best.entry((by, name.clone())).or_insert(Share {
                by,
                name,
                share,
                numbers,
                delta_bic: fall + pool.charge[*h],
                effect: form.name(),
            });
        }
        spectrum.extend(line(form).map(|(joint, motor, order)| Line { joint, motor, order, share }));
    }
    let mut shares: Vec<Share> = best.into_values().collect();
    shares.sort_by(|a, b| a.by.cmp(b.by).then(b.share.total_cmp(&a.share)).then(a.name.cmp(&b.name)));
    spectrum.sort_by_key(|line| (line.joint, line.motor, line.order));
    debug_assert!(spectrum.iter().all(|line| line.joint < survey.joints()));
    Located { shares, spectrum }
}

/// What a form depends on, in words.
fn variables(form: &Form, clock: Clock) -> Option<String> {
    let names: Vec<String> = form.variables().into_iter().map(|variable| clock.named(variable)).collect();
    (!names.is_empty()).then(|| names.join(" and "))
}

/// The order of a pure sine and cosine of a joint's or its motor's angle at that joint.
fn line(form: &Form) -> Option<(usize, bool, u32)> {
    let term = form.term()?;
    let (joint, of) = term.of_one()?;
    let Basis::Wave { order, overtone: false } = term.basis() else { return None };
    let motor = of == Variable::Motor { joint };
    (motor || of == Variable::Angle { joint }).then_some((joint, motor, order))
}

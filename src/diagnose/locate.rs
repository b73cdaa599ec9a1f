//! Where the residual sits and what it goes with, before any name is given: what each place and each variable could explain at most.

use super::pool::Pool;
use super::state::State;
use super::words::Clock;
use crate::effect::{Course, Effect, Form, Placed, Side, Signature, Survey, Warmth};
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
        match (form, form.place()) {
            (Form::GearCyclic(gear), _) if !gear.has_overtone() => {
                spectrum.push(Line { joint: gear.joint(), motor: false, order: gear.order(), share })
            }
            (Form::GearMotorCyclic(gear), crate::effect::Place::Joint(joint)) => {
                spectrum.push(Line { joint, motor: true, order: gear.order(), share });
            }
            _ => (),
        }
    }
    let mut shares: Vec<Share> = best.into_values().collect();
    shares.sort_by(|a, b| a.by.cmp(b.by).then(b.share.total_cmp(&a.share)).then(a.name.cmp(&b.name)));
    spectrum.sort_by_key(|line| (line.joint, line.motor, line.order));
    debug_assert!(spectrum.iter().all(|line| line.joint < survey.joints()));
    Located { shares, spectrum }
}

/// What a form goes with.
fn variables(form: &Form, clock: Clock) -> impl Iterator<Item = String> {
    let time = clock.name();
    let warmth = |by: Warmth| match by {
        Warmth::Temperature { .. } => "temperature",
        Warmth::Time { .. } => time,
    };
    let number = match form.place() {
        crate::effect::Place::Joint(joint) => joint + 1,
        _ => 0,
    };
    let own = |what: &str| vec![format!("{what} {number}")];
    let angle = |joint: usize| format!("q{}", joint + 1);
    let all = match form {
        Form::JointCompliance(_) | Form::JointHardening(_) => own("load of joint"),
        Form::Backlash(gap) if matches!(gap.side(), Side::Load { .. }) => own("load of joint"),
        Form::Backlash(_) => own("approach of joint"),
        Form::GearMotorCyclic(_) => own("motor"),
        Form::GearCyclic(_) | Form::JointTable(_) | Form::AxisWobble(_) | Form::Counterbalance(_) => vec![format!("q{number}")],
        Form::ZeroShift(_) | Form::FrameShift(_) => vec![time.into()],
        Form::ThermalGrowth(growth) => vec![warmth(growth.by()).into()],
        Form::TrackerDrift(drift) => match drift.course() {
            Course::Warming(by) => vec![warmth(by).into()],
            _ => vec![time.into()],
        },
        Form::PayloadError(_) => vec!["payload".into()],
        Form::JointLogLag(lag) if lag.is_time() => vec!["speed".into()],
        Form::JointLogLag(_) => vec!["last move".into()],
        Form::ViscousWindup(_) => own("speed of joint"),
        Form::LinkCompliance(_) | Form::BaseCompliance(_) | Form::LinkMass(_) => vec!["load of the arm".into()],
        Form::CouplingRatio(_) => Vec::new(),
        Form::Unknown(unknown) => match unknown.signature() {
            Signature::Angle { by, .. } | Signature::Hinge { by, .. } | Signature::Periodic { by, .. } => vec![angle(by)],
            Signature::Bump { .. } | Signature::Step { .. } => vec![format!("q{number}")],
            Signature::Product { a, b } | Signature::Surface { a, b, .. } => vec![format!("{} and {}", angle(a), angle(b))],
            Signature::Sway { .. } | Signature::Time { .. } | Signature::Creep { .. } => vec![time.into()],
            Signature::Side { .. } | Signature::Sag => vec!["direction of gravity".into()],
            Signature::Warming(by) => vec![warmth(by).into()],
            Signature::Payload { .. } => vec!["payload".into()],
        },
    };
    all.into_iter()
}

//! Shapes of laws of the table of causes: periods a turn, changes at one moment, lost motion, warmth; what is proposed of each, and what lies
//! around a shape.

use super::basis::around;
use super::{
    Basis, Clock, Form, Law, Measure, Motion, Place, Survey, Term, Variable, figure, names,
};
use crate::criteria::effect::{BENDS, RARE};
use crate::robot::Memory;
use std::f64::consts::TAU;

/// Laws, each with how many like it are tried, and how much rarer it is than others.
pub(super) type RatedLaws = Vec<(Law, usize, f64)>;

// Errors of whole periods a turn, and of periods between.

/// An order needs this much of its phase (rad) within the joint's travel to be more than a line.
const PHASE: f64 = 2.2;

/// A sine and a cosine of any order: of whole periods a turn, or not.
pub(super) fn of_order(order: f64) -> Basis {
    let whole = order.round();
    if (order - whole).abs() < 1e-9 && whole >= 1.0 {
        Basis::Wave {
            order: whole as u32,
            overtone: false,
        }
    } else {
        Basis::Sway {
            period: TAU / order,
        }
    }
}

/// Periods a turn of a sine and a cosine; none of another basis.
pub(super) fn order(basis: Basis) -> Option<f64> {
    match basis {
        Basis::Wave { order, .. } => Some(f64::from(order)),
        Basis::Sway { period } => Some(TAU / period),
        _ => None,
    }
}

/// Whether a joint of this travel (rad) shows more of an order than a line.
pub(super) fn is_within(order: f64, travel: f64) -> bool {
    order * travel > PHASE
}

/// An order in the name of a parameter, which has no points.
pub(super) fn in_name(order: f64) -> String {
    format!("{:.3}", order)
        .trim_end_matches('0')
        .trim_end_matches('.')
        .replace('.', "_")
}

/// Orders between those of a wave of a joint's angle: a gear stage need not be in phase with its joint.
pub(super) fn near_order(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    let (Motion::Joint { joint }, None, Some(order)) =
        (term.motion(), term.law().times, order(term.basis()))
    else {
        return Vec::new();
    };
    let step = 0.25 * libm::exp2(-f64::from(level));
    let orders = [order - step, order + step]
        .into_iter()
        .filter(|order| is_within(*order, survey.travel(joint)));
    term.with_bases(orders.map(of_order))
}

// Changes at one moment: what `zero_shift`, `base_shift` and `tool_shift` have in common.

/// Change points tried at first; the best is refined to every one.
const CHANGES: usize = 40;

/// What shows when something has moved.
pub(super) const RETURN: Measure = Measure {
    rank: 3,
    advice: "return to a few anchor poses with different first joints every half hour",
};

/// A motion that steps at each of the change points, with how many are tried. A joint or a tool that steps when the payload changes follows
/// the payload; what stands before the arm may have been touched then.
pub(super) fn changes(motion: Motion, survey: &Survey) -> RatedLaws {
    let times = survey
        .changes(CHANGES)
        .filter(|at| is_its_own(motion, *at, survey));
    times
        .map(|at| {
            (
                Law::new(Variable::Time, Basis::After { at }),
                survey.boundaries.len(),
                0.0,
            )
        })
        .collect()
}

/// The same at neighbouring change points.
pub(super) fn near_change(term: &Term, survey: &Survey) -> Vec<Term> {
    let Basis::After { at } = term.basis() else {
        return Vec::new();
    };
    let others = survey
        .changes_near(at)
        .iter()
        .copied()
        .filter(|other| *other != at && is_its_own(term.motion(), *other, survey));
    term.with_bases(others.map(|at| Basis::After { at }))
}

/// What may have moved, as far as these data show, when the payload changed for the only time: of a joint or a tool that follows the payload.
pub fn moved_with_the_payload(form: &Form, survey: &Survey) -> Option<(&'static str, Place)> {
    let term = form.term().filter(|term| {
        survey.payload_changes_once() && term.law().variables() == [Variable::Payload]
    })?;
    match term.motion() {
        Motion::Joint { joint } => Some((names::ZERO_SHIFT, Place::Joint(joint))),
        Motion::Tool { .. } => Some((names::TOOL_SHIFT, Place::Tool)),
        _ => None,
    }
}

/// Whether no change of the payload would do the same.
fn is_its_own(motion: Motion, at: f64, survey: &Survey) -> bool {
    matches!(motion, Motion::Base { .. }) || !survey.is_payload_change(at)
}

// Lost motion by the cause that leaves a joint on one side of its play: the load, friction under smaller loads than some threshold, or
// friction that fades in over a travel after each reversal (Dahl).

/// Widths of the blur as shares of the threshold.
const BLURS: [f64; 2] = [0.0, 0.5];
/// Smallest and largest threshold and blur, as shares of the joint's largest load: there the load or the approach decides alone.
const THRESHOLDS: [f64; 2] = [1e-3, 1.5];
/// Travels (rad) of pre-sliding tried at first; shortest and longest.
const TRAVELS: [f64; 6] = [0.004, 0.012, 0.035, 0.1, 0.25, 0.6];
const BOUNDS: [f64; 2] = [0.001, 1.5];
/// Moves shorter than so many travels have not slid yet; so many rows must have ended one.
const SLID: f64 = 2.0;
const ROWS: usize = 5;

/// The side that the load pushes the joint to, blurred over some torque.
pub(super) fn by_load(joint: usize, survey: &Survey) -> RatedLaws {
    if !survey.is_loaded(joint) {
        return Vec::new();
    }
    let law = |width| Law::new(Variable::Load { joint }, Basis::Rise { centre: 0.0, width });
    [1e-9, 0.03, 0.08]
        .map(|share| (law(share * survey.load(joint)), 3, otherwise(joint, survey)))
        .into()
}

/// Friction of so many Nm decides under smaller loads, larger ones push the joint to their side; blurred over some torque.
/// Positive: friction leaves the joint on the side to which it came; negative: it trails on the other one.
pub(super) fn mixed(joint: usize, survey: &Survey) -> RatedLaws {
    if !survey.is_loaded(joint) || !survey.both_directions(joint) {
        return Vec::new();
    }
    let mut loads: Vec<f64> = survey.torques(joint).map(f64::abs).collect();
    loads.sort_by(f64::total_cmp);
    let shares =
        [0.05, 0.15, 0.3, 0.5].map(|share| loads[((loads.len() - 1) as f64 * share) as usize]);
    let tried = shares.map(|friction| (friction, *BENDS * BLURS.len(), otherwise(joint, survey)));
    let known = known(joint, survey).map(|friction| (friction, BLURS.len(), 0.0));
    let laws = known
        .into_iter()
        .chain(tried)
        .flat_map(|(friction, tried, rare)| {
            let of_friction = move |friction: f64| {
                BLURS.map(|blur| (pushed(joint, friction, blur * friction.abs()), tried, rare))
            };
            [friction, -friction].into_iter().flat_map(of_friction)
        });
    laws.collect()
}

fn pushed(joint: usize, friction_nm: f64, width: f64) -> Law {
    let basis = if width > 0.0 {
        Basis::Rise { centre: 0.0, width }
    } else {
        Basis::Sign
    };
    Law::new(Variable::Push { joint, friction_nm }, basis)
}

/// Friction of a joint (Nm) by the torques of the arm, where they are known and some load is larger: below it, approach alone decides.
fn known(joint: usize, survey: &Survey) -> Option<f64> {
    let friction = survey.robot.description().joints[joint].coulomb?;
    (friction > 0.0 && friction < survey.load(joint)).then_some(friction)
}

/// How much rarer another friction is than a known one.
fn otherwise(joint: usize, survey: &Survey) -> f64 {
    if survey.both_directions(joint) && known(joint, survey).is_some() {
        *RARE
    } else {
        0.0
    }
}

/// Other thresholds and blurs.
pub(super) fn near_push(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    let Variable::Push { joint, friction_nm } = term.law().first.variable else {
        return Vec::new();
    };
    let width = if let Basis::Rise { width, .. } = term.basis() {
        width
    } else {
        0.0
    };
    if known(joint, survey) == Some(friction_nm.abs()) {
        return Vec::new();
    }
    let bounds = THRESHOLDS.map(|share| share * survey.load(joint));
    let scaled = |value: f64| {
        let sizes = [1.6, 1.25]
            .into_iter()
            .flat_map(move |first| around(value.abs(), first, 0.5, level, bounds));
        sizes.map(move |size| libm::copysign(size, value))
    };
    let wider = scaled(width)
        .filter(|_| width > 0.0)
        .map(|width| pushed(joint, friction_nm, width));
    scaled(friction_nm)
        .map(|friction_nm| pushed(joint, friction_nm, width))
        .chain(wider)
        .map(|law| term.with(law))
        .collect()
}

/// Why no play is as a term with a half-gap has it: a threshold that no load reached, or a gap below nothing.
pub(super) fn impossible_play(
    term: &Term,
    half_gap: f64,
    error: f64,
    survey: &Survey,
) -> Option<String> {
    if let Variable::Push { joint, friction_nm } = term.law().first.variable {
        let most = survey.recorded_load(joint);
        let [friction, largest] = [friction_nm.abs(), most].map(|torque| figure(torque, 0));
        if friction_nm.abs() > most {
            return Some(format!(
                "its threshold of {friction} Nm lies beyond the largest recorded load of {largest} Nm"
            ));
        }
    }
    (half_gap < -error).then(|| "its gap is negative".into())
}

/// Pre-sliding over travels that some moves are shorter than.
pub(super) fn slip(joint: usize, survey: &Survey) -> RatedLaws {
    let shortly = |travel: &f64| {
        let moves = survey
            .rows
            .iter()
            .map(|row| survey.data.last_move(*row, joint).abs());
        moves
            .filter(|moved| *moved > 0.0 && *moved < SLID * travel)
            .take(ROWS)
            .count()
            == ROWS
    };
    let travels = TRAVELS
        .into_iter()
        .filter(|travel| survey.both_directions(joint) && shortly(travel));
    travels
        .map(|travel| {
            (
                Law::of(Variable::Slip { joint, travel }),
                TRAVELS.len(),
                0.0,
            )
        })
        .collect()
}

/// Other travels.
pub(super) fn near_slip(term: &Term, level: i32) -> Vec<Term> {
    let Variable::Slip { joint, travel } = term.law().first.variable else {
        return Vec::new();
    };
    let travels = around(travel, 1.6, 0.5, level, BOUNDS);
    travels
        .map(|travel| term.with(Law::of(Variable::Slip { joint, travel })))
        .collect()
}

// How far something has warmed up: by the measured temperature, at once or behind it, by time since the start, or by a joint's own work.

/// The source from which a warmth is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Warmth {
    /// The recorded temperature above the first one (K), at once or with a lag: what was measured need not be what grows.
    Temperature,
    /// Time since the start, which stands for a temperature that nobody measured; 1 in the end.
    WarmUp,
    /// How fast the joint moved of late; 1 at its most.
    Work,
}

/// Time constants as shares of the recording: of warm-ups, lags, and the cooling of a joint.
const WARM_UPS: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.5];
const LAGS: [f64; 3] = [0.03, 0.1, 0.3];
const COOLINGS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// Shortest and longest time constant, in the same shares: the one is a step at the start, the other a straight line.
const CONSTANTS: [f64; 2] = [0.02, 10.0];
/// The same of what lags: far behind, it no longer follows.
const BEHIND: [f64; 2] = [0.005, 2.0];

impl Warmth {
    /// What the recording offers, and of how many of its kind each is one.
    pub(super) fn laws(self, joint: Option<usize>, survey: &Survey) -> Vec<(Law, usize)> {
        let [start, end] = survey.time;
        let shared = |shares: &'static [f64]| {
            shares
                .iter()
                .filter(move |_| end > start)
                .map(move |share| share * (end - start))
        };
        let above = |variable| {
            survey
                .reference_c
                .map(|zero| Law::new(variable, Basis::Linear { zero, per: 1.0 }))
        };
        let kinds = 1 + 2 * usize::from(survey.reference_c.is_some());
        match (self, joint) {
            (Self::Temperature, _) => {
                let lagging = shared(&LAGS).filter_map(|lag| above(Variable::Lagging { lag }));
                let measured = above(Variable::Temperature).map(|law| (law, kinds));
                measured
                    .into_iter()
                    .chain(lagging.map(|law| (law, kinds * LAGS.len())))
                    .collect()
            }
            (Self::WarmUp, _) => {
                let law = |constant| Law::new(Variable::Time, Basis::Settling { start, constant });
                shared(&WARM_UPS)
                    .map(|constant| (law(constant), kinds * WARM_UPS.len()))
                    .collect()
            }
            (Self::Work, Some(joint)) if survey.data.has_clock() => {
                let law = |cooling| {
                    let heat =
                        |row: &usize| survey.data.memory(Memory::Work { joint, cooling }, *row);
                    let per = survey.rows.iter().map(heat).fold(0.0, f64::max);
                    (per > 0.0).then(|| {
                        Law::new(
                            Variable::Work { joint, cooling },
                            Basis::Linear { zero: 0.0, per },
                        )
                    })
                };
                let laws: Vec<Law> = shared(&COOLINGS).filter_map(law).collect();
                let tried = 3 * laws.len();
                laws.into_iter().map(|law| (law, tried)).collect()
            }
            (Self::Work, _) => Vec::new(),
        }
    }

    /// What the number of a law is called that follows it.
    pub(super) fn number(self) -> &'static str {
        match self {
            Self::Temperature => "per_kelvin",
            Self::WarmUp => "in_the_end",
            Self::Work => "at_most_work",
        }
    }

    pub(super) fn is(self, variable: Variable, basis: Basis) -> bool {
        match self {
            Self::Temperature => {
                matches!(variable, Variable::Temperature | Variable::Lagging { .. })
            }
            Self::WarmUp => matches!((variable, basis), (Variable::Time, Basis::Settling { .. })),
            Self::Work => matches!(variable, Variable::Work { .. }),
        }
    }
}

/// The time constant of a term that follows a warmth, if it has one, s.
pub(super) fn time_constant(term: &Term) -> Option<f64> {
    match (term.law().first.variable, term.basis()) {
        (Variable::Lagging { lag: time } | Variable::Work { cooling: time, .. }, _) => Some(time),
        (_, Basis::Settling { constant, .. }) => Some(constant),
        _ => None,
    }
}

/// Why a term cannot follow a warmth: its time constant is beyond what the recording can show, which only a straight line is left of.
pub(super) fn impossible_warmth(term: &Term, survey: &Survey) -> Option<String> {
    let time = time_constant(term)?;
    let (clock, length) = (Clock::of(survey.data), survey.length());
    // What ends at the bound would go on beyond it.
    let beyond = time >= SLOWEST * CONSTANTS[1] * length;
    beyond.then(|| {
        format!(
            "its time constant of {} is ten times as long as the recording ({})",
            clock.span(time),
            clock.span(length)
        )
    })
}

/// A time constant of this share of its bound is at the bound.
const SLOWEST: f64 = 0.99;

/// Other time constants around that of a term's first factor.
pub(super) fn near_warmth(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    let bounds = |shares: [f64; 2]| shares.map(|share| share * survey.length());
    match (term.law().first.variable, term.basis()) {
        (Variable::Lagging { lag }, _) => {
            let lags = around(lag, 1.7, 0.5, level, bounds(BEHIND));
            lags.map(|lag| term.with(term.law().by(Variable::Lagging { lag })))
                .collect()
        }
        (Variable::Work { joint, cooling }, _) => {
            let coolings = around(cooling, 1.5, 0.5, level, bounds(CONSTANTS));
            coolings
                .map(|cooling| term.with(term.law().by(Variable::Work { joint, cooling })))
                .collect()
        }
        (_, Basis::Settling { start, constant }) => {
            let constants = around(constant, 1.5, 0.5, level, bounds(CONSTANTS));
            term.with_bases(constants.map(|constant| Basis::Settling { start, constant }))
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Unknown;
    use crate::robot::{Measurements, PointReadings, small_arm};
    use nalgebra::Vector3;

    const ROWS: usize = 60;

    /// What may have moved with the payload of a joint that follows it, and whether a zero that moves in the middle is proposed.
    fn moved_by(payload: impl Fn(usize) -> f64) -> (Option<(&'static str, Place)>, bool) {
        let robot = small_arm();
        let data = Measurements {
            joints: 2,
            q: (0..2 * ROWS).map(|k| (k as f64 * 0.7).sin()).collect(),
            points: PointReadings::new(vec![Vector3::zeros(); ROWS], 1e-5),
            payload: (0..ROWS).map(payload).collect(),
            time: Some((0..ROWS).map(|row| 10.0 * row as f64).collect()),
            ..Measurements::default()
        };
        let rows: Vec<usize> = (0..ROWS).collect();
        let (torque, compliance) = (vec![0.0; 2 * ROWS], vec![0.0; 2]);
        let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
        let joint = Motion::Joint { joint: 1 };
        let form = Form::from(Term::new(&Unknown, joint, Law::of(Variable::Payload)));
        let middle = |(law, ..): &(Law, usize, f64)| matches!(law.first.basis, Basis::After { at } if (at - 295.0).abs() <= 10.0);
        (
            moved_with_the_payload(&form, &survey),
            changes(joint, &survey).iter().any(middle),
        )
    }

    #[test]
    fn what_follows_a_payload_that_changes_once_may_have_moved_then_and_no_zero_is_proposed_in_its_stead()
     {
        let shift = Some((names::ZERO_SHIFT, Place::Joint(1)));
        assert_eq!(
            moved_by(|row| if row < ROWS / 2 { 0.0 } else { 5.0 }),
            (shift, false)
        );
        assert_eq!(
            moved_by(|row| if row % 10 < 5 { 0.0 } else { 5.0 }),
            (None, true)
        );
        // The lightest two of three payloads differ, too.
        assert_eq!(
            moved_by(|row| [0.0, 2.0, 5.0][3 * row / ROWS]),
            (None, true)
        );
    }
}

//! `unknown`: laws without a name, for what no cause of the list explains: placed and described, never christened.

mod words;

use super::basis::around;
use super::instrument_laws;
use super::joint_table::PLAUSIBLE;
use super::motion::{SHORT, extent};
use super::orders;
use super::unweighed_windup::is_unweighed;
use super::{
    Axes, Basis, Cause, Form, Hypothesis, Law, Motion, NamedForms, NumberSpec, Place, Polar, Summary, Survey, Term, Variable,
    about, names, warmth,
};
use super::{frames, interactions};
use crate::criteria::effect::{HARDLY_EVER, LOW_ORDERS, OPEN, RARE, RARER, UNCOMMON};
use crate::criteria::words::SLOW;
use crate::robot::RobotModel;
use crate::units::Unit;
use words::in_words;

/// Structure of no law of the list.
pub struct Unknown;

/// Cosines of a smooth function of one variable, of a frame in time, and of each of two.
const CURVE: usize = 8;
const EACH: usize = 3;
/// Rows within a bump's width: fewer make a bump of any single wrong point.
const SUPPORT: usize = 5;
/// The widest bump or step as a share of the joint's travel.
const LOCAL: f64 = 0.2;
/// Widths (rad; m of a joint that slides) and spacing of bumps.
const WIDTHS: [f64; 3] = [0.08, 0.16, 0.32];
/// Powers of time by which something creeps.
const POWERS: [f64; 2] = [0.3, 3.0];
/// Periods of a sway as shares of the recording.
const SWAYS: [f64; 6] = [0.1, 0.14, 0.2, 0.28, 0.4, 0.57];
/// Shortest and longest period, in the same shares: beyond one period a sway is a drift.
const PERIODS: [f64; 2] = [0.05, 1.0];
/// Orders in another joint's angle.
const ORDERS: u32 = 3;
/// One sigma of what is known of a coefficient before any measurement, SI.
const WIDE: f64 = 0.01;
const PER_LOAD: f64 = 1e-4;

impl Unknown {
    fn at_joint(survey: &Survey, joint: usize) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        let unweighed = is_unweighed(survey.robot);
        let mut add = |law: Law, tried: usize, penalty: f64| {
            let term = Term::new(&Self, Motion::Joint { joint }, law);
            let weight = if unweighed && is_hose(&term) { *HARDLY_EVER } else { 0.0 };
            out.push(Hypothesis::new(term, tried).penalised(*OPEN + weight + penalty));
        };
        let own = |basis| Law::new(Variable::Angle { joint }, basis);
        let [low, high] = survey.range[joint];
        let places = (survey.travel(joint) / 0.1) as usize + 1;
        // Centre and width are fitted, too: as much as two numbers in the criterion.
        let two_numbers = 3 * survey.rows.len();
        for width in WIDTHS {
            let count = ((high - low - 0.5 * width) / width).ceil().max(0.0) as usize;
            let centres = (0..count).map(|k| low + width * (k as f64 + 0.5));
            for centre in centres.filter(|centre| supported(survey, joint, *centre, width)) {
                add(own(Basis::Bump { centre, width }), two_numbers, 0.0);
                if width > WIDTHS[0] {
                    add(own(Basis::Rise { centre, width }), two_numbers, 0.0);
                }
            }
        }
        for share in [0.25, 0.5, 0.75] {
            for upwards in [true, false] {
                add(own(Basis::Hinge { from: low + share * (high - low), upwards }), places, 0.0);
            }
        }
        interactions::at_joint(survey, joint).into_iter().for_each(|(law, tried)| add(law, tried, *UNCOMMON));
        for by in 0..survey.joints() {
            let cosines = |joint: usize, count| {
                let [low, high] = survey.range[joint];
                Basis::Cosines { low, high, count }
            };
            let angle = Variable::Angle { joint: by };
            add(Law::new(angle, cosines(by, CURVE)), 1, 0.0);
            // What slides has no turns.
            let turns = |joint: usize| survey.robot.is_revolute(joint);
            if by != joint && turns(by) {
                (1..=ORDERS)
                    .for_each(|order| add(Law::new(angle, Basis::Wave { order, overtone: false }), *LOW_ORDERS, *HARDLY_EVER));
            }
            for other in by + 1..survey.joints() {
                let (second, wave) = (Variable::Angle { joint: other }, Basis::Wave { order: 1, overtone: false });
                if turns(by) && turns(other) {
                    add(Law::new(angle, wave).times(second, wave), 3, 0.0);
                }
                add(Law::new(angle, cosines(by, EACH)).times(second, cosines(other, EACH)), 1, 0.0);
            }
        }
        let [start, end] = survey.time;
        if end > start {
            add(Law::new(Variable::Time, Basis::Cosines { low: start, high: end, count: CURVE }), 1, 0.0);
            add(Law::new(Variable::Time, Basis::Creep { start, end, exponent: 1.0 }), 1, *RARE);
        }
        out
    }
}

impl Cause for Unknown {
    about! {
        name: names::UNKNOWN,
        place: "joint, link, base, tool or tracker",
        formula: "a form-free function of joints, time, payload or sight",
        size: "any",
        confounded: "whatever is in no list",
        needs: "-",
        absorbs_residual: &[names::GEAR_CYCLIC, names::JOINT_TABLE],
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let mut out: Vec<Hypothesis> = (0..survey.joints()).flat_map(|joint| Self::at_joint(survey, joint)).collect();
        let mut add = |motion, law, tried, penalty: f64| {
            out.push(Hypothesis::new(Term::new(&Self, motion, law), tried).penalised(*OPEN + penalty));
        };
        let [start, end] = survey.time;
        if end > start {
            let slow = Law::new(Variable::Time, Basis::Cosines { low: start, high: end, count: EACH });
            add(Motion::Base { axes: Axes::Both }, slow, 1, 0.0);
            for share in SWAYS {
                let sway = Law::new(Variable::Time, Basis::Sway { period: share * (end - start) });
                for axes in [Axes::Place, Axes::Rotation] {
                    add(Motion::Base { axes }, sway, 2 * SWAYS.len(), 0.0);
                }
            }
        }
        let tool = Motion::Tool { axes: Axes::Place };
        // A seat with play: other on either side of an axis. A mounting that yields: by the direction of gravity.
        (0..3).for_each(|axis| add(tool, Law::new(Variable::Gravity { axis: Some(axis) }, Basis::Sign), 3, 0.0));
        add(tool, Law::of(Variable::Gravity { axis: None }), 1, 0.0);
        for (law, tried) in warmth::all(survey) {
            // A link that grows askew: by another direction as the next joint turns.
            for link in 0..survey.joints().saturating_sub(1) {
                let law = match law.first.basis {
                    // Nobody knows at which temperature it is straight.
                    Basis::Linear { zero, per } => law.with(Basis::Straight { zero, per }),
                    _ => law,
                };
                let bent = law.times(Variable::Angle { joint: link + 1 }, Basis::Wave { order: 1, overtone: false });
                let long = extent(survey.robot, link).norm() > SHORT;
                if long && survey.robot.is_revolute(link + 1) {
                    add(Motion::Links { first: link, last: link }, bent, tried, *RARER)
                }
            }
        }
        for (motion, law, tried, penalty) in frames::laws(survey) {
            add(motion, law, tried, penalty);
        }
        for (of, law, tried, penalty) in instrument_laws::laws(survey, &SWAYS) {
            add(Motion::Instrument { of }, law, tried, penalty);
        }
        if survey.payload_changes() {
            let loaded = Law::new(Variable::Payload, Basis::After { at: survey.heavy_payload() });
            add(tool, loaded, 1, *RARER);
            add(Motion::Base { axes: Axes::Both }, loaded, 1, *RARER);
        }
        out
    }

    fn numbers(&self, term: &Term, robot: &RobotModel) -> Vec<NumberSpec> {
        let counted = 1..=term.law().count();
        match term.motion() {
            Motion::Joint { .. } => {
                let loaded = term.law().times.is_some_and(|factor| matches!(factor.of, Variable::Load { .. }));
                let per_load = term.law().times.is_some_and(|factor| loaded && factor.basis == Basis::PROPORTIONAL);
                let unit = if per_load { Unit::RadianPerNewtonMetre } else { term.motion().unit(robot) };
                let sigma = match loaded {
                    true => PER_LOAD,
                    false if term.is_own_curve() => PLAUSIBLE,
                    false => WIDE,
                };
                counted.map(|k| (format!("c{k}"), unit, sigma)).collect()
            }
            Motion::Instrument { of } => {
                let unit = if of == Polar::Range { Unit::Millimetre } else { Unit::Radian };
                counted.map(|k| (format!("c{k}"), unit, if of == Polar::Range { 1e-3 } else { 1e-4 })).collect()
            }
            Motion::Axis { about, .. } => {
                let axes = ["a", "b"].into_iter().enumerate().filter(|(axis, _)| about.is_none_or(|about| about == *axis));
                axes.flat_map(|(_, axis)| counted.clone().map(move |k| (format!("{axis}{k}"), Unit::Radian, WIDE))).collect()
            }
            Motion::Links { .. } => counted.map(|k| (format!("c{k}"), Unit::One, WIDE)).collect(),
            Motion::Slide { along: true, .. } => counted.map(|k| (format!("s{k}"), Unit::Millimetre, WIDE)).collect(),
            Motion::Slide { .. } => ["u", "v"]
                .iter()
                .flat_map(|axis| counted.clone().map(move |k| (format!("{axis}{k}"), Unit::Millimetre, WIDE)))
                .collect(),
            Motion::Bend { .. } => ["a", "b"]
                .iter()
                .flat_map(|axis| counted.clone().map(move |k| (format!("{axis}{k}"), Unit::Radian, WIDE)))
                .collect(),
            motion => {
                let numbers = counted.flat_map(|k| motion.frame_numbers(move |axis| format!("{axis}{k}")));
                numbers.map(|(name, unit, _)| (name, unit, WIDE)).collect()
            }
        }
    }

    fn prior_sigma(&self, term: &Term) -> Option<f64> {
        let loaded = term.law().times.is_some_and(|factor| matches!(factor.of, Variable::Load { .. }));
        let of_joint = matches!(term.motion(), Motion::Joint { .. });
        (of_joint && !loaded && !term.is_own_curve()).then_some(orders::LARGE)
    }

    fn near(&self, term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
        match term.basis() {
            Basis::Bump { centre, width } | Basis::Rise { centre, width } => {
                let Some((joint, _)) = term.of_one() else { return Vec::new() };
                let step = libm::exp2(-f64::from(level));
                let power = libm::exp2(-0.5 * f64::from(level));
                let widths = [0.75, 1.0, 1.33].map(|factor| width * libm::pow(factor, power));
                let centres = [-0.4, 0.0, 0.4].map(|share| centre + share * width * step);
                let pairs = centres.into_iter().flat_map(|centre| widths.map(|width| (centre, width)));
                let pairs = pairs.filter(|pair| *pair != (centre, width));
                let pairs = pairs.filter(|(centre, width)| supported(survey, joint, *centre, *width));
                let bump = matches!(term.basis(), Basis::Bump { .. });
                let shape = |(centre, width)| if bump { Basis::Bump { centre, width } } else { Basis::Rise { centre, width } };
                term.with_bases(pairs.map(shape))
            }
            Basis::Hinge { from, upwards } => {
                let Variable::Angle { joint } = term.law().first.of else { return Vec::new() };
                let [low, high] = survey.range[joint];
                let step = 0.12 * (high - low) * libm::exp2(-0.7 * f64::from(level));
                let places = [from - step, from + step].into_iter().filter(|at| *at > low && *at < high);
                term.with_bases(places.map(|from| Basis::Hinge { from, upwards }))
            }
            Basis::Sway { period } => {
                let bounds = PERIODS.map(|share| share * (survey.time[1] - survey.time[0]));
                let periods = around(period, 1.15, 0.7, level, bounds);
                term.with_bases(periods.map(|period| Basis::Sway { period }))
            }
            Basis::Creep { start, end, exponent } => {
                let exponents = around(exponent, 1.5, 0.7, level, POWERS);
                term.with_bases(exponents.map(|exponent| Basis::Creep { start, end, exponent }))
            }
            _ => warmth::near(term, survey, level),
        }
    }

    fn variant(&self, term: &Term) -> String {
        let label = |of: &Variable| match of {
            Variable::Gravity { axis: Some(axis) } => format!("gravity_{}", ["x", "y", "z"][*axis]),
            Variable::Stretch { joint, .. } => format!("stretch_{}", joint + 1),
            Variable::Recent { joint, .. } => format!("recent_{}", joint + 1),
            Variable::Position { along } | Variable::Sighted { along } => {
                format!("position_{}", along.map(|value| format!("{:.0}", 100.0 * value)).join("_"))
            }
            of => of.to_string().replace(' ', "_"),
        };
        let names: Vec<String> = term.law().variables().iter().map(label).collect();
        let shape = match term.basis() {
            Basis::Linear { .. } => "_line".into(),
            Basis::After { at } => format!("_after_{at:.0}"),
            _ => String::new(),
        };
        if let Motion::Instrument { of } = term.motion() {
            return format!("{of:?}_{}{shape}", names.join("_")).to_lowercase();
        }
        let curve = term.law().factors().any(|factor| factor.basis.is_curve());
        let moves = match term.motion() {
            Motion::Slide { along: true, .. } => "along_",
            Motion::Slide { .. } => "across_",
            Motion::Bend { .. } => "bent_",
            Motion::Axis { turning: true, .. } => "axis_turning_",
            Motion::Axis { .. } => "axis_",
            Motion::Base { axes: Axes::Rotation } => "turned_",
            _ => "",
        };
        if !moves.is_empty() || curve && term.law().times.is_some() {
            return format!("{moves}{}{shape}", names.join("_"));
        }
        match (term.basis(), term.law().first.of) {
            (Basis::Hinge { .. }, _) => "hinge".into(),
            (Basis::Bump { .. }, _) => "bump".into(),
            (Basis::Rise { .. }, _) => "step".into(),
            (Basis::Sway { .. }, _) => {
                if term.motion() == (Motion::Base { axes: Axes::Rotation }) { "rock" } else { "sway" }.into()
            }
            (Basis::Creep { .. }, _) => "creep".into(),
            (Basis::Sign, Variable::Gravity { .. }) => "side".into(),
            (_, Variable::Gravity { .. }) if curve => names.join("_"),
            (_, Variable::Gravity { .. }) => "sag".into(),
            (Basis::After { at }, Variable::Time) => format!("after_{at:.0}"),
            (Basis::Cosines { .. }, Variable::Time) if term.law().times.is_none() => "time".into(),
            (_, Variable::Temperature) if curve => "warm_curve".into(),
            (Basis::Settling { .. }, _) | (_, Variable::Temperature) => "warm".into(),
            (_, Variable::Payload) => "payload".into(),
            (_, Variable::Approach { .. } | Variable::Load { .. }) => format!("{}{shape}", names.join("_")),
            _ => format!("{}{shape}", names.join("_")),
        }
    }

    /// A joint that follows a function of its own angle and a neighbour's: a hose runs along both and pulls.
    fn called(&self, term: &Term, _p: &[f64], _survey: &Survey) -> &'static str {
        if is_hose(term) { names::CABLE_DRAG } else { names::UNKNOWN }
    }

    fn sentence(&self, summary: &Summary) -> String {
        let law = described(summary).unwrap_or_default();
        format!("{} has an error that no entry of the library explains: {law}", summary.place)
    }

    fn is_nameless(&self) -> bool {
        true
    }

    /// What goes in proportion with an angle, or once or twice a turn with it, is a part of a joint's function of that angle and another.
    fn has_part(&self, own: &NamedForms, part: &NamedForms, _survey: &Survey) -> bool {
        let angles = own.forms.iter().find_map(|form| form.term()?.two_angles());
        let (Some(angles), Place::Joint(joint)) = (angles, own.place) else { return false };
        let is_part = |form: &&Form| match (form.place(), form.term().map(Term::basis)) {
            (Place::Coupled(by, moved), _) => moved == joint && angles.contains(&by),
            (at, Some(Basis::Wave { order, .. })) if form.name() == names::GEAR_CYCLIC => {
                at == Place::Joint(joint) && angles.contains(&joint) && order <= *SLOW
            }
            _ => false,
        };
        part.forms.iter().all(is_part)
    }

    fn identities(&self, term: &Term, called: &str) -> Vec<(&'static str, Place)> {
        let place = term.motion().place();
        let joint = matches!(place, Place::Joint(_));
        match (term.basis(), term.law().first.of) {
            (Basis::Wave { .. }, Variable::Angle { joint: by }) if term.law().times.is_none() => {
                vec![(names::AXIS_WOBBLE, Place::Joint(by))]
            }
            // No motor current tells of a pull.
            _ if called == names::CABLE_DRAG => vec![(names::UNKNOWN, place)],
            _ if joint && term.two_angles().is_some() => vec![(names::CABLE_DRAG, place)],
            _ => Vec::new(),
        }
    }
}

/// Whether a joint follows a function of its own angle and a neighbour's.
pub(super) fn is_hose(term: &Term) -> bool {
    let Place::Joint(joint) = term.motion().place() else { return false };
    term.two_angles().is_some_and(|[a, b]| (a == joint || b == joint) && a.abs_diff(b) == 1)
}

/// Whether a bump or step is local, and enough rows lie within it: a wide one stands in for any law of the angle.
fn supported(survey: &Survey, joint: usize, centre: f64, width: f64) -> bool {
    let [low, high] = survey.range[joint];
    if width > LOCAL * (high - low) || !(low..=high).contains(&centre) {
        return false;
    }
    let within = |row: &&usize| (survey.data.q(**row)[joint] - centre).abs() < width;
    survey.rows.iter().filter(within).take(SUPPORT).count() == SUPPORT
}

/// What a finding's law without a name is a function of and how, in words; none where it has no such law.
pub(super) fn described(summary: &Summary) -> Option<String> {
    let (term, numbers) = summary.estimates(names::UNKNOWN).next()?;
    // A joint that slides errs by a length.
    let slides = matches!(term.motion(), Motion::Joint { .. }) && numbers.first().is_some_and(|number| number.unit == "mm");
    Some(in_words(term, slides, summary.clock))
}

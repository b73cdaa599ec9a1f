//! The cells that have a name: each cause of the library at each of its places, in the shapes that it proposes and as curves of the same
//! physics.

use super::cell::{
    CauseCell, CellShape, FreeShape, Over, ShapeGroup, Shapes, has_few, line, not_quite_straight,
    support,
};
use super::generated;
use crate::criteria::cells::{BENT, COMMON, RARE, RARER};
use crate::criteria::effect;
use crate::diagnose::types::Question;
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::{
    AxisPoint, Basis, CAUSES, DeclaredForm, Form, Hypothesis, Law, Motion, Place, Survey, Term,
    Unknown, Variable, cause, names,
};
use crate::robot::RobotModel;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// Causes that most arms have; all others of the list are rare.
const OF_MOST_ARMS: [&str; 11] = [
    names::JOINT_COMPLIANCE,
    names::GEAR_CYCLIC,
    names::BACKLASH,
    names::ZERO_SHIFT,
    names::AXIS_WOBBLE,
    names::LINK_COMPLIANCE,
    names::BASE_COMPLIANCE,
    names::THERMAL_GROWTH,
    names::TRACKER_DRIFT,
    names::TRACKER_CIRCLE,
    names::TRACKER_ELEVATION,
];

/// ln of the prior odds of a cell of a cause, those of a user's own as of a common one; `weight` multiplies the rarity.
fn log_prior(name: &str, place: Place, weight: f64) -> f64 {
    let odds = match name {
        names::CABLE_DRAG => *RARER,
        // The first link bends as its foundation tilts, and foundations yield more often.
        names::LINK_COMPLIANCE if place == Place::Links(0, 0) => *RARE,
        name if OF_MOST_ARMS.contains(&name) || cause(name).is_none() => *COMMON,
        _ => *RARE,
    };
    COMMON.ln() + weight * (odds / *COMMON).ln()
}

/// The cause under whose name a form is a cell: a joint yields to its load in one way, in proportion or not.
fn cell_of(cause: &str) -> &str {
    if cause == names::JOINT_HARDENING {
        names::JOINT_COMPLIANCE
    } else {
        cause
    }
}

/// All cells of causes. Those of a name that is not to be given stay, as rare as a cell without a name, and are `unknown`: what they explain
/// would take the name of a neighbour.
pub(super) fn cells(
    survey: &Survey,
    values: &dyn Fn(Variable) -> Option<Vec<f64>>,
    question: &Question,
) -> Vec<CauseCell> {
    let Question {
        without,
        declared,
        prior_weight,
        ..
    } = *question;
    let mut all: BTreeMap<(Cow<'static, str>, Place), Vec<Hypothesis>> = BTreeMap::new();
    // What is a cell of its own without a name, or no cell at all.
    let other = [
        names::UNKNOWN,
        names::JOINT_TABLE,
        names::OUTLIER,
        names::MISLABELLED_POINT,
    ];
    let causes = CAUSES.iter().filter(|cause| !other.contains(&cause.name()));
    let proposed = causes.flat_map(|cause| cause.propose(survey));
    let proposed = proposed.chain(
        declared
            .iter()
            .flat_map(|cause| DeclaredForm::hypotheses(cause, survey)),
    );
    for hypothesis in proposed {
        let name = cell_of(hypothesis.form.name()).to_string();
        let key = (name.into(), hypothesis.form.place());
        all.entry(key).or_default().push(hypothesis);
    }
    for joint in survey.revolute() {
        let pulled = hoses(survey, joint);
        if !pulled.is_empty() {
            all.entry((names::CABLE_DRAG.into(), Place::Joint(joint)))
                .or_default()
                .extend(pulled);
        }
    }
    let cell = |((name, place), hypotheses): ((Cow<'static, str>, Place), Vec<Hypothesis>)| {
        let unusual = unusual(&hypotheses);
        let mut groups = weighed(hypotheses, survey.robot);
        groups.extend(curves(&name, place, &groups, values, survey.joints()));
        let is_named = !without.iter().any(|out| *out == name);
        CauseCell {
            key: format!("{name}@{place}"),
            log_prior: if is_named {
                log_prior(&name, place, prior_weight) - prior_weight * unusual
            } else {
                generated::prior_odds(question).ln()
            },
            name: if is_named {
                name
            } else {
                names::UNKNOWN.into()
            },
            place,
            shapes: Shapes::Listed(groups),
            between: None,
        }
    };
    all.into_iter().map(cell).collect()
}

/// By how much, in ln of odds, the commonest form of a cell is rarer than what is rare.
fn unusual(hypotheses: &[Hypothesis]) -> f64 {
    let least = hypotheses
        .iter()
        .map(|hypothesis| hypothesis.prior_penalty)
        .fold(f64::INFINITY, f64::min);
    0.5 * (least - *effect::RARE).max(0.0)
}

/// The forms of a cell, weighed by how many like them are tried and how rare they are among each other.
fn weighed(hypotheses: Vec<Hypothesis>, robot: &RobotModel) -> Vec<ShapeGroup> {
    let weight =
        |hypothesis: &Hypothesis| (-0.5 * hypothesis.prior_penalty).exp() / hypothesis.tried;
    let sum: f64 = hypotheses.iter().map(weight).sum();
    let plain = hypotheses.iter().map(weight).fold(0.0, f64::max);
    let one = |hypothesis: Hypothesis| {
        let weight = weight(&hypothesis);
        let is_hardening = hypothesis.form.name() == names::JOINT_HARDENING;
        let is_bent = is_hardening || weight < 0.5 * plain && hypothesis.tried > 1.0;
        let shape = |shares, part: f64| CellShape {
            is_bent,
            ..CellShape::new(shares, (part * weight / sum).ln())
        };
        let shapes = if is_hardening {
            let shares = bent_shares(hypothesis.form.numbers(robot).len());
            vec![shape(shares, 0.5), shape(Vec::new(), 0.5)]
        } else {
            vec![shape(Vec::new(), 1.0)]
        };
        ShapeGroup {
            forms: vec![hypothesis.form],
            shapes,
            positive: hypothesis.positive,
            largest: hypothesis.largest,
        }
    };
    hypotheses.into_iter().map(one).collect()
}

/// Shares of a line and of a bend that is a part of it: the two hardly grow against each other.
fn bent_shares(count: usize) -> Vec<f64> {
    let bend = BENT[1] * BENT[1];
    let each = bend / (1.0 + bend) / (count.max(2) - 1) as f64;
    std::iter::once(1.0 / (1.0 + bend))
        .chain(std::iter::repeat_n(each, count.max(2) - 1))
        .collect()
}

/// Curves that are the same physics as a cause's own laws.
fn curves(
    name: &str,
    place: Place,
    groups: &[ShapeGroup],
    values: &dyn Fn(Variable) -> Option<Vec<f64>>,
    joints: usize,
) -> Vec<ShapeGroup> {
    let Place::Joint(joint) = place else {
        return Vec::new();
    };
    let (motion, load) = (Motion::Joint { joint }, Variable::Load { joint });
    let mut forms = groups.iter().flat_map(|group| &group.forms);
    match name {
        names::JOINT_COMPLIANCE => {
            let line = forms.find(|form| form.name() == name);
            let line =
                line.filter(|form| form.variables() == [load] && form.compliance(&[1.0]).is_some());
            let curve = line.cloned().zip(values(load));
            curve
                .and_then(|(line, values)| not_quite_straight(line, motion, load, &values))
                .into_iter()
                .collect()
        }
        names::BACKLASH => {
            let gap = Variable::Approach { joint };
            let loads = values(load).filter(|values| line(values).is_some());
            let Some(loads) = loads.filter(|_| forms.any(|form| form.variables() == [gap])) else {
                return Vec::new();
            };
            let ([low, high], count) = (support(&loads), 8);
            let law = Law::of(gap).times(load, Basis::Series { low, high, count });
            let shares = vec![0.5, 0.3, 0.12, 0.04, 0.02, 0.01, 0.006, 0.004];
            vec![ShapeGroup::new(
                vec![Term::new(&Unknown, motion, law).into()],
                vec![CellShape::bent(shares, 0.3_f64.ln())],
            )]
        }
        names::AXIS_WOBBLE => {
            let variable = Variable::Angle { joint };
            let Some(values) = values(variable).filter(|values| !has_few(values)) else {
                return Vec::new();
            };
            let lengths = 3;
            let free = |turning| FreeShape {
                motion: Motion::Axis {
                    joint,
                    about: None,
                    turning,
                    at: AxisPoint::Own,
                },
                variable,
                over: Over::Curve {
                    count: 12,
                    first: 12,
                    lengths,
                },
            };
            let log_weight = 0.3_f64.ln() - ((2 * lengths) as f64).ln();
            let axis = [true, false].into_iter();
            let axis = axis.flat_map(|turning| free(turning).curves(&values, log_weight));
            // About the middle of the link that the joint moves.
            let bends = [1, 2].into_iter().filter(|_| joint + 1 < joints);
            let bends = bends.map(|order| {
                let law = Law::new(variable, wave(order));
                let form = Term::new(&Unknown, Motion::Bend { link: joint }, law).into();
                ShapeGroup::of(form, 0.05_f64.ln())
            });
            axis.chain(bends).collect()
        }
        _ => Vec::new(),
    }
}

/// The forms of a name at a place as a search looks at them first, one at a time; where there are none, all places of that name.
pub(crate) fn forms_of(
    (name, place): (&str, Place),
    question: &Question,
    survey: &Survey,
    problem: &WhitenedProblem,
) -> Result<Vec<Form>, BTreeSet<Place>> {
    let values = |variable| problem.values(variable);
    let (of_name, places): (Vec<CauseCell>, BTreeSet<Place>) = if name == names::UNKNOWN {
        let places = generated::places(survey).into_iter().collect();
        (generated::cells_at(place, survey), places)
    } else {
        let mut all = cells(survey, &values, question);
        all.retain(|cell| cell.name == cell_of(name));
        let places = all.iter().map(|cell| cell.place).collect();
        (all, places)
    };
    let groups = of_name
        .iter()
        .filter(|cell| cell.place == place)
        .flat_map(|cell| cell.groups(survey, &values, false));
    let one_by_one = groups
        .filter(|group| name == names::UNKNOWN || group.forms.len() == 1)
        .flat_map(|group| group.forms);
    // A joint yields to its load in one way: in proportion, or not.
    let bends = [names::JOINT_COMPLIANCE, names::JOINT_HARDENING].contains(&name);
    let forms: Vec<Form> = one_by_one
        .filter(|form| !bends || form.name() == name)
        .collect();
    if forms.is_empty() {
        Err(places)
    } else {
        Ok(forms)
    }
}

/// Pulls on a joint by its own angle and a neighbour's.
fn hoses(survey: &Survey, joint: usize) -> Vec<Hypothesis> {
    let turns = |other: &usize| {
        *other < survey.joints() && survey.robot.is_revolute(*other) && survey.travel(*other) > 0.0
    };
    let neighbours: Vec<usize> = [joint.wrapping_sub(1), joint + 1]
        .into_iter()
        .filter(turns)
        .collect();
    let law = |other: &usize| {
        let cosines = |joint: usize| {
            let ([low, high], count) = (survey.range[joint], 3);
            Basis::Series { low, high, count }
        };
        let [here, there] = [joint, *other].map(|joint| Variable::Angle { joint });
        [
            Law::new(here, wave(1)).times(there, wave(1)),
            Law::new(here, cosines(joint)).times(there, cosines(*other)),
        ]
    };
    let pull = |law: Law| {
        let term = Term::new(&Unknown, Motion::Joint { joint }, law);
        Hypothesis::new(term, 2 * neighbours.len())
    };
    neighbours.iter().flat_map(law).map(pull).collect()
}

/// A sine and a cosine of so many periods a turn.
fn wave(order: u32) -> Basis {
    Basis::Wave {
        order,
        overtone: false,
    }
}

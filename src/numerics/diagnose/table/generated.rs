//! The cells without a name: every motion of every place over every variable of the recording, less what a named cell is; and products of
//! two variables where one of them shows. What is left out here would take the name of a neighbour.

use super::cell::{CauseCell, FreeShape, Over, Shapes, is_square};
use super::frame::SearchRows;
use crate::criteria::cells::{FADING, LIMITS, PAIR, PRODUCT};
use crate::diagnose::types::Question;
use crate::effect::{Axes, AxisPoint, Motion, Place, Polar, Survey, Variable, names};
use crate::observation::only_contacts;
use nalgebra::Vector3;

/// Directions in which the position of the tool is a variable: axes, diagonals of faces and of the cube.
const ARROWS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [-1, 1, 1],
];
/// Shorter links (m) are no place of their own.
const SHORT: f64 = 1e-3;

const FINE: Over = Over::Curve {
    count: 40,
    first: 8,
    lengths: 5,
};
const CURVE: Over = Over::Curve {
    count: 20,
    first: 5,
    lengths: 3,
};
/// A wave of a dozen periods has no slow part that a coarse look would see.
const WAVY: Over = Over::Curve {
    count: 40,
    first: 40,
    lengths: 5,
};
const SLOW: Over = Over::Curve {
    count: 8,
    first: 4,
    lengths: 2,
};

/// Variables of one kind, which share its prior odds.
type Kind = Vec<(Variable, Over)>;

/// All cells of one variable.
pub(super) fn cells(
    survey: &Survey,
    frame: &mut SearchRows,
    question: &Question,
    is_open: bool,
) -> Vec<CauseCell> {
    let unnamed = super::listed::unnamed(question);
    let mut out = Vec::new();
    let varies = |frame: &SearchRows, variable: Variable| {
        frame
            .values(variable)
            .is_some_and(|values| super::cell::line(&values).is_some())
    };
    // Where nothing but joints was recorded, an arm that is smaller closes as well, and whatever follows the place of the tool looks so.
    let closed = only_contacts(survey.data, survey.rows) || !is_open;
    let places = if closed { Vec::new() } else { places(survey) };
    for place in places {
        let families = families(place, survey);
        let mut groups: Vec<Vec<(Motion, Variable, Over)>> = Vec::new();
        for motions in families {
            let kinds: Vec<Kind> = kinds(place, motions[0], survey);
            let variables: Vec<Variable> = kinds
                .iter()
                .flatten()
                .map(|(variable, _)| *variable)
                .collect();
            frame.prepare(&[], &variables);
            for kind in kinds {
                let kind = kind
                    .into_iter()
                    .filter(|(variable, _)| varies(frame, *variable));
                let all: Vec<_> = kind
                    .flat_map(|(variable, over)| {
                        motions.iter().map(move |motion| (*motion, variable, over))
                    })
                    .filter(|(motion, variable, over)| {
                        !is_listed(*motion, *variable, *over, survey)
                    })
                    .collect();
                if !all.is_empty() {
                    groups.push(all);
                }
            }
        }
        let count = groups.len() as f64;
        for group in groups {
            let log_prior = (unnamed / count / group.len() as f64).ln();
            out.extend(group.into_iter().map(|(motion, variable, over)| {
                cell(
                    FreeShape {
                        motion,
                        variable,
                        over,
                    },
                    log_prior,
                    survey,
                )
            }));
        }
    }
    out
}

/// Products of a motion's variable that shows with every other one that it may follow.
pub(super) fn products(
    shown: &[FreeShape],
    survey: &Survey,
    frame: &mut SearchRows,
) -> Vec<CauseCell> {
    let mut out: Vec<CauseCell> = Vec::new();
    for FreeShape {
        motion, variable, ..
    } in shown
    {
        let kinds = kinds(motion.place(), *motion, survey);
        let others: Vec<Variable> = kinds
            .into_iter()
            .flatten()
            .map(|(other, _)| other)
            .filter(|other| other != variable)
            .collect();
        frame.prepare(&[], &others);
        let mut seen: Vec<Variable> = Vec::new();
        for other in others {
            let free = FreeShape {
                motion: *motion,
                variable: *variable,
                over: Over::Product(other),
            };
            if seen.contains(&other) || free.is_square() || are_one(*variable, other, survey) {
                continue;
            }
            seen.push(other);
            let cell = cell(free, PRODUCT.ln(), survey);
            if !out.iter().any(|known| known.key == cell.key) {
                out.push(cell);
            }
        }
    }
    out
}

/// Products of all pairs of variables that a motion may follow, of which neither need show by itself.
pub(super) fn pairs(survey: &Survey, frame: &mut SearchRows) -> Vec<FreeShape> {
    let mut out = Vec::new();
    for place in places(survey) {
        for motion in families(place, survey).into_iter().flatten() {
            let kinds = kinds(place, motion, survey);
            let mut variables: Vec<Variable> = Vec::new();
            for variable in kinds
                .into_iter()
                .filter(|kind| kind.len() <= survey.joints())
                .flatten()
                .map(|(variable, _)| variable)
            {
                if frame
                    .values(variable)
                    .is_some_and(|values| super::cell::line(&values).is_some())
                    && !variables.iter().any(|known| is_square(*known, variable))
                {
                    variables.push(variable);
                }
            }
            frame.prepare(&[motion], &variables);
            for (i, variable) in variables.iter().enumerate() {
                let others = variables.iter().skip(i + 1);
                let others = others.filter(|other| !are_one(*variable, **other, survey));
                out.extend(others.map(|other| FreeShape {
                    motion,
                    variable: *variable,
                    over: Over::Product(*other),
                }));
            }
        }
    }
    out
}

/// Cells of products that were seen among all pairs.
pub(super) fn pair_cells(seen: &[FreeShape], survey: &Survey) -> Vec<CauseCell> {
    let of_free = |free: &FreeShape| cell(*free, PAIR.ln(), survey);
    seen.iter().map(of_free).collect()
}

/// Products that may do what one does: of the same variables at the places near it, where a motion that an axis does not turn is the same one,
/// and of other variables that change slowly, as time, temperature and payload may do together.
pub(super) fn siblings(free: &FreeShape, survey: &Survey) -> Vec<FreeShape> {
    let Over::Product(other) = free.over else {
        return Vec::new();
    };
    let motions = places(survey)
        .into_iter()
        .filter(|place| are_near(*place, free.motion.place(), 3, survey))
        .flat_map(|place| families(place, survey))
        .flatten()
        .map(|motion| FreeShape { motion, ..*free });
    let slow = [Variable::Time, Variable::Temperature, Variable::Payload];
    let like = |variable: Variable| slow.into_iter().filter(move |_| slow.contains(&variable));
    let first = like(free.variable).map(|variable| FreeShape { variable, ..*free });
    let second = like(other).map(|other| FreeShape {
        over: Over::Product(other),
        ..*free
    });
    motions
        .chain(first)
        .chain(second)
        .filter(|one| {
            let Over::Product(other) = one.over else {
                return false;
            };
            one != free && other != one.variable && !are_one(one.variable, other, survey)
        })
        .collect()
}

/// Whether two variables change together, so that their product is a curve of one with a break: a clock, and a payload that changes once.
fn are_one(a: Variable, b: Variable, survey: &Survey) -> bool {
    let clocks = [Variable::Time, Variable::Temperature];
    let both = |a, b| clocks.contains(&a) && b == Variable::Payload;
    survey.payload_changes_once() && (both(a, b) || both(b, a))
}

/// Whether two places are so many steps from each other at most, along the chain of base, joints, links and tool.
pub(super) fn are_near(a: Place, b: Place, steps: usize, survey: &Survey) -> bool {
    let along = |place: Place| match place {
        Place::Base => Some(0),
        Place::Joint(joint) => Some(2 * joint + 1),
        Place::Links(first, last) if first == last => Some(2 * first + 2),
        Place::Tool => Some(2 * survey.joints()),
        _ => None,
    };
    let both = along(a).zip(along(b));
    both.is_some_and(|(a, b)| a.abs_diff(b) <= steps)
}

pub(super) fn cell(free: FreeShape, log_prior: f64, survey: &Survey) -> CauseCell {
    // Recordings of robots of one model travel differently far, and their cells are the same.
    let named = |variable: Variable| match variable {
        Variable::Stretch { joint, limit } => {
            let share = limit / survey.travel(joint);
            format!("Stretch {{ joint: {joint}, share: {share:.4} }}")
        }
        variable => format!("{variable:?}"),
    };
    let times = if let Over::Product(other) = free.over {
        format!(" times {}", named(other))
    } else {
        String::new()
    };
    let step = if free.over == Over::Step { " step" } else { "" };
    // As the tables of fleets have it.
    let motion = match free.motion {
        Motion::Instrument { reading } => format!("Instrument {{ of: {reading:?} }}"),
        motion => format!("{motion:?}"),
    };
    CauseCell {
        name: names::UNKNOWN,
        place: free.motion.place(),
        key: format!("{motion} by {}{times}{step}", named(free.variable)),
        log_prior,
        shapes: Shapes::Free(free),
        between: None,
    }
}

/// Places of cells without a name.
pub(crate) fn places(survey: &Survey) -> Vec<Place> {
    let joints = 0..survey.joints();
    let length = |link: usize| (survey.robot.point(link + 1) - survey.robot.point(link)).norm();
    let links = joints
        .clone()
        .filter(|link| link + 1 < survey.joints() && length(*link) > SHORT);
    let all = joints
        .map(Place::Joint)
        .chain(links.map(|link| Place::Links(link, link)));
    let instrument = survey.seen_from_outside().then_some(Place::Tracker);
    all.chain([Place::Base, Place::Tool])
        .chain(instrument)
        .collect()
}

/// The motions of a place, by family.
pub(super) fn families(place: Place, survey: &Survey) -> Vec<Vec<Motion>> {
    match place {
        // What carries the first joint is the base, and leans with it.
        Place::Joint(joint) if joint > 0 && survey.robot.is_revolute(joint) => vec![
            vec![Motion::Joint { joint }],
            vec![false, true]
                .into_iter()
                .map(|turning| Motion::Axis {
                    joint,
                    about: None,
                    turning,
                    at: AxisPoint::Own,
                })
                .collect(),
            vec![Motion::Slide { joint, along: true }],
            vec![Motion::Slide {
                joint,
                along: false,
            }],
        ],
        Place::Joint(joint) if survey.robot.is_revolute(joint) => vec![
            vec![Motion::Joint { joint }],
            vec![Motion::Slide { joint, along: true }],
        ],
        Place::Joint(joint) => vec![vec![Motion::Joint { joint }]],
        Place::Links(link, _) => vec![
            vec![Motion::Links {
                first: link,
                last: link,
            }],
            vec![Motion::Bend { link }],
        ],
        Place::Tracker => [Polar::Range, Polar::Azimuth, Polar::Elevation]
            .map(|reading| vec![Motion::Instrument { reading }])
            .to_vec(),
        Place::Tool => vec![vec![Motion::Tool { axes: Axes::Place }]],
        _ => [Axes::Place, Axes::Rotation]
            .map(|axes| vec![Motion::Base { axes }])
            .to_vec(),
    }
}

/// What a motion of a place may follow, by kind.
pub(super) fn kinds(place: Place, motion: Motion, survey: &Survey) -> Vec<Kind> {
    let joints = survey.joints();
    let seat = match place {
        Place::Joint(joint) | Place::Links(joint, _) => joint,
        Place::Tool => joints.saturating_sub(1),
        _ => 0,
    };
    let others = || (0..joints).filter(move |joint| *joint != seat);
    let turns = matches!(motion, Motion::Joint { .. });
    let arrows = ARROWS.map(|arrow| Vector3::from(arrow).map(f64::from).normalize().into());
    let stretch = |joint: usize| Variable::Stretch {
        joint,
        limit: LIMITS[1] * survey.travel(joint),
    };
    let recent = |joint| Variable::Recent {
        joint,
        time: FADING[1],
    };
    let mut out: Vec<Kind> = Vec::new();
    if let Motion::Instrument { reading } = motion {
        // What counts fractions of a wave errs by them.
        let range = match reading {
            Polar::Range => WAVY,
            _ => CURVE,
        };
        out.extend(
            [
                (Variable::Azimuth, CURVE),
                (Variable::Elevation, CURVE),
                (Variable::Range, range),
            ]
            .map(|one| vec![one]),
        );
        out.push(
            (0..joints)
                .map(|joint| (Variable::Angle { joint }, CURVE))
                .collect(),
        );
        out.push(
            (0..joints)
                .map(|joint| (Variable::Approach { joint }, Over::Line))
                .collect(),
        );
        out.push(
            (0..joints)
                .map(|joint| (Variable::Move { joint }, SLOW))
                .collect(),
        );
        out.push(
            arrows
                .map(|along| (Variable::Sighted { along }, SLOW))
                .to_vec(),
        );
        out.push((0..joints).map(|joint| (stretch(joint), SLOW)).collect());
        if survey.data.has_clock() {
            out.push((0..joints).map(|joint| (recent(joint), SLOW)).collect());
        }
    } else {
        out.push(vec![(
            Variable::Angle { joint: seat },
            if turns { FINE } else { CURVE },
        )]);
        out.push(
            others()
                .map(|joint| (Variable::Angle { joint }, CURVE))
                .collect(),
        );
        out.push(vec![(Variable::Approach { joint: seat }, Over::Line)]);
        out.push(
            others()
                .map(|joint| (Variable::Approach { joint }, Over::Line))
                .collect(),
        );
        out.push(vec![(Variable::Move { joint: seat }, CURVE)]);
        out.push(
            others()
                .map(|joint| (Variable::Move { joint }, SLOW))
                .collect(),
        );
        let loaded = |joint: &usize| survey.is_loaded(*joint);
        out.push(
            [seat]
                .into_iter()
                .filter(loaded)
                .map(|joint| (Variable::Load { joint }, CURVE))
                .collect(),
        );
        out.push(
            others()
                .filter(loaded)
                .map(|joint| (Variable::Load { joint }, SLOW))
                .collect(),
        );
        out.push(
            arrows
                .map(|along| (Variable::Position { along }, SLOW))
                .to_vec(),
        );
        let limits = LIMITS.map(|share| Variable::Stretch {
            joint: seat,
            limit: share * survey.travel(seat),
        });
        out.push(limits.map(|variable| (variable, SLOW)).to_vec());
        out.push(others().map(|joint| (stretch(joint), SLOW)).collect());
        if survey.data.has_clock() {
            out.push(
                FADING
                    .map(|time| (Variable::Recent { joint: seat, time }, SLOW))
                    .to_vec(),
            );
            out.push(others().map(|joint| (recent(joint), SLOW)).collect());
        }
    }
    if place == Place::Tool {
        out.push(
            (0..3)
                .map(|axis| (Variable::Gravity { axis: Some(axis) }, SLOW))
                .collect(),
        );
    }
    out.push(vec![(Variable::Time, CURVE)]);
    out.push(vec![(Variable::Time, Over::Step)]);
    out.push(vec![(Variable::Temperature, CURVE)]);
    out.push(vec![(Variable::Payload, Over::Line)]);
    out.retain(|kind| !kind.is_empty());
    out
}

/// Whether this motion over this variable, in all shapes, is the cell of a cause.
pub(super) fn is_listed(motion: Motion, variable: Variable, over: Over, survey: &Survey) -> bool {
    let last = survey.joints().saturating_sub(1);
    match (motion, variable, over) {
        // What the last joint carries is the tool.
        (Motion::Slide { joint, .. }, Variable::Time, Over::Step) => joint == last,
        (
            Motion::Joint { joint },
            Variable::Approach { joint: by } | Variable::Load { joint: by },
            _,
        ) => joint == by,
        (
            Motion::Joint { .. } | Motion::Base { .. } | Motion::Tool { .. },
            Variable::Time,
            Over::Step,
        ) => true,
        _ => false,
    }
}

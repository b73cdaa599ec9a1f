//! The cells without a name: every motion of every place over every variable of the recording, less what a named cell is; and products of
//! two variables where one of them shows. What is left out here would take the name of a neighbour.

use super::cell::{CauseCell, FreeShape, Over, Shapes, is_square, line};
use super::frame::SearchRows;
use crate::criteria::cells::{FADING, LIMITS, PAIR, PRODUCT, UNNAMED, USUAL};
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

const FINE: Over = curve((40, 8, 5));
const CURVE: Over = curve((20, 5, 3));
/// A wave of a dozen periods has no slow part that a coarse look would see.
const WAVY: Over = curve((40, 40, 5));
const SLOW: Over = curve((8, 4, 2));

/// A line or a curve of so many cosines, so many at first, and correlation lengths.
const fn curve((count, first, lengths): (usize, usize, usize)) -> Over {
    Over::Curve {
        count,
        first,
        lengths,
    }
}

/// All cells of one variable.
pub(super) fn cells(
    survey: &Survey,
    frame: &mut SearchRows,
    question: &Question,
    is_open: bool,
) -> Vec<CauseCell> {
    let odds = prior_odds(question);
    let mut out = Vec::new();
    // Where nothing but joints was recorded, an arm that is smaller closes as well, and whatever follows the place of the tool looks so.
    let closed = only_contacts(survey.data, survey.rows) || !is_open;
    let places = if closed { Vec::new() } else { places(survey) };
    for place in places {
        let mut groups: Vec<Vec<FreeShape>> = Vec::new();
        for motions in families(place, survey) {
            let kinds = kinds(motions[0], survey);
            let variables: Vec<Variable> = kinds.iter().flatten().map(|one| one.variable).collect();
            frame.prepare(&[], &variables);
            for mut kind in kinds {
                kind.retain(|free| varies(free.variable, frame));
                let moved = |free: FreeShape| {
                    let motions = motions.iter();
                    motions.map(move |motion| FreeShape {
                        motion: *motion,
                        ..free
                    })
                };
                let all = kind.into_iter().flat_map(moved);
                groups.push(all.filter(|free| !is_listed(free, survey)).collect());
            }
        }
        groups.retain(|group| !group.is_empty());
        let count = groups.len() as f64;
        for group in groups {
            let log_prior = (odds / count / group.len() as f64).ln();
            let named = |free: FreeShape| cell(free, log_prior, survey);
            out.extend(group.into_iter().map(named));
        }
    }
    out
}

/// Prior odds of all cells without a name at a place together.
pub(super) fn prior_odds(question: &Question) -> f64 {
    let odds = |probability: f64| probability / (1.0 - probability);
    *UNNAMED * odds(question.open_world) / odds(*USUAL)
}

/// Whether a variable takes more than one value.
fn varies(variable: Variable, frame: &SearchRows) -> bool {
    let values = frame.values(variable);
    values.is_some_and(|values| line(&values).is_some())
}

/// Products of a motion's variable that shows with every other one that it may follow.
pub(super) fn products(
    shown: &[FreeShape],
    survey: &Survey,
    frame: &mut SearchRows,
) -> Vec<CauseCell> {
    let mut out: Vec<CauseCell> = Vec::new();
    for free in shown {
        let kinds = kinds(free.motion, survey).into_iter().flatten();
        let others = kinds.map(|other| other.variable);
        let others: Vec<Variable> = others.filter(|other| *other != free.variable).collect();
        frame.prepare(&[], &others);
        for other in others {
            let product = FreeShape {
                over: Over::Product(other),
                ..*free
            };
            if product.is_square() || are_one(free.variable, other, survey) {
                continue;
            }
            let cell = cell(product, PRODUCT.ln(), survey);
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
            let mut variables: Vec<Variable> = Vec::new();
            let mut kinds = kinds(motion, survey);
            kinds.retain(|kind| kind.len() <= survey.joints());
            for FreeShape { variable, .. } in kinds.into_iter().flatten() {
                if varies(variable, frame)
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
    let product = |free: &FreeShape| cell(*free, PAIR.ln(), survey);
    seen.iter().map(product).collect()
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
    let second = like(other).map(Over::Product);
    let second = second.map(|over| FreeShape { over, ..*free });
    let is_another = |one: &FreeShape| {
        matches!(one.over, Over::Product(other)
            if one != free && other != one.variable && !are_one(one.variable, other, survey))
    };
    let all = motions.chain(first).chain(second);
    all.filter(is_another).collect()
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
        name: names::UNKNOWN.into(),
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
        Place::Joint(joint) if !survey.robot.is_revolute(joint) => {
            vec![vec![Motion::Joint { joint }]]
        }
        Place::Joint(joint) => {
            let axis = [false, true].map(|turning| Motion::Axis {
                joint,
                about: None,
                turning,
                at: AxisPoint::Own,
            });
            let slide = |along| vec![Motion::Slide { joint, along }];
            let turn = vec![Motion::Joint { joint }];
            match joint {
                // What carries the first joint is the base, and leans with it.
                0 => vec![turn, slide(true)],
                _ => vec![turn, axis.to_vec(), slide(true), slide(false)],
            }
        }
        Place::Links(link, _) => {
            let (first, last) = (link, link);
            vec![
                vec![Motion::Links { first, last }],
                vec![Motion::Bend { link }],
            ]
        }
        Place::Tracker => [Polar::Range, Polar::Azimuth, Polar::Elevation]
            .map(|reading| vec![Motion::Instrument { reading }])
            .to_vec(),
        Place::Tool => vec![vec![Motion::Tool { axes: Axes::Place }]],
        _ => [Axes::Place, Axes::Rotation]
            .map(|axes| vec![Motion::Base { axes }])
            .to_vec(),
    }
}

/// A motion over what it may follow, by kind of variable: those of a kind share its prior odds.
fn kinds(motion: Motion, survey: &Survey) -> Vec<Vec<FreeShape>> {
    let place = motion.place();
    let reading = match motion {
        Motion::Instrument { reading } => Some(reading),
        _ => None,
    };
    let seat = match place {
        Place::Joint(joint) | Place::Links(joint, _) => Some(joint),
        Place::Tool => Some(survey.joints().saturating_sub(1)),
        _ => Some(0),
    };
    let seat = seat.filter(|_| reading.is_none());
    let here: Vec<usize> = seat.into_iter().collect();
    let others: Vec<usize> = (0..survey.joints())
        .filter(|joint| Some(*joint) != seat)
        .collect();
    let free = |variable: Variable, over: Over| FreeShape {
        motion,
        variable,
        over,
    };
    let each = |joints: &[usize], over: Over, variable: &dyn Fn(usize) -> Variable| {
        let joints = joints.iter();
        joints.map(|joint| free(variable(*joint), over)).collect()
    };
    let arrows = ARROWS.map(|arrow| Vector3::from(arrow).map(f64::from).normalize().into());
    let mut out: Vec<Vec<FreeShape>> = Vec::new();
    // What counts fractions of a wave errs by them.
    let over_range = match reading {
        Some(Polar::Range) => WAVY,
        _ => CURVE,
    };
    if reading.is_some() {
        out.push(vec![free(Variable::Azimuth, CURVE)]);
        out.push(vec![free(Variable::Elevation, CURVE)]);
        out.push(vec![free(Variable::Range, over_range)]);
    }
    let turns = matches!(motion, Motion::Joint { .. });
    let angle = |joint| Variable::Angle { joint };
    out.push(each(&here, if turns { FINE } else { CURVE }, &angle));
    out.push(each(&others, CURVE, &angle));
    let approach = |joint| Variable::Approach { joint };
    out.push(each(&here, Over::Line, &approach));
    out.push(each(&others, Over::Line, &approach));
    let last_move = |joint| Variable::Move { joint };
    out.push(each(&here, CURVE, &last_move));
    out.push(each(&others, SLOW, &last_move));
    if reading.is_some() {
        let sighted = |along| free(Variable::Sighted { along }, SLOW);
        out.push(arrows.map(sighted).to_vec());
    } else {
        for (joints, over) in [(&here, CURVE), (&others, SLOW)] {
            let mut loaded = joints.clone();
            loaded.retain(|joint| survey.is_loaded(*joint));
            out.push(each(&loaded, over, &|joint| Variable::Load { joint }));
        }
        let position = |along| free(Variable::Position { along }, SLOW);
        out.push(arrows.map(position).to_vec());
    }
    let stretch = |joint: usize, share: f64| Variable::Stretch {
        joint,
        limit: share * survey.travel(joint),
    };
    let at_limits = |joint: &usize| LIMITS.map(|share| free(stretch(*joint, share), SLOW));
    out.push(here.iter().flat_map(at_limits).collect());
    out.push(each(&others, SLOW, &|joint| stretch(joint, LIMITS[1])));
    if survey.data.has_clock() {
        let fading = |joint: &usize| {
            let joint = *joint;
            FADING.map(|time| free(Variable::Recent { joint, time }, SLOW))
        };
        out.push(here.iter().flat_map(fading).collect());
        let time = FADING[1];
        out.push(each(&others, SLOW, &|joint| Variable::Recent {
            joint,
            time,
        }));
    }
    if place == Place::Tool {
        let gravity = |axis| free(Variable::Gravity { axis: Some(axis) }, SLOW);
        out.push((0..3).map(gravity).collect());
    }
    out.push(vec![free(Variable::Time, CURVE)]);
    out.push(vec![free(Variable::Time, Over::Step)]);
    out.push(vec![free(Variable::Temperature, CURVE)]);
    out.push(vec![free(Variable::Payload, Over::Line)]);
    out.retain(|kind| !kind.is_empty());
    out
}

/// Everything that a place may do and follow and that has no name.
pub(super) fn cells_at(place: Place, survey: &Survey) -> Vec<CauseCell> {
    let motions = families(place, survey).into_iter().flatten();
    let motions = motions.filter(|motion| motion.place() == place);
    let all = motions.flat_map(|motion| kinds(motion, survey).into_iter().flatten());
    all.filter(|free| !is_listed(free, survey))
        .map(|free| cell(free, 0.0, survey))
        .collect()
}

/// Whether a motion over a variable, in all shapes, is the cell of a cause.
fn is_listed(free: &FreeShape, survey: &Survey) -> bool {
    let last = survey.joints().saturating_sub(1);
    match (free.motion, free.variable, free.over) {
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

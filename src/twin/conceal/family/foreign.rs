//! Effects drawn at random, so that no list holds them: any shape over any variable in any direction of motion.

use super::{Bench, Column, Draft, joint, link};
use crate::effect::{
    Foreign, ForeignCourse, ForeignMotion, ForeignShape, ForeignVariable, Physical,
};
use crate::matrix::{self, Vector};
use crate::noise::Noise;
use ForeignMotion::*;
use ForeignVariable::*;
use std::f64::consts::TAU;

/// Motions, evenly drawn: a joint's shift is along its axis or across it.
#[rustfmt::skip]
const MOTIONS: [ForeignMotion; 12] = [
    JointTurn, JointTurn, JointShift, JointTilt, LinkShift, LinkBend, BaseShift, BaseTurn, ToolShift, Range, Azimuth, Elevation,
];

/// Waves of a smooth shape.
const WAVES: usize = 12;
/// Shortest and longest length of a smooth shape, share of its variable's way.
const LENGTHS: [f64; 2] = [0.08, 0.8];
/// Warm-up and swing end about here, C.
const WARMTH_C: [f64; 2] = [20.0, 35.0];
/// Share of effects of two variables.
const PRODUCTS: f64 = 0.35;

/// Draws an effect of natural size.
pub(crate) fn foreign(bench: &Bench, draw: &mut Noise) -> Draft {
    let motion = MOTIONS[draw.index(MOTIONS.len())];
    let seat = seat(bench, motion, draw);
    let mut courses = vec![course(bench, motion, seat, &[], draw)];
    let alone = match &courses[0].over {
        // Those alone are a gap and a payload: names of the list.
        Approach(number) => motion != JointTurn || *number != seat,
        Payload => false,
        _ => true,
    };
    if !alone || draw.chance(PRODUCTS) {
        let second = course(bench, motion, seat, &courses, draw);
        courses.push(second);
    }
    let direction = direction(bench, motion, seat, draw);
    let size = draw.sign() * draw.size(40.0, 200.0);
    let columns: Vec<Column> = (courses.iter())
        .filter_map(|course| column(&course.over))
        .collect();
    let form = form(&courses);
    // Time only goes on, and so does the temperature of these recordings: what jumps with them does so once and for good.
    let jumps = |one: &ForeignCourse| matches!(one.shape, ForeignShape::Jumps(_));
    let is_step = match &courses[..] {
        [one] => matches!(one.over, Time | Temperature) && jumps(one),
        _ => false,
    };
    // A curve of a turning joint over its own angle, whatever its shape, is that of transmission or encoder; also where its flanks differ.
    let is_angle = |one: &ForeignCourse| matches!(one.over, Angle(number) if number == seat);
    let is_side = |one: &ForeignCourse| matches!(one.over, Approach(number) if number == seat);
    let is_table = motion == JointTurn
        && match &courses[..] {
            [one] => is_angle(one),
            [a, b] => is_angle(a) && is_side(b) || is_side(a) && is_angle(b),
            _ => false,
        };
    let effect = Physical::Foreign(Foreign {
        motion,
        seat,
        direction,
        size,
        courses,
    });
    let mut draft = Draft::one(form, "unknown", motion.place(seat), [effect]).needing(&columns);
    let same = same_places(bench, motion, seat);
    let names = same.iter().map(|place| ("unknown", place.clone()));
    draft.accepted.extend(names);
    if is_table {
        draft.accepted.push(("joint_table", motion.place(seat)));
    }
    if is_step {
        let places = [motion.place(seat)].into_iter().chain(same);
        let names = places.filter_map(|place| Some((step(motion, &place)?, place)));
        draft.accepted.extend(names);
    }
    draft
}

/// The name of what moves at a place so, once and for good, if there is one.
fn step(motion: ForeignMotion, place: &str) -> Option<&'static str> {
    match place {
        "base" => Some("base_shift"),
        "tool" => Some("tool_shift"),
        _ => (motion == JointTurn).then_some("zero_shift"),
    }
}

/// The joint or link that moves: not the last joint's turn, which hardly moves the tool, and links with a length.
fn seat(bench: &Bench, motion: ForeignMotion, draw: &mut Noise) -> usize {
    match motion {
        JointTurn | JointShift | JointTilt => bench.turning(draw),
        LinkShift | LinkBend => bench.long_link(draw).unwrap_or(1),
        _ => 1,
    }
}

/// A unit vector: along a joint's axis or across it, along a link or across it, anywhere.
fn direction(bench: &Bench, motion: ForeignMotion, seat: usize, draw: &mut Noise) -> Vector {
    let arrow = draw.vector(1.0, 1.0);
    let along = draw.chance(0.5);
    let described = &bench.robot.joints[seat - 1];
    let (line, along) = match motion {
        JointShift => (described.axis, along),
        JointTilt => (described.axis, false),
        LinkShift => (bench.line(seat - 1), along),
        LinkBend => (bench.line(seat - 1), false),
        _ => return arrow,
    };
    let line = matrix::scale(line, 1.0 / matrix::norm(line).max(1e-9));
    let across = matrix::minus(arrow, matrix::scale(line, matrix::dot(line, arrow)));
    if along {
        line
    } else {
        matrix::scale(across, 1.0 / matrix::norm(across).max(1e-9))
    }
}

/// A shape over a variable that is none of `others`; only one of an effect's variables remembers.
fn course(
    bench: &Bench,
    motion: ForeignMotion,
    seat: usize,
    others: &[ForeignCourse],
    draw: &mut Noise,
) -> ForeignCourse {
    loop {
        let (over, between) = variable(bench, motion, seat, draw);
        let kind = std::mem::discriminant(&over);
        let taken = |other: &ForeignCourse| {
            std::mem::discriminant(&other.over) == kind
                || (other.over.is_remembered() && over.is_remembered())
        };
        if others.iter().any(taken) {
            continue;
        }
        let two_values = matches!(over, Approach(_) | Payload);
        let shape = if two_values {
            ForeignShape::Straight
        } else {
            shape(draw)
        };
        return ForeignCourse {
            over,
            between,
            shape,
        };
    }
}

/// A variable, and the values between which it moves.
fn variable(
    bench: &Bench,
    motion: ForeignMotion,
    seat: usize,
    draw: &mut Noise,
) -> (ForeignVariable, [f64; 2]) {
    let instrument = motion.is_sighted();
    let anywhere = instrument || matches!(motion, BaseShift | BaseTurn | ToolShift);
    // Half of what sits on the chain depends on its described joint.
    let other = 1 + draw.index(bench.joints());
    let number = if !anywhere && draw.chance(0.5) {
        seat
    } else {
        other
    };
    let range = bench.ranges_deg[number - 1].map(f64::to_radians);
    let width = range[1] - range[0];
    let spans = (0..bench.joints()).map(|index| matrix::norm(bench.line(index)));
    let reach: f64 = spans.sum();
    match draw.index(11) {
        0..=2 => (Angle(number), range),
        3 => (Approach(number), [-1.0, 1.0]),
        4 => (LastMove(number), [-0.7 * width, 0.7 * width]),
        5 if !instrument => {
            let loaded = bench.loaded();
            let number = loaded.get(draw.index(loaded.len())).copied().unwrap_or(1);
            (
                Load(number),
                [-bench.peak[number - 1], bench.peak[number - 1]],
            )
        }
        6 => (Payload, [0.0, bench.robot.payload_mass]),
        7 => (Temperature, WARMTH_C),
        8 => {
            let far = if instrument { 2.0 * reach } else { reach };
            (Space(draw.vector(1.0, 1.0)), [-far, far])
        }
        9 => (
            Relaxing(number, draw.size(10.0, 120.0)),
            [-0.7 * width, 0.7 * width],
        ),
        10 => {
            let limit = draw.uniform(0.05, 0.4) * width;
            (Slipping(number, limit), [-limit, limit])
        }
        _ => (Time, [0.0, bench.end_s]),
    }
}

/// Smooth in half of the effects, else with corners or jumps.
fn shape(draw: &mut Noise) -> ForeignShape {
    match draw.index(4) {
        0 | 1 => {
            // Random Fourier features of a Gaussian process with a squared exponential kernel.
            let length = draw.size(LENGTHS[0], LENGTHS[1]);
            let amplitude = (2.0 / WAVES as f64).sqrt();
            let mut wave = || {
                let (size, rate) = (amplitude * draw.normal(), draw.normal() / length);
                [size, rate, draw.uniform(0.0, TAU)]
            };
            ForeignShape::Smooth((0..WAVES).map(|_| wave()).collect())
        }
        2 => {
            let inner = 1 + draw.index(3);
            ForeignShape::Corners(points(&[0.0, 1.0], inner, draw))
        }
        _ => {
            let inner = 1 + draw.index(3);
            ForeignShape::Jumps(points(&[], inner, draw))
        }
    }
}

/// Drawn values at `fixed` places and at some well inside, in their order.
fn points(fixed: &[f64], inner: usize, draw: &mut Noise) -> Vec<[f64; 2]> {
    let mut places: Vec<f64> = fixed.to_vec();
    places.extend((0..inner).map(|_| draw.uniform(0.15, 0.85)));
    places.sort_by(f64::total_cmp);
    places.dedup();
    places.into_iter().map(|at| [at, draw.normal()]).collect()
}

/// What nobody can see without.
fn column(over: &ForeignVariable) -> Option<Column> {
    match over {
        Approach(_) => Some(Column::Direction),
        Time | Relaxing(..) => Some(Column::Time),
        Temperature => Some(Column::Temperature),
        _ => None,
    }
}

fn form(courses: &[ForeignCourse]) -> &'static str {
    let memory = courses.iter().any(|course| course.over.is_remembered());
    match (courses, memory) {
        ([_, _, ..], true) => "product with memory",
        ([_, _, ..], false) => "product of two",
        (_, true) => "memory",
        ([one], _) => match one.shape {
            ForeignShape::Straight => "straight",
            ForeignShape::Smooth(_) => "smooth",
            ForeignShape::Corners(_) => "corners",
            ForeignShape::Jumps(_) => "jumps",
        },
        _ => "nothing",
    }
}

/// Where the same motion of the chain may be put as well.
fn same_places(bench: &Bench, motion: ForeignMotion, seat: usize) -> Vec<String> {
    let (base, tool, tracker): (String, String, String) =
        ("base".into(), "tool".into(), "tracker".into());
    let last = bench.joints();
    match motion {
        JointTurn if seat > 1 => vec![],
        JointTurn => vec![base],
        JointShift | JointTilt => vec![if seat > 1 { link(seat - 1) } else { base }],
        LinkShift | LinkBend => vec![if seat < last { joint(seat + 1) } else { tool }],
        BaseShift | BaseTurn => vec![tracker, joint(1)],
        ToolShift => vec![link(last), joint(last)],
        // The turn of the whole instrument about its standing axis.
        Azimuth => vec![base],
        Range | Elevation => vec![],
    }
}

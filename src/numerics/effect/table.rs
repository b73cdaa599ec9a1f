//! The table of causes: a row for each, in the order in which a model is built up. Where two parameters do the same, the one whose cause comes
//! first is kept.
//!
//! A row says where its cause acts ([`At`]), what it follows there ([`Follows`]) and how rare it is; proposals, names of numbers, sentences,
//! pages and `calib effects` are made from it. Motions with physics of their own stand in files of theirs, with a [`OwnMotion`](super::OwnMotion).

use super::Follows::{
    Angle, Constant, HalfOrders, Push, Side, Slip, Slow, Steady, Step, Velocity, Waves,
};
use super::Warmth::{Temperature, WarmUp, Work};
use super::geometry::{DeclaredCouplings, JointOffset, LinkGeometry, ReductionRatio};
use super::{
    AnchorShift, At, Axes, BasePlacement, Basis, Cause, Follows, HiddenSize, LawRow, Limit,
    Measure, Place, Polar, Times, ToolOffset, Turning, compliance, joint_hardening, joint_log_lag,
    law_shapes, names, torque_model, unknown,
};
use crate::criteria::effect::{LOW_ORDERS, RARE, UNCOMMON, WOBBLES};
use crate::units::Unit;

/// What separates warmth of the arm from that of its surroundings.
const WATCH: Measure = Measure {
    rank: 4,
    advice: "log the arm's temperature from a cold start and watch a fixed target on the floor",
};
/// What shows errors of the instrument itself.
const TWO_FACES: Measure = Measure {
    rank: 2,
    advice: "measure fixed points in both faces, and from a second station",
};

const ORDER: &str = "{order} times a turn by {amplitude}";

/// A law of a kind, with what is its own.
macro_rules! row {
    ($kind:ident $(, $field:ident: $value:expr)*) => {
        LawRow { $($field: $value,)* ..$kind }
    };
}

/// What to measure, and how soon among what else is to be measured.
macro_rules! measure {
    ($rank:literal: $advice:literal) => {
        Some(Measure {
            rank: $rank,
            advice: $advice,
        })
    };
}

const PLAIN: LawRow = LawRow::PLAIN;
/// No gear or encoder errs by more than a quarter of a degree.
const GEAR: LawRow = LawRow {
    largest: 5e-3,
    says: ORDER,
    ..PLAIN
};
const GAP: LawRow = LawRow {
    number: "half_gap",
    ..PLAIN
};
const GROWTH: LawRow = LawRow {
    at: At::Runs,
    positive: true,
    ..PLAIN
};
const OF_LINKS: Limit = Limit {
    most: f64::INFINITY,
    subject: "of any material of links",
    negative: Some("links do not shrink as they warm up"),
};
/// What of a joint follows its warmth is one of three.
const ZERO: LawRow = LawRow {
    follows: Follows::Warmth(&[Temperature, WarmUp, Work]),
    tried: || 3,
    rarity: || *RARE,
    variant: "zero",
    ..PLAIN
};
const DRIFT: LawRow = LawRow {
    at: At::Tracker(&[Axes::Place, Axes::Both]),
    ..PLAIN
};
const CIRCLE: LawRow = LawRow {
    rarity: || *RARE,
    sigma: 1e-3,
    ..PLAIN
};
const AIR: LawRow = LawRow {
    at: At::Reading(Polar::Range),
    times: Some(Times::Range),
    rarity: || *RARE,
    sigma: 1e-4,
    ..PLAIN
};
const OF_AIR: Limit = Limit {
    most: f64::INFINITY,
    subject: "that air can make",
    negative: None,
};

/// Every cause.
pub static CAUSES: &[&Cause] = &[
    &Cause {
        name: names::ANCHOR,
        place: "anchor",
        formula: "what is measured from is elsewhere: the end of a draw-wire or ballbar, a socket, a plane, a sphere; it moves no point",
        confounded: "base_frame",
        needs: "distances, sockets, planes or spheres",
        arm_effect: Some(|_| Box::new(AnchorShift)),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::BASE_FRAME,
        place: "base",
        formula: "a rigid motion of the base",
        confounded: "tool_offset, joint_offset of the first joint",
        arm_effect: Some(|setting| Box::new(BasePlacement::new(setting.base))),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::TOOL_OFFSET,
        place: "tool",
        formula: "a displacement of the measured point",
        confounded: "link_geometry of the last link",
        arm_effect: Some(|_| Box::new(ToolOffset)),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::JOINT_OFFSET,
        place: "joint",
        formula: "d = c",
        size: "0.1 to 5 mrad",
        confounded: "base_frame, link_geometry",
        arm_effect: Some(|_| Box::new(JointOffset)),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::LINK_GEOMETRY,
        place: "link",
        formula: "lengths and tilts between two axes",
        size: "0.1 to 1 mm, 0.1 to 1 mrad",
        confounded: "joint_offset, tool_offset",
        arm_effect: Some(|_| Box::new(LinkGeometry)),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::REDUCTION_RATIO,
        place: "joint",
        formula: "d = c q",
        size: "1e-5 to 1e-3",
        confounded: "joint_compliance, gear_cyclic of order 1",
        needs: "a wide travel of the joint",
        arm_effect: Some(|_| Box::new(ReductionRatio)),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::COUPLING_RATIO,
        place: "joint A->B",
        formula: "d of B = c q of A",
        size: "1e-5 to 1e-2",
        confounded: "axis_wobble, link_geometry",
        needs: "a wide travel of joint A",
        sentence: "{place}: the second moves with the first by {100:2} % of its angle",
        laws: &[row!(PLAIN, at: At::Pairs, follows: Angle)],
        arm_effect: Some(|_| Box::new(DeclaredCouplings)),
        ..Cause::PLAIN
    },
    &compliance::JOINT,
    &joint_hardening::CAUSE,
    &compliance::LINK,
    &compliance::BASE,
    &Cause {
        name: names::GEAR_CYCLIC,
        place: "joint",
        formula: "d = a sin(n q) + b cos(n q), n = 1 .. 48",
        size: "5 to 100 arcsec",
        confounded: "counterbalance at n = 1, axis_wobble",
        needs: "enough points a period",
        sentence: "the transmission or encoder of {place} errs periodically with its angle: {each}",
        // Eccentricity makes the lowest orders on any joint; strain wave gears and absolute encoders show some twenty, worm wheels more.
        laws: &[
            row!(GEAR, follows: Waves(Turning::Joint, [1, 4], false), tried: || *LOW_ORDERS),
            row!(GEAR, follows: Waves(Turning::Joint, [1, 4], true), tried: || *LOW_ORDERS, rarity: || *UNCOMMON,
                says: "{order} times a turn by {amplitude} and {twice} times by {overtone}"),
            row!(GEAR, follows: Waves(Turning::Joint, [5, 48], false), tried: || 48),
            // Gears with a fraction of a turn.
            row!(GEAR, follows: HalfOrders(20), tried: || 48, rarity: || *UNCOMMON),
        ],
        same: |term| {
            let first = matches!(term.basis(), Basis::Wave { order: 1, .. });
            first.then(|| (names::COUNTERBALANCE, term.motion().place()))
        },
        ..Cause::PLAIN
    },
    &Cause {
        name: "gear_motor_cyclic",
        place: "joint",
        formula: "d = a sin(n i q) + b cos(n i q), i the reduction ratio, n = 1, 2",
        size: "2 to 30 arcsec",
        confounded: "noise: nothing else is as fast",
        needs: "reduction ratios in the robot file",
        sentence: "{place} errs periodically with its motor's angle, amplitude {amplitude}",
        // Shaft, and two teeth or poles.
        laws: &[row!(PLAIN, follows: Waves(Turning::Motor, [1, 2], false), tried: || 2)],
        ..Cause::PLAIN
    },
    &Cause {
        name: "gear_flank",
        place: "joint",
        formula: "d = s (a sin(n q) + b cos(n q)), n = 1 .. 24",
        size: "2 to 40 arcsec",
        confounded: "backlash where the joint travels little, gear_cyclic where all poses are approached from one side",
        needs: "both directions of approach over the joint's range",
        sentence: "the two flanks of the teeth of {place} err differently: {each} to either side",
        laws: &[
            row!(PLAIN, follows: Waves(Turning::Joint, [1, 24], false), times: Some(Times::Approach), tried: || 48, says: ORDER),
        ],
        measure: measure!(5: "repeat poses from both sides over the whole range of the joint"),
        ..Cause::PLAIN
    },
    &Cause {
        name: "gear_load",
        place: "joint",
        formula: "d = t (a sin(n q) + b cos(n q)), n = 1 .. 24",
        size: "2 to 40 arcsec under full load",
        confounded: "gear_cyclic where the load hardly changes, joint_compliance where the joint travels little",
        needs: "link masses, loads that change at the same angle",
        sentence: "the gear of {place} errs periodically, in proportion to its load: {each}",
        laws: &[
            row!(PLAIN, follows: Waves(Turning::Joint, [1, 24], false), times: Some(Times::Load), tried: || 48, rarity: || *RARE,
                sigma: 1e-4, says: ORDER),
        ],
        measure: measure!(5: "repeat poses with and without a payload over the whole range of the joint"),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::JOINT_TABLE,
        place: "joint",
        formula: "d = a curve of q that is no wave, over the measured range",
        size: "5 to 200 arcsec",
        confounded: "gear_cyclic",
        needs: "many points",
        sentence: "the transmission or encoder of {place} errs over its angle by a curve that is no wave{sides}",
        ..Cause::PLAIN
    },
    &Cause {
        name: names::BACKLASH,
        place: "joint",
        formula: "d = g s, or g sign(t), or the one at small and the other at large loads",
        size: "5 to 100 arcsec",
        confounded: "joint_hardening, joint_log_lag",
        needs: "both directions of approach",
        sentence: "{place} has lost motion to the side that its load pushes it",
        laws: &[
            row!(GAP, follows: Side, positive: true,
                says: "{place} has lost motion: a half-gap of {size} to the side that the load pushes it"),
            row!(GAP, follows: Push, positive: true,
                says: "{place} has lost motion: a half-gap of {size} by the direction of approach, and above about {friction} Nm to the \
                       side to which the load pushes it"),
            row!(GAP, says: "{place} has lost motion: a half-gap of {size} by the direction of approach"),
            row!(GAP, times: Some(Times::Time), tried: || 2, rarity: || *RARE, number: "half_gap_in_the_end", variant: "growing",
                says: "the lost motion of {place} grows, to a half-gap of {size} in the end"),
            row!(GAP, times: Some(Times::Load), tried: || 2, rarity: || *RARE, number: "half_gap_per_load", sigma: 1e-4,
                variant: "by_load",
                says: "the compliance of {place} depends on the direction of approach: half the difference is {value}"),
        ],
        measure: measure!(5: "repeat poses from both sides under loads of both signs"),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::PRESLIDING,
        place: "joint",
        formula: "d = c z, z -> s + (z - s) exp(-|dq| / travel) from row to row",
        size: "5 to 60 arcsec over 0.5 to 10 deg",
        confounded: "backlash where all moves are long, joint_log_lag",
        needs: "rows in the order of measurement, short moves among them",
        sentence: "lost motion of {place} fades in after each reversal: {size} to either side",
        laws: &[row!(GAP, follows: Slip,
                says: "lost motion of {place} fades in after each reversal over a travel of {travel} deg: {size} to either side")],
        measure: measure!(5: "approach one pose from both sides in steps of a tenth of a degree up to ten"),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::THERMAL_GROWTH,
        place: "link, or neighbouring links",
        formula: "lengths grow by c (T - T0), or c (1 - exp(-time / tau))",
        size: "10 to 25 um/m for each kelvin",
        confounded: "tracker_drift, growth of neighbouring links",
        needs: "temperature or time",
        sentence: "{place} grows with warmth",
        // Aluminium grows by 23e-6 a kelvin, zinc by 30e-6, the polymers of light links by up to 70e-6; no arm warms up by more than 60 K.
        // What the search may try is more, so that what is no growth is not forced into another name.
        laws: &[
            row!(GROWTH, follows: Follows::Warmth(&[Temperature]), largest: 1e-4, limit: Some(Limit { most: 7e-5, ..OF_LINKS }),
                sigma: 1e-3, says: "{place} grows by {1e6:1} um/m for each kelvin{lagging}"),
            row!(GROWTH, follows: Follows::Warmth(&[WarmUp]), largest: 60.0 * 1e-4,
                limit: Some(Limit { most: 60.0 * 7e-5, ..OF_LINKS }),
                says: "{place} grows as the robot warms up, {1e6:0} um/m in the end with a time constant of {span}"),
        ],
        measure: Some(WATCH),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::JOINT_WARMING,
        place: "joint",
        formula: "d = w, w q or w t, w: temperature above the first, warm-up, or recent work",
        size: "1 to 50 arcsec",
        confounded: "tracker_drift and base_shift (joint 1), thermal_growth",
        needs: "temperature or time",
        sentence: "{place} changes with warmth: {each}",
        laws: &[
            row!(ZERO, says: "its zero by {1:0} arcsec {pace}"),
            row!(ZERO, times: Some(Times::Angle), variant: "ratio", says: "its ratio by {1e6:0} ppm {pace}"),
            row!(ZERO, times: Some(Times::Load), sigma: 1e-4, variant: "stiffness", says: "its compliance by {1e6:2} urad/Nm {pace}"),
        ],
        measure: Some(WATCH),
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &torque_model::BALANCER,
    &torque_model::HOSE,
    &torque_model::LINK_MASS,
    &torque_model::PAYLOAD,
    &Cause {
        name: names::AXIS_WOBBLE,
        place: "joint",
        formula: "the axis tilts by sin(n q), cos(n q), n = 1, 2",
        size: "5 to 100 arcsec",
        confounded: "gear_cyclic of a neighbour, coupling_ratio",
        needs: "points far off the axis",
        sentence: "the axis of {place} tilts as the joint turns",
        // It stands where an outer ring is not round, and turns with the joint where an inner one is not. No bearing lets it tilt by 400
        // arcsec.
        laws: &[
            row!(PLAIN, at: At::Axes, follows: Waves(Turning::Joint, [1, 2], false), tried: || *WOBBLES, rarity: || *RARE,
                largest: 2e-3),
        ],
        measure: measure!(6: "measure a second target off the first"),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::VISCOUS_WINDUP,
        place: "joint",
        formula: "d = -c dq/dt: the joint trails in proportion to its speed",
        size: "0.2 to 10 arcsec for each deg/s",
        confounded: "joint_log_lag where one joint moves alone",
        needs: "joint velocities, of a moving arm",
        sentence: "{place} trails behind in proportion to its speed, by {1:2} {unit}",
        // Viscous friction winds the gear up: c is its coefficient over the gear's stiffness, s. A joint that trails by 0.1 s is not driven.
        laws: &[
            row!(PLAIN, at: At::AllJoints, follows: Velocity, positive: true, largest: 0.1, number: "trail"),
        ],
        // A joint that trails by less than 5 arcsec for each deg/s is no cause to measure again.
        hidden: Some(|| HiddenSize {
            subject: None,
            may: "may trail",
            least: 5.0 / 3600.0,
            unit: Unit::ArcsecondPerDegreePerSecond,
        }),
        ..Cause::PLAIN
    },
    &Cause {
        name: names::ZERO_SHIFT,
        place: "joint",
        formula: "d = c after some time",
        size: "10 to 500 arcsec",
        confounded: "base_shift (joint 1), tool_shift (last joint)",
        needs: "rows in the order of measurement",
        sentence: "the zero of {place} steps by {size}{when}",
        laws: &[row!(PLAIN, at: At::AllJoints, follows: Step, number: "step", sigma: 0.1)],
        measure: Some(law_shapes::RETURN),
        separable_by_poses: false,
        same: |term| {
            (term.motion().place() == Place::Joint(0)).then_some((names::BASE_SHIFT, Place::Base))
        },
        ..Cause::PLAIN
    },
    &Cause {
        name: names::TOOL_SHIFT,
        place: "tool",
        formula: "the target moves at some time",
        size: "20 to 500 um",
        confounded: "zero_shift of the last joints",
        needs: "rows in the order of measurement",
        sentence: "the target on the tool has moved{when}",
        laws: &[row!(PLAIN, at: At::Tool, follows: Step)],
        measure: Some(law_shapes::RETURN),
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &Cause {
        name: names::BASE_SHIFT,
        place: "base",
        formula: "the base moves at some time",
        size: "20 to 500 um",
        confounded: "zero_shift of joint 1, tracker_drift",
        needs: "rows in the order of measurement",
        sentence: "the base (or the tracker) has moved{when}",
        laws: &[row!(PLAIN, at: At::Base(&[Axes::Place, Axes::Both]), follows: Step)],
        measure: Some(law_shapes::RETURN),
        of_the_measurement: true,
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &Cause {
        name: names::TRACKER_DRIFT,
        place: "tracker",
        formula: "the tracker's frame moves steadily, with the warm-up, or slowly",
        size: "10 to 200 um",
        confounded: "thermal_growth, base_shift",
        needs: "time",
        sentence: "the tracker's frame drifts slowly{rows}",
        laws: &[
            row!(DRIFT, follows: Steady, tried: || 3, says: "the tracker's frame drifts {pace}{rows}"),
            row!(DRIFT, follows: Follows::Warmth(&[Temperature, WarmUp]), tried: || 3, rarity: || *RARE,
                says: "the tracker's frame drifts with the warm-up{rows}"),
            row!(DRIFT, at: At::Tracker(&[Axes::Place]), follows: Slow, rarity: || *RARE),
        ],
        measure: Some(WATCH),
        of_the_measurement: true,
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &Cause {
        name: "tracker_scale",
        place: "tracker",
        formula: "all distances are longer by a share",
        size: "1 to 20 um/m",
        confounded: "link_geometry, which absorbs it",
        needs: "a scale bar: points of the arm never show it",
        of_the_measurement: true,
        ..Cause::PLAIN
    },
    &Cause {
        name: names::TRACKER_CIRCLE,
        place: "tracker",
        formula: "azimuth errs by a sin(n az) + b cos(n az), n = 1, 2",
        size: "0.5 to 5 arcsec",
        confounded: "base_frame and gear_cyclic of joint 1 where the azimuth changes little",
        needs: "points measured from outside the arm's reach, the instrument at the recording's origin",
        sentence: "the tracker's azimuths err periodically: {each}",
        // The horizontal circle sits off its axis, or is out of round.
        laws: &[
            row!(CIRCLE, at: At::Reading(Polar::Azimuth), follows: Waves(Turning::Azimuth, [1, 2], false), tried: || 2, says: ORDER),
        ],
        measure: Some(TWO_FACES),
        of_the_measurement: true,
        ..Cause::PLAIN
    },
    &Cause {
        name: names::TRACKER_ELEVATION,
        place: "tracker",
        formula: "elevation or azimuth errs by a sin(n el) + b cos(n el), n = 1, 2",
        size: "0.5 to 5 arcsec",
        confounded: "base_frame and link_geometry where the elevation changes little",
        needs: "points measured from outside the arm's reach, the instrument at the recording's origin, its z upright",
        sentence: "the tracker's head errs with the elevation: {each}",
        // The head sags, or its vertical circle sits off its axis; a transit axis that is not level turns the azimuth.
        laws: &[
            row!(CIRCLE, at: At::Reading(Polar::Elevation), follows: Waves(Turning::Elevation, [1, 2], false), tried: || 3,
                says: "elevations by {amplitude}"),
            row!(CIRCLE, at: At::Reading(Polar::Azimuth), follows: Waves(Turning::Elevation, [1, 1], false), tried: || 3,
                variant: "transit", says: "azimuths by {amplitude}"),
        ],
        measure: Some(TWO_FACES),
        of_the_measurement: true,
        ..Cause::PLAIN
    },
    &Cause {
        name: "tracker_offset",
        place: "tracker",
        formula: "ranges are longer by c",
        size: "5 um to the radius of a reflector",
        confounded: "base_frame and link_geometry, which absorb most of it from afar",
        needs: "points measured from outside the arm's reach, the instrument at the recording's origin",
        sentence: "every range of the tracker is wrong by {1e3:0} um",
        // A dead path, or the constant of another reflector.
        laws: &[
            row!(PLAIN, at: At::Reading(Polar::Range), follows: Constant, rarity: || *RARE, number: "offset"),
        ],
        measure: measure!(2: "measure a line of three points from within it and from its end"),
        of_the_measurement: true,
        ..Cause::PLAIN
    },
    &Cause {
        name: "tracker_refraction",
        place: "tracker",
        formula: "ranges grow by c (T - T0), or c (1 - exp(-time / tau)), in proportion to their length",
        size: "1 um/m for each kelvin",
        confounded: "tracker_drift and thermal_growth of all links",
        needs: "temperature or time, the instrument at the recording's origin",
        sentence: "the tracker's ranges grow by {1e6:1} um/m for each kelvin",
        // Air changes by 1e-6 a kelvin; five times that, since the temperature that was logged need not be that along the beam, and no air in
        // a hall warms up by more than 30 K. More than twice that again is a weather station with a fault.
        laws: &[
            row!(AIR, follows: Follows::Warmth(&[Temperature]), largest: 1e-5, limit: Some(Limit { most: 5e-6, ..OF_AIR })),
            row!(AIR, follows: Follows::Warmth(&[WarmUp]), largest: 3e-4, limit: Some(Limit { most: 30.0 * 5e-6, ..OF_AIR }),
                says: "the tracker's ranges grow as the air warms up, by {1e6:1} um/m in the end with a time constant of {span}"),
        ],
        measure: measure!(2: "log the air's temperature and measure a fixed point on the floor now and then"),
        of_the_measurement: true,
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &joint_log_lag::CAUSE,
    &Cause {
        name: names::OUTLIER,
        place: "recording",
        formula: "single wrong points",
        of_the_measurement: true,
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &Cause {
        name: names::MISLABELLED_POINT,
        place: "recording",
        formula: "points that carry each other's name",
        of_the_measurement: true,
        separable_by_poses: false,
        ..Cause::PLAIN
    },
    &unknown::CAUSE,
];

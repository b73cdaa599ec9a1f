//! The twin beyond the library: instruments, memory and interactions against numbers worked out by hand, the set that is drawn from them,
//! and the library's set, which stays as it was.

use crate::twin::{ARCSEC, assert_near, row};
use calib::twin::arm::Arm;
use calib::twin::conceal::case::Case;
use calib::twin::conceal::design::{Content, Design};
use calib::twin::conceal::family::{BEYOND, Collection};
use calib::twin::conceal::robots::Kind;
use calib::twin::effect::{
    Circle, GearLoad, Heat, JointWarming, Physical, Presliding, TrackerCircle, TrackerElevation,
    TrackerOffset, TrackerRefraction, recall,
};
use calib::twin::matrix::IDENTITY;
use calib::twin::memory::{Moment, past};
use calib::twin::plan::Point;
use calib::twin::recorder::{Equilibrium, Shot, settle, sighted};
use calib::twin::truth::TrueRobot;

/// Moves of one joint, deg, 100 s apart, at a temperature that rises by 1 K from one to the next.
fn moves(travels_deg: &[f64]) -> Vec<Moment> {
    let moment = |(number, travel): (usize, &f64)| Moment {
        pieces: vec![vec![travel.to_radians()]],
        time_s: 100.0 * (number + 1) as f64,
        temperature_c: 21.0 + number as f64,
    };
    travels_deg.iter().enumerate().map(moment).collect()
}

fn remembered(effect: Physical, past: &[Moment]) -> Vec<f64> {
    recall(&[effect], past)
        .into_iter()
        .map(|memory| memory[0])
        .collect()
}

/// Two travels up leave 1 - exp(-2); half a travel back brings -1 + (1 + that) exp(-1/2); a joint that stays keeps what it had.
#[test]
fn lost_motion_of_dahl_fades_in_over_its_travel() {
    let friction = Presliding::effect(1, 30.0, 1.0, vec![]);
    let z = remembered(friction.clone(), &moves(&[2.0, -0.5, 0.0]));
    let expected = [0.864_664_716_763, 0.130_976_320_801, 0.130_976_320_801];
    assert_near(&z, expected, 1e-12);
    let found = settled(vec![0.5], &[friction]).motion.joint;
    assert_near(&found, [-15.0 * ARCSEC, 0.0, 0.0, 0.0, 0.0], 1e-15);
}

/// Elements that slip at 1 and 3 deg: after 2 deg up one slides and one is stretched by 2/3; 1.5 deg back leave -1/2 and 1/6.
#[test]
fn maxwells_elements_slip_one_after_another() {
    let friction = Presliding::effect(1, 30.0, 0.0, vec![1.0, 3.0]);
    let z = remembered(friction, &moves(&[2.0, -1.5]));
    assert_near(&z, [5.0 / 6.0, -1.0 / 6.0], 1e-12);
}

/// The arm of five joints at its zero pose under effects of this memory.
fn settled(memory: Vec<f64>, effects: &[Physical]) -> Equilibrium {
    let arm = Arm::new(&Kind::Five5r.description([0.0; 3]), &TrueRobot::default());
    settle(&arm, &row(&[0.0; 5], 0.0, memory), effects)
}

/// An arcsec of zero per unit of warmth, which saturates at `full`.
fn warming(heat: Heat, time_s: f64, full: f64) -> Physical {
    JointWarming::effect(1, heat, time_s, 0.0, full, 20.0, 1.0, 0.0, 0.0)
}

/// Half a radian, of which exp(-1) is left 100 s later when 0.2 come on top.
#[test]
fn a_joint_warms_by_its_own_work_and_cools_off() {
    let worked = moves(&[0.5f64.to_degrees(), -0.2f64.to_degrees()]);
    let warm = remembered(warming(Heat::Work, 100.0, 0.0), &worked);
    assert_near(&warm, [0.5, 0.383_939_720_586], 1e-12);
}

/// Behind a ramp of 0.01 K/s a body with 100 s ends up 1 K behind: after 1000 s it is 10 - 1 + exp(-10) K warmer.
#[test]
fn metal_trails_a_ramp_by_slope_times_its_time() {
    let warm = |time_s, full, rows| {
        remembered(
            warming(Heat::Temperature, time_s, full),
            &moves(&vec![0.0; rows]),
        )
    };
    assert_near(&warm(100.0, 0.0, 10)[9..], [9.000_045_399_930], 1e-11);
    assert_near(warm(0.0, 0.0, 3), [1.0, 2.0, 3.0], 1e-12);
    // Saturating at 2 K, the first kelvin is 2 tanh(1/2).
    assert_near(warm(0.0, 2.0, 1), [2.0 * 0.5f64.tanh()], 1e-12);
}

/// A repeat is reached as before: back to where the arm came from, and again.
#[test]
fn a_repeated_row_went_away_and_came_back() {
    let point = |q: f64, before: f64, time_s: f64| Point {
        block: 0,
        q: vec![q],
        before: vec![before],
        direction: vec![1.0],
        time_s,
        temperature_c: 20.0,
        payload_kg: 0.0,
    };
    let ways = past(&[
        point(0.3, 0.0, 10.0),
        point(0.3, 0.0, 20.0),
        point(0.5, 0.3, 30.0),
    ]);
    let travels: Vec<Vec<f64>> = ways
        .iter()
        .map(|moment| moment.travels(1).collect())
        .collect();
    assert_eq!(travels, [vec![0.3], vec![-0.3, 0.3], vec![0.2]]);
}

/// At azimuth 90 deg and 3 m from the standing axis 10 arcsec are 3 m times 10 arcsec against x; at 45 deg of elevation a tangent is 1.
#[test]
fn an_instrument_errs_in_range_azimuth_and_elevation_about_its_own_origin() {
    let circle = |circle, phase_deg| TrackerCircle::effect(circle, 10.0, phase_deg);
    let head = |index, sag, transit| TrackerElevation::effect(index, sag, 0.0, 0.0, transit);
    let ranges =
        |constant, cyclic, square| TrackerOffset::effect(constant, cyclic, 20_000.0, 0.0, square);
    let (high, turned) = ([0.0, 3.0, 4.0], [-30.0 * ARCSEC, 3.0, 4.0]);
    let (along, farther) = ([3.0, 0.0, 4.0], [3.000_06, 0.0, 4.000_08]);
    for (effect, point, expected, within) in [
        (circle(Circle::Eccentric, 0.0), high, turned, 1e-8),
        (circle(Circle::OffCentre, 0.0), high, turned, 1e-8),
        // Along x only the cosine shows: sin(0 + 90 deg).
        (
            circle(Circle::OffCentre, 90.0),
            along,
            [3.0, 30.0 * ARCSEC, 4.0],
            1e-8,
        ),
        (circle(Circle::Elliptic, 0.0), high, high, 1e-12),
        (
            head(4.0, 6.0, 0.0),
            [3.0, 0.0, 0.0],
            [3.0, 0.0, 30.0 * ARCSEC],
            1e-8,
        ),
        (
            head(0.0, 0.0, 10.0),
            [3.0, 0.0, 3.0],
            [3.0, 30.0 * ARCSEC, 3.0],
            1e-8,
        ),
        (ranges(75.0, 0.0, 1.0), along, farther, 1e-12),
        (ranges(0.0, 100.0, 0.0), along, farther, 1e-12),
    ] {
        let found = effect.sight(&row(&[0.0], 0.0, vec![0.0]), 0.0, point);
        assert_near(found, expected, within);
    }
}

/// 1 um/m/K, 5 K, 5 m: 25 um of range; the chain of the recording takes the memory of the right effect.
#[test]
fn warm_air_stretches_ranges_after_the_arm_has_settled() {
    let air = TrackerRefraction::effect(1.0, 20.0, 0.0, 0.0, 1.0);
    let effects = [Presliding::effect(1, 0.0, 1.0, vec![]), air];
    let memory = recall(&effects, &moves(&[0.0; 5])).pop().unwrap();
    let found = settled(memory.clone(), &effects);
    let seen = sighted(&found, &IDENTITY, &row(&[0.0; 5], 0.0, memory), &effects);
    let expected = [1.010, 0.0, 1.130].map(|metres| metres * (1.0 + 5e-6));
    assert_near(seen, expected, 1e-12);
}

/// 100 arcsec/Nm times sin(90 deg) times the torque of the wrist's weight: the hand's centre lies 115 mm before joint 4 in x.
#[test]
fn a_gear_under_load_errs_with_what_it_carries() {
    let found = settled(vec![], &[GearLoad::effect(4, 2.0, 100.0, 90.0, 0.0)]);
    // About +y the weight of 7.5 kg at 45 mm and of 2.1 kg at 115 mm turns downwards, positive.
    let torque = 9.81 * (7.5 * 0.045 + 2.1 * 0.115);
    let share = found.motion.joint[3] / (100.0 * ARCSEC * torque);
    assert!((share - 1.0).abs() < 1e-2, "{:?}", found.motion.joint);
}

#[test]
fn beyond_the_library_every_family_is_plain_in_both_forms() {
    for (row, family) in BEYOND.iter().enumerate() {
        for other_forms in [0.0, 1.0] {
            let collection = Collection::Beyond;
            let design = Design {
                seed: 8,
                points: Some(50),
                other_forms,
                faulty: 0.0,
                collection,
                ..Design::default()
            };
            let case = Case::make(&design, row, Content::Single(row)).unwrap();
            let first = case.concealed.first().unwrap();
            let name = format!(
                "{} ({}, {})",
                family.name,
                first.cause.form,
                case.kind.name()
            );
            assert!(
                first.cause.effect == family.name && case.want().len() == 1,
                "{name}: {:?}",
                case.want()
            );
            assert!(
                (50.0..=201.0).contains(&first.strength),
                "{name}: L {}",
                first.strength
            );
            assert_eq!(first.strange, other_forms > 0.5, "{name}");
        }
    }
}

#[test]
fn beyond_the_library_arms_have_five_joints_too_and_come_from_near_by() {
    let design = Design {
        seed: 4,
        cases: 34,
        points: Some(60),
        collection: Collection::Beyond,
        robots: vec![Kind::Five5r],
        ..Design::default()
    };
    let contents = design.contents();
    let rows: std::collections::BTreeSet<_> = contents.iter().collect();
    assert_eq!(rows.len(), BEYOND.len(), "each family in turn");
    let case = Case::make(&design, 3, contents[3]).unwrap();
    assert_eq!(case.robot.joints.len(), 5);
    assert!(case.recording().is_ok() && case.climate.swing_k > 0.0);
    let far = |pair: &[Shot]| -> f64 {
        let joints = pair[0].q.iter().zip(&pair[1].q);
        let far = joints.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        far.to_degrees()
    };
    let pairs = case.shots.windows(2);
    let near = pairs
        .filter(|pair| (1e-3..6.01).contains(&far(pair)))
        .count();
    assert!(
        (10..45).contains(&near),
        "{near} of {} short moves",
        case.shots.len()
    );
}

/// The set of the library is frozen: what a seed drew before there was another list it draws still.
#[test]
fn the_librarys_recordings_are_those_of_before() {
    let message_of = |seed: u64, cases: usize, share: f64| -> Vec<String> {
        let design = Design {
            seed,
            cases,
            points: Some(40),
            nulls: share,
            pairs: share,
            open: share,
            ..Design::default()
        };
        let contents = design.contents();
        let cases = contents
            .iter()
            .enumerate()
            .map(|(number, content)| Case::make(&design, number, *content).unwrap());
        let line = |case: Case| {
            let causes = case.concealed.iter().map(|one| {
                let (effect, place) = (one.cause.effect, &one.cause.place);
                format!(
                    "{effect} at {place}, {}, L {:.3}",
                    one.cause.form, one.strength
                )
            });
            let causes: Vec<String> = causes.collect();
            let (kind, held_out) = (case.kind.name(), case.shots.len() - case.fit);
            let causes = if causes.is_empty() {
                "nothing".into()
            } else {
                causes.join(" + ")
            };
            format!("{kind}, {held_out} held out: {causes}")
        };
        cases.map(line).collect()
    };
    // Written by the version before.
    assert_eq!(
        message_of(5, 6, 0.17),
        [
            "seven7r, 15 held out: joint_compliance at joint 4, one joint, L 105.174",
            "sr210d, 14 held out: gear_cyclic at joint 5, one high order, L 120.275",
            "compact6, 10 held out: base_shift at base, step, L 68.754 + gear_motor_cyclic at joint 1, one order, L 776.181",
            "seven7r, 10 held out: joint_hardening at joint 4, progressive, quadratic, L 58.032 + joint_compliance at joint 4, progressive, quadratic, L 1701.588",
            "seven7r, 12 held out: nothing",
            "seven7r, 19 held out: unknown at joint 3, bump, L 31.232",
        ]
    );
    assert_eq!(
        message_of(20_261_126, 5, 0.2),
        [
            "compact6, 17 held out: joint_hardening at joint 4, progressive, quadratic, L 5.745 + joint_compliance at joint 4, progressive, quadratic, L 40.436",
            "compact6, 11 held out: unknown at joint 4, bump, L 1534.223",
            "seven7r, 18 held out: joint_compliance at joint 2, all loaded joints, L 815.072 + joint_compliance at joint 3, all loaded joints, L 1472.398 + joint_compliance at joint 4, all loaded joints, L 1130.012 + joint_compliance at joint 5, all loaded joints, L 92.192 + joint_compliance at joint 6, all loaded joints, L 45.697",
            "compact6, 18 held out: nothing",
            "seven7r, 15 held out: joint_compliance at joint 4, one joint, L 69.928 + base_compliance at base, isotropic, L 452.517",
        ]
    );
}

//! Lost motion by the cause that leaves a joint on one side of its play: the load, friction under smaller loads than some threshold, or friction that
//! fades in over a travel after each reversal (Dahl).

use super::basis::around;
use super::{Basis, Law, Survey, Term, Variable, figure};
use crate::criteria::effect::{BENDS, RARE};

/// RatedLaws, each with how many like it are tried, and how much rarer it is than others.
type RatedLaws = Vec<(Law, usize, f64)>;

/// Widths of the blur as shares of the threshold.
const BLURS: [f64; 2] = [0.0, 0.5];
/// Smallest and largest threshold and blur, as shares of the joint's largest load: there the load or the approach decides alone.
const THRESHOLDS: [f64; 2] = [1e-3, 1.5];
/// Travels (rad) of pre-sliding tried at first; shortest and longest.
const TRAVELS: [f64; 6] = [0.004, 0.012, 0.035, 0.1, 0.25, 0.6];
const BOUNDS: [f64; 2] = [0.001, 1.5];
/// Moves shorter than so many travels have not slid yet; so many rows must have ended one.
const SHORT: f64 = 2.0;
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
pub(super) fn near(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
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
pub(super) fn impossible(
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
            .filter(|moved| *moved > 0.0 && *moved < SHORT * travel)
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

//! `backlash`: lost motion; half a gap to the side that friction or gravity leaves the joint on (hysteresis included).

use super::basis::around;
use super::{Basis, Cause, Hypothesis, Law, Measure, Motion, NumberSpec, Summary, Survey, Term, Variable, about, figure, names};
use crate::criteria::effect::{BENDS, RARE};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Lost motion by the side of approach or of the load.
pub struct Backlash;

/// Widths of the blur as shares of the threshold.
const BLURS: [f64; 2] = [0.0, 0.5];
/// Smallest and largest threshold and blur, as shares of the joint's largest load: there the load or the approach decides alone.
const THRESHOLDS: [f64; 2] = [1e-3, 1.5];

/// The side that the load pushes the joint to, blurred over some torque.
fn by_load(joint: usize, width: f64) -> Law {
    Law::new(Variable::Load { joint }, Basis::Rise { centre: 0.0, width })
}

/// Friction of so many Nm decides under smaller loads, larger ones push the joint to their side; blurred over some torque.
/// Positive: friction leaves the joint on the side to which it came; negative: it trails on the other one.
fn mixed(joint: usize, friction_nm: f64, width: f64) -> Law {
    let basis = if width > 0.0 { Basis::Rise { centre: 0.0, width } } else { Basis::Sign };
    Law::new(Variable::Push { joint, friction_nm }, basis)
}

/// Friction of a joint (Nm) by the torques of the arm, where they are known and some load is larger: below it, approach alone decides.
fn known(joint: usize, survey: &Survey) -> Option<f64> {
    let friction = survey.robot.description().joints[joint].coulomb?;
    (friction > 0.0 && friction < survey.load(joint)).then_some(friction)
}

impl Cause for Backlash {
    about! {
        name: names::BACKLASH,
        place: "joint",
        formula: "d = g s, or g sign(t), or the one at small and the other at large loads",
        size: "5 to 100 arcsec",
        confounded: "joint_hardening, joint_log_lag",
        needs: "both directions of approach",
        measure: Some(Measure { rank: 5, advice: "repeat poses from both sides under loads of both signs" }),
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for joint in survey.revolute() {
            let form = |law| Term::new(&Self, Motion::Joint { joint }, law);
            let both = survey.both_directions(joint);
            if survey.is_loaded(joint) {
                let most = survey.load(joint);
                let known = known(joint, survey).filter(|_| both);
                let otherwise = if known.is_some() { *RARE } else { 0.0 };
                let widths = [1e-9, 0.03, 0.08].map(|share| by_load(joint, share * most));
                out.extend(widths.map(|law| Hypothesis::new(form(law), 3).positive().penalised(otherwise)));
                for friction_nm in known.into_iter().flat_map(|friction| [friction, -friction]) {
                    let laws = BLURS.map(|blur| mixed(joint, friction_nm, blur * friction_nm.abs()));
                    out.extend(laws.map(|law| Hypothesis::new(form(law), BLURS.len()).positive()));
                }
                if both {
                    let mut loads: Vec<f64> = survey.torques(joint).map(f64::abs).collect();
                    loads.sort_by(f64::total_cmp);
                    let shares = [0.05, 0.15, 0.3, 0.5].map(|share| loads[((loads.len() - 1) as f64 * share) as usize]);
                    for friction_nm in shares.into_iter().flat_map(|friction| [friction, -friction]) {
                        let laws = BLURS.map(|blur| mixed(joint, friction_nm, blur * friction_nm.abs()));
                        let count = *BENDS * BLURS.len();
                        out.extend(laws.map(|law| Hypothesis::new(form(law), count).positive().penalised(otherwise)));
                    }
                }
            }
            if both {
                let side = Law::of(Variable::Approach { joint });
                out.push(Hypothesis::new(form(side), 1));
                let [start, end] = survey.time;
                if end > start {
                    let growing = side.times(Variable::Time, Basis::Creep { start, end, exponent: 1.0 });
                    out.push(Hypothesis::new(form(growing), 2).penalised(*RARE));
                }
                if survey.is_loaded(joint) {
                    let yielding = side.times(Variable::Load { joint }, Basis::PROPORTIONAL);
                    out.push(Hypothesis::new(form(yielding), 2).penalised(*RARE));
                }
            }
        }
        out
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        match term.law().times.map(|factor| factor.of) {
            Some(Variable::Load { .. }) => vec![("half_gap_per_load".into(), Unit::RadianPerNewtonMetre, 1e-4)],
            Some(_) => vec![("half_gap_in_the_end".into(), Unit::Radian, 0.01)],
            None => vec![("half_gap".into(), Unit::Radian, 0.01)],
        }
    }

    fn variant(&self, term: &Term) -> String {
        match term.law().times.map(|factor| factor.of) {
            Some(Variable::Load { .. }) => "by_load",
            Some(_) => "growing",
            None => "",
        }
        .into()
    }

    fn near(&self, term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
        let Variable::Push { joint, friction_nm } = term.law().first.of else { return Vec::new() };
        let width = if let Basis::Rise { width, .. } = term.basis() { width } else { 0.0 };
        if known(joint, survey) == Some(friction_nm.abs()) {
            return Vec::new();
        }
        let bounds = THRESHOLDS.map(|share| share * survey.load(joint));
        let scaled = |value: f64| {
            let sizes = [1.6, 1.25].into_iter().flat_map(move |first| around(value.abs(), first, 0.5, level, bounds));
            sizes.map(move |size| libm::copysign(size, value))
        };
        let wider = scaled(width).filter(|_| width > 0.0).map(|width| mixed(joint, friction_nm, width));
        scaled(friction_nm).map(|friction_nm| mixed(joint, friction_nm, width)).chain(wider).map(|law| term.with(law)).collect()
    }

    fn sentence(&self, summary: &Summary) -> String {
        let place = summary.place;
        let times = |term: &Term| term.law().times.map(|factor| factor.of);
        match summary.terms(names::BACKLASH).next().and_then(times) {
            Some(Variable::Load { .. }) => {
                return format!(
                    "the compliance of {place} depends on the direction of approach: half the difference is {}",
                    summary.value()
                );
            }
            Some(_) => return format!("the lost motion of {place} grows, to a half-gap of {} in the end", summary.size()),
            None => {}
        }
        let by = match summary.terms(names::BACKLASH).next().map(|term| term.law().first.of) {
            Some(Variable::Load { .. }) => "to the side that the load pushes it".to_string(),
            Some(Variable::Push { friction_nm, .. }) => {
                let friction = figure(friction_nm.abs(), 0);
                format!("by the direction of approach, and above about {friction} Nm to the side to which the load pushes it")
            }
            Some(_) => "by the direction of approach".to_string(),
            None => return format!("{place} has lost motion to the side that its load pushes it"),
        };
        format!("{place} has lost motion: a half-gap of {} {by}", summary.size())
    }

    fn impossible(&self, term: &Term, p: &[f64], error: &dyn Fn(usize) -> f64, survey: &Survey) -> Option<String> {
        let law = term.law();
        if let Variable::Push { joint, friction_nm } = law.first.of {
            let most = survey.recorded_load(joint);
            let [friction, largest] = [friction_nm.abs(), most].map(|torque| figure(torque, 0));
            if friction_nm.abs() > most {
                return Some(format!("its threshold of {friction} Nm lies beyond the largest recorded load of {largest} Nm"));
            }
        }
        let pushed = matches!(law.first.of, Variable::Load { .. } | Variable::Push { .. });
        (pushed && *p.first()? < -error(0)).then(|| "its gap is negative".into())
    }
}

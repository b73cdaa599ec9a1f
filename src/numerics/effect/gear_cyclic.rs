//! `gear_cyclic`: transmission or encoder error periodic in the joint angle; a sine and a cosine for each order per joint turn.

use super::summary::amplitude;
use super::{
    Basis, Cause, Hypothesis, Law, Motion, NumberSpec, ParameterEstimate, Place, Summary, Survey, Term, Variable, about, figure,
    names, orders,
};
use crate::criteria::effect::{LOW_ORDERS, UNCOMMON};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Transmission or encoder error periodic in the joint angle.
pub struct GearCyclic;

/// Orders per joint turn that are tried: strain wave gears and absolute encoders show some twenty, worm wheels more.
const ORDERS: u32 = 48;
/// Eccentricity makes the lowest orders on any joint; they are tried as a few, all others as many.
const LOW: u32 = 4;
/// Below this order those between whole ones are tried, too.
const BETWEEN: u32 = 20;

impl GearCyclic {
    /// The error of one order per turn of a joint; with its overtone, twice the order, as an eccentric wheel or disc has it.
    pub fn term(joint: usize, order: u32, overtone: bool) -> Term {
        Term::new(&Self, Motion::Joint { joint }, Law::new(Variable::Angle { joint }, Basis::Wave { order, overtone }))
    }
}

impl Cause for GearCyclic {
    about! {
        name: names::GEAR_CYCLIC,
        place: "joint",
        formula: "d = a sin(n q) + b cos(n q), n = 1 .. 48",
        size: "5 to 100 arcsec",
        confounded: "counterbalance at n = 1, axis_wobble",
        needs: "enough points a period",
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute();
        let forms = joints.flat_map(|joint| {
            orders::within_travel(survey, joint, ORDERS).flat_map(move |order| {
                let pure =
                    Hypothesis::new(Self::term(joint, order, false), if order > LOW { ORDERS as usize } else { *LOW_ORDERS });
                let wheel =
                    (order <= LOW).then(|| Hypothesis::new(Self::term(joint, order, true), *LOW_ORDERS).penalised(*UNCOMMON));
                [Some(pure), wheel].into_iter().flatten().map(|hypothesis| hypothesis.within(orders::BEYOND))
            })
        });
        // Orders of gears with a fraction of a turn: half ones to begin with.
        let joints = survey.revolute();
        let between = joints.flat_map(|joint| {
            let travel = survey.travel(joint);
            let orders = (1..BETWEEN).map(|order| f64::from(order) + 0.5).filter(move |order| orders::is_within(*order, travel));
            let term = move |order| {
                Term::new(&Self, Motion::Joint { joint }, Law::new(Variable::Angle { joint }, orders::of_order(order)))
            };
            orders.map(move |order| Hypothesis::new(term(order), ORDERS as usize).penalised(*UNCOMMON).within(orders::BEYOND))
        });
        forms.chain(between).collect()
    }

    /// Orders in between: a gear stage need not be in phase with its joint.
    fn near(&self, term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
        let (Motion::Joint { joint }, Some(order)) = (term.motion(), orders::order(term.basis())) else { return Vec::new() };
        if matches!(term.basis(), Basis::Wave { overtone: true, .. }) {
            return Vec::new();
        }
        let step = 0.25 * libm::exp2(-f64::from(level));
        let orders = [order - step, order + step].into_iter().filter(|order| orders::is_within(*order, survey.travel(joint)));
        term.with_bases(orders.map(orders::of_order))
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        let names = ["sin", "cos", "sin_overtone", "cos_overtone"].into_iter().take(term.law().count());
        names.map(|name| (name.to_string(), Unit::Radian, 0.01)).collect()
    }

    fn variant(&self, term: &Term) -> String {
        match term.basis() {
            Basis::Wave { order, overtone: true } => format!("order{order}_{}", 2 * order),
            _ => orders::variant(term),
        }
    }

    fn sentence(&self, summary: &Summary) -> String {
        let orders: Vec<String> = summary.estimates(names::GEAR_CYCLIC).map(|(term, numbers)| order(term, &numbers)).collect();
        format!("the transmission or encoder of {} errs periodically with its angle: {}", summary.place, orders.join(", "))
    }

    fn identities(&self, term: &Term, _called: &str) -> Vec<(&'static str, Place)> {
        let first = matches!(term.basis(), Basis::Wave { order: 1, .. });
        if first { vec![(names::COUNTERBALANCE, term.motion().place())] } else { Vec::new() }
    }
}

/// An order and its amplitude in words.
fn order(term: &Term, numbers: &[&ParameterEstimate]) -> String {
    let Some(order) = orders::order(term.basis()) else { return String::new() };
    let overtone =
        numbers.get(2..).filter(|pair| pair.len() >= 2).map(|pair| format!(" and {} times by {}", 2.0 * order, amplitude(pair)));
    let order = if order.fract().abs() < 1e-9 { format!("{order:.0}") } else { figure(order, 2) };
    format!("{order} times a turn by {}{}", amplitude(numbers), overtone.unwrap_or_default())
}

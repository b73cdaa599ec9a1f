//! `joint_hardening`: wind-up that is not proportional to the load; d = a tau + b f(tau), f of slope 1 at no load or a free curve.

use super::form::placed;
use super::unknown::PLAUSIBLE;
use super::{
    ArmState, BeyondRange, Cause, Deflection, Errors, Form, Hypothesis, Measure, NumberSpec,
    OwnMotion, ParameterEstimate, Place, Placed, Summary, Survey, Variable, figure, names,
};
use crate::criteria::effect::{self, RARE};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// What is added to the proportional part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum HardeningLaw {
    /// tau / (1 + |tau| / at): a gear that stiffens.
    Saturating { at_nm: f64 },
    /// at tanh(tau / at): a soft zone around no load.
    SoftZone { at_nm: f64 },
    /// tau up to `at`, nothing more beyond: two stiffnesses.
    Knee { at_nm: f64 },
    /// at (|tau| / at)^exponent with the sign of tau.
    Power { exponent: f64, at_nm: f64 },
    /// sin((2k - 1) pi / 2 tau / most), k = 1..=6: a curve through no load, odd as a wind-up is, held beyond the largest torque.
    Curve { most_nm: f64 },
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BentWindup {
    joint: usize,
    law: HardeningLaw,
}

/// Sines of a free curve.
const CURVE: usize = 6;
/// Smallest and largest torque of a bend, as shares of the joint's largest load: a smaller one is a step at no load, beyond the
/// largest it is never seen, and a power says as much of what bends gradually. See also [`least_bend`].
const BENDS: [f64; 2] = [0.01, 0.98];
/// Share of the rows that has to lie on the other side of a bend.
const BEYOND: f64 = 0.05;
pub(super) static CAUSE: Cause = Cause {
    name: names::JOINT_HARDENING,
    place: "joint",
    formula: "d = a t + b f(t): stiffer, softer, two slopes, a power, a free curve",
    size: "5 to 50 % of the wind-up",
    confounded: "joint_compliance, backlash",
    needs: "link masses and two payloads",
    measure: Some(Measure {
        rank: 7,
        advice: "measure with a third payload between none and full, and with joints near their largest load",
    }),
    motion: Some(OwnMotion {
        propose,
        sentence: Some(sentence),
        read: Form::kept::<BentWindup>,
    }),
    ..Cause::PLAIN
};

/// Every loaded joint with several laws each.
fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let mut out = Vec::new();
    for joint in survey.revolute().filter(|joint| survey.is_loaded(*joint)) {
        let most = survey.load(joint);
        let least = least_bend(survey, joint);
        let saturating: fn(f64) -> HardeningLaw = |at_nm| HardeningLaw::Saturating { at_nm };
        let soft_zone: fn(f64) -> HardeningLaw = |at_nm| HardeningLaw::SoftZone { at_nm };
        let knee: fn(f64) -> HardeningLaw = |at_nm| HardeningLaw::Knee { at_nm };
        let bends = [
            (saturating, 0.05),
            (saturating, 0.15),
            (saturating, 0.5),
            (saturating, BENDS[1]),
            (soft_zone, 0.2),
            (knee, 0.1),
            (knee, 0.3),
            (knee, 0.6),
        ];
        let bends = bends.into_iter().filter(|(_, share)| share * most >= least);
        let powers = [2.0, 3.0].map(|exponent| HardeningLaw::Power {
            exponent,
            at_nm: most,
        });
        let laws = bends.map(|(law, share)| law(share * most)).chain(powers);
        out.extend(laws.map(|law| {
            Hypothesis::new(BentWindup { joint, law }, *effect::BENDS).penalised(*RARE)
        }));
        let curve = BentWindup {
            joint,
            law: HardeningLaw::Curve { most_nm: most },
        };
        out.push(Hypothesis::new(curve, 1).penalised(*RARE));
    }
    out
}

fn sentence(summary: &Summary) -> String {
    let shape = summary
        .words(names::JOINT_HARDENING)
        .unwrap_or_else(|| "its shape is a free curve of the load".into());
    format!(
        "{} winds up under its load, but not in proportion: {shape}",
        summary.place
    )
}

/// Smallest torque of a bend that the loads of a joint show, Nm. Where they pull to both sides, any that is more than a step;
/// where they pull to one side, the smaller loads have to lie below it: else the joint's zero explains it as well, and where the
/// load changes its side the two differ by twice the step.
fn least_bend(survey: &Survey, joint: usize) -> f64 {
    let mut torques: Vec<f64> = survey.torques(joint).collect();
    let few = (BEYOND * torques.len() as f64) as usize;
    let against = torques.iter().filter(|torque| **torque < 0.0).count();
    let step = BENDS[0] * survey.load(joint);
    if against.min(torques.len() - against) > few || torques.is_empty() {
        return step;
    }
    torques.iter_mut().for_each(|torque| *torque = torque.abs());
    step.max(*torques.select_nth_unstable_by(few, f64::total_cmp).1)
}

impl BentWindup {
    /// What each number turns the joint by under a torque, per unit.
    fn rates(&self, torque: f64) -> Vec<f64> {
        match self.law {
            HardeningLaw::Curve { most_nm } => {
                let quarter = FRAC_PI_2 * (torque / most_nm).clamp(-1.0, 1.0);
                let sines = (0..CURVE).map(|k| libm::sin((2 * k + 1) as f64 * quarter));
                std::iter::once(torque).chain(sines).collect()
            }
            _ => vec![torque, self.bend(torque).0],
        }
    }

    /// f and its slope.
    fn bend(&self, torque: f64) -> (f64, f64) {
        match self.law {
            HardeningLaw::Saturating { at_nm } => {
                let denominator = 1.0 + torque.abs() / at_nm;
                (torque / denominator, 1.0 / (denominator * denominator))
            }
            HardeningLaw::SoftZone { at_nm } => {
                let t = libm::tanh(torque / at_nm);
                (at_nm * t, 1.0 - t * t)
            }
            HardeningLaw::Knee { at_nm } => {
                (torque.clamp(-at_nm, at_nm), f64::from(torque.abs() < at_nm))
            }
            HardeningLaw::Power { exponent, at_nm } => {
                let share = torque.abs() / at_nm;
                (
                    at_nm * libm::pow(share, exponent) * torque.signum(),
                    exponent * libm::pow(share, exponent - 1.0),
                )
            }
            HardeningLaw::Curve { .. } => (0.0, 0.0),
        }
    }
}

impl Placed for BentWindup {
    placed! { self: Place::Joint(self.joint), &CAUSE, [Variable::Load { joint: self.joint }], self }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let mut numbers = vec![("linear".into(), Unit::RadianPerNewtonMetre, 1e-3)];
        match self.law {
            HardeningLaw::Curve { .. } => {
                numbers.extend((1..=CURVE).map(|k| (format!("sin{k}"), Unit::Radian, PLAUSIBLE)))
            }
            _ => numbers.push(("bend".into(), Unit::RadianPerNewtonMetre, 1e-3)),
        }
        numbers
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let torque = state.posture.torque[self.joint];
        self.rates(torque)
            .into_iter()
            .enumerate()
            .for_each(|(k, rate)| out.turn(k, p, self.joint, rate));
        let bend = if let HardeningLaw::Curve { .. } = self.law {
            0.0
        } else {
            p[1] * self.bend(torque).1
        };
        out.yields(self.joint, p[0] + bend);
    }

    /// Both what it is at the end of its range and what it adds beyond: a law that levels off there may go on, and one that goes on level off.
    fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        p: &[f64],
        within: &[Option<[f64; 2]>],
        out: &mut BeyondRange,
    ) -> Option<Variable> {
        let (variable, share) = self.most_beyond(robot, state, within)?;
        let (torque, [low, high]) = (
            state.posture.torque[self.joint],
            within.first().copied().flatten()?,
        );
        let [end, now] =
            [torque.clamp(low.min(0.0), high.max(0.0)), torque].map(|torque| self.rates(torque));
        let mut add = |rates: Vec<f64>, factor: f64| {
            rates
                .into_iter()
                .enumerate()
                .for_each(|(k, rate)| out.motions.turn(k, p, self.joint, rate));
            out.close(factor * *effect::STIFFNESS_BEYOND);
        };
        add(
            now.iter().zip(&end).map(|(now, end)| now - end).collect(),
            1.0,
        );
        add(end, share);
        Some(variable)
    }

    /// Both near no load and far out.
    fn is_against_load(&self, p: &[f64], error: &Errors) -> bool {
        let per = if let HardeningLaw::Curve { most_nm } = self.law {
            1.0 / most_nm
        } else {
            1.0
        };
        let bent = |sum: &dyn Fn(usize) -> f64| per * (1..p.len()).map(sum).sum::<f64>();
        // The sines of a free curve are 1 and -1 in turn where the load is largest.
        let near = p[0] + bent(&|k| if k % 2 == 1 { p[k] } else { -p[k] });
        p[0] < 0.0 && near < 0.0 && p[0] < -error(0) && near < -error(0) - bent(error)
    }

    fn compliance(&self, p: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint, *p.first()?))
    }

    fn impossible(&self, _p: &[f64], _error: &Errors, survey: &Survey) -> Option<String> {
        let (HardeningLaw::Saturating { at_nm }
        | HardeningLaw::SoftZone { at_nm }
        | HardeningLaw::Knee { at_nm }) = self.law
        else {
            return None;
        };
        let most = survey.recorded_load(self.joint);
        let [at, largest] = [at_nm, most].map(|torque| figure(torque, 0));
        (at_nm > most).then(|| {
            format!("its bend at {at} Nm lies beyond the largest recorded load of {largest} Nm")
        })
    }

    fn words(&self, _numbers: &[&ParameterEstimate]) -> Option<String> {
        match self.law {
            HardeningLaw::Saturating { at_nm } => {
                Some(format!("it stiffens above about {} Nm", figure(at_nm, 0)))
            }
            HardeningLaw::SoftZone { at_nm } => {
                Some(format!("it is soft below about {} Nm", figure(at_nm, 0)))
            }
            HardeningLaw::Knee { at_nm } => Some(format!(
                "it has two stiffnesses, with the knee at {} Nm",
                figure(at_nm, 0)
            )),
            HardeningLaw::Power { exponent, .. } => Some(format!(
                "it grows by the load to the power of {}",
                figure(exponent, 1)
            )),
            HardeningLaw::Curve { .. } => None,
        }
    }

    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        let step = libm::pow(1.5, libm::exp2(-0.5 * f64::from(level)));
        let most = survey.load(self.joint);
        let least = least_bend(survey, self.joint);
        let largest = BENDS[1] * most;
        let scaled = |factor: f64| {
            let mut law = self.law;
            match &mut law {
                HardeningLaw::Saturating { at_nm }
                | HardeningLaw::SoftZone { at_nm }
                | HardeningLaw::Knee { at_nm } => {
                    *at_nm = (*at_nm * factor).clamp(least.min(largest), largest)
                }
                HardeningLaw::Power { exponent, .. } => {
                    *exponent = (*exponent * factor).clamp(0.2, 6.0)
                }
                HardeningLaw::Curve { .. } => return None,
            }
            Some(law)
        };
        let laws = [step, 1.0 / step]
            .into_iter()
            .filter_map(scaled)
            .filter(|law| *law != self.law);
        laws.map(|law| {
            Self {
                joint: self.joint,
                law,
            }
            .into()
        })
        .collect()
    }
}

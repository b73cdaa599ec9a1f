//! Columns of the table of causes: where a law acts, what it follows, in which shapes, and what its numbers are called.

use super::basis::around;
use super::law_shapes::{self, RatedLaws, Warmth};
use super::motion::{SHORT, extent};
use super::{
    Axes, AxisPoint, Basis, Cause, Errors, Factor, Hypothesis, Law, Motion, NumberSpec, Polar,
    Survey, Term, Variable, figure,
};
use crate::criteria::effect::{RARE, RARER};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Laws of a cause: one for each place and each shape.
#[derive(Debug, Clone, Copy)]
pub struct LawRow {
    /// Where it acts.
    pub at: At,
    /// What it follows, and how.
    pub follows: Follows,
    /// What its size is in proportion to.
    pub times: Option<Times>,
    /// How many like it are tried, which share the weight of one; of shapes by themselves, times their number.
    pub tried: fn() -> usize,
    /// -2 ln of its prior odds against the other laws of its cause.
    pub rarity: fn() -> f64,
    /// Whether only positive coefficients make sense.
    pub positive: bool,
    /// The largest coefficient that makes sense, SI.
    pub largest: f64,
    /// What no such thing does, in words.
    pub limit: Option<Limit>,
    /// Name of its number, of what is no wave, follows no warmth and moves no frame.
    pub number: &'static str,
    /// One sigma of what is known of a number before any measurement, SI.
    pub sigma: f64,
    /// What distinguishes it from other laws of its cause in one model; empty: the order of a wave, else nothing.
    pub variant: &'static str,
    /// The sentence for it, in the place of the cause's own unless that has `{each}`: words with holes, see `sentence.rs`.
    pub says: &'static str,
}

/// The largest number of a cause as people know it.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// SI.
    pub(crate) most: f64,
    /// Of what more is not possible.
    pub(crate) subject: &'static str,
    /// Why a number below zero is not possible; `None` where it is.
    pub(crate) negative: Option<&'static str>,
}

/// Where laws act.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum At {
    /// Every joint that turns.
    Joints,
    /// Every joint.
    AllJoints,
    /// The axis of every joint that turns but the last, whose tilt one point cannot separate from its angle: about points of the axis, both
    /// directions or one, standing or turning with the joint.
    Axes,
    /// A joint because of another one, of pairs that the robot file does not declare.
    Pairs,
    /// Runs of neighbouring links; they begin and end with a link that can grow, else they are the same as shorter ones.
    Runs,
    /// The base, in each of these ways.
    Base(&'static [Axes]),
    /// The target on the tool.
    Tool,
    /// The measuring frame, in each of these ways.
    Tracker(&'static [Axes]),
    /// What an instrument reads that sees the arm from outside.
    Reading(Polar),
}

/// What a law follows, in which shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Follows {
    /// Waves of whole orders, from and to, perhaps with twice the order. A search moves the order of a lone wave by up to a quarter (`near`).
    Waves(Turning, [u32; 2], bool),
    /// Waves of the joint's angle of orders 1.5, 2.5 and so on below this one.
    HalfOrders(u32),
    /// The side of approach.
    Approach,
    /// The side to which the load pushes.
    Side,
    /// The side of the approach under small loads, of the load under large ones.
    Push,
    /// Pre-sliding travel since a reversal.
    Slip,
    /// The angle of the other joint.
    Angle,
    /// Against the joint's velocity.
    Velocity,
    /// Nothing: a constant.
    Constant,
    /// The payload, 1 at the largest.
    Payload,
    /// A step at some time.
    Step,
    /// A power of time.
    Steady,
    /// A slow curve of time.
    Slow,
    /// A warmth that is known in one of these ways.
    Warmth(&'static [Warmth]),
}

/// The angle of which waves are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turning {
    /// The joint's.
    Joint,
    /// That of its motor.
    Motor,
    /// The instrument's about its standing axis.
    Azimuth,
    /// That above its horizon.
    Elevation,
}

/// What the size of a law is in proportion to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Times {
    /// The side of approach.
    Approach,
    /// The load of the joint.
    Load,
    /// The angle of the joint.
    Angle,
    /// The distance from the instrument.
    Range,
    /// Time since the start.
    Time,
}

/// Powers of time by which a drift may go on: what settles and what begins slowly.
const POWERS: [f64; 2] = [0.25, 3.0];
/// Cosines of a slow course.
const SLOW: usize = 3;
/// Points of an axis that are nearer to each other (m) are one.
const NEAR: f64 = 0.02;

impl LawRow {
    /// A law at joints that turn, as common as others of its cause.
    pub const PLAIN: Self = Self {
        at: At::Joints,
        follows: Follows::Approach,
        times: None,
        tried: || 1,
        rarity: || 0.0,
        positive: false,
        largest: f64::INFINITY,
        limit: None,
        number: "",
        sigma: 0.01,
        variant: "",
        says: "",
    };

    /// Its hypotheses under the name of a cause.
    pub(super) fn propose(&self, cause: &'static Cause, survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for (motion, joint, rarer) in self.at.motions(survey) {
            let factor = match self.times.map(|times| times.factor(joint, survey)) {
                Some(None) => continue,
                factor => factor.flatten(),
            };
            for (law, tried, rare) in self.follows.laws(motion, joint, survey) {
                let law = Law {
                    times: factor,
                    ..law
                };
                let tried = tried * (self.tried)();
                out.push(Hypothesis {
                    prior_penalty: (self.rarity)() + rarer + rare,
                    positive: self.positive,
                    largest: self.largest,
                    ..Hypothesis::new(Term::new(cause, motion, law), tried)
                });
            }
        }
        out
    }

    /// Whether a term is one of its laws.
    pub(super) fn is(&self, term: &Term) -> bool {
        let law = term.law();
        let times = law.times.map(|factor| Times::of(factor.variable));
        self.at.is(term.motion()) && self.follows.is(law.first) && times == self.times.map(Some)
    }

    /// The coefficients of one of its laws.
    pub(super) fn numbers(&self, term: &Term, robot: &RobotModel) -> Vec<NumberSpec> {
        let unit = self.unit(term.motion(), robot);
        let named = |name: String| (name, unit, self.sigma);
        match (term.motion(), self.follows) {
            (Motion::Axis { about, .. }, _) => {
                let names = ["a_sin", "a_cos", "b_sin", "b_cos"].into_iter().enumerate();
                names
                    .filter(|(k, _)| about.is_none_or(|about| about == k / 2))
                    .map(|(_, name)| named(name.into()))
                    .collect()
            }
            (_, Follows::Waves(..) | Follows::HalfOrders(_)) => {
                let names = ["sin", "cos", "sin_overtone", "cos_overtone"]
                    .into_iter()
                    .take(term.basis().count());
                names.map(|name| named(name.into())).collect()
            }
            (Motion::Base { .. } | Motion::Tool { .. } | Motion::Tracker { .. }, Follows::Slow) => {
                (1..=term.law().count())
                    .flat_map(|k| {
                        term.motion()
                            .frame_numbers(move |name| format!("{name}_cos{k}"))
                    })
                    .collect()
            }
            (Motion::Base { .. } | Motion::Tool { .. } | Motion::Tracker { .. }, _) => {
                term.motion().frame_numbers(str::to_string)
            }
            (_, Follows::Warmth(kinds)) => {
                let kind = kinds
                    .iter()
                    .find(|kind| kind.is(term.law().first.variable, term.basis()));
                vec![named(kind.map_or("", |kind| kind.number()).into())]
            }
            _ => vec![named(self.number.into())],
        }
    }

    fn unit(&self, motion: Motion, robot: &RobotModel) -> Unit {
        match (motion, self.times, self.follows) {
            (Motion::Joint { .. }, Some(Times::Load), _) => Unit::RadianPerNewtonMetre,
            (Motion::Joint { .. }, Some(Times::Angle), _) => Unit::One,
            (Motion::Joint { .. }, _, Follows::Velocity) if motion.unit(robot) == Unit::Radian => {
                Unit::RadianPerRadianPerSecond
            }
            (Motion::Joint { .. }, _, Follows::Velocity) => Unit::Second,
            (Motion::Coupled { .. } | Motion::Links { .. }, ..)
            | (Motion::Instrument { .. }, Some(Times::Range), _) => Unit::One,
            _ => motion.unit(robot),
        }
    }

    /// What tells a term of it from others of its cause: see [`Placed::variant`](super::Placed::variant).
    pub(super) fn variant(&self, term: &Term) -> String {
        if !self.variant.is_empty() {
            return self.variant.into();
        }
        let Some(order) = law_shapes::order(term.basis()) else {
            return String::new();
        };
        let tail = match (term.basis(), term.motion()) {
            (
                Basis::Wave {
                    order,
                    overtone: true,
                },
                _,
            ) => format!("_{}", 2 * order),
            (_, Motion::Axis { turning: false, .. }) => "_fixed".into(),
            _ => String::new(),
        };
        format!("order{}{tail}", law_shapes::in_name(order))
    }

    /// Why a term of it with coefficients `p` cannot be its cause: see [`Placed::impossible`](super::Placed::impossible).
    pub(super) fn impossible(
        &self,
        term: &Term,
        p: &[f64],
        error: &Errors,
        survey: &Survey,
    ) -> Option<String> {
        let value = *p.first()?;
        let beyond = self.limit.and_then(|limit| {
            let per = match term.basis() {
                Basis::Settling { .. } => "in all",
                _ => "for each kelvin",
            };
            let size = match limit.negative {
                Some(why) if value < -error(0) => return Some(why.to_string()),
                Some(_) => value,
                None => value.abs(),
            };
            (size > limit.most).then(|| {
                let [size, largest] = [size, limit.most].map(|share| figure(1e6 * share, 0));
                format!(
                    "{size} um/m {per} is more than the {largest} {}",
                    limit.subject
                )
            })
        });
        beyond.or_else(|| match self.follows {
            Follows::Side | Follows::Push => {
                law_shapes::impossible_play(term, value, error(0), survey)
            }
            Follows::Warmth(_) => law_shapes::impossible_warmth(term, survey),
            _ => None,
        })
    }
}

/// Terms with other shapes around that of a term, closer with every level: see [`Placed::near`](super::Placed::near).
pub(super) fn near(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    match (term.law().first.variable, term.basis()) {
        (Variable::Time, Basis::After { .. }) => law_shapes::near_change(term, survey),
        (
            _,
            Basis::Power {
                start,
                end,
                exponent,
            },
        ) => {
            let exponents = around(exponent, 1.5, 0.7, level, POWERS);
            term.with_bases(exponents.map(|exponent| Basis::Power {
                start,
                end,
                exponent,
            }))
        }
        (Variable::Push { .. }, _) => law_shapes::near_push(term, survey, level),
        (Variable::Slip { .. }, _) => law_shapes::near_slip(term, level),
        (
            Variable::Angle { .. },
            Basis::Wave {
                overtone: false, ..
            }
            | Basis::Sway { .. },
        ) => law_shapes::near_order(term, survey, level),
        _ => law_shapes::near_warmth(term, survey, level),
    }
}

impl At {
    /// The motions, each with its joint, and how much rarer it is than others.
    fn motions(self, survey: &Survey) -> Vec<(Motion, Option<usize>, f64)> {
        let n = survey.joints();
        let all = |axes: &[Axes], value_of: fn(Axes) -> Motion| {
            axes.iter()
                .map(|axes| (value_of(*axes), None, 0.0))
                .collect()
        };
        let joint = |joint| (Motion::Joint { joint }, Some(joint), 0.0);
        match self {
            Self::Joints => survey.revolute().map(joint).collect(),
            Self::AllJoints => (0..n).map(joint).collect(),
            Self::Axes => survey
                .revolute()
                .filter(|joint| joint + 1 < n)
                .flat_map(|joint| tilts(joint, survey))
                .collect(),
            Self::Pairs => {
                let couplings = &survey.robot.description().couplings;
                let declared = |by, moved| couplings.iter().any(|c| c.by == by && c.moved == moved);
                let pairs = (0..n).flat_map(|by| (0..n).map(move |moved| (by, moved)));
                let pairs = pairs.filter(|(by, moved)| by != moved && !declared(*by, *moved));
                let rarer = |by: usize, moved| if by.abs_diff(moved) == 1 { 0.0 } else { *RARER };
                pairs
                    .map(|(by, moved)| (Motion::Coupled { by, moved }, Some(by), rarer(by, moved)))
                    .collect()
            }
            Self::Runs => {
                let long = |link: usize| extent(survey.robot, link).norm() > SHORT;
                let runs =
                    (0..n - 1).flat_map(|first| (first..n - 1).map(move |last| (first, last)));
                let runs = runs.filter(|(first, last)| long(*first) && long(*last));
                runs.map(|(first, last)| (Motion::Links { first, last }, None, 0.0))
                    .collect()
            }
            Self::Base(axes) => all(axes, |axes| Motion::Base { axes }),
            Self::Tool => all(&[Axes::Place], |axes| Motion::Tool { axes }),
            Self::Tracker(_) if survey.length() <= 0.0 => Vec::new(),
            Self::Tracker(axes) => all(axes, |axes| Motion::Tracker { axes }),
            Self::Reading(reading) => survey
                .seen_from_outside()
                .then_some((Motion::Instrument { reading }, None, 0.0))
                .into_iter()
                .collect(),
        }
    }

    fn is(self, motion: Motion) -> bool {
        match (self, motion) {
            (Self::Reading(reading), Motion::Instrument { reading: wanted }) => reading == wanted,
            (Self::Joints | Self::AllJoints, Motion::Joint { .. })
            | (Self::Axes, Motion::Axis { .. })
            | (Self::Pairs, Motion::Coupled { .. })
            | (Self::Runs, Motion::Links { .. })
            | (Self::Base(_), Motion::Base { .. })
            | (Self::Tool, Motion::Tool { .. })
            | (Self::Tracker(_), Motion::Tracker { .. }) => true,
            _ => false,
        }
    }
}

/// Tilts of the axis of a joint: about its own point, or rarely about those nearest to its neighbours.
fn tilts(joint: usize, survey: &Survey) -> Vec<(Motion, Option<usize>, f64)> {
    let point = survey.robot.point(joint);
    let far = |at: &AxisPoint| {
        *at == AxisPoint::Own || (at.of(survey.robot, joint) - point).norm() > NEAR
    };
    let points = [AxisPoint::Own, AxisPoint::Next, AxisPoint::Before]
        .into_iter()
        .filter(far);
    let ways = points.flat_map(|at| [true, false].map(|turning| (at, turning)));
    let all = ways.flat_map(|(at, turning)| {
        [None, Some(0), Some(1)].map(|about| {
            (
                at,
                Motion::Axis {
                    joint,
                    about,
                    turning,
                    at,
                },
            )
        })
    });
    all.map(|(at, motion)| {
        (
            motion,
            Some(joint),
            if at == AxisPoint::Own { 0.0 } else { *RARE },
        )
    })
    .collect()
}

impl Follows {
    /// The laws of a motion, each with how many like it are tried, and how much rarer it is than others.
    fn laws(self, motion: Motion, joint: Option<usize>, survey: &Survey) -> RatedLaws {
        let one_law = |variable, basis| vec![(Law::new(variable, basis), 1, 0.0)];
        let [start, end] = survey.time;
        match (self, joint) {
            (Self::Waves(turning, [from, to], overtone), joint) => {
                let Some(variable) = turning.variable(joint, survey) else {
                    return Vec::new();
                };
                // An axis tilts whether its joint travels far or not.
                let is_seen = |order: &u32| match (motion, variable) {
                    (Motion::Joint { .. }, Variable::Angle { joint }) => {
                        law_shapes::is_within(f64::from(*order), survey.travel(joint))
                    }
                    _ => true,
                };
                let law = |order| Law::new(variable, Basis::Wave { order, overtone });
                (from..=to)
                    .filter(is_seen)
                    .map(|order| (law(order), 1, 0.0))
                    .collect()
            }
            (Self::HalfOrders(below), Some(joint)) => {
                let halves = (1..below).map(|order| f64::from(order) + 0.5);
                let seen =
                    halves.filter(|order| law_shapes::is_within(*order, survey.travel(joint)));
                seen.map(|order| {
                    (
                        Law::new(Variable::Angle { joint }, law_shapes::of_order(order)),
                        1,
                        0.0,
                    )
                })
                .collect()
            }
            (Self::Approach, Some(joint)) if survey.both_directions(joint) => {
                one_law(Variable::Approach { joint }, Basis::PROPORTIONAL)
            }
            (Self::Side, Some(joint)) => law_shapes::by_load(joint, survey),
            (Self::Push, Some(joint)) => law_shapes::mixed(joint, survey),
            (Self::Slip, Some(joint)) => law_shapes::slip(joint, survey),
            (Self::Angle, Some(joint)) => one_law(Variable::Angle { joint }, Basis::PROPORTIONAL),
            (Self::Velocity, Some(joint)) => {
                let moves = survey.moves()
                    && survey
                        .rows
                        .iter()
                        .any(|row| survey.data.velocity(*row, joint) != 0.0);
                if moves {
                    one_law(
                        Variable::Velocity { joint },
                        Basis::Linear {
                            zero: 0.0,
                            per: -1.0,
                        },
                    )
                } else {
                    Vec::new()
                }
            }
            // 1 at any range.
            (Self::Constant, _) => one_law(Variable::Range, Basis::After { at: 0.0 }),
            (Self::Payload, _) if survey.payload_changes() => one_law(
                Variable::Payload,
                Basis::Linear {
                    zero: 0.0,
                    per: 2.0 * survey.heavy_payload(),
                },
            ),
            (Self::Step, _) => law_shapes::changes(motion, survey),
            (Self::Steady, _) => one_law(
                Variable::Time,
                Basis::Power {
                    start,
                    end,
                    exponent: 1.0,
                },
            ),
            (Self::Slow, _) => one_law(
                Variable::Time,
                Basis::Cosines {
                    low: start,
                    high: end,
                    count: SLOW,
                },
            ),
            (Self::Warmth(kinds), joint) => {
                let laws = kinds.iter().flat_map(|kind| kind.laws(joint, survey));
                laws.map(|(law, tried)| (law, tried, 0.0)).collect()
            }
            _ => Vec::new(),
        }
    }

    fn is(
        self,
        Factor {
            variable, basis, ..
        }: Factor,
    ) -> bool {
        match self {
            Self::Waves(turning, _, overtone) => {
                turning.is(variable)
                    && matches!(basis, Basis::Wave { overtone: is_overtone, .. } if is_overtone == overtone)
            }
            Self::HalfOrders(_) => {
                Turning::Joint.is(variable) && matches!(basis, Basis::Sway { .. })
            }
            Self::Approach => matches!(variable, Variable::Approach { .. }),
            Self::Side => matches!(
                (variable, basis),
                (Variable::Load { .. }, Basis::Rise { .. })
            ),
            Self::Push => matches!(variable, Variable::Push { .. }),
            Self::Slip => matches!(variable, Variable::Slip { .. }),
            Self::Angle => matches!(
                (variable, basis),
                (Variable::Angle { .. }, Basis::Linear { .. })
            ),
            Self::Velocity => matches!(variable, Variable::Velocity { .. }),
            Self::Constant => variable == Variable::Range,
            Self::Payload => variable == Variable::Payload,
            Self::Step => matches!((variable, basis), (Variable::Time, Basis::After { .. })),
            Self::Steady => matches!((variable, basis), (Variable::Time, Basis::Power { .. })),
            Self::Slow => matches!((variable, basis), (Variable::Time, Basis::Cosines { .. })),
            Self::Warmth(kinds) => kinds.iter().any(|kind| kind.is(variable, basis)),
        }
    }
}

impl Turning {
    fn variable(self, joint: Option<usize>, survey: &Survey) -> Option<Variable> {
        Some(match self {
            Self::Joint => Variable::Angle { joint: joint? },
            Self::Motor => {
                survey.robot.description().joints[joint?].reduction_ratio?;
                Variable::Motor { joint: joint? }
            }
            Self::Azimuth => Variable::Azimuth,
            Self::Elevation => Variable::Elevation,
        })
    }

    fn is(self, variable: Variable) -> bool {
        match self {
            Self::Joint => matches!(variable, Variable::Angle { .. }),
            Self::Motor => matches!(variable, Variable::Motor { .. }),
            Self::Azimuth => variable == Variable::Azimuth,
            Self::Elevation => variable == Variable::Elevation,
        }
    }
}

impl Times {
    /// The factor at a joint; none where the recording cannot tell.
    fn factor(self, joint: Option<usize>, survey: &Survey) -> Option<Factor> {
        let in_proportion = |variable| Some(Factor::new(variable, Basis::PROPORTIONAL));
        match (self, joint) {
            (Self::Approach, Some(joint)) if survey.both_directions(joint) => {
                in_proportion(Variable::Approach { joint })
            }
            (Self::Load, Some(joint)) if survey.is_loaded(joint) => {
                in_proportion(Variable::Load { joint })
            }
            (Self::Angle, Some(joint)) => in_proportion(Variable::Angle { joint }),
            (Self::Range, _) => in_proportion(Variable::Range),
            (Self::Time, _) if survey.length() > 0.0 => {
                let [start, end] = survey.time;
                Some(Factor::new(
                    Variable::Time,
                    Basis::Creep {
                        start,
                        end,
                        exponent: 1.0,
                    },
                ))
            }
            _ => None,
        }
    }

    fn of(of: Variable) -> Option<Self> {
        Some(match of {
            Variable::Approach { .. } => Self::Approach,
            Variable::Load { .. } => Self::Load,
            Variable::Angle { .. } => Self::Angle,
            Variable::Range => Self::Range,
            Variable::Time => Self::Time,
            _ => return None,
        })
    }
}

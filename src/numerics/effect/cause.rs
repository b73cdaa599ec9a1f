//! Causes of error: what each is stands in its row of the [table](CAUSES).

use super::law_row::{Follows, LawRow};
use super::{
    CAUSES, Effect, EffectContext, Form, HiddenSize, Hypothesis, NumberSpec, Place, Summary,
    Survey, Term, Variable, names,
};
use super::{law_row, sentence, unknown};
use crate::robot::RobotModel;

/// A cause: in words, and where it acts by which laws.
#[derive(Debug)]
pub struct Cause {
    /// Canonical name.
    pub name: &'static str,
    /// Where it sits.
    pub place: &'static str,
    /// q: joint position, dq/dt: its velocity, t: load torque of a joint, s: direction of approach, T: temperature; d: turn of the joint.
    pub formula: &'static str,
    /// On industrial arms.
    pub size: &'static str,
    /// Effects that do nearly the same where a recording is poor.
    pub confounded: &'static str,
    /// Columns of the recording and entries of the robot file without which it cannot be told.
    pub needs: &'static str,
    /// The sentence for a finding, without its size at the tool: words with holes such as `{value}`. Its laws may say more.
    pub sentence: &'static str,
    /// Where it acts, and what it follows there.
    pub laws: &'static [LawRow],
    /// Whether it belongs to one measurement and not to the arm.
    pub of_the_measurement: bool,
    /// Whether more poses may separate it from other causes: steps and drifts have had their time, faults of rows have none.
    pub separable_by_poses: bool,
    /// What separates it from others beside more poses.
    pub measure: Option<Measure>,
    /// The effect of the whole arm, for causes that are identified, not searched for.
    pub arm_effect: Option<ArmEffectOf>,
    /// How large it may be where it is not found, on a path that is short or slow.
    pub hidden: Option<fn() -> HiddenSize>,
    /// Another cause that does the same as a law of this one in whatever data: an identity of kinematics or statics.
    pub same: fn(&Term) -> Option<(&'static str, Place)>,
    /// The motion of a cause that is no product of the columns of laws.
    pub motion: Option<OwnMotion>,
}

/// A motion with physics of its own.
#[derive(Debug)]
pub struct OwnMotion {
    /// Every hypothesis that a recording can speak of.
    pub(crate) propose: fn(&Survey) -> Vec<Hypothesis>,
    /// What a mechanic is told of a finding; `None`: what the row says.
    pub(crate) sentence: Option<fn(&Summary) -> String>,
    /// Reads its forms as [`Placed::body`](super::Placed::body) wrote them.
    pub(crate) read: fn(&serde_json::Value) -> serde_json::Result<Form>,
}

/// The effect of the whole arm in a setting.
pub type ArmEffectOf = fn(&EffectContext) -> Box<dyn Effect>;

/// A measurement that is no pose and separates a cause from others; of two causes the one of lower rank says what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Measure {
    /// The lower, the earlier it is proposed.
    pub rank: u8,
    /// What to measure, as an order.
    pub advice: &'static str,
}

impl Cause {
    /// What most causes are, without words.
    pub const PLAIN: Self = Self {
        name: "",
        place: "",
        formula: "",
        size: "any",
        confounded: "-",
        needs: "-",
        sentence: "",
        laws: &[],
        of_the_measurement: false,
        separable_by_poses: true,
        measure: None,
        arm_effect: None,
        hidden: None,
        same: |_| None,
        motion: None,
    };

    /// Its canonical name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Whether its forms describe something that is in no list.
    pub fn is_nameless(&self) -> bool {
        self.name == names::UNKNOWN
    }

    /// Every hypothesis that the recording can speak of; those of one place are the shapes of one cell of a diagnosis.
    pub fn propose(&'static self, survey: &Survey) -> Vec<Hypothesis> {
        let of_laws = self.laws.iter().flat_map(|law| law.propose(self, survey));
        of_laws
            .chain(
                self.motion
                    .iter()
                    .flat_map(|motion| (motion.propose)(survey)),
            )
            .collect()
    }

    /// Whether it is a step in time, which may occur more than once in a recording.
    pub fn is_a_step(&self) -> bool {
        self.laws
            .iter()
            .any(|law| matches!(law.follows, Follows::Step))
    }

    /// What a mechanic is told of a finding, without its size at the tool.
    pub fn sentence(&self, summary: &Summary) -> String {
        match self.motion.as_ref().and_then(|motion| motion.sentence) {
            Some(says) => says(summary),
            None => sentence::of(self, summary),
        }
    }

    /// The effect of the whole arm in a setting, if it is one.
    pub fn arm_effect(&self, setting: &EffectContext) -> Option<Box<dyn Effect>> {
        self.arm_effect.map(|make| make(setting))
    }

    /// How large a form that was not found may be where geometry takes up most of what it does: of what follows the speed of joints that
    /// turn, or of all.
    pub fn hidden(&self, form: &Form, robot: &RobotModel) -> Option<HiddenSize> {
        let of_speed = form
            .variables()
            .iter()
            .all(|variable| matches!(variable, Variable::Speed | Variable::Velocity { .. }));
        let turns = !matches!(form.place(), Place::Joint(joint) if !robot.is_revolute(joint));
        self.hidden.filter(|_| of_speed && turns).map(|size| size())
    }

    /// The row of a term of this cause; none of what has no name.
    pub(super) fn law(&self, term: &Term) -> Option<&'static LawRow> {
        self.laws.iter().find(|law| law.is(term))
    }

    /// The coefficients of a term of this cause.
    pub(super) fn numbers(&self, term: &Term, robot: &RobotModel) -> Vec<NumberSpec> {
        self.law(term).map_or_else(
            || unknown::numbers(term, robot),
            |law| law.numbers(term, robot),
        )
    }

    /// See [`Placed::variant`](super::Placed::variant).
    pub(super) fn variant(&self, term: &Term) -> String {
        self.law(term)
            .map_or_else(|| unknown::variant(term), |law| law.variant(term))
    }

    /// See [`Placed::near`](super::Placed::near); the shapes of a curve without a name are those of its cell.
    pub(super) fn near(&self, term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
        if self.is_nameless() {
            Vec::new()
        } else {
            law_row::near(term, survey, level)
        }
    }

    /// See [`Placed::identities`](super::Placed::identities).
    pub(super) fn identities(&self, term: &Term, called: &str) -> Vec<(&'static str, Place)> {
        if self.is_nameless() {
            unknown::identities(term, called)
        } else {
            (self.same)(term).into_iter().collect()
        }
    }
}

/// The cause of a canonical name.
pub fn cause(name: &str) -> Option<&'static Cause> {
    CAUSES.iter().copied().find(|cause| cause.name == name)
}

/// The effect of the whole arm of a name, if there is one.
pub fn arm_effect(name: &str, setting: &EffectContext) -> Option<Box<dyn Effect>> {
    cause(name)?.arm_effect(setting)
}

/// Causes that are effects of the whole arm, which are identified; all others are searched for.
pub fn identified() -> impl Iterator<Item = &'static Cause> {
    CAUSES
        .iter()
        .copied()
        .filter(|cause| cause.arm_effect.is_some())
}

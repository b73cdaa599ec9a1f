//! A target as a program states it: its numbers, where they stand, and how corrected ones are written there.

use super::flow::JoinedState;
use super::stated::{self, PostureStatement};
use super::token::{Token, words};
use super::{Gathered, Messages, SolvedLiteral};
use crate::robot::Bound;
use crate::spatial::Pose;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// What the numbers of a target mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TargetKind {
    /// Six joints, deg.
    Joints,
    /// X, Y, Z (mm), A about z, B about the new y, C about the new x (deg).
    Frame,
    /// x, y, z (mm), q1..q4 (w, x, y, z).
    Quaternion,
    /// Six joints, rad.
    Radians,
    /// x, y, z (m), rx, ry, rz (rotation vector, rad).
    RotationVector,
}

impl TargetKind {
    /// Whether it is a target of joints.
    pub fn is_of_joints(self) -> bool {
        matches!(self, Self::Joints | Self::Radians)
    }
}

/// A target of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Literal {
    /// Joints or pose.
    pub kind: TargetKind,
    /// In the order of the kind.
    pub values: Vec<f64>,
    /// Where each value stands, sign included.
    pub spans: Vec<Range<usize>>,
    /// External axes, deg or mm; none where one is not connected.
    pub external: Vec<Option<f64>>,
    /// In which posture.
    pub posture: PostureStatement,
    /// Where each number of the posture stands.
    pub posture_spans: Vec<Range<usize>>,
    /// The frame that a Cartesian target stands in, in the robot's base (m); none: the base itself.
    pub frame: Option<Pose>,
    /// The tool that reaches a Cartesian target, in the frame of the robot file's tool (m); none: that one itself.
    pub tool: Option<Pose>,
    /// As the program has it.
    pub(super) tool_in_force: Option<ToolInForce>,
    /// The mass at the flange that the program states, kg.
    pub payload: Option<f64>,
}

impl Literal {
    /// As it is read; what is in force at it follows from the whole program.
    pub(super) fn read(
        kind: TargetKind,
        (values, spans): (Vec<f64>, Vec<Range<usize>>),
        external: Vec<Option<f64>>,
        (posture, posture_spans): (PostureStatement, Vec<Range<usize>>),
    ) -> Self {
        Self {
            kind,
            values,
            spans,
            external,
            posture,
            posture_spans,
            frame: None,
            tool: None,
            tool_in_force: None,
            payload: None,
        }
    }

    /// Angles and lengths that no robot has, at their bytes.
    pub(super) fn beyond_any_robot(&self) -> impl Iterator<Item = (usize, String)> {
        let placed = self.values.iter().zip(&self.spans).enumerate();
        placed.filter_map(|(k, (value, span))| {
            let fault = match self.kind {
                TargetKind::Joints => Bound::Angle.fault(value.to_radians()),
                TargetKind::Radians => Bound::Angle.fault(*value),
                TargetKind::RotationVector => {
                    if k < 3 { Bound::Length } else { Bound::Angle }.fault(*value)
                }
                _ if k < 3 => Bound::Length.fault(value * 1e-3),
                TargetKind::Frame => Bound::Angle.fault(value.to_radians()),
                TargetKind::Quaternion => None,
            };
            Some((span.start, fault?))
        })
    }

    /// The byte at which its first number stands.
    pub fn at(&self) -> usize {
        let starts = self.spans.iter().map(|span| span.start);
        starts.min().unwrap_or_default()
    }

    /// Decimals of value `k`: 1e-6 deg is 0.04 um at 2.5 m, 1e-8 rad 0.03 um, 1e-5 mm is 0.01 um.
    fn decimals(&self, k: usize) -> usize {
        match self.kind {
            TargetKind::Joints => 6,
            TargetKind::Radians | TargetKind::RotationVector => 8,
            TargetKind::Frame | TargetKind::Quaternion if k < 3 => 5,
            TargetKind::Frame => 6,
            TargetKind::Quaternion => 9,
        }
    }

    /// The numbers that change, as text, in the order of the program; `bytes`: the program.
    pub(super) fn replacements(
        &self,
        bytes: &[u8],
        solved: &SolvedLiteral,
    ) -> Vec<(Range<usize>, String)> {
        let (values, posture) = (&solved.values, solved.posture);
        assert_eq!(values.len(), self.values.len(), "a number for every number");
        let mut out: Vec<(Range<usize>, String)> = Vec::new();
        for (k, (new, old)) in values.iter().zip(&self.values).enumerate() {
            let decimals = self.decimals(k);
            // Half a unit of the last decimal: nothing that would be written differs.
            if (new - old).abs() > 0.5 * 10f64.powi(-(decimals as i32)) {
                out.push((self.spans[k].clone(), fixed(*new, decimals)));
            }
        }
        let numbers = self.posture.numbers().into_iter().zip(posture.numbers());
        for ((old, new), span) in numbers.zip(&self.posture_spans) {
            if old != new {
                out.push((span.clone(), stated::written(&bytes[span.clone()], new)));
            }
        }
        out.sort_by_key(|(span, _)| span.start);
        out
    }
}

/// With so many decimals, and no sign before a zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(tail) if tail.bytes().all(|byte| matches!(byte, b'0' | b'.')) => tail.into(),
        _ => text,
    }
}

/// What a program makes of a frame, a tool or a load.
#[derive(Debug, Clone)]
pub(super) enum Setting<T> {
    /// It sets none.
    Unset,
    /// The value, and how people find where it is set.
    Known(T, String),
    /// Why the text does not say.
    Open(String),
}

/// A tool by its name and, where that is declared, its frame at the flange (m).
#[derive(Debug, Clone)]
pub(super) struct ToolInForce {
    pub name: String,
    pub frame: Option<Pose>,
}

/// At a motion.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InForce {
    /// In the robot's base, m.
    pub base: Setting<Pose>,
    pub tool: Setting<ToolInForce>,
    /// kg; none where its declaration does not say.
    pub load: Setting<Option<f64>>,
}

impl PartialEq for ToolInForce {
    /// Two tools of one frame are one, whatever their names.
    fn eq(&self, other: &Self) -> bool {
        match (&self.frame, &other.frame) {
            (Some(one), Some(others)) => one == others,
            _ => self.name == other.name,
        }
    }
}

impl<T> Setting<T> {
    /// The value where it is known, set as `by` says; else it is open, and why.
    pub(super) fn or_open(value: Option<T>, by: String, why: impl FnOnce() -> String) -> Self {
        match value {
            Some(value) => Self::Known(value, by),
            None => Self::Open(why()),
        }
    }
}

impl<T: PartialEq> PartialEq for Setting<T> {
    /// By value: where it is set makes no difference.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Unset, Self::Unset) => true,
            (Self::Known(one, _), Self::Known(others, _)) => one == others,
            (Self::Open(one), Self::Open(others)) => one == others,
            _ => false,
        }
    }
}

impl<T: Clone + PartialEq> JoinedState for Setting<T> {
    fn joined(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Open(_), _) => self.clone(),
            (_, Self::Open(_)) => other.clone(),
            (Self::Known(one, at), Self::Known(others, also)) if one != others => Self::Open(
                format!("differs between the ways to this target: {at} and {also}; expected one"),
            ),
            (Self::Known(_, at), Self::Unset) | (Self::Unset, Self::Known(_, at)) => {
                Self::Open(format!(
                    "is set on some of the ways to this target alone, by {at}; expected on all"
                ))
            }
            _ => self.clone(),
        }
    }
}

impl JoinedState for InForce {
    fn joined(&self, other: &Self) -> Self {
        Self {
            base: self.base.joined(&other.base),
            tool: self.tool.joined(&other.tool),
            load: self.load.joined(&other.load),
        }
    }
}

impl InForce {
    /// Where nothing is set.
    pub const NOTHING: Self = Self {
        base: Setting::Unset,
        tool: Setting::Unset,
        load: Setting::Unset,
    };

    /// Where nothing is known, for one reason.
    pub fn open(why: &str) -> Self {
        Self {
            base: Setting::Open(why.into()),
            tool: Setting::Open(why.into()),
            load: Setting::Open(why.into()),
        }
    }
}

/// What is in force wherever the files of a program move to targets.
#[derive(Debug, Default)]
pub(super) struct Reached {
    /// By the name of a target, in capitals.
    pub named: BTreeMap<String, Vec<InForce>>,
    /// By the bytes of a target that stands in a motion of the file that is corrected.
    pub placed: Vec<(Range<usize>, InForce)>,
    /// Names that are used otherwise than by motions.
    pub mentioned: BTreeMap<String, InForce>,
    /// What was assumed of other files, at the bytes of the file that is corrected.
    pub assumed: Messages,
}

impl Reached {
    /// Takes note of what is in force where a motion leads to a name.
    pub fn moved_to(&mut self, name: &Token, force: &InForce) {
        let uses = self.named.entry(name.upper()).or_default();
        uses.push(force.clone());
    }

    /// Takes note of names whose targets are handed on in `place`: where these go is not followed.
    pub fn handed_on(&mut self, tokens: &[Token], place: &str) {
        for word in words(tokens) {
            let force = InForce::open(&format!("is not followed: {place} hands the target on"));
            self.mentioned.entry(word.upper()).or_insert(force);
        }
    }

    /// For each literal what is in force wherever it is reached; `names`: numbers of literals that a variable holds, and its name. Both are in the
    /// order of the program.
    pub fn uses(
        &self,
        literals: &[Literal],
        names: &[(Range<usize>, String)],
    ) -> Vec<Vec<InForce>> {
        let of_k = |(k, literal): (usize, &Literal)| -> Vec<InForce> {
            let name = names.get(names.partition_point(|(literals, _)| literals.end <= k));
            if let Some((_, name)) = name.filter(|(literals, _)| literals.contains(&k)) {
                let named = self.named.get(name).into_iter().flatten();
                return named.chain(self.mentioned.get(name)).cloned().collect();
            }
            let at = literal.at();
            let before = self.placed.partition_point(|(span, _)| span.end <= at);
            let placed = self.placed.get(before).into_iter();
            let placed = placed.filter(|(span, _)| span.contains(&at));
            placed.map(|(_, force)| force.clone()).collect()
        };
        literals.iter().enumerate().map(of_k).collect()
    }
}

/// How the language calls what is in force.
pub(super) struct Words {
    pub base: &'static str,
    pub tool: &'static str,
    /// What is assumed where nothing is set.
    pub no_base: &'static str,
}

/// Gives literals their frames, tools and payloads, as they are in force where the literals are reached, and reports them.
pub(super) fn settle(found: &mut Gathered, reached: &Reached, words: &Words) {
    let uses = reached.uses(&found.literals, &found.names);
    let mut reported = BTreeSet::new();
    let mut notes: Vec<(bool, usize, String)> = Vec::new();
    for (literal, uses) in found.literals.iter_mut().zip(uses) {
        let at = literal.at();
        let cartesian = !literal.kind.is_of_joints();
        let Some(all) = uses.into_iter().reduce(|all, one| all.joined(&one)) else {
            if cartesian {
                let note = "is moved to in none of the files that were read, which would state its frame and tool; --with names others";
                notes.push((true, at, note.into()));
            }
            continue;
        };
        let mut tell = |refuses: bool, note: String| {
            if refuses || reported.insert(note.clone()) {
                notes.push((refuses, at, note));
            }
        };
        if cartesian {
            match all.base {
                Setting::Known(pose, by) => {
                    literal.frame = Some(pose).filter(|pose| *pose != Pose::identity());
                    if literal.frame.is_some() {
                        tell(false, format!("{by} is applied, in the robot's base"));
                    }
                }
                Setting::Unset => tell(false, words.no_base.into()),
                Setting::Open(why) => tell(true, format!("its {} {why}", words.base)),
            }
        }
        match all.tool {
            Setting::Known(tool, _) => literal.tool_in_force = Some(tool),
            Setting::Open(why) if cartesian => tell(true, format!("its {} {why}", words.tool)),
            Setting::Open(_) | Setting::Unset => {}
        }
        match all.load {
            Setting::Known(Some(mass), by) => {
                literal.payload = Some(mass);
                tell(false, format!("payload {mass} kg, as {by} states"));
            }
            Setting::Open(why) => tell(false, format!("no payload is stated: it {why}")),
            _ => {}
        }
    }
    for (refuses, at, note) in notes {
        found.say(refuses, at, note);
    }
}

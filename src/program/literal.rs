//! A target as a program states it: its numbers, where they stand, and how corrected ones are written there.
//!
//! Joint positions that a program declares under names: `CONST jointtarget` of RAPID, `DECL E6AXIS` and `DECL AXIS` of KRL, positions in joints of

use super::pose::{self, PostureStatement};
use super::settle::ToolInForce;
use super::{Declared, Language, Note, SolvedLiteral, fanuc, krl, placed, rapid, urscript};
use crate::robot::Bound;
use crate::spatial::Pose;
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
        let (frame, tool, tool_in_force, payload) = (None, None, None, None);
        Self {
            kind,
            values,
            spans,
            external,
            posture,
            posture_spans,
            frame,
            tool,
            tool_in_force,
            payload,
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
        self.spans
            .iter()
            .map(|span| span.start)
            .min()
            .unwrap_or_default()
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
        let SolvedLiteral {
            values, posture, ..
        } = solved;
        assert_eq!(values.len(), self.values.len(), "a number for every number");
        let mut out: Vec<(Range<usize>, String)> = Vec::new();
        for (k, (new, old)) in values.iter().zip(&self.values).enumerate() {
            let decimals = self.decimals(k);
            // Half a unit of the last decimal: nothing that would be written differs.
            if (new - old).abs() > 0.5 * 10f64.powi(-(decimals as i32)) {
                out.push((self.spans[k].clone(), fixed(*new, decimals)));
            }
        }
        let numbers = self
            .posture
            .numbers()
            .into_iter()
            .zip(posture.numbers())
            .zip(&self.posture_spans);
        let changed = numbers.filter(|((old, new), _)| old != new);
        out.extend(
            changed
                .map(|((_, new), span)| (span.clone(), pose::written(&bytes[span.clone()], new))),
        );
        out.sort_by_key(|(span, _)| span.start);
        out
    }
}

/// With so many decimals, and no sign before a zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|byte| matches!(byte, b'0' | b'.')) => rest.into(),
        _ => text,
    }
}

/// Bytes of a program that lists joints, at most.
pub const MOST_BYTES: usize = 64 << 20;

/// A joint position under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedJoints {
    /// Line at which its first number stands, from 1.
    pub line: usize,
    /// As the program calls it.
    pub name: String,
    /// Six joints, deg.
    pub joints: Vec<f64>,
    /// Six external axes, deg or mm; none where one is not connected or not given.
    pub external: Vec<Option<f64>>,
}

/// All joint positions that a program declares, in its order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointList {
    /// In the order of the program.
    pub rows: Vec<ListedJoints>,
    /// How many poses it declares, whose joints it does not say.
    pub poses: usize,
}

/// The language of a file that declares positions, by the ending of its name and by how it begins: tables of text end in `.dat`, too.
pub fn listing(ending: &str, head: &[u8]) -> Option<Language> {
    let language = Language::of_ending(ending)?;
    let words: &[&str] = match language {
        Language::Krl => &[
            "DEFDAT",
            "DEF ",
            "E6AXIS",
            "E3AXIS",
            "DECL AXIS",
            "E6POS",
            "&ACCESS",
        ],
        Language::Rapid => &["JOINTTARGET", "ROBTARGET", "MODULE"],
        Language::Fanuc => &["/PROG"],
        Language::UrScript => &["DEF ", "MOVEJ", "MOVEL"],
    };
    let head = String::from_utf8_lossy(head).to_ascii_uppercase();
    words
        .iter()
        .any(|word| head.contains(word))
        .then_some(language)
}

/// Reads what a program declares; fails with every fault of that.
pub fn joint_list(bytes: &[u8], language: Language) -> Result<JointList, Vec<Note>> {
    if bytes.len() > MOST_BYTES {
        let message = format!(
            "a program of more than {} MB; allowed: shorter ones",
            MOST_BYTES >> 20
        );
        return Err(vec![Note {
            line: 1,
            column: 1,
            message,
        }]);
    }
    let Declared {
        mut found,
        names,
        poses,
    } = match language {
        Language::Krl => krl::listed(bytes),
        Language::Rapid => rapid::listed(bytes),
        Language::Fanuc => fanuc::listed(bytes),
        Language::UrScript => urscript::listed(bytes),
    };
    found.faults.append(&mut found.partial);
    found
        .faults
        .extend(found.literals.iter().flat_map(Literal::beyond_any_robot));
    let faults = placed(bytes, found.faults);
    if !faults.is_empty() {
        return Err(faults);
    }
    // By the line at which each stands; positions are declared one after the other.
    let lines = placed(
        bytes,
        found
            .literals
            .iter()
            .zip(names)
            .map(|(literal, name)| (literal.at(), name))
            .collect(),
    );
    found.literals.sort_by_key(Literal::at);
    let rows = found.literals.into_iter().zip(lines);
    let row = |(
        literal,
        Note {
            line,
            message: name,
            ..
        },
    ): (Literal, Note)| ListedJoints {
        line,
        name,
        joints: match literal.kind {
            TargetKind::Radians => literal.values.iter().map(|rad| rad.to_degrees()).collect(),
            _ => literal.values,
        },
        external: literal.external,
    };
    Ok(JointList {
        rows: rows.map(row).collect(),
        poses,
    })
}

//! Which tool of a program the robot file's is, and where the others are.

use super::literal::ToolInForce;
use super::{Gathered, Literal};
use crate::compensate::turns;
use crate::robot::RobotModel;
use crate::spatial::Pose;
use nalgebra::Vector3;

/// m: a tool whose distance from axis 6 differs by more is another one.
const SAME: f64 = 10e-3;

const EXPECTED: &str =
    "the name of a tool, its number in TOOL_DATA, or its frame X,Y,Z,A,B,C at the flange (mm, deg)";

/// The robot file's tool, as a person states it.
#[derive(Debug, Clone, PartialEq)]
pub enum RobotTool {
    /// By its name in the program (RAPID), or its number in TOOL_DATA (KRL).
    Named(String),
    /// By its frame at the flange, m.
    Frame(Pose),
}

impl RobotTool {
    /// The tool by a name, a number, or `X,Y,Z,A,B,C` in mm and deg; fails where the text is none of them.
    pub fn parse(text: &str) -> Result<Self, String> {
        let is_named = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
        if !text.is_empty() && text.bytes().all(is_named) {
            return Ok(Self::Named(text.into()));
        }
        let numbers: Option<Vec<f64>> = text
            .split(',')
            .map(|part| {
                part.trim()
                    .parse()
                    .ok()
                    .filter(|number: &f64| number.is_finite())
            })
            .collect();
        match numbers.as_deref() {
            Some([x, y, z, a, b, c]) => {
                let turn = turns(a.to_radians(), b.to_radians(), c.to_radians());
                let place = Vector3::new(*x, *y, *z) * 1e-3;
                Ok(Self::Frame(Pose::new(turn, place)))
            }
            _ => Err(format!("expected {EXPECTED}, found `{text}`")),
        }
    }

    /// The frame of the robot file's tool at the flange; fails where the program does not say.
    fn frame(&self, known: &[ToolInForce]) -> Result<Pose, String> {
        let name = match self {
            Self::Frame(frame) => return Ok(*frame),
            Self::Named(name) if name.bytes().all(|byte| byte.is_ascii_digit()) => {
                format!("TOOL_DATA[{name}]")
            }
            Self::Named(name) => name.to_ascii_uppercase(),
        };
        if ["TOOL0", "TOOL_DATA[0]"].contains(&name.as_str()) {
            return Ok(Pose::identity());
        }
        let named = |tool: &ToolInForce| Some((tool.name.clone(), tool.frame?));
        let known: Vec<(String, Pose)> = known.iter().filter_map(named).collect();
        if let Some((_, frame)) = known.iter().find(|(there, _)| *there == name) {
            return Ok(*frame);
        }
        let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
        let names = if names.is_empty() {
            "none".into()
        } else {
            names.join(", ")
        };
        Err(format!(
            "--tool {name}: no file that was read declares the frame of such a tool; declared: {names}, or give X,Y,Z,A,B,C"
        ))
    }
}

/// Gives Cartesian targets the tool in force, from the robot file's.
pub(super) fn relate(
    found: &mut Gathered,
    robot: &RobotModel,
    stated: Option<&RobotTool>,
    known: &[ToolInForce],
) -> Result<(), String> {
    let of_the_file = stated.map(|stated| stated.frame(known)).transpose()?;
    let is_cartesian = |literal: &Literal| !literal.kind.is_of_joints();
    let first = found
        .literals
        .iter()
        .find(|literal| is_cartesian(literal))
        .map(Literal::at);
    let Some(first) = first else {
        return Ok(());
    };
    let mut notes: Vec<(bool, usize, String)> = Vec::new();
    let mut say = |refuses: bool, at: usize, note: String| notes.push((refuses, at, note));
    let mut one: Option<ToolInForce> = None;
    let (mut unset, mut of_joints) = (None, Vec::new());
    for literal in &mut found.literals {
        let (at, tool) = (literal.at(), literal.tool_in_force.take());
        if !is_cartesian(literal) {
            of_joints.extend(tool.map(|tool| (at, tool)));
            continue;
        }
        let Some(tool) = tool else {
            unset.get_or_insert(at);
            continue;
        };
        match (of_the_file, &tool.frame) {
            (Some(its_frame), Some(frame)) => {
                literal.tool =
                    Some(its_frame.inverse() * *frame).filter(|by| *by != Pose::identity())
            }
            (Some(_), None) => {
                let name = &tool.name;
                let note = format!(
                    "is reached with the tool {name}, whose frame no file that was read declares"
                );
                say(true, at, note);
            }
            (None, _) => {
                if let Some(one) = one.as_ref().filter(|one| **one != tool) {
                    let (tool, one) = (&tool.name, &one.name);
                    let note = format!(
                        "is reached with the tool {tool}, another target with {one}: --tool says which of them is the robot file's"
                    );
                    say(true, at, note);
                }
            }
        }
        one.get_or_insert(tool);
    }
    let far = |literal: &Literal| Some((literal.at(), literal.tool?.translation.norm()));
    if let Some((at, far)) = found.literals.iter().find_map(far) {
        let note = format!(
            "its tool stands {:.1} mm from the robot file's: the correction there rests on how well orientations are identified",
            far * 1e3
        );
        say(false, at, note);
    }
    let is_other = |tool: &ToolInForce| match of_the_file {
        Some(frame) => tool.frame.is_some_and(|its_frame| its_frame != frame),
        None => one.as_ref().is_some_and(|one| one != tool),
    };
    if let Some((at, tool)) = of_joints.into_iter().find(|(_, tool)| is_other(tool)) {
        let name = &tool.name;
        let note = format!(
            "joints with the tool {name}: they are corrected where the robot file's tool is"
        );
        say(false, at, note);
    }
    let frame = of_the_file.or_else(|| one.as_ref().and_then(|tool| tool.frame));
    if let Some(apart) = frame.and_then(|frame| apart(robot, &frame)) {
        say(true, first, apart);
    } else if let Some(ToolInForce { name, .. }) = one.as_ref().filter(|_| of_the_file.is_none()) {
        let note =
            format!("the tool {name} is taken as the robot file's; --tool states another one");
        say(false, first, note);
    }
    if let Some(at) = unset {
        let note = match one {
            Some(_) => "no tool is set before this target, and others are reached with one",
            None => "no tool is set before this target: calib assumed that it is the robot file's",
        };
        say(one.is_some(), at, note.into());
    }
    for (refuses, at, note) in notes {
        found.say(refuses, at, note);
    }
    Ok(())
}

/// Why a tool of this frame at the flange is not the robot file's, where its distance from axis 6 says so.
fn apart(robot: &RobotModel, frame: &Pose) -> Option<String> {
    let last = robot.joints() - 1;
    let out = robot.home().translation - robot.point(last);
    let reach = out.cross(robot.axis(last)).norm();
    let stated = frame.translation.xy().norm();
    let message = || {
        format!(
            "the tool stands {:.1} mm from axis 6, the robot file's {:.1} mm: it is another one; --tool says which is the robot file's",
            stated * 1e3,
            reach * 1e3
        )
    };
    let far = (stated - reach).abs();
    (far > SAME || far.is_nan()).then(message)
}

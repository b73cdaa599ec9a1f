//! Programs of controllers, corrected in place: only the numbers of targets change, every other byte stays.
//!
//! KUKA KRL: aggregates with A1..A6 (`E6AXIS`, `AXIS`) or X, Y, Z, A, B, C (`E6POS`, `POS`, motion instructions). ABB RAPID: `jointtarget`
//! and `robtarget` literals in declarations and motion instructions. Cartesian targets are poses of the robot file's tool in the
//! robot's base; they stay Cartesian: the pose at which the controller, which believes in the nominal robot, drives the corrected joints.

use super::correct::{Answer, Corrector, Target};
use super::text::turns;
use crate::compensate::{Chain, Nominal};
use crate::error::{Error, Fault, Result};
use crate::robot::RobotModel;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::ops::Range;

/// Joints that both languages have targets for.
const JOINTS: usize = 6;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Language {
    Krl,
    Rapid,
}

impl Language {
    pub fn of(ending: &str) -> Option<Self> {
        match ending {
            "src" | "dat" | "sub" => Some(Self::Krl),
            "mod" | "modx" | "sys" | "prg" => Some(Self::Rapid),
            _ => None,
        }
    }
}

/// Where the numbers of a target stand in the program, and what they are.
pub(super) struct Place {
    spans: Vec<Range<usize>>,
    values: Vec<f64>,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Six joints, deg.
    Joints,
    /// X, Y, Z (mm), A, B, C (deg).
    Frame,
    /// x, y, z (mm), q1..q4.
    Quaternion,
}

/// A fault at a byte of the program.
type Trouble = (usize, String);

/// The program with its targets corrected; warnings name lines.
pub(super) fn corrected(
    place: &str,
    program: &[u8],
    language: Language,
    robot: &RobotModel,
    corrector: &mut Corrector,
) -> Result<(Vec<u8>, Vec<String>)> {
    if robot.joints() != JOINTS {
        return Err(Error::spec(place, format!("programs have targets of {JOINTS} joints, the robot has {}", robot.joints())));
    }
    let found = match language {
        Language::Krl => krl(program),
        Language::Rapid => rapid(program),
    };
    let at = |byte: usize| {
        let line = program[..byte].iter().filter(|b| **b == b'\n').count() + 1;
        let start = program[..byte].iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        (line, byte - start + 1)
    };
    let fault = |(byte, message): Trouble| {
        let (line, column) = at(byte);
        Fault::new(format!("{place}:{line}:{column}"), message)
    };
    let places = found.map_err(|troubles| Error::Data(troubles.into_iter().map(fault).collect()))?;
    if places.is_empty() {
        return Err(Error::data(place, "has no targets"));
    }
    let answers = corrector.batch(places.iter().map(Place::target).collect());
    let missed: Vec<Fault> = (places.iter().zip(&answers))
        .filter(|(_, answer)| !answer.reached)
        .map(|(target, answer)| fault((target.spans[0].start, answer.remark.clone())))
        .collect();
    if !missed.is_empty() {
        return Err(Error::Data(missed));
    }
    let mut out = Vec::with_capacity(program.len() + 8 * places.len());
    let mut warnings = Vec::new();
    let mut from = 0;
    for (target, answer) in places.iter().zip(&answers) {
        for (span, text) in target.spans.iter().zip(target.written(robot, answer)) {
            out.extend_from_slice(&program[from..span.start]);
            out.extend_from_slice(text.as_bytes());
            from = span.end;
        }
        if !answer.remark.is_empty() {
            warnings.push(format!("{place}:{}: {}", at(target.spans[0].start).0, answer.remark));
        }
    }
    out.extend_from_slice(&program[from..]);
    Ok((out, warnings))
}

impl Place {
    fn target(&self) -> Target {
        let v = &self.values;
        let point = || Some(Vector3::new(v[0], v[1], v[2]) * 1e-3);
        match self.kind {
            Kind::Joints => Target { q: Some(v.iter().map(|deg| deg.to_radians()).collect()), ..Target::default() },
            Kind::Frame => {
                let rotation = turns(v[3].to_radians(), v[4].to_radians(), v[5].to_radians());
                Target { point: point(), rotation: Some(rotation), ..Target::default() }
            }
            Kind::Quaternion => {
                let turn = UnitQuaternion::from_quaternion(Quaternion::new(v[3], v[4], v[5], v[6]));
                Target { point: point(), rotation: Some(turn.to_rotation_matrix().into_inner()), ..Target::default() }
            }
        }
    }

    /// The corrected numbers in the order of the spans.
    fn written(&self, robot: &RobotModel, answer: &Answer) -> Vec<String> {
        if self.kind == Kind::Joints {
            return answer.q.iter().map(|q| format!("{:.6}", q.to_degrees())).collect();
        }
        let pose = Nominal::new(robot).place(&answer.q);
        let mut out: Vec<String> = pose.translation.iter().map(|metres| format!("{:.5}", metres * 1e3)).collect();
        let rotation = Rotation3::from_matrix_unchecked(pose.rotation);
        if self.kind == Kind::Frame {
            let (c, b, a) = rotation.euler_angles();
            // Of the angles that turn alike those next to the given, so that 180 does not become -180.
            let near = |angle: f64, given: f64| angle + 360.0 * ((given - angle) / 360.0).round();
            out.extend(
                [a, b, c].iter().zip(&self.values[3..]).map(|(angle, given)| format!("{:.6}", near(angle.to_degrees(), *given))),
            );
        } else {
            let turn = UnitQuaternion::from_rotation_matrix(&rotation);
            let given = &self.values[3..];
            let new = [turn.w, turn.i, turn.j, turn.k];
            let sign = if new.iter().zip(given).map(|(a, b)| a * b).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
            out.extend(new.iter().map(|part| format!("{:.9}", sign * part)));
        }
        out
    }
}

/// Bytes that are neither comment nor string, by position.
fn code(program: &[u8], comment: u8) -> Vec<bool> {
    let mut out = vec![true; program.len()];
    let (mut in_comment, mut in_string) = (false, false);
    for (at, byte) in program.iter().enumerate() {
        match byte {
            b'\n' => (in_comment, in_string) = (false, false),
            b'"' if !in_comment => {
                in_string = !in_string;
                out[at] = false;
                continue;
            }
            byte if *byte == comment && !in_string => in_comment = true,
            _ => {}
        }
        out[at] = !in_comment && !in_string;
    }
    out
}

fn number(program: &[u8], span: &Range<usize>) -> Option<f64> {
    let text = std::str::from_utf8(&program[span.clone()]).ok()?;
    // A sign may stand apart from its number.
    text.replace(' ', "").parse::<f64>().ok().filter(|value| value.is_finite())
}

fn trimmed(program: &[u8], mut span: Range<usize>) -> Range<usize> {
    while span.start < span.end && program[span.start].is_ascii_whitespace() {
        span.start += 1;
    }
    while span.start < span.end && program[span.end - 1].is_ascii_whitespace() {
        span.end -= 1;
    }
    span
}

/// The statement's beginning up to `at`, in capitals.
fn before(program: &[u8], at: usize) -> String {
    let start = program[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |k| k + 1);
    String::from_utf8_lossy(&program[start..at]).to_ascii_uppercase()
}

fn krl(program: &[u8]) -> Result<Vec<Place>, Vec<Trouble>> {
    let code = code(program, b';');
    let (mut places, mut troubles) = (Vec::new(), Vec::new());
    let mut open: Vec<usize> = Vec::new();
    for at in (0..program.len()).filter(|at| code[*at]) {
        match program[at] {
            b'{' => open.push(at),
            b'}' => match open.pop() {
                Some(start) => match aggregate(program, start, at) {
                    Ok(place) => places.extend(place),
                    Err(trouble) => troubles.push(trouble),
                },
                None => troubles.push((at, "`}` without `{`".into())),
            },
            b'\n' => {
                for start in open.drain(..) {
                    troubles.push((start, "`{` without `}` on its line".into()));
                }
            }
            _ => {}
        }
    }
    troubles.extend(open.into_iter().map(|start| (start, "`{` without `}`".into())));
    places.sort_by_key(|place: &Place| place.spans[0].start);
    if troubles.is_empty() { Ok(places) } else { Err(troubles) }
}

/// `{[TYPE:] NAME value, ...}` as a target, if it is one.
fn aggregate(program: &[u8], open: usize, close: usize) -> Result<Option<Place>, Trouble> {
    let head = before(program, open);
    let mut start = open + 1;
    let mut kind_name = head
        .split(|c: char| !c.is_alphanumeric() && c != '_' && c != '$')
        .find(|word| matches!(*word, "E6POS" | "POS" | "E6AXIS" | "AXIS"))
        .map(String::from);
    if let Some(colon) = program[start..close].iter().position(|byte| *byte == b':') {
        kind_name = Some(String::from_utf8_lossy(&program[start..start + colon]).trim().to_ascii_uppercase());
        start += colon + 1;
    }
    let moves =
        head.split_whitespace().next().is_some_and(|word| matches!(word, "PTP" | "LIN" | "SPTP" | "SLIN" | "CIRC" | "SCIRC"));
    let mut fields: Vec<(String, Range<usize>)> = Vec::new();
    let mut from = start;
    for at in start..=close {
        if at == close || program[at] == b',' {
            let field = trimmed(program, from..at);
            let name = program[field.clone()].iter().position(u8::is_ascii_whitespace).map_or(field.end, |k| field.start + k);
            fields.push((
                String::from_utf8_lossy(&program[field.start..name]).to_ascii_uppercase(),
                trimmed(program, name..field.end),
            ));
            from = at + 1;
        }
    }
    let names: &[&str] = match kind_name.as_deref() {
        Some("E6AXIS" | "AXIS") => &AXES,
        Some("E6POS" | "POS") => &FRAME,
        None if moves && fields.iter().any(|(name, _)| name == "A1") => &AXES,
        None if moves && fields.iter().any(|(name, _)| name == "X") => &FRAME,
        _ => return Ok(None),
    };
    let mut found = Vec::new();
    for name in names {
        let Some((_, span)) = fields.iter().find(|(field, _)| field == name) else {
            return Err((open, format!("the target has no {name}; a target is corrected whole or not at all")));
        };
        let Some(value) = number(program, span) else {
            let text = String::from_utf8_lossy(&program[span.clone()]);
            return Err((span.start, format!("{name} is `{text}`, expected a number")));
        };
        found.push((span.clone(), value));
    }
    if !found.is_sorted_by_key(|(span, _)| span.start) {
        return Err((open, format!("expected {} in this order", names.join(", "))));
    }
    let kind = if names == AXES { Kind::Joints } else { Kind::Frame };
    let (spans, values) = found.into_iter().unzip();
    Ok(Some(Place { spans, values, kind }))
}

const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
const FRAME: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];

/// A bracket list of RAPID.
enum Node {
    List(usize, Vec<Node>),
    Leaf(Range<usize>),
}

fn rapid(program: &[u8]) -> Result<Vec<Place>, Vec<Trouble>> {
    let code = code(program, b'!');
    let (mut places, mut troubles) = (Vec::new(), Vec::new());
    let mut at = 0;
    while at < program.len() {
        if !code[at] || program[at] != b'[' {
            if code[at] && program[at] == b']' {
                troubles.push((at, "`]` without `[`".into()));
            }
            at += 1;
            continue;
        }
        let wanted = statement(program, &code, at);
        match list(program, &code, at) {
            Ok((node, end)) => {
                if let Some(kind) = wanted
                    && let Err(trouble) = take(program, &node, kind, &mut places)
                {
                    troubles.push(trouble);
                }
                at = end;
            }
            Err(trouble) => {
                troubles.push(trouble);
                break;
            }
        }
    }
    if troubles.is_empty() { Ok(places) } else { Err(troubles) }
}

/// Which targets the statement of a literal holds, if any: its text from the last `;` on.
fn statement(program: &[u8], code: &[bool], at: usize) -> Option<Want> {
    let start = (0..at).rev().find(|k| code[*k] && program[*k] == b';').map_or(0, |k| k + 1);
    let text: Vec<u8> = (start..at).filter(|k| code[*k]).map(|k| program[k].to_ascii_lowercase()).collect();
    let text = String::from_utf8_lossy(&text).into_owned();
    // Of a motion instruction the first literal is the target; what follows is its speed, zone, tool or work object.
    if text.contains(']') {
        return None;
    }
    let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
    if text.contains(":=") {
        return words.find_map(|word| match word {
            "jointtarget" => Some(Want::Joints),
            "robtarget" => Some(Want::Pose),
            _ => None,
        });
    }
    words.find(|word| word.starts_with("move")).map(|word| if word.contains("absj") { Want::Joints } else { Want::Pose })
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Want {
    Joints,
    Pose,
}

/// The list that opens at `at`, and the byte behind it.
fn list(program: &[u8], code: &[bool], at: usize) -> Result<(Node, usize), Trouble> {
    let mut items = Vec::new();
    let mut from = at + 1;
    let mut k = at + 1;
    let mut nested = false;
    while k < program.len() {
        match program[k] {
            _ if !code[k] => k += 1,
            b'[' => {
                let (node, end) = list(program, code, k)?;
                items.push(node);
                (k, nested) = (end, true);
            }
            b',' | b']' => {
                if !std::mem::take(&mut nested) {
                    items.push(Node::Leaf(trimmed(program, from..k)));
                }
                if program[k] == b']' {
                    return Ok((Node::List(at, items), k + 1));
                }
                from = k + 1;
                k += 1;
            }
            b';' => return Err((at, "`[` without `]` in its statement".into())),
            _ => k += 1,
        }
    }
    Err((at, "`[` without `]`".into()))
}

/// Takes the targets in a literal, also of an array.
fn take(program: &[u8], node: &Node, want: Want, places: &mut Vec<Place>) -> Result<(), Trouble> {
    let Node::List(at, items) = node else { return Ok(()) };
    let sizes: Vec<Option<usize>> =
        items.iter().map(|item| if let Node::List(_, inner) = item { Some(inner.len()) } else { None }).collect();
    let leaves = |item: &Node| matches!(item, Node::List(_, inner) if inner.iter().all(|node| matches!(node, Node::Leaf(_))));
    let flat = !items.is_empty() && items.iter().all(leaves);
    let (shape, kind, used): (&[usize], Kind, usize) = match want {
        Want::Joints => (&[6, 6], Kind::Joints, 1),
        Want::Pose => (&[3, 4, 4, 6], Kind::Quaternion, 2),
    };
    if flat {
        if sizes.iter().map(|size| size.unwrap_or_default()).ne(shape.iter().copied()) {
            let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
            return Err((*at, format!("expected a target of lists with {} numbers", shape.join(", "))));
        }
        let mut target = Place { spans: Vec::new(), values: Vec::new(), kind };
        for item in &items[..used] {
            let Node::List(_, numbers) = item else { continue };
            for leaf in numbers {
                let Node::Leaf(span) = leaf else { continue };
                let Some(value) = number(program, span) else {
                    return Err((span.start, format!("`{}` is no number", String::from_utf8_lossy(&program[span.clone()]))));
                };
                target.spans.push(span.clone());
                target.values.push(value);
            }
        }
        if kind == Kind::Quaternion {
            let length = target.values[3..].iter().map(|v| v * v).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-3 {
                return Err((target.spans[3].start, format!("the quaternion has length {length:.4}, expected 1")));
            }
        }
        places.push(target);
        return Ok(());
    }
    if items.iter().any(|item| matches!(item, Node::Leaf(_))) {
        return Err((*at, "a target is a list of lists of numbers".into()));
    }
    items.iter().try_for_each(|item| take(program, item, want, places))
}

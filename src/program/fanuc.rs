//! FANUC TP programs as ASCII listings (.ls): targets are the positions of the section /POS, joints J1 to J6 (deg) or X, Y, Z (mm), W, P, R (deg:
//! about x, then y, then z of the fixed frame) with CONFIG, of motion group 1. Other groups stay; positions in registers are not in the file.
//!
//! A listing holds no frames: UF 0 is the robot's world, other user frames are refused or assumed; UT names the tool. Of CONFIG the wrist (N,
//! F), the elbow (U, D) and the turns of J1, J4 and J6 are read; the arm behind its base (B) and arms with left and right are refused.

use super::literal::ToolInForce;
use super::token::{ProgramText, Token, TokenKind, tokens};
use super::{Declared, Gathered, Language, Literal, PostureStatement, TargetKind, quoted};
use crate::spatial::Pose;
use std::collections::BTreeMap;
use std::ops::Range;

/// What positions have, with their units; W, P, R as the kind [`TargetKind::Frame`] orders them.
const JOINTS: [&str; 6] = ["J1", "J2", "J3", "J4", "J5", "J6"];
const POSE: [&str; 6] = ["X", "Y", "Z", "R", "P", "W"];
const EXTERNAL: [&str; 3] = ["E1", "E2", "E3"];
/// Whole turns of a joint, at most.
const MOST_TURNS: f64 = 8.0;
/// Motions, and what displaces their targets.
const MOTIONS: [&str; 5] = ["J", "L", "C", "A", "S"];
const DISPLACED: [&str; 5] = ["OFFSET", "TOOL_OFFSET", "VOFFSET", "INC", "STITCH"];

pub(super) fn read(bytes: &[u8]) -> Gathered {
    let mut found = Gathered::default();
    if positions(bytes, &mut found, &mut Vec::new()) {
        motions(bytes, &mut found);
    }
    found
}

/// The joint positions that a listing holds.
pub(super) fn listed(bytes: &[u8]) -> Declared {
    let (mut found, mut names) = (Gathered::default(), Vec::new());
    positions(bytes, &mut found, &mut names);
    let all = found.literals.len();
    let kept: Vec<(Literal, String)> = found
        .literals
        .drain(..)
        .zip(names)
        .filter(|(literal, _)| literal.kind == TargetKind::Joints)
        .collect();
    let poses = all - kept.len();
    let (literals, names) = kept.into_iter().unzip();
    Declared {
        found: Gathered { literals, ..found },
        names,
        poses,
    }
}

/// The lines of a file with the bytes at which each begins.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut at = 0;
    bytes
        .split_inclusive(|byte| *byte == b'\n')
        .map(move |line| {
            at += line.len();
            (at - line.len(), line)
        })
}

/// Where a section begins, behind its line.
fn section(bytes: &[u8], name: &str) -> Option<usize> {
    lines(bytes)
        .find(|(_, line)| line.trim_ascii().eq_ignore_ascii_case(name.as_bytes()))
        .map(|(at, line)| at + line.len())
}

/// Reads the section of positions; false where there is none.
fn positions(bytes: &[u8], found: &mut Gathered, names: &mut Vec<String>) -> bool {
    let (Some(start), Some(end)) = (section(bytes, "/POS"), section(bytes, "/END")) else {
        found.fault(0, "no listing of a TP program: expected the sections /MN, /POS and /END, each on a separate line");
        return false;
    };
    let end = bytes[..end]
        .windows(4)
        .rposition(|four| four.eq_ignore_ascii_case(b"/END"))
        .unwrap_or(end);
    if let Some((at, _)) = lines(bytes)
        .filter(|(at, _)| *at > end)
        .find(|(_, line)| !line.trim_ascii().is_empty())
    {
        found.fault(at, "text behind /END is not understood");
        return false;
    }
    if start > end {
        found.fault(end, "/END stands before /POS");
        return false;
    }
    // What stands elsewhere is no position: comments may hold any sign.
    let blank = |(at, byte): (usize, &u8)| {
        if (start..end).contains(&at) || [0, b'\r', b'\n'].contains(byte) {
            *byte
        } else {
            b' '
        }
    };
    let blanked: Vec<u8> = bytes.iter().enumerate().map(blank).collect();
    let source = ProgramText {
        bytes: &blanked,
        language: Language::Fanuc,
    };
    let all = tokens(source, found);
    let mut reader = Reader {
        source,
        tokens: &all,
        at: 0,
        found,
        names,
    };
    while reader.at < all.len() && reader.position().is_some() {}
    true
}

struct Reader<'a, 'p> {
    source: ProgramText<'p>,
    tokens: &'a [Token],
    at: usize,
    found: &'a mut Gathered,
    names: &'a mut Vec<String>,
}

/// A number of a position, and where it stands.
type Number = (f64, Range<usize>);

/// What a motion group of a position states.
#[derive(Default)]
struct Group {
    numbers: BTreeMap<String, (Number, &'static str)>,
    user_frame: Option<(String, usize)>,
    tool: Option<String>,
    config: Option<Range<usize>>,
}

impl Reader<'_, '_> {
    /// Reports a fault here; the rest is not read.
    fn fault<T>(&mut self, expected: &str) -> Option<T> {
        let token = self.tokens.get(self.at).or(self.tokens.last());
        let (at, text) = token.map_or((0, String::new()), |token| {
            (
                token.span.start,
                quoted(self.source.bytes, token.span.clone()),
            )
        });
        self.found.fault(
            at,
            format!("{text} in the positions is not understood; expected {expected}"),
        );
        None
    }
    fn word(&self, words: &[&str]) -> bool {
        self.tokens
            .get(self.at)
            .is_some_and(|token| self.source.is_word(token, words))
    }
    fn sign(&mut self, sign: u8) -> Option<()> {
        if self.tokens.get(self.at).is_some_and(|token| token.is(sign)) {
            self.at += 1;
            return Some(());
        }
        self.fault(&format!("`{}`", char::from(sign)))
    }
    fn number(&mut self) -> Option<Number> {
        for count in [2, 1] {
            if let Some(number) = self
                .tokens
                .get(self.at..self.at + count)
                .and_then(|tokens| self.source.number(tokens))
            {
                self.at += count;
                return Some(number);
            }
        }
        self.fault("a number (a position that was not taught has none)")
    }

    /// `P[1:"name"]{ GP1: ... };`
    fn position(&mut self) -> Option<()> {
        if !self.word(&["P"]) {
            return self.fault("`P[NUMBER]{...};`");
        }
        let at = self.tokens[self.at].span.start;
        self.at += 1;
        self.sign(b'[')?;
        let (number, _) = self.number()?;
        if self.tokens.get(self.at).is_some_and(|token| token.is(b':')) {
            self.at += 1;
            if self
                .tokens
                .get(self.at)
                .is_none_or(|token| token.sort != TokenKind::Text)
            {
                return self.fault("a name in quotes");
            }
            self.at += 1;
        }
        self.sign(b']')?;
        self.sign(b'{')?;
        let name = format!("P[{number}]");
        if self.names.contains(&name) {
            self.found.fault(at, format!("{name} stands twice"));
        }
        let mut groups = 0;
        while let Some(token) = self.tokens.get(self.at).filter(|token| !token.is(b'}')) {
            let head = self.source.upper(token);
            let Some(group) = head
                .strip_prefix("GP")
                .and_then(|number| number.parse::<usize>().ok())
                .filter(|group| *group > 0)
            else {
                return self.fault("`GP1:`");
            };
            let place = token.span.start;
            self.at += 1;
            self.sign(b':')?;
            let stated = self.group()?;
            groups += 1;
            if group == 1 {
                self.target(place, &stated)?;
                self.names.push(name.clone());
            } else {
                self.found.warn(place, format!("group {group} stays as it is: calib assumed that it does not move the robot"));
            }
        }
        if groups == 0 {
            return self.fault("`GP1:`");
        }
        self.sign(b'}')?;
        self.sign(b';')
    }

    /// The entries of a group, up to the next one or the end of the position.
    fn group(&mut self) -> Option<Group> {
        let mut group = Group::default();
        loop {
            let Some(token) = self
                .tokens
                .get(self.at)
                .filter(|token| token.sort == TokenKind::Word)
            else {
                return self.fault("UF, UT, CONFIG, J1 to J6, or X, Y, Z, W, P, R");
            };
            let (name, at) = (self.source.upper(token), token.span.start);
            self.at += 1;
            match name.as_str() {
                "UF" | "UT" => {
                    self.sign(b':')?;
                    let is_current = self.word(&["F"]);
                    let value = if is_current {
                        self.at += 1;
                        "F".to_string()
                    } else {
                        self.number()?.0.to_string()
                    };
                    let before = if name == "UF" {
                        group.user_frame.replace((value, at)).is_some()
                    } else {
                        group.tool.replace(value).is_some()
                    };
                    if before {
                        self.found
                            .fault(at, format!("{name} stands twice in a group"));
                    }
                }
                "CONFIG" => {
                    self.sign(b':')?;
                    let text = self
                        .tokens
                        .get(self.at)
                        .filter(|token| token.sort == TokenKind::Text)
                        .map(|token| token.span.clone());
                    let Some(text) = text else {
                        return self.fault("a configuration, e.g. 'N U T, 0, 0, 0'");
                    };
                    self.at += 1;
                    if group.config.replace(text).is_some() {
                        self.found.fault(at, "CONFIG stands twice in a group");
                    }
                }
                _ if JOINTS.contains(&&*name)
                    || POSE.contains(&&*name)
                    || EXTERNAL.contains(&&*name)
                    || name == "J7" =>
                {
                    self.sign(b'=')?;
                    let number = self.number()?;
                    let unit = ["mm", "deg"].into_iter().find(|unit| self.word(&[*unit]));
                    let Some(unit) = unit else {
                        return self.fault("mm or deg");
                    };
                    self.at += 1;
                    if group.numbers.insert(name.clone(), (number, unit)).is_some() {
                        self.found
                            .fault(at, format!("{name} stands twice in a group"));
                    }
                }
                _ => {
                    self.at -= 1;
                    return self.fault("UF, UT, CONFIG, J1 to J6, or X, Y, Z, W, P, R");
                }
            }
            let next = self.tokens.get(self.at);
            if next.is_some_and(|token| token.is(b',')) {
                self.at += 1;
                // The maker's listings end the line of UF and UT in a comma; a group may end there.
                continue;
            }
            let begins =
                |token: &Token| token.is(b'}') || self.source.upper(token).starts_with("GP");
            return if next.is_some_and(begins) {
                Some(group)
            } else {
                self.fault("`,`, the next group or `}`")
            };
        }
    }

    /// The target that group 1 of a position is.
    fn target(&mut self, at: usize, group: &Group) -> Option<()> {
        let is_pose = POSE.iter().any(|name| group.numbers.contains_key(*name));
        let (wanted, units) = if is_pose {
            (POSE, ["mm", "mm", "mm", "deg", "deg", "deg"])
        } else {
            (JOINTS, ["deg"; 6])
        };
        let known = |name: &str| wanted.contains(&name) || EXTERNAL.contains(&name);
        if let Some(other) = group.numbers.keys().find(|name| !known(name)) {
            self.found.fault(
                at,
                format!(
                    "{other} in a position of {}; calib knows arms of six joints",
                    wanted.join(", ")
                ),
            );
            return Some(());
        }
        let (mut values, mut spans) = (Vec::new(), Vec::new());
        for (name, unit) in wanted.iter().zip(units) {
            match group.numbers.get(*name) {
                Some(((value, span), stated)) if *stated == unit => {
                    values.push(*value);
                    spans.push(span.clone());
                }
                Some(((_, span), stated)) => self
                    .found
                    .fault(span.start, format!("{name} in {stated}, expected {unit}")),
                None => self.found.fault(
                    at,
                    format!("{name} is missing; expected {}", wanted.join(", ")),
                ),
            }
        }
        let external = EXTERNAL.map(|name| {
            group
                .numbers
                .get(name)
                .map(|((value, span), _)| (*value, span.start))
        });
        for (value, place) in external.iter().flatten() {
            self.found.warn(*place, format!("external axis at {value}: calib assumed that external axes do not move the robot"));
        }
        let external = external.map(|axis| axis.map(|(value, _)| value)).to_vec();
        let (posture, posture_spans) = match (&group.config, is_pose) {
            (Some(span), true) => self.config(span.clone()),
            (None, true) => {
                self.found.fault(
                    at,
                    "CONFIG is missing: it says in which posture the pose is reached",
                );
                return Some(());
            }
            (_, false) => (PostureStatement::Unstated, Vec::new()),
        };
        if values.len() < wanted.len() {
            return Some(());
        }
        match group.user_frame.as_ref().filter(|(frame, _)| is_pose && frame != "0") {
            Some((frame, place)) => self.found.frame(
                *place,
                format!("user frame {frame} is in no listing: calib assumed that it is the robot's world, as UF 0"),
            ),
            None if is_pose && group.user_frame.is_none() => {
                self.found.fault(at, "UF is missing: it says in which frame the pose stands")
            }
            None => {}
        }
        let kind = if is_pose {
            TargetKind::Frame
        } else {
            TargetKind::Joints
        };
        let mut literal = Literal::read(kind, (values, spans), external, (posture, posture_spans));
        let frame = |tool: &String| (tool == "0").then(Pose::identity);
        literal.tool_in_force = group.tool.as_ref().map(|tool| ToolInForce {
            name: format!("UTOOL[{tool}]"),
            frame: frame(tool),
        });
        self.found.literals.push(literal);
        Some(())
    }

    /// `'N U T, 0, 0, 0'`: the posture, and where its turns stand.
    fn config(&mut self, span: Range<usize>) -> (PostureStatement, Vec<Range<usize>>) {
        const EXPECTED: &str =
            "expected N or F, U or D, T, and the turns of J1, J4 and J6, as in 'N U T, 0, 0, 0'";
        let inner = span.start + 1..span.end.saturating_sub(1).max(span.start + 1);
        let text = &self.source.bytes[inner.clone()];
        let mut parts = Vec::new();
        let mut from = inner.start;
        for part in text.split(|byte| *byte == b',') {
            let blanks = part.len() - part.trim_ascii_start().len();
            parts.push(from + blanks..from + blanks + part.trim_ascii().len());
            from += part.len() + 1;
        }
        let of_span = |span: &Range<usize>| {
            String::from_utf8_lossy(&self.source.bytes[span.clone()]).to_ascii_uppercase()
        };
        let read = || {
            let [letters, turns @ ..] = parts.as_slice() else {
                return None;
            };
            let [one, four, six] = turns else { return None };
            let turn = |span: &Range<usize>| {
                of_span(span)
                    .parse::<i32>()
                    .ok()
                    .filter(|turn| f64::from(turn.abs()) <= MOST_TURNS)
            };
            let turns = [turn(one)?, turn(four)?, turn(six)?];
            let letters = of_span(letters);
            let [wrist @ ("N" | "F"), elbow @ ("U" | "D"), "T"] =
                letters.split_whitespace().collect::<Vec<_>>()[..]
            else {
                return None;
            };
            Some(PostureStatement::Config {
                flip: wrist == "F",
                up: elbow == "U",
                turns,
            })
        };
        match read() {
            Some(posture) => {
                // Once a listing: what the letters mean stands in no file.
                if !self.found.frames.iter().any(|(_, known)| known == POSTURES) {
                    self.found.frame(span.start, POSTURES);
                }
                (posture, parts[1..].to_vec())
            }
            None => {
                let text = quoted(self.source.bytes, span.clone());
                self.found.fault(
                    span.start,
                    format!("configuration {text} is not read; {EXPECTED}"),
                );
                (PostureStatement::Unstated, Vec::new())
            }
        }
    }
}

/// The assumption on the letters of a configuration.
const POSTURES: &str = "CONFIG: calib assumed that N is a wrist with J5 below zero, and F one above; confirm it at one pose of the controller";

/// Motions whose targets are elsewhere than the listing says, or not in it.
fn motions(bytes: &[u8], found: &mut Gathered) {
    let (Some(start), Some(end)) = (section(bytes, "/MN"), section(bytes, "/POS")) else {
        return;
    };
    for (at, line) in lines(bytes).filter(|(at, _)| (start..end).contains(at)) {
        let text = String::from_utf8_lossy(line).to_ascii_uppercase();
        // Names of positions may hold any sign; behind `!` is a remark.
        let unnamed: String = text.split('"').step_by(2).collect();
        let plain = unnamed.split('!').next().unwrap_or_default();
        let body = plain
            .trim_start()
            .trim_start_matches(|c: char| c.is_ascii_digit())
            .trim_start();
        let Some(body) = body.strip_prefix(':').map(str::trim_start) else {
            continue;
        };
        let (head, tail) = body.split_at(
            body.find(|c: char| !c.is_ascii_alphanumeric())
                .unwrap_or(body.len()),
        );
        if !MOTIONS.contains(&head) {
            continue;
        }
        if tail.trim_start().starts_with("PR[") {
            found.warn(
                at,
                "left as it is: moves to a position register, which is not in the listing",
            );
        }
        let words = tail.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        if let Some(word) = words.into_iter().find(|word| DISPLACED.contains(word)) {
            found.frame(
                at,
                format!(
                    "{word} displaces the target: calib assumed that it is reached where it stands"
                ),
            );
        }
    }
}

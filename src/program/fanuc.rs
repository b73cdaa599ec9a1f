//! FANUC TP programs as ASCII listings (.ls): targets are the positions of the section /POS, joints J1 to J6 (deg) or X, Y, Z (mm), W, P, R (deg:
//! about x, then y, then z of the fixed frame) with CONFIG, of motion group 1. Other groups stay; positions in registers are not in the file.
//!
//! A listing holds no frames: UF 0 is the robot's world, other user frames are refused or assumed; UT names the tool. Of CONFIG the wrist (N,
//! F), the elbow (U, D) and the turns of J1, J4 and J6 are read; the arm behind its base (B) and arms with left and right are refused.

use super::literal::ToolInForce;
use super::token::{Token, TokenKind, number, tokens};
use super::{Gathered, Grammar, Language, Literal, PostureStatement, TargetKind};
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

pub(super) const GRAMMAR: Grammar = Grammar {
    endings: &["ls"],
    comment: "!",
    heads: &["/MN"],
    begins: &["/PROG"],
    read: |bytes, _| {
        let mut found = Gathered::default();
        if positions(bytes, &mut found) {
            motions(bytes, &mut found);
        }
        found
    },
    listed,
};

/// The joint positions that a listing holds.
fn listed(bytes: &[u8]) -> Gathered {
    let mut found = Gathered::default();
    positions(bytes, &mut found);
    let (literals, names) = (found.literals.split_off(0), found.names.split_off(0));
    for (literal, (_, name)) in literals.into_iter().zip(names) {
        if literal.kind == TargetKind::Joints {
            found.literals.push(literal);
            found.held_by(name, found.literals.len() - 1);
        } else {
            found.poses += 1;
        }
    }
    found
}

/// The lines of a file with the bytes at which each begins.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut at = 0;
    let lines = bytes.split_inclusive(|byte| *byte == b'\n');
    lines.map(move |line| {
        at += line.len();
        (at - line.len(), line)
    })
}

/// Where a section begins, behind its line.
fn section(bytes: &[u8], name: &str) -> Option<usize> {
    let is_it =
        |(_, line): &(usize, &[u8])| line.trim_ascii().eq_ignore_ascii_case(name.as_bytes());
    let (at, line) = lines(bytes).find(is_it)?;
    Some(at + line.len())
}

/// Reads the section of positions; false where there is none.
fn positions(bytes: &[u8], found: &mut Gathered) -> bool {
    let (Some(start), Some(end)) = (section(bytes, "/POS"), section(bytes, "/END")) else {
        found.fault(0, "no listing of a TP program: expected the sections /MN, /POS and /END, each on a separate line");
        return false;
    };
    let mut fours = bytes[..end].windows(4);
    let begin = fours.rposition(|four| four.eq_ignore_ascii_case(b"/END"));
    let end = begin.unwrap_or(end);
    let is_text = |(at, line): &(usize, &[u8])| *at > end && !line.trim_ascii().is_empty();
    if let Some((at, _)) = lines(bytes).find(is_text) {
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
    let all = tokens(&blanked, Language::Fanuc, found);
    let mut reader = Reader {
        tokens: &all,
        at: 0,
        found,
    };
    while reader.at < all.len() && reader.position().is_some() {}
    true
}

struct Reader<'a, 'p> {
    tokens: &'a [Token<'p>],
    at: usize,
    found: &'a mut Gathered,
}

/// A number of a position, and where it stands.
type Number = (f64, Range<usize>);

/// What a motion group of a position states.
#[derive(Default)]
struct Group<'p> {
    numbers: BTreeMap<String, (Number, &'static str)>,
    user_frame: Option<(String, usize)>,
    tool: Option<String>,
    config: Option<Token<'p>>,
}

impl<'p> Reader<'_, 'p> {
    /// Reports a fault here; the rest is not read.
    fn fault<T>(&mut self, expected: &str) -> Option<T> {
        let token = self.tokens.get(self.at).or(self.tokens.last());
        let (at, text) = token.map_or((0, String::new()), |token| (token.start, token.quoted()));
        let message = format!("{text} in the positions is not understood; expected {expected}");
        self.found.fault(at, message);
        None
    }
    /// Goes on behind the next token, if it is such a one.
    fn take(&mut self, is: impl Fn(&Token) -> bool) -> Option<Token<'p>> {
        let token = self.tokens.get(self.at).copied().filter(is)?;
        self.at += 1;
        Some(token)
    }
    fn word(&mut self, word: &str) -> bool {
        self.take(|token| token.is_word(word)).is_some()
    }
    fn sign(&mut self, sign: u8) -> Option<()> {
        match self.take(|token| token.is(sign)) {
            Some(_) => Some(()),
            None => self.fault(&format!("`{}`", char::from(sign))),
        }
    }
    fn number(&mut self) -> Option<Number> {
        for count in [2, 1] {
            let tokens = self.tokens.get(self.at..self.at + count);
            if let Some(number) = tokens.and_then(number) {
                self.at += count;
                return Some(number);
            }
        }
        self.fault("a number (a position that was not taught has none)")
    }
    /// What may stand once in a group.
    fn once(&mut self, at: usize, name: &str, before: bool) {
        if before {
            let message = format!("{name} stands twice in a group");
            self.found.fault(at, message);
        }
    }

    /// `P[1:"name"]{ GP1: ... };`
    fn position(&mut self) -> Option<()> {
        let Some(head) = self.take(|token| token.is_word("P")) else {
            return self.fault("`P[NUMBER]{...};`");
        };
        self.sign(b'[')?;
        let (number, _) = self.number()?;
        let is_text = |token: &Token| token.sort == TokenKind::Text;
        if self.take(|token| token.is(b':')).is_some() && self.take(is_text).is_none() {
            return self.fault("a name in quotes");
        }
        self.sign(b']')?;
        self.sign(b'{')?;
        let name = format!("P[{number}]");
        if self.found.names.iter().any(|(_, known)| *known == name) {
            self.found.fault(head.start, format!("{name} stands twice"));
        }
        let mut groups = 0;
        while let Some(token) = self.tokens.get(self.at).filter(|token| !token.is(b'}')) {
            let head = token.upper();
            let number = head
                .strip_prefix("GP")
                .and_then(|number| number.parse().ok());
            let Some(group) = number.filter(|group: &usize| *group > 0) else {
                return self.fault("`GP1:`");
            };
            let place = token.start;
            self.at += 1;
            self.sign(b':')?;
            let stated = self.group()?;
            groups += 1;
            if group == 1 {
                let before = self.found.literals.len();
                self.target(place, &stated);
                self.found.held_by(name.clone(), before);
            } else {
                let message = format!(
                    "group {group} stays as it is: calib assumed that it does not move the robot"
                );
                self.found.warn(place, message);
                let numbers = stated.numbers.iter();
                let axes = numbers.map(|(name, ((value, span), _))| {
                    (format!("{name} of group {group}"), span.start, *value)
                });
                self.found.externals.extend(axes);
            }
        }
        if groups == 0 {
            return self.fault("`GP1:`");
        }
        self.sign(b'}')?;
        self.sign(b';')
    }

    /// The entries of a group, up to the next one or the end of the position.
    fn group(&mut self) -> Option<Group<'p>> {
        const ENTRIES: &str = "UF, UT, CONFIG, J1 to J6, or X, Y, Z, W, P, R";
        let mut group = Group::default();
        loop {
            let Some(token) = self.take(|token| token.sort == TokenKind::Word) else {
                return self.fault(ENTRIES);
            };
            let (name, at) = (token.upper(), token.start);
            match name.as_str() {
                "UF" | "UT" => {
                    self.sign(b':')?;
                    let value = match self.word("F") {
                        true => "F".to_string(),
                        false => self.number()?.0.to_string(),
                    };
                    let before = if name == "UF" {
                        group.user_frame.replace((value, at)).is_some()
                    } else {
                        group.tool.replace(value).is_some()
                    };
                    self.once(at, &name, before);
                }
                "CONFIG" => {
                    self.sign(b':')?;
                    let Some(text) = self.take(|token| token.sort == TokenKind::Text) else {
                        return self.fault("a configuration, e.g. 'N U T, 0, 0, 0'");
                    };
                    let before = group.config.replace(text).is_some();
                    self.once(at, &name, before);
                }
                entry
                    if [&JOINTS[..], &POSE, &EXTERNAL, &["J7"]]
                        .concat()
                        .contains(&entry) =>
                {
                    self.sign(b'=')?;
                    let number = self.number()?;
                    let unit = ["mm", "deg"].into_iter().find(|unit| self.word(unit));
                    let Some(unit) = unit else {
                        return self.fault("mm or deg");
                    };
                    let before = group.numbers.insert(name.clone(), (number, unit)).is_some();
                    self.once(at, &name, before);
                }
                _ => {
                    self.at -= 1;
                    return self.fault(ENTRIES);
                }
            }
            // The maker's listings end the line of UF and UT in a comma; a group may end there.
            if self.take(|token| token.is(b',')).is_some() {
                continue;
            }
            let next = self.tokens.get(self.at);
            let begins = |token: &Token| token.is(b'}') || token.upper().starts_with("GP");
            return match next.is_some_and(begins) {
                true => Some(group),
                false => self.fault("`,`, the next group or `}`"),
            };
        }
    }

    /// The target that group 1 of a position is.
    fn target(&mut self, at: usize, group: &Group) {
        let is_pose = POSE.iter().any(|name| group.numbers.contains_key(*name));
        let (wanted, units, kind) = if is_pose {
            let units = ["mm", "mm", "mm", "deg", "deg", "deg"];
            (POSE, units, TargetKind::Frame)
        } else {
            (JOINTS, ["deg"; 6], TargetKind::Joints)
        };
        let all = wanted.join(", ");
        let known = |name: &str| wanted.contains(&name) || EXTERNAL.contains(&name);
        if let Some(other) = group.numbers.keys().find(|name| !known(name)) {
            let message = format!("{other} in a position of {all}; calib knows arms of six joints");
            return self.found.fault(at, message);
        }
        let (mut values, mut spans) = (Vec::new(), Vec::new());
        for (name, unit) in wanted.iter().zip(units) {
            match group.numbers.get(*name) {
                Some(((value, span), stated)) if *stated == unit => {
                    values.push(*value);
                    spans.push(span.clone());
                }
                Some(((_, span), stated)) => {
                    let message = format!("{name} in {stated}, expected {unit}");
                    self.found.fault(span.start, message);
                }
                None => {
                    let message = format!("{name} is missing; expected {all}");
                    self.found.fault(at, message);
                }
            }
        }
        let external = EXTERNAL.map(|name| group.numbers.get(name).map(|(number, _)| number));
        for (value, span) in external.into_iter().flatten() {
            let message = format!(
                "external axis at {value}: calib assumed that external axes do not move the robot"
            );
            self.found.warn(span.start, message);
        }
        let external = external.map(|axis| axis.map(|(value, _)| *value)).to_vec();
        let posture = match (&group.config, is_pose) {
            (Some(text), true) => self.config(text),
            (None, true) => {
                let message = "CONFIG is missing: it says in which posture the pose is reached";
                return self.found.fault(at, message);
            }
            (_, false) => (PostureStatement::Unstated, Vec::new()),
        };
        if values.len() < wanted.len() {
            return;
        }
        match &group.user_frame {
            Some((frame, place)) if is_pose && frame != "0" => {
                let message = format!(
                    "user frame {frame} is in no listing: calib assumed that it is the robot's world, as UF 0"
                );
                self.found.frame(*place, message);
            }
            None if is_pose => {
                let message = "UF is missing: it says in which frame the pose stands";
                self.found.fault(at, message);
            }
            _ => {}
        }
        let mut literal = Literal::read(kind, (values, spans), external, posture);
        literal.tool_in_force = group.tool.as_ref().map(|tool| ToolInForce {
            name: format!("UTOOL[{tool}]"),
            frame: (tool == "0").then(Pose::identity),
        });
        self.found.literals.push(literal);
    }

    /// `'N U T, 0, 0, 0'`: the posture, and where its turns stand.
    fn config(&mut self, quoted: &Token) -> (PostureStatement, Vec<Range<usize>>) {
        let text = quoted.text();
        let inner = text
            .get(1..text.len().saturating_sub(1))
            .unwrap_or_default();
        let mut parts = Vec::new();
        let mut from = quoted.start + 1;
        for part in inner.split(|byte| *byte == b',') {
            let start = from + part.len() - part.trim_ascii_start().len();
            let text = String::from_utf8_lossy(part.trim_ascii()).to_ascii_uppercase();
            parts.push((text, start..start + part.trim_ascii().len()));
            from += part.len() + 1;
        }
        let read = || {
            let [(letters, _), turns @ ..] = parts.as_slice() else {
                return None;
            };
            let turn = |(text, _): &(String, Range<usize>)| {
                let turn = text.parse::<i32>().ok()?;
                (f64::from(turn.abs()) <= MOST_TURNS).then_some(turn)
            };
            let turns: Option<Vec<i32>> = turns.iter().map(turn).collect();
            let letters: Vec<&str> = letters.split_whitespace().collect();
            match letters[..] {
                [wrist @ ("N" | "F"), elbow @ ("U" | "D"), "T"] => Some(PostureStatement::Config {
                    flip: wrist == "F",
                    up: elbow == "U",
                    turns: turns?.try_into().ok()?,
                }),
                _ => None,
            }
        };
        let Some(posture) = read() else {
            let text = quoted.quoted();
            let message = format!(
                "configuration {text} is not read; expected N or F, U or D, T, and the turns of J1, J4 and J6, as in 'N U T, 0, 0, 0'"
            );
            self.found.fault(quoted.start, message);
            return (PostureStatement::Unstated, Vec::new());
        };
        // Once a listing: what the letters mean stands in no file.
        if !self.found.frames.iter().any(|(_, known)| known == POSTURES) {
            self.found.frame(quoted.start, POSTURES);
        }
        (
            posture,
            parts.into_iter().skip(1).map(|(_, span)| span).collect(),
        )
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
        let plain = unnamed.split('!').next().unwrap_or_default().trim_start();
        let body = plain
            .trim_start_matches(|c: char| c.is_ascii_digit())
            .trim_start();
        let Some(body) = body.strip_prefix(':').map(str::trim_start) else {
            continue;
        };
        let end = body.find(|c: char| !c.is_ascii_alphanumeric());
        let (head, tail) = body.split_at(end.unwrap_or(body.len()));
        if !MOTIONS.contains(&head) {
            continue;
        }
        if tail.trim_start().starts_with("PR[") {
            let message =
                "left as it is: moves to a position register, which is not in the listing";
            found.warn(at, message);
        }
        let words = tail.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        if let Some(word) = words.into_iter().find(|word| DISPLACED.contains(word)) {
            let message = format!(
                "{word} displaces the target: calib assumed that it is reached where it stands"
            );
            found.frame(at, message);
        }
    }
}

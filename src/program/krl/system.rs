//! Frames, tools and loads of the system that files declare, and how a line of a program puts them in force.
//!
//! `$BASE`, `$TOOL`, `$LOAD` are set by aggregates, by entries of `BASE_DATA`, `TOOL_DATA`, `LOAD_DATA`, by frames that are declared with their
//! numbers, by `BAS(#BASE, n)` and `BAS(#TOOL, n)` (which takes the load of the same number), and by the data of a point (`FDAT`) that an inline
//! form names: `FDAT_ACT=FP1` with `BAS(#PTP_PARAMS, ..)`, or `WITH $BASE=SBASE(FP1.BASE_NO), $TOOL=STOOL2(FP1)` for one motion.

use super::super::flow::{Flow, FlowStep, JoinedState};
use super::super::literal::{InForce, Reached, Setting, ToolInForce};
use super::super::token::{Token, TokenKind, arguments, closing, number};
use super::aggregate::Aggregate;
use super::line::{called, declared, member, routines, step, steps};
use super::{before_with, motion};
use crate::compensate::turns;
use crate::spatial::Pose;
use nalgebra::Vector3;
use std::borrow::Borrow;
use std::collections::BTreeMap;

/// Calls of `BAS` that put the data of a point in force.
const OF_A_POINT: [&str; 5] = ["FRAMES", "PTP_PARAMS", "CP_PARAMS", "PTP_DAT", "CP_DAT"];

/// Heads of lines that name a routine and do not call it.
const DECLARING: &str = "DEF DEFFCT GLOBAL EXT EXTFCT EXTP EXTFCTP";

/// What an inline form says of its point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PointData {
    tool: i64,
    base: i64,
    /// The tool stands still, and the robot carries the workpiece.
    fixed_tool: bool,
}

/// What files declare by name and number; none where they say two things of one, or change a part of it.
#[derive(Debug, Default)]
pub(super) struct SystemData {
    bases: BTreeMap<i64, Option<Pose>>,
    tools: BTreeMap<i64, Option<Pose>>,
    loads: BTreeMap<i64, Option<f64>>,
    points: BTreeMap<String, Option<PointData>>,
    frames: BTreeMap<String, Option<Pose>>,
    /// Routines of other files, and whether they set what is in force.
    routines: BTreeMap<String, bool>,
}

/// The state of a program: what is in force, and the point whose data come next.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SystemState {
    pub force: InForce,
    point: Option<String>,
    /// Why the robot does not carry the tool in `$BASE`.
    not_in_base: Setting<String>,
}

impl JoinedState for SystemState {
    fn joined(&self, other: &Self) -> Self {
        let point = self
            .point
            .clone()
            .filter(|point| other.point.as_ref() == Some(point));
        Self {
            force: self.force.joined(&other.force),
            point,
            not_in_base: self.not_in_base.joined(&other.not_in_base),
        }
    }
}

impl SystemState {
    /// At the beginning of a program.
    pub const START: Self = Self {
        force: InForce::NOTHING,
        point: None,
        not_in_base: Setting::Unset,
    };

    /// What is in force at a motion.
    pub fn at_motion(&self) -> InForce {
        let base = match &self.not_in_base {
            Setting::Unset => return self.force.clone(),
            Setting::Known(why, _) if why.is_empty() => return self.force.clone(),
            Setting::Known(why, _) => why.clone(),
            Setting::Open(_) => {
                "is not known: $IPO_MODE or $ROBROOT is set on some of the ways that lead here"
                    .into()
            }
        };
        InForce {
            base: Setting::Open(base),
            ..self.force.clone()
        }
    }
}

/// Takes note of a second statement of one thing.
fn note<K: Ord, T: PartialEq + Copy>(known: &mut BTreeMap<K, Option<T>>, key: K, value: Option<T>) {
    let entry = known.entry(key).or_insert(value);
    if *entry != value {
        *entry = None;
    }
}

impl SystemData {
    /// Adds what the lines of a file declare.
    pub fn declare(&mut self, lines: &[&[Token]]) {
        for line in lines {
            if let Some((name, number, value)) = entry(line) {
                match name.as_str() {
                    "BASE_DATA" => note(&mut self.bases, number, value.and_then(frame)),
                    "TOOL_DATA" => note(&mut self.tools, number, value.and_then(frame)),
                    _ => note(&mut self.loads, number, value.and_then(mass)),
                }
            } else if let Some((kind, names)) = declared(line)
                && let Some(at) = line.iter().position(|token| token.is(b'='))
            {
                let (name, value) = (names[0].clone(), &line[at + 1..]);
                match kind.as_str() {
                    "FDAT" => note(&mut self.points, name, point(value)),
                    "FRAME" => note(&mut self.frames, name, frame(value)),
                    _ => {}
                }
            }
        }
        // Set a second time, in whole or in part.
        for line in lines
            .iter()
            .filter(|line| line.len() > 2 && declared(line).is_none())
        {
            let name = line[0].upper();
            if let Some((subject, Some(value))) = member(&line[1..]) {
                let whole = subject.is_none();
                if self.frames.contains_key(&name) {
                    note(&mut self.frames, name, frame(value).filter(|_| whole));
                } else if self.points.contains_key(&name) {
                    note(&mut self.points, name, point(value).filter(|_| whole));
                }
            }
        }
    }

    /// Adds the routines of other files. What a routine calls may be declared behind it, or in a file behind its own: all are read until no
    /// further one is found to set anything.
    pub fn declare_routines(&mut self, files: &[Vec<&[Token]>]) {
        loop {
            let before = self.routines.clone();
            files
                .iter()
                .for_each(|lines| self.declare_routines_of(lines));
            if self.routines == before {
                return;
            }
        }
    }

    fn declare_routines_of(&mut self, lines: &[&[Token]]) {
        let mut inside: Option<String> = None;
        for line in lines {
            if let FlowStep::Routine(name) = step(line) {
                self.routines.entry(name.clone()).or_insert(false);
                inside = Some(name);
            } else if self.sets(line) {
                let inside = inside.iter().cloned();
                self.routines.extend(inside.map(|name| (name, true)));
            }
        }
    }

    /// Whether a line sets what is in force.
    pub fn sets(&self, line: &[Token]) -> bool {
        const SET: &str = "$BASE $TOOL $LOAD $IPO_MODE $ROBROOT FDAT_ACT BAS";
        line[0].is_word(SET) || self.called(line).is_some()
    }

    /// The routine of another file that a line calls, by itself or within an expression, where that one sets what is in force.
    fn called(&self, line: &[Token]) -> Option<String> {
        let mut calls = called(line).filter(|_| !line[0].is_word(DECLARING));
        calls.find(|name| self.routines.get(name) == Some(&true))
    }

    /// The routine that a line calls and that no file that was read has.
    fn unknown_call(&self, line: &[Token]) -> Option<String> {
        let call = line.len() > 2 && line[0].sort == TokenKind::Word && line[1].is(b'(');
        let name = Some(line[0].upper()).filter(|name| call && name != "BAS")?;
        (!self.routines.contains_key(&name)).then_some(name)
    }

    /// Takes a state through a line; `place`: how people find it.
    fn take(&self, line: &[Token], place: &str, state: &mut SystemState) {
        if line[0].is_word("BAS") {
            self.call(line, place, state);
        } else if let Some(name) = self.called(line) {
            let why = format!("is set by {name}, a routine of another file ({place})");
            state.force = InForce::open(&why);
        } else {
            self.set(line, place, state);
        }
    }

    /// A motion with what stands behind its `WITH`.
    fn at_motion(&self, line: &[Token], place: &str, state: &SystemState) -> InForce {
        let mut state = state.clone();
        let settings = line.get(before_with(line).len() + 1..).unwrap_or_default();
        for setting in arguments(settings).filter(|setting| !setting.is_empty()) {
            self.set(setting, place, &mut state);
        }
        state.at_motion()
    }

    /// `$BASE = ...` and the like.
    fn set(&self, line: &[Token], place: &str, state: &mut SystemState) {
        let name = line[0].upper();
        let Some((subject, Some(value))) = member(&line[1..]) else {
            return;
        };
        let by = format!("{name} of {place}");
        let open = |why: &str| format!("{why} ({name} of {place})");
        let of_part = subject.is_some();
        let unknown = || open(&unknown(value, of_part));
        match name.as_str() {
            "$BASE" => {
                let base = self.base(value).filter(|_| !of_part);
                state.force.base = Setting::or_open(base, by, unknown);
            }
            "$TOOL" => {
                let tool = self.tool(value).filter(|_| !of_part);
                state.force.tool = Setting::or_open(tool, by, unknown);
            }
            "$LOAD" => {
                let mass = self.load(value).filter(|_| !of_part);
                let unknown = || open("is set when the program runs");
                state.force.load = Setting::or_open(mass, by, unknown);
            }
            "$IPO_MODE" => {
                let carried = value.get(1).is_some_and(|word| word.is_word("BASE"));
                let point = self.point_in(value, "SIPO_MODE");
                let carried = carried || point.is_some_and(|point| !point.fixed_tool);
                state.not_in_base =
                    Setting::Known(if carried { String::new() } else { open(FIXED) }, by);
            }
            "$ROBROOT" => {
                let zero = frame(value).is_some_and(|pose| pose == Pose::identity());
                let why = open("is not known: the program moves the robot's base");
                state.not_in_base = Setting::Known(if zero { String::new() } else { why }, by);
            }
            "FDAT_ACT" => state.point = value.first().map(Token::upper).filter(|_| !of_part),
            _ => {}
        }
    }

    /// `BAS(#BASE, 3)`.
    fn call(&self, line: &[Token], place: &str, state: &mut SystemState) {
        let [_, open, sharp, what, tail @ ..] = line else {
            return;
        };
        if !open.is(b'(') || !sharp.is(b'#') {
            return;
        }
        let number = tail
            .get(1..2)
            .and_then(number)
            .map(|(number, _)| number as i64);
        match what.upper().as_str() {
            what if OF_A_POINT.contains(&what) => {
                let Some(name) = state.point.clone() else {
                    return;
                };
                match self.point(&name) {
                    Some(point) => self.apply(point, &format!("{name} at {place}"), state),
                    None => {
                        let why = format!(
                            "is that of {name}, which no file that was read declares ({place})"
                        );
                        state.force = InForce::open(&why);
                    }
                }
            }
            "BASE" => {
                let base = number.and_then(|number| self.base_of(number));
                let by = format!("BAS(#BASE) of {place}");
                state.force.base = Setting::or_open(base, by, || {
                    format!(
                        "is an entry of BASE_DATA that no file that was read declares ({place})"
                    )
                });
            }
            "TOOL" => match number {
                Some(number) => self.use_tool(number, &format!("BAS(#TOOL) of {place}"), state),
                None => {
                    let why = format!("is chosen when the program runs ({place})");
                    state.force.tool = Setting::Open(why);
                }
            },
            "EX_BASE" => {
                let why = format!("moves with an external kinematic ({place})");
                state.force.base = Setting::Open(why);
            }
            _ => {}
        }
    }

    fn apply(&self, point: PointData, by: &str, state: &mut SystemState) {
        self.use_tool(point.tool, by, state);
        let (base, table) = (
            self.base_of(point.base),
            format!("BASE_DATA[{}]", point.base),
        );
        state.force.base = Setting::or_open(base, format!("{table} by {by}"), || {
            format!("is {table}, which no file that was read declares ({by})")
        });
        let why = match point.fixed_tool {
            true => format!("{FIXED} ({by})"),
            false => String::new(),
        };
        state.not_in_base = Setting::Known(why, by.into());
    }

    fn use_tool(&self, number: i64, by: &str, state: &mut SystemState) {
        state.force.tool = Setting::Known(self.tool_of(number), by.into());
        let by = format!("LOAD_DATA[{number}], by {by},");
        state.force.load = Setting::Known(sole(&self.loads, &number), by);
    }

    fn point(&self, name: &str) -> Option<PointData> {
        sole(&self.points, name)
    }

    /// The data of the point in `NAME(FP1)` or `NAME(FP1.MEMBER)`.
    fn point_in(&self, value: &[Token], names: &str) -> Option<PointData> {
        let [name, open, point, ..] = value else {
            return None;
        };
        let is = name.is_word(names) && open.is(b'(') && point.sort == TokenKind::Word;
        self.point(&Some(point.upper()).filter(|_| is)?)
    }

    fn base_of(&self, number: i64) -> Option<Pose> {
        if number == 0 {
            Some(Pose::identity())
        } else {
            sole(&self.bases, &number)
        }
    }

    fn tool_of(&self, number: i64) -> ToolInForce {
        let frame = if number == 0 {
            Some(Pose::identity())
        } else {
            sole(&self.tools, &number)
        };
        ToolInForce {
            name: format!("TOOL_DATA[{number}]"),
            frame,
        }
    }

    /// Frames of tools by their names, as the files declare them.
    pub fn tools(&self) -> impl Iterator<Item = ToolInForce> + '_ {
        self.tools.keys().map(|number| self.tool_of(*number))
    }

    fn base(&self, value: &[Token]) -> Option<Pose> {
        let entry = || self.base_of(indexed(value, "BASE_DATA")?);
        let of_point = || self.base_of(self.point_in(value, "SBASE")?.base);
        self.plain(value).or_else(entry).or_else(of_point)
    }

    fn tool(&self, value: &[Token]) -> Option<ToolInForce> {
        if let Some(frame) = self.plain(value) {
            let (name, frame) = ("$TOOL".into(), Some(frame));
            return Some(ToolInForce { name, frame });
        }
        let of_point = || Some(self.point_in(value, "STOOL STOOL2")?.tool);
        let number = indexed(value, "TOOL_DATA").or_else(of_point);
        number.map(|number| self.tool_of(number))
    }

    /// The mass of a load, none where its declaration does not say; none at all where the text does not say which load it is.
    fn load(&self, value: &[Token]) -> Option<Option<f64>> {
        if value.first().is_some_and(|first| first.is(b'{')) {
            return Some(mass(value));
        }
        let of_point = || Some(self.point_in(value, "SLOAD")?.tool);
        let number = indexed(value, "LOAD_DATA").or_else(of_point);
        number.map(|number| sole(&self.loads, &number))
    }

    /// A frame by its numbers, or one that is declared with them.
    fn plain(&self, value: &[Token]) -> Option<Pose> {
        let named = || match value {
            [word] => sole(&self.frames, word.upper().as_str()),
            _ => None,
        };
        frame(value).or_else(named)
    }
}

/// What is declared by a name or number, if one thing is.
fn sole<K, Q, T>(known: &BTreeMap<K, Option<T>>, key: &Q) -> Option<T>
where
    K: Ord + Borrow<Q>,
    Q: Ord + ?Sized,
    T: Copy,
{
    known.get(key).copied().flatten()
}

/// Why a frame is not known.
fn unknown(value: &[Token], of_part: bool) -> String {
    let number = |table| Some((table, indexed(value, table)?));
    match ["BASE_DATA", "TOOL_DATA"].into_iter().find_map(number) {
        _ if of_part => "is set in parts".into(),
        Some((table, number)) => {
            format!("is {table}[{number}], which no file that was read declares")
        }
        None => "is computed when the program runs".into(),
    }
}

const FIXED: &str = "is carried by the robot: the tool stands still ($IPO_MODE #TCP)";

/// `BASE_DATA[3] = {...}`: name, number, and the value; none where a part of it is set.
fn entry<'t, 'p>(line: &'t [Token<'p>]) -> Option<(String, i64, Option<&'t [Token<'p>]>)> {
    let [name, _, _, _, tail @ ..] = line else {
        return None;
    };
    let tables = ["BASE_DATA", "TOOL_DATA", "LOAD_DATA"];
    let number = tables.iter().find_map(|table| indexed(&line[..4], table))?;
    let (subject, value) = member(tail)?;
    Some((name.upper(), number, value.filter(|_| subject.is_none())))
}

/// The number in `TABLE[3]`.
fn indexed(value: &[Token], table: &str) -> Option<i64> {
    let [name, open, index, close] = value else {
        return None;
    };
    let is = name.is_word(table) && open.is(b'[') && close.is(b']');
    let (number, _) = number(std::slice::from_ref(index)).filter(|_| is)?;
    Some(number as i64)
}

/// A frame: `{X 1, ..., C 6}` or `$NULLFRAME`, mm and deg.
fn frame(value: &[Token]) -> Option<Pose> {
    if value.len() == 1 && value[0].is_word("$NULLFRAME") {
        return Some(Pose::identity());
    }
    let [x, y, z, a, b, c] = ["X", "Y", "Z", "A", "B", "C"].map(|name| field(value, name));
    let turn = turns(a?.to_radians(), b?.to_radians(), c?.to_radians());
    Some(Pose::new(turn, Vector3::new(x?, y?, z?) * 1e-3))
}

/// The mass of a LOAD, kg: below 0 it is not known.
fn mass(value: &[Token]) -> Option<f64> {
    field(value, "M").filter(|mass| *mass >= 0.0)
}

/// The data of a point.
fn point(value: &[Token]) -> Option<PointData> {
    let number = |name: &str| field(value, name).map(|number| number as i64);
    let fixed = |w: &[Token]| w[0].is_word("IPO_FRAME") && w[2].is_word("TCP");
    Some(PointData {
        tool: number("TOOL_NO")?,
        base: number("BASE_NO")?,
        fixed_tool: value.windows(3).any(fixed),
    })
}

/// A number of an aggregate by its name, not of those inside.
fn field(value: &[Token], name: &str) -> Option<f64> {
    let [open, .., close] = value else {
        return None;
    };
    let whole = open.is(b'{') && close.is(b'}') && closing(value, 0) + 1 == value.len();
    whole.then(|| Aggregate::new(value).number(name))?
}

/// Adds the motions of a file, whose bytes are given; `file`: how people find it, where it is not the one that is corrected.
pub(super) fn reach(
    bytes: &[u8],
    lines: &[&[Token]],
    data: &SystemData,
    file: Option<&str>,
    out: &mut Reached,
) {
    let places = places(bytes, lines, file);
    let names = routines(lines);
    let flow = Flow::of(&steps(lines, |line| data.sets(line)));
    let (states, lost) = match flow {
        Ok(flow) => {
            let take =
                |at: usize, state: &mut SystemState| data.take(lines[at], &places[at], state);
            let lost = "is not known: no way leads to this line".to_string();
            (flow.states(&SystemState::START, take), lost)
        }
        Err(at) => {
            let place = &places[at];
            let lost = format!("is not known: the block of {place} does not close where it should");
            (vec![None; lines.len()], lost)
        }
    };
    for ((line, state), place) in lines.iter().zip(states).zip(&places) {
        if motion(line).is_none() {
            mentions(line, place, out);
            let unknown = data.unknown_call(line);
            if let Some(name) = unknown.filter(|name| !names.contains(name) && file.is_none()) {
                let message = format!(
                    "calls {name} of a file that was not read: calib assumed that it leaves $BASE, $TOOL and $LOAD as they are"
                );
                out.assumed.push((line[0].start, message));
            }
            continue;
        }
        let force = match &state {
            Some(state) => data.at_motion(line, place, state),
            None => InForce::open(&lost),
        };
        // The positions of a motion, and whatever else stands between its commas.
        for operand in arguments(&before_with(line)[1..]) {
            match operand {
                [first, ..] if first.sort == TokenKind::Word => out.moved_to(first, &force),
                [first, .., last] if first.is(b'{') && file.is_none() => {
                    out.placed.push((first.start..last.end, force.clone()));
                }
                _ => {}
            }
        }
    }
}

/// Names that a line uses otherwise than as the position of a motion.
fn mentions(line: &[Token], place: &str, out: &mut Reached) {
    let head = line[0].upper();
    // Variables of the system are no targets that a program moves to by their names.
    if declared(line).is_some() || head.ends_with("_REL") || head.starts_with('$') {
        return;
    }
    // What is assigned to is none that is used.
    let assigned = line.iter().position(|token| token.is(b'='));
    out.handed_on(&line[assigned.unwrap_or(0) + 1..], place);
}

/// How people find each line.
fn places(bytes: &[u8], lines: &[&[Token]], file: Option<&str>) -> Vec<String> {
    let (mut number, mut from) = (1, 0);
    let place = |line: &&[Token]| {
        let at = line[0].start;
        number += bytes[from..at]
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
        from = at;
        match file {
            Some(file) => format!("{file}:{number}"),
            None => format!("line {number}"),
        }
    };
    lines.iter().map(place).collect()
}

//! Frames, tools and loads of the system that files declare, and how a line of a program puts them in force.
//!
//! `$BASE`, `$TOOL`, `$LOAD` are set by aggregates, by entries of `BASE_DATA`, `TOOL_DATA`, `LOAD_DATA`, by frames that are declared with their
//! numbers, by `BAS(#BASE, n)` and `BAS(#TOOL, n)` (which takes the load of the same number), and by the data of a point (`FDAT`) that an inline
//! form names: `FDAT_ACT=FP1` with `BAS(#PTP_PARAMS, ..)`, or `WITH $BASE=SBASE(FP1.BASE_NO), $TOOL=STOOL2(FP1)` for one motion.

use super::super::flow::{FlowStep, JoinedState};
use super::super::literal::{InForce, Setting, ToolInForce};
use super::super::token::{ProgramText, Token, TokenKind, arguments, closing};
use super::aggregate::Aggregate;
use super::line::{declared, member, step};
use crate::compensate::turns;
use crate::spatial::Pose;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Calls of `BAS` that put the data of a point in force.
const OF_A_POINT: [&str; 5] = ["FRAMES", "PTP_PARAMS", "CP_PARAMS", "PTP_DAT", "CP_DAT"];

/// Heads of lines that name a routine and do not call it.
const DECLARING: [&str; 7] = [
    "DEF", "DEFFCT", "GLOBAL", "EXT", "EXTFCT", "EXTP", "EXTFCTP",
];

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
    pub(crate) force: InForce,
    point: Option<String>,
    /// Why the robot does not carry the tool in `$BASE`.
    astray: Setting<String>,
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
            astray: self.astray.joined(&other.astray),
        }
    }
}

impl SystemState {
    /// At the beginning of a program.
    pub(crate) const START: Self = Self {
        force: InForce::NOTHING,
        point: None,
        astray: Setting::Unset,
    };

    /// What is in force at a motion.
    pub(crate) fn at_motion(&self) -> InForce {
        let base = match &self.astray {
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
    pub(crate) fn declare(&mut self, source: ProgramText, lines: &[&[Token]]) {
        for line in lines {
            if let Some((name, number, value)) = entry(source, line) {
                match name.as_str() {
                    "BASE_DATA" => note(
                        &mut self.bases,
                        number,
                        value.and_then(|value| frame(source, value)),
                    ),
                    "TOOL_DATA" => note(
                        &mut self.tools,
                        number,
                        value.and_then(|value| frame(source, value)),
                    ),
                    _ => note(
                        &mut self.loads,
                        number,
                        value.and_then(|value| mass(source, value)),
                    ),
                }
            } else if let Some((kind, names)) = declared(source, line)
                && let Some(at) = line.iter().position(|token| token.is(b'='))
            {
                match kind.as_str() {
                    "FDAT" => note(
                        &mut self.points,
                        names[0].clone(),
                        point(source, &line[at + 1..]),
                    ),
                    "FRAME" => note(
                        &mut self.frames,
                        names[0].clone(),
                        frame(source, &line[at + 1..]),
                    ),
                    _ => {}
                }
            }
        }
        // Set a second time, in whole or in part.
        for line in lines
            .iter()
            .filter(|line| line.len() > 2 && declared(source, line).is_none())
        {
            let name = source.upper(&line[0]);
            if let Some((subject, Some(value))) = member(source, &line[1..]) {
                let whole = subject.is_none();
                if self.frames.contains_key(&name) {
                    note(
                        &mut self.frames,
                        name,
                        frame(source, value).filter(|_| whole),
                    );
                } else if self.points.contains_key(&name) {
                    note(
                        &mut self.points,
                        name,
                        point(source, value).filter(|_| whole),
                    );
                }
            }
        }
    }

    /// Adds the routines of other files. What a routine calls may be declared behind it, or in a file behind its own: all are read until no
    /// further one is found to set anything.
    pub(crate) fn declare_routines(&mut self, files: &[(ProgramText, Vec<&[Token]>)]) {
        loop {
            let before = self.routines.clone();
            files
                .iter()
                .for_each(|(source, lines)| self.declare_routines_of(*source, lines));
            if self.routines == before {
                return;
            }
        }
    }

    fn declare_routines_of(&mut self, source: ProgramText, lines: &[&[Token]]) {
        let mut inside: Option<String> = None;
        for line in lines {
            match step(source, line) {
                FlowStep::Routine(name) => {
                    self.routines.entry(name.clone()).or_insert(false);
                    inside = Some(name);
                }
                _ if self.sets(source, line) => {
                    inside.iter().for_each(|name| {
                        self.routines.insert(name.clone(), true);
                    });
                }
                _ => {}
            }
        }
    }

    /// Whether a line sets what is in force.
    pub(crate) fn sets(&self, source: ProgramText, line: &[Token]) -> bool {
        const SET: [&str; 7] = [
            "$BASE",
            "$TOOL",
            "$LOAD",
            "$IPO_MODE",
            "$ROBROOT",
            "FDAT_ACT",
            "BAS",
        ];
        source.is_word(&line[0], &SET) || self.called(source, line).is_some()
    }

    /// The routine of another file that a line calls, by itself or within an expression, where that one sets what is in force.
    fn called(&self, source: ProgramText, line: &[Token]) -> Option<String> {
        if source.is_word(&line[0], &DECLARING) {
            return None;
        }
        let calls = line
            .windows(2)
            .filter(|w| w[0].sort == TokenKind::Word && w[1].is(b'('));
        calls
            .map(|w| source.upper(&w[0]))
            .find(|name| self.routines.get(name) == Some(&true))
    }

    /// The routine that a line calls and that no file that was read has.
    pub(crate) fn unknown_call(&self, source: ProgramText, line: &[Token]) -> Option<String> {
        let call = line.len() > 2 && line[0].sort == TokenKind::Word && line[1].is(b'(');
        let known = source.is_word(&line[0], &["BAS"])
            || self.routines.contains_key(&source.upper(&line[0]));
        (call && !known).then(|| source.upper(&line[0]))
    }

    /// Takes a state through a line; `place`: how people find it.
    pub(crate) fn take(
        &self,
        source: ProgramText,
        line: &[Token],
        place: &str,
        state: &mut SystemState,
    ) {
        if source.is_word(&line[0], &["BAS"]) {
            self.call(source, line, place, state);
        } else if let Some(name) = self.called(source, line) {
            state.force = InForce::open(&format!(
                "is set by {name}, a routine of another file ({place})"
            ));
        } else {
            self.set(source, line, place, state);
        }
    }

    /// A motion with what stands behind its `WITH`.
    pub(crate) fn at_motion(
        &self,
        source: ProgramText,
        line: &[Token],
        place: &str,
        state: &SystemState,
    ) -> InForce {
        let mut state = state.clone();
        let with = line
            .iter()
            .position(|token| source.is_word(token, &["WITH"]))
            .map_or(line.len(), |at| at + 1);
        let settings = arguments(&line[with..]);
        for setting in settings.filter(|setting| !setting.is_empty()) {
            self.set(source, setting, place, &mut state);
        }
        state.at_motion()
    }

    /// `$BASE = ...` and the like.
    fn set(&self, source: ProgramText, line: &[Token], place: &str, state: &mut SystemState) {
        let name = source.upper(&line[0]);
        let Some((subject, Some(value))) = member(source, &line[1..]) else {
            return;
        };
        let by = format!("{name} of {place}");
        let open = |why: &str| format!("{why} ({name} of {place})");
        match name.as_str() {
            "$BASE" => {
                state.force.base = match self.base(source, value).filter(|_| subject.is_none()) {
                    Some(pose) => Setting::Known(pose, by),
                    None => Setting::Open(open(&self.unknown(source, value, subject.is_some()))),
                }
            }
            "$TOOL" => {
                state.force.tool = match self.tool(source, value).filter(|_| subject.is_none()) {
                    Some(tool) => Setting::Known(tool, by),
                    None => Setting::Open(open(&self.unknown(source, value, subject.is_some()))),
                }
            }
            "$LOAD" => {
                state.force.load = match self.load(source, value).filter(|_| subject.is_none()) {
                    Some(mass) => Setting::Known(mass, by),
                    None => Setting::Open(open("is set when the program runs")),
                }
            }
            "$IPO_MODE" => {
                let carried = value
                    .get(1)
                    .is_some_and(|word| source.is_word(word, &["BASE"]));
                let point =
                    of_function(source, value, &["SIPO_MODE"]).and_then(|name| self.point(&name));
                let carried = carried || point.is_some_and(|point| !point.fixed_tool);
                state.astray =
                    Setting::Known(if carried { String::new() } else { open(FIXED) }, by);
            }
            "$ROBROOT" => {
                let zero = frame(source, value).is_some_and(|pose| pose == Pose::identity());
                let why = open("is not known: the program moves the robot's base");
                state.astray = Setting::Known(if zero { String::new() } else { why }, by);
            }
            "FDAT_ACT" => {
                state.point = value
                    .first()
                    .map(|name| source.upper(name))
                    .filter(|_| subject.is_none())
            }
            _ => {}
        }
    }

    /// `BAS(#BASE, 3)`.
    fn call(&self, source: ProgramText, line: &[Token], place: &str, state: &mut SystemState) {
        let [_, open, sharp, what, tail @ ..] = line else {
            return;
        };
        if !open.is(b'(') || !sharp.is(b'#') {
            return;
        }
        let what = source.upper(what);
        let number = tail
            .get(1..2)
            .and_then(|number| source.number(number))
            .map(|(number, _)| number as i64);
        if OF_A_POINT.contains(&what.as_str()) {
            let point = state
                .point
                .as_ref()
                .map(|name| (name.clone(), self.point(name)));
            match point {
                Some((name, Some(point))) => {
                    self.apply(point, &format!("{name} at {place}"), state)
                }
                Some((name, None)) => {
                    state.force = InForce::open(&format!(
                        "is that of {name}, which no file that was read declares ({place})"
                    ))
                }
                None => {}
            }
        } else if what == "BASE" {
            state.force.base = match number.and_then(|number| self.base_of(number)) {
                Some(pose) => Setting::Known(pose, format!("BAS(#BASE) of {place}")),
                None => Setting::Open(format!(
                    "is an entry of BASE_DATA that no file that was read declares ({place})"
                )),
            };
        } else if what == "TOOL" {
            match number {
                Some(number) => self.use_tool(number, &format!("BAS(#TOOL) of {place}"), state),
                None => {
                    state.force.tool =
                        Setting::Open(format!("is chosen when the program runs ({place})"))
                }
            }
        } else if what == "EX_BASE" {
            state.force.base = Setting::Open(format!("moves with an external kinematic ({place})"));
        }
    }

    fn apply(&self, point: PointData, by: &str, state: &mut SystemState) {
        self.use_tool(point.tool, by, state);
        state.force.base = match self.base_of(point.base) {
            Some(pose) => Setting::Known(pose, format!("BASE_DATA[{}] by {by}", point.base)),
            None => Setting::Open(format!(
                "is BASE_DATA[{}], which no file that was read declares ({by})",
                point.base
            )),
        };
        state.astray = Setting::Known(
            if point.fixed_tool {
                format!("{FIXED} ({by})")
            } else {
                String::new()
            },
            by.into(),
        );
    }

    fn use_tool(&self, number: i64, by: &str, state: &mut SystemState) {
        state.force.tool = Setting::Known(self.tool_of(number), by.into());
        state.force.load = Setting::Known(
            self.loads.get(&number).copied().flatten(),
            format!("LOAD_DATA[{number}], by {by},"),
        );
    }

    fn point(&self, name: &str) -> Option<PointData> {
        self.points.get(name).copied().flatten()
    }

    fn base_of(&self, number: i64) -> Option<Pose> {
        if number == 0 {
            Some(Pose::identity())
        } else {
            self.bases.get(&number).copied().flatten()
        }
    }

    fn tool_of(&self, number: i64) -> ToolInForce {
        let frame = if number == 0 {
            Some(Pose::identity())
        } else {
            self.tools.get(&number).copied().flatten()
        };
        ToolInForce {
            name: format!("TOOL_DATA[{number}]"),
            frame,
        }
    }

    /// Frames of tools by their names, as the files declare them.
    pub(crate) fn tools(&self) -> impl Iterator<Item = ToolInForce> + '_ {
        self.tools.keys().map(|number| self.tool_of(*number))
    }

    fn base(&self, source: ProgramText, value: &[Token]) -> Option<Pose> {
        let of_point = || {
            of_function(source, value, &["SBASE"])
                .and_then(|name| self.point(&name))
                .and_then(|point| self.base_of(point.base))
        };
        frame(source, value)
            .or_else(|| self.named(source, value))
            .or_else(|| indexed(source, value, "BASE_DATA").and_then(|number| self.base_of(number)))
            .or_else(of_point)
    }

    fn tool(&self, source: ProgramText, value: &[Token]) -> Option<ToolInForce> {
        let plain = frame(source, value).or_else(|| self.named(source, value));
        let named = |frame| ToolInForce {
            name: "$TOOL".into(),
            frame: Some(frame),
        };
        let number = indexed(source, value, "TOOL_DATA").or_else(|| {
            of_function(source, value, &["STOOL", "STOOL2"])
                .and_then(|name| self.point(&name))
                .map(|point| point.tool)
        });
        plain
            .map(named)
            .or_else(|| number.map(|number| self.tool_of(number)))
    }

    /// The mass of a load, none where its declaration does not say; none at all where the text does not say which load it is.
    fn load(&self, source: ProgramText, value: &[Token]) -> Option<Option<f64>> {
        if value.first().is_some_and(|first| first.is(b'{')) {
            return Some(mass(source, value));
        }
        let number = indexed(source, value, "LOAD_DATA").or_else(|| {
            of_function(source, value, &["SLOAD"])
                .and_then(|name| self.point(&name))
                .map(|point| point.tool)
        });
        number.map(|number| self.loads.get(&number).copied().flatten())
    }

    fn named(&self, source: ProgramText, value: &[Token]) -> Option<Pose> {
        let [word] = value else { return None };
        self.frames.get(&source.upper(word)).copied().flatten()
    }

    /// Why a frame is not known.
    fn unknown(&self, source: ProgramText, value: &[Token], of_part: bool) -> String {
        let table = ["BASE_DATA", "TOOL_DATA"]
            .into_iter()
            .find_map(|table| Some((table, indexed(source, value, table)?)));
        match table {
            _ if of_part => "is set in parts".into(),
            Some((table, number)) => {
                format!("is {table}[{number}], which no file that was read declares")
            }
            None => "is computed when the program runs".into(),
        }
    }
}

const FIXED: &str = "is carried by the robot: the tool stands still ($IPO_MODE #TCP)";

/// `BASE_DATA[3] = {...}`: name, number, and the value; none where a part of it is set.
fn entry<'t>(source: ProgramText, line: &'t [Token]) -> Option<(String, i64, Option<&'t [Token]>)> {
    let [name, open, number, close, tail @ ..] = line else {
        return None;
    };
    let is = open.is(b'[')
        && close.is(b']')
        && source.is_word(name, &["BASE_DATA", "TOOL_DATA", "LOAD_DATA"]);
    let (number, _) = source.number(std::slice::from_ref(number))?;
    let (subject, value) = member(source, tail).filter(|_| is)?;
    Some((
        source.upper(name),
        number as i64,
        value.filter(|_| subject.is_none()),
    ))
}

/// The number in `TABLE[3]`.
fn indexed(source: ProgramText, value: &[Token], table: &str) -> Option<i64> {
    let [name, open, number, close] = value else {
        return None;
    };
    let is = source.is_word(name, &[table]) && open.is(b'[') && close.is(b']');
    source
        .number(std::slice::from_ref(number))
        .filter(|_| is)
        .map(|(number, _)| number as i64)
}

/// The point in `NAME(FP1)` or `NAME(FP1.MEMBER)`.
fn of_function(source: ProgramText, value: &[Token], names: &[&str]) -> Option<String> {
    let [name, open, point, ..] = value else {
        return None;
    };
    let is = source.is_word(name, names) && open.is(b'(') && point.sort == TokenKind::Word;
    is.then(|| source.upper(point))
}

/// A frame: `{X 1, ..., C 6}` or `$NULLFRAME`, mm and deg.
fn frame(source: ProgramText, value: &[Token]) -> Option<Pose> {
    if value.len() == 1 && source.is_word(&value[0], &["$NULLFRAME"]) {
        return Some(Pose::identity());
    }
    let value = ["X", "Y", "Z", "A", "B", "C"].map(|name| field(source, value, name));
    let [x, y, z, a, b, c] = value;
    let turn = turns(a?.to_radians(), b?.to_radians(), c?.to_radians());
    Some(Pose::new(turn, Vector3::new(x?, y?, z?) * 1e-3))
}

/// The mass of a LOAD, kg: below 0 it is not known.
fn mass(source: ProgramText, value: &[Token]) -> Option<f64> {
    field(source, value, "M").filter(|mass| *mass >= 0.0)
}

/// The data of a point.
fn point(source: ProgramText, value: &[Token]) -> Option<PointData> {
    let number = |name: &str| field(source, value, name).map(|number| number as i64);
    let fixed_tool = value
        .windows(3)
        .any(|w| source.is_word(&w[0], &["IPO_FRAME"]) && source.is_word(&w[2], &["TCP"]));
    Some(PointData {
        tool: number("TOOL_NO")?,
        base: number("BASE_NO")?,
        fixed_tool,
    })
}

/// A number of an aggregate by its name, not of those inside.
fn field(source: ProgramText, value: &[Token], name: &str) -> Option<f64> {
    let [open, .., close] = value else {
        return None;
    };
    let whole = open.is(b'{') && close.is(b'}') && closing(value, 0) + 1 == value.len();
    whole.then(|| Aggregate::new(source, value).number(name))?
}

//! The base and the load under which the targets of a file are reached, where all that it sets of them is the same.
//!
//! `$BASE` and `$LOAD` are set by an aggregate, by an entry of `BASE_DATA` or `LOAD_DATA` that the file itself fills, or by `BAS`. Which of
//! several settings holds at a motion follows from how a program runs, not from its text: such files state none.

use super::super::Gathered;
use super::super::TargetKind;
use super::super::token::{ProgramText, Token};
use super::MOTIONS;
use super::aggregate::Aggregate;
use super::line::{closing, member};
use crate::compensate::turns;
use crate::spatial::Pose;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// What all settings of a variable say.
#[derive(Debug, Clone)]
struct Settings<T> {
    /// Byte and value; none where that cannot be told.
    all: Vec<(usize, Option<T>)>,
    /// Entries of the table of frames or loads.
    table: BTreeMap<i64, T>,
}

impl<T: Clone + PartialEq> Settings<T> {
    fn new() -> Self {
        Self { all: Vec::new(), table: BTreeMap::new() }
    }

    /// The one value, and where it is first set, before byte `motion`.
    fn one(&self, motion: usize) -> Option<(usize, T)> {
        let (at, first) = self.all.first()?;
        let first = first.clone()?;
        let same = self.all.iter().all(|(_, value)| value.as_ref() == Some(&first));
        (same && *at < motion).then_some((*at, first))
    }
}

/// Base (m, rad) and payload (kg) of all targets of a file, with the byte where each is set.
#[derive(Debug, Default)]
pub(super) struct SetSurroundings {
    base: Option<(usize, Pose)>,
    load: Option<(usize, f64)>,
}

impl SetSurroundings {
    /// Of the lines of a file.
    pub fn of(source: ProgramText, lines: &[&[Token]]) -> Self {
        let (mut base, mut load) = (Settings::new(), Settings::new());
        for line in lines {
            if source.is_word(&line[0], &["BASE_DATA", "LOAD_DATA"])
                && let Some((number, value)) = entry(source, line)
            {
                match source.is_word(&line[0], &["BASE_DATA"]) {
                    true => drop(frame(source, value).map(|pose| base.table.insert(number, pose))),
                    false => drop(mass(source, value).map(|mass| load.table.insert(number, mass))),
                }
            }
        }
        let is_motion = |line: &&&[Token]| MOTIONS.iter().any(|(name, _)| source.is_word(&line[0], &[name]));
        let motion = lines.iter().find(is_motion).map_or(usize::MAX, |line| line[0].span.start);
        for line in lines {
            set(source, line, "$BASE", "BASE_DATA", &mut base, frame);
            set(source, line, "$LOAD", "LOAD_DATA", &mut load, mass);
            let call =
                line.windows(6).find(|w| source.is_word(&w[0], &["BAS"]) && w[1].is(b'(') && w[2].is(b'#') && w[4].is(b','));
            if let Some((call, number)) = call.and_then(|call| Some((call, source.number(&call[5..6])?.0 as i64))) {
                let at = call[0].span.start;
                if source.is_word(&call[3], &["BASE"]) {
                    base.all.push((at, base.table.get(&number).copied()));
                } else if source.is_word(&call[3], &["TOOL"]) {
                    load.all.push((at, load.table.get(&number).copied()));
                }
            }
            let point = line.windows(2).find(|w| source.is_word(&w[0], &["BASE_NO"]));
            if let Some((number, _)) = point.and_then(|w| source.number(&w[1..])) {
                let known = if number == 0.0 { Some(Pose::identity()) } else { base.table.get(&(number as i64)).copied() };
                base.all.push((line[0].span.start, known));
            }
        }
        // Points of inline forms that stand in the base itself set nothing.
        let own = base.all.iter().all(|(_, pose)| *pose == Some(Pose::identity()));
        Self { base: base.one(motion).filter(|_| !own), load: load.one(motion) }
    }

    /// Whether what a file sets of this variable is applied.
    pub fn applies(&self, variable: &str) -> bool {
        variable == "$BASE" && self.base.is_some()
    }

    /// Gives literals their frame and payload, and says which they are.
    pub fn settle(self, found: &mut Gathered) {
        for literal in &mut found.literals {
            literal.frame = self.base.map(|(_, pose)| pose).filter(|_| literal.kind != TargetKind::Joints);
            literal.payload = self.load.map(|(_, mass)| mass);
        }
        if let Some((at, _)) = self.base {
            found.warn(at, "$BASE is applied as this program sets it, in the robot's base");
        }
        if let Some((at, mass)) = self.load {
            found.warn(at, format!("payload {mass} kg, as $LOAD states"));
        }
    }
}

/// `NAME[3] = {...}`: number and aggregate.
fn entry<'t>(source: ProgramText, line: &'t [Token]) -> Option<(i64, &'t [Token])> {
    let [_, open, number, close, equals, rest @ ..] = line else { return None };
    let is = open.is(b'[') && close.is(b']') && equals.is(b'=');
    let (number, _) = source.number(std::slice::from_ref(number))?;
    is.then_some((number as i64, rest))
}

/// What a line sets of a variable.
fn set<T: Clone>(
    source: ProgramText,
    line: &[Token],
    variable: &str,
    table: &str,
    settings: &mut Settings<T>,
    read: fn(ProgramText, &[Token]) -> Option<T>,
) {
    for (k, token) in line.iter().enumerate().filter(|(_, token)| source.is_word(token, &[variable])) {
        let Some((member, Some(value))) = member(source, &line[k + 1..]) else { continue };
        // Behind WITH it holds for one motion.
        let whole = member.is_none() && k == 0;
        let entry = value.first().filter(|first| source.is_word(first, &[table])).and_then(|_| source.number(value.get(2..3)?));
        let known = match entry {
            Some((number, _)) => settings.table.get(&(number as i64)).cloned(),
            None => read(source, value),
        };
        settings.all.push((token.span.start, known.filter(|_| whole)));
    }
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

/// A number of an aggregate by its name, not of those inside.
fn field(source: ProgramText, value: &[Token], name: &str) -> Option<f64> {
    let [open, .., close] = value else { return None };
    let whole = open.is(b'{') && close.is(b'}') && closing(value, 0) + 1 == value.len();
    whole.then(|| Aggregate::new(source, value).number(name))?
}

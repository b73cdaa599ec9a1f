//! Programs of robot controllers, read strictly and rewritten: only the numbers of targets change, every other byte stays.
//!
//! KUKA KRL (`krl`), ABB RAPID (`rapid`), FANUC's listings (`fanuc`) and Universal Robots' script (`urscript`). A target is accepted where its literal is understood exactly: every field known, named
//! once, one number each. What cannot be told to be a target or not refuses the program; nothing is guessed. A program is parsed
//! whole before anything is solved, so that all its faults come at once. Joint positions that a program declares under names are a table,
//! too ([`joint_list`]).
//!
//! Joint positions that a program declares under names: `CONST jointtarget` of RAPID, `DECL E6AXIS` and `DECL AXIS` of KRL, positions in joints of
//! FANUC's listings, lists of six joints of URScript.
//!
//! A robot that is measured at the positions of a program logs no joints: the program holds them. Instructions are not looked at.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::{description, error, statistics, units};
use calib_numerics::{compensate, robot, spatial};
use {calib_dynamics as dynamics, calib_raw as raw};

pub use crate::correct::{ProgramFile, ProgramLoad, ProgramRules, corrected, has_mark, with_mark};
use crate::literal::ToolInForce;
pub use crate::literal::{Literal, TargetKind};
pub use crate::pose::solve;
use crate::robot::RobotModel;
pub use crate::stated::PostureStatement;
use crate::token::{Token, tokens};
pub use crate::tools::RobotTool;
use std::collections::BTreeMap;
use std::ops::Range;

mod correct;
mod fanuc;
mod flow;
mod krl;
mod literal;
mod pose;
mod rapid;
mod stated;
pub mod targets;
mod token;
mod tools;
mod urscript;

/// The languages of controllers that are known here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// KUKA: .src, .dat.
    Krl,
    /// ABB: .mod.
    Rapid,
    /// FANUC: .ls.
    Fanuc,
    /// Universal Robots: .script.
    UrScript,
}

/// What is to be known of a language.
struct Grammar {
    /// Endings of its files.
    endings: &'static [&'static str],
    /// What a comment begins with.
    comment: &'static str,
    /// First words of the lines behind which a comment may stand; none: it stands at the head of the file.
    heads: &'static [&'static str],
    /// What stands at the begin of a file that declares positions, in capitals.
    begins: &'static [&'static str],
    /// Reads a file with the declarations of the others.
    read: fn(&[u8], &[Companion]) -> Gathered,
    /// Reads the joint positions that a file declares, and counts its poses.
    listed: fn(&[u8]) -> Gathered,
}

impl Language {
    const ALL: [Self; 4] = [Self::Krl, Self::Rapid, Self::Fanuc, Self::UrScript];

    fn grammar(self) -> &'static Grammar {
        match self {
            Self::Krl => &krl::GRAMMAR,
            Self::Rapid => &rapid::GRAMMAR,
            Self::Fanuc => &fanuc::GRAMMAR,
            Self::UrScript => &urscript::GRAMMAR,
        }
    }

    /// By the ending of a file's name, in any case.
    pub fn of_ending(ending: &str) -> Option<Self> {
        let ending = ending.to_ascii_lowercase();
        let has = |language: &Self| language.grammar().endings.contains(&ending.as_str());
        Self::ALL.into_iter().find(has)
    }
}

/// Another file of a program: it declares frames, tools and loads, or moves to targets that the corrected file declares.
#[derive(Debug, Clone, Copy)]
pub struct Companion<'a> {
    /// How messages name it.
    pub place: &'a str,
    /// As it is in the file.
    pub text: &'a [u8],
}

/// The tokens of other files. What is wrong with the writing of another file is no fault of the one that is corrected.
fn others<'a>(companions: &[Companion<'a>], language: Language) -> Vec<Vec<Token<'a>>> {
    let read = |file: &Companion<'a>| tokens(file.text, language, &mut Gathered::default());
    companions.iter().map(read).collect()
}

/// What becomes of a target that states some of its numbers, as `LIN {X 10}`: the controller keeps the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Partial {
    /// It refuses the whole program.
    Refused,
    /// It stays as it is, with a warning.
    Left,
}

/// What becomes of a program that uses frames which are not applied: work objects, $BASE, $TOOL, displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frames {
    /// It is refused, with the lines.
    Refused,
    /// They are taken as those of the robot file, with a warning for each.
    Assumed,
}

/// Joints that all languages have targets for.
const JOINTS: usize = 6;

/// Brackets in brackets, at most: targets in arrays of three dimensions have six.
const DEPTH: usize = 16;

/// Something said of a place in a program; line and column count from 1, columns in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// From 1.
    pub line: usize,
    /// From 1.
    pub column: usize,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// Why a program was refused.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ProgramRefusal {
    /// In the order of the program.
    pub faults: Vec<Note>,
    /// How many of the faults are partial targets, which [`Partial::Left`] accepts.
    pub partial: usize,
}

/// A program with what was found in it.
#[derive(Debug)]
pub struct Program<'p> {
    bytes: &'p [u8],
    /// In the order of the program.
    literals: Vec<Literal>,
    warnings: Vec<Note>,
    /// Frames that are not applied.
    frames: Vec<Note>,
    /// Tools that its files declare.
    tools: Vec<ToolInForce>,
    /// Where each external axis first stands elsewhere than before.
    moving: Vec<Note>,
}

/// The answer to one literal.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedLiteral {
    /// The corrected numbers, in the units and the order of [`Literal::values`].
    pub values: Vec<f64>,
    /// The posture in which it is reached, stated as [`Literal::posture`] is.
    pub posture: PostureStatement,
    /// What is to be known of it; empty if nothing.
    pub remark: String,
}

/// A program with its targets corrected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rewritten {
    /// The program with its targets replaced.
    pub bytes: Vec<u8>,
    /// In the order of the program.
    pub warnings: Vec<Note>,
}

/// Messages by the bytes that they are of.
type Messages = Vec<(usize, String)>;

/// What a language's reader gathers.
#[derive(Debug, Default)]
struct Gathered {
    literals: Vec<Literal>,
    /// Literals that a variable holds, by their numbers, and its name.
    names: Vec<(Range<usize>, String)>,
    /// Variable -> types it is declared with anywhere in the file, in capitals.
    types: BTreeMap<String, Vec<String>>,
    warnings: Messages,
    faults: Messages,
    partial: Messages,
    frames: Messages,
    /// Tools that its files declare.
    tools: Vec<ToolInForce>,
    /// External axes that no literal holds: their names, bytes and positions.
    externals: Vec<(String, usize, f64)>,
    /// Positions that are poses, where joints are listed.
    poses: usize,
}

impl Gathered {
    fn warn(&mut self, at: usize, message: impl Into<String>) {
        self.warnings.push((at, message.into()));
    }

    fn fault(&mut self, at: usize, message: impl Into<String>) {
        self.faults.push((at, message.into()));
    }

    /// A frame that is not applied.
    fn frame(&mut self, at: usize, message: impl Into<String>) {
        self.frames.push((at, message.into()));
    }

    fn partial(&mut self, at: usize, message: impl Into<String>) {
        self.partial.push((at, message.into()));
    }

    /// Something that should not stand where it does.
    fn stray(&mut self, token: &Token, place: &str) {
        let message = format!("{} {place} is not understood", token.quoted());
        self.fault(token.start, message);
    }

    /// A frame that is not applied where it `refuses`, else a warning.
    fn say(&mut self, refuses: bool, at: usize, message: String) {
        let messages = if refuses {
            &mut self.frames
        } else {
            &mut self.warnings
        };
        messages.push((at, message));
    }

    /// What was read since there were `before` literals is held by a variable.
    fn held_by(&mut self, name: String, before: usize) {
        self.names.push((before..self.literals.len(), name));
    }

    fn declare(&mut self, name: String, kind: String) {
        let known = self.types.entry(name).or_default();
        if !known.contains(&kind) {
            known.push(kind);
        }
    }

    fn types(&self, name: &str) -> &[String] {
        self.types.get(name).map_or(&[], Vec::as_slice)
    }

    /// The one type that a variable has in this file.
    fn stated(&self, name: &str) -> Option<&str> {
        match self.types(name) {
            [one] => Some(one),
            _ => None,
        }
    }

    /// All its faults in the order of the program.
    fn placed_faults(&mut self, bytes: &[u8]) -> Vec<Note> {
        let beyond = self.literals.iter().flat_map(Literal::beyond_any_robot);
        self.faults.extend(beyond);
        placed(bytes, std::mem::take(&mut self.faults))
    }
}

impl<'p> Program<'p> {
    /// Reads a program that is one file; fails with every fault of it.
    pub fn parse(
        bytes: &'p [u8],
        language: Language,
        partial: Partial,
    ) -> Result<Self, ProgramRefusal> {
        Self::parse_with(bytes, language, partial, &[])
    }

    /// Reads a file of a program whole, by what the others declare; fails with every fault of it.
    pub fn parse_with(
        bytes: &'p [u8],
        language: Language,
        partial: Partial,
        companions: &[Companion],
    ) -> Result<Self, ProgramRefusal> {
        let mut found = (language.grammar().read)(bytes, companions);
        let parts = std::mem::take(&mut found.partial);
        let mut refused = 0;
        match partial {
            Partial::Refused => {
                refused = parts.len();
                found.faults.extend(parts);
            }
            Partial::Left => {
                let left = |(at, what)| (at, format!("left as it is: {what}"));
                found.warnings.extend(parts.into_iter().map(left));
            }
        }
        let faults = found.placed_faults(bytes);
        if !faults.is_empty() {
            let partial = refused;
            return Err(ProgramRefusal { faults, partial });
        }
        found.literals.sort_by_key(Literal::at);
        let mut program = Self {
            bytes,
            literals: found.literals,
            warnings: Vec::new(),
            frames: Vec::new(),
            tools: found.tools,
            moving: Vec::new(),
        };
        program.moving = placed(bytes, moving(&program.literals, found.externals));
        program.note(found.warnings, found.frames);
        Ok(program)
    }

    fn note(&mut self, warnings: Messages, frames: Messages) {
        let frames = placed(self.bytes, frames);
        self.warnings.extend(placed(self.bytes, warnings));
        self.warnings.extend(frames.iter().cloned());
        self.frames.extend(frames);
        for notes in [&mut self.warnings, &mut self.frames] {
            notes.sort_by_key(|note| (note.line, note.column));
        }
    }

    /// The targets that are to be corrected.
    pub fn literals(&self) -> &[Literal] {
        &self.literals
    }

    /// Takes the tools of its targets from the robot file's, which is the one that is stated, or else the one that the program uses; fails where
    /// the stated one is not known.
    pub fn relate_tools(
        &mut self,
        robot: &RobotModel,
        stated: Option<&RobotTool>,
    ) -> Result<(), String> {
        let mut found = Gathered {
            literals: std::mem::take(&mut self.literals),
            ..Gathered::default()
        };
        let related = tools::relate(&mut found, robot, stated, &self.tools);
        self.literals = found.literals;
        self.note(found.warnings, found.frames);
        related
    }

    /// Takes `payload` (kg) as what all targets carry, and says where the program states another one.
    fn carries(&mut self, payload: f64) {
        let differs = |literal: &Literal| {
            let stated = literal.payload.filter(|stated| *stated != payload)?;
            let message = format!(
                "the program states a payload of {stated} kg, --payload {payload} kg, which is used"
            );
            Some((literal.at(), message))
        };
        let other = self.literals.iter().find_map(differs);
        self.note(other.into_iter().collect(), Vec::new());
        let literals = self.literals.iter_mut();
        literals.for_each(|literal| literal.payload = Some(payload));
    }

    /// The lines that use frames which are not applied; they are among the warnings, too.
    pub fn frames(&self) -> &[Note] {
        &self.frames
    }

    /// Where external axes move: the first place at which each stands elsewhere than before.
    pub fn moving(&self) -> &[Note] {
        &self.moving
    }

    /// A frame that is not applied at the first Cartesian target, if there is one.
    fn base_differs(&mut self, why: &str) {
        let mut literals = self.literals.iter();
        if let Some(first) = literals.find(|literal| !literal.kind.is_of_joints()) {
            self.note(Vec::new(), vec![(first.at(), why.into())]);
        }
    }

    /// What was assumed, or left as it is.
    pub fn warnings(&self) -> &[Note] {
        &self.warnings
    }

    /// The program with every literal's numbers replaced by its answer's; fails where one has none, with all the reasons.
    ///
    /// A number that is, to the decimals written, what it was stays as it was written.
    pub fn rewritten(
        &self,
        answers: Vec<Result<SolvedLiteral, String>>,
    ) -> Result<Rewritten, ProgramRefusal> {
        assert_eq!(answers.len(), self.literals.len(), "one answer a literal");
        let (mut faults, mut remarks) = (Vec::new(), Vec::new());
        let mut bytes = Vec::with_capacity(self.bytes.len() + 16 * answers.len());
        let mut from = 0;
        for (literal, answer) in self.literals.iter().zip(answers) {
            let solved = match answer {
                Ok(solved) => solved,
                Err(message) => {
                    faults.push((literal.at(), message));
                    continue;
                }
            };
            for (span, text) in literal.replacements(self.bytes, &solved) {
                bytes.extend_from_slice(&self.bytes[from..span.start]);
                // `A1-0.1`: the sign parts the name from the number.
                if bytes.last().is_some_and(u8::is_ascii_alphanumeric) && !text.starts_with('-') {
                    bytes.push(b' ');
                }
                bytes.extend_from_slice(text.as_bytes());
                from = span.end;
            }
            if !solved.remark.is_empty() {
                remarks.push((literal.at(), solved.remark));
            }
        }
        if !faults.is_empty() {
            let (faults, partial) = (placed(self.bytes, faults), 0);
            return Err(ProgramRefusal { faults, partial });
        }
        bytes.extend_from_slice(&self.bytes[from..]);
        let mut warnings = self.warnings.clone();
        warnings.extend(placed(self.bytes, remarks));
        warnings.sort_by_key(|note| (note.line, note.column));
        Ok(Rewritten { bytes, warnings })
    }
}

/// Positions that differ by less are the same, deg or mm.
const STILL: f64 = 1e-6;

/// External axes that stand at two positions or more in a program.
fn moving(literals: &[Literal], others: Vec<(String, usize, f64)>) -> Messages {
    let of_literal = |literal: &Literal| -> Vec<(String, usize, f64)> {
        let axes = (1..).zip(&literal.external);
        let stated = axes.filter_map(|(axis, at)| Some((format!("E{axis}"), literal.at(), (*at)?)));
        stated.collect()
    };
    let mut first: BTreeMap<String, f64> = BTreeMap::new();
    let mut out: BTreeMap<String, (usize, String)> = BTreeMap::new();
    for (axis, at, value) in literals.iter().flat_map(of_literal).chain(others) {
        let before = *first.entry(axis.clone()).or_insert(value);
        if (value - before).abs() > STILL {
            let message = format!(
                "the external axis {axis} moves ({before} to {value}): how the robot's base moves with it is not stated, and targets stand in a base \
                 that stands still"
            );
            out.entry(axis).or_insert((at, message));
        }
    }
    out.into_values().collect()
}

/// Bytes as lines and columns, in order.
fn placed(bytes: &[u8], mut messages: Messages) -> Vec<Note> {
    messages.sort();
    let (mut line, mut start, mut from) = (1, 0, 0);
    let place = |(at, message): (usize, String)| {
        for k in (from..at).filter(|k| bytes[*k] == b'\n') {
            (line, start) = (line + 1, k + 1);
        }
        from = at;
        let column = at - start + 1;
        Note {
            line,
            column,
            message,
        }
    };
    messages.into_iter().map(place).collect()
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
    let head = String::from_utf8_lossy(head).to_ascii_uppercase();
    let mut begins = language.grammar().begins.iter();
    begins.any(|word| head.contains(word)).then_some(language)
}

/// Reads what a program declares; fails with every fault of that.
pub fn joint_list(bytes: &[u8], language: Language) -> Result<JointList, Vec<Note>> {
    if bytes.len() > MOST_BYTES {
        let most = MOST_BYTES >> 20;
        let message = format!("a program of more than {most} MB; allowed: shorter ones");
        return Err(placed(bytes, vec![(0, message)]));
    }
    let mut found = (language.grammar().listed)(bytes);
    let parts = std::mem::take(&mut found.partial);
    found.faults.extend(parts);
    let faults = found.placed_faults(bytes);
    if !faults.is_empty() {
        return Err(faults);
    }
    // By the line at which each stands; positions are declared one after the other.
    let names = found.names.into_iter();
    let names = names.flat_map(|(literals, name)| literals.map(move |_| name.clone()));
    let places = found.literals.iter().map(Literal::at).zip(names);
    let lines = placed(bytes, places.collect());
    found.literals.sort_by_key(Literal::at);
    let row = |(literal, note): (Literal, Note)| ListedJoints {
        line: note.line,
        name: note.message,
        joints: match literal.kind {
            TargetKind::Radians => literal.values.iter().map(|rad| rad.to_degrees()).collect(),
            _ => literal.values,
        },
        external: literal.external,
    };
    Ok(JointList {
        rows: found.literals.into_iter().zip(lines).map(row).collect(),
        poses: found.poses,
    })
}

//! KUKA KRL: a statement a line. Targets are the aggregates `{...}` of motions, and of variables of a type of targets.
//!
//! Types: POS, E3POS, E6POS and AXIS, E3AXIS, E6AXIS, by the aggregate's own prefix (`{E6POS: X 1,...}`), else by the variable's declaration
//! in the same file, else by the motion. FRAME is a target only as operand of a motion. Variables of the system (`$BASE`, `$H_POS`),
//! relative motions (`LIN_REL`) and motions of external axes (`ASYPTP`) are left alone. What the geometric operator `:` joins is no
//! absolute pose: such targets are refused, and so is every aggregate that may be a target and of which the file does not tell.

mod aggregate;

use super::token::{Sort, Source, Token, tokens};
use super::{Found, Language, quoted};
use aggregate::{Aggregate, Type};
use std::collections::BTreeMap;

/// Motions, and how many positions each has.
const MOTIONS: [(&str, usize); 7] = [("PTP", 1), ("LIN", 1), ("CIRC", 2), ("SPTP", 1), ("SLIN", 1), ("SCIRC", 2), ("SPL", 1)];

/// What moves by a distance, or no axis of the robot.
const LEFT: [&str; 8] = ["PTP_REL", "LIN_REL", "CIRC_REL", "SPTP_REL", "SLIN_REL", "SCIRC_REL", "SPL_REL", "ASYPTP"];

/// What may stand behind a position: how it is blended.
const BLENDING: [&str; 5] = ["C_PTP", "C_DIS", "C_ORI", "C_VEL", "C_SPL"];

/// Types that need no DECL.
const PREDEFINED: [&str; 11] = ["INT", "REAL", "BOOL", "CHAR", "FRAME", "POS", "E3POS", "E6POS", "AXIS", "E3AXIS", "E6AXIS"];

const RELATIVE: &str = "the geometric operator `:` makes a relative pose of its operand; calib corrects absolute ones alone";

/// Frames of the system that are kept in files.
const FRAME_TABLES: [&str; 2] = ["BASE_DATA", "TOOL_DATA"];

pub(super) fn read(bytes: &[u8]) -> Found {
    let mut found = Found::default();
    let source = Source { bytes, language: Language::Krl };
    let tokens = tokens(source, &mut found);
    let lines: Vec<&[Token]> = tokens.split(|token| token.sort == Sort::LineEnd).filter(|line| !line.is_empty()).collect();
    let mut types: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in &lines {
        if let Some((kind, names)) = declared(source, line) {
            for name in names {
                let known = types.entry(name).or_default();
                if !known.contains(&kind) {
                    known.push(kind.clone());
                }
            }
        }
    }
    let mut reader = Reader { source, types, found };
    for line in lines {
        reader.line(line);
    }
    reader.found
}

/// The type and the names that a line declares, in capitals.
fn declared(source: Source, line: &[Token]) -> Option<(String, Vec<String>)> {
    let skipped = line.iter().take_while(|token| source.is_word(token, &["DECL", "GLOBAL", "CONST"])).count();
    let rest = &line[skipped..];
    let [kind, first, ..] = rest else { return None };
    let plain = rest.get(2).is_none_or(|next| next.is(b'=') || next.is(b'[') || next.is(b','));
    if kind.sort != Sort::Word || first.sort != Sort::Word || !plain {
        return None;
    }
    let kind = source.upper(kind);
    if skipped == 0 && !PREDEFINED.contains(&kind.as_str()) {
        return None;
    }
    let mut names = vec![source.upper(first)];
    let mut depth = 0;
    for pair in rest.windows(2) {
        depth += opens(&pair[0]);
        if depth == 0 && pair[0].is(b',') && pair[1].sort == Sort::Word {
            names.push(source.upper(&pair[1]));
        }
    }
    Some((kind, names))
}

/// +1 where a bracket opens, -1 where it closes.
fn opens(token: &Token) -> i32 {
    match token.sort {
        Sort::Sign(b'{' | b'[' | b'(') => 1,
        Sort::Sign(b'}' | b']' | b')') => -1,
        _ => 0,
    }
}

struct Reader<'p> {
    source: Source<'p>,
    /// Variable -> types it is declared with anywhere in the file.
    types: BTreeMap<String, Vec<String>>,
    found: Found,
}

impl Reader<'_> {
    fn line(&mut self, line: &[Token]) {
        if !self.braces_match(line) {
            return;
        }
        self.system(line);
        let head = self.source.upper(&line[0]);
        if LEFT.contains(&head.as_str()) {
            return;
        }
        if let Some((_, positions)) = MOTIONS.iter().find(|(name, _)| *name == head) {
            // `PTP = 3` names a variable.
            if !line.get(1).is_some_and(|next| next.is(b'=')) {
                return self.motion(line, *positions);
            }
        }
        self.other(line, &head);
    }

    fn braces_match(&mut self, line: &[Token]) -> bool {
        let mut open: Vec<&Token> = Vec::new();
        let before = self.found.faults.len();
        for token in line {
            if token.is(b'{') {
                open.push(token);
            } else if token.is(b'}') && open.pop().is_none() {
                self.found.fault(token.span.start, "`}` without `{`");
            }
        }
        for token in open {
            self.found.fault(token.span.start, "`{` without `}` on its line");
        }
        self.found.faults.len() == before
    }

    /// What a line sets that calib takes for granted.
    fn system(&mut self, line: &[Token]) {
        for (k, token) in line.iter().enumerate() {
            let names = ["$BASE", "$TOOL", "$IPO_MODE", "$ROBROOT"];
            if self.source.is_word(token, &names) && member(self.source, &line[k + 1..]).is_some_and(|(_, rest)| rest.is_some()) {
                let name = self.source.upper(token);
                self.found.warn(token.span.start, assumed(&name));
            }
        }
        let calls = line.windows(4).find(|w| self.source.is_word(&w[0], &["BAS"]) && w[1].is(b'(') && w[2].is(b'#'));
        if let Some(call) = calls.filter(|call| self.source.is_word(&call[3], &["BASE", "TOOL", "EX_BASE", "FRAMES"])) {
            let name = if self.source.is_word(&call[3], &["TOOL"]) { "$TOOL" } else { "$BASE" };
            self.found.warn(call[0].span.start, assumed(name));
        }
    }

    fn motion(&mut self, line: &[Token], positions: usize) {
        if let Some(colon) = self.geometric(line) {
            self.found.fault(colon, RELATIVE);
            return;
        }
        let end = line.iter().position(|token| self.source.is_word(token, &["WITH"])).unwrap_or(line.len());
        let (mut depth, mut operand, mut begins) = (0, 0, true);
        let mut k = 1;
        while k < end {
            let token = &line[k];
            if !token.is(b'{') {
                depth += opens(token);
                if depth == 0 && token.is(b',') {
                    (operand, begins) = (operand + 1, true);
                } else {
                    begins = false;
                }
                k += 1;
                continue;
            }
            let close = closing(line, k);
            let behind = line.get(close + 1).filter(|_| close + 1 < end);
            let whole = begins && operand < positions;
            if !whole || depth != 0 {
                self.found.fault(token.span.start, "an aggregate that is no position of this motion");
            } else if let Some(stray) = behind.filter(|next| !(next.is(b',') || self.source.is_word(next, &BLENDING))) {
                let text = quoted(self.source.bytes, stray.span.clone());
                self.found.fault(stray.span.start, format!("{text} behind a position is not understood"));
            } else {
                self.position(&line[k..=close]);
            }
            (k, begins) = (close + 1, false);
        }
        self.settings(&line[end..]);
    }

    /// An operand of a motion.
    fn position(&mut self, tokens: &[Token]) {
        let aggregate = Aggregate::new(self.source, tokens);
        let kind = match aggregate.prefix() {
            None => aggregate.by_fields(),
            Some(name) => match Type::of(&name).or((name == "FRAME").then_some(Type::FRAME)) {
                Some(kind) => kind,
                None => {
                    let message = format!("type {name} is not understood as a position");
                    self.found.fault(tokens[0].span.start, message);
                    return;
                }
            },
        };
        aggregate.take(kind, &mut self.found);
    }

    /// What stands behind WITH sets variables of the system: `$BASE = {...}`, `$VEL = {...}`.
    fn settings(&mut self, tokens: &[Token]) {
        let mut k = 0;
        while k < tokens.len() {
            if tokens[k].is(b'{') {
                let close = closing(tokens, k);
                let system = k > 1 && tokens[k - 1].is(b'=') && self.source.upper(&tokens[k - 2]).starts_with('$');
                if !system && Aggregate::new(self.source, &tokens[k..=close]).may_be_target() {
                    self.found.fault(tokens[k].span.start, "an aggregate that is no position of this motion");
                }
                k = close;
            }
            k += 1;
        }
    }

    /// Where a geometric operator stands.
    fn geometric(&self, line: &[Token]) -> Option<usize> {
        let label = line.len() == 2;
        let heading = line.iter().any(|token| self.source.is_word(token, &["DEF", "DEFFCT", "EXT", "EXTFCT", "EXTP", "EXTFCTP"]));
        let mut depth = 0;
        line.iter().filter(|_| !label && !heading).find_map(|token| {
            match token.sort {
                Sort::Sign(b'{') => depth += 1,
                Sort::Sign(b'}') => depth -= 1,
                _ => {}
            }
            (depth == 0 && token.is(b':')).then_some(token.span.start)
        })
    }

    /// A declaration, an assignment, or what is neither.
    fn other(&mut self, line: &[Token], head: &str) {
        let declares = declared(self.source, line).map(|(kind, _)| kind);
        let has_aggregate = line.iter().any(|token| token.is(b'{'));
        if let Some(at) = self.geometric(line) {
            match has_aggregate {
                _ if declares.as_deref() == Some("FRAME") || self.sets_frame(line) => {}
                true => self.found.fault(at, RELATIVE),
                false => self.found.warn(at, "left as it is: a pose that the program computes by the geometric operator `:`"),
            }
            return;
        }
        if !has_aggregate {
            return self.component(line, head);
        }
        let mut k = 0;
        while k < line.len() {
            if line[k].is(b'{') {
                let close = closing(line, k);
                self.value(&line[..k], &line[k..=close], declares.as_deref());
                k = close;
            }
            k += 1;
        }
    }

    /// Whether a line sets a variable that is known to be no target.
    fn sets_frame(&self, line: &[Token]) -> bool {
        let name = self.source.upper(&line[0]);
        name.starts_with('$') || FRAME_TABLES.contains(&name.as_str()) || self.stated(&name) == Some("FRAME")
    }

    /// The one type that a variable has in this file.
    fn stated(&self, name: &str) -> Option<&str> {
        match self.types.get(name).map(Vec::as_slice) {
            Some([one]) => Some(one),
            _ => None,
        }
    }

    /// An aggregate behind `before`, in a line that declares a type or none.
    fn value(&mut self, before: &[Token], tokens: &[Token], declares: Option<&str>) {
        let aggregate = Aggregate::new(self.source, tokens);
        let at = tokens[0].span.start;
        let (name, member) = variable(self.source, before).unwrap_or_default();
        let prefix = aggregate.prefix();
        if name.starts_with('$') {
            // Of its frames `system` has told.
            if aggregate.by_fields().is_of_axes() || prefix.as_deref().and_then(Type::of).is_some() {
                self.found.warn(at, format!("left as it is: `{name}` is a variable of the system"));
            }
            return;
        }
        if FRAME_TABLES.contains(&name.as_str()) {
            self.found.warn(at, assumed(if name == "TOOL_DATA" { "$TOOL" } else { "$BASE" }));
            return;
        }
        let by_name = declares.or_else(|| self.stated(&name)).filter(|_| member.is_none()).map(String::from);
        match prefix.or(by_name) {
            Some(kind) => match Type::of(&kind) {
                Some(kind) => aggregate.take(kind, &mut self.found),
                None => {
                    if kind == "FDAT" {
                        self.frame_data(tokens);
                    } else if kind != "FRAME" && aggregate.may_be_target() {
                        self.found.warn(at, format!("left as it is: {kind} is no type of targets that calib knows"));
                    }
                    self.nested(tokens);
                }
            },
            None if aggregate.may_be_target() => {
                let what = if name.is_empty() { "this aggregate".into() } else { format!("`{name}`") };
                self.found.fault(at, format!("the type of {what} is not stated in this file; write {}", aggregate.advice()));
            }
            None => self.nested(tokens),
        }
    }

    /// Aggregates inside one that is no target: a target by its prefix, a frame, or of a kind that is not told.
    fn nested(&mut self, tokens: &[Token]) {
        let mut k = 1;
        while k < tokens.len() {
            if tokens[k].is(b'{') {
                let close = closing(tokens, k);
                let inner = &tokens[k..=close];
                let aggregate = Aggregate::new(self.source, inner);
                match aggregate.prefix().as_deref().map(Type::of) {
                    Some(Some(kind)) => aggregate.take(kind, &mut self.found),
                    // The centre of mass and the inertia of a LOAD.
                    None if self.source.is_word(&tokens[k - 1], &["CM", "J"]) => {}
                    None if aggregate.is_frame() => {
                        self.found.warn(inner[0].span.start, "left as it is: taken for a FRAME inside a structure");
                    }
                    None if aggregate.may_be_target() => {
                        let message = format!("the type of this aggregate is not stated; write {}", aggregate.advice());
                        self.found.fault(inner[0].span.start, message);
                    }
                    _ => self.nested(inner),
                }
                k = close;
            }
            k += 1;
        }
    }

    /// The data of an inline form: which base its point is taught in.
    fn frame_data(&mut self, tokens: &[Token]) {
        let base = tokens.windows(2).find(|w| self.source.is_word(&w[0], &["BASE_NO"]));
        if base.and_then(|w| self.source.number(&w[1..])).is_some_and(|(number, _)| number != 0.0) {
            self.found.warn(tokens[0].span.start, assumed("$BASE"));
        }
        if tokens.windows(3).any(|w| self.source.is_word(&w[0], &["IPO_FRAME"]) && self.source.is_word(&w[2], &["TCP"])) {
            self.found.warn(tokens[0].span.start, assumed("$IPO_MODE"));
        }
    }

    /// `XP1.Z = 50`: one number of a target.
    fn component(&mut self, line: &[Token], head: &str) {
        let Some((Some(member), Some(_))) = member(self.source, &line[1..]) else { return };
        let of_target = ["X", "Y", "Z", "A", "B", "C", "A1", "A2", "A3", "A4", "A5", "A6"].contains(&member.as_str());
        if !of_target || head.starts_with('$') || self.sets_frame(line) {
            return;
        }
        let at = line[0].span.start;
        let types = self.types.get(head).map(Vec::as_slice).unwrap_or_default();
        if types.iter().any(|name| Type::of(name).is_some()) {
            self.found
                .partial(at, format!("sets {member} of the target `{head}` alone; a target is corrected whole or not at all"));
        } else if types.is_empty() {
            self.found.warn(at, format!("left as it is: sets {member} of `{head}`, whose type this file does not state"));
        }
    }
}

/// What calib takes for granted where a program sets a frame of the system.
fn assumed(name: &str) -> String {
    match name {
        "$TOOL" => "sets $TOOL: calib assumed that its frame is the tool of the robot file".into(),
        "$IPO_MODE" => "sets $IPO_MODE: calib assumed that the robot carries the tool (#BASE)".into(),
        name => format!("sets {name}: calib assumed that targets are in the robot's base, $BASE and $ROBROOT at zero"),
    }
}

/// The place of the brace that closes the one at `open`.
fn closing(line: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (k, token) in line.iter().enumerate().skip(open) {
        match token.sort {
            Sort::Sign(b'{') => depth += 1,
            Sort::Sign(b'}') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return k;
        }
    }
    line.len() - 1
}

/// Behind a name: the last member of `[1].FRAME.X`, and what follows `=`; the second is none where nothing is set.
fn member<'t>(source: Source, rest: &'t [Token]) -> Option<(Option<String>, Option<&'t [Token]>)> {
    let mut member = None;
    let mut k = 0;
    loop {
        match rest.get(k).map(|token| token.sort) {
            Some(Sort::Sign(b'[')) => k += rest[k..].iter().position(|token| token.is(b']'))? + 1,
            Some(Sort::Sign(b'.')) => {
                member = Some(source.upper(rest.get(k + 1)?));
                k += 2;
            }
            Some(Sort::Sign(b'=')) => return Some((member, Some(&rest[k + 1..]))),
            _ => return Some((member, None)),
        }
    }
}

/// The variable that is set where `before` ends in `NAME[1].MEMBER =`: its name, and whether a member of it.
fn variable(source: Source, before: &[Token]) -> Option<(String, Option<String>)> {
    let (last, mut rest) = before.split_last()?;
    if !last.is(b'=') {
        return None;
    }
    let mut of = None;
    loop {
        let (last, front) = rest.split_last()?;
        if last.is(b']') {
            let open = front.iter().rposition(|token| token.is(b'['))?;
            rest = &front[..open];
        } else if last.sort == Sort::Word {
            if front.last().is_some_and(|token| token.is(b'.')) {
                of = of.or_else(|| Some(source.upper(last)));
                rest = &front[..front.len() - 1];
            } else {
                return Some((source.upper(last), of));
            }
        } else {
            return None;
        }
    }
}

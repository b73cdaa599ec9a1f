//! Universal Robots' script: targets are the poses `p[x,y,z,rx,ry,rz]` (m, rotation vector) and the lists of six joints (rad) of motions, written
//! there or held by a variable as a literal.
//!
//! Whether a list of six numbers is a target follows from its use. What a program computes from literals (`pose_trans(frame, p[...])`) is
//! refused, and so is every literal that is handed to a function of the program's own; what it computes from elsewhere stays, with a word.

use super::literal::ToolInForce;
use super::token::{
    BRACKETS, Token, TokenKind, arguments, closing, lines, number, quoted, tokens, words,
};
use super::{DEPTH, Gathered, Grammar, Language, Literal, PostureStatement, TargetKind};
use crate::spatial::Pose;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

pub(super) const GRAMMAR: Grammar = Grammar {
    endings: &["script", "urscript"],
    comment: "#",
    heads: &[],
    begins: &["DEF ", "MOVEJ", "MOVEL"],
    read: |bytes, _| {
        let mut reader = Reader::of(bytes);
        reader.settle();
        reader.found
    },
    listed,
};

/// Motions, and how many of their arguments are targets.
const MOTIONS: [(&str, usize); 6] = [
    ("movej", 1),
    ("movel", 1),
    ("movep", 1),
    ("movec", 2),
    ("servoj", 1),
    ("servoc", 1),
];
/// Functions whose arguments are no targets, whatever their form.
const OTHERS: &str = "set_tcp set_payload set_payload_cog set_target_payload set_payload_mass set_gravity \
    force_mode speedj speedl stopj textmsg popup freedrive_mode set_tool_voltage sleep sync write_output_float_register \
    rtde_set_watchdog force_mode_set_damping zero_ftsensor";
const SET_LOAD: [&str; 3] = ["set_payload", "set_target_payload", "set_payload_mass"];
const INVERSE: &str = "get_inverse_kin";

/// A list of six numbers.
#[derive(Clone)]
struct SixNumbers {
    is_pose: bool,
    values: Vec<f64>,
    spans: Vec<Range<usize>>,
    /// Tokens that it has.
    tokens: usize,
}

#[derive(Default)]
struct Reader {
    found: Gathered,
    /// Literals that variables hold.
    held: Vec<(String, SixNumbers)>,
    moved_to: BTreeSet<String>,
    /// Near which joints a pose is reached, by the names of both.
    near: BTreeMap<String, String>,
    /// Where a name is handed on, and how.
    handed_on: BTreeMap<String, (usize, String)>,
    /// Tools and masses that are set, with the bytes.
    tools: Vec<(usize, Option<Pose>)>,
    loads: Vec<(usize, Option<f64>)>,
}

/// The joint positions that variables hold, whatever the program does with them.
fn listed(bytes: &[u8]) -> Gathered {
    let reader = Reader::of(bytes);
    let mut found = Gathered {
        literals: reader.found.literals,
        ..Gathered::default()
    };
    for (name, six) in reader.held {
        if six.is_pose {
            found.poses += 1;
            continue;
        }
        found.literals.push(six.literal(PostureStatement::Unstated));
        found.held_by(name, found.literals.len() - 1);
    }
    found
}

impl SixNumbers {
    /// The six numbers that begin at the first token; none where it is another thing.
    fn at(line: &[Token]) -> Option<Self> {
        let is_pose = line.first().is_some_and(|token| token.name() == "p");
        let open = usize::from(is_pose);
        line.get(open).filter(|token| token.is(b'['))?;
        let close = closing(line, open);
        let numbers: Option<Vec<_>> = arguments(&line[open + 1..close]).map(number).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == 6)?;
        let (values, spans) = numbers.into_iter().unzip();
        Some(Self {
            is_pose,
            values,
            spans,
            tokens: close + 1,
        })
    }
    /// The six numbers that all of the tokens are.
    fn whole(tokens: &[Token]) -> Option<Self> {
        Self::at(tokens).filter(|six| six.tokens == tokens.len())
    }
    fn literal(self, posture: PostureStatement) -> Literal {
        let kind = if self.is_pose {
            TargetKind::RotationVector
        } else {
            TargetKind::Radians
        };
        let posture = (posture, Vec::new());
        Literal::read(kind, (self.values, self.spans), Vec::new(), posture)
    }
    fn pose(&self) -> Option<Pose> {
        let [x, y, z, a, b, c] = self.values[..] else {
            return None;
        };
        let (turn, place) = (Vector3::new(a, b, c), Vector3::new(x, y, z));
        self.is_pose
            .then(|| Pose::from_rotation_vector(turn, place))
    }
}

/// Whether these are a word, which differs by case here.
fn is(token: &Token, word: &str) -> bool {
    token.sort == TokenKind::Word && token.text() == word.as_bytes()
}

/// Whether a list or a pose begins here.
fn is_list(tokens: &[Token]) -> bool {
    match tokens {
        [first, ..] if first.is(b'[') => true,
        [first, next, ..] => is(first, "p") && next.is(b'['),
        _ => false,
    }
}

/// Tokens behind `name =`, where they begin so.
fn behind<'t, 'p>(tokens: &'t [Token<'p>], word: &str) -> &'t [Token<'p>] {
    match tokens {
        [name, sign, tail @ ..] if is(name, word) && sign.is(b'=') => tail,
        _ => tokens,
    }
}

/// The one that a name has; none where it has several.
fn only<T>(mut all: impl Iterator<Item = T>) -> Option<T> {
    let one = all.next()?;
    all.next().is_none().then_some(one)
}

impl Reader {
    fn of(bytes: &[u8]) -> Self {
        let mut reader = Self::default();
        let all = tokens(bytes, Language::UrScript, &mut reader.found);
        for line in lines(&all) {
            if reader.brackets_match(line) {
                reader.line(line);
            }
        }
        reader
    }

    /// As those of the other languages, but that only the first fault of a line is reported.
    fn brackets_match(&mut self, line: &[Token]) -> bool {
        let mut open: Vec<(u8, u8, usize)> = Vec::new();
        let fault = line.iter().find_map(|token| {
            let begins = BRACKETS.iter().find(|(opens, _)| token.is(*opens));
            open.extend(begins.map(|(opens, closes)| (*opens, *closes, token.start)));
            let ends = BRACKETS.iter().find(|(_, closes)| token.is(*closes));
            if let Some((opens, closes)) = ends
                && open.pop().is_none_or(|(last, ..)| last != *opens)
            {
                let [opens, closes] = [*opens, *closes].map(char::from);
                return Some((token.start, format!("`{closes}` without `{opens}`")));
            }
            let deep = open.len() == DEPTH;
            deep.then(|| (token.start, "brackets are nested too deep".into()))
        });
        let unclosed = open.first().map(|(opens, _, at)| {
            let message = format!("`{}` is not closed on its line", char::from(*opens));
            (*at, message)
        });
        let fault = fault.or(unclosed);
        let sound = fault.is_none();
        self.found.faults.extend(fault);
        sound
    }

    fn line(&mut self, line: &[Token]) {
        let is_scope = |token: &&Token| is(token, "global") || is(token, "local");
        let skipped = line.iter().take_while(is_scope).count();
        let line = &line[skipped..];
        let [first, others @ ..] = line else { return };
        let assigns = others.iter().position(|token| token.is(b'='));
        let assigns = assigns.filter(|_| first.sort == TokenKind::Word);
        if assigns == Some(0) {
            let value = &others[1..];
            match SixNumbers::at(value) {
                Some(six) if six.tokens == value.len() => self.held.push((first.name(), six)),
                Some(_) => self.others(value, "an expression"),
                None => self.value(value),
            }
            return;
        }
        // `wp[2] = 0.3` changes a number of a target.
        if assigns.is_some_and(|at| others[0].is(b'[') && closing(others, 0) + 1 == at) {
            self.hand_on(&line[..1], "is changed in one number");
        }
        self.value(line);
    }

    /// Whatever is no assignment of a literal: calls, and literals and names in them.
    fn value(&mut self, tokens: &[Token]) {
        let mut k = 0;
        while k < tokens.len() {
            let next = tokens.get(k + 1);
            if tokens[k].sort == TokenKind::Word && next.is_some_and(|next| next.is(b'(')) {
                let close = closing(tokens, k + 1);
                self.call(&tokens[k], &tokens[k + 2..close]);
                k = close + 1;
                continue;
            }
            // A literal, or a list that may hold some.
            if !is_list(&tokens[k..]) {
                k += 1;
                continue;
            }
            let open = k + usize::from(!tokens[k].is(b'['));
            let close = closing(tokens, open);
            if SixNumbers::at(&tokens[k..]).is_some() {
                self.others(&tokens[k..=close], "an expression");
            } else if open > k {
                let message = "a pose that is not written in six numbers: `p[x,y,z,rx,ry,rz]`";
                self.found.fault(tokens[k].start, message);
            } else {
                self.value(&tokens[open + 1..close]);
            }
            k = close + 1;
        }
    }

    fn call(&mut self, function: &Token, inside: &[Token]) {
        let (name, at) = (function.name(), function.start);
        let all: Vec<&[Token]> = arguments(inside).collect();
        if let Some((_, count)) = MOTIONS.iter().find(|(motion, _)| *motion == name) {
            let place = format!("an argument of `{name}` that is no target");
            for (k, argument) in all.iter().enumerate() {
                match k < *count {
                    true => self.target(argument),
                    false => self.others(argument, &place),
                }
            }
            return;
        }
        let first = all.first().copied().unwrap_or_default();
        if name == "set_tcp" {
            let pose = self.known(first).and_then(|six| six.pose());
            self.tools.push((at, pose));
        } else if SET_LOAD.contains(&&*name) {
            self.loads.push((at, number(first).map(|(mass, _)| mass)));
        }
        if OTHERS.split(' ').any(|other| other == name) {
            return;
        }
        self.others(inside, &format!("a call of `{name}`"));
        self.hand_on(inside, &format!("is handed to `{name}`"));
    }

    /// A literal, or the one that a variable holds, as its last assignment before has it.
    fn known(&self, tokens: &[Token]) -> Option<SixNumbers> {
        match tokens {
            [word] if word.sort == TokenKind::Word => {
                let name = word.name();
                let held = self.held.iter().filter(|(held, _)| *held == name);
                only(held).map(|(_, six)| six.clone())
            }
            _ => SixNumbers::whole(tokens),
        }
    }

    /// Where a motion leads.
    fn target(&mut self, argument: &[Token]) {
        let Some(first) = argument.first() else {
            return;
        };
        let named = argument.get(1).is_some_and(|sign| sign.is(b'='));
        let argument = if named { &argument[2..] } else { argument };
        let at = first.start;
        if let Some(six) = SixNumbers::whole(argument) {
            let literal = six.literal(PostureStatement::Unstated);
            return self.found.literals.push(literal);
        }
        let text = quoted(argument);
        match argument {
            [word] if word.sort == TokenKind::Word => drop(self.moved_to.insert(word.name())),
            [word, open, inside @ .., _]
                if is(word, INVERSE)
                    && open.is(b'(')
                    && closing(argument, 1) + 1 == argument.len() =>
            {
                self.inverse(inside);
            }
            _ if is_list(argument) => self
                .found
                .fault(at, format!("{text} is no list of six numbers")),
            _ => {
                let is_held = |token: &Token| self.held.iter().any(|(name, _)| is(token, name));
                let writes = |k| SixNumbers::at(&argument[k..]).is_some();
                if argument.iter().any(is_held) || (0..argument.len()).any(writes) {
                    let message = format!(
                        "{text} computes a target from a literal; calib corrects targets that are written"
                    );
                    self.found.fault(at, message);
                } else {
                    let message = format!("left as it is: {text} computes the target");
                    self.found.warn(at, message);
                }
            }
        }
    }

    /// `get_inverse_kin(POSE, qnear=JOINTS)`: the pose is the target, the joints say near which posture.
    fn inverse(&mut self, inside: &[Token]) {
        let all: Vec<&[Token]> = arguments(inside).collect();
        let near = all.get(1).map(|near| behind(near, "qnear"));
        match all.first() {
            Some([pose]) if pose.sort == TokenKind::Word => {
                let name = pose.name();
                if let Some([joints]) = near {
                    self.near.insert(name.clone(), joints.name());
                }
                self.moved_to.insert(name);
            }
            Some(pose) => {
                let near = near.and_then(|near| self.known(near));
                let six = SixNumbers::whole(pose).filter(|six| six.is_pose);
                match six {
                    Some(six) => self
                        .found
                        .literals
                        .push(six.literal(near_to(near.as_ref()))),
                    None => self.target(pose),
                }
            }
            None => {}
        }
    }

    /// Literals of the form of a target where none is expected.
    fn others(&mut self, tokens: &[Token], place: &str) {
        let mut k = 0;
        while k < tokens.len() {
            let Some(six) = SixNumbers::at(&tokens[k..]) else {
                k += 1;
                continue;
            };
            let what = if six.is_pose {
                "a pose"
            } else {
                "a list of six numbers"
            };
            let message = format!(
                "{what} in {place}: calib cannot say whether it is a target; hold it in a variable of a motion"
            );
            self.found.fault(tokens[k].start, message);
            k += six.tokens;
        }
    }

    fn hand_on(&mut self, tokens: &[Token], how: &str) {
        for word in words(tokens) {
            let before = self.handed_on.entry(word.name());
            before.or_insert_with(|| (word.start, how.to_string()));
        }
    }

    /// Makes targets of what variables hold, by their use, and says with which tool and load all are reached.
    fn settle(&mut self) {
        let held = std::mem::take(&mut self.held);
        let joints = |pose: &String| {
            let joints = self.near.get(pose)?;
            let named = held
                .iter()
                .filter(|(name, six)| name == joints && !six.is_pose);
            only(named).map(|(_, six)| six)
        };
        let mut reported = BTreeSet::new();
        for (name, six) in &held {
            let handed = self.handed_on.get(name);
            let message = match (self.moved_to.contains(name), handed) {
                (true, Some((_, how))) => {
                    format!("the target `{name}` {how}: calib cannot say what becomes of it there")
                }
                (true, None) => {
                    let near = joints(name).filter(|_| six.is_pose);
                    let literal = six.clone().literal(near_to(near));
                    self.found.literals.push(literal);
                    continue;
                }
                (false, Some((_, how))) if six.is_pose => {
                    format!("the pose `{name}` {how}: calib cannot say whether it is a target")
                }
                _ => continue,
            };
            if let Some((at, _)) = handed.filter(|_| reported.insert(name)) {
                self.found.fault(*at, message);
            }
        }
        self.in_force();
    }

    fn in_force(&mut self) {
        let mut pairs = self.tools.windows(2);
        let is_one = pairs.all(|two| two[0].1.is_some() && two[0].1 == two[1].1);
        if let Some((_, tool)) = self.tools.first().filter(|_| is_one) {
            let tool = ToolInForce {
                name: "SET_TCP".into(),
                frame: *tool,
            };
            let literals = self.found.literals.iter_mut();
            literals.for_each(|literal| literal.tool_in_force = Some(tool.clone()));
            self.found.tools = vec![tool];
        } else if let Some((at, _)) = self.tools.first() {
            let message = "set_tcp sets several tools: calib assumed that all targets are reached with the robot file's";
            self.found.frame(*at, message);
        }
        let is_one = self.loads.windows(2).all(|two| two[0].1 == two[1].1);
        match self.loads.first() {
            Some((at, Some(mass))) if is_one => {
                let literals = self.found.literals.iter_mut();
                literals.for_each(|literal| literal.payload = Some(*mass));
                let message = format!("payload {mass} kg, as the program states");
                self.found.warn(*at, message);
            }
            Some((at, _)) => {
                let message = "no payload is stated: the program sets several, or computes it";
                self.found.warn(*at, message);
            }
            None => {}
        }
    }
}

/// Near joints, if they are stated.
fn near_to(joints: Option<&SixNumbers>) -> PostureStatement {
    let micro = |q: f64| (q * 1e6).round().clamp(-1e9, 1e9) as i32;
    joints.map_or(PostureStatement::Unstated, |joints| {
        PostureStatement::Near(std::array::from_fn(|joint| micro(joints.values[joint])))
    })
}

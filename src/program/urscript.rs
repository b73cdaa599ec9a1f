//! Universal Robots' script: targets are the poses `p[x,y,z,rx,ry,rz]` (m, rotation vector) and the lists of six joints (rad) of motions, written
//! there or held by a variable as a literal.
//!
//! Whether a list of six numbers is a target follows from its use. What a program computes from literals (`pose_trans(frame, p[...])`) is
//! refused, and so is every literal that is handed to a function of the program's own; what it computes from elsewhere stays, with a word.

use super::literal::ToolInForce;
use super::token::{ProgramText, Token, TokenKind, arguments, closing, lines, tokens};
use super::{DEPTH, Declared, Gathered, Language, Literal, PostureStatement, TargetKind, quoted};
use crate::spatial::Pose;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

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
const OTHERS: [&str; 20] = [
    "set_tcp",
    "set_payload",
    "set_payload_cog",
    "set_target_payload",
    "set_payload_mass",
    "set_gravity",
    "force_mode",
    "speedj",
    "speedl",
    "stopj",
    "textmsg",
    "popup",
    "freedrive_mode",
    "set_tool_voltage",
    "sleep",
    "sync",
    "write_output_float_register",
    "rtde_set_watchdog",
    "force_mode_set_damping",
    "zero_ftsensor",
];
const SET_LOAD: [&str; 3] = ["set_payload", "set_target_payload", "set_payload_mass"];
const INVERSE: &str = "get_inverse_kin";

/// A list of six numbers.
struct SixNumbers {
    is_pose: bool,
    values: Vec<f64>,
    spans: Vec<Range<usize>>,
    /// Tokens that it has.
    tokens: usize,
}

#[derive(Default)]
struct Uses {
    moved_to: BTreeSet<String>,
    /// Near which joints a pose is reached, by the names of both.
    near: BTreeMap<String, String>,
    handed_on: BTreeMap<String, (usize, String)>,
}

struct Reader<'p> {
    source: ProgramText<'p>,
    found: Gathered,
    /// Literals that variables hold.
    held: Vec<(String, SixNumbers)>,
    uses: Uses,
    /// Tools and masses that are set, with the bytes.
    tools: Vec<(usize, Option<Pose>)>,
    loads: Vec<(usize, Option<f64>)>,
}

pub(super) fn read(bytes: &[u8]) -> Gathered {
    let mut reader = Reader::of(bytes);
    reader.settle();
    reader.found
}

/// The joint positions that variables hold.
pub(super) fn listed(bytes: &[u8]) -> Declared {
    let mut reader = Reader::of(bytes);
    let (mut names, mut poses) = (Vec::new(), 0);
    for (name, six) in std::mem::take(&mut reader.held) {
        match six.is_pose {
            true => poses += 1,
            false => {
                names.push(name);
                reader
                    .found
                    .literals
                    .push(six.literal(PostureStatement::Unstated));
            }
        }
    }
    // Positions are listed, whatever the program does with them.
    let found = Gathered {
        literals: reader.found.literals,
        ..Gathered::default()
    };
    Declared {
        found,
        names,
        poses,
    }
}

impl SixNumbers {
    fn literal(self, posture: PostureStatement) -> Literal {
        let kind = if self.is_pose {
            TargetKind::RotationVector
        } else {
            TargetKind::Radians
        };
        Literal::read(
            kind,
            (self.values, self.spans),
            Vec::new(),
            (posture, Vec::new()),
        )
    }
    fn pose(&self) -> Option<Pose> {
        let [x, y, z, a, b, c] = self.values[..] else {
            return None;
        };
        self.is_pose
            .then(|| Pose::from_rotation_vector(Vector3::new(a, b, c), Vector3::new(x, y, z)))
    }
}

impl<'p> Reader<'p> {
    fn of(bytes: &'p [u8]) -> Self {
        let source = ProgramText {
            bytes,
            language: Language::UrScript,
        };
        let mut found = Gathered::default();
        let all = tokens(source, &mut found);
        let (uses, held, tools, loads) = (Uses::default(), Vec::new(), Vec::new(), Vec::new());
        let mut reader = Self {
            source,
            found,
            held,
            uses,
            tools,
            loads,
        };
        for line in lines(&all) {
            if reader.brackets_match(line) {
                reader.line(line);
            }
        }
        reader
    }

    /// Names differ by case here.
    fn name(&self, token: &Token) -> String {
        String::from_utf8_lossy(&self.source.bytes[token.span.clone()]).into_owned()
    }
    fn is(&self, token: &Token, word: &str) -> bool {
        token.sort == TokenKind::Word && &self.source.bytes[token.span.clone()] == word.as_bytes()
    }

    fn brackets_match(&mut self, line: &[Token]) -> bool {
        let mut open: Vec<(u8, usize)> = Vec::new();
        for token in line {
            match token.sort {
                TokenKind::Sign(sign @ (b'(' | b'[' | b'{')) => open.push((sign, token.span.start)),
                TokenKind::Sign(sign @ (b')' | b']' | b'}')) => {
                    let opens = match sign {
                        b')' => b'(',
                        b']' => b'[',
                        _ => b'{',
                    };
                    if open.pop().is_none_or(|(last, _)| last != opens) {
                        self.found.fault(
                            token.span.start,
                            format!("`{}` without `{}`", char::from(sign), char::from(opens)),
                        );
                        return false;
                    }
                }
                _ => {}
            }
            if open.len() == DEPTH {
                self.found
                    .fault(token.span.start, "brackets are nested too deep");
                return false;
            }
        }
        let Some((sign, at)) = open.first() else {
            return true;
        };
        self.found.fault(
            *at,
            format!("`{}` is not closed on its line", char::from(*sign)),
        );
        false
    }

    /// The six numbers that begin at the first token; none where it is another thing.
    fn six(&self, line: &[Token]) -> Option<SixNumbers> {
        let is_pose = line.first().is_some_and(|token| self.is(token, "p"));
        let open = usize::from(is_pose);
        line.get(open).filter(|token| token.is(b'['))?;
        let close = closing(line, open);
        let numbers: Option<Vec<_>> = arguments(&line[open + 1..close])
            .map(|item| self.source.number(item))
            .collect();
        let (values, spans): (Vec<f64>, Vec<_>) = numbers
            .filter(|numbers| numbers.len() == 6)?
            .into_iter()
            .unzip();
        Some(SixNumbers {
            is_pose,
            values,
            spans,
            tokens: close + 1,
        })
    }

    fn line(&mut self, line: &[Token]) {
        let skipped = line
            .iter()
            .take_while(|token| ["global", "local"].iter().any(|word| self.is(token, word)))
            .count();
        let line = &line[skipped..];
        let [first, others @ ..] = line else { return };
        let assigns = others.iter().position(|token| token.is(b'='));
        if let (TokenKind::Word, Some(0)) = (first.sort, assigns) {
            let (name, value) = (self.name(first), &others[1..]);
            match self.six(value) {
                Some(six) if six.tokens == value.len() => self.held.push((name, six)),
                Some(_) => self.others(value, "an expression"),
                None => self.value(value),
            }
            return;
        }
        // `wp[2] = 0.3` changes a number of a target.
        if let (TokenKind::Word, Some(at)) = (first.sort, assigns)
            && others[0].is(b'[')
            && closing(others, 0) + 1 == at
        {
            self.hand_on(&line[..1], "is changed in one number");
        }
        self.value(line);
    }

    /// Whatever is no assignment of a literal: calls, and literals and names in them.
    fn value(&mut self, tokens: &[Token]) {
        let mut k = 0;
        while k < tokens.len() {
            let is_call = tokens[k].sort == TokenKind::Word
                && tokens.get(k + 1).is_some_and(|next| next.is(b'('));
            if is_call {
                let close = closing(tokens, k + 1);
                self.call(&tokens[k], &tokens[k + 2..close]);
                k = close + 1;
                continue;
            }
            // A literal, or a list that may hold some.
            let opens = tokens[k].is(b'[')
                || self.is(&tokens[k], "p") && tokens.get(k + 1).is_some_and(|next| next.is(b'['));
            if opens {
                let open = k + usize::from(!tokens[k].is(b'['));
                let close = closing(tokens, open);
                if self.six(&tokens[k..]).is_some() {
                    self.others(&tokens[k..=close], "an expression");
                } else if open > k {
                    self.found.fault(
                        tokens[k].span.start,
                        "a pose that is not written in six numbers: `p[x,y,z,rx,ry,rz]`",
                    );
                } else {
                    self.value(&tokens[open + 1..close]);
                }
                k = close + 1;
                continue;
            }
            k += 1;
        }
    }

    fn call(&mut self, function: &Token, inside: &[Token]) {
        let (name, at) = (self.name(function), function.span.start);
        let all: Vec<&[Token]> = arguments(inside).collect();
        if let Some((_, count)) = MOTIONS.iter().find(|(motion, _)| *motion == name) {
            for (k, argument) in all.iter().enumerate() {
                match k < *count {
                    true => self.target(argument),
                    false => self.others(
                        argument,
                        &format!("an argument of `{name}` that is no target"),
                    ),
                }
            }
            return;
        }
        let first = all.first().copied().unwrap_or_default();
        if name == "set_tcp" {
            self.tools
                .push((at, self.known(first).and_then(|six| six.pose())));
        } else if SET_LOAD.contains(&&*name) {
            self.loads
                .push((at, self.source.number(first).map(|(mass, _)| mass)));
        }
        if OTHERS.contains(&&*name) {
            return;
        }
        self.others(inside, &format!("a call of `{name}`"));
        self.hand_on(inside, &format!("is handed to `{name}`"));
    }

    /// A literal, or the one that a variable holds, as its last assignment before has it.
    fn known(&self, tokens: &[Token]) -> Option<SixNumbers> {
        let six = match tokens {
            [word] if word.sort == TokenKind::Word => {
                let name = self.name(word);
                let mut found = self
                    .held
                    .iter()
                    .filter(|(held, _)| *held == name)
                    .map(|(_, six)| six);
                let (one, more) = (found.next()?, found.next());
                let (is_pose, values, spans) = (one.is_pose, one.values.clone(), one.spans.clone());
                more.is_none().then_some(SixNumbers {
                    is_pose,
                    values,
                    spans,
                    tokens: 1,
                })
            }
            _ => self.six(tokens),
        };
        six.filter(|six| six.tokens == tokens.len())
    }

    /// Where a motion leads.
    fn target(&mut self, argument: &[Token]) {
        let Some(first) = argument.first() else {
            return;
        };
        let named = argument.get(1).is_some_and(|sign| sign.is(b'='));
        let argument = if named { &argument[2..] } else { argument };
        let at = first.span.start;
        if let Some(six) = self
            .six(argument)
            .filter(|six| six.tokens == argument.len())
        {
            return self
                .found
                .literals
                .push(six.literal(PostureStatement::Unstated));
        }
        match argument {
            [word] if word.sort == TokenKind::Word => {
                self.uses.moved_to.insert(self.name(word));
            }
            [word, open, inside @ .., _]
                if self.is(word, INVERSE)
                    && open.is(b'(')
                    && closing(argument, 1) + 1 == argument.len() =>
            {
                self.inverse(inside);
            }
            [first, ..]
                if first.is(b'[')
                    || self.is(first, "p") && argument.get(1).is_some_and(|next| next.is(b'[')) =>
            {
                let text = quoted(self.source.bytes, self.source.over(argument, at));
                self.found
                    .fault(at, format!("{text} is no list of six numbers"));
            }
            _ => {
                let text = quoted(self.source.bytes, self.source.over(argument, at));
                let holds = argument
                    .iter()
                    .any(|token| self.held.iter().any(|(name, _)| self.is(token, name)));
                let writes = (0..argument.len()).any(|k| self.six(&argument[k..]).is_some());
                if holds || writes {
                    self.found
                        .fault(at, format!("{text} computes a target from a literal; calib corrects targets that are written"));
                } else {
                    self.found
                        .warn(at, format!("left as it is: {text} computes the target"));
                }
            }
        }
    }

    /// `get_inverse_kin(POSE, qnear=JOINTS)`: the pose is the target, the joints say near which posture.
    fn inverse(&mut self, inside: &[Token]) {
        let all: Vec<&[Token]> = arguments(inside).collect();
        let near = all.get(1).map(|near| near.strip_prefix_word(self, "qnear"));
        match all.first() {
            Some([pose]) if pose.sort == TokenKind::Word => {
                let name = self.name(pose);
                if let Some([joints]) = near {
                    self.uses.near.insert(name.clone(), self.name(joints));
                }
                self.uses.moved_to.insert(name);
            }
            Some(pose) => {
                let posture = near
                    .and_then(|near| self.known(near))
                    .map_or(PostureStatement::Unstated, |near| near_to(&near.values));
                match self
                    .six(pose)
                    .filter(|six| six.is_pose && six.tokens == pose.len())
                {
                    Some(six) => self.found.literals.push(six.literal(posture)),
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
            if let Some(six) = self.six(&tokens[k..]) {
                let what = if six.is_pose {
                    "a pose"
                } else {
                    "a list of six numbers"
                };
                let message = format!(
                    "{what} in {place}: calib cannot say whether it is a target; hold it in a variable of a motion"
                );
                self.found.fault(tokens[k].span.start, message);
                k += six.tokens;
            } else {
                k += 1;
            }
        }
    }

    fn hand_on(&mut self, tokens: &[Token], how: &str) {
        for word in tokens.iter().filter(|token| token.sort == TokenKind::Word) {
            self.uses
                .handed_on
                .entry(self.name(word))
                .or_insert_with(|| (word.span.start, how.to_string()));
        }
    }

    /// Makes targets of what variables hold, by their use, and says with which tool and load all are reached.
    fn settle(&mut self) {
        let near: BTreeMap<String, Vec<f64>> = (self.uses.near.iter())
            .filter_map(|(pose, joints)| {
                let mut found = self
                    .held
                    .iter()
                    .filter(|(name, six)| name == joints && !six.is_pose);
                Some((
                    pose.clone(),
                    found
                        .next()
                        .filter(|_| found.next().is_none())?
                        .1
                        .values
                        .clone(),
                ))
            })
            .collect();
        let mut reported = BTreeSet::new();
        for (name, six) in std::mem::take(&mut self.held) {
            let (is_target, handed) = (
                self.uses.moved_to.contains(&name),
                self.uses.handed_on.get(&name),
            );
            match (is_target, handed) {
                (true, Some((at, how))) if reported.insert(name.clone()) => {
                    self.found.fault(
                        *at,
                        format!(
                            "the target `{name}` {how}: calib cannot say what becomes of it there"
                        ),
                    );
                }
                (true, None) => {
                    let posture = near
                        .get(&name)
                        .filter(|_| six.is_pose)
                        .map_or(PostureStatement::Unstated, |q| near_to(q));
                    self.found.literals.push(six.literal(posture));
                }
                (false, Some((at, how))) if six.is_pose && reported.insert(name.clone()) => {
                    self.found.fault(
                        *at,
                        format!("the pose `{name}` {how}: calib cannot say whether it is a target"),
                    );
                }
                _ => {}
            }
        }
        self.in_force();
    }

    fn in_force(&mut self) {
        let is_one = |poses: &[(usize, Option<Pose>)]| {
            poses
                .windows(2)
                .all(|two| two[0].1.is_some() && two[0].1 == two[1].1)
        };
        if let Some((at, tool)) = self.tools.first() {
            if is_one(&self.tools) {
                let tool = ToolInForce {
                    name: "SET_TCP".into(),
                    frame: *tool,
                };
                self.found
                    .literals
                    .iter_mut()
                    .for_each(|literal| literal.tool_in_force = Some(tool.clone()));
                self.found.tools = vec![tool];
            } else {
                self.found
                    .frame(*at, "set_tcp sets several tools: calib assumed that all targets are reached with the robot file's");
            }
        }
        match (
            self.loads.first(),
            self.loads.windows(2).all(|two| two[0].1 == two[1].1),
        ) {
            (Some((at, Some(mass))), true) => {
                self.found
                    .literals
                    .iter_mut()
                    .for_each(|literal| literal.payload = Some(*mass));
                self.found
                    .warn(*at, format!("payload {mass} kg, as the program states"));
            }
            (Some((at, _)), _) => self.found.warn(
                *at,
                "no payload is stated: the program sets several, or computes it",
            ),
            (None, _) => {}
        }
    }
}

fn near_to(q: &[f64]) -> PostureStatement {
    PostureStatement::Near(std::array::from_fn(|joint| {
        (q[joint] * 1e6).round().clamp(-1e9, 1e9) as i32
    }))
}

/// Tokens behind `name =`, where they begin so.
trait NamedArgument {
    fn strip_prefix_word(&self, reader: &Reader, word: &str) -> Self;
}

impl NamedArgument for &[Token] {
    fn strip_prefix_word(&self, reader: &Reader, word: &str) -> Self {
        match self {
            [name, sign, tail @ ..] if reader.is(name, word) && sign.is(b'=') => tail,
            _ => self,
        }
    }
}

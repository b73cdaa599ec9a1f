//! Set-up errors in the words of an engineer, each with what mends it.

use crate::criteria::setup::{ARMS, FAR, NAMED, QUARTERLY, SMALL};
use crate::effect::{ParameterEstimate, figure};
use crate::error::counted;
use crate::observation::Dimension;
use crate::robot::{RobotModel, numbered};
use crate::setup::compare::{AsStated, ExplainedSetup};
use crate::setup::counting::{CountedJoint, LIMIT};
use crate::setup::mixture::TwoSetups;
use crate::setup::placement::{FreeNumber, median};
use crate::setup::wrong::{LENGTHS, RowOrder, WrongSetup};
use crate::types::{Diagnosis, ErrorLengths, Finding, Probabilities, Question, SETUP, VerdictKind};
use crate::unasked::unasked;

/// What is wrong, and what to change in which file.
pub(super) struct SetupWords {
    pub(crate) what: String,
    pub(crate) mend: String,
    /// By how much lengths of the robot file are longer when it is mended.
    pub(crate) scale: f64,
}

impl SetupWords {
    fn of(what: String, mend: String) -> Self {
        Self {
            what,
            mend,
            scale: 1.0,
        }
    }
}

/// The words of a set-up error; `values` are those of its own number, `reach` is that of the robot file's arm, m.
pub(super) fn words(
    wrong: WrongSetup,
    robot: &RobotModel,
    values: &[f64],
    reach: f64,
) -> SetupWords {
    let joints = robot.joints();
    let (what, mend) = match wrong {
        WrongSetup::PointUnit(unit) => return length_words(unit, reach),
        WrongSetup::InRadians => {
            ("the joints are in rad and were read in deg".into(), "in `ingest`: `columns: {q: {.., unit: rad}}`".into())
        }
        WrongSetup::InDegrees => {
            ("the joints are in deg and were read in rad".into(), "in `ingest`: `columns: {q: {.., unit: deg}}`".into())
        }
        WrongSetup::Signs(group) => sign_words(&group.joints().collect::<Vec<_>>(), joints),
        WrongSetup::Exchanged(a, b) => {
            let mut order: Vec<usize> = (0..joints).collect();
            order.swap(a, b);
            (
                format!("joints {} and {} are exchanged", a + 1, b + 1),
                order_of_columns(&order),
            )
        }
        WrongSetup::Columns(order) => (
            format!(
                "the columns of joints are not in the order of the robot's: one after another they hold joints {}",
                numbered(&order.joints(joints))
            ),
            order_of_columns(&order.columns(joints)),
        ),
        WrongSetup::Zero(joint, quarters) => return zero_words(&[(joint, quarters)], joints),
        WrongSetup::Zeros { joint, quarters, next } => {
            let what = format!(
                "the recording reads {} deg at the zero of joint {} and {} deg at that of joint {}",
                90 * quarters,
                joint + 1,
                90 * next,
                joint + 2
            );
            (what, zero_words(&[(joint, quarters), (joint + 1, next)], joints).mend)
        }
        WrongSetup::Counting(counting) => return counting_words(counting.joints().iter().take(joints)),
        WrongSetup::Coupled { moved, sign, .. } => {
            let mut counted = vec![CountedJoint::default(); joints];
            counted[moved].coupled = sign as i32;
            return counting_words(counted.iter());
        }
        WrongSetup::Mirrored => (
            "the points are a mirror image: an axis of the tracker's frame has the wrong sign, or two are exchanged".into(),
            "in `ingest`: exchange the columns of `x` and `y`; since the base is fitted, this corrects both cases".into(),
        ),
        WrongSetup::Order(order) => return order_words(order),
        WrongSetup::Number(number) => return number_words(number, values, joints),
    };
    SetupWords::of(what, mend)
}

/// The words of several set-up errors at once; joints that turn the other way have one list of signs.
pub(super) fn together(
    wrong: &[WrongSetup],
    robot: &RobotModel,
    words: impl Fn(WrongSetup) -> SetupWords,
) -> Vec<SetupWords> {
    let signs = |wrong: &WrongSetup| match wrong {
        WrongSetup::Signs(group) => group.joints().collect(),
        _ => Vec::new(),
    };
    let turned: Vec<usize> = wrong.iter().flat_map(signs).collect();
    let twice = |joint: &usize| turned.iter().filter(|other| *other == joint).count() > 1;
    let mut reversed: Vec<usize> = (0..robot.joints()).collect();
    reversed.retain(|joint| turned.contains(joint) && !twice(joint));
    let others = wrong.iter().filter(|wrong| signs(wrong).is_empty());
    let mut all: Vec<SetupWords> = others.map(|wrong| words(*wrong)).collect();
    if !reversed.is_empty() {
        let (what, mend) = sign_words(&reversed, robot.joints());
        all.push(SetupWords::of(what, mend));
    }
    all
}

/// The columns of the joints, each by its number, from 0, among those that are mapped now.
fn order_of_columns(columns: &[usize]) -> String {
    let order = columns.iter().map(|k| format!("<joint {}>", k + 1));
    let order = order.collect::<Vec<_>>().join(", ");
    format!(
        "in `ingest`, with the columns in the order in which they are mapped now: `columns: {{q: {{.., columns: [{order}]}}}}`"
    )
}

/// Joints, from 0, that turn the other way.
fn sign_words(reversed: &[usize], joints: usize) -> (String, String) {
    let signs: Vec<&str> = (0..joints)
        .map(|joint| if reversed.contains(&joint) { "-1" } else { "1" })
        .collect();
    let (noun, verb, axes) = match reversed.len() {
        1 => ("joint", "turns", "axis"),
        _ => ("joints", "turn", "axes"),
    };
    let (joints, signs) = (numbered(reversed), signs.join(", "));
    (
        format!("{noun} {joints} {verb} the other way than the robot file says"),
        format!(
            "in `ingest`: `columns: {{q: {{.., sign: [{signs}]}}}}`, or turn the {axes} round in the robot file"
        ),
    )
}

/// Zeros of joints in quarters of a turn.
fn zero_words(zeros: &[(usize, i32)], joints: usize) -> SetupWords {
    let mut counted = vec![CountedJoint::default(); joints];
    for (joint, quarters) in zeros {
        counted[*joint].quarters = *quarters;
    }
    counting_words(counted.iter())
}

/// Signs, zeros and couplings of all joints.
fn counting_words<'j>(joints: impl ExactSizeIterator<Item = &'j CountedJoint>) -> SetupWords {
    let count = joints.len();
    let all: Vec<(usize, &CountedJoint)> = (1..).zip(joints).collect();
    let list = |value: &dyn Fn(&CountedJoint) -> i32| {
        let each = all.iter().map(|(_, counted)| value(counted).to_string());
        each.collect::<Vec<_>>().join(", ")
    };
    let (mut what, mut mend, mut unit) = (Vec::new(), Vec::new(), "");
    let reversed = all.iter().filter(|(_, counted)| counted.reversed);
    let reversed: Vec<usize> = reversed.map(|(joint, _)| joint - 1).collect();
    if !reversed.is_empty() {
        what.push(sign_words(&reversed, count).0);
        let signs = list(&|counted| if counted.reversed { -1 } else { 1 });
        mend.push(format!("sign: [{signs}]"));
    }
    let turned = all.iter().filter(|(_, counted)| counted.quarters != 0);
    let turned: Vec<String> = turned
        .map(|(joint, counted)| {
            let degrees = 90 * counted.quarters;
            format!("the recording reads {degrees} deg at the zero of joint {joint}")
        })
        .collect();
    if !turned.is_empty() {
        unit = ", in deg";
        mend.push(format!(
            "zero: [{}]",
            list(&|counted| 90 * counted.quarters)
        ));
    }
    what.extend(turned);
    let mut coupled = Vec::new();
    for (joint, ratio) in all.iter().map(|(joint, counted)| (joint, counted.coupled)) {
        let (how, by) = (if ratio < 0 { "minus" } else { "plus" }, joint - 1);
        if ratio != 0 {
            what.push(format!("joint {joint} is reported {how} the angle of joint {by}, relative to the horizontal and not to the link before it"));
            coupled.push(format!("{{joint: {joint}, by: {by}, ratio: {ratio}}}"));
        }
    }
    if !coupled.is_empty() {
        mend.push(format!("coupled: [{}]", coupled.join(", ")));
    }
    SetupWords::of(
        what.join(", and "),
        format!(
            "in `ingest`: `columns: {{q: {{.., {}}}}}`{unit}",
            mend.join(", ")
        ),
    )
}

fn unit_name(unit: &str) -> &'static str {
    match unit {
        "mm" => "millimetres",
        "um" => "micrometres",
        "in" => "inches",
        "cm" => "centimetres",
        _ => "metres",
    }
}

fn length_words(unit: usize, reach: f64) -> SetupWords {
    let (factor, read, is) = LENGTHS[unit];
    if (ARMS[0]..=ARMS[1]).contains(&reach) {
        let what = format!(
            "the points are in {} and were read in {}",
            unit_name(is),
            unit_name(read)
        );
        let mend = if is == "cm" {
            "export the points in mm; cm cannot be read".into()
        } else {
            format!(
                "in `ingest`: `columns: {{x: {{.., unit: {is}}}, y: {{.., unit: {is}}}, z: {{.., unit: {is}}}}}`"
            )
        };
        return SetupWords::of(what, mend);
    }
    // As much too small as the points seem too large.
    let pair = LENGTHS
        .iter()
        .find(|other| (other.0 * factor - 1.0).abs() < 1e-9 && other.2 != "cm");
    let (read, is) = pair.map_or(("mm", "m"), |pair| (pair.1, pair.2));
    SetupWords {
        what: format!(
            "the lengths of the robot file are in {} and were read in {}",
            unit_name(is),
            unit_name(read)
        ),
        mend: format!("in the robot file: `units: {{length: {is}, ..}}`"),
        scale: 1.0 / factor,
    }
}

fn order_words(order: RowOrder) -> SetupWords {
    let (what, mend) = match order {
        RowOrder::Shifted(by) => {
            let how = if by < 0 { "ahead of" } else { "behind" };
            (
                format!(
                    "the points are {} {how} their joints",
                    counted(by.unsigned_abs(), "row")
                ),
                "in `ingest`: `join: {by: id}` or `join: {by: time}`, or remove the rows that only one file has",
            )
        }
        RowOrder::Reversed => (
            "the points stand in the reverse order of their joints".into(),
            "in `ingest`: `join: {by: id}` or `join: {by: time}`, or sort one of the files the other way",
        ),
        RowOrder::PointsByText { .. } => (
            "the points are sorted by name as text (1, 10, 11, 2), their joints are not".into(),
            "in `ingest`: `join: {by: id}`, or sort the points as they were measured",
        ),
        RowOrder::JointsByText { .. } => (
            "the joints are sorted by name as text (1, 10, 11, 2), their points are not".into(),
            "in `ingest`: `join: {by: id}`, or sort the joints in the order in which they were driven to",
        ),
    };
    SetupWords::of(what, mend.into())
}

fn number_words(number: FreeNumber, values: &[f64], joints: usize) -> SetupWords {
    let (what, mend) = match number {
        FreeNumber::Length(joint) => (
            format!(
                "a length in the robot file from joint {} to joint {} is wrong: all that follows it is displaced by {}",
                joint + 1,
                joint + 2,
                displacement(values)
            ),
            format!(
                "in the robot file: look for a typing error between joints {} and {}",
                joint + 1,
                joint + 2
            ),
        ),
        FreeNumber::Axis(joint) => (
            format!(
                "only the axis of joint {} is not where the robot file puts it: it is displaced by {}",
                joint + 1,
                displacement(values)
            ),
            format!(
                "in the robot file: look for a typing error in the point of joint {}'s axis",
                joint + 1
            ),
        ),
        FreeNumber::Zero(joint) => {
            let degrees = values.first().copied().unwrap_or_default().to_degrees();
            let quarters = (-degrees / 90.0).round() as i32;
            let remaining = -degrees - 90.0 * f64::from(quarters);
            if quarters != 0 && remaining.abs() < *QUARTERLY && joints <= LIMIT {
                let SetupWords { what, mend, .. } = zero_words(&[(joint, quarters)], joints);
                let what = format!("{what}, and is also {} deg off", figure(remaining, 2));
                return SetupWords::of(what, mend);
            }
            (
                format!(
                    "the zero of joint {} is off by {} deg, more than manufacture allows",
                    joint + 1,
                    figure(degrees, 2)
                ),
                format!(
                    "master joint {} again, or correct its zero in the robot file",
                    joint + 1
                ),
            )
        }
    };
    SetupWords::of(what, mend)
}

/// Base axes that matter, mm.
fn displacement(values: &[f64]) -> String {
    let largest = values.iter().map(|value| value.abs()).fold(0.0, f64::max);
    let axes = values
        .iter()
        .zip(["x", "y", "z"])
        .filter(|(value, _)| value.abs() > *SMALL * largest);
    let axes: Vec<String> = axes
        .map(|(value, axis)| format!("{axis} {:+.1} mm", value * 1e3))
        .collect();
    format!("{} (zero pose, base axes)", axes.join(", "))
}

/// A length in mm.
pub(super) fn mm(metres: f64) -> String {
    let mm = metres * 1e3;
    if mm < 99.5 {
        format!("{} mm", figure(mm, 1))
    } else {
        format!("{mm:.0} mm")
    }
}

/// A set-up error that explains the residual of the nominal robot.
pub(super) fn explained(
    question: &Question,
    stated: &AsStated,
    found: &ExplainedSetup,
) -> Diagnosis {
    let words_of = |wrong| words(wrong, question.robot, &found.placed.values, stated.reach);
    let all = together(&found.wrong, question.robot, words_of);
    let joined =
        |text: fn(&SetupWords) -> &str, by: &str| all.iter().map(text).collect::<Vec<_>>().join(by);
    let scale: f64 = all.iter().map(|words| words.scale).product();
    let (before, after) = (stated.placed.left, scale * found.placed.left);
    let mut text = format!(
        "{}; with this error the nominal robot is {} off the points (median, base and tool fitted), without it {}. Remedy: {}",
        joined(|words| &words.what, ", and "),
        mm(before),
        mm(after),
        joined(|words| &words.mend, "; ")
    );
    let alike = found.alike.iter().filter(|wrong| wrong.number().is_none());
    let mut alike: Vec<SetupWords> = alike.map(|wrong| words_of(*wrong)).collect();
    alike.dedup_by(|a, b| a.what == b.what);
    alike.retain(|other| all.iter().all(|words| words.what != other.what));
    if !alike.is_empty() {
        let each = alike
            .iter()
            .map(|words| format!("{}; remedy then: {}", words.what, words.mend));
        text.push_str(&format!(
            ". These data are explained equally well if {}",
            each.collect::<Vec<_>>().join(", or if ")
        ));
    }
    let number = |name: &str, value: f64| ParameterEstimate {
        name: name.into(),
        form: 0,
        value,
        unit: "mm",
        sigma: None,
    };
    let far = *FAR * median(&found.placed.off);
    let lengths = |off: &[f64], scale: f64| {
        let kept = off
            .iter()
            .zip(&found.placed.off)
            .filter(|(_, off)| **off <= far);
        let kept: Vec<f64> = kept.map(|(off, _)| scale * off).collect();
        ErrorLengths::of_lengths(&kept)
    };
    let name = *NAMED / (1.0 + found.alike.len() as f64);
    let finding = Finding {
        parameters: vec![
            number("median_before", before * 1e3),
            number("median_after", after * 1e3),
        ],
        probabilities: Probabilities::new(name, *NAMED, 1.0 - *NAMED),
        ..finding(text)
    };
    Diagnosis {
        before: lengths(&stated.placed.off, 1.0),
        after: lengths(&found.placed.off, scale),
        ..wrong(question, vec![finding])
    }
}

/// Rows of two set-ups.
pub(super) fn two_setups(question: &Question, found: &TwoSetups) -> Diagnosis {
    wrong(question, vec![finding(found.words())])
}

/// An identified model that leaves the robot file by more than manufacture allows, and no set-up error of the list that explains it.
pub(super) fn implausible(question: &Question, numbers: &[String]) -> Diagnosis {
    let text = format!(
        "the identified robot differs from the robot file by more than manufacture allows: {}. Check these for a typing error \
         or a wrong unit, and the joints for a wrong zero or sign",
        numbers.join(", ")
    );
    wrong(question, vec![finding(text)])
}

/// Nothing of the list explains the residual of the nominal robot.
pub(super) fn unexplained(question: &Question, stated: &AsStated) -> Diagnosis {
    let statement = format!(
        "the set-up is wrong: with base and tool fitted the nominal robot is {} off the points (median), {:.1} % of its reach, and \
         none of the usual errors explains it (units, signs, zeros, the order of columns, coupled joints, a mirrored frame, the order of rows, \
         one length). Check that the robot file is this arm's (lines marked REPLACE or CHECK, the DH convention), and that the \
         joints belong to these points",
        mm(stated.placed.left),
        100.0 * stated.share_of_reach()
    );
    Diagnosis {
        statement,
        ..wrong(question, Vec::new())
    }
}

fn finding(text: String) -> Finding {
    Finding::of_recording(SETUP, format!("{text}."), *NAMED)
}

/// The nominal robot with its base where the rows to fit have it.
fn wrong(question: &Question, findings: Vec<Finding>) -> Diagnosis {
    let rows = question.fit;
    let diagnosis = unasked(question, VerdictKind::WrongSetup, None);
    let off = diagnosis
        .model
        .error_sizes(question.data, Dimension::Length);
    Diagnosis {
        before: ErrorLengths::of(&off, rows),
        held_out: false,
        findings,
        not_observable: vec![
            "what the simulation lacks: it is tested once the set-up is right".into(),
        ],
        ..diagnosis
    }
}

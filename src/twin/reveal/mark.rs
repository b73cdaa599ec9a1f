//! One case: what was found of every concealed cause, and what was said that is not there.
//!
//! Stated 95 % intervals against true numbers: the twin's numbers in the words and units of a diagnosis.
//!
//! Only numbers that mean the same in both are compared; a curve of another form has no true slope.
//!
//! Whether a diagnosis looked in the right place, gave no wrong name, and named `unknown` where it knew no name.

use crate::reveal::paper::{
    Answer, Atoms, Cause, Finding, Name, Number, Rival, Truth, all_atoms, atoms,
};
use crate::reveal::reliability::{Statement, statements};
use crate::reveal::share::Share;
use calib_foundation::units::Unit;
use serde::Serialize;
use std::collections::BTreeSet;

/// From this visibility on an effect should be named.
pub(crate) const DUE: f64 = 50.0;

/// How a cause was named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Named, at its place, as the first choice; by a name and place that data cannot separate from it, too.
    Exact,
    /// Among the explanations that the data cannot separate, or by a name that is accepted for it.
    InSet,
    /// Not named, and something else was.
    Wrong,
    /// Not named, and nothing else was.
    Silent,
}

impl Outcome {
    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Exact => "exact",
            Outcome::InSet => "in_set",
            Outcome::Wrong => "wrong",
            Outcome::Silent => "silent",
        }
    }
}

/// A cause and how it was named.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    pub effect: String,
    pub place: String,
    pub form: String,
    /// Made by a formula that the library is not expected to hold.
    pub(crate) strange: bool,
    /// L, squared visible displacement over the variance of the noise.
    pub strength: f64,
    pub outcome: Outcome,
    /// Whether its place was found.
    pub placed: Placed,
    /// What was said instead, strongest first: `effect at place`.
    pub(crate) label: Option<String>,
    /// The stated probability of the true name, 0 where nothing was called so; none where no finding states any.
    pub(crate) probability: Option<f64>,
}

/// Held-out errors against what noise and the parameters' uncertainty leave, rms mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOut {
    pub before: f64,
    pub after: f64,
    /// `floor sqrt(1 + p / (n - p - 1))` with the true noise, p of geometry and of the findings, n coordinates to fit; with it what foreign
    /// effects do beyond what the points to fit show of them, which no model can know.
    pub bound: f64,
}

impl HeldOut {
    /// After over its bound.
    pub(crate) fn ratio(&self) -> f64 {
        self.after / self.bound
    }
    /// Share of the squared error above the bound that is gone; none where there was next to nothing to explain.
    pub(crate) fn explained(&self) -> Option<f64> {
        let above = |rms: f64| rms.powi(2) - self.bound.powi(2);
        (above(self.before) > 0.1 * self.bound.powi(2))
            .then(|| 1.0 - above(self.after).max(0.0) / above(self.before))
    }
}

/// A marked case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    pub name: String,
    /// What it conceals: null, single, pair or open.
    pub content: String,
    pub(crate) family: String,
    pub robot: String,
    pub points: usize,
    pub verdict: String,
    pub causes: Vec<Marked>,
    /// Faults of the recording, and whether each was named.
    pub tampered: Vec<(String, bool)>,
    /// Findings that are neither wanted nor accepted, strongest first.
    pub strays: Vec<String>,
    /// Where points were held out.
    pub held_out: Option<HeldOut>,
    /// Intervals of the numbers that were stated.
    pub(crate) intervals: Vec<Interval>,
    pub(crate) statements: Vec<Statement>,
}

impl Case {
    /// Every cause of at least this strength named exactly, and nothing said that is not there.
    pub(crate) fn right(&self, strength: f64) -> bool {
        let due = |cause: &&Marked| cause.strength >= strength;
        self.strays.is_empty()
            && self
                .causes
                .iter()
                .filter(due)
                .all(|cause| cause.outcome == Outcome::Exact)
    }
}

fn label_of(finding: &Finding) -> String {
    // The names come from a file and go to a terminal.
    format!("{} at {}", finding.effect, finding.place)
        .chars()
        .filter(|c| !c.is_control())
        .collect()
}

/// Everything that a finding may mean: itself and its rivals.
fn reach(finding: &Finding) -> Atoms {
    let rivals = finding.rivals.iter().flat_map(Rival::atoms);
    finding.atoms().into_iter().chain(rivals).collect()
}

/// Marks a diagnosis of a case.
pub fn mark(truth: &Truth, answer: &Answer) -> Case {
    let found: Atoms = answer.findings.iter().flat_map(Finding::atoms).collect();
    let reached: Atoms = answer.findings.iter().flat_map(reach).collect();
    let accepted = all_atoms(&truth.accepted);
    let mut known = accepted.clone();
    known.extend(truth.effects.iter().flat_map(Cause::atoms));
    // Both kinds of tampering count as known where one is: a swapped pair is two outliers, too.
    if !truth.tampered.is_empty() {
        let faults = POINT_FAULTS.iter();
        known.extend(faults.flat_map(|effect| atoms(effect, "recording")));
    }
    let tampered = truth.tampered.iter().map(Name::atoms);
    let causes = truth.effects.iter().map(Cause::atoms);
    let true_names: Vec<Atoms> = causes.chain(tampered).collect();
    let accepted_names: Vec<Atoms> = truth.accepted.iter().map(Name::atoms).collect();
    let stray = |finding: &&Finding| reach(finding).is_disjoint(&known);
    let strays: Vec<String> = answer.findings.iter().filter(stray).map(label_of).collect();
    let causes = truth
        .effects
        .iter()
        .filter(|cause| cause.wanted)
        .map(|cause| {
            let own = cause.atoms();
            let same = all_atoms(&cause.same);
            let outcome = if own.is_subset(&found) || !same.is_disjoint(&found) {
                Outcome::Exact
            } else if own.is_subset(&reached) || !accepted.is_disjoint(&found) {
                Outcome::InSet
            } else if strays.is_empty() {
                Outcome::Silent
            } else {
                Outcome::Wrong
            };
            Marked {
                effect: cause.effect.clone(),
                place: cause.place.clone(),
                form: cause.form.clone(),
                strange: cause.strange,
                strength: cause.strength,
                outcome,
                placed: placed(cause, truth, &answer.findings, &known, reach),
                label: (outcome == Outcome::Wrong)
                    .then(|| strays.first().cloned())
                    .flatten(),
                probability: probability_of(&own, &answer.findings),
            }
        });
    let named = |name: &str| answer.findings.iter().any(|finding| finding.effect == name);
    Case {
        name: truth.case.clone(),
        content: truth.content.clone(),
        family: truth.family.clone(),
        robot: truth.robot.clone(),
        points: truth.points.fit,
        verdict: answer.verdict.clone(),
        causes: causes.collect(),
        tampered: truth
            .tampered
            .iter()
            .map(|fault| (fault.effect.clone(), named(&fault.effect)))
            .collect(),
        held_out: held_out(truth, answer),
        intervals: truth
            .effects
            .iter()
            .flat_map(|cause| intervals(cause, &answer.findings))
            .collect(),
        statements: statements(&answer.findings, &true_names, &accepted_names),
        strays,
    }
}

/// The largest probability that a finding or a rival of this name was given.
fn probability_of(name: &Atoms, findings: &[Finding]) -> Option<f64> {
    let own = findings
        .iter()
        .map(|finding| (&finding.effect, &finding.place, finding.probability));
    let rivals = findings.iter().flat_map(|finding| &finding.rivals);
    let rivals = rivals.map(|rival| (&rival.effect, &rival.place, rival.probability));
    let stated: Vec<(bool, f64)> = own
        .chain(rivals)
        .filter_map(|(effect, place, p)| Some((atoms(effect, place) == *name, p?)))
        .collect();
    let of_it = stated
        .iter()
        .filter(|(same, _)| *same)
        .map(|(_, p)| *p)
        .fold(0.0, f64::max);
    (!stated.is_empty()).then_some(of_it)
}

fn held_out(truth: &Truth, answer: &Answer) -> Option<HeldOut> {
    let before = answer.before.as_ref()?.validate_rms_mm?;
    let after = answer.after.as_ref()?.validate_rms_mm?;
    let found: usize = answer
        .findings
        .iter()
        .map(|finding| finding.parameters.len())
        .sum();
    let (p, n) = (
        (truth.geometry_rank + found) as f64,
        3.0 * truth.points.fit as f64,
    );
    let noise = truth.noise.as_ref()?;
    let square = noise.validate_rms_per_axis_mm.powi(2) * (1.0 + p / (n - p - 1.0).max(1.0));
    let bound = (3.0 * (square + noise.unseen_rms_per_axis_mm.powi(2))).sqrt();
    Some(HeldOut {
        before,
        after,
        bound,
    })
}

/// Whether a stated 95 % interval holds the true number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Interval {
    pub(crate) effect: String,
    pub(crate) name: String,
    /// Whether it holds the truth.
    pub(crate) holds: bool,
}

/// Two-sided 95 % of a normal distribution.
const NINETY_FIVE: f64 = 1.959_964;

/// A true number as a diagnosis would state it.
struct Expected {
    name: String,
    value: f64,
    unit: &'static str,
    /// The sign is a convention: sizes are compared.
    unsigned: bool,
}

/// Intervals of what was found of a cause.
pub(super) fn intervals(cause: &Cause, findings: &[Finding]) -> Vec<Interval> {
    let same = findings
        .iter()
        .filter(|finding| finding.effect == cause.effect && finding.place == cause.place);
    let stated: Vec<&Number> = same.flat_map(|finding| &finding.parameters).collect();
    let judge = |truth: Expected| {
        let full = format!("{}.{}", cause.effect, truth.name);
        let number = stated
            .iter()
            .find(|number| number.name == truth.name || number.name == full)?;
        let sigma = number.sigma.filter(|sigma| *sigma > 0.0)?;
        let expected = convert(truth.value, truth.unit, &number.unit)?;
        let off = if truth.unsigned {
            number.value.abs() - expected.abs()
        } else {
            number.value - expected
        };
        Some(Interval {
            effect: cause.effect.clone(),
            name: truth.name,
            holds: off.abs() <= NINETY_FIVE * sigma,
        })
    };
    cause
        .parameters
        .iter()
        .filter_map(|number| expected(cause, number))
        .filter_map(judge)
        .collect()
}

/// The true number `effect.seat.what` in the words of a diagnosis; none where it has no counterpart.
fn expected(cause: &Cause, number: &Number) -> Option<Expected> {
    let rest = number.name.strip_prefix(&cause.effect)?.strip_prefix('.')?;
    let (seat, what) = rest.split_once('.').unwrap_or((rest, ""));
    let signed = |name: String, value: f64, unit: &'static str| {
        Some(Expected {
            name,
            value,
            unit,
            unsigned: false,
        })
    };
    let value = number.value;
    match (cause.effect.as_str(), what) {
        ("joint_compliance", "") => signed(seat.into(), value, "rad/Nm"),
        ("link_compliance", "middle") => signed(seat.into(), value, "rad/Nm"),
        ("base_compliance", "x") if cause.form == "isotropic" => {
            signed(seat.into(), value, "rad/Nm")
        }
        ("gear_cyclic" | "gear_motor_cyclic", ripple) => {
            let kind = ["sin", "cos"]
                .into_iter()
                .find(|kind| ripple.starts_with(kind))?;
            let order: f64 = ripple.strip_prefix(kind)?.parse().ok()?;
            signed(format!("{seat}.order{order}.{kind}"), value, "arcsec")
        }
        ("backlash", "gap")
            if ["by direction", "by sign of load"].contains(&cause.form.as_str()) =>
        {
            Some(Expected {
                name: format!("{seat}.half_gap"),
                value: 0.5 * value,
                unit: "arcsec",
                unsigned: true,
            })
        }
        ("zero_shift", "step") => signed(format!("{seat}.step"), value, "arcsec"),
        // A run of links grows as one.
        ("thermal_growth", "expansion") => {
            let run = cause.place.strip_prefix("link ")?.replace('-', "_");
            let first = run.split('_').next() == seat.strip_prefix('l');
            first.then(|| Expected {
                name: format!("l{run}.per_kelvin"),
                value: 1e-6 * value,
                unit: "1",
                unsigned: false,
            })
        }
        ("tool_shift", shift) => signed(
            format!("{seat}.{}", shift.strip_prefix("shift_")?),
            1e-3 * value,
            "mm",
        ),
        ("joint_log_lag", "share") => signed(format!("{seat}.share"), value, "1"),
        ("payload_error", "mass") if value != 0.0 => signed(format!("{seat}.mass"), value, "1"),
        ("link_mass", "mass") if value != 0.0 => signed(format!("{seat}.mass"), value, "1"),
        _ => None,
    }
}

/// A value in another unit; none where the units do not convert.
fn convert(value: f64, from: &str, to: &str) -> Option<f64> {
    if from == to {
        return Some(value);
    }
    let (from, to) = (Unit::parse(from)?, Unit::parse(to)?);
    (from.quantity() == to.quantity()).then(|| to.from_si(from.to_si(value)))
}

/// Faults of single points: they say nothing about where a cause sits.
pub(super) const POINT_FAULTS: [&str; 2] = ["outlier", "mislabelled_point"];
/// A name that is stated with this probability or more is given.
pub(crate) const GIVEN: f64 = 0.5;
/// What has a place and no name.
pub const NAMELESS: &str = "unknown";

/// What was named of a cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Placed {
    /// The strongest finding, but for faults of points and what sits at the other causes' places, is at its place or at an accepted one.
    pub place: bool,
    /// It has its name or an accepted one, or `unknown` stands at its place.
    pub name_or_unknown: bool,
    /// A name was given that is not there: by a finding that is neither wanted nor accepted nor has such a rival, or as the first choice
    /// at the right place.
    pub wrong_name: bool,
    /// The same with a probability of [`GIVEN`] or more.
    pub(crate) wrong_given: bool,
}

fn places(names: &Atoms) -> BTreeSet<&str> {
    names.iter().map(|(_, place)| place.as_str()).collect()
}

/// Judges what was named of `cause`; `known` are all names that are there or accepted, `reach` all that a finding may mean.
pub(super) fn placed(
    cause: &Cause,
    truth: &Truth,
    findings: &[Finding],
    known: &Atoms,
    reach: impl Fn(&Finding) -> Atoms,
) -> Placed {
    let own = cause.atoms();
    let accepted = all_atoms(&truth.accepted);
    let right: BTreeSet<&str> = places(&own).union(&places(&accepted)).copied().collect();
    let others: Atoms = truth.effects.iter().flat_map(Cause::atoms).collect();
    let elsewhere: BTreeSet<&str> = places(&others).difference(&right).copied().collect();

    let named: Vec<(&Finding, Atoms)> = findings
        .iter()
        .map(|finding| (finding, finding.atoms()))
        .collect();
    let physical = || {
        named
            .iter()
            .filter(|(finding, _)| !POINT_FAULTS.contains(&finding.effect.as_str()))
    };
    let there = |names: &Atoms| !places(names).is_disjoint(&right);
    let found: Atoms = named.iter().flat_map(|(_, names)| names.clone()).collect();
    let wrong = |finding: &Finding, names: &Atoms| {
        finding.effect != NAMELESS
            && names.is_disjoint(known)
            && (there(names) || reach(finding).is_disjoint(known))
    };
    Placed {
        place: physical()
            .find(|(_, names)| !places(names).is_subset(&elsewhere))
            .is_some_and(|(_, names)| there(names)),
        name_or_unknown: own.is_subset(&found)
            || !accepted.is_disjoint(&found)
            || named
                .iter()
                .any(|(finding, names)| finding.effect == NAMELESS && there(names)),
        wrong_name: named.iter().any(|(finding, names)| wrong(finding, names)),
        wrong_given: named.iter().any(|(finding, names)| {
            wrong(finding, names) && finding.probability.unwrap_or(1.0) >= GIVEN
        }),
    }
}

/// Shares of causes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(crate) struct Places {
    pub(crate) place: Share,
    /// Right names, or `unknown` at the right place.
    pub(crate) name_or_unknown: Share,
    pub(crate) wrong_name: Share,
    /// Wrong names with a probability of [`GIVEN`] or more.
    #[serde(rename = "wrong_name_0.5")]
    pub(crate) wrong_given: Share,
}

impl Places {
    /// Each with a title.
    pub(super) fn titled(&self) -> [(&'static str, Share); 4] {
        [
            ("place right", self.place),
            (
                "name right, or unknown at the right place",
                self.name_or_unknown,
            ),
            ("a wrong name at all", self.wrong_name),
            ("a wrong name with 0.5 or more", self.wrong_given),
        ]
    }
    pub(super) fn of(causes: impl Iterator<Item = Placed>) -> Places {
        let all: Vec<Placed> = causes.collect();
        let share = |holds: fn(&Placed) -> bool| Share::of(all.iter().map(holds));
        Places {
            place: share(|one| one.place),
            name_or_unknown: share(|one| one.name_or_unknown),
            wrong_name: share(|one| one.wrong_name),
            wrong_given: share(|one| one.wrong_given),
        }
    }
}

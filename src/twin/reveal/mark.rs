//! One case: what was found of every concealed cause, and what was said that is not there.
//!
//! Whether a diagnosis looked in the right place, gave no wrong name, and named `unknown` where it knew no name; and what it named when
//! the causes of the recording were taken out of the list that it may name.

use super::paper::{Answer, Atoms, Cause, Finding, Name, Truth, all_atoms, atoms};
use super::stated::{Interval, Statement, intervals, statements};
use crate::lists::named;
use std::collections::BTreeSet;

/// From this visibility on an effect should be named.
pub(crate) const DUE: f64 = 50.0;

named! {
    /// How a cause was named.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    Outcome,
    /// All of them.
    OUTCOMES: 4 {
        /// Named, at its place, as the first choice; by a name and place that data cannot separate from it, too.
        Exact "exact",
        /// Among the explanations that the data cannot separate, or by a name that is accepted for it.
        InSet "in_set",
        /// Not named, and something else was.
        Wrong "wrong",
        /// Not named, and nothing else was.
        Silent "silent",
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
        let is_missed =
            |cause: &Marked| cause.strength >= strength && cause.outcome != Outcome::Exact;
        self.strays.is_empty() && !self.causes.iter().any(is_missed)
    }
}

fn label_of(finding: &Finding) -> String {
    // The names come from a file and go to a terminal.
    let label = format!("{} at {}", finding.effect, finding.place);
    label.chars().filter(|c| !c.is_control()).collect()
}

/// Everything that a finding may mean.
fn reach(finding: &Finding) -> Atoms {
    finding.names().flat_map(|(_, names)| names).collect()
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
    let wanted = truth.effects.iter().filter(|cause| cause.wanted);
    let causes = wanted.map(|cause| {
        let name = cause.atoms();
        let same = all_atoms(&cause.same);
        let outcome = if name.is_subset(&found) || !same.is_disjoint(&found) {
            Outcome::Exact
        } else if name.is_subset(&reached) || !accepted.is_disjoint(&found) {
            Outcome::InSet
        } else if strays.is_empty() {
            Outcome::Silent
        } else {
            Outcome::Wrong
        };
        let stray = strays.first().filter(|_| outcome == Outcome::Wrong);
        Marked {
            effect: cause.effect.clone(),
            place: cause.place.clone(),
            form: cause.form.clone(),
            strange: cause.strange,
            strength: cause.strength,
            outcome,
            placed: placed(cause, truth, &answer.findings, &known),
            label: stray.cloned(),
            probability: probability_of(&name, &answer.findings),
        }
    });
    let faults = truth.tampered.iter().map(|fault| &fault.effect);
    let stated = |cause| intervals(cause, &answer.findings);
    let named = |name: &str| answer.findings.iter().any(|finding| finding.effect == name);
    Case {
        name: truth.case.clone(),
        content: truth.content.clone(),
        robot: truth.robot.clone(),
        points: truth.points.fit,
        verdict: answer.verdict.clone(),
        causes: causes.collect(),
        tampered: faults.map(|fault| (fault.clone(), named(fault))).collect(),
        held_out: held_out(truth, answer),
        intervals: truth.effects.iter().flat_map(stated).collect(),
        statements: statements(&answer.findings, &true_names, &accepted_names),
        strays,
    }
}

/// The largest probability that a finding or a rival of this name was given.
fn probability_of(name: &Atoms, findings: &[Finding]) -> Option<f64> {
    let stated = findings.iter().flat_map(Finding::names);
    let stated = stated.filter_map(|(probability, stated)| Some((stated == *name, probability?)));
    let of_it = stated.map(|(same, probability)| if same { probability } else { 0.0 });
    of_it.reduce(f64::max)
}

fn held_out(truth: &Truth, answer: &Answer) -> Option<HeldOut> {
    let before = answer.before.as_ref()?.validate_rms_mm?;
    let after = answer.after.as_ref()?.validate_rms_mm?;
    let numbers = answer.findings.iter().map(|one| one.parameters.len());
    let p = (truth.geometry_rank + numbers.sum::<usize>()) as f64;
    let n = 3.0 * truth.points.fit as f64;
    let noise = truth.noise.as_ref()?;
    let square = noise.validate_rms_per_axis_mm.powi(2) * (1.0 + p / (n - p - 1.0).max(1.0));
    let bound = (3.0 * (square + noise.unseen_rms_per_axis_mm.powi(2))).sqrt();
    Some(HeldOut {
        before,
        after,
        bound,
    })
}

/// Faults of single points: they say nothing about where a cause sits.
const POINT_FAULTS: [&str; 2] = ["outlier", "mislabelled_point"];
/// A name that is stated with this probability or more is given.
pub(super) const GIVEN: f64 = 0.5;
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

/// Judges what was named of `cause`; `known` are all names that are there or accepted.
fn placed(cause: &Cause, truth: &Truth, findings: &[Finding], known: &Atoms) -> Placed {
    let accepts = cause.atoms();
    let accepted = all_atoms(&truth.accepted);
    let right = &places(&accepts) | &places(&accepted);
    let others: Atoms = truth.effects.iter().flat_map(Cause::atoms).collect();
    let elsewhere = &places(&others) - &right;
    let all = findings.iter().map(|finding| (finding, finding.atoms()));
    let named: Vec<(&Finding, Atoms)> = all.collect();
    let is_physical = |finding: &Finding| !POINT_FAULTS.contains(&finding.effect.as_str());
    let there = |names: &Atoms| !places(names).is_disjoint(&right);
    let found: Atoms = named.iter().flat_map(|(_, names)| names.clone()).collect();
    let wrong = |finding: &Finding, names: &Atoms| {
        finding.effect != NAMELESS
            && names.is_disjoint(known)
            && (there(names) || reach(finding).is_disjoint(known))
    };
    let any = |is: &dyn Fn(&Finding, &Atoms) -> bool| {
        let mut named = named.iter();
        named.any(|(finding, names)| is(finding, names))
    };
    let mut strongest = named.iter();
    let strongest = strongest
        .find(|(finding, names)| is_physical(finding) && !places(names).is_subset(&elsewhere));
    Placed {
        place: strongest.is_some_and(|(_, names)| there(names)),
        name_or_unknown: accepts.is_subset(&found)
            || !accepted.is_disjoint(&found)
            || any(&|finding, names| finding.effect == NAMELESS && there(names)),
        wrong_name: any(&wrong),
        wrong_given: any(&|finding, names| {
            wrong(finding, names) && finding.probability.unwrap_or(1.0) >= GIVEN
        }),
    }
}

/// A held-out error that exceeds the whole list's by this factor tells that something is missing.
const TELLS: f64 = 1.1;

/// A recording that was diagnosed without its causes.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    pub(crate) name: String,
    /// What was taken out of the list.
    pub effect: String,
    /// L of it.
    pub(crate) strength: f64,
    /// Whether the data can tell: the held-out error is above [`TELLS`] times that of a diagnosis with the whole list.
    pub(crate) tells: bool,
    /// The wrong name with the highest probability, `effect at place`.
    pub(crate) wrong: Option<(String, f64)>,
    pub(crate) verdict: String,
    /// A finding has the name that was taken out.
    pub(crate) came_back: bool,
    pub(crate) statements: Vec<Statement>,
}

/// Marks a diagnosis `without` the causes of the recording against one with the `whole` list; none where no single cause of the list was
/// concealed, or where no points were held out.
pub fn left_out(truth: &Truth, whole: &Answer, without: &Answer) -> Option<LeftOut> {
    let cause = truth.effects.iter().find(|cause| cause.wanted)?;
    let held_out = |answer: &Answer| answer.after.as_ref()?.validate_rms_mm;
    // The place is right by `unknown`, a name that data cannot separate from what is out of the list is no wrong one.
    let same = || truth.accepted.iter().chain(&cause.same);
    let accepted = same().filter(|name| name.effect != cause.effect);
    let mut known: Atoms = accepted.flat_map(Name::atoms).collect();
    let places = same().map(|name| &name.place).chain([&cause.place]);
    known.extend(places.flat_map(|place| atoms(NAMELESS, place)));
    known.extend(all_atoms(&truth.tampered));
    // What else is concealed is no wrong name, wanted or not.
    let is_other = |other: &&Cause| other.effect != cause.effect;
    let others = truth.effects.iter().filter(is_other);
    known.extend(others.flat_map(Cause::atoms));
    let right = known.iter().map(|name| Atoms::from([name.clone()]));
    let right: Vec<Atoms> = right.collect();
    let is_wrong =
        |finding: &&Finding| finding.effect != NAMELESS && finding.atoms().is_disjoint(&known);
    let wrong = without.findings.iter().filter(is_wrong);
    let wrong = wrong.map(|finding| (label_of(finding), finding.probability.unwrap_or(1.0)));
    let mut names = without.findings.iter().map(|finding| &finding.effect);
    Some(LeftOut {
        name: truth.case.clone(),
        effect: cause.effect.clone(),
        strength: cause.strength,
        tells: held_out(without)? > TELLS * held_out(whole)?,
        wrong: wrong.max_by(|a, b| a.1.total_cmp(&b.1)),
        verdict: without.verdict.clone(),
        came_back: names.any(|name| *name == cause.effect),
        statements: statements(&without.findings, &right, &right),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn answer(verdict: &str, rms: f64, name: [&str; 2], probability: f64) -> Answer {
        let finding = json!({ "effect": name[0], "where": name[1], "probability": probability });
        let document = json!({ "verdict": verdict, "after": { "validate_rms_mm": rms }, "findings": [finding] });
        serde_json::from_value(document).expect("an answer")
    }

    fn truth(accepted: &Value, effects: &[[&str; 2]]) -> Truth {
        let cause = |[effect, place]: &[&str; 2]| json!({ "effect": effect, "where": place, "form": "plain", "L": 80.0, "parameters": [] });
        let effects: Vec<Value> = effects.iter().map(cause).collect();
        let points = json!({ "fit": 50, "validate": 20 });
        let truth = json!({ "case": "c", "content": "single", "family": "f", "robot": "r", "tampered": [], "points": points,
            "accepted": accepted, "effects": effects });
        serde_json::from_value(truth).expect("a truth")
    }

    #[test]
    fn a_recording_without_its_cause_is_wrong_by_another_name_and_right_by_unknown_at_its_place() {
        let hardening = json!([{ "effect": "joint_hardening", "where": "joint 2" }]);
        let backlash = truth(&hardening, &[["backlash", "joint 2"]]);
        let whole = answer("explained", 0.1, ["backlash", "joint 2"], 0.9);
        let judge = |verdict, rms, name, probability| {
            let without = answer(verdict, rms, name, probability);
            left_out(&backlash, &whole, &without).expect("a mark")
        };
        let spring = ["joint_compliance", "joint 2"];
        let both = truth(&json!([]), &[["payload_error", "tool"], spring]);
        let mark = left_out(&both, &whole, &answer("unexplained", 0.3, spring, 0.9));
        let mark = mark.expect("a mark");
        assert!(
            mark.effect == "payload_error" && mark.wrong.is_none(),
            "what is there is no wrong name"
        );
        let unknown = judge("unexplained", 0.12, ["unknown", "joint 2"], 0.8);
        let right = unknown.statements.iter().all(|one| one.right);
        assert!(unknown.tells && unknown.wrong.is_none() && right);
        let accepted = judge("explained", 0.1, ["joint_hardening", "joint 2"], 0.95);
        assert!(!accepted.tells && accepted.wrong.is_none());
        let wrong = judge("explained", 0.3, ["zero_shift", "joint 2"], 0.6);
        assert_eq!(wrong.wrong, Some(("zero_shift at joint 2".into(), 0.6)));
        let back = judge("unexplained", 0.3, ["backlash", "joint 3"], 0.4);
        let board = crate::reveal::board::Board {
            left_out: vec![unknown, accepted, wrong, back],
            ..Default::default()
        };
        let worlds = &board.document()["left_out"]["worlds"];
        let figure = |world: usize, share: usize, what: &str| {
            worlds[world]["shares"][share]["share"][what].as_u64()
        };
        // A wrong name, a sure one, called explained, the name came back; where the data can tell, and where they cannot.
        let counts = [0, 1, 2, 3].map(|share| figure(0, share, "count"));
        assert_eq!(counts, [1, 0, 1, 1].map(Some));
        assert_eq!([figure(0, 0, "of"), figure(1, 0, "of")], [Some(3), Some(1)]);
    }
}

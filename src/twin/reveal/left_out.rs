//! Recordings whose own causes were taken out of the list that a diagnosis may name: what was said in their stead.

use super::mark::DUE;
use super::paper::{Answer, Atoms, Cause, Name, Truth, all_atoms, atoms};
use super::reliability::{Statement, statements};
use super::share::Share;
use crate::reveal::mark::{GIVEN, NAMELESS};
use std::collections::BTreeSet;

/// A held-out error that exceeds the whole list's by this factor tells that something is left out.
pub(crate) const TELLS: f64 = 1.1;
/// Verdicts by which nothing is left to be found.
const CONTENT: [&str; 2] = ["explained", "nothing_missing"];

/// A recording that was diagnosed without its causes.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    pub(crate) name: String,
    /// What was left out.
    pub effect: String,
    /// L of it.
    pub(crate) strength: f64,
    /// Whether the data can tell: the held-out error is above [`TELLS`] times that of a diagnosis with the whole list.
    pub(crate) tells: bool,
    /// The wrong name with the highest probability, `effect at place`.
    pub(crate) wrong: Option<(String, f64)>,
    pub(crate) verdict: String,
    /// A finding has the name that was left out.
    pub(crate) came_back: bool,
    pub(crate) statements: Vec<Statement>,
}

/// Marks a diagnosis `without` the causes of the recording beside one with the `whole` list; none where no single cause of the list was
/// concealed, or where no points were held out.
pub fn left_out(truth: &Truth, whole: &Answer, without: &Answer) -> Option<LeftOut> {
    let cause = truth.effects.iter().find(|cause| cause.wanted)?;
    let held_out = |answer: &Answer| answer.after.as_ref()?.validate_rms_mm;
    // The place is right by `unknown`, a name that data cannot separate from what was left out is no wrong one.
    let accepted = truth
        .accepted
        .iter()
        .chain(&cause.same)
        .filter(|name| name.effect != cause.effect);
    let mut known: Atoms = accepted.flat_map(Name::atoms).collect();
    let places = truth.accepted.iter().chain(&cause.same);
    let places = places.map(|name| name.place.as_str());
    let places = places.chain([cause.place.as_str()]);
    known.extend(places.flat_map(|place| atoms(NAMELESS, place)));
    known.extend(all_atoms(&truth.tampered));
    // What else is concealed is no wrong name, wanted or not.
    let others = truth.effects.iter();
    let others = others.filter(|other| other.effect != cause.effect);
    known.extend(others.flat_map(Cause::atoms));
    let right: Vec<Atoms> = known
        .iter()
        .map(|name| BTreeSet::from([name.clone()]))
        .collect();
    let said = without
        .findings
        .iter()
        .filter(|finding| finding.effect != NAMELESS);
    let wrong = said.filter(|finding| finding.atoms().is_disjoint(&known));
    let strongest = wrong.map(|finding| {
        let name = format!("{} at {}", finding.effect, finding.place);
        (
            name.chars().filter(|c| !c.is_control()).collect::<String>(),
            finding.probability.unwrap_or(1.0),
        )
    });
    Some(LeftOut {
        name: truth.case.clone(),
        effect: cause.effect.clone(),
        strength: cause.strength,
        tells: held_out(without)? > TELLS * held_out(whole)?,
        wrong: strongest.max_by(|a, b| a.1.total_cmp(&b.1)),
        verdict: without.verdict.clone(),
        came_back: without
            .findings
            .iter()
            .any(|finding| finding.effect == cause.effect),
        statements: statements(&without.findings, &right, &right),
    })
}

/// Shares over recordings of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct LeftOutShares {
    /// A wrong name with [`GIVEN`] or more.
    pub(crate) wrong: Share,
    /// A wrong name with 0.9 or more.
    pub(crate) sure: Share,
    /// Said to be explained, or that nothing is missing.
    pub(crate) content: Share,
    /// The name that was left out was given.
    pub(crate) came_back: Share,
}

impl LeftOutShares {
    /// Shares over recordings of L from [`DUE`] on in which the data can tell, or cannot.
    pub(crate) fn of(all: &[LeftOut], tells: bool) -> LeftOutShares {
        let own = || {
            all.iter()
                .filter(|one| one.strength >= DUE && one.tells == tells)
        };
        let stated = |one: &LeftOut, least: f64| {
            one.wrong
                .as_ref()
                .is_some_and(|(_, probability)| *probability >= least)
        };
        LeftOutShares {
            wrong: Share::of(own().map(|one| stated(one, GIVEN))),
            sure: Share::of(own().map(|one| stated(one, 0.9))),
            content: Share::of(own().map(|one| CONTENT.contains(&one.verdict.as_str()))),
            came_back: Share::of(own().map(|one| one.came_back)),
        }
    }

    /// Each with a title.
    pub(crate) fn titled(&self) -> [(String, Share); 4] {
        [
            (format!("a wrong name with {GIVEN} or more"), self.wrong),
            ("a wrong name with 0.9 or more".into(), self.sure),
            ("called explained, or nothing missing".into(), self.content),
            (
                "the name that was left out was given".into(),
                self.came_back,
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn answer(verdict: &str, rms: f64, findings: &Value) -> Answer {
        serde_json::from_value(json!({ "verdict": verdict, "after": { "validate_rms_mm": rms }, "findings": findings }))
            .expect("an answer")
    }

    #[test]
    fn a_recording_without_its_cause_is_wrong_by_another_name_and_right_by_unknown_at_its_place() {
        let truth: Truth = serde_json::from_value(json!({
            "case": "c", "content": "single", "family": "backlash", "robot": "r", "tampered": [], "points": { "fit": 50, "validate": 20 },
            "accepted": [{ "effect": "joint_hardening", "where": "joint 2" }],
            "effects": [{ "effect": "backlash", "where": "joint 2", "form": "plain", "L": 80.0, "parameters": [] }],
        }))
        .expect("a truth");
        let whole = answer(
            "explained",
            0.1,
            &json!([{ "effect": "backlash", "where": "joint 2", "probability": 0.9 }]),
        );
        let judge = |verdict, rms, findings: Value| {
            left_out(&truth, &whole, &answer(verdict, rms, &findings)).expect("a mark")
        };
        let beside: Truth = serde_json::from_value(json!({
            "case": "c", "content": "single", "family": "payload_error", "robot": "r", "tampered": [], "points": { "fit": 50, "validate": 20 },
            "accepted": [],
            "effects": [{ "effect": "payload_error", "where": "tool", "form": "mass", "L": 80.0, "parameters": [], "wanted": true },
                { "effect": "joint_compliance", "where": "joint 2", "form": "mass", "L": 900.0, "parameters": [], "wanted": true }],
        }))
        .expect("a truth");
        let true_name =
            json!([{ "effect": "joint_compliance", "where": "joint 2", "probability": 0.9 }]);
        let mark =
            left_out(&beside, &whole, &answer("unexplained", 0.3, &true_name)).expect("a mark");
        assert!(
            mark.effect == "payload_error" && mark.wrong.is_none(),
            "what is there is no wrong name"
        );
        let unknown = judge(
            "unexplained",
            0.12,
            json!([{ "effect": "unknown", "where": "joint 2", "probability": 0.8 }]),
        );
        assert!(
            unknown.tells
                && unknown.wrong.is_none()
                && unknown.statements.iter().all(|one| one.right)
        );
        let accepted = judge(
            "explained",
            0.1,
            json!([{ "effect": "joint_hardening", "where": "joint 2", "probability": 0.95 }]),
        );
        assert!(!accepted.tells && accepted.wrong.is_none());
        let wrong = judge(
            "explained",
            0.3,
            json!([{ "effect": "zero_shift", "where": "joint 2", "probability": 0.6 }]),
        );
        let back = judge(
            "unexplained",
            0.3,
            json!([{ "effect": "backlash", "where": "joint 3", "probability": 0.4 }]),
        );
        assert_eq!(wrong.wrong, Some(("zero_shift at joint 2".into(), 0.6)));
        let all = [unknown, accepted, wrong, back];
        let shares = LeftOutShares::of(&all, true);
        assert_eq!(
            [
                shares.wrong.count,
                shares.sure.count,
                shares.content.count,
                shares.came_back.count
            ],
            [1, 0, 1, 1]
        );
        assert_eq!(
            [shares.wrong.of, LeftOutShares::of(&all, false).wrong.of],
            [3, 1]
        );
    }
}

//! The scoreboard: outcomes by visibility, by family and by what was said instead, false alarms, held-out errors, intervals.

use super::left_out::LeftOut;
use super::mark::{Case, DUE, HeldOut, Marked, Outcome};
use super::reliability::{Reliability, Subject, reliability};
use super::share::Share;
use crate::reveal::mark::Places;
use serde::{Serialize, Serializer};
use serde_json::json;
use std::collections::BTreeMap;

/// Lower ends of the bins of visibility L.
pub(crate) const BINS: [f64; 5] = [0.0, 5.0, 15.0, 50.0, 200.0];
/// A held-out error that is no larger over its bound is as good as can be expected.
pub(crate) const NEAR_BOUND: f64 = 1.15;

/// Outcomes of causes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Counts {
    /// Named, at their places.
    pub(crate) exact: usize,
    /// Among the rivals.
    pub(crate) in_set: usize,
    /// Not named, and something else was.
    pub(crate) wrong: usize,
    /// Not named, and nothing else was.
    pub(crate) silent: usize,
}

impl Counts {
    fn of<'a>(causes: impl Iterator<Item = &'a Marked>) -> Counts {
        let mut out = Counts::default();
        for cause in causes {
            match cause.outcome {
                Outcome::Exact => out.exact += 1,
                Outcome::InSet => out.in_set += 1,
                Outcome::Wrong => out.wrong += 1,
                Outcome::Silent => out.silent += 1,
            }
        }
        out
    }
    /// All of them.
    pub(crate) fn all(&self) -> usize {
        self.exact + self.in_set + self.wrong + self.silent
    }
    /// Those that were named.
    pub(crate) fn exactly(&self) -> Share {
        Share {
            count: self.exact,
            of: self.all(),
        }
    }
}

impl Serialize for Counts {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        json!({ "n": self.all(), "exact": self.exact, "in_set": self.in_set, "wrong": self.wrong,
            "silent": self.silent, "exact_wilson_95": self.exactly().limits() })
        .serialize(to)
    }
}

/// All marked cases.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Board {
    pub cases: Vec<Case>,
    /// Cases without a verdict, or with one that cannot be read, and why.
    pub missing: Vec<(String, String)>,
    /// Recordings that were diagnosed without their causes, too.
    pub left_out: Vec<LeftOut>,
}

/// Forms of the twin whose formula the library does not have: it approximates them. Every other form, of what is in no list too, is one that
/// the library's laws can take.
const OWN_FORMS: [&str; 6] = [
    "eccentric wheel",
    "at the middle",
    "cantilever",
    "gas strut",
    "hung over two joints",
    "bent by two joints",
];

/// What a set of effects is counted over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Company {
    /// The only cause of its recording.
    Alone,
    /// One of several.
    Beside,
}

impl Board {
    fn causes(&self) -> impl Iterator<Item = (&Case, &Marked)> {
        self.cases
            .iter()
            .flat_map(|case| case.causes.iter().map(move |cause| (case, cause)))
    }

    /// Outcomes by bin of visibility.
    pub(crate) fn by_strength(&self, company: Company) -> Vec<Counts> {
        let upper = |bin: usize| BINS.get(bin + 1).copied().unwrap_or(f64::INFINITY);
        let alone = |case: &Case| (case.causes.len() == 1) == (company == Company::Alone);
        (0..BINS.len())
            .map(|bin| {
                let within = |cause: &Marked| (BINS[bin]..upper(bin)).contains(&cause.strength);
                Counts::of(
                    self.causes()
                        .filter(|(case, cause)| alone(case) && within(cause))
                        .map(|(_, cause)| cause),
                )
            })
            .collect()
    }

    /// Causes that should be named.
    fn due(&self) -> impl Iterator<Item = &Marked> {
        let causes = self.causes().map(|(_, cause)| cause);
        causes.filter(|cause| cause.strength >= DUE)
    }

    fn due_by_effect(&self) -> BTreeMap<&str, Vec<&Marked>> {
        let mut out: BTreeMap<&str, Vec<&Marked>> = BTreeMap::new();
        for cause in self.due() {
            out.entry(&cause.effect).or_default().push(cause);
        }
        out
    }

    /// Outcomes of due causes by effect.
    pub(crate) fn by_effect(&self) -> BTreeMap<&str, Counts> {
        let due = self.due_by_effect().into_iter();
        due.map(|(name, causes)| (name, Counts::of(causes.into_iter())))
            .collect()
    }

    /// Places and names of due causes: of all, and by effect.
    pub(crate) fn places(&self) -> (Places, BTreeMap<&str, Places>) {
        let by_effect = self.due_by_effect().into_iter().map(|(name, causes)| {
            let placed = causes.into_iter().map(|cause| cause.placed);
            (name, Places::of(placed))
        });
        let all = Places::of(self.due().map(|cause| cause.placed));
        (all, by_effect.collect())
    }

    /// Recordings with a due effect whose held-out error is near its bound.
    pub(crate) fn near_bound(&self) -> Share {
        let [due, _] = self.ratios();
        Share::of(due.iter().map(|ratio| *ratio <= NEAR_BOUND))
    }

    /// Due causes whose formula the library has, or has not: outcomes, and the mean probability that the true name was given.
    pub(crate) fn by_formula(&self, shared: bool) -> (Counts, Option<f64>) {
        let own: Vec<&Marked> = self
            .due()
            .filter(|cause| (cause.strange || OWN_FORMS.contains(&cause.form.as_str())) != shared)
            .collect();
        let stated: Vec<f64> = own.iter().filter_map(|cause| cause.probability).collect();
        let mean = (!stated.is_empty()).then(|| stated.iter().sum::<f64>() / stated.len() as f64);
        (Counts::of(own.into_iter()), mean)
    }

    /// Due causes: effect -> what it was called (`=`: rightly; `-`: nothing) -> how often.
    pub(crate) fn confusion(&self) -> BTreeMap<&str, BTreeMap<String, usize>> {
        let mut out: BTreeMap<&str, BTreeMap<String, usize>> = BTreeMap::new();
        for cause in self.due() {
            let called = match (cause.outcome, &cause.label) {
                (Outcome::Exact, _) => "=".to_string(),
                (Outcome::InSet, _) => "in the set".to_string(),
                (Outcome::Wrong, Some(label)) => match label.split_once(" at ") {
                    Some((name, _)) if name == cause.effect => format!("{name} elsewhere"),
                    Some((name, _)) => name.to_string(),
                    None => label.clone(),
                },
                (Outcome::Wrong | Outcome::Silent, _) => "-".to_string(),
            };
            *out.entry(&cause.effect)
                .or_default()
                .entry(called)
                .or_default() += 1;
        }
        out
    }

    /// Recordings without an effect in which one was declared.
    pub(crate) fn alarms(&self) -> Share {
        self.named_besides(true)
    }

    /// Recordings with effects in which something was named that is not there.
    pub(crate) fn strays(&self) -> Share {
        self.named_besides(false)
    }

    fn named_besides(&self, null: bool) -> Share {
        let cases = self.cases.iter();
        let cases = cases.filter(|case| case.causes.is_empty() == null);
        Share::of(cases.map(|case| !case.strays.is_empty()))
    }

    /// Recordings whose causes are all due: all named and nothing else; and the strongest named.
    pub(crate) fn whole(&self, content: &str) -> [Share; 2] {
        let due = |case: &&Case| {
            case.content == content && case.causes.iter().all(|cause| cause.strength >= DUE)
        };
        let strongest = |case: &Case| {
            let most = case
                .causes
                .iter()
                .max_by(|a, b| a.strength.total_cmp(&b.strength));
            most.is_none_or(|cause| cause.outcome == Outcome::Exact)
        };
        [
            Share::of(self.cases.iter().filter(due).map(|case| case.right(DUE))),
            Share::of(self.cases.iter().filter(due).map(strongest)),
        ]
    }

    /// Faults of the recording by kind: how many were named.
    pub(crate) fn tampered(&self) -> BTreeMap<&str, Share> {
        let faults = self.cases.iter().flat_map(|case| &case.tampered);
        Share::by_kind(faults.map(|(kind, named)| (kind.as_str(), *named)))
    }

    /// Held-out errors of recordings with a due effect.
    fn held_out_of_due(&self) -> impl Iterator<Item = HeldOut> {
        let due = self
            .cases
            .iter()
            .filter(|case| case.causes.iter().any(|cause| cause.strength >= DUE));
        due.filter_map(|case| case.held_out)
    }

    /// Held-out errors over their bounds, ascending, where an effect is due, and in recordings without one.
    pub(crate) fn ratios(&self) -> [Vec<f64>; 2] {
        let nulls = self
            .cases
            .iter()
            .filter(|case| case.causes.is_empty())
            .filter_map(|case| case.held_out);
        let sorted = |all: Vec<HeldOut>| {
            let mut out: Vec<f64> = all.iter().map(HeldOut::ratio).collect();
            out.sort_by(f64::total_cmp);
            out
        };
        [
            sorted(self.held_out_of_due().collect()),
            sorted(nulls.collect()),
        ]
    }

    /// Recordings with a due effect whose held-out error is larger with the findings than before.
    pub(crate) fn worse(&self) -> Share {
        Share::of(
            self.held_out_of_due()
                .map(|held_out| held_out.after > held_out.before),
        )
    }

    /// Recordings with a due effect whose held-out error is larger with the findings than before, and than its bound.
    pub(crate) fn worse_than_bound(&self) -> Share {
        Share::of(
            self.held_out_of_due()
                .map(|held_out| held_out.after > held_out.before.max(held_out.bound)),
        )
    }

    /// Explained shares of held-out errors where an effect is due, ascending.
    pub(crate) fn explained(&self) -> Vec<f64> {
        let mut out: Vec<f64> = self
            .held_out_of_due()
            .filter_map(|held_out| held_out.explained())
            .collect();
        out.sort_by(f64::total_cmp);
        out
    }

    /// Stated 95 % intervals that hold the true number, by effect; of recordings in which all due causes were named and nothing
    /// else: the numbers of a wrong model are not those of the truth.
    pub(crate) fn intervals(&self) -> BTreeMap<&str, Share> {
        let right = self.cases.iter().filter(|case| case.right(DUE));
        let all = right.flat_map(|case| &case.intervals);
        Share::by_kind(all.map(|interval| (interval.effect.as_str(), interval.holds)))
    }

    /// Stated probabilities against what was true.
    pub(crate) fn reliability(&self, subject: Subject) -> Reliability {
        reliability(self.cases.iter().flat_map(|case| &case.statements), subject)
    }

    /// Stated probabilities of recordings without their causes in which the data cannot tell that something is left out.
    pub(crate) fn untold_reliability(&self) -> Reliability {
        let untold = self
            .left_out
            .iter()
            .filter(|one| one.strength >= DUE && !one.tells);
        reliability(untold.flat_map(|one| &one.statements), Subject::Name)
    }

    /// Verdicts by content.
    pub(crate) fn verdicts(&self) -> BTreeMap<(&str, &str), usize> {
        let mut out = BTreeMap::new();
        for case in &self.cases {
            *out.entry((case.content.as_str(), case.verdict.as_str()))
                .or_default() += 1;
        }
        out
    }

    /// Recordings that were not right: a due cause missed, or something said that is not there.
    pub(crate) fn failures(&self) -> impl Iterator<Item = &Case> {
        self.cases.iter().filter(|case| !case.right(DUE))
    }
}

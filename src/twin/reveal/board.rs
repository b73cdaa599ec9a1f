//! The scoreboard: outcomes by visibility, by family and by what was said instead, false alarms, held-out errors, intervals.

use super::mark::{Case, DUE, GIVEN, HeldOut, LeftOut, Marked, OUTCOMES, Outcome};
use super::stated::{Share, Statement, Subject, mixed, reliability};
use calib_foundation::statistics::quantile;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Lower ends of the bins of visibility L.
const BINS: [f64; 5] = [0.0, 5.0, 15.0, 50.0, 200.0];
/// A held-out error that is no larger over its bound is as good as can be expected.
const NEAR_BOUND: f64 = 1.15;
/// Shares of recordings whose cause nobody listed.
const UNLISTED: [f64; 2] = [0.3, 0.5];
/// Verdicts by which nothing is missing.
const CONTENT: [&str; 2] = ["explained", "nothing_missing"];

/// Forms of the twin whose formula the library does not have: it approximates them. Every other form, of what is in no list too, is one that
/// the library's laws can take.
const TWINS_FORMS: [&str; 6] = [
    "eccentric wheel",
    "at the middle",
    "cantilever",
    "gas strut",
    "hung over two joints",
    "bent by two joints",
];

/// Whether the held-out error tells that a cause is out of the list.
const TELLS: [(&str, bool); 2] = [
    ("where the data can tell", true),
    ("where it cannot", false),
];

/// All marked cases.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Board {
    pub cases: Vec<Case>,
    /// Cases without a verdict, or with one that cannot be read, and why.
    pub missing: Vec<(String, String)>,
    /// Recordings that were diagnosed without their causes, too.
    pub left_out: Vec<LeftOut>,
}

/// Outcomes of causes.
fn outcomes<'a>(causes: impl IntoIterator<Item = &'a Marked>) -> Value {
    let all: Vec<Outcome> = causes.into_iter().map(|cause| cause.outcome).collect();
    let count = |outcome: &Outcome| all.iter().filter(|one| *one == outcome).count();
    let exact = Share::of(all.iter().map(|one| *one == Outcome::Exact));
    let mut out = json!({ "n": exact.total, "exact_wilson_95": exact.limits() });
    for outcome in &OUTCOMES {
        out[outcome.name()] = json!(count(outcome));
    }
    out
}

/// Whether places and names of causes are right.
fn places(causes: &[&Marked]) -> Value {
    let share = |holds: fn(&Marked) -> bool| Share::of(causes.iter().map(|cause| holds(cause)));
    json!({
        "place": share(|cause| cause.placed.place),
        "name_or_unknown": share(|cause| cause.placed.name_or_unknown),
        "wrong_name": share(|cause| cause.placed.wrong_name),
        "wrong_name_0.5": share(|cause| cause.placed.wrong_given),
    })
}

fn spread(mut all: Vec<f64>) -> Value {
    all.sort_by(f64::total_cmp);
    json!({ "n": all.len(), "median": quantile(&all, 0.5), "p90": quantile(&all, 0.9) })
}

impl Board {
    fn causes(&self) -> impl Iterator<Item = (&Case, &Marked)> {
        let cases = self.cases.iter();
        cases.flat_map(|case| case.causes.iter().map(move |cause| (case, cause)))
    }

    /// Causes that should be named.
    fn due(&self) -> Vec<&Marked> {
        let causes = self.causes().map(|(_, cause)| cause);
        causes.filter(|cause| cause.strength >= DUE).collect()
    }

    /// Outcomes by bin of visibility, of what is alone in its recording, or not.
    fn by_strength(&self, alone: bool) -> Vec<Value> {
        let bin = |(bin, from): (usize, &f64)| {
            let to = BINS.get(bin + 1);
            let title = to.map_or_else(|| format!("> {from}"), |to| format!("{from}-{to}"));
            let range = *from..to.copied().unwrap_or(f64::INFINITY);
            let within = self.causes().filter(|(case, cause)| {
                (case.causes.len() == 1) == alone && range.contains(&cause.strength)
            });
            json!({ "L": title, "outcomes": outcomes(within.map(|(_, cause)| cause)) })
        };
        BINS.iter().enumerate().map(bin).collect()
    }

    /// Due causes whose formula the library has, or has not: outcomes, and the mean probability that the true name was given.
    fn by_formula(&self, shared: bool) -> Value {
        let is_twins = |cause: &&Marked| cause.strange || TWINS_FORMS.contains(&&*cause.form);
        let mut causes = self.due();
        causes.retain(|cause| is_twins(cause) != shared);
        let stated = causes.iter().filter_map(|cause| cause.probability);
        let stated: Vec<f64> = stated.collect();
        let mean = (!stated.is_empty()).then(|| stated.iter().sum::<f64>() / stated.len() as f64);
        json!({ "shared": shared, "outcomes": outcomes(causes), "mean_probability": mean })
    }

    /// Due causes: effect -> what it was called (`=`: rightly; `-`: nothing) -> how often.
    fn confusion(&self) -> BTreeMap<&str, BTreeMap<String, usize>> {
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
            let calls = out.entry(&cause.effect).or_default();
            *calls.entry(called).or_default() += 1;
        }
        out
    }

    /// Recordings without an effect in which one was declared, or those with effects in which something was named that is not there.
    fn named_besides(&self, null: bool) -> Share {
        let cases = self.cases.iter();
        let cases = cases.filter(|case| case.causes.is_empty() == null);
        Share::of(cases.map(|case| !case.strays.is_empty()))
    }

    /// Shares of recordings, each with what it is of.
    fn shares(&self) -> Vec<Value> {
        // Recordings of two causes that are both due: all named and nothing else; and the strongest named.
        let is_due = |case: &&Case| {
            case.content == "pair" && case.causes.iter().all(|cause| cause.strength >= DUE)
        };
        let pairs = || self.cases.iter().filter(is_due);
        let strongest = |case: &Case| {
            let by_strength = |a: &&Marked, b: &&Marked| a.strength.total_cmp(&b.strength);
            let most = case.causes.iter().max_by(by_strength);
            most.is_none_or(|cause| cause.outcome == Outcome::Exact)
        };
        let both = format!("two effects of L {DUE} or more, both named and nothing else");
        let faults = self.cases.iter().flat_map(|case| &case.tampered);
        let faults = Share::by_kind(faults.map(|(kind, named)| (kind.as_str(), *named)));
        let alarms = "false alarms in recordings without an effect";
        let strays = "recordings with effects in which something was named that is not there";
        let shares = [
            (alarms, self.named_besides(true)),
            (strays, self.named_besides(false)),
            (&both, Share::of(pairs().map(|case| case.right(DUE)))),
            ("the stronger one named", Share::of(pairs().map(strongest))),
        ];
        let named = |what: &str, share: Share| json!({ "what": what, "share": share });
        let mut out: Vec<Value> = shares.map(|(what, share)| named(what, share)).into();
        out.extend(
            faults
                .into_iter()
                .map(|(kind, share)| named(&format!("{kind} named"), share)),
        );
        out
    }

    /// Held-out errors of recordings with a due effect, or of those without any.
    fn held_out(&self, due: bool) -> Vec<HeldOut> {
        let counts = |case: &&Case| match due {
            true => case.causes.iter().any(|cause| cause.strength >= DUE),
            false => case.causes.is_empty(),
        };
        let cases = self.cases.iter().filter(counts);
        cases.filter_map(|case| case.held_out).collect()
    }

    /// Stated 95 % intervals that hold the true number, by effect; of recordings in which all due causes were named and nothing
    /// else: the numbers of a wrong model are not those of the truth.
    fn intervals(&self) -> BTreeMap<&str, Share> {
        let right = self.cases.iter().filter(|case| case.right(DUE));
        let all = right.flat_map(|case| &case.intervals);
        Share::by_kind(all.map(|interval| (interval.effect.as_str(), interval.holds)))
    }

    /// Recordings without their due causes, in which the data can tell, or cannot.
    fn without(&self, tells: bool) -> impl Iterator<Item = &LeftOut> + Clone {
        let due = self.left_out.iter().filter(|one| one.strength >= DUE);
        due.filter(move |one| one.tells == tells)
    }

    /// What was named where the causes were taken out of the list.
    fn left_out(&self) -> Value {
        let worlds = TELLS.map(|(which, tells)| {
            let share = |what: &str, holds: &dyn Fn(&LeftOut) -> bool| {
                json!({ "what": what, "share": Share::of(self.without(tells).map(holds)) })
            };
            let wrong = |one: &LeftOut, least: f64| {
                let wrong = one.wrong.as_ref();
                wrong.is_some_and(|(_, probability)| *probability >= least)
            };
            let shares = [
                share("a wrong name with 0.5 or more", &|one| wrong(one, GIVEN)),
                share("a wrong name with 0.9 or more", &|one| wrong(one, 0.9)),
                share("called explained, or nothing missing", &|one| {
                    CONTENT.contains(&one.verdict.as_str())
                }),
                share("the name that was left out was given", &|one| one.came_back),
            ];
            json!({ "which": which, "shares": shares })
        });
        let due = || self.left_out.iter().filter(|one| one.strength >= DUE);
        let is_both = |case: &&Case| due().any(|one| one.name == case.name);
        let listed = all(self
            .cases
            .iter()
            .filter(is_both)
            .map(|case| &case.statements));
        let without = all(due().map(|one| &one.statements));
        let hidden = all(self.without(false).map(|one| &one.statements));
        let mixed =
            |unlisted| json!({ "unlisted": unlisted, "bins": mixed(&listed, &without, unlisted) });
        json!({
            "recordings": self.left_out.len(),
            "worlds": worlds,
            "reliability": reliability("names where the data cannot tell", &hidden, Subject::Name),
            "both_worlds": UNLISTED.map(mixed),
        })
    }

    /// Recordings that were not right: a due cause missed, or something named that is not there.
    fn failures(&self) -> Vec<String> {
        let wrong = self.cases.iter().filter(|case| !case.right(DUE));
        wrong.map(failure).collect()
    }

    /// The scoreboard as JSON.
    pub fn document(&self) -> Value {
        let due = self.due();
        let mut by_effect: BTreeMap<&str, Vec<&Marked>> = BTreeMap::new();
        (due.iter()).for_each(|cause| by_effect.entry(&cause.effect).or_default().push(cause));
        let of_effects = |figures: fn(&[&Marked]) -> Value| -> BTreeMap<&str, Value> {
            let effects = by_effect.iter();
            effects
                .map(|(name, causes)| (*name, figures(causes)))
                .collect()
        };
        let statements = all(self.cases.iter().map(|case| &case.statements));
        let by_formula = [true, false].map(|shared| self.by_formula(shared));
        let missing = self.missing.iter();
        let [held_out, null] = [true, false].map(|due| self.held_out(due));
        let ratios = |all: &[HeldOut]| spread(all.iter().map(HeldOut::ratio).collect());
        let share = |holds: fn(&HeldOut) -> bool| Share::of(held_out.iter().map(holds));
        json!({
            "recordings": self.cases.len(),
            "without_verdict": missing.map(|(case, why)| json!({ "case": case, "why": why })).collect::<Vec<_>>(),
            "alone": self.by_strength(true),
            "beside": self.by_strength(false),
            "by_effect": of_effects(|causes| outcomes(causes.iter().copied())),
            "by_formula": by_formula,
            "places": { "all": places(&due), "by_effect": of_effects(places) },
            "confusion": self.confusion(),
            "reliability": [reliability("names", &statements, Subject::Name), reliability("places", &statements, Subject::Place)],
            "shares": self.shares(),
            "intervals": self.intervals(),
            "held_out_over_bound": { "due": ratios(&held_out), "null": ratios(&null),
                "due_within_1.15": share(|one| one.ratio() <= NEAR_BOUND),
                "due_worse": share(|one| one.after > one.before),
                "due_worse_than_bound": share(|one| one.after > one.before.max(one.bound)) },
            "left_out": self.left_out(),
            "explained_share": spread(held_out.iter().filter_map(HeldOut::explained).collect()),
            "failures": self.failures(),
        })
    }

    /// What people read in addition to the document: held-out errors within 1.1 of their bounds, wrong names where the causes were taken
    /// out of the list, verdicts by content.
    pub fn details(&self) -> Value {
        let within = [true, false]
            .map(|due| Share::of(self.held_out(due).iter().map(|one| one.ratio() <= 1.1)));
        let called = |one: &LeftOut| {
            let (name, probability) = one.wrong.as_ref().filter(|(_, p)| *p >= GIVEN)?;
            let (case, effect) = (&one.name, &one.effect);
            let line = format!("{case}: {effect} is called {name} with {probability:.2}");
            Some(line)
        };
        let called = [true, false]
            .map(|tells| -> Vec<String> { self.without(tells).filter_map(called).collect() });
        let mut verdicts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for case in &self.cases {
            *verdicts.entry((&case.content, &case.verdict)).or_default() += 1;
        }
        let line = |((content, verdict), count)| format!("{content}: {verdict} {count}");
        let verdicts: Vec<String> = verdicts.into_iter().map(line).collect();
        json!({ "within": within, "called": called, "verdicts": verdicts })
    }
}

/// Statements of several.
fn all<'a>(several: impl Iterator<Item = &'a Vec<Statement>>) -> Vec<&'a Statement> {
    several.flatten().collect()
}

fn failure(case: &Case) -> String {
    let cause = |one: &Marked| {
        let (effect, place, form) = (&one.effect, &one.place, &one.form);
        let (strength, outcome) = (one.strength, one.outcome.name());
        format!("{effect} at {place} [{form}, L {strength:.0}: {outcome}]")
    };
    let or = |all: Vec<String>, nothing: &str| match all.is_empty() {
        true => nothing.to_string(),
        false => all.join(", "),
    };
    let wanted = or(case.causes.iter().map(cause).collect(), "nothing");
    let strays = or(case.strays.clone(), "nothing else");
    let (name, robot, points) = (&case.name, &case.robot, case.points);
    format!("  {name} ({robot}, {points} points): {wanted}; also named: {strays}")
}

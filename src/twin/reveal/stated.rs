//! Counts as shares with their uncertainty, and stated probabilities against what was true: how often what is stated with a probability is
//! right, and the mean squared error of it.

use super::paper::{Atoms, Cause, Finding, Number};
use calib_foundation::units::Unit;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// How many of how many, with Wilson's 95 % limits.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Share {
    pub(crate) count: usize,
    pub(crate) total: usize,
}

impl Share {
    /// Counts what holds.
    pub(crate) fn of(all: impl IntoIterator<Item = bool>) -> Share {
        let mut share = Share::default();
        all.into_iter().for_each(|holds| share.add(holds));
        share
    }
    fn add(&mut self, holds: bool) {
        self.count += usize::from(holds);
        self.total += 1;
    }
    /// What holds by kind.
    pub(super) fn by_kind<'a>(
        all: impl Iterator<Item = (&'a str, bool)>,
    ) -> BTreeMap<&'a str, Share> {
        let mut out: BTreeMap<&str, Share> = BTreeMap::new();
        all.for_each(|(kind, holds)| out.entry(kind).or_default().add(holds));
        out
    }
    /// E. B. Wilson, 1927.
    pub(crate) fn limits(&self) -> [f64; 2] {
        if self.total == 0 {
            return [0.0, 1.0];
        }
        let (n, z) = (self.total as f64, 1.959_964f64);
        let p = self.count as f64 / n;
        let middle = p + z * z / (2.0 * n);
        let wide = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [middle - wide, middle + wide].map(|limit| limit / (1.0 + z * z / n))
    }
}

impl Serialize for Share {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let limits = self.limits();
        json!({ "count": self.count, "of": self.total, "wilson_95": limits }).serialize(to)
    }
}

/// What a probability is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Subject {
    /// An effect at a place: of a finding or of a rival.
    Name,
    /// A finding's place.
    Place,
}

/// Something that was stated with a probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Statement {
    pub(crate) subject: Subject,
    pub(crate) probability: f64,
    /// Whether it held.
    pub(crate) right: bool,
}

/// What findings say with a probability, against the names that are `true_names`, and those that are `accepted` where a finding has none of
/// these.
pub(super) fn statements(
    findings: &[Finding],
    true_names: &[Atoms],
    accepted: &[Atoms],
) -> Vec<Statement> {
    let names = || true_names.iter().chain(accepted).flatten();
    let places: BTreeSet<&str> = names().map(|(_, place)| place.as_str()).collect();
    let mut out = Vec::new();
    let mut say = |subject, probability: Option<f64>, right| {
        out.extend(probability.map(|probability| Statement {
            subject,
            probability,
            right,
        }));
    };
    for finding in findings {
        let names: Vec<(Option<f64>, Atoms)> = finding.names().collect();
        let there = (names[0].1.iter()).any(|(_, place)| places.contains(place.as_str()));
        say(Subject::Place, finding.place_probability, there);
        let is_known = names.iter().any(|(_, name)| true_names.contains(name));
        let known = if is_known { true_names } else { accepted };
        names
            .into_iter()
            .for_each(|(probability, name)| say(Subject::Name, probability, known.contains(&name)));
    }
    out
}

/// Ends of the bins of probability; the last one holds its upper end.
const ENDS: [f64; 9] = [0.0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0];

/// Statements of a subject bin by bin: its ends, and what lies in it.
fn bins<'a>(statements: &[&'a Statement], subject: Subject) -> Vec<(f64, f64, Vec<&'a Statement>)> {
    let bin = |ends: &[f64]| {
        let (from, to) = (ends[0], ends[1]);
        let within = |one: &&&Statement| {
            let p = one.probability;
            one.subject == subject && p >= from && (p < to || to == 1.0)
        };
        (
            from,
            to,
            statements.iter().filter(within).copied().collect(),
        )
    };
    ENDS.windows(2).map(bin).collect()
}

fn sum(statements: &[&Statement], value_of: impl Fn(&Statement) -> f64) -> f64 {
    statements.iter().map(|one| value_of(one)).sum()
}

fn outcome(statement: &Statement) -> f64 {
    f64::from(u8::from(statement.right))
}

/// Stated probabilities of a subject against what was true: bins that hold statements; Brier's score (1950), the mean squared difference of
/// probability and outcome; the chance that a right statement has a higher probability than a wrong one (area under the ROC curve).
pub(super) fn reliability(title: &str, statements: &[&Statement], subject: Subject) -> Value {
    let bin = |(from, to, all): (f64, f64, Vec<&Statement>)| {
        let stated = sum(&all, |one| one.probability) / all.len() as f64;
        let right = Share::of(all.iter().map(|one| one.right));
        (!all.is_empty())
            .then(|| json!({ "from": from, "to": to, "stated": stated, "right": right }))
    };
    let all: Vec<&Statement> = (statements.iter().copied())
        .filter(|one| one.subject == subject)
        .collect();
    let miss = |one: &Statement| (one.probability - outcome(one)).powi(2);
    let brier = (!all.is_empty()).then(|| sum(&all, miss) / all.len() as f64);
    let bins: Vec<Value> = bins(statements, subject)
        .into_iter()
        .filter_map(bin)
        .collect();
    json!({ "of": title, "brier": brier, "auc": auc(&all), "bins": bins })
}

/// By Mann and Whitney's (1947) ranks; ties count half. None where all are right, or wrong.
fn auc(all: &[&Statement]) -> Option<f64> {
    let (right, wrong): (Vec<&Statement>, Vec<&Statement>) = all.iter().partition(|s| s.right);
    let pairs = (right.len() * wrong.len()) as f64;
    let above = |a: &Statement, b: &Statement| {
        0.5 * (1.0 + f64::from(a.probability.total_cmp(&b.probability) as i8))
    };
    let all = right
        .iter()
        .flat_map(|a| wrong.iter().map(move |b| above(a, b)));
    let sum: f64 = all.sum();
    (pairs > 0.0).then(|| sum / pairs)
}

/// Statements of names with the whole list and without the cause, the latter with the weight `unlisted`, by bins that hold any: what would
/// be stated where so many of all causes are in no list.
pub(super) fn mixed(listed: &[&Statement], without: &[&Statement], unlisted: f64) -> Vec<Value> {
    let [listed, without] = [listed, without].map(|all| bins(all, Subject::Name));
    let bin = |((from, to, listed), (_, _, without)): ((f64, f64, Vec<_>), (_, _, Vec<_>))| {
        let sum = |value_of: fn(&Statement) -> f64| {
            (1.0 - unlisted) * sum(&listed, value_of) + unlisted * sum(&without, value_of)
        };
        let all = sum(|_| 1.0);
        let (stated, right) = (sum(|one| one.probability) / all, sum(outcome) / all);
        (all > 0.0).then(|| {
            json!({ "from": from, "to": to, "stated": stated, "right": right,
                "statements_whole_list": listed.len(), "statements_left_out": without.len() })
        })
    };
    listed.into_iter().zip(without).filter_map(bin).collect()
}

/// Whether a stated 95 % interval holds the true number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Interval {
    pub(crate) effect: String,
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

type Counterpart = (
    &'static str,
    &'static str,
    &'static [&'static str],
    &'static str,
    f64,
    &'static str,
);

/// True numbers that have a counterpart: effect, the twin's word for the number, forms of which it holds (empty: all), the word of a
/// diagnosis after the seat, its value per true one, and unit.
#[rustfmt::skip]
const COUNTERPARTS: [Counterpart; 11] = [
    ("joint_compliance", "", &[], "", 1.0, "rad/Nm"),
    ("link_compliance", "middle", &[], "", 1.0, "rad/Nm"),
    ("base_compliance", "x", &["isotropic"], "", 1.0, "rad/Nm"),
    ("backlash", "gap", &["by direction", "by sign of load"], ".half_gap", 0.5, "arcsec"),
    ("zero_shift", "step", &[], ".step", 1.0, "arcsec"),
    ("tool_shift", "shift_x", &[], ".x", 1e-3, "mm"),
    ("tool_shift", "shift_y", &[], ".y", 1e-3, "mm"),
    ("tool_shift", "shift_z", &[], ".z", 1e-3, "mm"),
    ("joint_log_lag", "share", &[], ".share", 1.0, "1"),
    ("payload_error", "mass", &[], ".mass", 1.0, "1"),
    ("link_mass", "mass", &[], ".mass", 1.0, "1"),
];

/// Intervals of what was found of a cause.
pub(super) fn intervals(cause: &Cause, findings: &[Finding]) -> Vec<Interval> {
    let same = findings
        .iter()
        .filter(|finding| finding.effect == cause.effect && finding.place == cause.place);
    let stated: Vec<&Number> = same.flat_map(|finding| &finding.parameters).collect();
    let judge = |truth: Expected| {
        let full = format!("{}.{}", cause.effect, truth.name);
        let number = (stated.iter()).find(|one| one.name == truth.name || one.name == full)?;
        let sigma = number.sigma.filter(|sigma| *sigma > 0.0)?;
        let expected = convert(truth.value, truth.unit, &number.unit)?;
        let off = if truth.unsigned {
            number.value.abs() - expected.abs()
        } else {
            number.value - expected
        };
        Some(Interval {
            effect: cause.effect.clone(),
            holds: off.abs() <= NINETY_FIVE * sigma,
        })
    };
    (cause.parameters.iter())
        .filter_map(|number| expected(cause, number))
        .filter_map(judge)
        .collect()
}

/// The true number `effect.seat.what` in the words of a diagnosis; none where it has no counterpart.
fn expected(cause: &Cause, number: &Number) -> Option<Expected> {
    let tail = number.name.strip_prefix(&cause.effect)?.strip_prefix('.')?;
    let (seat, what) = tail.split_once('.').unwrap_or((tail, ""));
    let expected = |name, factor: f64, unit| {
        Some(Expected {
            name,
            value: factor * number.value,
            unit,
            unsigned: what == "gap",
        })
    };
    match (cause.effect.as_str(), what) {
        ("gear_cyclic" | "gear_motor_cyclic", wave) => {
            let (kind, order) = wave.split_at_checked(3)?;
            let name = format!("{seat}.order{order}.{kind}");
            ["sin", "cos"]
                .contains(&kind)
                .then(|| expected(name, 1.0, "arcsec"))?
        }
        // A run of links grows as one.
        ("thermal_growth", "expansion") => {
            let run = cause.place.strip_prefix("link ")?.replace('-', "_");
            let first = run.split('_').next() == seat.strip_prefix('l');
            first.then(|| expected(format!("l{run}.per_kelvin"), 1e-6, "1"))?
        }
        // Of a wrong centre the mass is none.
        (_, "mass") if number.value == 0.0 => None,
        (effect, what) => {
            let (.., ending, factor, unit) =
                COUNTERPARTS.iter().find(|(subject, word, forms, ..)| {
                    let form = forms.is_empty() || forms.contains(&cause.form.as_str());
                    (*subject, *word) == (effect, what) && form
                })?;
            expected(format!("{seat}{ending}"), *factor, unit)
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn statement(subject: Subject, probability: f64, right: bool) -> &'static Statement {
        Box::leak(Box::new(Statement {
            subject,
            probability,
            right,
        }))
    }

    fn name(probability: f64, right: bool) -> &'static Statement {
        statement(Subject::Name, probability, right)
    }

    #[test]
    fn statements_fall_into_bins_and_the_score_is_the_mean_squared_miss() {
        let wrong = [name(0.85, false), name(0.05, false)];
        let all = [
            &[name(0.85, true), name(0.85, true), name(1.0, true)][..],
            &wrong,
        ]
        .concat();
        let found = reliability("names", &all, Subject::Name);
        let count = |bin: &Value| [&bin["right"]["count"], &bin["right"]["of"]].map(Value::as_u64);
        let counts: Vec<_> = found["bins"]
            .as_array()
            .expect("bins")
            .iter()
            .map(count)
            .collect();
        assert_eq!(counts, [[0, 1], [2, 3], [1, 1]].map(|bin| bin.map(Some)));
        // 2 x 0.15^2 + 0.85^2 + 0 + 0.05^2, by five.
        assert!((found["brier"].as_f64().expect("a score") - 0.154).abs() < 1e-12);
        // Three are right and two wrong: 1.0 is above both wrong ones, each 0.85 above one and level with the other.
        assert!((found["auc"].as_f64().expect("an area") - 5.0 / 6.0).abs() < 1e-12);
        assert_eq!(
            reliability("places", &all, Subject::Place)["bins"],
            json!([])
        );
    }

    #[test]
    fn each_kind_of_recording_counts_by_its_share() {
        let place = statement(Subject::Place, 0.96, false);
        let listed = [name(0.96, true), name(0.96, true), name(0.92, true), place];
        let bins = mixed(&listed, &[name(1.0, false), name(1.0, true)], 0.25);
        let figure = |bin: usize, what: &str| bins[bin][what].as_f64().expect("a figure");
        let counts =
            |bin| ["statements_whole_list", "statements_left_out"].map(|kind| figure(bin, kind));
        assert_eq!(
            (bins.len(), counts(0), figure(0, "right")),
            (2, [1.0, 0.0], 1.0)
        );
        // 0.75 x 2 + 0.25 x 1 of 0.75 x 2 + 0.25 x 2.
        assert_eq!(
            (figure(1, "from"), figure(1, "to"), counts(1)),
            (0.95, 1.0, [2.0, 2.0])
        );
        let off = [figure(1, "right") - 0.875, figure(1, "stated") - 0.97];
        assert!(off.iter().all(|off| off.abs() < 1e-12), "{bins:?}");
    }
}

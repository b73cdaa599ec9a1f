//! One case: what was found of every concealed cause, and what was said that is not there.

use super::interval::{Interval, intervals};
use super::paper::{Answer, Atoms, Cause, Finding, Name, Rival, Truth, all_atoms, atoms};
use super::place::{POINT_FAULTS, Placed, placed};
use super::reliability::{Statement, statements};

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

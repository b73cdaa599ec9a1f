//! Stated probabilities against what was true: how often what is said with a probability is right, and the mean squared error of it.

use super::paper::{Atoms, Finding};
use super::share::Share;
use serde::Serialize;
use std::collections::BTreeSet;

/// What a probability is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Subject {
    /// An effect at a place: of a finding or of a rival.
    Name,
    /// A finding's place.
    Place,
}

impl Subject {
    /// As people read it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Name => "names",
            Self::Place => "places",
        }
    }
}

/// Something that was said with a probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Statement {
    /// What it is about.
    pub(crate) subject: Subject,
    pub(crate) probability: f64,
    /// Whether it held.
    pub(crate) right: bool,
}

/// Statements whose probability lies in a range, and how many of them are right.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Bin {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) stated: f64,
    /// Statements that held.
    pub(crate) right: Share,
}

/// Ends of the bins.
const ENDS: [f64; 8] = [0.0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95];

/// The bins from their lower to their upper ends.
pub(super) fn ends() -> impl Iterator<Item = [f64; 2]> {
    ENDS.iter()
        .zip(ENDS[1..].iter().chain([&1.0]))
        .map(|(from, to)| [*from, *to])
}

/// Whether a probability lies in a bin; the last one holds its upper end.
pub(super) fn within(probability: f64, [from, to]: [f64; 2]) -> bool {
    probability >= from && (probability < to || to == 1.0)
}

/// What findings say with a probability, against the names that are `true_names`, and those that are `accepted` where a finding has none of
/// these.
pub(super) fn statements(
    findings: &[Finding],
    true_names: &[Atoms],
    accepted: &[Atoms],
) -> Vec<Statement> {
    let places: BTreeSet<&str> = true_names
        .iter()
        .chain(accepted)
        .flatten()
        .map(|(_, place)| place.as_str())
        .collect();
    let mut out = Vec::new();
    for finding in findings {
        let own = finding.atoms();
        let there = own.iter().any(|(_, place)| places.contains(place.as_str()));
        let rivals = finding
            .rivals
            .iter()
            .map(|rival| (rival.probability, rival.atoms()));
        let names: Vec<(Option<f64>, Atoms)> = std::iter::once((finding.probability, own))
            .chain(rivals)
            .collect();
        let known = if names.iter().any(|(_, name)| true_names.contains(name)) {
            true_names
        } else {
            accepted
        };
        let mut say = |subject, probability: Option<f64>, right| {
            out.extend(probability.map(|probability| Statement {
                subject,
                probability,
                right,
            }));
        };
        say(Subject::Place, finding.place_probability, there);
        names
            .into_iter()
            .for_each(|(probability, name)| say(Subject::Name, probability, known.contains(&name)));
    }
    out
}

/// Stated probabilities of a subject against what was true.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reliability {
    /// Those that hold statements.
    pub(crate) bins: Vec<Bin>,
    /// Brier's score (1950): the mean squared difference of probability and outcome; none of no statements.
    pub(crate) brier: Option<f64>,
    /// Chance that a right statement has a higher probability than a wrong one (area under the ROC curve); none where all are alike.
    pub(crate) auc: Option<f64>,
}

/// The reliability of statements of one subject.
pub(super) fn reliability<'a>(
    statements: impl Iterator<Item = &'a Statement>,
    subject: Subject,
) -> Reliability {
    let all: Vec<&Statement> = statements
        .filter(|statement| statement.subject == subject)
        .collect();
    let bins = ends().filter_map(|[from, to]| {
        let own: Vec<&&Statement> = all
            .iter()
            .filter(|s| within(s.probability, [from, to]))
            .collect();
        let stated = own.iter().map(|s| s.probability).sum::<f64>() / own.len() as f64;
        let right = Share::of(own.iter().map(|s| s.right));
        (!own.is_empty()).then_some(Bin {
            from,
            to,
            stated,
            right,
        })
    });
    let miss = |s: &&Statement| (s.probability - f64::from(u8::from(s.right))).powi(2);
    let brier = (!all.is_empty()).then(|| all.iter().map(miss).sum::<f64>() / all.len() as f64);
    Reliability {
        bins: bins.collect(),
        brier,
        auc: auc(&all),
    }
}

/// By Mann and Whitney's (1947) ranks; ties count half.
fn auc(all: &[&Statement]) -> Option<f64> {
    let (right, wrong): (Vec<&Statement>, Vec<&Statement>) = all.iter().partition(|s| s.right);
    let pairs = (right.len() * wrong.len()) as f64;
    let above = |a: &Statement, b: &Statement| match a.probability.total_cmp(&b.probability) {
        std::cmp::Ordering::Greater => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Less => 0.0,
    };
    let sum: f64 = right
        .iter()
        .flat_map(|a| wrong.iter().map(move |b| above(a, b)))
        .sum();
    (pairs > 0.0).then(|| sum / pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_fall_into_bins_and_the_score_is_the_mean_squared_miss() {
        let said = |probability, right| Statement {
            subject: Subject::Name,
            probability,
            right,
        };
        let all = [
            said(0.85, true),
            said(0.85, true),
            said(0.85, false),
            said(1.0, true),
            said(0.05, false),
        ];
        let Reliability { bins, brier, auc } = reliability(all.iter(), Subject::Name);
        let shown: Vec<(f64, usize, usize)> = bins
            .iter()
            .map(|bin| (bin.from, bin.right.count, bin.right.of))
            .collect();
        assert_eq!(shown, [(0.0, 0, 1), (0.8, 2, 3), (0.95, 1, 1)]);
        // 2 x 0.15^2 + 0.85^2 + 0 + 0.05^2, by five.
        assert!((brier.expect("a score") - 0.154).abs() < 1e-12);
        // Three are right and two wrong: 1.0 is above both wrong ones, each 0.85 above one and level with the other.
        assert!((auc.expect("an area") - 5.0 / 6.0).abs() < 1e-12);
        assert!(reliability(all.iter(), Subject::Place).bins.is_empty());
    }
}

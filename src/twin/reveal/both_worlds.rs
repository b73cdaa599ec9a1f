//! Stated probabilities where some recordings have a cause that nobody listed: the same recordings diagnosed with the whole list and without
//! their causes, mixed by the share of the latter.

use super::board::Board;
use super::mark::DUE;
use super::reliability::{Statement, Subject, ends, within};
use serde::Serialize;

/// Shares of recordings whose cause nobody listed.
pub(crate) const UNLISTED: [f64; 2] = [0.3, 0.5];

/// Statements of both kinds whose probability lies in a range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct MixedBin {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) stated: f64,
    /// The share of statements that held.
    pub(crate) right: f64,
    /// How many statements there are with the whole list, and without the cause.
    pub(crate) statements_whole_list: usize,
    pub(crate) statements_left_out: usize,
}

impl Board {
    /// Stated probabilities of names of the recordings that were diagnosed with the whole list and without their causes.
    pub(crate) fn mixed_reliability(&self, unlisted: f64) -> Vec<MixedBin> {
        let due = || self.left_out.iter().filter(|one| one.strength >= DUE);
        let listed = self
            .cases
            .iter()
            .filter(|case| due().any(|one| one.name == case.name))
            .flat_map(|case| &case.statements);
        let without = due().flat_map(|one| &one.statements);
        mixed([listed.collect(), without.collect()], unlisted)
    }
}

/// Statements with the whole list and without the cause, the latter with the weight `unlisted`, by bins that hold any.
fn mixed(statements: [Vec<&Statement>; 2], unlisted: f64) -> Vec<MixedBin> {
    let weights = [1.0 - unlisted, unlisted];
    let bin = |[from, to]: [f64; 2]| {
        let of_names = |all: &Vec<&Statement>| -> Vec<Statement> {
            let own = all
                .iter()
                .filter(|one| one.subject == Subject::Name && within(one.probability, [from, to]));
            own.map(|one| **one).collect()
        };
        let own = [of_names(&statements[0]), of_names(&statements[1])];
        let sum = |of: &dyn Fn(&Statement) -> f64| -> f64 {
            own.iter()
                .zip(weights)
                .map(|(all, weight)| weight * all.iter().map(of).sum::<f64>())
                .sum()
        };
        let all = sum(&|_| 1.0);
        (all > 0.0).then(|| MixedBin {
            from,
            to,
            stated: sum(&|one| one.probability) / all,
            right: sum(&|one| f64::from(u8::from(one.right))) / all,
            statements_whole_list: own[0].len(),
            statements_left_out: own[1].len(),
        })
    };
    ends().filter_map(bin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_recording_counts_by_its_share() {
        let said = |subject, probability, right| Statement {
            subject,
            probability,
            right,
        };
        let name = |probability, right| said(Subject::Name, probability, right);
        let listed = [
            name(0.96, true),
            name(0.96, true),
            name(0.92, true),
            said(Subject::Place, 0.96, false),
        ];
        let without = [name(1.0, false), name(1.0, true)];
        let bins = mixed([listed.iter().collect(), without.iter().collect()], 0.25);
        let [second, first] = [bins[1], bins[0]];
        let counts = |bin: MixedBin| [bin.statements_whole_list, bin.statements_left_out];
        assert_eq!((bins.len(), counts(first), first.right), (2, [1, 0], 1.0));
        // 0.75 x 2 + 0.25 x 1 of 0.75 x 2 + 0.25 x 2.
        assert_eq!(
            (second.from, second.to, counts(second)),
            (0.95, 1.0, [2, 2])
        );
        assert!(
            (second.right - 0.875).abs() < 1e-12 && (second.stated - 0.97).abs() < 1e-12,
            "{second:?}"
        );
    }
}

//! How probable the names of a finding are: its own, those of its rivals, and that none of them is right.
//!
//! That none is right, and that it acts at its place, are odds of evidence: of names against free forms. Names share what is left in
//! proportion to exp(-criterion / 2 T): the criterion is -2 ln of a posterior whose noise is the residual's, so T is 1 for forms that are
//! right; true shapes differ a little from the library's, which T allows for (`tests/reference/calibrate_probability.py`).

use crate::criteria::open_world::{MISLED, PLACED, PLACED_AMONG};
use crate::criteria::words::{FAULT, IDENTITY, TEMPERATURE};
use crate::diagnose::open_world::NameOdds;
use crate::diagnose::types::{Finding, Probabilities, RivalCause};
use crate::effect::names;

/// Sets the probabilities of a fault of single rows.
pub(super) fn weigh_fault(fault: &mut Finding) {
    fault.probabilities = Probabilities { name: *FAULT, place: *FAULT, none: 1.0 - *FAULT };
}

/// Sets the probabilities of a finding and of its rivals; `odds` are those of free forms against names, `rejected` says that the finding's
/// own name was among these and cannot be.
pub(super) fn weigh(finding: &mut Finding, odds: &NameOdds, rejected: bool) {
    if finding.effect == names::UNKNOWN {
        return weigh_nameless(finding, odds, rejected);
    }
    let whole = 1.0 + finding.rivals.iter().map(weight).sum::<f64>();
    for rival in &mut finding.rivals {
        rival.probability = (1.0 - odds.none) * weight(rival) / whole;
    }
    finding.probabilities = Probabilities { name: (1.0 - odds.none) / whole, place: odds.place, none: odds.none };
}

/// Lowers the probabilities of the places of findings without a name: evidence knows free forms at places, and errs more often where several
/// share what one effect does. What is elsewhere is no longer what the finding says.
pub(super) fn weigh_places(findings: &mut [Finding]) {
    let is_nameless = |finding: &Finding| finding.effect == names::UNKNOWN;
    let count = findings.iter().filter(|finding| is_nameless(finding)).count();
    let most = if count > 1 { *PLACED_AMONG } else { *PLACED };
    for finding in findings.iter_mut().filter(|finding| is_nameless(finding)) {
        let Probabilities { name, place, none } = &mut finding.probabilities;
        *place *= most;
        let all = *name + *none;
        *name *= *place;
        *none = all - *name;
    }
}

/// The weight of a rival beside a name whose weight is 1; only identities differ by nothing at all.
fn weight(rival: &RivalCause) -> f64 {
    let loss = if rival.delta_bic == 0.0 { *IDENTITY } else { rival.delta_bic.max(0.0) };
    (-loss / (2.0 * *TEMPERATURE)).exp()
}

/// Sets the probabilities of a finding without a name: rivals share what free forms and a rejected name leave.
fn weigh_nameless(finding: &mut Finding, odds: &NameOdds, rejected: bool) {
    let whole = f64::from(u8::from(rejected)) + finding.rivals.iter().map(weight).sum::<f64>();
    // No law of the list does as well: what is left is that evidence misleads.
    let of_names = if finding.rivals.is_empty() { (1.0 - odds.none).min(*MISLED) } else { 1.0 - odds.none };
    for rival in &mut finding.rivals {
        rival.probability = of_names * weight(rival) / whole;
    }
    let name = 1.0 - finding.rivals.iter().map(|rival| rival.probability).sum::<f64>();
    let none = if finding.rivals.is_empty() { of_names } else { 0.0 };
    finding.probabilities = Probabilities { name: name - none, place: odds.place, none };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::types::Evidence;
    use crate::effect::Place;

    fn finding(delta_bic: f64, rivals: &[(&'static str, usize, f64)]) -> Finding {
        let rival = |(effect, joint, delta_bic): &(&'static str, usize, f64)| RivalCause {
            effect,
            place: Place::Joint(*joint),
            delta_bic: *delta_bic,
            probability: 0.0,
        };
        Finding {
            effect: "gear_cyclic",
            place: Place::Joint(1),
            statement: String::new(),
            parameters: Vec::new(),
            evidence: Some(Evidence { delta_bic, ..Evidence::default() }),
            rivals: rivals.iter().map(rival).collect(),
            probabilities: Probabilities::default(),
            valid: None,
            forms: Vec::new(),
        }
    }

    #[test]
    fn names_and_none_add_up_to_one_and_equal_rivals_share_alike() {
        let odds = NameOdds { none: 0.2, place: 0.9, log: 100.0, share: 1.0 };
        let mut found = finding(200.0, &[("backlash", 1, -1.0), ("zero_shift", 2, 3.0), ("counterbalance", 2, 0.0)]);
        weigh(&mut found, &odds, false);
        let Probabilities { name, place, none } = found.probabilities;
        let rivals: Vec<f64> = found.rivals.iter().map(|rival| rival.probability).collect();
        assert!((name + none + rivals.iter().sum::<f64>() - 1.0).abs() < 1e-12 && none == 0.2 && place == 0.9);
        assert!((name - rivals[0]).abs() < 1e-12 && rivals[1] < rivals[0] && rivals[2] < rivals[1]);
        found.effect = names::UNKNOWN;
        weigh(&mut found, &odds, false);
        let sum: f64 = found.rivals.iter().map(|rival| rival.probability).sum();
        assert!((found.probabilities.name - 0.2).abs() < 1e-12 && (sum - 0.8).abs() < 1e-12);
    }

    #[test]
    fn a_place_without_a_name_is_less_sure_among_several() {
        let nameless = || {
            let mut out = finding(200.0, &[]);
            out.effect = names::UNKNOWN;
            out.probabilities = Probabilities { name: 0.75, place: 1.0, none: 0.0 };
            out
        };
        let mut named = finding(200.0, &[]);
        named.probabilities.place = 1.0;
        let places = |mut findings: Vec<Finding>| {
            weigh_places(&mut findings);
            findings.iter().map(|finding| finding.probabilities.place).collect::<Vec<_>>()
        };
        let mut alone = [nameless()];
        weigh_places(&mut alone);
        let Probabilities { name, place, none } = alone[0].probabilities;
        assert_eq!((name, place), (0.75 * *PLACED, *PLACED));
        assert!((name + none - 0.75).abs() < 1e-12, "rivals have what they had");
        assert_eq!(places(vec![named.clone(), nameless()]), [1.0, *PLACED]);
        assert_eq!(places(vec![nameless(), named, nameless()]), [*PLACED_AMONG, 1.0, *PLACED_AMONG]);
    }

    #[test]
    fn what_a_rejected_name_would_have_is_that_it_is_none_of_the_list() {
        let odds = NameOdds { none: 0.02, place: 0.9, log: 100.0, share: 1.0 };
        let mut alone = finding(200.0, &[]);
        alone.effect = names::UNKNOWN;
        weigh(&mut alone, &odds, true);
        assert_eq!((alone.probabilities.name, alone.probabilities.none), (0.98, 0.02));
        let mut beside = finding(200.0, &[("backlash", 1, 0.01), ("zero_shift", 2, 0.01)]);
        beside.effect = names::UNKNOWN;
        weigh(&mut beside, &odds, true);
        // Three names share alike, and one of them cannot be.
        assert!((beside.probabilities.name - (0.02 + 0.98 / 3.0)).abs() < 0.01, "{:?}", beside.probabilities);
    }
}

//! How probable the names of a finding are: its own, those of its rivals, and that none of them is right.
//!
//! Names share what is left by none in proportion to exp(-criterion / 2 T): the criterion is -2 ln of a posterior whose noise is the
//! residual's, so T is 1 for forms that are right; true shapes differ a little from the library's, which T allows for. That none is
//! right becomes less probable the more the criterion would lose without the finding. The numbers were fitted once to 672 recordings of
//! this project's own making (`tests/reference/calibrate_probability.py`), and are judged by others in the proof: in 296 of them, which
//! weighed 0.3 each, the cause had been left out of the list: what is stated allows for physics that nobody has listed.

use crate::diagnose::open_world::NameOdds;
use crate::diagnose::types::{Evidence, Finding, Probabilities, RivalCause};
use crate::effect::Unknown;

/// T.
const TEMPERATURE: f64 = 2.03;
/// ln odds that none of the names is right: constant, by ln of the criterion's loss without the finding, and for a finding without a law.
const NONE: f64 = 0.52;
const BY_LOSS: f64 = -0.57;
const NO_LAW: f64 = 0.45;
/// What the criterion would lose by a rival that does exactly the same in whatever data, by how rarely it is the cause.
const IDENTITY: f64 = 6.3;
/// Of what has none of the names, the share that acts at the named place all the same.
const SAME_PLACE: f64 = 0.34;
/// Faults of single rows are seen as such or not at all.
const FAULT: f64 = 0.98;

/// Sets the probabilities of a finding and of its rivals; `odds` are those of a free form against names.
pub(super) fn weigh(finding: &mut Finding, odds: Option<&NameOdds>) {
    let Some(evidence) = finding.evidence else {
        finding.probabilities = Probabilities { name: FAULT, place: FAULT, none: 1.0 - FAULT };
        return;
    };
    let nameless = finding.effect == Unknown::NAME;
    if let Some(odds) = odds.filter(|_| nameless) {
        return weigh_nameless(finding, odds);
    }
    let none = odds.map_or_else(|| none(&evidence, nameless), |odds| odds.none);
    // Only identities differ by nothing at all.
    let loss = |delta: f64| if delta == 0.0 { IDENTITY } else { delta.max(0.0) };
    let weight = |delta: f64| (-loss(delta) / (2.0 * TEMPERATURE)).exp();
    let whole = 1.0 + finding.rivals.iter().map(|rival| weight(rival.delta_bic)).sum::<f64>();
    for rival in &mut finding.rivals {
        rival.probability = (1.0 - none) * weight(rival.delta_bic) / whole;
    }
    let name = (1.0 - none) / whole;
    let there = finding.rivals.iter().filter(|rival| rival.place == finding.place).map(|rival| rival.probability);
    let place = odds.map_or(name + there.sum::<f64>() + SAME_PLACE * none, |odds| odds.place);
    finding.probabilities = Probabilities { name, place: place.min(1.0), none };
}

/// Of a finding without a name: rivals share what free forms leave.
fn weigh_nameless(finding: &mut Finding, odds: &NameOdds) {
    let weight = |rival: &RivalCause| (-rival.delta_bic.max(0.0) / (2.0 * TEMPERATURE)).exp();
    let whole: f64 = finding.rivals.iter().map(weight).sum();
    for rival in &mut finding.rivals {
        rival.probability = (1.0 - odds.none) * weight(rival) / whole.max(f64::MIN_POSITIVE);
    }
    let none = if finding.rivals.is_empty() { 1.0 - odds.none } else { 0.0 };
    finding.probabilities = Probabilities { name: odds.none, place: odds.place, none };
}

fn none(evidence: &Evidence, no_law: bool) -> f64 {
    let odds = NONE + BY_LOSS * evidence.delta_bic.max(1.0).ln() + NO_LAW * f64::from(u8::from(no_law));
    1.0 / (1.0 + (-odds).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let mut found = finding(200.0, &[("backlash", 1, -1.0), ("zero_shift", 2, 3.0), ("counterbalance", 2, 0.0)]);
        weigh(&mut found, None);
        let Probabilities { name, place, none } = found.probabilities;
        let rivals: Vec<f64> = found.rivals.iter().map(|rival| rival.probability).collect();
        assert!((name + none + rivals.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((name - rivals[0]).abs() < 1e-12 && rivals[1] < rivals[0] && rivals[2] < rivals[1]);
        assert!(place > name + rivals[0] && place < 1.0);
    }

    #[test]
    fn none_is_less_probable_the_more_the_criterion_would_lose() {
        let none = |loss: f64| {
            let mut found = finding(loss, &[]);
            weigh(&mut found, None);
            found.probabilities.none
        };
        assert!(none(20.0) > none(100.0) && none(100.0) > none(1000.0));
    }
}

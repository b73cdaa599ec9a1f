//! What free forms add to a judged model, or put in the place of its names, as far as folds agree; and the odds of what stands.

use super::look::{OpenWorldLook, Sighted};
use super::names::NameOdds;
use super::step::ModelStep;
use crate::criteria::open_world::ROUNDS;
use crate::diagnose::finding_groups::FindingKey;
use crate::diagnose::judge::JudgedCauses;
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{Fitter, RoundView};
use crate::diagnose::words::of_the_open_world;
use crate::effect::{Place, Survey};
use std::collections::BTreeMap;

/// A judged model with free forms, and the odds of its findings.
pub(crate) struct Settled {
    pub judged: JudgedCauses,
    pub odds: BTreeMap<FindingKey, NameOdds>,
}

/// Asks free forms beside a judged model and instead of its findings. `survey` is that of the round before. `structured` says whether the gate
/// saw more than noise in what the findings leave: along a path noise that lasts looks like a smooth function, and only what the gate sees,
/// which knows how long it lasts, may join there.
pub(crate) fn settle(
    mut judged: JudgedCauses,
    structured: bool,
    pool: &mut CachedHypotheses,
    survey: &Survey,
    fitter: &Fitter,
    tell: &mut dyn FnMut(String),
) -> Settled {
    let joins = structured || !fitter.is_on_a_path(&judged.state.screening.kept);
    let mut refused: Vec<Place> = Vec::new();
    let mut asked_alone = false;
    // What joined may leave nothing to a cause that was there before: that goes however late it is seen.
    let mut round = 0;
    loop {
        tell(of_the_open_world(&judged.state));
        let view = RoundView::of(&judged.state, fitter);
        let (mut odds, mut step) = (BTreeMap::new(), None);
        {
            let sight = Sighted::of(&view, &judged, fitter);
            let look = OpenWorldLook::of(&sight, pool, survey);
            if round < *ROUNDS && !std::mem::replace(&mut asked_alone, true) {
                step = look.alone();
            }
            if round < *ROUNDS && step.is_none() && joins {
                step = look.joining(&mut refused);
            }
            if step.is_none() {
                let contested = look.contested();
                step = if round < *ROUNDS { look.exchange(&contested) } else { look.dropped(&contested) };
                odds = contested.iter().map(|(key, own)| (*key, look.odds(key, own))).collect();
            }
        }
        let Some(ModelStep { state, kept, new, sentence, .. }) = step else { return Settled { judged, odds } };
        tell(sentence);
        let mut set: Vec<usize> = kept.iter().map(|i| judged.set[*i]).collect();
        let first = pool.add(new);
        set.extend(first..pool.hypotheses.len());
        judged = JudgedCauses { state, set, gains: Vec::new(), withdrawn: judged.withdrawn };
        round += 1;
    }
}

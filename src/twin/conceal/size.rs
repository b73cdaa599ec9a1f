//! How large concealed effects are: each is scaled until it is as visible as drawn, when geometry has absorbed what it can.

use super::design::{Content, Design};
use super::family::{Bench, Cause, Collection, Draft, foreign::foreign};
use super::visible::Site;
use crate::matrix::{Column, Shadow, length};
use crate::noise::Noise;

/// A cause with how visible it is at the points to fit.
#[derive(Debug, Clone)]
pub struct Concealed {
    /// What acts.
    pub cause: Cause,
    /// Made by a formula that a library is not expected to hold; stated of what lies beyond the library.
    pub strange: bool,
    /// Root mean square of its displacement per axis, mm: all of it, and what geometry and the other causes leave.
    pub raw_mm: f64,
    /// What geometry and the other causes leave, mm.
    pub visible_mm: f64,
    /// Squared visible displacement over the noise's variance, `3 N SNR^2`: beside the other causes, and with geometry alone.
    pub strength: f64,
    /// With geometry alone.
    pub strength_alone: f64,
}

/// What a cause is seen against.
#[derive(Clone, Copy)]
pub(super) struct Sight<'a> {
    pub(super) site: &'a Site<'a>,
    /// What geometry can do.
    pub(super) shadow: &'a Shadow,
    /// Root mean square of a coordinate's noise, m.
    pub(super) noise: f64,
}

impl Sight<'_> {
    /// Visibility of a displacement that nothing absorbs.
    fn strength(&self, column: &[f64]) -> f64 {
        (length(column) / self.noise).powi(2)
    }
}

impl Cause {
    fn scale(&mut self, by: f64) {
        self.physical.iter_mut().for_each(|effect| effect.scale(by));
    }
}

/// A visibility to aim at: mostly 50 to 1000, some hardly there, some plain.
fn aim(draw: &mut Noise) -> f64 {
    match draw.uniform(0.0, 1.0) {
        u if u < 0.1 => draw.size(1.0, 5.0),
        u if u < 0.25 => draw.size(5.0, 50.0),
        u if u < 0.85 => draw.size(50.0, 1000.0),
        _ => draw.size(1000.0, PLAINEST),
    }
}

/// The largest visibility of an effect whose size may be changed.
const PLAINEST: f64 = 5000.0;
/// Bounds of the factor on a natural size.
const SMALLEST: f64 = 2e-3;
const LARGEST: f64 = 4.0;
/// Visibility of what lies beyond the library.
const PLAIN: [f64; 2] = [50.0, 200.0];
/// Root mean square per axis of an effect drawn at random, in standard deviations of a coordinate.
const FOREIGN: [f64; 2] = [2.0, 20.0];
/// Effects that may be drawn until one can be seen.
const DRAWS: usize = 40;

/// What a case conceals: the drafts, and their causes, each as visible as drawn.
pub(super) fn conceal(
    design: &Design,
    content: Content,
    on: &Bench,
    sight: &Sight,
    draw: &mut Noise,
) -> (Vec<Draft>, Vec<Concealed>) {
    let families = design.collection.families();
    let rows = match content {
        Content::Null => vec![],
        Content::Foreign => {
            return until_plain(sight, true, |_| {
                let draft = foreign(on, draw);
                let ratio = draw.size(FOREIGN[0], FOREIGN[1]);
                let mut causes = draft.causes.clone();
                // The whole displacement counts. Twice: what hangs on the load is not quite proportional.
                for _ in 0..2 {
                    let whole = alone(&causes, 0, sight.site);
                    let found = length(&whole) / (whole.len().max(1) as f64).sqrt() / sight.noise;
                    causes[0].scale(ratio / found.max(1e-6));
                }
                Some((draft, causes))
            });
        }
        Content::Single(row) if design.collection == Collection::Beyond => {
            let other = draw.chance(design.other_forms);
            return until_plain(sight, other, |is_last| {
                let draft = (families[row].draw)(on, other, draw)?;
                let wanted = draw.size(PLAIN[0], PLAIN[1]);
                let largest = if is_last { f64::INFINITY } else { LARGEST };
                let mut causes = draft.causes.clone();
                for index in (0..causes.len()).filter(|index| draft.causes[*index].sized) {
                    // The others absorb what they can, as geometry does.
                    let found = seen(causes.clone(), sight)[index].strength.max(1e-9);
                    let factor = (wanted / found).sqrt().clamp(SMALLEST, largest);
                    causes[index].scale(factor);
                }
                Some((draft, causes))
            });
        }
        Content::Single(row) => vec![row],
        Content::Pair(first, second) => vec![first, second],
    };
    let mut drafts: Vec<Draft> = Vec::new();
    let is_pair = rows.len() > 1;
    for row in rows {
        // A pair does not sit twice in one place.
        let attempt = |_| {
            let other = draw.chance(design.other_forms);
            let draft = (families[row].draw)(on, other, draw)?;
            let mut taken = drafts.iter().flat_map(|other| &other.causes);
            let places = draft.causes.iter().map(|cause| &cause.place);
            let twice = taken.any(|cause| places.clone().any(|place| *place == cause.place));
            let is_several = is_pair && draft.causes.len() > 1;
            (!twice && !is_several).then_some(draft)
        };
        let draft = (0..50).find_map(attempt);
        drafts.extend(draft);
    }
    let mut causes: Vec<Cause> = drafts.iter().flat_map(|one| one.causes.clone()).collect();
    for index in 0..causes.len() {
        let natural = draw.chance(design.natural);
        let wanted = aim(draw);
        if !causes[index].sized {
            continue;
        }
        let column = sight.shadow.outside(alone(&causes, index, sight.site));
        let found = sight.strength(&column).max(1e-9);
        // What is of natural size stays so, but where it would be too plain to test anything.
        let wanted = if natural { found.min(PLAINEST) } else { wanted };
        let factor = (wanted / found).sqrt().clamp(SMALLEST, LARGEST);
        causes[index].scale(factor);
    }
    (drafts, seen(causes, sight))
}

/// Draws effects until one is plain to see, so many at most; `attempt` draws one in its size, and hears whether it is the last.
fn until_plain(
    sight: &Sight,
    strange: bool,
    mut attempt: impl FnMut(bool) -> Option<(Draft, Vec<Cause>)>,
) -> (Vec<Draft>, Vec<Concealed>) {
    let mut out = (Vec::new(), Vec::new());
    for number in 1..=DRAWS {
        let Some((draft, causes)) = attempt(number == DRAWS) else {
            continue;
        };
        let mut concealed = seen(causes, sight);
        concealed.iter_mut().for_each(|one| one.strange = strange);
        let is_plain = |one: &Concealed| !one.cause.sized || one.strength >= PLAIN[0];
        let is_plain = concealed.iter().all(is_plain);
        out = (vec![draft], concealed);
        if is_plain {
            break;
        }
    }
    out
}

/// How visible causes of this size are.
fn seen(causes: Vec<Cause>, sight: &Sight) -> Vec<Concealed> {
    let Sight { site, shadow, .. } = *sight;
    let columns: Vec<Column> = (0..causes.len())
        .map(|index| alone(&causes, index, site))
        .collect();
    let rms = |column: &[f64]| 1e3 * length(column) / (column.len().max(1) as f64).sqrt();
    let seen = |(index, cause): (usize, Cause)| {
        let others = shadow.with_others(&columns, index);
        let visible = others.outside(columns[index].clone());
        Concealed {
            cause,
            strange: false,
            raw_mm: rms(&columns[index]),
            visible_mm: rms(&visible),
            strength: sight.strength(&visible),
            strength_alone: sight.strength(&shadow.outside(columns[index].clone())),
        }
    };
    causes.into_iter().enumerate().map(seen).collect()
}

/// What one cause does in company of all others: the displacement with all of them less that without it, m.
fn alone(causes: &[Cause], index: usize, site: &Site) -> Column {
    let displacement = |skipped: Option<usize>| {
        let kept = causes.iter().enumerate();
        let kept = kept.filter(|(other, _)| Some(*other) != skipped);
        let effects = kept.flat_map(|(_, cause)| cause.physical.clone());
        site.displacement(&effects.collect::<Vec<_>>())
    };
    let pairs = displacement(None)
        .into_iter()
        .zip(displacement(Some(index)));
    pairs.map(|(with, without)| with - without).collect()
}

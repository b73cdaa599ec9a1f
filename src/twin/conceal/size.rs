//! How large concealed effects are: each is scaled until it is as visible as drawn, when geometry has absorbed what it can.

use super::design::{Content, Design};
use super::family::{Bench, Cause, Draft, foreign::foreign};
use super::visible::Site;
use crate::effect::Physical;
use crate::noise::Noise;
use crate::shadow::{Shadow, norm};

/// A cause with how visible it is at the points to fit.
#[derive(Debug, Clone)]
pub struct Concealed {
    /// What acts.
    pub cause: Cause,
    pub form: &'static str,
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
        (norm(column) / self.noise).powi(2)
    }
}

impl Cause {
    fn scale(&mut self, by: f64) {
        for effect in &mut self.physical {
            *effect = effect.scaled(by);
        }
    }
}

fn causes(drafts: &[Draft]) -> Vec<(Cause, &'static str)> {
    drafts
        .iter()
        .flat_map(|draft| draft.causes.iter().map(|cause| (cause.clone(), draft.form)))
        .collect()
}

/// Draws the families of a case; a pair does not sit twice in one place.
pub(super) fn drafts(
    design: &Design,
    content: Content,
    bench: &Bench,
    draw: &mut Noise,
) -> Vec<Draft> {
    let rows = match content {
        Content::Null | Content::Foreign => vec![],
        Content::Single(row) => vec![row],
        Content::Pair(first, second) => vec![first, second],
    };
    let mut out: Vec<Draft> = Vec::new();
    for row in rows {
        for _ in 0..50 {
            let other = draw.chance(design.other_forms);
            let Some(draft) = (design.collection.families()[row].draw)(bench, other, draw) else {
                continue;
            };
            let taken = |place: &str| {
                out.iter()
                    .flat_map(|other| &other.causes)
                    .any(|cause| cause.place == place)
            };
            let several = matches!(content, Content::Pair(..)) && draft.causes.len() > 1;
            if !several && !draft.causes.iter().any(|cause| taken(&cause.place)) {
                out.push(draft);
                break;
            }
        }
    }
    out
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

/// Gives the causes their size and says how visible they are then.
pub(super) fn size(
    design: &Design,
    drafts: &[Draft],
    sight: &Sight,
    draw: &mut Noise,
) -> Vec<Concealed> {
    let mut causes = causes(drafts);
    let Sight { site, shadow, .. } = *sight;
    let strength = |column: &[f64]| sight.strength(column);
    for index in 0..causes.len() {
        let natural = draw.chance(design.natural);
        let wanted = aim(draw);
        if !causes[index].0.sized {
            continue;
        }
        let found = strength(&shadow.outside(alone(&causes, index, site))).max(1e-9);
        // What is of natural size stays so, but where it would be too plain to test anything.
        let wanted = if natural { found.min(PLAINEST) } else { wanted };
        let factor = (wanted / found).sqrt().clamp(SMALLEST, LARGEST);
        causes[index].0.scale(factor);
    }
    seen(causes, sight)
}

/// How visible causes of this size are.
fn seen(causes: Vec<(Cause, &'static str)>, sight: &Sight) -> Vec<Concealed> {
    let Sight { site, shadow, .. } = *sight;
    let columns: Vec<Vec<f64>> = (0..causes.len())
        .map(|index| alone(&causes, index, site))
        .collect();
    let rms = |column: &[f64]| 1e3 * norm(column) / (column.len().max(1) as f64).sqrt();
    (causes.into_iter().enumerate())
        .map(|(index, (cause, form))| {
            let mut beside = shadow.clone();
            columns
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != index)
                .for_each(|(_, column)| beside.add(column.clone()));
            let left = beside.outside(columns[index].clone());
            Concealed {
                cause,
                form,
                strange: false,
                raw_mm: rms(&columns[index]),
                visible_mm: rms(&left),
                strength: sight.strength(&left),
                strength_alone: sight.strength(&shadow.outside(columns[index].clone())),
            }
        })
        .collect()
}

/// What one cause does beside all others: the displacement with all of them less that without it, m.
fn alone(causes: &[(Cause, &'static str)], index: usize, site: &Site) -> Vec<f64> {
    let effects = |skipped: Option<usize>| -> Vec<Physical> {
        let kept = causes
            .iter()
            .enumerate()
            .filter(|(other, _)| Some(*other) != skipped);
        kept.flat_map(|(_, (cause, _))| cause.physical.clone())
            .collect()
    };
    let (with, without) = (
        site.displacement(&effects(None)),
        site.displacement(&effects(Some(index))),
    );
    with.iter()
        .zip(&without)
        .map(|(with, without)| with - without)
        .collect()
}

/// Visibility of what lies beyond the library.
const PLAIN: [f64; 2] = [50.0, 200.0];
/// Effects that may be drawn until one can be seen.
const DRAWS: usize = 40;

/// Draws an effect of a case beyond the library until one can be as visible as it should, at most `LARGEST` times its natural size;
/// where none can, the last is made larger.
pub(super) fn beyond(
    design: &Design,
    content: Content,
    bench: &Bench,
    sight: &Sight,
    draw: &mut Noise,
) -> (Vec<Draft>, Vec<Concealed>) {
    let Content::Single(row) = content else {
        return (Vec::new(), Vec::new());
    };
    let other = draw.chance(design.other_forms);
    let mut out = (Vec::new(), Vec::new());
    for left in (0..DRAWS).rev() {
        let Some(draft) = (design.collection.families()[row].draw)(bench, other, draw) else {
            continue;
        };
        let wanted = draw.size(PLAIN[0], PLAIN[1]);
        let largest = if left == 0 { f64::INFINITY } else { LARGEST };
        let drafts = vec![draft];
        let mut causes = causes(&drafts);
        for index in (0..causes.len()).filter(|index| drafts[0].causes[*index].sized) {
            // The others absorb what they can, as geometry does.
            let found = seen(causes.clone(), sight)[index].strength.max(1e-9);
            let factor = (wanted / found).sqrt().clamp(SMALLEST, largest);
            causes[index].0.scale(factor);
        }
        let mut concealed = seen(causes, sight);
        concealed.iter_mut().for_each(|one| one.strange = other);
        let plain = concealed
            .iter()
            .filter(|one| one.cause.sized)
            .all(|one| one.strength >= PLAIN[0]);
        out = (drafts, concealed);
        if plain {
            break;
        }
    }
    out
}

/// Root mean square per axis of an effect drawn at random, in standard deviations of a coordinate.
const FOREIGN: [f64; 2] = [2.0, 20.0];

/// Draws an effect at random until geometry leaves enough of it to be seen; its whole displacement is made `FOREIGN` times the noise.
pub(super) fn drawn(
    bench: &Bench,
    sight: &Sight,
    draw: &mut Noise,
) -> (Vec<Draft>, Vec<Concealed>) {
    let mut out = (Vec::new(), Vec::new());
    for _ in 0..DRAWS {
        let draft = foreign(bench, draw);
        let ratio = draw.size(FOREIGN[0], FOREIGN[1]);
        let drafts = vec![draft];
        let mut causes = causes(&drafts);
        // Twice: what hangs on the load is not quite proportional.
        for _ in 0..2 {
            let whole = alone(&causes, 0, sight.site);
            let found = norm(&whole) / (whole.len().max(1) as f64).sqrt() / sight.noise;
            causes[0].0.scale(ratio / found.max(1e-6));
        }
        let mut concealed = seen(causes, sight);
        concealed.iter_mut().for_each(|one| one.strange = true);
        let plain = concealed.iter().all(|one| one.strength >= PLAIN[0]);
        out = (drafts, concealed);
        if plain {
            break;
        }
    }
    out
}

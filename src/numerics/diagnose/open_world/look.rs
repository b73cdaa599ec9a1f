//! A look at a judged model: free forms of all places beside it, instead of it, and instead of each of its findings.

use super::frame::{ProjectedColumns, ProjectedRows};
use super::free_form::{AroundGroups, FreeForm, FreeTerm, PlaceGroups, side_by_side};
use super::names::{
    ContestedName, NameCase, NameOdds, NamedFinding, SurveyedPlaces, fitted_variances, groups_of_places, survey_places,
    unit_variances,
};
use super::state::{CauseColumns, KnownCauses};
use super::step::{ModelChange, ModelStep};
use crate::criteria::open_world::{FIRST, LOUDER, MIMICRY_OF_LOADS, MISLED, SEEN, SHARED, SIZE, STRONG, WORSE};
use crate::diagnose::finding_groups::{FindingGroups, FindingKey, groups};
use crate::diagnose::judge::JudgedCauses;
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{Fitter, RoundView};
use crate::effect::{Place, Survey, names};
use std::collections::BTreeMap;
use std::ops::Range;

/// A judged model with its rows, projected.
pub(super) struct Sighted<'v> {
    frame: ProjectedRows<'v>,
    judged: &'v JudgedCauses,
    fitter: &'v Fitter<'v>,
    blocks: Vec<ProjectedColumns>,
    /// Columns of all causes, and which are each one's.
    all: CauseColumns,
    ranges: Vec<Range<usize>>,
}

impl<'v> Sighted<'v> {
    pub fn of(view: &'v RoundView<'v>, judged: &'v JudgedCauses, fitter: &'v Fitter<'v>) -> Self {
        let frame = ProjectedRows::of(view, &judged.state, fitter);
        let blocks: Vec<ProjectedColumns> = judged.state.causes.iter().map(|cause| frame.block(&cause.form)).collect();
        let all = CauseColumns::new(&frame, side_by_side(&blocks, frame.residual_rows()));
        let mut at = 0;
        let range = |block: &ProjectedColumns| {
            at += block.square.len();
            at - block.square.len()..at
        };
        let ranges = blocks.iter().map(range).collect();
        Self { frame, judged, fitter, blocks, all, ranges }
    }

    /// Columns of some causes with the roots of their prior variances.
    fn picked(&self, is_in: &dyn Fn(usize) -> bool) -> Vec<(usize, f64)> {
        let variances = |i: usize| fitted_variances(&self.judged.state, i, &self.blocks[i].square);
        let of = |i: usize| self.ranges[i].clone().zip(variances(i));
        (0..self.blocks.len()).filter(|i| is_in(*i)).flat_map(of).map(|(k, variance)| (k, variance.sqrt())).collect()
    }

    fn state(&self, is_in: &dyn Fn(usize) -> bool, scale: f64) -> KnownCauses<'_> {
        KnownCauses::of(&self.all, self.picked(is_in), scale)
    }
}

/// Free forms beside a judged model.
pub(super) struct OpenWorldLook<'l, 'v, 'a> {
    sight: &'l Sighted<'v>,
    pool: &'l CachedHypotheses<'a>,
    around: AroundGroups<'l, 'v>,
    groups: Vec<PlaceGroups>,
    scale: f64,
    whole: KnownCauses<'l>,
    beside: SurveyedPlaces,
    findings: FindingGroups,
}

impl<'l, 'v, 'a> OpenWorldLook<'l, 'v, 'a> {
    pub fn of(sight: &'l Sighted<'v>, pool: &'l CachedHypotheses<'a>, survey: &'l Survey<'l>) -> Self {
        let without = sight.fitter.question.without;
        let around = AroundGroups { frame: &sight.frame, survey, causes: &sight.all, without };
        let all = groups_of_places(&around);
        let mut scale = 1.0 / sight.frame.view.autocorrelation_time();
        let mut whole = sight.state(&|_| true, scale);
        let mut beside = survey_places(&[(whole.clone(), None)], &all, &around).remove(0);
        let louder = louder(&sight.frame, &whole, beside.best.first(), scale, sight.fitter);
        let louder = louder.max(sight.fitter.least_of_the_noise());
        if louder > *LOUDER || louder < 1.0 / *LOUDER && sight.fitter.least_of_the_noise() < 1.0 {
            scale /= louder;
            whole = sight.state(&|_| true, scale);
            beside = survey_places(&[(whole.clone(), None)], &all, &around).remove(0);
        }
        let findings = groups(&sight.judged.state, &sight.judged.set, pool, survey);
        Self { sight, pool, around, groups: all, scale, whole, beside, findings }
    }

    fn case(&self) -> NameCase<'_, 'l, 'v, 'a> {
        NameCase {
            around: &self.around,
            pool: self.pool,
            judged: self.sight.judged,
            open_world: self.sight.fitter.question.open_world,
        }
    }

    fn change<'c>(&'c self, without: &'c [usize], worse: f64) -> ModelChange<'c, 'a> {
        ModelChange { judged: self.sight.judged, pool: self.pool, fitter: self.sight.fitter, without, worse }
    }

    /// The free form of one place instead of all causes, where it says more than they do together.
    pub fn alone(&self) -> Option<ModelStep> {
        let set = &self.sight.judged.set;
        if self.findings.len() < 2 {
            return None;
        }
        let none = self.sight.state(&|_| false, self.scale);
        let best = survey_places(&[(none, None)], &self.groups, &self.around).remove(0).best.into_iter().next()?;
        let case = self.case();
        let [open, listed] = case.priors(self.beside.logs.len());
        let price: f64 = set.iter().map(|h| case.price(*h) - listed + *SIZE).sum();
        let more = best.log + open - (self.whole.log() - price);
        let all: Vec<usize> = (0..set.len()).collect();
        let sentence = || format!("a free form at {} says more than all causes: {more:.0} nats of evidence", best.place);
        (more > *STRONG).then(|| self.change(&all, 0.0).free(&best.terms, sentence()))?
    }

    /// A law of the list or the free form of a place beside everything.
    pub fn joining(&self, refused: &mut Vec<Place>) -> Option<ModelStep> {
        let price = (self.beside.logs.len().max(1) as f64).ln();
        let is_first = (0..self.sight.judged.set.len()).all(|i| !self.is_nameless(i));
        let least = price + if is_first { *FIRST } else { *STRONG };
        let strong = || self.beside.best.iter().filter(|form| form.log > least && !refused.contains(&form.place));
        let first = |form: &FreeForm| form.terms.first().map_or(f64::NEG_INFINITY, |term| term.log);
        let form = strong().max_by(|a, b| first(a).total_cmp(&first(b)))?;
        let whole = strong().max_by(|a, b| a.log.total_cmp(&b.log))?;
        let case = self.case();
        let [open, listed] = case.priors(self.beside.logs.len());
        let laws = case.listed(&[], &self.whole);
        let law = laws.into_iter().max_by(|a, b| a.log.total_cmp(&b.log)).filter(|law| law.log + listed > form.log + open);
        let named = law.and_then(|law| {
            let hypothesis = self.pool.hypotheses[law.at].clone();
            let sentence = format!("{} at {} joins: it says more than a free form", law.key.0, law.key.1);
            self.change(&[], 0.0).law(hypothesis, sentence)
        });
        let joined = |form: &FreeForm, terms: &[FreeTerm]| {
            let sentence = format!("a free form at {} joins: {:.0} nats of evidence", form.place, form.log);
            self.change(&[], 0.0).free(terms, sentence)
        };
        // What each place says alone tells where it is; all that one of them says may still be the better model.
        let free = || {
            let terms = self.own_terms(form);
            let is_more = whole.place != form.place || whole.terms.len() > terms.len();
            let all = || is_more.then(|| joined(whole, &whole.terms)).flatten();
            let (own, all) = rayon::join(|| joined(form, terms), all);
            let is_better = all.as_ref().is_some_and(|all| own.as_ref().is_none_or(|own| all.folds.is_better_than(&own.folds)));
            if is_better { all } else { own }
        };
        let step = named.or_else(free);
        if step.is_none() {
            refused.push(form.place);
        }
        step
    }

    /// The terms of a free form that say more than any other place does alone: what the others take up may belong there, and is asked again
    /// beside the first.
    fn own_terms<'f>(&self, form: &'f FreeForm) -> &'f [FreeTerm] {
        let elsewhere = self.beside.firsts.iter().filter(|(place, _)| *place != form.place).map(|(_, log)| *log);
        let most = elsewhere.fold(f64::NEG_INFINITY, f64::max);
        let own = form.terms.iter().skip(1).take_while(|term| term.log > most).count();
        &form.terms[..form.terms.len().min(own + 1)]
    }

    /// The odds of a finding; of a weak name none of the list is right but for what evidence misleads, and several names that take up loads
    /// are as a rule what one cause leaves that nobody listed.
    pub fn odds(&self, key: &FindingKey, own: &ContestedName) -> NameOdds {
        let none = if self.is_weak(key, own) {
            1.0 - *MISLED
        } else if self.is_one_of_several_of_loads(&own.members) {
            own.odds.none.max(self.case().least(*MIMICRY_OF_LOADS))
        } else {
            own.odds.none
        };
        NameOdds { none, ..own.odds }
    }

    fn is_one_of_several_of_loads(&self, members: &[usize]) -> bool {
        let takes_up = |cause: &usize| {
            let form = &self.sight.judged.state.causes[*cause].form;
            form.cause().takes_up_loads(form)
        };
        let findings = self.findings.values().filter(|members| members.iter().any(takes_up));
        members.iter().any(takes_up) && findings.count() > 1
    }

    fn is_nameless(&self, cause: usize) -> bool {
        self.sight.judged.state.causes[cause].form.cause().is_nameless()
    }

    /// Whether a name is hardly seen beside a free form, or one of many that would do there: what a free form does not follow looks like a
    /// small law of the list.
    fn is_weak(&self, key: &FindingKey, own: &ContestedName) -> bool {
        let beside_free = (0..self.sight.judged.set.len()).any(|i| self.is_nameless(i) && !own.members.contains(&i));
        let seen = || self.loss_without(&own.members) >= *SEEN && own.share_of_names >= *SHARED;
        beside_free && key.0 != names::UNKNOWN && !seen()
    }

    /// What the criterion loses without some causes.
    fn loss_without(&self, members: &[usize]) -> f64 {
        let set = &self.sight.judged.set;
        let bic = |with: &dyn Fn(usize) -> bool| {
            let mut some: Vec<usize> = (0..set.len()).filter(|i| with(*i)).map(|i| set[i]).collect();
            some.sort_unstable();
            self.pool.bic(&some)
        };
        bic(&|i| !members.contains(&i)) - bic(&|_| true)
    }

    /// The odds of every finding.
    pub fn contested(&self) -> BTreeMap<FindingKey, ContestedName> {
        let blocks = &self.sight.blocks;
        let causes = &self.sight.judged.state.causes;
        let own = |i: usize, of: usize| {
            let sizes = unit_variances(&causes[i], &blocks[i].square);
            self.sight.ranges[i].clone().zip(sizes.into_iter().map(move |variance| variance / of as f64))
        };
        let named = |(key, members): (&FindingKey, &'_ Vec<usize>)| NamedFinding {
            key: *key,
            members: members.clone(),
            own: members.iter().flat_map(|i| own(*i, members.len())).collect(),
        };
        let named: Vec<NamedFinding> = self.findings.iter().map(named).collect();
        let rest = |own: &NamedFinding| (self.sight.state(&|i| !own.members.contains(&i), self.scale), Some(own.key.1));
        let rests: Vec<(KnownCauses, Option<Place>)> = named.iter().map(rest).collect();
        let instead = survey_places(&rests, &self.groups, &self.around);
        let case = self.case();
        let odds = named.iter().zip(&rests).zip(&instead);
        odds.map(|((own, (rest, _)), instead)| (own.key, case.odds(own, rest, instead, &self.beside))).collect()
    }

    /// What stands in the place of a finding: a law of the list for what has no name, a free form for a name, or nothing.
    pub fn exchange(&self, contested: &BTreeMap<FindingKey, ContestedName>) -> Option<ModelStep> {
        let christened = contested.values().find_map(|own| {
            let law = self.pool.hypotheses[own.named?].clone();
            let sentence = format!("{} at {} says more than a law without a name", law.form.name(), law.form.place());
            self.change(&own.members, 0.0).law(law, sentence)
        });
        let freed = || {
            contested.iter().find_map(|((effect, place), own)| {
                let form = own.instead.as_ref()?;
                let sentence = format!("a free form at {} says more than {effect} at {place}", form.place);
                self.change(&own.members, 0.0).free(&form.terms, sentence)
            })
        };
        christened.or_else(freed).or_else(|| self.dropped(contested))
    }

    /// Without a finding that has nothing to explain beside the others; without a name that is smaller than its own uncertainty, or weak.
    pub fn dropped(&self, contested: &BTreeMap<FindingKey, ContestedName>) -> Option<ModelStep> {
        let state = &self.sight.judged.state;
        let small = |members: &[usize]| state.square_size(members).is_some_and(|size| size < 1.0);
        let weak = |key: &FindingKey, own| key.0 != names::UNKNOWN && (small(&contested[key].members) || self.is_weak(key, own));
        contested.iter().filter(|(key, own)| own.odds.log < 0.0 || weak(key, own)).find_map(|((effect, place), own)| {
            let sentence = format!("{effect} at {place} is withdrawn: nothing is left for it beside the others");
            self.change(&own.members, *WORSE).free(&[], sentence)
        })
    }
}

/// By how much the noise is larger, in squares, than what repeats and statements say: what the richest model leaves, repeats weighing in.
fn louder(frame: &ProjectedRows, whole: &KnownCauses, richest: Option<&FreeForm>, scale: f64, fitter: &Fitter) -> f64 {
    let left = frame.square() * scale - whole.gain() - richest.map_or(0.0, |form| form.gain);
    let repeats = 3.0 * fitter.repeatability.repeats as f64;
    let freedom = (frame.residual_rows().saturating_sub(frame.rank())) as f64 * scale;
    (repeats + left.max(0.0)) / (repeats + freedom).max(1.0)
}

//! The free form of a place: groups that join one after another while each pays for itself.

use super::evidence::{GroupEvidence, evidence, log_mean, log_sum};
use super::frame::{GroupProducts, ProjectedColumns, ProjectedRows};
use super::groups::{FreeGroup, GroupColumns};
use super::knots::with_knots;
use super::pairs::pairs;
use super::state::{AskedGroup, CauseColumns, KnownCauses};
use crate::criteria::open_world::{CLOSER, GROUPS, JUMPS, LEVELS, PAYS};
use crate::effect::{Place, Survey};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Columns of groups that are projected at once.
const COLUMNS: usize = 128;

/// A group in a free form.
#[derive(Debug, Clone)]
pub(super) struct FreeTerm {
    pub group: FreeGroup,
    /// Prior variances of its coefficients, SI.
    pub variances: Vec<f64>,
    /// ln of its evidence beside the terms before it, choices paid.
    pub log: f64,
}

/// What the free form of a place says.
#[derive(Debug, Clone)]
pub(super) struct FreeForm {
    pub place: Place,
    /// ln of its evidence over that of the state that it is beside; the choice among groups is in it.
    pub log: f64,
    pub terms: Vec<FreeTerm>,
    /// By how much the squared residual, over the noise, falls with it.
    pub gain: f64,
}

/// A group with what its evidence needs.
struct SeenGroup {
    group: FreeGroup,
    block: ProjectedColumns,
    /// Prior variances of its columns, a list a length.
    variances: Vec<Vec<f64>>,
    /// Products of the columns of the model's causes with its own.
    known: DMatrix<f64>,
}

impl SeenGroup {
    fn asked(&self) -> AskedGroup<'_> {
        AskedGroup { products: &self.block.products, known: &self.known, columns: &self.block.columns }
    }

    fn evidence(&self, seen: &GroupProducts, length: usize) -> GroupEvidence {
        evidence(&seen.gram, &seen.gradient, &self.variances[length])
    }
}

/// The groups of a place.
#[derive(Clone)]
pub(super) struct PlaceGroups {
    pub place: Place,
    groups: Vec<Arc<SeenGroup>>,
}

/// What a further group of a free form stands beside.
struct BesideTerms<'b, 'f, 'a> {
    /// The model's causes and the terms before it.
    state: &'b KnownCauses<'f>,
    terms: &'b [FreeTerm],
    around: &'b AroundGroups<'f, 'a>,
}

/// What the model's causes and the list are, beside which free forms are asked.
pub(super) struct AroundGroups<'f, 'a> {
    pub frame: &'f ProjectedRows<'a>,
    pub survey: &'f Survey<'f>,
    /// All causes of the model.
    pub causes: &'f CauseColumns,
    /// Names that are taken out of the list.
    pub without: &'f [String],
}

impl PlaceGroups {
    /// All groups; without their columns unless these are to be `kept`: only a free form of several groups needs them, beside causes alone
    /// products say all.
    pub fn of(place: Place, around: &AroundGroups, kept: bool) -> Self {
        let mut columns = GroupColumns::new(around.frame, around.survey);
        let all = columns.of(place);
        let mut out = Self { place, groups: Vec::new() };
        out.take(all, &mut columns, around, kept);
        out
    }

    /// With the products of two variables that what some states leave points at.
    pub fn with_pairs(&self, states: &[&KnownCauses], around: &AroundGroups, kept: bool) -> Self {
        let mut columns = GroupColumns::new(around.frame, around.survey);
        let mut out = self.clone();
        let new = pairs(self.place, states, around.frame, &mut columns, around.survey);
        out.take(new, &mut columns, around, kept);
        out
    }

    fn take(&mut self, groups: Vec<FreeGroup>, columns: &mut GroupColumns, around: &AroundGroups, kept: bool) {
        let mut groups = groups.into_iter().filter(|group| !group.is_listed(around.without));
        loop {
            let (mut some, mut raw) = (Vec::new(), Vec::new());
            while raw.len() < COLUMNS * around.frame.residual_rows()
                && let Some(group) = groups.next()
            {
                if let Some(own) = columns.raw(&group) {
                    some.push((group, own.len() / around.frame.residual_rows()));
                    raw.extend(own);
                }
            }
            if some.is_empty() {
                return;
            }
            let (all, square) = around.frame.projected(raw);
            let known = around.causes.with(&all);
            let mut first = 0;
            for (group, count) in some {
                let own = all.columns(first, count).into_owned();
                let mut block = around.frame.with_products(own, square[first..first + count].to_vec());
                let (variances, known) = (group.variances(&block), known.columns(first, count).into_owned());
                if !kept {
                    block.columns = DMatrix::zeros(0, 0);
                }
                self.groups.push(Arc::new(SeenGroup { group, block, variances, known }));
                first += count;
            }
        }
    }

    /// The evidence of every group beside a state, with its best length.
    fn scan(&self, state: &KnownCauses) -> Vec<(GroupEvidence, usize)> {
        let asked: Vec<AskedGroup> = self.groups.iter().map(|group| group.asked()).collect();
        let seen = state.beside(&asked);
        let of = |g: usize, length: usize| self.groups[g].evidence(&seen[g], length);
        let lengths = |g: usize| self.groups[g].variances.len();
        // Two lengths of all, every length of the best ones.
        let first = |g: usize| {
            let last = lengths(g) - 1;
            let ends: Vec<GroupEvidence> = if last == 0 { vec![of(g, 0)] } else { vec![of(g, 0), of(g, last)] };
            (mixed(&ends), if last > 0 && ends[1].log > ends[0].log { last } else { 0 })
        };
        let mut out: Vec<(GroupEvidence, usize)> = (0..self.groups.len()).map(first).collect();
        let mut order: Vec<usize> = (0..out.len()).filter(|g| lengths(*g) > 2).collect();
        order.sort_by(|a, b| out[*b].0.log.total_cmp(&out[*a].0.log));
        for g in order.into_iter().take(*CLOSER) {
            out[g] = closest(&(0..lengths(g)).map(|length| of(g, length)).collect::<Vec<_>>());
        }
        out
    }

    /// The evidence of a group with its lengths mixed, and the best of them.
    fn closest(&self, g: usize, state: &KnownCauses) -> (GroupEvidence, usize) {
        let group = &self.groups[g];
        let seen = state.beside_one(group.asked());
        closest(&(0..group.variances.len()).map(|length| group.evidence(&seen, length)).collect::<Vec<_>>())
    }

    /// Gives a group the numbers and the shape that say most, and asks so of what else a joint's travel leaves behind where it shows. Returns
    /// what all of it adds to ln of the evidence, choices paid.
    fn refine(&mut self, g: usize, columns: &mut GroupColumns, beside: &BesideTerms) -> f64 {
        let start = self.paid(g, beside.state);
        // The first group of a place decides which place it is.
        let relatives = if beside.terms.is_empty() { columns.relatives(&self.groups[g].group) } else { Vec::new() };
        let mut log = self.shaped((g, start), columns, beside);
        for alike in relatives {
            let first = self.groups.len();
            self.groups.push(self.groups[g].clone());
            let begun = self.exchanged((first, f64::NEG_INFINITY), alike, columns, beside);
            let other = self.shaped((first, begun.unwrap_or(f64::NEG_INFINITY)), columns, beside);
            if other > log {
                log = other;
                self.groups.swap(g, first);
            }
            self.groups.truncate(first);
        }
        log - start
    }

    /// Moves the numbers of a group's variables to where the evidence is largest, and gives it shorter waves, jumps or corners where these say
    /// more; returns the evidence of what stands there.
    fn shaped(&mut self, (g, mut log): (usize, f64), columns: &mut GroupColumns, beside: &BesideTerms) -> f64 {
        for level in 0..*LEVELS {
            let near = columns.near(&self.groups[g].group, level);
            if near.is_empty() {
                break;
            }
            log = self.exchanged((g, log), near, columns, beside).unwrap_or(log);
        }
        // The plainer of two shapes that say as much is kept; most curves have no jumps.
        let finer = columns.finer(&self.groups[g].group).into_iter().collect();
        log = self.exchanged((g, log + *PAYS), finer, columns, beside).unwrap_or(log);
        let knotted = with_knots(&self.groups[g].group, beside.state, columns);
        self.exchanged((g, log + *JUMPS), knotted, columns, beside).unwrap_or(log)
    }

    /// ln of the evidence of a group beside a state without the price of its place among others like it; none of an amplitude that no arm has.
    fn paid(&self, g: usize, state: &KnownCauses) -> f64 {
        let (found, _) = self.closest(g, state);
        if found.is_off_the_grid() { f64::NEG_INFINITY } else { found.log - (self.groups[g].group.of as f64).ln() }
    }

    /// Puts the best of other groups in the place of one, if its evidence is more than `log`, and returns it.
    fn exchanged(
        &mut self,
        (g, log): (usize, f64),
        others: Vec<FreeGroup>,
        columns: &mut GroupColumns,
        beside: &BesideTerms,
    ) -> Option<f64> {
        let first = self.groups.len();
        let others = others.into_iter().filter(|other| is_new(other, beside.terms)).collect();
        self.take(others, columns, beside.around, true);
        let tried = (first..self.groups.len()).map(|other| (other, self.paid(other, beside.state)));
        let best = tried.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, other)| *other > log);
        if let Some((other, _)) = best {
            self.groups.swap(g, other);
        }
        self.groups.truncate(first);
        best.map(|(_, better)| better)
    }

    /// The price of a group's choice: all motions and variables alike, and within a motion that steps all times.
    fn price(&self, g: usize) -> f64 {
        let choices: f64 = self.groups.iter().map(|seen| 1.0 / seen.group.of as f64).sum();
        choices.max(1.0).ln() + (self.groups[g].group.of as f64).ln()
    }

    /// ln of the evidence of all groups as alternatives, each with its price; none whose amplitude no arm can have.
    fn alternatives(&self, scan: &[(GroupEvidence, usize)]) -> f64 {
        let sound = scan.iter().enumerate().filter(|(_, (found, _))| !found.is_off_the_grid());
        log_sum(&sound.map(|(g, (found, _))| found.log - self.price(g)).collect::<Vec<_>>())
    }

    /// The same beside a state.
    pub fn first(&self, state: &KnownCauses) -> f64 {
        self.alternatives(&self.scan(state))
    }

    /// The free form beside a state.
    pub fn greedy(&mut self, state: &KnownCauses, around: &AroundGroups) -> FreeForm {
        let (mut now, mut terms): (_, Vec<FreeTerm>) = (state.clone(), Vec::new());
        let mut log = f64::NEG_INFINITY;
        let mut columns = GroupColumns::new(around.frame, around.survey);
        for step in 0..*GROUPS {
            let scan = self.scan(&now);
            let paid = |g: usize| scan[g].0.log - self.price(g);
            let sound = (0..scan.len()).filter(|g| !scan[*g].0.is_off_the_grid() && is_new(&self.groups[*g].group, &terms));
            let Some(best) = sound.max_by(|a, b| paid(*a).total_cmp(&paid(*b))) else { break };
            let mut own = if step == 0 { self.alternatives(&scan) } else { paid(best) };
            if step == 0 {
                log = own;
            }
            if step == 0 && paid(best) < 0.0 || step > 0 && own < *PAYS {
                break;
            }
            own += self.refine(best, &mut columns, &BesideTerms { state: &now, terms: &terms, around });
            let (_, length) = self.closest(best, &now);
            let first = self.groups.len();
            self.take(vec![self.groups[best].group.without_idle_waves(length)], &mut columns, around, true);
            let trimmed = if self.groups.len() > first { first } else { best };
            let (found, length) = self.closest(trimmed, &now);
            let square = found.amplitude * found.amplitude;
            let seen = self.groups[trimmed].clone();
            self.groups.truncate(first);
            let variances: Vec<f64> = seen.variances[length].iter().map(|variance| variance * square).collect();
            now = now.with(around.frame, &seen.block.columns, &variances);
            let group = seen.group;
            log = if step == 0 { own } else { log + own };
            terms.push(FreeTerm { group, variances, log: own });
            if step == 0 {
                let products = columns.products(&group);
                self.take(products, &mut columns, around, true);
            }
        }
        FreeForm { place: self.place, log, terms, gain: now.gain() - state.gain() }
    }
}

/// Whether no term of a free form has the same numbers by their names: a model holds each once.
fn is_new(group: &FreeGroup, terms: &[FreeTerm]) -> bool {
    let key = |group: &FreeGroup| group.hypothesis().form.key();
    terms.iter().all(|term| term.group.motion != group.motion || key(&term.group) != key(group))
}

/// The evidence of all lengths mixed, with the amplitude of the best, and which that is.
fn closest(all: &[GroupEvidence]) -> (GroupEvidence, usize) {
    let best = (0..all.len()).max_by(|a, b| all[*a].log.total_cmp(&all[*b].log)).unwrap_or(0);
    (GroupEvidence { log: log_mean(&all.iter().map(|one| one.log).collect::<Vec<_>>()), ..all[best] }, best)
}

fn mixed(all: &[GroupEvidence]) -> GroupEvidence {
    let best = all.iter().copied().max_by(|a, b| a.log.total_cmp(&b.log));
    let log = log_mean(&all.iter().map(|one| one.log).collect::<Vec<_>>());
    GroupEvidence { log, amplitude: best.map_or(0.0, |best| best.amplitude) }
}

/// Columns one after another as one matrix.
pub(super) fn side_by_side(blocks: &[ProjectedColumns], rows: usize) -> DMatrix<f64> {
    let all: Vec<f64> = blocks.iter().flat_map(|block| block.columns.iter().copied()).collect();
    DMatrix::from_vec(rows, all.len() / rows.max(1), all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Basis, Law, Motion, Variable};

    #[test]
    fn a_memory_with_another_time_is_not_new_beside_one_of_the_same_joint() {
        let recent = |joint, time| FreeGroup {
            motion: Motion::Joint { joint: 0 },
            law: Law::new(Variable::Recent { joint, time }, Basis::Cosines { low: 0.0, high: 1.0, count: 4 }),
            of: 3,
        };
        let terms = [FreeTerm { group: recent(0, 15.0), variances: vec![1.0; 4], log: 0.0 }];
        assert!(!is_new(&recent(0, 80.0), &terms) && is_new(&recent(1, 80.0), &terms));
    }
}

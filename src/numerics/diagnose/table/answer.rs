//! What a search has found, as findings: which components make one up, how probable its name and its place are, what else it may be; and where
//! the residual sits before and after.

use super::cause_table::CauseTable;
use super::cell::{CauseCell, FreeShape, Shapes};
use super::component::{CellColumns, Component};
use super::scan::{CellEvidence, CellScan};
use super::search::without;
use super::state::KnownState;
use crate::criteria::cells::{BENDS, MISLED, RIVAL, SWAPS};
use crate::diagnose::types::{
    ExplainedCell, ExplainedShare, Located, Probabilities, RivalCause, SpectrumLine,
};
use crate::effect::{Basis, Clock, Form, Place, Term, Variable, names};
use calib_engine::log_sum;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// One finding of a search.
#[derive(Clone)]
pub(crate) struct FoundCell {
    pub(crate) effect: Cow<'static, str>,
    pub(crate) place: Place,
    /// Positions of its forms among the causes of the model.
    pub(crate) members: Vec<usize>,
    /// ln of the evidence for it given all others.
    pub(crate) log: f64,
    /// ln of the prior odds of its cells.
    pub(crate) log_prior: f64,
    /// Fall of the squared residual in standard deviations, and by how many numbers.
    pub(crate) gain: f64,
    pub(crate) numbers: usize,
    pub(crate) probabilities: Probabilities,
    pub(crate) rivals: Vec<RivalCause>,
    /// Of each member: whether its coefficients are positive, and the largest of them (SI).
    pub(crate) bounds: Vec<(bool, f64)>,
}

impl FoundCell {
    /// That it is no cause at all with a probability, names and places as probable among the rest as before.
    pub(crate) fn or_nothing(&mut self, probability: f64) {
        let remaining = (1.0 - probability).max(0.0);
        let Probabilities { name, place, none } = self.probabilities;
        let none = remaining * none + probability;
        self.probabilities = Probabilities::new(remaining * name, remaining * place, none);
        for rival in &mut self.rivals {
            rival.probability *= remaining;
        }
    }
}

/// What the table says of the last model.
pub(crate) struct Answer {
    pub(crate) found: Vec<FoundCell>,
    /// Probability that no further cell is there, at the start and at the end.
    pub(crate) nothing_first: f64,
    pub(crate) nothing_last: f64,
    /// What the best further cell would be.
    pub(crate) next: Option<String>,
    pub(crate) located_first: Located,
    pub(crate) located_last: Located,
    /// Standard errors of forms that geometry may hide: cause and place with the form and its error, SI.
    pub(crate) hidden: Vec<(Form, f64)>,
    /// Positions of the components of a finding, and what is more probable in their stead.
    pub(super) better: Option<(Vec<usize>, Component)>,
}

impl CauseTable<'_, '_> {
    /// The name of a component.
    pub(super) fn name_of(&self, component: &Component) -> Cow<'static, str> {
        let cell = &self.cells[component.cell];
        let is_table = |form: &Form| form.term().is_some_and(Term::is_own_table);
        if cell.name == names::JOINT_COMPLIANCE && component.shape.is_bent {
            self.bent.into()
        } else if self.may_be_table(cell) && component.forms.iter().all(is_table) {
            names::JOINT_TABLE.into()
        } else {
            cell.name.clone()
        }
    }

    /// The name of a cell, whatever its shape.
    fn name_of_cell(&self, cell: &CauseCell) -> Cow<'static, str> {
        if self.may_be_table(cell) && cell.free().is_some_and(FreeShape::is_own_table) {
            names::JOINT_TABLE.into()
        } else {
            cell.name.clone()
        }
    }

    /// Whether a curve over the own angle of a cell's place has the name of a transmission.
    fn may_be_table(&self, cell: &CauseCell) -> bool {
        let turns =
            |place| matches!(place, Place::Joint(joint) if self.survey.robot.is_revolute(joint));
        !cell.is_named() && turns(cell.place) && self.has_tables
    }

    /// Components by name and place. A joint's curve over its own angle that is smaller than the unnamed components of that joint is grouped with
    /// them.
    fn by_name(
        &self,
        components: &[Component],
    ) -> BTreeMap<(Cow<'static, str>, Place), Vec<usize>> {
        let mut groups: BTreeMap<(Cow<'static, str>, Place), Vec<usize>> = BTreeMap::new();
        for (i, component) in components.iter().enumerate() {
            let cell = &self.cells[component.cell];
            let name = match self.name_of(component) {
                table if table == names::JOINT_TABLE => table,
                _ => cell.name.clone(),
            };
            groups.entry((name, cell.place)).or_default().push(i);
        }
        let square = |members: &Vec<usize>| {
            let sizes = members.iter().map(|i| components[*i].amplitude.powi(2));
            sizes.sum::<f64>()
        };
        let tables = groups
            .keys()
            .filter(|(name, _)| *name == names::JOINT_TABLE);
        let tables: Vec<Place> = tables.map(|(_, place)| *place).collect();
        for place in tables {
            let unnamed = groups
                .get(&(names::UNKNOWN.into(), place))
                .map_or(0.0, square);
            if square(&groups[&(names::JOINT_TABLE.into(), place)]) < unnamed {
                let members = groups.remove(&(names::JOINT_TABLE.into(), place));
                let all = groups.entry((names::UNKNOWN.into(), place)).or_default();
                all.extend(members.into_iter().flatten());
                all.sort_unstable();
            }
        }
        groups
    }

    /// The findings that components are; `first` is where the residual sat before any of them.
    pub(super) fn answer(&mut self, components: &[Component], first: (Located, f64)) -> Answer {
        let state = self.state(components, None);
        let scan = self.scan(&state, 4, &[]);
        let mut ranges = Vec::new();
        let mut at = 0;
        for component in components {
            ranges.push(at..at + component.forms.len());
            at += component.forms.len();
        }
        let (mut found, mut better) = (Vec::new(), None);
        for ((name, _), members) in self.by_name(components) {
            let (mut one, instead) = self.found(components, (&name, &members), state.kappa);
            one.members = members.iter().flat_map(|i| ranges[*i].clone()).collect();
            found.push(one);
            better = better.or(instead.map(|instead| (members, instead)));
        }
        join_tables(&mut found);
        let better = better.map(|(members, (cell, found))| (members, self.component(cell, &found)));
        let next = scan
            .best()
            .filter(|best| scan.log_odds[*best] > 0.0)
            .map(|best| {
                let cell = &self.cells[best];
                format!("most like {} at {}", cell.name, cell.place)
            });
        Answer {
            found,
            nothing_first: first.1,
            nothing_last: nothing(&scan),
            next,
            located_first: first.0,
            located_last: self.locate(&state),
            hidden: self.hidden(&state),
            better,
        }
    }

    /// The finding of some components: names and places given all others, at a noise; and a cell that alone is more probable than they are.
    fn found(
        &self,
        components: &[Component],
        (name, members): (&Cow<'static, str>, &[usize]),
        kappa: f64,
    ) -> (FoundCell, Option<(usize, CellEvidence)>) {
        let mut known = without(components, members);
        let state = self.state(&known, Some(kappa));
        let with = self.state(components, Some(kappa));
        // The strongest of several stands for its finding; further ones of its cell add to it.
        let log = |i: &usize| (*i, self.log_evidence(&components[*i], &state));
        let logs: BTreeMap<usize, f64> = members.iter().map(log).collect();
        let strongest = members.iter().max_by(|a, b| logs[*a].total_cmp(&logs[*b]));
        let main = *strongest.unwrap_or(&members[0]);
        let (component, log_main) = (&components[main], logs[&main]);
        let cell = component.cell;
        let mut log = log_main;
        known.push(component.clone());
        for i in members.iter().filter(|i| **i != main) {
            let given = self.state(&known, Some(kappa));
            log += self.log_evidence(&components[*i], &given).max(0.0);
            known.push(components[*i].clone());
        }
        let mut also = vec![cell];
        also.extend(self.over_its_variable(component, &state));
        let alike = self.alike(component, 60);
        let mut scan = self.scan_instead(component, &alike, &state, 8, &also);
        let priors = members
            .iter()
            .map(|i| self.cells[components[*i].cell].log_prior);
        let log_prior = priors.sum::<f64>();
        // Others are asked what the strongest does, and compete with all of them.
        scan.log_odds[cell] = (self.cells[cell].log_prior + log_main).max(log_prior + log);
        let least = scan.log_odds[cell] + *SWAPS;
        let better = scan.best().filter(|best| scan.log_odds[*best] > least);
        let better = better.and_then(|best| Some((best, scan.closely.get(&best)?.clone())));
        let place = self.cells[cell].place;
        let effect = match self.name_of(component) {
            table if table == names::JOINT_TABLE => name.clone(),
            other => other,
        };
        let (probabilities, rivals) = self.weigh((&effect, place), component, &scan);
        let bounds = members.iter().flat_map(|i| {
            let one = &components[*i];
            std::iter::repeat_n((one.positive, one.largest), one.forms.len())
        });
        let gain = (state.rows.square - with.rows.square).max(0.0);
        let found = FoundCell {
            effect,
            place,
            members: Vec::new(),
            log,
            log_prior,
            gain,
            numbers: members.iter().map(|i| components[*i].part.ncols()).sum(),
            probabilities,
            rivals,
            bounds: bounds.collect(),
        };
        (found, better)
    }

    /// Probabilities of a name and a place, and the rivals, by the odds of every cell and of nothing.
    fn weigh(
        &self,
        (effect, place): (&Cow<'static, str>, Place),
        component: &Component,
        scan: &CellScan,
    ) -> (Probabilities, Vec<RivalCause>) {
        let whole = log_of_all(scan);
        let mut shares: BTreeMap<(Cow<'static, str>, Place), f64> = BTreeMap::new();
        for (k, cell) in self.cells.iter().enumerate() {
            let probability = (scan.log_odds[k] - whole).exp();
            if probability < 1e-6 {
                continue;
            }
            // A bend pays for its further numbers here as where shapes are chosen.
            let bends = |found: &CellEvidence| {
                let bent = (found.bent - found.log).exp().clamp(0.0, 1.0);
                let paid = bent * (-*BENDS).exp();
                paid / (paid + (1.0 - bent)).max(f64::MIN_POSITIVE)
            };
            let bent = scan.closely.get(&k).map_or(0.0, bends);
            // What was refined stands for its cell.
            let bent = match k == component.cell && component.shape.is_bent {
                true => bent.max(0.9),
                false => bent,
            };
            if cell.name == names::JOINT_COMPLIANCE {
                *shares.entry((self.bent.into(), cell.place)).or_default() += bent * probability;
                *shares.entry((cell.name.clone(), cell.place)).or_default() +=
                    (1.0 - bent) * probability;
            } else {
                let name = if k == component.cell {
                    effect.clone()
                } else {
                    self.name_of_cell(cell)
                };
                *shares.entry((name, cell.place)).or_default() += probability;
            }
        }
        let sound = 1.0 - *MISLED;
        let name = sound * shares.get(&(effect.clone(), place)).copied().unwrap_or(0.0);
        let here = shares.iter().filter(|(key, _)| key.1 == place);
        let at_place = sound * here.map(|(_, share)| share).sum::<f64>();
        let rivals = shares.iter().filter(|(key, share)| {
            let (other, at) = key;
            (other, *at) != (effect, place) && **share > *RIVAL
        });
        let rival = |((other, at), share): (&(Cow<'static, str>, Place), &f64)| RivalCause {
            effect: other.clone(),
            place: *at,
            delta_bic: 2.0 * (name.max(1e-12) / (sound * share)).ln(),
            probability: sound * share,
        };
        let mut rivals: Vec<RivalCause> = rivals.map(rival).collect();
        rivals.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let rival_sum: f64 = rivals.iter().map(|rival| rival.probability).sum();
        (
            Probabilities::new(name, at_place, 1.0 - name - rival_sum),
            rivals,
        )
    }

    /// What each place, variable and order could explain of what a state leaves.
    pub(super) fn locate(&self, state: &KnownState) -> Located {
        let mut best: BTreeMap<(&'static str, String), ExplainedShare> = BTreeMap::new();
        let mut lines: BTreeMap<(usize, bool, u32), f64> = BTreeMap::new();
        let mut cells: BTreeMap<(Place, &'static str), ExplainedCell> = BTreeMap::new();
        let clock = Clock::of(self.survey.data);
        let all: Vec<usize> = (0..self.cells.len()).collect();
        let (across, first) = self.across_cells(&all, state);
        for ((cell, block), first) in self.cells.iter().zip(&self.coarse).zip(first) {
            for (group, shape, found) in state.shapes(block, &across, first) {
                let seen = &block.groups[group];
                let share = found.fit / state.rows.square.max(f64::MIN_POSITIVE);
                let shares = &seen.group.shapes[shape].shares;
                let parameters = shares.iter().filter(|share| **share > 0.0).count();
                let delta_bic = 2.0 * (found.log + cell.log_prior);
                let form = &seen.group.forms[0];
                let follows = form.follows(cell.place);
                let explains = self.frame.size(found.fit) * state.kappa;
                let new = ExplainedCell {
                    place: cell.place,
                    follows,
                    explains,
                    delta_bic,
                    effect: cell.name.clone(),
                };
                let at = cells.entry((cell.place, follows)).or_insert(new.clone());
                if new.delta_bic > at.delta_bic {
                    *at = new;
                }
                let variables = form.variables().into_iter();
                let variables: Vec<String> = variables.map(|asked| clock.named(asked)).collect();
                let mut names = vec![("place", cell.place.to_string())];
                if !variables.is_empty() {
                    names.push(("variable", variables.join(" and ")));
                }
                for (by, name) in names {
                    let new = ExplainedShare {
                        by,
                        name: name.clone(),
                        share,
                        parameters,
                        delta_bic,
                        effect: cell.name.clone(),
                    };
                    let at = best.entry((by, name)).or_insert(new.clone());
                    if new.delta_bic > at.delta_bic {
                        *at = new;
                    }
                }
                if let Some(line) = wave(form) {
                    let at = lines.entry(line).or_insert(0.0);
                    *at = at.max(share);
                }
            }
        }
        let mut shares: Vec<ExplainedShare> = best.into_values().collect();
        shares.sort_by(|a, b| {
            a.by.cmp(b.by)
                .then(b.share.total_cmp(&a.share))
                .then(a.name.cmp(&b.name))
        });
        let spectrum = lines
            .into_iter()
            .map(|((joint, motor, order), share)| SpectrumLine {
                joint,
                motor,
                order,
                share,
            });
        Located {
            shares,
            cells: cells.into_values().collect(),
            spectrum: spectrum.collect(),
        }
    }

    /// Standard errors of forms that geometry may hide.
    fn hidden(&self, state: &KnownState) -> Vec<(Form, f64)> {
        let mut out = Vec::new();
        for cell in self.cells.iter().filter(|cell| cell.is_named()) {
            let Shapes::Listed(groups) = &cell.shapes else {
                continue;
            };
            for group in groups {
                let [form] = &group.forms[..] else { continue };
                let is_found = |component: &Component| component.forms.contains(form);
                if form.cause().hidden(form, self.survey.robot).is_none()
                    || state.components.iter().any(is_found)
                {
                    continue;
                }
                let block = CellColumns::of(vec![group.clone()], self.frame);
                let errors = state.errors(&block, &self.across_block(&block, state));
                out.extend(errors.first().map(|error| (form.clone(), *error)));
            }
        }
        out
    }
}

/// Waves of a gear that are less probable than another curve of the same joint, where such a curve is found as well, are a part of that.
fn join_tables(found: &mut Vec<FoundCell>) {
    let is_table = |one: &FoundCell| one.effect == names::JOINT_TABLE;
    let tables: Vec<Place> = found
        .iter()
        .filter(|one| is_table(one))
        .map(|one| one.place)
        .collect();
    for place in tables {
        let is_part = |one: &FoundCell| {
            let Probabilities { name, none, .. } = one.probabilities;
            let mut rivals = one.rivals.iter();
            let curve =
                rivals.find(|rival| rival.effect == names::JOINT_TABLE && rival.place == place);
            one.place == place
                && one.effect == names::GEAR_CYCLIC
                && curve.is_some_and(|curve| curve.probability > name + none)
        };
        let parts: Vec<FoundCell> = found.extract_if(.., |one| is_part(one)).collect();
        let table = found
            .iter_mut()
            .find(|one| is_table(one) && one.place == place);
        let Some(table) = table else { continue };
        for part in parts {
            table.log += part.log.max(0.0);
            table.gain += part.gain;
            table.numbers += part.numbers;
            table.members.extend(part.members);
            table.bounds.extend(part.bounds);
            table.rivals.retain(|rival| rival.effect != part.effect);
        }
    }
}

/// ln of the odds of all cells and of nothing together.
fn log_of_all(scan: &CellScan) -> f64 {
    let odds = scan.log_odds.iter().copied().chain([0.0]);
    log_sum(&odds.collect::<Vec<_>>())
}

/// Probability that nothing more is there.
pub(super) fn nothing(scan: &CellScan) -> f64 {
    (-log_of_all(scan)).exp()
}

/// The joint, side of the gear and order of a pure sine and cosine of a joint's or its motor's angle at that joint.
fn wave(form: &Form) -> Option<(usize, bool, u32)> {
    let term = form.term()?;
    let (joint, variable) = term.of_one()?;
    let Basis::Wave {
        order,
        overtone: false,
    } = term.basis()
    else {
        return None;
    };
    let motor = variable == Variable::Motor { joint };
    (motor || variable == Variable::Angle { joint }).then_some((joint, motor, order))
}

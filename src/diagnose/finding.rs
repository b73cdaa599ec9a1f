//! Findings: what the chosen causes are called, how large they are, what else would explain them.

use super::Course;
use super::judge::Worth;
use super::pool::Pool;
use super::rivals::{exact, rivals};
use super::state::solve;
use super::statement::sentence;
use super::verdict::Looked;
use crate::effect::{
    AxisWobble, Backlash, Basis, Effect, Form, GearCyclic, JointCompliance, JointHardening, JointLogLag, Number, ParameterSpec,
    Place, ReductionRatio, Term, Told, Unknown, Variable, cause, people,
};
use crate::estimate::{Fate, Kind, Screening, Suspect, tail};
use std::collections::BTreeMap;

/// How well a finding stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evidence {
    pub f_statistic: f64,
    pub p_value: f64,
    /// How much worse the criterion is without it.
    pub delta_bic: f64,
    /// Fall of the held-out rms error, m; `None` where no rows are held out, or several effects make up the finding.
    pub heldout_gain: Option<f64>,
    /// Rms of the whole effect over the recording, m.
    pub effect_rms: f64,
    /// Fall of the whitened squared residual.
    pub gain: f64,
}

/// Another explanation that these data cannot tell apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    pub effect: &'static str,
    pub place: Place,
    pub delta_bic: f64,
}

/// A cause of what the base model leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    pub effect: &'static str,
    pub place: Place,
    pub statement: String,
    pub numbers: Vec<Number>,
    /// None for faults of single rows.
    pub evidence: Option<Evidence>,
    pub rivals: Vec<Rival>,
    /// Joint (from 0) and range (rad) over which it holds, for joint errors.
    pub valid: Option<(usize, [f64; 2])>,
    pub forms: Vec<Form>,
}

/// Effects that are faults of the recording, not of the robot.
const FAULTS: [&str; 3] = ["outlier", "mislabelled_point", "joint_log_lag"];

impl Finding {
    pub fn is_physics(&self) -> bool {
        !FAULTS.contains(&self.effect)
    }

    /// Whether nothing but a shape stands behind it.
    pub fn has_no_law(&self) -> bool {
        !self.forms.is_empty() && self.forms.iter().all(|form| form.cause().is_nameless())
    }
}

/// Chosen causes by the name that they are called and their place: positions among the chosen.
type Key = (&'static str, Place);
type Groups = BTreeMap<Key, Vec<usize>>;

/// The chosen causes as findings, strongest first.
pub(crate) fn findings(last: &Course, looked: &Looked) -> Vec<Finding> {
    if let Some(offset) = last.screening.apart {
        let rows = offset.abs();
        let how = if offset < 0 { "before" } else { "behind" };
        let text = format!(
            "the joints of a point stand {rows} rows {how} it: join the two logs anew, nothing else can be said until then"
        );
        return vec![of_the_recording("joint_log_lag", text)];
    }
    let pool = looked.pool;
    // The pool's sets are ascending; the chosen causes stand in their own order.
    let set = &looked.set;
    let mut sorted = set.clone();
    sorted.sort_unstable();
    let ranges = last.model.stack.effects().count() - last.chosen.len();
    let ranges: Vec<_> = last.model.stack.effects().skip(ranges).map(|(_, range)| range).collect();
    let mut groups: Groups = BTreeMap::new();
    for (i, k) in set.iter().enumerate() {
        let form = &pool.hypotheses[*k].form;
        let values = &last.model.x[ranges[i].clone()];
        groups.entry((form.called(values, looked.survey), form.place())).or_default().push(i);
    }
    refine(pool, &mut groups, set);
    both_angles(pool, &mut groups, set);
    wobbles(pool, &mut groups, set);
    // One wind-up a joint: a compliance beside a hardening of the same joint is part of it.
    let hard: Vec<Place> = groups.keys().filter(|key| key.0 == JointHardening::NAME).map(|key| key.1).collect();
    for place in hard {
        if let Some(more) = groups.remove(&(JointCompliance::NAME, place)) {
            groups.entry((JointHardening::NAME, place)).or_default().extend(more);
        }
    }
    let whole = solve(pool, &sorted);
    let bic = pool.bic(&sorted);
    let mut out = Vec::new();
    for ((effect, place), members) in groups {
        let own: Vec<usize> = members.iter().map(|i| set[*i]).collect();
        let mut rest: Vec<usize> = sorted.iter().copied().filter(|k| !own.contains(k)).collect();
        if !pool.bic(&rest).is_finite() {
            // Without the last joint that yields, the torque model moves nothing.
            rest.retain(|k| !pool.borrowed[*k]);
        }
        let without = solve(pool, &rest);
        let gain = whole.gain - without.gain;
        let rank = whole.rank.saturating_sub(without.rank).max(1);
        let freedom = pool.lines.saturating_sub(pool.rank() + whole.rank).max(1) as f64;
        let f_statistic = gain / rank as f64 / ((pool.square - whole.gain) / freedom) * pool.count / pool.lines as f64;
        let mut numbers = Vec::new();
        for i in &members {
            let range = &ranges[*i];
            for k in range.clone() {
                let spec = &last.model.stack.specs()[k];
                let sigma = match last.fitted.fates[k] {
                    Fate::Free(sigma) => Some(sigma),
                    _ => None,
                };
                let (unit, symbol) = people(spec.unit);
                let number = spec.name.strip_prefix(effect).unwrap_or(&spec.name).trim_start_matches('.');
                numbers.push(Number {
                    name: number.to_string(),
                    value: unit.from_si(last.model.x[k]),
                    unit: symbol,
                    sigma: sigma.map(|sigma| unit.from_si(sigma)),
                });
            }
        }
        let forms: Vec<Form> = members.iter().map(|i| last.chosen[*i].form.clone()).collect();
        let mut rivals = rivals(pool, &rest, &own, bic, (effect, place));
        exact(effect, &forms, &mut rivals);
        rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic).then(a.effect.cmp(b.effect)));
        let effect_rms = size(pool, members.iter().map(|i| (set[*i], &last.model.x[ranges[*i].clone()])));
        let evidence = Evidence {
            f_statistic,
            p_value: tail(f_statistic, rank as f64, freedom),
            delta_bic: pool.bic(&rest) - bic,
            heldout_gain: worth_of(&forms, place, &looked.worths),
            effect_rms,
            gain,
        };
        let table = forms.iter().find_map(|form| match form.term()?.basis() {
            Basis::Fading { low, high, .. } => Some([low, high]),
            _ => None,
        });
        let valid = match forms[0].place() {
            Place::Joint(joint) => Some((joint, table.unwrap_or(looked.survey.range[joint]))),
            _ => None,
        };
        let statement = sentence(effect, &Told { place, forms: &forms, numbers: &numbers }, effect_rms);
        out.push(Finding { effect, place, statement, numbers, evidence: Some(evidence), rivals, valid, forms });
    }
    let data = looked.survey.data;
    let by_the_way_there = |form: &Form| match form.variables().first() {
        Some(Variable::LastMove) => true,
        Some(of) => of.follows_the_way() && data.direction.is_none(),
        None => false,
    };
    // Nobody knows from where the arm came to the first row.
    let unknown = last.chosen.iter().any(|cause| by_the_way_there(&cause.form)).then_some(0);
    out.extend(faults(&last.screening, unknown));
    out.extend(reversals(last));
    let strength = |finding: &Finding| finding.evidence.map_or(0.0, |evidence| evidence.gain);
    out.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    out
}

/// What held-out rows say of forms of one effect at a place.
fn worth_of(forms: &[Form], place: Place, worths: &[Worth]) -> Option<f64> {
    let name = forms.first()?.name();
    let own = worths.iter().find(|worth| worth.effect == name && worth.place == place);
    own.filter(|_| forms.iter().all(|form| form.name() == name)).map(|worth| worth.gain)
}

/// A small rest at the joint of a strong finding is no cause of its own but the finer shape of the finding: it joins its group.
fn refine(pool: &Pool, groups: &mut Groups, set: &[usize]) {
    let mut sorted = set.to_vec();
    sorted.sort_unstable();
    let whole = solve(pool, &sorted).gain;
    let finer = |name| cause(name).map_or(&[] as &[&str], |cause| cause.finer());
    let gain = |members: &[usize]| {
        let own: Vec<usize> = members.iter().map(|i| set[*i]).collect();
        let rest: Vec<usize> = sorted.iter().copied().filter(|k| !own.contains(k)).collect();
        whole - solve(pool, &rest).gain
    };
    let gains: BTreeMap<Key, f64> = groups.iter().map(|(key, members)| (*key, gain(members))).collect();
    for (small, own) in &gains {
        let main = gains
            .iter()
            .filter(|(main, gain)| {
                let joins = main.1 == small.1 && *own < REFINEMENT * **gain && finer(main.0).contains(&small.0);
                // Both go with the side of the last move.
                joins || (main.0 == JointLogLag::NAME && small.0 == Backlash::NAME && *own < TRACE * **gain)
            })
            .max_by(|a, b| a.1.total_cmp(b.1));
        if let Some((main, _)) = main.filter(|(main, _)| groups.contains_key(*main)) {
            let members = groups.remove(small).unwrap_or_default();
            groups.entry(*main).or_default().extend(members);
        }
    }
}

/// What goes in proportion with an angle, or once or twice a turn with it, is a part of a joint's function of that angle and another.
fn both_angles(pool: &Pool, groups: &mut Groups, set: &[usize]) {
    let form = |i: &usize| &pool.hypotheses[set[*i]].form;
    let main = groups.iter().find_map(|(key, members)| {
        let angles = members.iter().find_map(|i| form(i).term()?.two_angles())?;
        let Place::Joint(joint) = form(&members[0]).place() else { return None };
        Some((*key, joint, angles))
    });
    let Some((main, joint, angles)) = main else { return };
    let is_part = |i: &usize| match (form(i).place(), form(i).term().map(Term::basis)) {
        (Place::Coupled(by, moved), _) => moved == joint && angles.contains(&by),
        (at, Some(Basis::Wave { order, .. })) if form(i).is(&GearCyclic) => {
            at == Place::Joint(joint) && angles.contains(&joint) && order <= SLOW
        }
        _ => false,
    };
    let parts: Vec<_> = groups.iter().filter(|(_, members)| members.iter().all(is_part)).map(|(key, _)| *key).collect();
    for part in parts {
        let members = groups.remove(&part).unwrap_or_default();
        groups.entry(main).or_default().extend(members);
    }
}

/// Orders that a smooth function of an angle may have, too.
const SLOW: u32 = 2;

/// What a neighbour seems to do with the angle of a joint whose axis wobbles is a part of that wobble.
fn wobbles(pool: &Pool, groups: &mut Groups, set: &[usize]) {
    // Of a joint that follows a sine of another joint's angle, that other joint.
    let by = |i: &usize| {
        let term = pool.hypotheses[set[*i]].form.term()?;
        match (term.basis(), term.of_one()) {
            (Basis::Wave { .. }, Some((joint, Variable::Angle { joint: by }))) if by != joint => {
                Some((AxisWobble::NAME, Place::Joint(by)))
            }
            _ => None,
        }
    };
    let unknown: Vec<Key> = groups.keys().filter(|key| key.0 == Unknown::NAME).copied().collect();
    for key in unknown {
        let wobble = groups[&key].iter().map(by).reduce(|a, b| if a == b { a } else { None }).flatten();
        if let Some(wobble) = wobble.filter(|wobble| groups.contains_key(wobble)) {
            let members = groups.remove(&key).unwrap_or_default();
            groups.entry(wobble).or_default().extend(members);
        }
    }
}

/// Joints that turn the other way than the robot file says.
fn reversals(last: &Course) -> Vec<Finding> {
    let specs = last.model.stack.specs().iter().zip(&last.model.x).zip(&last.fitted.fates);
    let reversed = specs
        .filter(|((spec, x), _)| spec.name.starts_with(ReductionRatio::NAME) && (*x - super::REVERSED).abs() < REVERSED_WITHIN);
    let one = |((spec, x), fate): ((&ParameterSpec, &f64), &Fate)| {
        let sigma = if let Fate::Free(sigma) = fate { Some(*sigma) } else { None };
        let place = spec.place;
        let statement =
            format!("{place} turns the other way than the robot file says: turn its axis there, or the sign of its column");
        let numbers = vec![Number { name: "k".into(), value: 1.0 + x, unit: "1", sigma }];
        Finding { place, numbers, ..of_the_recording(ReductionRatio::NAME, statement) }
    };
    reversed.map(one).collect()
}

/// A reversed joint's ratio is -1 to this.
const REVERSED_WITHIN: f64 = 0.1;

/// Less than this share of a finding's gain at its own joint is its finer shape; anywhere, of a lag of all joints.
const REFINEMENT: f64 = 0.1;
const TRACE: f64 = 0.05;

/// Rows of the recording that no model can follow, as findings; `unknown` is a row that the found causes cannot foretell.
fn faults(screening: &Screening, unknown: Option<usize>) -> Vec<Finding> {
    // What has no other explanation than that it is far out must be farther than this noise reaches.
    let far = |s: &Suspect| s.kind != Kind::Outlier || s.statistic > screening.reach;
    let of = |kinds: fn(Kind) -> bool| -> Vec<usize> {
        let own = screening.suspects.iter().filter(|s| !s.used() && kinds(s.kind) && Some(s.row) != unknown);
        own.filter(|s| far(s)).map(|s| s.row + 1).collect()
    };
    let list = |rows: &[usize]| {
        let named: Vec<String> = rows.iter().take(20).map(usize::to_string).collect();
        let more = rows.len().saturating_sub(20);
        format!("{}{}", named.join(", "), if more > 0 { format!(" and {more} more") } else { String::new() })
    };
    let mut out = Vec::new();
    let swapped = of(|kind| matches!(kind, Kind::Exchanged | Kind::Mislabelled));
    if !swapped.is_empty() {
        out.push(of_the_recording("mislabelled_point", format!("points carry another point's name: rows {}", list(&swapped))));
    }
    let shifted = of(|kind| matches!(kind, Kind::ShiftedBlock(_)));
    if !shifted.is_empty() {
        let text = format!("joints and points are rows apart in the recording: rows {}", list(&shifted));
        out.push(of_the_recording("joint_log_lag", text));
    }
    let wrong = of(|kind| matches!(kind, Kind::Outlier | Kind::UnitSlip(_) | Kind::Zero));
    if !wrong.is_empty() {
        out.push(of_the_recording("outlier", format!("single wrong points: rows {}", list(&wrong))));
    }
    out
}

/// A fault of the recording.
fn of_the_recording(effect: &'static str, statement: String) -> Finding {
    let place = Place::Recording;
    Finding { effect, place, statement, numbers: Vec::new(), evidence: None, rivals: Vec::new(), valid: None, forms: Vec::new() }
}

/// Rms length (m) of the whole effect over the fitted rows, the absorbed part included, of hypotheses with their fitted coefficients.
fn size<'a>(pool: &Pool, own: impl Iterator<Item = (usize, &'a [f64])>) -> f64 {
    // In standard deviations of the rows; the mean noise turns it into a length.
    let mut sum = vec![0.0; pool.lines];
    for (k, coefficients) in own {
        let columns = pool.lens.columns(&pool.hypotheses[k].form);
        for (column, coefficient) in columns.chunks(pool.lines).zip(coefficients) {
            sum.iter_mut().zip(column).for_each(|(value, c)| *value += c * coefficient);
        }
    }
    let rows = pool.lens.rows;
    let squares = rows.iter().enumerate().map(|(i, row)| {
        let whitened: f64 = (0..3).map(|axis| sum[3 * i + axis].powi(2)).sum();
        whitened * pool.lens.data.noise(*row).powi(2) / 3.0
    });
    (squares.sum::<f64>() / rows.len().max(1) as f64).sqrt()
}

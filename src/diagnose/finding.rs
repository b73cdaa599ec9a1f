//! Findings: what the chosen causes are called, how large they are, what else would explain them.

use super::Course;
use super::judge::Worth;
use super::pool::Pool;
use super::rivals::{exact, rivals};
use super::state::solve;
use super::statement::sentence;
use super::verdict::Looked;
use crate::effect::{Effect, Form, ParameterSpec, Place, Placed, ReductionRatio, Signature};
use crate::estimate::{Fate, Kind, Screening, Suspect, tail};
use crate::units::Unit;
use std::collections::BTreeMap;

/// A number of a finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    pub name: String,
    pub value: f64,
    pub unit: &'static str,
    pub sigma: Option<f64>,
}

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
    pub place: String,
    pub delta_bic: f64,
}

/// A cause of what the base model leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    pub effect: &'static str,
    pub place: String,
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
        !self.forms.is_empty() && self.forms.iter().all(|form| matches!(form, Form::Unknown(_)))
    }
}

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
    let mut groups: BTreeMap<(&'static str, String), Vec<usize>> = BTreeMap::new();
    for (i, k) in set.iter().enumerate() {
        let form = &pool.hypotheses[*k].form;
        let values = &last.model.x[ranges[i].clone()];
        let name = match form {
            Form::JointTable(_) if is_wavy(values) => "gear_cyclic",
            Form::JointHardening(law) if law.is_lost_motion(values, looked.survey.load(law.joint())) => "backlash",
            Form::Unknown(unknown) if unknown.is_hose() => "cable_drag",
            _ => form.name(),
        };
        groups.entry((name, form.place().to_string())).or_default().push(i);
    }
    refine(pool, &mut groups, set);
    both_angles(pool, &mut groups, set);
    wobbles(pool, &mut groups, set);
    // One wind-up a joint: a compliance beside a hardening of the same joint is part of it.
    let hard: Vec<String> = groups.keys().filter(|key| key.0 == "joint_hardening").map(|key| key.1.clone()).collect();
    for place in hard {
        if let Some(more) = groups.remove(&("joint_compliance", place.clone())) {
            groups.entry(("joint_hardening", place)).or_default().extend(more);
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
        let mut rivals = rivals(pool, &rest, &own, bic, (effect, &place));
        exact(effect, &forms, &place, &mut rivals);
        rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic).then(a.effect.cmp(b.effect)));
        let effect_rms = size(pool, members.iter().map(|i| (set[*i], &last.model.x[ranges[*i].clone()])));
        let evidence = Evidence {
            f_statistic,
            p_value: tail(f_statistic, rank as f64, freedom),
            delta_bic: pool.bic(&rest) - bic,
            heldout_gain: worth_of(&forms, &place, &looked.worths),
            effect_rms,
            gain,
        };
        let table = forms.iter().find_map(|form| if let Form::JointTable(table) = form { Some(table.range()) } else { None });
        let valid = match forms[0].place() {
            Place::Joint(joint) => Some((joint, table.unwrap_or(looked.survey.range[joint]))),
            _ => None,
        };
        let statement = sentence(effect, &place, &forms, &numbers, effect_rms);
        out.push(Finding { effect, place, statement, numbers, evidence: Some(evidence), rivals, valid, forms });
    }
    let data = looked.survey.data;
    let by_the_way_there = |form: &Form| match form {
        Form::JointLogLag(lag) => !lag.is_time(),
        Form::Backlash(_) => data.direction.is_none(),
        _ => false,
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
fn worth_of(forms: &[Form], place: &str, worths: &[Worth]) -> Option<f64> {
    let name = forms.first()?.name();
    let own = worths.iter().find(|worth| worth.effect == name && worth.place == place);
    own.filter(|_| forms.iter().all(|form| form.name() == name)).map(|worth| worth.gain)
}

/// Cosines of a curve up to this one make at most two periods over its range.
const SMOOTH: usize = 4;

/// Whether a curve has most of its variance in waves of more than two periods over its range: a gear or an encoder.
fn is_wavy(coefficients: &[f64]) -> bool {
    let square = |some: &[f64]| some.iter().map(|c| c * c).sum::<f64>();
    2.0 * square(&coefficients[SMOOTH.min(coefficients.len())..]) > square(coefficients)
}

/// What else an effect's own shape may leave at the same joint where it is not quite that of the library.
fn leaves(main: &str) -> &'static [&'static str] {
    match main {
        "counterbalance" | "cable_drag" => &["gear_cyclic", "unknown", "joint_table", "backlash"],
        "joint_hardening" => &["backlash", "unknown"],
        "joint_compliance" => &["unknown"],
        "backlash" => &["joint_hardening", "joint_compliance", "unknown"],
        "viscous_windup" => &["backlash", "gear_cyclic", "unknown"],
        "gear_cyclic" | "joint_table" => &["unknown"],
        "unknown" => &["gear_cyclic", "joint_table"],
        _ => &[],
    }
}

/// A small rest at the joint of a strong finding is no cause of its own but the finer shape of the finding: it joins its group.
fn refine(pool: &Pool, groups: &mut BTreeMap<(&'static str, String), Vec<usize>>, set: &[usize]) {
    let mut sorted = set.to_vec();
    sorted.sort_unstable();
    let whole = solve(pool, &sorted).gain;
    let gain = |members: &[usize]| {
        let own: Vec<usize> = members.iter().map(|i| set[*i]).collect();
        let rest: Vec<usize> = sorted.iter().copied().filter(|k| !own.contains(k)).collect();
        whole - solve(pool, &rest).gain
    };
    let gains: BTreeMap<(&'static str, String), f64> = groups.iter().map(|(key, members)| (key.clone(), gain(members))).collect();
    for (small, own) in &gains {
        let main = gains
            .iter()
            .filter(|(main, gain)| {
                let finer = main.1 == small.1 && *own < REFINEMENT * **gain && leaves(main.0).contains(&small.0);
                // Both go with the side of the last move.
                finer || (main.0 == "joint_log_lag" && small.0 == "backlash" && *own < TRACE * **gain)
            })
            .max_by(|a, b| a.1.total_cmp(b.1));
        if let Some((main, _)) = main.filter(|(main, _)| groups.contains_key(*main)) {
            let members = groups.remove(small).unwrap_or_default();
            groups.entry(main.clone()).or_default().extend(members);
        }
    }
}

/// What goes in proportion with an angle, or once or twice a turn with it, is a part of a joint's function of that angle and another.
fn both_angles(pool: &Pool, groups: &mut BTreeMap<(&'static str, String), Vec<usize>>, set: &[usize]) {
    let form = |i: &usize| &pool.hypotheses[set[*i]].form;
    let main = groups.iter().find_map(|(key, members)| {
        let angles =
            members.iter().find_map(|i| if let Form::Unknown(unknown) = form(i) { unknown.two_angles() } else { None })?;
        let Place::Joint(joint) = form(&members[0]).place() else { return None };
        Some((key.clone(), joint, angles))
    });
    let Some((main, joint, angles)) = main else { return };
    let is_part = |i: &usize| match form(i) {
        Form::GearCyclic(gear) => gear.joint() == joint && angles.contains(&joint) && gear.order() <= SLOW,
        other => matches!(other.place(), Place::Coupled(by, moved) if moved == joint && angles.contains(&by)),
    };
    let parts: Vec<_> = groups.iter().filter(|(_, members)| members.iter().all(is_part)).map(|(key, _)| key.clone()).collect();
    for part in parts {
        let members = groups.remove(&part).unwrap_or_default();
        groups.entry(main.clone()).or_default().extend(members);
    }
}

/// Orders that a smooth function of an angle may have, too.
const SLOW: u32 = 2;

/// What a neighbour seems to do with the angle of a joint whose axis wobbles is a part of that wobble.
fn wobbles(pool: &Pool, groups: &mut BTreeMap<(&'static str, String), Vec<usize>>, set: &[usize]) {
    let by = |i: &usize| match &pool.hypotheses[set[*i]].form {
        Form::Unknown(unknown) => match unknown.signature() {
            Signature::Periodic { by, .. } => Some(("axis_wobble", Place::Joint(by).to_string())),
            _ => None,
        },
        _ => None,
    };
    let unknown: Vec<(&'static str, String)> = groups.keys().filter(|key| key.0 == "unknown").cloned().collect();
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
        let place = spec.place.clone();
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
    let place = Place::Recording.to_string();
    Finding { effect, place, statement, numbers: Vec::new(), evidence: None, rivals: Vec::new(), valid: None, forms: Vec::new() }
}

/// The unit in which people read a number of this unit.
fn people(unit: Unit) -> (Unit, &'static str) {
    match unit {
        Unit::Radian => (Unit::Arcsecond, "arcsec"),
        Unit::Second => (Unit::Millisecond, "ms"),
        Unit::RadianPerRadianPerSecond => (Unit::ArcsecondPerDegreePerSecond, "arcsec/(deg/s)"),
        other => (other, other.symbol()),
    }
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

//! Findings: what the chosen causes are called, how large they are, what else would explain them.

use super::Course;
use super::group::{groups, ranges};
use super::judge::Worth;
use super::pool::Pool;
use super::rivals::{exact, rivals};
use super::state::solve;
use super::statement::sentence;
use super::verdict::Looked;
use crate::effect::{
    Basis, Clock, Effect, Form, JointLogLag, Number, ParameterSpec, Place, ReductionRatio, Told, Variable, people,
};
use crate::error::counted;
use crate::estimate::{Fate, Kind, Screening, Suspect, tail};

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

/// The chosen causes as findings, strongest first.
pub(crate) fn findings(last: &Course, looked: &Looked) -> Vec<Finding> {
    if let Some(offset) = last.screening.apart {
        let rows = counted(offset.unsigned_abs() as usize, "row");
        let how = if offset < 0 { "before" } else { "behind" };
        let text =
            format!("the joints of a point stand {rows} {how} it: join the two logs anew, nothing else can be said until then");
        return vec![of_the_recording(JointLogLag::NAME, text)];
    }
    let pool = looked.pool;
    // The pool's sets are ascending; the chosen causes stand in their own order.
    let set = &looked.set;
    let mut sorted = set.clone();
    sorted.sort_unstable();
    let ranges = ranges(last);
    let groups = groups(last, set, pool, looked.survey);
    let whole = solve(pool, &sorted);
    let clock = Clock::of(looked.survey.data);
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
        let statement = sentence(effect, &Told { place, forms: &forms, numbers: &numbers, clock }, effect_rms);
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
        let noun = if rows.len() == 1 { "row" } else { "rows" };
        format!("{noun} {}{}", named.join(", "), if more > 0 { format!(" and {more} more") } else { String::new() })
    };
    let mut out = Vec::new();
    let swapped = of(|kind| matches!(kind, Kind::Exchanged | Kind::Mislabelled));
    if !swapped.is_empty() {
        out.push(of_the_recording("mislabelled_point", format!("points carry another point's name: {}", list(&swapped))));
    }
    let shifted = of(|kind| matches!(kind, Kind::ShiftedBlock(_)));
    if !shifted.is_empty() {
        let text = format!("joints and points are rows apart in the recording: {}", list(&shifted));
        out.push(of_the_recording("joint_log_lag", text));
    }
    let wrong = of(|kind| matches!(kind, Kind::Outlier | Kind::UnitSlip(_) | Kind::Zero));
    if !wrong.is_empty() {
        out.push(of_the_recording("outlier", format!("single wrong points: {}", list(&wrong))));
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

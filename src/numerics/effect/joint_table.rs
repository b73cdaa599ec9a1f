//! `joint_table`: a repeatable error of a joint of no simple form, as a curve over the range that was measured.

use super::{
    Basis, Cause, Gaps, Hypothesis, Law, Motion, NumberSpec, ParameterEstimate, Summary, Survey, Term, Variable, about, names,
};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;
use crate::units::Unit;
use std::f64::consts::PI;

/// A free curve of a joint over its angle.
pub struct JointTable;

/// Highest orders per joint turn that a curve resolves.
const RESOLUTIONS: [f64; 3] = [12.0, 24.0, 36.0];
/// Measured values for each number of a curve.
const VALUES_EACH: f64 = 20.0;
/// Rows within a wave of an end of the range.
const SUPPORT: usize = 5;
/// Rows within a wave anywhere between; with fewer the curve is straight there.
const SUPPORT_BETWEEN: usize = 3;
/// Places within a wave at which that is asked.
const PLACES: f64 = 8.0;
/// How large a number of a curve may be, rad (60 arcsec): holds it down where points are sparse.
pub(super) const PLAUSIBLE: f64 = 3e-4;
/// Cosines of a curve up to this one make at most two periods over its range.
const SMOOTH: usize = 4;

impl Cause for JointTable {
    fn stands_in_for_two(&self) -> bool {
        true
    }

    about! {
        name: names::JOINT_TABLE,
        place: "joint",
        formula: "d = a smooth curve of q over the measured range",
        size: "5 to 200 arcsec",
        confounded: "gear_cyclic",
        needs: "many points",
        absorbs_residual: &[names::UNKNOWN],
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for joint in survey.revolute() {
            let mut q: Vec<f64> = survey.rows.iter().map(|row| survey.data.q(*row)[joint]).collect();
            q.sort_by(f64::total_cmp);
            for resolution in RESOLUTIONS {
                let wave = 2.0 * PI / resolution;
                let Some([low, high]) = well_covered(&q, wave) else { continue };
                let gaps = gaps(&q, wave, [low, high]);
                let count = (resolution * (high - low) / PI).ceil();
                if count >= 1.0 && 3.0 * survey.rows.len() as f64 > VALUES_EACH * count {
                    let law = Law::new(Variable::Angle { joint }, Basis::Fading { low, high, count: count as usize, gaps });
                    let term = Term::new(&Self, Motion::Joint { joint }, law);
                    out.push(Hypothesis::new(term, RESOLUTIONS.len()).penalised(*RARE));
                }
            }
        }
        out
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        (1..=term.law().count()).map(|k| (format!("cos{k}"), Unit::Radian, PLAUSIBLE)).collect()
    }

    /// With most of its variance in waves of more than two periods over its range: a gear or an encoder.
    fn called(&self, _term: &Term, p: &[f64], _survey: &Survey) -> &'static str {
        let square = |some: &[f64]| some.iter().map(|c| c * c).sum::<f64>();
        if 2.0 * square(&p[SMOOTH.min(p.len())..]) > square(p) { names::GEAR_CYCLIC } else { names::JOINT_TABLE }
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("{} has a repeatable error of no simple form, kept as a table", summary.place)
    }
}

/// The strongest orders per joint turn of a table, in words.
pub(super) fn strongest_orders(table: &Term, numbers: &[&ParameterEstimate]) -> String {
    let Basis::Fading { low, high, .. } = table.basis() else { return String::new() };
    let mut waves: Vec<(f64, f64)> = (1..).zip(numbers).map(|(k, n)| (f64::from(k), n.value.abs())).collect();
    waves.sort_by(|a, b| b.1.total_cmp(&a.1));
    // A cosine of k half periods over the range makes k pi / range periods a turn.
    let orders = waves.iter().take(4).map(|(k, _)| format!("{:.0}", k * PI / (high - low)));
    format!("a curve, strongest about {} times a turn", orders.collect::<Vec<_>>().join(", "))
}

/// The range of a joint's sorted positions without sparse ends: within a wave (rad) of either end there are some rows.
fn well_covered(q: &[f64], wave: f64) -> Option<[f64; 2]> {
    let covered = |some: &[f64]| some[SUPPORT - 1] - some[0] < wave;
    let low = q.windows(SUPPORT).find(|some| covered(some))?[0];
    let high = q.windows(SUPPORT).rfind(|some| covered(some))?[SUPPORT - 1];
    (high > low).then_some([low, high])
}

/// The two widest stretches of a range (rad) of sorted positions in which a wave holds too few rows.
fn gaps(q: &[f64], wave: f64, [low, high]: [f64; 2]) -> Gaps {
    let step = wave / PLACES;
    let below = |limit: f64| q.partition_point(|value| *value < limit);
    let sparse = |u: f64| below(u + 0.5 * wave) - below(u - 0.5 * wave) < SUPPORT_BETWEEN;
    // Ends are supported by rows within a whole wave of them.
    let places = ((high - low - wave) / step).floor().max(0.0) as usize;
    let mut found: Vec<[f64; 2]> = Vec::new();
    for u in (0..=places).map(|k| low + 0.5 * wave + k as f64 * step).filter(|u| sparse(*u)) {
        match found.last_mut() {
            Some(last) if u - last[1] < 1.5 * step => last[1] = u,
            _ => found.push([u, u]),
        }
    }
    found.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
    let mut widest = found.into_iter().filter(|[low, high]| high > low);
    Gaps([0; 2].map(|_: i32| widest.next().unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// deg
    fn found(q: impl Iterator<Item = f64>, wave: f64) -> Vec<[f64; 2]> {
        let q: Vec<f64> = q.map(f64::to_radians).collect();
        let wave = wave.to_radians();
        let range = well_covered(&q, wave).expect("rows");
        let Gaps(all) = gaps(&q, wave, range);
        all.into_iter().filter(|[low, high]| high > low).map(|gap| gap.map(f64::to_degrees)).collect()
    }

    #[test]
    fn a_table_knows_where_there_was_but_one_row_in_twenty_degrees() {
        let rows = |k: i32| f64::from(k);
        let whole = found((0..120).map(rows), 10.0);
        assert!(whole.is_empty(), "{whole:?}");
        let isolated = (0..=50).chain([60]).chain(70..=120).map(rows);
        let gaps = found(isolated, 10.0);
        let [[low, high]] = gaps[..] else { panic!("{gaps:?}") };
        assert!((50.0..55.0).contains(&low) && (65.0..70.0).contains(&high), "{low} to {high}");
        // A wave that is longer than the gap has rows enough.
        assert!(found((0..=50).chain([60]).chain(70..=120).map(rows), 30.0).is_empty());
    }
}

//! `joint_table`: a repeatable error of a joint of no simple form, as a curve over the range that was measured.

use super::{
    Basis, Cause, CauseDescription, Hypothesis, Law, Motion, NumberSpec, ParameterEstimate, Summary, Survey, Term, Variable,
};
use crate::robot::RobotModel;
use crate::units::Unit;
use std::f64::consts::PI;

pub struct JointTable;

/// Highest orders per joint turn that a curve resolves.
const RESOLUTIONS: [f64; 3] = [12.0, 24.0, 36.0];
/// Measured values for each number of a curve.
const VALUES_EACH: f64 = 20.0;
/// Rows within a wave of an end of the range.
const SUPPORT: usize = 5;
/// How large a number of a curve may be, rad (60 arcsec): holds it down where points are sparse.
pub(super) const PLAUSIBLE: f64 = 3e-4;
/// Cosines of a curve up to this one make at most two periods over its range.
const SMOOTH: usize = 4;

impl JointTable {
    pub const NAME: &'static str = "joint_table";
}

impl Cause for JointTable {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: Self::NAME,
            place: "joint",
            formula: "d = a smooth curve of q over the measured range",
            size: "5 to 200 arcsec",
            confounded: "gear_cyclic",
            needs: "many points",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for joint in survey.revolute() {
            for resolution in RESOLUTIONS {
                let Some([low, high]) = well_covered(survey, joint, 2.0 * PI / resolution) else { continue };
                let count = (resolution * (high - low) / PI).ceil();
                if count >= 1.0 && 3.0 * survey.rows.len() as f64 > VALUES_EACH * count {
                    let law = Law::new(Variable::Angle { joint }, Basis::Fading { low, high, count: count as usize });
                    let term = Term::new(&Self, Motion::Joint { joint }, law);
                    out.push(Hypothesis::new(term, RESOLUTIONS.len()).penalised(4.0));
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
        if 2.0 * square(&p[SMOOTH.min(p.len())..]) > square(p) { "gear_cyclic" } else { Self::NAME }
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("{} has a repeatable error of no simple form, kept as a table", summary.place)
    }

    fn finer(&self) -> &'static [&'static str] {
        &["unknown"]
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

/// The range of a joint without sparse ends: within a wave (rad) of either end there are some rows.
fn well_covered(survey: &Survey, joint: usize, wave: f64) -> Option<[f64; 2]> {
    let mut q: Vec<f64> = survey.rows.iter().map(|row| survey.data.q(*row)[joint]).collect();
    q.sort_by(f64::total_cmp);
    let covered = |some: &[f64]| some[SUPPORT - 1] - some[0] < wave;
    let low = q.windows(SUPPORT).find(|some| covered(some))?[0];
    let high = q.windows(SUPPORT).rfind(|some| covered(some))?[SUPPORT - 1];
    (high > low).then_some([low, high])
}

//! The verdict of a diagnosis, with errors before and after.

crate::table::rows! { "verdict",
    /// One row a diagnosis; key `step`. Errors are of held-out rows where there are any, suspects among them.
    pub struct Verdict of VerdictRow {
        step: String,
        /// `explained`, `nothing_missing`, `unexplained`, `not_asked` of too few rows, or `wrong_setup`.
        verdict: String,
        /// The same in a sentence, with what its noise rests on.
        statement: Option<String>,
        /// `repeats`, `instrument` or `inferred`.
        noise_basis: Option<String>,
        /// Rms length of the noise of these rows: instrument and joint repeatability.
        noise_floor_mm: Option<f64>,
        /// Whether the errors are of rows that no model has seen.
        held_out: bool,
        before_mean_mm: Option<f64>,
        before_rms_mm: Option<f64>,
        before_max_mm: Option<f64>,
        after_mean_mm: Option<f64>,
        after_rms_mm: Option<f64>,
        after_max_mm: Option<f64>,
        /// Rms length of what is left at fitted rows.
        leftover_rms_mm: Option<f64>,
        /// The same figures where the rows to fit measured angles and no length.
        noise_floor_rad: Option<f64>,
        before_rms_rad: Option<f64>,
        after_rms_rad: Option<f64>,
        leftover_rms_rad: Option<f64>,
        /// Squared whitened residual per degree of freedom.
        chi_square: f64,
        /// Probability that what the base model leaves, and what is left in the end, is noise; null where it was not asked.
        p_before: Option<f64>,
        p_after: Option<f64>,
        /// Standard deviation of every joint from move to move.
        repeatability_rad: f64,
        /// Repeats of a target in a pose that it rests on.
        repeats: i64,
        /// Rows that were fitted.
        points: i64,
        /// What these data cannot show, one sentence a line.
        not_observable: String,
        /// What is left looks like, where it is not noise.
        signature: Option<String>,
        /// What to measure next, one sentence a line.
        next_measurements: Option<String>,
        /// Findings that the fit of the whole model left without size or made worse, one sentence a line.
        withdrawn: Option<String>,
        /// What counts time in statements and in the forms of findings: `s`, or `row` of the recording where it has no clock.
        clock: Option<String>,
    }
}

use super::Findings;
use crate::diagnose::{Diagnosis, ErrorLengths, VerdictKind};
use crate::observation::Dimension;
use crate::robot::NoiseBasis;

impl VerdictRow {
    /// Whether something is left that neither a finding nor noise explains.
    pub fn is_unexplained(&self) -> bool {
        self.verdict == VerdictKind::Unexplained.name()
    }

    /// Whether nothing is known of the noise: neither was it stated nor measured, nor is it what the joints scatter by.
    pub fn is_noise_assumed(&self) -> bool {
        self.is_noise_inferred() && self.repeatability_rad == 0.0
    }

    /// Whether the noise was neither stated nor measured.
    pub fn is_noise_inferred(&self) -> bool {
        self.noise_basis.as_deref() == Some(NoiseBasis::Inferred.name())
    }
}

impl Verdict {
    /// What is wrong with the set-up, where a diagnosis says so: `findings` are its own.
    pub fn wrong_setup(&self, findings: &Findings) -> Option<String> {
        let wrong = self.0.iter().any(|row| row.verdict == VerdictKind::WrongSetup.name());
        let first = findings.0.first().map(|finding| finding.statement.as_str()).unwrap_or_default();
        wrong.then(|| format!("the set-up is wrong: {first}").trim_end_matches('.').to_string())
    }

    /// The verdict of the stage `step`.
    pub fn of(step: &str, diagnosis: &Diagnosis) -> Self {
        let lengths = diagnosis.dimension == Dimension::Length;
        let in_mm = |size: f64| lengths.then_some(size * 1e3);
        let in_rad = |size: f64| (!lengths).then_some(size);
        let mm = |errors: Option<ErrorLengths>, of: fn(ErrorLengths) -> f64| errors.and_then(|errors| in_mm(of(errors)));
        let rms_rad = |errors: Option<ErrorLengths>| errors.and_then(|errors| in_rad(errors.rms));
        Self(vec![VerdictRow {
            step: step.into(),
            verdict: diagnosis.verdict.name().into(),
            statement: Some(diagnosis.statement.clone()),
            noise_basis: Some(diagnosis.noise_basis.name().into()),
            noise_floor_mm: in_mm(diagnosis.noise_floor),
            held_out: diagnosis.held_out,
            before_mean_mm: mm(diagnosis.before, |e| e.mean),
            before_rms_mm: mm(diagnosis.before, |e| e.rms),
            before_max_mm: mm(diagnosis.before, |e| e.max),
            after_mean_mm: mm(diagnosis.after, |e| e.mean),
            after_rms_mm: mm(diagnosis.after, |e| e.rms),
            after_max_mm: mm(diagnosis.after, |e| e.max),
            leftover_rms_mm: in_mm(diagnosis.leftover_rms),
            noise_floor_rad: in_rad(diagnosis.noise_floor),
            before_rms_rad: rms_rad(diagnosis.before),
            after_rms_rad: rms_rad(diagnosis.after),
            leftover_rms_rad: in_rad(diagnosis.leftover_rms),
            chi_square: diagnosis.chi_square,
            p_before: diagnosis.gate_first,
            p_after: diagnosis.gate_last,
            repeatability_rad: diagnosis.repeatability.sigma,
            repeats: diagnosis.repeatability.repeats as i64,
            points: diagnosis.kept.len() as i64,
            not_observable: diagnosis.not_observable.join("\n"),
            signature: diagnosis.signature.clone(),
            next_measurements: (!diagnosis.next_measurements.is_empty()).then(|| diagnosis.next_measurements.join("\n")),
            withdrawn: (!diagnosis.withdrawn.is_empty()).then(|| diagnosis.withdrawn.join("\n")),
            clock: Some(if diagnosis.clock { "s" } else { "row" }.into()),
        }])
    }
}

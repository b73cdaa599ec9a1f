//! Too few rows to ask what was left out: the nominal robot in its place, and no findings.

use super::misfit::Misfit;
use super::types::{Diagnosis, ErrorLengths, JointRepeatability, Located, Question, VerdictKind};
use super::verdict_statement::statement;
use crate::effect::{BasePlacement, Effect, EffectStack};
use crate::estimate::{FitOptions, Model, align, fit_screened};

/// Fewest rows to fit: geometry alone takes some thirty parameters from three of each row.
pub(crate) const FEWEST: usize = 15;

/// The nominal robot with its base where the rows to fit have it.
pub(crate) fn not_asked(question: &Question) -> Diagnosis {
    let Question { robot, data, fit, .. } = *question;
    let base = align(robot, data, fit);
    let effect: Box<dyn Effect> = Box::new(BasePlacement::new(base));
    let start = Model::nominal(robot.clone(), EffectStack::new(robot, base, vec![effect]));
    let candidates: Vec<usize> = (0..start.x.len()).collect();
    let (model, fitted, screening) = fit_screened(&start, data, &FitOptions { rows: fit, candidates: &candidates }, question.set);
    let predicted = model.predict(data);
    let misfit = Misfit::of(question, data, &screening, &predicted, fitted.singular.len());
    let errors = ErrorLengths::of(data, &predicted, &misfit.rows);
    let ground = misfit.ground(data, data.noise_basis, 0);
    let statement = statement(VerdictKind::NotAsked, &ground);
    Diagnosis {
        verdict: VerdictKind::NotAsked,
        statement,
        noise_basis: data.noise_basis,
        noise_floor: misfit.noise_floor,
        before: errors,
        after: errors,
        held_out: misfit.held_out,
        folds: None,
        findings: Vec::new(),
        withdrawn: Vec::new(),
        clock: data.has_clock(),
        not_observable: vec![format!(
            "what is missing: {} rows were fitted, at least {FEWEST} are needed to tell it from geometry",
            fit.len()
        )],
        signature: None,
        next_measurements: Vec::new(),
        leftover_rms: misfit.leftover_rms,
        chi_square: misfit.chi_square,
        gate_first: None,
        gate_last: None,
        repeatability: JointRepeatability { sigma: 0.0, repeats: 0 },
        located_before: Located::default(),
        located_after: Located::default(),
        kept: screening.kept.clone(),
        screening,
        model,
        fitted,
    }
}

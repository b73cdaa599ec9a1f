//! A diagnosis in which no physics is asked: the nominal robot with its base where the rows to fit have it.

use super::misfit::Misfit;
use super::types::{Diagnosis, ErrorLengths, JointRepeatability, Located, Question, VerdictKind};
use super::words::statement;
use crate::criteria::search::FEWEST;
use crate::effect::{BasePlacement, Effect, EffectStack};
use crate::estimate::{Model, align, fit_screened};

/// Too few rows to ask what was left out: the nominal robot in its place, and no findings.
pub(crate) fn not_asked(question: &Question) -> Diagnosis {
    let diagnosis = unasked(question, VerdictKind::NotAsked, Some(question.set));
    let rows = question.fit.len();
    let too_few = format!(
        "what the simulation lacks: {rows} rows were fitted, at least {} are needed to separate it from geometry",
        *FEWEST
    );
    Diagnosis {
        after: diagnosis.before,
        not_observable: vec![too_few],
        ..diagnosis
    }
}

/// The diagnosis of the nominal robot, fitted by its base: no findings, and nothing after. Rows are screened by `set`, if given.
pub(super) fn unasked(
    question: &Question,
    verdict: VerdictKind,
    set: Option<&[usize]>,
) -> Diagnosis {
    let base = align(question.robot, question.data, question.fit);
    let effect: Box<dyn Effect> = Box::new(BasePlacement::new(base));
    let stack = EffectStack::new(question.robot, base, vec![effect]);
    let start = Model::nominal(question.robot.clone(), stack);
    let candidates: Vec<usize> = (0..start.x.len()).collect();
    let data = question.data;
    let (model, fitted, screening) = fit_screened(&start, data, question.fit, &candidates, set);
    let misfit = Misfit::of(question, data, &screening, &model, fitted.singular.len());
    Diagnosis {
        dimension: misfit.dimension,
        verdict,
        statement: statement(verdict, &misfit.ground(data, data.noise_basis, 0, false)),
        noise_basis: data.noise_basis,
        noise_floor: misfit.noise_floor,
        before: ErrorLengths::of(&misfit.sizes, &misfit.rows),
        after: None,
        held_out: misfit.held_out,
        folds: None,
        findings: Vec::new(),
        clock: data.has_clock(),
        not_observable: Vec::new(),
        signature: None,
        next_measurements: Vec::new(),
        leftover_rms: misfit.leftover_rms,
        chi_square: misfit.chi_square,
        gate_first: None,
        formulas: Vec::new(),
        gate_last: None,
        repeatability: JointRepeatability::default(),
        located_before: Located::default(),
        located_after: Located::default(),
        kept: screening.kept.clone(),
        screening,
        model,
        fitted,
    }
}

//! A diagnosis in which no physics is asked: the nominal robot with its base where the rows to fit have it.

use super::misfit::Misfit;
use super::types::{Diagnosis, ErrorLengths, JointRepeatability, Located, Question, VerdictKind};
use super::words::statement;
use crate::effect::{BasePlacement, Effect, EffectStack};
use crate::estimate::{Fitted, Model, Screening, align};

/// The nominal robot on its base, and the parameters of that base.
pub(super) fn on_its_base(question: &Question) -> (Model, Vec<usize>) {
    let Question {
        robot, data, fit, ..
    } = *question;
    let base = align(robot, data, fit);
    let effect: Box<dyn Effect> = Box::new(BasePlacement::new(base));
    let start = Model::nominal(robot.clone(), EffectStack::new(robot, base, vec![effect]));
    let candidates = (0..start.x.len()).collect();
    (start, candidates)
}

/// What is said of such a model, fitted: no findings, and nothing after.
pub(super) fn unasked(
    question: &Question,
    verdict: VerdictKind,
    (model, fitted, screening): (Model, Fitted, Screening),
) -> Diagnosis {
    let data = question.data;
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
        repeatability: JointRepeatability {
            sigma: 0.0,
            repeats: 0,
        },
        located_before: Located::default(),
        located_after: Located::default(),
        kept: screening.kept.clone(),
        screening,
        model,
        fitted,
    }
}

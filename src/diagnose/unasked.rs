//! Too few rows to ask what was left out: the nominal robot in its place, and no findings.

use super::verdict::{Diagnosis, Errors, Verdict};
use super::{Located, Question, Repeatability};
use crate::effect::{BasePlacement, Effect, EffectStack};
use crate::estimate::{FitOptions, Model, Weight, align, fit_screened};

/// Fewest rows to fit: geometry alone takes some thirty numbers from three of each row.
pub(crate) const FEWEST: usize = 15;

/// The nominal robot with its base where the rows to fit have it.
pub(crate) fn not_asked(question: &Question) -> Diagnosis {
    let Question { robot, data, fit, .. } = *question;
    let base = align(robot, data, fit);
    let effect: Box<dyn Effect> = Box::new(BasePlacement::new(base));
    let mut model = Model::nominal(robot.clone(), EffectStack::new(robot, base, vec![effect]));
    let candidates: Vec<usize> = (0..model.x.len()).collect();
    let (fitted, screening) = fit_screened(&mut model, data, &FitOptions { rows: fit, candidates: &candidates }, question.set);
    let predicted = model.predict(data);
    let aside: Vec<usize> = screening.suspects.iter().filter(|suspect| !suspect.used()).map(|suspect| suspect.row).collect();
    let judges: Vec<usize> = question.validate.iter().copied().filter(|row| !aside.contains(row)).collect();
    let held_out = !judges.is_empty();
    let rows = if held_out { &judges } else { &screening.kept };
    let errors = Errors::of(data, &predicted, rows);
    let rms = |rows: &[usize], length: &dyn Fn(usize) -> f64| {
        (rows.iter().map(|row| length(*row).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
    };
    let kept = screening.kept.clone();
    let whitened = |row: &usize| Weight::of(data, *row, 0.0).apply(&(data.position[*row] - predicted[*row])).norm_squared();
    let freedom = (3 * kept.len()).saturating_sub(fitted.singular.len()).max(1) as f64;
    Diagnosis {
        verdict: Verdict::NotAsked,
        noise_floor: rms(rows, &|row| data.noise(row)),
        before: errors,
        after: errors,
        held_out,
        findings: Vec::new(),
        withdrawn: Vec::new(),
        clock: data.has_clock(),
        not_observable: vec![format!(
            "what is missing: {} rows were fitted, at least {FEWEST} are needed to tell it from geometry",
            fit.len()
        )],
        signature: None,
        next_measurements: Vec::new(),
        leftover_rms: rms(&kept, &|row| (data.position[row] - predicted[row]).norm()),
        chi_square: kept.iter().map(whitened).sum::<f64>() / freedom,
        gate_first: None,
        gate_last: None,
        repeatability: Repeatability { sigma: 0.0, repeats: 0 },
        located_before: Located::default(),
        located_after: Located::default(),
        screening,
        model,
        fitted,
        kept,
    }
}

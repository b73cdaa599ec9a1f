//! The tables of `learn`: how the rivals compare, the course of a network's training, and predictions with the correction on top.

use crate::error::Result;
use crate::estimate::network::rivals::{RivalComparison, RivalContest};
use crate::estimate::network::{JudgedRival, Phase, Rival, TrainingStep};
use crate::stage::Context;
use crate::table::{
    Corrections, CorrectionsRow, Network, Prediction, Recording, Training, TrainingRow,
};

/// What the comparison comes to, for the person who waits.
pub(super) fn sentence(comparison: &RivalComparison, learnt: bool) -> String {
    let tell = |judged: &JudgedRival| {
        let name = judged.rival.map_or("none", Rival::name);
        format!("{name} {:.3} mm", judged.mean() * 1e3)
    };
    let all: Vec<String> = comparison.judged.iter().map(tell).collect();
    let kept = comparison.judged[comparison.chosen]
        .rival
        .filter(|_| learnt);
    let what = kept.map_or_else(
        || "no correction was kept".to_string(),
        |rival| format!("`{}` was kept", rival.name()),
    );
    format!(
        "{what}; cross-validated error on its own training rows: {}",
        all.join(", ")
    )
}

pub(super) fn comparison_table(
    step: &str,
    contest: &RivalContest,
    comparison: &RivalComparison,
    learnt: bool,
) -> Corrections {
    let chosen = if learnt { comparison.chosen } else { 0 };
    let best = &comparison.judged[chosen];
    let before = comparison.judged[0].mean() * 1e3;
    let row = |(j, judged): (usize, &JudgedRival)| {
        let (gain, sigma, behind) = (
            judged.gain * 1e3,
            judged.sigma * 1e3,
            (judged.mean() - best.mean()) * 1e3,
        );
        let reason = match judged.rival {
            None if j == chosen => "nothing that was tried helps clearly".to_string(),
            None => format!("a correction gains {:.3} mm", best.gain * 1e3),
            Some(_) if j == chosen => {
                format!("smallest error of those that help: gains {gain:.3} +- {sigma:.3} mm")
            }
            Some(_) if !judged.helps() => {
                format!("does not help clearly: gains {gain:.3} +- {sigma:.3} mm")
            }
            Some(_) => format!(
                "{behind:.3} mm behind {}",
                best.rival.map_or("none", Rival::name)
            ),
        };
        CorrectionsRow {
            step: step.into(),
            rival: judged.rival.map_or("none", Rival::name).into(),
            chosen: j == chosen,
            reason,
            before_mm: before,
            mean_mm: Some(judged.mean() * 1e3),
            rms_mm: Some(judged.rms() * 1e3),
            max_mm: Some(judged.max() * 1e3),
            gain_mm: Some(gain),
            gain_sigma_mm: Some(sigma),
            numbers: judged.numbers as i64,
            evaluations: judged.evaluations as i64,
            hidden: judged.settings.map(|settings| settings.0 as i64),
            decay: judged.settings.map(|settings| settings.1),
        }
    };
    let mut rows: Vec<CorrectionsRow> = comparison.judged.iter().enumerate().map(row).collect();
    let untried = contest.rivals.iter().filter(|rival| {
        comparison
            .judged
            .iter()
            .all(|judged| judged.rival != Some(**rival))
    });
    rows.extend(untried.map(|rival| CorrectionsRow {
        step: step.into(),
        rival: rival.name().into(),
        chosen: false,
        reason: match rival {
            rival if rival.goes_through_the_jacobian() && contest.arm.is_none() => {
                "the stage has no robot with these joints, or no parameters".into()
            }
            _ => "it could not be fitted to these rows".into(),
        },
        before_mm: before,
        mean_mm: None,
        rms_mm: None,
        max_mm: None,
        gain_mm: None,
        gain_sigma_mm: None,
        numbers: 0,
        evaluations: 0,
        hidden: None,
        decay: None,
    }));
    Corrections(rows)
}

/// The course of a training as a comparison_table.
pub(super) fn history(step: &str, course: Vec<TrainingStep>) -> Training {
    let rows = course.into_iter().map(|record| TrainingRow {
        step: step.into(),
        phase: match record.phase {
            Phase::Swarm => "swarm".into(),
            Phase::Gradient => "gradient".into(),
        },
        member: record.member as i64,
        generation: record.index as i64,
        best: record.best,
        train_rms_mm: record.train_rms * 1e3,
        check_rms_mm: record.check_rms.map(|rms| rms * 1e3),
        evaluations: record.evaluations as i64,
    });
    Training(rows.collect())
}

/// Every prediction with the correction; rows that were trained on are no longer held out.
pub(super) fn corrected(
    prediction: &Prediction,
    network: &Network,
    recording: &Recording,
    sources: &[Vec<f64>],
    trained: &[usize],
    context: &Context,
) -> Result<Prediction> {
    // Read back from its table, so that whoever applies the table later gets these very numbers.
    let correction = network.correction(&recording.prismatic)?;
    let mut rows = prediction.0.clone();
    let (mut fading, mut outside) = (0, 0);
    for (row, sources) in rows.iter_mut().zip(sources) {
        row.step = context.id.into();
        let Some(correction) = &correction else {
            continue;
        };
        let applied = correction.at(sources);
        outside += usize::from(applied.share == 0.0);
        fading += usize::from(applied.share > 0.0 && applied.share < 1.0);
        let [x, y, z] = applied.delta.map(|value| value * 1e3);
        (row.x_mm, row.y_mm, row.z_mm) = (row.x_mm + x, row.y_mm + y, row.z_mm + z);
        (row.dx_mm, row.dy_mm, row.dz_mm) = (row.dx_mm - x, row.dy_mm - y, row.dz_mm - z);
        row.error_mm =
            (row.dx_mm * row.dx_mm + row.dy_mm * row.dy_mm + row.dz_mm * row.dz_mm).sqrt();
        // Cross-validation was of the model without a correction, whichever rows the correction learned from.
        (row.fold_error_mm, row.block_error_mm) = (None, None);
    }
    for row in trained {
        rows[*row].held_out = false;
    }
    if fading + outside > 0 {
        context.note(format!(
            "{} of {} rows lie outside the region (joints, payload) that the correction saw: it fades out on {fading} and is silent on {outside}",
            fading + outside,
            rows.len()
        ));
    }
    Ok(Prediction(rows))
}

//! What a diagnosis says of a wrong set-up: the nominal robot where its base fits best, the set-up error, and no physics.

use super::compare::{AsStated, ExplainedSetup};
use super::mixture::TwoSetups;
use super::pairs::median;
use super::words::{SetupWords, mm, together, words};
use crate::criteria::setup::{FAR, NAMED};
use crate::diagnose::types::{
    Diagnosis, ErrorLengths, Finding, Probabilities, Question, SETUP, VerdictKind,
};
use crate::diagnose::unasked::{on_its_base, unasked};
use crate::effect::{ParameterEstimate, Place};
use crate::estimate::{FitOptions, Screening, fit};
use crate::observation::Dimension;

/// A set-up error that explains what the nominal robot leaves.
pub(super) fn explained(
    question: &Question,
    stated: &AsStated,
    found: &ExplainedSetup,
) -> Diagnosis {
    let own = |wrong| words(wrong, question.robot, &found.placed.values, stated.reach);
    let all = together(&found.wrong, question.robot, own);
    let what: Vec<&str> = all.iter().map(|words| words.what.as_str()).collect();
    let mend: Vec<&str> = all.iter().map(|words| words.mend.as_str()).collect();
    let scale: f64 = all.iter().map(|words| words.scale).product();
    let (before, after) = (stated.placed.left, scale * found.placed.left);
    let mut text = format!(
        "{}; with this error the nominal robot is {} off the points (median, base and tool fitted), without it {}. Remedy: {}",
        what.join(", and "),
        mm(before),
        mm(after),
        mend.join("; ")
    );
    let mut alike: Vec<SetupWords> = found
        .alike
        .iter()
        .filter(|wrong| wrong.number().is_none())
        .map(|wrong| own(*wrong))
        .collect();
    alike.dedup_by(|a, b| a.what == b.what);
    alike.retain(|other| !what.contains(&other.what.as_str()));
    if !alike.is_empty() {
        let each: Vec<String> = alike
            .iter()
            .map(|words| format!("{}; remedy then: {}", words.what, words.mend))
            .collect();
        text.push_str(&format!(
            ". These data are explained equally well if {}",
            each.join(", or if ")
        ));
    }
    let number = |name: &str, value: f64| ParameterEstimate {
        name: name.into(),
        form: 0,
        value,
        unit: "mm",
        sigma: None,
    };
    let kept: Vec<bool> = found
        .placed
        .off
        .iter()
        .map(|off| *off <= *FAR * median(&found.placed.off))
        .collect();
    let lengths = |off: &[f64], scale: f64| {
        let kept: Vec<f64> = off
            .iter()
            .zip(&kept)
            .filter(|(_, kept)| **kept)
            .map(|(off, _)| scale * off)
            .collect();
        ErrorLengths::of_lengths(&kept)
    };
    let name = *NAMED / (1.0 + found.alike.len() as f64);
    let finding = Finding {
        parameters: vec![
            number("median_before", before * 1e3),
            number("median_after", after * 1e3),
        ],
        probabilities: Probabilities {
            name,
            place: *NAMED,
            none: 1.0 - *NAMED,
        },
        ..finding(format!("{text}."))
    };
    let errors = (
        lengths(&stated.placed.off, 1.0),
        lengths(&found.placed.off, scale),
    );
    Diagnosis {
        before: errors.0,
        after: errors.1,
        ..wrong(question, vec![finding])
    }
}

/// Rows of two set-ups.
pub(super) fn two_setups(question: &Question, found: &TwoSetups) -> Diagnosis {
    wrong(question, vec![finding(format!("{}.", found.words()))])
}

/// An identified model that leaves the robot file by more than manufacture allows, and no set-up error of the list that explains it.
pub(super) fn implausible(question: &Question, numbers: &[String]) -> Diagnosis {
    let text = format!(
        "the identified robot differs from the robot file by more than manufacture allows: {}. Check these for a typing error \
         or a wrong unit, and the joints for a wrong zero or sign",
        numbers.join(", ")
    );
    wrong(question, vec![finding(format!("{text}."))])
}

/// Nothing of the list explains what the nominal robot leaves.
pub(super) fn unexplained(question: &Question, stated: &AsStated) -> Diagnosis {
    let statement = format!(
        "the set-up is wrong: with base and tool fitted the nominal robot is {} off the points (median), {:.1} % of its reach, and \
         none of the usual errors explains it (units, signs, zeros, exchanged or coupled joints, a mirrored frame, the order of rows, \
         one length). Check that the robot file is this arm's (lines marked REPLACE or CHECK, the DH convention), and that the \
         joints belong to these points",
        mm(stated.placed.left),
        100.0 * stated.share_of_reach()
    );
    Diagnosis {
        statement,
        ..wrong(question, Vec::new())
    }
}

fn finding(statement: String) -> Finding {
    Finding {
        effect: SETUP,
        place: Place::Recording,
        statement,
        parameters: Vec::new(),
        evidence: None,
        rivals: Vec::new(),
        probabilities: Probabilities {
            name: *NAMED,
            place: *NAMED,
            none: 1.0 - *NAMED,
        },
        valid: None,
        forms: Vec::new(),
    }
}

/// The nominal robot with its base where the rows to fit have it.
fn wrong(question: &Question, findings: Vec<Finding>) -> Diagnosis {
    let Question {
        data, fit: rows, ..
    } = *question;
    let (start, candidates) = on_its_base(question);
    let (model, fitted) = fit(
        &start,
        data,
        &FitOptions {
            rows,
            candidates: &candidates,
        },
    );
    let before = ErrorLengths::of(&model.error_sizes(data, Dimension::Length), rows);
    let screening = Screening {
        kept: rows.to_vec(),
        ..Screening::default()
    };
    let not_observable =
        vec!["what the simulation lacks: it is tested once the set-up is right".into()];
    let diagnosis = unasked(
        question,
        VerdictKind::WrongSetup,
        (model, fitted, screening),
    );
    Diagnosis {
        before,
        held_out: false,
        findings,
        not_observable,
        ..diagnosis
    }
}

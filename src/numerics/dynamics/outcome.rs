//! The answer to a diagnosis of torques, from what was solved.

use super::arm::{INERTIAL_NAMES, INERTIAL_NUMBERS, inertial_unit};
use super::cause::{COULOMB, FittedNumber, LOAD_FRICTION, UNKNOWN, VISCOUS, plain};
use super::cells::CauseChoice;
use super::enforce::with_bodies;
use super::findings::{FittedSet, contact, plain_finding, sigma_of};
use super::latency::Latency;
use super::problem::TorqueProblem;
use super::recording::{ends, largest};
use super::sliding::unit_at;
use super::solve::SolvedTorques;
use super::types::{
    EnforcedBodies, InertialBasis, InertialEstimate, TorqueCourses, TorqueDiagnosis, TorqueErrors,
    TorqueFinding, TorqueLeftover, TorqueNoise, TorqueQuestion,
};
use super::weighted::{JointNoise, NoiseMemory};
use crate::criteria::torque::NAMED;
use crate::diagnose::{Probabilities, VerdictKind};
use crate::effect::Place;
use crate::error::counted;
use crate::statistics::quantile;
use calib_numerics::figures::significant;

/// Times the noise beyond which held-out rows are not explained.
const UNEXPLAINED: f64 = 1.5;
/// Rows that count as one, from which on a residual is no noise.
const LASTING: f64 = 8.0;

/// Remark on a recording that has its own simulation.
const SIMULATED: &str = "measured torques are held against the simulated ones of the recording: what is found is what that simulation lacks";

/// All of it.
pub(super) fn outcome(
    solved: &SolvedTorques,
    question: &TorqueQuestion,
    mut remarks: Vec<String>,
) -> TorqueDiagnosis {
    let problem = &solved.problem;
    let choice = CauseChoice::new(problem, &solved.weighted);
    let fit = FittedSet::of(&choice, &solved.set, &solved.slopes);
    let bodies = question.enforce_bodies.then(|| with_bodies(&fit)).flatten();
    let (solution, enforced) = match bodies {
        Some((solution, enforced)) => (solution, Some(enforced)),
        None => (fit.solution.clone(), None),
    };
    // As the arm is simulated today: as declared, else with identified masses alone.
    let today = match problem.scene.declared {
        Some(_) => Vec::new(),
        None => choice.base.solution(),
    };
    let (first, last) = (problem.residual(&today), problem.residual(&solution));
    let (held, judging) = (problem.counted_rows(true), problem.judging_rows());
    let [before, after] = [&first, &last].map(|residual| errors(problem, residual, &judging));
    if let Some(enforced) = &enforced {
        let free = errors(problem, &problem.residual(&fit.solution), &judging);
        remarks.push(bodies_remark(enforced, &free, &after));
    }
    remarks.push(filters_remark(problem));
    if problem.scene.beyond.is_some() {
        remarks.push(SIMULATED.into());
    }
    let mut found = fit.findings(&solved.silent, &held);
    found.extend(problem.events.iter().map(contact));
    found.extend(solved.latency.as_ref().map(late));
    found
        .iter_mut()
        .for_each(|one| nameless(one, &question.without));
    found.sort_by(|a, b| b.evidence.effect_rms.total_cmp(&a.evidence.effect_rms));
    let leftover = leftover(problem, &last);
    let over = after.rms.iter().zip(&problem.noise);
    let over = over
        .map(|(rms, noise)| rms / noise.sigma)
        .fold(0.0, f64::max);
    let verdict = match over > UNEXPLAINED {
        true => VerdictKind::Unexplained,
        false if found.is_empty() => VerdictKind::NothingMissing,
        false => VerdictKind::Explained,
    };
    let noise = |noise: &JointNoise| TorqueNoise {
        sigma: noise.sigma,
        autocorrelation: noise.autocorrelation(),
    };
    let model = fit.model(&solution);
    TorqueDiagnosis {
        verdict,
        statement: statement(verdict, &found, [before.nrmse_mean, after.nrmse_mean], over),
        remarks,
        basis: match problem.scene.declared {
            Some(_) => InertialBasis::Declared,
            None => InertialBasis::Free(problem.all.base_changes.len()),
        },
        cutoff: problem.reduction.cutoff,
        rate: problem.reduction.rate,
        noise: problem.noise.iter().map(noise).collect(),
        before,
        after,
        held_out: !held.is_empty(),
        findings: found,
        not_observable: not_observable(&fit, &solved.silent),
        leftover,
        events: problem.events.clone(),
        courses: courses(problem, &first, &last),
        inertials: inertials(&fit, &solution),
        friction: model.friction_curves().unwrap_or_default(),
        model,
        enforced,
    }
}

/// What it costs that links are bodies.
fn bodies_remark(enforced: &EnforcedBodies, before: &TorqueErrors, after: &TorqueErrors) -> String {
    let links = enforced.links.iter().map(|link| (link + 1).to_string());
    let links: Vec<String> = links.collect();
    format!(
        "no body has the numbers of link {}: all links are bodies now, at the price of {:.1} of the whitened squared residual; mean NRMSE of \
         judged rows {:.4} before, {:.4} after; sigmas are those of before",
        links.join(", "),
        enforced.cost,
        before.nrmse_mean,
        after.nrmse_mean
    )
}

/// How rows came about.
fn filters_remark(problem: &TorqueProblem) -> String {
    let lead = 1e3 * problem.scene.friction_lead;
    let turns = match lead {
        0.0 => String::new(),
        lead if lead > 0.0 => format!(", {lead:.1} ms before the velocity does"),
        lead => format!(", {:.1} ms after the velocity does", -lead),
    };
    format!(
        "measured and simulated torques are low-passed alike at {:.1} Hz without delay; {:.1} rows a second are judged; the sign of friction turns over {:.3} rad/s{turns}",
        problem.reduction.cutoff, problem.reduction.rate, problem.scene.sign_width
    )
}

/// A finding whose name is not to be given is without one at its place, and so are its rivals.
fn nameless(finding: &mut TorqueFinding, without: &[String]) {
    let is_left_out = |effect: &str| without.iter().any(|name| name == effect);
    if is_left_out(&finding.effect) {
        finding.effect = UNKNOWN.into();
        finding.statement = format!("something without a name acts at {}", finding.place);
    }
    let here = (finding.effect.clone(), finding.place);
    for rival in finding
        .rivals
        .iter_mut()
        .filter(|rival| is_left_out(&rival.effect))
    {
        rival.effect = UNKNOWN.into();
    }
    let probabilities = &mut finding.probabilities;
    finding.rivals.retain(|rival| {
        let is_same = (&rival.effect, rival.place) == (&here.0, here.1);
        if is_same {
            let Probabilities { name, place, none } = *probabilities;
            *probabilities = Probabilities::new(name + rival.probability, place, none);
        }
        !is_same
    });
}

fn late(latency: &Latency) -> TorqueFinding {
    let [value, sigma] = [latency.seconds, latency.sigma].map(|seconds| 1e3 * seconds);
    let parameter = plain("latency", FittedNumber { value, sigma }, "ms");
    let statement = format!("torques come {value:.1} ms later than the positions of their rows");
    let (name, place) = (super::LATENCY, Place::Recording);
    plain_finding(name, place, statement, vec![parameter], latency.gain, 1.0)
}

fn statement(verdict: VerdictKind, found: &[TorqueFinding], nrmse: [f64; 2], over: f64) -> String {
    let falls = format!(
        "mean NRMSE of judged rows {:.3} before, {:.3} after",
        nrmse[0], nrmse[1]
    );
    let findings = counted(found.len(), "finding");
    match verdict {
        VerdictKind::NothingMissing => {
            format!("the rigid arm explains the torques down to their noise ({falls})")
        }
        VerdictKind::Explained => {
            format!("with {findings} the torques are explained down to their noise ({falls})")
        }
        _ => format!("with {findings} up to {over:.1} times the noise is left ({falls})"),
    }
}

/// What is left of fitted rows.
fn leftover(problem: &TorqueProblem, residual: &[Vec<f64>]) -> Vec<TorqueLeftover> {
    let runs = problem.runs(false);
    let of_joint = |(joint, course): (usize, &Vec<f64>)| {
        let noise = JointNoise::of(course, &runs, 0.0, NoiseMemory::Short);
        let lasting = noise.autocorrelation();
        let signature = (lasting > LASTING)
            .then(|| format!("correlated over {lasting:.0} rows: not white noise"));
        TorqueLeftover {
            rms: noise.sigma,
            over_noise: noise.sigma / problem.noise[joint].sigma,
            signature,
        }
    };
    residual.iter().enumerate().map(of_joint).collect()
}

fn courses(problem: &TorqueProblem, first: &[Vec<f64>], last: &[Vec<f64>]) -> TorqueCourses {
    fn each<T>([rows, n]: [usize; 2], value: impl Fn(usize, usize) -> T) -> Vec<T> {
        (0..rows * n).map(|k| value(k % n, k / n)).collect()
    }
    let (n, judged) = (problem.joints(), &problem.reduction.rows);
    let (rows, scene) = (judged.len(), &problem.scene);
    let torque = (0..n).map(|joint| problem.torque_at(joint, problem.latency));
    let torque: Vec<Vec<f64>> = torque.collect();
    let less = |left: &[Vec<f64>]| {
        each([rows, n], |joint, row| {
            torque[joint][row] - left[joint][row]
        })
    };
    let time = judged.iter().map(|row| problem.start + scene.time[*row]);
    TorqueCourses {
        row: judged.clone(),
        time: time.collect(),
        held_out: (0..rows).map(|row| problem.is_held_out(row)).collect(),
        in_event: (0..rows).map(|row| problem.in_event(row)).collect(),
        at_rest: each([rows, n], |joint, row| rests(problem, joint, row)),
        velocity: each([rows, n], |joint, row| scene.velocity[joint][judged[row]]),
        measured: each([rows, n], |joint, row| torque[joint][row]),
        simulated: less(first),
        corrected: less(last),
    }
}

fn inertials(fit: &FittedSet, solution: &[(usize, f64)]) -> Vec<InertialEstimate> {
    let problem = fit.choice.problem;
    let theta = problem.inertials(fit.set, solution);
    let mut estimates = Vec::new();
    for link in 0..problem.joints() {
        let changes = problem.inertial_changes(fit.set, link);
        let columns: Vec<usize> = changes.iter().map(|(column, _)| *column).collect();
        let covariance = fit.uncertain.covariance(&columns);
        for (number, quantity) in INERTIAL_NAMES.into_iter().enumerate() {
            let along: Vec<f64> = changes.iter().map(|(_, ten)| ten[number]).collect();
            let at = INERTIAL_NUMBERS * link + number;
            let declared = problem.scene.declared.as_ref().map(|all| all.theta[at]);
            if declared.is_none() && along.iter().all(|share| *share == 0.0) {
                continue;
            }
            estimates.push(InertialEstimate {
                link,
                quantity,
                unit: inertial_unit(number),
                value: theta[at],
                declared,
                sigma: sigma_of(&along, &covariance),
            });
        }
    }
    estimates
}

// Differences of measured and predicted torque, moving and resting rows apart.

/// Times the width of a sign below which a joint rests.
const REST: f64 = 2.0;

/// Whether a joint rests in a judged row.
fn rests(problem: &TorqueProblem, joint: usize, row: usize) -> bool {
    problem.scene.velocity[joint][problem.reduction.rows[row]].abs()
        < REST * problem.scene.width_at(joint)
}

/// Errors by a residual (`[joint][judged row]`, Nm) in some rows.
fn errors(problem: &TorqueProblem, residual: &[Vec<f64>], rows: &[usize]) -> TorqueErrors {
    let joints = || 0..problem.joints();
    let rms = |joint: usize, counts: &dyn Fn(usize) -> bool| {
        let counted = rows.iter().filter(|row| counts(**row));
        let squares: Vec<f64> = counted.map(|row| residual[joint][*row].powi(2)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let all = joints().map(|joint| rms(joint, &|_| true).unwrap_or(0.0));
    let all: Vec<f64> = all.collect();
    let nrmse = joints().map(|joint| all[joint] / spread(problem, joint, rows));
    let nrmse: Vec<f64> = nrmse.collect();
    let of_rows = |at_rest: bool| {
        let of_joint = |joint| rms(joint, &|row| rests(problem, joint, row) == at_rest);
        joints().map(of_joint).collect()
    };
    TorqueErrors {
        nrmse_mean: nrmse.iter().sum::<f64>() / joints().len() as f64,
        nrmse,
        rms: all,
        rms_moving: of_rows(false),
        rms_rest: of_rows(true),
    }
}

/// Rms (Nm) of measured torque about its mean.
fn spread(problem: &TorqueProblem, joint: usize, rows: &[usize]) -> f64 {
    let torque = problem.torque_at(joint, problem.latency);
    let count = rows.len().max(1) as f64;
    let mean = rows.iter().map(|row| torque[*row]).sum::<f64>() / count;
    let squares = rows.iter().map(|row| (torque[*row] - mean).powi(2));
    (squares.sum::<f64>() / count).sqrt().max(f64::MIN_POSITIVE)
}

// What these data cannot show, a sentence each.

/// rad over which a joint must move for its gravity to show.
const SMALL_RANGE: f64 = 0.2;
/// A coefficient whose standard deviation is above this share of the joint's largest torque is not seen.
const UNSEEN: f64 = 0.5;

/// Sentences on a set's problem; what is silent in it is too small to be told.
fn not_observable(fit: &FittedSet, silent: &[usize]) -> Vec<String> {
    let choice = fit.choice;
    let scene = &choice.problem.scene;
    let mut sentences = Vec::new();
    if scene.declared.is_none() {
        sentences.push(
            "masses are identified, not declared: a wrong payload, link, torque constant or tilted base vanishes in them".into(),
        );
    }
    for joint in 0..scene.joints() {
        let [least, most] = ends(scene.position[joint].iter().copied());
        let name = joint + 1;
        if most - least < SMALL_RANGE {
            sentences.push(format!(
                "joint {name}: it moves over {:.3} {} only; an offset, a cable or spring and gravity are one there",
                most - least,
                unit_at(scene.arm.prismatic[joint], "rad")
            ));
        }
        let (slowest, fastest) = speeds(&scene.velocity[joint], scene.sign_width);
        if fastest < 1.5 * slowest {
            sentences.push(format!("joint {name}: it moves at one speed only; viscous and Coulomb friction are one there"));
        }
    }
    for number in 0..choice.open {
        let form = choice.form(number);
        let found = choice.has(fit.set, |other| other.is_called_as(form));
        if !found && form.width == 1 && form.cause.inertial && is_unseen(fit, number) {
            sentences.push(format!(
                "{} {}: these motions do not show it",
                form.place,
                form.name().replace('_', " ")
            ));
        }
        let mut silent = silent.iter();
        let silent = silent.find(|one| choice.form(**one).is_called_as(form));
        let is_curve = choice.has(fit.set, |other| {
            other.place == form.place && other.is_nameless_curve()
        });
        let may_hide = FRICTIONS.contains(&form.name()) && form.is_plain() && !is_curve;
        if may_hide && (!found || silent.is_some()) {
            sentences.extend(hidden_friction(fit, *silent.unwrap_or(&number)));
        }
    }
    sentences
}

/// Frictions of which is told how much of them the noise would hide.
const FRICTIONS: [&str; 3] = [VISCOUS, COULOMB, LOAD_FRICTION];
/// Share of the joint's largest torque that may be hidden without a word.
const HIDDEN: f64 = 0.03;

/// How much of a friction that is not named these rows would not show, where that is more than a little.
fn hidden_friction(fit: &FittedSet, number: usize) -> Option<String> {
    let (problem, form) = (fit.choice.problem, fit.choice.form(number));
    let place = problem.all.of(number).start;
    let column = &problem.all.columns[place];
    let size = largest(column.courses.iter().flatten());
    let measured = (column.joints.iter()).map(|joint| problem.torque_at(*joint, problem.latency));
    let torque = measured.fold(0.0, |most, course| f64::max(most, largest(&course)));
    let sigma = match fit.set.contains(&number) {
        true => fit.sweep.sigma(place),
        false => fit.sweep.with(&[number]).sigma(place),
    };
    let most = *NAMED * sigma;
    let (_, unit) = form.coefficient_names().swap_remove(0);
    let unit = unit_at(form.slides(&problem.scene.arm.prismatic), unit);
    let most_of_it = most_of(most, unit);
    (most > 0.0 && most * size > HIDDEN * torque).then(|| {
        format!(
            "{} {}: not seen; {most_of_it} would be hidden by the noise",
            form.place,
            form.name().replace('_', " ")
        )
    })
}

/// At most so much of a unit, or of the load.
fn most_of(most: f64, unit: &str) -> String {
    match unit {
        "1" if most >= 1.0 => "any share of the load".to_string(),
        "1" => format!("up to {} % of the load", significant(1e2 * most, 2)),
        unit => format!("up to {} {unit}", significant(most, 2)),
    }
}

/// Speeds below and above which a tenth of the moving rows are.
fn speeds(velocity: &[f64], width: f64) -> (f64, f64) {
    let speeds = velocity.iter().map(|value| value.abs());
    let mut moving: Vec<f64> = speeds.filter(|speed| *speed > 2.0 * width).collect();
    moving.sort_by(f64::total_cmp);
    let at = |share: f64| quantile(&moving, share).unwrap_or(0.0);
    (at(0.1), at(0.9))
}

/// Whether a form as large as a good part of the joint's torque would not be noticed.
fn is_unseen(fit: &FittedSet, number: usize) -> bool {
    let problem = fit.choice.problem;
    let place = problem.all.of(number).start;
    let column = &problem.all.columns[place];
    let size = largest(column.courses.iter().flatten());
    let measured = column.joints.iter().map(|joint| &problem.measured[*joint]);
    let torque = largest(measured.flatten());
    let sigma = fit.sweep.with(&[number]).sigma(place);
    sigma == 0.0 || sigma * size > UNSEEN * torque
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_load_that_may_be_all_of_it_is_any() {
        assert_eq!(most_of(9.22, "1"), "any share of the load");
        assert_eq!(most_of(0.123, "1"), "up to 12 % of the load");
        assert_eq!(most_of(0.123, "Nm"), "up to 0.12 Nm");
    }
}

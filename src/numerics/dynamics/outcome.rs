//! The answer to a diagnosis of torques, from what was solved.

use super::arm::{INERTIAL_NAMES, INERTIAL_NUMBERS, inertial_unit};
use super::cause::TorqueParameter;
use super::choice::CauseChoice;
use super::enforce::with_bodies;
use super::findings::{contact, findings, plain_finding};
use super::model::TorqueModel;
use super::problem::TorqueProblem;
use super::scene::{ends, largest};
use super::solve::SolvedTorques;
use super::sweep::SweptColumns;
use super::types::{
    EnforcedBodies, InertialBasis, InertialEstimate, TorqueCourses, TorqueDiagnosis, TorqueErrors,
    TorqueFinding, TorqueLeftover, TorqueNoise, TorqueQuestion,
};
use crate::diagnose::VerdictKind;
use crate::effect::Place;
use crate::error::counted;
use crate::weighted::{JointNoise, NoiseMemory};

/// Times the noise beyond which held-out rows are not explained.
const UNEXPLAINED: f64 = 1.5;
/// Rows that count as one, from which on a residual is no noise.
const LASTING: f64 = 8.0;

/// All of it.
pub(super) fn outcome(
    solved: &SolvedTorques,
    question: &TorqueQuestion,
    mut remarks: Vec<String>,
) -> TorqueDiagnosis {
    let problem = &solved.problem;
    let choice = CauseChoice::new(problem, &solved.weighted);
    let set = &solved.set;
    let sweep = choice.base.with(set);
    let free = sweep.solution();
    let uncertain = solved.slopes.with_slopes(&sweep);
    let bodies = if question.enforce_bodies {
        with_bodies(problem, set, &sweep, &free)
    } else {
        None
    };
    let (solution, enforced) = bodies.map_or_else(
        || (free.clone(), None),
        |(solution, enforced)| (solution, Some(enforced)),
    );
    // As the arm is simulated today: as declared, else with identified masses alone.
    let today = if problem.scene.declared.is_some() {
        Vec::new()
    } else {
        choice.base.solution()
    };
    let (first, last) = (problem.residual(&today), problem.residual(&solution));
    let counted_rows = |held_out: bool| {
        problem
            .runs(held_out)
            .into_iter()
            .flatten()
            .collect::<Vec<usize>>()
    };
    let held = counted_rows(true);
    let judging = if held.is_empty() {
        counted_rows(false)
    } else {
        held.clone()
    };
    let (before, after) = (
        errors(problem, &first, &judging),
        errors(problem, &last, &judging),
    );
    if let Some(enforced) = &enforced {
        remarks.push(bodies_remark(
            enforced,
            &errors(problem, &problem.residual(&free), &judging),
            &after,
        ));
    }
    let mut found = findings(
        &choice,
        (set, &solved.silent),
        &held,
        (&uncertain, &solved.slopes),
    );
    found.extend(problem.events.iter().map(contact));
    found.extend(solved.latency.as_ref().map(late));
    found.sort_by(|a, b| b.evidence.gain.total_cmp(&a.evidence.gain));
    let leftover = leftover(problem, &last);
    let over = after
        .rms
        .iter()
        .zip(&problem.noise)
        .map(|(rms, noise)| rms / noise.sigma)
        .fold(0.0, f64::max);
    let verdict = match over > UNEXPLAINED {
        true => VerdictKind::Unexplained,
        false if found.is_empty() => VerdictKind::NothingMissing,
        false => VerdictKind::Explained,
    };
    let model = TorqueModel::of(&choice, set, (&uncertain, &solved.slopes), &solution);
    TorqueDiagnosis {
        verdict,
        statement: statement(verdict, &found, [before.nrmse_mean, after.nrmse_mean], over),
        remarks: remarks
            .into_iter()
            .chain([filters_remark(problem)])
            .collect(),
        basis: match problem.scene.declared {
            Some(_) => InertialBasis::Declared,
            None => InertialBasis::Free(problem.all.base),
        },
        cutoff: problem.reduction.cutoff,
        rate: problem.reduction.rate,
        noise: problem
            .noise
            .iter()
            .map(|n| TorqueNoise {
                sigma: n.sigma,
                autocorrelation: n.autocorrelation(),
            })
            .collect(),
        before,
        after,
        held_out: !held.is_empty(),
        findings: found,
        not_observable: not_observable(&choice, set, &sweep),
        leftover,
        events: problem.events.clone(),
        courses: courses(problem, &first, &last),
        inertials: inertials(problem, set, &uncertain, &solution),
        friction: model.friction_curves().unwrap_or_default(),
        model,
        enforced,
    }
}

/// What it costs that links are bodies.
fn bodies_remark(enforced: &EnforcedBodies, before: &TorqueErrors, after: &TorqueErrors) -> String {
    let links: Vec<String> = enforced
        .links
        .iter()
        .map(|link| (link + 1).to_string())
        .collect();
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

fn late(latency: &super::latency::Latency) -> TorqueFinding {
    let milliseconds = 1e3 * latency.seconds;
    let parameter = TorqueParameter {
        name: "latency".into(),
        value: milliseconds,
        unit: "ms",
        sigma: Some(1e3 * latency.sigma),
    };
    let statement =
        format!("torques come {milliseconds:.1} ms later than the positions of their rows");
    plain_finding(
        super::LATENCY,
        Place::Recording,
        statement,
        vec![parameter],
        latency.gain,
        1.0,
    )
}

fn statement(verdict: VerdictKind, found: &[TorqueFinding], nrmse: [f64; 2], over: f64) -> String {
    let falls = format!(
        "mean NRMSE of judged rows {:.3} before, {:.3} after",
        nrmse[0], nrmse[1]
    );
    match verdict {
        VerdictKind::NothingMissing => {
            format!("the rigid arm explains the torques down to their noise ({falls})")
        }
        VerdictKind::Explained => {
            format!(
                "with {} the torques are explained down to their noise ({falls})",
                counted(found.len(), "finding")
            )
        }
        _ => format!(
            "with {} up to {over:.1} times the noise is left ({falls})",
            counted(found.len(), "finding")
        ),
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
    let (n, rows) = (problem.joints(), problem.reduction.rows.len());
    let torque: Vec<Vec<f64>> = (0..n)
        .map(|joint| problem.torque_at(joint, problem.latency))
        .collect();
    let each = |value: &dyn Fn(usize, usize) -> f64| {
        (0..rows)
            .flat_map(|row| (0..n).map(move |joint| value(joint, row)))
            .collect::<Vec<f64>>()
    };
    TorqueCourses {
        row: problem.reduction.rows.clone(),
        time: problem
            .reduction
            .rows
            .iter()
            .map(|row| problem.start + problem.scene.time[*row])
            .collect(),
        held_out: (0..rows).map(|row| problem.is_held_out(row)).collect(),
        in_event: (0..rows).map(|row| problem.in_event(row)).collect(),
        at_rest: (0..rows)
            .flat_map(|row| (0..n).map(move |joint| rests(problem, joint, row)))
            .collect(),
        velocity: each(&|joint, row| problem.scene.velocity[joint][problem.reduction.rows[row]]),
        measured: each(&|joint, row| torque[joint][row]),
        simulated: each(&|joint, row| torque[joint][row] - first[joint][row]),
        corrected: each(&|joint, row| torque[joint][row] - last[joint][row]),
    }
}

fn inertials(
    problem: &TorqueProblem,
    set: &[usize],
    sweep: &SweptColumns,
    solution: &[(usize, f64)],
) -> Vec<InertialEstimate> {
    let theta = problem.inertials(set, solution);
    let mut estimates = Vec::new();
    for link in 0..problem.joints() {
        let changes = problem.inertial_changes(set, link);
        let columns: Vec<usize> = changes.iter().map(|(column, _)| *column).collect();
        let covariance = sweep.covariance(&columns);
        for number in 0..INERTIAL_NUMBERS {
            let along: Vec<f64> = changes.iter().map(|(_, ten)| ten[number]).collect();
            let declared = problem
                .scene
                .declared
                .as_ref()
                .map(|all| all.theta[INERTIAL_NUMBERS * link + number]);
            if declared.is_none() && along.iter().all(|share| *share == 0.0) {
                continue;
            }
            let count = along.len();
            let variance: f64 = (0..count * count)
                .map(|entry| along[entry / count] * along[entry % count] * covariance[entry])
                .sum();
            estimates.push(InertialEstimate {
                link,
                quantity: INERTIAL_NAMES[number],
                unit: inertial_unit(number),
                value: theta[INERTIAL_NUMBERS * link + number],
                declared,
                sigma: variance.max(0.0).sqrt(),
            });
        }
    }
    estimates
}

// Differences of measured and predicted torque, moving and resting rows apart.

/// Times the width of a sign below which a joint rests.
const REST: f64 = 2.0;

/// Whether a joint rests in a judged row.
pub(super) fn rests(problem: &TorqueProblem, joint: usize, row: usize) -> bool {
    problem.scene.velocity[joint][problem.reduction.rows[row]].abs()
        < REST * problem.scene.width_at(joint)
}

/// Errors by a residual (`[joint][judged row]`, Nm) in some rows.
pub(super) fn errors(
    problem: &TorqueProblem,
    residual: &[Vec<f64>],
    rows: &[usize],
) -> TorqueErrors {
    let n = problem.joints();
    let rms = |joint: usize, counts: &dyn Fn(usize) -> bool| {
        let squares: Vec<f64> = rows
            .iter()
            .filter(|row| counts(**row))
            .map(|row| residual[joint][*row].powi(2))
            .collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let all: Vec<f64> = (0..n)
        .map(|joint| rms(joint, &|_| true).unwrap_or(0.0))
        .collect();
    let nrmse: Vec<f64> = (0..n)
        .map(|joint| all[joint] / spread(problem, joint, rows))
        .collect();
    TorqueErrors {
        nrmse_mean: nrmse.iter().sum::<f64>() / n as f64,
        nrmse,
        rms: all,
        rms_moving: (0..n)
            .map(|joint| rms(joint, &|row| !rests(problem, joint, row)))
            .collect(),
        rms_rest: (0..n)
            .map(|joint| rms(joint, &|row| rests(problem, joint, row)))
            .collect(),
    }
}

/// Rms (Nm) of measured torque about its mean.
fn spread(problem: &TorqueProblem, joint: usize, rows: &[usize]) -> f64 {
    let torque = problem.torque_at(joint, problem.latency);
    let count = rows.len().max(1) as f64;
    let mean = rows.iter().map(|row| torque[*row]).sum::<f64>() / count;
    (rows
        .iter()
        .map(|row| (torque[*row] - mean).powi(2))
        .sum::<f64>()
        / count)
        .sqrt()
        .max(f64::MIN_POSITIVE)
}

// What these data cannot show, a sentence each.

/// rad over which a joint must move for its gravity to show.
const SMALL_RANGE: f64 = 0.2;
/// A coefficient whose standard deviation is above this share of the joint's largest torque is not seen.
const UNSEEN: f64 = 0.5;

/// Sentences on a set's problem.
pub(super) fn not_observable(
    choice: &CauseChoice,
    set: &[usize],
    sweep: &SweptColumns,
) -> Vec<String> {
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
                "joint {name}: it moves over {:.3} rad only; an offset, a cable or spring and gravity are one there",
                most - least
            ));
        }
        let (slowest, fastest) = speeds(&scene.velocity[joint], scene.sign_width);
        if fastest < 1.5 * slowest {
            sentences.push(format!("joint {name}: it moves at one speed only; viscous and Coulomb friction are one there"));
        }
    }
    for number in 0..choice.open {
        let form = choice.form(number);
        let found = set
            .iter()
            .any(|other| choice.form(*other).is_called_as(form));
        if !found && form.width == 1 && form.cause.inertial && is_unseen(choice, sweep, number) {
            sentences.push(format!(
                "{} {}: these motions do not show it",
                form.place,
                form.cause.name.replace('_', " ")
            ));
        }
    }
    sentences
}

/// Speeds below and above which a tenth of the moving rows are.
fn speeds(velocity: &[f64], width: f64) -> (f64, f64) {
    let mut moving: Vec<f64> = velocity
        .iter()
        .map(|value| value.abs())
        .filter(|speed| *speed > 2.0 * width)
        .collect();
    moving.sort_by(f64::total_cmp);
    let at = |share: f64| crate::statistics::quantile(&moving, share).unwrap_or(0.0);
    (at(0.1), at(0.9))
}

/// Whether a form as large as a good part of the joint's torque would not be noticed.
fn is_unseen(choice: &CauseChoice, sweep: &SweptColumns, number: usize) -> bool {
    let problem = choice.problem;
    let column = &problem.all.columns[problem.all.of(number).start];
    let size = largest(column.courses.iter().flatten());
    let measured = column.joints.iter().map(|joint| &problem.measured[*joint]);
    let torque = largest(measured.flatten());
    let mut with = sweep.clone();
    with.add(number);
    let sigma = with.covariance(&[problem.all.of(number).start])[0]
        .max(0.0)
        .sqrt();
    sigma == 0.0 || sigma * size > UNSEEN * torque
}

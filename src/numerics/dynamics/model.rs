//! The identified model of an arm's torques as data: inertial numbers of the links, and the causes that add torque at joints.
//!
//! A judged set as one model, with its covariance.

use crate::arm::{INERTIAL_NUMBERS, inertial_name, inertial_unit};
use crate::cause::{TORQUE_CAUSES, TorqueForm};
use crate::choice::CauseChoice;
use crate::effect::Place;
use crate::error::{Error, Result};
use crate::problem::TorqueProblem;
use crate::scene::{ends, largest};
use crate::shape_slopes::ShapeSlopes;
use crate::statistics::nearest;
use crate::sweep::SweptColumns;

/// A cause that adds torque at joints, with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueTerm {
    /// Canonical name of the cause.
    pub effect: String,
    /// Where it acts.
    pub place: Place,
    /// Further joints (from 0) or an order, as the cause reads them.
    pub with: [usize; 2],
    /// Numbers that enter nonlinearly, SI.
    pub shape: Vec<f64>,
    /// Numbers that enter linearly, SI; names by [`TorqueTerm::names`].
    pub coefficients: Vec<f64>,
    /// Rms of its torque over the recording, Nm, over the joints that it acts on.
    pub rms: f64,
}

/// What the judged rows visited at a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Least and greatest, rad.
    pub position: [f64; 2],
    /// rad/s.
    pub speed: f64,
    /// rad/s^2.
    pub acceleration: f64,
    /// Nm, of the rigid arm.
    pub load: f64,
    /// Nm, one standard deviation: what held-out rows leave beyond noise and the covariance of the model's numbers.
    pub misfit: f64,
    /// Nm, 95 %: what is usual for the model's torque there, by the covariance and the misfit.
    pub usual: f64,
    /// rad/s over which the sign of its velocity turns: the model's, but where friction leads.
    pub sign_width: f64,
}

/// The identified model of an arm's torques.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueModel {
    /// 10 n, as the regressor counts them, payload on the last link; 0 where [`TorqueModel::identified`] is false.
    pub inertials: Vec<f64>,
    /// 10 n: all where masses were declared, else the base parameters, which stand for others too.
    pub identified: Vec<bool>,
    /// All causes that add torque at joints: findings, and of viscous and Coulomb friction the one that is too small to be named next to the
    /// other.
    pub terms: Vec<TorqueTerm>,
    /// Covariance of identified inertials, of all coefficients, of the numbers of shapes that were found, term after term, and of the width of a
    /// sign, row-major; with the noise's autocorrelation. Empty where it is not known.
    pub covariance: Vec<f64>,
    /// rad/s over which the sign of a velocity turns.
    pub sign_width: f64,
    /// s by which friction turns before the velocity does.
    pub friction_lead: f64,
    /// s by which the recording's torques came late; they do not when they are commanded.
    pub latency: f64,
    /// Hz, of the low-pass of the recording.
    pub cutoff: f64,
    /// Per joint.
    pub range: Vec<JointRange>,
    /// Least and greatest of the recording, C; `None` where it was not recorded.
    pub temperature: Option<[f64; 2]>,
}

impl TorqueModel {
    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.range.len()
    }

    /// The beginning of the names of a term's numbers.
    pub fn prefix(&self, term: usize) -> String {
        let model_term = &self.terms[term];
        let alike = |other: &&TorqueTerm| {
            other.effect == model_term.effect && other.place == model_term.place
        };
        let before = self.terms[..term].iter().filter(alike).count();
        match before {
            0 => format!("{}.{}", model_term.effect, model_term.place.tag()),
            _ => format!(
                "{}.{}.{}",
                model_term.effect,
                model_term.place.tag(),
                before + 1
            ),
        }
    }

    /// Whether every inertial number of a link is identified, not only what base parameters stand for.
    pub fn is_whole(&self, link: usize) -> bool {
        self.identified[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)]
            .iter()
            .all(|known| *known)
    }
}

// Terms of a model as forms of causes, and what all numbers of a model are called.

/// Name of the width of a sign among the numbers of a model.
const SIGN_WIDTH: &str = "recording.sign_width";

impl TorqueTerm {
    /// Its form. Fails where no cause has its name or its numbers are too few.
    pub(super) fn form(&self) -> Result<TorqueForm> {
        let cause = TORQUE_CAUSES
            .into_iter()
            .find(|cause| cause.name == self.effect && cause.has_shape(&self.shape));
        let cause = cause.ok_or_else(|| {
            Error::data(
                "torque model",
                format!("`{}` is no cause that adds torque", self.effect),
            )
        })?;
        let form = TorqueForm {
            cause,
            place: self.place,
            with: self.with,
            shape: self.shape.clone(),
            width: self.coefficients.len(),
        };
        Ok(form)
    }

    /// Values of the shape numbers that were found from the data. Fails where no cause has its name.
    pub fn shape_numbers(&self) -> Result<Vec<f64>> {
        self.form().map(|form| {
            form.shape_numbers()
                .iter()
                .map(|span| form.shape[span.index])
                .collect()
        })
    }

    /// Quantity and unit of each coefficient. Fails where no cause has its name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        self.form().map(|form| form.coefficient_names())
    }
}

impl TorqueModel {
    /// Name of each number of the covariance, in its order: `rigid_body.l3.mass`, `viscous_friction.j2.viscous`; a second cause of a name
    /// at a place is `torque_ripple.j2.2.sine`. Fails where no cause has a term's name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        let inertials = (0..self.inertials.len()).filter(|number| self.identified[*number]);
        let mut names: Vec<(String, &'static str)> = inertials
            .map(|number| (inertial_name(number), inertial_unit(number)))
            .collect();
        for (place, term) in self.terms.iter().enumerate() {
            let prefix = self.prefix(place);
            names.extend(
                term.names()?
                    .into_iter()
                    .map(|(quantity, unit)| (format!("{prefix}.{quantity}"), unit)),
            );
        }
        for (place, term) in self.terms.iter().enumerate() {
            let prefix = self.prefix(place);
            names.extend(
                term.form()?
                    .shape_numbers()
                    .iter()
                    .map(|span| (format!("{prefix}.{}", span.name), span.unit)),
            );
        }
        names.push((SIGN_WIDTH.into(), "rad/s"));
        Ok(names)
    }
}

/// 95 % of a normal distribution lie within so many standard deviations.
pub(super) const COVERAGE: f64 = 1.96;
/// Judged rows at which the usual uncertainty is asked, at most.
const ASKED: usize = 300;

impl TorqueModel {
    /// The model of a judged set.
    pub(super) fn of(
        choice: &CauseChoice,
        set: &[usize],
        (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
        solution: &[(usize, f64)],
    ) -> Self {
        let problem = choice.problem;
        let adds = |number: &usize| {
            let form = choice.form(*number);
            problem
                .scene
                .declared
                .as_ref()
                .is_none_or(|declared| form.cause.inertial(form, declared).is_none())
        };
        let adding: Vec<usize> = set.iter().copied().filter(adds).collect();
        let term = |number: &usize| {
            let form = choice.form(*number);
            TorqueTerm {
                effect: form.cause.name.into(),
                place: form.place,
                with: form.with,
                shape: form.shape.clone(),
                coefficients: problem.coefficients(*number, solution),
                rms: problem.rms_of(*number, solution),
            }
        };
        let (identified, covariance) = covariance(problem, set, &adding, (uncertain, slopes));
        let mut inertials = problem.inertials(set, solution);
        inertials
            .iter_mut()
            .zip(&identified)
            .filter(|(_, known)| !**known)
            .for_each(|(number, _)| *number = 0.0);
        let certainty = certainty(problem, set, (uncertain, slopes), solution);
        Self {
            inertials,
            identified,
            terms: adding.iter().map(term).collect(),
            covariance,
            sign_width: problem.scene.sign_width,
            friction_lead: problem.scene.friction_lead,
            latency: problem.latency,
            cutoff: problem.reduction.cutoff,
            range: certainty
                .into_iter()
                .enumerate()
                .map(|(joint, [misfit, usual])| range(problem, joint, misfit, usual))
                .collect(),
            temperature: problem.temperature,
        }
    }
}

/// What held-out rows (fitted ones where none are) of each joint leave beyond noise and the covariance of the numbers, Nm, one standard
/// deviation, and the median of the torque's uncertainty (95 %).
fn certainty(
    problem: &TorqueProblem,
    set: &[usize],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
    solution: &[(usize, f64)],
) -> Vec<[f64; 2]> {
    let of_forms = set.iter().flat_map(|number| problem.all.of(*number));
    let of_shapes = slopes.0.iter().map(|(_, column)| *column);
    let columns: Vec<usize> = (0..problem.all.base)
        .chain(of_forms)
        .chain(of_shapes)
        .collect();
    let (all, width) = (uncertain.covariance(&columns), columns.len());
    let residual = problem.residual(solution);
    let held: Vec<usize> = problem.runs(true).into_iter().flatten().collect();
    let rows = if held.is_empty() {
        problem.runs(false).into_iter().flatten().collect()
    } else {
        held
    };
    let of_joint = |joint: usize| {
        let course = |(place, column): (usize, &usize)| {
            let column = &problem.all.columns[*column];
            let at = column.joints.iter().position(|one| *one == joint)?;
            Some((place, column.courses[at].as_slice()))
        };
        let acting: Vec<(usize, &[f64])> = columns.iter().enumerate().filter_map(course).collect();
        let variance = |row: &usize| {
            let each = |(a, first): &(usize, &[f64])| {
                let with = acting
                    .iter()
                    .map(|(b, second)| all[a * width + b] * second[*row])
                    .sum::<f64>();
                first[*row] * with
            };
            acting.iter().map(each).sum::<f64>().max(0.0)
        };
        let asked: Vec<f64> = rows
            .iter()
            .step_by(rows.len().div_ceil(ASKED).max(1))
            .map(variance)
            .collect();
        let mean = |values: &mut dyn Iterator<Item = f64>, count: usize| {
            values.sum::<f64>() / count.max(1) as f64
        };
        let left = mean(
            &mut rows.iter().map(|row| residual[joint][*row].powi(2)),
            rows.len(),
        );
        let by_numbers = mean(&mut asked.iter().copied(), asked.len());
        let misfit = (left - problem.noise[joint].sigma.powi(2) - by_numbers).max(0.0);
        let mut usual: Vec<f64> = asked
            .iter()
            .map(|variance| COVERAGE * (variance + misfit).sqrt())
            .collect();
        [misfit.sqrt(), nearest(&mut usual, 0.5).unwrap_or(0.0)]
    };
    (0..problem.joints()).map(of_joint).collect()
}

fn range(problem: &TorqueProblem, joint: usize, misfit: f64, usual: f64) -> JointRange {
    let rows = || {
        (0..problem.reduction.rows.len())
            .filter(|row| !problem.in_event(*row))
            .map(|row| problem.reduction.rows[row])
    };
    let most = |course: &[f64]| largest(rows().map(|row| &course[row]));
    let position = &problem.scene.position[joint];
    JointRange {
        position: ends(rows().map(|row| position[row])),
        speed: most(&problem.scene.velocity[joint]),
        acceleration: most(&problem.scene.acceleration[joint]),
        load: most(&problem.scene.rigid[joint]),
        misfit,
        usual,
        sign_width: problem.scene.width_at(joint),
    }
}

/// Which inertial numbers are identified, and the covariance of these, of the coefficients of `adding` and of the numbers of shapes.
fn covariance(
    problem: &TorqueProblem,
    set: &[usize],
    adding: &[usize],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> (Vec<bool>, Vec<f64>) {
    let mut columns: Vec<usize> = Vec::new();
    // Each number of the model as a sum of coefficients: position in `columns`, and share.
    let mut sums: Vec<Vec<(usize, f64)>> = Vec::new();
    let mut identified = Vec::with_capacity(INERTIAL_NUMBERS * problem.joints());
    for link in 0..problem.joints() {
        let changes = problem.inertial_changes(set, link);
        let first = columns.len();
        columns.extend(changes.iter().map(|(column, _)| *column));
        for number in 0..INERTIAL_NUMBERS {
            let shares = changes
                .iter()
                .enumerate()
                .map(|(place, (_, ten))| (first + place, ten[number]));
            let shares: Vec<(usize, f64)> = shares.filter(|(_, share)| *share != 0.0).collect();
            let known = problem.scene.declared.is_some() || !shares.is_empty();
            identified.push(known);
            if known {
                sums.push(shares);
            }
        }
    }
    for column in adding
        .iter()
        .flat_map(|number| problem.all.of(*number))
        .chain(slopes.0.iter().map(|(_, column)| *column))
    {
        sums.push(vec![(columns.len(), 1.0)]);
        columns.push(column);
    }
    let (all, width) = (uncertain.covariance(&columns), columns.len());
    let entry = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
        a.iter()
            .map(|(row, left)| {
                left * b
                    .iter()
                    .map(|(column, right)| right * all[row * width + column])
                    .sum::<f64>()
            })
            .sum()
    };
    let covariance = sums
        .iter()
        .flat_map(|a| sums.iter().map(move |b| entry(a, b)))
        .collect();
    (identified, covariance)
}

#[cfg(test)]
mod tests {
    use super::super::cases::arm;
    use super::super::cause::TORQUE_CAUSES;
    use super::*;
    use crate::dynamics::clock::RecordingClock;
    use crate::dynamics::scene::DynamicScene;
    use crate::types::TorqueRecording;

    #[test]
    fn every_form_is_read_back_as_one_of_its_own_cause_and_names_its_coefficients() {
        let position = (0..400)
            .map(|k| libm::sin(0.05 * f64::from(k / 4) + f64::from(k % 4)))
            .collect();
        let recording = TorqueRecording::of_motion(
            4,
            (0..100).map(|row| 0.01 * f64::from(row)).collect(),
            position,
        );
        let arm = arm();
        let scene = DynamicScene::new(
            &arm,
            &recording,
            &RecordingClock::of(&recording),
            10.0,
            false,
        );
        let mut tried = 0;
        for cause in TORQUE_CAUSES {
            for form in (cause.forms)(cause, &scene)
                .into_iter()
                .filter(|_| !cause.coefficients.is_empty())
            {
                let term = TorqueTerm {
                    effect: cause.name.into(),
                    place: form.place,
                    with: form.with,
                    shape: form.shape.clone(),
                    coefficients: vec![1.0; form.width],
                    rms: 0.0,
                };
                let read = term.form().expect("a cause");
                assert!(
                    std::ptr::eq(read.cause.coefficients, cause.coefficients),
                    "{}",
                    cause.name
                );
                assert_eq!(read.width, form.width, "{}", cause.name);
                assert!(
                    read.cause.coefficients.len() >= form.width,
                    "{}",
                    cause.name
                );
                tried += 1;
            }
        }
        assert!(tried > 100, "{tried}");
    }
}

//! Torques that a planned motion needs, by the identified model: differentiated and composed as the recording was.

use super::arm::DynamicArm;
use super::arm::INERTIAL_NUMBERS;
use super::cause::{TorqueForm, friction_of};
use super::clock::RecordingClock;
use super::clock::column;
use super::model::{JointRange, TorqueModel};
use super::modelled::COVERAGE;
use super::newton_euler::InverseDynamics;
use super::recording::TorqueRecording;
use super::scene::{DynamicScene, split};
use super::shape_slopes::planned_slopes;
use crate::effect::Place;
use crate::error::{Error, Result};

/// A motion of n joints at an even clock; lists are row-major (rows x n).
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMotion {
    /// Number of joints n.
    pub joints: usize,
    /// s, ascending in even steps; length rows.
    pub time: Vec<f64>,
    /// rad.
    pub position: Vec<f64>,
    /// rad/s. `None`: found from positions.
    pub velocity: Option<Vec<f64>>,
    /// rad/s^2. `None`: found from positions.
    pub acceleration: Option<Vec<f64>>,
    /// C, length rows. `None`: not known.
    pub temperature: Option<Vec<f64>>,
    /// s from when the arm began to move to the first row, for friction that falls as gears warm up. `None`: the arm is warm.
    pub since_start: Option<f64>,
}

/// What a motion needs; row-major (rows x n).
#[derive(Debug, Clone, PartialEq)]
pub struct NeededTorques {
    /// Nm at the joints, as the drives or sensors of the recording state it.
    pub torque: Vec<f64>,
    /// Nm of the rigid arm as identified.
    pub(crate) load: Vec<f64>,
    /// Nm by which `torque` differs from that of the arm as declared; all of it where no masses are declared.
    pub(crate) correction: Vec<f64>,
    /// Nm, 95 %: by the model's covariance, and by laws that are used beyond the motion of the recording. `None` where the model
    /// carries no covariance.
    pub u95: Option<Vec<f64>>,
    /// rad/s.
    pub(crate) velocity: Vec<f64>,
    /// rad/s^2.
    pub(crate) acceleration: Vec<f64>,
}

/// What a coefficient of a model adds at a joint, Nm per unit, a value a row.
pub(super) struct TermCourse {
    /// Term of the model.
    pub(crate) term: usize,
    /// Among all coefficients of the model.
    pub(crate) coefficient: usize,
    pub(crate) joint: usize,
    pub(crate) course: Vec<f64>,
}

impl TorqueModel {
    /// Torques of a motion of the arm that the model was identified on. Fails where sizes differ, there are fewer than ten rows, or no
    /// cause has a term's name.
    pub fn needed(&self, arm: &DynamicArm, motion: &PlannedMotion) -> Result<NeededTorques> {
        /// Rows that derivatives need.
        const LEAST: usize = 10;
        let (n, rows) = (self.joints(), motion.time.len());
        if arm.joints() != n || motion.joints != n || motion.position.len() != n * rows {
            let message = format!(
                "the model has {n} joints, the arm {}, the motion {}",
                arm.joints(),
                motion.joints
            );
            return Err(Error::data("motion", message));
        }
        if rows < LEAST {
            return Err(Error::data(
                "motion",
                format!("has {rows} rows; at least {LEAST} are needed"),
            ));
        }
        let forms = self.forms()?;
        let mut scene = self.scene(arm, motion);
        let declared = match &scene.declared {
            Some(declared) => scene.torques_of(&declared.theta),
            None => vec![vec![0.0; rows]; n],
        };
        scene.believe(&self.inertials);
        if forms.iter().any(|form| form.place == Place::Base) {
            scene.tilt(&self.inertials);
        }
        scene.friction = self.friction(&forms, &scene);
        let courses = self.courses(&forms, &scene);
        let mut torque: Vec<Vec<f64>> = scene.rigid.clone();
        for one in &courses {
            let value = self.coefficient(one);
            torque[one.joint]
                .iter_mut()
                .zip(&one.course)
                .for_each(|(sum, part)| *sum += value * part);
        }
        let differences = torque
            .iter()
            .zip(&declared)
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect());
        let correction: Vec<Vec<f64>> = differences.collect();
        let by_row = |courses: &[Vec<f64>]| {
            (0..rows)
                .flat_map(|row| courses.iter().map(move |course| course[row]))
                .collect()
        };
        Ok(NeededTorques {
            u95: self.uncertainty(&forms, &mut scene, &courses),
            torque: by_row(&torque),
            load: by_row(&scene.rigid),
            correction: by_row(&correction),
            velocity: by_row(&scene.velocity),
            acceleration: by_row(&scene.acceleration),
        })
    }

    /// Of its terms. Fails where no cause has a term's name.
    pub(super) fn forms(&self) -> Result<Vec<TorqueForm>> {
        self.terms.iter().map(|term| term.form()).collect()
    }

    /// Nm, `[joint][row]`; `forms` are those of the terms.
    pub(super) fn friction(&self, forms: &[TorqueForm], scene: &DynamicScene) -> Vec<Vec<f64>> {
        let coefficients = self.terms.iter().map(|term| &term.coefficients[..]);
        friction_of(forms.iter().zip(coefficients), scene)
    }

    /// What each coefficient adds, term after term.
    fn courses(&self, forms: &[TorqueForm], scene: &DynamicScene) -> Vec<TermCourse> {
        let mut courses = Vec::new();
        let mut first = 0;
        for (term, form) in forms.iter().enumerate() {
            for joint in form.acts_on(self.joints()) {
                for number in 0..form.width {
                    let mut course = vec![0.0; scene.rows()];
                    form.write(scene, joint, number, &mut course);
                    courses.push(TermCourse {
                        term,
                        coefficient: first + number,
                        joint,
                        course,
                    });
                }
            }
            first += form.width;
        }
        courses
    }

    /// Value of a coefficient.
    pub(super) fn coefficient(&self, of: &TermCourse) -> f64 {
        let before: usize = self.terms[..of.term]
            .iter()
            .map(|term| term.coefficients.len())
            .sum();
        self.terms[of.term].coefficients[of.coefficient - before]
    }

    /// The motion as causes see it.
    fn scene<'a>(&self, arm: &'a DynamicArm, motion: &PlannedMotion) -> DynamicScene<'a> {
        let n = motion.joints;
        let recording = TorqueRecording::of_motion(n, motion.time.clone(), motion.position.clone());
        let clock = RecordingClock::even(&motion.time);
        let mut scene = DynamicScene::new(arm, &recording, &clock, self.cutoff, false);
        scene.turn_over(self.sign_width);
        scene.turn_each_over(self.range.iter().map(|range| range.sign_width));
        scene.friction_lead = self.friction_lead;
        // A warm arm began to move longer ago than any time constant: what fades has faded.
        let begun = motion.since_start.unwrap_or(f64::INFINITY);
        scene.time.iter_mut().for_each(|time| *time += begun);
        let columns = |all: &Vec<f64>| {
            (0..n)
                .map(|joint| column(all, n, joint))
                .collect::<Vec<Vec<f64>>>()
        };
        if let Some(velocity) = &motion.velocity {
            scene.position = columns(&motion.position);
            scene.velocity = columns(velocity);
        }
        if let Some(acceleration) = &motion.acceleration {
            scene.acceleration = columns(acceleration);
        }
        scene
    }
}

// How far a torque that is fed forward may be off: by the covariance of the model's numbers, and by laws beyond what the recording visited.

impl TorqueModel {
    /// Nm, 95 %, row-major (rows x n); `None` where the model carries no covariance. The variance of a torque is that of its numbers, each
    /// through its terms (of a shape number to first order), what held-out rows leave beyond it, and the square of what each law adds times how far beyond its range it is used, as a
    /// share of that range.
    pub(super) fn uncertainty(
        &self,
        forms: &[TorqueForm],
        scene: &mut DynamicScene,
        courses: &[TermCourse],
    ) -> Option<Vec<f64>> {
        let known = self.identified.iter().filter(|known| **known).count();
        let coefficients: Vec<&[f64]> = self
            .terms
            .iter()
            .map(|term| term.coefficients.as_slice())
            .collect();
        let linear = known + coefficients.iter().map(|own| own.len()).sum::<usize>();
        let width = linear
            + forms
                .iter()
                .map(|form| form.shape_numbers().len())
                .sum::<usize>()
            + 1;
        if self.covariance.len() != width * width {
            return None;
        }
        let shapes = planned_slopes(forms, &coefficients, scene, linear);
        let scene = &*scene;
        let (n, rows) = (self.joints(), scene.rows());
        let places: Vec<Option<usize>> = self.places();
        let by_joint: Vec<Vec<&TermCourse>> = (0..n)
            .map(|joint| courses.iter().filter(|one| one.joint == joint).collect())
            .collect();
        let mut dynamics = InverseDynamics::new(scene.arm);
        let mut motion = vec![0.0; 3 * n];
        let mut slopes: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
        let mut all = Vec::with_capacity(n * rows);
        for row in 0..rows {
            scene.motion_into(row, &mut motion);
            slopes.iter_mut().for_each(Vec::clear);
            dynamics.regressor(
                split(&motion, n),
                &scene.arm.gravity,
                |joint, link, numbers| {
                    let own = places[INERTIAL_NUMBERS * link..].iter().zip(numbers);
                    let own = own.filter_map(|(place, value)| place.map(|place| (place, *value)));
                    slopes[joint].extend(own.filter(|(_, value)| *value != 0.0));
                },
            );
            for (joint, slope) in slopes.iter_mut().enumerate() {
                slope.extend(
                    by_joint[joint]
                        .iter()
                        .map(|one| (known + one.coefficient, one.course[row])),
                );
                slope.extend(
                    shapes
                        .iter()
                        .filter(|one| one.1 == joint)
                        .map(|(number, _, course)| (*number, course[row])),
                );
                let row_of = |(a, first): &(usize, f64)| {
                    let own = &self.covariance[a * width..(a + 1) * width];
                    first
                        * slope
                            .iter()
                            .map(|(b, second)| own[*b] * second)
                            .sum::<f64>()
                };
                let own = slope.iter().map(row_of).sum::<f64>().max(0.0)
                    + self.range[joint].misfit.powi(2);
                let variance = own + self.beyond(forms, scene, &by_joint[joint], row);
                all.push(COVERAGE * variance.sqrt());
            }
        }
        Some(all)
    }

    /// Where each inertial number stands in the covariance.
    fn places(&self) -> Vec<Option<usize>> {
        let mut next = 0;
        let place = |known: &bool| {
            let own = known.then_some(next);
            next += usize::from(*known);
            own
        };
        self.identified.iter().map(place).collect()
    }

    /// Variance of laws that are used beyond the recording at a joint, Nm^2.
    fn beyond(
        &self,
        forms: &[TorqueForm],
        scene: &DynamicScene,
        own: &[&TermCourse],
        row: usize,
    ) -> f64 {
        let mut variance = 0.0;
        for term in own.chunk_by(|a, b| a.term == b.term) {
            let form = &forms[term[0].term];
            let joint = form.joint();
            let share = self.range[joint].beyond(form, scene, joint, row);
            if share > 0.0 {
                let torque: f64 = term
                    .iter()
                    .map(|one| self.coefficient(one) * one.course[row])
                    .sum();
                variance += (share * torque).powi(2);
            }
        }
        variance
    }
}

impl JointRange {
    /// How far a law is used beyond what was recorded of its variable, as a share of the recorded range.
    fn beyond(&self, form: &TorqueForm, scene: &DynamicScene, joint: usize, row: usize) -> f64 {
        let above = |value: f64, most: f64| {
            if most > 0.0 {
                (value.abs() / most - 1.0).max(0.0)
            } else {
                0.0
            }
        };
        let load = if form.cause.of_rigid {
            above(scene.rigid[joint][row], self.load)
        } else {
            0.0
        };
        let is_friction = !form.cause.modifies.is_empty() || form.friction(0, 1.0, 1.0).is_some();
        if is_friction {
            return load.max(above(scene.velocity[joint][row], self.speed));
        }
        let ([least, greatest], position) = (self.position, scene.position[joint][row]);
        let width = (greatest - least).max(f64::MIN_POSITIVE);
        load.max((least - position).max(position - greatest).max(0.0) / width)
    }
}

//! How far a torque that is fed forward may be off: by the covariance of the model's numbers, and by laws beyond what the recording visited.

use super::cause::TorqueForm;
use super::feed_forward::TermCourse;
use super::model::{JointRange, TorqueModel};
use super::modelled::COVERAGE;
use super::newton_euler::{INERTIAL_NUMBERS, InverseDynamics};
use super::scene::{DynamicScene, split};
use super::shape_slopes::planned_slopes;

impl TorqueModel {
    /// Nm, 95 %, row-major (rows x n); `None` where the model carries no covariance. The variance of a torque is that of its numbers, each
    /// by what it adds (of a shape number to first order), what held-out rows left besides, and the square of what each law adds times how far beyond its range it is used, as a
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

//! A recording prepared for least squares: measured and rigid torque, base and forms in judged rows, and which of these count.

use super::arm::{DynamicArm, INERTIAL_NUMBERS};
use super::cause::{TorqueForm, friction_of};
use super::clock::{RecordingClock, column};
use super::columns::TorqueColumns;
use super::reduce::{ReducedRegressor, Reduction};
use super::scene::{DynamicScene, ends};
use super::sweep::value_of;
use super::types::{ContactEvent, TorqueQuestion};
use super::weighted::{Weighing, WeightedColumns};
use crate::effect::Place;
use crate::types::TorqueRecording;
use crate::weighted::JointNoise;
use std::ops::Range;

/// s around an event whose rows do not count either.
const EVENT_MARGIN: f64 = 0.3;

/// What all steps work on.
pub(super) struct TorqueProblem<'a> {
    pub(crate) scene: DynamicScene<'a>,
    /// s, of the first row.
    pub(crate) start: f64,
    pub(crate) reduction: Reduction,
    pub(crate) regressor: ReducedRegressor,
    pub(crate) all: TorqueColumns,
    /// 10 n numbers from which the base is counted.
    pub(crate) theta: Vec<f64>,
    /// `[joint][row]`, rows as recorded, filtered.
    torque: Vec<Vec<f64>>,
    /// s by which torques come late.
    pub(crate) latency: f64,
    /// `[joint]`: measured minus rigid torque of judged rows.
    pub(crate) measured: Vec<Vec<f64>>,
    /// Whether each judged row is held out.
    held_out: Vec<bool>,
    pub(crate) events: Vec<ContactEvent>,
    pub(crate) noise: Vec<JointNoise>,
    /// Causes at their places that are none: only a number at an end of its search would explain the torques, or cross-validation
    /// did not confirm them.
    pub(crate) barred: Vec<TorqueForm>,
    /// Whether the width of a sign has changed since columns of forms outside a set were made.
    is_stale: bool,
    /// Least and greatest, C, where it was recorded.
    pub(crate) temperature: Option<[f64; 2]>,
}

impl<'a> TorqueProblem<'a> {
    /// The problem of a checked recording.
    pub(crate) fn new(
        arm: &'a DynamicArm,
        recording: TorqueRecording,
        question: &TorqueQuestion,
        clock: &RecordingClock,
        cutoff: f64,
    ) -> Self {
        let scene = DynamicScene::new(arm, &recording, clock, cutoff, question.free_inertials);
        let reduction = Reduction::new(clock, cutoff);
        let regressor = ReducedRegressor::of(&scene, &reduction);
        let mut torque: Vec<Vec<f64>> = (0..recording.joints)
            .map(|joint| column(&recording.torque, recording.joints, joint))
            .collect();
        reduction.filter(&mut torque);
        let theta = scene.declared.as_ref().map_or_else(
            || vec![0.0; 10 * recording.joints],
            |declared| declared.theta.clone(),
        );
        let temperature = recording
            .temperature
            .as_ref()
            .map(|all| ends(all.iter().copied()));
        let mut problem = Self {
            held_out: reduction
                .rows
                .iter()
                .map(|row| recording.held_out[*row])
                .collect(),
            all: TorqueColumns::empty(),
            scene,
            start: recording.time[0],
            reduction,
            regressor,
            theta,
            torque,
            latency: 0.0,
            measured: Vec::new(),
            events: Vec::new(),
            noise: Vec::new(),
            barred: Vec::new(),
            is_stale: false,
            temperature: temperature.filter(|[least, most]| least <= most),
        };
        problem.shift(0.0);
        problem
    }

    /// Forms the columns.
    pub(crate) fn form(&mut self, without: &[String]) {
        let half_range = |joint: usize| {
            let course = self.torque_at(joint, self.latency);
            let fitted = course
                .iter()
                .zip(&self.held_out)
                .filter(|(_, held)| !**held);
            let [least, most] = ends(fitted.map(|(torque, _)| *torque));
            0.5 * (most - least)
        };
        let torque = (0..self.joints()).map(half_range).collect();
        self.all = TorqueColumns::new(
            &self.scene,
            &self.reduction,
            &self.regressor,
            without,
            torque,
        );
    }

    /// Takes a trial form; its number.
    pub(crate) fn push(&mut self, form: TorqueForm) -> usize {
        self.all
            .push(form, &self.scene, &self.reduction, &self.regressor)
    }

    /// Makes columns of a set of the sign of a velocity anew, after its width has changed; those of others wait.
    pub(crate) fn renew_signs(&mut self, set: &[usize]) {
        self.all
            .renew_signs(set, &self.scene, &self.reduction, &self.regressor);
        self.is_stale = true;
    }

    /// Makes the columns that wait anew.
    pub(crate) fn refresh(&mut self) {
        if std::mem::take(&mut self.is_stale) {
            let listed: Vec<usize> = (0..self.all.listed).collect();
            self.all
                .renew_signs(&listed, &self.scene, &self.reduction, &self.regressor);
        }
    }

    /// Columns that change a link's inertial numbers, and by what: of the base, and of the forms of a set.
    pub(crate) fn inertial_changes(
        &self,
        set: &[usize],
        link: usize,
    ) -> Vec<(usize, [f64; INERTIAL_NUMBERS])> {
        let base = self.all.base_changes.iter().enumerate();
        let mut changes: Vec<_> = base
            .filter(|(_, (body, _))| *body == link)
            .map(|(column, (_, ten))| (column, *ten))
            .collect();
        for number in set {
            let form = &self.all.forms[*number];
            let of_form = self
                .scene
                .declared
                .as_ref()
                .and_then(|declared| form.cause.inertial(form, declared));
            let columns = self.all.of(*number).zip(of_form.into_iter().flatten());
            changes.extend(
                columns
                    .filter(|(_, (body, _))| *body == link)
                    .map(|(column, (_, ten))| (column, ten)),
            );
        }
        changes
    }

    /// Inertial numbers with what coefficients change of them.
    pub(crate) fn inertials(&self, set: &[usize], solution: &[(usize, f64)]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        for link in 0..self.joints() {
            let body = &mut theta[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)];
            for (column, ten) in self.inertial_changes(set, link) {
                let value = value_of(solution, column);
                body.iter_mut()
                    .zip(ten)
                    .for_each(|(sum, part)| *sum += value * part);
            }
        }
        theta
    }

    /// Makes columns of the rigid torque and of friction anew, from the inertial numbers and the solution of a fit with a set of forms.
    pub(crate) fn believe(&mut self, theta: &[f64], set: &[usize], solution: &[(usize, f64)]) {
        self.scene.believe(theta);
        let coefficients: Vec<Vec<f64>> = set
            .iter()
            .map(|number| self.coefficients(*number, solution))
            .collect();
        let forms = set.iter().map(|number| &self.all.forms[*number]);
        let forms = forms.zip(coefficients.iter().map(Vec::as_slice));
        self.scene.friction = friction_of(forms, &self.scene);
        // A tilt times what is wrong of the masses looks like offsets.
        if set
            .iter()
            .any(|number| self.all.forms[*number].place == Place::Base)
        {
            self.scene.tilt(theta);
        }
        self.all
            .renew(&self.scene, &self.reduction, &self.regressor);
    }

    /// Coefficients of a form in a solution.
    pub(crate) fn coefficients(&self, form: usize, solution: &[(usize, f64)]) -> Vec<f64> {
        let columns = self.all.of(form);
        columns.map(|column| value_of(solution, column)).collect()
    }

    /// Nm, rms of the torque of a form in a solution, over the joints that it acts on.
    pub(crate) fn rms_of(&self, form: usize, solution: &[(usize, f64)]) -> f64 {
        let mut torques = vec![vec![0.0; self.reduction.rows.len()]; self.joints()];
        for column in self.all.of(form) {
            self.all.columns[column].add(value_of(solution, column), &mut torques);
        }
        torques.retain(|course| course.iter().any(|value| *value != 0.0));
        let square: f64 = torques.iter().flatten().map(|value| value * value).sum();
        (square / torques.iter().map(Vec::len).sum::<usize>().max(1) as f64).sqrt()
    }

    /// Number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.measured.len()
    }

    /// s, of judged rows, from the first recorded one.
    pub(crate) fn time(&self, row: usize) -> f64 {
        self.scene.time[self.reduction.rows[row]]
    }

    /// Measured torque of judged rows, as it was `latency` s later.
    pub(crate) fn torque_at(&self, joint: usize, latency: f64) -> Vec<f64> {
        let course = &self.torque[joint];
        let stretch_of = |row: usize| {
            self.scene
                .stretches
                .iter()
                .find(|stretch| stretch.contains(&row))
        };
        let at = |row: &usize| {
            let stretch = stretch_of(*row).cloned().unwrap_or(*row..*row + 1);
            interpolated(
                &course[stretch.clone()],
                (row - stretch.start) as f64 + latency * self.scene.rate,
            )
        };
        self.reduction.rows.iter().map(at).collect()
    }

    /// Measured minus rigid torque with torques that come `latency` s late.
    pub(crate) fn difference(&self, latency: f64) -> Vec<Vec<f64>> {
        let of_joint = |joint: usize| {
            let mut course = self.torque_at(joint, latency);
            let rigid = self.regressor.torque(joint, &self.theta);
            course
                .iter_mut()
                .zip(rigid)
                .for_each(|(value, rigid)| *value -= rigid);
            course
        };
        (0..self.torque.len()).map(of_joint).collect()
    }

    /// Takes a latency.
    pub(crate) fn shift(&mut self, latency: f64) {
        self.latency = latency;
        self.measured = self.difference(latency);
    }

    /// Courses of the regressor at each joint in some judged rows.
    pub(crate) fn base_courses(&self, rows: &[usize]) -> Vec<Vec<Vec<f64>>> {
        let numbers = 10 * self.joints();
        let of_joint = |joint: usize| {
            let courses = (10 * joint..numbers).map(|number| self.regressor.course(joint, number));
            let used = courses.filter(|course| course.iter().any(|value| *value != 0.0));
            used.map(|course| rows.iter().map(|row| course[*row]).collect())
                .collect()
        };
        (0..self.joints()).map(of_joint).collect()
    }

    /// Whether a judged row lies in an event.
    pub(crate) fn in_event(&self, row: usize) -> bool {
        let time = self.time(row);
        self.events
            .iter()
            .any(|event| time > event.start - EVENT_MARGIN && time < event.end + EVENT_MARGIN)
    }

    /// Whether a judged row is held out.
    pub(crate) fn is_held_out(&self, row: usize) -> bool {
        self.held_out[row]
    }

    /// Runs of judged rows outside events, of the fitted or of the held-out ones.
    pub(crate) fn runs(&self, held_out: bool) -> Vec<Range<usize>> {
        self.runs_where(|row| self.held_out[row] == held_out && !self.in_event(row))
    }

    /// Runs of judged rows that count.
    fn runs_where(&self, counts: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
        let mut runs = Vec::new();
        for run in &self.reduction.runs {
            let mut start = None;
            for row in run.clone() {
                match (counts(row), start) {
                    (true, None) => start = Some(row),
                    (false, Some(first)) => {
                        runs.push(first..row);
                        start = None;
                    }
                    _ => (),
                }
            }
            runs.extend(start.map(|first| first..run.end));
        }
        runs
    }

    /// Inner products of fitted rows under the present noise: of the base, all that causes list, and a set.
    pub(crate) fn weighted(&mut self, set: &[usize]) -> WeightedColumns {
        self.refresh();
        let listed = 0..self.all.listed;
        let forms: Vec<usize> = listed
            .clone()
            .chain(set.iter().copied().filter(|form| !listed.contains(form)))
            .collect();
        self.weighted_of(&forms)
    }

    /// The same of the base and some forms.
    pub(crate) fn weighted_of(&self, forms: &[usize]) -> WeightedColumns {
        let mut chosen: Vec<usize> = (0..self.all.base)
            .chain(forms.iter().flat_map(|form| self.all.of(*form)))
            .collect();
        chosen.sort_unstable();
        WeightedColumns::new(
            &self.all,
            &self.measured,
            self.weighing(&self.runs(false)),
            &chosen,
        )
    }

    /// The weighing of some runs under the present noise.
    pub(crate) fn weighing<'b>(&'b self, runs: &'b [Range<usize>]) -> Weighing<'b> {
        Weighing {
            noise: &self.noise,
            runs,
        }
    }

    /// What coefficients leave of the measured torque, Nm.
    pub(crate) fn residual(&self, solution: &[(usize, f64)]) -> Vec<Vec<f64>> {
        let mut left = self.measured.clone();
        for (column, value) in solution {
            self.all.columns[*column].add(-value, &mut left);
        }
        left
    }
}

/// A smooth course between its rows: cubic through the four nearest.
fn interpolated(course: &[f64], at: f64) -> f64 {
    let last = course.len() - 1;
    let at = at.clamp(0.0, last as f64);
    let row = (at.floor() as usize).min(last.saturating_sub(1));
    let share = at - row as f64;
    if share == 0.0 || last < 3 {
        return course[row] + share * (course[(row + 1).min(last)] - course[row]);
    }
    let first = row.saturating_sub(1).min(last - 3);
    let x = at - first as f64;
    (0..4)
        .map(|node: usize| {
            let others = (0..4).filter(|other| *other != node);
            let weight: f64 = others
                .map(|other| (x - other as f64) / (node as f64 - other as f64))
                .product();
            weight * course[first + node]
        })
        .sum()
}

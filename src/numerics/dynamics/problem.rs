//! A recording prepared for least squares: measured and rigid torque, base and forms in judged rows, and which of these count.

use super::arm::{DynamicArm, INERTIAL_NUMBERS};
use super::cause::{
    COULOMB, OFFSET, ROTOR, TORQUE_CAUSES, TorqueCause, TorqueForm, UNKNOWN, VISCOUS, declared,
    friction_of, of_greatest_load,
};
use super::columns::{ReducedRegressor, Reduction, TorqueColumn, TorqueColumns, columns_of};
use super::recording::{
    RecordingClock, TorqueRecording, add, by_joint, dot, ends, lagrange, largest, square,
};
use super::scene::DynamicScene;
use super::sweep::{SweptColumns, value_of};
use super::types::{ContactEvent, TorqueQuestion};
use super::weighted::{JointNoise, NoiseMemory, Weighing, WeightedColumns};
use crate::criteria::cells::{FAR, USUAL};
use crate::criteria::torque::MISLED;
use crate::effect::{DeclaredTorque, Place};
use crate::statistics::nearest;
use std::ops::Range;
use std::sync::Arc;

/// s around an event whose rows do not count either.
const EVENT_MARGIN: f64 = 0.3;

/// Hz: the low-pass, and up to where positions are those of the motion, not counts of an encoder.
#[derive(Debug, Clone, Copy)]
pub(super) struct TorqueBand {
    pub(crate) cutoff: f64,
    pub(crate) followed: f64,
}

impl TorqueBand {
    /// Positions are of the motion in all of it.
    pub(crate) fn whole(cutoff: f64) -> Self {
        Self {
            cutoff,
            followed: cutoff,
        }
    }
}

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
    /// Nm, `[joint][judged row]`: of the recording's own simulation less those of the declared masses.
    beyond: Option<Vec<Vec<f64>>>,
    /// s by which torques come late.
    pub(crate) latency: f64,
    /// Nm, `[joint][judged row]`: how far differentiation and rounding of the positions may move the rigid torque, by how far it moves with the
    /// filter of the positions; 0 where no masses are declared.
    pub(crate) numerics: Vec<Vec<f64>>,
    /// rad/s, of positions filtered at half the frequency.
    coarse_velocity: Vec<Vec<f64>>,
    /// `[joint]`: measured minus rigid torque of judged rows.
    pub(crate) measured: Vec<Vec<f64>>,
    /// Whether each judged row is held out.
    held_out: Vec<bool>,
    pub(crate) events: Vec<ContactEvent>,
    pub(crate) noise: Vec<JointNoise>,
    /// Causes at their places that are none: only a number at an end of its search would explain the torques, or cross-validation
    /// did not confirm them.
    pub(crate) barred: Vec<TorqueForm>,
    /// Laws of a user's own.
    own: Vec<Arc<DeclaredTorque>>,
    /// ln by which causes without a name are more probable than usual.
    pub(crate) openness: f64,
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
        band: TorqueBand,
    ) -> Self {
        let (cutoff, free) = (band.cutoff, question.free_inertials);
        let scene = DynamicScene::new(arm, &recording, clock, band.followed, free);
        let reduction = Reduction::new(clock, cutoff);
        let regressor = ReducedRegressor::of(&scene, &reduction);
        let mut torque = by_joint(&recording.torque, recording.joints);
        reduction.filter(&mut torque);
        let theta = scene.declared.as_ref().map_or_else(
            || vec![0.0; INERTIAL_NUMBERS * recording.joints],
            |declared| declared.theta.clone(),
        );
        let temperature = recording.temperature.as_ref();
        let temperature = temperature.map(|all| ends(all.iter().copied()));
        let coarse = DynamicScene::half_band(arm, &recording, clock, band.followed, free);
        let numerics = numerics_of(&scene, &coarse, &reduction);
        let rows = reduction.rows.iter();
        let mut problem = Self {
            beyond: scene.beyond.clone().map(|beyond| reduction.reduce(beyond)),
            numerics,
            coarse_velocity: coarse.velocity,
            held_out: rows.map(|row| recording.held_out[*row]).collect(),
            all: TorqueColumns::default(),
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
            own: question.effects.iter().cloned().map(Arc::new).collect(),
            openness: log_odds(question.open_world) - log_odds(*USUAL),
            is_stale: false,
            temperature: temperature.filter(|[least, most]| least <= most),
        };
        problem.shift(0.0);
        problem
    }

    /// Forms the columns of the base alone: of inertial numbers, and of how much earlier or later each joint's torque may come, which is held.
    pub(crate) fn form_base(&mut self) {
        let half_range = |joint: usize| {
            let course = self.torque_at(joint, self.latency).into_iter();
            let fitted = course.zip(&self.held_out).filter(|(_, held)| !**held);
            let [least, most] = ends(fitted.map(|(torque, _)| torque));
            0.5 * (most - least)
        };
        let torque = (0..self.joints()).map(half_range).collect();
        self.all = TorqueColumns::of_base(&self.scene, &self.regressor, torque);
        self.hold_shifts();
    }

    /// Forms the columns: of the base, and of all forms of all causes.
    pub(crate) fn form(&mut self) {
        self.form_base();
        let (nameless, causes): (Vec<&'static TorqueCause>, Vec<_>) = TORQUE_CAUSES
            .iter()
            .partition(|cause| cause.name == UNKNOWN);
        let scene = &self.scene;
        let forms = |cause: &'static TorqueCause| (cause.forms)(cause, scene);
        let named = causes.into_iter().flat_map(forms);
        let own = self.own.iter().flat_map(|law| declared(law, scene));
        let all: Vec<TorqueForm> = (named.chain(own))
            .chain(nameless.into_iter().flat_map(forms))
            .collect();
        for form in all {
            if !form.needs_turn(&self.scene.arm.prismatic) {
                self.push(form);
            }
        }
        self.all.listed = self.all.forms.len();
    }

    /// Whether a user has declared laws.
    pub(crate) fn has_own_laws(&self) -> bool {
        !self.own.is_empty()
    }

    /// Columns of a form.
    fn columns_of(&self, form: &TorqueForm) -> Vec<TorqueColumn> {
        columns_of(form, &self.scene, &self.reduction, &self.regressor)
    }

    /// Takes another form; its number.
    pub(crate) fn push(&mut self, form: TorqueForm) -> usize {
        let alike = self.all.alike(&form);
        let columns = alike.unwrap_or_else(|| self.columns_of(&form));
        self.all.take(form, columns)
    }

    /// Makes columns of some forms anew whose cause is concerned.
    fn renew(
        &mut self,
        forms: impl IntoIterator<Item = usize>,
        is_concerned: fn(&TorqueForm) -> bool,
    ) {
        for number in forms {
            let form = &self.all.forms[number];
            if is_concerned(form) {
                let fresh = self.columns_of(form);
                self.all.replace(number, &fresh);
            }
        }
    }

    /// Makes columns of a set of the sign of a velocity anew, after its width has changed; those of others wait.
    pub(crate) fn renew_signs(&mut self, set: &[usize]) {
        self.renew(set.iter().copied(), |form| form.cause.of_sign);
        self.is_stale = true;
    }

    /// Makes the columns that wait anew.
    pub(crate) fn refresh(&mut self) {
        if std::mem::take(&mut self.is_stale) {
            self.renew(0..self.all.listed, |form| form.cause.of_sign);
        }
    }

    /// Columns that change a link's inertial numbers, and by what: of the base, and of the forms of a set.
    pub(crate) fn inertial_changes(
        &self,
        set: &[usize],
        link: usize,
    ) -> Vec<(usize, [f64; INERTIAL_NUMBERS])> {
        let base = self.all.base_changes.iter().copied().enumerate();
        let of_forms = set.iter().flat_map(|number| {
            let changes = self.all.forms[*number].inertial(&self.scene);
            self.all.of(*number).zip(changes.unwrap_or_default())
        });
        base.chain(of_forms)
            .filter(|(_, (body, _))| *body == link)
            .map(|(column, (_, ten))| (column, ten))
            .collect()
    }

    /// Inertial numbers with what coefficients change of them.
    pub(crate) fn inertials(&self, set: &[usize], solution: &[(usize, f64)]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        for link in 0..self.joints() {
            let body = &mut theta[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)];
            for (column, ten) in self.inertial_changes(set, link) {
                add(body, value_of(solution, column), &ten);
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
        for form in &mut self.all.forms {
            of_greatest_load(form, &self.scene);
        }
        self.renew(0..self.all.forms.len(), TorqueForm::is_of_rigid);
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
        let stretches = &self.scene.stretches;
        let stretch_of = |row: usize| stretches.iter().find(|stretch| stretch.contains(&row));
        let later = latency * self.scene.rate;
        let (whole, share) = (later.floor(), later - later.floor());
        let weights: Vec<f64> = lagrange(&NODES, share).collect();
        let at = |row: &usize| {
            let stretch = stretch_of(*row).cloned().unwrap_or(*row..*row + 1);
            let begin = (row - stretch.start) as f64 + whole + NODES[0];
            let course = &course[stretch];
            let within = begin >= 0.0 && begin as usize + NODES.len() <= course.len();
            match within {
                true => dot(
                    &weights,
                    &course[begin as usize..begin as usize + NODES.len()],
                ),
                false => interpolated(course, begin - NODES[0] + share),
            }
        };
        self.reduction.rows.iter().map(at).collect()
    }

    /// Measured minus rigid torque with torques that come `latency` s late.
    pub(crate) fn difference(&self, latency: f64) -> Vec<Vec<f64>> {
        let of_joint = |joint: usize| {
            let mut course = self.torque_at(joint, latency);
            add(
                &mut course,
                -1.0,
                &self.regressor.torque(joint, &self.theta),
            );
            if let Some(beyond) = &self.beyond {
                add(&mut course, -1.0, &beyond[joint]);
            }
            course
        };
        (0..self.torque.len()).map(of_joint).collect()
    }

    /// Takes a latency.
    pub(crate) fn shift(&mut self, latency: f64) {
        self.latency = latency;
        self.measured = self.difference(latency);
    }

    /// Nm, rms over fitted rows of what numerics may make at some joints.
    pub(crate) fn numerics_at(&self, joints: &[usize]) -> f64 {
        let rows = self.counted_rows(false);
        let courses = joints.iter().map(|joint| &self.numerics[*joint]);
        let squares = courses.flat_map(|course| rows.iter().map(|row| course[*row].powi(2)));
        (squares.sum::<f64>() / (rows.len() * joints.len()).max(1) as f64).sqrt()
    }

    /// Nm, `[joint][judged row]`: how far some friction moves with the filter of the positions. Where a joint turns is not exactly at a row.
    pub(crate) fn friction_moved(
        &mut self,
        friction: impl Fn(&DynamicScene) -> Vec<Vec<f64>>,
    ) -> Vec<Vec<f64>> {
        let mut moved = friction(&self.scene);
        std::mem::swap(&mut self.scene.velocity, &mut self.coarse_velocity);
        let coarse = friction(&self.scene);
        std::mem::swap(&mut self.scene.velocity, &mut self.coarse_velocity);
        let courses = moved.iter_mut().zip(&coarse);
        courses.for_each(|(fine, coarse)| add(fine, -1.0, coarse));
        self.reduction.reduce(moved)
    }

    /// Coefficients that a fit of the base and a set has of how far the friction of a solution moves with the filter of the positions.
    pub(crate) fn moved_by_filter(
        &mut self,
        weighted: &WeightedColumns,
        set: &[usize],
        solution: &[(usize, f64)],
    ) -> Vec<(usize, f64)> {
        let coefficients = set
            .iter()
            .map(|number| self.coefficients(*number, solution));
        let coefficients: Vec<Vec<f64>> = coefficients.collect();
        let forms = set.iter().map(|number| self.all.forms[*number].clone());
        let forms: Vec<TorqueForm> = forms.collect();
        let moved = self.friction_moved(|scene| {
            let coefficients = coefficients.iter().map(Vec::as_slice);
            friction_of(forms.iter().zip(coefficients), scene)
        });
        let runs = self.runs(false);
        let weighted = weighted.with_measured(self.weighing(&runs).measured(&moved));
        let fit = SweptColumns::base(&self.all, &weighted).with(set);
        fit.solution()
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
        let counts = |row: usize| self.held_out[row] == held_out && !self.in_event(row);
        let of_run = |run: &Range<usize>| runs_where(run.clone(), counts);
        self.reduction.runs.iter().flat_map(of_run).collect()
    }

    /// The rows of these.
    pub(crate) fn counted_rows(&self, held_out: bool) -> Vec<usize> {
        self.runs(held_out).into_iter().flatten().collect()
    }

    /// Rows that judge: the held-out ones, the fitted ones where none are.
    pub(crate) fn judging_rows(&self) -> Vec<usize> {
        let held = self.counted_rows(true);
        match held.is_empty() {
            true => self.counted_rows(false),
            false => held,
        }
    }

    /// Inner products of fitted rows under the present noise: of the base, all that causes list, and a set.
    pub(crate) fn weighted(&mut self, set: &[usize]) -> WeightedColumns {
        self.refresh();
        let listed = 0..self.all.listed;
        let others = set.iter().copied().filter(|form| !listed.contains(form));
        self.weighted_of(&listed.clone().chain(others).collect::<Vec<usize>>())
    }

    /// The same of the base and some forms.
    pub(crate) fn weighted_of(&self, forms: &[usize]) -> WeightedColumns {
        self.weighted_by(self.weighing(&self.runs(false)), forms)
    }

    /// The same of the rows of a weighing.
    pub(crate) fn weighted_by(&self, weighing: Weighing, forms: &[usize]) -> WeightedColumns {
        let mut chosen = self.all.with_base(forms);
        chosen.sort_unstable();
        WeightedColumns::new(&self.all, &self.measured, weighing, &chosen)
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

/// ln of the odds of a probability.
fn log_odds(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}

/// s about a row over which what numerics make is taken for as large as the largest of it: a jump of an acceleration is not exactly at a row.
const AROUND: f64 = 0.12;

/// Share of a torque that the digits of a recording do not hold.
const DIGITS: f64 = 1e-5;

/// Nm: by how much rigid torques (`[joint][judged row]`) differ with positions filtered otherwise.
fn numerics_of(fine: &DynamicScene, coarse: &DynamicScene, reduction: &Reduction) -> Vec<Vec<f64>> {
    let courses = fine.rigid.iter().zip(&coarse.rigid);
    let apart = courses.map(|(fine, coarse)| fine.iter().zip(coarse).map(|(a, b)| a - b).collect());
    let apart = reduction.reduce(apart.collect());
    let around = (AROUND * reduction.rate).ceil() as usize;
    let widest = |course: Vec<f64>| {
        let of_row = |row: usize| {
            let first = row.saturating_sub(around);
            largest(&course[first..(row + around + 1).min(course.len())])
        };
        (0..course.len()).map(of_row).collect()
    };
    let rigid = reduction.reduce(fine.rigid.clone());
    let whole = apart.into_iter().map(widest).zip(rigid);
    whole
        .map(|(course, rigid): (Vec<f64>, Vec<f64>)| {
            let size = (square(&rigid) / rigid.len().max(1) as f64).sqrt();
            course.iter().map(|made| made + DIGITS * size).collect()
        })
        .collect()
}

/// Runs of rows that count.
fn runs_where(rows: Range<usize>, counts: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let rows: Vec<usize> = rows.collect();
    let parts = rows.split(|row| !counts(*row));
    let ends = parts.filter_map(|part| Some(*part.first()?..part.last()? + 1));
    ends.collect()
}

/// Rows about a time between two rows: a polynomial through fewer would smooth noise below the low-pass, which so would be less the farther
/// a time is from a row.
const NODES: [f64; 16] = [
    -7.0, -6.0, -5.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0,
];

/// A smooth course between its rows near an end: cubic through the four nearest.
fn interpolated(course: &[f64], at: f64) -> f64 {
    let last = course.len() - 1;
    let at = at.clamp(0.0, last as f64);
    let row = (at.floor() as usize).min(last.saturating_sub(1));
    let share = at - row as f64;
    if share == 0.0 || last < 3 {
        return course[row] + share * (course[(row + 1).min(last)] - course[row]);
    }
    let first = row.saturating_sub(1).min(last - 3);
    let weights = lagrange(&[0.0, 1.0, 2.0, 3.0], at - first as f64);
    weights
        .zip(&course[first..])
        .map(|(weight, value)| weight * value)
        .sum()
}

/// Scale and weights find each other in so many rounds.
const ROUNDS: usize = 4;
/// Standard deviation over the median of absolute values, of normal noise.
const MEDIAN: f64 = 1.4826;

/// The rich model's forms, and those of `set`.
pub(super) fn rich_forms(problem: &TorqueProblem, set: &[usize]) -> Vec<usize> {
    let forms = problem.all.forms.iter().enumerate();
    let rich = forms.filter(|(number, form)| (form.cause.rich)(form) && !set.contains(number));
    let rich = rich.map(|(number, _)| number);
    set.iter().copied().chain(rich).collect()
}

/// What hardly an arm is without.
pub(super) fn basic_forms(problem: &TorqueProblem) -> Vec<usize> {
    let forms = &problem.all.forms;
    let is_basic = |form: &usize| {
        let form = &forms[*form];
        form.width == 1 && [VISCOUS, COULOMB, OFFSET, ROTOR].contains(&form.name())
    };
    (0..problem.all.listed).filter(is_basic).collect()
}

/// Noise of each joint and the residual of a fit of the base and some forms to the fitted rows.
pub(super) fn noise_of_fit(
    problem: &TorqueProblem,
    forms: &[usize],
    memory: NoiseMemory,
) -> (Vec<JointNoise>, Vec<Vec<f64>>) {
    let runs = problem.runs(false);
    let mut residual = problem.measured.clone();
    for _ in 0..ROUNDS {
        let white = |course: &Vec<f64>| JointNoise::white(robust_sigma(course, &runs));
        let weighing = Weighing {
            noise: &residual.iter().map(white).collect::<Vec<_>>(),
            runs: &runs,
        };
        let weighted = problem.weighted_by(weighing, forms);
        let sweep = SweptColumns::base(&problem.all, &weighted).with(forms);
        residual = problem.residual(&sweep.solution());
    }
    let spent = problem.all.with_base(forms).len() as f64 / problem.joints() as f64;
    let courses = residual.iter().zip(&problem.numerics);
    let noise = courses.map(|(course, numerics)| {
        JointNoise::of(course, &runs, spent, memory)
            .at_least(&JointNoise::of(numerics, &runs, 0.0, memory))
    });
    (noise.collect(), residual)
}

/// s over which noise is summed up where its correlation misleads: friction changes its sign, and with it what it weighs, within a second.
const LASTS: f64 = 0.25;

/// Noise of each joint by a fit of the base and some forms that is thought to be right. White at joints where its correlation misleads (Hausman,
/// 1978): a fit by correlated noise weighs what changes from row to row, where a model that only nearly holds is wrong, and leaves more than
/// least squares by more than the scatter of these.
pub(super) fn noise_of(
    problem: &TorqueProblem,
    forms: &[usize],
    memory: NoiseMemory,
) -> Vec<JointNoise> {
    let (noise, least) = noise_of_fit(problem, forms, memory);
    let runs = problem.runs(false);
    let weighing = Weighing {
        noise: &noise,
        runs: &runs,
    };
    let weighted = problem.weighted_by(weighing, forms);
    let fit = SweptColumns::base(&problem.all, &weighted).with(forms);
    let left = problem.residual(&fit.solution());
    let columns = problem.all.with_base(forms);
    let lasts = (LASTS * problem.reduction.rate) as usize;
    let of_joint = |(joint, noise): (usize, &JointNoise)| {
        let sum = |course: &Vec<f64>| -> f64 {
            runs.iter().map(|run| square(&course[run.clone()])).sum()
        };
        let more = sum(&left[joint]) - sum(&least[joint]);
        let acting = columns.iter();
        let acting = acting.filter(|column| problem.all.columns[**column].at(joint).is_some());
        let scatter = acting.count() as f64 * noise.sigma.powi(2) * noise.autocorrelation();
        match more > *MISLED * scatter {
            true => noise.evened(&least[joint], &runs, lasts),
            false => noise.clone(),
        }
    };
    noise.iter().enumerate().map(of_joint).collect()
}

/// Noise by which what is found is weighed in the end: what the rich model leaves has lost its slow part with what is slow in that model, so
/// that its course is that of what a set leaves.
pub(super) fn noise_left(problem: &TorqueProblem, set: &[usize]) -> Vec<JointNoise> {
    let left = noise_of(problem, set, NoiseMemory::Long);
    let rich = problem.noise.iter();
    rich.zip(left)
        .map(|(rich, left)| JointNoise {
            sigma: rich.sigma,
            ..left
        })
        .collect()
}

/// Noise of a residual without the rows that stand far out: a push is none.
pub(super) fn noise_apart(problem: &TorqueProblem, residual: &[Vec<f64>]) -> Vec<JointNoise> {
    let runs = problem.runs(false);
    let of_course = |course: &Vec<f64>| {
        let rows = runs.iter().flat_map(|run| &course[run.clone()]);
        let mut sizes: Vec<f64> = rows.map(|value| value.abs()).collect();
        let most = *FAR * MEDIAN * nearest(&mut sizes, 0.5).unwrap_or(0.0);
        let is_near = |row: usize| course[row].abs() <= most;
        let near = |run: &Range<usize>| runs_where(run.clone(), is_near);
        let near: Vec<Range<usize>> = runs.iter().flat_map(near).collect();
        JointNoise::of(course, &near, 0.0, NoiseMemory::Short)
    };
    residual.iter().map(of_course).collect()
}

/// Half of the mean square, half of the median: neither outliers alone nor their absence decides.
fn robust_sigma(course: &[f64], runs: &[Range<usize>]) -> f64 {
    let rows = || runs.iter().flat_map(|run| course[run.clone()].iter());
    let count = rows().count().max(1) as f64;
    let square = rows().map(|value| value * value).sum::<f64>() / count;
    let mut sizes: Vec<f64> = rows().map(|value| value.abs()).collect();
    let middle = MEDIAN * nearest(&mut sizes, 0.5).unwrap_or(0.0);
    (0.5 * square + 0.5 * middle * middle).sqrt() + 1e-9
}

//! Torques that a planned motion needs, by the identified model: differentiated and composed as the recording was.

use super::arm::{DynamicArm, INERTIAL_NUMBERS};
use super::cause::{TorqueForm, friction_of};
use super::model::{COVERAGE, CovariancePlaces, JointRange, TorqueModel};
use super::newton_euler::InverseDynamics;
use super::recording::{RecordingClock, TorqueRecording, add, by_joint};
use super::refine::planned_slopes;
use super::scene::{DynamicScene, split};
use crate::effect::Place;
use crate::error::{Error, Result};
use std::fmt;

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

/// What a coefficient of a term of a model adds at a joint, Nm per unit, a value a row.
struct TermCourse {
    term: usize,
    number: usize,
    joint: usize,
    course: Vec<f64>,
}

impl TorqueModel {
    /// Torques of a motion of the arm that the model was identified on. Fails where sizes differ, there are fewer than ten rows, or no
    /// cause has a term's name.
    pub fn needed(&self, arm: &DynamicArm, motion: &PlannedMotion) -> Result<NeededTorques> {
        /// Rows that derivatives need.
        const LEAST: usize = 10;
        let (n, rows) = (self.joints(), motion.time.len());
        let [of_arm, of_motion] = [arm.joints(), motion.joints];
        if of_arm != n || of_motion != n || motion.position.len() != n * rows {
            let message =
                format!("the model has {n} joints, the arm {of_arm}, the motion {of_motion}");
            return Err(Error::data("motion", message));
        }
        if rows < LEAST {
            let message = format!("has {rows} rows; at least {LEAST} are needed");
            return Err(Error::data("motion", message));
        }
        let places = self.places()?;
        let forms = &places.forms;
        if motion.since_start.is_none()
            && let Some(law) = forms
                .iter()
                .filter_map(|form| form.law.as_ref())
                .find(|law| law.asks_time())
        {
            let message = format!(
                "the law `{}` of the model follows time: state how long ago the arm began to move (--since-start)",
                law.declaration().name
            );
            return Err(Error::data("motion", message));
        }
        let mut scene = self.scene(arm, motion);
        let declared = match &scene.declared {
            Some(declared) => scene.torques_of(&declared.theta),
            None => vec![vec![0.0; rows]; n],
        };
        scene.believe(&self.inertials);
        if forms.iter().any(|form| form.place == Place::Base) {
            scene.tilt(&self.inertials);
        }
        scene.friction = self.friction(forms, &scene);
        let courses = self.courses(forms, &scene);
        let mut torque = scene.rigid.clone();
        for one in &courses {
            add(&mut torque[one.joint], self.coefficient(one), &one.course);
        }
        let mut correction = torque.clone();
        for (course, declared) in correction.iter_mut().zip(&declared) {
            add(course, -1.0, declared);
        }
        let by_row = |courses: &[Vec<f64>]| {
            let rows = 0..rows;
            rows.flat_map(|row| courses.iter().map(move |course| course[row]))
                .collect()
        };
        Ok(NeededTorques {
            u95: self.uncertainty(&places, &mut scene, &courses),
            torque: by_row(&torque),
            load: by_row(&scene.rigid),
            correction: by_row(&correction),
            velocity: by_row(&scene.velocity),
            acceleration: by_row(&scene.acceleration),
        })
    }

    /// Nm, `[joint][row]`; `forms` are those of the terms.
    pub(super) fn friction(&self, forms: &[TorqueForm], scene: &DynamicScene) -> Vec<Vec<f64>> {
        let coefficients = self.terms.iter().map(|term| &term.coefficients[..]);
        friction_of(forms.iter().zip(coefficients), scene)
    }

    /// What each coefficient adds, term after term.
    fn courses(&self, forms: &[TorqueForm], scene: &DynamicScene) -> Vec<TermCourse> {
        let mut courses = Vec::new();
        for (term, form) in forms.iter().enumerate() {
            for joint in form.acts_on(self.joints()) {
                for number in 0..form.width {
                    let mut course = vec![0.0; scene.rows()];
                    form.write(scene, joint, number, &mut course);
                    courses.push(TermCourse {
                        term,
                        number,
                        joint,
                        course,
                    });
                }
            }
        }
        courses
    }

    /// Value of a coefficient.
    fn coefficient(&self, course: &TermCourse) -> f64 {
        self.terms[course.term].coefficients[course.number]
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
        // Where a temperature is not known, the arm is as warm as it was in the middle.
        let usual = self.temperature.map(|[least, most]| 0.5 * (least + most));
        let usual = usual.map_or_else(Vec::new, |usual| vec![usual; motion.time.len()]);
        scene.temperature = motion.temperature.clone().unwrap_or(usual);
        // A warm arm began to move longer ago than any time constant: what fades has faded.
        let begun = motion.since_start.unwrap_or(f64::INFINITY);
        scene.time.iter_mut().for_each(|time| *time += begun);
        if let Some(velocity) = &motion.velocity {
            scene.position = by_joint(&motion.position, n);
            scene.velocity = by_joint(velocity, n);
        }
        if let Some(acceleration) = &motion.acceleration {
            scene.acceleration = by_joint(acceleration, n);
        }
        scene
    }
}

// How far a torque that is fed forward may be off: by the covariance of the model's numbers, and by laws beyond what the recording visited.

impl TorqueModel {
    /// Nm, 95 %, row-major (rows x n); `None` where the model carries no covariance. The variance of a torque is that of its numbers, each
    /// through its terms (of a shape number to first order), what held-out rows leave beyond it, and the square of what each law adds times how far beyond its range it is used, as a
    /// share of that range.
    fn uncertainty(
        &self,
        places: &CovariancePlaces,
        scene: &mut DynamicScene,
        courses: &[TermCourse],
    ) -> Option<Vec<f64>> {
        let (forms, width) = (&places.forms, places.width);
        let covariance = self.covariance_of_all(width)?;
        let coefficients = self.terms.iter().map(|term| &term.coefficients);
        let coefficients: Vec<&Vec<f64>> = coefficients.collect();
        let first = places.shapes.first().copied().unwrap_or(width - 1);
        let shapes = planned_slopes(forms, &coefficients, scene);
        let scene = &*scene;
        let (n, rows) = (self.joints(), scene.rows());
        let mut places_left = 0..;
        let inertial = self.identified.iter();
        let inertial = inertial.map(|known| known.then(|| places_left.next()).flatten());
        let inertial: Vec<Option<usize>> = inertial.collect();
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
                    let placed = inertial[INERTIAL_NUMBERS * link..].iter().zip(numbers);
                    let placed = placed.filter_map(|(place, value)| Some(((*place)?, *value)));
                    slopes[joint].extend(placed.filter(|(_, value)| *value != 0.0));
                },
            );
            for (joint, slope) in slopes.iter_mut().enumerate() {
                slope.extend(by_joint[joint].iter().map(|one| {
                    let place = places.coefficients[one.term] + one.number;
                    (place, one.course[row])
                }));
                let of_shapes = shapes.iter().filter(|one| one.1 == joint);
                slope.extend(of_shapes.map(|(number, _, course)| (first + number, course[row])));
                let row_of = |(a, first): &(usize, f64)| {
                    let covariance_row = &covariance[a * width..(a + 1) * width];
                    let with = slope.iter().map(|(b, second)| covariance_row[*b] * second);
                    first * with.sum::<f64>()
                };
                let by_numbers = slope.iter().map(row_of).sum::<f64>().max(0.0);
                let variance = by_numbers + self.range[joint].misfit.powi(2);
                let variance = variance + self.beyond(forms, scene, &by_joint[joint], row);
                all.push(COVERAGE * variance.sqrt());
            }
        }
        Some(all)
    }

    /// Variance of laws that are used beyond the recording at a joint, Nm^2.
    fn beyond(
        &self,
        forms: &[TorqueForm],
        scene: &DynamicScene,
        courses: &[&TermCourse],
        row: usize,
    ) -> f64 {
        let mut variance = 0.0;
        for term in courses.chunk_by(|a, b| a.term == b.term) {
            let form = &forms[term[0].term];
            let joint = form.joint();
            let share = self.range[joint].beyond(form, scene, joint, row);
            if share > 0.0 {
                let parts = term
                    .iter()
                    .map(|one| self.coefficient(one) * one.course[row]);
                let torque: f64 = parts.sum();
                variance += (share * torque).powi(2);
            }
        }
        variance
    }
}

impl JointRange {
    /// How far a law is used beyond what was recorded of its variable, as a share of the recorded range.
    fn beyond(&self, form: &TorqueForm, scene: &DynamicScene, joint: usize, row: usize) -> f64 {
        let above = |value: f64, most: f64| match most > 0.0 {
            true => (value.abs() / most - 1.0).max(0.0),
            false => 0.0,
        };
        let load = match form.is_of_rigid() {
            true => above(scene.rigid[joint][row], self.load),
            false => 0.0,
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

/// Beyond the greatest speed, acceleration or load of the recording by more than this share, torques are extrapolated.
const BEYOND: f64 = 1.02;
/// rad: the same of positions.
const ASIDE: f64 = 0.02;
/// K: the same of temperatures.
const WARMER: f64 = 1.0;
/// So many times what is usual in the recorded motion an uncertainty is worth a remark, however small the correction; twice as much is refused.
const USUAL: f64 = 3.0;
/// Share of the correction above which an uncertainty is worth a remark.
const HALF: f64 = 0.5;

/// The limit, and whether a person insists on what it refuses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueGate {
    /// 95 % uncertainty of a joint's torque, Nm. `None`: the size of the correction itself, or six times what is usual in the recorded
    /// motion where that is more.
    pub uncertainty: Option<f64>,
    /// Rows beyond the limit are written all the same, with a remark.
    pub insisted: bool,
    /// Why the model itself is refused, where someone insisted on it: every row says so.
    pub model: Vec<String>,
}

/// Remarks on a row. Joints count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum TorqueRemark {
    /// A joint where, or faster than, or under more load than it was recorded, in words.
    BeyondRecorded(usize, &'static str),
    /// Colder or warmer than recorded: C, and the nearest that was.
    Temperature(f64, f64),
    /// Joint, correction and its uncertainty, Nm.
    Uncertain(usize, f64, f64),
    /// Beyond the limit: no torques are written.
    Refused(String),
    /// Beyond the limit, and written because someone insisted.
    Insisted(String),
}

impl fmt::Display for TorqueRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BeyondRecorded(joint, what) => write!(f, "joint {} {what}", joint + 1),
            Self::Temperature(at, known) => {
                let [colder, begins] = match at < known {
                    true => ["colder", "begins"],
                    false => ["warmer", "ends"],
                };
                write!(
                    f,
                    "{colder} than recorded: {at:.1} C, the recording {begins} at {known:.1} C"
                )
            }
            Self::Uncertain(joint, correction, u95) => write!(
                f,
                "joint {}: the correction of {correction:.3} Nm is uncertain by {u95:.3} Nm",
                joint + 1
            ),
            Self::Refused(reason) => write!(f, "refused: {reason}"),
            Self::Insisted(reason) => write!(f, "written because of --force: {reason}"),
        }
    }
}

/// The remarks of a row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JudgedRow(pub Vec<TorqueRemark>);

impl JudgedRow {
    /// Whether no torques are to be written.
    pub fn is_refused(&self) -> bool {
        self.has(|remark| matches!(remark, TorqueRemark::Refused(_)))
    }

    fn has(&self, is_one: fn(&TorqueRemark) -> bool) -> bool {
        self.0.iter().any(is_one)
    }

    /// Whether it was written because someone insisted.
    pub fn is_insisted(&self) -> bool {
        self.has(|remark| matches!(remark, TorqueRemark::Insisted(_)))
    }

    /// Whether it lies outside of what the recording visited.
    pub fn is_beyond(&self) -> bool {
        use TorqueRemark::{BeyondRecorded, Temperature};
        self.has(|remark| matches!(remark, BeyondRecorded(..) | Temperature(..)))
    }
}

impl fmt::Display for JudgedRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all: Vec<String> = self.0.iter().map(ToString::to_string).collect();
        f.write_str(&all.join("; "))
    }
}

impl TorqueModel {
    /// Remarks on each row of a motion, and which rows are refused.
    pub fn judged(
        &self,
        motion: &PlannedMotion,
        needed: &NeededTorques,
        gate: &TorqueGate,
    ) -> Vec<JudgedRow> {
        (0..motion.time.len())
            .map(|row| self.judged_row(motion, needed, gate, row))
            .collect()
    }

    fn judged_row(
        &self,
        motion: &PlannedMotion,
        needed: &NeededTorques,
        gate: &TorqueGate,
        row: usize,
    ) -> JudgedRow {
        let n = self.joints();
        let insisted = gate.model.iter().cloned().map(TorqueRemark::Insisted);
        let mut remarks: Vec<TorqueRemark> = insisted.collect();
        let mut reason = None;
        for (joint, seen) in self.range.iter().enumerate() {
            let at = n * row + joint;
            let outside = seen.outside(motion, needed, at);
            remarks.extend(outside.map(|what| TorqueRemark::BeyondRecorded(joint, what)));
            let Some(u95) = needed.u95.as_ref().map(|all| all[at]) else {
                continue;
            };
            let size = needed.correction[at].abs();
            if u95.is_nan() || u95 > (HALF * size).max(USUAL * seen.usual) {
                remarks.push(TorqueRemark::Uncertain(joint, size, u95));
            }
            let limit = gate
                .uncertainty
                .unwrap_or_else(|| size.max(2.0 * USUAL * seen.usual));
            if reason.is_none() && (u95.is_nan() || u95 > limit) {
                reason = Some(format!(
                    "joint {}: the correction of {size:.3} Nm is uncertain by {u95:.3} Nm, at most {limit:.3} Nm allowed (--max-uncertainty)",
                    joint + 1
                ));
            }
        }
        remarks.extend(self.outside_temperature(motion, row));
        let verdict = if gate.insisted {
            TorqueRemark::Insisted
        } else {
            TorqueRemark::Refused
        };
        remarks.extend(reason.map(verdict));
        JudgedRow(remarks)
    }

    fn outside_temperature(&self, motion: &PlannedMotion, row: usize) -> Option<TorqueRemark> {
        let at = motion.temperature.as_ref().map(|all| all[row])?;
        let [least, greatest] = self.temperature?;
        let known = at.clamp(least, greatest);
        ((at - known).abs() > WARMER).then_some(TorqueRemark::Temperature(at, known))
    }
}

impl JointRange {
    /// What of a joint's row is outside of what was recorded.
    fn outside(
        &self,
        motion: &PlannedMotion,
        needed: &NeededTorques,
        at: usize,
    ) -> impl Iterator<Item = &'static str> {
        let [least, greatest] = self.position;
        let aside = !(least - ASIDE..=greatest + ASIDE).contains(&motion.position[at]);
        let above = |value: f64, most: f64| value.abs() > BEYOND * most;
        let (faster, harder) = (
            above(needed.velocity[at], self.speed),
            above(needed.acceleration[at], self.acceleration),
        );
        let all = [
            (aside, "where it was not recorded"),
            (faster, "faster than recorded"),
            (harder, "accelerates more than recorded"),
            (
                above(needed.load[at], self.load),
                "under more load than recorded",
            ),
        ];
        all.into_iter()
            .filter(|(outside, _)| *outside)
            .map(|(_, what)| what)
    }
}

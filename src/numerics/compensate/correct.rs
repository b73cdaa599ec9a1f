//! Targets in, commands out: what precedes goes one after another, the solving in parallel, the order stays.

use super::{
    ArmSides, Chain, Circumstance, CommandSolution, CorrectedCommand, Gate, IdentifiedArm, Nominal,
    Reach, Remark, StatedPosture, ToolGoal, Uncertainty, beyond_limits, inverse, least_change,
    one_step,
    posture::{CountedArm, inverse_in},
};
use crate::error::counted;
use crate::robot::{JointConvention, RobotModel, RowTime, Visited};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;

/// m and rad: a target farther off is said to be not reached.
const REACHED: f64 = 1e-6;

/// rad: a stretched wrist turns a pose by less, 1 deg; a pose farther turned is another one.
const TURNED_AWAY: f64 = std::f64::consts::PI / 180.0;

/// rad or m: a smaller move has no direction.
const STILL: f64 = 1e-9;

/// A target as it was given, SI; joints and sides of approach as the controller counts them.
#[derive(Debug, Clone, Default)]
pub struct CommandTarget {
    /// Joints, rad or m, of a joint target or near a Cartesian one.
    pub q: Option<Vec<f64>>,
    /// Base frame.
    pub point: Option<Vector3<f64>>,
    /// Orientation of the tool, base frame; none where the target is a point.
    pub rotation: Option<Matrix3<f64>>,
    /// In which posture a Cartesian target is to be reached, where it says.
    pub posture: Option<StatedPosture>,
    /// kg, where the target says.
    pub payload: Option<f64>,
    /// C, where the target says.
    pub temperature: Option<f64>,
    /// s, on the clock of the recording, where the target says.
    pub time: Option<f64>,
    /// Side from which each joint comes, +1 or -1, where the target says.
    pub direction: Option<Vec<f64>>,
    /// Motor currents, A, where the target says.
    pub current: Option<Vec<f64>>,
}

/// How to correct, and what holds where a target does not say.
#[derive(Debug, Clone)]
pub struct CorrectionOptions {
    /// How targets and commands count the joints.
    pub convention: JointConvention,
    /// Cartesian columns are the targets though there are joints; these then say near which posture.
    pub cartesian: bool,
    /// Whether joint targets keep the nominal orientation.
    pub oriented: bool,
    /// One step by the nominal Jacobian instead of solving.
    pub one_step: bool,
    /// kg, where a target does not say.
    pub payload: f64,
    /// C, where a target does not say.
    pub temperature: Option<f64>,
    /// s, where a target does not say.
    pub time: Option<f64>,
    /// Whether the model knows times: one of a recording without a clock knows rows.
    pub clock: bool,
    /// Side of every joint as the controller counts, where a target does not say; else the order of the targets tells.
    pub direction: Option<f64>,
    /// Where the first Cartesian target is searched from, as the controller counts.
    pub start: Option<Vec<f64>>,
    /// Whether answers tell the uncertainty of the point.
    pub uncertainty: bool,
    /// Which corrections are refused.
    pub gate: Gate,
}

impl CorrectionOptions {
    /// Options for targets that say all there is, with joints counted so.
    pub fn counted_by(convention: JointConvention) -> Self {
        Self {
            convention,
            cartesian: false,
            oriented: false,
            one_step: false,
            payload: 0.0,
            temperature: None,
            time: None,
            clock: false,
            direction: None,
            start: None,
            uncertainty: true,
            gate: Gate::default(),
        }
    }
}

/// Corrects targets in their order: what a target does not say follows from the one before.
pub struct Corrector<'a> {
    arm: &'a IdentifiedArm,
    coverage: Option<Visited>,
    uncertainty: Option<Uncertainty>,
    manner: CorrectionOptions,
    /// The sides of the nominal arm, where it has some.
    sides: Option<ArmSides>,
    /// What of the model depends on motor currents.
    by_current: Option<String>,
    /// What of it depends on what no target states.
    by_what_is_not_stated: Vec<String>,
    /// Nominal joints of the target before.
    last: Option<Vec<f64>>,
    direction: Vec<f64>,
    /// Sums over all targets so far.
    pub tally: CorrectionTotals,
}

/// Results of all targets.
#[derive(Debug, Clone, Default)]
pub struct CorrectionTotals {
    /// How many targets.
    pub targets: u64,
    /// m.
    pub uncorrected_sum: f64,
    /// m.
    pub uncorrected_max: f64,
    /// Largest residual of those that are reached, m.
    pub residual_max: f64,
    /// Targets without a solution.
    pub not_reached: u64,
    /// Targets whose correction is beyond a limit: no joints.
    pub refused: u64,
    /// Targets beyond a limit that were written because someone insisted.
    pub insisted: u64,
    /// Targets that are reached but for their orientation.
    pub turned: u64,
    /// Targets beyond the limits of a joint.
    pub beyond_limits: u64,
    /// Targets beyond what was measured.
    pub beyond_measured: u64,
    /// Targets whose correction is uncertain by more than half of itself.
    pub uncertain: u64,
}

impl CorrectionTotals {
    fn add(&mut self, answer: &CorrectedCommand) {
        self.targets += 1;
        self.uncorrected_sum += answer.uncorrected;
        self.uncorrected_max = self.uncorrected_max.max(answer.uncorrected);
        if answer.q.is_some() {
            self.residual_max = self.residual_max.max(answer.residual);
        }
        let any = |is: fn(&Remark) -> bool| u64::from(answer.remarks.iter().any(is));
        let refused = any(|remark| matches!(remark, Remark::Refused(_)));
        self.refused += refused;
        self.insisted += any(|remark| matches!(remark, Remark::Insisted(_)));
        self.not_reached += u64::from(answer.q.is_none()) - refused;
        self.turned +=
            u64::from(answer.q.is_some()) * any(|remark| matches!(remark, Remark::Turned(_)));
        self.beyond_limits += any(|remark| matches!(remark, Remark::BeyondLimits(_)));
        self.uncertain += any(|remark| matches!(remark, Remark::Uncertain(..)));
        self.beyond_measured +=
            any(|remark| matches!(remark, Remark::BeyondMeasured(_) | Remark::BeyondFitted(..)));
    }

    /// What the correction does, in a line.
    pub fn summary(&self) -> String {
        format!(
            "{}; uncorrected error {:.3} mm on average, {:.3} mm at most; residual under the model: {:.1e} mm at most\n",
            counted(self.targets, "target"),
            self.uncorrected_sum / self.targets.max(1) as f64 * 1e3,
            self.uncorrected_max * 1e3,
            self.residual_max * 1e3
        )
    }

    /// What is wrong with some of them, a sentence a line.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let all = [
            (
                self.not_reached,
                "could not be reached and has",
                "could not be reached and have",
                "no joints",
            ),
            (
                self.refused,
                "is",
                "are",
                "beyond the limits of corrections and refused; --force writes them all the same",
            ),
            (
                self.insisted,
                "is",
                "are",
                "beyond the limits of corrections and written because of --force",
            ),
            (
                self.turned,
                "is",
                "are",
                "reached in position but not in orientation: the wrist is singular there",
            ),
            (self.beyond_limits, "leaves", "leave", "the joint limits"),
            (
                self.uncertain,
                "has",
                "have",
                "a correction that is uncertain by more than half of itself",
            ),
            (
                self.beyond_measured,
                "is",
                "are",
                "outside of what was measured: the model extrapolates there",
            ),
        ];
        let stated = all.into_iter().filter(|(count, ..)| *count > 0);
        stated.map(|(count, one, several, what)| {
            format!(
                "{count} of them {} {what}",
                if count == 1 { one } else { several }
            )
        })
    }
}

struct Job {
    /// None: the point that the nominal robot reaches at `home`.
    wanted: Option<ToolGoal>,
    home: Vec<f64>,
    /// The posture that is stated leads nowhere.
    other_posture: bool,
    circumstance: Circumstance,
}

impl<'a> Corrector<'a> {
    /// A corrector of an arm; nothing is solved yet.
    pub fn new(
        arm: &'a IdentifiedArm,
        coverage: Option<Visited>,
        uncertainty: Option<Uncertainty>,
        manner: CorrectionOptions,
    ) -> Self {
        let (joints, by_current) = (arm.model().robot.joints(), arm.by_current());
        let by_what_is_not_stated = arm.by_what_is_not_stated();
        let (direction, tally) = (vec![0.0; joints], CorrectionTotals::default());
        let sides = ArmSides::of(&arm.model().robot, &manner.convention);
        Self {
            arm,
            coverage,
            uncertainty,
            manner,
            sides,
            by_current,
            by_what_is_not_stated,
            last: None,
            direction,
            tally,
        }
    }

    /// Whether targets get an uncertainty.
    pub fn has_uncertainty(&self) -> bool {
        self.uncertainty.is_some() && self.manner.uncertainty
    }

    /// How targets and commands count the joints.
    pub fn convention(&self) -> &JointConvention {
        &self.manner.convention
    }

    /// The sides of the nominal arm, where it has some.
    pub fn sides(&self) -> Option<&ArmSides> {
        self.sides.as_ref()
    }

    /// Answers in the order of the targets, which follow those of the batch before; their joints are as the controller counts them.
    pub fn batch(&mut self, targets: Vec<CommandTarget>) -> Vec<CorrectedCommand> {
        let jobs: Vec<Job> = targets
            .into_iter()
            .map(|target| self.prepare(target))
            .collect();
        let this: &Self = self;
        let mut answers: Vec<CorrectedCommand> = jobs
            .par_iter()
            .map_init(
                || (this.arm.reach(), Nominal::new(&this.arm.model().robot)),
                |(reach, nominal), job| this.solve(reach, nominal, job),
            )
            .collect();
        for answer in &mut answers {
            self.tally.add(answer);
            if let Some(q) = &mut answer.q {
                self.manner.convention.to_controller(q);
            }
        }
        answers
    }

    fn prepare(&mut self, target: CommandTarget) -> Job {
        let robot: &RobotModel = &self.arm.model().robot;
        let n = robot.joints();
        let convention = &self.manner.convention;
        let of_robot = |q: Vec<f64>| changed(q, |q| convention.to_robot(q));
        let mut other_posture = false;
        let (wanted, home) = match (target.q.map(of_robot), target.point) {
            (Some(q), point) if !(self.manner.cartesian && point.is_some()) => (None, q),
            (q, point) => {
                let seed = q
                    .or_else(|| self.last.clone())
                    .or_else(|| self.manner.start.clone().map(of_robot));
                let oriented = target.rotation.is_some();
                let pose = Pose::new(
                    target.rotation.unwrap_or_else(Matrix3::identity),
                    point.unwrap_or_else(Vector3::zeros),
                );
                let wanted = ToolGoal { pose, oriented };
                let seed = seed.unwrap_or_else(|| vec![0.0; n]);
                let stated = target.posture.as_ref();
                let counted = CountedArm {
                    robot,
                    convention,
                    sides: self.sides.as_ref(),
                };
                let stated = stated.map(|posture| inverse_in(&counted, &wanted, &seed, posture));
                other_posture = matches!(stated, Some(None));
                (
                    Some(wanted),
                    stated
                        .flatten()
                        .unwrap_or_else(|| inverse(robot, &wanted, &seed)),
                )
            }
        };
        if let Some(last) = &self.last {
            for (direction, (now, before)) in self.direction.iter_mut().zip(home.iter().zip(last)) {
                if (now - before).abs() > STILL {
                    *direction = (now - before).signum();
                }
            }
        }
        self.last.get_or_insert_default().clone_from(&home);
        let fixed = self.manner.direction.map(|direction| vec![direction; n]);
        let stated = target
            .direction
            .or(fixed)
            .map(|sides| changed(sides, |sides| self.manner.convention.turn_sides(sides)));
        let stated_time = target
            .time
            .or(self.manner.time)
            .filter(|_| self.manner.clock);
        let circumstance = Circumstance {
            payload: target.payload.unwrap_or(self.manner.payload),
            temperature: target.temperature.or(self.manner.temperature),
            time: stated_time.map_or(RowTime::LongAfter, RowTime::At),
            direction: stated.unwrap_or_else(|| self.direction.clone()),
            current: target.current,
        };
        Job {
            wanted,
            home,
            other_posture,
            circumstance,
        }
    }

    fn solve(&self, reach: &mut Reach, nominal: &mut Nominal, job: &Job) -> CorrectedCommand {
        reach.under(&job.circumstance);
        let wanted = job.wanted.unwrap_or_else(|| ToolGoal {
            pose: nominal.place(&job.home),
            oriented: self.manner.oriented,
        });
        let found: CommandSolution = if self.manner.one_step {
            one_step(reach, nominal, &wanted, &job.home)
        } else {
            Self::reached(reach, &wanted, &job.home)
        };
        let turned = wanted.oriented && (found.turn > REACHED || found.turn.is_nan());
        let uncertainty = self
            .uncertainty
            .as_ref()
            .map(|uncertainty| uncertainty.at(reach, &found.q));
        let correction = self.arm.base().rotation
            * (reach.place(&job.home).translation - wanted.pose.translation);
        let certainty = self
            .uncertainty
            .as_ref()
            .map(|uncertainty| uncertainty.of_correction(reach, &found.q, &correction));
        let mut remarks = Vec::new();
        let off = if self.manner.one_step {
            left_by_nominal(nominal, job)
        } else {
            found.residual
        };
        let faces = !turned || found.turn <= TURNED_AWAY;
        let reached =
            !job.other_posture && off < REACHED && faces && found.q.iter().all(|q| q.is_finite());
        if job.other_posture {
            remarks.push(Remark::OtherPosture);
        } else if !reached {
            remarks.push(Remark::NotReached(faces.then_some(found.residual)));
        }
        if turned {
            remarks.push(Remark::Turned(found.turn));
        }
        if reached {
            let limits = beyond_limits(self.arm.model().robot.description(), &found.q);
            remarks.extend((!limits.is_empty()).then_some(Remark::BeyondLimits(limits)));
            let Circumstance {
                payload,
                temperature,
                ..
            } = job.circumstance;
            let unmeasured = self
                .coverage
                .iter()
                .flat_map(|visited| visited.beyond(&found.q, payload, temperature));
            remarks.extend(unmeasured.map(Remark::BeyondMeasured));
            remarks.extend(certainty.iter().filter_map(Remark::of_certainty));
            remarks.extend(certainty.iter().flat_map(Remark::beyond));
            let open = Some(&self.by_what_is_not_stated).filter(|findings| !findings.is_empty());
            remarks.extend(open.cloned().map(Remark::NotStated));
            let share = reach.share();
            if share < 1.0 {
                remarks.push(Remark::Faded(share));
            }
        }
        let nominal_goal = ToolGoal {
            pose: nominal.place(&job.home),
            oriented: true,
        };
        let turn = nominal_goal.turn_left(&reach.place(&job.home));
        let mut command = CorrectedCommand {
            q: reached.then_some(found.q),
            uncorrected: found.before,
            turn,
            residual: found.residual,
            iterations: found.iterations,
            uncertainty: uncertainty.filter(|_| self.manner.uncertainty),
            certainty,
            remarks,
        };
        let unstated = self
            .by_current
            .as_ref()
            .filter(|_| job.circumstance.current.is_none());
        let unstated = unstated.map(|finding| {
            format!("{finding} depends on the motor current, which the target does not state (columns i1_a, i2_a, ...)")
        });
        self.manner.gate.judge(&mut command, unstated);
        command
    }

    /// Where a whole pose cannot be had, as at a stretched wrist, the point goes before the orientation.
    fn reached(reach: &mut Reach, wanted: &ToolGoal, home: &[f64]) -> CommandSolution {
        let found = least_change(reach, wanted, home, home);
        if !wanted.oriented || (found.residual < REACHED && found.turn < REACHED) {
            return found;
        }
        let point = ToolGoal {
            oriented: false,
            ..*wanted
        };
        let CommandSolution {
            q,
            residual,
            before,
            iterations,
            ..
        } = least_change(reach, &point, home, home);
        let turn = wanted.turn_left(&reach.place(&q));
        CommandSolution {
            q,
            residual,
            turn,
            before,
            iterations: iterations + found.iterations,
        }
    }
}

fn changed(mut values: Vec<f64>, change: impl Fn(&mut [f64])) -> Vec<f64> {
    change(&mut values);
    values
}

/// How far (m) the nominal robot stays away from a Cartesian target: one step does not say whether there is a way.
fn left_by_nominal(nominal: &mut Nominal, job: &Job) -> f64 {
    job.wanted.map_or(0.0, |wanted| {
        (nominal.place(&job.home).translation - wanted.pose.translation).norm()
    })
}

/// A about z, then B about the new y, then C about the new x (rad): KUKA's A, B, C.
pub fn turns(a: f64, b: f64, c: f64) -> Matrix3<f64> {
    Rotation3::from_euler_angles(c, b, a).into_inner()
}

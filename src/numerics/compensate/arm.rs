//! The arm as identified: where it really puts the tool, in its own base frame, under stated circumstances.

use super::solve::{Chain, parts};
use crate::effect::{Effect, Form, PlacementBuffers, Variable};
use crate::estimate::Model;
use crate::estimate::choose::spread;
use crate::estimate::network::Correction;
use crate::robot::{Measurements, Memories, RowTime};
use crate::spatial::{Pose, Twist};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// Under which conditions a command will be carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct Circumstance {
    /// kg.
    pub payload: f64,
    /// C; none: that of the first recorded row.
    pub temperature: Option<f64>,
    /// By the clock of the recording.
    pub time: RowTime,
    /// Side from which each joint comes to rest, +1 or -1; 0 where unknown.
    pub direction: Vec<f64>,
    /// A, for models whose compliance is by motor current.
    pub current: Option<Vec<f64>>,
}

impl Circumstance {
    /// No payload, warm, nothing known of the approach.
    pub fn unknown(joints: usize) -> Self {
        Self {
            payload: 0.0,
            temperature: None,
            time: RowTime::LongAfter,
            direction: vec![0.0; joints],
            current: None,
        }
    }

    /// Those under which a row was measured.
    pub fn of_row(data: &Measurements, row: usize) -> Self {
        Self {
            payload: data.payload[row],
            temperature: data.temperature(row),
            time: data.row_time(row),
            direction: (0..data.joints)
                .map(|joint| data.direction(row, joint))
                .collect(),
            current: data.current(row).map(<[f64]>::to_vec),
        }
    }
}

/// An identified arm.
pub struct IdentifiedArm {
    model: Model,
    base: Pose,
    correction: Option<Correction>,
    /// Parameters of the measurement itself, which are zero here.
    quiet: Vec<usize>,
}

impl IdentifiedArm {
    /// The arm of a model; effects of the measurement itself are taken out.
    pub fn new(mut model: Model, correction: Option<Correction>) -> Self {
        let of_it = |form: &Form| form.is_of_the_measurement();
        let effects = model
            .stack
            .effects()
            .filter(|(effect, _)| effect.form().is_some_and(of_it));
        let quiet: Vec<usize> = effects.flat_map(|(_, range)| range).collect();
        for parameter in &quiet {
            model.x[*parameter] = 0.0;
        }
        let base = model.base();
        Self {
            model,
            base,
            correction,
            quiet,
        }
    }

    /// The same arm with targets in another base, given in the tracker's frame.
    pub fn standing_at(self, base: Pose) -> Self {
        Self { base, ..self }
    }

    /// Nominal arm, effects and their values.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Positions of the parameters that belonged to the measurement by which the arm was identified.
    pub(super) fn of_the_measurement(&self) -> &[usize] {
        &self.quiet
    }

    /// The effect and place that depends on motor currents, where one does: without them it is nothing.
    pub(super) fn by_current(&self) -> Option<String> {
        self.moved_by(|effect| effect.needs_current()).next()
    }

    /// Effects of a kind that have a size, with their places.
    fn moved_by(&self, is: impl Fn(&dyn Effect) -> bool) -> impl Iterator<Item = String> {
        let (specs, x) = (self.model.stack.specs(), &self.model.x);
        let effects = self.model.stack.effects();
        effects
            .filter(move |(effect, _)| is(*effect))
            .filter_map(|(effect, mut range)| {
                let k = range.find(|k| x[*k] != 0.0)?;
                Some(format!("{} at {}", effect.name(), specs[k].place))
            })
    }

    /// Effects and places that depend on what no target states: on moves before it, as of an arm that rested, or on another circumstance, which
    /// counts for nothing.
    pub fn by_what_is_not_stated(&self) -> Vec<String> {
        let follows = |form: &Form| form.variables().into_iter().any(Variable::is_no_targets);
        let moved = self.moved_by(|effect| effect.form().is_some_and(follows));
        let places: BTreeSet<String> = moved.collect();
        places.into_iter().collect()
    }

    /// The base that targets are in, in the tracker's frame.
    pub fn base(&self) -> &Pose {
        &self.base
    }

    /// What was learned on top, if anything.
    pub(crate) fn correction(&self) -> Option<&Correction> {
        self.correction.as_ref()
    }

    /// Buffers to place the arm with; one a thread.
    pub fn reach(&self) -> Reach<'_> {
        let joints = self.model.robot.joints();
        let data = Measurements {
            joints,
            q: vec![0.0; joints],
            payload: vec![0.0],
            long_after: true,
            direction: Some(vec![0.0; joints]),
            ..Measurements::default()
        };
        let Model {
            robot, stack, x, ..
        } = &self.model;
        let mut scratch = stack.scratch(robot);
        stack.only_points(robot, &data, x, &mut scratch);
        Reach {
            arm: self,
            scratch,
            data,
            velocities: vec![Twist::zeros(); joints],
            sources: Vec::new(),
        }
    }
}

/// A law that a command takes beyond the rows that it was fitted to.
pub(super) struct BeyondFitted {
    /// First parameter of its form, in the stack.
    pub(crate) parameter: usize,
    /// What it is a function of.
    pub(crate) variable: Variable,
    /// What it may be off there: of the point, m2, tracker frame.
    pub(crate) covariance: Matrix3<f64>,
}

impl BeyondFitted {
    /// Its size squared, in any direction: what a law does there may have another direction than all of the correction.
    pub(crate) fn square(&self) -> f64 {
        self.covariance.trace()
    }
}

/// One arm being placed.
pub struct Reach<'a> {
    arm: &'a IdentifiedArm,
    scratch: PlacementBuffers,
    /// A single row: the command and its circumstances.
    data: Measurements,
    velocities: Vec<Twist>,
    sources: Vec<f64>,
}

impl Reach<'_> {
    /// Takes load, temperature, time and directions of a target from here on.
    pub fn under(&mut self, circumstance: &Circumstance) {
        let Circumstance {
            payload,
            temperature,
            time,
            direction,
            current,
        } = circumstance;
        self.data.payload[0] = *payload;
        self.data.temperature = temperature.map(|value| vec![value]);
        (self.data.time, self.data.long_after) = match time {
            RowTime::At(time) => (Some(vec![*time]), false),
            RowTime::LongAfter => (None, true),
        };
        self.data
            .direction
            .get_or_insert_default()
            .clone_from(direction);
        self.data.current.clone_from(current);
        self.data.memories = Memories::default();
        // What is computed for one target must not depend on the one before.
        self.scratch.near(false);
    }

    /// How much of the learned correction applies at the command placed last: 1 inside its range, 0 far outside; 1 without one.
    pub(crate) fn share(&mut self) -> f64 {
        let Some(correction) = self.arm.correction() else {
            return 1.0;
        };
        self.fill_sources();
        correction.at(&self.sources).share
    }

    /// The derivative of the point (m, tracker frame) at command `q` by every parameter of the model.
    pub(super) fn derivatives(&mut self, q: &[f64], emit: impl FnMut(usize, Vector3<f64>)) {
        self.data.q.copy_from_slice(q);
        let Model {
            robot, stack, x, ..
        } = &self.arm.model;
        self.scratch.points_and_partials();
        stack.derivatives(robot, &self.data, 0, x, &mut self.scratch, emit);
        stack.only_points(robot, &self.data, x, &mut self.scratch);
    }

    /// Laws that command `q` takes beyond the rows that they were fitted to.
    pub(super) fn beyond_fitted(&mut self, q: &[f64]) -> Vec<BeyondFitted> {
        self.data.q.copy_from_slice(q);
        let Model {
            robot, stack, x, ..
        } = &self.arm.model;
        let motion = stack.point_motion(robot, &self.data, 0, x, &mut self.scratch);
        let beyond = stack.beyond(robot, &self.data, x, &motion).into_iter();
        // What belonged to the measurement moves no arm.
        beyond
            .filter(|(_, _, covariance)| covariance.trace() > 0.0)
            .map(|(parameter, variable, covariance)| BeyondFitted {
                parameter,
                variable,
                covariance,
            })
            .collect()
    }

    /// Sum over the revolute joints of the outer products of the point's derivatives (m per rad, base frame) at command `q`.
    pub(super) fn joint_scatter(&mut self, q: &[f64]) -> Matrix3<f64> {
        self.place(q);
        let robot = &self.arm.model.robot;
        let revolute = self
            .velocities
            .iter()
            .enumerate()
            .filter(|(joint, _)| robot.is_revolute(*joint));
        revolute
            .map(|(_, velocity)| velocity.fixed_rows::<3>(0).into_owned())
            .map(|v| v * v.transpose())
            .sum()
    }

    fn fill_sources(&mut self) {
        self.sources.clear();
        self.sources.extend_from_slice(&self.data.q);
        self.sources.push(self.data.payload[0]);
    }
}

impl Chain for Reach<'_> {
    fn place(&mut self, q: &[f64]) -> Pose {
        self.data.q.copy_from_slice(q);
        let Model {
            robot, stack, x, ..
        } = &self.arm.model;
        let mut pose = stack
            .place(robot, &self.data, 0, x, &mut self.scratch)
            .tool(&mut self.velocities);
        self.scratch.near(true);
        let base = &self.arm.base;
        if let Some(correction) = &self.arm.correction {
            self.fill_sources();
            pose.translation += Vector3::from(correction.at(&self.sources).delta);
        }
        for velocity in &mut self.velocities {
            let (v, w) = parts(velocity);
            let (v, w) = (base.rotation.tr_mul(&v), base.rotation.tr_mul(&w));
            *velocity = Twist::new(v.x, v.y, v.z, w.x, w.y, w.z);
        }
        Pose::new(
            base.rotation.tr_mul(&pose.rotation),
            base.inverse_point(&pose.translation),
        )
    }

    fn velocities(&self) -> &[Twist] {
        &self.velocities
    }
}

/// Poses over which it is seen.
const POSES: usize = 30;

/// m: a smaller displacement by the load is of no account.
const MATTERS: f64 = 1e-6;

/// Whether a load of `heaviest` kg moves the tool of the arm, or turns it away, from where it is without one.
pub fn load_matters(arm: &IdentifiedArm, heaviest: f64) -> bool {
    let robot = &arm.model().robot;
    let poses = spread(robot, POSES);
    let bare = Circumstance::unknown(robot.joints());
    let loaded = Circumstance {
        payload: heaviest,
        ..bare.clone()
    };
    let mut reach = arm.reach();
    (0..poses.rows()).any(|row| {
        reach.under(&bare);
        let without = reach.place(poses.q(row));
        reach.under(&loaded);
        (reach.place(poses.q(row)).translation - without.translation).norm() > MATTERS
    })
}

/// Why targets without a payload are refused; `load`: the largest that was measured, kg.
pub fn unstated_payload(load: f64) -> String {
    format!(
        "states no payload, and the identified arm depends on it (measured up to {load} kg): give --payload KG, 0 where nothing is carried; a table may have a column payload_kg, a program tooldata or $LOAD"
    )
}

/// A circumstance that a person states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stated {
    /// Mass at the tool, kg.
    Payload,
    /// C.
    Temperature,
    /// Side from which a joint comes to rest.
    Direction,
}

/// C.
const ABSOLUTE_ZERO: f64 = -273.15;

impl Stated {
    /// What is wrong with a number of it, and what is allowed.
    pub fn fault(self, value: f64) -> Option<String> {
        let (holds, allowed) = match self {
            Self::Payload => (value >= 0.0, "a mass of 0 or more, kg"),
            Self::Temperature => (value > ABSOLUTE_ZERO, "a temperature above -273.15 C"),
            Self::Direction => (
                [-1.0, 0.0, 1.0].contains(&value),
                "a direction: 1, -1, or 0 where it is not known",
            ),
        };
        (!(holds && value.is_finite())).then(|| format!("expected {allowed}, found {value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::Stated;

    #[test]
    fn what_no_circumstance_can_be_is_told_with_what_is_allowed() {
        for (stated, value, fault) in [
            (
                Stated::Payload,
                -5.0,
                "expected a mass of 0 or more, kg, found -5",
            ),
            (
                Stated::Payload,
                f64::INFINITY,
                "expected a mass of 0 or more, kg, found inf",
            ),
            (
                Stated::Temperature,
                -500.0,
                "expected a temperature above -273.15 C, found -500",
            ),
            (
                Stated::Temperature,
                f64::NAN,
                "expected a temperature above -273.15 C, found NaN",
            ),
            (
                Stated::Direction,
                7.0,
                "expected a direction: 1, -1, or 0 where it is not known, found 7",
            ),
        ] {
            assert_eq!(stated.fault(value).as_deref(), Some(fault));
        }
        for (stated, value) in [
            (Stated::Payload, 0.0),
            (Stated::Temperature, -273.0),
            (Stated::Direction, -1.0),
            (Stated::Direction, 0.0),
        ] {
            assert_eq!(stated.fault(value), None);
        }
    }
}

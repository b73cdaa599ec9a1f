//! The chosen effects, composed: the only place with the chain rule Ad(prefix) J_left(xi) d(xi)/dp.
//!
//! P = base E_0 exp(x1 (q1 + d1)) E_1 ... exp(xn (qn + dn)) E_n tool, with E_k = exp of the summed twists at station k.

use super::placed_row::{PlacedRow, PlacementBuffers, Rates, Station, Turns};
use super::{
    ArmState, BasePlacement, BeyondRange, Deflection, Direction, Effect, Law, ParameterSpec,
    Variable, names,
};
use crate::robot::{Measurements, Posture, RobotModel, Travel};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Matrix3x6, Vector3};
use std::ops::Range;
use std::sync::Arc;

/// Effects in a fixed order with their parameters numbered through.
pub struct EffectStack {
    effects: Vec<Member>,
    specs: Vec<ParameterSpec>,
    base: Pose,
}

/// An effect, the range of its parameters, and what it asks for.
struct Member {
    effect: Arc<dyn Effect>,
    range: Range<usize>,
    torque: bool,
    sight: bool,
    constant: bool,
}

impl Member {
    fn new(effect: Arc<dyn Effect>, range: Range<usize>) -> Self {
        Self {
            torque: effect.needs_torque(),
            sight: effect.needs_sight(),
            constant: effect.is_constant(),
            effect,
            range,
        }
    }
}

impl EffectStack {
    /// Composes effects; `base` is the start of `base_frame`.
    pub fn new(robot: &RobotModel, base: Pose, effects: Vec<Box<dyn Effect>>) -> Self {
        let mut specs = Vec::new();
        let mut numbered = Vec::new();
        for effect in effects {
            let first = specs.len();
            specs.extend(effect.parameters(robot));
            numbered.push(Member::new(Arc::from(effect), first..specs.len()));
        }
        Self {
            effects: numbered,
            specs,
            base,
        }
    }

    /// The same effects with another start of `base_frame`, about which its parameters count from zero.
    pub(crate) fn standing_at(&self, base: Pose) -> Self {
        let again = |member: &Member| {
            let effect: Arc<dyn Effect> = match member.effect.name() {
                names::BASE_FRAME => Arc::new(BasePlacement::new(base)),
                _ => member.effect.clone(),
            };
            Member::new(effect, member.range.clone())
        };
        Self {
            effects: self.effects.iter().map(again).collect(),
            specs: self.specs.clone(),
            base,
        }
    }

    fn needs_torque(&self) -> bool {
        self.effects.iter().any(|member| member.torque)
    }

    /// The same stack with the laws of its forms held at the ends of what some rows have of their variables.
    pub(crate) fn held_within(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        rows: &[usize],
        x: &[f64],
    ) -> Self {
        let mut ranges: Vec<Vec<Option<[f64; 2]>>> = vec![Vec::new(); self.effects.len()];
        let mut pairs: Vec<Vec<[f64; 2]>> = vec![Vec::new(); self.effects.len()];
        let mut scratch = self.scratch(robot);
        for row in rows {
            let point = self.place(robot, data, *row, x, &mut scratch).point;
            let state = ArmState::new(data, *row, &scratch.posture, point);
            let kept = ranges.iter_mut().zip(&mut pairs);
            for (member, (ranges, pairs)) in self.effects.iter().zip(kept) {
                let sizes = (member.effect)
                    .form()
                    .map_or_else(Vec::new, |form| form.sizes(robot, &state));
                ranges.resize(sizes.len(), None);
                if let [Some(first), Some(second)] = sizes[..] {
                    pairs.push([first, second]);
                }
                for (size, range) in sizes.into_iter().zip(ranges) {
                    if let Some(size) = size.filter(|size| size.is_finite()) {
                        *range = Some(
                            range.map_or([size; 2], |[low, high]| [low.min(size), high.max(size)]),
                        );
                    }
                }
            }
        }
        let kept = ranges.into_iter().zip(&pairs);
        let held = |(member, (ranges, pairs)): (&Member, (Vec<_>, &Vec<[f64; 2]>))| {
            let held: Arc<dyn Effect> = match member.effect.form() {
                Some(form) => Arc::new(form.fitted_within(ranges, pairs)),
                None => member.effect.clone(),
            };
            Member::new(held, member.range.clone())
        };
        Self {
            effects: self.effects.iter().zip(kept).map(held).collect(),
            specs: self.specs.clone(),
            base: self.base,
        }
    }

    /// What forms may be off in a row, of which `motion` is, that is beyond the rows that they were fitted to: the first parameter of each,
    /// the variable that is most beyond, and the covariance of the point, m2, tracker frame.
    pub(crate) fn beyond(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        x: &[f64],
        motion: &PointMotion,
    ) -> Vec<(usize, Variable, Matrix3<f64>)> {
        let state = motion.state(data, motion.row);
        let mut beyond = BeyondRange::new(robot.joints());
        let mut out = Vec::new();
        for Member { effect, range, .. } in &self.effects {
            let (Some(form), p) = (effect.form(), &x[range.clone()]) else {
                continue;
            };
            beyond.clear();
            let Some(variable) = form.beyond(robot, &state, p, &mut beyond) else {
                continue;
            };
            let moved = |(factor, motions): (f64, &[(usize, Direction)])| {
                let sum: Vector3<f64> = motions
                    .iter()
                    .map(|(k, direction)| motion.point_along(direction) * p[*k])
                    .sum();
                sum * sum.transpose() * (factor * factor)
            };
            out.push((range.start, variable, beyond.groups().map(moved).sum()));
        }
        out
    }

    /// All parameters in the order of `x`.
    pub fn specs(&self) -> &[ParameterSpec] {
        &self.specs
    }

    /// Where the base stands in the tracker's frame before any correction.
    pub fn base(&self) -> &Pose {
        &self.base
    }

    /// Effects and the range of their parameters.
    pub fn effects(&self) -> impl Iterator<Item = (&dyn Effect, Range<usize>)> {
        self.effects
            .iter()
            .map(|member| (member.effect.as_ref(), member.range.clone()))
    }

    /// Positions of the parameters of an effect by its canonical name, at all of its places.
    pub fn parameters_of(&self, name: &str) -> impl Iterator<Item = usize> {
        self.effects()
            .filter(move |(effect, _)| effect.name() == name)
            .flat_map(|(_, range)| range)
    }

    /// Buffers for [`EffectStack::place`], one a thread.
    pub fn scratch(&self, robot: &RobotModel) -> PlacementBuffers {
        PlacementBuffers::new(robot.joints())
    }

    /// Prepares for rows of which only the points are wanted, all under the same `x`: there are no partials, and what is the same at
    /// every row is summed once.
    pub(crate) fn only_points(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        x: &[f64],
        scratch: &mut PlacementBuffers,
    ) {
        scratch.deflection.clear();
        scratch.deflection.bare = true;
        scratch.constant = None;
        let state = ArmState::new(data, 0, &scratch.posture, Vector3::zeros());
        for Member { effect, range, .. } in self.effects.iter().filter(|member| member.constant) {
            effect.deflect(robot, &state, &x[range.clone()], &mut scratch.deflection);
        }
        scratch.constant = Some((
            scratch.deflection.joint.clone(),
            scratch.deflection.station.clone(),
        ));
    }

    /// Places the arm of a row under parameters `x`: all that it shows follows from what comes back.
    ///
    /// Torques are taken at the arm's own geometry, first unwound, then wound up; what a third pass would add is of the order of
    /// the wind-up (rad) cubed.
    pub fn place<'a>(
        &self,
        robot: &'a RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &'a mut PlacementBuffers,
    ) -> PlacedRow<'a> {
        for (travel, q) in scratch.commanded.iter_mut().zip(data.q(row)) {
            *travel = if scratch.near {
                travel.moved(q - travel.value())
            } else {
                Travel::new(*q)
            };
        }
        scratch.deflection.clear();
        if let Some((joint, station)) = &scratch.constant {
            scratch.deflection.joint.copy_from_slice(joint);
            scratch.deflection.station.copy_from_slice(station);
        }
        scratch.target = robot.setup().target(data.target(row));
        self.deflect(Needs::Nothing, robot, (data, row), x, scratch);
        let mut point = self.chain(robot, scratch);
        if self.needs_torque() {
            scratch.deflection.keep();
            scratch.load_correction.clear();
            for Member { effect, range, .. } in &self.effects {
                effect.load_correction(
                    data.q(row),
                    data.payload[row],
                    &x[range.clone()],
                    &mut scratch.load_correction,
                );
            }
            for _ in 0..2 {
                scratch
                    .posture
                    .gravity_torques(robot, data.payload[row], &scratch.load_correction);
                scratch.deflection.restore();
                self.deflect(Needs::Torque, robot, (data, row), x, scratch);
                point = self.chain(robot, scratch);
            }
        }
        if self.effects.iter().any(|member| member.sight) {
            self.deflect(Needs::Sight(point), robot, (data, row), x, scratch);
            point += scratch.deflection.reading;
        }
        PlacedRow {
            robot,
            scratch,
            point,
        }
    }

    /// The measured point (m, tracker frame) of a row under parameters `x`.
    pub fn point(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut PlacementBuffers,
    ) -> Vector3<f64> {
        self.place(robot, data, row, x, scratch).point
    }

    /// The measured point, and its derivative by every parameter through `emit(parameter, derivative)`, as `PlacedRow::partials`.
    pub fn derivatives(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut PlacementBuffers,
        emit: impl FnMut(usize, Vector3<f64>),
    ) -> Vector3<f64> {
        let mut placed = self.place(robot, data, row, x, scratch);
        placed.partials(emit);
        placed.point
    }

    /// What the row shows of any effect, in the stack or not. The arm hangs as the stack makes it hang.
    pub fn point_motion(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut PlacementBuffers,
    ) -> PointMotion {
        let point = self.point(robot, data, row, x, scratch);
        if !self.needs_torque() {
            scratch
                .posture
                .gravity_torques(robot, data.payload[row], &scratch.load_correction);
        }
        scratch.velocities(robot, &point);
        PointMotion {
            row,
            point,
            posture: scratch.posture.clone(),
            compliance: scratch.deflection.compliance.clone(),
            by_station: scratch.by_station.clone(),
            by_joint: scratch.by_joint.clone(),
            turns: None,
        }
    }

    /// The same with how the target turns.
    pub fn target_motion(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut PlacementBuffers,
    ) -> PointMotion {
        let motion = self.point_motion(robot, data, row, x, scratch);
        PointMotion {
            turns: Some(scratch.turns(robot)),
            ..motion
        }
    }

    /// Adds the motions of the effects with the given need.
    fn deflect(
        &self,
        needs: Needs,
        robot: &RobotModel,
        (data, row): (&Measurements, usize),
        x: &[f64],
        scratch: &mut PlacementBuffers,
    ) {
        let point = if let Needs::Sight(point) = needs {
            point
        } else {
            Vector3::zeros()
        };
        let state = ArmState::new(data, row, &scratch.posture, point);
        let summed = scratch.constant.is_some();
        let due = |member: &&Member| match needs {
            Needs::Nothing => !(member.torque || member.sight || summed && member.constant),
            Needs::Torque => member.torque,
            Needs::Sight(_) => member.sight,
        };
        for Member { effect, range, .. } in self.effects.iter().filter(due) {
            scratch.deflection.start(range.start);
            effect.deflect(robot, &state, &x[range.clone()], &mut scratch.deflection);
        }
    }

    fn chain(&self, robot: &RobotModel, scratch: &mut PlacementBuffers) -> Vector3<f64> {
        let n = robot.joints();
        let mut frame = self.base;
        for (k, (twist, station)) in scratch
            .deflection
            .station
            .iter()
            .zip(&mut scratch.stations)
            .enumerate()
        {
            if *twist != station.twist {
                *station = Station::of(twist);
            }
            scratch.before[k] = frame;
            if !station.still {
                frame = frame * station.motion;
            }
            scratch.posture.behind[k] = frame;
            if k < n {
                frame = frame
                    * robot.motion(k, &scratch.commanded[k].moved(scratch.deflection.joint[k]));
                scratch.posture.body[k] = frame;
            }
        }
        frame.point(&robot.mounting(scratch.target).translation)
    }
}

/// How a row's target moves with everything that an effect can do.
pub struct PointMotion {
    row: usize,
    /// Predicted point, tracker frame, m.
    pub(crate) point: Vector3<f64>,
    /// Joints and loads as they really are.
    pub posture: Posture,
    /// rad/Nm.
    compliance: Vec<f64>,
    by_station: Vec<Matrix3x6<f64>>,
    /// m/rad (m/m).
    pub by_joint: Vec<Vector3<f64>>,
    /// Where orientations are asked for.
    turns: Option<Turns>,
}

impl PointMotion {
    fn state<'a>(&'a self, data: &'a Measurements, row: usize) -> ArmState<'a> {
        ArmState::new(data, row, &self.posture, self.point)
    }

    /// A variable of one number in this row; none where the row does not tell.
    pub fn value(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        variable: Variable,
    ) -> Option<f64> {
        variable.value(0, robot, &self.state(data, row))
    }

    /// Puts into `buffer` where each parameter of an effect acts at zero.
    pub fn deflect(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        effect: &dyn Effect,
        zeros: &[f64],
        buffer: &mut Deflection,
    ) {
        buffer.clear();
        buffer.start(0);
        effect.deflect(robot, &self.state(data, self.row), zeros, buffer);
    }

    fn rates(&self) -> Rates<'_> {
        Rates {
            by_joint: &self.by_joint,
            by_station: &self.by_station,
            compliance: &self.compliance,
        }
    }

    /// Derivative of the point as the tracker reads it, m per unit of a parameter that acts there.
    pub(crate) fn point_along(&self, direction: &Direction) -> Vector3<f64> {
        self.rates().along(direction)
    }

    /// Derivative of the vector from the row's anchor to the point, which is `reach`, m per unit.
    pub(crate) fn anchor_reach_along(
        &self,
        direction: &Direction,
        reach: &Vector3<f64>,
    ) -> Vector3<f64> {
        self.rates().anchor_reach(direction, reach)
    }

    /// Rotation of the target about the tracker's axes, rad per unit; zero where turns were not asked for.
    pub(crate) fn turn_along(&self, direction: &Direction) -> Vector3<f64> {
        let turns = self.turns.as_ref();
        turns
            .and_then(|turns| turns.along(direction, &self.compliance))
            .unwrap_or_else(Vector3::zeros)
    }

    /// The values of a law's functions in this row, numbered; none of those that the row does not tell.
    pub fn law(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        law: &Law,
        mut each: impl FnMut(usize, f64),
    ) {
        law.values(robot, &self.state(data, self.row), &mut each);
    }
}

/// What an effect must know before it can deflect.
#[derive(Clone, Copy, PartialEq)]
enum Needs {
    Nothing,
    /// Gravity torque, known only once the arm stands somewhere.
    Torque,
    /// The target's point, tracker frame, m, known only once the arm stands as all else makes it.
    Sight(Vector3<f64>),
}

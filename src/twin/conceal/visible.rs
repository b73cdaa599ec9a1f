//! What is left of an effect when geometry, ratios and couplings have absorbed what they can: differences of the twin by its own
//! true numbers, and the effect's displacement less its shadow on them. Columns are coordinates of all points, tracker frame, m.

use crate::arm::{Arm, Motion, Row};
use crate::effect::{self, Physical};
use crate::matrix::{Column, Shadow, length};
use crate::plan::Point;
use crate::recorder::{Equilibrium, settle, sighted};
use crate::tracker::Tracker;
use crate::truth::TrueRobot;
use crate::{matrix, memory};
use calib_foundation::description::RobotDescription;

/// What a recording is made of, but for its effects and its noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Site<'a> {
    /// As its owner believes it to be.
    pub(crate) robot: &'a RobotDescription,
    /// With a number for every joint, link and coupling.
    pub(crate) truth: &'a TrueRobot,
    /// Where it stands and how well it measures.
    pub(crate) tracker: &'a Tracker,
    /// In the order of measurement.
    pub(crate) points: &'a [Point],
}

impl Site<'_> {
    /// What the tracker would see without effects and noise of the joints that are logged under `effects`.
    fn bare(&self, truth: &TrueRobot, tracker: &Tracker, effects: &[Physical]) -> Column {
        let arm = Arm::new(self.robot, truth);
        let (still, base) = (Motion::none(arm.links.len()), tracker.base());
        let rows = self.points.iter().flat_map(|point| {
            let mut q = point.q.clone();
            let logs = effects.iter();
            logs.for_each(|effect| effect.log(&mut q, &point.before));
            let posture = arm.posture(&truth.drive(self.robot, &q), &still);
            matrix::place(&base, posture.tool)
        });
        rows.collect()
    }

    /// Every row with the arm as it rests there under effects.
    fn at_rest<'s>(
        &'s self,
        effects: &'s [Physical],
    ) -> impl Iterator<Item = (Row, Equilibrium)> + 's {
        let mut arm = Arm::new(self.robot, self.truth);
        effects.iter().for_each(|effect| effect.shape(&mut arm));
        let memories = effect::recall(effects, &memory::past(self.points));
        let points = self.points.iter().zip(memories);
        points.map(move |(point, memory)| {
            let row = point.row(self.truth.drive(self.robot, &point.q), memory);
            let settled = settle(&arm, &row, effects);
            (row, settled)
        })
    }

    /// What the tracker sees with effects, less what it would see without them of the joints as logged.
    pub(crate) fn displacement(&self, effects: &[Physical]) -> Column {
        let base = self.tracker.base();
        let seen = self
            .at_rest(effects)
            .flat_map(|(row, settled)| sighted(&settled, &base, &row, effects));
        let bare = self.bare(self.truth, self.tracker, effects);
        seen.zip(bare).map(|(seen, bare)| seen - bare).collect()
    }

    /// What foreign effects do at the points after the first `fit` ones beyond what these show of them, root mean square of a coordinate, m:
    /// the effects less the same known without noise at the points to fit, and straight between them.
    pub(crate) fn unseen(&self, fit: usize, effects: &[Physical]) -> f64 {
        let is_foreign = |effect: &Physical| matches!(effect, Physical::Foreign(_));
        if !effects.iter().any(is_foreign) {
            return 0.0;
        }
        let mut seen: Vec<Vec<Vec<f64>>> = vec![Vec::new(); effects.len()];
        let base = self.tracker.base();
        for (row, settled) in self.at_rest(effects).take(fit) {
            let tool = settled.posture.tool;
            let there = matrix::place(&matrix::times(&settled.motion.tracker, &base), tool);
            for (index, effect) in effects.iter().enumerate() {
                if let Physical::Foreign(foreign) = effect {
                    let memory = row.memory.get(index).copied().unwrap_or(0.0);
                    let is_sighted = foreign.motion.is_sighted();
                    let point = if is_sighted { there } else { tool };
                    seen[index].push(foreign.values(&row, memory, &settled.torque, point));
                }
            }
        }
        let known = |(effect, values): (&Physical, &Vec<Vec<f64>>)| match effect {
            Physical::Foreign(foreign) => Physical::Foreign(foreign.known_at(values)),
            other => other.clone(),
        };
        let known: Vec<Physical> = effects.iter().zip(&seen).map(known).collect();
        let [all, known] = [effects, &known].map(|effects| self.displacement(effects));
        let judged = all.iter().zip(&known).skip(3 * fit);
        let judged: Column = judged.map(|(all, known)| all - known).collect();
        length(&judged) / (judged.len().max(1) as f64).sqrt()
    }

    /// Central differences by every number of geometry, gears, couplings and the tracker's pose.
    fn geometry(&self) -> Vec<Column> {
        let mut out = Vec::new();
        let mut push = |step: f64, change: &dyn Fn(&mut TrueRobot, &mut Tracker, f64)| {
            let at = |side: f64| {
                let (mut truth, mut tracker) = (self.truth.clone(), self.tracker.clone());
                change(&mut truth, &mut tracker, side * step);
                self.bare(&truth, &tracker, &[])
            };
            let (above, below) = (at(1.0), at(-1.0));
            let sides = above.iter().zip(&below);
            out.push(sides.map(|(a, b)| (a - b) / (2.0 * step)).collect());
        };
        // Steps of about 1e-5 rad or m: truncation and rounding are both about 1e-10 of the difference.
        for joint in 0..self.robot.joints.len() {
            push(1e-5, &|truth, _, by| {
                truth.offset_deg[joint] += by.to_degrees()
            });
            push(1e-5, &|truth, _, by| truth.ratio[joint] += by);
            for axis in 0..3 {
                push(0.01, &|truth, _, by| {
                    truth.links[joint].shift_mm[axis] += by
                });
                push(2.0, &|truth, _, by| {
                    truth.links[joint].tilt_arcsec[axis] += by
                });
            }
        }
        for coupling in 0..self.truth.couplings.len() {
            push(1e-5, &|truth, _, by| truth.couplings[coupling].error += by);
        }
        for axis in 0..3 {
            push(0.01, &|_, tracker, by| tracker.position_mm[axis] += by);
            push(0.0005, &|_, tracker, by| {
                tracker.roll_pitch_yaw_deg[axis] += by
            });
        }
        out
    }

    /// Root mean square of a coordinate's noise: the tracker's, and the joints' from move to move (rad), m.
    pub(crate) fn noise(&self, play_rad: f64) -> f64 {
        let bare = self.bare(self.truth, self.tracker, &[]);
        let (points, _) = bare.as_chunks::<3>();
        let square = |point: &[f64; 3]| 3.0 * self.tracker.sigma(*point).powi(2);
        let beam: f64 = points.iter().map(square).sum();
        let mut play = 0.0;
        if play_rad > 0.0 {
            for joint in 0..self.robot.joints.len() {
                let mut truth = self.truth.clone();
                truth.offset_deg[joint] += 1e-4f64.to_degrees();
                let moved = self.bare(&truth, self.tracker, &[]);
                let square = |(a, b): (&f64, &f64)| ((a - b) / 1e-4 * play_rad).powi(2);
                play += moved.iter().zip(&bare).map(square).sum::<f64>();
            }
        }
        ((beam + play) / bare.len().max(1) as f64).sqrt()
    }

    /// The space of everything that geometry can do.
    pub(crate) fn shadow(&self) -> Shadow {
        Shadow::of(self.geometry())
    }
}

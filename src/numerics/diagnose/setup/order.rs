//! Columns of joints in another order than the robot's: all orders are tried, by few rows first.

use crate::criteria::setup::{COUNTINGS, ORDERED, SCREENED};
use crate::robot::RobotModel;
use crate::setup::counting::{AffineImage, LIMIT};
use crate::setup::placement::PointPairs;
use rayon::prelude::*;

/// The column, from 0, that holds each joint of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ColumnOrder([u8; LIMIT]);

impl ColumnOrder {
    /// The column of each joint.
    pub(crate) fn columns(&self, joints: usize) -> Vec<usize> {
        let first = self.0.iter().take(joints);
        first.map(|column| usize::from(*column)).collect()
    }

    /// The joint of each column.
    pub(crate) fn joints(&self, joints: usize) -> Vec<usize> {
        let columns = self.columns(joints);
        let mut out = vec![0; joints];
        for (joint, column) in columns.iter().enumerate() {
            out[*column] = joint;
        }
        out
    }

    /// The numbers of the columns -> joint positions of the robot file.
    pub(crate) fn to_robot(self, q: &mut [f64]) {
        let columns = self.columns(q.len());
        let read: Vec<f64> = columns.iter().map(|column| q[*column]).collect();
        q.copy_from_slice(&read);
    }

    /// The orders that leave least of these points, but for that of the file and exchanges of two; none of an arm of too many joints.
    pub(crate) fn likely(pairs: &PointPairs) -> Vec<Self> {
        let robot = pairs.robot;
        if robot.joints() > LIMIT || robot.joints() < 3 {
            return Vec::new();
        }
        let mut all = Vec::new();
        extend(robot, &mut Vec::new(), &mut all);
        for (rows, kept) in [(*ORDERED, *SCREENED), (*SCREENED, *COUNTINGS)] {
            let affine = AffineImage {
                pairs: &pairs.every(rows),
            };
            let judged = all.into_par_iter();
            let judged = judged.map(|order: Self| (affine.left_with(|q| order.to_robot(q)), order));
            let mut judged: Vec<(f64, Self)> = judged.collect();
            judged.sort_by(|a, b| a.0.total_cmp(&b.0));
            all = judged
                .into_iter()
                .take(kept)
                .map(|(_, order)| order)
                .collect();
        }
        all
    }
}

/// All orders that begin so, in which no column holds a joint of the other kind: units tell lengths from angles.
fn extend(robot: &RobotModel, begun: &mut Vec<u8>, all: &mut Vec<ColumnOrder>) {
    let joints = robot.joints();
    if begun.len() == joints {
        let moved = (0..joints).filter(|joint| usize::from(begun[*joint]) != *joint);
        if moved.count() > 2 {
            let mut order = [0; LIMIT];
            order[..joints].copy_from_slice(begun);
            all.push(ColumnOrder(order));
        }
        return;
    }
    let turns = |joint: usize| robot.is_revolute(joint);
    for column in 0..joints {
        let is_free = !begun.contains(&(column as u8));
        if is_free && turns(column) == turns(begun.len()) {
            begun.push(column as u8);
            extend(robot, begun, all);
            begun.pop();
        }
    }
}

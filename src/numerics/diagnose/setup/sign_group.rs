//! Joints that a controller counts the other way together: makers reverse joints by the role of their axes, not one by one.
//!
//! Of an upright arm the axes of pitch are parallel to that of the first pitch joint, the others (swivel and roll) lie in the arm's
//! plane: joints 1, 4 and 6 of the usual six, which are tried whatever the wrist. Then come all joints, and every two.

use crate::robot::RobotModel;

/// Joints, from 0, as bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SignGroup(u64);

impl SignGroup {
    /// The groups of two joints or more that a robot may have: swivel and roll, pitch, the pitch of the main axes, all, and every two.
    pub(crate) fn all(robot: &RobotModel) -> Vec<Self> {
        let turning: Vec<usize> = (0..robot.joints().min(64))
            .filter(|joint| robot.is_revolute(*joint))
            .collect();
        let pitch = turning
            .windows(2)
            .find(|pair| robot.is_parallel(pair[0], pair[1]))
            .map(|pair| pair[0]);
        let of = |choose: &dyn Fn(usize) -> bool| {
            Self::of(turning.iter().copied().filter(|joint| choose(*joint)))
        };
        let mut out = vec![of(&|joint| {
            robot.joints() == 6 && [0, 3, 5].contains(&joint)
        })];
        if let Some(pitch) = pitch {
            let is_pitch = |joint: usize| robot.is_parallel(pitch, joint);
            let wrist = (pitch..robot.joints())
                .find(|joint| !is_pitch(*joint))
                .unwrap_or(robot.joints());
            out.extend([
                of(&|joint| !is_pitch(joint)),
                of(&is_pitch),
                of(&|joint| is_pitch(joint) && joint < wrist),
            ]);
        }
        out.push(of(&|_| true));
        let two = |k: usize| turning[k + 1..].iter().map(move |b| (k, *b));
        out.extend(
            (0..turning.len())
                .flat_map(two)
                .map(|(k, b)| Self::of([turning[k], b].into_iter())),
        );
        let mut all: Vec<Self> = Vec::new();
        for group in out.into_iter().filter(|group| group.0.count_ones() > 1) {
            if !all.contains(&group) {
                all.push(group);
            }
        }
        all
    }

    fn of(joints: impl Iterator<Item = usize>) -> Self {
        Self(joints.fold(0, |bits, joint| bits | 1 << joint))
    }

    /// Its joints, from 0.
    pub(crate) fn joints(self) -> impl Iterator<Item = usize> {
        (0..64).filter(move |joint| self.0 >> joint & 1 == 1)
    }
}

//! `base_frame`: where the robot's base stands in the tracker's frame; six parameters about the base origin, tracker axes.

use super::{ArmState, Deflection, Effect, ParameterSpec, Place, names};
use crate::robot::RobotModel;
use crate::spatial::{Pose, Twist};
use crate::units::Unit;
use nalgebra::Vector3;

/// Corrections to a starting pose: exp of the twist, given in tracker axes, applied in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct BasePlacement {
    start: Pose,
}

const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

impl BasePlacement {
    /// Corrections from a start; all zero there.
    pub fn new(start: Pose) -> Self {
        Self { start }
    }

    /// The base pose after corrections `p` (m, rad).
    pub(crate) fn pose(&self, p: &[f64]) -> Pose {
        let mut twist = Twist::zeros();
        for (parameter, value) in p.iter().enumerate() {
            twist += self.direction(parameter) * *value;
        }
        self.start * Pose::exp(&twist)
    }

    fn direction(&self, parameter: usize) -> Twist {
        let local: Vector3<f64> = self.start.rotation.row(parameter % 3).transpose();
        let mut twist = Twist::zeros();
        twist
            .fixed_rows_mut::<3>(if parameter < 3 { 0 } else { 3 })
            .copy_from(&local);
        twist
    }
}

impl Effect for BasePlacement {
    fn name(&self) -> &'static str {
        names::BASE_FRAME
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        AXES.iter()
            .enumerate()
            .map(|(k, axis)| ParameterSpec {
                name: format!("base_frame.{axis}"),
                place: Place::Base,
                unit: if k < 3 {
                    Unit::Millimetre
                } else {
                    Unit::Radian
                },
                prior_sigma: if k < 3 { 10.0 } else { 1.0 },
            })
            .collect()
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn deflect(&self, _robot: &RobotModel, _state: &ArmState, p: &[f64], out: &mut Deflection) {
        for parameter in 0..6 {
            out.shift(parameter, p, 0, self.direction(parameter));
        }
    }
}

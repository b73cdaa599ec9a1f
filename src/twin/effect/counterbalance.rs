//! A balancer beside a joint's gear: it takes torque off the gear, and who leaves it out overrates the wind-up.

use super::{Act, Motion, State, effect};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What makes the torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Balancer {
    /// `sin(q + phase)`: a coil spring on a crank, long against its stretch.
    Spring,
    /// `sin u / (1.25 - cos u)` with `u = q + phase`, times 0.75: a gas strut whose pressure rises as it is driven in.
    Gas,
}

effect! {
    /// Torque of a balancer.
    pub struct Counterbalance {
        /// From 1.
        pub joint: usize,
        /// What pushes.
        pub balancer: Balancer,
        /// The largest torque on the joint, Nm; its sign is that of the turn.
        pub torque_nm: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "counterbalance" at joint, scaled by torque_nm, |self| [("torque", "Nm", self.torque_nm)]
}

impl Act for Counterbalance {
    fn act(&self, state: &State, motion: &mut Motion) {
        let (sine, cosine) =
            (state.row.command[self.joint - 1] + self.phase_deg.to_radians()).sin_cos();
        let course = match self.balancer {
            Balancer::Spring => sine,
            // sin u / (b - cos u) peaks at 1 / sqrt(b^2 - 1), 4/3 for b = 1.25.
            Balancer::Gas => 0.75 * sine / (1.25 - cosine),
        };
        motion.load[self.joint - 1] += self.torque_nm * course;
    }
}

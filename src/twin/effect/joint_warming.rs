//! A joint that is warm: by its own work, which cools off, or by the arm's temperature, which it follows late. Its zero moves, its
//! gear's ratio, or its spring softens.

use super::{Act, Motion, State, effect};
use crate::memory::{self, Moment};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the warmth `w` comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Heat {
    /// Travel of the joint that has not yet cooled off, rad.
    Work,
    /// The same of casing and oil, each with its time, half of each.
    Oil,
    /// The logged temperature over the reference, followed with the time constant, K.
    Temperature,
}

effect! {
    /// The joint turns by `w (zero + ratio q + softening torque)`.
    pub struct JointWarming {
        /// From 1.
        pub joint: usize,
        /// What warms the joint.
        pub heat: Heat,
        /// Time constant, s; of temperature 0: at once.
        #[serde(default)]
        pub time_s: f64,
        /// That of the oil, s.
        #[serde(default = "minute")]
        pub oil_s: f64,
        /// Warmth at which it saturates, as `full tanh(w / full)`; 0: it does not.
        #[serde(default)]
        pub full: f64,
        /// Temperature at which nothing is off, C.
        #[serde(default = "room")]
        pub reference_c: f64,
        /// arcsec per unit of warmth.
        #[serde(default)]
        pub zero_arcsec: f64,
        /// arcsec per rad of the joint and unit of warmth.
        #[serde(default)]
        pub ratio_arcsec_per_rad: f64,
        /// rad/Nm per unit of warmth.
        #[serde(default)]
        pub softening_rad_per_nm: f64,
    }
    "joint_warming" at joint, scaled by zero_arcsec ratio_arcsec_per_rad softening_rad_per_nm, |self| {
        let kelvin = self.heat == Heat::Temperature;
        let [zero, ratio, softening] =
            if kelvin { ["arcsec/K", "arcsec/rad/K", "rad/Nm/K"] } else { ["arcsec/rad", "arcsec/rad2", "1/Nm"] };
        [
            ("zero", zero, self.zero_arcsec),
            ("ratio", ratio, self.ratio_arcsec_per_rad),
            ("softening", softening, self.softening_rad_per_nm),
            ("time", "s", self.time_s),
        ]
    }
}

fn minute() -> f64 {
    60.0
}

fn room() -> f64 {
    20.0
}

impl Act for JointWarming {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        let zero =
            ARCSEC * (self.zero_arcsec + self.ratio_arcsec_per_rad * state.row.command[joint]);
        motion.joint[joint] +=
            state.memory * (zero + self.softening_rad_per_nm * state.torque[joint]);
    }
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        let warmth = match self.heat {
            Heat::Work => memory::recent_travel(past, self.joint, self.time_s),
            Heat::Oil => {
                let casing = memory::recent_travel(past, self.joint, self.time_s);
                let oil = memory::recent_travel(past, self.joint, self.oil_s);
                casing
                    .iter()
                    .zip(oil)
                    .map(|(casing, oil)| 0.5 * (casing + oil))
                    .collect()
            }
            Heat::Temperature => {
                let joint = memory::behind(past, self.time_s, self.reference_c);
                joint
                    .into_iter()
                    .map(|celsius| celsius - self.reference_c)
                    .collect::<Vec<f64>>()
            }
        };
        let held = |w: f64| {
            if self.full > 0.0 {
                self.full * (w / self.full).tanh()
            } else {
                w
            }
        };
        warmth.into_iter().map(held).collect()
    }
}

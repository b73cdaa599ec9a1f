//! What the findings of a model depend on: only that is worth a remark where it was never visited.

use crate::diagnose::BASE;
use crate::effect::{Variable, names};
use crate::estimate::Model;
use crate::robot::Unmeasured;

/// What the findings of a model depend on; geometry holds wherever the joints go.
pub(super) struct Dependence {
    joints: Vec<bool>,
    payload: bool,
    temperature: bool,
}

impl Dependence {
    /// What all effects but geometry depend on.
    pub fn of(model: &Model) -> Self {
        let mut out = Self { joints: vec![false; model.robot.joints()], payload: false, temperature: false };
        for (effect, _) in model.stack.effects() {
            match effect.form() {
                Some(form) => form.variables().into_iter().for_each(|variable| out.on(variable)),
                None if [&BASE[..], &[names::ANCHOR]].concat().contains(&effect.name()) => {}
                None => out.joints.fill(true),
            }
            if effect.needs_torque() {
                out.on(Variable::ArmLoad);
            }
        }
        out
    }

    fn on(&mut self, variable: Variable) {
        match variable {
            Variable::Angle { joint }
            | Variable::Motor { joint }
            | Variable::Current { joint }
            | Variable::Approach { joint }
            | Variable::Move { joint }
            | Variable::Velocity { joint }
            | Variable::Slip { joint, .. }
            | Variable::Stretch { joint, .. }
            | Variable::Recent { joint, .. }
            | Variable::Circumstance { joint: Some(joint), .. }
            | Variable::Work { joint, .. } => self.joints[joint] = true,
            // How an arm hangs follows from all of its joints.
            Variable::Load { .. } | Variable::Push { .. } | Variable::ArmLoad => {
                self.joints.fill(true);
                self.payload = true;
            }
            Variable::Payload => self.payload = true,
            Variable::Temperature | Variable::Lagging { .. } => self.temperature = true,
            Variable::Time | Variable::Circumstance { joint: None, .. } => {}
            Variable::Gravity { .. }
            | Variable::LastMove
            | Variable::Speed
            | Variable::Position { .. }
            | Variable::Sighted { .. }
            | Variable::Azimuth
            | Variable::Elevation
            | Variable::Range => self.joints.fill(true),
        }
    }

    /// Whether it is of any concern that this was not visited; joints that are of none are taken out.
    pub fn has(&self, what: &mut Unmeasured) -> bool {
        match what {
            Unmeasured::Payload => self.payload,
            Unmeasured::Temperature => self.temperature,
            Unmeasured::Joints(joints) | Unmeasured::Gaps(joints) => {
                joints.retain(|joint| self.joints[*joint]);
                !joints.is_empty()
            }
        }
    }
}

//! What effects are called, where they sit, and which have another form than the usual formula.

use super::law::Law;

impl Law {
    /// Its canonical name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Viscous { .. } => "viscous_friction",
            Self::Coulomb { .. } => "coulomb_friction",
            Self::Asymmetric { .. } => "asymmetric_friction",
            Self::Stribeck { .. } => "stribeck_friction",
            Self::Presliding { .. } => "presliding_friction",
            Self::Load { .. } => "load_friction",
            Self::Warmup { .. } => "warmup_friction",
            Self::WristCoupling { .. } => "wrist_coupling",
            Self::Rotor { .. } => "rotor_inertia",
            Self::TorqueConstant { .. } => "torque_constant",
            Self::Offset { .. } => "current_offset",
            Self::Ripple { .. } => "torque_ripple",
            Self::Spring { .. } => "spring_balance",
            Self::Cable { .. } => "cable_stiffness",
            Self::Latency { .. } => "current_latency",
            Self::Elasticity { .. } => "joint_elasticity",
            Self::Backlash { .. } => "backlash_spikes",
            Self::Contact { .. } => "contact",
            Self::Payload { .. } => "payload_error",
            Self::LinkMass { .. } => "link_mass",
            Self::LinkCentre { .. } => "link_com",
            Self::LinkInertia { .. } => "link_inertia",
            Self::Tilt { .. } => "gravity_direction",
            Self::Meshing { .. } => "unknown",
        }
    }

    /// The joint that it acts on, from 0.
    pub fn joint(&self) -> Option<usize> {
        match *self {
            Self::Viscous { joint, .. }
            | Self::Coulomb { joint, .. }
            | Self::Asymmetric { joint, .. }
            | Self::Stribeck { joint, .. }
            | Self::Presliding { joint, .. }
            | Self::Load { joint, .. }
            | Self::Warmup { joint, .. }
            | Self::WristCoupling { joint, .. }
            | Self::Rotor { joint, .. }
            | Self::TorqueConstant { joint, .. }
            | Self::Offset { joint, .. }
            | Self::Ripple { joint, .. }
            | Self::Spring { joint, .. }
            | Self::Cable { joint, .. }
            | Self::Elasticity { joint, .. }
            | Self::Backlash { joint, .. }
            | Self::Meshing { joint, .. } => Some(joint),
            _ => None,
        }
    }

    /// Where it sits, as people write it.
    pub fn place(&self) -> String {
        match self {
            Self::LinkMass { link, .. } | Self::LinkCentre { link, .. } | Self::LinkInertia { link, .. } => {
                format!("link {}", link + 1)
            }
            Self::Payload { .. } => "tool".into(),
            Self::Tilt { .. } => "base".into(),
            Self::Latency { .. } => "recording".into(),
            Self::Contact { .. } => "arm".into(),
            other => other.joint().map_or_else(|| "arm".into(), |joint| format!("joint {}", joint + 1)),
        }
    }

    /// Whether it can have another form than the usual formula.
    pub(super) fn has_other_form(&self) -> bool {
        matches!(
            self,
            Self::Stribeck { .. }
                | Self::Presliding { .. }
                | Self::Load { .. }
                | Self::Cable { .. }
                | Self::Payload { .. }
                | Self::Meshing { .. }
        )
    }
}

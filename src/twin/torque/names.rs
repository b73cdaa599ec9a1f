//! What effects are called, where they sit, and which have another form than the usual formula.

use super::law::{Bristles, Fall, Law};

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
            Self::Meshing { .. }
            | Self::SpeedCurve { .. }
            | Self::AngleCurve { .. }
            | Self::AngleDrag { .. }
            | Self::HoseDrag { .. } => "unknown",
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
            | Self::Meshing { joint, .. }
            | Self::SpeedCurve { joint, .. }
            | Self::AngleCurve { joint, .. }
            | Self::AngleDrag { joint, .. }
            | Self::HoseDrag { joint, .. } => Some(joint),
            _ => None,
        }
    }

    /// Where it sits, as people write it.
    pub fn place(&self) -> String {
        match self {
            Self::LinkMass { link, .. }
            | Self::LinkCentre { link, .. }
            | Self::LinkInertia { link, .. } => {
                format!("link {}", link + 1)
            }
            Self::Payload { .. } => "tool".into(),
            Self::Tilt { .. } => "base".into(),
            Self::Latency { .. } => "recording".into(),
            Self::Contact { .. } => "arm".into(),
            other => other
                .joint()
                .map_or_else(|| "arm".into(), |joint| format!("joint {}", joint + 1)),
        }
    }

    /// Whether it has another form than the usual formula.
    pub(super) fn is_of_another_form(&self) -> bool {
        match *self {
            Self::Viscous { exponent, .. }
            | Self::Load { exponent, .. }
            | Self::WristCoupling { exponent, .. } => exponent != 1.0,
            Self::Offset { drift, .. } => drift != 0.0,
            Self::Latency { filter, .. } => filter,
            Self::LinkMass { away, .. } => away != [0.0; 3],
            Self::Asymmetric { by_speed, .. } => by_speed != 0.0,
            Self::Stribeck { fall, .. } => fall != Fall::Exponential(1.0),
            Self::Presliding { bristles, .. } => bristles != Bristles::One,
            Self::Warmup { slow, .. } => slow,
            Self::TorqueConstant { half, .. } => half.is_finite(),
            Self::Ripple { overtone, .. } => overtone != 0.0,
            Self::Spring { gas, .. } => gas != 0.0,
            Self::Cable { hardening, .. } => hardening != 0.0,
            Self::Backlash { wave, .. } => wave,
            Self::Contact { held, .. } => held,
            Self::Payload { centre, .. } => centre != [0.0; 3],
            _ => self.name() == "unknown",
        }
    }

    /// What it may be called besides, at its place: a curve that no library has is also one of its kind.
    pub(super) fn kin(&self) -> &'static [&'static str] {
        match self {
            Self::Viscous { exponent, .. } if *exponent != 1.0 => &["unknown", "stribeck_friction"],
            Self::SpeedCurve { .. } => &["stribeck_friction"],
            Self::AngleCurve { .. } => &["torque_ripple"],
            Self::HoseDrag { .. } => &["presliding_friction"],
            // A hose at the joint that arms balance is a spring there.
            Self::Cable { joint: 1, .. } => &["spring_balance"],
            // What is bolted on moves the centre, too.
            Self::LinkMass { away, .. } if *away != [0.0; 3] => &["link_com"],
            _ => &[],
        }
    }
}

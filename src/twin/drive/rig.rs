//! An arm and its drives as they are.

use crate::torque::{Body, Machine};

/// A joint with its drive; what is 0, infinite or none changes nothing.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Servo {
    /// Nm/rad, Nm s/rad.
    pub(super) kp: f64,
    pub(super) kd: f64,
    /// Whether the commanded speed is in the damping.
    pub(super) on_error: bool,
    /// Nm.
    pub(super) limit: f64,
    /// Nm s/rad, Nm, kg m2.
    pub(super) damping: f64,
    pub(super) friction: f64,
    pub(super) armature: f64,
    /// rad, s, rad.
    pub(super) offset: f64,
    pub(super) delay: f64,
    pub(super) dead_band: f64,
    /// rad/s of the set point.
    pub(super) speed_limit: f64,
    /// Nm/(rad s), Nm.
    pub(super) integral: [f64; 2],
    /// Nm, rad/s.
    pub(super) stribeck: [f64; 2],
    /// Of the drive's torque: driving, driven back.
    pub(super) load: [f64; 2],
    /// Share of dry friction more when cold, s.
    pub(super) warm_up: [f64; 2],
    /// Nm/rad, rad.
    pub(super) spring: [f64; 2],
    /// Nm, waves a turn, phase.
    pub(super) ripple: [f64; 3],
    /// Nm, at which angle, how wide.
    pub(super) bump: [f64; 3],
    /// Of the torque that the gear gives to the link: driving, driven back.
    pub(super) gear_load: [f64; 2],
    /// rad in which friction bends until it slides; 0 is a stop.
    pub(super) travel: f64,
    /// A gear that yields.
    pub(super) gear: Option<Gear>,
    /// Which drive is felt, and which share of it.
    pub(super) coupled: Option<(usize, f64)>,
}

/// A spring with play between a rotor, on which the encoder is, and its link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gear {
    /// Nm/rad, Nm s/rad.
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// rad, the whole of it.
    pub(super) play: f64,
}

/// An arm with its drives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rig {
    /// s between two commands that are taken; 0 takes all.
    pub(super) hold: f64,
    /// Share of torque and limit that is lost per Nm that all drives together give.
    pub(super) sag: f64,
    pub(super) machine: Machine,
    pub(super) servos: Vec<Servo>,
}

impl Servo {
    pub(super) fn plain(
        [kp, kd, limit]: [f64; 3],
        on_error: bool,
        [damping, friction, armature]: [f64; 3],
    ) -> Self {
        Self {
            kp,
            kd,
            on_error,
            limit,
            damping,
            friction,
            armature,
            offset: 0.0,
            delay: 0.0,
            dead_band: 0.0,
            speed_limit: f64::INFINITY,
            integral: [0.0; 2],
            stribeck: [0.0, 1.0],
            load: [0.0; 2],
            warm_up: [0.0, 1.0],
            spring: [0.0; 2],
            ripple: [0.0, 1.0, 0.0],
            bump: [0.0, 0.0, 1.0],
            gear_load: [0.0; 2],
            travel: 0.0,
            gear: None,
            coupled: None,
        }
    }
}

impl Rig {
    pub(super) fn joints(&self) -> usize {
        self.servos.len()
    }

    /// Whether a gear yields somewhere.
    pub(super) fn yields(&self) -> bool {
        self.servos.iter().any(|servo| servo.gear.is_some())
    }

    /// A number of a link's inertials changed by a share (mass 0, inertia 4) or a way (centre 1 to 3, m).
    pub(super) fn off(&self, link: usize, number: usize, by: f64) -> Self {
        let mut other = self.clone();
        let body: &mut Body = &mut other.machine.links[link];
        match number {
            0 => body.mass *= 1.0 + by,
            4 => body.inertia = body.inertia.map(|moment| moment * (1.0 + by)),
            axis => body.centre[axis - 1] += by,
        }
        other
    }
}

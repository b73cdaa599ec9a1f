//! What moves or changes bodies: links that bend and grow, masses that are not as described, the base, the tool.

use super::{Motion, State, by_axis, effect};
use crate::arm::{Arm, step};
use crate::matrix::{self, Vector};
use crate::memory::{self, Moment};

// A uniform elastic beam, clamped at its joint and loaded at its far end by the weight of everything beyond. Under an end force F and an
// end moment M a cantilever of length L turns by `M L/EI + F L^2/(2 EI)` and moves by `M L^2/(2 EI) + F L^3/(3 EI)` across its axis; along
// its axis a moment twists it by `M L/GJ`.
effect! {
    /// The beam between joint N and joint N+1.
    LinkCompliance "link_compliance" at link {
        bending_rad_per_nm: f64 = "Rotation of the end per end moment across the beam, L/EI, rad/Nm.",
        #[serde(default)] torsion_rad_per_nm: f64 = "Rotation of the end per moment along the beam, L/GJ, rad/Nm.",
    }
    scaled by bending_rad_per_nm torsion_rad_per_nm;
    truth |self| [("bending", "rad/Nm", self.bending_rad_per_nm), ("torsion", "rad/Nm", self.torsion_rad_per_nm)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let frame = &state.posture.frames[index];
        let span = state.arm.links[index].span;
        let length = matrix::norm(span);
        if length == 0.0 {
            return;
        }
        let along = matrix::scale(span, 1.0 / length);
        let (force, moment) = state.loads.wrench(index + 1, matrix::place(frame, span));
        let (force, moment) = (matrix::see(frame, force), matrix::see(frame, moment));
        let twist = matrix::dot(moment, along);
        let across = matrix::minus(moment, matrix::scale(along, twist));
        // `along x F` is the moment of the end force per unit of arm, so it bends the same way as `across`.
        let by_force = matrix::scale(matrix::cross(along, force), length);
        let soft = self.bending_rad_per_nm;
        let bend = matrix::add(matrix::scale(across, soft), matrix::scale(by_force, soft / 2.0));
        let lean = matrix::add(matrix::scale(across, soft / 2.0), matrix::scale(by_force, soft / 3.0));
        let moved = matrix::scale(matrix::cross(lean, along), length);
        let turned = matrix::add(bend, matrix::scale(along, self.torsion_rad_per_nm * twist));
        motion.move_end(index, &matrix::times(&matrix::shift(moved), &matrix::turn_by(turned)));
    }
}

// A link that gives way at its middle, as a casting with a weak flange does.
effect! {
    /// An elastic hinge halfway along the link, soft about both directions across it.
    LinkHinge "link_compliance" at link {
        rad_per_nm: f64 = "Rotation per moment at the middle, rad/Nm.",
    }
    scaled by rad_per_nm;
    truth |self| [("middle", "rad/Nm", self.rad_per_nm)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let frame = &state.posture.frames[index];
        let span = state.arm.links[index].span;
        let length = matrix::norm(span);
        if length == 0.0 {
            return;
        }
        let along = matrix::scale(span, 1.0 / length);
        let half = matrix::scale(span, 0.5);
        let (_, moment) = state.loads.wrench(index + 1, matrix::place(frame, half));
        let moment = matrix::see(frame, moment);
        let across = matrix::minus(moment, matrix::scale(along, matrix::dot(moment, along)));
        let turned = matrix::turn_by(matrix::scale(across, self.rad_per_nm));
        let back = matrix::times(&turned, &matrix::shift(half));
        motion.move_end(index, &matrix::times(&matrix::shift(matrix::scale(half, -1.0)), &back));
    }
}

/// Growth of a link along its span, as a share of it.
fn grow(link: usize, strain: f64, state: &State, motion: &mut Motion) {
    let growth = matrix::shift(matrix::scale(state.arm.links[link - 1].span, strain));
    motion.link_end[link - 1] = matrix::times(&growth, &motion.link_end[link - 1]);
}

effect! {
    /// Growth of the link between joint N and joint N+1.
    ThermalGrowth "thermal_growth" at link {
        um_per_m_k: f64 = "Expansion, um per m and K; steel and cast iron have 11 to 12.",
        reference_c: f64 = "Temperature at which the link has its length, C.",
    }
    scaled by um_per_m_k;
    truth |self| [("expansion", "um/m/K", self.um_per_m_k)];
    fn act(&self, state: &State, motion: &mut Motion) {
        grow(self.link, 1e-6 * self.um_per_m_k * (state.row.temperature_c - self.reference_c), state, motion);
    }
}

// A link that warms up at its own pace: behind the sensor, or with no sensor at all.
effect! {
    /// Growth by `1 - exp(-t / warm_up)` of a final strain.
    ThermalWarmUp "thermal_growth" at link {
        um_per_m: f64 = "Final growth, um per m.",
        warm_up_h: f64 = "Time constant, h.",
    }
    scaled by um_per_m;
    truth |self| [("final", "um/m", self.um_per_m), ("warm_up", "h", self.warm_up_h)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let strain = 1e-6 * self.um_per_m * (1.0 - (-state.row.time_s / (3600.0 * self.warm_up_h)).exp());
        grow(self.link, strain, state, motion);
    }
}

// Metal that lags the thermometer: a thick casting is still cold where the sensor on its skin is warm.
effect! {
    /// Growth of a link with a temperature that follows the logged one.
    ThermalLag "thermal_growth" at link {
        um_per_m_k: f64 = "Expansion, um per m and K.",
        reference_c: f64 = "Temperature at which the link has its length, C.",
        lag_s: f64 = "Time constant with which its metal follows, s.",
        #[serde(default)] core_s: f64
            = "That of the core behind the skin, s; half of the growth is the core's. 0: the link is warm throughout.",
    }
    scaled by um_per_m_k;
    truth |self| [("expansion", "um/m/K", self.um_per_m_k), ("lag", "s", self.lag_s)];
    fn act(&self, state: &State, motion: &mut Motion) {
        grow(self.link, 1e-6 * self.um_per_m_k * state.memory, state, motion);
    }
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        let skin = memory::behind(past, self.lag_s, self.reference_c);
        let core = memory::behind(past, self.lag_s + self.core_s, self.reference_c);
        skin.iter().zip(core).map(|(skin, core)| 0.5 * (skin + core) - self.reference_c).collect()
    }
}

// A bent link: how much of its growth reaches the next body depends on how the next joint stands.
effect! {
    /// Growth of the link along its span by expansion times temperature rise times `cos(q)^power` of the next joint.
    ThermalBow "unknown" at link ".bow" {
        um_per_m_k: f64 = "um per m and K.",
        reference_c: f64 = "Temperature at which the link has its length, C.",
        power: i32 = "Power of the cosine of the next joint.",
    }
    scaled by um_per_m_k;
    truth |self| [("expansion", "um/m/K", self.um_per_m_k)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let next = state.row.command.get(self.link).copied().unwrap_or(0.0);
        let rise = state.row.temperature_c - self.reference_c;
        grow(self.link, 1e-6 * self.um_per_m_k * rise * next.cos().powi(self.power), state, motion);
    }
}

effect! {
    /// True mass and centre of a link against the described ones; they show through springs and in the currents.
    LinkMass "link_mass" at link {
        #[serde(default)] mass_share: f64 = "True mass per described mass, less 1.",
        #[serde(default)] centre_mm: Vector = "Displacement of its centre at the zero pose along the base axes, mm.",
    }
    scaled by mass_share centre_mm;
    truth |self| [("mass", "1", self.mass_share), ("centre", "mm", matrix::norm(self.centre_mm))];
    fn shape(&self, arm: &mut Arm) {
        if let Some(link) = arm.links.get_mut(self.link - 1) {
            link.mass *= 1.0 + self.mass_share;
            link.centre = matrix::add(link.centre, matrix::scale(self.centre_mm, 1e-3));
        }
    }
}

effect! {
    /// True payload against the declared one; it shows through springs and in the currents.
    PayloadError "payload_error" of "tool" "tool" {
        #[serde(default)] mass_share: f64 = "True mass per declared mass, less 1.",
        #[serde(default)] centre_mm: Vector = "Displacement of its centre at the zero pose along the base axes, mm.",
    }
    scaled by mass_share centre_mm;
    truth |self| [("mass", "1", self.mass_share), ("centre", "mm", matrix::norm(self.centre_mm))];
    fn shape(&self, arm: &mut Arm) {
        arm.payload_share *= 1.0 + self.mass_share;
        arm.payload_centre = matrix::add(arm.payload_centre, matrix::scale(self.centre_mm, 1e-3));
    }
}

// The reflector or the tool steps in its mounting.
effect! {
    /// A step of the measured point from a moment on.
    ToolShift "tool_shift" of "tool" "tool" {
        shift_um: Vector = "Displacement at the zero pose along the base axes, um.",
        at_s: f64 = "The moment since the start of the recording, s.",
    }
    scaled by shift_um;
    truth |self| {
        let [x, y, z] = self.shift_um;
        [("shift_x", "um", x), ("shift_y", "um", y), ("shift_z", "um", z), ("at", "s", self.at_s)]
    };
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            motion.tool = matrix::add(motion.tool, matrix::scale(self.shift_um, 1e-6));
        }
    }
}

// The foundation tilts under the overturning moment of the whole arm about its foot.
effect! {
    /// A base on elastic anchors: soft about both horizontal axes, stiff about the vertical one.
    BaseCompliance "base_compliance" of "base" "base" {
        rad_per_nm: [f64; 2] = "Tilt about base x and y per moment, rad/Nm.",
        #[serde(default)] pivot_mm: Vector = "The point about which it tilts, base frame, mm.",
    }
    scaled by rad_per_nm;
    truth |self| [("x", "rad/Nm", self.rad_per_nm[0]), ("y", "rad/Nm", self.rad_per_nm[1])];
    fn act(&self, state: &State, motion: &mut Motion) {
        let pivot = matrix::scale(self.pivot_mm, 1e-3);
        let (_, moment) = state.loads.wrench(0, pivot);
        let tilt = [self.rad_per_nm[0] * moment[0], self.rad_per_nm[1] * moment[1], 0.0];
        motion.move_base(pivot, &matrix::turn_by(tilt));
    }
}

// A collision, a loosened anchor.
effect! {
    /// A rigid step of the base from a moment on.
    BaseShift "base_shift" of "base" "base" {
        #[serde(default)] shift_um: Vector = "Displacement, base frame, um.",
        #[serde(default)] turn_arcsec: Vector = "Rotation vector about the base's origin, arcsec.",
        at_s: f64 = "The moment since the start of the recording, s.",
    }
    scaled by shift_um turn_arcsec;
    truth |self| by_axis(self.shift_um, self.turn_arcsec).chain([("at", "s", self.at_s)]);
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            motion.base = matrix::times(&step(self.shift_um, self.turn_arcsec, 1.0), &motion.base);
        }
    }
}

// As a floor does with a neighbour's machine or the sun: an effect that no list expects.
effect! {
    /// A sine of time in one direction of motion of the base.
    BaseSway "unknown" of "base_sway" "base" {
        #[serde(default)] shift_um: Vector = "Displacement at the peak, base frame, um.",
        #[serde(default)] turn_arcsec: Vector = "Rotation vector at the peak, arcsec.",
        period_s: f64 = "s.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by shift_um turn_arcsec;
    truth |self| [("shift", "um", matrix::norm(self.shift_um)), ("turn", "arcsec", matrix::norm(self.turn_arcsec)), ("period", "s", self.period_s)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let share = (std::f64::consts::TAU * state.row.time_s / self.period_s + self.phase_deg.to_radians()).sin();
        motion.base = matrix::times(&step(self.shift_um, self.turn_arcsec, share), &motion.base);
    }
}

//! What is wrong with the instrument: its circles, its ranges, its air, its stand.

use super::{Motion, State, by_axis, effect, sine_and_cosine};
use crate::arm::{Row, step};
use crate::matrix::{self, Vector};
use crate::memory::{self, Moment};
use crate::tracker::Polar;
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The course of a creep over time, with `u = t / settling`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// `1 - exp(-u)`: slows down towards a final motion.
    #[default]
    Settling,
    /// `u`: never slows down.
    Linear,
    /// `sqrt(u)`: as heat creeps into a stand.
    Root,
}

effect! {
    /// A creep of the tracker's stand.
    TrackerDrift "tracker_drift" of "tracker" "tracker" {
        #[serde(default)] shift_um: Vector = "Final displacement of what is measured, tracker frame, um.",
        #[serde(default)] turn_arcsec: Vector = "Its final rotation vector about the tracker's origin, arcsec.",
        settling_h: f64 = "Time constant, h; for the courses that do not settle, the time at which the motion is as stated.",
        #[serde(default)] course: Course = "Over time.",
    }
    scaled by shift_um turn_arcsec;
    truth |self| by_axis(self.shift_um, self.turn_arcsec);
    fn act(&self, state: &State, motion: &mut Motion) {
        let u = state.row.time_s / (3600.0 * self.settling_h);
        let share = match self.course {
            Course::Settling => 1.0 - (-u).exp(),
            Course::Linear => u,
            Course::Root => u.max(0.0).sqrt(),
        };
        motion.tracker = matrix::times(&step(self.shift_um, self.turn_arcsec, share), &motion.tracker);
    }
}

// Somebody knocks against the stand: to the data the robot's base steps the other way.
effect! {
    /// A rigid step of what is measured from a moment on, of which a part may settle back.
    // Named by the stand's own numbers: those of the base have another frame.
    TrackerKnock "base_shift" of "stand" "base" {
        #[serde(default)] shift_um: Vector = "Displacement, tracker frame, um.",
        #[serde(default)] turn_arcsec: Vector = "Rotation vector about the tracker's origin, arcsec.",
        at_s: f64 = "The moment since the start of the recording, s.",
        #[serde(default)] back_share: f64 = "Share of the step that settles back.",
        #[serde(default = "minute")] back_s: f64 = "Time constant of that, s.",
    }
    scaled by shift_um turn_arcsec;
    truth |self| [("shift", "um", matrix::norm(self.shift_um)), ("turn", "arcsec", matrix::norm(self.turn_arcsec)), ("at", "s", self.at_s)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let since = state.row.time_s - self.at_s;
        if since >= 0.0 {
            let share = 1.0 - self.back_share * (1.0 - (-since / self.back_s).exp());
            motion.tracker = matrix::times(&step(self.shift_um, self.turn_arcsec, share), &motion.tracker);
        }
    }
}

fn minute() -> f64 {
    60.0
}

// As a tripod does in the sun or near a machine: an effect that no list expects.
effect! {
    /// A sine of time in one direction of motion of what is measured.
    TrackerSway "unknown" of "tracker_sway" "tracker" {
        #[serde(default)] shift_um: Vector = "Displacement at the peak, tracker frame, um.",
        #[serde(default)] turn_arcsec: Vector = "Rotation vector at the peak about the tracker's origin, arcsec.",
        period_s: f64 = "s.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
        #[serde(default)] fading_s: f64 = "Time in which the swing fades to 37 %, s; 0: never.",
    }
    scaled by shift_um turn_arcsec;
    truth |self| [("shift", "um", matrix::norm(self.shift_um)), ("turn", "arcsec", matrix::norm(self.turn_arcsec)), ("period", "s", self.period_s)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let time = state.row.time_s;
        let left = if self.fading_s > 0.0 { (-time / self.fading_s).exp() } else { 1.0 };
        let share = left * (TAU * time / self.period_s + self.phase_deg.to_radians()).sin();
        motion.tracker = matrix::times(&step(self.shift_um, self.turn_arcsec, share), &motion.tracker);
    }
}

// The tracker's metre is wrong, by its air's temperature or pressure: all lengths scale, and the robot's with them.
effect! {
    /// Every measured coordinate is too large by this.
    TrackerScale "tracker_scale" of "tracker" "tracker" {
        um_per_m: f64 = "um per m.",
    }
    scaled by um_per_m;
    truth |self| [("scale", "um/m", self.um_per_m)];
    fn act(&self, _state: &State, motion: &mut Motion) {
        let rows = motion.tracker.iter_mut().take(3);
        rows.flatten().for_each(|number| *number *= 1.0 + 1e-6 * self.um_per_m);
    }
}

// Air changes its index of refraction as it warms: ranges scale with the deviation of its temperature, about 1 um/m/K.
effect! {
    /// Ranges grow with the temperature of the air along the beam.
    TrackerRefraction "tracker_refraction" of "tracker" "tracker" {
        um_per_m_k: f64 = "um per m and K.",
        reference_c: f64 = "Temperature for which the tracker corrects, C.",
        #[serde(default)] lag_s: f64 = "Time constant with which the air follows the logged temperature, s; 0: at once.",
        #[serde(default)] own_rise_k: f64 = "The air warms by so much on its own, K, whatever is logged; 0: it follows the log.",
        #[serde(default = "one")] warm_up_h: f64 = "Time constant of that, h.",
    }
    scaled by um_per_m_k;
    truth |self| [("scale", "um/m/K", self.um_per_m_k), ("lag", "s", self.lag_s)];
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        if self.own_rise_k != 0.0 {
            let rise = |time_s: f64| self.own_rise_k * (1.0 - (-time_s / (3600.0 * self.warm_up_h)).exp());
            return past.iter().map(|moment| rise(moment.time_s)).collect();
        }
        let air = memory::behind(past, self.lag_s, self.reference_c);
        air.into_iter().map(|celsius| celsius - self.reference_c).collect()
    }
    fn sight(&self, _row: &Row, memory: f64, point: Vector) -> Vector {
        matrix::scale(point, 1.0 + 1e-6 * self.um_per_m_k * memory)
    }
}

fn one() -> f64 {
    1.0
}

/// What is wrong with the circle, with amplitude `a` and phase `p`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Circle {
    /// `a sin(azimuth + p)`: a small eccentricity.
    Eccentric,
    /// `a sin(2 azimuth + p)`: a circle bent to an ellipse, or one read at two sides.
    Elliptic,
    /// The direction from a centre `a` radii off the axis, by the arctangent.
    OffCentre,
}

// The horizontal circle sits off its axis, or is no circle.
effect! {
    /// Error of the azimuth.
    TrackerCircle "tracker_circle" of "tracker" "tracker" {
        circle: Circle = "Which circle.",
        amplitude_arcsec: f64 = "arcsec.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec;
    truth |self| {
        let order = if self.circle == Circle::Elliptic { 2.0 } else { 1.0 };
        sine_and_cosine(order, "arcsec", self.amplitude_arcsec, self.phase_deg)
    };
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let (size, phase) = (self.amplitude_arcsec * ARCSEC, self.phase_deg.to_radians());
        let azimuth = match self.circle {
            Circle::Eccentric => seen.azimuth + size * (seen.azimuth + phase).sin(),
            Circle::Elliptic => seen.azimuth + size * (2.0 * seen.azimuth + phase).sin(),
            Circle::OffCentre => {
                let (sine, cosine) = seen.azimuth.sin_cos();
                (sine + size * phase.sin()).atan2(cosine - size * phase.cos())
            }
        };
        Polar { azimuth, ..seen }.point()
    }
}

// The head: its vertical index is off, it sags, its vertical circle is eccentric, or its transit axis is tilted.
effect! {
    /// Errors of the angles by the elevation.
    #[derive(Default)]
    #[serde(default)]
    TrackerElevation "tracker_elevation" of "tracker" "tracker" {
        index_arcsec: f64 = "Every elevation is too large by this, arcsec.",
        sag_arcsec: f64 = "The elevation by this times its cosine, arcsec: the weight of the head.",
        circle_arcsec: f64 = "The elevation by this times `sin(elevation + phase)`, arcsec.",
        phase_deg: f64 = "Phase at zero, deg.",
        transit_arcsec: f64
            = "The azimuth by this times the tangent of the elevation, arcsec: the transit axis is not square to the standing one.",
    }
    scaled by index_arcsec sag_arcsec circle_arcsec transit_arcsec;
    truth |self| [
        ("index", "arcsec", self.index_arcsec),
        ("sag", "arcsec", self.sag_arcsec),
        ("circle", "arcsec", self.circle_arcsec),
        ("transit", "arcsec", self.transit_arcsec),
    ];
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let circle = self.circle_arcsec * (seen.elevation + self.phase_deg.to_radians()).sin();
        let elevation = seen.elevation + ARCSEC * (self.index_arcsec + self.sag_arcsec * seen.elevation.cos() + circle);
        let azimuth = seen.azimuth + ARCSEC * self.transit_arcsec * seen.elevation.tan();
        Polar { azimuth, elevation, ..seen }.point()
    }
}

// By a dead path or the reflector's constant, by a cyclic part, by the square of the range.
effect! {
    /// What is added to a range `r`.
    #[serde(default)]
    TrackerOffset "tracker_offset" of "tracker" "tracker" {
        constant_um: f64 = "um.",
        cyclic_um: f64 = "Times `sin(2 pi r / wave + phase)`, um: stray light in the meter of distances.",
        wave_mm: f64 = "Length of the cycle, mm.",
        phase_deg: f64 = "Phase of the cycle at the instrument, deg.",
        um_per_m2: f64 = "Times the square of the range, um per m2.",
    }
    scaled by constant_um cyclic_um um_per_m2;
    truth |self| [("constant", "um", self.constant_um), ("cyclic", "um", self.cyclic_um), ("square", "um/m2", self.um_per_m2)];
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let cycle = (TAU * 1e3 * seen.range / self.wave_mm + self.phase_deg.to_radians()).sin();
        let off = self.constant_um + self.cyclic_um * cycle + self.um_per_m2 * seen.range * seen.range;
        Polar { range: seen.range + 1e-6 * off, ..seen }.point()
    }
}

impl Default for TrackerOffset {
    fn default() -> Self {
        Self {
            constant_um: 0.0,
            cyclic_um: 0.0,
            wave_mm: 1000.0,
            phase_deg: 0.0,
            um_per_m2: 0.0,
        }
    }
}

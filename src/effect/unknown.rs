//! `unknown`: form-free signatures, for what no entry of the library explains: placed and described, never christened.

use super::form::{cosines, parameters};
use super::frame_shift::{MOTION, unit};
use super::joint_table::PLAUSIBLE;
use super::signature::Signature;
use super::thermal_growth::Warmth;
use super::{ArmState, Deflection, Effect, Form, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    place: Place,
    signature: Signature,
}

/// Cosines of a smooth function of one variable, and of each of two.
const CURVE: usize = 8;
const EACH: usize = 3;
/// Rows within a bump's width: fewer make a bump of any single wrong point.
const SUPPORT: usize = 5;
/// The widest bump or step as a share of the joint's travel.
const LOCAL: f64 = 0.2;
/// Widths (rad) and spacing of bumps.
const WIDTHS: [f64; 3] = [0.08, 0.16, 0.32];
/// Powers of time by which something creeps.
const POWERS: std::ops::RangeInclusive<f64> = 0.3..=3.0;
/// Lengths of the recording, from its start, over which a creep is believed to go on.
const CREEPING: f64 = 2.0;
/// Periods of a sway as shares of the recording.
const SWAYS: [f64; 6] = [0.1, 0.14, 0.2, 0.28, 0.4, 0.57];
/// Shortest and longest period, in the same shares: beyond one period a sway is a drift.
const PERIODS: [f64; 2] = [0.05, 1.0];
/// Orders in another joint's angle.
const ORDERS: u32 = 3;
/// What goes with another joint's angle is nearly always the wobble of that joint's axis: -2 ln of the odds that it is not.
const WOBBLE: f64 = 12.0;
/// -2 ln of the odds of things outside the library.
const OPEN: f64 = 8.0;

impl Unknown {
    pub fn signature(&self) -> Signature {
        self.signature
    }

    /// Whether a joint follows a function of its own angle and a neighbour's, as where a hose runs along both and pulls.
    pub fn is_hose(&self) -> bool {
        let Place::Joint(joint) = self.place else { return false };
        self.two_angles().is_some_and(|[a, b]| (a == joint || b == joint) && a.abs_diff(b) == 1)
    }

    /// The angles of which a joint follows a function, where there are two.
    pub fn two_angles(&self) -> Option<[usize; 2]> {
        match self.signature {
            Signature::Product { a, b } | Signature::Surface { a, b, .. } => Some([a, b]),
            _ => None,
        }
    }

    /// Whether a joint follows a smooth function of its own angle: nearly geometry, or another law of that angle, in its slow part.
    pub fn is_curve(&self) -> bool {
        matches!((self.signature, self.place), (Signature::Angle { by, .. }, Place::Joint(joint)) if by == joint)
    }

    /// Whether it is a motion of the base in time: it says nothing of the arm, nor of another time.
    pub fn is_passing(&self) -> bool {
        self.place == Place::Base && matches!(self.signature, Signature::Sway { .. } | Signature::Time { .. })
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let mut out: Vec<Hypothesis> = (0..survey.joints()).flat_map(|joint| Self::at_joint(survey, joint)).collect();
        let mut add = |place, signature, tried, charge: f64| {
            out.push(Hypothesis::new(Self { place, signature }, tried).charged(OPEN + charge));
        };
        let [start_s, end_s] = survey.time;
        if end_s > start_s {
            add(Place::Base, Signature::Time { start_s, end_s }, 1, 0.0);
            let periods = SWAYS.map(|share| share * (end_s - start_s));
            for period_s in periods {
                [false, true]
                    .into_iter()
                    .for_each(|turns| add(Place::Base, Signature::Sway { period_s, turns }, 2 * SWAYS.len(), 0.0));
            }
        }
        (0..3).for_each(|axis| add(Place::Tool, Signature::Side { axis }, 3, 0.0));
        add(Place::Tool, Signature::Sag, 1, 0.0);
        if survey.payload_changes() {
            let signature = Signature::Payload { above_kg: survey.heavy_payload() };
            add(Place::Tool, signature, 1, 6.0);
            add(Place::Base, signature, 1, 6.0);
        }
        out
    }

    fn at_joint(survey: &Survey, joint: usize) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        let place = Place::Joint(joint);
        let mut add = |signature, tried: usize, charge: f64| {
            out.push(Hypothesis::new(Self { place, signature }, tried).charged(OPEN + charge));
        };
        let n = survey.joints();
        let [low, high] = survey.range[joint];
        let places = (survey.travel(joint) / 0.1) as usize + 1;
        // Centre and width are fitted, too: as much as two numbers in the criterion.
        let two_numbers = 3 * survey.rows.len();
        for width_rad in WIDTHS {
            let count = ((high - low - 0.5 * width_rad) / width_rad).ceil().max(0.0) as usize;
            let centres = (0..count).map(|k| low + width_rad * (k as f64 + 0.5));
            for centre_rad in centres.filter(|centre| supported(survey, joint, *centre, width_rad)) {
                add(Signature::Bump { centre_rad, width_rad }, two_numbers, 0.0);
                if width_rad > WIDTHS[0] {
                    add(Signature::Step { centre_rad, width_rad }, two_numbers, 0.0);
                }
            }
        }
        for share in [0.25, 0.5, 0.75] {
            for upwards in [true, false] {
                let from_rad = low + share * (high - low);
                add(Signature::Hinge { by: joint, from_rad, upwards }, places, 0.0);
            }
        }
        for by in 0..n {
            let [low, high] = survey.range[by];
            add(Signature::Angle { by, low, high }, 1, 0.0);
            if by != joint {
                (1..=ORDERS).for_each(|order| add(Signature::Periodic { by, order }, 6, WOBBLE));
            }
            for b in by + 1..n {
                add(Signature::Product { a: by, b }, 3, 0.0);
                add(Signature::Surface { a: by, b, a_range: survey.range[by], b_range: survey.range[b] }, 1, 0.0);
            }
        }
        let [start_s, end_s] = survey.time;
        if end_s > start_s {
            add(Signature::Time { start_s, end_s }, 1, 0.0);
            add(Signature::Creep { start_s, end_s, power: 1.0 }, 1, 4.0);
        }
        Warmth::all(survey).into_iter().for_each(|(by, tried)| add(Signature::Warming(by), tried, 4.0));
        out
    }

    /// Values of the signature in a row: the motion is their combination.
    fn values(&self, state: &ArmState, mut each: impl FnMut(usize, f64)) {
        let at = |joint: usize| state.q[joint];
        match self.signature {
            Signature::Angle { by, low, high } => {
                cosines(at(by), [low, high], CURVE).enumerate().for_each(|(k, value)| each(k, value));
            }
            Signature::Bump { centre_rad, width_rad } => {
                let Place::Joint(joint) = self.place else { return };
                let distance = (at(joint) - centre_rad) / width_rad;
                each(0, libm::exp(-distance * distance));
            }
            Signature::Step { centre_rad, width_rad } => {
                let Place::Joint(joint) = self.place else { return };
                each(0, libm::tanh((at(joint) - centre_rad) / width_rad));
            }
            Signature::Hinge { by, from_rad, upwards } => {
                let beyond = at(by) - from_rad;
                each(0, if upwards { beyond.max(0.0) } else { (-beyond).max(0.0) });
            }
            Signature::Periodic { by, order } => {
                let (sine, cosine) = libm::sincos(f64::from(order) * at(by));
                each(0, sine);
                each(1, cosine);
            }
            Signature::Product { a, b } => {
                let ((sa, ca), (sb, cb)) = (libm::sincos(at(a)), libm::sincos(at(b)));
                [sa * sb, sa * cb, ca * sb, ca * cb].into_iter().enumerate().for_each(|(k, value)| each(k, value));
            }
            Signature::Surface { a, b, a_range, b_range } => {
                for (i, x) in cosines(at(a), a_range, EACH).enumerate() {
                    cosines(at(b), b_range, EACH).enumerate().for_each(|(k, y)| each(EACH * i + k, x * y));
                }
            }
            Signature::Sway { period_s, .. } => {
                let (sine, cosine) = libm::sincos(std::f64::consts::TAU * state.time() / period_s);
                each(0, sine);
                each(1, cosine);
            }
            Signature::Time { start_s, end_s } => {
                let count = if self.is_joint() { CURVE } else { EACH };
                cosines(state.time(), [start_s, end_s], count).enumerate().for_each(|(k, value)| each(k, value));
            }
            Signature::Creep { start_s, end_s, power } => {
                let share = (state.time() - start_s) / (end_s - start_s);
                // Long after the recording what was seen last holds.
                each(0, libm::pow(if share > CREEPING { 1.0 } else { share.max(0.0) }, power));
            }
            Signature::Warming(by) => each(0, by.at(state)),
            Signature::Side { axis } => each(0, state.posture.down(self.station(state)).map_or(0.0, |down| down[axis].signum())),
            Signature::Sag => {
                let down = state.posture.down(self.station(state)).unwrap_or_default();
                (0..3).for_each(|axis| each(axis, down[axis]));
            }
            Signature::Payload { above_kg } => each(0, f64::from(state.payload() > above_kg)),
        }
    }

    fn is_joint(&self) -> bool {
        matches!(self.place, Place::Joint(_))
    }

    fn station(&self, state: &ArmState) -> usize {
        match self.place {
            Place::Tool => state.q.len(),
            _ => 0,
        }
    }

    fn count(&self) -> usize {
        match self.signature {
            Signature::Angle { .. } => CURVE,
            Signature::Periodic { .. } | Signature::Sway { .. } => 2,
            Signature::Product { .. } => 4,
            Signature::Sag => 3,
            Signature::Surface { .. } => EACH * EACH,
            Signature::Time { .. } if self.is_joint() => CURVE,
            Signature::Time { .. } => EACH,
            _ => 1,
        }
    }

    /// Directions at a frame, of [`MOTION`]: displacement of a tool, one kind of motion of a swaying base, all of a base else.
    fn axes(&self) -> std::ops::Range<usize> {
        match self.signature {
            Signature::Sway { turns: true, .. } => 3..6,
            Signature::Sway { .. } => 0..3,
            _ if self.place == Place::Tool => 0..3,
            _ => 0..6,
        }
    }
}

impl Effect for Unknown {
    fn name(&self) -> &'static str {
        "unknown"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let numbers: Vec<(String, Unit, f64)> = match self.place {
            Place::Joint(joint) => {
                let unit = if robot.is_revolute(joint) { Unit::Radian } else { Unit::Millimetre };
                let size = if self.is_curve() { PLAUSIBLE } else { 0.01 };
                (1..=self.count()).map(|k| (format!("c{k}"), unit, size)).collect()
            }
            _ => (1..=self.count())
                .flat_map(|k| self.axes().map(move |axis| (format!("{}{k}", MOTION[axis].0), MOTION[axis].1, 0.01)))
                .collect(),
        };
        parameters(self, numbers.iter().map(|(name, unit, sigma)| (name.as_str(), *unit, *sigma)))
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let (axes, station) = (self.axes(), self.station(state));
        self.values(state, |k, value| match self.place {
            Place::Joint(joint) => out.turn(k, p, joint, value),
            _ => axes.clone().for_each(|axis| out.shift(axes.len() * k + axis - axes.start, p, station, unit(axis) * value)),
        });
    }

    fn needs_torque(&self) -> bool {
        matches!(self.signature, Signature::Side { .. } | Signature::Sag)
    }
}

/// Whether a bump or step is local, and enough rows lie within it: a wide one stands in for any law of the angle.
fn supported(survey: &Survey, joint: usize, centre_rad: f64, width_rad: f64) -> bool {
    let [low, high] = survey.range[joint];
    if width_rad > LOCAL * (high - low) || !(low..=high).contains(&centre_rad) {
        return false;
    }
    let within = |row: &&usize| (survey.data.q(**row)[joint] - centre_rad).abs() < width_rad;
    survey.rows.iter().filter(within).take(SUPPORT).count() == SUPPORT
}

impl Placed for Unknown {
    fn place(&self) -> Place {
        self.place
    }

    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        let with = |signature| Form::from(Self { place: self.place, signature });
        match self.signature {
            Signature::Bump { centre_rad, width_rad } | Signature::Step { centre_rad, width_rad } => {
                let step = libm::exp2(-f64::from(level));
                let power = libm::exp2(-0.5 * f64::from(level));
                let widths = [0.75, 1.0, 1.33].map(|factor| width_rad * libm::pow(factor, power));
                let centres = [-0.4, 0.0, 0.4].map(|share| centre_rad + share * width_rad * step);
                let pairs = centres.into_iter().flat_map(|c| widths.map(|w| (c, w)));
                let Place::Joint(joint) = self.place else { return Vec::new() };
                let shape = |(centre_rad, width_rad)| match self.signature {
                    Signature::Step { .. } => Signature::Step { centre_rad, width_rad },
                    _ => Signature::Bump { centre_rad, width_rad },
                };
                pairs.filter(|(centre, width)| supported(survey, joint, *centre, *width)).map(|pair| with(shape(pair))).collect()
            }
            Signature::Hinge { by, from_rad, upwards } => {
                let [low, high] = survey.range[by];
                let step = 0.12 * (high - low) * libm::exp2(-0.7 * f64::from(level));
                let places = [from_rad - step, from_rad + step].into_iter().filter(|at| *at > low && *at < high);
                places.map(|from_rad| with(Signature::Hinge { by, from_rad, upwards })).collect()
            }
            Signature::Sway { period_s, turns } => {
                let step = libm::pow(1.15, libm::exp2(-0.7 * f64::from(level)));
                let [shortest, longest] = PERIODS.map(|share| share * (survey.time[1] - survey.time[0]));
                let within = |period_s: f64| Signature::Sway { period_s: period_s.clamp(shortest, longest), turns };
                [step, 1.0 / step].map(|factor| with(within(period_s * factor))).to_vec()
            }
            Signature::Creep { start_s, end_s, power } => {
                let step = libm::pow(1.5, libm::exp2(-0.7 * f64::from(level)));
                let powers = [power * step, power / step].into_iter().filter(|power| POWERS.contains(power));
                powers.map(|power| with(Signature::Creep { start_s, end_s, power })).collect()
            }
            Signature::Warming(by) => by.near(survey, level).into_iter().map(|by| with(Signature::Warming(by))).collect(),
            _ => Vec::new(),
        }
    }

    fn variant(&self) -> String {
        match self.signature {
            Signature::Angle { by, .. } | Signature::Periodic { by, .. } => format!("q{}", by + 1),
            Signature::Hinge { .. } => "hinge".into(),
            Signature::Bump { .. } => "bump".into(),
            Signature::Step { .. } => "step".into(),
            Signature::Product { a, b } | Signature::Surface { a, b, .. } => format!("q{}_q{}", a + 1, b + 1),
            Signature::Sway { turns, .. } => if turns { "rock" } else { "sway" }.into(),
            Signature::Time { .. } => "time".into(),
            Signature::Creep { .. } => "creep".into(),
            Signature::Warming(_) => "warm".into(),
            Signature::Side { .. } => "side".into(),
            Signature::Sag => "sag".into(),
            Signature::Payload { .. } => "payload".into(),
        }
    }
}

//! The families of effects that may be concealed, each in the form that a library expects and in others.
//!
//! A family draws effects of a natural size for the robot and the plan at hand; how large they end up is decided by how visible
//! they are. Names and places are the canonical ones.

pub(super) mod foreign;
mod gears;
mod instruments;
mod interactions;
mod loads;

use super::robots::{ALL_KINDS, KINDS, Kind};
use crate::arm::Arm;
use crate::effect::Physical;
use crate::equilibrium::settle;
use crate::matrix::{self, Vector};
use crate::noise::Noise;
use crate::plan::Point;
use crate::truth::ARCSEC;
use calib_foundation::description::RobotDescription;

/// A column of the recording that may be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Column {
    /// The clock.
    Time,
    /// The temperature.
    Temperature,
    /// Motor currents.
    Current,
    /// Sides of approach.
    Direction,
}

/// One concealed cause: what a diagnosis should name, and what the twin does for it.
#[derive(Debug, Clone)]
pub struct Cause {
    pub effect: &'static str,
    pub place: String,
    /// What makes it.
    pub physical: Vec<Physical>,
    /// Its size may be changed to reach a visibility.
    pub(crate) sized: bool,
    /// Must be named; what only goes along with another cause may be.
    pub wanted: bool,
}

/// What a family has drawn.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    /// The form, in a few words.
    pub(crate) form: &'static str,
    /// More than one where they act together.
    pub(crate) causes: Vec<Cause>,
    /// Names that are true as well, or that no position data can separate: they neither count nor hurt.
    pub(crate) accepted: Vec<(&'static str, String)>,
    /// Columns without which nobody can name it.
    pub(crate) needs: Vec<Column>,
    /// Columns that the form takes away.
    pub(crate) hides: Vec<Column>,
}

impl Draft {
    fn new(form: &'static str, causes: Vec<Cause>) -> Draft {
        Draft {
            form,
            causes,
            accepted: Vec::new(),
            needs: Vec::new(),
            hides: Vec::new(),
        }
    }
    /// A draft of one cause whose size may be changed.
    fn one(
        form: &'static str,
        effect: &'static str,
        place: impl Into<String>,
        physical: Vec<Physical>,
    ) -> Draft {
        Draft::new(form, vec![sized(effect, place.into(), physical)])
    }
    fn accepting(mut self, effect: &'static str, place: String) -> Draft {
        self.accepted.push((effect, place));
        self
    }
    fn needing(mut self, columns: &[Column]) -> Draft {
        self.needs.extend(columns);
        self
    }
    fn hiding(mut self, column: Column) -> Draft {
        self.hides.push(column);
        self
    }
}

/// A cause whose size may be changed.
fn sized(effect: &'static str, place: String, physical: Vec<Physical>) -> Cause {
    Cause {
        effect,
        place,
        physical,
        sized: true,
        wanted: true,
    }
}

/// A cause of the size that it was drawn with.
fn fixed(effect: &'static str, place: String, physical: Vec<Physical>) -> Cause {
    Cause {
        sized: false,
        ..sized(effect, place, physical)
    }
}

fn joint(number: usize) -> String {
    format!("joint {number}")
}

fn link(number: usize) -> String {
    format!("link {number}")
}

/// Whether a form is the one that a library would hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// As a library would hold it.
    Obvious,
    /// Otherwise.
    Other,
}

/// What a family may look at: the robot, the plan, and the loads of the undeflected arm.
#[derive(Debug)]
pub(crate) struct Bench<'a> {
    /// As its owner believes it to be.
    pub(crate) robot: &'a RobotDescription,
    /// Ranges of every joint, deg.
    pub(crate) ranges_deg: &'a [[f64; 2]],
    /// Largest torque on each joint over the points, Nm.
    pub(crate) peak: Vec<f64>,
    /// Largest moment about the foot, Nm.
    pub(crate) overturning: f64,
    /// When the last point to fit is measured, and when the load changes, s.
    pub(crate) end_s: f64,
    /// s.
    pub(crate) change_s: f64,
}

impl<'a> Bench<'a> {
    /// Weighs the arm in every point to fit.
    pub(crate) fn new(
        robot: &'a RobotDescription,
        ranges_deg: &'a [[f64; 2]],
        points: &[Point],
    ) -> Bench<'a> {
        let arm = Arm::new(robot, &Default::default());
        let mut bench = Bench {
            robot,
            ranges_deg,
            peak: vec![0.0; robot.joints.len()],
            overturning: 0.0,
            end_s: points.last().map_or(0.0, |point| point.time_s),
            change_s: points
                .iter()
                .find(|point| point.payload_kg > 0.0)
                .map_or(0.0, |point| point.time_s),
        };
        for point in points {
            let row = point.row(point.q.clone(), Vec::new());
            let rest = settle(&arm, &row, &[]);
            for (peak, torque) in bench.peak.iter_mut().zip(&rest.torque) {
                *peak = peak.max(torque.abs());
            }
            let loads = crate::arm::Loads::new(&arm, &rest.posture, point.payload_kg);
            let (_, moment) = loads.wrench(0, [0.0; 3]);
            bench.overturning = bench.overturning.max(moment[0].hypot(moment[1]));
        }
        bench
    }

    fn joints(&self) -> usize {
        self.robot.joints.len()
    }

    /// Joints (from 1) that gravity loads, but for the last, whose turn moves the tool little.
    fn loaded(&self) -> Vec<usize> {
        let most = self.peak.iter().copied().fold(0.0, f64::max);
        (1..self.joints())
            .filter(|number| self.peak[number - 1] > 0.02 * most)
            .collect()
    }

    /// A joint that turns the tool: any but the last.
    fn turning(&self, draw: &mut Noise) -> usize {
        1 + draw.index(self.joints() - 1)
    }

    /// One of the loaded joints, mostly one of the heavily loaded.
    fn bearing(&self, draw: &mut Noise) -> Option<usize> {
        let loaded = self.loaded();
        let most = self.peak.iter().copied().fold(0.0, f64::max);
        let heavy: Vec<usize> = loaded
            .iter()
            .copied()
            .filter(|number| self.peak[number - 1] > 0.2 * most)
            .collect();
        let list = if draw.chance(0.7) && !heavy.is_empty() {
            heavy
        } else {
            loaded
        };
        list.get(draw.index(list.len())).copied()
    }

    /// From the axis of a joint (from 0) to the next one, or to the tool, m.
    fn line(&self, index: usize) -> Vector {
        let next = self.robot.joints.get(index + 1);
        let end = next.map_or(self.robot.tool, |next| next.point);
        matrix::minus(end, self.robot.joints[index].point)
    }

    /// Links (from 1) with a length worth the name.
    fn long_links(&self) -> Vec<usize> {
        (1..self.joints())
            .filter(|number| matrix::norm(self.line(number - 1)) > 0.15)
            .collect()
    }

    /// One of them; none where there is none.
    fn long_link(&self, draw: &mut Noise) -> Option<usize> {
        let long = self.long_links();
        long.get(draw.index(long.len())).copied()
    }

    /// Wind-up per torque (rad/Nm) that turns a joint by so much under its largest torque.
    fn softness(&self, number: usize, arcsec: f64) -> f64 {
        arcsec * ARCSEC / self.peak[number - 1].max(1e-9)
    }

    /// A moment for a step: not near the ends and not near the change of the load.
    fn moment(&self, draw: &mut Noise) -> f64 {
        let (early, late) = (0.15 * self.end_s, 0.85 * self.end_s);
        for _ in 0..50 {
            let at = draw.uniform(early, late);
            if (at - self.change_s).abs() > 0.1 * self.end_s {
                return at.round();
            }
        }
        early.round()
    }

    /// An angle well inside a joint's range, deg.
    fn angle(&self, number: usize, draw: &mut Noise) -> f64 {
        let [lower, upper] = self.ranges_deg[number - 1];
        lower + (upper - lower) * draw.uniform(0.25, 0.75)
    }
}

/// Draws an effect; none where this robot cannot have it.
type Draw = fn(&Bench, Form, &mut Noise) -> Option<Draft>;

/// A family of effects.
pub struct Family {
    /// The canonical name of the effect; `unknown` for what is in no list.
    pub name: &'static str,
    /// Draws one.
    pub(crate) draw: Draw,
    /// May stand beside another one.
    pub(crate) paired: bool,
}

const fn alone(name: &'static str, draw: Draw) -> Family {
    Family {
        name,
        draw,
        paired: false,
    }
}

const fn paired(name: &'static str, draw: Draw) -> Family {
    Family {
        paired: true,
        ..alone(name, draw)
    }
}

/// Families in canonical names; several rows of one name are different causes.
pub const FAMILIES: &[Family] = &[
    paired("joint_compliance", gears::joint_compliance),
    alone("joint_hardening", gears::joint_hardening),
    paired("gear_cyclic", gears::gear_cyclic),
    paired("gear_motor_cyclic", gears::gear_motor_cyclic),
    paired("backlash", gears::backlash),
    paired("axis_wobble", gears::axis_wobble),
    paired("zero_shift", gears::zero_shift),
    alone("cable_drag", gears::cable_drag),
    paired("link_compliance", loads::link_compliance),
    paired("base_compliance", loads::base_compliance),
    alone("counterbalance", loads::counterbalance),
    alone("link_mass", loads::link_mass),
    alone("payload_error", loads::payload_error),
    paired("thermal_growth", loads::thermal_growth),
    paired("tool_shift", loads::tool_shift),
    paired("base_shift", loads::base_shift),
    paired("tracker_drift", loads::tracker_drift),
    alone("joint_log_lag", loads::joint_log_lag),
    alone("tracker_scale", loads::tracker_scale),
    alone("unknown", foreign::bump),
    alone("unknown", foreign::hinge),
    alone("unknown", foreign::product),
    alone("unknown", foreign::sway),
];

/// Families of physics that no list of effects holds yet: instruments, memory, interactions.
pub const BEYOND: &[Family] = &[
    alone("tracker_circle", instruments::circle),
    alone("tracker_elevation", instruments::elevation),
    alone("tracker_offset", instruments::offset),
    alone("tracker_refraction", instruments::refraction),
    alone("unknown", instruments::swing),
    alone("base_shift", instruments::knock),
    alone("presliding", interactions::presliding),
    alone("joint_warming", interactions::own_heat),
    alone("joint_warming", interactions::late_heat),
    alone("thermal_growth", interactions::lagging_link),
    alone("gear_load", interactions::gear_load),
    alone("gear_flank", interactions::gear_flank),
    alone("joint_warming", interactions::warm_ratio),
    alone("joint_warming", interactions::warm_spring),
    alone("backlash", interactions::spring_by_direction),
    alone("backlash", interactions::growing_gap),
    alone("unknown", interactions::bent_link),
];

/// What a set of recordings is drawn from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Collection {
    /// [`FAMILIES`] on the robots of `KINDS`.
    #[default]
    Library,
    /// [`BEYOND`], one plain cause a recording, on an arm of five joints, too.
    Beyond,
}

impl Collection {
    /// Kinds of effects that are drawn.
    pub fn families(self) -> &'static [Family] {
        match self {
            Self::Library => FAMILIES,
            Self::Beyond => BEYOND,
        }
    }

    /// Robots that are drawn.
    pub(crate) fn robots(self) -> &'static [Kind] {
        match self {
            Self::Library => &KINDS,
            Self::Beyond => &ALL_KINDS,
        }
    }
}

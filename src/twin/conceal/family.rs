//! The families of effects that may be concealed, each in the form that a library expects and in others.
//!
//! A family draws effects of a natural size for the robot and the plan at hand; how large they end up is decided by how visible
//! they are. Names and places are the canonical ones.

pub(super) mod foreign;
mod gears;
mod instruments;
mod interactions;
mod loads;
mod memories;
mod mounts;
mod unlisted;

use super::robots::{ALL_KINDS, KINDS, Kind};
use crate::arm::Arm;
use crate::effect::Physical;
use crate::equilibrium::settle;
use crate::noise::Noise;
use crate::plan::Point;
use crate::statics::Row;
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
    /// Canonical name.
    pub effect: &'static str,
    /// In the words of the interface.
    pub place: String,
    /// What makes it.
    pub physical: Vec<Physical>,
    /// Its size may be changed to reach a visibility.
    pub sized: bool,
    /// Must be named; what only goes along with another cause may be.
    pub wanted: bool,
}

/// What a family has drawn.
#[derive(Debug, Clone)]
pub struct Draft {
    /// The form, in a few words.
    pub form: &'static str,
    /// More than one where they act together.
    pub causes: Vec<Cause>,
    /// Names that are true as well, or that no position data can separate: they neither count nor hurt.
    pub accepted: Vec<(&'static str, String)>,
    /// Columns without which nobody can name it.
    pub needs: Vec<Column>,
    /// Columns that the form takes away.
    pub hides: Vec<Column>,
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
        effect,
        place,
        physical,
        sized: false,
        wanted: true,
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
pub enum Form {
    /// As a library would hold it.
    Obvious,
    /// Otherwise.
    Other,
}

/// What a family may look at: the robot, the plan, and the loads of the undeflected arm.
#[derive(Debug)]
pub struct Bench<'a> {
    /// As its owner believes it to be.
    pub robot: &'a RobotDescription,
    /// Ranges of every joint, deg.
    pub ranges_deg: &'a [[f64; 2]],
    /// Largest torque on each joint over the points, Nm.
    pub peak: Vec<f64>,
    /// Largest moment about the foot, Nm.
    pub overturning: f64,
    /// When the last point to fit is measured, and when the load changes, s.
    pub end_s: f64,
    /// s.
    pub change_s: f64,
}

impl<'a> Bench<'a> {
    /// Weighs the arm in every point to fit.
    pub fn new(
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
            let row = Row {
                command: point.q.clone(),
                drive: point.q.clone(),
                direction: point.direction.clone(),
                time_s: point.time_s,
                temperature_c: point.temperature_c,
                payload_kg: point.payload_kg,
                velocity: Vec::new(),
                memory: Vec::new(),
            };
            let rest = settle(&arm, &row, &[]);
            for (peak, torque) in bench.peak.iter_mut().zip(&rest.torque) {
                *peak = peak.max(torque.abs());
            }
            let loads = crate::statics::Loads::new(&arm, &rest.posture, point.payload_kg);
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

    /// Links (from 1) with a length worth the name.
    fn long_links(&self) -> Vec<usize> {
        let end = |index: usize| {
            self.robot
                .joints
                .get(index + 1)
                .map_or(self.robot.tool, |next| next.point)
        };
        let span = |index: usize| {
            crate::matrix::norm(crate::matrix::minus(
                end(index),
                self.robot.joints[index].point,
            ))
        };
        (1..self.joints())
            .filter(|number| span(number - 1) > 0.15)
            .collect()
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

/// A family of effects.
pub struct Family {
    /// The canonical name of the effect; `unknown` for what is in no list.
    pub name: &'static str,
    /// Draws an effect; none where this robot cannot have it.
    pub draw: fn(&Bench, Form, &mut Noise) -> Option<Draft>,
    /// May stand beside another one.
    pub paired: bool,
}

/// Families in canonical names; several rows of one name are different causes.
pub const FAMILIES: &[Family] = &[
    Family {
        name: "joint_compliance",
        draw: gears::joint_compliance,
        paired: true,
    },
    Family {
        name: "joint_hardening",
        draw: gears::joint_hardening,
        paired: false,
    },
    Family {
        name: "gear_cyclic",
        draw: gears::gear_cyclic,
        paired: true,
    },
    Family {
        name: "gear_motor_cyclic",
        draw: gears::gear_motor_cyclic,
        paired: true,
    },
    Family {
        name: "backlash",
        draw: gears::backlash,
        paired: true,
    },
    Family {
        name: "axis_wobble",
        draw: gears::axis_wobble,
        paired: true,
    },
    Family {
        name: "zero_shift",
        draw: gears::zero_shift,
        paired: true,
    },
    Family {
        name: "cable_drag",
        draw: gears::cable_drag,
        paired: false,
    },
    Family {
        name: "link_compliance",
        draw: loads::link_compliance,
        paired: true,
    },
    Family {
        name: "base_compliance",
        draw: loads::base_compliance,
        paired: true,
    },
    Family {
        name: "counterbalance",
        draw: loads::counterbalance,
        paired: false,
    },
    Family {
        name: "link_mass",
        draw: loads::link_mass,
        paired: false,
    },
    Family {
        name: "payload_error",
        draw: loads::payload_error,
        paired: false,
    },
    Family {
        name: "thermal_growth",
        draw: mounts::thermal_growth,
        paired: true,
    },
    Family {
        name: "tool_shift",
        draw: mounts::tool_shift,
        paired: true,
    },
    Family {
        name: "base_shift",
        draw: mounts::base_shift,
        paired: true,
    },
    Family {
        name: "tracker_drift",
        draw: mounts::tracker_drift,
        paired: true,
    },
    Family {
        name: "joint_log_lag",
        draw: mounts::joint_log_lag,
        paired: false,
    },
    Family {
        name: "tracker_scale",
        draw: mounts::tracker_scale,
        paired: false,
    },
    Family {
        name: "unknown",
        draw: unlisted::bump,
        paired: false,
    },
    Family {
        name: "unknown",
        draw: unlisted::hinge,
        paired: false,
    },
    Family {
        name: "unknown",
        draw: unlisted::product,
        paired: false,
    },
    Family {
        name: "unknown",
        draw: unlisted::sway,
        paired: false,
    },
];

/// Families of physics that no list of effects holds yet: instruments, memory, interactions.
pub const BEYOND: &[Family] = &[
    Family {
        name: "tracker_circle",
        draw: instruments::circle,
        paired: false,
    },
    Family {
        name: "tracker_elevation",
        draw: instruments::elevation,
        paired: false,
    },
    Family {
        name: "tracker_offset",
        draw: instruments::offset,
        paired: false,
    },
    Family {
        name: "tracker_refraction",
        draw: instruments::refraction,
        paired: false,
    },
    Family {
        name: "unknown",
        draw: instruments::swing,
        paired: false,
    },
    Family {
        name: "base_shift",
        draw: instruments::knock,
        paired: false,
    },
    Family {
        name: "presliding",
        draw: memories::presliding,
        paired: false,
    },
    Family {
        name: "joint_warming",
        draw: memories::own_heat,
        paired: false,
    },
    Family {
        name: "joint_warming",
        draw: memories::late_heat,
        paired: false,
    },
    Family {
        name: "thermal_growth",
        draw: memories::lagging_link,
        paired: false,
    },
    Family {
        name: "gear_load",
        draw: interactions::gear_load,
        paired: false,
    },
    Family {
        name: "gear_flank",
        draw: interactions::gear_flank,
        paired: false,
    },
    Family {
        name: "joint_warming",
        draw: interactions::warm_ratio,
        paired: false,
    },
    Family {
        name: "joint_warming",
        draw: interactions::warm_spring,
        paired: false,
    },
    Family {
        name: "backlash",
        draw: interactions::spring_by_direction,
        paired: false,
    },
    Family {
        name: "backlash",
        draw: interactions::growing_gap,
        paired: false,
    },
    Family {
        name: "unknown",
        draw: interactions::bent_link,
        paired: false,
    },
];

/// What a set of recordings is drawn from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Collection {
    /// [`FAMILIES`] on the robots of [`KINDS`].
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
    pub fn robots(self) -> &'static [Kind] {
        match self {
            Self::Library => &KINDS,
            Self::Beyond => &ALL_KINDS,
        }
    }
}

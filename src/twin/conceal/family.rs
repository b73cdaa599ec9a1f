//! The families of effects that may be concealed, each in the form that a library expects and in others.

pub(super) mod foreign;
mod table;

pub use table::{BEYOND, FAMILIES};

use super::robots::{ALL_KINDS, KINDS, Kind};
use crate::arm::Arm;
use crate::effect::{JointCompliance, Physical};
use crate::lists::named;
use crate::lists::{Family, families};
use crate::matrix::{self, Vector};
use crate::noise::Noise;
use crate::plan::Point;
use crate::recorder::settle;
use crate::truth::ARCSEC;
use calib_foundation::description::RobotDescription;

named! {
    /// A column of the recording that may be missing.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    Column,
    /// All of them.
    COLUMNS: 4 {
        /// The clock.
        Time "time_s",
        /// The temperature.
        Temperature "temp_c",
        /// Motor currents.
        Current "current",
        /// Sides of approach.
        Direction "direction",
    }
}

/// One concealed cause: what a diagnosis should name, and what the twin does for it.
#[derive(Debug, Clone)]
pub struct Cause {
    /// The form of it, in a few words.
    pub form: &'static str,
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
#[derive(Debug, Clone, Default)]
pub struct Draft {
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
    fn new(form: &'static str, mut causes: Vec<Cause>) -> Draft {
        causes.iter_mut().for_each(|cause| cause.form = form);
        Draft {
            causes,
            ..Draft::default()
        }
    }
    /// A draft of one cause whose size may be changed.
    fn one(
        form: &'static str,
        effect: &'static str,
        place: impl Into<String>,
        physical: impl Into<Vec<Physical>>,
    ) -> Draft {
        let cause = Cause {
            sized: true,
            ..fixed(effect, place.into(), physical)
        };
        Draft::new(form, vec![cause])
    }
    /// A cause of the size that it was drawn with, which shows through the springs of all loaded joints.
    fn on_springs(
        form: &'static str,
        effect: &'static str,
        place: impl Into<String>,
        physical: Physical,
        on: &Bench,
        draw: &mut Noise,
    ) -> Draft {
        let mut causes = vec![fixed(effect, place.into(), [physical])];
        causes.extend(springs(on, draw));
        Draft::new(form, causes)
    }
    /// With the linear spring of its joint, of a size between two bounds: it may be named, or counted to what is concealed.
    fn over_spring(mut self, on: &Bench, number: usize, sizes: [f64; 2], draw: &mut Noise) -> Self {
        let linear = [spring(on, number, draw.size(sizes[0], sizes[1]))];
        self.causes.push(Cause {
            form: self.causes[0].form,
            wanted: false,
            ..fixed("joint_compliance", joint(number), linear)
        });
        self
    }
    fn accepting(mut self, effect: &'static str, place: String) -> Draft {
        self.accepted.push((effect, place));
        self
    }
    fn needing(mut self, columns: &[Column]) -> Draft {
        self.needs.extend(columns);
        self
    }
}

/// A cause of the size that it was drawn with.
fn fixed(effect: &'static str, place: String, physical: impl Into<Vec<Physical>>) -> Cause {
    Cause {
        form: "",
        effect,
        place,
        physical: physical.into(),
        sized: false,
        wanted: true,
    }
}

/// The linear spring of a joint that turns by so many arcsec under its largest torque.
fn spring(on: &Bench, number: usize, arcsec: f64) -> Physical {
    JointCompliance::effect(number, on.softness(number, arcsec))
}

/// The springs of all loaded joints, of their natural size.
fn springs(on: &Bench, draw: &mut Noise) -> Vec<Cause> {
    let spring = |number| {
        let spring = [spring(on, number, draw.size(60.0, 250.0))];
        fixed("joint_compliance", joint(number), spring)
    };
    on.loaded().into_iter().map(spring).collect()
}

fn joint(number: usize) -> String {
    format!("joint {number}")
}

fn link(number: usize) -> String {
    format!("link {number}")
}

/// What a family may look at: the robot, the plan, and the loads of the undeflected arm.
#[derive(Debug)]
pub struct Bench<'a> {
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
        let loaded = points.iter().find(|point| point.payload_kg > 0.0);
        let mut bench = Bench {
            robot,
            ranges_deg,
            peak: vec![0.0; robot.joints.len()],
            overturning: 0.0,
            end_s: points.last().map_or(0.0, |point| point.time_s),
            change_s: loaded.map_or(0.0, |point| point.time_s),
        };
        for point in points {
            let row = point.row(point.q.clone(), Vec::new());
            let at_rest = settle(&arm, &row, &[]);
            for (peak, torque) in bench.peak.iter_mut().zip(&at_rest.torque) {
                *peak = peak.max(torque.abs());
            }
            let loads = crate::arm::Loads::new(&arm, &at_rest.posture, point.payload_kg);
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
        self.carrying(0.02)
    }

    /// Those of them that carry more than a share of what the most loaded one does.
    fn carrying(&self, share: f64) -> Vec<usize> {
        let most = self.peak.iter().copied().fold(0.0, f64::max);
        let carries = |number: &usize| self.peak[number - 1] > share * most;
        (1..self.joints()).filter(carries).collect()
    }

    /// A joint that turns the tool: any but the last.
    fn turning(&self, draw: &mut Noise) -> usize {
        1 + draw.index(self.joints() - 1)
    }

    /// One of the loaded joints, mostly one of the heavily loaded.
    fn bearing(&self, draw: &mut Noise) -> Option<usize> {
        let heavy = self.carrying(0.2);
        let is_heavy = draw.chance(0.7) && !heavy.is_empty();
        let list = if is_heavy { heavy } else { self.loaded() };
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
        let is_long = |number: &usize| matrix::norm(self.line(number - 1)) > 0.15;
        (1..self.joints()).filter(is_long).collect()
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

/// Draws an effect, in another form than the obvious one if that is asked for; none where this robot cannot have it.
pub type DrawEffect = fn(&Bench, bool, &mut Noise) -> Option<Draft>;

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
    pub fn families(self) -> &'static [Family<DrawEffect>] {
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

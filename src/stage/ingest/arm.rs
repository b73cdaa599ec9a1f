//! What ingest needs to know of the robot (number and kinds of joints, their limits), and where the quantities of a row live in its list of
//! numbers and of texts: one after another, as the recording declares them.

use crate::error::{Error, Result};
use crate::observation::{DeclaredColumn, KINDS, MeasurementKind, Part};
use crate::table::{Robot, recording_columns};
use std::ops::Range;

/// A joint at its limit is not beyond it: what rounding in the file's unit may add, rad or m.
const SLACK: f64 = 1e-6;
pub(super) const UNLIMITED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

pub(super) struct RobotJoints {
    /// Names of the joints; none where no robot is known.
    pub names: Vec<String>,
    pub prismatic: Vec<bool>,
    /// Travel of each joint, rad or m.
    pub limits: Vec<[f64; 2]>,
    /// The layout of its rows.
    pub slots: Slots,
}

impl RobotJoints {
    pub(super) fn of(robot: &Robot) -> Result<Self> {
        let (mut names, mut kinds, mut limits) = (Vec::new(), Vec::new(), Vec::new());
        for row in &robot.0 {
            let metres = |mm: Option<f64>| mm.map(|mm| mm * 1e-3);
            let (prismatic, lower, upper) = match row.kind.as_str() {
                "revolute" => (false, row.lower_rad, row.upper_rad),
                "prismatic" => (true, metres(row.lower_mm), metres(row.upper_mm)),
                _ => continue,
            };
            names.push(row.name.clone());
            kinds.push(prismatic);
            let [lowest, highest] = UNLIMITED;
            limits.push([lower.unwrap_or(lowest), upper.unwrap_or(highest)]);
        }
        if kinds.is_empty() {
            return Err(Error::data("robot", "has no joint"));
        }
        Ok(Self {
            names,
            ..Self::new(kinds, limits)
        })
    }
    pub(super) fn new(prismatic: Vec<bool>, limits: Vec<[f64; 2]>) -> Self {
        Self {
            names: Vec::new(),
            slots: Slots::new(prismatic.len()),
            prismatic,
            limits,
        }
    }
    /// A joint (from 0) at `value`, rad or m, beyond which limit it is, in deg or mm.
    pub(super) fn beyond(&self, joint: usize, value: f64) -> String {
        let [lower, upper] = self.limits.get(joint).copied().unwrap_or(UNLIMITED);
        let (scale, unit) = self.shown_in(joint);
        let (side, limit) = match value < lower {
            true => ("below its lower", lower),
            false => ("above its upper", upper),
        };
        let (name, value, limit) = (self.called(joint), value * scale, limit * scale);
        format!("{name} at {value:.4} {unit}, {side} limit of {limit:.4} {unit}")
    }
    /// The first joint (from 0) of a row that is beyond its limits.
    pub(super) fn first_beyond(&self, q: &[f64]) -> Option<usize> {
        let mut joints = q.iter().zip(&self.limits);
        joints.position(|(q, [lower, upper])| *q < lower - SLACK || *q > upper + SLACK)
    }
    /// `joint 2 (`shoulder`)`, of a joint (from 0).
    pub(super) fn called(&self, joint: usize) -> String {
        let name = self.names.get(joint).map(|name| format!(" (`{name}`)"));
        format!("joint {}{}", joint + 1, name.unwrap_or_default())
    }
    /// What positions of a joint (from 0) are multiplied by for people, and their unit then.
    pub(super) fn shown_in(&self, joint: usize) -> (f64, &'static str) {
        match self.prismatic.get(joint) {
            Some(true) => (1e3, "mm"),
            _ => (1f64.to_degrees(), "deg"),
        }
    }
    pub(super) fn joints(&self) -> usize {
        self.prismatic.len()
    }
}

/// The layout of a row, of a robot with so many joints.
pub(super) struct Slots {
    columns: Vec<(&'static DeclaredColumn, Range<usize>)>,
    texts: Vec<&'static str>,
    pub count: usize,
    pub time: usize,
    pub q: Range<usize>,
    pub velocity: Range<usize>,
    pub point: Range<usize>,
    pub kinds: Vec<KindSlots>,
}

pub(super) struct KindSlots {
    pub kind: &'static dyn MeasurementKind,
    pub values: Vec<usize>,
    pub sigma: Vec<usize>,
    /// Whether each reading needs its standard deviation.
    pub own_sigma: bool,
    /// Among the row's texts: the name of the place that holds the target, of a contact constraint.
    pub name: Option<usize>,
}

impl Slots {
    pub(super) fn new(joints: usize) -> Self {
        let mut count = 0;
        let place = |column: &'static DeclaredColumn| {
            let first = count;
            count += column.numbers(joints);
            (column, first..count)
        };
        let columns: Vec<(&'static DeclaredColumn, Range<usize>)> =
            recording_columns().map(place).collect();
        let texts =
            recording_columns().filter(|column| column.is_text() && column.setting != "point_id");
        let mut slots = Self {
            texts: texts.map(|column| column.setting).collect(),
            columns,
            count,
            time: 0,
            q: 0..0,
            velocity: 0..0,
            point: 0..0,
            kinds: Vec::new(),
        };
        slots.time = slots.of("time").start;
        (slots.q, slots.velocity) = (slots.of("q"), slots.of("velocity"));
        slots.point = slots.of("x").start..slots.of("z").end;
        let part = |kind: &dyn MeasurementKind, part: Part| -> Vec<usize> {
            kind.columns(part)
                .flat_map(|column| slots.of(column.setting).take(column.stored.len()))
                .collect()
        };
        let name = |kind: &dyn MeasurementKind| {
            let column = kind.telling().next().filter(|_| kind.is_contact())?;
            let mut texts = slots.texts.iter();
            texts.position(|setting| *setting == column.setting)
        };
        let kinds = KINDS.iter().map(|kind| KindSlots {
            kind: *kind,
            values: part(*kind, Part::Value),
            sigma: part(*kind, Part::Sigma),
            own_sigma: kind.about().own_sigma,
            name: name(*kind),
        });
        slots.kinds = kinds.collect();
        slots
    }
    pub(super) fn of(&self, setting: &str) -> Range<usize> {
        let mut columns = self.columns.iter();
        let found = columns.find(|(column, _)| column.setting == setting);
        found.map_or(0..0, |(_, places)| places.clone())
    }
    /// All columns with numbers, and their places.
    pub(super) fn numbers(&self) -> impl Iterator<Item = &(&'static DeclaredColumn, Range<usize>)> {
        self.columns.iter().filter(|(_, places)| !places.is_empty())
    }
    /// Settings of the texts of a row but its id.
    pub(super) fn texts(&self) -> &[&'static str] {
        &self.texts
    }
}

//! The robot as its owner believes it to be.

use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Result};
use crate::identified::robot_file;
use crate::raw;
use crate::robot::LibraryArm;
use crate::robot::import::{Imported, RobotFileText, read_calib, urdf_outline};
use crate::store::frame::Frame;
use crate::table::{Robot as RobotTable, Table};
use crate::units::Unit;
use serde_json::json;
use std::path::Path;

/// A nominal robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// As plain data, SI.
    pub description: RobotDescription,
    /// What a person should know of how it was read, a sentence each.
    pub notes: Vec<String>,
}

impl From<Imported> for Robot {
    fn from(read: Imported) -> Self {
        Self {
            description: read.robot,
            notes: read.notes,
        }
    }
}

impl Robot {
    /// From calib's robot file, or a practice `robot.json`. Fails with every fault of the file.
    pub fn from_file(path: &Path) -> Result<Self> {
        Ok(Self {
            description: robot_file(path, None)?,
            notes: Vec::new(),
        })
    }

    /// From the text of calib's robot file, YAML or JSON; `label` names it in errors.
    pub fn from_text(label: &str, text: &str) -> Result<Self> {
        Ok(read_calib(RobotFileText { label, text }, None)?.into())
    }

    /// From a URDF: the chain that ends at the link `tip`.
    pub fn from_urdf(path: &Path, tip: &str) -> Result<Self> {
        let label = path.display().to_string();
        let text = raw::text(path)
            .map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
        let urdf = RobotFileText {
            label: &label,
            text: &text,
        };
        let base = urdf_outline(urdf, tip)?.base;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let kinematics = json!({ "urdf": { "base": base, "tip": tip } });
        let units = json!({ "length": "mm", "angle": "rad" });
        let text =
            json!({ "calib_robot": 1, "name": name, "units": units, "kinematics": kinematics });
        let text = text.to_string();
        let text = RobotFileText {
            label: &label,
            text: &text,
        };
        Ok(read_calib(text, Some(urdf))?.into())
    }

    /// An arm of the library, as `calib robots` lists them.
    pub fn library(name: &str) -> Result<Self> {
        Ok(LibraryArm::named(name)?.read()?.into())
    }

    /// How many joints.
    pub fn joints(&self) -> usize {
        self.description.joints.len()
    }

    /// Which of them slide.
    pub fn prismatic(&self) -> Vec<bool> {
        let joints = self.description.joints.iter();
        joints
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect()
    }

    /// Positions of arrays, row-major -> rad and m.
    pub(crate) fn to_si(&self, joints: &[f64]) -> Vec<f64> {
        self.converted(joints, Unit::to_si)
    }

    /// The other way.
    pub fn from_si(&self, joints: &[f64]) -> Vec<f64> {
        self.converted(joints, Unit::from_si)
    }

    fn converted(&self, joints: &[f64], by: fn(Unit, f64) -> f64) -> Vec<f64> {
        let slides = self.prismatic();
        let unit = |slides: &bool| match slides {
            true => Unit::Millimetre,
            false => Unit::Radian,
        };
        let each = joints.iter().zip(slides.iter().cycle());
        each.map(|(value, slides)| by(unit(slides), *value))
            .collect()
    }

    pub(super) fn table(&self) -> Result<Frame> {
        RobotTable::from_description(&self.description).to_frame()
    }
}

//! What most controllers let one enter, as a list: zeros, ratios, couplings, the tool.
//!
//! By how much joints stand elsewhere than commanded, as an affine map of the commanded positions, and that map as a controller counts.

use super::{CarriedTorques, Export, Format};
use crate::effect::Place;
use crate::error::Result;
use crate::estimate::Covariance;
use crate::identified::IdentifiedModel;
use crate::robot::{JointConvention, RobotModel};
use crate::units::Unit;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeSet;

pub(super) const CONTROLLER: Format = Format {
    name: "controller",
    help: "Joint zeros, ratios, couplings and tool, as a list, as the controller counts its joints",
    comment: "#",
    carries: CarriedTorques::Nothing,
    text,
};

fn text(export: &Export) -> Result<String> {
    let mut text: String = export.head(&CONTROLLER);
    text.push_str(
        "# true position = factor * commanded + zero (+ coupling * the other joint); sigma is one standard deviation\n",
    );
    text.push_str("quantity,where,value,unit,sigma,status\n");
    text.extend(lines(&export.identified));
    let tools = [export.corrected.tool, export.identified.robot.tool];
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        let [now, nominal] = tools.map(|tool| tool[k] * 1e3);
        text.push_str(&format!(
            "tool {axis} (zero pose; base frame),tool,{now:.6},mm,,was {nominal:.6}\n"
        ));
    }
    Ok(text)
}

/// A parameter, and what the numbers of the list are by it. SI.
struct Share<'a> {
    /// In the stack.
    position: Option<usize>,
    status: &'a str,
    value: f64,
    sigma: Option<f64>,
    /// By a unit of the parameter.
    by: JointDeviation,
}

fn shares<'a>(identified: &'a IdentifiedModel, convention: &JointConvention) -> Vec<Share<'a>> {
    let specs = identified.model.stack.specs();
    let rows = identified.parameters.0.iter().filter_map(|row| {
        let entry = DeviationEntry::of(&row.effect, &row.place)?;
        let unit = Unit::parse(&row.unit).unwrap_or(Unit::One);
        Some(Share {
            position: specs.iter().position(|spec| spec.name == row.name),
            status: &row.status,
            value: unit.to_si(row.value),
            sigma: row.sigma.map(|sigma| unit.to_si(sigma)),
            by: JointDeviation::unit(entry, convention.zero().len()).counted(convention),
        })
    });
    rows.collect()
}

/// The numbers that the model has parameters for; as a controller counts, one may be of several parameters.
fn lines(identified: &IdentifiedModel) -> Vec<String> {
    let robot = &identified.model.robot;
    let convention = identified
        .convention
        .clone()
        .unwrap_or_else(|| JointConvention::of_the_robot_file(robot.joints()));
    let shares = shares(identified, &convention);
    let line = |entry: DeviationEntry| {
        let known = shares.iter().filter(|share| share.by.holds(entry));
        let at_joint: Vec<(&Share, f64)> = known.map(|share| (share, share.by.at(entry))).collect();
        if at_joint.is_empty() {
            return None;
        }
        let (quantity, scale, unit, decimals) = shown(entry, robot);
        let values = at_joint.iter().map(|(share, by)| share.value * by);
        let value = values.sum::<f64>() * scale;
        let sigma = sigma(&at_joint, identified.covariance.as_ref());
        let sigma = sigma.map(|sigma| format!("{:.3e}", sigma * scale));
        let sigma = sigma.unwrap_or_default();
        let statuses: BTreeSet<&str> = at_joint.iter().map(|(share, _)| share.status).collect();
        let status = statuses.into_iter().collect::<Vec<_>>().join(" and ");
        Some(format!(
            "{quantity},{},{value:.decimals$},{unit},{sigma},{status}\n",
            entry.place()
        ))
    };
    DeviationEntry::all(robot.joints())
        .filter_map(line)
        .collect()
}

/// What a number is called, what it is multiplied with from SI, its unit, and the decimals that keep a joint within 1e-9 rad.
fn shown(entry: DeviationEntry, robot: &RobotModel) -> (&'static str, f64, String, usize) {
    // People enter degrees.
    let unit = |joint: usize| match robot.is_revolute(joint) {
        true => Unit::Degree,
        false => Unit::Millimetre,
    };
    match entry {
        DeviationEntry::Zero(joint) => {
            ("zero", unit(joint).from_si(1.0), unit(joint).to_string(), 9)
        }
        DeviationEntry::Factor(_) => ("factor - 1", 1.0, "1".into(), 12),
        DeviationEntry::Coupling { by, moved } if unit(by) == unit(moved) => {
            ("coupling", 1.0, "1".into(), 12)
        }
        DeviationEntry::Coupling { by, moved } => {
            let scale = unit(moved).from_si(1.0) / unit(by).from_si(1.0);
            let unit = format!("{}/{}", unit(moved), unit(by));
            ("coupling", scale, unit, 12)
        }
    }
}

/// Standard deviation of a sum of parameters, each times a factor: of those that were estimated. None where none was, and of several
/// where their covariance is not known.
fn sigma(shares: &[(&Share, f64)], covariance: Option<&Covariance>) -> Option<f64> {
    let with_sigma = |(share, by): &(&Share, f64)| Some((share.position, *by, share.sigma?));
    let estimated: Vec<(Option<usize>, f64, f64)> = shares.iter().filter_map(with_sigma).collect();
    if let [(_, by, sigma)] = estimated[..] {
        return Some(sigma * by.abs());
    }
    let covariance = covariance?;
    let known = |(position, ..): &(Option<usize>, f64, f64)| {
        position.is_some_and(|position| covariance.parameters().contains(&position))
    };
    if estimated.is_empty() || !estimated.iter().all(known) {
        return None;
    }
    let by = |position: usize| -> f64 {
        let same = estimated.iter().filter(|one| one.0 == Some(position));
        same.map(|(_, by, _)| by).sum()
    };
    let part = |(a, b, value, _): (usize, usize, f64, f64)| {
        by(a) * by(b) * value * if a == b { 1.0 } else { 2.0 }
    };
    Some(covariance.pairs().map(part).sum::<f64>().sqrt())
}

/// A share below this one of the largest is rounding.
const ROUNDING: f64 = 1e-12;

/// A number of the map; joints from 0.
#[derive(Debug, Clone, Copy)]
pub(super) enum DeviationEntry {
    /// What a joint's position is off at zero, rad or m.
    Zero(usize),
    /// How a joint moves more than commanded, of itself.
    Factor(usize),
    /// How it moves with another one.
    Coupling { by: usize, moved: usize },
}

impl DeviationEntry {
    /// All of so many joints: zeros, factors, couplings.
    pub fn all(joints: usize) -> impl Iterator<Item = Self> {
        let pairs = (0..joints).flat_map(move |by| (0..joints).map(move |moved| (by, moved)));
        let couplings = pairs.filter(|(by, moved)| by != moved);
        let couplings = couplings.map(|(by, moved)| Self::Coupling { by, moved });
        let joints = || 0..joints;
        let alone = joints().map(Self::Zero).chain(joints().map(Self::Factor));
        alone.chain(couplings)
    }

    /// The one that a parameter is; none of an effect that no such map holds.
    pub fn of(effect: &str, place: &str) -> Option<Self> {
        match (effect, place.parse()) {
            ("joint_offset", Ok(Place::Joint(joint))) => Some(Self::Zero(joint)),
            ("reduction_ratio", Ok(Place::Joint(joint))) => Some(Self::Factor(joint)),
            ("coupling_ratio", Ok(Place::Coupled(by, moved))) => Some(Self::Coupling { by, moved }),
            _ => None,
        }
    }

    pub(crate) fn place(self) -> Place {
        match self {
            Self::Zero(joint) | Self::Factor(joint) => Place::Joint(joint),
            Self::Coupling { by, moved } => Place::Coupled(by, moved),
        }
    }
}

/// q_true - q = slope q + zero, SI; the zero is a column behind those of the slope.
#[derive(Debug, Clone)]
pub(super) struct JointDeviation(DMatrix<f64>);

impl JointDeviation {
    /// One number of 1, all others 0, in the robot file's counting.
    pub(crate) fn unit(entry: DeviationEntry, joints: usize) -> Self {
        let mut out = Self(DMatrix::zeros(joints, joints + 1));
        let place = out.place(entry);
        out.0[place] = 1.0;
        out
    }

    fn place(&self, entry: DeviationEntry) -> (usize, usize) {
        match entry {
            DeviationEntry::Zero(joint) => (joint, self.0.nrows()),
            DeviationEntry::Factor(joint) => (joint, joint),
            DeviationEntry::Coupling { by, moved } => (moved, by),
        }
    }

    pub(crate) fn at(&self, entry: DeviationEntry) -> f64 {
        self.0[self.place(entry)]
    }

    /// Whether a number is more than rounding.
    pub(crate) fn holds(&self, entry: DeviationEntry) -> bool {
        self.at(entry).abs() > ROUNDING * self.0.amax()
    }

    /// In the controller's numbers c: with q = A (c - z), c_true - c = B slope A (c - z) + B zero, B the inverse of A.
    pub(crate) fn counted(&self, convention: &JointConvention) -> Self {
        let shown = DVector::from_column_slice(convention.zero());
        let joints = shown.len();
        let (slope, zero) = (self.0.columns(0, joints), self.0.column(joints));
        let matrix = |change: &dyn Fn(&mut DVector<f64>)| {
            let column = |joint: usize| {
                let mut unit = DVector::zeros(joints);
                unit[joint] = 1.0;
                change(&mut unit);
                unit
            };
            DMatrix::from_columns(&(0..joints).map(column).collect::<Vec<_>>())
        };
        let to_robot = matrix(&|unit| {
            *unit += &shown;
            convention.to_robot(unit.as_mut_slice());
        });
        let back = matrix(&|unit| {
            convention.to_controller(unit.as_mut_slice());
            *unit -= &shown;
        });
        let slope = &back * slope * to_robot;
        let zero = back * zero - &slope * shown;
        let mut out = slope.insert_column(joints, 0.0);
        out.set_column(joints, &zero);
        Self(out)
    }
}

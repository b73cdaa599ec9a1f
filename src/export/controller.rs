//! What most controllers let one enter, as a list: zeros, ratios, couplings, the tool.

use super::entered::{self, EnteredNumbers, PointError, WantedPoints};
use super::{CarriedGeometry, CarriedTorques, Export, Format};
use crate::description::Made;
use crate::effect::{Place, names, tolerance};
use crate::error::{Error, Result, one_line};
use crate::estimate::Determined;
use crate::identified::{IdentifiedModel, placed};
use crate::robot::{JointConvention, RobotModel};
use crate::spatial::Pose;
use crate::units::Unit;
use nalgebra::{DMatrix, DVector, Vector3};
use std::collections::BTreeSet;

pub(super) const CONTROLLER: Format = Format {
    name: "controller",
    help: "Joint zeros, ratios, couplings and tool, as a list, as the controller counts its joints",
    comment: "#",
    geometry: CarriedGeometry::Numbers(&[
        names::TOOL_OFFSET,
        names::JOINT_OFFSET,
        names::REDUCTION_RATIO,
        names::COUPLING_RATIO,
    ]),
    carries: CarriedTorques::Nothing,
    text,
};

fn text(export: &Export) -> Result<String> {
    let list = ControllerList::of(export);
    let EnteredNumbers { nothing, left, .. } = &list.solved;
    if left.is_worse(nothing) && !export.insisted {
        let [nothing, left] = [nothing.mean, left.mean].map(|mean| mean * 1e3);
        let message = format!(
            "the best list of these numbers leaves {left:.3} mm, entering nothing {nothing:.3} mm: there is nothing to enter; allowed: \
             calib compensate, which uses the whole model, or --force"
        );
        return Err(Error::data(&export.identified.origin, message));
    }
    let mut text: String = export.head(&CONTROLLER);
    let base = list.anew.as_ref().map(|[nothing, left]| {
        let [nothing, left] = [nothing.mean, left.mean].map(|mean| mean * 1e3);
        format!("# the same once the base is taught anew: {left:.4} mm mean; nothing entered {nothing:.4} mm mean\n")
    });
    let [before, after] = [nothing, left].map(|error| {
        let [mean, most] = [error.mean, error.most].map(|length| length * 1e3);
        format!("{mean:.4} mm mean, {most:.4} mm at most")
    });
    text.push_str(&format!(
        "# error that is left with this list: {after}; nothing entered: {before} ({} {}, against the identified model in the robot's own base; \
         the list holds no base)\n",
        list.wanted.rows.len(),
        export.poses_said()
    ));
    text.extend(base);
    text.push_str(
        "# solved anew, all else nominal; true position = factor * commanded + zero (+ coupling * the other joint); sigma is one standard deviation\n",
    );
    text.push_str("quantity,where,value,unit,sigma,status\n");
    text.extend(list.lines());
    text.push_str(&list.tool_lines(export));
    Ok(text)
}

/// A number of the list, and what the numbers of the controller are by it.
struct Share {
    /// Among those that were solved.
    position: usize,
    status: &'static str,
    /// SI.
    value: f64,
    /// By a unit of the number.
    by: JointDeviation,
}

/// What the list is solved for.
struct ControllerList<'a> {
    identified: &'a IdentifiedModel,
    /// Joints' numbers in the robot file's counting.
    entries: Vec<DeviationEntry>,
    wanted: WantedPoints,
    /// The entries, then three coordinates of each target.
    solved: EnteredNumbers,
    /// Entering nothing, and with the list, where the base is fitted anew.
    anew: Option<[PointError; 2]>,
}

impl<'a> ControllerList<'a> {
    fn of(export: &'a Export) -> Self {
        let (identified, data) = (&export.identified, &export.data);
        let robot = &identified.model.robot;
        let wanted = WantedPoints::of(&identified.model, data);
        let rows = identified.parameters.0.iter();
        let entries: Vec<DeviationEntry> = rows
            .filter_map(|row| DeviationEntry::of(&row.effect, &row.place))
            .collect();
        let targets = robot.setup().targets.len().max(1);
        let joints = robot.joints();
        let predicted = |values: &[f64]| -> Vec<Vector3<f64>> {
            let (numbers, tools) = values.split_at(entries.len());
            let mut deviation = JointDeviation::none(joints);
            for (entry, value) in entries.iter().zip(numbers) {
                deviation.add(*entry, *value);
            }
            let point = |row: &usize| {
                let target = robot.setup().target(data.target(*row)).unwrap_or(0);
                let tool = Vector3::from_column_slice(&tools[3 * target..3 * target + 3]);
                let mounting = robot.mounting_at(data, *row).translation;
                let q = deviation.applied(data.q(*row));
                robot.last_body(&q).point(&(mounting + tool))
            };
            wanted.rows.iter().map(point).collect()
        };
        let mut tolerances: Vec<f64> = entries
            .iter()
            .map(|entry| tolerance(robot, entry.made()))
            .collect();
        tolerances.extend(vec![tolerance(robot, Made::Tool); 3 * targets]);
        let solved = entered::solve(&tolerances, &wanted, predicted);
        let anew = |values: &[f64]| {
            let points = predicted(values);
            let base = placed(&points, &wanted.points).ok()?;
            let moved: Vec<Vector3<f64>> = points.iter().map(|point| base.point(point)).collect();
            Some(wanted.error(&moved))
        };
        let nothing = anew(&vec![0.0; tolerances.len()]);
        let anew = nothing
            .zip(anew(&solved.values))
            .map(|(nothing, left)| [nothing, left]);
        Self {
            identified,
            entries,
            wanted,
            solved,
            anew,
        }
    }

    /// The numbers of the joints; as a controller counts, one may be of several.
    fn lines(&self) -> Vec<String> {
        let robot = &self.identified.model.robot;
        let convention = self.identified.convention.clone();
        let convention =
            convention.unwrap_or_else(|| JointConvention::of_the_robot_file(robot.joints()));
        let share = |(position, entry): (usize, &DeviationEntry)| Share {
            position,
            status: self.status(position, tolerance(robot, entry.made())),
            value: self.solved.values[position],
            by: JointDeviation::unit(*entry, robot.joints()).counted(&convention),
        };
        let shares: Vec<Share> = self.entries.iter().enumerate().map(share).collect();
        let line = |entry: DeviationEntry| {
            let known = shares.iter().filter(|share| share.by.holds(entry));
            let at_joint: Vec<(&Share, f64)> =
                known.map(|share| (share, share.by.at(entry))).collect();
            if at_joint.is_empty() {
                return None;
            }
            let (quantity, scale, unit, decimals) = shown(entry, robot);
            let values = at_joint.iter().map(|(share, by)| share.value * by);
            let value = values.sum::<f64>() * scale;
            let sigma = self.sigma(&at_joint) * scale;
            let statuses: BTreeSet<&str> = at_joint.iter().map(|(share, _)| share.status).collect();
            let status = statuses.into_iter().collect::<Vec<_>>().join(" and ");
            Some(format!(
                "{quantity},{},{value:.decimals$},{unit},{sigma:.3e},{status}\n",
                entry.place()
            ))
        };
        DeviationEntry::all(robot.joints())
            .filter_map(line)
            .collect()
    }

    /// Whether the poses say what a number is, or its tolerance does.
    fn status(&self, position: usize, tolerance: f64) -> &'static str {
        let sigma = self.solved.covariance[(position, position)].max(0.0).sqrt();
        Determined::of(tolerance, sigma).name()
    }

    /// Standard deviation of a sum of numbers, each times a factor.
    fn sigma(&self, shares: &[(&Share, f64)]) -> f64 {
        let pairs = shares
            .iter()
            .flat_map(|a| shares.iter().map(move |b| (a, b)));
        let part = |((a, by), (b, other)): (&(&Share, f64), &(&Share, f64))| {
            by * other * self.solved.covariance[(a.position, b.position)]
        };
        pairs
            .map(|(a, b)| part((a, b)))
            .sum::<f64>()
            .max(0.0)
            .sqrt()
    }

    /// The tool in the flange's frame, where the robot file or the library of arms knows that.
    fn tool_lines(&self, export: &Export) -> String {
        let robot = &self.identified.model.robot;
        let targets = &robot.setup().targets;
        let (place, nominal) = (
            &self.identified.robot,
            Vector3::from(self.identified.robot.tool),
        );
        let flange = export.flange();
        let (frame, said) = match &flange {
            Some((frame, said)) => (*frame, format!("frame of the flange, {said}")),
            None => (
                Pose::identity(),
                "base frame at the zero pose: the robot file knows no flange".into(),
            ),
        };
        let number = match targets.is_empty() {
            true => Some(0),
            false => robot.setup().target(""),
        };
        let Some(number) = number else {
            return format!(
                "# not carried: where targets sit; the tool of {} stays as it is\n",
                one_line(&place.name)
            );
        };
        let at = self.entries.len() + 3 * number;
        let off = Vector3::from_column_slice(&self.solved.values[at..at + 3]);
        let turn = frame.rotation.transpose();
        let covariance = self.solved.covariance.fixed_view::<3, 3>(at, at);
        let covariance = turn * covariance * frame.rotation;
        let inverse = frame.inverse();
        let [now, was] = [nominal + off, nominal].map(|point| inverse.point(&point) * 1e3);
        let mut out = format!("# tool: {said}; its turn (A, B, C) stays as it is\n");
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            out.push_str(&format!(
                "tool {axis},tool,{:.6},mm,{:.3e},was {:.6}\n",
                now[k],
                covariance[(k, k)].max(0.0).sqrt() * 1e3,
                was[k]
            ));
        }
        out
    }
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

    /// What of the arm it is.
    fn made(self) -> Made {
        match self {
            Self::Zero(_) => Made::Zero,
            Self::Factor(_) => Made::Ratio,
            Self::Coupling { .. } => Made::Coupling,
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
    fn none(joints: usize) -> Self {
        Self(DMatrix::zeros(joints, joints + 1))
    }

    /// One number of 1, all others 0, in the robot file's counting.
    fn unit(entry: DeviationEntry, joints: usize) -> Self {
        let mut out = Self::none(joints);
        out.add(entry, 1.0);
        out
    }

    fn add(&mut self, entry: DeviationEntry, value: f64) {
        let place = self.place(entry);
        self.0[place] += value;
    }

    /// Where joints that were commanded to `q` stand.
    fn applied(&self, q: &[f64]) -> Vec<f64> {
        let one = |(joint, at): (usize, &f64)| {
            let row = self.0.row(joint);
            let slope: f64 = q.iter().zip(row.iter()).map(|(q, by)| q * by).sum();
            at + slope + row[q.len()]
        };
        q.iter().enumerate().map(one).collect()
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

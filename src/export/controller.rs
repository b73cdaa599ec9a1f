//! What most controllers let one enter, as a list: zeros, ratios, couplings, the tool.

use super::{Export, Format};
use crate::effect::Place;
use crate::error::Result;
use crate::robot::JointConvention;
use crate::units::Unit;
use nalgebra::DMatrix;

pub(super) struct Controller;

impl Format for Controller {
    fn name(&self) -> &'static str {
        "controller"
    }

    fn help(&self) -> &'static str {
        "Joint zeros, ratios, couplings and tool, as a list, as the controller counts its joints"
    }

    fn text(&self, export: &Export) -> Result<String> {
        let mut text: String = export.remarks().iter().map(|line| format!("# {line}\n")).collect();
        text.push_str(
            "# true position = factor * commanded + zero (+ coupling * the other joint); sigma is one standard deviation\n",
        );
        text.push_str("quantity,where,value,unit,sigma,status\n");
        let convention = export.identified.convention.as_ref().filter(|convention| !convention.is_of_the_robot_file());
        match convention {
            None => text.extend(as_identified(export)),
            Some(convention) => text.extend(as_counted(export, convention)),
        }
        for (axis, (now, nominal)) in ["x", "y", "z"].iter().zip(export.corrected.tool.iter().zip(&export.identified.robot.tool))
        {
            text.push_str(&format!("tool {axis} (zero pose; base frame),tool,{:.6},mm,,was {:.6}\n", now * 1e3, nominal * 1e3));
        }
        Ok(text)
    }
}

/// The parameters themselves: the controller counts as the robot file does.
fn as_identified(export: &Export) -> Vec<String> {
    let rows = export.identified.parameters.0.iter().filter_map(|row| {
        let quantity = match row.effect.as_str() {
            "joint_offset" => "zero",
            "reduction_ratio" => "factor - 1",
            "coupling_ratio" => "coupling",
            _ => return None,
        };
        // People enter degrees.
        let (scale, unit) = if row.unit == "rad" { (180.0 / std::f64::consts::PI, "deg") } else { (1.0, row.unit.as_str()) };
        let sigma = row.sigma.map(|sigma| format!("{:.3e}", sigma * scale)).unwrap_or_default();
        Some(format!("{quantity},{},{:.9},{unit},{sigma},{}\n", row.place, row.value * scale, row.status))
    });
    rows.collect()
}

/// Joint positions as an affine map of the commanded ones, less these: q_true - q = slope q + zero, SI.
#[derive(Clone)]
struct Deviation {
    slope: DMatrix<f64>,
    zero: Vec<f64>,
}

impl Deviation {
    fn none(joints: usize) -> Self {
        Self { slope: DMatrix::zeros(joints, joints), zero: vec![0.0; joints] }
    }

    /// Adds `value` (SI) of a parameter; false where it belongs to no such map.
    fn add(&mut self, effect: &str, place: &str, value: f64) -> bool {
        match (effect, place.parse()) {
            ("joint_offset", Ok(Place::Joint(joint))) => self.zero[joint] += value,
            ("reduction_ratio", Ok(Place::Joint(joint))) => self.slope[(joint, joint)] += value,
            ("coupling_ratio", Ok(Place::Coupled(by, moved))) => self.slope[(moved, by)] += value,
            _ => return false,
        }
        true
    }

    /// The same map in the controller's numbers c: with q = A (c - z), c_true - c = A^-1 slope A (c - z) + A^-1 zero.
    fn counted(&self, convention: &JointConvention) -> Self {
        let n = self.zero.len();
        let zero = convention.zero();
        let linear = |there: bool| {
            let mut out = DMatrix::zeros(n, n);
            for joint in 0..n {
                let mut unit: Vec<f64> = zero.to_vec();
                if there {
                    unit[joint] += 1.0;
                    convention.to_robot(&mut unit);
                } else {
                    unit = vec![0.0; n];
                    unit[joint] = 1.0;
                    convention.to_controller(&mut unit);
                    unit.iter_mut().zip(zero).for_each(|(value, zero)| *value -= zero);
                }
                out.column_mut(joint).copy_from_slice(&unit);
            }
            out
        };
        let back = linear(false);
        let slope = &back * &self.slope * linear(true);
        let shown = nalgebra::DVector::from_column_slice(zero);
        let own = nalgebra::DVector::from_column_slice(&self.zero);
        let zero = back * own - &slope * shown;
        Self { slope, zero: zero.as_slice().to_vec() }
    }

    fn numbers(&self) -> Vec<f64> {
        self.zero.iter().chain(self.slope.iter()).copied().collect()
    }
}

/// The same map in the controller's numbers: a number may then be of several parameters.
fn as_counted(export: &Export, convention: &JointConvention) -> Vec<String> {
    let identified = &export.identified;
    let robot = &identified.model.robot;
    let n = robot.joints();
    let mut whole = Deviation::none(n);
    // Each number by a unit of each parameter, to carry the uncertainty.
    let mut by_parameter: Vec<(usize, &str, Option<f64>, Vec<f64>)> = Vec::new();
    let specs = identified.model.stack.specs();
    for row in &identified.parameters.0 {
        let unit = Unit::parse(&row.unit).unwrap_or(Unit::One);
        let mut one = Deviation::none(n);
        if !one.add(&row.effect, &row.place, 1.0) {
            continue;
        }
        whole.add(&row.effect, &row.place, unit.to_si(row.value));
        let at = specs.iter().position(|spec| spec.name == row.name).unwrap_or(usize::MAX);
        by_parameter.push((at, &row.status, row.sigma.map(|sigma| unit.to_si(sigma)), one.counted(convention).numbers()));
    }
    let whole = whole.counted(convention);
    let sigma_of = |number: usize| -> Option<f64> {
        let moved = by_parameter.iter().filter(|(.., by)| by[number] != 0.0).collect::<Vec<_>>();
        if let [(_, _, sigma, by)] = moved[..] {
            return sigma.map(|sigma| sigma * by[number].abs());
        }
        let covariance = identified.covariance.as_ref()?;
        let by = |at: usize| moved.iter().find(|(own, ..)| *own == at).map_or(0.0, |(.., by)| by[number]);
        let twice = |(a, b, value, _): (usize, usize, f64, f64)| by(a) * by(b) * value * if a == b { 1.0 } else { 2.0 };
        Some(covariance.pairs().map(twice).sum::<f64>().sqrt())
    };
    let status = |number: usize| {
        let mut all: Vec<&str> =
            by_parameter.iter().filter(|(.., by)| by[number] != 0.0).map(|(_, status, ..)| *status).collect();
        all.dedup();
        all.join(" and ")
    };
    let angle = |joint: usize| if robot.is_revolute(joint) { (Unit::Degree, "deg") } else { (Unit::Millimetre, "mm") };
    let line = |quantity: &str, place: String, number: usize, value: f64, unit: (Unit, &str)| {
        let sigma = sigma_of(number).map(|sigma| format!("{:.3e}", unit.0.from_si(sigma))).unwrap_or_default();
        format!("{quantity},{place},{:.9},{},{sigma},{}\n", unit.0.from_si(value), unit.1, status(number))
    };
    let mut lines = Vec::new();
    let told = |number: usize| by_parameter.iter().any(|(.., by)| by[number] != 0.0);
    for joint in (0..n).filter(|joint| told(*joint)) {
        lines.push(line("zero", Place::Joint(joint).to_string(), joint, whole.zero[joint], angle(joint)));
    }
    let entries = (0..n).flat_map(|by| (0..n).map(move |moved| (moved, by)));
    for (moved, by) in entries.filter(|(moved, by)| told(n + by * n + moved)) {
        let number = n + by * n + moved;
        let (quantity, place) =
            if moved == by { ("factor - 1", Place::Joint(by)) } else { ("coupling", Place::Coupled(by, moved)) };
        lines.push(line(quantity, place.to_string(), number, whole.slope[(moved, by)], (Unit::One, "1")));
    }
    lines
}

//! Makers of controllers that count joints each in their way, and a simulated robot recorded and identified in a way of theirs.

use super::true_error::Cell;
use crate::answer::{fed, put};
use calib::robot::{CountedCoupling, JointConvention};
use calib::twin::plan::Point;
use calib::units::Unit;
use std::path::Path;
use tempfile::TempDir;

/// How a controller counts, deg: c = sign * (q, couplings added) + zero.
pub struct Maker {
    pub name: &'static str,
    pub sign: [f64; 6],
    zero: [f64; 6],
    /// Joint, by, ratio; from 1.
    coupled: &'static [(usize, usize, f64)],
}

pub const PLAIN: Maker = Maker {
    name: "robot file",
    sign: [1.0; 6],
    zero: [0.0; 6],
    coupled: &[],
};

pub fn makers() -> Vec<Maker> {
    let mut all: Vec<Maker> = (0..6)
        .map(|joint| {
            let mut sign = [1.0; 6];
            sign[joint] = -1.0;
            Maker {
                name: ["sign 1", "sign 2", "sign 3", "sign 4", "sign 5", "sign 6"][joint],
                sign,
                ..PLAIN
            }
        })
        .collect();
    let swivel = [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0];
    all.push(Maker {
        name: "signs 1, 4, 6",
        sign: swivel,
        ..PLAIN
    });
    all.push(Maker {
        name: "zeros",
        zero: [0.0, -90.0, 90.0, 0.0, 12.5, 180.0],
        ..PLAIN
    });
    all.push(Maker {
        name: "coupled",
        coupled: &[(3, 2, -1.0), (6, 5, 0.5)],
        ..PLAIN
    });
    // As KUKA, ABB (a parallelogram) and FANUC (joint 3 against the horizon) count an upright arm.
    all.push(Maker {
        name: "KUKA",
        sign: swivel,
        zero: [0.0, -90.0, 90.0, 0.0, 0.0, 0.0],
        ..PLAIN
    });
    all.push(Maker {
        name: "ABB, parallelogram",
        coupled: &[(3, 2, 1.0)],
        ..PLAIN
    });
    all.push(Maker {
        name: "FANUC",
        sign: [1.0, 1.0, -1.0, -1.0, 1.0, -1.0],
        coupled: &[(3, 2, -1.0)],
        ..PLAIN
    });
    let zero = [10.0, -90.0, 90.0, 30.0, -45.0, 180.0];
    all.push(Maker {
        name: "all at once",
        sign: swivel,
        zero,
        coupled: &[(3, 2, -1.0), (6, 5, 0.5)],
    });
    all
}

/// Those of these names, the robot file's counting among them.
pub fn makers_of(names: &[&str]) -> Vec<Maker> {
    let all = std::iter::once(PLAIN).chain(makers());
    all.filter(|maker| names.contains(&maker.name)).collect()
}

impl Maker {
    /// A motion of KRL to these joints.
    pub fn ptp(&self, q: &[f64]) -> String {
        let counted = self.counted(q).into_iter().zip(1..);
        let named: Vec<String> = counted.map(|(c, j)| format!("A{j} {c:.9}")).collect();
        format!("PTP {{{}}}\n", named.join(","))
    }

    /// Whether no joint is within 5 deg of the border of a quadrant.
    pub fn is_clear(&self, q: &[f64]) -> bool {
        let numbers = self.counted(q);
        let off = |c: &f64| (5.0..85.0).contains(&c.rem_euclid(90.0));
        numbers.iter().all(off)
    }

    pub fn counted(&self, q: &[f64]) -> Vec<f64> {
        let ours: Vec<f64> = q.iter().map(|q| q.to_degrees()).collect();
        let held = |joint| self.held(joint, &ours);
        (0..6)
            .map(|joint| self.sign[joint] * (ours[joint] + held(joint)) + self.zero[joint])
            .collect()
    }

    /// What the controller's numbers (deg) make of the joints, rad: no joint that is in another one's number holds a third.
    pub fn driven(&self, numbers: &[f64]) -> Vec<f64> {
        let plain: Vec<f64> = (0..6)
            .map(|joint| self.sign[joint] * (numbers[joint] - self.zero[joint]))
            .collect();
        (0..6)
            .map(|joint| (plain[joint] - self.held(joint, &plain)).to_radians())
            .collect()
    }

    pub fn convention(&self) -> JointConvention {
        let coupled = self
            .coupled
            .iter()
            .map(|(joint, by, ratio)| CountedCoupling {
                joint: joint - 1,
                by: by - 1,
                ratio: *ratio,
            });
        JointConvention::new(
            self.sign.to_vec(),
            self.zero.map(f64::to_radians).to_vec(),
            coupled.collect(),
        )
    }

    /// What of the other joints is in the number of one.
    fn held(&self, joint: usize, values: &[f64]) -> f64 {
        let parts = self
            .coupled
            .iter()
            .filter(|(moved, ..)| *moved == joint + 1);
        parts.map(|(_, by, ratio)| ratio * values[by - 1]).sum()
    }

    fn settings(&self) -> String {
        let coupled = self
            .coupled
            .iter()
            .map(|(joint, by, ratio)| format!("{{joint: {joint}, by: {by}, ratio: {ratio}}}"));
        format!(
            "sign: {:?}, zero: {:?}, coupled: [{}]",
            self.sign,
            self.zero,
            coupled.collect::<Vec<_>>().join(", ")
        )
    }
}

/// The pipeline's end of most recordings.
pub const IDENTIFY: &str = "  - uses: identify\n    with: {on: [fit]}\n";

/// A folder with a run of the cell as its maker counts: a recording of the points, then `stages`.
pub fn recorded(
    maker: &Maker,
    cell: &Cell,
    points: &[Point],
    robot: &str,
    stages: &str,
) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", robot);
    let recorded = cell.recorded_by(points.to_vec(), 77).recording;
    let rows = points
        .iter()
        .zip(&recorded.position)
        .enumerate()
        .map(|(k, (point, position))| {
            let numbers = maker
                .counted(&point.q)
                .iter()
                .map(|c| format!("{c:.9}"))
                .collect::<Vec<_>>()
                .join(",");
            let [x, y, z] = position.map(|x| Unit::Millimetre.from_si(x));
            format!("P{k},{numbers},{},{x:.6},{y:.6},{z:.6}\n", point.payload_kg)
        });
    let header = "id,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,kg,x,y,z\n";
    put(
        here,
        "log.csv",
        header.to_string() + &rows.collect::<String>(),
    );
    let q = format!(
        "{{column: \"q{{j}}_deg\", unit: deg, {}}}",
        maker.settings()
    );
    let pipeline = format!(
        "calib: 1\nname: counted\nseed: 3\nstages:\n  - uses: robot\n    with: {{file: robot.yaml}}\n  - uses: ingest\n    with:\n      files:\n        - file: log.csv\n          columns:\n            point_id: {{column: id}}\n            usage: {{value: fit}}\n            q: {q}\n            payload: {{column: kg, unit: kg}}\n            x: {{column: x, unit: mm}}\n            y: {{column: y, unit: mm}}\n            z: {{column: z, unit: mm}}\n      instrument: leica_at960\n  - uses: split\n    with: {{by: usage}}\n{stages}"
    );
    put(here, "pipeline.yaml", pipeline);
    ran(here, "run pipeline.yaml --quiet", "");
    folder
}

pub fn ran(here: &Path, arguments: &str, input: &str) -> String {
    let output = fed(here, arguments, input).code(0);
    output.out
}

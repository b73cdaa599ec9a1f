//! The practice layout `robot.json`: axes, points, masses and centres at the zero pose in the base frame, in mm, kg, kg m2 and Nm/A.

use super::inertia::outside_link;
use super::kinematics::direction;
use super::place::{DocumentNode, Faults};
use super::{Imported, RobotFileText, inertia};
use crate::description::{
    Coupling, DeclaredInertias, JointDescription, JointKind, RobotDescription,
};
use crate::error::Result;
use crate::robot::Bound;
use crate::units::Unit;
use nalgebra::{Point3, Vector3};

const KEYS: [&str; 19] = [
    "name",
    "axes",
    "points",
    "tool",
    "mass",
    "com",
    "inertia",
    "ratio",
    "kt",
    "payload",
    "payload_com",
    "payload_inertia",
    "gravity",
    "coupling",
    "inertia_tolerance",
    // What the recording itself shows.
    "signal",
    "encoder_deg",
    "resolution",
    "rate_hz",
];
const TOLERANCE: [&str; 3] = ["mass_rel", "com_mm", "inertia_rel"];

/// Reads a practice `robot.json` (mm, kg, Nm/A; couplings as pairs from 0). Fails with every fault of the file.
pub fn read(file: RobotFileText) -> Result<Imported> {
    let (node, faults) = Faults::parse(file)?;
    let root = DocumentNode::root(&node, &faults).open_map(&KEYS);
    let axes = root.get("axes").items();
    if root.opt("axes").is_some() && axes.is_empty() {
        root.get("axes")
            .fault("no joints; expected at least one axis");
    }
    let n = axes.len();
    let points = root.get("points").per_joint(n);
    let per_joint = |key: &str| {
        root.opt(key)
            .map(|list| list.per_joint(n))
            .unwrap_or_default()
    };
    let (masses, centres, ratios, constants) = (
        per_joint("mass"),
        per_joint("com"),
        per_joint("ratio"),
        per_joint("kt"),
    );
    let number = |list: &[DocumentNode], i: usize| {
        list.get(i)
            .and_then(DocumentNode::given)
            .map(|value| value.sized(Bound::Factor, Unit::One))
    };
    let joints: Vec<JointDescription> = (axes.iter().enumerate())
        .map(|(i, axis)| JointDescription {
            name: format!("J{}", i + 1),
            kind: JointKind::Revolute,
            axis: direction(axis).into(),
            point: points
                .get(i)
                .map_or([f64::NAN; 3], |point| metres(point).into()),
            limits: None,
            reduction_ratio: number(&ratios, i),
            motor_constant: number(&constants, i),
            mass: masses
                .get(i)
                .and_then(DocumentNode::given)
                .map(DocumentNode::not_negative),
            centre: centres
                .get(i)
                .and_then(DocumentNode::given)
                .map(|centre| metres(centre).into()),
            coulomb: None,
        })
        .collect();
    let tool = metres(&root.get("tool"));
    let offset = root
        .opt("payload_com")
        .map_or_else(Vector3::zeros, |offset| metres(&offset).coords);
    let reached = joints.iter().map(|joint| Vector3::from(joint.point));
    let reached: Vec<_> = reached.chain([tool.coords]).collect();
    for (link, (joint, centre)) in joints.iter().zip(&centres).enumerate() {
        let place = joint.centre.map(Vector3::from);
        if let Some(message) = place.and_then(|place| outside_link(&place, link, &reached)) {
            centre.fault(message);
        }
    }
    let robot = RobotDescription {
        name: root
            .opt("name")
            .map_or_else(|| "robot".into(), |name| name.text()),
        joints,
        tool: tool.into(),
        tool_rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        couplings: root
            .opt("coupling")
            .map_or_else(Vec::new, |list| couplings(list, n)),
        payload_mass: root.opt("payload").map_or(0.0, |mass| mass.not_negative()),
        payload_centre: (tool + offset).into(),
        gravity: root.opt("gravity").map_or(super::GRAVITY, super::gravity),
        inertias: DeclaredInertias {
            links: per_joint("inertia")
                .iter()
                .map(|value| value.given().cloned().map(inertia::moments))
                .collect(),
            payload: root.opt("payload_inertia").map(inertia::moments),
            tolerance: root
                .opt("inertia_tolerance")
                .map(|value| inertia::tolerance(value, TOLERANCE, Unit::Millimetre)),
        },
        tolerances: Default::default(),
    };
    let unused = root.keys().filter(|key| !KEYS.contains(key));
    let mut notes: Vec<String> = unused
        .map(|key| format!("{}: the key `{key}` is not used", file.label))
        .collect();
    notes.extend(faults.finish()?);
    Ok(Imported {
        flange: None,
        robot,
        notes,
        about: super::About::default(),
    })
}

fn metres(value: &DocumentNode) -> Point3<f64> {
    Point3::from(value.sized_vector(Bound::Length, Unit::Millimetre))
}

/// Pairs (moved, by) of joints from 0. The layout states no ratio: the controller is taken to add none.
fn couplings(list: DocumentNode, joints: usize) -> Vec<Coupling> {
    let index = |value: f64| (0..joints).find(|j| *j as f64 == value);
    let mut couplings: Vec<_> = (list.items().iter())
        .filter_map(|pair| {
            let [moved, by] = pair.vector::<2>();
            match (index(moved), index(by)) {
                (Some(moved), Some(by)) if moved != by => Some(Coupling { moved, by, ratio: 0.0 }),
                _ => {
                    if !moved.is_nan() && !by.is_nan() {
                        pair.fault(format!("expected two different joints (moved, by) counted from 0, below {joints}"));
                    }
                    None
                }
            }
        })
        .collect();
    couplings.sort_by_key(|c| (c.moved, c.by));
    couplings
}

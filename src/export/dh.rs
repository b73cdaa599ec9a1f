//! DH and modified DH tables as calib's own robot file, so that calib reads back what it wrote.

use super::{CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::error::{Error, Result, one_line};
use crate::estimate::choose::spread;
use crate::robot::import::{RobotFileText, read_calib};
use crate::robot::{DhRow, DhTable, RobotModel};
use crate::yaml::quoted;
use nalgebra::{Rotation3, UnitQuaternion};

/// arcsec: neighbouring axes nearer to parallel than this make a table worth a warning.
const FLAT_ARCSEC: f64 = 3600.0;

/// m: a row farther from its neighbours than this holds no length of an arm, and no controller takes it.
const FARTHEST: f64 = 100.0;

/// Poses at which the table that is read back is compared with the geometry.
const POSES: usize = 500;

pub(super) const DH: Format = Format {
    name: "dh",
    help: "calib's robot file with a Denavit-Hartenberg table",
    comment: "#",
    carries: CarriedTorques::Nothing,
    text: |export| text(export, false),
};

pub(super) const MDH: Format = Format {
    name: "mdh",
    help: "The same with Craig's modified table",
    text: |export| text(export, true),
    ..DH
};

/// The table with what its reader must know, and how well it stands for the corrected geometry when read back.
fn text(export: &Export, modified: bool) -> Result<String> {
    let format = if modified { &MDH } else { &DH };
    if !export.insisted {
        refuse_far(
            &DhTable::of(&RobotModel::new(export.corrected.clone())),
            &export.identified.origin,
        )?;
    }
    let body = body(export, modified);
    let back = read_calib(
        RobotFileText {
            label: "exported table",
            text: &body,
        },
        None,
    )?
    .robot;
    let (now, then) = (
        RobotModel::new(back),
        RobotModel::new(export.corrected.clone()),
    );
    let poses = spread(&then, POSES);
    let apart = (0..poses.rows()).map(|row| {
        (now.forward(poses.q(row)).translation - then.forward(poses.q(row)).translation).norm()
    });
    let most = apart.fold(0.0, f64::max) * 1e3;
    let mut out: String = export.head(format);
    out.push_str(&format!(
        "# conversion to this table: {most:.1e} mm at most over {} poses\n",
        poses.rows()
    ));
    out.push_str("# masses, payload and couplings are not part of it: they stand in the original robot file\n");
    Ok(out + &body)
}

/// Refuses a table whose rows are far from the arm: neighbouring axes nearly parallel have their common normal there.
fn refuse_far(rows: &DhTable, place: &str) -> Result<()> {
    let far = |row: &&DhRow| row.d.abs() > FARTHEST || row.a.abs() > FARTHEST;
    let Some(row) = std::iter::once(&rows.base).chain(&rows.joints).find(far) else {
        return Ok(());
    };
    let pair = rows.flattest().map_or(String::new(), |(joint, angle)| {
        format!(
            " (axes {} and {} are {:.1} arcsec from parallel)",
            joint + 1,
            joint + 2,
            angle.to_degrees() * 3600.0
        )
    });
    let message = format!(
        "a Denavit-Hartenberg table of this arm has d = {:.0} mm, a = {:.0} mm{pair}: take --format urdf or mjcf, which carry such axes, or insist with --force",
        mm(row.d),
        mm(row.a)
    );
    Err(Error::data(place, message))
}

fn body(export: &Export, modified: bool) -> String {
    let robot = &export.corrected;
    let rows = DhTable::of(&RobotModel::new(robot.clone()));
    let mut out = String::new();
    if let Some((joint, angle)) = rows
        .flattest()
        .filter(|(_, angle)| angle.to_degrees() * 3600.0 < FLAT_ARCSEC)
    {
        out.push_str(&format!(
            "# axes {} and {} are {:.0} arcsec from parallel: their common normal, and with it d, is far from the arm (the table is exact all the same)\n",
            joint + 1,
            joint + 2,
            angle.to_degrees() * 3600.0
        ));
    }
    out.push_str("calib_robot: 1\n");
    out.push_str(&format!("name: {}\n", quoted(&one_line(&robot.name))));
    out.push_str("units: {length: mm, angle: deg}\n");
    out.push_str(&format!(
        "kinematics:\n  {}:\n",
        if modified { "mdh" } else { "dh" }
    ));
    let kind = |joint: usize| {
        if robot.joints[joint].kind == JointKind::Prismatic {
            ", kind: prismatic"
        } else {
            ""
        }
    };
    if modified {
        let DhRow { theta, d, .. } = rows.base;
        out.push_str(&line(
            &[
                ("alpha", 0.0),
                ("a", 0.0),
                ("theta", deg(theta)),
                ("d", mm(d)),
            ],
            ", kind: fixed",
        ));
        let mut before = rows.base;
        for (joint, row) in rows.joints.iter().enumerate() {
            let numbers = [
                ("alpha", deg(before.alpha)),
                ("a", mm(before.a)),
                ("theta", deg(row.theta)),
                ("d", mm(row.d)),
            ];
            out.push_str(&line(&numbers, kind(joint)));
            before = *row;
        }
    } else {
        let numbers = |row: &DhRow| {
            [
                ("theta", deg(row.theta)),
                ("d", mm(row.d)),
                ("a", mm(row.a)),
                ("alpha", deg(row.alpha)),
            ]
        };
        out.push_str(&line(&numbers(&rows.base), ", kind: fixed"));
        for (joint, row) in rows.joints.iter().enumerate() {
            out.push_str(&line(&numbers(row), kind(joint)));
        }
    }
    let [x, y, z]: [f64; 3] = rows.tool.translation.map(mm).into();
    let turn =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows.tool.rotation));
    out.push_str(&format!(
        "tool: {{point: [{x:?}, {y:?}, {z:?}], orientation: {{quaternion: [{:?}, {:?}, {:?}, {:?}]}}}}\n",
        turn.w, turn.i, turn.j, turn.k
    ));
    out.push_str("joints:\n");
    for joint in &robot.joints {
        let scale = if joint.kind == JointKind::Prismatic {
            mm
        } else {
            deg
        };
        let limits = joint
            .limits
            .map(|[lower, upper]| format!(", limits: [{:?}, {:?}]", scale(lower), scale(upper)));
        let ratio = joint
            .reduction_ratio
            .map(|ratio| format!(", reduction_ratio: {ratio:?}"));
        let constant = joint
            .motor_constant
            .map(|constant| format!(", motor_constant: {constant:?}"));
        let more: String = [limits, ratio, constant].into_iter().flatten().collect();
        out.push_str(&format!(
            "  - {{name: {}{more}}}\n",
            quoted(&one_line(&joint.name))
        ));
    }
    out
}

fn line(numbers: &[(&str, f64)], more: &str) -> String {
    let cells: Vec<String> = numbers
        .iter()
        .map(|(name, value)| format!("{name}: {value:?}"))
        .collect();
    format!("    - {{{}{more}}}\n", cells.join(", "))
}

fn mm(metres: f64) -> f64 {
    metres * 1e3
}

fn deg(radians: f64) -> f64 {
    radians.to_degrees()
}

//! DH and modified DH tables as calib's own robot file, so that calib reads back what it wrote.

use super::{CarriedGeometry, CarriedTorques, Export, Format};
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
    geometry: CarriedGeometry::Rigid,
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
    export.refuse_worse()?;
    let then = RobotModel::new(export.corrected.clone());
    let table = DhTable::of(&then);
    if !export.insisted {
        refuse_far(&table, &export.identified.origin)?;
    }
    let body = body(export, &table, modified);
    let (label, text) = ("exported table", body.as_str());
    let now = RobotModel::new(read_calib(RobotFileText { label, text }, None)?.robot);
    let poses = spread(&then, POSES);
    let apart = (0..poses.rows()).map(|row| {
        let point = |robot: &RobotModel| robot.forward(poses.q(row)).translation;
        (point(&now) - point(&then)).norm()
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

fn body(export: &Export, rows: &DhTable, modified: bool) -> String {
    let robot = &export.corrected;
    let mut out = String::new();
    let flattest = rows
        .flattest()
        .map(|(joint, angle)| (joint, angle.to_degrees() * 3600.0));
    if let Some((joint, arcsec)) = flattest.filter(|(_, arcsec)| *arcsec < FLAT_ARCSEC) {
        let (first, second) = (joint + 1, joint + 2);
        out += &format!(
            "# axes {first} and {second} are {arcsec:.0} arcsec from parallel: their common normal, and with it d, is far from the arm (the table is exact all the same)\n"
        );
    }
    let (name, kind) = (
        quoted(&one_line(&robot.name)),
        if modified { "mdh" } else { "dh" },
    );
    out += &format!(
        "calib_robot: 1\nname: {name}\nunits: {{length: mm, angle: deg}}\nkinematics:\n  {kind}:\n"
    );
    // The base stands before the joints, fixed; a modified row turns and shifts about the x axis of the row before.
    let kinds = robot.joints.iter().map(|joint| match joint.kind {
        JointKind::Prismatic => ", kind: prismatic",
        JointKind::Revolute => "",
    });
    let all = std::iter::once((&rows.base, ", kind: fixed")).chain(rows.joints.iter().zip(kinds));
    let mut before = [("alpha", 0.0), ("a", 0.0)];
    for (row, more) in all {
        let (turn, d) = (("theta", deg(row.theta)), ("d", mm(row.d)));
        let [a, alpha] = [("a", mm(row.a)), ("alpha", deg(row.alpha))];
        out += &match modified {
            true => line(&[before[0], before[1], turn, d], more),
            false => line(&[turn, d, a, alpha], more),
        };
        before = [alpha, a];
    }
    let [x, y, z]: [f64; 3] = rows.tool.translation.map(mm).into();
    let turn =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows.tool.rotation));
    out.push_str(&format!(
        "tool: {{point: [{x:?}, {y:?}, {z:?}], orientation: {{quaternion: [{:?}, {:?}, {:?}, {:?}]}}}}\n",
        turn.w, turn.i, turn.j, turn.k
    ));
    out += "joints:\n";
    for joint in &robot.joints {
        let scale = match joint.kind {
            JointKind::Prismatic => mm,
            JointKind::Revolute => deg,
        };
        let limits = joint.limits.map(|limits| limits.map(scale));
        let more = [
            limits.map(|limits| format!(", limits: {limits:?}")),
            joint
                .reduction_ratio
                .map(|ratio| format!(", reduction_ratio: {ratio:?}")),
            joint
                .motor_constant
                .map(|constant| format!(", motor_constant: {constant:?}")),
        ];
        let (name, more) = (quoted(&one_line(&joint.name)), more.into_iter().flatten());
        out += &format!("  - {{name: {name}{}}}\n", more.collect::<String>());
    }
    out
}

fn line(numbers: &[(&str, f64)], more: &str) -> String {
    let cells = numbers
        .iter()
        .map(|(name, value)| format!("{name}: {value:?}"));
    let cells: Vec<String> = cells.collect();
    format!("    - {{{}{more}}}\n", cells.join(", "))
}

fn mm(metres: f64) -> f64 {
    metres * 1e3
}

fn deg(radians: f64) -> f64 {
    radians.to_degrees()
}

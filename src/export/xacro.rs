//! An include for the arm's own description: corrected origins of its joints, in its own frames, and nothing else; meshes, limits and
//! inertials stay where they are.

use super::body::{self, moved, numbers, origin, tool};
use super::own_urdf::OwnUrdf;
use super::{CarriedGeometry, CarriedTorques, Export, Format};
use crate::error::{Error, Result, one_line};
use crate::spatial::Pose;
use minijinja::context;
use nalgebra::Vector3;

pub(super) const XACRO: Format = Format {
    name: "xacro",
    help: "An include with the corrected origins of the joints of the arm's own URDF",
    comment: "<!--",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::Nothing,
    text,
};

fn text(export: &Export) -> Result<String> {
    let own = OwnUrdf::of(export)?.ok_or_else(|| {
        let message = "no URDF stands behind this model; allowed: a robot file with `kinematics: {urdf: ...}`, or --format urdf, which writes a whole arm";
        Error::data(&export.identified.origin, message)
    })?;
    let origins = origins(export, &own).ok_or_else(|| {
        let message = "joints whose names hold other signs than letters, digits and _-./ cannot be written into a xacro expression";
        Error::data(&own.file, message)
    })?;
    let mut remarks = export.remarks_in(&XACRO);
    remarks.push(format!(
        "in {}: include this file, and in each joint below have",
        own.file
    ));
    remarks.push("<xacro:calib_origin joint=\"NAME\"/> in the place of its <origin .../>".into());
    remarks.push(origins.tool.clone());
    let quoted =
        |[place, turn]: &[[f64; 3]; 2]| format!("('{}', '{}')", numbers(*place), numbers(*turn));
    let joints = origins.joints.iter();
    let all = joints.map(|(name, origin)| format!("('{name}', {})", quoted(origin)));
    let all: Vec<String> = all.collect();
    // xacro ends an expression at the first brace.
    let origins = format!("${{dict([{}])}}", all.join(", "));
    body::document(&remarks, include_str!("xacro.xml"), context! { origins })
}

struct Origins {
    /// Name of each moving joint, place and turn.
    joints: Vec<(String, [[f64; 3]; 2])>,
    /// The remark on the tool.
    tool: String,
}

/// The corrected origins of the moving joints; none where a name cannot be written.
fn origins(export: &Export, own: &OwnUrdf) -> Option<Origins> {
    let robot = &export.corrected;
    let (mut nominal, mut corrected) = (Pose::identity(), Pose::identity());
    let mut joints = Vec::new();
    for (joint, now) in own.joints.iter().zip(&robot.joints) {
        let placed = moved(&joint.frame, &joint.axis, now);
        // Links in between hang on the one before as they did.
        let parent = corrected * nominal.inverse() * joint.parent_frame;
        let (place, turn) = origin(&parent, &placed);
        // Names stand in an expression between quotes.
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./ ".contains(c);
        let plain = joint.name.chars().all(is_plain);
        joints.push((plain.then(|| joint.name.clone())?, [place, turn]));
        (nominal, corrected) = (joint.frame, placed);
    }
    let (place, turn) = origin(&corrected, &tool(robot.tool, &robot.tool_rotation));
    let last = own.joints.last()?;
    let tool = format!(
        "not carried: the measured point, {:.4} mm from the frame of {}: there it stands at {} m, turned by {} rad",
        1e3 * Vector3::from(place).norm(),
        one_line(&last.child),
        numbers(place),
        numbers(turn)
    );
    Some(Origins { joints, tool })
}

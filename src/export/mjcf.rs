//! MJCF, MuJoCo's own format: every body's frame parallel to the base at the zero pose and on its joint's axis, so that no angle is
//! converted and a joint at 0 is the robot at 0. The measured point is a site.

use super::body::{self, Xml, empty, numbers, offset};
use super::friction::{ARMATURE, DAMPING, DRIVE, FRICTION, SPRINGS, gear, positive, spring};
use super::{CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::error::{Result, one_line};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::io;

/// Mass, kg, and inertia, kg m2, that no body has less of: MuJoCo refuses moving bodies without.
const LEAST: [(&str, &str); 2] = [("boundmass", "0.001"), ("boundinertia", "1e-6")];

pub(super) const MJCF: Format = Format {
    name: "mjcf",
    help: "MuJoCo model: bodies and joints at the corrected axes, the tool as a site",
    comment: "<!--",
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION, ARMATURE, DRIVE, SPRINGS[0], SPRINGS[1]]),
    text,
};

fn text(export: &Export) -> Result<String> {
    let robot = &export.corrected;
    let mut remarks = export.remarks_in(&MJCF);
    if !robot.couplings.is_empty() {
        remarks.push(
            "couplings of joints are not part of it: they stand in the original robot file".into(),
        );
    }
    if (0..robot.joints.len()).any(|joint| export.body(joint).is_none()) {
        remarks.push(format!(
            "bodies whose mass is not known have {} kg",
            LEAST[0].1
        ));
    }
    let name = one_line(&robot.name);
    body::document(&remarks, |xml| {
        xml.create_element("mujoco")
            .with_attribute(("model", name.as_str()))
            .write_inner_content(|xml| {
                empty(
                    xml,
                    "compiler",
                    &[&[("angle", "radian")][..], &LEAST].concat(),
                )?;
                empty(xml, "option", &[("gravity", &numbers(robot.gravity))])?;
                xml.create_element("worldbody").write_inner_content(|xml| {
                    let base = xml
                        .create_element("body")
                        .with_attribute(("name", "base_link"));
                    base.write_inner_content(|xml| beyond(xml, export, 0))
                        .map(drop)
                })?;
                drives(xml, export)
            })?;
        Ok(())
    })
}

/// What hangs on the body before joint `index` (from 0): the next body with all behind it, at last the tool.
fn beyond(xml: &mut Xml, export: &Export, index: usize) -> io::Result<()> {
    let robot = &export.corrected;
    let before = index
        .checked_sub(1)
        .map_or([0.0; 3], |before| robot.joints[before].point);
    let Some(joint) = robot.joints.get(index) else {
        let r = &robot.tool_rotation;
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|i, k| r[i][k]));
        let turn = UnitQuaternion::from_rotation_matrix(&rotation);
        let quaternion = numbers([turn.w, turn.i, turn.j, turn.k]);
        return empty(
            xml,
            "site",
            &[
                ("name", "tool0"),
                ("pos", &offset(robot.tool, before)),
                ("quat", &quaternion),
            ],
        );
    };
    let (name, place) = (format!("link_{}", index + 1), offset(joint.point, before));
    let body = xml
        .create_element("body")
        .with_attributes([("name", name.as_str()), ("pos", place.as_str())]);
    body.write_inner_content(|xml| {
        if let Some(body) = export.body(index) {
            body.remark
                .map_or(Ok(()), |remark| body::comment(xml, remark))?;
            let [xx, xy, xz, yy, yz, zz] = body.inertia;
            let inertia = match body.is_placeholder() {
                true => ("diaginertia", numbers([xx, yy, zz])),
                false => ("fullinertia", numbers([xx, yy, zz, xy, xz, yz])),
            };
            let parts = [
                ("pos", numbers(body.centre)),
                ("mass", numbers([body.mass])),
                inertia,
            ];
            empty(
                xml,
                "inertial",
                &parts
                    .each_ref()
                    .map(|(name, value)| (*name, value.as_str())),
            )?;
        }
        hinge(xml, export, index)?;
        beyond(xml, export, index + 1)
    })?;
    Ok(())
}

fn hinge(xml: &mut Xml, export: &Export, index: usize) -> io::Result<()> {
    let joint = &export.corrected.joints[index];
    let (name, axis) = (one_line(&joint.name), numbers(joint.axis));
    let kind = if joint.kind == JointKind::Revolute {
        "hinge"
    } else {
        "slide"
    };
    let mut attributes = vec![
        ("name", name.as_str()),
        ("type", kind),
        ("pos", "0 0 0"),
        ("axis", &axis),
    ];
    let range = joint.limits.map(numbers);
    match &range {
        Some(range) => attributes.extend([("limited", "true"), ("range", range)]),
        None => attributes.push(("limited", "false")),
    }
    let torques = export.identified.torques.as_ref();
    let dynamics = [
        ("damping", DAMPING),
        ("frictionloss", FRICTION),
        ("armature", ARMATURE),
    ];
    let dynamics = dynamics.map(|(name, effect)| {
        (
            name,
            torques.and_then(|torques| positive(torques, effect, index)),
        )
    });
    let spring = torques.and_then(|torques| spring(torques, index));
    let springs = [
        ("stiffness", spring.map(|[stiffness, _]| stiffness)),
        ("springref", spring.map(|[_, rest]| rest)),
    ];
    let dynamics: Vec<(&str, String)> = dynamics
        .into_iter()
        .chain(springs)
        .filter_map(|(name, value)| Some((name, numbers([value?]))))
        .collect();
    attributes.extend(dynamics.iter().map(|(name, value)| (*name, value.as_str())));
    empty(xml, "joint", &attributes)
}

/// A motor for each joint that takes amperes, where torques were identified and the drives are declared.
fn drives(xml: &mut Xml, export: &Export) -> io::Result<()> {
    let Some(torques) = &export.identified.torques else {
        return Ok(());
    };
    let gears: Vec<(String, String)> = (export.corrected.joints.iter().enumerate())
        .filter_map(|(index, joint)| {
            Some((one_line(&joint.name), numbers([gear(torques, index)?])))
        })
        .collect();
    if gears.is_empty() {
        return Ok(());
    }
    xml.create_element("actuator").write_inner_content(|xml| {
        body::comment(xml, "controls are motor currents, A")?;
        gears.iter().try_for_each(|(joint, gear)| {
            empty(
                xml,
                "motor",
                &[
                    ("name", &format!("motor_{joint}")),
                    ("joint", joint),
                    ("gear", gear),
                ],
            )
        })
    })?;
    Ok(())
}

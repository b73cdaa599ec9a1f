//! calib's own robot file: YAML with units, one kinematic format, and what is known of joints, links, payload and gravity.

use super::kinematics::{self, DhConvention};
use super::place::{DocumentNode, Faults};
use super::tolerances::tolerances;
use super::{ChainBody, FrameChain, Imported, RobotFileText, about, inertia, urdf};
use crate::description::{
    Coupling, DeclaredInertias, JointDescription, JointKind, RobotDescription,
};
use crate::error::Result;
use crate::robot::Bound;
use crate::spatial::Pose;
use crate::units::{Quantity, Unit};
use nalgebra::{
    Isometry3, Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3,
};

const FORMAT: f64 = 1.0;
/// m: a point of an axis that is farther from base and tool is nothing that anyone sees at an arm.
const FAR: f64 = 10.0;
const FORMATS: [&str; 4] = ["screws", "dh", "mdh", "urdf"];

#[derive(Clone, Copy)]
struct FileUnits {
    length: Unit,
    angle: Unit,
}

/// Reads calib's robot file; `urdf` is the file that `kinematics.urdf` refers to. Fails with every fault of the file.
pub fn read(file: RobotFileText, urdf: Option<RobotFileText>) -> Result<Imported> {
    let (node, faults) = Faults::parse(file)?;
    let root = DocumentNode::root(&node, &faults).map(&[
        "calib_robot",
        "name",
        "about",
        "units",
        "kinematics",
        "tool",
        "joints",
        "couplings",
        "links",
        "payload",
        "mass_tolerance",
        "tolerances",
        "gravity",
    ]);
    let format = root.get("calib_robot");
    let version = format.number();
    if version.is_finite() && version != FORMAT {
        format.fault(format!(
            "format {version} is not known to this calib; expected {FORMAT}"
        ));
    }
    let units = units(root.get("units").map(&["length", "angle"]));
    let chain = chain(root.get("kinematics").map(&FORMATS), units, urdf, &faults)?;
    let mut notes = chain
        .as_ref()
        .map(|chain| chain.notes.clone())
        .unwrap_or_default();
    let flange = chain.as_ref().and_then(flange);
    let robot = chain.map(|chain| describe(&root, chain, units));
    let about = about(
        root.get("about"),
        robot.as_ref().map_or(0, |robot| robot.joints.len()),
        units.length,
    );
    notes.extend(faults.finish()?);
    notes.extend(robot.iter().flat_map(implausible));
    match robot {
        Some(robot) => Ok(Imported {
            robot,
            notes,
            about,
            flange,
        }),
        None => Err(crate::error::Error::Bug(
            "a robot file without kinematics had no fault".into(),
        )),
    }
}

fn units(value: DocumentNode) -> FileUnits {
    let unit = |key: &str, quantity: Quantity, fallback: Unit| {
        let allowed: Vec<_> = (Unit::symbols(quantity).into_iter())
            .filter_map(|s| Some((s, Unit::parse(s)?)))
            .collect();
        value.get(key).choice(&allowed).unwrap_or(fallback)
    };
    FileUnits {
        length: unit("length", Quantity::Length, Unit::Millimetre),
        angle: unit("angle", Quantity::Angle, Unit::Degree),
    }
}

/// The one kinematic format of the file, or none after a fault.
fn chain(
    value: DocumentNode,
    units: FileUnits,
    urdf: Option<RobotFileText>,
    faults: &Faults,
) -> Result<Option<FrameChain>> {
    let mut given = FORMATS
        .into_iter()
        .filter(|format| value.opt(format).is_some());
    let chain = match (given.next(), given.next()) {
        (Some(_), Some(_)) => {
            value.fault(format!(
                "more than one description of the arm; expected one of {}",
                FORMATS.join(", ")
            ));
            return Ok(None);
        }
        (Some("screws"), _) => kinematics::screws(&value.get("screws"), units.length),
        (Some("dh"), _) => kinematics::dh(
            &value.get("dh"),
            DhConvention::Standard,
            units.length,
            units.angle,
        ),
        (Some("mdh"), _) => kinematics::dh(
            &value.get("mdh"),
            DhConvention::Modified,
            units.length,
            units.angle,
        ),
        (Some(_), _) => {
            let ends = value.get("urdf").map(&["base", "tip"]);
            let (base, tip) = (ends.get("base").text(), ends.get("tip").text());
            let Some(urdf) = urdf else {
                ends.fault("the URDF itself is missing; name it in the pipeline: `with: {file: robot.yaml, urdf: arm.urdf}`");
                return Ok(None);
            };
            if base.is_empty() || tip.is_empty() {
                return Ok(None);
            }
            let Some(chain) = faults.absorb(urdf::read(urdf, &base, &tip))? else {
                return Ok(None);
            };
            chain
        }
        (None, _) => {
            // Faults of a `kinematics` that is no map were noted when it was read.
            if value.given().is_some() && value.keys().all(|key| FORMATS.contains(&key)) {
                value.fault(format!(
                    "no description of the arm; expected one of {}",
                    FORMATS.join(", ")
                ));
            }
            return Ok(None);
        }
    };
    if chain.joints.is_empty() {
        value.fault("no joints; expected at least one");
        return Ok(None);
    }
    Ok(Some(chain))
}

/// Where the last frame of the chain stands, where its format knows frames.
fn flange(chain: &FrameChain) -> Option<Pose> {
    let knows = chain.joints.iter().any(|joint| joint.frame.is_some());
    let turn = chain.tip.rotation.to_rotation_matrix().into_inner();
    knows.then(|| Pose::new(turn, chain.tip.translation.vector))
}

fn describe(root: &DocumentNode, chain: FrameChain, units: FileUnits) -> RobotDescription {
    let tool = tool(root.get("tool"), &chain, units);
    let name = root
        .opt("name")
        .map_or_else(|| "robot".into(), |name| name.text());
    let mut joints: Vec<JointDescription> = (chain.joints.iter().enumerate())
        .map(|(i, joint)| JointDescription {
            name: joint.name.clone().unwrap_or_else(|| format!("J{}", i + 1)),
            kind: joint.kind,
            axis: joint.axis.into(),
            point: joint.point.into(),
            limits: joint.limits,
            reduction_ratio: None,
            motor_constant: None,
            mass: joint.body.as_ref().map(|body| body.mass),
            centre: joint.body.as_ref().map(|body| body.centre.into()),
            coulomb: None,
        })
        .collect();
    if let Some(list) = root.opt("joints") {
        for (joint, value) in joints.iter_mut().zip(list.per_joint(chain.joints.len())) {
            drive(joint, value, units);
        }
    }
    distinct(root, &joints);
    slide(&mut joints, &tool.translation.vector);
    let mut inertias: Vec<_> = chain
        .joints
        .iter()
        .map(|joint| joint.body.as_ref().and_then(|body| body.inertia))
        .collect();
    let points = joints.iter().map(|joint| joint.point);
    let points = points.map(Vector3::from);
    let points: Vec<_> = points.chain([tool.translation.vector]).collect();
    if let Some(list) = root.opt("links") {
        for (i, value) in list
            .per_joint(joints.len())
            .into_iter()
            .enumerate()
            .take(joints.len())
        {
            if value.given().is_some() {
                let place = value.get("centre");
                let body = link(value, chain.joints[i].frame, units);
                if let Some(message) = inertia::outside_link(&body.centre.coords, i, &points) {
                    place.fault(message);
                }
                joints[i].mass = Some(body.mass);
                joints[i].centre = Some(body.centre.into());
                inertias[i] = body.inertia;
            }
        }
    }
    let tolerance = root
        .opt("mass_tolerance")
        .map(|value| inertia::tolerance(value, ["mass", "centre", "inertia"], units.length));
    let couplings = root
        .opt("couplings")
        .map_or_else(Vec::new, |list| couplings(list, joints.len()));
    let ChainBody {
        mass: payload_mass,
        centre: payload_centre,
        inertia: payload_inertia,
    } = payload(root.get("payload"), &tool, units);
    RobotDescription {
        name,
        joints,
        tool: tool.translation.vector.into(),
        tool_rotation: rows(&tool.rotation),
        couplings,
        payload_mass,
        payload_centre: payload_centre.into(),
        gravity: root.opt("gravity").map_or(super::GRAVITY, super::gravity),
        inertias: DeclaredInertias {
            links: inertias,
            payload: payload_inertia,
            tolerance,
        },
        tolerances: root.opt("tolerances").map(tolerances).unwrap_or_default(),
    }
}

/// Moves points that are far from the arm along their axes, to where each is nearest to the one before: where neighbouring axes are nearly
/// parallel, frames of the Denavit-Hartenberg convention stand on a common normal that is anywhere. The arm moves as before.
fn slide(joints: &mut [JointDescription], tool: &Vector3<f64>) {
    let mut before = Vector3::zeros();
    for joint in joints {
        let (axis, point) = (Vector3::from(joint.axis), Vector3::from(joint.point));
        if point.norm().min((point - tool).norm()) > FAR {
            joint.point = match joint.kind {
                JointKind::Revolute => (point - axis * axis.dot(&(point - before))).into(),
                // Wherever it stands it slides alike.
                JointKind::Prismatic => before.into(),
            };
        }
        before = joint.point.into();
    }
}

/// The tool frame at the zero pose in the base frame: the measured point, and the orientation of the tool's axes.
fn tool(value: DocumentNode, chain: &FrameChain, units: FileUnits) -> Isometry3<f64> {
    let on_link = chain.joints.iter().any(|joint| joint.frame.is_some());
    if value.given().is_none() && on_link {
        return chain.tip;
    }
    let value = value.map(&["point", "orientation"]);
    let point = Vector3::from(
        value
            .get("point")
            .sized_vector::<3>(Bound::Length, units.length),
    );
    let orientation = value
        .opt("orientation")
        .map_or_else(UnitQuaternion::identity, |o| orientation(o, units.angle));
    chain.tip * Isometry3::from_parts(Translation3::from(point), orientation)
}

fn orientation(value: DocumentNode, angle: Unit) -> UnitQuaternion<f64> {
    let value = value.map(&["rpy", "quaternion"]);
    match (value.opt("rpy"), value.opt("quaternion")) {
        (Some(rpy), None) => {
            let [roll, pitch, yaw] = rpy.sized_vector(Bound::Angle, angle);
            UnitQuaternion::from_euler_angles(roll, pitch, yaw)
        }
        (None, Some(quaternion)) => {
            let [w, x, y, z] = quaternion.vector();
            let q = Quaternion::new(w, x, y, z);
            // Four decimals of a unit quaternion are a unit quaternion; anything else is a slip of the pen.
            if (q.norm() - 1.0).abs() > 1e-3 {
                quaternion.fault(format!(
                    "has length {}; expected a unit quaternion [w, x, y, z]",
                    q.norm()
                ));
            }
            UnitQuaternion::from_quaternion(q)
        }
        _ => {
            if value.given().is_some() {
                value.fault(
                    "expected either `rpy: [roll, pitch, yaw]` or `quaternion: [w, x, y, z]`",
                );
            }
            UnitQuaternion::identity()
        }
    }
}

/// What the file says of a joint beyond its screw.
fn drive(joint: &mut JointDescription, value: DocumentNode, units: FileUnits) {
    if value.given().is_none() {
        return;
    }
    let value = value.map(&["name", "limits", "reduction_ratio", "motor_constant"]);
    if let Some(name) = value.opt("name") {
        joint.name = name.text();
    }
    if let Some(limits) = value.opt("limits") {
        let (unit, bound) = match joint.kind {
            JointKind::Revolute => (units.angle, Bound::Angle),
            JointKind::Prismatic => (units.length, Bound::Length),
        };
        let travel = limits.vector::<2>();
        let [lower, upper] = travel.map(|x| unit.to_si(x));
        if lower >= upper {
            limits.fault(format!(
                "expected [lower, upper] with lower < upper, found [{}, {}]",
                travel[0], travel[1]
            ));
        } else {
            let beyond = [lower, upper].into_iter().find_map(|end| bound.fault(end));
            beyond.into_iter().for_each(|message| limits.fault(message));
        }
        joint.limits = Some([lower, upper]);
    }
    let nonzero = |key: &str| {
        value.opt(key).map(|value| {
            let number = value.sized(Bound::Factor, Unit::One);
            if number == 0.0 {
                value.fault("expected a number other than 0");
            }
            number
        })
    };
    joint.reduction_ratio = nonzero("reduction_ratio");
    joint.motor_constant = nonzero("motor_constant");
}

/// Columns of targets and recordings name joints: a name stands for one.
fn distinct(root: &DocumentNode, joints: &[JointDescription]) {
    for (k, joint) in joints.iter().enumerate() {
        if let Some(other) = joints[..k]
            .iter()
            .position(|other| other.name == joint.name)
        {
            let places = root
                .opt("joints")
                .map_or_else(Vec::new, |joints| joints.items());
            let column = |k: usize| {
                places
                    .get(k)
                    .map(|value| value.get("name"))
                    .filter(|name| name.given().is_some())
            };
            // A name that was not given is `J` and the joint's number: the other one has taken it.
            let (at, other) = column(k).map_or_else(|| (column(other), k), |at| (Some(at), other));
            let message = format!(
                "joint {} is called `{}` too; expected a name of its own",
                other + 1,
                joint.name
            );
            at.unwrap_or_else(|| root.clone()).fault(message);
        }
    }
}

/// Whether numbers are in a frame of that name, and not in that of the base.
fn is_in(frame: &str, value: &DocumentNode) -> bool {
    let frame = value
        .opt("frame")
        .and_then(|f| f.choice(&[("base", false), (frame, true)]));
    frame.unwrap_or(false)
}

fn link(value: DocumentNode, frame: Option<Isometry3<f64>>, units: FileUnits) -> ChainBody {
    let value = value.map(&["mass", "centre", "inertia", "frame"]);
    let centre = Point3::from(
        value
            .get("centre")
            .sized_vector::<3>(Bound::Length, units.length),
    );
    let of_link = value.get("frame");
    let in_link = is_in("link", &value);
    let centre = match frame {
        Some(frame) if in_link => frame * centre,
        None if in_link => {
            of_link.fault("screws know no link frames; expected `base`");
            centre
        }
        _ => centre,
    };
    let moments = value.opt("inertia").map(inertia::moments);
    let moments = match frame {
        Some(frame) if in_link => {
            moments.map(|moments| inertia::turned(&moments, &frame.rotation.to_rotation_matrix()))
        }
        _ => moments,
    };
    ChainBody {
        mass: value.get("mass").not_negative(),
        centre,
        inertia: moments,
    }
}

fn couplings(list: DocumentNode, joints: usize) -> Vec<Coupling> {
    let mut couplings: Vec<Coupling> = Vec::new();
    for value in list.items() {
        let value = value.map(&["moved", "by", "ratio"]);
        let ratio = value
            .opt("ratio")
            .map_or(0.0, |ratio| ratio.sized(Bound::Factor, Unit::One));
        if let (Some(moved), Some(by)) = (
            value.get("moved").joint(joints),
            value.get("by").joint(joints),
        ) {
            if moved == by {
                value.fault("a joint cannot move itself; expected two different joints");
            }
            if couplings.iter().any(|c| (c.moved, c.by) == (moved, by)) {
                value.fault(format!(
                    "the coupling of joint {} to joint {} is given twice",
                    moved + 1,
                    by + 1
                ));
            }
            couplings.push(Coupling { moved, by, ratio });
        }
    }
    couplings.sort_by_key(|c| (c.moved, c.by));
    couplings
}

/// No arm carries more, or has heavier links, for the square of its length, kg/m2; the heaviest that are made have a quarter of it.
const CARRIED: f64 = 600.0;
const HEAVIEST: f64 = 2000.0;

/// Masses that no arm of this length has; those in grams are of this kind.
fn implausible(robot: &RobotDescription) -> Vec<String> {
    let points = robot.joints.iter().map(|joint| Vector3::from(joint.point));
    let points: Vec<Vector3<f64>> = points.chain([Vector3::from(robot.tool)]).collect();
    let travel = robot
        .joints
        .iter()
        .filter(|joint| joint.kind == JointKind::Prismatic);
    let travel = travel.filter_map(|joint| Some(joint.limits?[1] - joint.limits?[0]));
    let length = points
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .sum::<f64>()
        + travel.filter(|travel| travel.is_finite()).sum::<f64>();
    let links: f64 = robot.joints.iter().filter_map(|joint| joint.mass).sum();
    let said = |what: &str, mass: f64, most: f64| {
        let most = most * length * length;
        (mass > most && length > 0.0).then(|| {
            format!(
                "{what}: {mass} kg on an arm of {length:.2} m between its axes, of which none has more than {most:.0} kg; masses are in kg: \
                 if the file holds grams, divide by 1000"
            )
        })
    };
    let payload = said("payload.mass", robot.payload_mass, CARRIED);
    payload
        .into_iter()
        .chain(said("links", links, HEAVIEST))
        .collect()
}

/// Rated payload, zero pose, base frame.
fn payload(value: DocumentNode, tool: &Isometry3<f64>, units: FileUnits) -> ChainBody {
    let point = Point3::from(tool.translation.vector);
    if value.given().is_none() {
        return ChainBody {
            mass: 0.0,
            centre: point,
            inertia: None,
        };
    }
    let value = value.map(&["mass", "offset", "inertia", "frame"]);
    let offset = value.opt("offset").map_or([0.0; 3], |offset| {
        offset.sized_vector(Bound::Length, units.length)
    });
    let offset = Vector3::from(offset);
    let in_tool = is_in("tool", &value);
    let rotation = if in_tool {
        tool.rotation.to_rotation_matrix()
    } else {
        Rotation3::identity()
    };
    let moments = value
        .opt("inertia")
        .map(|value| inertia::turned(&inertia::moments(value), &rotation));
    ChainBody {
        mass: value.get("mass").not_negative(),
        centre: point + rotation * offset,
        inertia: moments,
    }
}

fn rows(rotation: &UnitQuaternion<f64>) -> [[f64; 3]; 3] {
    let matrix: Matrix3<f64> = Rotation3::from(*rotation).into_inner();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)]))
}

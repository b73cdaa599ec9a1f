//! Postures for a ball that is brought to sockets, no instrument at hand: `calib poses ROBOT --sockets`.

use super::site::site;
use super::{Drive, PoseAnswer, PoseRequest, closing, drive};
use crate::description::RobotDescription;
use crate::error::{Error, Result};
use crate::estimate::choose::{ContactProposal, ContactRequest, PriorSigma, propose_contacts};
use crate::robot::{JointConvention, RobotModel};
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use nalgebra::Vector3;
use serde_json::json;

/// mm per axis; a ball that is brought to a printed socket by hand.
const SIGMA: f64 = 0.1;

/// What a maker's tolerances justify: 0.3 mm and 1 mrad a link, 30 mrad a zero; the ball within 10 mm.
fn priors() -> Vec<PriorSigma> {
    let prior = |begins, others, turns| PriorSigma {
        begins,
        turns,
        others,
    };
    vec![
        prior("link_geometry.", 3e-4, 1e-3),
        prior("joint_offset.", 0.03, 0.03),
        prior("joint_compliance.", 1e-4, 1e-4),
        prior("tool_offset.", 0.01, 0.01),
    ]
}

/// Reads `[[x, y, z], ...]`, m in the base frame.
pub fn places(text: &str) -> std::result::Result<Vec<[f64; 3]>, String> {
    let expected =
        "expected sockets as [x, y, z] in m, base frame, e.g. [[0.4, 0.1, 0.0], [0.4, 0.15, 0.0]]";
    let places: Vec<[f64; 3]> = serde_json::from_str(text).map_err(|_| expected.to_string())?;
    if places.is_empty() {
        return Err(expected.into());
    }
    match places.iter().flatten().find(|value| value.abs() > 20.0) {
        Some(value) => Err(format!("{value} m is beyond any arm; sockets are in m")),
        None => Ok(places),
    }
}

/// Proposes postures that bring the ball to sockets in the base frame, m.
pub fn sockets(
    request: &PoseRequest,
    robot: RobotDescription,
    place: &str,
    places: &[[f64; 3]],
) -> Result<PoseAnswer> {
    let site = site(request, &robot, place, None)?;
    if request.payloads.len() > 1 {
        let message = "a ball is brought to sockets with one payload";
        return Err(Error::spec("--payload", message));
    }
    let shown = request.sigma.unwrap_or(SIGMA);
    let each = |count: usize| count.div_ceil(places.len());
    let wish = ContactRequest {
        places: places.iter().map(|place| Vector3::from(*place)).collect(),
        count: request.count,
        candidates: each(request.candidates).max(2 * each(request.count)),
        sigma: 1e-3 * shown,
        priors: priors(),
        seed: request.seed,
    };
    let proposal = propose_contacts(&RobotModel::new(robot.clone()), &site, &wish)
        .map_err(|fault| Error::spec(place, fault))?;
    let joints = robot.joints.len();
    let drive = Drive {
        ranges: site.ranges,
        // No side of approach is proposed.
        direction: vec![1.0; proposal.poses.rows() * joints],
        poses: proposal.poses.clone(),
        convention: JointConvention::of_the_robot_file(joints),
        robot,
    };
    let specs = proposal.model.stack.specs();
    let parameters = proposal.sigma.iter().map(|(k, before, after, random)| {
        let unit = specs[*k].unit;
        let [before, after, random] = [*before, *after, *random].map(|sigma| unit.from_si(sigma));
        json!({"name": specs[*k].name, "unit": unit.symbol(), "sigma_before": before, "sigma": after, "sigma_random": random})
    });
    let sockets = places
        .iter()
        .zip(&proposal.without)
        .map(|(place, left_out)| json!({"place_m": place, "postures": left_out.count, "growth_without": left_out.growth}));
    let offsets = proposal.offsets.iter().map(|offset| {
        let weakest = offset.weakest.is_finite().then_some(1e3 * offset.weakest);
        json!({"off_axis_mm": 1e3 * offset.off, "directions": offset.directions, "known": offset.known, "weakest_mm_or_mrad": weakest})
    });
    let document = json!({
        "joints_counted_as": drive::counting(&drive.convention, &drive.robot),
        "sigma_mm": shown,
        "sockets": sockets.collect::<Vec<_>>(),
        "parameters": parameters.collect::<Vec<_>>(),
        "ball": offsets.collect::<Vec<_>>(),
        "advice": advice(&proposal, joints),
        "socket_of_pose": proposal.socket,
        "poses": drive::objects(&drive),
    });
    let links = proposal.sigma.iter();
    let links = links.filter(|(k, ..)| specs[*k].name.starts_with("link_geometry"));
    let better = |(_, before, after, _): &&(usize, f64, f64, f64)| 2.0 * after < *before;
    let place = |[x, y, z]: &[f64; 3]| format!("[{x}, {y}, {z}]");
    let about = context! {
        of => Serde(&document), sigma => shown.to_string(), sets => proposal.sets,
        places => places.iter().map(place).collect::<Vec<_>>(), better => links.clone().filter(better).count(),
        links => links.count(), joints => joints, closing => closing(request),
    };
    Ok(PoseAnswer {
        text: filled(include_str!("sockets.txt"), about),
        document,
        drive: Some(drive),
        warnings: Vec::new(),
    })
}

/// The remark on the ball's distance from the axis of the last joint, of so many.
fn advice(proposal: &ContactProposal, joints: usize) -> Option<String> {
    let offsets = &proposal.offsets;
    let now = offsets.first().filter(|now| now.known < now.directions)?;
    let best = offsets.iter().map(|other| other.known).max();
    let best = best.filter(|best| *best > now.known)?;
    let enough = offsets.iter().find(|other| other.known == best)?;
    Some(format!(
        "the ball lies {:.1} mm off the axis of joint {joints}: that joint's zero, its axis and the ball are hardly seen. {:.0} mm off the axis \
         {} of {} directions are known to 1 mm or mrad, instead of {}",
        1e3 * now.off,
        1e3 * enough.off,
        enough.known,
        enough.directions,
        now.known
    ))
}

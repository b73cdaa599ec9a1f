//! Postures for a ball that is brought to sockets, no instrument at hand: `calib poses ROBOT --sockets`.

use super::proposal::closing;
use super::site::site;
use super::{Drive, PoseAnswer, PoseRequest, drive};
use crate::description::RobotDescription;
use crate::error::{Error, Fault, Result};
use crate::estimate::choose::{ContactProposal, ContactRequest, PriorSigma, propose_contacts};
use crate::robot::{JointConvention, RobotModel};
use crate::text::filled;
use crate::units::Unit;
use minijinja::context;
use minijinja::value::Serde;
use nalgebra::Vector3;
use serde_json::json;

/// Postures that bring the ball to sockets; made once, shown as text, JSON or file.
pub struct SocketProposal<'a> {
    request: &'a PoseRequest,
    robot: RobotDescription,
    ranges: Vec<[f64; 2]>,
    convention: JointConvention,
    places: Vec<[f64; 3]>,
    /// mm.
    sigma: f64,
    proposal: ContactProposal,
    /// No side of approach is proposed.
    direction: Vec<f64>,
}

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

/// Proposes postures for sockets in the base frame, m.
pub fn sockets<'a>(
    request: &'a PoseRequest,
    imported: RobotDescription,
    place: &str,
    places: &[[f64; 3]],
) -> Result<SocketProposal<'a>> {
    let site = site(request, &imported, place, None)?;
    if request.payloads.len() > 1 {
        return Err(Error::Spec(vec![Fault::new(
            "--payload",
            "a ball is brought to sockets with one payload",
        )]));
    }
    let shown = request.sigma.unwrap_or(SIGMA);
    let wish = ContactRequest {
        places: places.iter().map(|place| Vector3::from(*place)).collect(),
        count: request.count,
        candidates: request
            .candidates
            .div_ceil(places.len())
            .max(2 * request.count.div_ceil(places.len())),
        sigma: 1e-3 * shown,
        priors: priors(),
        seed: request.seed,
    };
    let proposal = propose_contacts(&RobotModel::new(imported.clone()), &site, &wish)
        .map_err(|fault| Error::spec(place, fault))?;
    let joints = imported.joints.len();
    Ok(SocketProposal {
        request,
        convention: JointConvention::of_the_robot_file(joints),
        direction: vec![1.0; proposal.poses.rows() * joints],
        robot: imported,
        ranges: site.ranges,
        places: places.to_vec(),
        sigma: shown,
        proposal,
    })
}

impl SocketProposal<'_> {
    fn name(&self, parameter: usize) -> (&str, Unit) {
        let spec = &self.proposal.model.stack.specs()[parameter];
        (&spec.name, spec.unit)
    }

    /// What is said of the ball's distance from the last axis.
    fn advice(&self) -> Option<String> {
        let offsets = &self.proposal.offsets;
        let now = offsets.first().filter(|now| now.known < now.directions)?;
        let best = offsets
            .iter()
            .map(|other| other.known)
            .max()
            .filter(|best| *best > now.known)?;
        let enough = offsets.iter().find(|other| other.known == best)?;
        Some(format!(
            "the ball lies {:.1} mm off the axis of joint {}: that joint's zero, its axis and the ball are hardly seen. {:.0} mm off the axis \
             {} of {} directions are known to 1 mm or mrad, instead of {}",
            1e3 * now.off,
            self.robot.joints.len(),
            1e3 * enough.off,
            enough.known,
            enough.directions,
            now.known
        ))
    }
}

impl PoseAnswer for SocketProposal<'_> {
    fn drive(&self) -> Option<Drive<'_>> {
        let (poses, direction) = (&self.proposal.poses, self.direction.as_slice());
        Some(Drive {
            robot: &self.robot,
            ranges: &self.ranges,
            poses,
            direction,
            convention: &self.convention,
        })
    }

    fn text(&self) -> String {
        let links = self.proposal.sigma.iter();
        let links = links.filter(|(k, ..)| self.name(*k).0.starts_with("link_geometry"));
        let better = |(_, before, after, _): &&(usize, f64, f64, f64)| 2.0 * after < *before;
        let place = |[x, y, z]: &[f64; 3]| format!("[{x}, {y}, {z}]");
        let about = context! {
            of => Serde(self.document()), sigma => self.sigma.to_string(), sets => self.proposal.sets,
            places => self.places.iter().map(place).collect::<Vec<_>>(), better => links.clone().filter(better).count(),
            links => links.count(), joints => self.robot.joints.len(), closing => closing(self.request),
        };
        filled(include_str!("sockets.txt"), about)
    }

    fn document(&self) -> serde_json::Value {
        let ContactProposal {
            sigma,
            without,
            offsets,
            socket,
            ..
        } = &self.proposal;
        let parameters = sigma.iter().map(|(k, before, after, random)| {
            let (name, unit) = self.name(*k);
            let [before, after, random] = [*before, *after, *random].map(|sigma| unit.from_si(sigma));
            json!({"name": name, "unit": unit.symbol(), "sigma_before": before, "sigma": after, "sigma_random": random})
        });
        let sockets = self
            .places
            .iter()
            .zip(without)
            .map(|(place, left_out)| json!({"place_m": place, "postures": left_out.count, "growth_without": left_out.growth}));
        let offsets = offsets.iter().map(|offset| {
            let weakest = offset.weakest.is_finite().then_some(1e3 * offset.weakest);
            json!({"off_axis_mm": 1e3 * offset.off, "directions": offset.directions, "known": offset.known, "weakest_mm_or_mrad": weakest})
        });
        json!({
            "joints_counted_as": drive::counting(&self.convention, &self.robot),
            "sigma_mm": self.sigma,
            "sockets": sockets.collect::<Vec<_>>(),
            "parameters": parameters.collect::<Vec<_>>(),
            "ball": offsets.collect::<Vec<_>>(),
            "advice": self.advice(),
            "socket_of_pose": socket,
            "poses": self.drive().map(|drive| drive::objects(&drive)),
        })
    }
}

//! `link_compliance`: link N bends under the moment of all that it carries, all along as a beam or at its middle; rad/Nm.

use super::form::placed;
use super::motion::{SHORT, extent};
use super::{
    ArmState, Cause, Deflection, Form, Hypothesis, NumberSpec, OwnMotion, Place, Placed, Survey,
    Variable, names,
};
use crate::criteria::effect::{RARE, STIFFNESS_BEYOND, UNLIKELY};
use crate::robot::RobotModel;
use crate::spatial::{Twist, screw};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Which moments bend the link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Bending {
    /// Those across the link, at its middle: a joint within it.
    AcrossLink,
    /// Those across the link at each of its places: a beam that does not twist.
    Beam,
    /// Those across and along the link at each of its places, alike: a tube.
    Tube,
    /// Those across the axis that moves it: what the joint's own compliance does not show.
    AcrossAxis,
    /// Two stiffnesses across that axis.
    TwoDirections,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BentLink {
    /// From 0.
    link: usize,
    bending: Bending,
}

/// The last links are a stubby wrist, and hardly bend.
const WRIST: usize = 2;

pub(super) static CAUSE: Cause = Cause {
    name: names::LINK_COMPLIANCE,
    place: "link",
    formula: "the link bends by the moment at each of its places, as a uniform beam",
    size: "0.05 to 1 urad/Nm",
    confounded: "joint_compliance of either end",
    needs: "link masses",
    sentence: "{place} bends under what it carries by {value}",
    motion: Some(OwnMotion {
        propose,
        sentence: None,
        read: Form::kept::<BentLink>,
    }),
    ..Cause::PLAIN
};

/// Every link that something hangs on.
fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let n = survey.joints();
    let loaded = (0..n).any(|joint| survey.is_loaded(joint));
    let bendings = [
        Bending::Beam,
        Bending::Tube,
        Bending::AcrossLink,
        Bending::AcrossAxis,
        Bending::TwoDirections,
    ];
    let links = (0..n - 1).filter(|link| loaded && extent(survey.robot, *link).norm() > SHORT);
    let forms = links.flat_map(|link| bendings.map(|bending| BentLink { link, bending }));
    let odds = |form: &BentLink| {
        if form.link + WRIST >= n {
            *UNLIKELY
        } else {
            *RARE
        }
    };
    forms
        .map(|form| (odds(&form), form))
        .map(|(odds, form)| {
            Hypothesis::new(form, bendings.len())
                .positive()
                .penalised(odds)
        })
        .collect()
}

impl BentLink {
    /// A place on the link, m, at a share of its length, and the moment about that, Nm.
    fn moment(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        share: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let place = robot.point(self.link) + extent(robot, self.link) * share;
        (place, state.posture.moment(self.link + 1, &place))
    }

    /// What the moments at all places of the link turn beyond it by a unit, without those along `direction`. The moment is linear along the
    /// link, the motion that it makes quadratic: Simpson's rule is exact.
    fn beam(&self, robot: &RobotModel, state: &ArmState, without: Option<&Vector3<f64>>) -> Twist {
        let at = |share: f64| {
            let (place, moment) = self.moment(robot, state, share);
            let along = without.map_or_else(Vector3::zeros, |direction| {
                direction * direction.dot(&moment)
            });
            screw(&(moment - along), &place)
        };
        (at(0.0) + at(0.5) * 4.0 + at(1.0)) / 6.0
    }
}

impl Placed for BentLink {
    placed! { self: Place::Links(self.link, self.link), &CAUSE, [Variable::ArmLoad], self }

    /// What carries the first joint's link is the base.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        if self.link == 0 {
            vec![(names::BASE_COMPLIANCE, Place::Base)]
        } else {
            Vec::new()
        }
    }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let names: &[&str] = if self.bending == Bending::TwoDirections {
            &["first", "second"]
        } else {
            &[""]
        };
        names
            .iter()
            .map(|name| (name.to_string(), Unit::RadianPerNewtonMetre, 1e-3))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let along = extent(robot, self.link);
        let station = self.link + 1;
        let (middle, moment) = self.moment(robot, state, 0.5);
        let without = |direction: &Vector3<f64>| moment - direction * direction.dot(&moment);
        match self.bending {
            Bending::AcrossLink => {
                out.shift(0, p, station, screw(&without(&along.normalize()), &middle))
            }
            Bending::Beam => out.shift(
                0,
                p,
                station,
                self.beam(robot, state, Some(&along.normalize())),
            ),
            Bending::Tube => out.shift(0, p, station, self.beam(robot, state, None)),
            Bending::AcrossAxis => out.shift(
                0,
                p,
                station,
                screw(&without(robot.axis(self.link)), &middle),
            ),
            Bending::TwoDirections => {
                for (k, (_, normal)) in robot.normals(self.link).iter().enumerate() {
                    out.shift(
                        k,
                        p,
                        station,
                        screw(&(normal * normal.dot(&moment)), &middle),
                    );
                }
            }
        }
    }

    fn sizes(&self, robot: &RobotModel, state: &ArmState) -> Vec<Option<f64>> {
        vec![Some(self.moment(robot, state, 0.5).1.norm())]
    }

    fn doubt(&self) -> f64 {
        *STIFFNESS_BEYOND
    }
}

//! `anchor`: the far end of a draw-wire or ballbar is elsewhere; three parameters each, tracker axes. It moves no point.

use super::{ArmState, Cause, CauseDescription, Deflection, Effect, EffectContext, ParameterSpec, Place};
use crate::robot::RobotModel;
use crate::units::Unit;
use nalgebra::Vector3;

/// The far end of a draw-wire or ballbar.
#[derive(Debug, Clone, Copy)]
pub struct AnchorShift;

const AXES: [&str; 3] = ["x", "y", "z"];

impl AnchorShift {
    /// Canonical name, as in tables and YAML.
    pub const NAME: &'static str = "anchor";

    /// What the names of an anchor's parameters begin with, dot included.
    pub fn prefix(anchor: &str) -> String {
        if anchor.is_empty() { format!("{}.", Self::NAME) } else { format!("{}.{anchor}.", Self::NAME) }
    }
}

impl Cause for AnchorShift {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: "anchor",
            place: "anchor",
            formula: "the far end of a draw-wire or ballbar is elsewhere; it moves no point",
            size: "any",
            confounded: "base_frame",
            needs: "distances",
        }
    }

    fn whole(&self, _setting: &EffectContext) -> Option<Box<dyn Effect>> {
        Some(Box::new(Self))
    }
}

impl Effect for AnchorShift {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let anchors = robot.setup().anchors.iter();
        let all = anchors.flat_map(|anchor| {
            AXES.iter().map(move |axis| ParameterSpec {
                name: format!("{}{axis}", Self::prefix(&anchor.name)),
                place: Place::Anchor,
                unit: Unit::Millimetre,
                prior_sigma: 1.0,
            })
        });
        all.collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        if let Some(number) = state.anchor(robot) {
            for axis in 0..3 {
                out.move_anchor(3 * number + axis, p, Vector3::ith(axis, 1.0));
            }
        }
    }
}

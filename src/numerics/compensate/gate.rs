//! What is refused though it can be computed: corrections larger than an arm's errors are, and models that no arm's errors explain.
//!
//! A command is corrected by ||p_real(q) - p_wanted|| (m) and by the turn between the two orientations (rad), both at the uncorrected
//! command. A model is held against the robot file by its tool, joint zeros and links; its base is free. One who insists gets the
//! command all the same, with a remark that says so.

use super::{CorrectedCommand, Remark};
use crate::effect::{Place, names};
use crate::estimate::Model;
use crate::units::Quantity;
use std::collections::BTreeMap;

/// Limits above which a command or a model is refused, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateLimits {
    /// Displacement by which a command is corrected, m.
    pub correction: f64,
    /// Turn by which a command is corrected, rad.
    pub turn: f64,
    /// 95 % uncertainty of a correction along its direction, m; none: the size of the correction itself.
    pub uncertainty: Option<f64>,
    /// Distance of the tool, or of a link, from the robot file's, m.
    pub shift: f64,
    /// Turn of the tool, of a link, or of a joint's zero, rad.
    pub tilt: f64,
}

impl Default for GateLimits {
    fn default() -> Self {
        let deg = std::f64::consts::PI / 180.0;
        Self {
            correction: 20e-3,
            turn: 2.0 * deg,
            uncertainty: None,
            shift: 50e-3,
            tilt: 5.0 * deg,
        }
    }
}

/// The limits, and whether a person insists on what they refuse.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gate {
    /// What is refused.
    pub limits: GateLimits,
    /// Commands beyond the limits are written all the same, with a remark.
    pub insisted: bool,
    /// Why the model itself is refused, where someone insisted on it: every command says so.
    pub model: Vec<String>,
}

impl Gate {
    /// Takes the joints away from a command beyond the limits, or of which something is not known that it depends on; or remarks that someone
    /// insisted.
    pub(super) fn judge(&self, command: &mut CorrectedCommand, unstated: Option<String>) {
        if command.q.is_some() {
            command
                .remarks
                .extend(self.model.iter().cloned().map(Remark::Insisted));
        }
        let Some(reason) = command
            .q
            .as_ref()
            .and_then(|_| unstated.or_else(|| self.reason(command)))
        else {
            return;
        };
        if self.insisted {
            command.remarks.push(Remark::Insisted(reason));
        } else {
            command.q = None;
            command.remarks.push(Remark::Refused(reason));
        }
    }

    /// Why a command is refused; none where it is within the limits. What is no number is not.
    fn reason(&self, command: &CorrectedCommand) -> Option<String> {
        let GateLimits {
            correction,
            turn,
            uncertainty,
            ..
        } = self.limits;
        if beyond(command.uncorrected, correction) {
            let (by, most) = (command.uncorrected * 1e3, round(correction * 1e3));
            return Some(format!(
                "corrected by {by:.3} mm, at most {most} mm allowed (--max-correction)"
            ));
        }
        if let Some(certainty) = &command.certainty {
            let limit = uncertainty.unwrap_or_else(|| certainty.limit());
            if beyond(certainty.u95, limit) {
                let by = certainty
                    .finding
                    .as_ref()
                    .map(|finding| format!(", most of it by {finding}"))
                    .unwrap_or_default();
                let (u95, size) = (certainty.u95 * 1e3, certainty.correction * 1e3);
                return Some(format!(
                    "the correction of {size:.3} mm is uncertain by {u95:.3} mm{by}, at most {:.3} mm allowed (--max-uncertainty)",
                    limit * 1e3
                ));
            }
        }
        let (by, most) = (command.turn.to_degrees(), round(turn.to_degrees()));
        beyond(command.turn, turn)
            .then(|| format!("turned by {by:.3} deg, at most {most} deg allowed (--max-turn)"))
    }

    /// What of a model is further from the robot file than allowed, a sentence each. Targets with a name of their own are of the
    /// measurement, and free; the one without is the robot's tool, whether its orientation was measured or not.
    pub fn beyond(&self, model: &Model) -> Vec<String> {
        const BY_FILE: [&str; 3] = [
            names::TOOL_OFFSET,
            names::JOINT_OFFSET,
            names::LINK_GEOMETRY,
        ];
        let (robot, specs) = (&model.robot, model.stack.specs());
        let placed = !robot.setup().targets.is_empty();
        let held = |name: &str| BY_FILE.contains(&name) && !(name == names::TOOL_OFFSET && placed);
        let mut distances: BTreeMap<String, (f64, f64)> = BTreeMap::new();
        if let Some(target) = robot.setup().target("") {
            let off = robot.mounting(Some(target)).translation - robot.home().translation;
            distances.insert("tool".into(), (off.norm_squared(), 0.0));
        }
        for (effect, range) in model
            .stack
            .effects()
            .filter(|(effect, _)| held(effect.name()))
        {
            for k in range {
                let place = specs[k].place;
                let what = if place == Place::Tool {
                    "tool".into()
                } else {
                    format!("{} at {place}", effect.name())
                };
                let (shift, tilt) = distances.entry(what).or_default();
                *if specs[k].unit.quantity() == Quantity::Angle {
                    tilt
                } else {
                    shift
                } += model.x[k] * model.x[k];
            }
        }
        distances
            .iter()
            .filter_map(|(what, (shift, tilt))| self.too_far(what, shift.sqrt(), tilt.sqrt()))
            .collect()
    }

    fn too_far(&self, what: &str, shift: f64, tilt: f64) -> Option<String> {
        let [most, most_tilt] = [self.limits.shift * 1e3, self.limits.tilt.to_degrees()];
        let all = [
            (shift * 1e3, most, "mm", "--max-shift"),
            (tilt.to_degrees(), most_tilt, "deg", "--max-tilt"),
        ];
        let far = all.into_iter().find(|(by, most, ..)| beyond(*by, *most));
        let (by, most, unit, option) = far?;
        Some(format!(
            "{what} is {by:.1} {unit} from the robot file's, at most {} {unit} allowed ({option})",
            round(most)
        ))
    }
}

/// What is no number is beyond any limit.
fn beyond(by: f64, most: f64) -> bool {
    by.is_nan() || by > most
}

fn round(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

//! What is exported: the corrected geometry, and how well it stands for the whole model.

use crate::compensate::{LeftOut, distance, left_out, rigid};
use crate::description::RobotDescription;
use crate::error::one_line;
use crate::estimate::choose::spread;
use crate::identified::IdentifiedModel;

/// Poses over which geometry and model are compared where no recording is at hand.
const POSES: usize = 500;

/// The model that is exported.
pub struct Export {
    pub(super) identified: IdentifiedModel,
    pub(super) corrected: RobotDescription,
    pub(super) left_out: Vec<LeftOut>,
    /// Rms and maximum distance of the corrected description from the model, m, and over how many poses.
    pub(super) residual: (f64, f64),
    pub(super) poses: usize,
    /// Whether someone insists on what is refused.
    pub(super) insisted: bool,
    /// Whether these are the recorded ones.
    recorded: bool,
}

impl Export {
    /// Splits the model into the rigid geometry that formats hold, and the rest, which is listed.
    /// `insisted`: a format that holds the arm badly is written all the same.
    pub fn of(identified: IdentifiedModel, insisted: bool) -> Self {
        let recording = identified.data.as_ref().filter(|data| data.rows() > 0);
        let recorded = recording.is_some();
        let data = recording
            .cloned()
            .unwrap_or_else(|| spread(&identified.model.robot, POSES));
        let corrected = rigid(&identified.model);
        Self {
            left_out: left_out(&identified.model, &data),
            residual: distance(&identified.model, &corrected, &data),
            corrected,
            poses: data.rows(),
            recorded,
            insisted,
            identified,
        }
    }

    /// What the reader of an export must know, a sentence a line.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let which = if self.recorded {
            "recorded poses"
        } else {
            "poses spread over the joint limits"
        };
        if self.identified.is_of_torques_alone() {
            let name = one_line(&self.corrected.name);
            let mut lines = vec![format!(
                "geometry of {name} as declared, torques of {}",
                self.identified.origin
            )];
            lines.extend(
                self.identified
                    .torques
                    .iter()
                    .flat_map(|torques| torques.warnings.iter().map(|line| one_line(line))),
            );
            lines.extend(self.insisted());
            return lines;
        }
        let mut lines = vec![
            format!(
                "corrected geometry of {}, {}",
                one_line(&self.corrected.name),
                self.identified.origin
            ),
            format!(
                "rigid geometry alone stands {:.4} mm rms, {:.4} mm at most from the identified model over {} {which}",
                self.residual.0 * 1e3,
                self.residual.1 * 1e3,
                self.poses
            ),
        ];
        lines.extend(self.measured_apart());
        if self.identified.convention.is_none() {
            lines.extend(self.identified.counting());
        }
        let robot = &self.identified.model.robot;
        let difference = self
            .identified
            .convention
            .as_ref()
            .and_then(|convention| convention.difference(robot));
        lines.extend(difference.map(|difference| {
            format!(
                "the controller counts its joints otherwise than the robot file: {difference}. Geometry is exported in the counting of the \
                 robot file, the list of numbers for the controller in the controller's"
            )
        }));
        for LeftOut {
            effect,
            place,
            rms,
            most,
        } in &self.left_out
        {
            lines.push(format!(
                "not carried: {effect} at {place}, {:.4} mm rms, {:.4} mm at most",
                rms * 1e3,
                most * 1e3
            ));
        }
        lines.extend(self.insisted());
        if self.identified.correction.is_some() {
            lines.push("not carried: the learned correction".into());
        }
        lines
    }

    /// What the tool has of the targets that were measured, where they are not its point alone.
    fn measured_apart(&self) -> Option<String> {
        let robot = &self.identified.model.robot;
        let targets = &robot.setup().targets;
        if let Some(tool) = robot.setup().target("") {
            let angle = (robot.home().inverse() * targets[tool].mounting)
                .rotation_vector()
                .norm()
                .to_degrees();
            return Some(format!(
                "the tool is the identified point, turned as in the robot file: the frame that was measured, turned by {angle:.4} deg against it, \
                 is the instrument's"
            ));
        }
        let names: Vec<&str> = targets.iter().map(|target| target.name.as_str()).collect();
        let listed = || {
            format!(
                "not carried: where targets sit ({}); the tool is that of the robot file",
                names.join(", ")
            )
        };
        (!names.is_empty()).then(listed)
    }

    /// What was refused and is written all the same.
    fn insisted(&self) -> Vec<String> {
        self.identified
            .refusals
            .iter()
            .map(|reason| format!("written because of --force: {}", one_line(reason)))
            .collect()
    }
}

/// What is to be said of [`placeholder_inertia`].
pub(super) const PLACEHOLDER: &str =
    "the inertia is a placeholder: recordings at rest do not show it";

/// The inertia of a ball of 0.1 m, kg m2.
pub(super) fn placeholder_inertia(mass: f64) -> f64 {
    0.4 * mass * 0.01
}

//! The identified model for other programs, one file per format. A format carries rigid geometry or less: what it leaves out stands in it.

mod body;
mod controller;
mod dh;
mod friction;
mod json;
mod mark;
mod rigid;
mod ur_kinematics;
mod xacro;

pub use mark::Belonging;

use crate::compensate::{LeftOut, distance, left_out, rigid};
use crate::description::RobotDescription;
use crate::error::{Result, one_line};
use crate::estimate::choose::spread;
use crate::identified::IdentifiedModel;

/// A way to write the model down.
pub(crate) struct Format {
    /// What `--format` calls it.
    pub(crate) name: &'static str,
    /// What it is, in one line.
    pub(crate) help: &'static str,
    /// How lines begin that say whence it is, and may differ between exports of one model: comments, where it has some.
    pub(crate) comment: &'static str,
    /// What it holds of identified torques.
    pub(crate) carries: CarriedTorques,
    /// The whole file, which begins with `Export::head` or has its mark elsewhere. Fails where the format cannot hold this arm at all.
    pub(crate) text: fn(&Export) -> Result<String>,
}

/// What a format holds of identified torques.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CarriedTorques {
    /// None of it.
    Nothing,
    /// Inertials, and these causes at joints.
    Causes(&'static [&'static str]),
    /// All.
    All,
}

/// All formats, in the order of the help.
pub(crate) const FORMATS: &[Format] = &[
    rigid::URDF,
    xacro::XACRO,
    ur_kinematics::UR_KINEMATICS,
    dh::DH,
    dh::MDH,
    json::JSON,
    rigid::MJCF,
    rigid::SDF,
    controller::CONTROLLER,
    json::DYNAMICS,
];

/// Poses over which geometry and model are compared where no recording is at hand.
const POSES: usize = 500;

/// The model that is exported.
pub struct Export {
    identified: IdentifiedModel,
    corrected: RobotDescription,
    left_out: Vec<LeftOut>,
    /// Rms and maximum distance of the corrected description from the model, m, and over how many poses.
    residual: (f64, f64),
    poses: usize,
    /// Whether someone insists on what is refused.
    insisted: bool,
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
        let which = match self.recorded {
            true => "recorded poses",
            false => "poses spread over the joint limits",
        };
        if self.identified.is_of_torques_alone() {
            let name = one_line(&self.corrected.name);
            let mut lines = vec![format!(
                "geometry of {name} as declared, torques of {}",
                self.identified.origin
            )];
            let torques = self.identified.torques.iter();
            let warnings = torques.flat_map(|torques| &torques.warnings);
            lines.extend(warnings.map(|line| one_line(line)));
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
        let convention = self.identified.convention.as_ref();
        let difference = convention.and_then(|convention| convention.difference(robot));
        lines.extend(difference.map(|difference| {
            format!(
                "the controller counts its joints otherwise than the robot file: {difference}. Geometry is exported in the counting of the \
                 robot file, the list of numbers for the controller in the controller's"
            )
        }));
        lines.extend(self.left_out.iter().map(|out| {
            let (effect, place) = (&out.effect, &out.place);
            let [rms, most] = [out.rms * 1e3, out.most * 1e3];
            format!("not carried: {effect} at {place}, {rms:.4} mm rms, {most:.4} mm at most")
        }));
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
        let names = Some(names.join(", ")).filter(|_| !targets.is_empty())?;
        Some(format!(
            "not carried: where targets sit ({names}); the tool is that of the robot file"
        ))
    }

    /// What was refused and is written all the same.
    fn insisted(&self) -> Vec<String> {
        let reasons = self.identified.refusals.iter();
        let line = |reason: &String| format!("written because of --force: {}", one_line(reason));
        reasons.map(line).collect()
    }
}

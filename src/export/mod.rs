//! The identified model for other programs, one file per format. A format carries rigid geometry or less: what it leaves out stands in it.

mod body;
mod controller;
mod dh;
mod drives;
mod entered;
mod flange;
mod friction;
mod json;
mod mark;
mod own_mjcf;
mod own_urdf;
mod rigid;
mod ur_kinematics;
mod xacro;

pub(crate) use drives::{DRIVE_FORMATS, DriveExport, DriveFormat};
pub use mark::Belonging;

use crate::compensate::{LeftOut, RIGID, distance, left_out, rigid};
use crate::description::RobotDescription;
use crate::error::{Error, Result, one_line};
use crate::estimate::choose::spread;
use crate::identified::IdentifiedModel;
use crate::robot::Measurements;
use crate::spatial::Pose;

/// A way to write the model down.
pub(crate) struct Format {
    /// What `--format` calls it.
    pub(crate) name: &'static str,
    /// What it is, in one line.
    pub(crate) help: &'static str,
    /// How lines begin that say whence it is, and may differ between exports of one model: comments, where it has some.
    pub(crate) comment: &'static str,
    /// What it holds of identified geometry.
    pub(crate) geometry: CarriedGeometry,
    /// What it holds of identified torques.
    pub(crate) carries: CarriedTorques,
    /// The whole file, which begins with `Export::head` or has its mark elsewhere. Fails where the format cannot hold this arm at all.
    pub(crate) text: fn(&Export) -> Result<String>,
}

/// What a format holds of identified geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CarriedGeometry {
    /// All that is rigid.
    Rigid,
    /// Numbers of these effects, solved anew with all else nominal.
    Numbers(&'static [&'static str]),
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
    /// The recording, or poses spread over the joint limits.
    data: Measurements,
    corrected: RobotDescription,
    left_out: Vec<LeftOut>,
    /// Rms and maximum distance of the corrected description from the model, m, and over how many poses.
    residual: (f64, f64),
    /// The same of the nominal description.
    nothing: (f64, f64),
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
            left_out: left_out(&identified.model, &data, &RIGID),
            nothing: distance(&identified.model, &identified.robot, &data),
            residual: distance(&identified.model, &corrected, &data),
            corrected,
            poses: data.rows(),
            recorded,
            insisted,
            data,
            identified,
        }
    }

    fn poses_said(&self) -> &'static str {
        match self.recorded {
            true => "recorded poses",
            false => "poses spread over the joint limits",
        }
    }

    /// What the reader of an export must know, a sentence a line.
    pub(crate) fn remarks(&self, geometry: CarriedGeometry) -> Vec<String> {
        let which = self.poses_said();
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
        let mut lines = vec![format!(
            "corrected geometry of {}, {}",
            one_line(&self.corrected.name),
            self.identified.origin
        )];
        let left_out = match geometry {
            CarriedGeometry::Rigid => {
                let [residual, nothing] = [self.residual, self.nothing].map(|(rms, most)| {
                    format!("{:.4} mm rms, {:.4} mm at most", rms * 1e3, most * 1e3)
                });
                lines.push(format!(
                    "rigid geometry alone stands {residual} from the identified model over {} {which}; the nominal geometry {nothing}",
                    self.poses
                ));
                lines.extend(self.measured_apart());
                lines.push(self.base_said());
                self.left_out.clone()
            }
            CarriedGeometry::Numbers(carried) => {
                left_out(&self.identified.model, &self.data, carried)
            }
        };
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
        lines.extend(left_out.iter().map(|out| {
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

    /// Where the robot's base stands in the measured frame: files of the arm begin at its base.
    fn base_said(&self) -> String {
        let base = self.identified.model.base();
        let (place, turn) = body::origin(&Pose::identity(), &base);
        // Micrometres and microradians: no instrument tells more.
        let said = |numbers: [f64; 3]| numbers.map(|number| format!("{number:.6}")).join(" ");
        format!(
            "not carried: where the base stands in the measured frame: at {} m, turned by roll, pitch, yaw {} rad",
            said(place),
            said(turn)
        )
    }

    /// Fails where these numbers are worse than nominal ones and nobody insists.
    fn refuse_worse(&self) -> Result<()> {
        let ((left, _), (nothing, _)) = (self.residual, self.nothing);
        if self.insisted || left <= nothing {
            return Ok(());
        }
        let message = format!(
            "entering this geometry leaves {:.4} mm rms, entering nothing {:.4} mm: what it does not carry outweighs it; allowed: calib compensate, \
             which uses the whole model, or --force",
            left * 1e3,
            nothing * 1e3
        );
        Err(Error::data(&self.identified.origin, message))
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

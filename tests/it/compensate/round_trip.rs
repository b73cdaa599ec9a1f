//! A program compensated for a simulated robot, and where that really goes when its controller, which believes in the robot file, runs it.

use super::ROBOT;
use super::maker::Maker;
use super::true_error::Cell;
use crate::fixture::robot_of;
use calib::compensate::{
    CorrectionOptions, Corrector, Gate, IdentifiedArm, Nominal, ToolGoal, least_change, turns,
};
use calib::program::{
    Companion, Frames, Language, Literal, Partial, Program, ProgramFile, ProgramLoad, ProgramRules,
    Rewritten, RobotTool, corrected,
};
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::twin::plan::Point;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// A simulated robot, and what was identified of it.
pub struct Trip {
    pub cell: Cell,
    pub arm: IdentifiedArm,
    pub robot: RobotModel,
}

impl Trip {
    /// Of an arm that can be turned over at shoulder, elbow and wrist.
    pub fn new() -> Self {
        let wide = [
            ("[-120, 120]", "[-175, 175]"),
            ("[-60, 75]", "[-130, 130]"),
            ("[-80, 75]", "[-260, 80]"),
            ("[-170, 170]", "[-350, 350]"),
        ];
        let text = wide
            .into_iter()
            .fold(ROBOT.to_string(), |text, (from, to)| text.replace(from, to));
        let robot = robot_of(&text);
        let cell = Cell::of(robot.clone(), 1.2, [100.0, 200.0], Vec::new());
        let arm = IdentifiedArm::new(cell.identified(), None);
        Self {
            cell,
            arm,
            robot: RobotModel::new(robot),
        }
    }

    /// A program as `calib compensate` writes it; the reasons where it is refused.
    pub fn compensated(
        &self,
        maker: &Maker,
        language: Language,
        text: &str,
    ) -> Result<Rewritten, String> {
        self.compensated_by(maker, language, text, &[], None)
    }

    /// The same of a program of several files, with the robot file's tool as it is stated.
    pub fn compensated_by(
        &self,
        maker: &Maker,
        language: Language,
        text: &str,
        companions: &[Companion],
        tool: Option<RobotTool>,
    ) -> Result<Rewritten, String> {
        let manner = CorrectionOptions {
            oriented: true,
            uncertainty: false,
            gate: Gate {
                insisted: true,
                ..Gate::default()
            },
            ..CorrectionOptions::counted_by(maker.convention())
        };
        let mut corrector = Corrector::new(&self.arm, None, None, manner);
        // What the letters of a configuration mean stands in no listing.
        let frames = if language == Language::Fanuc {
            Frames::Assumed
        } else {
            Frames::Refused
        };
        let rules = ProgramRules {
            partial: Partial::Refused,
            frames,
            load: ProgramLoad::Optional,
            tool,
            base: None,
        };
        let source = ProgramFile {
            place: "program",
            text: text.as_bytes(),
            language,
            companions,
        };
        corrected(&source, rules, self.robot.description(), &mut corrector)
            .map_err(|error| error.to_string())
    }

    /// Joints by which the controller reaches a pose of the robot file's tool, near to `near` (rad).
    pub fn driven(&self, pose: Pose, near: &[f64]) -> Vec<f64> {
        driven(&self.robot, pose, near)
    }

    /// How far (mm) the true robot is from where each target's joints should bring a point of the tool, with the joints that are driven; the
    /// point as its place (m) in the tool frame of the robot file.
    pub fn misses(&self, wanted: &[Vec<f64>], driven: &[Vec<f64>]) -> Vec<f64> {
        let points = driven
            .iter()
            .map(|q| Point {
                q: q.clone(),
                ..self.still()
            })
            .collect();
        let goal = |q: &Vec<f64>| self.arm.base().point(&self.robot.forward(q).translation);
        self.cell
            .places(points)
            .iter()
            .zip(wanted)
            .map(|(at, q)| (at - goal(q)).norm() * 1e3)
            .collect()
    }

    /// The misses of the same targets stated as joints in a program of KRL.
    pub fn misses_by_joints(&self, maker: &Maker, wanted: &[Vec<f64>]) -> Vec<f64> {
        let joints: String = wanted.iter().map(|q| maker.ptp(q)).collect();
        let written = self.compensated(maker, Language::Krl, &joints).unwrap();
        let targets = read(Language::Krl, &written.bytes).into_iter();
        let driven: Vec<_> = targets.map(|one| maker.driven(&one.values)).collect();
        self.misses(wanted, &driven)
    }

    fn still(&self) -> Point {
        self.cell.targets_by(1, &[0.0], 3).remove(0)
    }
}

pub fn driven(robot: &RobotModel, pose: Pose, near: &[f64]) -> Vec<f64> {
    let goal = ToolGoal {
        pose,
        oriented: true,
    };
    let found = least_change(&mut Nominal::new(robot), &goal, near, near);
    assert!(found.residual < 1e-6, "{}", found.residual);
    found.q
}

/// The targets of a program, values and postures.
pub fn read(language: Language, bytes: &[u8]) -> Vec<Literal> {
    Program::parse(bytes, language, Partial::Refused)
        .unwrap()
        .literals()
        .to_vec()
}

/// What the numbers of a Cartesian target say.
pub fn pose(literal: &Literal) -> Pose {
    let v = &literal.values;
    let rotation = if v.len() == 6 {
        turns(v[3].to_radians(), v[4].to_radians(), v[5].to_radians())
    } else {
        UnitQuaternion::from_quaternion(Quaternion::new(v[3], v[4], v[5], v[6]))
            .to_rotation_matrix()
            .into_inner()
    };
    Pose::new(rotation, Vector3::new(v[0], v[1], v[2]) * 1e-3)
}

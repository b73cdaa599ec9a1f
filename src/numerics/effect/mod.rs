//! The library of physical effects: every cause of error is a row of the table [`CAUSES`].
//!
//! An [`Effect`] adds small motions somewhere on the chain and says how they change with its parameters. Identification, prediction and
//! compensation use the same effects through one composition, the [`EffectStack`]. What a search may choose is a [`Form`]: most are laws at
//! a place, effect = sum_k c_k * direction(place) * law_k(variables of the row), a [`Term`]; the others are motions with physics of their
//! own. Both are [`Placed`], and that is all that a form has to be.

mod basis;
mod cause;
mod compliance;
mod declared;
mod deflection;
mod form;
mod geometry;
mod joint_hardening;
mod joint_log_lag;
mod law;
mod law_row;
mod law_shapes;
mod motion;
pub mod names;
mod place;
mod placed_row;
mod sentence;
mod stack;
mod summary;
mod survey;
mod table;
mod torque_model;
mod unknown;
mod unweighed_windup;
mod variable;
mod volume;
mod words;

pub use basis::Basis;
pub use cause::{ArmEffectOf, Cause, Measure, OwnMotion, arm_effect, cause, identified};
pub use declared::{
    DeclarationFault, DeclaredCause, DeclaredForm, DeclaredTorque, EffectDeclaration, Laws,
    ShapeRange, Starts,
};
pub use deflection::{BeyondRange, Deflection, Direction};
pub use form::{Errors, Form, NumberSpec, Placed, Term, is_own_table};
pub use geometry::{AnchorShift, BasePlacement, ToolOffset, tolerance};
pub use law::{Factor, Law};
pub use law_row::{At, Follows, LawRow, Limit, Times, Turning};
pub use law_shapes::{Warmth, moved_with_the_payload};
pub use motion::{Axes, AxisPoint, Motion, Polar, Sight};
pub use place::Place;
pub use placed_row::{PlacedRow, PlacementBuffers};
pub use stack::{EffectStack, PointMotion};
pub use summary::{
    FittedForms, HiddenSize, ModelledFinding, ParameterEstimate, Summary, people, turned_holder,
};
pub use survey::{Hypothesis, STANDS, Survey};
pub use table::CAUSES;
pub use unknown::Unknown;
pub use variable::Variable;
pub use volume::Closing;
pub use words::{Clock, figure};

use crate::robot::{LoadCorrection, Measurements, Posture, RobotModel, RowTime};
use crate::spatial::Pose;
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A parameter of an effect: its name, its unit and how far from nominal arms are made.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSpec {
    /// E.g. `reduction_ratio.j2`; zero always means the nominal robot.
    pub name: String,
    /// E.g. `joint 2`, `link 3`, `base`, `tool`.
    pub place: Place,
    /// The unit that people and tables see; values are SI.
    pub unit: Unit,
    /// One standard deviation of how far from nominal it is before any measurement, SI: a prior of every fit.
    pub tolerance: f64,
}

/// The circumstances of one row that effects may depend on.
#[derive(Debug, Clone, Copy)]
pub struct ArmState<'a> {
    data: &'a Measurements,
    row: usize,
    /// Commanded joint positions, rad or m.
    pub(crate) q: &'a [f64],
    /// Where the arm really hangs and what it carries; at rest at the zero pose unless an effect of the stack asks for it.
    pub(crate) posture: &'a Posture,
    /// Where the target is, tracker frame, m; the origin unless the effect asks for it.
    point: Vector3<f64>,
}

impl<'a> ArmState<'a> {
    pub(crate) fn new(
        data: &'a Measurements,
        row: usize,
        posture: &'a Posture,
        point: Vector3<f64>,
    ) -> Self {
        Self {
            data,
            row,
            q: data.q(row),
            posture,
            point,
        }
    }

    /// The target as the instrument sees it.
    pub(crate) fn sight(&self) -> Sight {
        Sight::of(&self.point)
    }

    /// The number of the target that the row measured; none where the robot knows no such target.
    pub(crate) fn target(&self, robot: &RobotModel) -> Option<usize> {
        robot.setup().target(self.data.target(self.row))
    }

    /// The number of the anchor that the row measured from.
    pub(crate) fn anchor(&self, robot: &RobotModel) -> Option<usize> {
        robot.setup().anchor(self.data.anchor(self.row)?)
    }

    /// Motor currents, A, where recorded.
    pub(crate) fn current(&self) -> Option<&'a [f64]> {
        self.data.current(self.row)
    }

    /// s, or the number of the row where the recording has no clock; infinite long after the recording, where laws take their limit.
    pub(crate) fn time(&self) -> f64 {
        match self.data.row_time(self.row) {
            RowTime::At(time) => time,
            RowTime::LongAfter => f64::INFINITY,
        }
    }

    /// Direction from which a joint came to rest, +1 or -1; 0 if it never moved.
    pub fn direction(&self, joint: usize) -> f64 {
        self.data.direction(self.row, joint)
    }

    /// What a joint moved from the stop before, rad or m.
    pub(crate) fn last_move(&self, joint: usize) -> f64 {
        self.data.last_move(self.row, joint)
    }

    /// The largest of the moves of all joints that turn from the stop before, rad.
    pub(crate) fn largest_turn(&self, robot: &RobotModel) -> f64 {
        let turns = (0..robot.joints()).filter(|joint| robot.is_revolute(*joint));
        turns
            .map(|joint| self.last_move(joint).abs())
            .fold(0.0, f64::max)
    }
}

/// A physical cause of pose error.
pub trait Effect: Send + Sync {
    /// Canonical name, e.g. `reduction_ratio`.
    fn name(&self) -> &str;
    /// The parameters, in the order of `p` in [`Effect::deflect`].
    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec>;
    /// Adds the motions that parameters `p` (SI) cause in this state, with their partials.
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection);
    /// True if the effect reads `ArmState::posture`.
    fn needs_torque(&self) -> bool {
        false
    }
    /// True if the effect reads motor currents.
    fn needs_current(&self) -> bool {
        false
    }
    /// True if the effect reads `ArmState::sight`; such a one reads no posture.
    fn needs_sight(&self) -> bool {
        false
    }
    /// True if its motions are the same at every row, whatever the joints, the load and the time.
    fn is_constant(&self) -> bool {
        false
    }
    /// Adds what parameters `p` change about the load of the arm at joint positions `q` under the declared
    /// `payload` (kg); its partials belong into `deflect`.
    fn load_correction(&self, _q: &[f64], _payload: f64, _p: &[f64], _out: &mut LoadCorrection) {}
    /// Its place and shape, for effects that have one; none for effects of the whole arm.
    fn form(&self) -> Option<&Form> {
        None
    }
    /// What the recording or the robot lacks for this effect, if anything, as a sentence.
    fn missing(&self, _robot: &RobotModel, _data: &Measurements) -> Option<String> {
        None
    }
}

/// What stands in for the torque that winds a joint up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Load {
    /// Gravity torque from the masses of the robot file; compliance in rad/Nm.
    GravityTorque,
    /// Motor current as in the paper (Eq. 28); factors in rad/A, sign as the controller's.
    MotorCurrent,
}

impl Load {
    /// The unit of a joint's compliance to this load.
    pub(crate) fn unit_of_compliance(self) -> Unit {
        match self {
            Self::GravityTorque => Unit::RadianPerNewtonMetre,
            Self::MotorCurrent => Unit::RadianPerAmpere,
        }
    }

    /// The load to which a compliance of this unit belongs.
    pub fn of_compliance(unit: Unit) -> Option<Self> {
        [Self::GravityTorque, Self::MotorCurrent]
            .into_iter()
            .find(|load| load.unit_of_compliance() == unit)
    }
}

/// What an effect needs to be made.
#[derive(Debug, Clone, Copy)]
pub struct EffectContext {
    /// Where the base stands in the tracker's frame before any correction.
    pub base: Pose,
    /// By what joints wind up.
    pub load: Load,
}

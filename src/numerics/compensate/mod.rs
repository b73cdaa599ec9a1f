//! Joint commands that bring the real arm to a wanted point: the inverse of the whole identified model.
//!
//! A joint target stands for the point where the *nominal* robot would put the tool; the command is the nearest one (least change of
//! joints) at which the identified arm, with every accepted effect and the learned correction, puts it there. Newton's method on the
//! effect stack: its Jacobian leaves out how effects change with the joints, which is of the order of the errors themselves, so that
//! every step gains about three digits. Frames: targets are in the robot's base frame, as identified.

mod arm;
mod correct;
mod gate;
mod posture;
mod remark;
mod rigid;
mod sides;
mod solve;
mod uncertainty;

pub use arm::{Circumstance, IdentifiedArm, Reach, Stated, load_matters, unstated_payload};
pub use correct::{CommandTarget, CorrectionOptions, CorrectionTotals, Corrector, turns};
pub use gate::{Gate, GateLimits};
pub use posture::StatedPosture;
use remark::beyond_limits;
pub use remark::{CorrectedCommand, Remark, doubts};
pub use rigid::{LeftOut, RIGID, distance, left_out, rigid};
pub use sides::{ArmSides, SideShares, StatedSides};
pub use solve::{
    Chain, CommandSolution, Nominal, SETTLED, ToolGoal, inverse, least_change, one_step,
};
pub use uncertainty::{CorrectionUncertainty, PositionUncertainty, Scatter, Uncertainty};

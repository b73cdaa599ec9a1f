//! `joint_table`: a repeatable error of a joint of no simple form, as a curve over the range that was measured.

use super::{Cause, NumberSpec, Summary, Term, about, names};
use crate::robot::RobotModel;
use crate::units::Unit;

/// A free curve of a joint over its angle.
pub struct JointTable;

/// How large a number of a curve may be, rad (60 arcsec): holds it down where points are sparse.
pub(super) const PLAUSIBLE: f64 = 3e-4;
impl Cause for JointTable {
    about! {
        name: names::JOINT_TABLE,
        place: "joint",
        formula: "d = a smooth curve of q over the measured range",
        size: "5 to 200 arcsec",
        confounded: "gear_cyclic",
        needs: "many points",
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        (1..=term.law().count()).map(|k| (format!("cos{k}"), Unit::Radian, PLAUSIBLE)).collect()
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("{} has a repeatable error of no simple form, kept as a table", summary.place)
    }
}

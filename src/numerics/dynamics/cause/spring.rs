//! Torque that grows with the angle of a joint: a balancing spring at joint 2, a cable or hose elsewhere.

use super::{FittedNumber, PLAIN, TorqueCause, TorqueCauseDescription, TorqueForm, fill};
use crate::dynamics::scene::DynamicScene;

/// q and 1; of what stiffens as it bends its square and cube, too. Shape: least and greatest angle, rad,
/// and of a balancing spring the highest power; none of a straight balancing spring.
pub(super) struct SpringTorque {
    balances: bool,
}

/// At the joint that arms balance.
pub(super) static SPRING_BALANCE: SpringTorque = SpringTorque { balances: true };
/// Its name.
pub(super) const SPRING_BALANCE_NAME: &str = "spring_balance";
/// At the others.
pub(super) static CABLE_STIFFNESS: SpringTorque = SpringTorque { balances: false };
/// Angles at which the stiffness is looked at.
const CHECKED: usize = 8;
/// Columns.
const WIDTHS: [usize; 2] = [2, 4];
/// From 0.
pub(super) const BALANCED: usize = 1;

impl TorqueCause for SpringTorque {
    fn about(&self) -> &'static TorqueCauseDescription {
        const CABLE: TorqueCauseDescription = TorqueCauseDescription {
            name: "cable_stiffness",
            coefficients: &[
                ("stiffness", "Nm/rad"),
                ("at_zero", "Nm"),
                ("square", "Nm/rad2"),
                ("cube", "Nm/rad3"),
            ],
            of_angle: true,
            ..PLAIN
        };
        if self.balances {
            &TorqueCauseDescription {
                name: SPRING_BALANCE_NAME,
                ..CABLE
            }
        } else {
            &CABLE
        }
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let cause: &'static dyn TorqueCause = if self.balances {
            &SPRING_BALANCE
        } else {
            &CABLE_STIFFNESS
        };
        let joints = (0..scene.joints()).filter(|joint| (*joint == BALANCED) == self.balances);
        let form = |joint: usize, width: usize| {
            let ends = scene.position[joint]
                .iter()
                .fold([f64::MAX, f64::MIN], |[a, b], q| [a.min(*q), b.max(*q)]);
            let with_power = [ends[0], ends[1], (width - 1) as f64];
            let shape = match (self.balances, width) {
                // A straight balancing spring may work over its dead centre.
                (true, 2) => &[],
                (true, _) => &with_power[..],
                (false, _) => &ends,
            };
            TorqueForm::at_joint(cause, joint, width).shaped(shape)
        };
        joints
            .flat_map(|joint| WIDTHS.map(|width| form(joint, width)))
            .collect()
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.width == WIDTHS[0]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        match column {
            0 => out.copy_from_slice(&scene.position[form.joint()]),
            1 => out.fill(1.0),
            power => {
                let angle = &scene.position[form.joint()];
                fill(out, |row| angle[row].powi(power as i32));
            }
        }
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        let counts: &[usize] = if self.balances { &[0, 3] } else { &[2] };
        counts.contains(&shape.len())
    }

    /// What bends resists: its stiffness is positive wherever the joint moves.
    fn is_possible(&self, form: &TorqueForm, values: &[f64]) -> bool {
        let number = |power: usize| values.get(power).copied().unwrap_or(0.0);
        let stiffness = |q: f64| number(0) + 2.0 * number(2) * q + 3.0 * number(3) * q * q;
        let &[least, most, ..] = &form.shape[..] else {
            return true;
        };
        (0..=CHECKED).all(|k| stiffness(least + (most - least) * k as f64 / CHECKED as f64) > 0.0)
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let what = if self.balances {
            "a balancing spring"
        } else {
            "a cable or hose"
        };
        format!(
            "{what} acts on {} with {:.3} Nm/rad and {:.3} Nm at zero",
            form.place, fitted[0].value, fitted[1].value
        )
    }
}

//! Gears of a wrist that turn with two joints: friction of the sum of two velocities, felt by both.

use super::{FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, plain, shape};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// x = v + k v_by, and its sign, at the joint and k times that at the other; `with` holds the other joint, and
/// whether both are known or likely to share a gear.
pub(super) struct WristCoupling;

/// k of neighbouring joints of a wrist; of other pairs only gears of one to one are tried.
const RATIOS: [f64; 14] = [
    -1.4, -1.2, -1.0, -0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4,
];
const PLAIN_RATIOS: [f64; 2] = [-1.0, 1.0];
/// Ratios that stand in the rich model.
const USUAL: [f64; 2] = [-0.6, 1.0];
const LEAST_RATIO: f64 = 0.15;
/// Joints of a wrist begin here, from 0.
const WRIST: usize = 3;

impl TorqueCause for WristCoupling {
    about! {
        name: "wrist_coupling",
        coefficients: &[("viscous", "Nm s/rad"), ("coulomb", "Nm")],
        of_sign: true,
        positive: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let mut forms = Vec::new();
        for moved in 1..scene.joints() {
            for by in (0..scene.joints()).filter(|by| *by != moved) {
                let known = scene.arm.coupled.contains(&(moved, by));
                let near = known || (by + 1 == moved && by >= WRIST && scene.joints() == 6);
                let ratios = if near { &RATIOS[..] } else { &PLAIN_RATIOS[..] };
                if !near && by > moved {
                    continue;
                }
                for ratio in ratios {
                    let form = TorqueForm::at_joint(&WristCoupling, moved, 2).shaped(&[*ratio]);
                    forms.push(TorqueForm {
                        with: [by, usize::from(near)],
                        ..form
                    });
                }
            }
        }
        forms
    }

    fn price(&self, form: &TorqueForm) -> f64 {
        if form.with[1] == 1 { 6.0 } else { 30.0 }
    }

    fn acts_on(&self, form: &TorqueForm, _joints: usize) -> Vec<usize> {
        vec![form.joint(), form.with[0]]
    }

    /// Gears that hardly turn with the other joint do not turn with it.
    fn is_itself(&self, form: &TorqueForm, _scene: &DynamicScene) -> bool {
        form.shape[0].abs() > LEAST_RATIO
    }

    /// Friction brakes: neither of its numbers drives.
    fn is_possible(&self, _form: &TorqueForm, values: &[f64]) -> bool {
        values.iter().all(|value| *value >= 0.0)
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.with[1] == 1 && USUAL.contains(&form.shape[0])
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        let [least, most] = if form.shape[0] > 0.0 {
            [0.05, 2.0]
        } else {
            [-2.0, -0.05]
        };
        vec![ShapeSpan {
            name: "ratio",
            unit: "1",
            index: 0,
            least,
            most,
            by_ratio: false,
            usual: None,
        }]
    }

    fn cell(&self, form: &TorqueForm) -> [usize; 2] {
        form.with
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let (moved, by, ratio) = (form.joint(), form.with[0], form.shape[0]);
        let share = if joint == moved { 1.0 } else { ratio };
        for (row, value) in out.iter_mut().enumerate() {
            let together = scene.velocity[moved][row] + ratio * scene.velocity[by][row];
            *value = share
                * if column == 0 {
                    together
                } else {
                    scene.sign(together)
                };
        }
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![
            plain("viscous", fitted[0], "Nm s/rad"),
            plain("coulomb", fitted[1], "Nm"),
            shape("by_joint", (form.with[0] + 1) as f64, "1"),
            shape("ratio", form.shape[0], "1"),
        ]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let (by, ratio) = (form.with[0] + 1, form.shape[0]);
        let [viscous, coulomb] = [fitted[0].value, fitted[1].value];
        format!(
            "gears of {} turn with joint {by} too (ratio {ratio:.2}): friction of both together is {coulomb:.3} Nm and {viscous:.3} Nm s/rad",
            form.place
        )
    }
}

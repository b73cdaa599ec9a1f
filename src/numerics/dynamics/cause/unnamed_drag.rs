//! Friction without a name that is greater at some angles of its joint: ways, seals and lubricant differ along a turn.

use super::unknown::UNKNOWN;
use super::{COULOMB, FittedNumber, TorqueCause, TorqueForm, about, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// So many waves a turn (`with`), with the sign of the velocity; shape: least and greatest angle of the joint, rad.
pub(super) struct UnnamedDrag;

/// Waves a turn.
const ORDERS: usize = 4;

impl TorqueCause for UnnamedDrag {
    about! {
        name: UNKNOWN,
        coefficients: &[("drag_cosine", "Nm"), ("drag_sine", "Nm")],
        price: 30.0,
        of_sign: true,
        modifies: &[COULOMB],
        may_repeat: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let of = |joint: usize| {
            let ends = scene.position[joint]
                .iter()
                .fold([f64::MAX, f64::MIN], |[a, b], q| [a.min(*q), b.max(*q)]);
            let form = move |order| TorqueForm {
                with: [order, 0],
                ..TorqueForm::at_joint(&UnnamedDrag, joint, 2).shaped(&ends)
            };
            (1..=ORDERS).map(form)
        };
        (0..scene.joints()).flat_map(of).collect()
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let angle = &scene.position[form.joint()];
        let turn = |row: usize| form.with[0] as f64 * angle[row];
        let wave = |row: usize| {
            if column == 0 {
                turn(row).cos()
            } else {
                turn(row).sin()
            }
        };
        fill(out, |row| scene.direction(form.joint(), row) * wave(row));
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 2
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let order = TorqueParameter {
            name: "order".into(),
            value: form.with[0] as f64,
            unit: "1",
            sigma: None,
        };
        vec![
            plain("drag_cosine", fitted[0], "Nm"),
            plain("drag_sine", fitted[1], "Nm"),
            order,
        ]
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        format!(
            "friction without a name acts at {} beside Coulomb friction; it depends on the angle of the joint",
            form.place
        )
    }
}

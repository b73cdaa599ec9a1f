//! Torque that comes back with every turn, or part of a turn, of a joint or its motor.

use super::{FittedNumber, TorqueCause, TorqueForm, about, fill, shape};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Cosine and sine of an order, and of a ripple that is no plain wave those of twice the order; `with` holds the order and whether it is of
/// the motor.
pub(super) struct Ripple;

/// Per turn of the joint, and of the motor; the last of each only shows that the order is beyond.
const ORDERS: usize = 9;
const MOTOR_ORDERS: usize = 3;
/// Lowest orders stand in the rich model.
const USUAL: usize = 4;
/// The highest order that is tried with an overtone.
const WITH_OVERTONE: usize = 4;

impl Ripple {
    fn periods(form: &TorqueForm) -> f64 {
        form.with[0] as f64
            * if form.with[1] == 1 {
                form.shape[0]
            } else {
                1.0
            }
    }
}

impl TorqueCause for Ripple {
    about! {
        name: "torque_ripple",
        coefficients: &[("cosine", "Nm"), ("sine", "Nm"), ("overtone_cosine", "Nm"), ("overtone_sine", "Nm")],
        may_repeat: true,
        of_angle: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let mut forms = Vec::new();
        for joint in 0..scene.joints() {
            let mut add = |order: usize, motor: usize, width: usize| {
                let form = TorqueForm::at_joint(&Ripple, joint, width)
                    .shaped(&[scene.arm.ratio[joint].abs()]);
                forms.push(TorqueForm {
                    with: [order, motor],
                    ..form
                });
            };
            (1..=ORDERS).for_each(|order| add(order, 0, 2));
            (1..=WITH_OVERTONE).for_each(|order| add(order, 0, 4));
            if scene.arm.ratio[joint].abs() > ORDERS as f64 {
                (1..=MOTOR_ORDERS).for_each(|order| add(order, 1, 2));
            }
        }
        forms
    }

    fn has_ends(&self, form: &TorqueForm) -> bool {
        form.with[0] >= [ORDERS, MOTOR_ORDERS][form.with[1].min(1)]
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.width == 2 && form.with[1] == 0 && form.with[0] <= USUAL
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let (angle, periods) = (&scene.position[form.joint()], Self::periods(form));
        let periods = periods * (1 + column / 2) as f64;
        if column.is_multiple_of(2) {
            fill(out, |row| (periods * angle[row]).cos());
        } else {
            fill(out, |row| (periods * angle[row]).sin());
        }
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let (amplitude, sigma) = amplitude(&fitted[..2]);
        let of = if form.with[1] == 1 {
            "motor_order"
        } else {
            "order"
        };
        vec![
            TorqueParameter {
                name: "amplitude".into(),
                value: amplitude,
                unit: "Nm",
                sigma: Some(sigma),
            },
            shape("phase", fitted[1].value.atan2(fitted[0].value), "rad"),
            shape(of, form.with[0] as f64, "1"),
        ]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let of = if form.with[1] == 1 {
            "its motor"
        } else {
            "the joint"
        };
        let (amplitude, _) = amplitude(&fitted[..2]);
        format!(
            "the torque of {} ripples by {amplitude:.3} Nm, {} times a turn of {of}",
            form.place, form.with[0]
        )
    }
}

/// The amplitude of a cosine and a sine, with its standard deviation.
fn amplitude(fitted: &[FittedNumber]) -> (f64, f64) {
    let amplitude = fitted[0].value.hypot(fitted[1].value);
    let weighted = (fitted[0].value * fitted[0].sigma).hypot(fitted[1].value * fitted[1].sigma);
    (amplitude, weighted / amplitude.max(f64::MIN_POSITIVE))
}

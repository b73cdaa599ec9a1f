//! Balancers at the joint that arms balance: their torque swings with the joint's angle.

use super::spring::{BALANCED, SPRING_BALANCE_NAME};
use super::{FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, fill};
use crate::dynamics::scene::DynamicScene;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Between two points a spring's lever is a sine of the angle: one wave a turn. Shape: least and greatest angle of the joint, rad. A ripple
/// of one wave a turn is the same torque: there it is a balancer, with the ripple as its rival.
pub(super) struct Balancer;

/// The same lever with a force that changes with the stroke (gas, a bent lever): the sine of the angle from the dead centre times a force
/// with a wave of its own. Shape: the dead centre and the ends of the search for it, a turn more than they are, so that they are positive;
/// least and greatest angle; rad.
pub(super) struct GasSpring;

/// Dead centres that are tried over half a turn: half a turn on it is the same with the other sign.
const CENTRES: usize = 8;
/// Angles at which the force is looked at.
const CHECKED: usize = 8;

/// Least and greatest angle of the joint that arms balance; none of an arm without it.
fn range(scene: &DynamicScene) -> Option<[f64; 2]> {
    let angles = scene.position.get(BALANCED)?.iter();
    Some(angles.fold([f64::MAX, f64::MIN], |[a, b], q| [a.min(*q), b.max(*q)]))
}

/// A sentence of a spring whose torque is -size sin(q - zero).
fn statement(form: &TorqueForm, size: f64, zero: f64) -> String {
    format!(
        "a balancing spring acts on {} with up to {size:.3} Nm; it pulls towards {:.0} deg",
        form.place,
        zero.to_degrees()
    )
}

impl TorqueCause for Balancer {
    about! {
        name: SPRING_BALANCE_NAME,
        coefficients: &[("cosine", "Nm"), ("sine", "Nm")],
        of_angle: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let form = |range: [f64; 2]| TorqueForm::at_joint(&Balancer, BALANCED, 2).shaped(&range);
        range(scene).into_iter().map(form).collect()
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
        if column == 0 {
            fill(out, |row| angle[row].cos());
        } else {
            fill(out, |row| angle[row].sin());
        }
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 2
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let (cosine, sine) = (fitted[0].value, fitted[1].value);
        statement(form, cosine.hypot(sine), cosine.atan2(-sine))
    }
}

impl TorqueCause for GasSpring {
    about! {
        name: SPRING_BALANCE_NAME,
        coefficients: &[("force", "Nm"), ("force_by_sine", "Nm"), ("force_by_cosine", "Nm")],
        of_angle: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let of = |[least, most]: [f64; 2]| {
            (0..CENTRES).map(move |number| {
                let centre = TAU - FRAC_PI_2 + PI * number as f64 / CENTRES as f64;
                let shape = [centre, TAU - PI, TAU + PI, least, most];
                TorqueForm::at_joint(&GasSpring, BALANCED, 3).shaped(&shape)
            })
        };
        range(scene).into_iter().flat_map(of).collect()
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        vec![ShapeSpan {
            name: "dead_centre",
            unit: "rad",
            index: 0,
            least: form.shape[1],
            most: form.shape[2],
            by_ratio: false,
            usual: None,
        }]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let (angle, centre) = (&scene.position[form.joint()], form.shape[0]);
        fill(out, |row| {
            let (sine, cosine) = (angle[row] - centre).sin_cos();
            sine * [1.0, sine, cosine][column]
        });
    }

    /// A spring pushes one way wherever the joint moves.
    fn is_possible(&self, form: &TorqueForm, values: &[f64]) -> bool {
        let (&[_, _, _, least, most], &[mean, by_sine, by_cosine]) = (&form.shape[..], values)
        else {
            return true;
        };
        let is_same_way = |k: usize| {
            let q = least + (most - least) * k as f64 / CHECKED as f64 - form.shape[0];
            (mean + by_sine * q.sin() + by_cosine * q.cos()) * mean > 0.0
        };
        (0..=CHECKED).all(is_same_way)
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 5
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let force = fitted[0].value;
        // It pulls towards where its torque falls through zero.
        let turned = form.shape[0] + if force > 0.0 { PI } else { 0.0 };
        statement(form, force.abs(), turned.sin().atan2(turned.cos()))
    }
}

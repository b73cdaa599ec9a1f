//! A base that does not stand as declared.

use super::{FittedNumber, TorqueCause, TorqueForm, about, shape};
use crate::dynamics::scene::{DynamicScene, GRAVITY};
use crate::dynamics::types::TorqueParameter;
use crate::effect::Place;

/// Gravity from the side, along x and y of the base.
pub(super) struct GravityDirection;

impl TorqueCause for GravityDirection {
    about! {
        name: "gravity_direction",
        coefficients: &[("side_x", "1"), ("side_y", "1")],
        price: 4.0,
        rich: true,
        inertial: true,
        of_rigid: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let form = TorqueForm {
            place: Place::Base,
            ..TorqueForm::at_joint(&GravityDirection, 0, 2)
        };
        if scene.declared.is_some() {
            vec![form]
        } else {
            Vec::new()
        }
    }

    fn write(
        &self,
        _form: &TorqueForm,
        scene: &DynamicScene,
        joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        out.copy_from_slice(&scene.sideways[column][joint]);
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let (angle, sigma) = tilt(fitted);
        vec![
            TorqueParameter {
                name: "tilt".into(),
                value: angle.to_degrees(),
                unit: "deg",
                sigma: Some(sigma.to_degrees()),
            },
            shape(
                "azimuth",
                fitted[1].value.atan2(fitted[0].value).to_degrees(),
                "deg",
            ),
        ]
    }

    fn statement(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let azimuth = fitted[1].value.atan2(fitted[0].value).to_degrees();
        let side = GRAVITY * fitted[0].value.hypot(fitted[1].value);
        format!(
            "the base is tilted by {:.2} deg: gravity pulls towards {azimuth:.0} deg of its plane with {side:.3} m/s2",
            tilt(fitted).0.to_degrees()
        )
    }
}

/// rad, with its standard deviation.
fn tilt(fitted: &[FittedNumber]) -> (f64, f64) {
    let side = fitted[0].value.hypot(fitted[1].value);
    let sigma = (fitted[0].value * fitted[0].sigma).hypot(fitted[1].value * fitted[1].sigma)
        / side.max(f64::MIN_POSITIVE);
    (side.min(1.0).asin(), sigma)
}

//! A link whose centre of mass is elsewhere.

use super::{FittedNumber, TorqueCause, TorqueForm, about, at_each_link, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Displacement of the centre, in three coordinates.
pub(super) struct WrongLinkCentre;

const WIDTH: usize = 3;
/// m: farther off is no error of a declaration.
const FARTHEST: f64 = 0.2;

impl TorqueCause for WrongLinkCentre {
    about! { name: "link_com", price: 8.0, inertial: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_link(&WrongLinkCentre, scene, WIDTH)
    }

    fn is_possible(&self, _form: &TorqueForm, values: &[f64]) -> bool {
        values.iter().all(|shift| shift.abs() < FARTHEST)
    }

    fn inertial(
        &self,
        form: &TorqueForm,
        declared: &DeclaredInertials,
    ) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        Some(
            declared.centre_shift[form.link()]
                .iter()
                .map(|ten| (form.link(), *ten))
                .collect(),
        )
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let in_mm = |number: &FittedNumber| FittedNumber {
            value: 1e3 * number.value,
            sigma: 1e3 * number.sigma,
        };
        ["centre_x", "centre_y", "centre_z"]
            .iter()
            .zip(fitted)
            .map(|(name, number)| plain(name, in_mm(number), "mm"))
            .collect()
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let [x, y, z] = [0, 1, 2].map(|axis| 1e3 * fitted[axis].value);
        format!(
            "the centre of mass of {} is ({x:.1}, {y:.1}, {z:.1}) mm from where it is declared",
            form.place
        )
    }
}

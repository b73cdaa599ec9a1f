//! A link whose inertia is not the declared one.

use super::{FittedNumber, TorqueCause, TorqueForm, about, at_each_link, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Six numbers about the joint's point.
pub(super) struct WrongLinkInertia;

const WIDTH: usize = 6;

impl TorqueCause for WrongLinkInertia {
    about! { name: "link_inertia", price: 8.0, inertial: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_link(&WrongLinkInertia, scene, WIDTH)
    }

    fn inertial(
        &self,
        form: &TorqueForm,
        _declared: &DeclaredInertials,
    ) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        let unit =
            |number: usize| std::array::from_fn(|entry| f64::from(u8::from(entry == 4 + number)));
        Some(
            (0..WIDTH)
                .map(|number| (form.link(), unit(number)))
                .collect(),
        )
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let names = [
            "inertia_xx",
            "inertia_xy",
            "inertia_xz",
            "inertia_yy",
            "inertia_yz",
            "inertia_zz",
        ];
        names
            .iter()
            .zip(fitted)
            .map(|(name, value)| plain(name, *value, "kg m2"))
            .collect()
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let largest = fitted
            .iter()
            .map(|number| number.value)
            .max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or(0.0);
        format!(
            "the inertia of {} is off, by up to {largest:.3} kg m2",
            form.place
        )
    }
}

//! A payload that is not the declared one.

use super::{Fitted, TorqueCause, TorqueForm, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;
use crate::effect::Place;

/// Mass at the declared centre; mass and centre; all ten numbers.
pub(super) struct Payload;

const WIDTHS: [usize; 3] = [1, 4, INERTIAL_NUMBERS];

impl TorqueCause for Payload {
    fn name(&self) -> &'static str {
        "payload_error"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let form = |width| TorqueForm { place: Place::Tool, ..TorqueForm::at_joint(&Payload, 0, width) };
        if scene.declared.is_some() { WIDTHS.map(form).to_vec() } else { Vec::new() }
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        4.0
    }

    fn acts_on(&self, _form: &TorqueForm, joints: usize) -> Vec<usize> {
        (0..joints).collect()
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn is_inertial(&self) -> bool {
        true
    }

    fn write(&self, _form: &TorqueForm, _scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        out.fill(0.0);
    }

    fn inertial(&self, form: &TorqueForm, declared: &DeclaredInertials) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        let last = declared.tolerance.len() - 1;
        let unit = |number: usize| std::array::from_fn(|entry| f64::from(u8::from(entry == number)));
        let column = |number: usize| if number == 0 && form.width < INERTIAL_NUMBERS { declared.payload } else { unit(number) };
        Some((0..form.width).map(|number| (last, column(number))).collect())
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[Fitted]) -> Vec<TorqueParameter> {
        let names = [
            "mass",
            "moment_x",
            "moment_y",
            "moment_z",
            "inertia_xx",
            "inertia_xy",
            "inertia_xz",
            "inertia_yy",
            "inertia_yz",
            "inertia_zz",
        ];
        let unit = |number: usize| ["kg", "kg m", "kg m2"][usize::from(number > 0) + usize::from(number > 3)];
        (0..form.width).map(|number| plain(names[number], fitted[number], unit(number))).collect()
    }

    fn statement(&self, form: &TorqueForm, fitted: &[Fitted]) -> String {
        let mass = fitted[0].value;
        let more = if mass >= 0.0 { "more" } else { "less" };
        let centre = if form.width > 1 { ", its centre elsewhere" } else { "" };
        format!("the payload is {:.2} kg {more} than declared{centre}", mass.abs())
    }
}

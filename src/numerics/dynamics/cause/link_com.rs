//! A link whose centre of mass is elsewhere.

use super::{Fitted, TorqueCause, TorqueForm, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;
use crate::effect::Place;

/// Mass times centre, in three coordinates.
pub(super) struct LinkCom;

const WIDTH: usize = 3;

impl TorqueCause for LinkCom {
    fn name(&self) -> &'static str {
        "link_com"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let links = if scene.declared.is_some() { scene.joints() } else { 0 };
        let form = |link| TorqueForm { place: Place::Links(link, link), ..TorqueForm::at_joint(&LinkCom, link, WIDTH) };
        (0..links).map(form).collect()
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        8.0
    }

    fn acts_on(&self, form: &TorqueForm, _joints: usize) -> Vec<usize> {
        (0..=form.link()).collect()
    }

    fn is_inertial(&self) -> bool {
        true
    }

    fn write(&self, _form: &TorqueForm, _scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        out.fill(0.0);
    }

    fn inertial(&self, form: &TorqueForm, _declared: &DeclaredInertials) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        let unit = |axis: usize| std::array::from_fn(|entry| f64::from(u8::from(entry == 1 + axis)));
        Some((0..WIDTH).map(|axis| (form.link(), unit(axis))).collect())
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[Fitted]) -> Vec<TorqueParameter> {
        ["moment_x", "moment_y", "moment_z"].iter().zip(fitted).map(|(name, value)| plain(name, *value, "kg m")).collect()
    }

    fn statement(&self, form: &TorqueForm, fitted: &[Fitted]) -> String {
        let [x, y, z] = [fitted[0].value, fitted[1].value, fitted[2].value];
        format!("the centre of {} is off: mass times displacement is ({x:.2}, {y:.2}, {z:.2}) kg m", form.place)
    }
}

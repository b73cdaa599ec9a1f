//! A link that is heavier or lighter than declared.

use super::{FittedNumber, TorqueCause, TorqueForm, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;
use crate::effect::Place;

/// All its numbers in proportion.
pub(super) struct HeavierLink;

const WIDTH: usize = 1;

impl TorqueCause for HeavierLink {
    fn name(&self) -> &'static str {
        "link_mass"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let links = if scene.declared.is_some() { scene.joints() } else { 0 };
        let form = |link| TorqueForm { place: Place::Links(link, link), ..TorqueForm::at_joint(&HeavierLink, link, WIDTH) };
        (0..links).map(form).collect()
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        6.0
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

    fn inertial(&self, form: &TorqueForm, declared: &DeclaredInertials) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        let own = &declared.links[INERTIAL_NUMBERS * form.link()..];
        Some(vec![(form.link(), std::array::from_fn(|number| own[number]))])
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("relative", fitted[0], "1")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("{} weighs {:+.1} % against what is declared", form.place, 100.0 * fitted[0].value)
    }
}

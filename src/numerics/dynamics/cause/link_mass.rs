//! A link that is heavier or lighter than declared.

use super::{FittedNumber, TorqueCause, TorqueForm, about, at_each_link, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// All its numbers in proportion.
pub(super) struct HeavierLink;

const WIDTH: usize = 1;
/// Share of the declared mass: what errs by more is no error of a declaration.
const LEAST: f64 = -0.7;
const MOST: f64 = 1.0;

impl TorqueCause for HeavierLink {
    about! { name: "link_mass", inertial: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_link(&HeavierLink, scene, WIDTH)
    }

    fn is_possible(&self, _form: &TorqueForm, values: &[f64]) -> bool {
        (LEAST..=MOST).contains(&values[0])
    }

    fn inertial(
        &self,
        form: &TorqueForm,
        declared: &DeclaredInertials,
    ) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        let own = &declared.links[INERTIAL_NUMBERS * form.link()..];
        Some(vec![(
            form.link(),
            std::array::from_fn(|number| own[number]),
        )])
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("relative", fitted[0], "1")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!(
            "{} weighs {:+.1} % against what is declared",
            form.place,
            100.0 * fitted[0].value
        )
    }
}

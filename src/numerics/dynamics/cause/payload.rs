//! A payload that is not the declared one.

use super::{FittedNumber, TorqueCause, TorqueForm, about, plain};
use crate::dynamics::inertials::DeclaredInertials;
use crate::dynamics::newton_euler::INERTIAL_NUMBERS;
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;
use crate::effect::Place;

/// Mass at the declared centre; mass and centre; all ten numbers.
pub(super) struct Payload;

/// kg: less is nothing to have a centre.
const LIGHTEST: f64 = 0.1;
/// m by which its centre is elsewhere, at most.
const FARTHEST: f64 = 0.5;
/// Changes of the last link's numbers but the mass.
const OTHERS: [&str; 9] = [
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
const WIDTHS: [usize; 3] = [1, 4, INERTIAL_NUMBERS];

impl TorqueCause for Payload {
    about! { name: "payload_error", price: 4.0, rich: true, inertial: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let mass = scene.arm.payload.map_or(0.0, |payload| payload.mass);
        let form = |width| TorqueForm {
            place: Place::Tool,
            ..TorqueForm::at_joint(&Payload, 0, width).shaped(&[mass])
        };
        if scene.declared.is_some() {
            WIDTHS.map(form).to_vec()
        } else {
            Vec::new()
        }
    }

    fn is_possible(&self, form: &TorqueForm, values: &[f64]) -> bool {
        let whole = form.shape[0] + values[0];
        let centred = form.width == INERTIAL_NUMBERS
            || values[1..]
                .iter()
                .all(|moment| moment.abs() < FARTHEST * whole.max(LIGHTEST));
        whole > -LIGHTEST && centred
    }

    fn inertial(
        &self,
        form: &TorqueForm,
        declared: &DeclaredInertials,
    ) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        let last = declared.tolerance.len() - 1;
        let unit =
            |number: usize| std::array::from_fn(|entry| f64::from(u8::from(entry == number)));
        let column = |number: usize| match number {
            _ if form.width == INERTIAL_NUMBERS => unit(number),
            0 => declared.payload,
            axis => declared.payload_shift[axis - 1],
        };
        Some(
            (0..form.width)
                .map(|number| (last, column(number)))
                .collect(),
        )
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let mut all = vec![plain("mass", fitted[0], "kg")];
        // What a payload without its mass would be at: the moment that is found, of all the mass that is there.
        let whole = (form.shape[0] + fitted[0].value).abs().max(LIGHTEST);
        for (name, number) in ["centre_x", "centre_y", "centre_z"]
            .iter()
            .zip(&fitted[1..])
            .filter(|_| form.width < INERTIAL_NUMBERS)
        {
            all.push(plain(
                name,
                FittedNumber {
                    value: 1e3 * number.value / whole,
                    sigma: 1e3 * number.sigma / whole,
                },
                "mm",
            ));
        }
        if form.width == INERTIAL_NUMBERS {
            all.extend(OTHERS.iter().zip(&fitted[1..]).map(|(name, number)| {
                plain(
                    name,
                    *number,
                    if name.starts_with('m') {
                        "kg m"
                    } else {
                        "kg m2"
                    },
                )
            }));
        }
        all
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let mass = fitted[0].value;
        let more = if mass >= 0.0 { "more" } else { "less" };
        let centre = if form.width > 1 {
            ", its centre elsewhere"
        } else {
            ""
        };
        format!(
            "the payload is {:.2} kg {more} than declared{centre}",
            mass.abs()
        )
    }
}

//! What identifications make of poses measured more than once: weights by the joints' repeatability, and words for the person.

use crate::error::{Place, counted};
use crate::estimate::{Model, Poses, Repeated, spread};
use crate::robot::{Measurements, NoiseBasis};
use crate::stage::Context;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How well joints come back to where they were; rows far out on the arm weigh less for it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Repeatability {
    /// Estimated, where the recording returns to poses.
    #[default]
    Measured,
    /// Not taken into account.
    Ignored,
    /// One standard deviation of every revolute joint, arcsec.
    Arcsec(f64),
}

/// rad per arcsec.
const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

impl Repeatability {
    pub fn faults(&self, at: &mut Place) {
        let possible = !matches!(self, Self::Arcsec(sigma) if !(*sigma > 0.0 && sigma.is_finite()));
        at.at("repeatability").must(
            possible,
            "expected `measured`, `ignored`, or a figure above zero, e.g. {arcsec: 3}",
        );
    }

    /// Gives every row the covariance that the joints make of it; the standard deviation of a joint (rad), where one is known.
    pub fn apply(
        &self,
        model: &Model,
        data: &mut Measurements,
        rows: &[usize],
        context: &Context,
    ) -> Option<f64> {
        let sigma = match self {
            Self::Ignored => None,
            Self::Arcsec(sigma) => Some(sigma * ARCSEC),
            Self::Measured => Poses::of(data, rows).joint_repeatability(model, data).inspect(|sigma| {
                let arcsec = sigma / ARCSEC;
                context.note(format!("joints return to a pose to {arcsec:.1} arcsec each (one sigma): rows are weighted by it"));
            }),
        };
        data.spread = sigma.map(|sigma| spread(model, data, sigma));
        if sigma.is_some() && *self == Self::Measured {
            data.noise_basis = NoiseBasis::Repeats;
        }
        sigma
    }
}

/// Below this chance of a complete model doing as badly the model lacks something.
const UNLIKELY: f64 = 0.01;

/// Notes for the person on what repeats say against the fit.
pub fn note(context: &Context, repeated: &Repeated) {
    let Repeated {
        poses,
        noise,
        freedom,
        revisited,
        lack_of_fit,
    } = repeated;
    let what = if *revisited {
        "noise and repeatability"
    } else {
        "noise (the arm stood still: no word on repeatability)"
    };
    let floor = noise * 1e3;
    let mut line = format!(
        "measured more than once: {}, {floor:.3} mm per axis of {what}, {} of freedom",
        counted(poses, "pose"),
        counted(freedom, "degree")
    );
    if let Some((ratio, chance)) = lack_of_fit {
        line += &if *chance < UNLIKELY {
            format!(
                "; the residual between poses is {ratio:.1} times that in mean square: this model lacks something"
            )
        } else {
            format!(
                "; the residual between poses is no larger (F {ratio:.2}, p {chance:.2}): no lack of fit shows"
            )
        };
    }
    context.note(line);
}

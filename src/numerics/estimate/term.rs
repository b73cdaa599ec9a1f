//! A term of the problem: what one row measured of one kind, in standard deviations, with Huber's loss.

use crate::effect::PlacedRow;
use crate::observation::{
    ExcessSigma, MeasurementKind, Residual, ResidualNumbers, Sensitivity, WIDEST,
};
use crate::robot::Measurements;
use crate::statistics::MEDIAN_CHI2;

/// Beyond this whitened error length (99.3 % of good terms of one, two, three ... numbers are below) a term pulls with constant force.
const HUBER_BY_AXES: [f64; WIDEST + 1] =
    [f64::INFINITY, 2.7, 3.15, HUBER, 3.75, 4.0, 4.2, 4.4, 4.6];
pub(crate) const HUBER: f64 = 3.5;

/// Weighted residual and derivatives of one kind in one row.
pub(crate) struct ObservationTerm {
    /// Measured - predicted in standard deviations.
    pub error: ResidualNumbers,
    pub axes: usize,
    sensitivity: Sensitivity,
}

impl ObservationTerm {
    /// With `excess` beside the measurement's own noise. `None` where the row measured none.
    pub fn of(
        kind: &'static dyn MeasurementKind,
        data: &Measurements,
        row: usize,
        placed: &PlacedRow,
        excess: ExcessSigma,
    ) -> Option<(Self, Residual)> {
        let residual = Residual::of(kind, data, row, placed)?;
        let weight = residual.weight(data, excess.of(residual.dimension()));
        let error = weight.whiten(&residual.error);
        let sensitivity = residual.sensitivity(data, placed, weight);
        Some((
            Self {
                error,
                axes: residual.axes,
                sensitivity,
            },
            residual,
        ))
    }

    /// Root of Huber's weight: the share by which errors and derivatives count.
    pub fn share(&self) -> f64 {
        share(self.error.norm(), self.axes)
    }

    /// Derivatives of what was predicted, in standard deviations per unit of the parameter.
    pub fn derivatives(&self, placed: &mut PlacedRow, emit: impl FnMut(usize, &[f64])) {
        self.sensitivity.derivatives(placed, emit);
    }
}

/// Root of Huber's weight of an error of so many axes, in standard deviations.
pub(crate) fn share(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error > bound {
        (bound / error).sqrt()
    } else {
        1.0
    }
}

/// Where Huber's loss turns linear for a term of so many axes.
pub(crate) fn bound(axes: usize) -> f64 {
    HUBER_BY_AXES[axes]
}

pub(crate) fn huber(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error <= bound {
        0.5 * error * error
    } else {
        bound * (error - 0.5 * bound)
    }
}

/// By what a squared error of so many axes is to be multiplied to have the median of three.
pub(crate) fn as_of_three(axes: usize) -> f64 {
    MEDIAN_CHI2[3] / MEDIAN_CHI2[axes]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{EffectContext, EffectStack, Load, arm_effect};
    use crate::estimate::Model;
    use crate::observation::{Dimension, KindDescription, Rank, Weight};
    use crate::robot::{Readings, small_arm};
    use crate::spatial::Pose;
    use nalgebra::Vector3;

    const SIGMA: f64 = 1e-5;

    /// How far a point lies along five lines.
    struct FiveLines;

    const LINES: [[f64; 3]; 5] = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.6, 0.8, 0.0],
        [0.0, 0.6, -0.8],
    ];

    static ABOUT: KindDescription = KindDescription {
        name: "five_lines",
        word: "lines",
        dimension: Dimension::Length,
        axes: 5,
        columns: &[],
        own_sigma: true,
        rank: Rank {
            places: true,
            rotations: false,
            scale: true,
            blind: [0, 0],
        },
        is_screened: false,
    };

    impl MeasurementKind for FiveLines {
        fn about(&self) -> &'static KindDescription {
            &ABOUT
        }

        fn residual(
            &self,
            data: &Measurements,
            row: usize,
            placed: &PlacedRow,
        ) -> Option<(ResidualNumbers, f64)> {
            let reading = self.reading(data, row)?;
            let left = |k: usize| reading.values[k] - Vector3::from(LINES[k]).dot(&placed.point);
            Some((
                ResidualNumbers::new([0, 1, 2, 3, 4].map(left)),
                reading.sigma * reading.sigma,
            ))
        }

        fn sensitivity(
            &self,
            _data: &Measurements,
            _row: usize,
            _placed: &PlacedRow,
            weight: Weight,
        ) -> Sensitivity {
            Sensitivity::Lines(
                LINES
                    .iter()
                    .map(|line| weight.apply(&Vector3::from(*line)))
                    .collect(),
            )
        }
    }

    #[test]
    fn a_kind_of_more_than_three_numbers_has_a_residual_as_wide_and_its_own_partials() {
        let robot = small_arm();
        let base = Pose::identity();
        let effects = vec![
            arm_effect(
                "joint_offset",
                &EffectContext {
                    base,
                    load: Load::GravityTorque,
                },
            )
            .expect("a cause"),
        ];
        let mut model = Model::nominal(robot.clone(), EffectStack::new(&robot, base, effects));
        let readings = Readings {
            kind: "five_lines",
            width: 5,
            values: vec![0.1; 5],
            sigma: vec![SIGMA],
            anchor: None,
        };
        let data = Measurements {
            joints: 2,
            q: vec![0.3, -0.4],
            payload: vec![0.0],
            readings: vec![readings],
            ..Measurements::default()
        };
        let excess = ExcessSigma {
            length: 2e-5,
            angle: 0.0,
        };
        let seen = |model: &Model| -> (Vec<f64>, usize, Vec<Vec<f64>>) {
            let mut scratch = model.stack.scratch(&model.robot);
            let mut placed = model.place(&data, 0, &mut scratch);
            let (term, residual) =
                ObservationTerm::of(&FiveLines, &data, 0, &placed, excess).expect("was measured");
            let mut partials = vec![vec![0.0; 5]; model.x.len()];
            term.derivatives(&mut placed, |k, own| {
                partials[k]
                    .iter_mut()
                    .zip(own)
                    .for_each(|(sum, value)| *sum += value)
            });
            assert_eq!((residual.error.len(), residual.axes), (5, 5));
            let whitened = SIGMA.hypot(excess.length).recip();
            assert!(
                term.error
                    .iter()
                    .zip(residual.error.iter())
                    .all(|(a, b)| (a - b * whitened).abs() < 1e-9 * a.abs())
            );
            (term.error.to_vec(), term.axes, partials)
        };
        let (_, _, partials) = seen(&model);
        for (k, partial) in partials.iter().enumerate() {
            let mut at = |x: f64| {
                model.x[k] = x;
                seen(&model).0
            };
            let (above, below) = (at(1e-6), at(-1e-6));
            model.x[k] = 0.0;
            for line in 0..5 {
                // Measured less predicted falls as the prediction grows.
                let difference = (below[line] - above[line]) / 2e-6;
                assert!(
                    (difference - partial[line]).abs() < 1e-4 * (1.0 + difference.abs()),
                    "{k} {line}: {difference}"
                );
            }
        }
        assert!(partials.iter().flatten().any(|value| value.abs() > 1e3));
    }
}

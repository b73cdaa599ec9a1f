//! What torques along a motion tell of base parameters and friction: the information matrix under white noise.

use super::super::arm::{DynamicArm, INERTIAL_NUMBERS};
use super::super::clock::RecordingClock;
use super::super::newton_euler::InverseDynamics;
use super::super::reduce::{ReducedRegressor, Reduction};
use super::super::scene::{DynamicScene, split};
use super::series::{JointSeries, SeriesBasis};
use crate::reduce::base_parameters;
use crate::types::TorqueRecording;
use nalgebra::{DMatrix, DVector};

/// rad/s over which the sign of a velocity turns.
const SIGN_WIDTH: f64 = 0.01;
/// Hz.
const CUTOFF: f64 = 5.0;
/// Share of a column's information that is added to the diagonal, so that what is not seen at all is infinitely bad only in proportion.
const FLOOR: f64 = 1e-12;

/// Whose parameters, and how noisy torques are.
pub(super) struct Information<'a> {
    pub(crate) arm: &'a DynamicArm,
    /// Base parameters, `10 link + number`.
    pub(crate) base: &'a [usize],
    /// Nm, per joint.
    pub(crate) noise: &'a [f64],
}

/// The information of a motion, scaled to ones on the diagonal, and the scales.
pub(super) struct MotionInformation {
    scaled: DMatrix<f64>,
    scale: DVector<f64>,
}

/// Base parameters of an arm, from a motion that moves all joints.
pub(super) fn base_of(arm: &DynamicArm, basis: &SeriesBasis, series: &JointSeries) -> Vec<usize> {
    let (n, motion) = (arm.joints(), basis.motion(series));
    let recording = TorqueRecording::of_motion(n, motion.time, motion.position);
    let clock = RecordingClock::even(&recording.time);
    let scene = DynamicScene::new(arm, &recording, &clock, CUTOFF, true);
    base_parameters(&ReducedRegressor::of(
        &scene,
        &Reduction::new(&clock, CUTOFF),
    ))
}

impl Information<'_> {
    /// The information of some rows of a motion, each standing for `share` recorded ones.
    pub(crate) fn of(
        &self,
        basis: &SeriesBasis,
        series: &JointSeries,
        rows: &[usize],
        share: f64,
    ) -> MotionInformation {
        let (n, masses) = (self.arm.joints(), self.base.len());
        let width = masses + 2 * n;
        let mut place = vec![None; INERTIAL_NUMBERS * n];
        self.base
            .iter()
            .enumerate()
            .for_each(|(column, number)| place[*number] = Some(column));
        let mut regressor = DMatrix::<f64>::zeros(n * rows.len(), width);
        let mut dynamics = InverseDynamics::new(self.arm);
        let mut motion = vec![0.0; 3 * n];
        for (count, row) in rows.iter().enumerate() {
            basis.row_into(series, *row, &mut motion);
            let first = n * count;
            dynamics.regressor(
                split(&motion, n),
                &self.arm.gravity,
                |joint, link, numbers| {
                    for (number, value) in numbers.iter().enumerate() {
                        if let Some(column) = place[INERTIAL_NUMBERS * link + number] {
                            regressor[(first + joint, column)] = value / self.noise[joint];
                        }
                    }
                },
            );
            for joint in 0..n {
                let velocity = motion[n + joint];
                regressor[(first + joint, masses + 2 * joint)] = velocity / self.noise[joint];
                regressor[(first + joint, masses + 2 * joint + 1)] =
                    (velocity / SIGN_WIDTH).tanh() / self.noise[joint];
            }
        }
        let whole = regressor.tr_mul(&regressor) * share;
        let scale = DVector::from_fn(width, |column, _| {
            whole[(column, column)].sqrt().max(f64::MIN_POSITIVE)
        });
        let scaled = DMatrix::from_fn(width, width, |a, b| {
            let value = whole[(a, b)] / (scale[a] * scale[b]);
            if a == b { value + FLOOR } else { value }
        });
        MotionInformation { scaled, scale }
    }
}

impl MotionInformation {
    /// Natural logarithm of the determinant; minus infinity where something is not seen.
    pub(crate) fn log_determinant(&self) -> f64 {
        let scales: f64 = self.scale.iter().map(|scale| 2.0 * scale.ln()).sum();
        let factor = self.scaled.clone().cholesky();
        factor.map_or(f64::NEG_INFINITY, |factor| {
            scales
                + 2.0
                    * factor
                        .l()
                        .diagonal()
                        .iter()
                        .map(|value| value.ln())
                        .sum::<f64>()
        })
    }

    /// How many times other parameters raise the variance of each.
    pub(crate) fn inflations(&self) -> Vec<f64> {
        let inverse = self
            .scaled
            .clone()
            .cholesky()
            .map(|factor| factor.inverse());
        let width = self.scale.len();
        inverse.map_or_else(
            || vec![f64::INFINITY; width],
            |inverse| inverse.diagonal().iter().copied().collect(),
        )
    }

    /// One standard deviation of each parameter.
    pub(crate) fn sigmas(&self) -> Vec<f64> {
        self.inflations()
            .iter()
            .zip(&self.scale)
            .map(|(inflation, scale)| inflation.sqrt() / scale)
            .collect()
    }

    /// Condition of the regressor with columns of one length.
    pub(crate) fn condition(&self) -> f64 {
        let values = self.scaled.symmetric_eigenvalues();
        (values.max() / values.min().max(f64::MIN_POSITIVE)).sqrt()
    }
}

//! The recording as the present model sees it: whitened residuals, and how any form of an effect would move them.
//!
//! Residual rows are in standard deviations: three a row of the recording for the measured point, then one for each usable motor current.

mod autocorrelated;
mod currents;
mod travel;

use crate::effect::{Deflection, Effect, Form, PointMotion};
use crate::estimate::{Model, Prior, Weight};
use crate::robot::{Measurements, RobotModel};
pub(crate) use autocorrelated::AutocorrelatedNoise;
use autocorrelated::Innovations;
use currents::Currents;
use faer::Mat;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Fitted rows through the present model.
pub(crate) struct WhitenedProblem<'a> {
    pub robot: &'a RobotModel,
    pub data: &'a Measurements,
    /// Rows of the recording, ascending.
    pub rows: Vec<usize>,
    motions: Vec<PointMotion>,
    weights: Vec<Weight>,
    currents: Option<Currents>,
    /// What a standard deviation of a current counts: that of the points as they are left by the model.
    current_weight: f64,
    /// What each row says beyond those before it, where noise is correlated.
    innovations: Option<Innovations>,
    model: &'a Model,
    /// Columns of a unit travel of each joint.
    travels: OnceLock<Vec<Vec<f64>>>,
    /// Whitened measured - predicted.
    pub residual: Vec<f64>,
}

impl<'a> WhitenedProblem<'a> {
    /// Of measured points alone.
    pub fn new(model: &'a Model, data: &'a Measurements, rows: Vec<usize>) -> Self {
        let motions: Vec<PointMotion> = rows
            .par_iter()
            .map_init(
                || model.stack.scratch(&model.robot),
                |scratch, row| model.stack.point_motion(&model.robot, data, *row, &model.x, scratch),
            )
            .collect();
        let weights: Vec<Weight> = rows.iter().map(|row| Weight::of(data, *row, 0.0)).collect();
        let mut residual = Vec::with_capacity(3 * rows.len());
        for ((motion, weight), row) in motions.iter().zip(&weights).zip(&rows) {
            residual.extend(weight.apply(&(data.position[*row] - motion.point)).iter());
        }
        let current_weight = (residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64).sqrt();
        Self {
            robot: &model.robot,
            data,
            rows,
            residual,
            motions,
            weights,
            currents: None,
            current_weight,
            innovations: None,
            model,
            travels: OnceLock::new(),
        }
    }

    /// With the motor currents, which say something where a joint yields to torques.
    pub fn with_currents(mut self) -> Self {
        self.currents = Currents::new(self.robot, self.data, &self.rows, &self.motions);
        self.residual.extend(self.currents.iter().flat_map(Currents::whitened).map(|value| value * self.current_weight));
        self
    }

    /// With autocorrelated noise: all columns become innovations.
    pub fn with_autocorrelation(mut self, noise: AutocorrelatedNoise) -> Self {
        let (innovations, points) = (noise.filter(&self.rows), self.points());
        innovations.apply(&mut self.residual[..points]);
        self.innovations = Some(innovations);
        self
    }

    /// Takes a column's points to their innovations.
    fn innovate(&self, column: &mut [f64]) {
        if let Some(innovations) = &self.innovations {
            innovations.apply(&mut column[..3 * self.rows.len()]);
        }
    }

    fn points(&self) -> usize {
        3 * self.rows.len()
    }

    /// Residuals of the points, three a row.
    pub fn of_points(&self) -> &[f64] {
        &self.residual[..self.points()]
    }

    pub fn residual_rows(&self) -> usize {
        self.residual.len()
    }

    /// The place in `rows` of a residual row.
    pub fn row_of(&self, residual_row: usize) -> usize {
        match &self.currents {
            Some(currents) if residual_row >= self.points() => (residual_row - self.points()) / currents.joints.len(),
            _ => residual_row / 3,
        }
    }

    /// Load torques (Nm), row-major.
    pub fn torques(&self) -> Vec<f64> {
        self.motions.iter().flat_map(|motion| motion.posture.torque.iter().copied()).collect()
    }

    /// Motion of each row's point by each joint, m/rad; row-major.
    pub fn by_joint(&self, row: usize) -> &[Vector3<f64>] {
        &self.motions[row].by_joint
    }

    /// The largest motion of the point by each joint, m/rad.
    pub fn reach(&self) -> Vec<f64> {
        let joints = 0..self.robot.joints();
        joints.map(|j| self.motions.iter().map(|motion| motion.by_joint[j].norm()).fold(0.0, f64::max)).collect()
    }

    /// Columns of a form, one after another.
    pub fn columns(&self, form: &Form) -> Vec<f64> {
        let mut out = self.motions_by(form);
        out.chunks_mut(self.residual_rows().max(1)).for_each(|column| self.innovate(column));
        out
    }

    /// The same whether noise is correlated or not: whitened motions of the points per unit of each parameter.
    pub fn motions_by(&self, form: &Form) -> Vec<f64> {
        match self.travel(form) {
            Some((joint, values)) => self.travelled(joint, &values),
            None => self.motions_by_partials(form),
        }
    }

    /// Of any form, from its own partial derivatives.
    fn motions_by_partials(&self, form: &Form) -> Vec<f64> {
        let count = form.parameters(self.robot).len();
        let zeros = vec![0.0; count];
        let rows = self.residual_rows();
        let mut out = vec![0.0; count * rows];
        let mut buffer = Deflection::new(self.robot.joints());
        for (i, (motion, weight)) in self.motions.iter().zip(&self.weights).enumerate() {
            motion.derivatives(self.robot, self.data, form, &zeros, &mut buffer, |parameter, derivative| {
                let derivative = weight.apply(&derivative);
                for axis in 0..3 {
                    out[parameter * rows + 3 * i + axis] += derivative[axis];
                }
            });
            let Some(currents) = &self.currents else { continue };
            for (parameter, joint, rate) in buffer.loads() {
                if let Some(k) = currents.joints.iter().position(|usable| *usable == joint) {
                    let row = i * currents.joints.len() + k;
                    out[parameter * rows + self.points() + row] += rate * self.current_weight / currents.sigma_of(row);
                }
            }
        }
        out
    }

    /// Columns of some parameters of the model itself, and what each motor has of its own.
    pub fn jacobian(&self, free: &[usize]) -> Mat<f64> {
        let model = self.model;
        let mut column = vec![None; model.stack.specs().len()];
        for (j, parameter) in free.iter().enumerate() {
            column[*parameter] = Some(j);
        }
        let nuisances = self.currents.as_ref().map_or(0, Currents::nuisances);
        let mut out = Mat::zeros(self.residual_rows(), free.len() + nuisances);
        let mut scratch = model.stack.scratch(&model.robot);
        for (i, (row, weight)) in self.rows.iter().zip(&self.weights).enumerate() {
            model.stack.derivatives(&model.robot, self.data, *row, &model.x, &mut scratch, |parameter, derivative| {
                if let Some(j) = column[parameter] {
                    let derivative = weight.apply(&derivative);
                    for axis in 0..3 {
                        out[(3 * i + axis, j)] += derivative[axis];
                    }
                }
            });
        }
        for j in 0..free.len() {
            self.innovate(out.col_as_slice_mut(j));
        }
        if let Some(currents) = &self.currents {
            for row in 0..currents.residual_rows() {
                for k in 0..nuisances {
                    out[(self.points() + row, free.len() + k)] = currents.nuisance(row, k) * self.current_weight;
                }
            }
        }
        out
    }

    /// Values of some forms in the present model, zero where it has them not.
    fn present(&self, forms: &[&Form]) -> Vec<f64> {
        let value = |name: &String| {
            let specs = self.model.stack.specs();
            specs.iter().position(|spec| spec.name == *name).map_or(0.0, |k| self.model.x[k])
        };
        let names = forms.iter().flat_map(|form| form.parameters(self.robot)).map(|spec| spec.name);
        names.map(|name| value(&name)).collect()
    }

    /// What the currents alone say of the parameters of some forms; nothing where they say nothing.
    pub fn priors_by_currents(&self, forms: &[&Form]) -> Vec<Prior> {
        let Some(currents) = self.currents.as_ref().filter(|_| !forms.is_empty()) else { return Vec::new() };
        let rows = self.residual_rows();
        let all: Vec<f64> = forms.iter().flat_map(|form| self.columns(form)).collect();
        let columns: Vec<Vec<f64>> =
            all.chunks(rows).map(|c| c[self.points()..].iter().map(|value| value / self.current_weight).collect()).collect();
        // The residual is that of the present model; what is asked is the whole parameter, hence at zero where it is new.
        currents.priors(&columns, &self.present(forms)).unwrap_or_default()
    }
}

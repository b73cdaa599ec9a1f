//! The recording as the present model sees it: whitened residuals, and how any form of an effect would move them.
//!
//! Residual rows are in standard deviations: of every row of the recording as many as it has measured numbers, of whatever kinds, then one for
//! each usable motor current.
//!
//! Which residual rows hold what a row of the recording measured: as many as its kinds have numbers there.
//!
//! Columns of laws of a joint's travel: functions of the row times what a unit travel of the joint does. Most hypotheses are such, and
//! their columns and products follow from one number a row.

use crate::effect::{
    Basis, Deflection, Direction, EffectStack, Form, Law, Motion, PlacementBuffers, PointMotion,
    Term, Unknown, Variable,
};
use crate::estimate::{Model, Prior};
use crate::linear::{mean_square, shown_directions};
use crate::observation::{MeasurementKind, Residual, Sensitivity, kinds};
use crate::robot::{Measurements, RobotModel};
pub(crate) use crate::whitened::autocorrelated::AutocorrelatedNoise;
use crate::whitened::autocorrelated::Innovations;
use crate::whitened::currents::Currents;
use faer::Mat;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::OnceLock;

mod autocorrelated;
mod currents;

/// Fitted rows through the present model.
pub(crate) struct WhitenedProblem<'a> {
    pub(crate) robot: &'a RobotModel,
    pub(crate) data: &'a Measurements,
    /// Rows of the recording, ascending.
    pub(crate) rows: Vec<usize>,
    motions: Vec<PointMotion>,
    readings: ReadingLines,
    currents: Option<Currents>,
    /// What a standard deviation of a current counts: that of the points as they are left by the model.
    current_weight: f64,
    /// What each row says beyond those before it, where noise is correlated.
    innovations: Option<Innovations>,
    model: &'a Model,
    /// Columns of a unit travel of each joint.
    travels: OnceLock<Vec<Vec<f64>>>,
    /// Whitened measured - predicted.
    pub(crate) residual: Vec<f64>,
}

impl<'a> WhitenedProblem<'a> {
    /// The problem of what rows measured, without the motor currents.
    pub(crate) fn new(model: &'a Model, data: &'a Measurements, rows: Vec<usize>) -> Self {
        let kinds = kinds(data);
        let turns = kinds.iter().any(|kind| kind.about().rank.rotations);
        let look = |scratch: &mut PlacementBuffers, row: &usize| {
            let placed = model
                .stack
                .place(&model.robot, data, *row, &model.x, scratch);
            let seen = |kind: &&'static dyn MeasurementKind| {
                let residual = Residual::of(*kind, data, *row, &placed)?;
                let weight = residual.weight(data, 0.0);
                let (error, lines) = (weight.apply(&residual.error), kind.lines(data, *row));
                Some((
                    SeenReading {
                        kind: *kind,
                        lines,
                        sensitivity: residual.sensitivity(data, &placed, weight),
                    },
                    error,
                ))
            };
            let seen: Vec<(SeenReading, Vector3<f64>)> = kinds.iter().filter_map(seen).collect();
            let motion = if turns {
                EffectStack::target_motion
            } else {
                EffectStack::point_motion
            };
            (
                motion(&model.stack, &model.robot, data, *row, &model.x, scratch),
                seen,
            )
        };
        let scratch = || model.stack.scratch(&model.robot);
        let looked: Vec<_> = rows.par_iter().map_init(scratch, look).collect();
        let mut motions = Vec::with_capacity(rows.len());
        let mut residual = Vec::with_capacity(3 * rows.len());
        let mut readings = ReadingLines::default();
        for (motion, seen) in looked {
            motions.push(motion);
            let errors = seen.iter();
            let errors = errors.flat_map(|(one, error)| one.lines.iter().map(|line| error[*line]));
            residual.extend(errors);
            readings.push(seen.into_iter().map(|(reading, _)| reading).collect());
        }
        let current_weight = mean_square(&residual).sqrt();
        Self {
            robot: &model.robot,
            data,
            rows,
            residual,
            motions,
            readings,
            currents: None,
            current_weight,
            innovations: None,
            model,
            travels: OnceLock::new(),
        }
    }

    /// With the motor currents, which say something where a joint yields to torques.
    pub(crate) fn with_currents(mut self) -> Self {
        self.currents = Currents::new(self.robot, self.data, &self.rows, &self.motions);
        let whitened = self.currents.iter().flat_map(Currents::whitened);
        let weighed = whitened.map(|value| value * self.current_weight);
        self.residual.extend(weighed);
        self
    }

    /// With autocorrelated noise: all columns become innovations. Of rows that measured different numbers noise stays white.
    pub(crate) fn with_autocorrelation(mut self, noise: AutocorrelatedNoise) -> Self {
        let width = self.width();
        let filter = width.map(|width| noise.filter(&self.rows, width));
        let measured = self.measured();
        if let Some(innovations) = filter {
            innovations.apply(&mut self.residual[..measured]);
            self.innovations = Some(innovations);
        }
        self
    }

    /// Whether the noise is correlated from row to row.
    pub(crate) fn is_correlated(&self) -> bool {
        self.innovations.is_some()
    }

    /// Takes what a column says of readings to their innovations.
    pub(crate) fn innovate(&self, column: &mut [f64]) {
        if let Some(innovations) = &self.innovations {
            innovations.apply(&mut column[..self.measured()]);
        }
    }

    /// Residual rows of readings.
    fn measured(&self) -> usize {
        self.readings.row_of.len()
    }

    /// Numbers that each row measured, where all measured as many.
    pub(crate) fn width(&self) -> Option<usize> {
        let mut widths = (0..self.rows.len()).map(|i| self.readings.lines_of(i).len());
        let width = widths.next().filter(|width| *width > 0)?;
        widths.all(|other| other == width).then_some(width)
    }

    /// Residuals of what was measured, row by row.
    pub(crate) fn measured_residual(&self) -> &[f64] {
        &self.residual[..self.measured()]
    }

    /// Residual rows of the readings of a row, by its place in `rows`.
    pub(crate) fn readings_of(&self, place: usize) -> Range<usize> {
        self.readings.lines_of(place)
    }

    pub(crate) fn residual_rows(&self) -> usize {
        self.residual.len()
    }

    /// The places in `rows` of residual rows of readings.
    pub(crate) fn rows_of_readings(&self) -> &[usize] {
        &self.readings.row_of
    }

    /// The place in `rows` of a residual row.
    pub(crate) fn row_of(&self, residual_row: usize) -> usize {
        match &self.currents {
            Some(currents) if residual_row >= self.measured() => {
                (residual_row - self.measured()) / currents.joints.len()
            }
            _ => self.readings.row_of[residual_row],
        }
    }

    /// Load torques (Nm), row-major.
    pub(crate) fn torques(&self) -> Vec<f64> {
        self.motions
            .iter()
            .flat_map(|motion| motion.posture.torque.iter().copied())
            .collect()
    }

    /// Motion of each row's point by each joint, m/rad; row-major.
    pub(crate) fn by_joint(&self, row: usize) -> &[Vector3<f64>] {
        &self.motions[row].by_joint
    }

    /// How far each joint moves the first three numbers that a row (by its place) measured of a kind, in standard deviations per rad or m;
    /// none where it measured none.
    pub(crate) fn reading_by_joint(&self, place: usize, kind: &str) -> Option<Vec<Vector3<f64>>> {
        let (_, reading) = self
            .readings
            .seen(place)
            .find(|(_, reading)| reading.kind.about().name == kind)?;
        let along = |joint| {
            let direction = Direction::Joint(joint, 1.0);
            reading.sensitivity.along(&self.motions[place], &direction)
        };
        Some((0..self.robot.joints()).map(along).collect())
    }

    /// The largest motion of the point by each joint, m/rad.
    pub(crate) fn reach(&self) -> Vec<f64> {
        let reach = |joint: usize| {
            let motions = self.motions.iter();
            motions
                .map(|motion| motion.by_joint[joint].norm())
                .fold(0.0, f64::max)
        };
        (0..self.robot.joints()).map(reach).collect()
    }

    /// Columns of a form, one after another.
    pub(crate) fn columns(&self, form: &Form) -> Vec<f64> {
        let mut out = self.motions_by(form);
        out.chunks_mut(self.residual_rows().max(1))
            .for_each(|column| self.innovate(column));
        out
    }

    /// How each row's point moves.
    pub(crate) fn motions(&self) -> &[PointMotion] {
        &self.motions
    }

    /// The same whether noise is correlated or not: whitened motions of the points per unit of each parameter.
    pub(crate) fn motions_by(&self, form: &Form) -> Vec<f64> {
        match self.travel(form) {
            Some((joint, values)) => self.travelled(joint, &values),
            None => self.motions_by_partials(form),
        }
    }

    /// The same of any form, from its own partial derivatives.
    fn motions_by_partials(&self, form: &Form) -> Vec<f64> {
        let count = form.parameters(self.robot).len();
        let zeros = vec![0.0; count];
        let rows = self.residual_rows();
        let mut out = vec![0.0; count * rows];
        let mut buffer = Deflection::new(self.robot.joints());
        for (i, motion) in self.motions.iter().enumerate() {
            motion.deflect(self.robot, self.data, form, &zeros, &mut buffer);
            for (first, reading) in self.readings.seen(i) {
                for (parameter, direction) in &buffer.partials {
                    let derivative = reading.sensitivity.along(motion, direction);
                    for (k, line) in reading.lines.iter().enumerate() {
                        out[parameter * rows + first + k] += derivative[*line];
                    }
                }
            }
            let Some(currents) = &self.currents else {
                continue;
            };
            for (parameter, joint, rate) in buffer.loads() {
                if let Some(k) = currents.joints.iter().position(|usable| *usable == joint) {
                    let row = i * currents.joints.len() + k;
                    out[parameter * rows + self.measured() + row] +=
                        rate * self.current_weight / currents.sigma_of(row);
                }
            }
        }
        out
    }

    /// Whitened motions of the points by each direction of a motion, whatever the row; noise is not made white in time.
    pub(crate) fn directions(&self, motion: Motion) -> Vec<Vec<f64>> {
        // One from the beginning of time.
        let always = Law::new(Variable::Time, Basis::After { at: f64::MIN });
        let columns = self.motions_by(&Term::new(&Unknown, motion, always).into());
        columns
            .chunks(self.residual_rows().max(1))
            .map(<[f64]>::to_vec)
            .collect()
    }

    /// A variable of one number at every row; none where some row does not tell.
    pub(crate) fn values(&self, variable: Variable) -> Option<Vec<f64>> {
        let one = |(row, motion): (&usize, &PointMotion)| {
            motion.value(self.robot, self.data, *row, variable)
        };
        self.rows.iter().zip(&self.motions).map(one).collect()
    }

    /// An orthonormal basis of what some parameters of the model under their priors, and what each motor has of its own, can do.
    pub(crate) fn basis(&self, parameters: &[usize]) -> Mat<f64> {
        shown_directions(&self.jacobian(parameters), &self.prior_sigmas(parameters))
    }

    /// Standard deviations of some parameters before any measurement, SI.
    pub(crate) fn prior_sigmas(&self, parameters: &[usize]) -> Vec<f64> {
        let sigma = |k: &usize| self.model.prior(*k).sigma;
        parameters.iter().map(sigma).collect()
    }

    /// Columns of some parameters of the model itself, and what each motor has of its own.
    pub(crate) fn jacobian(&self, free: &[usize]) -> Mat<f64> {
        let model = self.model;
        let mut column = vec![None; model.stack.specs().len()];
        for (j, parameter) in free.iter().enumerate() {
            column[*parameter] = Some(j);
        }
        let nuisances = self.currents.as_ref().map_or(0, Currents::nuisances);
        let mut out = Mat::zeros(self.residual_rows(), free.len() + nuisances);
        let mut scratch = model.stack.scratch(&model.robot);
        let (stack, robot) = (&model.stack, &model.robot);
        for (i, row) in self.rows.iter().enumerate() {
            let mut placed = stack.place(robot, self.data, *row, &model.x, &mut scratch);
            for (first, reading) in self.readings.seen(i) {
                let sensitivity = &reading.sensitivity;
                sensitivity.derivatives(&mut placed, |parameter, derivative| {
                    if let Some(j) = column[parameter] {
                        for (k, line) in reading.lines.iter().enumerate() {
                            out[(first + k, j)] += derivative[*line];
                        }
                    }
                });
            }
        }
        for j in 0..free.len() {
            self.innovate(out.col_as_slice_mut(j));
        }
        if let Some(currents) = &self.currents {
            for row in 0..currents.residual_rows() {
                for k in 0..nuisances {
                    out[(self.measured() + row, free.len() + k)] =
                        currents.nuisance(row, k) * self.current_weight;
                }
            }
        }
        out
    }

    /// Values of some forms in the present model, zero where it has them not.
    fn present(&self, forms: &[&Form]) -> Vec<f64> {
        let known = self.model.stack.specs();
        let specs = forms.iter().flat_map(|form| form.parameters(self.robot));
        specs
            .map(|spec| known.iter().position(|known| known.name == spec.name))
            .map(|place| place.map_or(0.0, |k| self.model.x[k]))
            .collect()
    }

    /// What the currents alone say of the parameters of some forms; nothing where they say nothing.
    pub(crate) fn priors_by_currents(&self, forms: &[&Form]) -> Vec<Prior> {
        let Some(currents) = self.currents.as_ref().filter(|_| !forms.is_empty()) else {
            return Vec::new();
        };
        let rows = self.residual_rows();
        let all: Vec<f64> = forms.iter().flat_map(|form| self.columns(form)).collect();
        let current_lines = |column: &[f64]| {
            let values = column[self.measured()..].iter();
            values.map(|value| value / self.current_weight).collect()
        };
        let columns: Vec<Vec<f64>> = all.chunks(rows).map(current_lines).collect();
        // The residual is that of the present model; what is asked is the whole parameter, hence at zero where it is new.
        currents
            .priors(&columns, &self.present(forms))
            .unwrap_or_default()
    }
}

/// Adds columns, one after another, by their coefficients.
pub(crate) fn add_columns(sum: &mut [f64], columns: &[f64], coefficients: &[f64]) {
    for (column, coefficient) in columns.chunks(sum.len().max(1)).zip(coefficients) {
        let each = sum.iter_mut().zip(column);
        each.for_each(|(value, c)| *value += c * coefficient);
    }
}

/// What a row measured of one kind, as the present model sees it.
pub(crate) struct SeenReading {
    pub(crate) kind: &'static dyn MeasurementKind,
    /// Lines of the kind's residual that were measured.
    pub(crate) lines: &'static [usize],
    /// How it follows the target's motion, in standard deviations.
    pub(crate) sensitivity: Sensitivity,
}

/// Readings of all rows, one row after another.
#[derive(Default)]
pub(crate) struct ReadingLines {
    readings: Vec<SeenReading>,
    /// The first residual row of each reading.
    first: Vec<usize>,
    /// By row: past its last reading.
    end: Vec<usize>,
    /// By row: past its last residual row.
    end_line: Vec<usize>,
    /// By residual row: the place of its row.
    pub(crate) row_of: Vec<usize>,
}

impl ReadingLines {
    /// Takes the readings of the next row.
    pub(crate) fn push(&mut self, readings: Vec<SeenReading>) {
        let place = self.end.len();
        for reading in readings {
            self.first.push(self.row_of.len());
            self.row_of
                .extend(std::iter::repeat_n(place, reading.lines.len()));
            self.readings.push(reading);
        }
        self.end.push(self.readings.len());
        self.end_line.push(self.row_of.len());
    }

    /// Readings of a row, each with its first residual row.
    pub(crate) fn seen(&self, place: usize) -> impl Iterator<Item = (usize, &SeenReading)> {
        let range = begin(&self.end, place)..self.end[place];
        self.first[range.clone()]
            .iter()
            .copied()
            .zip(&self.readings[range])
    }

    /// Residual rows of a row.
    pub(crate) fn lines_of(&self, place: usize) -> Range<usize> {
        begin(&self.end_line, place)..self.end_line[place]
    }
}

fn begin(end: &[usize], place: usize) -> usize {
    place.checked_sub(1).map_or(0, |before| end[before])
}

impl WhitenedProblem<'_> {
    /// The joint that a form makes travel, and the values of its functions, one after another, a number each row; none where the form does
    /// anything else.
    pub(crate) fn travel(&self, form: &Form) -> Option<(usize, Vec<f64>)> {
        let term = form.term()?;
        let joint = term.motion().travels()?;
        let rows = self.rows.len();
        let mut values = vec![0.0; term.law().count() * rows];
        for (i, motion) in self.motions.iter().enumerate() {
            motion.law(self.robot, self.data, term.law(), |k, value| {
                values[k * rows + i] += value
            });
        }
        Some((joint, values))
    }

    /// The same where every residual row says what it says by itself.
    pub(crate) fn plain_travel(&self, form: &Form) -> Option<(usize, Vec<f64>)> {
        if self.innovations.is_some() {
            None
        } else {
            self.travel(form)
        }
    }

    /// Column of a unit travel of a joint, whether noise is correlated or not.
    pub(crate) fn unit_travel(&self, joint: usize) -> &[f64] {
        let column = |joint: usize| {
            // One in every row, and the angle, which is not asked.
            let (zero, per) = (0.0, 1.0);
            let law = Law::new(Variable::Angle { joint }, Basis::Straight { zero, per });
            let term = Term::new(&Unknown, Motion::Joint { joint }, law);
            let mut columns = self.motions_by_partials(&term.into());
            columns.truncate(self.residual_rows());
            columns
        };
        &self
            .travels
            .get_or_init(|| (0..self.robot.joints()).map(column).collect())[joint]
    }

    /// Columns of functions of a joint's travel, one after another.
    pub(crate) fn travelled(&self, joint: usize, values: &[f64]) -> Vec<f64> {
        let unit = self.unit_travel(joint);
        let mut out = Vec::with_capacity(values.len() / self.rows.len().max(1) * unit.len());
        for values in values.chunks(self.rows.len().max(1)) {
            let lines = unit.iter().enumerate();
            out.extend(lines.map(|(line, unit)| unit * values[self.row_of(line)]));
        }
        out
    }

    /// Sums, row by row, of the products of a column with that of a unit travel of a joint.
    pub(crate) fn along_travel(&self, joint: usize, column: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.rows.len()];
        for (line, (value, unit)) in column.iter().zip(self.unit_travel(joint)).enumerate() {
            out[self.row_of(line)] += value * unit;
        }
        out
    }
}

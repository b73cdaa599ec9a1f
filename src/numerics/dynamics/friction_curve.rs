//! Friction of a joint over its velocity, with its band: the sum of all laws of speed, which single ones may stand for in part alone.

use super::cause::TorqueForm;
use super::model::TorqueModel;
use super::shape_slopes::slope;
use super::types::FrictionCurve;
use crate::effect::Place;
use crate::error::Result;

/// Velocities on either side of zero.
const POINTS: usize = 30;

/// A law of friction of a joint: its form, coefficients, and where these and its shape numbers stand in the covariance.
struct FrictionLaw<'a> {
    form: TorqueForm,
    coefficients: &'a [f64],
    first: usize,
    shapes: usize,
}

impl FrictionLaw<'_> {
    /// Nm at a velocity whose sign turns over a width.
    fn torque(&self, form: &TorqueForm, velocity: f64, width: f64) -> f64 {
        let sign = (velocity / width).tanh();
        let of = |(column, value): (usize, &f64)| form.cause.friction(form, column, velocity, sign).unwrap_or(0.0) * value;
        self.coefficients.iter().enumerate().map(of).sum()
    }
}

impl TorqueModel {
    /// The curve of every joint that has friction, over the speeds of the recording; standard deviations are 0 where the model carries no
    /// covariance. Fails where no cause has a term's name.
    pub fn friction_curves(&self) -> Result<Vec<FrictionCurve>> {
        let known = self.identified.iter().filter(|known| **known).count();
        let mut shapes = known + self.terms.iter().map(|term| term.coefficients.len()).sum::<usize>();
        let mut first = known;
        let mut laws: Vec<Vec<FrictionLaw>> = (0..self.joints()).map(|_| Vec::new()).collect();
        for term in &self.terms {
            let form = term.form()?;
            let (own, numbers) = (first, shapes);
            first += term.coefficients.len();
            shapes += form.shape_numbers().len();
            if let (Place::Joint(joint), Some(_)) = (form.place, form.cause.friction(&form, 0, 0.0, 0.0)) {
                laws[joint].push(FrictionLaw { form, coefficients: &term.coefficients, first: own, shapes: numbers });
            }
        }
        let curves = laws.iter().enumerate().filter(|(_, laws)| !laws.is_empty());
        Ok(curves.map(|(joint, laws)| self.friction_curve(joint, laws, shapes + 1)).collect())
    }

    fn friction_curve(&self, joint: usize, laws: &[FrictionLaw], numbers: usize) -> FrictionCurve {
        let (range, whole) = (&self.range[joint], self.covariance.len() == numbers * numbers);
        let share = range.sign_width / self.sign_width;
        let points = (-(POINTS as i32)..=POINTS as i32).map(|point| range.speed * f64::from(point) / POINTS as f64);
        let mut curve = FrictionCurve { joint, velocity: points.collect(), torque: Vec::new(), sigma: Vec::new() };
        for velocity in &curve.velocity {
            let sum = |width: f64| laws.iter().map(|law| law.torque(&law.form, *velocity, width)).sum::<f64>();
            let mut along = vec![(numbers - 1, slope(self.sign_width, |width| sum(share * width)))];
            for law in laws {
                let sign = (velocity / range.sign_width).tanh();
                let of = |column: usize| law.form.cause.friction(&law.form, column, *velocity, sign).unwrap_or(0.0);
                along.extend((0..law.coefficients.len()).map(|column| (law.first + column, of(column))));
                along.extend(law.form.shape_numbers().iter().enumerate().map(|(place, span)| {
                    let moved = |size: f64| law.torque(&law.form.with_shape(span.index, size), *velocity, range.sign_width);
                    (law.shapes + place, slope(law.form.shape[span.index], moved))
                }));
            }
            let with = |(row, left): &(usize, f64)| {
                along.iter().map(|(column, right)| left * right * self.covariance[row * numbers + column]).sum::<f64>()
            };
            curve.torque.push(sum(range.sign_width));
            curve.sigma.push(if whole { along.iter().map(with).sum::<f64>().max(0.0).sqrt() } else { 0.0 });
        }
        curve
    }
}

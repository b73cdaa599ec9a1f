//! Friction of a joint over its velocity, with its band: the sum of all laws of speed, which single ones may stand for in part alone.

use super::cause::{COULOMB, FittedNumber, TorqueForm, VISCOUS, line_of_power};
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
        let of_column = |(column, value): (usize, &f64)| {
            form.friction(column, velocity, sign).unwrap_or(0.0) * value
        };
        self.coefficients.iter().enumerate().map(of_column).sum()
    }
}

impl TorqueModel {
    /// The curve of every joint that has friction, over the speeds of the recording; standard deviations are 0 where the model carries no
    /// covariance. Fails where no cause has a term's name.
    pub fn friction_curves(&self) -> Result<Vec<FrictionCurve>> {
        let (laws, numbers) = self.laws()?;
        let curves = laws.iter().enumerate().filter(|(_, laws)| !laws.is_empty());
        Ok(curves
            .map(|(joint, laws)| self.friction_curve(joint, laws, numbers))
            .collect())
    }

    /// Viscous and Coulomb friction of a joint whose viscous friction grows with another power of speed than the first: those of the straight
    /// line of both over the recorded speeds, Nm s/rad and Nm, each with its standard deviation, 0 where the model carries no covariance.
    /// None where speed enters by its first power. Fails where no cause has a term's name.
    pub fn friction_line(&self, joint: usize) -> Result<Option<[FittedNumber; 2]>> {
        let (laws, numbers) = self.laws()?;
        let of_name = |name: &str| laws[joint].iter().find(|law| law.form.cause.name == name);
        let Some(power) = of_name(VISCOUS).filter(|law| {
            law.form
                .shape
                .first()
                .is_some_and(|exponent| *exponent != 1.0)
        }) else {
            return Ok(None);
        };
        let (exponent, value, fastest) = (
            power.form.shape[0],
            power.coefficients[0],
            self.range[joint].speed,
        );
        let whole = self.covariance.len() == numbers * numbers;
        Ok(Some([1, 0].map(|part| {
            let of_line = |exponent: f64| line_of_power(exponent, fastest)[part];
            let coulomb = of_name(COULOMB).filter(|_| part == 0);
            let mut along = vec![(power.first, of_line(exponent))];
            along.extend(
                power
                    .form
                    .shape_numbers()
                    .first()
                    .map(|_| (power.shapes, value * slope(exponent, of_line))),
            );
            along.extend(coulomb.map(|law| (law.first, 1.0)));
            let sigma = if whole {
                self.sigma(&along, numbers)
            } else {
                0.0
            };
            FittedNumber {
                value: value * of_line(exponent) + coulomb.map_or(0.0, |law| law.coefficients[0]),
                sigma,
            }
        })))
    }

    /// The laws of friction of every joint, and how many rows the covariance has.
    fn laws(&self) -> Result<(Vec<Vec<FrictionLaw<'_>>>, usize)> {
        let known = self.identified.iter().filter(|known| **known).count();
        let mut shapes = known
            + self
                .terms
                .iter()
                .map(|term| term.coefficients.len())
                .sum::<usize>();
        let mut first = known;
        let mut laws: Vec<Vec<FrictionLaw>> = (0..self.joints()).map(|_| Vec::new()).collect();
        for term in &self.terms {
            let form = term.form()?;
            let (coefficient, number) = (first, shapes);
            first += term.coefficients.len();
            shapes += form.shape_numbers().len();
            if let (Place::Joint(joint), Some(_)) = (form.place, form.friction(0, 0.0, 0.0)) {
                laws[joint].push(FrictionLaw {
                    form,
                    coefficients: &term.coefficients,
                    first: coefficient,
                    shapes: number,
                });
            }
        }
        Ok((laws, shapes + 1))
    }

    /// The standard deviation of a sum of numbers, by their rows in the covariance.
    fn sigma(&self, along: &[(usize, f64)], numbers: usize) -> f64 {
        let with = |(row, left): &(usize, f64)| {
            along
                .iter()
                .map(|(column, right)| left * right * self.covariance[row * numbers + column])
                .sum::<f64>()
        };
        along.iter().map(with).sum::<f64>().max(0.0).sqrt()
    }

    fn friction_curve(&self, joint: usize, laws: &[FrictionLaw], numbers: usize) -> FrictionCurve {
        let (range, whole) = (
            &self.range[joint],
            self.covariance.len() == numbers * numbers,
        );
        let share = range.sign_width / self.sign_width;
        let points = (-(POINTS as i32)..=POINTS as i32)
            .map(|point| range.speed * f64::from(point) / POINTS as f64);
        let mut curve = FrictionCurve {
            joint,
            velocity: points.collect(),
            torque: Vec::new(),
            sigma: Vec::new(),
        };
        for velocity in &curve.velocity {
            let sum = |width: f64| {
                laws.iter()
                    .map(|law| law.torque(&law.form, *velocity, width))
                    .sum::<f64>()
            };
            let mut along = vec![(
                numbers - 1,
                slope(self.sign_width, |width| sum(share * width)),
            )];
            for law in laws {
                let sign = (velocity / range.sign_width).tanh();
                let of_column =
                    |column: usize| law.form.friction(column, *velocity, sign).unwrap_or(0.0);
                along.extend(
                    (0..law.coefficients.len())
                        .map(|column| (law.first + column, of_column(column))),
                );
                along.extend(
                    law.form
                        .shape_numbers()
                        .iter()
                        .enumerate()
                        .map(|(place, span)| {
                            let moved = |size: f64| {
                                law.torque(
                                    &law.form.with_shape(span.index, size),
                                    *velocity,
                                    range.sign_width,
                                )
                            };
                            (law.shapes + place, slope(law.form.shape[span.index], moved))
                        }),
                );
            }
            curve.torque.push(sum(range.sign_width));
            curve.sigma.push(if whole {
                self.sigma(&along, numbers)
            } else {
                0.0
            });
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{INERTIAL_NUMBERS, JointRange, TorqueTerm};

    #[test]
    fn friction_that_grows_with_another_power_of_speed_has_the_numbers_of_the_line_of_both() {
        let term = |effect: &str, shape: &[f64], value: f64| TorqueTerm {
            effect: effect.into(),
            place: Place::Joint(0),
            with: [0; 2],
            shape: shape.to_vec(),
            coefficients: vec![value],
            rms: 1.0,
        };
        let seen = JointRange {
            position: [-1.0, 1.0],
            speed: 2.0,
            acceleration: 1.0,
            load: 40.0,
            misfit: 0.0,
            usual: 0.0,
            sign_width: 0.01,
        };
        let model = |exponent: f64| TorqueModel {
            inertials: vec![0.0; INERTIAL_NUMBERS],
            identified: vec![false; INERTIAL_NUMBERS],
            terms: vec![term(VISCOUS, &[exponent], 4.0), term(COULOMB, &[], 1.0)],
            // Of both coefficients, of the exponent and of the width of the sign.
            covariance: [
                [0.01, 0.0, 0.0, 0.0],
                [0.0, 0.04, 0.0, 0.0],
                [0.0; 4],
                [0.0; 4],
            ]
            .concat(),
            sign_width: 0.01,
            friction_lead: 0.0,
            latency: 0.0,
            cutoff: 10.0,
            range: vec![seen],
            temperature: None,
        };
        // 4 |v|^0.8 up to 2 rad/s: the line through 2000 points of it, by plain least squares, rises by 3.3164 and begins at 0.5527.
        let [viscous, coulomb] = model(0.8).friction_line(0).unwrap().expect("a line");
        assert!(
            (viscous.value - 3.3164).abs() < 1e-3
                && (viscous.sigma - 0.1 * 3.3164 / 4.0).abs() < 1e-4,
            "{viscous:?}"
        );
        let sigma = f64::hypot(0.2, 0.1 * 0.5527 / 4.0);
        assert!(
            (coulomb.value - 1.5527).abs() < 1e-3 && (coulomb.sigma - sigma).abs() < 1e-4,
            "{coulomb:?}"
        );
        assert_eq!(model(1.0).friction_line(0).unwrap(), None);
    }
}

//! Viscous and Coulomb friction as numbers: where speed enters by another power than the first, those of the straight line of both together.

use super::cause::{FittedNumber, TorqueForm, VISCOUS, line_of_power};
use super::choice::CauseChoice;
use super::shape_slopes::{ShapeNumber, ShapeSlopes, slope};
use super::sweep::SweptColumns;

/// The number of viscous or Coulomb friction in a set that is of the line; none where speed enters by its first power.
pub(super) fn number_of_line(
    choice: &CauseChoice,
    set: &[usize],
    number: usize,
    solution: &[(usize, f64)],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> Option<FittedNumber> {
    let (all, form) = (&choice.problem.all, choice.form(number));
    if !form.cause.brakes {
        return None;
    }
    let is_power = |own: &TorqueForm| {
        own.place == form.place && own.cause.name == VISCOUS && !own.shape_numbers().is_empty()
    };
    let power = *set.iter().find(|own| is_power(choice.form(**own)))?;
    let exponent = choice.form(power).shape[0];
    let fastest = choice.problem.scene.velocity[form.joint()]
        .iter()
        .fold(0.0, |most: f64, velocity| most.max(velocity.abs()));
    let value = |column: usize| {
        solution
            .iter()
            .find(|(pivot, _)| *pivot == column)
            .map_or(0.0, |(_, value)| *value)
    };
    let (column, is_viscous) = (all.of(power).start, form.cause.name == VISCOUS);
    let of = |exponent: f64| line_of_power(exponent, fastest)[usize::from(is_viscous)];
    let mut along = vec![(column, of(exponent))];
    if !is_viscous {
        along.push((all.of(number).start, 1.0));
    }
    let shape = slopes
        .0
        .iter()
        .find(|(known, _)| *known == ShapeNumber::Of(power, 0));
    let line = along
        .iter()
        .map(|(column, share)| share * value(*column))
        .sum();
    along.extend(shape.map(|(_, own)| (*own, value(column) * slope(exponent, of))));
    let columns: Vec<usize> = along.iter().map(|(column, _)| *column).collect();
    let covariance = uncertain.covariance(&columns);
    let pairs = (0..along.len()).flat_map(|a| (0..along.len()).map(move |b| (a, b)));
    let variance: f64 = pairs
        .map(|(a, b)| along[a].1 * along[b].1 * covariance[a * along.len() + b])
        .sum();
    Some(FittedNumber {
        value: line,
        sigma: variance.max(0.0).sqrt(),
    })
}

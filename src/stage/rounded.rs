//! Logs rounded to a step: the step is found from the values themselves and compared with what the model leaves.

use crate::estimate::Model;
use crate::robot::Measurements;
use crate::units::Unit;

/// Steps that logs are rounded to, the coarsest first; finer ones are found as coarser ones are, and make too little to be said.
const STEPS: [f64; 13] = [
    1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5,
];
/// How far off a multiple of its step a number may be that was converted between units, as a share of the step.
const OFF: f64 = 1e-6;
/// Fewer values of a column than this may be multiples by choice.
const FEWEST: usize = 10;
/// A residual smaller than this share of what rounding would leave says that the numbers are exact: commanded so, and not rounded.
const EXACT: f64 = 0.6;
/// Beside a residual or a noise this many times larger, rounding is not what matters.
const DROWNED: f64 = 4.0;
/// What rounding by a step makes, as a standard deviation in steps: that of a uniform distribution.
const UNIFORM: f64 = 0.288_675;
/// By what joints are turned to see how far the point goes, rad or m.
const TURN: f64 = 1e-4;

/// What rounding does to the points, m.
struct Rounding {
    what: String,
    rms: f64,
    most: f64,
}

/// What is said of rounded joints and points, a sentence each, where rounding is as large as what the model leaves.
pub(super) fn rounded_logs(model: &Model, data: &Measurements, rows: &[usize]) -> Vec<String> {
    let predicted = model.predict(data);
    let left = rms(rows
        .iter()
        .map(|row| data.points.residual(*row, &predicted[*row]).norm()));
    let noise = rms(rows.iter().map(|row| data.noise(*row)));
    let sentence = |rounding: Rounding| {
        let Rounding { what, rms, most } = rounding;
        let matters = left > EXACT * rms && left < DROWNED * rms && noise < DROWNED * rms;
        matters.then(|| {
            format!(
                "{what}, which makes up to {:.2} mm and {:.3} mm rms of the {:.3} mm rms that the model leaves: log more digits",
                most * 1e3,
                rms * 1e3,
                left * 1e3
            )
        })
    };
    joints(model, data, rows)
        .into_iter()
        .chain(points(data, rows))
        .filter_map(sentence)
        .collect()
}

fn rms(lengths: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = lengths.fold((0.0, 0usize), |(sum, count), length| {
        (sum + length * length, count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

/// The coarsest step of which all values are multiples; none where they are too few to tell.
fn step(values: &[f64]) -> Option<f64> {
    let mut distinct = values.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    if distinct.len() < FEWEST {
        return None;
    }
    let is_multiple = |value: f64, step: f64| {
        ((value / step) - (value / step).round()).abs() < OFF * (1.0 + (value / step).abs() * 1e-4)
    };
    STEPS
        .into_iter()
        .find(|step| distinct.iter().all(|value| is_multiple(*value, *step)))
}

/// The step of a joint in the unit that makes it coarsest.
fn of_joint(values: &[f64], revolute: bool) -> Option<(f64, Unit)> {
    let units = if revolute {
        [Unit::Degree, Unit::Radian]
    } else {
        [Unit::Millimetre, Unit::Metre]
    };
    let step_in = |unit: Unit| {
        let values: Vec<f64> = values.iter().map(|value| unit.from_si(*value)).collect();
        step(&values).map(|step| (step, unit))
    };
    units
        .into_iter()
        .filter_map(step_in)
        .max_by(|a, b| a.1.to_si(a.0).total_cmp(&b.1.to_si(b.0)))
}

fn joints(model: &Model, data: &Measurements, rows: &[usize]) -> Option<Rounding> {
    let start = model.predict(data);
    let mut coarsest: Option<(f64, Unit)> = None;
    let (mut squares, mut most) = (0.0, vec![0.0; data.rows()]);
    for joint in 0..data.joints {
        let values: Vec<f64> = rows.iter().map(|row| data.q(*row)[joint]).collect();
        let Some((step, unit)) = of_joint(&values, model.robot.is_revolute(joint)) else {
            continue;
        };
        let si = unit.to_si(step);
        if coarsest.is_none_or(|(other, by)| si > by.to_si(other)) {
            coarsest = Some((step, unit));
        }
        let mut turned = data.clone();
        turned
            .q
            .iter_mut()
            .skip(joint)
            .step_by(data.joints)
            .for_each(|q| *q += TURN);
        let moved = model.predict(&turned);
        for row in rows {
            let lever = (moved[*row] - start[*row]).norm() / TURN;
            squares += (UNIFORM * si * lever).powi(2);
            most[*row] += 0.5 * si * lever;
        }
    }
    let (step, unit) = coarsest?;
    Some(Rounding {
        what: format!("joint positions are rounded to {step} {}", unit.symbol()),
        rms: (squares / rows.len().max(1) as f64).sqrt(),
        most: most.into_iter().fold(0.0, f64::max),
    })
}

fn points(data: &Measurements, rows: &[usize]) -> Option<Rounding> {
    let axis = |axis: usize| {
        let values: Vec<f64> = rows
            .iter()
            .filter_map(|row| Some(Unit::Millimetre.from_si(data.point(*row)?[axis])))
            .collect();
        step(&values)
    };
    // A point is as coarse as its finest axis says: one axis may be a multiple by chance.
    let step = (0..3)
        .map(axis)
        .collect::<Option<Vec<f64>>>()?
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let length = Unit::Millimetre.to_si(step) * 3f64.sqrt();
    Some(Rounding {
        what: format!("measured points are rounded to {step} mm"),
        rms: UNIFORM * length,
        most: 0.5 * length,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_from_the_values_in_the_unit_that_they_were_written_in() {
        let by = |step: f64, unit: Unit| {
            (0..40)
                .map(|k| unit.to_si(f64::from(k * k % 37) * step))
                .collect::<Vec<f64>>()
        };
        assert_eq!(
            of_joint(&by(0.1, Unit::Degree), true),
            Some((0.1, Unit::Degree))
        );
        assert_eq!(
            of_joint(&by(0.001, Unit::Radian), true),
            Some((0.001, Unit::Radian))
        );
        assert_eq!(
            of_joint(&by(0.5, Unit::Millimetre), false),
            Some((0.5, Unit::Millimetre))
        );
        let free: Vec<f64> = (0..40).map(|k| (f64::from(k) * 0.618_034).sin()).collect();
        assert_eq!(of_joint(&free, true), None);
        assert_eq!(of_joint(&by(0.1, Unit::Degree)[..8], true), None);
    }
}

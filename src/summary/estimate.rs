//! Figures of a result in few characters: lengths, and numbers with their standard deviations.

use crate::effect::figure;
use crate::units::Unit;

/// From this size (mm) on a length reads in mm, below in um.
const MILLIMETRES: f64 = 0.0995;
/// Numbers from the first of these sizes up to the second are written without a power of ten.
const PLAIN: [f64; 2] = [1e-3, 1e5];
/// Significant digits at most.
const LARGEST_POWER: i32 = 4;
/// A share from this on reads in percent, below in parts per million.
const PERCENT: f64 = 1e-3;

/// A length, given in mm.
pub(super) fn length(mm: f64) -> String {
    if mm >= MILLIMETRES {
        format!("{mm:.2} mm")
    } else {
        format!("{} um", figure(1e3 * mm, 0))
    }
}

/// An angle, given in rad.
pub(super) fn angle(rad: f64) -> String {
    format!("{} arcsec", figure(Unit::Arcsecond.from_si(rad), 0))
}

/// A number with its standard deviation, as many digits as that tells: `14.8 +- 0.4 arcsec`, `(4.17 +- 0.02)e-7 rad/Nm`.
pub(super) fn estimate(value: f64, sigma: Option<f64>, unit: &str) -> String {
    if unit == "1" {
        let (scale, unit) = if value.abs() >= PERCENT {
            (1e2, "%")
        } else {
            (1e6, "ppm")
        };
        return estimate(scale * value, sigma.map(|sigma| scale * sigma), unit);
    }
    let size = value.abs();
    let power = if size == 0.0 || (PLAIN[0]..PLAIN[1]).contains(&size) {
        0
    } else {
        size.log10().floor() as i32
    };
    let scale = 10f64.powi(power);
    let value = value / scale;
    // One that shows in no digit is as good as none.
    let sigma = sigma
        .map(|sigma| sigma / scale)
        .filter(|sigma| *sigma > 0.0 && decimals(*sigma, 1) <= decimals(value, LARGEST_POWER));
    let decimals = sigma.map_or_else(
        || decimals(value, LARGEST_POWER),
        |sigma| decimals(sigma, 1),
    );
    let number = match sigma {
        Some(sigma) => format!("{value:.decimals$} +- {sigma:.decimals$}"),
        None => format!("{value:.decimals$}"),
    };
    match (power, sigma) {
        (0, _) => format!("{number} {unit}"),
        (_, Some(_)) => format!("({number})e{power} {unit}"),
        (_, None) => format!("{number}e{power} {unit}"),
    }
}

/// Decimals that leave a number so many significant digits, and one more where the first is 1.
fn decimals(number: f64, digits: i32) -> usize {
    let size = number.abs();
    if size == 0.0 || !size.is_finite() {
        return 0;
    }
    let power = size.log10().floor() as i32;
    let more = i32::from(digits == 1 && size < 1.95 * 10f64.powi(power));
    usize::try_from(digits - 1 + more - power).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_its_standard_deviation_tells() {
        let written = [
            estimate(4.1712e-7, Some(2.3e-9), "rad/Nm"),
            estimate(4.1712e-7, Some(2.3e-12), "rad/Nm"),
            estimate(4.1712e-7, None, "rad/Nm"),
            estimate(14.8312, Some(0.42), "arcsec"),
            estimate(120.42, Some(141.4), "Nm"),
            estimate(1.2034, Some(0.0132), "Nm"),
            estimate(-0.0312, Some(0.004), "1"),
            estimate(1.21e-5, Some(3e-7), "1"),
            estimate(0.0, Some(0.0), "mm"),
        ];
        assert_eq!(
            written,
            [
                "(4.17 +- 0.02)e-7 rad/Nm",
                "4.171e-7 rad/Nm",
                "4.171e-7 rad/Nm",
                "14.8 +- 0.4 arcsec",
                "120 +- 141 Nm",
                "1.203 +- 0.013 Nm",
                "-3.1 +- 0.4 %",
                "12.1 +- 0.3 ppm",
                "0 mm"
            ]
        );
    }

    #[test]
    fn a_length_reads_in_the_unit_in_which_it_is_short() {
        assert_eq!(
            [3.546, 0.31, 0.047, 0.0063].map(length),
            ["3.55 mm", "0.31 mm", "47 um", "6.3 um"]
        );
        assert_eq!(angle(1e-4), "21 arcsec");
    }
}

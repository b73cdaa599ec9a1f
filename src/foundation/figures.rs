//! Numbers as a person reads them: fixed or significant digits, and no more of them than a standard deviation tells.

/// With so many decimals; no negative zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(tail) if !tail.contains(|c: char| ('1'..='9').contains(&c)) => tail.into(),
        _ => text,
    }
}

/// To so many significant digits, in powers of ten where that is shorter.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let power = value.abs().log10().floor();
    if (-3.0..7.0).contains(&power) {
        fixed(value, (digits as f64 - 1.0 - power).max(0.0) as usize)
    } else {
        format!("{value:.*e}", digits.saturating_sub(1))
    }
}

/// With the digits that a standard deviation tells, two of that where it begins with 1; four significant ones without.
pub fn measured(value: f64, sigma: Option<f64>) -> String {
    let Some(sigma) = sigma.filter(|sigma| *sigma > 0.0 && sigma.is_finite()) else {
        return significant(value, 4);
    };
    rounded(value, sigma, value)
}

/// The standard deviation of a value, written as [`measured`] writes that: both with the same decimals, or both in powers of ten.
pub fn deviation(sigma: f64, value: f64) -> String {
    match sigma > 0.0 && sigma.is_finite() {
        true => rounded(sigma, sigma, value),
        false => significant(sigma, 4),
    }
}

/// A number with the digits that `sigma` tells; whether in powers of ten is decided by `value`.
fn rounded(number: f64, sigma: f64, value: f64) -> String {
    let first = sigma.log10().floor();
    let digits = if sigma / 10f64.powf(first) < 2.0 {
        2.0
    } else {
        1.0
    };
    let place = first - digits + 1.0;
    let size = value.abs().max(sigma);
    if size.log10().floor() < -3.0 || size >= 1e7 {
        let kept = (number.abs().max(f64::MIN_POSITIVE).log10().floor() - place).max(0.0);
        return significant(number, kept as usize + 1);
    }
    let unit = 10f64.powf(place);
    fixed((number / unit).round() * unit, (-place).max(0.0) as usize)
}

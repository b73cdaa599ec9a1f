//! Numbers as a person reads them: fixed decimals, no negative zero, people's units.

use super::language::Locale;
use crate::error::{Error, Result};
use crate::units::{Quantity, Unit};
use calib_foundation::figures::{deviation, measured};
pub(super) use calib_foundation::figures::{fixed, significant};
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde_json::Value;

/// Decimals of a length in mm: a laser tracker resolves micrometres.
const MM: usize = 3;

pub(super) fn mm(value: f64) -> String {
    fixed(value, MM)
}

/// With a sign, for a change; none where it rounds to zero.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if value > 0.0 && text.contains(|c: char| ('1'..='9').contains(&c)) {
        format!("+{text}")
    } else {
        text
    }
}

/// The same without trailing zeros, for a number that is to be copied.
pub(super) fn exact(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    let (number, power) = text
        .split_once('e')
        .map_or((text.as_str(), None), |(number, power)| {
            (number, Some(power))
        });
    let short = if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        number
    };
    power.map_or_else(|| short.to_owned(), |power| format!("{short}e{power}"))
}

/// A count with its thousands set apart.
pub(super) fn count(value: i64) -> String {
    let digits = value.unsigned_abs().to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    if value < 0 { format!("-{out}") } else { out }
}

/// The same in the language of a page.
impl Locale {
    pub fn fixed(&self, value: f64, decimals: usize) -> String {
        self.decimal(fixed(value, decimals))
    }
    pub fn mm(&self, value: f64) -> String {
        self.decimal(mm(value))
    }
    pub fn significant(&self, value: f64, digits: usize) -> String {
        self.decimal(significant(value, digits))
    }
}

/// How a person reads a unit of the tables: a factor, a symbol and the usual decimals.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitFormat {
    factor: f64,
    pub symbol: &'static str,
    decimals: usize,
}

/// Readings of a value and of a small change of it (degrees, but arcseconds), by the symbol of the stored unit.
pub(super) fn readings(stored: &str) -> Option<(UnitFormat, UnitFormat)> {
    let unit = Unit::parse(stored)?;
    let reading = |factor: f64, symbol, decimals| UnitFormat {
        factor,
        symbol,
        decimals,
    };
    let into = |people: Unit, decimals| {
        reading(
            unit.to_si(1.0) / people.to_si(1.0),
            people.symbol(),
            decimals,
        )
    };
    let per = |symbol, decimals| {
        reading(
            unit.to_si(1.0) / Unit::Arcsecond.to_si(1.0),
            symbol,
            decimals,
        )
    };
    let same = |reading| Some((reading, reading));
    match unit.quantity() {
        Quantity::Length => same(into(Unit::Millimetre, MM)),
        Quantity::Angle => Some((into(Unit::Degree, 4), into(Unit::Arcsecond, 1))),
        Quantity::Compliance => same(per("arcsec/Nm", 4)),
        Quantity::CurrentCompliance => same(per("arcsec/A", 3)),
        Quantity::Number => Some((
            reading(1.0, "", 6),
            reading(1e6, "\u{d7}10\u{207b}\u{2076}", 1),
        )),
        _ => same(reading(1.0, unit.symbol(), 4)),
    }
}

impl UnitFormat {
    /// Decimals that show a sigma with two digits, at least the usual ones.
    pub fn decimals_for(&self, sigma: Option<f64>) -> usize {
        let needed = match sigma.map(|s| (s * self.factor).abs()) {
            Some(s) if s > 0.0 => (1.0 - s.log10().floor()).max(0.0) as usize,
            _ => 0,
        };
        self.decimals.max(needed).min(self.decimals + 4)
    }
    pub fn show(&self, value: f64, decimals: usize) -> String {
        fixed(value * self.factor, decimals)
    }
    pub fn show_signed(&self, value: f64, decimals: usize) -> String {
        signed(value * self.factor, decimals)
    }
}

/// The page of a template, behind the head, for which it has `title`, and where they are not those of the report `style` and `policy` (what
/// the page may load and run). Fails where the template asks for what the page does not have.
pub(super) fn render(
    locale: &Locale,
    name: &str,
    template: &str,
    mut page: Value,
) -> Result<String> {
    let usual = [
        ("version", env!("CARGO_PKG_VERSION")),
        ("policy", ""),
        ("style", include_str!("report.css")),
    ];
    for (key, value) in usual {
        if page.get(key).is_none() {
            page[key] = value.into();
        }
    }
    let text = format!("{}{template}", include_str!("head.html"));
    let mut environment = Environment::new();
    // A name in the template that does not exist is a bug, not an empty cell.
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    locale.teach(&mut environment);
    // Figures of rows; of none an empty cell.
    let (of_fixed, of_significant) = (locale.clone(), locale.clone());
    let (of_signed, of_decimal) = (locale.clone(), locale.clone());
    let of_measured = locale.clone();
    environment.add_filter("measured", move |value: Option<f64>, sigma: Option<f64>| {
        value.map_or_else(String::new, |value| {
            of_measured.decimal(measured(value, sigma))
        })
    });
    let of_deviation = locale.clone();
    environment.add_filter("deviation", move |sigma: Option<f64>, value: f64| {
        sigma.map_or_else(String::new, |sigma| {
            of_deviation.decimal(deviation(sigma, value))
        })
    });
    let fixed = move |value: Option<f64>, decimals: usize| {
        value.map_or_else(String::new, |value| of_fixed.fixed(value, decimals))
    };
    let in_mm = fixed.clone();
    environment.add_filter("mm", move |value: Option<f64>| in_mm(value, MM));
    environment.add_filter("count", count);
    environment.add_filter("fixed", fixed);
    environment.add_filter("decimal", move |value: f64| {
        of_decimal.decimal(value.to_string())
    });
    environment.add_filter("signed", move |value: f64, decimals: usize| {
        of_signed.decimal(signed(value, decimals))
    });
    environment.add_filter("significant", move |value: Option<f64>, digits: usize| {
        value.map_or_else(String::new, |value| {
            of_significant.significant(value, digits)
        })
    });
    environment
        .add_template(name, &text)
        .and_then(|()| environment.get_template(name)?.render(Serde(&page)))
        .map_err(|error| Error::Bug(format!("template {name}: {error:#}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_a_person_writes_them() {
        assert_eq!(mm(-0.0004), "0.000");
        assert_eq!(signed(0.0004, 3), "0.000");
        assert_eq!(signed(1.25, 1), "+1.2");
        assert_eq!(
            [0.0, 812.44, 0.0183, 1e-5, 4.2e9].map(|v| significant(v, 4)),
            ["0", "812.4", "0.01830", "1.000e-5", "4.200e9"]
        );
        assert_eq!(
            [12.5, 0.0, 120.0, 8.2e-7].map(|v| exact(v, 9)),
            ["12.5", "0", "120", "8.2e-7"]
        );
        assert_eq!(
            [
                (179.6004, 0.93),
                (179.6, 12.0),
                (0.03312, 0.0014),
                (4.17e-7, 2e-9),
                (1834.2, 310.0)
            ]
            .map(|(value, sigma)| measured(value, Some(sigma))),
            ["179.6", "180", "0.0331", "4.17e-7", "1800"]
        );
        assert_eq!(measured(12.3456, None), "12.35");
        assert_eq!(
            [(5e-4, 0.2196), (7e-6, 0.015007), (2e-9, 4.17e-7)]
                .map(|(sigma, value)| deviation(sigma, value)),
            ["0.0005", "0.000007", "2e-9"]
        );
        assert_eq!(
            [7, -1234, 10_000_000].map(count),
            ["7", "-1\u{202f}234", "10\u{202f}000\u{202f}000"]
        );
    }

    #[test]
    fn angles_read_in_degrees_and_their_changes_in_arcseconds() {
        let (coarse, fine) = readings("rad").expect("a unit of the tables");
        let sigma = Some(1e-7);
        assert_eq!(
            coarse.show(std::f64::consts::FRAC_PI_2, coarse.decimals_for(None)),
            "90.0000"
        );
        // A sigma of 0.0206 arcsec is shown with two digits.
        assert_eq!(fine.show(1e-7, fine.decimals_for(sigma)), "0.021");
        assert_eq!((coarse.symbol, fine.symbol), ("deg", "arcsec"));
    }
}

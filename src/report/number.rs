//! Numbers as a person reads them: fixed decimals, no negative zero, people's units.

use crate::units::{Quantity, Unit};

/// Decimals of a length in mm: a laser tracker resolves micrometres.
const MM: usize = 3;

pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if !rest.contains(|c: char| ('1'..='9').contains(&c)) => rest.into(),
        _ => text,
    }
}

pub(super) fn mm(value: f64) -> String {
    fixed(value, MM)
}

/// With a sign, for a change; none where it rounds to zero.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if value > 0.0 && text.contains(|c: char| ('1'..='9').contains(&c)) { format!("+{text}") } else { text }
}

/// To so many significant digits, in powers of ten where that is shorter.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let power = value.abs().log10().floor();
    if (-5.0..7.0).contains(&power) {
        fixed(value, (digits as f64 - 1.0 - power).max(0.0) as usize)
    } else {
        format!("{value:.*e}", digits.saturating_sub(1))
    }
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

/// How a person reads a unit of the tables: a factor, a symbol and the usual decimals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    factor: f64,
    pub symbol: &'static str,
    decimals: usize,
}

/// Readings of a value and of a small change of it (degrees, but arcseconds), by the symbol of the stored unit.
pub(super) fn readings(stored: &str) -> Option<(Reading, Reading)> {
    let unit = Unit::parse(stored)?;
    let reading = |factor: f64, symbol, decimals| Reading { factor, symbol, decimals };
    let into = |people: Unit, decimals| reading(unit.to_si(1.0) / people.to_si(1.0), people.symbol(), decimals);
    let per = |symbol, decimals| reading(unit.to_si(1.0) / Unit::Arcsecond.to_si(1.0), symbol, decimals);
    let same = |reading| Some((reading, reading));
    match unit.quantity() {
        Quantity::Length => same(into(Unit::Millimetre, MM)),
        Quantity::Angle => Some((into(Unit::Degree, 4), into(Unit::Arcsecond, 1))),
        Quantity::Compliance => same(per("arcsec/Nm", 4)),
        Quantity::CurrentCompliance => same(per("arcsec/A", 3)),
        Quantity::Number => same(reading(1.0, "", 6)),
        _ => same(reading(1.0, unit.symbol(), 4)),
    }
}

impl Reading {
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

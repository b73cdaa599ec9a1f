//! Units at the edges: SI inside, one stored unit per quantity, people's units in files and reports.

mod header;

pub use header::{Header, written};

use std::fmt;

/// A unit that a stored column, a parameter or a column of a recording may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unit {
    One,
    Millimetre,
    Micrometre,
    Metre,
    Inch,
    Radian,
    Degree,
    Milliradian,
    Arcsecond,
    Second,
    Millisecond,
    Minute,
    Hour,
    Kilogram,
    Ampere,
    Milliampere,
    NewtonMetre,
    KilogramMetre,
    Celsius,
    Kelvin,
    NewtonMetrePerAmpere,
    RadianPerNewtonMetre,
    RadianPerAmpere,
    MetrePerSecondSquared,
    RadianPerSecond,
    DegreePerSecond,
    MillimetrePerSecond,
    MetrePerSecond,
    /// How far a joint trails behind for its speed.
    RadianPerRadianPerSecond,
    ArcsecondPerDegreePerSecond,
}

/// What a unit measures; only units of one quantity convert into each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    Number,
    Length,
    Angle,
    Time,
    Mass,
    Current,
    Torque,
    FirstMoment,
    Temperature,
    TorqueConstant,
    Compliance,
    CurrentCompliance,
    Acceleration,
    AngularRate,
    LinearRate,
    Trailing,
}

use Quantity as Q;
/// Unit, symbol, quantity, factor to SI, offset to SI (added after the factor).
const UNITS: &[(Unit, &str, Quantity, f64, f64)] = &[
    (Unit::One, "1", Q::Number, 1.0, 0.0),
    (Unit::Millimetre, "mm", Q::Length, 1e-3, 0.0),
    (Unit::Micrometre, "um", Q::Length, 1e-6, 0.0),
    (Unit::Metre, "m", Q::Length, 1.0, 0.0),
    (Unit::Inch, "in", Q::Length, 25.4e-3, 0.0),
    (Unit::Radian, "rad", Q::Angle, 1.0, 0.0),
    (Unit::Degree, "deg", Q::Angle, std::f64::consts::PI / 180.0, 0.0),
    (Unit::Milliradian, "mrad", Q::Angle, 1e-3, 0.0),
    (Unit::Arcsecond, "arcsec", Q::Angle, std::f64::consts::PI / 648_000.0, 0.0),
    (Unit::Second, "s", Q::Time, 1.0, 0.0),
    (Unit::Millisecond, "ms", Q::Time, 1e-3, 0.0),
    (Unit::Minute, "min", Q::Time, 60.0, 0.0),
    (Unit::Hour, "h", Q::Time, 3600.0, 0.0),
    (Unit::Kilogram, "kg", Q::Mass, 1.0, 0.0),
    (Unit::Ampere, "A", Q::Current, 1.0, 0.0),
    (Unit::Milliampere, "mA", Q::Current, 1e-3, 0.0),
    (Unit::KilogramMetre, "kg m", Q::FirstMoment, 1.0, 0.0),
    (Unit::NewtonMetre, "Nm", Q::Torque, 1.0, 0.0),
    // Celsius is kept as the base of temperature: effects need differences, people need degrees.
    (Unit::Celsius, "C", Q::Temperature, 1.0, 0.0),
    (Unit::Kelvin, "K", Q::Temperature, 1.0, -273.15),
    (Unit::NewtonMetrePerAmpere, "Nm/A", Q::TorqueConstant, 1.0, 0.0),
    (Unit::RadianPerNewtonMetre, "rad/Nm", Q::Compliance, 1.0, 0.0),
    (Unit::RadianPerAmpere, "rad/A", Q::CurrentCompliance, 1.0, 0.0),
    (Unit::MetrePerSecondSquared, "m/s2", Q::Acceleration, 1.0, 0.0),
    (Unit::RadianPerSecond, "rad/s", Q::AngularRate, 1.0, 0.0),
    (Unit::DegreePerSecond, "deg/s", Q::AngularRate, std::f64::consts::PI / 180.0, 0.0),
    (Unit::MillimetrePerSecond, "mm/s", Q::LinearRate, 1e-3, 0.0),
    (Unit::MetrePerSecond, "m/s", Q::LinearRate, 1.0, 0.0),
    (Unit::RadianPerRadianPerSecond, "rad/(rad/s)", Q::Trailing, 1.0, 0.0),
    (Unit::ArcsecondPerDegreePerSecond, "arcsec/(deg/s)", Q::Trailing, 1.0 / 3600.0, 0.0),
];

impl Unit {
    fn row(self) -> &'static (Unit, &'static str, Quantity, f64, f64) {
        UNITS.iter().find(|row| row.0 == self).expect("every unit has a row")
    }
    pub fn symbol(self) -> &'static str {
        self.row().1
    }
    pub fn quantity(self) -> Quantity {
        self.row().2
    }
    /// Value in this unit -> SI.
    pub fn to_si(self, value: f64) -> f64 {
        let row = self.row();
        value * row.3 + row.4
    }
    /// SI -> value in this unit.
    pub fn from_si(self, value: f64) -> f64 {
        let row = self.row();
        (value - row.4) / row.3
    }
    pub fn parse(symbol: &str) -> Option<Unit> {
        UNITS.iter().find(|row| row.1 == symbol).map(|row| row.0)
    }
    /// All symbols of a quantity, for "allowed: mm, um, m, in".
    pub fn symbols(quantity: Quantity) -> Vec<&'static str> {
        UNITS.iter().filter(|row| row.2 == quantity).map(|row| row.1).collect()
    }
    /// The unit in which tables store a quantity: mm and mm/s for lengths and their rates, rad for angles, else the SI unit.
    pub fn stored(quantity: Quantity) -> Unit {
        match quantity {
            Quantity::Length => Unit::Millimetre,
            Quantity::LinearRate => Unit::MillimetrePerSecond,
            other => UNITS.iter().find(|row| row.2 == other && row.3 == 1.0 && row.4 == 0.0).expect("SI unit").0,
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

//! Units at the edges: SI inside, one stored unit per quantity, people's units in files and reports.
//!
//! Units as people write them in headers: English, German, French, Spanish; in brackets or behind the name.

use std::fmt;

/// A unit that a stored column, a parameter or a column of a recording may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unit {
    /// A plain number.
    One,
    /// mm.
    Millimetre,
    /// um.
    Micrometre,
    /// m.
    Metre,
    /// in, 25.4 mm.
    Inch,
    /// rad.
    Radian,
    /// deg.
    Degree,
    /// mrad.
    Milliradian,
    /// arcsec, 1/3600 deg.
    Arcsecond,
    /// s.
    Second,
    /// ms.
    Millisecond,
    /// min.
    Minute,
    /// h.
    Hour,
    /// kg.
    Kilogram,
    /// A.
    Ampere,
    /// mA.
    Milliampere,
    /// Nm.
    NewtonMetre,
    /// kg m, of a first moment.
    KilogramMetre,
    /// kg m2, of an inertia.
    KilogramSquareMetre,
    /// N.
    Newton,
    /// Hz.
    Hertz,
    /// Degrees Celsius.
    Celsius,
    /// K.
    Kelvin,
    /// Nm/A, of a motor.
    NewtonMetrePerAmpere,
    /// rad/Nm, of a joint that yields.
    RadianPerNewtonMetre,
    /// rad/A, of a joint that yields to its motor current.
    RadianPerAmpere,
    /// m/s2.
    MetrePerSecondSquared,
    /// rad/s.
    RadianPerSecond,
    /// deg/s.
    DegreePerSecond,
    /// mm/s.
    MillimetrePerSecond,
    /// m/s.
    MetrePerSecond,
    /// How far a joint trails behind for its speed.
    RadianPerRadianPerSecond,
    /// arcsec per deg/s, as people read a trailing joint.
    ArcsecondPerDegreePerSecond,
}

/// What a unit measures; only units of one quantity convert into each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Dimensionless.
    Number,
    /// SI: m.
    Length,
    /// SI: rad.
    Angle,
    /// SI: s.
    Time,
    /// SI: kg.
    Mass,
    /// SI: A.
    Current,
    /// SI: Nm.
    Torque,
    /// SI: kg m.
    FirstMoment,
    /// SI: kg m2.
    Inertia,
    /// SI: N.
    Force,
    /// SI: Hz.
    Frequency,
    /// Stored in degrees Celsius.
    Temperature,
    /// SI: Nm/A.
    TorqueConstant,
    /// SI: rad/Nm.
    Compliance,
    /// SI: rad/A.
    CurrentCompliance,
    /// SI: m/s2.
    Acceleration,
    /// SI: rad/s.
    AngularRate,
    /// SI: m/s.
    LinearRate,
    /// SI: rad per rad/s.
    Trailing,
}

use Quantity as Q;
/// Unit, symbol, quantity, factor to SI, offset to SI (added after the factor); in the order of the units.
const UNITS: &[(Unit, &str, Quantity, f64, f64)] = &[
    (Unit::One, "1", Q::Number, 1.0, 0.0),
    (Unit::Millimetre, "mm", Q::Length, 1e-3, 0.0),
    (Unit::Micrometre, "um", Q::Length, 1e-6, 0.0),
    (Unit::Metre, "m", Q::Length, 1.0, 0.0),
    (Unit::Inch, "in", Q::Length, 25.4e-3, 0.0),
    (Unit::Radian, "rad", Q::Angle, 1.0, 0.0),
    (
        Unit::Degree,
        "deg",
        Q::Angle,
        std::f64::consts::PI / 180.0,
        0.0,
    ),
    (Unit::Milliradian, "mrad", Q::Angle, 1e-3, 0.0),
    (
        Unit::Arcsecond,
        "arcsec",
        Q::Angle,
        std::f64::consts::PI / 648_000.0,
        0.0,
    ),
    (Unit::Second, "s", Q::Time, 1.0, 0.0),
    (Unit::Millisecond, "ms", Q::Time, 1e-3, 0.0),
    (Unit::Minute, "min", Q::Time, 60.0, 0.0),
    (Unit::Hour, "h", Q::Time, 3600.0, 0.0),
    (Unit::Kilogram, "kg", Q::Mass, 1.0, 0.0),
    (Unit::Ampere, "A", Q::Current, 1.0, 0.0),
    (Unit::Milliampere, "mA", Q::Current, 1e-3, 0.0),
    (Unit::NewtonMetre, "Nm", Q::Torque, 1.0, 0.0),
    (Unit::KilogramMetre, "kg m", Q::FirstMoment, 1.0, 0.0),
    (Unit::KilogramSquareMetre, "kg m2", Q::Inertia, 1.0, 0.0),
    (Unit::Newton, "N", Q::Force, 1.0, 0.0),
    (Unit::Hertz, "Hz", Q::Frequency, 1.0, 0.0),
    // Celsius is kept as the base of temperature: effects need differences, people need degrees.
    (Unit::Celsius, "C", Q::Temperature, 1.0, 0.0),
    (Unit::Kelvin, "K", Q::Temperature, 1.0, -273.15),
    (
        Unit::NewtonMetrePerAmpere,
        "Nm/A",
        Q::TorqueConstant,
        1.0,
        0.0,
    ),
    (
        Unit::RadianPerNewtonMetre,
        "rad/Nm",
        Q::Compliance,
        1.0,
        0.0,
    ),
    (
        Unit::RadianPerAmpere,
        "rad/A",
        Q::CurrentCompliance,
        1.0,
        0.0,
    ),
    (
        Unit::MetrePerSecondSquared,
        "m/s2",
        Q::Acceleration,
        1.0,
        0.0,
    ),
    (Unit::RadianPerSecond, "rad/s", Q::AngularRate, 1.0, 0.0),
    (
        Unit::DegreePerSecond,
        "deg/s",
        Q::AngularRate,
        std::f64::consts::PI / 180.0,
        0.0,
    ),
    (Unit::MillimetrePerSecond, "mm/s", Q::LinearRate, 1e-3, 0.0),
    (Unit::MetrePerSecond, "m/s", Q::LinearRate, 1.0, 0.0),
    (
        Unit::RadianPerRadianPerSecond,
        "rad/(rad/s)",
        Q::Trailing,
        1.0,
        0.0,
    ),
    (
        Unit::ArcsecondPerDegreePerSecond,
        "arcsec/(deg/s)",
        Q::Trailing,
        1.0 / 3600.0,
        0.0,
    ),
];

impl Unit {
    #[inline]
    fn row(self) -> &'static (Unit, &'static str, Quantity, f64, f64) {
        &UNITS[self as usize]
    }
    /// As it is written in files and column names: `mm`, `Nm/A`.
    pub fn symbol(self) -> &'static str {
        self.row().1
    }
    /// What it measures.
    pub fn quantity(self) -> Quantity {
        self.row().2
    }
    /// Value in this unit -> SI.
    #[inline]
    pub fn to_si(self, value: f64) -> f64 {
        let row = self.row();
        value * row.3 + row.4
    }
    /// SI -> value in this unit.
    #[inline]
    pub fn from_si(self, value: f64) -> f64 {
        let row = self.row();
        (value - row.4) / row.3
    }
    /// The unit of a symbol; none where no unit is written so.
    pub fn parse(symbol: &str) -> Option<Unit> {
        UNITS.iter().find(|row| row.1 == symbol).map(|row| row.0)
    }
    /// All symbols of a quantity, for "allowed: mm, um, m, in".
    pub fn symbols(quantity: Quantity) -> Vec<&'static str> {
        UNITS
            .iter()
            .filter(|row| row.2 == quantity)
            .map(|row| row.1)
            .collect()
    }
    /// The unit in which tables store a quantity: mm and mm/s for lengths and their rates, rad for angles, else the SI unit.
    pub fn stored(quantity: Quantity) -> Unit {
        match quantity {
            Quantity::Length => Unit::Millimetre,
            Quantity::LinearRate => Unit::MillimetrePerSecond,
            other => {
                UNITS
                    .iter()
                    .find(|row| row.2 == other && row.3 == 1.0 && row.4 == 0.0)
                    .expect("SI unit")
                    .0
            }
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

/// What is written, in small letters, and what it means.
const WRITTEN: [(&str, Unit); 31] = [
    ("mm", Unit::Millimetre),
    ("millimeter", Unit::Millimetre),
    ("m", Unit::Metre),
    ("meter", Unit::Metre),
    ("um", Unit::Micrometre),
    ("\u{b5}m", Unit::Micrometre),
    ("\u{3bc}m", Unit::Micrometre),
    ("in", Unit::Inch),
    ("inch", Unit::Inch),
    ("deg", Unit::Degree),
    ("degree", Unit::Degree),
    ("degrees", Unit::Degree),
    ("degr\u{e9}s", Unit::Degree),
    ("grad", Unit::Degree),
    ("grados", Unit::Degree),
    ("\u{b0}", Unit::Degree),
    ("\u{ba}", Unit::Degree),
    ("rad", Unit::Radian),
    ("mrad", Unit::Milliradian),
    ("arcsec", Unit::Arcsecond),
    ("kg", Unit::Kilogram),
    ("c", Unit::Celsius),
    ("\u{b0}c", Unit::Celsius),
    ("\u{ba}c", Unit::Celsius),
    ("degc", Unit::Celsius),
    ("s", Unit::Second),
    ("sec", Unit::Second),
    ("ms", Unit::Millisecond),
    ("a", Unit::Ampere),
    ("ma", Unit::Milliampere),
    ("nm", Unit::NewtonMetre),
];

/// The unit that a text in small letters stands for.
pub fn written(text: &str) -> Option<Unit> {
    WRITTEN
        .iter()
        .find(|(written, _)| *written == text.trim())
        .map(|(_, unit)| *unit)
}

/// The name of a column taken apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header<'a> {
    /// The name without its unit.
    pub stem: &'a str,
    /// The unit that the header states, if it does.
    pub unit: Option<Unit>,
    /// The unit as it stands there, where no bracket says that it is one: the `a` of `x_a`.
    pub ending: Option<&'a str>,
}

impl<'a> Header<'a> {
    /// The parts of a name in small letters: `x [mm]`, `q1_deg`, `load kg`, `x/mm`, `x in mm`.
    pub fn of(lower: &'a str) -> Self {
        for (open, close) in [('[', ']'), ('(', ')')] {
            if let Some((stem, inside)) = lower
                .strip_suffix(close)
                .and_then(|text| text.rsplit_once(open))
                && !stem.trim().is_empty()
                && let Some(unit) = written(inside)
            {
                return Self {
                    stem: stem.trim(),
                    unit: Some(unit),
                    ending: None,
                };
            }
        }
        for separator in ["_", " ", "/", "."] {
            if let Some((stem, ending)) = lower.rsplit_once(separator)
                && !stem.trim().is_empty()
                && let Some(unit) = written(ending)
            {
                return Self {
                    stem: stem.trim().trim_end_matches(" in"),
                    unit: Some(unit),
                    ending: Some(ending.trim()),
                };
            }
        }
        Self {
            stem: lower,
            unit: None,
            ending: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_finds_its_own_row() {
        for (unit, symbol, quantity, ..) in UNITS {
            assert_eq!(
                (unit.row().0, unit.symbol(), unit.quantity()),
                (*unit, *symbol, *quantity)
            );
        }
        // Of a unit without a row the index would be that of another, or none.
        assert_eq!(
            UNITS.iter().map(|row| row.0 as usize).collect::<Vec<_>>(),
            (0..UNITS.len()).collect::<Vec<_>>()
        );
    }
}

//! Units at the edges: SI inside, one stored unit per quantity, people's units in files and reports.

use std::fmt;

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

/// Declares the units, each with its symbol, its quantity, its factor to SI, and what is added after that.
macro_rules! units {
    ($($unit:ident $symbol:literal $quantity:ident $factor:expr $(, $offset:expr)?;)+) => {
        /// A unit that a stored column, a parameter or a column of a recording may have.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Unit {
            $(#[doc = concat!("`", $symbol, "`, of the quantity ", stringify!($quantity), ".")] $unit,)+
        }

        /// Unit, symbol, quantity, factor to SI, offset to SI; in the order of the units.
        const UNITS: &[(Unit, &str, Quantity, f64, f64)] =
            &[$((Unit::$unit, $symbol, Quantity::$quantity, $factor, 0.0 $(+ $offset)?)),+];
    };
}

units! {
    One "1" Number 1.0;
    Millimetre "mm" Length 1e-3;
    Micrometre "um" Length 1e-6;
    Metre "m" Length 1.0;
    Inch "in" Length 25.4e-3;
    Radian "rad" Angle 1.0;
    Degree "deg" Angle std::f64::consts::PI / 180.0;
    Milliradian "mrad" Angle 1e-3;
    Arcsecond "arcsec" Angle std::f64::consts::PI / 648_000.0;
    Second "s" Time 1.0;
    Millisecond "ms" Time 1e-3;
    Minute "min" Time 60.0;
    Hour "h" Time 3600.0;
    Kilogram "kg" Mass 1.0;
    Ampere "A" Current 1.0;
    Milliampere "mA" Current 1e-3;
    NewtonMetre "Nm" Torque 1.0;
    KilogramMetre "kg m" FirstMoment 1.0;
    KilogramSquareMetre "kg m2" Inertia 1.0;
    Newton "N" Force 1.0;
    Hertz "Hz" Frequency 1.0;
    // Celsius is kept as the base of temperature: effects need differences, people need degrees.
    Celsius "C" Temperature 1.0;
    Kelvin "K" Temperature 1.0, -273.15;
    NewtonMetrePerAmpere "Nm/A" TorqueConstant 1.0;
    // Of a joint that yields: to its load, to its motor current.
    RadianPerNewtonMetre "rad/Nm" Compliance 1.0;
    RadianPerAmpere "rad/A" CurrentCompliance 1.0;
    MetrePerSecondSquared "m/s2" Acceleration 1.0;
    RadianPerSecond "rad/s" AngularRate 1.0;
    DegreePerSecond "deg/s" AngularRate std::f64::consts::PI / 180.0;
    MillimetrePerSecond "mm/s" LinearRate 1e-3;
    MetrePerSecond "m/s" LinearRate 1.0;
    // How far a joint trails behind for its speed; the second as people read it.
    RadianPerRadianPerSecond "rad/(rad/s)" Trailing 1.0;
    ArcsecondPerDegreePerSecond "arcsec/(deg/s)" Trailing 1.0 / 3600.0;
}

impl Unit {
    #[inline]
    fn row(self) -> &'static (Unit, &'static str, Quantity, f64, f64) {
        &UNITS[self as usize]
    }
    /// As it is written in files and column names: `mm`, `Nm/A`.
    pub fn symbol(self) -> &'static str {
        self.row().1
    }
    /// In words, of many: `millimetres`; the symbol where that is what people say.
    pub fn plural(self) -> &'static str {
        match self {
            Self::Millimetre => "millimetres",
            Self::Micrometre => "micrometres",
            Self::Metre => "metres",
            Self::Inch => "inches",
            Self::Radian => "radians",
            Self::Degree => "degrees",
            Self::Second => "seconds",
            Self::Millisecond => "milliseconds",
            Self::Ampere => "amperes",
            Self::Milliampere => "milliamperes",
            Self::Celsius => "degrees Celsius",
            Self::Kelvin => "kelvin",
            other => other.symbol(),
        }
    }
    /// The first other unit of its quantity in which `value`, as it is read in this one (SI), lies in a range (SI); none where none does.
    pub fn misread(self, value: f64, [lower, upper]: [f64; 2]) -> Option<Unit> {
        let others = UNITS.iter().map(|row| row.0);
        let mut others =
            others.filter(|other| *other != self && other.quantity() == self.quantity());
        others.find(|other| (lower..=upper).contains(&other.to_si(self.from_si(value))))
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

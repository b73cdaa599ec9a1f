//! Units as people write them in headers: English, German, French, Spanish; in brackets or behind the name.

use super::Unit;

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

//! Stated 95 % intervals against true numbers: the twin's numbers in the words and units of a diagnosis.
//!
//! Only numbers that mean the same in both are compared; a curve of another form has no true slope.

use super::paper::{Cause, Finding, Number};
use calib_foundation::units::Unit;

/// Whether a stated 95 % interval holds the true number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Interval {
    pub(crate) effect: String,
    pub(crate) holds: bool,
}

/// Two-sided 95 % of a normal distribution.
const NINETY_FIVE: f64 = 1.959_964;

/// A true number as a diagnosis would state it.
struct Expected {
    name: String,
    value: f64,
    unit: &'static str,
    /// The sign is a convention: sizes are compared.
    unsigned: bool,
}

type Counterpart = (
    &'static str,
    &'static str,
    &'static [&'static str],
    &'static str,
    f64,
    &'static str,
);

/// True numbers that have a counterpart: effect, the twin's word for the number, forms of which it holds (empty: all), the word of a
/// diagnosis after the seat, its value per true one, and unit.
#[rustfmt::skip]
const COUNTERPARTS: [Counterpart; 11] = [
    ("joint_compliance", "", &[], "", 1.0, "rad/Nm"),
    ("link_compliance", "middle", &[], "", 1.0, "rad/Nm"),
    ("base_compliance", "x", &["isotropic"], "", 1.0, "rad/Nm"),
    ("backlash", "gap", &["by direction", "by sign of load"], ".half_gap", 0.5, "arcsec"),
    ("zero_shift", "step", &[], ".step", 1.0, "arcsec"),
    ("tool_shift", "shift_x", &[], ".x", 1e-3, "mm"),
    ("tool_shift", "shift_y", &[], ".y", 1e-3, "mm"),
    ("tool_shift", "shift_z", &[], ".z", 1e-3, "mm"),
    ("joint_log_lag", "share", &[], ".share", 1.0, "1"),
    ("payload_error", "mass", &[], ".mass", 1.0, "1"),
    ("link_mass", "mass", &[], ".mass", 1.0, "1"),
];

/// Intervals of what was found of a cause.
pub(super) fn intervals(cause: &Cause, findings: &[Finding]) -> Vec<Interval> {
    let same = findings
        .iter()
        .filter(|finding| finding.effect == cause.effect && finding.place == cause.place);
    let stated: Vec<&Number> = same.flat_map(|finding| &finding.parameters).collect();
    let judge = |truth: Expected| {
        let full = format!("{}.{}", cause.effect, truth.name);
        let number = (stated.iter()).find(|one| one.name == truth.name || one.name == full)?;
        let sigma = number.sigma.filter(|sigma| *sigma > 0.0)?;
        let expected = convert(truth.value, truth.unit, &number.unit)?;
        let off = if truth.unsigned {
            number.value.abs() - expected.abs()
        } else {
            number.value - expected
        };
        Some(Interval {
            effect: cause.effect.clone(),
            holds: off.abs() <= NINETY_FIVE * sigma,
        })
    };
    (cause.parameters.iter())
        .filter_map(|number| expected(cause, number))
        .filter_map(judge)
        .collect()
}

/// The true number `effect.seat.what` in the words of a diagnosis; none where it has no counterpart.
fn expected(cause: &Cause, number: &Number) -> Option<Expected> {
    let tail = number.name.strip_prefix(&cause.effect)?.strip_prefix('.')?;
    let (seat, what) = tail.split_once('.').unwrap_or((tail, ""));
    let expected = |name, factor: f64, unit| {
        Some(Expected {
            name,
            value: factor * number.value,
            unit,
            unsigned: what == "gap",
        })
    };
    match (cause.effect.as_str(), what) {
        ("gear_cyclic" | "gear_motor_cyclic", wave) => {
            let (kind, order) = wave.split_at_checked(3)?;
            let name = format!("{seat}.order{order}.{kind}");
            ["sin", "cos"]
                .contains(&kind)
                .then(|| expected(name, 1.0, "arcsec"))?
        }
        // A run of links grows as one.
        ("thermal_growth", "expansion") => {
            let run = cause.place.strip_prefix("link ")?.replace('-', "_");
            let first = run.split('_').next() == seat.strip_prefix('l');
            first.then(|| expected(format!("l{run}.per_kelvin"), 1e-6, "1"))?
        }
        // Of a wrong centre the mass is none.
        (_, "mass") if number.value == 0.0 => None,
        (effect, what) => {
            let (.., ending, factor, unit) =
                COUNTERPARTS.iter().find(|(subject, word, forms, ..)| {
                    let form = forms.is_empty() || forms.contains(&cause.form.as_str());
                    (*subject, *word) == (effect, what) && form
                })?;
            expected(format!("{seat}{ending}"), *factor, unit)
        }
    }
}

/// A value in another unit; none where the units do not convert.
fn convert(value: f64, from: &str, to: &str) -> Option<f64> {
    if from == to {
        return Some(value);
    }
    let (from, to) = (Unit::parse(from)?, Unit::parse(to)?);
    (from.quantity() == to.quantity()).then(|| to.from_si(from.to_si(value)))
}

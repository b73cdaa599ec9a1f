//! Stated 95 % intervals against true numbers: the twin's numbers in the words and units of a diagnosis.
//!
//! Only numbers that mean the same in both are compared; a curve of another form has no true slope.

use super::paper::{Cause, Finding, Number};
use calib_foundation::units::Unit;

/// Whether a stated 95 % interval holds the true number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Interval {
    pub(crate) effect: String,
    pub(crate) name: String,
    /// Whether it holds the truth.
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

/// Intervals of what was found of a cause.
pub(super) fn intervals(cause: &Cause, findings: &[Finding]) -> Vec<Interval> {
    let same = findings
        .iter()
        .filter(|finding| finding.effect == cause.effect && finding.place == cause.place);
    let stated: Vec<&Number> = same.flat_map(|finding| &finding.parameters).collect();
    let judge = |truth: Expected| {
        let full = format!("{}.{}", cause.effect, truth.name);
        let number = stated
            .iter()
            .find(|number| number.name == truth.name || number.name == full)?;
        let sigma = number.sigma.filter(|sigma| *sigma > 0.0)?;
        let expected = convert(truth.value, truth.unit, &number.unit)?;
        let off = if truth.unsigned {
            number.value.abs() - expected.abs()
        } else {
            number.value - expected
        };
        Some(Interval {
            effect: cause.effect.clone(),
            name: truth.name,
            holds: off.abs() <= NINETY_FIVE * sigma,
        })
    };
    cause
        .parameters
        .iter()
        .filter_map(|number| expected(cause, number))
        .filter_map(judge)
        .collect()
}

/// The true number `effect.seat.what` in the words of a diagnosis; none where it has no counterpart.
fn expected(cause: &Cause, number: &Number) -> Option<Expected> {
    let rest = number.name.strip_prefix(&cause.effect)?.strip_prefix('.')?;
    let (seat, what) = rest.split_once('.').unwrap_or((rest, ""));
    let signed = |name: String, value: f64, unit: &'static str| {
        Some(Expected {
            name,
            value,
            unit,
            unsigned: false,
        })
    };
    let value = number.value;
    match (cause.effect.as_str(), what) {
        ("joint_compliance", "") => signed(seat.into(), value, "rad/Nm"),
        ("link_compliance", "middle") => signed(seat.into(), value, "rad/Nm"),
        ("base_compliance", "x") if cause.form == "isotropic" => {
            signed(seat.into(), value, "rad/Nm")
        }
        ("gear_cyclic" | "gear_motor_cyclic", ripple) => {
            let kind = ["sin", "cos"]
                .into_iter()
                .find(|kind| ripple.starts_with(kind))?;
            let order: f64 = ripple.strip_prefix(kind)?.parse().ok()?;
            signed(format!("{seat}.order{order}.{kind}"), value, "arcsec")
        }
        ("backlash", "gap")
            if ["by direction", "by sign of load"].contains(&cause.form.as_str()) =>
        {
            Some(Expected {
                name: format!("{seat}.half_gap"),
                value: 0.5 * value,
                unit: "arcsec",
                unsigned: true,
            })
        }
        ("zero_shift", "step") => signed(format!("{seat}.step"), value, "arcsec"),
        // A run of links grows as one.
        ("thermal_growth", "expansion") => {
            let run = cause.place.strip_prefix("link ")?.replace('-', "_");
            let first = run.split('_').next() == seat.strip_prefix('l');
            first.then(|| Expected {
                name: format!("l{run}.per_kelvin"),
                value: 1e-6 * value,
                unit: "1",
                unsigned: false,
            })
        }
        ("tool_shift", shift) => signed(
            format!("{seat}.{}", shift.strip_prefix("shift_")?),
            1e-3 * value,
            "mm",
        ),
        ("joint_log_lag", "share") => signed(format!("{seat}.share"), value, "1"),
        ("payload_error", "mass") if value != 0.0 => signed(format!("{seat}.mass"), value, "1"),
        ("link_mass", "mass") if value != 0.0 => signed(format!("{seat}.mass"), value, "1"),
        _ => None,
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

//! How far from nominal an arm is made, as robot files state it: a number with its unit for each class of numbers.

use super::place::DocumentNode;
use crate::description::Made;
use crate::units::Unit;
use std::collections::BTreeMap;

/// `tolerances: {length: 0.5 mm, zero: 3 mrad, ratio: 1e-4}`, SI; a fault for everything that is no tolerance of an arm.
pub(super) fn tolerances(value: DocumentNode) -> BTreeMap<Made, f64> {
    let value = value.map(&Made::ALL.map(|(_, name, _)| name));
    let given = |(made, name, stored): &(Made, &str, Unit)| {
        let place = value.opt(name)?;
        Some((*made, tolerance(&place, *stored)))
    };
    Made::ALL.iter().filter_map(given).collect()
}

/// One of the quantity that `stored` is a unit of; a number alone where that has none.
fn tolerance(place: &DocumentNode, stored: Unit) -> f64 {
    let text = place.text();
    let text = text.trim();
    if text.is_empty() {
        return f64::NAN;
    }
    let (number, unit) = match text.split_once(char::is_whitespace) {
        Some((number, unit)) => (number, unit.trim()),
        None => (text, Unit::One.symbol()),
    };
    let allowed = Unit::symbols(stored.quantity());
    let unit = Unit::parse(unit).filter(|unit| unit.quantity() == stored.quantity());
    let (Ok(number), Some(unit)) = (number.parse::<f64>(), unit) else {
        let example = match stored {
            Unit::One => "1e-4".to_string(),
            unit => format!("0.5 {}", unit.symbol()),
        };
        let units = match stored {
            Unit::One => "a number without a unit".to_string(),
            _ => format!("a number and one of {}", allowed.join(", ")),
        };
        place.fault(format!(
            "expected {units}, e.g. `{example}`, found `{text}`"
        ));
        return f64::NAN;
    };
    if !(number > 0.0 && number.is_finite()) {
        place.fault(format!(
            "expected a tolerance above 0 (to keep a parameter at nominal, name it under `hold` of the stage), found `{text}`"
        ));
    }
    unit.to_si(number)
}

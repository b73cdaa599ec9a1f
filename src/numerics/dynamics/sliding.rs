//! Units of a joint that slides: N and m where one that turns has Nm and rad.

/// Of a joint that turns and of one that slides.
const UNITS: [(&str, &str); 10] = [
    ("Nm s/rad", "N s/m"),
    ("Nm/rad3", "N/m3"),
    ("Nm/rad2", "N/m2"),
    ("Nm/rad", "N/m"),
    ("kg m2", "kg"),
    ("rad/s2", "m/s2"),
    ("rad/s", "m/s"),
    ("Nm/A", "N/A"),
    ("Nm", "N"),
    ("rad", "m"),
];

/// The unit of a number of a joint by that of one that turns.
pub fn unit_at(slides: bool, unit: &'static str) -> &'static str {
    let known = UNITS.iter().find(|(turning, _)| slides && *turning == unit);
    known.map_or(unit, |(_, sliding)| sliding)
}

/// The unit of a number by that of one of a joint that turns.
pub(super) type UnitAt = fn(&'static str) -> &'static str;

/// Units of a joint.
pub(super) fn unit_of(slides: bool) -> UnitAt {
    match slides {
        true => |unit| unit_at(true, unit),
        false => |unit| unit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_sliding_joint_are_in_newtons_and_metres() {
        assert_eq!(
            ["Nm s/rad", "Nm", "rad/s", "kg m2", "s"].map(unit_of(true)),
            ["N s/m", "N", "m/s", "kg", "s"]
        );
        assert_eq!(["Nm s/rad", "s"].map(unit_of(false)), ["Nm s/rad", "s"]);
    }
}

//! What the ten inertial numbers of a link are called, and their units.

use super::newton_euler::INERTIAL_NUMBERS;

/// As the regressor counts them: moments are mass times centre from the joint's point, inertias about that point.
pub const INERTIAL_NAMES: [&str; INERTIAL_NUMBERS] = [
    "mass",
    "moment_x",
    "moment_y",
    "moment_z",
    "inertia_xx",
    "inertia_xy",
    "inertia_xz",
    "inertia_yy",
    "inertia_yz",
    "inertia_zz",
];

/// `rigid_body.l3.mass`; `number` counts 10 a link.
pub(super) fn inertial_name(number: usize) -> String {
    format!(
        "rigid_body.l{}.{}",
        number / INERTIAL_NUMBERS + 1,
        INERTIAL_NAMES[number % INERTIAL_NUMBERS]
    )
}

/// kg, kg m or kg m2.
pub(super) fn inertial_unit(number: usize) -> &'static str {
    match number % INERTIAL_NUMBERS {
        0 => "kg",
        1..=3 => "kg m",
        _ => "kg m2",
    }
}

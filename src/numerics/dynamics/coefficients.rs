//! What the coefficients of each cause are called in the model, and their units.

use super::cause::TorqueForm;

/// Quantity and unit.
pub(super) type CoefficientName = (&'static str, &'static str);

/// Of causes that add torque at joints; wrong masses are in the inertial numbers instead.
const NAMES: [(&str, &[CoefficientName]); 18] = [
    ("viscous_friction", &[("viscous", "Nm s/rad")]),
    ("coulomb_friction", &[("coulomb", "Nm")]),
    ("current_offset", &[("offset", "Nm")]),
    ("asymmetric_friction", &[("asymmetry", "Nm")]),
    ("stribeck_friction", &[("stribeck", "Nm")]),
    ("presliding_friction", &[("kept", "Nm")]),
    ("load_friction", &[("share", "1")]),
    ("warmup_friction", &[("viscous_cold", "Nm s/rad"), ("coulomb_cold", "Nm")]),
    ("rotor_inertia", &[("inertia", "kg m2")]),
    ("torque_constant", &[("relative", "1")]),
    ("spring_balance", &[("stiffness", "Nm/rad"), ("at_zero", "Nm")]),
    ("cable_stiffness", &[("stiffness", "Nm/rad"), ("at_zero", "Nm")]),
    ("torque_ripple", &[("cosine", "Nm"), ("sine", "Nm")]),
    ("joint_elasticity", &[("share", "1")]),
    ("backlash_spikes", &[("height", "Nm")]),
    ("wrist_coupling", &[("viscous", "Nm s/rad"), ("coulomb", "Nm")]),
    ("gravity_direction", &[("side_x", "1"), ("side_y", "1")]),
    ("unknown", &[("sin_sin", "Nm"), ("sin_cos", "Nm"), ("cos_sin", "Nm"), ("cos_cos", "Nm")]),
];

/// Of a form, one a column; by number where a cause has none.
pub(super) fn coefficient_names(form: &TorqueForm) -> Vec<(String, &'static str)> {
    let known = NAMES.iter().find(|(cause, _)| *cause == form.cause.name()).map_or(&[][..], |(_, names)| names);
    let name = |column: usize| match known.get(column) {
        Some((quantity, unit)) => ((*quantity).to_string(), *unit),
        None => (format!("coefficient_{}", column + 1), "1"),
    };
    (0..form.width).map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::super::cause::TORQUE_CAUSES;
    use super::*;

    #[test]
    fn every_cause_that_adds_torque_at_joints_has_names_for_its_coefficients() {
        let masses = ["payload_error", "link_mass", "link_com", "link_inertia"];
        for cause in TORQUE_CAUSES.iter().map(|cause| cause.name()).filter(|name| !masses.contains(name)) {
            assert!(NAMES.iter().any(|(name, _)| *name == cause), "{cause} has no names");
        }
    }
}

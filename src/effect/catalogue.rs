//! The library in words: what each effect is, how large it usually is, what it is easily taken for, and what shows it.
//!
//! [`EFFECTS`](super::EFFECTS) and [`CAUSES`](super::CAUSES) hold what is computed and no words; some names have no computation of their own.

/// An entry of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Canonical name.
    pub name: &'static str,
    /// Where it sits.
    pub place: &'static str,
    /// q: joint position, dq/dt: its velocity, t: load torque of a joint, s: direction of approach, T: temperature; d: turn of the joint.
    pub formula: &'static str,
    /// On industrial arms.
    pub size: &'static str,
    /// Effects that do nearly the same where a recording is poor.
    pub confounded: &'static str,
    /// Columns of the recording and entries of the robot file without which it cannot be told.
    pub needs: &'static str,
}

const fn about(
    name: &'static str,
    place: &'static str,
    formula: &'static str,
    size: &'static str,
    confounded: &'static str,
    needs: &'static str,
) -> About {
    About { name, place, formula, size, confounded, needs }
}

/// Every effect with a name, in the order in which a model is built up.
#[rustfmt::skip]
pub const CATALOGUE: &[About] = &[
    about("base_frame", "base", "a rigid motion of the base", "any", "tool_offset, joint_offset of the first joint", "-"),
    about("tool_offset", "tool", "a displacement of the measured point", "any", "link_geometry of the last link", "-"),
    about("anchor", "anchor", "the far end of a draw-wire or ballbar is elsewhere; it moves no point", "any", "base_frame", "distances"),
    about("joint_offset", "joint", "d = c", "0.1 to 5 mrad", "base_frame, link_geometry", "-"),
    about("link_geometry", "link", "lengths and tilts between two axes", "0.1 to 1 mm, 0.1 to 1 mrad", "joint_offset, tool_offset", "-"),
    about("reduction_ratio", "joint", "d = c q", "1e-5 to 1e-3", "joint_compliance, gear_cyclic of order 1", "a wide travel of the joint"),
    about("coupling_ratio", "joint A->B", "d of B = c q of A", "1e-5 to 1e-2", "axis_wobble, link_geometry", "a wide travel of joint A"),
    about("joint_compliance", "joint", "d = c t", "0.1 to 10 urad/Nm", "joint_hardening, reduction_ratio, link_compliance", "link masses, or motor currents"),
    about("joint_hardening", "joint", "d = a t + b f(t): stiffer, softer, two slopes, a power, a free curve", "5 to 50 % of the wind-up", "joint_compliance, backlash", "link masses and two payloads"),
    about("link_compliance", "link", "the link bends about its far joint, by the moment there", "0.05 to 1 urad/Nm", "joint_compliance of either end", "link masses"),
    about("base_compliance", "base", "the base tilts about its origin, or a point below, by the moment on it", "0.01 to 1 urad/Nm", "joint_compliance of joint 2, link_compliance of link 1", "link masses"),
    about("gear_cyclic", "joint", "d = a sin(n q) + b cos(n q), n = 1 .. 48", "5 to 100 arcsec", "counterbalance at n = 1, axis_wobble", "enough points a period"),
    about("gear_motor_cyclic", "joint", "d = a sin(n i q) + b cos(n i q), i the reduction ratio, n = 1, 2", "2 to 30 arcsec", "noise: nothing else is as fast", "reduction ratios in the robot file"),
    about("joint_table", "joint", "d = a smooth curve of q over the measured range", "5 to 200 arcsec", "gear_cyclic", "many points"),
    about("backlash", "joint", "d = g s, or g sign(t), or the one at small and the other at large loads", "5 to 100 arcsec", "joint_hardening, joint_log_lag", "both directions of approach"),
    about("thermal_growth", "link, or neighbouring links", "lengths grow by c (T - T0), or c (1 - exp(-time / tau))", "10 to 25 um/m for each kelvin", "tracker_drift, growth of neighbouring links", "temperature or time"),
    about("counterbalance", "joint 2 or 3", "t = a sin q + b cos q, and of 2 q, on top of gravity", "10 to 60 % of the gravity torque", "gear_cyclic of order 1, link_mass", "link masses and motor currents"),
    about("link_mass", "link", "mass and first moments of a link in the torque model", "3 to 20 %", "counterbalance, payload_error", "link masses and motor currents"),
    about("payload_error", "tool", "mass and centre of the payload in the torque model", "3 to 30 %", "joint_hardening", "rows with and without the payload"),
    about("cable_drag", "joint", "t by the angles of the joint and its neighbour", "1 to 10 % of the joint's torque", "unknown, gear_cyclic of order 1", "motor currents"),
    about("axis_wobble", "joint", "the axis tilts by sin(n q), cos(n q), n = 1, 2", "5 to 100 arcsec", "gear_cyclic of a neighbour, coupling_ratio", "points far off the axis"),
    about("viscous_windup", "joint", "d = -c dq/dt: the joint trails in proportion to its speed", "0.2 to 10 arcsec for each deg/s", "joint_log_lag where one joint moves alone", "joint velocities, of a moving arm"),
    about("zero_shift", "joint", "d = c after some time", "10 to 500 arcsec", "base_shift (joint 1), tool_shift (last joint)", "rows in the order of measurement"),
    about("tool_shift", "tool", "the target moves at some time", "20 to 500 um", "zero_shift of the last joints", "rows in the order of measurement"),
    about("base_shift", "base", "the base moves at some time", "20 to 500 um", "zero_shift of joint 1, tracker_drift", "rows in the order of measurement"),
    about("tracker_drift", "tracker", "the tracker's frame moves steadily, with the warm-up, or slowly", "10 to 200 um", "thermal_growth, base_shift", "time"),
    about("tracker_scale", "tracker", "all distances are longer by a share", "1 to 20 um/m", "link_geometry, which absorbs it", "a scale bar: points of the arm never show it"),
    about("joint_log_lag", "recording", "joints were logged a share of the last move too early; of a moving arm d = c dq/dt of every joint, its clock and the tracker's c apart", "0.1 to 5 % of the move; 0.5 to 20 ms", "backlash; viscous_windup where one joint moves alone", "rows in the order of measurement; joint velocities"),
    about("outlier", "recording", "single wrong points", "any", "-", "-"),
    about("mislabelled_point", "recording", "points that carry each other's name", "any", "-", "-"),
    about("unknown", "joint, base or tool", "a form-free function of joints, time or payload", "any", "whatever is in no list", "-"),
];

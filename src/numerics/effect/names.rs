//! The names of causes that others refer to: as in tables and YAML, each written down once.

#![expect(missing_docs, reason = "a constant is named as what it holds")]

pub const ANCHOR: &str = "anchor";
pub const AXIS_WOBBLE: &str = "axis_wobble";
pub const BACKLASH: &str = "backlash";
pub const BASE_COMPLIANCE: &str = "base_compliance";
pub const BASE_FRAME: &str = "base_frame";
pub(crate) const BASE_SHIFT: &str = "base_shift";
pub const CABLE_DRAG: &str = "cable_drag";
pub(crate) const COUNTERBALANCE: &str = "counterbalance";
pub const COUPLING_RATIO: &str = "coupling_ratio";
pub const GEAR_CYCLIC: &str = "gear_cyclic";
pub const JOINT_COMPLIANCE: &str = "joint_compliance";
pub const JOINT_HARDENING: &str = "joint_hardening";
pub const JOINT_LOG_LAG: &str = "joint_log_lag";
pub const JOINT_OFFSET: &str = "joint_offset";
pub const JOINT_TABLE: &str = "joint_table";
pub(crate) const JOINT_WARMING: &str = "joint_warming";
pub const LINK_COMPLIANCE: &str = "link_compliance";
pub const LINK_GEOMETRY: &str = "link_geometry";
pub(crate) const LINK_MASS: &str = "link_mass";
pub const MISLABELLED_POINT: &str = "mislabelled_point";
pub const OUTLIER: &str = "outlier";
pub(crate) const PAYLOAD_ERROR: &str = "payload_error";
pub(crate) const PRESLIDING: &str = "presliding";
pub const REDUCTION_RATIO: &str = "reduction_ratio";
pub const THERMAL_GROWTH: &str = "thermal_growth";
pub const TOOL_OFFSET: &str = "tool_offset";
pub(crate) const TOOL_SHIFT: &str = "tool_shift";
pub const TRACKER_CIRCLE: &str = "tracker_circle";
pub const TRACKER_DRIFT: &str = "tracker_drift";
pub const TRACKER_ELEVATION: &str = "tracker_elevation";
pub const UNKNOWN: &str = "unknown";
pub(crate) const VISCOUS_WINDUP: &str = "viscous_windup";
pub const ZERO_SHIFT: &str = "zero_shift";

//! The whole model as one JSON document: description, parameters with sigma, what rigid geometry leaves out.

use super::{CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::error::{Error, Result};
use serde_json::json;

pub(super) const JSON: Format = Format {
    name: "json",
    help: "Everything: description, parameters with sigma, remarks",
    comment: "\"origin\"",
    carries: CarriedTorques::All,
    text,
};

fn text(export: &Export) -> Result<String> {
    let finite = |value: f64| {
        if value.is_finite() {
            json!(value)
        } else {
            json!(null)
        }
    };
    let Export {
        identified,
        corrected,
        left_out,
        residual,
        poses,
        ..
    } = export;
    let joints = corrected.joints.iter().map(|joint| {
        json!({
            "name": joint.name,
            "kind": if joint.kind == JointKind::Revolute { "revolute" } else { "prismatic" },
            "axis": joint.axis, "point_m": joint.point, "limits": joint.limits,
            "reduction_ratio": joint.reduction_ratio, "motor_constant_nm_a": joint.motor_constant,
            "mass_kg": joint.mass, "centre_m": joint.centre,
        })
    });
    let parameters = identified.parameters.0.iter().map(|row| {
        json!({
            "name": row.name, "effect": row.effect, "where": row.place, "unit": row.unit, "nominal": finite(row.nominal),
            "value": finite(row.value), "sigma": row.sigma, "status": row.status,
            "form": row.form.as_deref().and_then(|form| serde_json::from_str::<serde_json::Value>(form).ok()),
        })
    });
    let base = identified.model.base();
    let mut document = json!({
        "calib_model": 1,
        "mark": export.mark(JSON.name).to_string(),
        "name": corrected.name,
        "origin": identified.origin,
        "conventions": "SI; screws at the zero pose in the base frame: T(q) = exp(S1 q1) .. exp(Sn qn) tool",
        "base_in_tracker": { "point_m": <[f64; 3]>::from(base.translation), "rotation_vector_rad": <[f64; 3]>::from(base.rotation_vector()) },
        "joints": joints.collect::<Vec<_>>(),
        "tool": { "point_m": corrected.tool, "rotation": corrected.tool_rotation },
        "parameters": parameters.collect::<Vec<_>>(),
        "rigid_residual_mm": { "rms": residual.0 * 1e3, "max": residual.1 * 1e3, "poses": poses },
        "not_in_geometry": left_out.iter().map(|out| json!({
            "effect": out.effect, "where": out.place.to_string(), "rms_mm": out.rms * 1e3, "max_mm": out.most * 1e3 })).collect::<Vec<_>>(),
        "learned_correction": identified.correction.is_some(),
    });
    if let Some(torques) = &identified.torques {
        document["torques"] = super::dynamics::document(export, torques)?;
    }
    serde_json::to_string_pretty(&document)
        .map(|text| text + "\n")
        .map_err(|error| Error::Bug(error.to_string()))
}

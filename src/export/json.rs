//! The whole model as one JSON document: description, parameters with sigma, what rigid geometry leaves out.

use super::friction::{ARMATURE, DAMPING, FRICTION, of_line, stands_alone};
use super::{CarriedGeometry, CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::dynamics::{FittedNumber, INERTIAL_NAMES, INERTIAL_NUMBERS, TorqueTerm, unit_at};
use crate::effect::Place;
use crate::error::{Error, Result};
use crate::identified::IdentifiedTorques;
use crate::table::TorqueParameterRow;
use serde_json::{Map, Value, json};

pub(super) const JSON: Format = Format {
    name: "json",
    help: "Everything: description, parameters with sigma, remarks",
    comment: "\"origin\"",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::All,
    text,
};

fn text(export: &Export) -> Result<String> {
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    let (identified, corrected) = (&export.identified, &export.corrected);
    let (residual, poses) = (export.residual, export.poses);
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
        "not_in_geometry": export.left_out.iter().map(|out| json!({
            "effect": out.effect, "where": out.place.to_string(), "rms_mm": out.rms * 1e3, "max_mm": out.most * 1e3 })).collect::<Vec<_>>(),
        "learned_correction": identified.correction.is_some(),
    });
    if let Some(torques) = &identified.torques {
        document["torques"] = dynamics(export, torques)?;
    }
    pretty(&document)
}

fn pretty(document: &Value) -> Result<String> {
    let text = serde_json::to_string_pretty(document);
    text.map(|text| text + "\n")
        .map_err(|error| Error::Bug(error.to_string()))
}

pub(super) const DYNAMICS: Format = Format {
    name: "dynamics",
    help: "Friction, inertials and all other causes of the torques with sigma, as plain JSON",
    comment: "\"origin\"",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::All,
    text: torques,
};

fn torques(export: &Export) -> Result<String> {
    let Some(torques) = &export.identified.torques else {
        let message =
            "no torques were identified: put `- uses: diagnose_torques` after `ingest_torques`";
        return Err(Error::spec("--format dynamics", message));
    };
    let mut document = dynamics(export, torques)?;
    document["mark"] = json!(export.mark(DYNAMICS.name).to_string());
    pretty(&document)
}

/// The model of torques as one document.
fn dynamics(export: &Export, torques: &IdentifiedTorques) -> Result<Value> {
    let model = &torques.model;
    let curves = model.friction_curves()?;
    let rows = |effect: &'static str| {
        let rows = torques.parameters.0.iter();
        rows.filter(move |row| row.effect == effect)
    };
    let joints = export.corrected.joints.iter().enumerate().map(|(index, joint)| {
        let place = format!("joint {}", index + 1);
        let alone = |effect: &str| {
            model.terms.iter().any(|term| term.effect == effect && term.place.to_string() == place && stands_alone(torques, term))
        };
        let of_effect = |effect: &'static str| {
            let mut numbers = rows(effect).filter(|row| row.place == place && row.form.is_some() && alone(effect));
            numbers.next().map_or(Value::Null, number)
        };
        let seen = &model.range[index];
        let [angle, rate, newton, drive] = match seen.slides {
            true => ["m", "m_s", "n", "force_n"],
            false => ["rad", "rad_s", "nm", "torque_nm"],
        };
        let curve = curves
            .iter()
            .find(|curve| curve.joint == index)
            .map(|curve| json!({ format!("speed_{rate}"): curve.velocity, drive: curve.torque, format!("sigma_{newton}"): curve.sigma }));
        let (mut viscous, mut coulomb) = (of_effect(DAMPING), of_effect(FRICTION));
        let model_term = |effect: &str| model.terms.iter().find(|term| term.effect == effect && term.place == Place::Joint(index));
        for (effect, unit, number) in [(DAMPING, "Nm s/rad", &mut viscous), (FRICTION, "Nm", &mut coulomb)] {
            let line = model_term(effect).and_then(|term| of_line(torques, term));
            if let (Some(raw), Some(FittedNumber { value, sigma })) = (number.as_object_mut(), line) {
                raw.extend(Map::from_iter([
                    ("value".into(), json!(value)),
                    ("unit".into(), json!(unit_at(seen.slides, unit))),
                    ("sigma".into(), json!(sigma)),
                ]));
            }
        }
        let power = rows(DAMPING).find(|row| row.place == place && row.form.is_some());
        let exponent = model_term(DAMPING).and_then(|term| term.shape.first()).filter(|exponent| **exponent != 1.0);
        if let (Some(friction), Some(power), Some(exponent)) = (viscous.as_object_mut(), power, exponent) {
            let unit = match seen.slides {
                true => "N (s/m)^exponent",
                false => "Nm (s/rad)^exponent",
            };
            let law = json!({ "value": power.value, "unit": unit, "sigma": power.sigma, "exponent": exponent });
            friction.insert("law".into(), law);
        }
        json!({
            "name": joint.name, "viscous": viscous, "coulomb": coulomb, "friction": curve,
            "armature": of_effect(ARMATURE), "reduction_ratio": joint.reduction_ratio, "motor_constant_nm_a": joint.motor_constant,
            format!("sign_width_{rate}"): seen.sign_width,
            "seen": { format!("position_{angle}"): seen.position, format!("speed_{rate}"): seen.speed, format!("acceleration_{rate}2"): seen.acceleration },
        })
    });
    Ok(json!({
        "calib_torques": 1,
        "name": export.corrected.name,
        "origin": torques.origin,
        "conventions": format!(
            "SI; joints and links from 1, axes of the base at the zero pose; numbers of a link are {}, moments from its joint's point and \
             inertias about it, those of links that are not whole stand for others too; the last link carries the payload; torques are those \
             that the drives or sensors of the recording state; friction is the sum of all laws of speed at a joint, viscous and coulomb its parts \
             where they stand alone: where one grows with another power of speed than the first (`law`), those of the straight line of both over the \
             recorded speeds",
            INERTIAL_NAMES[..INERTIAL_NUMBERS].join(", ")
        ),
        "sign_width_rad_s": model.sign_width,
        "friction_lead_s": model.friction_lead,
        "joints": joints.collect::<Vec<_>>(),
        "links": links(torques),
        "causes": causes(torques),
        "of_the_recording": torques.of_the_recording,
        "remarks": torques.warnings,
    }))
}

/// A number with its unit and standard deviation.
fn number(row: &TorqueParameterRow) -> Value {
    json!({ "value": row.value, "unit": row.unit, "sigma": row.sigma })
}

/// The numbers of some rows by their quantities.
fn numbers(torques: &IdentifiedTorques, is: impl Fn(&TorqueParameterRow) -> bool) -> Value {
    let rows = torques.parameters.0.iter().filter(|row| is(row));
    let numbers: Map<String, Value> = rows
        .map(|row| (row.quantity.clone(), number(row)))
        .collect();
    json!(numbers)
}

/// Every link with its body and the numbers that were estimated.
fn links(torques: &IdentifiedTorques) -> Vec<Value> {
    let model = &torques.model;
    let consistent = model.consistency();
    let link = |link: usize| {
        let place = format!("link {}", link + 1);
        let numbers = numbers(torques, |row| {
            row.effect == "rigid_body" && row.place == place
        });
        let body = model.body(link).map(|body| {
            let i = &body.inertia;
            json!({
                "mass_kg": body.mass, "centre_from_joint_m": <[f64; 3]>::from(body.centre),
                "inertia_about_centre_kg_m2": [i[(0, 0)], i[(0, 1)], i[(0, 2)], i[(1, 1)], i[(1, 2)], i[(2, 2)]],
            })
        });
        let known = consistent.iter().find(|one| one.link == link);
        json!({
            "link": link + 1, "whole": model.is_whole(link), "consistent": known.map(|one| one.is_consistent()),
            "body": body, "numbers": numbers,
        })
    };
    (0..model.joints()).map(link).collect()
}

/// Every cause with all of its numbers.
fn causes(torques: &IdentifiedTorques) -> Vec<Value> {
    let model = &torques.model;
    let cause = |(place, term): (usize, &TorqueTerm)| {
        let prefix = format!("{}.", model.prefix(place));
        let numbers = numbers(torques, |row| {
            let quantity = row.name.strip_prefix(&prefix);
            quantity.is_some_and(|quantity| quantity == row.quantity)
        });
        json!({
            "effect": term.effect, "where": term.place.to_string(), "alone": stands_alone(torques, term), "numbers": numbers, "with": term.with, "shape": term.shape,
            "rms_nm": term.rms,
        })
    };
    model.terms.iter().enumerate().map(cause).collect()
}

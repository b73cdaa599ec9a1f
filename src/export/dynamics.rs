//! Friction, inertials and all other causes of the torques as one plain JSON document, with sigma.

use super::friction::{ARMATURE, DAMPING, FRICTION, of_line, stands_alone};
use super::{CarriedTorques, Export, Format};
use crate::dynamics::{FittedNumber, INERTIAL_NAMES, INERTIAL_NUMBERS};
use crate::effect::Place;
use crate::error::{Error, Result};
use crate::identified::IdentifiedTorques;
use crate::table::TorqueParameterRow;
use serde_json::{Map, Value, json};

pub(super) const DYNAMICS: Format = Format {
    name: "dynamics",
    help: "Friction, inertials and all other causes of the torques with sigma, as plain JSON",
    comment: "\"origin\"",
    carries: CarriedTorques::All,
    text,
};

fn text(export: &Export) -> Result<String> {
    let Some(torques) = &export.identified.torques else {
        let message =
            "no torques were identified: put `- uses: diagnose_torques` after `ingest_torques`";
        return Err(Error::spec("--format dynamics", message));
    };
    let mut document = document(export, torques)?;
    document["mark"] = json!(export.mark(DYNAMICS.name).to_string());
    serde_json::to_string_pretty(&document)
        .map(|text| text + "\n")
        .map_err(|error| Error::Bug(error.to_string()))
}

/// The model of torques as one document.
pub(super) fn document(export: &Export, torques: &IdentifiedTorques) -> Result<Value> {
    let model = &torques.model;
    let curves = model.friction_curves()?;
    let rows = |effect: &'static str| {
        torques
            .parameters
            .0
            .iter()
            .filter(move |row| row.effect == effect)
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
        let curve = curves
            .iter()
            .find(|curve| curve.joint == index)
            .map(|curve| json!({ "speed_rad_s": curve.velocity, "torque_nm": curve.torque, "sigma_nm": curve.sigma }));
        let seen = &model.range[index];
        let (mut viscous, mut coulomb) = (of_effect(DAMPING), of_effect(FRICTION));
        let model_term = |effect: &str| model.terms.iter().find(|term| term.effect == effect && term.place == Place::Joint(index));
        for (effect, unit, number) in [(DAMPING, "Nm s/rad", &mut viscous), (FRICTION, "Nm", &mut coulomb)] {
            let line = model_term(effect).and_then(|term| of_line(torques, term));
            if let (Some(raw), Some(FittedNumber { value, sigma })) = (number.as_object_mut(), line) {
                raw.extend(Map::from_iter([
                    ("value".into(), json!(value)),
                    ("unit".into(), json!(unit)),
                    ("sigma".into(), json!(sigma)),
                ]));
            }
        }
        let power = rows(DAMPING).find(|row| row.place == place && row.form.is_some());
        let exponent = model_term(DAMPING).and_then(|term| term.shape.first()).filter(|exponent| **exponent != 1.0);
        if let (Some(friction), Some(power), Some(exponent)) = (viscous.as_object_mut(), power, exponent) {
            let law = json!({ "value": power.value, "unit": "Nm (s/rad)^exponent", "sigma": power.sigma, "exponent": exponent });
            friction.insert("law".into(), law);
        }
        json!({
            "name": joint.name, "viscous": viscous, "coulomb": coulomb, "friction": curve,
            "armature": of_effect(ARMATURE), "reduction_ratio": joint.reduction_ratio, "motor_constant_nm_a": joint.motor_constant,
            "sign_width_rad_s": seen.sign_width,
            "seen": { "position_rad": seen.position, "speed_rad_s": seen.speed, "acceleration_rad_s2": seen.acceleration },
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

/// Every link with its body and the numbers that were estimated.
fn links(torques: &IdentifiedTorques) -> Vec<Value> {
    let model = &torques.model;
    let consistent = model.consistency();
    let link = |link: usize| {
        let place = format!("link {}", link + 1);
        let numbers: Map<String, Value> = torques
            .parameters
            .0
            .iter()
            .filter(|row| row.effect == "rigid_body" && row.place == place)
            .map(|row| (row.quantity.clone(), number(row)))
            .collect();
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
    let cause = |(place, term): (usize, &crate::dynamics::TorqueTerm)| {
        let prefix = format!("{}.", model.prefix(place));
        let at_place = torques.parameters.0.iter().filter(|row| {
            let quantity = row.name.strip_prefix(&prefix);
            quantity.is_some_and(|quantity| quantity == row.quantity)
        });
        let numbers: Map<String, Value> = at_place
            .map(|row| {
                (
                    row.quantity.clone(),
                    json!({ "value": row.value, "unit": row.unit, "sigma": row.sigma }),
                )
            })
            .collect();
        json!({
            "effect": term.effect, "where": term.place.to_string(), "alone": stands_alone(torques, term), "numbers": numbers, "with": term.with, "shape": term.shape,
            "rms_nm": term.rms,
        })
    };
    model.terms.iter().enumerate().map(cause).collect()
}

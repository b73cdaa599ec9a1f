//! Columns of the recording are declared once: what is declared is stored, and a declared effect may ask for it.
//!
//! `CALIB_UPDATE=1 cargo test --test it columns` writes the fields that `schemas/recording.json` lacks.

use crate::answer::{self, put, read, root};
use crate::fixture::{poses, spread};
use crate::identify::normal;
use crate::twin::sr210d;
use calib::observation::DeclaredColumn;
use calib::robot::RobotModel;
use calib::spatial::{Pose, Twist};
use calib::table::{Recording, from_file, recording_columns};
use serde_json::{Value, json};

/// Fields that the recording's schema must have for a column: name, unit, and range in that unit.
fn fields(column: &DeclaredColumn) -> Vec<Value> {
    if column.is_text() {
        return vec![json!({"name": column.setting, "type": "utf8"})];
    }
    let mut out: Vec<Value> = Vec::new();
    for slides in [false, true] {
        let ([lower, upper], stored) = (column.of_joint(slides).1, column.columns(&[slides]));
        for (name, unit) in stored {
            let name = if column.is_of_joints() {
                name.replacen('1', "{j}", 1)
            } else {
                name
            };
            let within = json!({"min": unit.from_si(lower), "max": unit.from_si(upper)});
            let field = json!({"name": name, "type": "float64", "unit": unit.symbol(), "constraints": within});
            out.extend((!out.iter().any(|other| other["name"] == field["name"])).then_some(field));
        }
    }
    out
}

/// A field as the schema writes it, of a column that need not be there.
fn line(field: &Value, about: &str) -> String {
    let each = if field["name"].to_string().contains("{j}") {
        "\"per_joint\": true, "
    } else {
        ""
    };
    let number = match field["unit"].as_str() {
        None => String::new(),
        Some(unit) => {
            let close = if unit.starts_with("rad") || unit == "1" {
                "1e-06"
            } else {
                "0.001"
            };
            let [least, most] =
                ["min", "max"].map(|end| field["constraints"][end].as_f64().unwrap());
            format!(
                "\"constraints\": {{\"min\": {least}, \"max\": {most}}}, \"diff\": {{\"atol\": {close}}}, "
            )
        }
    };
    let unit = field["unit"]
        .as_str()
        .map(|unit| format!("\"unit\": \"{unit}\", "))
        .unwrap_or_default();
    let (name, kind, about) = (&field["name"], &field["type"], Value::from(about));
    format!(
        "    {{\"name\": {name}, \"type\": {kind}, {unit}{each}\"optional\": true, \"nullable\": true, {number}\"description\": {about}}}"
    )
}

#[test]
fn every_declared_column_is_stored() {
    let path = root("schemas/recording.json");
    let text = read(&path);
    let schema: Value = serde_json::from_str(&text).unwrap();
    let stored = schema["fields"].as_array().unwrap();
    let mut missing = Vec::new();
    for (column, field) in recording_columns()
        .flat_map(|column| fields(column).into_iter().map(move |field| (column, field)))
    {
        match stored.iter().find(|stored| stored["name"] == field["name"]) {
            None => missing.push(line(&field, column.about)),
            Some(stored) => {
                assert!(
                    stored["type"] == field["type"] && stored["unit"] == field["unit"],
                    "{stored} is declared as {field}"
                )
            }
        }
    }
    if std::env::var_os("CALIB_UPDATE").is_some() && !missing.is_empty() {
        let (head, _) = text.split_once("\n  ]").unwrap();
        return std::fs::write(path, format!("{head},\n{}\n  ]\n}}\n", missing.join(",\n")))
            .unwrap();
    }
    let missing = missing.join("\n");
    assert!(
        missing.is_empty(),
        "CALIB_UPDATE=1 writes these fields; then count the schema's version up:\n{missing}"
    );
}

/// An arm whose third joint follows the air's humidity, 4e-6 rad by percent; what a tracker saw of it.
fn recording() -> String {
    let robot = RobotModel::new(sr210d());
    let base = Pose::exp(&Twist::new(4.0, -1.5, 0.4, 0.02, -0.05, 2.2));
    let q = poses(robot.description(), 160);
    let mut text = "q1,q2,q3,q4,q5,q6,rh,x,y,z\n".to_string();
    for (row, q) in q.chunks(robot.joints()).enumerate() {
        let humidity = 20.0 + 60.0 * spread(row, 7);
        let mut real = q.to_vec();
        real[2] += 4e-6 * (humidity - 50.0);
        let point = base.point(&robot.forward(&real).translation);
        let numbers = q.iter().copied().chain([humidity]);
        let noisy = (0..3).map(|axis| point[axis] + 2e-5 * normal(3 * row + axis));
        let cells: Vec<String> = numbers
            .chain(noisy)
            .map(|number| format!("{number:.7}"))
            .collect();
        text.push_str(&format!("{}\n", cells.join(",")));
    }
    text
}

#[test]
fn a_circumstance_that_is_declared_in_one_line_is_a_law_of_a_users_own_effect() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "recording.csv", recording());
    put(
        here,
        "robot.yaml",
        std::fs::read(root("pipelines/sr210d/robot.yaml")).unwrap(),
    );
    let effect = "calib_effect: 1\nname: swelling\nplace: joint\nmotion: angle\nlaw: humidity - 50\nunit: arcsec\nsize: 1\nper: percent\n\
                  sentence: \"{place} follows the humidity: {value}\"\n";
    put(here, "swelling.yaml", effect);
    let pipeline = "calib: 1\nname: humid\nseed: 1\nstages:\n  - {uses: robot, with: {file: robot.yaml}}\n  - uses: ingest\n    with:\n      \
                    files: [{file: recording.csv, columns: {q: {column: \"q{j}\", unit: rad}, humidity: {column: rh}, x: {column: x, unit: m}, \
                    y: {column: y, unit: m}, z: {column: z, unit: m}}}]\n      instrument: {constant_um: 20, per_metre_um: 0, coverage: 1}\n  \
                    - {uses: split, with: {by: every, n: 5}}\n  - {uses: diagnose, with: {effects: [swelling.yaml]}}\n";
    put(here, "p.yaml", pipeline);
    let calib = |words: &str| answer::calib(here, words).ok();
    calib("run p.yaml --quiet --store s");
    let answer: Value =
        serde_json::from_str(&calib("diagnose p.yaml --json --quiet --store s")).unwrap();
    let findings = answer["findings"].as_array().unwrap();
    let named: Vec<[&Value; 2]> = findings
        .iter()
        .map(|finding| ["effect", "where"].map(|key| &finding[key]))
        .collect();
    assert_eq!(
        named,
        [[&json!("swelling"), &json!("joint 3")]],
        "{answer:#}"
    );
    // 4e-6 rad are 0.825 arcsec.
    let value = findings[0]["parameters"][0]["value"].as_f64().unwrap();
    assert!((value - 0.825).abs() < 0.08, "{value} arcsec: {answer:#}");
    let stored = from_file::<Recording>(&here.join("s/tables/humid/ingest.recording.parquet"))
        .unwrap()
        .table;
    assert!(
        stored.readings["humidity"]
            .iter()
            .all(|percent| (20.0..=80.0).contains(percent))
    );
}

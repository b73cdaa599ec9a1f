//! `export --format controller`: the numbers, as they are written, put the joints where the identified model has them, however the
//! controller counts, and each number's sigma is what the parameters' covariance makes of it.

use super::ROBOT;
use super::maker::{Maker, PLAIN, makers_of, ran, recorded};
use super::true_error::Cell;
use crate::fixture::{apart, largest, robot_of};
use calib::table::{CovarianceTable, Parameters, from_file};
use std::collections::BTreeMap;
use std::path::Path;

/// Value and sigma of each number by its quantity and place.
type ControllerList = BTreeMap<(String, String), (f64, Option<f64>)>;

fn listed(text: &str) -> ControllerList {
    let rows = text.lines().filter(|line| {
        ["zero", "factor - 1", "coupling"]
            .iter()
            .any(|start| line.starts_with(start))
    });
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        (
            (cells[0].to_string(), cells[1].to_string()),
            (cells[2].parse().unwrap(), cells[4].parse().ok()),
        )
    };
    rows.map(row).collect()
}

/// True joints (deg) of commanded ones, by the sentence in the file's head.
fn true_joints(list: &ControllerList, commanded: &[f64]) -> Vec<f64> {
    let value = |quantity: &str, place: String| {
        list.get(&(quantity.to_string(), place))
            .map_or(0.0, |(value, _)| *value)
    };
    let of_joint = |joint: usize| {
        let ours = (1.0 + value("factor - 1", format!("joint {joint}"))) * commanded[joint - 1];
        let coupled: f64 = (1..=6)
            .map(|by| value("coupling", format!("joint {by}->{joint}")) * commanded[by - 1])
            .sum();
        ours + value("zero", format!("joint {joint}")) + coupled
    };
    (1..=6).map(of_joint).collect()
}

/// The list as a maker counts that moves joints as the list of the robot file's counting does: read off at zero and at each joint alone.
fn counted(maker: &Maker, ours: &ControllerList) -> ControllerList {
    let off = |numbers: &[f64]| -> Vec<f64> {
        let q: Vec<f64> = maker
            .driven(numbers)
            .iter()
            .map(|q| q.to_degrees())
            .collect();
        let real: Vec<f64> = true_joints(ours, &q)
            .iter()
            .map(|q| q.to_radians())
            .collect();
        maker
            .counted(&real)
            .iter()
            .zip(numbers)
            .map(|(real, number)| real - number)
            .collect()
    };
    let zero = off(&[0.0; 6]);
    let mut out: ControllerList = (0..6)
        .map(|joint| {
            (
                ("zero".to_string(), format!("joint {}", joint + 1)),
                (zero[joint], None),
            )
        })
        .collect();
    for by in 1..=6 {
        let mut numbers = [0.0; 6];
        numbers[by - 1] = 100.0;
        for (joint, (off, zero)) in (1..=6).zip(off(&numbers).iter().zip(&zero)) {
            let (quantity, place) = if joint == by {
                ("factor - 1", format!("joint {by}"))
            } else {
                ("coupling", format!("joint {by}->{joint}"))
            };
            out.insert((quantity.into(), place), ((off - zero) / 100.0, None));
        }
    }
    out
}

/// Each number by a unit of each parameter, and the parameters' covariance (deg): what sigma has to be.
fn sigmas(maker: &Maker, tables: &Path) -> BTreeMap<(String, String), f64> {
    let table = |name: &str| tables.join(format!("identify.{name}.parquet"));
    let parameters: Parameters = from_file(&table("parameters")).unwrap().table;
    let covariance: CovarianceTable = from_file(&table("covariance")).unwrap().table;
    let none = counted(maker, &ControllerList::new());
    let mut by: BTreeMap<String, ControllerList> = BTreeMap::new();
    for row in &parameters.0 {
        let quantity = match row.effect.as_str() {
            "joint_offset" => "zero",
            "reduction_ratio" => "factor - 1",
            "coupling_ratio" => "coupling",
            _ => continue,
        };
        let size = if row.unit == "rad" {
            1f64.to_degrees()
        } else {
            1.0
        };
        let unit = [((quantity.to_string(), row.place.clone()), (size, None))].into();
        by.insert(row.name.clone(), counted(maker, &unit));
    }
    let mut out = BTreeMap::new();
    for (number, (at_none, _)) in &none {
        let share = |name: &String| by.get(name).map_or(0.0, |list| list[number].0 - at_none);
        let part = |row: &calib::table::CovarianceRow| {
            let twice = if row.parameter == row.other { 1.0 } else { 2.0 };
            share(&row.parameter) * share(&row.other) * row.covariance * twice
        };
        out.insert(
            number.clone(),
            covariance.0.iter().map(part).sum::<f64>().sqrt(),
        );
    }
    out
}

#[test]
fn numbers_for_the_controller_move_its_joints_as_the_model_does() {
    let text = ROBOT.to_string()
        + "couplings:\n  - {moved: 3, by: 2}\n  - {moved: 6, by: 5}\n  - {moved: 4, by: 1}\n";
    let robot = robot_of(&text);
    let cell = Cell::of(robot, 1.2, [100.0, 200.0], Vec::new());
    let points = cell.points(60, &[0.0], 5);
    let stages = "  - uses: identify\n    with: {on: [fit], effects: [base_frame, tool_offset, joint_offset, link_geometry, reduction_ratio, coupling_ratio]}\n";
    let mixed = [
        PLAIN.name,
        "signs 1, 4, 6",
        "zeros",
        "ABB, parallelogram",
        "all at once",
    ];
    for maker in makers_of(&mixed) {
        let folder = recorded(&maker, &cell, &points, &text, stages);
        let export = |model: &str| {
            listed(&ran(
                folder.path(),
                &format!("export --format controller --quiet {model}"),
                "",
            ))
        };
        let list = export("latest");
        // A table of parameters alone does not know the controller: its numbers are in the robot file's counting.
        let ours = export(".calib/tables/counted/identify.parameters.parquet --robot robot.yaml");
        let off = (0..200).map(|k| {
            let q: Vec<f64> = (0..6)
                .map(|j| 2.0 * (1.3 * f64::from(k) + 0.7 * f64::from(j)).sin())
                .collect();
            let degrees: Vec<f64> = q.iter().map(|q| q.to_degrees()).collect();
            let real = true_joints(&ours, &degrees);
            let real: Vec<f64> = real.iter().map(|q| q.to_radians()).collect();
            apart(
                &maker.driven(&true_joints(&list, &maker.counted(&q))),
                &real,
            )
        });
        let apart = largest(off);
        assert!(apart < 1e-9, "{}: {apart} rad", maker.name);
        let expected = sigmas(&maker, &folder.path().join(".calib/tables/counted"));
        assert!(
            list.values()
                .any(|(value, sigma)| value.abs() > 1e-3 && sigma.is_some()),
            "{list:?}"
        );
        for (number, (_, sigma)) in &list {
            let sigma = sigma.unwrap_or_default();
            assert!(
                (sigma - expected[number]).abs() <= 1e-3 * expected[number],
                "{}: {number:?}: {sigma}",
                maker.name
            );
        }
    }
}

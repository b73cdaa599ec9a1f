//! `export --format controller`: the numbers, as they are written, put the joints at the same places however the controller counts, and what
//! the list leaves is what its head says.

use super::ROBOT;
use super::maker::{PLAIN, makers_of, ran, recorded};
use super::true_error::Cell;
use crate::fixture::{apart, largest, robot_of};
use std::collections::BTreeMap;

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
    let mut plain: Option<ControllerList> = None;
    for maker in makers_of(&mixed) {
        let folder = recorded(&maker, &cell, &points, &text, stages);
        let command = "export --format controller --quiet latest";
        let list = listed(&ran(folder.path(), command, ""));
        assert!(
            list.values()
                .all(|(_, sigma)| sigma.is_some_and(|sigma| sigma > 0.0)),
            "{list:?}"
        );
        let plain = plain.get_or_insert_with(|| list.clone());
        let off = (0..200).map(|k| {
            let q: Vec<f64> = (0..6)
                .map(|j| 2.0 * (1.3 * f64::from(k) + 0.7 * f64::from(j)).sin())
                .collect();
            let degrees: Vec<f64> = q.iter().map(|q| q.to_degrees()).collect();
            let real = true_joints(plain, &degrees);
            let real: Vec<f64> = real.iter().map(|q| q.to_radians()).collect();
            apart(
                &maker.driven(&true_joints(&list, &maker.counted(&q))),
                &real,
            )
        });
        let apart = largest(off);
        assert!(apart < 1e-7, "{}: {apart} rad", maker.name);
    }
}

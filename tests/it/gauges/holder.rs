//! A target that steps on the tool: about the last axis it is a holder that has turned, or that joint's zero; elsewhere it has moved.

use super::Cell;
use crate::answer::{has, starts_with};
use crate::fixture::{self, diagnosed};
use calib::diagnose::Diagnosis;
use calib::effect::Place;
use calib::robot::{Measurements, RobotModel};

const ROWS: usize = 120;
const STEP: usize = 70;

fn cell(seed: usize) -> (Cell, Measurements) {
    let cell = Cell::new(fixture::offset_wrist(), &[("A", [60.0, 40.0, 20.0])], seed);
    let data = cell.rows(ROWS, 0);
    (cell, data)
}

fn diagnosis_of(cell: &Cell, mut data: Measurements) -> Diagnosis {
    cell.disturb(&mut data);
    diagnosed(&cell.description, &data)
}

#[test]
fn a_holder_that_turns_about_the_flange_is_one_step_with_two_names() {
    for (seed, degrees) in [(21, 3.3), (22, -0.4)] {
        let (cell, mut data) = cell(seed);
        let (logged, joints) = (data.q.clone(), data.joints);
        (STEP..ROWS).for_each(|row| data.q[row * joints + joints - 1] += f64::to_radians(degrees));
        data.points.position = cell.truth.predict(&data);
        data.q = logged;
        let diagnosis = diagnosis_of(&cell, data);
        let statements: Vec<&str> = diagnosis
            .findings
            .iter()
            .map(|finding| finding.statement.as_str())
            .collect();
        assert_eq!(statements.len(), 1, "{statements:?}");
        let size = format!(
            "the holder has turned by {:.2} deg about the flange",
            degrees.abs()
        );
        starts_with(statements[0], &size);
        has(statements[0], "from row 71");
        let found = &diagnosis.findings[0];
        let rivals = (found.rivals.iter()).map(|rival| (&*rival.effect, rival.place));
        let mut names: Vec<(&str, Place)> = rivals.collect();
        names.push((&found.effect, found.place));
        for name in [
            ("zero_shift", Place::Joint(joints - 1)),
            ("tool_shift", Place::Tool),
        ] {
            let times = names.iter().filter(|other| **other == name).count();
            assert_eq!(times, 1, "{names:?}");
        }
    }
}

#[test]
fn a_target_that_moves_along_the_last_axis_has_not_turned() {
    let (cell, mut data) = cell(23);
    let robot = RobotModel::new(cell.description.clone());
    for row in STEP..ROWS {
        let turn = cell.truth.stack.base().rotation * robot.last_body(data.q(row)).rotation;
        data.points.position[row] += turn * robot.axis(data.joints - 1) * 3e-4;
    }
    let diagnosis = diagnosis_of(&cell, data);
    assert_eq!(diagnosis.findings.len(), 1, "{}", diagnosis.statement);
    let statement = &diagnosis.findings[0].statement;
    starts_with(statement, "the target on the tool has moved");
}

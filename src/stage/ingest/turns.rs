//! Joints that are logged within one turn, as 0 to 360 deg: a reading jumps by a turn where the joint passes the end of that. In a log of a
//! moving arm neighbours say it; of single poses, and for a stretch as a whole, the limits of the joint do.

use super::arm::RobotJoints;
use crate::error::counted;
use std::f64::consts::{PI, TAU};

/// rad: so near a whole turn is a step between two rows one. No joint moves by the rest of a turn from row to row.
const NEAR: f64 = 0.5 * PI;
/// rad: what rounding in the file's unit may add to a limit or to a window.
const SLACK: f64 = 1e-3;
/// rad: poses that are torn by the end of a turn lie on both sides of it; a joint a little beyond its limits is none.
const SPREAD: f64 = 1.5 * PI;
/// Windows of one turn that controllers log in, rad.
const WINDOWS: [[f64; 2]; 2] = [[0.0, TAU], [-PI, PI]];

/// What was taken for turns at one joint.
#[derive(Debug, Clone, Copy, Default)]
struct Turned {
    /// Lines of the file with the first of it.
    line: u64,
    /// Steps of one turn between neighbours.
    jumps: u64,
    /// Rows that are read a turn away from what stands there.
    rows: u64,
}

/// The joints of the rows of a moving arm, one row after another.
pub(super) struct TurnCounter<'a> {
    arm: &'a RobotJoints,
    joints: Vec<JointTurns>,
}

/// One joint: rad.
#[derive(Debug, Clone, Default)]
struct JointTurns {
    /// Added to what stands in the file.
    added: f64,
    last: Option<f64>,
    /// Least and greatest of the present stretch.
    span: [f64; 2],
    told: Turned,
}

impl JointTurns {
    /// By how much the present stretch is to be moved to lie within limits, 0 where it lies there or does not fit.
    fn moved(&self, [lower, upper]: [f64; 2]) -> f64 {
        let [least, most] = self.span;
        let fits = |by: f64| least + by >= lower - SLACK && most + by <= upper + SLACK;
        let by = [0.0, -TAU, TAU].into_iter().find(|by| fits(*by));
        by.unwrap_or(0.0)
    }
}

impl<'a> TurnCounter<'a> {
    pub(super) fn new(arm: &'a RobotJoints) -> Self {
        let joints = vec![JointTurns::default(); arm.joints()];
        Self { arm, joints }
    }

    /// The joints of the next row, which stand in `line` of its file, as one turn after another; whether the row continues the stretch of the one
    /// before. `stretch` holds the rows of the stretch that are in hand, row-major, and is moved where limits show a turn only now.
    pub(super) fn next(&mut self, line: u64, goes_on: bool, q: &mut [f64], stretch: &mut [f64]) {
        let n = self.joints.len();
        for (joint, (value, turns)) in q.iter_mut().zip(&mut self.joints).enumerate() {
            if self.arm.prismatic[joint] {
                continue;
            }
            let step = turns.last.map(|last| *value + turns.added - last);
            let turned = step.map_or(0.0, |step| -TAU * (step / TAU).round());
            let is_turn = step.is_some_and(|step| (step + turned).abs() < NEAR);
            if turned != 0.0 && is_turn && (goes_on || turns.told.jumps > 0) {
                turns.added += turned;
                if goes_on {
                    turns.told.jumps += 1;
                    first(&mut turns.told.line, line);
                }
            }
            let here = *value + turns.added;
            turns.span = match goes_on {
                true => [turns.span[0].min(here), turns.span[1].max(here)],
                false => [here, here],
            };
            let moved = turns.moved(self.arm.limits[joint]);
            if moved != 0.0 {
                turns.added += moved;
                turns.span = turns.span.map(|end| end + moved);
                let mut before = 0;
                for value in stretch.iter_mut().skip(joint).step_by(n) {
                    *value += moved;
                    before += 1;
                }
                turns.told.rows += before;
                first(&mut turns.told.line, line);
            }
            turns.told.rows += u64::from(turns.added != 0.0);
            *value += turns.added;
            turns.last = Some(*value);
        }
    }

    /// What was taken for turns, a sentence a joint.
    pub(super) fn remarks(&self) -> Vec<String> {
        let told = self.joints.iter().enumerate();
        told.filter(|(_, turns)| turns.told.line > 0)
            .map(|(joint, JointTurns { told, .. })| {
                let jumps = match told.jumps {
                    0 => "it is beyond its limits there".into(),
                    jumps => format!(
                        "{} by a turn from row to row, the first in line {}",
                        counted(jumps, "jump"),
                        told.line
                    ),
                };
                let name = self.arm.called(joint);
                format!(
                    "{name} is logged within one turn ({jumps}): {} are read as continuing, a turn away from what stands there",
                    counted(told.rows, "row")
                )
            })
            .collect()
    }
}

fn first(line: &mut u64, here: u64) {
    if *line == 0 {
        *line = here;
    }
}

/// Moves readings of one joint at poses (rad) that are beyond its limits by a turn, where others are not, all are logged within one turn, and all
/// lie within the limits so, over no wider a range; how many are moved. Where all are beyond, a turn changes nothing.
pub(super) fn within_limits(values: &mut [&mut f64], limits: [f64; 2]) -> usize {
    let [lower, upper] = [limits[0] - SLACK, limits[1] + SLACK];
    let is_beyond = |value: f64| value < lower || value > upper;
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[least, most], value| [least.min(value), most.max(value)],
        )
    };
    let within = |value: f64| match is_beyond(value) {
        false => value,
        true if value > upper => value - TAU,
        true => value + TAU,
    };
    let before = ends(&mut values.iter().map(|value| **value));
    let is_logged_so = WINDOWS
        .iter()
        .any(|[least, most]| before[0] >= least - SLACK && before[1] <= most + SLACK);
    let fits = values.iter().all(|value| !is_beyond(within(**value)));
    let is_mixed = values.iter().any(|value| !is_beyond(**value));
    let after = ends(&mut values.iter().map(|value| within(**value)));
    let is_spread = before[1] - before[0] > SPREAD;
    if !is_logged_so
        || !is_spread
        || !is_mixed
        || !fits
        || after[1] - after[0] > before[1] - before[0] + SLACK
    {
        return 0;
    }
    let mut moved = 0;
    for value in values {
        let there = within(**value);
        moved += usize::from(there != **value);
        **value = there;
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arm(limits: [f64; 2]) -> RobotJoints {
        RobotJoints::new(vec![false], vec![limits.map(f64::to_radians)])
    }

    /// deg.
    fn counted_of(limits: [f64; 2], logged: &[f64]) -> (Vec<f64>, Vec<String>) {
        let arm = arm(limits);
        let mut turns = TurnCounter::new(&arm);
        let mut all: Vec<f64> = Vec::new();
        for (line, value) in (2..).zip(logged) {
            let mut q = [value.to_radians()];
            let goes_on = !all.is_empty();
            turns.next(line, goes_on, &mut q, &mut all);
            all.extend(q);
        }
        let degrees = all.iter().map(|value| value.to_degrees().round());
        (degrees.collect(), turns.remarks())
    }

    #[test]
    fn a_joint_that_passes_the_end_of_the_turn_it_is_logged_in_goes_on() {
        let wide = [-360.0, 360.0];
        let (read, said) = counted_of(wide, &[350.0, 358.0, 6.0, 12.0, 1.0, 355.0]);
        assert_eq!(read, [-10.0, -2.0, 6.0, 12.0, 1.0, -5.0]);
        assert!(
            said[0].contains("joint 1") && said[0].contains("2 jumps"),
            "{said:?}"
        );
        assert!(said[0].contains("line 4"), "{said:?}");
        let unlimited = [f64::NEG_INFINITY, f64::INFINITY];
        let (read, _) = counted_of(unlimited, &[179.0, -179.0, -178.0, 178.0]);
        assert_eq!(read, [179.0, 181.0, 182.0, 178.0]);
        let (read, said) = counted_of([-185.0, 185.0], &[270.0, 275.0]);
        assert_eq!((read, said.len()), (vec![-90.0, -85.0], 1));
    }

    #[test]
    fn what_is_no_turn_stays_as_it_is() {
        for logged in [
            &[100.0, 300.0, 90.0][..],
            &[0.0, 180.0, 359.0],
            &[10.0, 20.0],
        ] {
            let (read, said) = counted_of([-360.0, 360.0], logged);
            assert_eq!((&read[..], said.len()), (logged, 0));
        }
    }

    /// deg, as they are read.
    fn poses(limits: [f64; 2], logged: &[f64]) -> Vec<f64> {
        let mut all: Vec<f64> = logged.iter().map(|value| value.to_radians()).collect();
        let mut values: Vec<&mut f64> = all.iter_mut().collect();
        within_limits(&mut values, limits.map(f64::to_radians));
        all.iter().map(|value| value.to_degrees().round()).collect()
    }

    #[test]
    fn poses_logged_in_one_turn_are_read_within_the_limits_and_an_overtravel_is_left() {
        let limits = [-185.0, 185.0];
        assert_eq!(poses(limits, &[350.0, 10.0, 300.0]), [-10.0, 10.0, -60.0]);
        for stays in [
            &[-100.0, 0.0, 186.0][..],
            &[5.0, 100.0, 186.0],
            &[-400.0, 20.0],
            &[200.0, 250.0],
        ] {
            assert_eq!(poses(limits, stays), stays);
        }
    }
}

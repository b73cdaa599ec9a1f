//! Which gravity the torques of slow rows show: the declared one, one from another side, or none, before any other cause is asked.

use super::arm::DynamicArm;
use super::newton_euler::at_rest_under;
use super::recording::TorqueRecording;
use crate::criteria::torque::WEIGHTY;
use crate::error::Fault;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Share of the rows that are slow, and how many are looked at.
const SLOW: f64 = 1.0 / 3.0;
const LOOKED_AT: usize = 400;
const FEWEST: usize = 20;
/// Share of a joint's usual speed over which the sign of its friction turns.
const TURNS: f64 = 0.05;
/// Ratio of squared errors from which one gravity explains far better than another.
const FAR_BETTER: f64 = 0.2;
/// Ratio of squared errors from which a gravity explains nothing.
const NOTHING: f64 = 0.5;
/// rad: smaller tilts are those of a floor, and a finding.
const MOUNTED: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// rad: so near an axis of the base gravity is along it.
const ALONG: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Lengths of a found gravity over that of the declared one: masses are not farther off.
const LENGTHS: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// Coulomb friction over gravity that says which way torques count.
const BRAKES: f64 = 0.005;

/// What slow rows say of gravity.
pub(super) struct SeenGravity {
    /// m/s^2, base frame.
    found: Vector3<f64>,
    /// Squared errors: with the declared gravity, with the found one, without any.
    left: [f64; 3],
    /// Mean Coulomb friction of the joints that gravity loads, over what it loads them with; negative where torques count the other way.
    brakes: f64,
    /// Nm, rms over these joints: of the torques, of the declared gravity.
    rms: [f64; 2],
}

/// Sums of a joint over rows: products of torque and gravity with each other after friction has been taken off.
struct LoadedJoint {
    torque: Vec<f64>,
    gravity: Vec<Vector3<f64>>,
    friction: Vec<Vector2<f64>>,
    inverse: Matrix2<f64>,
}

impl LoadedJoint {
    fn new(torque: Vec<f64>, gravity: Vec<Vector3<f64>>, friction: Vec<Vector2<f64>>) -> Self {
        let gram: Matrix2<f64> = friction.iter().map(|f| f * f.transpose()).sum();
        let ridge = Matrix2::identity() * (1e-9 * gram.trace() + f64::MIN_POSITIVE);
        let inverse = (gram + ridge).try_inverse().unwrap_or_else(Matrix2::zeros);
        let mut joint = Self {
            torque,
            gravity,
            friction,
            inverse,
        };
        let of_torque = joint.friction_in(joint.torque.iter().copied());
        let of_gravity = [0, 1, 2]
            .map(|axis| joint.friction_in(joint.gravity.iter().map(move |gravity| gravity[axis])));
        for (row, friction) in joint.friction.iter().enumerate() {
            joint.torque[row] -= friction.dot(&of_torque);
            for (axis, of_gravity) in of_gravity.iter().enumerate() {
                joint.gravity[row][axis] -= friction.dot(of_gravity);
            }
        }
        joint
    }

    fn friction_in(&self, course: impl Iterator<Item = f64>) -> Vector2<f64> {
        let right: Vector2<f64> = self.friction.iter().zip(course).map(|(f, y)| f * y).sum();
        self.inverse * right
    }

    /// Sum of squares that a gravity leaves.
    fn left(&self, gravity: &Vector3<f64>) -> f64 {
        let rows = self.torque.iter().zip(&self.gravity);
        rows.map(|(torque, load)| (torque - load.dot(gravity)).powi(2))
            .sum()
    }
}

impl SeenGravity {
    /// What a checked recording shows; nothing where the declared arm has no weight.
    pub(crate) fn of(arm: &DynamicArm, recording: &TorqueRecording, theta: &[f64]) -> Option<Self> {
        let n = recording.joints;
        let declared = arm.gravity.norm();
        let (rows, velocity, usual) = slow_rows(recording);
        let mut loads_at = at_rest_under(arm, theta);
        let mut loads: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); n];
        for row in &rows {
            let position = &recording.position[row * n..(row + 1) * n];
            let along = [0, 1, 2].map(|axis| loads_at(position, &Vector3::ith(axis, 1.0)));
            for (joint, loads) in loads.iter_mut().enumerate() {
                loads.push(Vector3::from(along.each_ref().map(|load| load[joint])));
            }
        }
        let size = |loads: &Vec<Vector3<f64>>| {
            let squares: f64 = loads.iter().map(|load| load.norm_squared()).sum();
            (squares / (3 * loads.len().max(1)) as f64).sqrt() * declared
        };
        let sizes: Vec<f64> = loads.iter().map(size).collect();
        let most = sizes.iter().copied().fold(0.0, f64::max);
        if most <= 0.0 || rows.len() < FEWEST {
            return None;
        }
        let loaded: Vec<usize> = (0..n).filter(|j| sizes[*j] > *WEIGHTY * most).collect();
        let (mut rms, mut recorded, mut seen) = ([0.0; 2], Vec::new(), Vec::new());
        for joint in &loaded {
            let scale = 1.0 / sizes[*joint];
            let torque = rows.iter().map(|row| recording.torque[row * n + joint]);
            let torque: Vec<f64> = torque.map(|torque| torque * scale).collect();
            let gravity: Vec<Vector3<f64>> =
                loads[*joint].iter().map(|load| load * scale).collect();
            let speeds = rows
                .iter()
                .map(|row| velocity[row * n + joint] / usual[*joint]);
            let friction: Vec<Vector2<f64>> = speeds
                .map(|speed| Vector2::new((speed / TURNS).tanh(), speed))
                .collect();
            for (torque, gravity) in torque.iter().zip(&gravity) {
                rms[0] += (torque * sizes[*joint]).powi(2);
                rms[1] += (gravity.dot(&arm.gravity) * sizes[*joint]).powi(2);
            }
            recorded.push((torque.clone(), gravity.clone()));
            seen.push(LoadedJoint::new(torque, gravity, friction));
        }
        let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for joint in &seen {
            for (torque, load) in joint.torque.iter().zip(&joint.gravity) {
                gram += load * load.transpose();
                right += load * *torque;
            }
        }
        let ridge = Matrix3::identity() * (1e-6 * gram.trace());
        let found = (gram + ridge).try_inverse()? * right;
        let left =
            |gravity: &Vector3<f64>| -> f64 { seen.iter().map(|joint| joint.left(gravity)).sum() };
        let braked = seen
            .iter()
            .zip(&recorded)
            .map(|(joint, (torque, gravity))| {
                let rows = torque.iter().zip(gravity);
                joint.friction_in(rows.map(|(torque, load)| torque - load.dot(&found)))[0]
            });
        let count = (rows.len() * loaded.len()) as f64;
        Some(Self {
            found,
            left: [left(&arm.gravity), left(&found), left(&Vector3::zeros())],
            brakes: braked.sum::<f64>() / loaded.len() as f64,
            rms: rms.map(|square| (square / count).sqrt()),
        })
    }

    /// What is wrong, where gravity is not the declared one.
    pub(crate) fn fault(&self, arm: &DynamicArm) -> Option<Fault> {
        let [declared, found, without] = self.left;
        if without < FAR_BETTER * declared && found > NOTHING * without {
            return Some(self.holds_none());
        }
        let (length, angle) = (arm.gravity.norm(), self.found.angle(&arm.gravity));
        let is_gravity = LENGTHS.contains(&(self.found.norm() / length))
            && found < FAR_BETTER * declared
            && found < FAR_BETTER * without;
        if !is_gravity || angle < MOUNTED {
            return None;
        }
        let counts_otherwise = self.brakes < -BRAKES;
        let is_opposite = angle > std::f64::consts::PI - MOUNTED;
        if is_opposite && self.brakes <= BRAKES {
            // Torques with the other sign: friction drives, or says nothing.
            return None;
        }
        let shown = if counts_otherwise {
            -self.found
        } else {
            self.found
        };
        let remedy = written(&arm.gravity);
        let better = (declared / found.max(f64::MIN_POSITIVE)).sqrt();
        let stands = match is_opposite {
            true => "hangs, or the base frame points down: gravity points the other way than",
            false => "is mounted otherwise than",
        };
        let message = format!(
            "the arm {stands} the robot file says ({remedy}): at low speed the declared masses explain the torques {better:.0} times better with \
             `gravity: {}` (m/s2, base frame). Remedy: state it in the robot file{}",
            written(&snapped(&shown, length)),
            if counts_otherwise {
                "; and torques count the other way, friction drives"
            } else {
                ""
            }
        );
        Some(Fault::new("gravity", message))
    }

    fn holds_none(&self) -> Fault {
        let [torque, gravity] = self.rms;
        let message = format!(
            "the torques hold no gravity: {torque:.3} Nm rms at low speed at the joints that it loads, where the declared masses alone need \
             {gravity:.3} Nm, and no gravity from whatever side explains them. The columns are no torques of the joints: an estimate of external \
             torques, or torques with the controller's gravity taken off? Remedy: map the measured torques or the motor currents (`current`)"
        );
        Fault::new("torque", message)
    }
}

/// Slow rows (ascending), all velocities (rows x n, by differences) and the usual speed of each joint.
fn slow_rows(recording: &TorqueRecording) -> (Vec<usize>, Vec<f64>, Vec<f64>) {
    let n = recording.joints;
    let mut velocity = vec![0.0; recording.position.len()];
    let (mut inside, mut square) = (Vec::new(), vec![0.0; n]);
    for row in 1..recording.rows().saturating_sub(1) {
        let lasted = recording.time[row + 1] - recording.time[row - 1];
        if lasted > 0.0 && recording.trajectory[row + 1] == recording.trajectory[row - 1] {
            inside.push(row);
            for joint in 0..n {
                let moved = recording.position[(row + 1) * n + joint]
                    - recording.position[(row - 1) * n + joint];
                velocity[row * n + joint] = moved / lasted;
                square[joint] += (moved / lasted).powi(2);
            }
        }
    }
    let usual = square
        .iter()
        .map(|square| (square / inside.len().max(1) as f64).sqrt().max(1e-9));
    let usual: Vec<f64> = usual.collect();
    let speed = |row: &usize| -> f64 {
        let joints = velocity[row * n..(row + 1) * n].iter().zip(&usual);
        joints
            .map(|(velocity, usual)| (velocity / usual).powi(2))
            .sum()
    };
    let mut by_speed: Vec<(f64, usize)> = inside.iter().map(|row| (speed(row), *row)).collect();
    by_speed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    by_speed.truncate((inside.len() as f64 * SLOW) as usize);
    let mut slow: Vec<usize> = by_speed.into_iter().map(|(_, row)| row).collect();
    slow.sort_unstable();
    let every = slow.len().div_ceil(LOOKED_AT).max(1);
    (slow.into_iter().step_by(every).collect(), velocity, usual)
}

/// A gravity of a length, along the axis of the base that it nearly is along.
fn snapped(gravity: &Vector3<f64>, length: f64) -> Vector3<f64> {
    let signs = [1.0, -1.0].into_iter();
    let mut axes = signs.flat_map(|sign| [0, 1, 2].map(|axis| Vector3::ith(axis, sign)));
    let near = axes.find(|axis: &Vector3<f64>| axis.angle(gravity) < ALONG);
    near.unwrap_or_else(|| gravity.normalize()) * length
}

/// As a robot file has it.
fn written(gravity: &Vector3<f64>) -> String {
    let number = |value: f64| {
        let text = format!("{value:.2}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" {
            "0".to_string()
        } else {
            text.to_string()
        }
    };
    let [x, y, z] = [gravity.x, gravity.y, gravity.z].map(number);
    format!("[{x}, {y}, {z}]")
}

#[cfg(test)]
mod tests {
    use super::super::cases::{arm, record_at};
    use super::super::check::check;
    use super::*;

    /// 20 s at 50 Hz of an arm under `real` gravity with friction, of which the robot file declares the usual one.
    fn recorded(real: [f64; 3]) -> TorqueRecording {
        let standing = DynamicArm {
            gravity: Vector3::from(real),
            ..arm()
        };
        record_at(&standing, 50.0, 0.0, &|(joint, _, _, velocity, _, _)| {
            [4.0, 6.0, 3.0, 1.0][joint] * (velocity / 0.01).tanh()
        })
    }

    fn refused(recording: &TorqueRecording) -> String {
        check(&arm(), recording).unwrap_err().to_string()
    }

    #[test]
    fn gravity_from_another_side_is_named_with_what_to_declare() {
        for (real, said) in [
            ([0.0, -9.81, 0.0], "`gravity: [0, -9.81, 0]`"),
            ([9.81, 0.0, 0.0], "`gravity: [9.81, 0, 0]`"),
            ([0.0, 0.0, 9.81], "`gravity: [0, 0, 9.81]`"),
            // Aslant no axis is near: the direction is as good as friction lets it be, some 3 deg.
            ([0.0, 6.937, -6.937], ", -6."),
        ] {
            let message = refused(&recorded(real));
            assert!(message.contains(said), "{message}");
        }
        check(&arm(), &recorded([0.0, 0.0, -9.81])).unwrap();
        check(&arm(), &recorded([0.5, 0.0, -9.8])).unwrap();
    }

    #[test]
    fn torques_without_gravity_are_refused_for_that_and_not_for_a_unit_of_angles() {
        let mut recording = recorded([0.0, 0.0, 0.0]);
        assert!(refused(&recording).contains("hold no gravity"));
        recording
            .torque
            .iter_mut()
            .for_each(|torque| *torque *= 0.1);
        let message = refused(&recording);
        assert!(message.contains("hold no gravity"), "{message}");
        let mut scaled = recorded([0.0, 0.0, -9.81]);
        scaled.torque.iter_mut().for_each(|torque| *torque *= 0.01);
        let message = refused(&scaled);
        assert!(
            message.contains("unit, ratio or torque constant"),
            "{message}"
        );
    }
}

//! A rig moved along commands: explicit steps of second order (torques at the middle, to which the last acceleration leads), dry friction as the set of joints that stick.

use super::rig::{Rig, Servo};
use crate::way::JointState;

/// s of a step at most: of what is recorded, and of what only compares.
pub(super) const FINE: f64 = 2.5e-4;
pub(super) const COARSE: f64 = 1e-3;
/// s for which the arm holds its pose before the first row.
const BEFORE: f64 = 2.0;
/// Exchanges between sticking and sliding at most.
const EXCHANGES: usize = 30;

/// Angles (row-major) at every row of commands, which are `period` s apart and of which each holds until the next.
pub(super) fn angles(rig: &Rig, commands: &[f64], period: f64, step: f64) -> Vec<f64> {
    let n = rig.joints();
    let steps = (period / step - 1e-9).ceil() as usize;
    let h = period / steps as f64;
    let rows = commands.len() / n;
    let before = (BEFORE / period).ceil() as usize;
    let mut now = Now::new(rig, &commands[..n]);
    let mut out = Vec::with_capacity(commands.len());
    for row in 0..before + rows {
        let time = (row as f64 - before as f64) * period;
        if row >= before {
            out.extend_from_slice(&now.q);
        }
        for k in 0..steps {
            now.step(rig, commands, period, time + h * k as f64, h);
        }
    }
    out
}

struct Now {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    set_point: Vec<f64>,
    integral: Vec<f64>,
    driven: Vec<f64>,
}

impl Now {
    fn new(rig: &Rig, home: &[f64]) -> Self {
        let n = rig.joints();
        Self {
            q: home.to_vec(),
            v: vec![0.0; n],
            a: vec![0.0; n],
            set_point: home.to_vec(),
            integral: vec![0.0; n],
            driven: vec![0.0; n],
        }
    }

    fn step(&mut self, rig: &Rig, commands: &[f64], period: f64, time: f64, h: f64) {
        let n = rig.joints();
        let still = vec![0.0; n];
        let middle: Vec<f64> = self
            .q
            .iter()
            .zip(&self.v)
            .map(|(q, v)| q + 0.5 * h * v)
            .collect();
        let torque = |v: &[f64], a: &[f64]| {
            rig.machine.torque(&JointState {
                q: middle.clone(),
                v: v.to_vec(),
                a: a.to_vec(),
            })
        };
        let weight = torque(&still, &still);
        let ahead = self.v.iter().zip(&self.a).map(|(v, a)| v + 0.5 * h * a);
        let ahead: Vec<f64> = ahead.collect();
        let bias = torque(&ahead, &still);
        let mut mass = vec![vec![0.0; n]; n];
        for k in 0..n {
            let mut unit = still.clone();
            unit[k] = 1.0;
            let column = torque(&still, &unit);
            for i in 0..n {
                mass[i][k] = column[i] - weight[i];
            }
            mass[k][k] += rig.servos[k].armature;
        }
        let (mut force, mut limit) = (vec![0.0; n], vec![0.0; n]);
        let driven = self.driven.clone();
        for (j, servo) in rig.servos.iter().enumerate() {
            let [command, rate] = commanded(commands, n, j, period, time + 0.5 * h - servo.delay);
            let way = servo.speed_limit * h;
            self.set_point[j] += (command - self.set_point[j]).clamp(-way, way);
            let error = self.set_point[j] + servo.offset - middle[j];
            let felt = error - error.clamp(-servo.dead_band, servo.dead_band);
            if servo.integral[0] > 0.0 {
                let most = servo.integral[1];
                self.integral[j] =
                    (self.integral[j] + servo.integral[0] * error * h).clamp(-most, most);
            }
            let rate = if servo.on_error { rate } else { 0.0 };
            let asked = servo.kp * felt + servo.kd * (rate - ahead[j]) + self.integral[j];
            self.driven[j] = asked.clamp(-servo.limit, servo.limit);
            let felt = servo.coupled.map_or(0.0, |(by, share)| share * driven[by]);
            force[j] = self.driven[j] + felt - servo.damping * ahead[j] + passive(servo, middle[j])
                - bias[j];
            limit[j] = dry(servo, ahead[j], self.driven[j], time);
        }
        let free = solve(&mass, &force);
        let start: Vec<f64> = self.v.iter().zip(&free).map(|(v, a)| v + h * a).collect();
        let new = stuck(&mass, &start, &self.v, &limit, h);
        for j in 0..n {
            self.q[j] = middle[j] + 0.5 * h * new[j];
        }
        self.a = new
            .iter()
            .zip(&self.v)
            .map(|(new, old)| (new - old) / h)
            .collect();
        self.v = new;
    }
}

/// The command of a joint that holds at a time, and how fast it came: what was sent before the first row was the same.
fn commanded(commands: &[f64], n: usize, joint: usize, period: f64, time: f64) -> [f64; 2] {
    let rows = commands.len() / n;
    let row = (time / period).floor();
    if row < 1.0 {
        return [commands[joint], 0.0];
    }
    let row = (row as usize).min(rows - 1);
    let value = commands[row * n + joint];
    [value, (value - commands[(row - 1) * n + joint]) / period]
}

/// Springs, waves and bumps.
fn passive(servo: &Servo, q: f64) -> f64 {
    let [size, waves, phase] = servo.ripple;
    let [bump, centre, width] = servo.bump;
    let from = (q - centre) / width;
    size * (waves * q + phase).sin() + bump * (-0.5 * from * from).exp()
        - servo.spring[0] * (q - servo.spring[1])
}

fn dry(servo: &Servo, v: f64, drive: f64, time: f64) -> f64 {
    let slow = v / servo.stribeck[1];
    let cold = servo.warm_up[0] * (-time.max(0.0) / servo.warm_up[1]).exp();
    let own = (servo.friction + servo.stribeck[0] * (-slow * slow).exp()) * (1.0 + cold);
    let back = usize::from(drive * v < 0.0);
    own + servo.load[back] * drive.abs()
}

/// Speeds after a step with dry friction: joints stick where friction can hold them, the others slide against it.
fn stuck(mass: &[Vec<f64>], free: &[f64], before: &[f64], limit: &[f64], h: f64) -> Vec<f64> {
    let n = free.len();
    let direction = |j: usize| {
        if before[j] != 0.0 {
            before[j].signum()
        } else {
            free[j].signum()
        }
    };
    let mut slides: Vec<f64> = (0..n).map(direction).collect();
    let mut sticks: Vec<bool> = (0..n).map(|j| limit[j] > 0.0).collect();
    let inverse: Vec<Vec<f64>> = (0..n)
        .map(|k| {
            solve(
                mass,
                &(0..n)
                    .map(|i| f64::from(u8::from(i == k)))
                    .collect::<Vec<_>>(),
            )
        })
        .collect();
    let mut new = free.to_vec();
    for _ in 0..EXCHANGES {
        let held: Vec<usize> = (0..n).filter(|j| sticks[*j]).collect();
        let against = |j: usize| if sticks[j] { 0.0 } else { limit[j] * slides[j] };
        let sliding: Vec<f64> = (0..n)
            .map(|i| free[i] - h * (0..n).map(|k| inverse[k][i] * against(k)).sum::<f64>())
            .collect();
        let inner: Vec<Vec<f64>> = held
            .iter()
            .map(|i| held.iter().map(|k| h * inverse[*k][*i]).collect())
            .collect();
        let right: Vec<f64> = held.iter().map(|i| sliding[*i]).collect();
        let hold = solve(&inner, &right);
        new = (0..n)
            .map(|i| {
                sliding[i]
                    - held
                        .iter()
                        .zip(&hold)
                        .map(|(k, f)| h * inverse[*k][i] * f)
                        .sum::<f64>()
            })
            .collect();
        // The joint that asks most breaks loose; one that turns round sticks again.
        let over = held
            .iter()
            .zip(&hold)
            .map(|(j, f)| (*j, *f, f.abs() / limit[*j]));
        let most = over
            .max_by(|a, b| a.2.total_cmp(&b.2))
            .filter(|most| most.2 > 1.0);
        if let Some((joint, force, _)) = most {
            sticks[joint] = false;
            slides[joint] = force.signum();
            continue;
        }
        let turned =
            (0..n).find(|j| !sticks[*j] && limit[*j] > 0.0 && new[*j] * slides[*j] < -1e-12);
        let Some(joint) = turned else {
            break;
        };
        sticks[joint] = true;
    }
    new
}

/// Gauss with the largest pivot.
fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let n = right.len();
    let mut rows: Vec<Vec<f64>> = matrix.to_vec();
    let mut x = right.to_vec();
    for k in 0..n {
        let pivot = (k..n)
            .max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))
            .unwrap_or(k);
        rows.swap(k, pivot);
        x.swap(k, pivot);
        let pivot_row = rows[k].clone();
        for i in k + 1..n {
            let by = rows[i][k] / pivot_row[k];
            for (value, above) in rows[i].iter_mut().zip(&pivot_row) {
                *value -= by * above;
            }
            x[i] -= by * x[k];
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|c| rows[k][c] * x[c]).sum();
        x[k] = (x[k] - sum) / rows[k][k];
    }
    x
}

//! A rig moved along commands: explicit steps of second order (torques at the middle, to which the last acceleration leads), dry friction as the set of joints that stick.
//! Recordings are integrated in steps so fine that finer ones change nothing that the noise would show.

use super::rig::{Rig, Servo};

/// s of a step at most: the first of what is recorded, of what only compares, and of that where a gear yields.
const FINE: f64 = 2.5e-4;
pub(super) const COARSE: f64 = 1e-3;
const GEARED: f64 = 2.5e-4;
/// Times that a step is halved at most, and the share of the noise that a joint may still move by then, rms.
const HALVED: usize = 3;
const SETTLED: f64 = 0.05;
/// s for which the arm holds its pose before the first row.
const BEFORE: f64 = 2.0;
/// Exchanges between sticking and sliding at most.
const EXCHANGES: usize = 30;
/// s in which the supply follows the load.
const SUPPLY: f64 = 0.02;
/// Share of the armature on the rotor's side of a gear that yields.
const ROTOR: f64 = 0.95;

/// s of a step that compares.
pub(super) fn coarse(rig: &Rig) -> f64 {
    if rig.yields() { GEARED } else { COARSE }
}

/// Angles in steps so fine that half of them changes little against noise of `sigma` rad.
pub(super) fn settled(rig: &Rig, commands: &[f64], period: f64, sigma: f64) -> Vec<f64> {
    let n = rig.joints();
    let mut before = angles(rig, commands, period, FINE);
    for halved in 1..=HALVED {
        let step = FINE * 0.5_f64.powi(halved as i32);
        let finer = angles(rig, commands, period, step);
        let mut squares = vec![0.0; n];
        for (k, (a, b)) in finer.iter().zip(&before).enumerate() {
            squares[k % n] += (a - b).powi(2);
        }
        before = finer;
        let rows = (before.len() / n) as f64;
        let moves = squares
            .iter()
            .fold(0.0_f64, |most, square| most.max(*square));
        if (moves / rows).sqrt() < SETTLED * sigma {
            break;
        }
    }
    before
}

/// Angles (row-major) as encoders see them at every row of commands, which are `period` s apart and of which each holds until the next.
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
            out.extend(now.rotor.iter().map(|r| now.q[*r]));
        }
        for k in 0..steps {
            now.step(rig, commands, period, time + h * k as f64, h);
        }
    }
    out
}

/// Degrees of freedom at most: links, and a rotor of each gear that yields.
const MOST: usize = 8;
type Row = [f64; MOST];
type Square = [Row; MOST];

/// Links come first, then rotors that move by themselves.
struct Now {
    /// Degrees of freedom.
    freedoms: usize,
    /// By joint, what its drive turns.
    rotor: Vec<usize>,
    q: Row,
    v: Row,
    a: Row,
    set_point: Row,
    integral: Row,
    /// -1 to 1: how far friction is bent.
    bent: Row,
    /// Nm that gears give to their links.
    given: Row,
    /// Nm that all drives give, as the supply has followed.
    drawn: f64,
}

impl Now {
    fn new(rig: &Rig, home: &[f64]) -> Self {
        let n = rig.joints();
        let mut at_home = [0.0; MOST];
        at_home[..n].copy_from_slice(home);
        let (mut rotor, mut q, mut freedoms) = ((0..n).collect::<Vec<usize>>(), at_home, n);
        for joint in (0..n).filter(|joint| rig.servos[*joint].gear.is_some()) {
            rotor[joint] = freedoms;
            q[freedoms] = home[joint];
            freedoms += 1;
        }
        Self {
            freedoms,
            rotor,
            q,
            v: [0.0; MOST],
            a: [0.0; MOST],
            set_point: at_home,
            integral: [0.0; MOST],
            bent: [0.0; MOST],
            given: [0.0; MOST],
            drawn: 0.0,
        }
    }

    fn step(&mut self, rig: &Rig, commands: &[f64], period: f64, time: f64, h: f64) {
        let (n, m) = (rig.joints(), self.freedoms);
        let still = [0.0; MOST];
        let (mut middle, mut ahead) = ([0.0; MOST], [0.0; MOST]);
        for i in 0..m {
            middle[i] = self.q[i] + 0.5 * h * self.v[i];
            // What stopped in the last step does not go back by it.
            if self.v[i] != 0.0 {
                ahead[i] = self.v[i] + 0.5 * h * self.a[i];
            }
        }
        let pose = rig.machine.pose(&middle[..n]);
        let torque = |v: &Row, a: &Row| {
            let mut torque = [0.0; MOST];
            rig.machine.torque_at(&pose, &v[..n], &a[..n], &mut torque);
            torque
        };
        let weight = torque(&still, &still);
        let bias = torque(&ahead, &still);
        let mut mass = [[0.0; MOST]; MOST];
        for k in 0..n {
            let mut unit = still;
            unit[k] = 1.0;
            let column = torque(&still, &unit);
            for i in 0..n {
                mass[i][k] = column[i] - weight[i];
            }
        }
        let links = mass;
        let drives = self.drives(rig, commands, period, (time, h), (&middle, &ahead));
        let (mut force, mut limit) = ([0.0; MOST], [0.0; MOST]);
        for (j, servo) in rig.servos.iter().enumerate() {
            let r = self.rotor[j];
            let felt = servo.coupled.map_or(0.0, |(by, share)| share * drives[by]);
            force[j] -= bias[j];
            force[r] += drives[j] + felt - servo.damping * ahead[r] + passive(servo, middle[r]);
            let mut dry = dry(servo, ahead[r], drives[j], time + 0.5 * h);
            let back = usize::from(self.given[j] * ahead[r] < 0.0);
            dry += servo.gear_load[back] * self.given[j].abs();
            if servo.travel > 0.0 {
                // Dahl: it bends with the way and slides when it is bent whole.
                let sign = ahead[r].signum();
                let half = (-0.5 * h * ahead[r].abs() / servo.travel).exp();
                let bent = sign + (self.bent[j] - sign) * half;
                force[r] -= dry * bent;
                self.bent[j] = sign + (bent - sign) * half;
            } else {
                limit[r] = dry;
            }
            match servo.gear {
                None => mass[j][j] += servo.armature,
                Some(gear) => {
                    mass[j][j] += (1.0 - ROTOR) * servo.armature;
                    mass[r][r] = ROTOR * servo.armature;
                    let between = middle[r] - middle[j];
                    let bend = between - between.clamp(-0.5 * gear.play, 0.5 * gear.play);
                    if bend != 0.0 || gear.play == 0.0 {
                        let torque = gear.stiffness * bend + gear.damping * (ahead[r] - ahead[j]);
                        force[r] -= torque;
                        force[j] += torque;
                    }
                }
            }
        }
        // What the forces do, and unit forces at each freedom.
        let mut moves = [[0.0; MOST]; MOST + 1];
        moves[0] = force;
        (0..m).for_each(|k| moves[1 + k][k] = 1.0);
        solve(&mass, m, &mut moves[..=m]);
        let mut start = self.v;
        for i in 0..m {
            start[i] += h * moves[0][i];
        }
        let new = stuck(&moves[1..=m], &start, &self.v, &limit, h);
        for i in 0..m {
            self.q[i] = middle[i] + 0.5 * h * new[i];
            self.a[i] = (new[i] - self.v[i]) / h;
        }
        self.v = new;
        for j in 0..n {
            let inertial: f64 = (0..n).map(|k| links[j][k] * self.a[k]).sum();
            self.given[j] = bias[j] + inertial;
        }
        if rig.sag != 0.0 {
            let total: f64 = drives[..n].iter().map(|drive| drive.abs()).sum();
            self.drawn += (total - self.drawn) * (1.0 - (-h / SUPPLY).exp());
        }
    }

    /// What the drives give in the middle of a step, Nm.
    fn drives(
        &mut self,
        rig: &Rig,
        commands: &[f64],
        period: f64,
        (time, h): (f64, f64),
        (middle, ahead): (&Row, &Row),
    ) -> Row {
        let n = rig.joints();
        let supply = 1.0 - (rig.sag * self.drawn).clamp(0.0, 0.9);
        let drive = |(j, servo): (usize, &Servo)| {
            let r = self.rotor[j];
            let from = time - servo.delay;
            let [command, rate] = commanded((commands, n, j), period, rig.hold, [from, from + h]);
            let (far, way) = (command - self.set_point[j], servo.speed_limit * h);
            // The set point goes on through the step; its middle is what is felt.
            let goes = far.clamp(-way, way);
            let wanted = match far.abs() < way {
                true => command - 0.5 * far * far.abs() / way,
                false => self.set_point[j] + 0.5 * goes,
            };
            self.set_point[j] += goes;
            let error = wanted + servo.offset - middle[r];
            let felt = error - error.clamp(-servo.dead_band, servo.dead_band);
            let mut sum = self.integral[j];
            if servo.integral[0] > 0.0 {
                let most = servo.integral[1];
                self.integral[j] = (sum + servo.integral[0] * error * h).clamp(-most, most);
                sum = 0.5 * (sum + self.integral[j]);
            }
            let rate = if servo.on_error { rate } else { 0.0 };
            let demand = servo.kp * felt + servo.kd * (rate - ahead[r]) + sum;
            supply * demand.clamp(-servo.limit, servo.limit)
        };
        let mut drives = [0.0; MOST];
        let given = rig.servos.iter().enumerate().map(drive);
        drives
            .iter_mut()
            .zip(given)
            .for_each(|(to, given)| *to = given);
        drives
    }
}

/// The mean command of a joint between two times, and how fast it came: what was sent before the first row was the same. Of commands that come
/// while one is held the last is taken when that ends.
fn commanded(
    (commands, n, joint): (&[f64], usize, usize),
    period: f64,
    hold: f64,
    [from, to]: [f64; 2],
) -> [f64; 2] {
    let rows = commands.len() / n;
    let every = if hold > 0.0 { hold } else { period };
    // Times of steps are sums; a row begins at its own.
    let slot = |time: f64| (time / every + 1e-9).floor();
    let of = |slot: f64| {
        let row = ((slot * every / period + 1e-6).floor().max(0.0) as usize).min(rows - 1);
        commands[row * n + joint]
    };
    let at = |time: f64| {
        let here = slot(time);
        [of(here), (of(here) - of(here - 1.0)) / every]
    };
    let (first, last) = (at(from), at(to - 1e-9 * every));
    let turn = slot(to - 1e-9 * every) * every;
    let share = if turn > from {
        (turn - from) / (to - from)
    } else {
        0.0
    };
    std::array::from_fn(|k| share * first[k] + (1.0 - share) * last[k])
}

/// Springs, waves and bumps; what has no size costs no sine and no exponential.
fn passive(servo: &Servo, q: f64) -> f64 {
    let [size, waves, phase] = servo.ripple;
    let [bump, centre, width] = servo.bump;
    let mut torque = 0.0;
    if size != 0.0 {
        torque += size * (waves * q + phase).sin();
    }
    if bump != 0.0 {
        let from = (q - centre) / width;
        torque += bump * (-0.5 * from * from).exp();
    }
    torque - servo.spring[0] * (q - servo.spring[1])
}

fn dry(servo: &Servo, v: f64, drive: f64, time: f64) -> f64 {
    let mut own = servo.friction;
    if servo.stribeck[0] != 0.0 {
        let slow = v / servo.stribeck[1];
        own += servo.stribeck[0] * (-slow * slow).exp();
    }
    if servo.warm_up[0] != 0.0 {
        own *= 1.0 + servo.warm_up[0] * (-time.max(0.0) / servo.warm_up[1]).exp();
    }
    let back = usize::from(drive * v < 0.0);
    own + servo.load[back] * drive.abs()
}

/// Speeds after a step with dry friction, of `inverse` rows each what a unit force at a freedom does: joints stick where friction can hold
/// them, the others slide against it.
fn stuck(inverse: &[Row], free: &Row, before: &Row, limit: &Row, h: f64) -> Row {
    let n = inverse.len();
    let mut slides = [0.0; MOST];
    let mut sticks = [false; MOST];
    for j in 0..n {
        let from = if before[j] != 0.0 { before[j] } else { free[j] };
        slides[j] = from.signum();
        sticks[j] = limit[j] > 0.0;
    }
    let mut new = *free;
    for _ in 0..EXCHANGES {
        let (mut held, mut count) = ([0; MOST], 0);
        for j in (0..n).filter(|j| sticks[*j]) {
            held[count] = j;
            count += 1;
        }
        let held = &held[..count];
        let against = |j: usize| if sticks[j] { 0.0 } else { limit[j] * slides[j] };
        let mut sliding = *free;
        for (i, speed) in sliding[..n].iter_mut().enumerate() {
            *speed -= h * (0..n).map(|k| inverse[k][i] * against(k)).sum::<f64>();
        }
        let (mut inner, mut hold) = ([[0.0; MOST]; MOST], [[0.0; MOST]]);
        for (a, i) in held.iter().enumerate() {
            for (b, k) in held.iter().enumerate() {
                inner[a][b] = h * inverse[*k][*i];
            }
            hold[0][a] = sliding[*i];
        }
        solve(&inner, count, &mut hold);
        let [hold] = hold;
        for i in 0..n {
            let by = held.iter().zip(&hold);
            new[i] = sliding[i] - by.map(|(k, f)| h * inverse[*k][i] * f).sum::<f64>();
        }
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

/// Gauss with the largest pivot, of the first `n` rows and columns; right sides become solutions.
fn solve(matrix: &Square, n: usize, sides: &mut [Row]) {
    let mut rows = *matrix;
    for k in 0..n {
        let pivot = (k..n)
            .max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))
            .unwrap_or(k);
        rows.swap(k, pivot);
        sides.iter_mut().for_each(|x| x.swap(k, pivot));
        let pivot_row = rows[k];
        for i in k + 1..n {
            let by = rows[i][k] / pivot_row[k];
            for (value, above) in rows[i][..n].iter_mut().zip(&pivot_row) {
                *value -= by * above;
            }
            for x in &mut *sides {
                x[i] -= by * x[k];
            }
        }
    }
    for x in sides {
        for k in (0..n).rev() {
            let sum: f64 = (k + 1..n).map(|c| rows[k][c] * x[c]).sum();
            x[k] = (x[k] - sum) / rows[k][k];
        }
    }
}

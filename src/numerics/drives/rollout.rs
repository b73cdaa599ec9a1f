//! The simulation rolled out along the commands, and how its angles change with the physics.
//!
//! A step is an implicit midpoint for all that is stiff (second order: implicit Euler adds kd dt / 2 to the inertia); dry friction is set-valued: its
//! impulses, coupled over the joints by the inverse mass, stop what they can (projected Gauss-Seidel). Derivatives are those of the step.

use crate::chain::{Chain, MOST, Posed, Row, Square, invert};
use crate::columns::{Columns, Instant, StepMatrices, StepParts};
use crate::physics::{Commanded, LOAD_LAG, Motion, Physics, ROTOR_SHARE, SAG_LAG, Torque, slewed};
use crate::recording::{Commands, Recording, Trajectory};

pub use crate::columns::Direction;

/// A row of the recording as it is simulated.
pub struct SimulatedRow<'a> {
    /// Its number.
    pub row: usize,
    /// Simulated angles as the encoders see them.
    pub angle: &'a [f64],
    /// Speeds of the links.
    pub speed: &'a [f64],
    /// Torques of the drives, Nm.
    pub drive: &'a [f64],
    /// By joint, the change of the angle with each direction.
    pub change: &'a [&'a [f64]],
}

/// Which trajectories are rolled out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Those with rows that are fitted, which alone are seen.
    Fitted,
    /// All.
    All,
}

/// Sweeps of the impulses of dry friction at most, and rad/s at which they are settled.
const SWEEPS: usize = 20;
const SETTLED: f64 = 1e-9;

/// State of a roll-out.
struct Roller<'a> {
    chain: &'a Chain,
    physics: &'a Physics,
    n: usize,
    /// Degrees of freedom, and the one that each joint's drive turns.
    freedoms: usize,
    rotor: Vec<usize>,
    q: Row,
    v: Row,
    a: Row,
    push: Row,
    integral: Row,
    bent: Row,
    set_point: Row,
    driven: Row,
    load: Row,
    /// Nm that all drives give, over the last [`SAG_LAG`] and now.
    drawn: [f64; 2],
    posed: Posed,
    /// Nm/rad of gravity.
    gravity: Square,
    columns: Columns<'a>,
}

/// Rolls a simulation out; `see` is handed each row.
pub fn roll(
    chain: &Chain,
    physics: &Physics,
    recording: &Recording,
    directions: &[Direction],
    which: Which,
    mut see: impl FnMut(&SimulatedRow),
) {
    let n = chain.joints();
    let mut rotor: Vec<usize> = (0..n).collect();
    let mut freedoms = n;
    for (joint, physics) in physics.joints.iter().enumerate() {
        if physics.gear.is_some() && freedoms < MOST {
            rotor[joint] = freedoms;
            freedoms += 1;
        }
    }
    let mut roller = Roller {
        chain,
        physics,
        n,
        freedoms,
        rotor,
        q: [0.0; MOST],
        v: [0.0; MOST],
        a: [0.0; MOST],
        push: [0.0; MOST],
        integral: [0.0; MOST],
        bent: [0.0; MOST],
        set_point: [0.0; MOST],
        driven: [0.0; MOST],
        load: [0.0; MOST],
        drawn: [0.0; 2],
        posed: Posed::default(),
        gravity: [[0.0; MOST]; MOST],
        columns: Columns::new(physics, directions, freedoms),
    };
    let mut began = None;
    let most = if freedoms > n {
        chain.geared_step
    } else {
        chain.step
    };
    for trajectory in &recording.trajectories {
        if which == Which::Fitted && !recording.is_fitted(trajectory) {
            continue;
        }
        if began.replace(trajectory.began) != Some(trajectory.began) {
            for (integral, joint) in roller.integral.iter_mut().zip(&physics.joints) {
                *integral = joint.begun();
            }
            roller.columns.begin();
        }
        let commands = recording.commands(trajectory, physics.hold);
        let (at, speed) = recording.start(trajectory);
        roller.start((&at, &speed), &commands, recording, trajectory);
        let mut guess = 0;
        for row in trajectory.rows.clone() {
            if which == Which::All || !recording.held_out[row] {
                roller.show(row, &mut see);
            }
            if row + 1 == trajectory.rows.end {
                break;
            }
            let (from, to) = (recording.time[row], recording.time[row + 1]);
            let steps = ((to - from) / most - 1e-6).ceil().max(1.0) as usize;
            let h = (to - from) / steps as f64;
            if !directions.is_empty() {
                let gravity = &physics.bodies.gravity;
                chain.gravity_stiffness(&roller.posed, gravity, &mut roller.gravity);
            }
            for k in 0..steps {
                let time = from + h * k as f64;
                guess = commands.index(time, guess);
                roller.advance(&commands, guess, time, time - trajectory.began, h);
            }
            if !directions.is_empty() && !roller.columns.is_few() {
                roller.columns.carry(&roller.rotor);
            }
        }
    }
}

impl Roller<'_> {
    /// The beginning of a trajectory, at rest or in motion: friction, integral and warmth run on.
    fn start(
        &mut self,
        (at, speed): (&[f64], &[f64]),
        commands: &Commands,
        recording: &Recording,
        trajectory: &Trajectory,
    ) {
        let time = recording.time[trajectory.rows.start];
        self.q[..self.n].copy_from_slice(at);
        self.chain.pose(at, &self.physics.bodies, &mut self.posed);
        let mut weight = [0.0; MOST];
        let gravity = &self.physics.bodies.gravity;
        self.chain
            .torques(&self.posed, gravity, &[0.0; MOST], None, &mut weight);
        for joint in 0..self.n {
            let physics = &self.physics.joints[joint];
            let command = commands.mean(joint, time, time + 1e-6, 0)[0];
            self.set_point[joint] = command;
            self.driven[joint] = physics.kp * (command + physics.offset - at[joint]);
            let dry = physics.friction.max(1e-9);
            let held = self.driven[joint]
                - weight[joint]
                - physics.spring[0] * (at[joint] - physics.spring[1]);
            self.bent[joint] = match speed[joint] {
                0.0 => (held / dry).clamp(-1.0, 1.0),
                moving => sign(moving),
            };
            let rotor = self.rotor[joint];
            if let Some(gear) = &physics.gear {
                // The gear carries the weight, on the flank that it leans on.
                let bend = weight[joint] / gear.stiffness + 0.5 * gear.play * sign(weight[joint]);
                match gear.encoder_on_link {
                    true => self.q[rotor] = at[joint] + bend,
                    false => {
                        self.q[rotor] = at[joint];
                        self.q[joint] = at[joint] - bend;
                    }
                }
            }
        }
        self.load = weight;
        self.v = [0.0; MOST];
        for joint in 0..self.n {
            self.v[joint] = speed[joint];
            self.v[self.rotor[joint]] = speed[joint];
        }
        self.a = [0.0; MOST];
        self.push = [0.0; MOST];
        self.columns.start(recording, trajectory, &self.set_point);
    }

    fn show(&mut self, row: usize, see: &mut impl FnMut(&SimulatedRow)) {
        let seen = |joint: usize| match &self.physics.joints[joint].gear {
            Some(gear) if gear.encoder_on_link => joint,
            _ => self.rotor[joint],
        };
        let mut angle = [0.0; MOST];
        (0..self.n).for_each(|joint| angle[joint] = self.q[seen(joint)]);
        let at: [usize; MOST] =
            std::array::from_fn(|joint| if joint < self.n { seen(joint) } else { 0 });
        let (n, count) = (self.n, self.columns.count());
        let changes = self.columns.seen(&at[..n]);
        let change: [&[f64]; MOST] = std::array::from_fn(|joint| match joint < n {
            true => &changes[joint * count..(joint + 1) * count],
            false => &[],
        });
        see(&SimulatedRow {
            row,
            angle: &angle[..self.n],
            speed: &self.v[..self.n],
            drive: &self.driven[..self.n],
            change: &change[..self.n],
        });
    }

    fn advance(&mut self, commands: &Commands, guess: usize, time: f64, since: f64, h: f64) {
        let (n, m, physics) = (self.n, self.freedoms, self.physics);
        let (mut middle, mut ahead) = ([0.0; MOST], [0.0; MOST]);
        for i in 0..m {
            middle[i] = self.q[i] + 0.5 * h * self.v[i];
            // What stopped in the last step does not go back by it.
            if self.v[i] != 0.0 {
                ahead[i] = self.v[i] + 0.5 * h * self.a[i];
            }
        }
        self.chain
            .pose(&middle[..n], &physics.bodies, &mut self.posed);
        let (mut mass, mut bias) = ([[0.0; MOST]; MOST], [0.0; MOST]);
        self.chain.mass_matrix(&self.posed, &mut mass);
        let gravity = &physics.bodies.gravity;
        self.chain
            .torques(&self.posed, gravity, &ahead[..n], None, &mut bias);
        let drawn = self.drawn[0] + (self.drawn[1] - self.drawn[0]) * 0.5 * h / SAG_LAG;
        let sag = 1.0 - (physics.sag * drawn).clamp(0.0, 0.9);
        let (q, v, a, load) = (self.q, self.v, self.a, self.load);
        let mut motion = Motion {
            q: &q[..m],
            v: &v[..m],
            middle: &middle[..m],
            ahead: &ahead[..m],
            a: &a[..m],
            time: since + 0.5 * h,
            driven: &[],
            load: &load[..n],
        };
        let mut torques = [Torque::default(); MOST];
        let mut sent = [Commanded::default(); MOST];
        for j in 0..n {
            let (joint, r) = (&physics.joints[j], self.rotor[j]);
            let [angle, speed] =
                commands.mean(j, time - joint.delay, time + h - joint.delay, guess);
            let (angle, reached) = slewed(self.set_point[j], angle, joint.speed_limit, h);
            self.set_point[j] = reached;
            let before = self.integral[j];
            if joint.integral[0] != 0.0 {
                let error = angle + joint.offset - middle[r];
                let most = joint.integral[1];
                self.integral[j] = (before + joint.integral[0] * error * h).clamp(-most, most);
            }
            sent[j] = Commanded {
                angle,
                speed,
                integral: 0.5 * (before + self.integral[j]),
                bent: self.bent[j],
            };
            self.driven[j] = joint.drive(j, r, &motion, &sent[j], sag).given;
        }
        let driven = self.driven;
        motion.driven = &driven[..n];
        for j in 0..n {
            torques[j] = physics.joints[j].torque(j, self.rotor[j], &motion, &sent[j], sag);
        }
        let links = mass;
        let (mut force, mut limit) = ([0.0; MOST], [[0.0; 2]; MOST]);
        let (mut stiff, mut damp) = ([[0.0; MOST]; MOST], [[0.0; MOST]; MOST]);
        for j in 0..n {
            let (t, r) = (&torques[j], self.rotor[j]);
            force[j] -= bias[j];
            force[r] += t.smooth;
            limit[r] = t.limit;
            stiff[r][r] += t.stiffness;
            damp[r][r] += t.damping;
            let armature = physics.joints[j].armature;
            if r == j {
                mass[j][j] += armature;
            } else {
                mass[j][j] += (1.0 - ROTOR_SHARE) * armature;
                mass[r][r] = (ROTOR_SHARE * armature).max(1e-9);
                force[j] += t.link;
                for (matrix, value) in [(&mut stiff, t.gear[0]), (&mut damp, t.gear[1])] {
                    matrix[r][r] += value;
                    matrix[j][j] += value;
                    matrix[r][j] -= value;
                    matrix[j][r] -= value;
                }
            }
        }
        let mut implicit = mass;
        for i in 0..m {
            for k in 0..m {
                implicit[i][k] += 0.5 * h * damp[i][k] + 0.25 * h * h * stiff[i][k];
            }
        }
        let mut w = [[0.0; MOST]; MOST];
        if !invert(&implicit, m, &mut w) {
            // Bodies that no mass matrix belongs to: the angles say it.
            self.q = [f64::NAN; MOST];
            return;
        }
        let mut free = self.v;
        let mut pulled = [0.0; MOST];
        for i in 0..m {
            let by_speed: f64 = (0..m).map(|k| stiff[i][k] * self.v[k]).sum();
            pulled[i] = h * (force[i] - 0.5 * h * by_speed);
        }
        for i in 0..m {
            for k in 0..m {
                free[i] += w[i][k] * pulled[k];
            }
        }
        let mut new = self.slid(&w, &free, &limit, h);
        if new[..m]
            .iter()
            .any(|speed| !speed.is_finite() || speed.abs() > 1e4)
        {
            new = [f64::NAN; MOST];
        }
        if !self.columns.is_empty() {
            let slides: Row = std::array::from_fn(|i| {
                let against = limit[i][usize::from(self.push[i] < 0.0)];
                let share = if against > 0.0 {
                    self.push[i] / (h * against)
                } else {
                    sign(self.v[i])
                };
                if share.abs() > 0.999_999 { share } else { 0.0 }
            });
            let at = Instant {
                physics,
                rotor: &self.rotor,
                commands,
                guess,
                time,
                h,
                motion: &motion,
                sent: &sent[..n],
                torques: &torques[..n],
                slides: &slides,
                drawn,
                sag,
            };
            self.columns
                .ask(&at, self.chain, &self.posed, &a[..m], &ahead[..n]);
            for j in 0..n {
                for k in 0..n {
                    stiff[j][k] += self.gravity[j][k];
                }
            }
            self.linearised((&w, &stiff, &damp), &limit, h);
        }
        let total: f64 = driven[..n].iter().map(|drive| drive.abs()).sum();
        let lag = h / SAG_LAG;
        let drawn = (self.drawn[0] * (1.0 - 0.5 * lag) + total * lag) / (1.0 + 0.5 * lag);
        self.drawn = [drawn, total];
        for j in 0..n {
            let (joint, r) = (&physics.joints[j], self.rotor[j]);
            if joint.presliding > 0.0 {
                let v = 0.5 * (self.v[r] + new[r]);
                let rate = v.abs() * h / joint.presliding;
                self.bent[j] = (self.bent[j] + sign(v) * rate) / (1.0 + rate);
            }
        }
        for i in 0..m {
            self.q[i] += 0.5 * h * (self.v[i] + new[i]);
            self.a[i] = (new[i] - self.v[i]) / h;
            self.v[i] = new[i];
        }
        for i in 0..n {
            let inertial: f64 = (0..n).map(|k| links[i][k] * self.a[k]).sum();
            self.load[i] += (bias[i] + inertial - self.load[i]) * (h / LOAD_LAG).min(1.0);
        }
    }

    /// Speeds after dry friction: impulses within their limits stop what they can.
    fn slid(&mut self, w: &Square, free: &Row, limit: &[[f64; 2]; MOST], h: f64) -> Row {
        let m = self.freedoms;
        let mut new = *free;
        for i in 0..m {
            self.push[i] = self.push[i].clamp(-h * limit[i][1], h * limit[i][0]);
            for k in 0..m {
                new[k] -= w[k][i] * self.push[i];
            }
        }
        for _ in 0..SWEEPS {
            let mut most: f64 = 0.0;
            for i in 0..m {
                let [forward, back] = limit[i];
                if forward == 0.0 && back == 0.0 {
                    continue;
                }
                let push = (self.push[i] + new[i] / w[i][i]).clamp(-h * back, h * forward);
                let change = push - self.push[i];
                if change != 0.0 {
                    self.push[i] = push;
                    for k in 0..m {
                        new[k] -= w[k][i] * change;
                    }
                    most = most.max((w[i][i] * change).abs());
                }
            }
            if most < SETTLED {
                break;
            }
        }
        new
    }

    /// Carries the step's derivative on.
    fn linearised(
        &mut self,
        (w, stiff, damp): (&Square, &Square, &Square),
        limit: &[[f64; 2]; MOST],
        h: f64,
    ) {
        let m = self.freedoms;
        // What friction holds keeps its speed of zero.
        let (mut held, mut count) = ([0; MOST], 0);
        for i in 0..m {
            let against = limit[i][usize::from(self.push[i] < 0.0)];
            if against > 0.0 && self.push[i].abs() < 0.999_999 * h * against {
                held[count] = i;
                count += 1;
            }
        }
        let mut inverse = [[0.0; MOST]; MOST];
        if count > 0 {
            let mut inner = [[0.0; MOST]; MOST];
            for (a, i) in held[..count].iter().enumerate() {
                for (b, k) in held[..count].iter().enumerate() {
                    inner[a][b] = w[*i][*k];
                }
            }
            if !invert(&inner, count, &mut inverse) {
                count = 0;
            }
        }
        let parts = StepParts {
            w,
            stiff,
            damp,
            held: &held[..count],
            inner: &inverse,
            h,
        };
        if self.columns.is_few() {
            self.columns.carry_step(&self.rotor, &parts);
        } else {
            self.columns.push_step(step_matrices(&parts, m));
        }
    }
}

/// The step's derivative as matrices.
fn step_matrices(parts: &StepParts, m: usize) -> StepMatrices {
    let StepParts {
        w,
        stiff,
        damp,
        held,
        inner,
        h,
    } = *parts;
    let mut keep = [[0.0; MOST]; MOST];
    (0..m).for_each(|i| keep[i][i] = 1.0);
    for row in 0..m {
        for (b, k) in held.iter().enumerate() {
            let shares = held.iter().enumerate();
            let share: f64 = shares.map(|(a, i)| w[row][*i] * inner[a][b]).sum();
            keep[row][*k] -= share;
        }
    }
    let mut through = [[0.0; MOST]; MOST];
    for i in 0..m {
        for k in 0..m {
            through[i][k] = (0..m).map(|j| keep[i][j] * w[j][k]).sum();
        }
    }
    // new dv = keep dv + through h (f - K (dq + h/2 dv) - D dv)
    let (mut by_speed, mut by_angle) = ([[0.0; MOST]; MOST], [[0.0; MOST]; MOST]);
    for i in 0..m {
        for k in 0..m {
            let (mut speed, mut angle) = (0.0, 0.0);
            for j in 0..m {
                angle -= through[i][j] * stiff[j][k] * h;
                speed -= through[i][j] * (0.5 * h * stiff[j][k] + damp[j][k]) * h;
            }
            by_angle[i][k] = angle;
            by_speed[i][k] = keep[i][k] + speed;
        }
    }
    for row in &mut through[..m] {
        row[..m].iter_mut().for_each(|by| *by *= h);
    }
    StepMatrices {
        by_speed,
        by_angle,
        by_torque: through,
        h,
    }
}

fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

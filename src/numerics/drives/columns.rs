//! How simulated angles change with the physics: a change is torques at the same motion, which the linearised steps carry on.
//!
//! Between two rows the steps are one product of matrices, so that a change costs a few products a row and one torque a step, at the joint
//! where it acts; a few changes are carried step by step, which needs no matrices.

use crate::chain::{Bodies, Chain, MOST, Moved, Posed, Row, Square};
use crate::physics::{Commanded, Curve, Joint, Motion, Physics, Torque, slewed};
use crate::recording::{Commands, Recording, Trajectory};

/// A change of the physics whose response is wanted: joints and bodies as they would be.
#[derive(Debug, Clone, Default)]
pub struct Direction {
    /// Changed joints.
    pub joints: Vec<(usize, Joint)>,
    /// Changed bodies.
    pub bodies: Option<Bodies>,
    /// Changed time between commands that are taken, s.
    pub hold: Option<f64>,
    /// Changed share that the supply loses.
    pub sag: Option<f64>,
}

impl Direction {
    /// What differs between two simulations.
    pub fn between(base: &Physics, changed: &Physics) -> Self {
        let joints = base.joints.iter().zip(&changed.joints).enumerate();
        Self {
            joints: joints
                .filter(|(_, (before, after))| before != after)
                .map(|(joint, (_, after))| (joint, after.clone()))
                .collect(),
            bodies: (base.bodies != changed.bodies).then(|| changed.bodies.clone()),
            hold: (base.hold != changed.hold).then_some(changed.hold),
            sag: (base.sag != changed.sag).then_some(changed.sag),
        }
    }
}

/// What a direction does at one joint.
enum Change<'a> {
    /// One more curve.
    Curve(&'a Curve),
    /// One more wave.
    Wave([f64; 3]),
    /// Anything else.
    Joint(&'a Joint),
}

/// A direction at one joint, and what a drive with it remembers.
struct Slot<'a> {
    direction: usize,
    joint: usize,
    change: Change<'a>,
    /// Number of its commands where it takes others.
    hold: Option<usize>,
    sag: Option<f64>,
    set_point: f64,
    integral: f64,
}

/// A direction with other bodies: links that differ, or all where gravity does.
struct Heavier<'a> {
    direction: usize,
    bodies: &'a Bodies,
    links: Vec<usize>,
    turned: bool,
    asked: Row,
}

/// A linearised step: new speeds by speeds, angles and torques.
#[derive(Clone, Copy)]
pub(crate) struct StepMatrices {
    pub(crate) by_speed: Square,
    pub(crate) by_angle: Square,
    pub(crate) by_torque: Square,
    pub(crate) h: f64,
}

/// A linearised step as it is made: the inverse of the implicit mass, what pulls back by angles and by speeds, and which degrees of freedom
/// friction holds, with the inverse of the first over these.
pub(crate) struct StepParts<'a> {
    pub(crate) w: &'a Square,
    pub(crate) stiff: &'a Square,
    pub(crate) damp: &'a Square,
    pub(crate) held: &'a [usize],
    pub(crate) inner: &'a Square,
    pub(crate) h: f64,
}

/// What is known of a step before it is made.
pub(crate) struct Instant<'a> {
    pub(crate) physics: &'a Physics,
    pub(crate) rotor: &'a [usize],
    pub(crate) commands: &'a Commands,
    pub(crate) guess: usize,
    pub(crate) time: f64,
    pub(crate) h: f64,
    pub(crate) motion: &'a Motion<'a>,
    pub(crate) sent: &'a [Commanded],
    pub(crate) torques: &'a [Torque],
    /// Where dry friction slides, its sign; 0 where it holds.
    pub(crate) slides: &'a Row,
    /// Nm that all drives give.
    pub(crate) drawn: f64,
    pub(crate) sag: f64,
}

/// Steps between two evaluations of what a change of bodies asks for.
const BODIES_EVERY: usize = 4;
/// A column over angles and speeds.
type Tall = [f64; 2 * MOST];

/// Changes of angles and speeds with every direction.
pub(crate) struct Columns<'a> {
    count: usize,
    freedoms: usize,
    /// By direction: changes of angles, then of speeds.
    state: Vec<f64>,
    slots: Vec<Slot<'a>>,
    heavier: Vec<Heavier<'a>>,
    holds: Vec<f64>,
    held: Vec<Commands>,
    /// By step since the row: of each slot the torque at the rotor and on the link; of each heavier direction one a joint.
    pushes: Vec<f64>,
    weights: Vec<f64>,
    steps: Vec<StepMatrices>,
    gains: Vec<[Tall; MOST]>,
    /// By direction, what it asks for in a step that is carried by itself.
    forces: Vec<Row>,
    since: usize,
    /// By joint, the change of each direction as its encoder sees it.
    seen: Vec<f64>,
}

impl<'a> Columns<'a> {
    pub(crate) fn new(physics: &'a Physics, directions: &'a [Direction], freedoms: usize) -> Self {
        let n = physics.joints.len();
        let (mut slots, mut heavier, mut holds) = (Vec::new(), Vec::new(), Vec::new());
        for (d, direction) in directions.iter().enumerate() {
            let whole = direction.hold.is_some() || direction.sag.is_some();
            let hold = direction.hold.map(|hold| {
                holds.push(hold);
                holds.len() - 1
            });
            let mut slot = |joint: usize, change: Change<'a>| {
                slots.push(Slot {
                    direction: d,
                    joint,
                    change,
                    hold,
                    sag: direction.sag,
                    set_point: 0.0,
                    integral: 0.0,
                });
            };
            for (joint, base) in physics.joints.iter().enumerate() {
                let other = direction.joints.iter().find(|(at, _)| *at == joint);
                match other {
                    // Commands and voltage are those of all joints.
                    _ if whole => slot(
                        joint,
                        Change::Joint(other.map_or(base, |(_, changed)| changed)),
                    ),
                    Some((_, changed)) => slot(joint, change(base, changed)),
                    None => {}
                }
            }
            if let Some(bodies) = &direction.bodies {
                let links = bodies.links.iter().zip(&physics.bodies.links).enumerate();
                let links = links
                    .filter(|(_, (after, before))| after != before)
                    .map(|(link, _)| link);
                heavier.push(Heavier {
                    direction: d,
                    bodies,
                    links: links.collect(),
                    turned: bodies.gravity != physics.bodies.gravity,
                    asked: [0.0; MOST],
                });
            }
        }
        Self {
            count: directions.len(),
            freedoms,
            state: vec![0.0; 2 * freedoms * directions.len()],
            slots,
            heavier,
            holds,
            held: Vec::new(),
            pushes: Vec::new(),
            weights: Vec::new(),
            steps: Vec::new(),
            gains: Vec::new(),
            forces: vec![[0.0; MOST]; directions.len()],
            since: 0,
            seen: vec![0.0; n * directions.len()],
        }
    }

    /// Number of directions.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether they are so few that steps are not multiplied.
    pub(crate) fn is_few(&self) -> bool {
        self.count <= 2 * self.freedoms
    }

    /// All changes by one step.
    pub(crate) fn carry_step(&mut self, rotor: &[usize], step: &StepParts) {
        let (m, n, h) = (self.freedoms, rotor.len(), step.h);
        self.forces.fill([0.0; MOST]);
        let forces = &mut self.forces;
        for (slot, push) in self.slots.iter().zip(self.pushes.chunks_exact(2)) {
            let force = &mut forces[slot.direction];
            force[rotor[slot.joint]] += push[0];
            force[slot.joint] += push[1];
        }
        for (heavier, weights) in self.heavier.iter().zip(self.weights.chunks_exact(n)) {
            add(&mut forces[heavier.direction], 1.0, weights);
        }
        for (state, force) in self.state.chunks_exact_mut(2 * m).zip(forces) {
            let (angle, speed) = state.split_at_mut(m);
            let mut ahead = [0.0; MOST];
            for i in 0..m {
                ahead[i] = angle[i] + 0.5 * h * speed[i];
            }
            for i in 0..m {
                let pulled: f64 = (0..m)
                    .map(|k| step.stiff[i][k] * ahead[k] + step.damp[i][k] * speed[k])
                    .sum();
                force[i] = h * (force[i] - pulled);
            }
            let mut new = [0.0; MOST];
            new[..m].copy_from_slice(speed);
            for (column, force) in step.w.iter().zip(&force[..m]) {
                // The inverse is symmetric.
                add(&mut new[..m], *force, &column[..m]);
            }
            let stopped: Row = std::array::from_fn(|k| step.held.get(k).map_or(0.0, |i| new[*i]));
            for (row, i) in step.inner.iter().zip(step.held) {
                let by: f64 = row.iter().zip(&stopped).map(|(a, b)| a * b).sum();
                add(&mut new[..m], -by, &step.w[*i][..m]);
            }
            for i in 0..m {
                angle[i] += 0.5 * h * (speed[i] + new[i]);
            }
            speed[..m].copy_from_slice(&new[..m]);
        }
        self.pushes.clear();
        self.weights.clear();
    }

    /// At the beginning of a recording.
    pub(crate) fn begin(&mut self) {
        for slot in &mut self.slots {
            slot.integral = match &slot.change {
                Change::Joint(changed) => changed.begun(),
                _ => 0.0,
            };
        }
    }

    /// At the beginning of a trajectory, which is measured; integrals run on.
    pub(crate) fn start(
        &mut self,
        recording: &Recording,
        trajectory: &Trajectory,
        set_point: &Row,
    ) {
        self.state.fill(0.0);
        self.since = 0;
        self.steps.clear();
        let held = self.holds.iter();
        self.held = held
            .map(|hold| recording.commands(trajectory, *hold))
            .collect();
        for slot in &mut self.slots {
            slot.set_point = set_point[slot.joint];
        }
    }

    /// What every direction asks for in a step.
    pub(crate) fn ask(
        &mut self,
        at: &Instant,
        chain: &Chain,
        posed: &Posed,
        acceleration: &[f64],
        speed: &[f64],
    ) {
        let count = self.slots.len();
        let from = self.steps.len() * 2 * count;
        self.pushes.resize(from + 2 * count, 0.0);
        let mut wave = (usize::MAX, 0.0, (0.0, 0.0));
        for (slot, push) in self.slots.iter_mut().zip(self.pushes[from..].chunks_mut(2)) {
            let joint = slot.joint;
            let slides = at.slides[at.rotor[joint]];
            push[1] = 0.0;
            match &slot.change {
                Change::Curve(curve) => {
                    let value = curve.value(at.motion);
                    push[0] = if curve.dry { -slides * value } else { value };
                }
                Change::Wave([waves, cosine, sine]) => {
                    if (wave.0, wave.1) != (joint, *waves) {
                        wave = (
                            joint,
                            *waves,
                            libm::sincos(waves * at.motion.middle[at.rotor[joint]]),
                        );
                    }
                    push[0] = cosine * wave.2.1 + sine * wave.2.0;
                }
                Change::Joint(changed) => slot_torque(
                    (&mut slot.set_point, &mut slot.integral),
                    (joint, changed),
                    slot.hold.map_or(at.commands, |hold| &self.held[hold]),
                    slot.sag,
                    at,
                    acceleration,
                    push,
                ),
            }
        }
        let n = at.sent.len();
        if self.since.is_multiple_of(BODIES_EVERY) && !self.heavier.is_empty() {
            self.weigh(at.physics, chain, posed, speed, acceleration);
        }
        for heavier in &self.heavier {
            self.weights.extend_from_slice(&heavier.asked[..n]);
        }
        self.since += 1;
    }

    fn weigh(
        &mut self,
        physics: &Physics,
        chain: &Chain,
        posed: &Posed,
        speed: &[f64],
        acceleration: &[f64],
    ) {
        let gravity = &physics.bodies.gravity;
        let mut moved = [Moved::default(); MOST];
        chain.moved(posed, gravity, speed, Some(acceleration), &mut moved);
        for heavier in &mut self.heavier {
            let mut asked = [0.0; MOST];
            if heavier.turned {
                // At rest under what gravity differs by.
                let by = heavier.bodies.gravity - gravity;
                chain.torques(posed, &by, &[0.0; MOST], None, &mut asked);
            }
            for link in &heavier.links {
                chain.torques_of(
                    posed,
                    &moved[*link],
                    *link,
                    &heavier.bodies.links[*link],
                    &mut asked,
                );
            }
            heavier.asked = asked.map(|torque| -torque);
        }
    }

    pub(crate) fn push_step(&mut self, step: StepMatrices) {
        self.steps.push(step);
    }

    /// All steps since the row before at once.
    pub(crate) fn carry(&mut self, rotor: &[usize]) {
        let m = self.freedoms;
        let w = 2 * m;
        // Columns of the product of the later steps.
        let mut whole = [[0.0; 2 * MOST]; 2 * MOST];
        (0..w).for_each(|k| whole[k][k] = 1.0);
        self.gains.resize(self.steps.len(), [[0.0; 2 * MOST]; MOST]);
        for (step, gain) in self.steps.iter().zip(&mut self.gains).rev() {
            let half = 0.5 * step.h;
            let mut new = [[0.0; 2 * MOST]; 2 * MOST];
            for k in 0..m {
                gain[k][..w].fill(0.0);
                for c in 0..w {
                    new[k][c] = whole[k][c];
                    new[m + k][c] = half * whole[k][c];
                }
            }
            for i in 0..m {
                let mut through = [0.0; 2 * MOST];
                for c in 0..w {
                    through[c] = whole[m + i][c] + half * whole[i][c];
                }
                for k in 0..m {
                    add(&mut gain[k][..w], step.by_torque[i][k], &through[..w]);
                    add(&mut new[k][..w], step.by_angle[i][k], &through[..w]);
                    add(&mut new[m + k][..w], step.by_speed[i][k], &through[..w]);
                }
            }
            whole = new;
        }
        for state in self.state.chunks_exact_mut(w) {
            let mut new = [0.0; 2 * MOST];
            for (x, column) in state.iter().zip(&whole) {
                if *x != 0.0 {
                    add(&mut new[..w], *x, &column[..w]);
                }
            }
            state.copy_from_slice(&new[..w]);
        }
        let stride = 2 * self.slots.len();
        for (s, slot) in self.slots.iter().enumerate() {
            let state = &mut self.state[slot.direction * w..(slot.direction + 1) * w];
            for (k, gain) in self.gains.iter().enumerate() {
                let [push, link] = [
                    self.pushes[k * stride + 2 * s],
                    self.pushes[k * stride + 2 * s + 1],
                ];
                if push != 0.0 {
                    add(state, push, &gain[rotor[slot.joint]][..w]);
                }
                if link != 0.0 {
                    add(state, link, &gain[slot.joint][..w]);
                }
            }
        }
        let n = rotor.len();
        let stride = n * self.heavier.len();
        for (s, heavier) in self.heavier.iter().enumerate() {
            let state = &mut self.state[heavier.direction * w..(heavier.direction + 1) * w];
            for (k, gain) in self.gains.iter().enumerate() {
                for joint in 0..n {
                    add(
                        state,
                        self.weights[k * stride + n * s + joint],
                        &gain[joint][..w],
                    );
                }
            }
        }
        self.steps.clear();
        self.pushes.clear();
        self.weights.clear();
    }

    /// By joint, the changes of each direction at the degrees of freedom that the encoders see.
    pub(crate) fn seen(&mut self, at: &[usize]) -> &[f64] {
        let w = 2 * self.freedoms;
        for (joint, seen) in at.iter().zip(self.seen.chunks_exact_mut(self.count.max(1))) {
            for (out, state) in seen.iter_mut().zip(self.state.chunks_exact(w)) {
                *out = state[*joint];
            }
        }
        &self.seen
    }
}

fn add(to: &mut [f64], by: f64, from: &[f64]) {
    to.iter_mut()
        .zip(from)
        .for_each(|(to, from)| *to += by * from);
}

fn change<'a>(base: &Joint, changed: &'a Joint) -> Change<'a> {
    let (curves, waves) = (base.curves.len(), base.ripple.len());
    let mut more = base.clone();
    if let Some(curve) = changed.curves.get(curves) {
        more.curves.push(curve.clone());
        if more == *changed {
            return Change::Curve(curve);
        }
    } else if let Some(wave) = changed.ripple.get(waves) {
        more.ripple.push(*wave);
        if more == *changed {
            return Change::Wave(*wave);
        }
    }
    Change::Joint(changed)
}

fn slot_torque(
    (set_point, integral): (&mut f64, &mut f64),
    (joint, changed): (usize, &Joint),
    commands: &Commands,
    sag: Option<f64>,
    at: &Instant,
    acceleration: &[f64],
    push: &mut [f64],
) {
    let (base, r) = (&at.physics.joints[joint], at.rotor[joint]);
    let mut with = at.sent[joint];
    let own = !std::ptr::eq(commands, at.commands);
    if own || changed.delay != base.delay {
        let from = at.time - changed.delay;
        let [angle, speed] = commands.mean(joint, from, from + at.h, at.guess);
        (with.angle, with.speed) = (angle, speed);
    }
    if changed.speed_limit != base.speed_limit {
        let from = at.time - changed.delay;
        let [angle, _] = commands.mean(joint, from, from + at.h, at.guess);
        (with.angle, *set_point) = slewed(*set_point, angle, changed.speed_limit, at.h);
    }
    if changed.integral != base.integral {
        let error = with.angle + changed.offset - at.motion.middle[r];
        let (most, before) = (changed.integral[1], *integral);
        *integral = (before + changed.integral[0] * error * at.h).clamp(-most, most);
        with.integral = 0.5 * (before + *integral);
    }
    let sag = sag.map_or(at.sag, |sag| 1.0 - (sag * at.drawn).clamp(0.0, 0.9));
    let t = changed.torque(joint, r, at.motion, &with, sag);
    let before = &at.torques[joint];
    let way = usize::from(at.slides[r] < 0.0);
    let dry = at.slides[r] * (t.limit[way] - before.limit[way]);
    let rotor = changed.armature - base.armature;
    push[0] = t.smooth - before.smooth - dry - rotor * acceleration[r];
    if r != joint {
        push[1] = t.link - before.link;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::against_mujoco::motion;
    use crate::physics::Gear;
    use crate::rollout::{Which, roll};

    #[test]
    fn changes_carried_step_by_step_are_those_of_the_product_of_steps() {
        let (chain, mut physics, recording) = motion();
        physics.joints[1].friction = 0.2;
        physics.joints[2].gear = Some(Gear {
            stiffness: 400.0,
            damping: 0.5,
            play: 0.0,
            encoder_on_link: false,
        });
        let mut damped = physics.clone();
        damped.joints[2].damping += 0.1;
        let mut heavier = physics.clone();
        heavier.bodies.links[3].mass *= 1.1;
        let few = [&damped, &heavier].map(|changed| Direction::between(&physics, changed));
        let many = few.iter().cycle().take(12).cloned();
        let many: Vec<Direction> = many.collect();
        let changes = |directions: &[Direction]| {
            let mut all: Vec<[f64; 2]> = Vec::new();
            roll(
                &chain,
                &physics,
                &recording,
                directions,
                Which::All,
                |row| {
                    all.extend((0..4).map(|joint| [row.change[joint][0], row.change[joint][1]]));
                },
            );
            all
        };
        let (few, many) = (changes(&few), changes(&many));
        for direction in 0..2 {
            let size = many
                .iter()
                .fold(0.0_f64, |most, change| most.max(change[direction].abs()));
            assert!(size > 1e-6, "{size}");
            for (a, b) in few.iter().zip(&many) {
                assert!((a[direction] - b[direction]).abs() < 1e-8 * size);
            }
        }
    }
}

//! The small motions of one row, and their partial derivatives by the parameters.

use crate::spatial::Twist;
use nalgebra::Vector3;

/// Where a partial derivative acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Direction {
    /// Along the screw of a joint (from 0): rad or m per unit of the parameter.
    Joint(usize, f64),
    /// At a station: 0 the base, k the body moved by joint k, n also the tool; zero-pose base coordinates, per unit of the parameter.
    Station(usize, Twist),
    /// On the load of a joint (from 0): Nm per unit of the parameter; it acts through the joint's compliance.
    Torque(usize, f64),
    /// Motion of the row's anchor, tracker frame, m per unit.
    Anchor(Vector3<f64>),
    /// Turn of the row's plane: its normal, and the change of that per unit.
    AnchorTilt(Vector3<f64>, Vector3<f64>),
    /// Growth of the radius of the row's sphere, m per unit.
    AnchorGrowth(f64),
    /// Change of the point as the instrument reads it, tracker frame, m per unit.
    Instrument(Vector3<f64>),
}

/// Sums of all motions of a row. Twists at a station are added before the exponential, so the order of effects is irrelevant.
#[derive(Debug, Clone)]
pub struct Deflection {
    /// Extra travel of each joint, rad or m.
    pub(crate) joint: Vec<f64>,
    /// Twist at each station 0..=n.
    pub(crate) station: Vec<Twist>,
    /// How far the row's anchor is from where it was believed, tracker frame, m.
    pub(crate) anchor: Vector3<f64>,
    /// What the normal of the row's plane has across the one that was believed.
    pub(crate) anchor_tilt: Vector3<f64>,
    /// How much larger the radius of the row's sphere is than was believed, m.
    pub(crate) anchor_growth: f64,
    /// How far the point is read from where it is, tracker frame, m.
    pub(crate) reading: Vector3<f64>,
    /// How far each joint yields to a torque more, rad/Nm.
    pub(crate) compliance: Vec<f64>,
    /// (parameter of the stack, direction); a parameter may appear several times.
    pub partials: Vec<(usize, Direction)>,
    /// Whether no partials are kept, where only the motions are wanted.
    pub(crate) bare: bool,
    first: usize,
    kept: Kept,
}

/// What a form may be off beyond the rows that it was fitted to: groups of motions, each group with a factor of one standard deviation.
pub struct BeyondRange {
    /// Their directions, by the parameters of the form.
    pub(crate) motions: Deflection,
    ends: Vec<(usize, f64)>,
}

impl BeyondRange {
    pub(super) fn new(joints: usize) -> Self {
        Self {
            motions: Deflection::new(joints),
            ends: Vec::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.motions.clear();
        self.ends.clear();
    }

    /// Ends a group: what was moved since the one before is off together, by `factor` times its size.
    pub(crate) fn close(&mut self, factor: f64) {
        self.ends.push((self.motions.partials.len(), factor));
    }

    /// The groups: factor, and (parameter, direction) of each motion.
    pub(super) fn groups(&self) -> impl Iterator<Item = (f64, &[(usize, Direction)])> {
        let starts = std::iter::once(0).chain(self.ends.iter().map(|(end, _)| *end));
        starts
            .zip(&self.ends)
            .map(|(start, (end, factor))| (*factor, &self.motions.partials[start..*end]))
    }
}

/// Sums at [`Deflection::keep`].
#[derive(Debug, Clone, Default)]
struct Kept {
    joint: Vec<f64>,
    station: Vec<Twist>,
    partials: usize,
}

impl Deflection {
    /// No motion of an arm with so many joints.
    pub fn new(joints: usize) -> Self {
        let (joint, station) = (vec![0.0; joints], vec![Twist::zeros(); joints + 1]);
        Self {
            anchor: Vector3::zeros(),
            anchor_tilt: Vector3::zeros(),
            anchor_growth: 0.0,
            reading: Vector3::zeros(),
            compliance: joint.clone(),
            joint,
            station,
            partials: Vec::new(),
            bare: false,
            first: 0,
            kept: Kept::default(),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.joint.fill(0.0);
        self.station.fill(Twist::zeros());
        self.anchor = Vector3::zeros();
        self.anchor_tilt = Vector3::zeros();
        self.anchor_growth = 0.0;
        self.reading = Vector3::zeros();
        self.compliance.fill(0.0);
        self.partials.clear();
    }

    /// Remembers the motions so far for [`Deflection::restore`].
    pub(crate) fn keep(&mut self) {
        self.kept.joint.clone_from(&self.joint);
        self.kept.station.clone_from(&self.station);
        self.kept.partials = self.partials.len();
    }

    /// Drops all motions since [`Deflection::keep`].
    pub(crate) fn restore(&mut self) {
        self.joint.clone_from(&self.kept.joint);
        self.station.clone_from(&self.kept.station);
        self.compliance.fill(0.0);
        self.partials.truncate(self.kept.partials);
    }

    /// The number of the current effect's first parameter within the stack.
    pub(crate) fn start(&mut self, first: usize) {
        self.first = first;
    }

    fn partial(&mut self, parameter: usize, direction: Direction) {
        if !self.bare {
            self.partials.push((self.first + parameter, direction));
        }
    }

    /// Moves a joint by `p[parameter] * rate`.
    pub(crate) fn turn(&mut self, parameter: usize, p: &[f64], joint: usize, rate: f64) {
        self.joint[joint] += p[parameter] * rate;
        self.partial(parameter, Direction::Joint(joint, rate));
    }

    /// Says that a joint yields to a torque more by `compliance` (rad/Nm).
    pub(crate) fn yields(&mut self, joint: usize, compliance: f64) {
        self.compliance[joint] += compliance;
    }

    /// Moves everything beyond a station by the twist `p[parameter] * rate`.
    pub(crate) fn shift(&mut self, parameter: usize, p: &[f64], station: usize, rate: Twist) {
        self.station[station] += rate * p[parameter];
        self.partial(parameter, Direction::Station(station, rate));
    }

    /// Moves the row's anchor by `p[parameter] * rate` (m per unit); no effect that needs torques does.
    pub(crate) fn move_anchor(&mut self, parameter: usize, p: &[f64], rate: Vector3<f64>) {
        self.anchor += rate * p[parameter];
        self.partial(parameter, Direction::Anchor(rate));
    }

    /// Tilts the row's plane by `p[first]` and `p[first + 1]` (rad) along `across`, from the unit normal that was believed.
    pub(crate) fn tilt_anchor(
        &mut self,
        first: usize,
        p: &[f64],
        normal: &Vector3<f64>,
        across: &[Vector3<f64>; 2],
    ) {
        self.anchor_tilt = across[0] * p[first] + across[1] * p[first + 1];
        let tilted = normal + self.anchor_tilt;
        let (length, now) = (tilted.norm(), tilted.normalize());
        for (k, direction) in across.iter().enumerate() {
            self.partial(
                first + k,
                Direction::AnchorTilt(now, (direction - now * now.dot(direction)) / length),
            );
        }
    }

    /// Makes the radius of the row's sphere larger by `p[parameter]`, m.
    pub(crate) fn grow_anchor(&mut self, parameter: usize, p: &[f64]) {
        self.anchor_growth += p[parameter];
        self.partial(parameter, Direction::AnchorGrowth(1.0));
    }

    /// Moves what the instrument reads by `p[parameter] * rate` (m per unit).
    pub(crate) fn misread(&mut self, parameter: usize, p: &[f64], rate: Vector3<f64>) {
        self.reading += rate * p[parameter];
        self.partial(parameter, Direction::Instrument(rate));
    }

    /// What each parameter loads each joint with, Nm per unit: (parameter, joint, rate).
    pub fn loads(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.partials
            .iter()
            .filter_map(|(parameter, direction)| match direction {
                Direction::Torque(joint, rate) => Some((*parameter, *joint, *rate)),
                _ => None,
            })
    }

    /// Says that a unit of the parameter loads a joint with `rate` Nm more; the load itself is a correction of the load.
    pub(crate) fn load(&mut self, parameter: usize, joint: usize, rate: f64) {
        self.partial(parameter, Direction::Torque(joint, rate));
    }
}

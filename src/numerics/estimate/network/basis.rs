//! Terms of a linear correction: a way in which the point moves, times waves of the joints.
//!
//! Two dictionaries: `harmonics` moves the point along the tracker's axes (ridge on harmonics), `curves` turns each joint by a
//! smooth curve of its own angle, tilts and shifts the stations between, and winds joints up by the weight of what they carry.

use super::arm::{ScrewArm, Stance};

/// How the point moves. Joints, stations and axes from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputMotion {
    /// Along an axis of the tracker's frame.
    Along(usize),
    /// As this joint would move it.
    Turn(usize),
    /// With a shift of the station behind so many joints, along its axis.
    Shift(usize, usize),
    /// With a tilt of that station about its axis.
    Tilt(usize, usize),
}

/// What the motion is proportional to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wave {
    /// Sine or cosine of `order` times a joint's angle.
    Sin(usize, usize),
    /// The cosine of the same.
    Cos(usize, usize),
    /// The travel of a prismatic joint.
    Value(usize),
    /// The torque on a joint of a unit weight at the end of a body.
    Torque(usize, usize),
}

/// A way times the product of its waves.
#[derive(Debug, Clone, PartialEq)]
pub struct BasisTerm {
    /// What its output moves.
    pub way: OutputMotion,
    /// Factors that are multiplied.
    pub waves: Vec<Wave>,
}

/// Orders of a curve that share one prior: slow parts are larger than fast ones.
const BANDS: [usize; 5] = [3, 12, 30, 60, 90];
/// Rows for every order of a joint's curve.
const ROWS_EACH: usize = 8;
/// Highest order of the harmonics along the tracker's axes.
const HARMONICS: usize = 3;

/// Ridge on harmonics: constants, three orders of every joint, and first orders of every two joints multiplied.
pub(crate) fn harmonics(prismatic: &[bool]) -> Vec<Vec<BasisTerm>> {
    let first = |joint: usize| match prismatic[joint] {
        true => vec![Wave::Value(joint)],
        false => vec![Wave::Sin(joint, 1), Wave::Cos(joint, 1)],
    };
    let joints = 0..prismatic.len();
    let mut groups = vec![vec![Vec::new()]];
    groups.push(
        joints
            .clone()
            .flat_map(first)
            .map(|wave| vec![wave])
            .collect(),
    );
    let higher = joints.clone().filter(|joint| !prismatic[*joint]);
    let higher = higher.flat_map(|joint| {
        (2..=HARMONICS).flat_map(move |k| [vec![Wave::Sin(joint, k)], vec![Wave::Cos(joint, k)]])
    });
    groups.push(higher.collect());
    let mut pairs = Vec::new();
    for a in joints.clone() {
        for b in a + 1..prismatic.len() {
            pairs.extend(
                first(a)
                    .into_iter()
                    .flat_map(|x| first(b).into_iter().map(move |y| vec![x, y])),
            );
        }
    }
    groups.push(pairs);
    let along = |waves: Vec<Wave>| {
        (0..3).map(move |axis| BasisTerm {
            way: OutputMotion::Along(axis),
            waves: waves.clone(),
        })
    };
    groups
        .into_iter()
        .map(|group| group.into_iter().flat_map(along).collect())
        .collect()
}

/// Joint curves as fine as `rows` can show, small motions of all stations, and wind-up by weight.
pub(crate) fn curves(arm: &ScrewArm, rows: usize) -> Vec<Vec<BasisTerm>> {
    let joints = arm.hinges.len();
    let single = |way: OutputMotion, wave: Wave| BasisTerm {
        way,
        waves: vec![wave],
    };
    let mut groups: Vec<Vec<BasisTerm>> = Vec::new();
    for (joint, hinge) in arm.hinges.iter().enumerate() {
        let mut low = 1;
        for high in BANDS {
            if hinge.slides || ROWS_EACH * high > rows.max(ROWS_EACH * BANDS[0]) {
                break;
            }
            let waves =
                (low..=high).flat_map(|order| [Wave::Sin(joint, order), Wave::Cos(joint, order)]);
            groups.push(
                waves
                    .map(|wave| single(OutputMotion::Turn(joint), wave))
                    .collect(),
            );
            low = high + 1;
        }
    }
    let rigid = (0..=joints).flat_map(|station| {
        (0..3).flat_map(move |axis| {
            [
                OutputMotion::Shift(station, axis),
                OutputMotion::Tilt(station, axis),
            ]
        })
    });
    groups.push(
        rigid
            .map(|way| BasisTerm {
                way,
                waves: Vec::new(),
            })
            .collect(),
    );
    let weights = (0..joints).flat_map(|joint| {
        (joint..joints)
            .map(move |body| single(OutputMotion::Turn(joint), Wave::Torque(joint, body)))
    });
    groups.push(weights.collect());
    groups
}

/// Terms at a posture, with the memory that this takes.
pub(crate) struct BasisFunctions<'a> {
    arm: Option<&'a ScrewArm>,
    terms: &'a [BasisTerm],
    /// Sines and cosines of the multiples of each joint's angle.
    multiples: Vec<Vec<[f64; 2]>>,
}

impl<'a> BasisFunctions<'a> {
    /// Terms over an arm; those that move joints need one.
    pub(crate) fn new(arm: Option<&'a ScrewArm>, terms: &'a [BasisTerm]) -> Self {
        let mut highest: Vec<usize> = Vec::new();
        for wave in terms.iter().flat_map(|term| &term.waves) {
            if let Wave::Sin(joint, order) | Wave::Cos(joint, order) = *wave {
                highest.resize(highest.len().max(joint + 1), 0);
                highest[joint] = highest[joint].max(order);
            }
        }
        Self {
            arm,
            terms,
            multiples: highest
                .into_iter()
                .map(|order| vec![[0.0, 1.0]; order + 1])
                .collect(),
        }
    }

    /// What each term does at joint positions `q`, m per unit of its coefficient. Terms through the arm are nothing without it.
    pub(crate) fn at(&mut self, q: &[f64], mut put: impl FnMut(usize, [f64; 3])) {
        for (multiples, q) in self.multiples.iter_mut().zip(q) {
            for (order, entry) in multiples.iter_mut().enumerate() {
                let (sin, cos) = (order as f64 * q).sin_cos();
                *entry = [sin, cos];
            }
        }
        let stance = self.arm.map(|arm| arm.stance(q));
        for (t, term) in self.terms.iter().enumerate() {
            let factor: f64 = term
                .waves
                .iter()
                .map(|wave| self.wave(*wave, q, stance.as_ref()))
                .product();
            let way = direction(term.way, stance.as_ref());
            put(t, way.map(|value| value * factor));
        }
    }

    fn wave(&self, wave: Wave, q: &[f64], stance: Option<&Stance>) -> f64 {
        match wave {
            Wave::Sin(joint, order) => self.multiples[joint][order][0],
            Wave::Cos(joint, order) => self.multiples[joint][order][1],
            Wave::Value(joint) => q[joint],
            Wave::Torque(joint, body) => stance.map_or(0.0, |stance| stance.torque(joint, body)),
        }
    }
}

fn direction(way: OutputMotion, stance: Option<&Stance>) -> [f64; 3] {
    match (way, stance) {
        (OutputMotion::Along(axis), _) => {
            std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 })
        }
        (_, None) => [0.0; 3],
        (OutputMotion::Turn(joint), Some(stance)) => stance.turn(joint).into(),
        (OutputMotion::Shift(station, axis), Some(stance)) => stance.shift(station, axis).into(),
        (OutputMotion::Tilt(station, axis), Some(stance)) => stance.tilt(station, axis).into(),
    }
}

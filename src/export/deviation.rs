//! By how much joints stand elsewhere than commanded, as an affine map of the commanded positions, and that map as a controller counts.

use crate::effect::Place;
use crate::robot::JointConvention;
use nalgebra::{DMatrix, DVector};

/// A share below this one of the largest is rounding.
const ROUNDING: f64 = 1e-12;

/// A number of the map; joints from 0.
#[derive(Debug, Clone, Copy)]
pub(super) enum DeviationEntry {
    /// What a joint's position is off at zero, rad or m.
    Zero(usize),
    /// How a joint moves more than commanded, of itself.
    Factor(usize),
    /// How it moves with another one.
    Coupling { by: usize, moved: usize },
}

impl DeviationEntry {
    /// All of so many joints: zeros, factors, couplings.
    pub fn all(joints: usize) -> impl Iterator<Item = Self> {
        let pairs = (0..joints).flat_map(move |by| (0..joints).map(move |moved| (by, moved)));
        let couplings = pairs
            .filter(|(by, moved)| by != moved)
            .map(|(by, moved)| Self::Coupling { by, moved });
        (0..joints)
            .map(Self::Zero)
            .chain((0..joints).map(Self::Factor))
            .chain(couplings)
    }

    /// The one that a parameter is; none of an effect that no such map holds.
    pub fn of(effect: &str, place: &str) -> Option<Self> {
        match (effect, place.parse()) {
            ("joint_offset", Ok(Place::Joint(joint))) => Some(Self::Zero(joint)),
            ("reduction_ratio", Ok(Place::Joint(joint))) => Some(Self::Factor(joint)),
            ("coupling_ratio", Ok(Place::Coupled(by, moved))) => Some(Self::Coupling { by, moved }),
            _ => None,
        }
    }

    pub fn place(self) -> Place {
        match self {
            Self::Zero(joint) | Self::Factor(joint) => Place::Joint(joint),
            Self::Coupling { by, moved } => Place::Coupled(by, moved),
        }
    }
}

/// q_true - q = slope q + zero, SI.
#[derive(Debug, Clone)]
pub(super) struct JointDeviation {
    slope: DMatrix<f64>,
    zero: DVector<f64>,
}

impl JointDeviation {
    /// One number of 1, all others 0, in the robot file's counting.
    pub fn unit(entry: DeviationEntry, joints: usize) -> Self {
        let mut out = Self {
            slope: DMatrix::zeros(joints, joints),
            zero: DVector::zeros(joints),
        };
        match entry {
            DeviationEntry::Zero(joint) => out.zero[joint] = 1.0,
            DeviationEntry::Factor(joint) => out.slope[(joint, joint)] = 1.0,
            DeviationEntry::Coupling { by, moved } => out.slope[(moved, by)] = 1.0,
        }
        out
    }

    pub fn at(&self, entry: DeviationEntry) -> f64 {
        match entry {
            DeviationEntry::Zero(joint) => self.zero[joint],
            DeviationEntry::Factor(joint) => self.slope[(joint, joint)],
            DeviationEntry::Coupling { by, moved } => self.slope[(moved, by)],
        }
    }

    /// Whether a number is more than rounding.
    pub fn holds(&self, entry: DeviationEntry) -> bool {
        self.at(entry).abs() > ROUNDING * self.slope.amax().max(self.zero.amax())
    }

    /// In the controller's numbers c: with q = A (c - z), c_true - c = B slope A (c - z) + B zero, B the inverse of A.
    pub fn counted(&self, convention: &JointConvention) -> Self {
        let shown = DVector::from_column_slice(convention.zero());
        let joints = shown.len();
        let matrix = |change: &dyn Fn(&mut DVector<f64>)| {
            let columns: Vec<DVector<f64>> = (0..joints)
                .map(|joint| {
                    let mut unit = DVector::zeros(joints);
                    unit[joint] = 1.0;
                    change(&mut unit);
                    unit
                })
                .collect();
            DMatrix::from_columns(&columns)
        };
        let to_robot = matrix(&|unit| {
            *unit += &shown;
            convention.to_robot(unit.as_mut_slice());
        });
        let back = matrix(&|unit| {
            convention.to_controller(unit.as_mut_slice());
            *unit -= &shown;
        });
        let slope = &back * &self.slope * to_robot;
        let zero = back * &self.zero - &slope * shown;
        Self { slope, zero }
    }
}

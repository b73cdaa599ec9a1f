//! A declaration understood: what moves where by which formulas, in units; or everything that is wrong with it.

use super::check::{DeclarationFault, DeclarationFaults};
use super::declaration::{EffectDeclaration, ShapeRange};
use super::formula::{Formula, Function};
use super::seat::{Moves, Seat};
use crate::effect::motion::{SHORT, extent};
use crate::effect::{Motion, NumberSpec, Place, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;

/// What a declaration means.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredPattern {
    pub(crate) seat: Seat,
    pub(crate) moves: Moves,
    pub(crate) laws: Vec<Formula>,
    /// Names of the shape numbers, in the order of their positions.
    pub(crate) names: Vec<String>,
    pub(crate) shape: Vec<ShapeRange>,
    /// Unit of the coefficients, where it is stated.
    pub(crate) unit: Option<Unit>,
    /// The usual size of a coefficient, SI, where it is stated.
    pub(crate) size: Option<f64>,
}

/// Known beforehand of a coefficient of no stated size, SI; and of one of a stated size in multiples of it.
const WIDE: f64 = 0.01;
const WIDER: f64 = 20.0;

impl DeclaredPattern {
    /// Understands a declaration; fails with every fault.
    pub fn of(declaration: &EffectDeclaration) -> Result<Self, Vec<DeclarationFault>> {
        let mut faults = DeclarationFaults::default();
        faults.name(&declaration.name);
        let seat = faults.seat(&declaration.place);
        let moves = seat.and_then(|seat| faults.moves(seat, declaration.motion.as_deref()));
        let names: Vec<String> = declaration.shape.keys().cloned().collect();
        faults.shape(declaration);
        let laws = faults.laws(declaration, &names);
        let unit = moves.and_then(|moves| faults.unit(moves, declaration.unit.as_deref()));
        if let Some(size) = declaration.size.filter(|size| *size <= 0.0) {
            faults.add(
                "size",
                format!("expected the usual size of a coefficient, more than 0; found {size}"),
            );
        }
        if let (Some(seat), Some(moves)) = (seat, moves) {
            faults.agreement(seat, moves, &laws);
        }
        if let Some(sentence) = &declaration.sentence {
            faults.sentence(sentence, &names);
        }
        match (faults.0.is_empty(), seat, moves) {
            (true, Some(seat), Some(moves)) => Ok(Self {
                seat,
                moves,
                laws,
                shape: declaration.shape.values().cloned().collect(),
                names,
                unit,
                size: declaration
                    .size
                    .map(|size| unit.or(moves.unit()).map_or(size, |unit| unit.to_si(size))),
            }),
            _ => Err(faults.0),
        }
    }

    /// Whether a law jumps, so that what is left has no curvature by its shape numbers.
    pub fn jumps(&self) -> bool {
        let mut found = false;
        let jump =
            |part: &Formula| matches!(part, Formula::Call(Function::Step | Function::Sign, _));
        self.laws
            .iter()
            .for_each(|law| law.walk(&mut |part| found |= jump(part)));
        found
    }

    /// Where it may act on an arm.
    pub(crate) fn motions(&self, survey: &Survey) -> Vec<Motion> {
        let joints = survey.joints();
        let one = |place: Place| self.moves.at(place);
        match self.seat {
            Seat::AnyJoint => survey
                .revolute()
                .filter_map(|joint| one(Place::Joint(joint)))
                .collect(),
            Seat::AnyLink => {
                let long = |link: &usize| extent(survey.robot, *link).norm() > SHORT;
                (0..joints.saturating_sub(1))
                    .filter(long)
                    .filter_map(|link| one(Place::Links(link, link)))
                    .collect()
            }
            Seat::Fixed(Place::Joint(joint)) if joint >= joints => Vec::new(),
            Seat::Fixed(Place::Links(_, last)) if last >= joints => Vec::new(),
            Seat::Fixed(place) => one(place).into_iter().collect(),
        }
    }

    /// All combinations of starts.
    pub(crate) fn starts(&self) -> Vec<Vec<f64>> {
        let each = self
            .shape
            .iter()
            .map(|range| range.starts(self.shape.len()));
        each.fold(vec![Vec::new()], |all, starts| {
            let with =
                |begun: &Vec<f64>, start: &f64| begun.iter().copied().chain([*start]).collect();
            all.iter()
                .flat_map(|begun| starts.iter().map(move |start| with(begun, start)))
                .collect()
        })
    }

    /// The coefficients at a place.
    pub(crate) fn numbers(&self, motion: Motion, robot: &RobotModel) -> Vec<NumberSpec> {
        let many = self.laws.len() > 1;
        let counted = |k: usize| {
            if many {
                (k + 1).to_string()
            } else {
                String::new()
            }
        };
        let sigma = self.size.map_or(WIDE, |size| WIDER * size);
        let of_frame = |k: usize| motion.frame_numbers(move |axis| format!("{axis}{}", counted(k)));
        let unit = self.unit.unwrap_or_else(|| motion.unit(robot));
        let unit = if self.unit.is_none() && self.moves == Moves::Growth {
            Unit::One
        } else {
            unit
        };
        let plain = |name: String| (name, unit, sigma);
        match self.moves {
            Moves::Frame(_) => {
                let all = (0..self.laws.len()).flat_map(of_frame);
                all.map(|(name, given, _)| (name, self.unit.unwrap_or(given), sigma))
                    .collect()
            }
            Moves::Axis { .. } => {
                let sides = robot.normals(motion_joint(motion)).len();
                let names = ["across", "along"].into_iter().take(sides);
                names
                    .flat_map(|side| {
                        (0..self.laws.len()).map(move |k| plain(format!("{side}{}", counted(k))))
                    })
                    .collect()
            }
            _ => (0..self.laws.len())
                .map(|k| {
                    plain(if many {
                        format!("c{}", k + 1)
                    } else {
                        String::new()
                    })
                })
                .collect(),
        }
    }
}

fn motion_joint(motion: Motion) -> usize {
    match motion {
        Motion::Joint { joint } | Motion::Axis { joint, .. } => joint,
        _ => 0,
    }
}

//! A declaration understood: where it acts, what moves there by which formulas, in units; or everything that is wrong with it, all at once.

use super::declaration::{EffectDeclaration, ShapeRange};
use super::formula::{Formula, Function, parse};
use super::quantity::{Constant, RowQuantity};
use crate::effect::motion::{SHORT, extent};
use crate::effect::sentence::holes;
use crate::effect::{Axes, AxisPoint, Motion, NumberSpec, Place, Polar, Survey, Variable, cause};
use crate::error::nearest;
use crate::robot::RobotModel;
use crate::units::{Quantity, Unit};

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
        let jump =
            |part: &Formula| matches!(part, Formula::Call(Function::Step | Function::Sign, _));
        self.laws.iter().any(|law| law.any(jump))
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
        combinations(
            self.shape
                .iter()
                .map(|range| range.starts(self.shape.len())),
        )
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
        let usual = match self.moves {
            Moves::Growth => Unit::One,
            _ => motion.unit(robot),
        };
        let unit = self.unit.unwrap_or(usual);
        let plain = |name: String| (name, unit, sigma);
        match self.moves {
            Moves::Frame(_) => {
                let all = (0..self.laws.len()).flat_map(of_frame);
                all.map(|(name, given, _)| (name, self.unit.unwrap_or(given), sigma))
                    .collect()
            }
            Moves::Axis { .. } => {
                let names = ["across", "along"].into_iter();
                names
                    .flat_map(|side| {
                        (0..self.laws.len()).map(move |k| plain(format!("{side}{}", counted(k))))
                    })
                    .collect()
            }
            _ if many => (1..=self.laws.len())
                .map(|k| plain(format!("c{k}")))
                .collect(),
            _ => vec![plain(String::new())],
        }
    }
}

/// All combinations of a number of each of some lists.
pub(super) fn combinations(lists: impl Iterator<Item = Vec<f64>>) -> Vec<Vec<f64>> {
    lists.fold(vec![Vec::new()], |all, list| {
        let with = |begun: &Vec<f64>, one: &f64| begun.iter().copied().chain([*one]).collect();
        all.iter()
            .flat_map(|begun| list.iter().map(move |one| with(begun, one)))
            .collect()
    })
}

/// Where it may act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seat {
    /// At one of the joints that turn.
    AnyJoint,
    /// At a link that has a length.
    AnyLink,
    Fixed(Place),
}

/// What moves there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moves {
    Angle,
    Axis { turning: bool },
    Growth,
    Frame(Axes),
    Reading(Polar),
}

/// Motions of each kind of place; the first is the usual one.
const OF_JOINTS: [(&str, Moves); 3] = [
    ("angle", Moves::Angle),
    ("axis", Moves::Axis { turning: false }),
    ("turning_axis", Moves::Axis { turning: true }),
];
const OF_LINKS: [(&str, Moves); 1] = [("growth", Moves::Growth)];
const OF_FRAMES: [(&str, Moves); 3] = [
    ("displacement", Moves::Frame(Axes::Place)),
    ("rotation", Moves::Frame(Axes::Rotation)),
    ("both", Moves::Frame(Axes::Both)),
];
const OF_TRACKERS: [(&str, Moves); 6] = [
    ("displacement", Moves::Frame(Axes::Place)),
    ("rotation", Moves::Frame(Axes::Rotation)),
    ("both", Moves::Frame(Axes::Both)),
    ("azimuth", Moves::Reading(Polar::Azimuth)),
    ("elevation", Moves::Reading(Polar::Elevation)),
    ("range", Moves::Reading(Polar::Range)),
];
const PLACES: &str = "joint, joint 3, link, link 2, link 2-4, base, tool, tracker";

impl Seat {
    /// The place of these words.
    fn read(text: &str) -> Option<Self> {
        Some(match text {
            "joint" => Self::AnyJoint,
            "link" => Self::AnyLink,
            "base" => Self::Fixed(Place::Base),
            "tool" => Self::Fixed(Place::Tool),
            "tracker" => Self::Fixed(Place::Tracker),
            other => match other.parse().ok()? {
                place @ Place::Joint(_) if other.starts_with("joint ") => Self::Fixed(place),
                place @ Place::Links(first, last)
                    if other.starts_with("link ") && first <= last =>
                {
                    Self::Fixed(place)
                }
                _ => return None,
            },
        })
    }

    /// What may move there; the first is the usual one.
    fn allowed(self) -> &'static [(&'static str, Moves)] {
        match self {
            Self::AnyJoint | Self::Fixed(Place::Joint(_)) => &OF_JOINTS,
            Self::AnyLink | Self::Fixed(Place::Links(..)) => &OF_LINKS,
            Self::Fixed(Place::Tracker) => &OF_TRACKERS,
            Self::Fixed(_) => &OF_FRAMES,
        }
    }

    fn is_joint(self) -> bool {
        matches!(self, Self::AnyJoint | Self::Fixed(Place::Joint(_)))
    }
}

impl Moves {
    pub(crate) fn at(self, place: Place) -> Option<Motion> {
        Some(match (self, place) {
            (Self::Angle, Place::Joint(joint)) => Motion::Joint { joint },
            (Self::Axis { turning }, Place::Joint(joint)) => Motion::Axis {
                joint,
                about: None,
                turning,
                at: AxisPoint::Own,
            },
            (Self::Growth, Place::Links(first, last)) => Motion::Links { first, last },
            (Self::Frame(axes), Place::Base) => Motion::Base { axes },
            (Self::Frame(axes), Place::Tool) => Motion::Tool { axes },
            (Self::Frame(axes), Place::Tracker) => Motion::Tracker { axes },
            (Self::Reading(reading), Place::Tracker) => Motion::Instrument { reading },
            _ => return None,
        })
    }

    /// The unit that coefficients have where none is stated; none where they have several.
    fn unit(self) -> Option<Unit> {
        Some(match self {
            Self::Angle | Self::Axis { .. } | Self::Frame(Axes::Rotation) => Unit::Radian,
            Self::Reading(Polar::Azimuth | Polar::Elevation) => Unit::Radian,
            Self::Frame(Axes::Place) | Self::Reading(Polar::Range) => Unit::Millimetre,
            Self::Growth => Unit::One,
            Self::Frame(Axes::Both) => return None,
        })
    }

    /// What a coefficient may be in.
    fn quantities(self) -> &'static [Quantity] {
        use Quantity::*;
        match self {
            Self::Angle => &[
                Angle,
                Length,
                Number,
                Compliance,
                CurrentCompliance,
                Trailing,
            ],
            Self::Axis { .. } | Self::Frame(Axes::Rotation) => {
                &[Angle, Number, Compliance, CurrentCompliance]
            }
            Self::Reading(Polar::Azimuth | Polar::Elevation) => &[Angle, Number],
            Self::Frame(Axes::Place) | Self::Reading(Polar::Range) => &[Length, Number],
            Self::Growth => &[Number],
            Self::Frame(Axes::Both) => &[],
        }
    }
}

/// What is wrong, and the path of it below the declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeclarationFault {
    /// E.g. `laws[0].formula`.
    pub path: String,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// Longest name and formula.
const NAME: usize = 48;
const FORMULA: usize = 400;
/// Most formulas, shape numbers, and starts of all shape numbers together.
const LAWS: usize = 12;
const SHAPE: usize = 3;
const STARTS: usize = 200;
/// The faults found so far.
#[derive(Default)]
pub(super) struct DeclarationFaults(Vec<DeclarationFault>);

impl DeclarationFaults {
    /// Fails with the faults so far, where there are any.
    pub(super) fn none(self) -> Result<(), Vec<DeclarationFault>> {
        match self.0.is_empty() {
            true => Ok(()),
            false => Err(self.0),
        }
    }

    pub(super) fn add(&mut self, path: impl Into<String>, message: impl Into<String>) {
        self.0.push(DeclarationFault {
            path: path.into(),
            message: message.into(),
        });
    }

    pub(super) fn name(&mut self, name: &str) {
        if cause(name).is_some() {
            self.add(
                "name",
                format!("`{name}` is an effect of calib's own library; give yours another name"),
            );
        } else if !is_snake(name) {
            let message = format!(
                "expected lower snake case, at most {NAME} letters, e.g. worn_tooth; found `{name}`"
            );
            self.add("name", message);
        }
    }

    pub(super) fn seat(&mut self, place: &str) -> Option<Seat> {
        let seat = Seat::read(place);
        if seat.is_none() {
            self.add(
                "place",
                format!("`{place}` is no place of an effect; allowed: {PLACES}"),
            );
        }
        seat
    }

    fn moves(&mut self, seat: Seat, motion: Option<&str>) -> Option<Moves> {
        let allowed = seat.allowed();
        let Some(motion) = motion else {
            return Some(allowed[0].1);
        };
        let found = allowed
            .iter()
            .find(|(name, _)| *name == motion)
            .map(|(_, moves)| *moves);
        if found.is_none() {
            let names = allowed
                .iter()
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
                .join(", ");
            self.add(
                "motion",
                format!("`{motion}` is no motion of this place; allowed: {names}"),
            );
        }
        found
    }

    pub(super) fn shape(&mut self, declaration: &EffectDeclaration) {
        if declaration.shape.len() > SHAPE {
            self.add(
                "shape",
                format!(
                    "{} shape numbers; expected at most {SHAPE}",
                    declaration.shape.len()
                ),
            );
        }
        let mut starts = 1;
        for (name, range) in &declaration.shape {
            let path = format!("shape.{name}");
            let taken = RowQuantity::named(name).is_some()
                || Function::NAMED.iter().any(|(known, _)| known == name);
            if taken || ["pi", "place", "value", "values"].contains(&name.as_str()) {
                self.add(&path, format!("`{name}` has a meaning of its own in formulas or sentences; give it another name"));
            } else if !is_snake(name) {
                self.add(
                    &path,
                    format!("expected a name in lower snake case, e.g. t0; found `{name}`"),
                );
            }
            if range.from >= range.to {
                self.add(
                    &path,
                    format!(
                        "expected `from` below `to`; found {} and {}",
                        range.from, range.to
                    ),
                );
            }
            for start in range
                .start
                .0
                .iter()
                .filter(|start| !(range.from..=range.to).contains(*start))
            {
                self.add(
                    format!("{path}.start"),
                    format!("{start} lies outside {} to {}", range.from, range.to),
                );
            }
            starts *= range.starts(declaration.shape.len()).len();
        }
        if starts > STARTS {
            self.add(
                "shape",
                format!("{starts} combinations of starts; expected at most {STARTS}"),
            );
        }
    }

    pub(super) fn laws(
        &mut self,
        declaration: &EffectDeclaration,
        names: &[String],
    ) -> Vec<Formula> {
        let texts = &declaration.law.0;
        if texts.is_empty() || texts.len() > LAWS {
            self.add(
                "law",
                format!("expected 1 to {LAWS} formulas; found {}", texts.len()),
            );
        }
        let mut laws = Vec::new();
        for (k, text) in texts.iter().take(LAWS).enumerate() {
            let path = law_path(k, texts.len());
            if text.len() > FORMULA {
                self.add(
                    path,
                    format!(
                        "{} letters; expected a formula of at most {FORMULA}",
                        text.len()
                    ),
                );
                continue;
            }
            match parse(text, names) {
                Ok(formula) => laws.push(formula),
                Err(fault) => self.add(
                    path,
                    format!("`{text}`, character {}: {}", fault.at, fault.message),
                ),
            }
        }
        for name in names.iter().filter(|_| laws.len() == texts.len()) {
            let uses = laws.iter().any(|law| uses(law, names, name));
            if !uses {
                self.add(format!("shape.{name}"), "no formula has it".to_string());
            }
        }
        laws
    }

    fn unit(&mut self, moves: Moves, unit: Option<&str>) -> Option<Unit> {
        let unit = unit?;
        let allowed: Vec<&str> = moves
            .quantities()
            .iter()
            .flat_map(|quantity| Unit::symbols(*quantity))
            .collect();
        let found = Unit::parse(unit).filter(|_| allowed.contains(&unit));
        if found.is_none() {
            let allowed = if allowed.is_empty() {
                "none, since it has mm and rad".into()
            } else {
                allowed.join(", ")
            };
            self.add(
                "unit",
                format!("`{unit}` is no unit of this motion; allowed: {allowed}"),
            );
        }
        found
    }

    /// Whether the formulas ask for what there is at the place.
    fn agreement(&mut self, seat: Seat, moves: Moves, laws: &[Formula]) {
        let jointed = seat.is_joint();
        let read = matches!(moves, Moves::Reading(_));
        for (k, quantity) in laws
            .iter()
            .enumerate()
            .flat_map(|(k, law)| law.quantities().into_iter().map(move |named| (k, named)))
        {
            let path = law_path(k, laws.len());
            let name = quantity.text(&[]);
            let variable = quantity.asked.1;
            let sighted = matches!(
                variable,
                Variable::Azimuth | Variable::Elevation | Variable::Range
            );
            let hanging = variable.needs_torque();
            if quantity.is_relative() && !jointed {
                let bare = name.trim_end_matches("_next").trim_end_matches("_before");
                self.add(path, format!("`{name}` is of the joint at which an effect acts; here say which joint, e.g. {bare}2"));
            } else if sighted && !read {
                self.add(
                    path,
                    format!(
                        "`{name}` is there for the tracker's azimuth, elevation and range alone"
                    ),
                );
            } else if hanging && read {
                self.add(
                    path,
                    format!("`{name}` does nothing to what an instrument reads"),
                );
            }
        }
    }

    pub(super) fn sentence(&mut self, sentence: &str, names: &[String]) {
        let words = || {
            ["place", "value", "values"]
                .into_iter()
                .chain(names.iter().map(String::as_str))
        };
        for word in holes(sentence) {
            match word {
                Some(word) if words().any(|known| known == word) => (),
                Some(word) => {
                    let near = nearest(word, words())
                        .map(|near| format!("; did you mean `{{{near}}}`?"))
                        .unwrap_or_else(|| ".".into());
                    let allowed = words()
                        .map(|word| format!("{{{word}}}"))
                        .collect::<Vec<_>>()
                        .join(", ");
                    self.add(
                        "sentence",
                        format!("unknown placeholder `{{{word}}}`{near} Allowed: {allowed}"),
                    );
                }
                None => self.add("sentence", "a `{` without its `}`".to_string()),
            }
        }
    }
}

pub(super) fn law_path(k: usize, laws: usize) -> String {
    if laws == 1 {
        "law".into()
    } else {
        format!("law[{k}]")
    }
}

fn uses(law: &Formula, names: &[String], name: &str) -> bool {
    law.any(|part| match part {
        Formula::Shape(k)
        | Formula::Row(RowQuantity {
            constant: Some(Constant::Shape(k)),
            ..
        }) => names[*k] == name,
        _ => false,
    })
}

fn is_snake(name: &str) -> bool {
    let inside =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_';
    name.len() <= NAME
        && name.starts_with(|letter: char| letter.is_ascii_lowercase())
        && name.chars().all(inside)
}

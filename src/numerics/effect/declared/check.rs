//! What may be wrong with a declaration, all of it at once.

use super::declaration::EffectDeclaration;
use super::formula::{Formula, Function};
use super::parse::parse;
use super::quantity::{Constant, RowQuantity};
use super::seat::{Moves, PLACES, Seat};
use crate::effect::sentence::holes;
use crate::effect::{Variable, cause};
use crate::error::nearest;
use crate::units::Unit;

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
pub(crate) struct DeclarationFaults(pub Vec<DeclarationFault>);

impl DeclarationFaults {
    pub(crate) fn add(&mut self, path: impl Into<String>, message: impl Into<String>) {
        self.0.push(DeclarationFault {
            path: path.into(),
            message: message.into(),
        });
    }

    pub(crate) fn name(&mut self, name: &str) {
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

    pub(crate) fn seat(&mut self, place: &str) -> Option<Seat> {
        let seat = Seat::read(place);
        if seat.is_none() {
            self.add(
                "place",
                format!("`{place}` is no place of an effect; allowed: {PLACES}"),
            );
        }
        seat
    }

    pub(crate) fn moves(&mut self, seat: Seat, motion: Option<&str>) -> Option<Moves> {
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

    pub(crate) fn shape(&mut self, declaration: &EffectDeclaration) {
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

    pub(crate) fn laws(
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
            let path = if texts.len() == 1 {
                "law".into()
            } else {
                format!("law[{k}]")
            };
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

    pub(crate) fn unit(&mut self, moves: Moves, unit: Option<&str>) -> Option<Unit> {
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
    pub(crate) fn agreement(&mut self, seat: Seat, moves: Moves, laws: &[Formula]) {
        let jointed = seat.is_joint();
        let read = matches!(moves, Moves::Reading(_));
        for (k, quantity) in laws
            .iter()
            .enumerate()
            .flat_map(|(k, law)| law.quantities().into_iter().map(move |named| (k, named)))
        {
            let path = if laws.len() == 1 {
                "law".into()
            } else {
                format!("law[{k}]")
            };
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

    pub(crate) fn sentence(&mut self, sentence: &str, names: &[String]) {
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

fn uses(law: &Formula, names: &[String], name: &str) -> bool {
    let mut found = false;
    law.walk(&mut |part| {
        found |= match part {
            Formula::Shape(k) => names[*k] == name,
            Formula::Row(RowQuantity {
                constant: Some(Constant::Shape(k)),
                ..
            }) => names[*k] == name,
            _ => false,
        }
    });
    found
}

fn is_snake(name: &str) -> bool {
    let inside =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_';
    name.len() <= NAME
        && name.starts_with(|letter: char| letter.is_ascii_lowercase())
        && name.chars().all(inside)
}

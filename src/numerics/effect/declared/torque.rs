//! A law of torque at a joint that a user declares: formulas of its angle, velocity and load, of temperature and time.

use super::declaration::{EffectDeclaration, ShapeRange};
use super::formula::Formula;
use super::pattern::{DeclarationFault, DeclarationFaults, Seat, combinations, law_path};
use crate::effect::sentence::filled;
use crate::effect::{Place, Variable, figure};

/// What a torque is called where a declaration says what moves.
const MOTION: &str = "torque";
/// The unit of its coefficients.
const UNIT: &str = "Nm";
/// What its formulas may ask of a row.
const ASKED: &str = "q, velocity, load of this joint, of joint 3 as q3, of a neighbour as q_next or q_before; temperature, time";

/// A law of torque at a joint, Nm per coefficient; each formula has one.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredTorque {
    declaration: EffectDeclaration,
    laws: Vec<Formula>,
    /// From 0; any where there is none.
    joint: Option<usize>,
}

impl DeclaredTorque {
    /// The law that is declared. Fails with everything that is wrong with it.
    pub fn of(declaration: &EffectDeclaration) -> Result<Self, Vec<DeclarationFault>> {
        let mut faults = DeclarationFaults::default();
        faults.name(&declaration.name);
        let names: Vec<String> = declaration.shape.keys().cloned().collect();
        faults.shape(declaration);
        let laws = faults.laws(declaration, &names);
        let joint = match faults.seat(&declaration.place) {
            Some(Seat::AnyJoint) | None => None,
            Some(Seat::Fixed(Place::Joint(joint))) => Some(joint),
            Some(_) => {
                let message = format!(
                    "a torque acts at a joint; found `{}`; allowed: joint, joint 3",
                    declaration.place
                );
                faults.add("place", message);
                None
            }
        };
        let words = [
            ("motion", &declaration.motion, MOTION),
            ("unit", &declaration.unit, UNIT),
        ];
        for (path, word, allowed) in words {
            if let Some(word) = word.as_ref().filter(|word| *word != allowed) {
                let message =
                    format!("`{word}` is none of a torque; allowed: {allowed}, or leave it out");
                faults.add(path, message);
            }
        }
        if declaration.size.is_some() {
            let message = "the usual size of a torque is taken from the recording; leave it out";
            faults.add("size", message);
        }
        for (k, law) in laws.iter().enumerate() {
            for quantity in law.quantities() {
                if !is_known(quantity.asked.1) {
                    let message = format!(
                        "`{}` is not known of rows of torques; allowed: {ASKED}",
                        quantity.text(&names)
                    );
                    faults.add(law_path(k, laws.len()), message);
                }
            }
        }
        if let Some(sentence) = &declaration.sentence {
            faults.sentence(sentence, &names);
        }
        faults.none()?;
        Ok(Self {
            declaration: declaration.clone(),
            laws,
            joint,
        })
    }

    /// What the user wrote.
    pub fn declaration(&self) -> &EffectDeclaration {
        &self.declaration
    }

    /// Number of coefficients.
    pub fn laws(&self) -> usize {
        self.laws.len()
    }

    /// Joints (from 0) of an arm of so many at which it may act.
    pub fn joints(&self, joints: usize) -> Vec<usize> {
        let may = |joint: &usize| self.joint.is_none_or(|one| one == *joint);
        (0..joints).filter(may).collect()
    }

    /// Shape numbers at which a search starts.
    pub fn starts(&self) -> Vec<Vec<f64>> {
        let ranges = self.declaration.shape.values();
        let count = self.declaration.shape.len();
        combinations(ranges.map(|range| range.starts(count)))
    }

    /// Its shape numbers with their names, in the order in which they stand.
    pub fn shape(&self) -> impl Iterator<Item = (&str, &ShapeRange)> {
        let shape = self.declaration.shape.iter();
        shape.map(|(name, range)| (name.as_str(), range))
    }

    /// What its formulas ask for at a joint of an arm of so many, the first first; none where a joint is missing.
    pub fn variables(&self, joint: usize, joints: usize) -> Option<Vec<Variable>> {
        let quantities = self.laws.iter().flat_map(Formula::quantities);
        quantities
            .map(|quantity| quantity.variable(Some(joint), joints, &[]))
            .collect()
    }

    /// Whether a formula asks for a load.
    pub fn asks_load(&self) -> bool {
        self.asks(|variable| matches!(variable, Variable::Load { .. }))
    }

    /// Whether a formula asks for time.
    pub fn asks_time(&self) -> bool {
        self.asks(|variable| matches!(variable, Variable::Time))
    }

    fn asks(&self, is_it: fn(&Variable) -> bool) -> bool {
        let asks =
            |part: &Formula| matches!(part, Formula::Row(quantity) if is_it(&quantity.asked.1));
        self.laws.iter().any(|law| law.any(asks))
    }

    /// The value of a formula (from 0) for a joint, given the number of joints and the variables of a row; `None` where it is no number.
    pub fn value(
        &self,
        law: usize,
        shape: &[f64],
        (joint, joints): (usize, usize),
        row: &dyn Fn(Variable) -> Option<f64>,
    ) -> Option<f64> {
        let value = self.laws[law].value(shape, &|quantity| {
            row(quantity.variable(Some(joint), joints, shape)?)
        });
        value.filter(|value| value.is_finite())
    }

    /// A finding in a sentence, without a full stop: at a place, by coefficients in a unit and shape numbers.
    pub fn statement(&self, place: Place, values: &[f64], shape: &[f64], unit: &str) -> String {
        let per = self.declaration.per.as_ref();
        let per = per.map_or(String::new(), |per| format!(" per {per}"));
        let number = |value: &f64| format!("{} {unit}{per}", figure(*value, 2));
        let numbers: Vec<String> = values.iter().map(number).collect();
        let known = |word: &str| match word {
            "place" => place.to_string(),
            "value" => numbers.first().cloned().unwrap_or_default(),
            "values" => numbers.join(", "),
            other => {
                let mut named = self.shape().zip(shape);
                let found = named.find(|((name, _), _)| *name == other);
                found.map_or_else(String::new, |(_, value)| figure(*value, 2))
            }
        };
        match &self.declaration.sentence {
            Some(sentence) => filled(sentence, &known),
            None => format!(
                "{place} has the torque that {} says, {}: {}",
                self.declaration.name,
                self.declaration.law.0.join("; "),
                numbers.join(", ")
            ),
        }
    }
}

/// Whether rows of torques say it.
fn is_known(variable: Variable) -> bool {
    use Variable as V;
    matches!(
        variable,
        V::Angle { .. } | V::Velocity { .. } | V::Load { .. } | V::Temperature | V::Time
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Laws;

    fn declared(law: &str) -> EffectDeclaration {
        EffectDeclaration {
            name: "seal_drag".into(),
            place: "joint 2".into(),
            law: Laws(vec![law.into()]),
            ..EffectDeclaration::default()
        }
    }

    #[test]
    fn a_law_of_torque_is_read_and_asks_its_row() {
        let law = DeclaredTorque::of(&declared("velocity^3 + q1")).expect("a law");
        let row = |variable| match variable {
            Variable::Velocity { joint: 1 } => Some(2.0),
            Variable::Angle { joint: 0 } => Some(0.5),
            _ => None,
        };
        assert_eq!(law.joints(6), [1]);
        assert_eq!(law.value(0, &[], (1, 6), &row), Some(8.5));
        let said = law.statement(Place::Joint(1), &[0.25], &[], "Nm");
        assert!(said.starts_with("joint 2 has the torque that seal_drag says"));
    }

    #[test]
    fn all_that_is_wrong_with_it_is_said_at_once() {
        let wrong = EffectDeclaration {
            place: "tool".into(),
            unit: Some("mm".into()),
            motion: Some("axis".into()),
            size: Some(1.0),
            ..declared("elevation")
        };
        let faults = DeclaredTorque::of(&wrong).expect_err("faults");
        let paths: Vec<&str> = faults.iter().map(|fault| fault.path.as_str()).collect();
        assert_eq!(paths, ["place", "motion", "unit", "size", "law"]);
    }
}

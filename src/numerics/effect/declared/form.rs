//! A declared effect at a place with its shape numbers; it carries its declaration wherever it is kept.

use super::cause::DeclaredCause;
use super::declaration::{EffectDeclaration, ShapeRange};
use super::formula::Formula;
use super::quantity::RowQuantity;
use crate::effect::{
    ArmState, Cause, Deflection, Form, Hypothesis, Motion, NumberSpec, Place, Placed, Survey,
    Variable,
};
use crate::robot::{Measurements, RobotModel};
use serde::de::Error as _;
use serde::{Deserialize, Serialize};

/// The laws of a declaration at one place.
#[derive(Clone)]
pub struct DeclaredForm {
    cause: &'static DeclaredCause,
    motion: Motion,
    shape: Vec<f64>,
}

/// What a table of parameters keeps of it beside its name.
#[derive(Serialize, Deserialize)]
struct KeptForm {
    declared: EffectDeclaration,
    motion: Motion,
    shape: Vec<f64>,
}

impl DeclaredForm {
    /// Every hypothesis of a declaration that the recording can speak of.
    pub fn hypotheses(cause: &'static DeclaredCause, survey: &Survey) -> Vec<Hypothesis> {
        if Self::lacking(cause, survey).is_some() {
            return Vec::new();
        }
        let pattern = cause.pattern();
        let starts = pattern.starts();
        // Shape numbers are fitted, too: as much as so many numbers in the criterion.
        let values = 3.0 * survey.rows.len() as f64;
        let tried = starts
            .len()
            .max(libm::pow(values, 0.5 * pattern.shape.len() as f64) as usize);
        let mut out = Vec::new();
        for motion in pattern.motions(survey) {
            for shape in &starts {
                let form = Self {
                    cause,
                    motion,
                    shape: shape.clone(),
                };
                if form
                    .quantities()
                    .iter()
                    .all(|quantity| form.variable(quantity, survey.joints()).is_some())
                {
                    let hypothesis = Hypothesis::new(form, tried);
                    out.push(if cause.declaration().positive {
                        hypothesis.positive()
                    } else {
                        hypothesis
                    });
                }
            }
        }
        out
    }

    /// The column that the recording lacks for a declaration, if any.
    pub fn lacking(cause: &DeclaredCause, survey: &Survey) -> Option<&'static str> {
        let there = |quantity: &RowQuantity| match quantity.asked.1 {
            Variable::Current { .. } => survey.data.current.is_some(),
            Variable::Velocity { .. } => survey.data.velocity.is_some(),
            Variable::Temperature | Variable::Lagging { .. } => survey.reference_c.is_some(),
            Variable::Circumstance { column, .. } => {
                survey.data.circumstances.contains_key(column.text())
            }
            _ => true,
        };
        let quantities = cause.pattern().laws.iter().flat_map(Formula::quantities);
        quantities
            .filter(|quantity| !there(quantity))
            .find_map(|quantity| quantity.needs())
    }

    /// Reads what [`Placed::body`] wrote under a name.
    pub fn read(name: &str, body: serde_json::Value) -> serde_json::Result<Form> {
        if body.get("declared").is_none() {
            return Err(serde_json::Error::custom(format!("no cause `{name}`")));
        }
        let KeptForm {
            declared,
            motion,
            shape,
        } = serde_json::from_value(body)?;
        let cause = DeclaredCause::of(&declared).map_err(|faults| {
            let faults: Vec<String> = faults
                .into_iter()
                .map(|fault| format!("{}: {}", fault.path, fault.message))
                .collect();
            serde_json::Error::custom(format!(
                "the declaration of `{name}`: {}",
                faults.join("; ")
            ))
        })?;
        let pattern = cause.pattern();
        if declared.name != name
            || shape.len() != pattern.shape.len()
            || pattern.moves.at(motion.place()) != Some(motion)
        {
            return Err(serde_json::Error::custom(format!(
                "`{name}` is not as it was declared"
            )));
        }
        Ok(Self {
            cause,
            motion,
            shape,
        }
        .into())
    }

    /// Its cause, as it was declared.
    pub fn declaration(&self) -> &'static DeclaredCause {
        self.cause
    }

    fn quantities(&self) -> Vec<RowQuantity> {
        let mut out: Vec<RowQuantity> = Vec::new();
        for quantity in self
            .cause
            .pattern()
            .laws
            .iter()
            .flat_map(Formula::quantities)
        {
            if !out.contains(&quantity) {
                out.push(quantity);
            }
        }
        out
    }

    fn variable(&self, quantity: &RowQuantity, joints: usize) -> Option<Variable> {
        let joint = match self.motion {
            Motion::Joint { joint } | Motion::Axis { joint, .. } => Some(joint),
            _ => None,
        };
        quantity.variable(joint, joints, &self.shape)
    }

    /// Small steps of its shape numbers, by a share of their ranges, or of themselves where these go in ratios.
    pub fn shape_steps(&self, share: f64) -> Vec<f64> {
        let step = |(value, range): (&f64, &ShapeRange)| match range.is_of_ratios() {
            true => share * value,
            false => share * (range.to - range.from),
        };
        self.shape
            .iter()
            .zip(&self.cause.pattern().shape)
            .map(step)
            .collect()
    }

    /// The same with other shape numbers.
    pub fn shifted(&self, by: &[f64]) -> Form {
        let shape = self
            .shape
            .iter()
            .zip(by)
            .map(|(value, by)| value + by)
            .collect();
        Self {
            shape,
            ..self.clone()
        }
        .into()
    }

    /// Shapes around its own, closer with every level.
    fn shapes(&self, level: i32) -> Vec<Vec<f64>> {
        let around = |(value, range): (&f64, &ShapeRange)| {
            let step = libm::exp2(-f64::from(level));
            let [less, more] = match range.is_of_ratios() {
                true => [
                    value * libm::pow(RATIO, -step),
                    value * libm::pow(RATIO, step),
                ],
                false => [-STEP, STEP].map(|share| value + share * step * (range.to - range.from)),
            };
            [*value, less.max(range.from), more.min(range.to)]
        };
        let each = self
            .shape
            .iter()
            .zip(&self.cause.pattern().shape)
            .map(around);
        let all = each.fold(vec![Vec::new()], |all, choices| {
            let with = |begun: &Vec<f64>, choice: f64| {
                begun.iter().copied().chain([choice]).collect::<Vec<f64>>()
            };
            all.iter()
                .flat_map(|begun| choices.map(|choice| with(begun, choice)))
                .collect()
        });
        all.into_iter()
            .filter(|shape| *shape != self.shape)
            .collect()
    }
}

/// The first step of a shape number as a share of its range, and as a ratio.
const STEP: f64 = 0.1;
const RATIO: f64 = 1.7;

impl PartialEq for DeclaredForm {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.cause, other.cause)
            && self.motion == other.motion
            && self.shape == other.shape
    }
}

impl Placed for DeclaredForm {
    fn cause(&self) -> &'static Cause {
        self.cause.about()
    }

    fn place(&self) -> Place {
        self.motion.place()
    }

    /// Those of an arm that has all of its joints.
    fn variables(&self) -> Vec<Variable> {
        self.quantities()
            .iter()
            .filter_map(|quantity| self.variable(quantity, usize::MAX))
            .collect()
    }

    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec> {
        self.cause.pattern().numbers(self.motion, robot)
    }

    /// A row in which a law is no number is left alone by it.
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let laws = &self.cause.pattern().laws;
        let row = |quantity: &RowQuantity| {
            self.variable(quantity, robot.joints())?
                .value(0, robot, state)
        };
        for (k, law) in laws.iter().enumerate() {
            if let Some(value) = law
                .value(&self.shape, &row)
                .filter(|value| value.is_finite())
            {
                self.motion
                    .add(robot, state, (k, laws.len()), value, p, out);
            }
        }
    }

    fn needs_sight(&self) -> bool {
        matches!(self.motion, Motion::Instrument { .. })
    }

    fn missing(&self, _robot: &RobotModel, data: &Measurements) -> Option<String> {
        let moving = self
            .quantities()
            .iter()
            .any(|quantity| matches!(quantity.asked.1, Variable::Velocity { .. }));
        (moving && data.velocity.is_none()).then(|| "the recording has no joint velocities".into())
    }

    fn near(&self, _survey: &Survey, level: i32) -> Vec<Form> {
        self.shapes(level)
            .into_iter()
            .map(|shape| {
                Self {
                    shape,
                    ..self.clone()
                }
                .into()
            })
            .collect()
    }

    fn declared(&self) -> Option<&DeclaredForm> {
        Some(self)
    }

    fn shape_numbers(&self) -> Vec<(String, f64)> {
        self.cause
            .pattern()
            .names
            .iter()
            .cloned()
            .zip(self.shape.iter().copied())
            .collect()
    }

    fn body(&self) -> serde_json::Value {
        let declared = self.cause.declaration().clone();
        serde_json::json!(KeptForm {
            declared,
            motion: self.motion,
            shape: self.shape.clone()
        })
    }
}

//! A declared effect: as a cause next to those of the library, and as a form at a place with its shape numbers, which carries its declaration
//! wherever it is kept.

use super::declaration::{EffectDeclaration, ShapeRange};
use super::formula::Formula;
use super::pattern::{DeclarationFault, DeclaredPattern, combinations};
use super::quantity::RowQuantity;
use crate::effect::sentence::filled;
use crate::effect::summary::unit;
use crate::effect::{
    ArmState, Cause, Deflection, Form, Hypothesis, Motion, NumberSpec, OwnMotion, Place, Placed,
    Summary, Survey, Variable, figure,
};
use crate::robot::{Measurements, RobotModel};
use serde::de::Error as _;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A declared effect as a cause next to those of the library.
pub struct DeclaredCause {
    declaration: EffectDeclaration,
    pattern: DeclaredPattern,
}

/// The row of every declared effect in the table of causes: what differs is asked of the declaration, which each form has with it.
static DECLARED: Cause = Cause {
    motion: Some(OwnMotion {
        propose: |_| Vec::new(),
        sentence: Some(sentence),
        read: undeclared,
    }),
    ..Cause::PLAIN
};

/// What a declaration advises is asked for after what the library knows of its own causes.
const RANK: u8 = 9;

impl DeclaredCause {
    /// The cause that is declared. Fails with everything that is wrong with it.
    pub fn of(declaration: &EffectDeclaration) -> Result<Arc<Self>, Vec<DeclarationFault>> {
        let pattern = DeclaredPattern::of(declaration)?;
        Ok(Arc::new(Self {
            declaration: declaration.clone(),
            pattern,
        }))
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.declaration.name
    }

    /// What to measure that separates it from other causes, as the user says, with its rank.
    pub fn measure(&self) -> Option<(u8, &str)> {
        self.declaration
            .advice
            .as_deref()
            .map(|advice| (RANK, advice))
    }

    /// What the user wrote.
    pub fn declaration(&self) -> &EffectDeclaration {
        &self.declaration
    }

    /// What it costs a reader: the parts of its formulas and a coefficient each.
    pub fn price(&self) -> usize {
        self.pattern.laws.iter().map(|law| law.parts() + 1).sum()
    }

    /// Its formulas, parsed.
    pub fn pattern(&self) -> &DeclaredPattern {
        &self.pattern
    }
}

/// The sentence for a mechanic on a finding of a declared effect.
fn sentence(summary: &Summary) -> String {
    let Some(cause) = summary
        .forms
        .iter()
        .find_map(|form| form.declared())
        .map(|form| form.declaration())
    else {
        return String::new();
    };
    let per = cause
        .declaration
        .per
        .as_ref()
        .map(|per| format!(" per {per}"))
        .unwrap_or_default();
    let numbers: Vec<String> = (summary.parameters.iter())
        .map(|number| format!("{}{}{per}", figure(number.value, 1), unit(number)))
        .collect();
    let shape: Vec<(String, f64)> = summary
        .forms
        .iter()
        .flat_map(|form| form.shape_numbers())
        .collect();
    let known = |word: &str| match word {
        "place" => summary.place.to_string(),
        "value" => numbers.first().cloned().unwrap_or_default(),
        "values" => numbers.join(", "),
        other => shape
            .iter()
            .find(|(name, _)| name == other)
            .map_or_else(String::new, |(_, value)| figure(*value, 2)),
    };
    let text = match &cause.declaration.sentence {
        Some(sentence) => filled(sentence, &known),
        None => {
            let laws = cause.declaration.law.0.join("; ");
            format!(
                "{} errs as {} says, {laws}: {}",
                summary.place,
                cause.name(),
                known("values")
            )
        }
    };
    let ends = |(name, value): &(String, f64)| {
        let range = cause.declaration.shape.get(name)?;
        (*value <= range.from || *value >= range.to)
            .then(|| format!("; {name} ends at its bound {value}"))
    };
    let ends: Vec<String> = shape.iter().filter_map(ends).collect();
    format!("{text}{}", ends.concat())
}

/// A form of a declared effect is read with its declaration, not by its name.
fn undeclared(_: &serde_json::Value) -> serde_json::Result<Form> {
    Err(serde_json::Error::custom(
        "a declared effect without its declaration",
    ))
}

/// The laws of a declaration at one place.
#[derive(Clone)]
pub struct DeclaredForm {
    cause: Arc<DeclaredCause>,
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
    pub fn hypotheses(cause: &Arc<DeclaredCause>, survey: &Survey) -> Vec<Hypothesis> {
        if Self::lacking(cause, survey).is_some() {
            return Vec::new();
        }
        let pattern = &cause.pattern;
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
                    cause: cause.clone(),
                    motion,
                    shape: shape.clone(),
                };
                if form
                    .quantities()
                    .iter()
                    .all(|quantity| form.variable(quantity, survey.joints()).is_some())
                {
                    out.push(Hypothesis {
                        positive: cause.declaration.positive,
                        ..Hypothesis::new(form, tried)
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
        let quantities = cause.pattern.laws.iter().flat_map(Formula::quantities);
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
        let pattern = &cause.pattern;
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
    pub fn declaration(&self) -> &Arc<DeclaredCause> {
        &self.cause
    }

    fn quantities(&self) -> Vec<RowQuantity> {
        let mut out: Vec<RowQuantity> = Vec::new();
        for quantity in self.cause.pattern.laws.iter().flat_map(Formula::quantities) {
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
            .zip(&self.cause.pattern.shape)
            .map(step)
            .collect()
    }

    /// The same with other shape numbers.
    pub fn shifted(&self, by: &[f64]) -> Form {
        let shifted = self.shape.iter().zip(by).map(|(value, by)| value + by);
        self.with(shifted.collect())
    }

    fn with(&self, shape: Vec<f64>) -> Form {
        Form::from(Self {
            shape,
            ..self.clone()
        })
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
            vec![*value, less.max(range.from), more.min(range.to)]
        };
        let each = self.shape.iter().zip(&self.cause.pattern.shape).map(around);
        let others = combinations(each).into_iter();
        others.filter(|shape| *shape != self.shape).collect()
    }
}

/// The first step of a shape number as a share of its range, and as a ratio.
const STEP: f64 = 0.1;
const RATIO: f64 = 1.7;

impl PartialEq for DeclaredForm {
    fn eq(&self, other: &Self) -> bool {
        self.cause.declaration == other.cause.declaration
            && self.motion == other.motion
            && self.shape == other.shape
    }
}

impl Placed for DeclaredForm {
    fn cause(&self) -> &'static Cause {
        &DECLARED
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
        self.cause.pattern.numbers(self.motion, robot)
    }

    /// A row in which a law is no number is left alone by it.
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let laws = &self.cause.pattern.laws;
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
            .map(|shape| self.with(shape))
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

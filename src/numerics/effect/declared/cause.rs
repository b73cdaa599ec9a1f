//! A declared effect as a cause beside those of the library.
//!
//! Causes live as long as the program, as those of the library do: each declaration is kept once, by its content.

use super::check::DeclarationFault;
use super::declaration::EffectDeclaration;
use super::pattern::DeclaredPattern;
use super::seat::Seat;
use crate::effect::sentence::filled;
use crate::effect::{Cause, Form, Measure, OwnMotion, Place, Summary, figure};
use serde::de::Error as _;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

/// A declared effect, understood.
pub struct DeclaredCause {
    about: &'static Cause,
    declaration: EffectDeclaration,
    pattern: DeclaredPattern,
}

/// Every declaration so far, by its content.
static KEPT: Mutex<BTreeMap<String, &'static DeclaredCause>> = Mutex::new(BTreeMap::new());

/// What a declaration advises is asked for after what the library knows of its own causes.
const RANK: u8 = 9;

impl DeclaredCause {
    /// The cause that is declared. Fails with everything that is wrong with it.
    pub fn of(declaration: &EffectDeclaration) -> Result<&'static Self, Vec<DeclarationFault>> {
        let pattern = DeclaredPattern::of(declaration)?;
        let content = serde_json::to_string(declaration).expect("numbers and texts serialise");
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(kept
            .entry(content)
            .or_insert_with(|| Box::leak(Box::new(Self::new(declaration.clone(), pattern)))))
    }

    fn new(declaration: EffectDeclaration, pattern: DeclaredPattern) -> Self {
        let kept = |text: String| -> &'static str { Box::leak(text.into_boxed_str()) };
        let stated = |text: &Option<String>, otherwise: &str| {
            kept(text.clone().unwrap_or_else(|| otherwise.into()))
        };
        let columns: BTreeSet<&str> = pattern
            .laws
            .iter()
            .flat_map(|law| law.quantities())
            .filter_map(|quantity| quantity.needs())
            .collect();
        let columns: Vec<&str> = columns.into_iter().collect();
        let needs = if columns.is_empty() {
            "-".to_string()
        } else {
            columns.join(", ")
        };
        let size = match (declaration.size, &declaration.unit) {
            (Some(size), Some(unit)) => format!("{size} {unit}"),
            (Some(size), None) => size.to_string(),
            (None, _) => "any".into(),
        };
        Self {
            about: Box::leak(Box::new(Cause {
                name: kept(declaration.name.clone()),
                place: kept(declaration.place.clone()),
                formula: kept(declaration.law.0.join("; ")),
                size: kept(size),
                confounded: stated(&declaration.confounded, "-"),
                needs: stated(&declaration.needs, &needs),
                of_the_measurement: pattern.seat == Seat::Fixed(Place::Tracker),
                measure: declaration.advice.clone().map(|advice| Measure {
                    rank: RANK,
                    advice: kept(advice),
                }),
                motion: Some(OwnMotion {
                    propose: |_| Vec::new(),
                    sentence: Some(sentence),
                    read: undeclared,
                }),
                ..Cause::PLAIN
            })),
            declaration,
            pattern,
        }
    }

    /// Its row of the table of causes.
    pub fn about(&self) -> &'static Cause {
        self.about
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.about.name
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

/// What a mechanic is told of a finding that a declared effect is.
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
        .map(|number| {
            let unit = if number.unit == "1" {
                String::new()
            } else {
                format!(" {}", number.unit)
            };
            format!("{}{unit}{per}", figure(number.value, 1))
        })
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
            let laws = cause.about.formula;
            format!(
                "{} errs as {} says, {laws}: {}",
                summary.place,
                cause.about.name,
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

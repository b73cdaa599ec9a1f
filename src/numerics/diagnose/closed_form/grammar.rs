//! The formulas that are tried for an error without a name: of one variable, or products of functions of two.

use crate::criteria::closed_form::{ORDER, SPACING, TURNS};
use crate::effect::{EffectDeclaration, Laws, ShapeRange, Starts, Variable};
use std::collections::BTreeMap;

/// A variable by its name in formulas.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NamedVariable {
    pub(crate) name: String,
    pub(crate) is_angle: bool,
    /// Whether it is the position of a joint that slides.
    pub(crate) is_prismatic: bool,
    /// Over the fitted rows, rounded outwards; of angles a turn to either side.
    pub(crate) range: [f64; 2],
}

impl NamedVariable {
    /// The variable of a law at a joint; `None` if it has no name in formulas or never varies. `slides`: which joints do not turn.
    pub(crate) fn of(
        variable: Variable,
        joint: usize,
        [low, high]: [f64; 2],
        slides: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let name = variable.in_formulas(joint)?;
        let is_prismatic = matches!(variable, Variable::Angle { joint } if slides(joint));
        let is_angle = matches!(variable, Variable::Angle { .. }) && !is_prismatic;
        let range = if is_angle {
            [-TURN, TURN]
        } else {
            [rounded(low, f64::floor), rounded(high, f64::ceil)]
        };
        (range[0] < range[1]).then_some(Self {
            name,
            is_angle,
            is_prismatic,
            range,
        })
    }
}

/// rad; no joint of an arm goes further.
const TURN: f64 = 6.4;

/// To one digit, outwards.
fn rounded(value: f64, direction: fn(f64) -> f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let scale = libm::pow(10.0, libm::floor(libm::log10(value.abs())));
    direction(value / scale) * scale
}

/// A shape number by its name.
type ShapeNumber = (&'static str, ShapeRange);

/// A formula before its place is known.
struct Sketch {
    label: &'static str,
    laws: Vec<String>,
    shape: Vec<ShapeNumber>,
}

/// Declarations of all formulas at `place` of one variable, or of two; their coefficients are in `unit`.
pub(super) fn declarations(
    place: &str,
    unit: &str,
    variables: &[NamedVariable],
) -> Vec<EffectDeclaration> {
    let sketches = match variables {
        [one] => one_variable(one),
        [first, second] => two_variables(first, second),
        _ => Vec::new(),
    };
    let subject: Vec<String> = variables
        .iter()
        .map(|variable| variable.name.replace(['(', ')', '.'], "_"))
        .collect();
    sketches
        .into_iter()
        .map(|sketch| declaration((place, unit), &subject.join("_and_"), sketch))
        .collect()
}

fn declaration((place, unit): (&str, &str), subject: &str, sketch: Sketch) -> EffectDeclaration {
    let formulas = sketch.laws.join("; ");
    EffectDeclaration {
        name: format!("{}_of_{subject}", sketch.label),
        place: place.into(),
        sentence: Some(format!(
            "{{place}} errs by {{values}} times {formulas}{}",
            shape_text(&sketch.shape)
        )),
        law: Laws(sketch.laws),
        shape: sketch
            .shape
            .into_iter()
            .map(|(name, range)| (name.to_string(), range))
            .collect::<BTreeMap<_, _>>(),
        unit: Some(unit.into()),
        ..EffectDeclaration::default()
    }
}

/// The shape numbers, to be filled in.
fn shape_text(shape: &[(&str, ShapeRange)]) -> String {
    let each: Vec<String> = shape
        .iter()
        .map(|(name, _)| format!("{name} = {{{name}}}"))
        .collect();
    if each.is_empty() {
        String::new()
    } else {
        format!(", {}", each.join(", "))
    }
}

fn span(variable: &NamedVariable) -> f64 {
    variable.range[1] - variable.range[0]
}

/// Where something happens.
fn centre(variable: &NamedVariable) -> ShapeNumber {
    let [from, to] = variable.range;
    let steps = match variable.is_angle {
        true => (span(variable) / *SPACING) as usize,
        false => 12,
    };
    let at = |k: usize| from + span(variable) * k as f64 / steps as f64;
    let start = Starts((1..steps).map(|k| (1e3 * at(k)).round() / 1e3).collect());
    ("centre", ShapeRange { from, to, start })
}

/// Over how much.
fn width(variable: &NamedVariable) -> ShapeNumber {
    let shares = match variable.is_angle {
        true => [0.02, 0.06],
        false => [0.05, 0.2],
    };
    let (from, to) = (0.004 * span(variable), span(variable));
    let start = Starts(shares.map(|share| share * span(variable)).to_vec());
    ("width", ShapeRange { from, to, start })
}

/// How often.
fn order(variable: &NamedVariable) -> ShapeNumber {
    let (unit, last) = match variable.is_angle {
        true => (1.0, *ORDER),
        false => (std::f64::consts::TAU / span(variable), *TURNS),
    };
    let start = (1..=4 * last as usize)
        .map(|k| 0.25 * k as f64)
        .filter(|k| *k >= 0.5 && *k < last)
        .map(|k| k * unit);
    let (from, to) = (0.4 * unit, last * unit);
    let start = Starts(start.step_by(2).collect());
    ("order", ShapeRange { from, to, start })
}

fn one_variable(variable: &NamedVariable) -> Vec<Sketch> {
    let (v, [low, high]) = (&variable.name, variable.range);
    let mut out = Vec::new();
    let mut add = |label, laws: &[String], shape: &[fn(&NamedVariable) -> ShapeNumber]| {
        out.push(Sketch {
            label,
            laws: laws.to_vec(),
            shape: shape.iter().map(|number| number(variable)).collect(),
        });
    };
    add("line", std::slice::from_ref(v), &[]);
    add("square", &[format!("{v}^2")], &[]);
    add("cube", &[format!("{v}^3")], &[]);
    add("cubic", &[format!("{v}^2"), format!("{v}^3")], &[]);
    add("growing_square", &[format!("{v} * abs({v})")], &[]);
    add("root", &[format!("sqrt(abs({v}))")], &[]);
    add("kink", &[format!("abs({v} - centre)")], &[centre]);
    add("step", &[format!("step({v} - centre)")], &[centre]);
    let rise = format!("tanh(({v} - centre) / width)");
    add("rise", &[rise], &[centre, width]);
    let bump = format!("exp(-(({v} - centre) / width)^2)");
    add("bump", &[bump], &[centre, width]);
    let [sine, cosine] = ["sin", "cos"].map(|wave| format!("{wave}(order * {v})"));
    add("wave", &[sine, cosine], &[order]);
    if low < 0.0 && high > 0.0 {
        add("side", &[format!("sign({v})")], &[]);
    }
    if !variable.is_angle {
        add("decay", &[format!("exp(-({v} - {low}) / width)")], &[width]);
        add("rush", &[format!("exp(({v} - {high}) / width)")], &[width]);
    }
    out
}

/// Functions of one factor: a label and their formulas.
fn factors(variable: &NamedVariable) -> Vec<(&'static str, Vec<String>)> {
    let v = &variable.name;
    let mut out = vec![
        ("", vec![v.clone()]),
        ("square", vec![format!("{v}^2")]),
        ("size", vec![format!("abs({v})")]),
    ];
    if variable.range[0] < 0.0 && variable.range[1] > 0.0 {
        out.push(("side", vec![format!("sign({v})")]));
    }
    if variable.is_angle {
        out.push(("turn", vec![format!("sin({v})"), format!("cos({v})")]));
    }
    out
}

fn two_variables(first: &NamedVariable, second: &NamedVariable) -> Vec<Sketch> {
    let products = |a: &[String], b: &[String]| -> Vec<String> {
        a.iter()
            .flat_map(|a| b.iter().map(move |b| format!("{a} * {b}")))
            .collect()
    };
    let mut out = Vec::new();
    for (label, a) in factors(first) {
        for (other, b) in factors(second) {
            let label = match (label, other) {
                ("", "") => "product",
                ("", other) | (other, "") => match other {
                    "square" => "product_with_square",
                    "size" => "product_with_size",
                    "side" => "product_with_side",
                    _ => "product_with_turn",
                },
                ("turn", "turn") => "product_of_turns",
                _ => "mixed_product",
            };
            out.push(Sketch {
                label,
                laws: products(&a, &b),
                shape: Vec::new(),
            });
        }
    }
    for (one, other) in [(first, second), (second, first)] {
        let (v, w) = (&one.name, &other.name);
        if one.is_angle {
            out.push(Sketch {
                label: "scaled_wave",
                laws: ["sin", "cos"]
                    .map(|wave| format!("{wave}(order * {v}) * {w}"))
                    .to_vec(),
                shape: vec![order(one)],
            });
        }
        out.push(Sketch {
            label: "scaled_bump",
            laws: vec![format!("exp(-(({v} - centre) / width)^2) * {w}")],
            shape: vec![centre(one), width(one)],
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::DeclaredCause;

    #[test]
    fn every_formula_is_a_declaration_without_a_fault() {
        let named = |variable, range| {
            NamedVariable::of(variable, 2, range, |joint| joint == 0).expect("a name")
        };
        let angle = named(Variable::Angle { joint: 2 }, [-1.0, 1.0]);
        let load = named(Variable::Load { joint: 2 }, [-113.0, 87.0]);
        let other = named(Variable::Angle { joint: 4 }, [0.0, 1.0]);
        assert_eq!([&angle.name, &load.name, &other.name], ["q", "load", "q5"]);
        assert_eq!(load.range, [-200.0, 90.0]);
        for variables in [
            vec![angle.clone()],
            vec![load.clone()],
            vec![angle.clone(), load],
            vec![angle, other],
        ] {
            let all = declarations("joint 3", "rad", &variables);
            assert!(all.len() > 10);
            for declaration in all {
                if let Err(faults) = DeclaredCause::of(&declaration) {
                    panic!("{declaration:?}: {faults:?}");
                }
            }
        }
    }

    #[test]
    fn a_rail_errs_by_millimetres_over_its_own_travel() {
        let rail = NamedVariable::of(Variable::Angle { joint: 0 }, 0, [0.012, 1.987], |joint| {
            joint == 0
        })
        .expect("a name");
        assert_eq!(
            (
                rail.name.as_str(),
                rail.is_angle,
                rail.is_prismatic,
                rail.range
            ),
            ("q", false, true, [0.01, 2.0])
        );
        let all = declarations("joint 1", "mm", &[rail]);
        assert!(
            all.iter()
                .any(|declaration| declaration.name == "bump_of_q")
        );
        for declaration in all {
            assert_eq!(declaration.unit.as_deref(), Some("mm"));
            let within = declaration
                .shape
                .get("centre")
                .is_none_or(|centre| (centre.from, centre.to) == (0.01, 2.0));
            assert!(
                within && DeclaredCause::of(&declaration).is_ok(),
                "{declaration:?}"
            );
        }
    }
}

//! A law that a user has declared as a cause next to those of the library.

use super::{ColumnTorque, PLAIN, ShapeSpan, TorqueCause, TorqueForm, plain, span};
use crate::effect::{DeclaredTorque, ShapeRange, Variable};
use crate::scene::DynamicScene;
use std::sync::Arc;

/// The cause of every declared law: what differs from law to law is asked of the law, which each form has with it.
pub(crate) static DECLARED: TorqueCause = TorqueCause {
    follows,
    forms: |_, _| Vec::new(),
    spans,
    torque: ColumnTorque::Row(|column, row| {
        let (form, scene) = (column.form, column.scene);
        let place = (form.joint(), scene.joints());
        let says = |variable| scene.says(variable, row);
        let law = form.law.as_ref();
        let value = law.and_then(|law| law.value(column.column, &form.shape, place, &says));
        value.unwrap_or(0.0)
    }),
    parameters: |form, fitted| {
        let names = form.coefficient_names().into_iter().zip(fitted);
        let coefficients = names.map(|((name, unit), number)| plain(&name, *number, unit));
        coefficients.chain(form.shape_parameters()).collect()
    },
    statement: |form, fitted, unit| {
        let values: Vec<f64> = fitted.iter().map(|number| number.value).collect();
        let law = form.law.as_ref();
        law.map_or_else(String::new, |law| {
            law.statement(form.place, &values, &form.shape, unit("Nm"))
        })
    },
    ..PLAIN
};

/// Forms of a law at every joint whose rows say all that it asks.
pub(crate) fn declared(law: &Arc<DeclaredTorque>, scene: &DynamicScene) -> Vec<TorqueForm> {
    let is_said = |joint: &usize| {
        let asked = law.variables(*joint, scene.joints());
        asked.is_some_and(|asked| asked.iter().all(|one| scene.says(*one, 0).is_some()))
    };
    let joints = law.joints(scene.joints()).into_iter().filter(is_said);
    let starts = law.starts();
    let at_joint = |joint| {
        let form = TorqueForm {
            law: Some(law.clone()),
            ..TorqueForm::at_joint(&DECLARED, joint, law.laws())
        };
        let starts = starts.iter();
        starts.map(move |start| form.clone().shaped(start))
    };
    joints.flat_map(at_joint).collect()
}

fn spans(form: &TorqueForm) -> Vec<ShapeSpan> {
    let shape = form.law.iter().flat_map(|law| law.shape());
    let one = |(index, (name, range)): (usize, (&str, &ShapeRange))| ShapeSpan {
        name: name.to_string().into(),
        index,
        by_ratio: range.is_of_ratios(),
        ..span("", "1", [range.from, range.to])
    };
    shape.enumerate().map(one).collect()
}

/// The first variable of the law.
fn follows(form: &TorqueForm) -> &'static str {
    let law = form.law.as_ref();
    let asked = law.and_then(|law| law.variables(form.joint(), usize::MAX));
    let first = asked.into_iter().flatten().next();
    match first {
        Some(Variable::Angle { joint }) if joint == form.joint() => "own angle",
        Some(Variable::Angle { .. }) => "other angle",
        Some(Variable::Velocity { .. }) => "own speed",
        Some(Variable::Load { .. }) => "load",
        Some(Variable::Temperature) => "temperature",
        Some(Variable::Time) => "time",
        _ => "constant",
    }
}

//! A law that a user has declared as a cause next to those of the library.

use super::{CoefficientName, ColumnTorque, PLAIN, ShapeSpan, TorqueCause, TorqueForm, span};
use crate::effect::{DeclaredTorque, ShapeRange, Variable};
use crate::scene::DynamicScene;
use std::sync::{Mutex, PoisonError};

/// Every cause so far: they live as long as the program, as those of the library do, each kept once.
static KEPT: Mutex<Vec<&'static TorqueCause>> = Mutex::new(Vec::new());

/// The cause of a law.
pub(crate) fn declared(law: &DeclaredTorque) -> &'static TorqueCause {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let known = kept.iter().find(|cause| cause.declared == Some(law));
    if let Some(cause) = known {
        return cause;
    }
    let cause = cause_of(Box::leak(Box::new(law.clone())));
    kept.push(cause);
    cause
}

fn cause_of(law: &'static DeclaredTorque) -> &'static TorqueCause {
    let name = |k: usize| -> CoefficientName {
        let text = match law.laws() {
            1 => "coefficient".to_string(),
            _ => format!("coefficient_{}", k + 1),
        };
        (Box::leak(text.into_boxed_str()), "Nm")
    };
    let names: Vec<CoefficientName> = (0..law.laws()).map(name).collect();
    let declaration = law.declaration();
    Box::leak(Box::new(TorqueCause {
        name: declaration.name.as_str(),
        follows,
        declared: Some(law),
        coefficients: names.leak(),
        positive: declaration.positive,
        of_rigid: law.asks_load(),
        lengths: vec![law.shape().count()].leak(),
        forms,
        spans,
        torque: ColumnTorque::Row(|column, row| {
            let (form, scene) = (column.form, column.scene);
            let place = (form.joint(), scene.joints());
            let says = |variable| scene.says(variable, row);
            let law = form.cause.declared;
            let value = law.and_then(|law| law.value(column.column, &form.shape, place, &says));
            value.unwrap_or(0.0)
        }),
        statement: |form, fitted, unit| {
            let values: Vec<f64> = fitted.iter().map(|number| number.value).collect();
            let law = form.cause.declared;
            law.map_or_else(String::new, |law| {
                law.statement(form.place, &values, &form.shape, unit("Nm"))
            })
        },
        ..PLAIN
    }))
}

/// Forms at every joint whose rows say all that the law asks.
fn forms(cause: &'static TorqueCause, scene: &DynamicScene) -> Vec<TorqueForm> {
    let Some(law) = cause.declared else {
        return Vec::new();
    };
    let is_said = |joint: &usize| {
        let asked = law.variables(*joint, scene.joints());
        asked.is_some_and(|asked| asked.iter().all(|one| scene.says(*one, 0).is_some()))
    };
    let joints = law.joints(scene.joints()).into_iter().filter(is_said);
    let starts = law.starts();
    joints
        .flat_map(|joint| {
            let starts = starts.iter();
            starts.map(move |start| TorqueForm::at_joint(cause, joint, law.laws()).shaped(start))
        })
        .collect()
}

fn spans(form: &TorqueForm) -> Vec<ShapeSpan> {
    let shape = form.cause.declared.into_iter().flat_map(|law| law.shape());
    let one = |(index, (name, range)): (usize, (&'static str, &ShapeRange))| ShapeSpan {
        index,
        by_ratio: range.is_of_ratios(),
        ..span(name, "1", [range.from, range.to])
    };
    shape.enumerate().map(one).collect()
}

/// The first variable of the law.
fn follows(form: &TorqueForm) -> &'static str {
    let law = form.cause.declared;
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

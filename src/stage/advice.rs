//! What a person could measure to see what these data do not show, in words.

use crate::estimate::{ParameterStatus, Remedy, Session, remedies};
use crate::stage::Context;
use std::collections::BTreeMap;

/// Sentences for the remarks of redundant and unseen parameters, by name; the measurements that would show most are noted.
pub fn advice(context: &Context, session: &Session) -> BTreeMap<String, String> {
    let Session {
        data,
        rows,
        model,
        fitted,
    } = *session;
    let found = remedies(model, data, rows, fitted);
    let last = model.robot.joints();
    let mut counts: BTreeMap<&Remedy, usize> = BTreeMap::new();
    let mut sentences = BTreeMap::new();
    for (k, remedy) in &found {
        *counts.entry(remedy).or_default() += 1;
        let redundant = matches!(fitted.statuses[*k], ParameterStatus::Redundant(_));
        let sentence = match measure(remedy, last) {
            Some(measure) => format!("{measure} would show it"),
            None if redundant => {
                "no measured point can: they move every point in the same way".into()
            }
            None => continue,
        };
        sentences.insert(model.stack.specs()[*k].name.clone(), sentence);
    }
    for (remedy, count) in counts {
        if let Some(measure) = measure(remedy, last) {
            let what = if count == 1 {
                "one parameter".into()
            } else {
                format!("{count} parameters")
            };
            context.note(format!(
                "{measure} would show {what} that these data do not"
            ));
        }
    }
    sentences
}

/// The measurement as a noun, if there is one.
fn measure(remedy: &Remedy, last: usize) -> Option<String> {
    match remedy {
        Remedy::Nothing => None,
        Remedy::Payload => Some("poses with and without the payload".into()),
        Remedy::SecondTarget => Some(format!("a second target off the axis of joint {last}")),
        Remedy::Move(joints) => Some(match joints.as_slice() {
            [] => "poses all over the joints' ranges".into(),
            [joint] => format!("moving joint {}", joint + 1),
            [some @ .., joint] => {
                let some: Vec<String> = some.iter().map(|joint| (joint + 1).to_string()).collect();
                format!("moving joints {} and {}", some.join(", "), joint + 1)
            }
        }),
    }
}

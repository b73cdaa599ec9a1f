//! A formula that a diagnosis proposes, as a file of an effect of one's own.

use crate::effect::{EffectDeclaration, ShapeRange};
use crate::error::{Error, Result};
use serde::Serialize;

/// The file's text; `heading` says where it is from.
pub(super) fn declared_in_yaml(declaration: &str, heading: &str) -> Result<String> {
    let unreadable =
        |error: serde_json::Error| Error::data("table forms", format!("`{declaration}`: {error}"));
    let declared: EffectDeclaration = serde_json::from_str(declaration).map_err(unreadable)?;
    let mut lines = vec![
        format!("# {heading}."),
        "# `with: {effects: [this file]}` below `uses: diagnose` tries it; rename it once its cause is known.".into(),
        "calib_effect: 1".into(),
        format!("name: {}", json(&declared.name)),
        format!("place: {}", json(&declared.place)),
    ];
    lines.extend(
        declared
            .motion
            .iter()
            .map(|motion| format!("motion: {}", json(motion))),
    );
    match &declared.law.0[..] {
        [one] => lines.push(format!("law: {}", json(one))),
        several => {
            lines.push("law:".into());
            lines.extend(several.iter().map(|law| format!("  - {}", json(law))));
        }
    }
    if !declared.shape.is_empty() {
        lines.push("shape:".into());
        lines.extend(
            declared
                .shape
                .iter()
                .map(|(name, range)| format!("  {name}: {}", bounds(range))),
        );
    }
    lines.extend(
        declared
            .unit
            .iter()
            .map(|unit| format!("unit: {}", json(unit))),
    );
    lines.extend(
        declared
            .sentence
            .iter()
            .map(|sentence| format!("sentence: {}", json(sentence))),
    );
    Ok(lines.join("\n") + "\n")
}

fn bounds(range: &ShapeRange) -> String {
    format!(
        "{{from: {}, to: {}, start: {}}}",
        range.from,
        range.to,
        json(&range.start)
    )
}

/// JSON's texts and lists are YAML's.
fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("numbers and texts serialise")
}

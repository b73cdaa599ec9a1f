//! The proposed formula of a finding without a name as a file of an effect of one's own.

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
        line("name", &declared.name),
        line("place", &declared.place),
    ];
    lines.extend(declared.motion.iter().map(|motion| line("motion", motion)));
    match &declared.law.0[..] {
        [one] => lines.push(line("law", one)),
        several => {
            lines.push("law:".into());
            lines.extend(several.iter().map(|law| format!("  - {}", json(law))));
        }
    }
    if !declared.shape.is_empty() {
        lines.push("shape:".into());
    }
    let shape = declared.shape.iter();
    lines.extend(shape.map(|(name, range)| format!("  {name}: {}", bounds(range))));
    lines.extend(declared.unit.iter().map(|unit| line("unit", unit)));
    lines.extend(declared.sentence.iter().map(|text| line("sentence", text)));
    Ok(lines.join("\n") + "\n")
}

fn line(key: &str, value: &impl Serialize) -> String {
    format!("{key}: {}", json(value))
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

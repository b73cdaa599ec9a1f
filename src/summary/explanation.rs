//! Why a stage ran, or did not.

use super::run::word;
use crate::audit::Explanation;
use crate::pipeline::StageStatus;

/// Why a stage ran, as text.
pub fn explanation(explanation: &Explanation) -> String {
    let stage = &explanation.stage;
    let mut text = format!("{} in run {}: {}", stage.id, explanation.run, word(stage));
    match (stage.status, &stage.reason) {
        (StageStatus::Cached, _) => {
            text.push_str(", all that it depends on was the same as in an earlier run\n")
        }
        (_, Some(reason)) => text.push_str(&format!(", because: {reason}\n")),
        (_, None) => text.push('\n'),
    }
    let Some(before) = &explanation.before else {
        return text + "no earlier run of this pipeline had this stage\n";
    };
    if explanation.changes.is_empty() {
        return text + &format!("nothing that it depends on changed since run {before}\n");
    }
    text.push_str(&format!("since run {before}:\n"));
    for change in &explanation.changes {
        let writer = explanation
            .writers
            .iter()
            .find(|(port, _)| change.what == "input" && *port == change.name);
        let writer = writer.map_or_else(String::new, |(_, from)| format!(", written by {from}"));
        let value = |value: &str| {
            let cut: String = value.chars().take(60).collect();
            // Of hashes the beginning says enough.
            let hash = value.len() == 64 && value.chars().all(|c| c.is_ascii_hexdigit());
            if hash {
                value[..12].to_string()
            } else if cut.len() < value.len() {
                format!("{cut}…")
            } else {
                cut
            }
        };
        text.push_str(&format!(
            "  {} {}: {} -> {}{writer}\n",
            change.what,
            change.name,
            value(&change.before),
            value(&change.now)
        ));
    }
    text
}
